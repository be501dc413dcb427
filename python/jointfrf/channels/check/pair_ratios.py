"""Ratios h_pq / h_qp over frequency: their gain, power of i w, delay and phase, with standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.measurement import LEAST_SMOOTHNESS, modulus
from jointfrf.channels.check.ratio_line import block_medians, ratio_line
from jointfrf.frf.noise_estimate import ZERO
from jointfrf.frf.quantiles import medians
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "BROKEN",
    "ONE_SIDED",
    "PairRatios",
    "are_one_sided",
    "are_signals",
    "pair_ratios",
    "scatter_of",
]

#: An FRF below this share of sqrt|h_pp h_qq| is zero by symmetry, or nearly: it is not checked for reciprocity.
_SMALL = 1e-2
#: Scatter of log(h_pq / h_qp) above which h_pq and h_qp are not the same FRF; noise of 10 % gives 0.14.
BROKEN = 0.5
#: Scatter of a pair of which one is zero.
ONE_SIDED = 3.0
#: Delays that are tried first: this many steps of half a period of the whole band, either way.
_STEPS = 16


@dataclass(frozen=True, eq=False)
class PairRatios:
    """What is known of h_pq / h_qp = gain (i w)^power exp(i phase - i w delay), for pairs p < q.

    Attributes
    ----------
    p, q : ndarray of int, shape (n_pairs,)
    usable : ndarray of bool
        Pairs whose ratio is constant but for power, delay and noise.
    broken : ndarray of bool
        Pairs of two signals that are not the same FRF.
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
        Variance of a mean over that of independent lines.
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
    above, below = h[:, p, q], h[:, q, p]
    amplitude, phasor = _parts(above, below)
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
    usable, broken = judged & (scatter < BROKEN), judged & (scatter >= BROKEN)
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
    signals: NDArray[np.bool_] = large & (np.minimum(smooth, smooth.T) > max(LEAST_SMOOTHNESS, 4 / np.sqrt(n_freq)))
    return signals


def are_one_sided(size: FloatArray, smooth: FloatArray) -> NDArray[np.bool_]:
    """Pairs, shape (n, n), of which one FRF is a signal and the other one is zero to rounding."""
    alone = (size > 0) & (ZERO * size >= size.T) & (smooth > LEAST_SMOOTHNESS)
    return alone | alone.T


def scatter_of(above: ComplexArray, below: ComplexArray) -> FloatArray:
    """Median over lines of |log(above / below) - constant|: below `BROKEN` where they are one FRF up to a factor."""
    amplitude, phasor = _parts(above, below)
    rest = amplitude - medians(amplitude.T).T
    turn = np.angle(phasor * _unit(phasor.sum(axis=0)).conj())
    scatter: FloatArray = medians(np.hypot(rest, turn).T).T
    one_is_zero = ((above == 0) != (below == 0)).mean(axis=0) > 0.5
    return np.where(one_is_zero, ONE_SIDED, scatter)


def _parts(above: ComplexArray, below: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    """Logarithm of the size, and the phase factor, of above / below; 0 and 1 where one of them is zero."""
    known = (above != 0) & (below != 0)
    ratio = np.asarray(np.where(known, above, 1) / np.where(known, below, 1), np.complex128)
    size = modulus(ratio)
    return np.log(size), ratio / size


def _unit(values: ComplexArray) -> ComplexArray:
    size = abs(values)
    unit: ComplexArray = np.where(size > 0, values / np.where(size > 0, size, 1), 1)
    return unit


def _delays(omega: FloatArray) -> tuple[FloatArray, ComplexArray]:
    """Delays to try, s, and exp(i w delay), shape (n_delays, n_freq)."""
    step = np.pi / (omega[-1] - omega[0])
    steps = step * np.arange(-_STEPS, _STEPS + 1)
    once = np.exp(1j * omega * step)
    turns = np.empty((steps.size, omega.size), complex)
    turns[0] = once ** (-_STEPS)
    for i in range(1, steps.size):
        turns[i] = turns[i - 1] * once
    return steps, turns


def _powers(omega: FloatArray, amplitude: FloatArray) -> NDArray[np.intp]:
    """Exponent of w in each ratio, from -2 to 2, where this explains it better than a constant."""
    x, y = block_medians(np.log(omega)[:, None]), block_medians(amplitude)
    x, y = x - x.mean(), y - y.mean(axis=0)
    spread = (x**2).sum()
    if spread == 0:
        return np.zeros(y.shape[1], np.intp)
    slope = (x * y).sum(axis=0) / spread
    power = np.clip(np.rint(slope), -2, 2)
    left = ((y - slope * x) ** 2).sum(axis=0)
    explained = (abs(slope - power) < 0.3) & (left < 0.1 * (y**2).sum(axis=0))
    return np.where(explained, power, 0).astype(np.intp)
