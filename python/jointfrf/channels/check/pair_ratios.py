"""Ratios h_pq / h_qp over frequency: their gain, power of i w, delay and phase, with standard errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.signals import LEAST_SMOOTHNESS, modulus
from jointfrf.frf.entry_groups import ZERO
from jointfrf.frf.quantiles import medians
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = [
    "BROKEN",
    "ONE_SIDED",
    "PairRatios",
    "Polar",
    "are_one_sided",
    "are_signals",
    "block_medians",
    "exponents",
    "pair_ratios",
    "ratio_line",
    "scatter_of",
]

#: Lines over which the scatter is averaged: so many, and so many times those that correlate.
_BLOCK, _APART = 15, 8
#: Real and imaginary parts beyond this number of standard deviations, 1 % of normal ones, are clipped.
_CLIP = 2.5
#: Standard errors are never taken smaller: round-off, and small errors that every sensor has.
LEAST_ERROR = 1e-4
#: A phase at 0 Hz that is within so many standard errors of 0, 90, ... degrees is that.
_SAME = 3.0
#: An FRF below this share of sqrt|h_pp h_qq| is zero by symmetry, or nearly: it is not checked for reciprocity.
_SMALL = 1e-2
#: Scatter of log(h_pq / h_qp) above which h_pq and h_qp are not the same FRF; noise of 10 % gives 0.14.
BROKEN = 0.5
#: Pairs of different FRFs scatter by more than so many times the noise, which differences of neighbouring lines show.
_ABOVE_NOISE = 2.0
#: Scatter of a pair of which one is zero.
ONE_SIDED = 3.0
#: Delays that are tried first: this many steps of half a period of the whole band, either way.
_STEPS = 16


class RatioLine(NamedTuple):
    """Constant + 1j slope (w - at) for each of n ratios.

    Attributes
    ----------
    mean : ndarray, shape (n,)
        Logarithm of the gain, and 1j times the phase, at `at`.
    gain_error : ndarray, shape (n,)
        Standard error of the real part.
    slope, slope_error : ndarray, shape (n,)
        Slope of the phase and its standard error, s.
    at : ndarray, shape (n,)
        Weighted mean of the angular frequency, rad/s.
    inflation : float
        Variance of a mean, as a multiple of its variance with independent lines.
    """

    mean: ComplexArray
    gain_error: FloatArray
    slope: FloatArray
    slope_error: FloatArray
    at: FloatArray
    inflation: float

    def phase_at_zero(self) -> FloatArray:
        """Return the phase at 0 Hz, rad."""
        return self.mean.imag - self.at * self.slope


def ratio_line(omega: FloatArray, values: ComplexArray, turn: FloatArray, usable: NDArray[np.bool_]) -> RatioLine:
    """Fit the line by least squares, weighted by the noise.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    values : ndarray, shape (n_freq, n)
        Logarithms of the ratios, with the phase `turn` taken out.
    turn : ndarray, shape (n,)
        Phases, rad.
    usable : ndarray of bool, shape (n,)
        Ratios from which the correlation between lines is estimated.

    Notes
    -----
    A sign and powers of i w have a phase of 0, 90, 180 or 270 degrees at 0 Hz. If the data agree with one of these, the
    phase at 0 Hz is not fitted, which halves the error of the slope or better.

    The scatter is averaged over blocks of lines that are longer than the noise is correlated. Otherwise chance in a
    block would be taken for its noise level.
    """
    block, longer = 0, _BLOCK
    while longer > block:
        is_first, block = block == 0, longer
        deviation = _block_deviation(values, block)
        weight, limit = deviation**-2, _CLIP * deviation
        clipped = np.clip(values.real, -limit, limit) + 1j * np.clip(values.imag, -limit, limit)
        total = weight.sum(axis=0)
        mean = (weight * clipped).sum(axis=0) / total
        at = (weight * omega[:, None]).sum(axis=0) / total
        lever = omega[:, None] - at
        inertia = (weight * lever**2).sum(axis=0)
        slope = (weight * lever * clipped.imag).sum(axis=0) / inertia
        residual = clipped - mean - 1j * lever * slope
        inflation = _inflation((residual / deviation)[:, usable])
        longer = int(_APART * inflation) if is_first else 0
    # Variance of one line of weight 1, with the correlation.
    scale = inflation / _lost(inflation, len(omega))
    variance, phase_variance = ((weight * part**2).mean(axis=0) * scale for part in (residual.real, residual.imag))
    mean = mean + 1j * turn
    start = mean.imag - at * slope
    start -= np.pi / 2 * np.rint(start / (np.pi / 2))
    held = abs(start) < _SAME * np.sqrt(phase_variance * (1 / total + at**2 / inertia))
    moment = (weight * omega[:, None] ** 2).sum(axis=0)
    # Least squares with start = 0, from the estimates of the free line.
    change = np.where(held, at * total * start / moment, 0)
    return RatioLine(
        mean=mean - 1j * np.where(held, start - at * change, 0),
        gain_error=np.hypot(np.sqrt(variance / total), LEAST_ERROR),
        slope=slope + change,
        slope_error=np.hypot(np.sqrt(phase_variance / np.where(held, moment, inertia)), LEAST_ERROR / omega[-1]),
        at=at,
        inflation=inflation,
    )


def block_medians(values: FloatArray, length: int = _BLOCK) -> FloatArray:
    """Return the median over blocks of lines, shape (n_blocks, ...); the last block has the remaining lines."""
    n = max(values.shape[0] // length, 1)
    whole = min(n * length, values.shape[0])
    found = medians(np.moveaxis(values[:whole].reshape(n, whole // n, *values.shape[1:]), 1, -1))
    if values.shape[0] > whole:
        found[-1] = medians(np.moveaxis(values[whole - whole // n :], 0, -1))
    return found


def _block_deviation(rest: ComplexArray, length: int) -> FloatArray:
    """Return the standard deviation of each line, from the median in its block, and not far below that of all."""
    squares = block_medians(rest.real**2 + rest.imag**2, length) / np.log(2)
    squares = np.maximum(squares, 0.01 * medians(squares.T) + LEAST_ERROR**2)
    place = np.minimum(np.arange(rest.shape[0]) // length, squares.shape[0] - 1)
    return np.asarray(np.sqrt(squares)[place])


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


@dataclass(frozen=True, eq=False)
class PairRatios:
    """Estimates of h_pq / h_qp = gain (i w)^power exp(i phase - i w delay), for pairs p < q.

    Attributes
    ----------
    p, q : ndarray of int, shape (n_pairs,)
    usable : ndarray of bool
        Pairs whose ratio is constant, apart from power, delay and noise.
    broken : ndarray of bool
        Pairs of two signals that differ by more than noise: they are not the same FRF.
    power : ndarray of int
    log_gain, gain_error : ndarray
        Natural logarithm, and its standard error.
    delay, delay_error : ndarray
        s.
    phase : ndarray
        rad, at 0 Hz.
    scatter : ndarray
        Median of |log(ratio / model)| over lines.
    inflation : float
        Variance of a mean, as a multiple of its variance with independent lines.
    """

    p: NDArray[np.intp]
    q: NDArray[np.intp]
    usable: NDArray[np.bool_]
    broken: NDArray[np.bool_]
    power: NDArray[np.intp]
    log_gain: FloatArray
    gain_error: FloatArray
    delay: FloatArray
    delay_error: FloatArray
    phase: FloatArray
    scatter: FloatArray
    inflation: float


def pair_ratios(omega: FloatArray, h: ComplexArray, smooth: FloatArray) -> PairRatios:
    """Estimate the ratios of all pairs of FRFs between n DOFs.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
    h : ndarray, shape (n_freq, n, n)
    smooth : ndarray, shape (n, n)
        `smoothness` of h.
    """
    n = h.shape[1]
    p, q = np.triu_indices(n, 1)
    polar = Polar.of(h)
    amplitude, phasor = polar.at(p, q).over(polar.at(q, p))
    steps, tried = _delays(omega)
    delay = steps[np.argmax(abs(tried @ phasor), axis=0)]
    turned = phasor * np.exp(1j * omega[:, None] * delay)
    direction = _unit(turned.sum(axis=0))
    power = _powers(omega, amplitude)
    amplitude = amplitude - power * np.log(omega)[:, None]
    middle = medians(amplitude.T).T
    rest: ComplexArray = (amplitude - middle) + 1j * np.angle(turned * direction.conj())
    scatter = medians(modulus(rest).T).T
    typical = medians(modulus(h).T).T
    judged = are_signals(typical, smooth, h.shape[0])[p, q]
    usable = judged & (scatter < BROKEN)
    noise = medians(modulus(np.diff(rest, axis=0)).T).T / np.sqrt(2)
    broken = judged & ~usable & (scatter > _ABOVE_NOISE * noise)
    alone = are_one_sided(typical, smooth)[p, q]
    broken |= alone
    scatter[alone] = ONE_SIDED

    line = ratio_line(omega, rest, np.angle(direction), usable)
    return PairRatios(
        p, q, usable, broken, power,
        log_gain=middle + line.mean.real,
        gain_error=line.gain_error,
        delay=delay - line.slope,
        delay_error=line.slope_error,
        phase=line.phase_at_zero(),
        scatter=scatter,
        inflation=line.inflation,
    )  # fmt: skip


def are_signals(size: FloatArray, smooth: FloatArray, n_freq: int) -> NDArray[np.bool_]:
    """Pairs, shape (n, n), whose two FRFs are signals and not zero by symmetry.

    From the medians of |h| and the `smoothness` of h, both of shape (n, n).
    """
    across = size * size.T
    own = size.diagonal()
    large = (across > _SMALL**2 * np.outer(own, own)) & (across > 0)
    return np.asarray(large & (np.minimum(smooth, smooth.T) > max(LEAST_SMOOTHNESS, 4 / np.sqrt(n_freq))))


def are_one_sided(size: FloatArray, smooth: FloatArray) -> NDArray[np.bool_]:
    """Pairs, shape (n, n), of which one FRF is a signal and the other one is zero to rounding."""
    alone = (size > 0) & (ZERO * size >= size.T) & (smooth > LEAST_SMOOTHNESS)
    return alone | alone.T


class Polar(NamedTuple):
    """FRFs as the logarithm of their size and a phase factor; 0 and 1 where one is zero.

    Attributes
    ----------
    log_size : ndarray, shape (n_freq, ...)
    phasor : ndarray, shape (n_freq, ...)
    zero : ndarray of bool, shape (n_freq, ...)
    """

    log_size: FloatArray
    phasor: ComplexArray
    zero: NDArray[np.bool_]

    @classmethod
    def of(cls, h: ComplexArray) -> Polar:
        """Return sizes and phases of h, shape (n_freq, ...)."""
        size = modulus(h)
        zero = size == 0
        size = np.where(zero, 1, size)
        return cls(np.log(size), np.where(zero, 1, h / size), zero)

    def at(self, *places: Any) -> Polar:
        """Return those at some places of all lines."""
        at = (slice(None), *places)
        return Polar(self.log_size[at], self.phasor[at], self.zero[at])

    @property
    def transposed(self) -> Polar:
        """Those of h_qp in place of h_pq."""
        return Polar(self.log_size.swapaxes(1, 2), self.phasor.swapaxes(1, 2), self.zero.swapaxes(1, 2))

    def over(self, below: Polar) -> tuple[FloatArray, ComplexArray]:
        """Return the logarithm of the size, and the phase factor, of ratios; 0 and 1 where one of them is zero."""
        amplitude, phasor, unknown = (
            self.log_size - below.log_size, self.phasor * below.phasor.conj(), self.zero | below.zero
        )  # fmt: skip
        if unknown.any():
            amplitude[unknown], phasor[unknown] = 0, 1
        return amplitude, phasor


def scatter_of(above: Polar, below: Polar) -> tuple[FloatArray, FloatArray]:
    """Return the median over lines of |log(above / below) - constant|, and the real part of the constant."""
    amplitude, phasor = above.over(below)
    middle = medians(amplitude.T).T
    turn = np.angle(phasor * _unit(phasor.sum(axis=0)).conj())
    scatter: FloatArray = medians(np.sqrt((amplitude - middle) ** 2 + turn**2).T).T
    one_is_zero = (above.zero != below.zero).mean(axis=0) > 0.5
    return np.where(one_is_zero, ONE_SIDED, scatter), middle


def _unit(values: ComplexArray) -> ComplexArray:
    size = abs(values)
    return np.where(size > 0, values / np.where(size > 0, size, 1), 1)


def _delays(omega: FloatArray) -> tuple[FloatArray, ComplexArray]:
    """Return delays to try, s, and exp(i w delay), shape (n_delays, n_freq)."""
    steps = np.pi / (omega[-1] - omega[0]) * np.arange(-_STEPS, _STEPS + 1)
    return steps, np.exp(1j * np.outer(steps, omega))


def exponents(omega: FloatArray, log_size: FloatArray) -> FloatArray:
    """Return the exponents of w in sizes with these logarithms, shape (n_freq, ...), by least squares."""
    x = np.log(omega)
    x = x - x.mean()
    return np.asarray(x @ log_size / max(float(x @ x), TINY))


def _powers(omega: FloatArray, amplitude: FloatArray) -> NDArray[np.intp]:
    """Exponent of w in each ratio, from -2 to 2, where this explains it better than a constant."""
    x, y = block_medians(np.log(omega)[:, None])[:, 0], block_medians(amplitude)
    slope = exponents(np.exp(x), y)
    power = np.clip(np.rint(slope), -2, 2)
    explained = (abs(slope - power) < 0.3) & (np.var(y - np.outer(x, slope), axis=0) < 0.1 * np.var(y, axis=0))
    return np.where(explained, power, 0).astype(np.intp)
