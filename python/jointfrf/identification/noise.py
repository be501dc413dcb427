"""Noise of measured FRFs for a fit: given by the user, estimated, or assumed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import is_long, line_slices, spread_lines
from jointfrf.frf.calibration import CalibrationErrors, calibration_errors
from jointfrf.frf.cross_axis import CrossAxis
from jointfrf.frf.entry_groups import ZERO, entry_groups
from jointfrf.frf.moving_mass import MovingMass, found_mass, given_mass
from jointfrf.frf.noise_model import NoiseModel, found_noise
from jointfrf.frf.noise_parts import noise_parts
from jointfrf.frf.quantiles import medians
from jointfrf.frf.setups import SetUps
from jointfrf.frf.smoothing import OrderSearch, SmoothFrfs, near_squares, smoothed_in_pieces
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_number, as_real, check_type

__all__ = [
    "KnownNoise",
    "NoiseOptions",
    "SmoothedFrfs",
    "noise_about",
    "noise_of_channels",
    "noise_of_matrix",
    "without_mass",
]

#: Relative noise if neither the data nor the user give one: the level of the residual replaces it.
_ASSUMED_LEVEL = 0.01
#: Distance of smooth from measured FRFs, in standard deviations of the noise, beyond which they are not used on a line.
_MISSED = 3.0
#: Relative noise below this is rounding.
_LEAST_LEVEL = 1e-7
#: Least size of FRFs of single channels, relative to their largest line, so that their noise is not zero.
_LEAST_SIZE = 1e-6
_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class NoiseOptions:
    """Options on the noise, as in `identify`, `identify_model` and `estimate_noise`."""

    noise: float | StatedNoise | ArrayLike | None = None
    coherence: ArrayLike | None = None
    averages: float | None = None
    like: NoiseModel | SmoothFrfs | None = None
    setups: SetUps | None = None
    sensor_mass: float | None = 0.0

    def on_lines(self, kept: NDArray[np.bool_], shape: tuple[int, ...]) -> NoiseOptions:
        """Return the options for some of the lines of FRFs of a shape; an array of another shape raises an error."""
        found = self
        if self.coherence is not None:
            found = replace(found, coherence=as_real("coherence", self.coherence, shape)[kept])
        if self._variances is not None:
            found = replace(found, noise=as_real("noise", self._variances, shape)[kept])
        if self.setups is not None:
            check_type("setups", self.setups, SetUps)
            self.setups.check_fits(shape)
            found = replace(found, setups=self.setups.on_lines(kept))
        return found

    def calibration(self, freq: FloatArray, h: ComplexArray, *, reciprocal: bool) -> CalibrationErrors | None:
        """Return errors that are smooth over frequency, if the FRFs of these lines show any."""
        if not reciprocal and self.setups is None:
            return None
        return calibration_errors(freq, h, self.setups, reciprocal=reciprocal)

    @property
    def _variances(self) -> ArrayLike | None:
        """The given variance of each FRF."""
        if self.noise is None or isinstance(self.noise, StatedNoise):
            return None
        return self.noise if np.ndim(self.noise) > 0 else None

    def stated(self) -> StatedNoise | None:
        """Return the given parts of the noise; check that no further option is given."""
        if self.noise is not None and (self.coherence is not None or self.averages is not None):
            raise ValueError("coherence and averages are used where noise is not given: leave one of them out")
        if isinstance(self.noise, StatedNoise):
            return self.noise
        if self.noise is None or self._variances is not None:
            return None
        level = as_number("noise", self.noise)
        if level <= 0:
            raise ValueError(f"noise must be positive, not {level:g}")
        return StatedNoise(level)

    def variance(self, shape: tuple[int, ...], shown: NDArray[np.bool_]) -> FloatArray:
        """Return the given variances; positive for the FRFs that were measured, shape (n_o, n_i)."""
        assert self._variances is not None
        variance = as_real("noise", self._variances, shape)
        if not (variance[:, shown] > 0).all():
            raise ValueError("noise must contain positive variances: E|e|^2 of each FRF that was measured")
        return variance


@dataclass(frozen=True)
class KnownNoise:
    """Noise of the FRFs for a fit.

    Attributes
    ----------
    level : float
        Median of the noise relative to the FRFs.
    inflation : float
        Factor by which correlation between lines increases the variance of a mean.
    is_assumed : bool
        Whether the level is only a guess, to be replaced by the level of the residual.
    outlying : ndarray of int
        Lines whose noise is far above the noise of all further lines.
    model : NoiseModel, optional
        Noise of the channels, if estimated from their FRFs; not for long sweeps.
    is_given : bool
        Whether the user gave the noise.
    stated : StatedNoise, optional
        Noise that the user gave by its parts.
    smooth : SmoothFrfs, optional
        Smooth FRFs by the noise that the user gave; not for long sweeps.
    calibration : CalibrationErrors, optional
        Errors of the FRFs that are smooth over frequency, if h_pq and h_qp show any.
    mass : MovingMass, optional
        Mass of a sensor that moves, which was removed from the FRFs.
    cross_axis : CrossAxis, optional
        Shares of other joint DOFs in the channels, whose differences were removed from the FRFs.
    """

    level: float
    inflation: float
    is_assumed: bool
    outlying: NDArray[np.intp]
    model: NoiseModel | None = None
    is_given: bool = False
    stated: StatedNoise | None = None
    smooth: SmoothFrfs | None = None
    calibration: CalibrationErrors | None = None
    mass: MovingMass | None = None
    cross_axis: CrossAxis | None = None

    @property
    def like(self) -> NoiseModel | SmoothFrfs | None:
        """Noise with which fits of further realisations start."""
        return self.model or self.smooth

    @classmethod
    def given(
        cls,
        level: float,
        calibration: CalibrationErrors | None = None,
        smooth: SmoothFrfs | None = None,
        stated: StatedNoise | None = None,
    ) -> KnownNoise:
        """Return noise of a level that the user gave."""
        none = np.empty(0, np.intp)
        return cls(level, 1.0, False, none, is_given=True, stated=stated, smooth=smooth, calibration=calibration)

    @classmethod
    def found(cls, model: NoiseModel) -> KnownNoise:
        """Return noise estimated from the FRFs; assumed if they do not show it, or if it is rounding."""
        is_assumed = model.source == "none" or model.level < _LEAST_LEVEL
        level = _ASSUMED_LEVEL if is_assumed else model.level
        return cls(level, model.inflation, is_assumed, model.outlying, model, calibration=model.calibration)


class SmoothedFrfs(NamedTuple):
    """Smooth FRFs, and the noise of the measured ones.

    Attributes
    ----------
    smooth : ndarray, shape (n_freq, n_o, n_i)
        Smooth FRFs, m/N.
    variance : ndarray, shape (n_freq, n_o, n_i)
        Noise variance E|e|^2 of the measured FRFs, (m/N)^2; inf if nothing was measured.
    noise : KnownNoise
        Noise of the FRFs.
    """

    smooth: ComplexArray
    variance: FloatArray
    noise: KnownNoise


def without_mass(
    freq: FloatArray, h: ComplexArray, mass: float | None, *, is_square: bool, is_translation: bool
) -> tuple[ComplexArray, MovingMass | None]:
    """Return FRFs without the mass of a sensor that moves from point to point, and this mass.

    Parameters
    ----------
    freq : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, n_o, n_i)
        Measured receptances, m/N.
    mass : float or None
        Mass, kg; None to estimate it, 0 for none.
    is_square, is_translation : bool
        Whether responses and forces are the same points, all measured, and all of them translations.

    Raises
    ------
    ValueError
        A mass is given, but the receptances at the points of the sensor were not measured.
    """
    if mass:
        if not (is_square and is_translation):
            raise ValueError(
                f"sensor_mass {mass:g} kg can be removed only from FRFs of translations whose responses and forces are "
                "the same points. Measure these, or add an AddedMass to a model"
            )
        found: MovingMass | None = given_mass(freq, h, mass)
    elif mass is None and is_square and is_translation:
        found = found_mass(freq, h)
    else:
        found = None
    return (h, None) if found is None else (found.removed(freq, h), found)


def noise_of_matrix(freq: FloatArray, h: ComplexArray, options: NoiseOptions, *, reciprocal: bool) -> SmoothedFrfs:
    """Return smooth FRFs and noise of a matrix of FRFs, all measured; a level is relative to the smooth FRFs."""
    stated = options.stated()
    # The estimate below removes differences between set-ups as errors of channels, without attributing them to set-ups.
    is_apart = options.noise is not None or options.setups is not None
    calibration = options.calibration(freq, h, reciprocal=reciprocal) if is_apart else None
    like = options.like.smooth if isinstance(options.like, NoiseModel) else options.like
    if stated is not None:
        found = _smooth_by_stated(freq, h, stated, like, reciprocal=reciprocal)
        variance = _stated_variance(freq, found.h, stated)
        level = _usual_level(variance, h) if stated.has_floor else stated.relative
        known = KnownNoise.given(level, calibration, found, stated)
    elif options.noise is not None:
        variance = options.variance(h.shape, np.ones(h.shape[1:], bool))
        begun = _smooth_like(freq, h, variance, like, reciprocal=reciprocal)
        found = begun or smoothed_in_pieces(freq, h, variance, OrderSearch(), reciprocal=reciprocal)
        known = KnownNoise.given(_usual_level(variance, h), calibration, found)
    else:
        model = found_noise(
            freq, h, reciprocal=reciprocal, coherence=options.coherence, averages=options.averages,
            like=options.like if isinstance(options.like, NoiseModel) else None,
        )  # fmt: skip
        known, found = KnownNoise.found(model), model.smooth
        if options.setups is not None:
            known = replace(known, calibration=calibration)
        if model.source == "residual" and not model.smooth.is_smooth:
            # A tiny residual of a rational function is no noise, either.
            known = replace(known, level=_ASSUMED_LEVEL, is_assumed=True)
        variance = _relative_variance(model.smooth.h, _ASSUMED_LEVEL if known.is_assumed else _LEAST_LEVEL)
        if not known.is_assumed:
            np.maximum(model.variance, variance, out=variance)
        del model
    # Fits of further realisations start from these; for a long sweep they would take too much memory.
    if is_long(len(freq)):
        known, smooth = replace(known, model=None, smooth=None), found.h
    else:
        smooth = found.h.copy()
    return SmoothedFrfs(_near(smooth, h, variance), variance, known)


def _usual_level(variance: FloatArray, h: ComplexArray) -> float:
    """Return the median of the noise relative to the FRFs."""
    of_entry = np.median(np.sqrt(variance) / np.maximum(abs(h), _TINY), axis=0)
    # Entries that are zero by symmetry have noise, but no relative noise.
    return float(np.median(of_entry[of_entry < 1] if (of_entry < 1).any() else of_entry))


def _smooth_by_stated(
    freq: FloatArray, h: ComplexArray, stated: StatedNoise, like: SmoothFrfs | None, *, reciprocal: bool
) -> SmoothFrfs:
    """Return smooth FRFs, weighted by noise whose relative part is relative to them."""
    if like is not None and np.array_equal(like.freq_hz, freq) and like.h.shape == h.shape:
        begun = _smooth_like(freq, h, _stated_variance(freq, like.h, stated), like, reciprocal=reciprocal)
        if begun is not None:
            return begun
    # Measured FRFs as weights favour lines that noise has made small.
    variance = _stated_variance(freq, np.sqrt(near_squares(h)), stated)
    first = smoothed_in_pieces(freq, h, variance, OrderSearch(), reciprocal=reciprocal)
    variance, poles = _stated_variance(freq, first.h, stated), first.poles
    del first
    return smoothed_in_pieces(freq, h, variance, OrderSearch(), reciprocal=reciprocal, start=poles)


def _smooth_like(
    freq: FloatArray, h: ComplexArray, variance: FloatArray, like: SmoothFrfs | None, *, reciprocal: bool
) -> SmoothFrfs | None:
    """Return smooth FRFs with the poles of others, relocated; None if these leave a larger residual."""
    if like is None or not like.is_smooth or is_long(len(freq)):  # pieces have no common poles
        return None
    search = OrderSearch(patience=0)
    found = smoothed_in_pieces(freq, h, variance, search, reciprocal=reciprocal, start=like.poles)
    return found if found.is_like(like.level) else None


def noise_of_channels(
    freq: FloatArray, h: ComplexArray, shown: NDArray[np.bool_], options: NoiseOptions, *, reciprocal: bool
) -> SmoothedFrfs:
    """Return smooth FRFs and noise of any FRFs, of which some may be missing; a level is relative to measured FRFs.

    Parameters
    ----------
    freq : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, n_o, n_i)
    shown : ndarray of bool, shape (n_o, n_i)
        FRFs that were measured.
    options : NoiseOptions
    reciprocal : bool
        Whether responses and forces are the same channels, all measured.
    """
    measured, stated = np.where(shown, h, 0), options.stated()
    kept = np.zeros(shown.shape, bool)
    for group in entry_groups(measured, reciprocal=False):
        kept[group.rows, group.columns] = True
    kept &= shown  # without FRFs that are zero, by symmetry
    size = abs(measured)
    size = np.maximum(size, np.maximum(_LEAST_SIZE * size.max(axis=0), _TINY))
    if options.noise is not None:
        variance = options.variance(h.shape, shown) if stated is None else stated.variance(freq, size)
        calibration = options.calibration(freq, measured, reciprocal=reciprocal)
        known = KnownNoise.given(np.nan, calibration, stated=stated)
        return SmoothedFrfs(measured, np.where(kept, variance, np.inf), known)
    # In a square matrix, FRFs that are zero by symmetry may stay: reciprocity gives more information on the noise.
    taken = shown if reciprocal else kept
    rows, columns = np.flatnonzero(taken.any(axis=1)), np.flatnonzero(taken.any(axis=0))
    is_block = bool(taken[np.ix_(rows, columns)].all())

    def parts(values: ArrayLike) -> ComplexArray | FloatArray:
        of = np.asarray(values)
        return np.ascontiguousarray(of[:, rows][:, :, columns] if is_block else of[:, taken][:, None])

    def placed(values: ComplexArray | FloatArray) -> ComplexArray:
        whole = np.zeros((len(values), *shown.shape), np.complex128)
        whole[:, taken] = values.reshape(len(values), -1)
        return whole

    coherence = None if options.coherence is None else parts(as_real("coherence", options.coherence, h.shape))
    found = found_noise(
        freq, np.asarray(parts(h), np.complex128), reciprocal=reciprocal and is_block, coherence=coherence,
        averages=options.averages,
    )  # fmt: skip
    variance, smooth = placed(found.variance).real, placed(found.smooth.h)
    relative, floor, of_coherence = (
        placed(part[None])[0].real for part in (found.relative, found.floor, found.coherence_factor)
    )
    model = replace(found, relative=relative, floor=floor, coherence_factor=of_coherence, variance=variance)
    known = replace(KnownNoise.found(found), model=model)
    if options.setups is not None:
        known = replace(known, calibration=options.calibration(freq, measured, reciprocal=reciprocal and is_block))
    if known.is_assumed:
        variance, smooth = (_ASSUMED_LEVEL * size) ** 2, measured
    return SmoothedFrfs(smooth, np.where(kept, variance, np.inf), known)


def _near(smooth: ComplexArray, h: ComplexArray, variance: FloatArray) -> ComplexArray:
    """Return smooth FRFs, with measured FRFs on lines where smoothing misses these by more than their noise."""
    # Entries that are zero by symmetry contain rounding.
    shown = (smooth != 0).any(axis=0)
    for own in line_slices(len(h)):
        squares = (abs(h[own] - smooth[own]) ** 2 / variance[own])[:, shown].mean(axis=1)
        missed = squares > _MISSED**2
        smooth[own][missed] = h[own][missed]
    return smooth


def _relative_variance(h: ComplexArray | FloatArray, level: float) -> FloatArray:
    """Return level^2 |h|^2, with a floor for FRFs that are zero to rounding."""
    variance = np.empty(h.shape)
    for own in line_slices(len(h)):
        variance[own] = abs(h[own]) ** 2
    least = medians(variance[spread_lines(len(h))].T).T * ZERO**2 + ZERO**4 * variance.max()
    np.maximum(variance, least, out=variance)
    variance *= level**2
    return variance


def _stated_variance(freq: FloatArray, h: ComplexArray | FloatArray, stated: StatedNoise) -> FloatArray:
    """Return the variance of FRFs from the parts of their noise."""
    variance = _relative_variance(h, stated.relative)
    variance += stated.floor_variance(freq)[:, None, None]
    return variance


def noise_about(squares: FloatArray, size: FloatArray, shape: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return relative part and floor of the variance by entry, shape (n_entries,) each, and -2 log likelihood.

    Parameters
    ----------
    squares : ndarray, shape (n_entries, n_freq)
        |e|^2 of measured minus fitted FRFs.
    size : ndarray, shape (n_entries, n_freq)
        |h|^2 of the fitted FRFs.
    shape : ndarray, shape (n_freq,)
        Variance by the floor, up to a common factor.

    Notes
    -----
    The variance has a relative part and a floor, and a floor only if the squares clearly show it: at antiresonances a
    small FRF may contain most information of all, which a floor would hide. One floor of all entries is preferred to
    floors of single entries that hardly describe the squares better, because few lines of an entry show its floor.
    """
    size = np.maximum(size, _TINY)
    relative, floor = noise_parts(squares / shape, np.stack([size / shape, np.ones_like(size)]), common=True)
    variance = np.maximum(relative[:, None] * size + floor[:, None] * shape, _TINY)
    return relative, floor, 2 * float((np.log(variance) + squares / variance).sum())
