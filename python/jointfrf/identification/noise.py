"""Noise of measured FRFs as a fit uses it: as the user gives it, found from them, or assumed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import is_long, line_slices, spread_lines
from jointfrf.frf.entry_groups import ZERO
from jointfrf.frf.noise_model import NoiseModel, estimate_noise
from jointfrf.frf.noise_parts import noise_parts
from jointfrf.frf.quantiles import medians
from jointfrf.frf.smoothing import near_squares, smooth_frfs
from jointfrf.identification.manifold.transforms import Transforms, deformation_compliance, deformation_variance
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_number, as_real

__all__ = ["KnownNoise", "NoiseOptions", "PreparedFrfs", "known_noise", "noise_about"]

#: Relative noise where neither the data nor the user say one: the residual then tells.
_ASSUMED_LEVEL = 0.01
#: Smooth FRFs that lie so many standard deviations of the noise off the measured ones are none of a line.
_MISSED = 3.0
#: Relative noise below this is rounding.
_LEAST_LEVEL = 1e-7


@dataclass(frozen=True)
class NoiseOptions:
    """What is known of the noise, as in `identify` and `estimate_noise`."""

    noise: float | ArrayLike | None = None
    coherence: ArrayLike | None = None
    averages: float | None = None
    like: NoiseModel | None = None


@dataclass(frozen=True)
class KnownNoise:
    """Noise of the FRFs as a fit uses it.

    Attributes
    ----------
    level : float
        Median of the noise relative to the FRFs.
    inflation : float
        By how much correlation between lines makes the variance of a mean larger.
    is_assumed : bool
        Whether the level is only a guess, to be replaced by that of the residual.
    outlying : ndarray of int
        Lines whose noise is far above that of the others.
    model : NoiseModel, optional
        Noise of the channels, where it was found from their FRFs.
    is_told : bool
        Whether the user said the noise.
    """

    level: float
    inflation: float
    is_assumed: bool
    outlying: NDArray[np.intp]
    model: NoiseModel | None = None
    is_told: bool = False


class PreparedFrfs(NamedTuple):
    """What smoothing of the channels gives.

    Attributes
    ----------
    smooth : ndarray, shape (n_freq, 2 n, 2 n)
        Smooth FRFs of the joint DOFs, m/N.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Noise of the measured FRFs, (m/N)^2.
    deformation : ndarray, shape (n_freq, m_r, m_f), or None
        Squares of what is not rigid in them, (m/N)^2; None where that is not known.
    compliance : ndarray, shape (n,), or None
        What the sides between the channels add to the compliance of each joint DOF, m/N or rad/(N m).
    transforms : Transforms
        With rigid modes where these are known.
    noise : KnownNoise
    """

    smooth: ComplexArray
    variance: FloatArray
    deformation: FloatArray | None
    compliance: FloatArray | None
    transforms: Transforms
    noise: KnownNoise


def known_noise(
    freq: FloatArray, h: ComplexArray, options: NoiseOptions, transforms: Transforms, *, reciprocal: bool
) -> PreparedFrfs:
    """Return smooth FRFs of the joint DOFs, the variance of the measured ones, and what else is known of the noise."""
    if options.noise is None:
        return _estimated_noise(freq, h, options, transforms, reciprocal=reciprocal)
    if options.coherence is not None or options.averages is not None:
        raise ValueError("coherence and averages are used where noise is not given: leave one of them out")
    is_level = np.ndim(options.noise) == 0
    if is_level:
        level = as_number("noise", options.noise)
        if level <= 0:
            raise ValueError(f"noise must be positive, not {level:g}")
        variance = _relative_variance(np.sqrt(near_squares(h)), level)
        # Measured FRFs as weights favour lines that noise has made small.
        variance = _relative_variance(smooth_frfs(freq, h, variance, reciprocal=reciprocal).h, level)
    else:
        variance = as_real("noise", options.noise, h.shape)
        if (variance <= 0).any():
            raise ValueError("noise must hold positive variances")
        of_entry = np.median(np.sqrt(variance) / np.maximum(abs(h), np.finfo(float).tiny), axis=0)
        # Entries that are zero by symmetry have noise, but no relative noise.
        level = float(np.median(of_entry[of_entry < 1] if (of_entry < 1).any() else of_entry))
    smooth = smooth_frfs(freq, h, variance, reciprocal=reciprocal).h
    if is_level:
        variance = _relative_variance(smooth, level)
    known = KnownNoise(level, 1.0, False, np.empty(0, np.intp), is_told=True)
    return _prepared(h, _near(smooth, h, variance), variance, transforms, known)


def _prepared(
    h: ComplexArray, smooth: ComplexArray, variance: FloatArray, transforms: Transforms, known: KnownNoise
) -> PreparedFrfs:
    """Take smooth FRFs of the channels to the joint DOFs, and see what is not rigid in them."""
    transforms = transforms.with_modes(smooth)
    deformation, compliance = None, None
    if transforms.channels is not None:
        deformation = deformation_variance(smooth, *transforms.channels)
        compliance = deformation_compliance(h, variance, *transforms.channels)
    if transforms.compliance is not None:
        compliance = np.maximum(transforms.compliance, 0.0 if compliance is None else compliance)
    return PreparedFrfs(transforms.gamma(smooth), variance, deformation, compliance, transforms, known)


def _estimated_noise(
    freq: FloatArray, h: ComplexArray, options: NoiseOptions, transforms: Transforms, *, reciprocal: bool
) -> PreparedFrfs:
    """Find smooth FRFs and noise of the channels from the FRFs themselves."""
    model = estimate_noise(
        freq, h, reciprocal=reciprocal, coherence=options.coherence, averages=options.averages, like=options.like
    )
    # Below this, what looks like noise is rounding.
    level = model.level
    is_assumed = model.source == "none" or level < _LEAST_LEVEL
    # What a rational function leaves of FRFs that it meets but for so little is no noise, either.
    is_assumed |= model.source == "residual" and not model.smooth.is_smooth
    least = _ASSUMED_LEVEL if is_assumed else _LEAST_LEVEL
    variance = _relative_variance(model.smooth.h, least)
    if not is_assumed:
        np.maximum(model.variance, variance, out=variance)
    # Other realisations start from the model; of a long sweep it would take too much memory.
    kept = None if is_long(len(freq)) else model
    known = KnownNoise(least if is_assumed else level, model.inflation, is_assumed, model.outlying, kept)
    smooth = model.smooth.h.copy() if kept else model.smooth.h
    del model
    return _prepared(h, _near(smooth, h, variance), variance, transforms, known)


def _near(smooth: ComplexArray, h: ComplexArray, variance: FloatArray) -> ComplexArray:
    """Put the measured FRFs in place of the smooth ones on lines that smoothing misses by more than their noise."""
    # Entries that are zero by symmetry hold rounding.
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


#: A floor counts where it raises the logarithm of the likelihood by more than this.
_SIGNIFICANT = 4.0
_TINY = float(np.finfo(float).tiny)


def noise_about(squares: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return relative part and floor of the variance by entry, (relative^2, floor^2), shape (n_entries,) each.

    Parameters
    ----------
    squares : ndarray, shape (n_entries, n_freq)
        |e|^2 of measured minus fitted FRFs.
    size : ndarray, shape (n_entries, n_freq)
        |h|^2 of the fitted ones.

    Notes
    -----
    At antiresonances a small FRF may say most of all. A floor that the squares do not clearly show would hide it.
    """
    size = np.maximum(size, _TINY)
    relative, floor = noise_parts(squares, np.stack([size, np.ones_like(size)]))
    alone = (squares / size).mean(axis=1)

    def likelihood(parts: FloatArray, rest: FloatArray) -> FloatArray:
        variance = np.maximum(parts[:, None] * size + rest[:, None], _TINY)
        return np.asarray(-(np.log(variance) + squares / variance).sum(axis=1))

    shown = likelihood(relative, floor) > likelihood(alone, np.zeros_like(floor)) + _SIGNIFICANT
    return np.where(shown, relative, alone), np.where(shown, floor, 0.0)
