"""A line over frequency through the logarithms of ratios: gain, phase and its slope, with the errors of noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["LEAST_ERROR", "RatioLine", "block_medians", "ratio_line"]

#: Lines whose scatter is taken together: so many, and so many times those that correlate.
_BLOCK, _APART = 15, 8
#: Values beyond this number of standard deviations are clipped.
_CLIP = 2.5
#: Standard errors are never taken smaller: round-off, and small errors that every sensor has.
LEAST_ERROR = 1e-4
#: A phase at 0 Hz that is within so many standard errors of 0, 90, ... degrees is that.
_SAME = 3.0


class RatioLine(NamedTuple):
    """Constant + 1j slope (w - at) for each of n ratios.

    Attributes
    ----------
    mean : ndarray, shape (n,)
        Logarithm of the gain, and 1j times the phase, at `at`.
    gain_error : ndarray, shape (n,)
        Standard error of the real part.
    slope, slope_error : ndarray, shape (n,)
        Of the phase, s.
    at : ndarray, shape (n,)
        rad/s.
    inflation : float
        Variance of a mean over that of independent lines.
    """

    mean: ComplexArray
    gain_error: FloatArray
    slope: FloatArray
    slope_error: FloatArray
    at: FloatArray
    inflation: float

    def phase_at_zero(self) -> FloatArray:
        """Return the phase at 0 Hz, rad."""
        phase: FloatArray = self.mean.imag - self.at * self.slope
        return phase


def ratio_line(omega: FloatArray, values: ComplexArray, turn: FloatArray, usable: NDArray[np.bool_]) -> RatioLine:
    """Fit the line by least squares, weighted by the noise.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
    values : ndarray, shape (n_freq, n)
        log(ratio) near 0: its phase without `turn`.
    turn : ndarray, shape (n,)
        rad.
    usable : ndarray of bool, shape (n,)
        Ratios that the correlation between lines is found from.

    Notes
    -----
    The phase at 0 Hz is that of a sign and of powers of i w. Where the data agree with that it is not fitted, which
    halves the error of the slope or better.

    Blocks of lines whose scatter is taken together are longer than the noise is correlated: else its chance in each
    would be taken for its level.
    """
    fit = _fitted(omega, values, usable, _BLOCK)
    longer = int(_APART * fit.inflation)
    if longer > _BLOCK:
        fit = _fitted(omega, values, usable, longer)
    total, at, variance = fit.weight.sum(axis=0), fit.at, fit.variance
    mean, slope = fit.mean + 1j * turn, fit.slope
    start = mean.imag - at * slope
    start -= np.pi / 2 * np.rint(start / (np.pi / 2))
    held = abs(start) < _SAME * np.sqrt(variance.imag * (1 / total + at**2 / fit.inertia))
    moment = (fit.weight * omega[:, None] ** 2).sum(axis=0)
    # The least squares with start = 0, from those of the free line.
    change = np.where(held, at * total * start / moment, 0)
    inertia = np.where(held, moment, fit.inertia)
    return RatioLine(
        mean=mean - 1j * np.where(held, start - at * change, 0),
        gain_error=np.hypot(np.sqrt(variance.real / total), LEAST_ERROR),
        slope=slope + change,
        slope_error=np.hypot(np.sqrt(variance.imag / inertia), LEAST_ERROR / omega[-1]),
        at=at,
        inflation=fit.inflation,
    )


class _Fitted(NamedTuple):
    """Free line; the variance of real and imaginary part is that of one line of weight 1, with the correlation."""

    weight: FloatArray
    at: FloatArray
    mean: ComplexArray
    slope: FloatArray
    inertia: FloatArray
    variance: ComplexArray
    inflation: float


def _fitted(omega: FloatArray, values: ComplexArray, usable: NDArray[np.bool_], block: int) -> _Fitted:
    deviation = _block_deviation(values, block)
    weight = deviation**-2
    clipped = _clipped(values, deviation)
    total = weight.sum(axis=0)
    mean = (weight * clipped).sum(axis=0) / total
    at = (weight * omega[:, None]).sum(axis=0) / total
    lever = omega[:, None] - at
    inertia = (weight * lever**2).sum(axis=0)
    slope = (weight * lever * clipped.imag).sum(axis=0) / inertia
    left = clipped - mean - 1j * lever * slope
    # What a delay leaves in the phase is not noise: taken out before.
    inflation = _inflation((left / deviation)[:, usable])
    lost = _lost(inflation, len(omega))
    real, imaginary = ((weight * part**2).mean(axis=0) * inflation / lost for part in (left.real, left.imag))
    return _Fitted(weight, at, mean, slope, inertia, real + 1j * imaginary, inflation)


def block_medians(values: FloatArray, length: int = _BLOCK) -> FloatArray:
    """Return the median over blocks of lines, shape (n_blocks, ...); the last block takes what is left."""
    n = max(values.shape[0] // length, 1)
    whole = min(n * length, values.shape[0])
    medians = np.median(values[:whole].reshape(n, whole // n, *values.shape[1:]), axis=1)
    if values.shape[0] > whole:
        medians[-1] = np.median(values[whole - whole // n :], axis=0)
    return medians


def _block_deviation(rest: ComplexArray, length: int) -> FloatArray:
    """Return the standard deviation of each line, from the median in its block, and not far below that of all."""
    squares = block_medians(rest.real**2 + rest.imag**2, length) / np.log(2)
    squares = np.maximum(squares, 0.01 * np.median(squares, axis=0) + LEAST_ERROR**2)
    place = np.minimum(np.arange(rest.shape[0]) // length, squares.shape[0] - 1)
    deviation: FloatArray = np.sqrt(squares)[place]
    return deviation


def _clipped(rest: ComplexArray, deviation: FloatArray) -> ComplexArray:
    limit = _CLIP * deviation
    return np.clip(rest.real, -limit, limit) + 1j * np.clip(rest.imag, -limit, limit)


def _inflation(standard: ComplexArray) -> float:
    """Sum of the autocorrelation over lags, to the first that is not significant, of all pairs together."""
    n_freq, n_pairs = standard.shape
    if n_pairs == 0:
        return 1.0
    standard = standard - standard.mean(axis=0)
    spectrum = (abs(np.fft.fft(standard, 2 * n_freq, axis=0)) ** 2).sum(axis=1)
    covariance = np.fft.ifft(spectrum).real[: n_freq // 4 + 1]
    if covariance[0] <= 0:
        return 1.0
    correlation = covariance[1:] / covariance[0]
    small = np.flatnonzero(correlation < 2 / np.sqrt(n_freq * n_pairs))
    last = small[0] if small.size else correlation.size
    found = 1 + 2 * correlation[:last].sum()
    return float(found / _lost(found, n_freq))


def _lost(inflation: float, n_freq: int) -> float:
    """Return the share of the noise that a mean and a slope leave."""
    return max(1 - 2 * inflation / n_freq, 0.5)
