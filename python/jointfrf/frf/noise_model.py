"""Noise of measured FRFs from the FRFs alone: variance by entry and frequency, correlation, outlying lines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import line_slices
from jointfrf.frf.calibration import CalibrationErrors, calibration_errors
from jointfrf.frf.entry_groups import EntryGroup, entry_groups, reciprocity_noise
from jointfrf.frf.noise_parts import (
    ReciprocityDifferences,
    acceleration_floor,
    line_correlation,
    reciprocity_differences,
)
from jointfrf.frf.quantiles import medians
from jointfrf.frf.smoothing import (
    OrderSearch,
    SmoothFrfs,
    checked_frfs,
    first_variance,
    joined,
    near_squares,
    pieces,
    smoothed,
)
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray, as_integer, as_number, as_real, check_type
from jointfrf.kernel.call import call_for_number

__all__ = ["NoiseModel", "estimate_noise", "found_noise"]

#: Source of the variance.
NoiseSource = Literal["residual", "reciprocity", "none"]

#: Maximum number of updates of smooth FRFs and noise model in turn, and the factor of the variances on nearly all lines
#: below which they end: weights that are wrong by 1.5 on half of the lines cost 4 % of the efficiency.
_MOST_TURNS = 4
_SETTLED = 1.5
_SETTLED_SHARE = 0.97
#: Ratio of measured minus smooth to differences above which differences do not contain the noise of driving points.
_UNSEEN = 3.0
#: Ratio of the residual of smooth FRFs to the noise of differences above which smooth FRFs are rejected.
_MISSED = 2.0
#: Number of lines below which the noise by entry is hardly known, and smooth FRFs are no better than measured ones.
_COARSE = 50
#: Relative size of differences that are smooth over frequency above which FRFs are not reciprocal.
_UNSYMMETRIC = 0.5
#: Least relative noise for weights: systematic errors of measured FRFs are larger.
_ROUNDING = 1e-4
#: Relative differences below which they are rounding and show no noise.
_EXACT = 1e-10


@dataclass(frozen=True)
class NoiseModel:
    """Noise of measured FRFs.

    E|e|^2 = line_level line_factor (relative^2 |h|^2 + floor^2 s + coherence_factor^2 v)

    v is the variance by coherence. s is 1 for a floor that is constant in the FRFs. It is (f_m/f)^4, with the median
    line f_m, for receptances whose accelerances have a constant floor.

    Attributes
    ----------
    relative : ndarray, shape (n_out, n_in)
        Relative part, 0.05 for 5 %.
    floor : ndarray, shape (n_out, n_in)
        Part that does not depend on |h|, at the median line, in the unit of the FRF.
    coherence_factor : ndarray, shape (n_out, n_in)
        Ratio of the noise to the noise by coherence; 0 without coherence. Near 1 if coherence explains the noise alone.
    variance : ndarray, shape (n_freq, n_out, n_in)
        Noise variance E|e|^2, squared unit of the FRF.
    inflation : float
        Number of neighbouring lines that carry the noise of one independent line: covariances of estimates take this
        factor.
    inflation_source : {"reciprocity", "residual", "none"}
        Source of the inflation:

        - "reciprocity": differences h_pq - h_qp, which do not depend on a model
        - "residual": measured minus smooth, corrected for the parameters, if FRFs are not square or were made
          reciprocal before
        - "none": too few lines
    line_level : ndarray, shape (n_freq,)
        Variation of the noise power over frequency, common to all entries, that the parts do not describe; 1 if it is
        not significant.
    line_factor : ndarray, shape (n_freq,)
        Ratio of the noise power of an outlying line (mains hum) to the model, 1 for other lines.
    source : {"residual", "reciprocity", "none"}
        Source of the variance:

        - "residual": measured minus smooth FRFs
        - "reciprocity": the differences h_pq - h_qp, with too few lines or too little noise for smoothing
        - "none": both show no noise, and the variance is 0
    smooth : SmoothFrfs
        Smooth FRFs.
    calibration : CalibrationErrors or None
        Errors that are smooth over frequency, if h_pq and h_qp differ by more than noise. Variance and inflation do not
        contain them.
    floor_of_acceleration : bool
        Whether the floor is constant in acceleration.
    """

    relative: FloatArray
    floor: FloatArray
    coherence_factor: FloatArray
    variance: FloatArray
    inflation: float
    inflation_source: NoiseSource
    line_level: FloatArray
    line_factor: FloatArray
    source: NoiseSource
    smooth: SmoothFrfs
    calibration: CalibrationErrors | None = None
    floor_of_acceleration: bool = False

    def floor_shape(self, freq_hz: FloatArray) -> FloatArray:
        """Return s, by which the square of the floor depends on frequency, shape (n_freq,)."""
        return acceleration_floor(freq_hz) if self.floor_of_acceleration else np.ones(freq_hz.size)

    @property
    def outlying(self) -> NDArray[np.intp]:
        """Numbers of the outlying lines."""
        return np.flatnonzero(self.line_factor > 1)

    @cached_property
    def level(self) -> float:
        """Median of the noise relative to the FRFs, over entries that are not zero and lines."""
        counts = (self.relative > 0) | (self.floor > 0) | (self.coherence_factor > 0)
        if not counts.any():
            return 0.0
        ratio = np.empty((len(self.variance), np.count_nonzero(counts)))
        for own in line_slices(len(ratio)):
            h = self.smooth.h[own][:, counts]
            ratio[own] = self.variance[own][:, counts] / np.maximum(h.real**2 + h.imag**2, TINY)
        return float(np.sqrt(medians(ratio.ravel())))


def estimate_noise(
    freq_hz: ArrayLike,
    h: ArrayLike,
    *,
    reciprocal: bool | None = None,
    coherence: ArrayLike | None = None,
    averages: float | None = None,
    max_poles: int = 60,
    like: NoiseModel | None = None,
) -> NoiseModel:
    """Return the noise of measured FRFs, with smooth FRFs.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Lines in Hz, all different, in any spacing.
    h : array_like, shape (n_freq, n_out, n_in)
        Measured FRFs, in any unit.
    reciprocal : bool, optional
        Whether h_pq and h_qp of a square matrix are the same FRF, because responses and forces are the same points in
        the same order. By default the FRFs decide.
    coherence : array_like, shape (n_freq, n_out, n_in), optional
        Ordinary coherence of each FRF, above 0, at most 1.
    averages : float, optional
        Number of averages behind the coherence, default 1; without it, `coherence_factor` contains 1/sqrt(averages).
    max_poles : int
        Largest number of poles; see `smooth_frfs`.
    like : NoiseModel, optional
        Noise of other FRFs of the same structure on the same lines, such as another realisation. Its poles and
        variances are initial values, which saves most of the search. It is ignored if it does not describe these FRFs.

    Returns
    -------
    NoiseModel
        Parts of the noise, its correlation, outlying lines, and smooth FRFs.

    Raises
    ------
    ValueError
        An error of `smooth_frfs`. Or coherence is out of range, averages have no coherence or are below 1; or a square
        matrix is not reciprocal although `reciprocal` is true, or has too few lines to estimate its noise otherwise.

    See Also
    --------
    smooth_frfs : smooth FRFs for known noise.
    identify : fit of a joint, which estimates the noise by default.
    pollute : FRFs with added noise.

    Notes
    -----
    Smooth FRFs and noise model are updated in turn until the variances converge. Squares of measured minus smooth FRFs
    are divided by the part of the noise that the smooth FRFs have not absorbed. They give the parts of the variance by
    entry.

    From coherence g^2 of n averages, v = (1 - g^2)/(n g^2) |h|^2 is E|e|^2; |h| alone has half of it as its variance. v
    is one more part with a separate factor. The residual, which contains all noise, thus determines the weight of the
    coherence.

    If h_pq and h_qp differ smoothly over frequency, by gains, delays and drifts of channels, these differences are
    first removed: they are `calibration`, not noise. If the rest of the differences is smooth over frequency as well,
    and exceeds the noise that rational functions leave, `reciprocal` is false. More than 8192 lines are cut into pieces
    of equal length with separate parts. `variance` follows from these; `relative`, `floor` and `coherence_factor` are
    their root mean squares.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> h = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    >>> noise = jf.estimate_noise(freq, jf.pollute(h, 0.05, seed=1))
    >>> bool(abs(noise.level / 0.05 - 1) < 0.1)
    True
    """
    freq, lines = checked_frfs(freq_hz, h)
    if as_integer("max_poles", max_poles) < 1:
        raise ValueError(f"max_poles must be 1 or more, not {max_poles}")
    if like is not None:
        check_type("like", like, NoiseModel)
    order = np.argsort(freq, kind="stable")
    differences = None if reciprocal is False else _differences(lines[order])
    apart = 0.0 if differences is None else differences.asymmetry(lines[order])

    def found(*, as_reciprocal: bool) -> NoiseModel:
        return found_noise(
            freq,
            lines,
            reciprocal=as_reciprocal,
            coherence=coherence,
            averages=averages,
            max_poles=max_poles,
            like=like,
        )

    if reciprocal is None and differences is not None:
        model = found(as_reciprocal=True)
        rest = lines if model.calibration is None else model.calibration.without(freq, lines)
        left = _differences(rest[order])
        if left is not None and left.are_smooth(rest[order]):
            other = found(as_reciprocal=False)
            if other.source == "residual" and left.ratio(other.variance[order]) > _MISSED:
                return other
        if apart <= _UNSYMMETRIC:
            return model
    if apart > _UNSYMMETRIC:
        raise ValueError(
            f"h_pq and h_qp differ by {100 * apart:.0f} % (median): h is not reciprocal. Give reciprocal=False if "
            "responses and forces are different points"
        )
    return found(as_reciprocal=reciprocal is not False)


def _differences(h: ComplexArray) -> ReciprocityDifferences | None:
    """Return h_pq - h_qp of FRFs on lines in rising order."""
    return reciprocity_differences(h, entry_groups(h, reciprocal=True))


def found_noise(
    freq: FloatArray,
    lines: ComplexArray,
    *,
    reciprocal: bool = True,
    coherence: ArrayLike | None = None,
    averages: float | None = None,
    max_poles: int = 60,
    like: NoiseModel | None = None,
) -> NoiseModel:
    """Return the noise of checked FRFs, as `estimate_noise` does, whether they are reciprocal or not."""
    given = _coherence_variance(lines, coherence, averages)
    places = pieces(np.argsort(freq))
    if like is not None and (len(places) > 1 or like.variance.shape != lines.shape):
        like = None

    def estimated(noisy: _NoisyLines, own: NDArray[np.intp] | slice) -> NoiseModel:
        near = None if like is None else like.variance[own]
        return _estimated(noisy, None if given is None else given[own], near, like)

    noisy, calibration = _NoisyLines(freq, lines, reciprocal, max_poles), None
    if len(places) == 1 and (np.diff(freq) > 0).all():
        if noisy.differences is not None:
            known = noisy.differences, noisy.variance_of_differences
            calibration = calibration_errors(freq, lines, known=known)
        if calibration is not None:
            noisy = replace(noisy, h=calibration.without(freq, lines))
        model = replace(estimated(noisy, slice(None)), calibration=calibration)
        # The arrays of the measurement belong to the caller.
        return (
            model if model.smooth.is_smooth else replace(model, smooth=replace(model.smooth, h=model.smooth.h.copy()))
        )
    if reciprocal and lines.shape[1] == lines.shape[2]:
        calibration = calibration_errors(freq, lines)

    def parts() -> Iterator[NoiseModel]:
        for own in places:
            h = lines[own] if calibration is None else calibration.without(freq[own], lines[own])
            yield estimated(replace(noisy, freq=freq[own], h=h), own)

    return replace(_joined(places, parts(), lines.shape), calibration=calibration)


def _joined(places: list[NDArray[np.intp]], parts: Iterable[NoiseModel], shape: tuple[int, ...]) -> NoiseModel:
    """Return the noise of FRFs of this shape, pieces of the lines at their places; parts and inflation are means."""
    n_freq = shape[0]
    variance, by_entry = np.empty(shape), np.zeros((3, *shape[1:]))
    levels, inflation, known = np.empty((2, n_freq)), 0.0, []

    def smooth() -> Iterator[SmoothFrfs]:
        nonlocal inflation
        for own, one in zip(places, parts, strict=True):
            variance[own] = one.variance
            levels[:, own] = one.line_level, one.line_factor
            by_entry[:] += np.square([one.relative, one.floor, one.coherence_factor]) * len(own) / n_freq
            inflation += one.inflation * len(own) / n_freq
            known.append((one.source, one.inflation_source, one.floor_of_acceleration and len(places) == 1))
            yield one.smooth

    smooth_frfs = joined(places, smooth(), shape)
    source, inflation_source, of_acceleration = max(known, key=known.count)
    relative, floor, of_coherence = np.sqrt(by_entry)
    return NoiseModel(
        relative, floor, of_coherence, variance, inflation, inflation_source, levels[0], levels[1], source, smooth_frfs,
        floor_of_acceleration=of_acceleration,
    )  # fmt: skip


@dataclass(frozen=True)
class _NoisyLines:
    """Checked FRFs whose noise is estimated, lines in rising order.

    Attributes
    ----------
    freq : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, n_out, n_in)
        Measured FRFs.
    reciprocal : bool
        Whether h_pq and h_qp are the same FRF.
    max_poles : int
        Largest number of poles.
    """

    freq: FloatArray
    h: ComplexArray
    reciprocal: bool
    max_poles: int

    @cached_property
    def groups(self) -> list[EntryGroup]:
        """Groups of coupled entries."""
        return entry_groups(self.h, reciprocal=self.reciprocal)

    @cached_property
    def differences(self) -> ReciprocityDifferences | None:
        """Differences of reciprocal entries, if there are any."""
        return reciprocity_differences(self.h, self.groups) if self.reciprocal else None

    @cached_property
    def near(self) -> FloatArray:
        """|h|^2 over neighbouring lines."""
        return near_squares(self.h)

    @cached_property
    def usual(self) -> FloatArray:
        """Medians of `near` over the lines, shape (n_out, n_in)."""
        return medians(self.near.T).T

    @cached_property
    def variance_of_differences(self) -> FloatArray:
        """Variance of all entries by the parts of the differences."""
        assert self.differences is not None
        return self.differences.variance_of_parts(self.near, self.usual, self.freq)

    def smoothed(
        self, variance: FloatArray, inflation: float | None, patience: int, start: tuple[ComplexArray, ...] = ()
    ) -> SmoothFrfs:
        """Return smooth FRFs by weights of this variance; the search starts with the poles `start`, rad/s."""
        return smoothed(
            self.freq, self.h, variance, OrderSearch(inflation, self.max_poles, patience), self.groups, start
        )

    def weighing(self, variance: FloatArray) -> FloatArray:
        """Return the variance for weights: not below rounding, even if differences of most lines are zero."""
        return np.maximum(variance, self._least)

    @cached_property
    def _least(self) -> FloatArray:
        return np.maximum(_ROUNDING**2 * first_variance(self.near, self.usual), TINY)


class _NoiseParts(NamedTuple):
    """Noise of all entries without smoothing.

    Attributes
    ----------
    relative, floor : ndarray, shape (n_out, n_in)
        Relative noise, and floor at the median line.
    shape : ndarray, shape (n_freq,)
        Dependence of floor^2 on frequency.
    is_common : bool
        Whether all entries have one relative level.
    """

    relative: FloatArray
    floor: FloatArray
    shape: FloatArray
    is_common: bool = False

    @property
    def of_acceleration(self) -> bool:
        """Whether the floor depends on frequency."""
        return bool((self.shape != 1).any())

    def variance(self, squares: FloatArray) -> FloatArray:
        """Return the variance of FRFs with these squares |h|^2, shape (n_freq, n_out, n_in)."""
        return np.asarray(self.relative**2 * squares + self.floor**2 * self.shape[:, None, None])


def _estimated(
    lines: _NoisyLines, given: FloatArray | None, near: FloatArray | None, like: NoiseModel | None
) -> NoiseModel:
    """Return the noise model of checked FRFs; `near` is the variance of others on these lines."""
    differences = lines.differences
    begun = None if like is None or near is None else _initial_like(lines, near, like)
    if begun is None:
        differences, smooth, variance, inflation = _initial(lines, differences)
    else:
        smooth, variance, inflation = begun
    if not smooth.is_smooth:
        return _without_smoothing(lines, smooth, differences)
    if begun is None:
        model = _converged(lines, smooth, variance, inflation, given, differences)
    else:
        model = _model(lines.h, smooth, given, inflation or 1.0, differences, robust=False)
    smooth = model.smooth
    if not smooth.is_smooth:
        return _without_smoothing(lines, smooth, differences)
    seen = None if differences is None else _noise_of_differences(lines, model, differences)
    if seen is not None:
        return _without_smoothing(lines, replace(smooth, h=lines.h, is_smooth=False), differences, seen)
    inflation, source = _found_inflation(lines.h, differences, model)
    return replace(model, inflation=inflation, inflation_source=source)


def _converged(
    lines: _NoisyLines,
    smooth: SmoothFrfs,
    variance: FloatArray,
    inflation: float | None,
    given: FloatArray | None,
    differences: ReciprocityDifferences | None,
) -> NoiseModel:
    """Return the noise model after convergence of smooth FRFs and variances in turn."""
    for _ in range(_MOST_TURNS):
        model = _model(lines.h, smooth, given, inflation or 1.0, differences, robust=True)
        inflation, _ = _found_inflation(lines.h, differences, model)
        before, variance = variance, lines.weighing(model.variance)
        shown = (smooth.h != 0).any(axis=0)
        steps = abs(np.log(variance[:, shown] / before[:, shown]))
        settled = bool((steps < np.log(_SETTLED)).mean() > _SETTLED_SHARE)
        known = None if differences is None else inflation
        after = lines.smoothed(variance, known, 0 if settled else _patience(differences), smooth.poles)
        # Strong correlation of lines makes poles expensive: if one of them is missing, the residual is no noise.
        if after.level > max(_UNSEEN, smooth.level):
            break
        smooth = after
        if settled:
            break
    return _model(lines.h, smooth, given, inflation or 1.0, differences, robust=False)


def _noise_of_differences(
    lines: _NoisyLines, model: NoiseModel, differences: ReciprocityDifferences
) -> _NoiseParts | None:
    """Return the noise that differences show, if it describes the noise better than measured minus smooth.

    It does for few and coarse lines, which rational functions miss by as much as their noise or more: if the noise has
    one relative level, or if the residual is far more than the differences. For many lines, noise that h_pq and h_qp
    share is more likely.
    """
    if len(lines.h) >= _COARSE:
        return None
    parts = _parts_of_differences(lines, differences, model.smooth.h)
    is_described = parts is not None and (parts.is_common or differences.ratio(model.variance) < 1 / _MISSED)
    return parts if is_described else None


def _parts_of_differences(
    lines: _NoisyLines, differences: ReciprocityDifferences, smooth: ComplexArray
) -> _NoiseParts | None:
    """Return one relative level if it describes the differences, or else parts by entry; None if they are rounding."""
    squares = np.square(abs(lines.h))
    if differences.ratio(squares) < _EXACT:
        return None
    level = differences.common_level(lines.freq, lines.h, smooth)
    if level > 0:
        return _relative_noise(lines, level)
    usual = medians(squares.T).T
    (relative, floor), shape = differences.parts(squares, usual, lines.freq)
    return _NoiseParts(np.sqrt(relative), np.sqrt(floor * usual), shape)


def _relative_noise(lines: _NoisyLines, level: float) -> _NoiseParts:
    """Return noise of one relative level in all entries that are not zero."""
    relative = np.zeros((1, *lines.h.shape[1:]))
    for group in lines.groups:
        group.put(np.full((len(group.rows), 1), level), relative)
    return _NoiseParts(relative[0], np.zeros_like(relative[0]), np.ones(len(lines.h)), is_common=True)


def _initial(
    lines: _NoisyLines, differences: ReciprocityDifferences | None
) -> tuple[ReciprocityDifferences | None, SmoothFrfs, FloatArray, float | None]:
    """Return first smooth FRFs, their variance and inflation, and the differences if these show the noise."""
    smooth, variance, inflation = _first_smooth(lines, differences)
    if differences is not None and smooth.is_smooth and smooth.level > _UNSEEN:
        other = _first_smooth(lines, None)
        # If no rational function fits, nothing is gained by omitting the differences.
        if np.median((abs(lines.h - other[0].h) ** 2 / variance)[:, (other[0].h != 0).any(axis=0)]) < _UNSEEN:
            return None, *other
    return differences, smooth, variance, inflation


def _initial_like(
    lines: _NoisyLines, near: FloatArray, like: NoiseModel
) -> tuple[SmoothFrfs, FloatArray, float | None] | None:
    """Return smooth FRFs with relocated poles of others; None if these leave more noise."""
    if not like.smooth.is_smooth:
        return None
    variance = lines.weighing(near)
    smooth = lines.smoothed(variance, like.inflation, 0, like.smooth.poles)
    return (smooth, variance, like.inflation) if smooth.is_like(1.0) else None


def _first_smooth(
    lines: _NoisyLines, differences: ReciprocityDifferences | None
) -> tuple[SmoothFrfs, FloatArray, float | None]:
    """Return smooth FRFs by weights from differences if there are any, these variances, and the inflation."""
    inflation = None
    if differences is None:
        variance = first_variance(lines.near, lines.usual)
    else:
        variance = lines.weighing(lines.variance_of_differences)
        inflation = differences.inflation(variance, differences.line_levels(variance).factor)
        levels = differences.line_levels(variance, inflation)
        variance *= (levels.usual * levels.factor)[:, None, None]
    return lines.smoothed(variance, inflation, _patience(differences)), variance, inflation


def _patience(differences: ReciprocityDifferences | None) -> int:
    return 2 if differences is None else 1  # a worse start


def _coherence_variance(h: ComplexArray, coherence: ArrayLike | None, averages: float | None) -> FloatArray | None:
    """Return E|e|^2 by the coherence."""
    if coherence is None:
        if averages is not None:
            raise ValueError("averages need coherence; give coherence, too")
        return None
    squared = as_real("coherence", coherence, h.shape)
    if ((squared <= 0) | (squared > 1)).any():
        raise ValueError("coherence must be above 0 and at most 1")
    count = 1.0 if averages is None else as_number("averages", averages)
    if count < 1:
        raise ValueError(f"averages must be 1 or more, not {averages}")
    return (1 - squared) / (count * squared) * abs(h) ** 2


def _found_inflation(
    h: ComplexArray, differences: ReciprocityDifferences | None, model: NoiseModel
) -> tuple[float, NoiseSource]:
    if differences is not None:
        return model.inflation, "reciprocity"
    shown = (model.variance > 0).all(axis=0)
    if h.shape[1] == h.shape[2] and np.allclose(h, h.swapaxes(1, 2), rtol=1e-8, atol=0):
        shown = np.triu(shown)
    noise = ((h - model.smooth.h)[:, shown] / np.sqrt(model.variance[:, shown])).T
    noise = np.where(model.line_factor > 1, np.nan, noise)
    return line_correlation(noise, float(model.smooth.share[shown].mean())), "residual"


def _model(
    h: ComplexArray,
    smooth: SmoothFrfs,
    given: FloatArray | None,
    inflation: float,
    differences: ReciprocityDifferences | None,
    *,
    robust: bool,
) -> NoiseModel:
    """Return the noise model from measured minus smooth FRFs.

    The robust one is for weights. It must not take the error of preliminary smooth FRFs at peaks and antiresonances for
    noise, or for outlying lines if differences show these.
    """
    n_freq, n_out, n_in = h.shape
    shown = (smooth.h != 0).any(axis=0)
    measured, fitted = (np.ascontiguousarray(frfs[:, shown].T) for frfs in (h, smooth.h))
    known = np.zeros(measured.shape) if given is None else np.ascontiguousarray(given[:, shown].T)
    pairs = _numbers(shown, differences)
    first, second = pairs if pairs.size else np.zeros((2, 1), np.int32)  # the kernel takes no array without numbers
    parts, entries = np.empty((3, len(measured))), np.empty(measured.shape)
    usual, factor = np.empty((2, n_freq))
    is_shaped, found, _ = call_for_number(
        "estimate_noise",
        (
            *measured.shape, pairs.shape[1], int(robust), acceleration_floor(smooth.freq_hz),
            measured, fitted, smooth.share[shown], known, first, second, inflation, parts, entries, usual, factor,
        ),
    )  # fmt: skip
    variance, by_entry = np.zeros(h.shape), np.zeros((3, n_out, n_in))
    variance[:, shown], by_entry[:, shown] = entries.T, parts
    relative, floor, of_coherence = by_entry
    return NoiseModel(
        relative, floor, of_coherence, variance, found, "none", usual, factor, "residual", smooth,
        floor_of_acceleration=bool(is_shaped),
    )  # fmt: skip


def _numbers(shown: NDArray[np.bool_], differences: ReciprocityDifferences | None) -> NDArray[np.int32]:
    """Return the numbers, from 1, of both entries of each pair that differs, among those shown, shape (2, n_pairs)."""
    if differences is None:
        return np.zeros((2, 0), np.int32)
    number = np.zeros(shown.shape, np.int32)
    number[shown] = np.arange(1, np.count_nonzero(shown) + 1)
    rows, columns = differences.rows, differences.columns
    both = np.stack([number[rows, columns], number[columns, rows]])
    return np.ascontiguousarray(both[:, both.all(axis=0)])


def _without_smoothing(
    lines: _NoisyLines,
    smooth: SmoothFrfs,
    differences: ReciprocityDifferences | None,
    parts: _NoiseParts | None = None,
) -> NoiseModel:
    """Return the noise model for few lines and for nearly exact FRFs, by differences as far as there are any."""
    h = lines.h
    n_freq, n_out, n_in = h.shape
    source = "reciprocity"
    if parts is None and differences is not None and smooth.poles:
        parts = _parts_of_differences(lines, differences, h)
    if parts is None:
        level = float(reciprocity_noise(h[None])[0]) if lines.reciprocal and n_out == n_in else 0.0
        if level == 0:
            level, source = (smooth.level, "residual") if smooth.poles else (0.0, "none")
        parts = _relative_noise(lines, level)
    variance, factor = parts.variance(np.square(abs(h))), np.ones(n_freq)
    if differences is not None and smooth.poles:  # enough lines to find outlying ones
        factor = differences.line_levels(lines.weighing(variance)).factor
    return NoiseModel(
        relative=parts.relative,
        floor=parts.floor,
        coherence_factor=np.zeros((n_out, n_in)),
        variance=variance * factor[:, None, None],
        inflation=1.0,
        inflation_source="none",
        line_level=np.ones(n_freq),
        line_factor=factor,
        source=cast(NoiseSource, source),
        smooth=smooth,
        floor_of_acceleration=parts.of_acceleration,
    )
