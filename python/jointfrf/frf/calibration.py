"""Errors of channels and of single FRFs that go smoothly over frequency, by the differences of h_pq and h_qp."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.bands import spread_lines
from jointfrf.frf.entry_groups import entry_groups
from jointfrf.frf.noise_parts import ReciprocityDifferences, reciprocity_differences
from jointfrf.frf.smoothing import near_squares
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = ["CalibrationErrors", "calibration_errors", "shows_calibration"]

#: Functions of frequency that may be calibration, about as slow as an eighth of the band; as many faster ones show the
#: noise. Lines that each needs.
_SLOW, _LINES = 8, 20
#: Probability at which a sum of squares that exceeds that of noise is taken for chance: sixteen sums are looked at, so
#: that calibration is seen where there is none in 1.6 % of the tests.
_CHANCE = 0.001
#: Singular values below this share of the largest are zero.
_RANK = 1e-9


@dataclass(frozen=True, eq=False)
class CalibrationErrors:
    """Variances of relative errors of FRFs that are smooth over frequency.

    h_pq is measured as h_pq (1 + g_p + f_q + e_pq): g_p of the response, f_q of the force, e_pq of the FRF itself. Real
    and imaginary part, gain and phase, are sums of functions of frequency of mean square 1 (`functions`), each with an
    independent, normal factor.

    Attributes
    ----------
    span : (float, float)
        Hz.
    channel : ndarray, shape (2, n_functions)
        Variance of g_p - f_p, of gain and of phase, the same for all channels; 0 where it is not significant.
    own : ndarray, shape (2, n_functions)
        Variance of e_pq, likewise.
    channel_degrees, own_degrees : ndarray, shape (2, n_functions)
        Degrees of freedom of these variances.
    rows, columns : ndarray of int, shape (n_pairs,)
    differences : ndarray, shape (n_pairs, 2, n_functions)
        Significant factors of (h_pq - h_qp) over the mean of both.

    Notes
    -----
    The functions of the gain are Legendre polynomials; those of the phase a delay, which is proportional to frequency,
    and polynomials that are orthogonal to it.
    """

    span: tuple[float, float]
    channel: FloatArray
    own: FloatArray
    channel_degrees: FloatArray
    own_degrees: FloatArray
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    differences: FloatArray

    def functions(self, freq_hz: FloatArray) -> FloatArray:
        """Return the functions of gain and phase, shape (2, n_functions, n_freq)."""
        return _functions(self.span, self.channel.shape[1], freq_hz.tobytes())

    def variance(self, freq_hz: FloatArray) -> FloatArray:
        """Return E|g_p + f_q + e_pq|^2 of each line, shape (n_freq,)."""
        return np.asarray(np.einsum("ab,abl->l", self.channel + self.own, self.functions(freq_hz) ** 2))

    def without(self, freq_hz: FloatArray, h: ComplexArray) -> ComplexArray:
        """Return FRFs less the half of their smooth differences."""
        gain, phase = self.functions(freq_hz)
        relative = self.differences[:, 0] @ gain + 1j * (self.differences[:, 1] @ phase)
        p, q = self.rows, self.columns
        half = (relative / 4).T * (h[:, p, q] + h[:, q, p])
        left = h.copy()
        left[:, p, q] -= half
        left[:, q, p] += half
        return left

    def level(self, which: str) -> tuple[float, float]:
        """Return root mean squares over the band of gain and of phase, rad: of "channel" or "own"."""
        gain, phase = np.sqrt(getattr(self, which).sum(axis=1)).tolist()
        return gain, phase


def calibration_errors(
    freq_hz: FloatArray, h: ComplexArray, known: tuple[ReciprocityDifferences, FloatArray] | None = None
) -> CalibrationErrors | None:
    """Find the variances of smooth errors of FRFs between the same channels of a reciprocal structure.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    h : ndarray, shape (n_freq, m, m)
    known : (ReciprocityDifferences, ndarray), optional
        Differences of lines that rise in frequency, and the variance of h by their parts.

    Returns
    -------
    CalibrationErrors or None
        None where differences are those of noise, or FRFs were made reciprocal, or there are few lines.

    Notes
    -----
    Differences of each pair are fitted by least squares, weighted by their noise, and the factors split into those of
    channels, u_p - u_q with u = g - f, and what does not close, e_pq - e_qp. Noise has the same squares in slow
    functions as in faster ones, however far neighbouring lines correlate, unless that is over a good part of the band:
    sums of squares of slow functions of about one speed are compared with those of the faster half, of channels with
    channels, as noise that is common to a hit is. Those that exceed them by more than chance give the variances.
    """
    freq = freq_hz
    if known is None:
        lines = np.argsort(freq_hz)[spread_lines(len(freq_hz))]
        freq, h = freq_hz[lines], h[lines]
        found_differences = reciprocity_differences(h, entry_groups(h, reciprocal=True))
        if found_differences is None:
            return None
        known = found_differences, found_differences.variance_of_parts(near_squares(h))
    differences, variance = known
    n_slow = min(_SLOW, freq.size // _LINES // 2)
    if not n_slow:
        return None
    span = float(freq[0]), float(freq[-1])
    factors = _factors(differences, h, variance, _functions(span, 2 * n_slow, freq.tobytes()), _mixture(span))
    rows, columns = differences.rows, differences.columns
    by_noise = _squares(factors, 1 / factors.variance, rows, columns)
    # Errors far above the noise count alike, however small the noise of a pair is.
    alike = _squares(factors, np.ones((len(rows), 1, 1)), rows, columns)
    found = np.zeros((2, 2, 2, n_slow))  # variance and degrees; channel and own; gain and phase
    reference = by_noise[..., n_slow:].sum(axis=3)
    # Functions 0, 1, 2 to 3, 4 to 7 are about as fast.
    first = [one for one in (0, 1, 2, 4) if one < n_slow]
    tested, sized = (np.add.reduceat(squares[..., :n_slow], first, axis=3) for squares in (by_noise, alike))
    for part in range(2):
        for i, own in enumerate(map(slice, first, [*first[1:], n_slow])):
            variance_and_degrees = _variances(tested[:, :, part, i], sized[:, :, part, i], reference[:, :, part])
            found[:, :, part, own] = variance_and_degrees[:, :, None]
    variance, degrees = found
    if not variance.any():
        return None
    significant = np.where(variance.any(axis=0), factors.value[:, :, :n_slow], 0)
    return CalibrationErrors(span, variance[0], variance[1], degrees[0], degrees[1], rows, columns, significant)


def shows_calibration(h: ComplexArray) -> bool:
    """Return whether FRFs between the same channels could show smooth errors: both ways measured, on enough lines."""
    middle = h[len(h) // 2]
    return len(h) >= 2 * _LINES and middle.shape[0] > 1 and not np.allclose(middle, middle.T, rtol=1e-9, atol=0)


@lru_cache(maxsize=8)
def _functions(span: tuple[float, float], number: int, lines: bytes) -> FloatArray:
    """Return functions of gain and phase of mean square 1 over the band, shape (2, number, n_freq), of lines in Hz."""
    middle, half = (span[1] + span[0]) / 2, (span[1] - span[0]) / 2
    gain = legendre.legvander((np.frombuffer(lines) - middle) / half, max(number, 2) - 1).T
    gain *= np.sqrt(2 * np.arange(len(gain)) + 1)[:, None]
    phase = gain.copy()
    phase[:2] = _mixture(span) @ gain[:2]
    found = np.asarray(np.stack([gain, phase])[:, :number], float)
    found.flags.writeable = False
    return found


def _mixture(span: tuple[float, float]) -> FloatArray:
    """Return the matrix from the first two functions of the gain to those of the phase; it is its own inverse."""
    slow, fast = (span[1] + span[0]) / 2, (span[1] - span[0]) / np.sqrt(12)
    return np.asarray(np.array([[slow, fast], [fast, -slow]]) / np.hypot(slow, fast))


class _Factors(NamedTuple):
    """Factors of the functions in the relative differences of each pair, and their variance if lines were independent.

    Shape (n_pairs, 2, n_functions) each.
    """

    value: FloatArray
    variance: FloatArray


def _factors(
    differences: ReciprocityDifferences,
    h: ComplexArray,
    variance: FloatArray,
    functions: FloatArray,
    mixture: FloatArray,
) -> _Factors:
    p, q = differences.rows, differences.columns
    mean = (h[:, p, q] + h[:, q, p]).T / 2
    outlying = differences.line_levels(variance).factor > 1
    inverse = np.where(outlying, 0, 1 / np.sqrt(differences.pair_variance(variance)))
    size = abs(mean)
    turned = differences.values * (mean.conj() / np.maximum(size, TINY)) * inverse
    size = size * inverse
    # A real factor changes the part along h, an imaginary one the part across it.
    parts = np.stack([turned.real, turned.imag], axis=1)
    gain = functions[0]
    of_gain = np.linalg.pinv((size[:, None] ** 2 * gain) @ gain.T, hermitian=True)
    # The functions of the phase are those of the gain but for the first two: one inverse serves both.
    both = np.stack([of_gain, of_gain], axis=1)
    both[:, 1, :2] = mixture @ both[:, 1, :2]
    both[:, 1, :, :2] = both[:, 1, :, :2] @ mixture
    along = np.stack([(size * parts[:, i]) @ own.T for i, own in enumerate(functions)], axis=1)
    value = (both @ along[..., None])[..., 0]
    left = sum(
        np.square(parts[:, i] - size * (value[:, i] @ own)).sum(axis=1) for i, own in enumerate(functions)
    ) / max(2 * np.count_nonzero(~outlying), 1)
    return _Factors(value, np.maximum(np.einsum("pfaa->pfa", both) * left[:, None, None], TINY))


def _squares(factors: _Factors, weight: FloatArray, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> FloatArray:
    """Return weighted sums of squares of channels, and of what does not close, shape (2, 5, 2, n_functions).

    Each with its degrees of freedom, and what it is in the mean: by independent noise, by a unit of variance of each
    FRF, and of each channel. `weight` is broadcast to pairs, gain and phase, and functions.
    """
    n_pairs = len(rows)
    incidence = np.zeros((n_pairs, max(rows.max(), columns.max()) + 1))
    incidence[np.arange(n_pairs), rows] = 1
    incidence[np.arange(n_pairs), columns] = -1
    # Pairs last.
    w, value, noise = (np.moveaxis(one, 0, -1) for one in (weight, factors.value, factors.variance))
    root = np.sqrt(w)
    u, size, _ = np.linalg.svd(incidence * root[..., None], full_matrices=False)
    basis = np.where(size[..., None, :] > _RANK * size[..., None, :1], u, 0)
    share, rank = (basis**2).sum(axis=-1), (size > _RANK * size[..., :1]).sum(axis=-1)
    whole, of_noise = (root * value) ** 2, noise * w
    of_channels = (((root * value)[..., None, :] @ basis)[..., 0, :] ** 2).sum(axis=-1)
    apart = np.maximum(whole.sum(axis=-1) - of_channels, 0)
    of_units = 2 * w.sum(axis=-1)
    sums = np.zeros((2, 5, *apart.shape))
    shares = (share * of_noise).sum(axis=-1), 2 * (share * w).sum(axis=-1)
    for i, one in enumerate((of_channels, rank, *shares, of_units)):
        sums[0, i] = one
    for i, one in enumerate((apart, n_pairs - rank, of_noise.sum(axis=-1) - shares[0], of_units - shares[1])):
        sums[1, i] = one
    return sums


def _variances(tested: FloatArray, sized: FloatArray, reference: FloatArray) -> FloatArray:
    """Return variance and degrees of freedom of channels and of single FRFs, shape (2, 2), from sums of `_squares`.

    By the first sums it is tested whether they exceed those of noise, the third; the second ones give the size.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = np.where(reference[:, 1] > 0, reference[:, 0] / reference[:, 2], 0)
    found, degrees_noise = np.zeros((2, 2)), reference[:, 1].copy()
    for kind in (1, 0):
        expected = noise[kind] * tested[kind, 2] + found[0, 1] * tested[kind, 3]
        degrees = tested[kind, 1]
        if degrees == 0 or expected <= 0:
            continue
        if special.fdtrc(degrees, degrees_noise[kind], tested[kind, 0] / expected) < _CHANCE:
            expected = noise[kind] * sized[kind, 2] + found[0, 1] * sized[kind, 3]
            if sized[kind, 0] > expected:
                found[0, kind] = (sized[kind, 0] - expected) / sized[kind, 3 + (kind == 0)]
                found[1, kind] = degrees * (1 - expected / sized[kind, 0]) ** 2
                if kind == 1:
                    degrees_noise[0] = degrees
    return found
