"""Errors of channels, set-ups and single FRFs that are smooth over frequency, from FRFs that were measured twice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.bands import spread_lines
from jointfrf.frf.entry_groups import entry_groups
from jointfrf.frf.noise_parts import (
    ReciprocityDifferences,
    line_correlation,
    line_levels,
    parts_with_floor,
    reciprocity_differences,
)
from jointfrf.frf.quantiles import medians
from jointfrf.frf.setups import SetUps
from jointfrf.frf.smoothing import near_squares
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = ["CalibrationErrors", "ErrorKind", "SetUpErrors", "calibration_errors", "shows_calibration"]

#: Mean square of the FRFs of a pair above which they are a signal, relative to its expectation for noise.
_SIGNAL = 2.0
#: Number of functions of frequency that may be calibration, about as slow as an eighth of the band; the same number of
#: faster ones shows the noise. Number of lines that each needs.
_SLOW, _LINES = 8, 20
#: Number of polynomials that represent the square of frequency.
_OF_SQUARES = 3
#: Probability above which a sum of squares in excess of the noise is chance: with sixteen sums, 1.6 % of tests without
#: calibration errors show one.
_CHANCE = 0.001
#: Deviation of a set-up, in standard errors, above which it is named: by chance one of 1500 is.
_NAMED = 3.4
#: Singular values below this share of the largest are zero.
_RANK = 1e-9


#: Owner of an error: all FRFs of a response or of a force, a single FRF, all FRFs of a set-up, all FRFs.
ErrorKind = Literal["channel", "own", "setup", "common"]


class SetUpDeviation(NamedTuple):
    """Deviation of a set-up from the mean of all.

    Attributes
    ----------
    name : str
        Name of the set-up.
    part : {"gain", "phase", "resonances"}
        Kind of the deviation.
    size, error : float
        Largest deviation, relative or in rad, and its standard error there; for resonances, their relative increase in
        frequency.
    band : (float, float)
        Band in which FRFs deviate by more than half of the largest deviation, Hz.
    delay : float
        Delay of a phase that is proportional to frequency, s; NaN for other deviations.
    change : float
        Largest relative change of FRFs; for resonances the median over FRFs that were measured twice.
    """

    name: str
    part: str
    size: float
    error: float
    band: tuple[float, float]
    delay: float
    change: float


@dataclass(frozen=True, eq=False)
class SetUpErrors:
    """Relative errors that the FRFs of a set-up have in common, and errors that all set-ups have.

    Attributes
    ----------
    setups : SetUps
        Set-ups of the FRFs.
    variance, degrees : ndarray, shape (2, n_functions)
        Variance of the errors of one set-up, gain and phase, and its degrees of freedom.
    common : float
        Stated variance of a gain that all FRFs share.
    deviations : tuple of SetUpDeviation
        Set-ups that differ from the mean by more than chance.
    exceeds : bool
        Whether gains differ by more than the stated deviation.
    """

    setups: SetUps
    variance: FloatArray
    degrees: FloatArray
    common: float
    deviations: tuple[SetUpDeviation, ...]
    exceeds: bool = False

    def masks(self) -> NDArray[np.bool_]:
        """Return the FRFs of each set-up that has any, shape (n, n_responses, n_excitations)."""
        return np.stack([self.setups.of == number for number in np.flatnonzero(self.setups.counts)])


@dataclass(frozen=True, eq=False)
class CalibrationErrors:
    """Variances of relative errors of FRFs that are smooth over frequency.

    h_pq of set-up s is measured as h_pq (1 + g_p + f_q + u_s + e_pq): g_p of the response, f_q of the force, u_s of the
    set-up, e_pq of the FRF itself. Real and imaginary part, gain and phase, are sums of functions of frequency of mean
    square 1 (`functions`), each with an independent, normal factor.

    Attributes
    ----------
    span : (float, float)
        Frequency range, Hz.
    channel : ndarray, shape (2, n_functions)
        Variance of g_p - f_p, of gain and of phase, the same for all channels; 0 if it is not significant.
    own : ndarray, shape (2, n_functions)
        Variance of e_pq, of gain and of phase; 0 if it is not significant.
    channel_degrees, own_degrees : ndarray, shape (2, n_functions)
        Degrees of freedom of these variances.
    rows, columns : ndarray of int, shape (n_pairs,)
        Entries p, q of the pairs.
    differences : ndarray, shape (n_pairs, 2, n_functions)
        Significant factors of (h_pq - h_qp) over the mean of both.
    setups : SetUpErrors, optional
        Errors of set-ups, if the FRFs have several set-ups, or a stated common gain.
    resonant : bool
        Whether the gains of channels differ only by the square of frequency, like gains of sensors that resonate far
        above the band.

    Notes
    -----
    The functions of the gain are Legendre polynomials. The functions of the phase are a delay, which is proportional to
    frequency, and polynomials that are orthogonal to it. If sensors are resonant, the first function of the gain is the
    square of frequency, and all further ones are orthogonal to it. Such errors have one sign. Their mean over the
    channels, which no difference shows, is as large as their scatter if half of the sensors resonate. It is an error of
    all FRFs with the variance of g_p - f_p.
    """

    span: tuple[float, float]
    channel: FloatArray
    own: FloatArray
    channel_degrees: FloatArray
    own_degrees: FloatArray
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    differences: FloatArray
    setups: SetUpErrors | None = None
    resonant: bool = False

    def functions(self, freq_hz: FloatArray) -> FloatArray:
        """Return the functions of gain and phase, shape (2, n_functions, n_freq)."""
        return _functions(self.span, self.channel.shape[1], freq_hz.tobytes(), self.resonant)

    def _common(self) -> tuple[FloatArray, FloatArray]:
        """Return variances and degrees of freedom of errors that all FRFs share."""
        variance, degrees = np.zeros_like(self.channel), np.full_like(self.channel, np.inf)
        if self.setups is not None:
            variance[0, 0] = self.setups.common
        if self.resonant:
            # The delay follows from the damping of the same resonance, unless phases differ by more.
            for part in (0,) if self.channel[1, 1:].any() else (0, 1):
                variance[part, 0], degrees[part, 0] = self.channel[part, 0], self.channel_degrees[part, 0]
        return variance, degrees

    def resonance(self) -> float:
        """Return the resonance frequency, Hz, of one of the most different two sensors; inf if there is none."""
        if not self.resonant:
            return np.inf
        most = float(abs(self.differences[:, 0, 0]).max())
        return self.span[1] / float(np.sqrt(most * self.functions(np.array([self.span[1]]))[0, 0, 0]))

    def variance(self, freq_hz: FloatArray) -> FloatArray:
        """Return E|g_p + f_q + u_s + e_pq|^2 of each line, shape (n_freq,)."""
        variance = self.channel + self.own + self._common()[0]
        if self.setups is not None:
            variance = variance + self.setups.variance
        return np.asarray(np.einsum("ab,abl->l", variance, self.functions(freq_hz) ** 2))

    def without(self, freq_hz: FloatArray, h: ComplexArray) -> ComplexArray:
        """Return FRFs minus half of their smooth differences."""
        gain, phase = self.functions(freq_hz)
        relative = self.differences[:, 0] @ gain + 1j * (self.differences[:, 1] @ phase)
        p, q = self.rows, self.columns
        half = (relative / 4).T * (h[:, p, q] + h[:, q, p])
        left = h.copy()
        left[:, p, q] -= half
        left[:, q, p] += half
        return left

    def kinds(self) -> list[tuple[ErrorKind, FloatArray, FloatArray]]:
        """Return the kinds of errors, with variances and degrees of freedom by function, without kinds of variance 0.

        Kinds are responses and forces, each with half the variance of their difference, single FRFs, set-ups, and all.
        """
        found: list[tuple[ErrorKind, FloatArray, FloatArray]] = [
            ("channel", self.channel / 2, self.channel_degrees),
            ("own", self.own, self.own_degrees),
        ]
        if self.setups is not None:
            found.append(("setup", self.setups.variance, self.setups.degrees))
        found.append(("common", *self._common()))
        return [one for one in found if one[1].any()]

    def masks(self, kind: ErrorKind, shape: tuple[int, int]) -> NDArray[np.bool_]:
        """Return the FRFs of each error of a kind, shape (n_errors, n_responses, n_forces), for FRFs of this shape."""
        if kind == "setup" and self.setups is not None:
            return self.setups.masks()
        if kind == "common":
            return np.ones((1, *shape), bool)
        if kind == "own":
            return np.eye(shape[0] * shape[1], dtype=bool).reshape(-1, *shape)
        rows = np.broadcast_to(np.eye(shape[0], dtype=bool)[:, :, None], (shape[0], *shape))
        columns = np.broadcast_to(np.eye(shape[1], dtype=bool)[:, None, :], (shape[1], *shape))
        return np.concatenate([rows, columns])

    def level(self, which: str) -> tuple[float, float]:
        """Return root mean squares over the band of gain and of phase, rad: of "channel" or "own"."""
        gain, phase = np.sqrt(getattr(self, which).sum(axis=1)).tolist()
        return gain, phase


def calibration_errors(
    freq_hz: FloatArray,
    h: ComplexArray,
    setups: SetUps | None = None,
    *,
    reciprocal: bool = True,
    known: tuple[ReciprocityDifferences, FloatArray] | None = None,
) -> CalibrationErrors | None:
    """Return the variances of smooth errors of FRFs that were measured twice: both ways, or in two set-ups.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, m_r, m_f)
        Measured FRFs.
    setups : SetUps, optional
        Set-up of each FRF.
    reciprocal : bool
        Whether responses and forces are the same channels of a reciprocal structure.
    known : (ReciprocityDifferences, ndarray), optional
        Differences on lines in rising order, and the variance of h by their parts; not for set-ups.

    Returns
    -------
    CalibrationErrors or None
        Errors; None if differences are noise, or there are none, or there are few lines; not for several set-ups.

    Notes
    -----
    Differences of each pair are fitted by least squares, weighted by their noise. The factors are split, one after the
    other, into set-ups, u_s - u_t, channels, u_p - u_q with u = g - f, and the remainder, e_pq - e_qp.

    Noise has the same squares in slow functions as in faster ones, for any correlation of neighbouring lines that is
    short compared with the band. Sums of squares of slow functions of about one speed are therefore compared with sums
    of the faster half, each level with itself, because noise may be common to an impact. Sums that exceed them by more
    than chance give the variances.

    Gains and delays of set-ups are not tested, because a few set-ups may agree by chance. Their squares over their few
    degrees of freedom, n - 1 for n set-ups, are the variance of their mean.
    """
    freq = freq_hz
    if known is None:
        lines = np.argsort(freq_hz)[spread_lines(len(freq_hz))]
        freq, h = freq_hz[lines], h[lines]
    n_slow = min(_SLOW, freq.size // _LINES // 2)
    span = float(freq[0]), float(freq[-1])
    differences = None
    if n_slow and known is not None:
        differences = _of_directions(h, *known)
    elif n_slow:
        again = setups if setups is None else setups.on_lines(lines)
        differences = _differences(freq, h, again, reciprocal=reciprocal)
    differences = None if differences is None else differences.of_signals()
    if differences is None:
        return _stated_errors(span, setups)
    said = None if setups is None else setups.gain
    factors = _factors(differences, span, freq, 2 * n_slow)
    variance, degrees, exceeds = _split(factors, differences, n_slow, said)
    resonant = False
    if setups is None and variance[1, 0, 1:].any() and n_slow >= _OF_SQUARES:
        # Several functions that are one: the square of frequency.
        of_squares = _factors(differences, span, freq, 2 * n_slow, resonant=True)
        other = _split(of_squares, differences, n_slow, said)
        of_gain = other[0][:, 0]
        if resonant := bool(of_gain[1, 0] > 0 and not of_gain[1, 1:].any() and not of_gain[2].any()):
            factors, (variance, degrees, exceeds) = of_squares, other
    errors = None
    if setups is not None:
        deviations = _deviations(factors, differences, setups, variance, span)
        deviations += _higher_resonances(factors, differences, setups, freq)
        errors = SetUpErrors(setups, variance[0], degrees[0], setups.common_gain**2, deviations, exceeds)
    elif not variance.any():
        return None
    ways = differences.is_reciprocity
    significant = np.where(variance.any(axis=0), factors.value[ways][:, :, :n_slow], 0)
    return CalibrationErrors(
        span, variance[1], variance[2], degrees[1], degrees[2], differences.rows[ways], differences.columns[ways],
        significant, errors, resonant,
    )  # fmt: skip


def _split(
    factors: _Factors, differences: _Differences, n_slow: int, said: float | None
) -> tuple[FloatArray, FloatArray, bool]:
    """Return variances and degrees of freedom of set-ups, channels and FRFs, and whether set-ups exceed stated ones.

    Shapes are (3, 2, n_slow): gain and phase of each.
    """
    by_noise = _squares(factors, 1 / factors.variance, differences)
    found = np.zeros((2, 3, 2, n_slow))
    reference = by_noise[..., n_slow:].sum(axis=3)
    # Functions 0, 1, 2 to 3, 4 to 7 are about as fast.
    first = [one for one in (0, 1, 2, 4) if one < n_slow]
    tested = np.add.reduceat(by_noise[..., :n_slow], first, axis=3)

    @cache
    def sized() -> FloatArray:
        # Errors far above the noise have equal weight, however small the noise of a pair is.
        alike = _squares(factors, np.ones((len(factors.value), 1, 1)), differences)
        return np.asarray(np.add.reduceat(alike[..., :n_slow], first, axis=3))

    exceeds = False
    for part in range(2):
        for i, own in enumerate(map(slice, first, [*first[1:], n_slow])):
            variance_and_degrees = _variances(
                tested[:, :, part, i], sized, (part, i), reference[:, :, part],
                said if i == part == 0 else None, always=i == 0,
            )  # fmt: skip
            found[:, :, part, own] = variance_and_degrees[:, :, None]
            if i == part == 0 and said is not None:
                exceeds = bool(np.isfinite(variance_and_degrees[1, 0]))
    return found[0], found[1], exceeds


def _stated_errors(span: tuple[float, float], setups: SetUps | None) -> CalibrationErrors | None:
    """Return stated errors of gain, if no FRFs show any."""
    if setups is None or (setups.gain is None and not setups.common_gain):
        return None
    variance, none, no_pairs = np.array([[(setups.gain or 0.0) ** 2], [0.0]]), np.zeros((2, 1)), np.zeros(0, np.intp)
    errors = SetUpErrors(setups, variance, np.full((2, 1), np.inf), setups.common_gain**2, ())
    return CalibrationErrors(span, none, none, none, none, no_pairs, no_pairs, np.zeros((0, 2, 1)), errors)


def shows_calibration(h: ComplexArray) -> bool:
    """Return whether FRFs between the same channels could show smooth errors: both ways measured, on enough lines."""
    middle = h[len(h) // 2]
    return len(h) >= 2 * _LINES and middle.shape[0] > 1 and not np.allclose(middle, middle.T, rtol=1e-9, atol=0)


@lru_cache(maxsize=8)
def _functions(span: tuple[float, float], number: int, lines: bytes, resonant: bool = False) -> FloatArray:
    """Return functions of gain and phase of mean square 1 over the band, shape (2, number, n_freq), of lines in Hz."""
    middle, half = (span[1] + span[0]) / 2, (span[1] - span[0]) / 2
    whole = legendre.legvander((np.frombuffer(lines) - middle) / half, max(number, 2) - 1).T
    whole *= np.sqrt(2 * np.arange(len(whole)) + 1)[:, None]
    both = np.stack([whole, whole])
    first = min(_OF_SQUARES, len(whole))
    both[:, :first] = _mixtures(span, resonant)[:, :first, :first] @ both[:, :first]
    found = np.asarray(both[:, :number], float)
    found.flags.writeable = False
    return found


def _mixtures(span: tuple[float, float], resonant: bool) -> FloatArray:
    """Return the orthogonal matrices from the first Legendre polynomials to functions of gain and phase, (2, 3, 3)."""
    middle, half = (span[1] + span[0]) / 2, (span[1] - span[0]) / 2
    found = np.stack([np.eye(_OF_SQUARES)] * 2)
    slow, fast = middle, half / np.sqrt(3)
    found[1, :2, :2] = np.array([[slow, fast], [fast, -slow]]) / np.hypot(slow, fast)
    if resonant:
        # The reflection whose first row is the square of frequency in polynomials of mean square 1.
        square = np.array([middle**2 + half**2 / 3, 2 * middle * half / np.sqrt(3), half**2 * 2 / np.sqrt(45)])
        apart = square / np.linalg.norm(square) - np.eye(_OF_SQUARES)[0]
        found[0] -= 2 * np.outer(apart, apart) / (apart @ apart)
    return found


class _Differences(NamedTuple):
    """Differences of FRFs that were measured twice, and their channels and set-ups.

    Attributes
    ----------
    rows, columns : ndarray, shape (n_pairs,)
        Entry of the first FRF of each pair.
    values, mean : ndarray, shape (n_pairs, n_freq)
        Differences h_one - h_other, and their mean.
    noise : ndarray, shape (n_pairs, n_freq)
        Variance of the differences.
    of_channels, of_setups : ndarray, shape (n_pairs, m), (n_pairs, n_setups)
        Coefficient of each channel and set-up in a difference.
    is_reciprocity : ndarray of bool, shape (n_pairs,)
        Whether the pair is h_pq and h_qp, not one FRF of two set-ups.
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    values: ComplexArray
    mean: ComplexArray
    noise: FloatArray
    of_channels: FloatArray
    of_setups: FloatArray
    is_reciprocity: NDArray[np.bool_]

    def of_signals(self) -> _Differences | None:
        """Return the pairs whose FRFs are more than noise, which has no relative errors; None if there are none."""
        are_signals = (4 * np.square(abs(self.mean)) / self.noise).mean(axis=1) > _SIGNAL
        if are_signals.all():
            return self
        return _Differences(*(one[are_signals] for one in self)) if are_signals.any() else None


def _of_directions(h: ComplexArray, both: ReciprocityDifferences, variance: FloatArray) -> _Differences:
    """Return the differences of both directions, by the variance of the FRFs."""
    p, q = both.rows, both.columns
    return _Differences(
        p, q, both.values, (h[:, p, q] + h[:, q, p]).T / 2, both.pair_variance(variance), _of_channels(p, q, len(p)),
        np.zeros((len(p), 0)), np.ones(len(p), bool),
    )  # fmt: skip


def _of_channels(rows: NDArray[np.intp], columns: NDArray[np.intp], n_ways: int) -> FloatArray:
    """Return the coefficients of channels in differences; the first differences are between both directions."""
    found = np.zeros((len(rows), max(rows.max(), columns.max()) + 1))
    found[np.arange(n_ways), rows[:n_ways]] = 1
    found[np.arange(n_ways), columns[:n_ways]] = -1
    return found


def _differences(freq: FloatArray, h: ComplexArray, setups: SetUps | None, *, reciprocal: bool) -> _Differences | None:
    """Return the differences of FRFs that were measured twice; None if there are none."""
    both = reciprocity_differences(h, entry_groups(h, reciprocal=True)) if reciprocal else None
    if setups is None:
        near = near_squares(h)
        return None if both is None else _of_directions(h, both, both.variance_of_parts(near, medians(near.T).T, freq))
    empty = np.zeros(0, np.intp)
    rows, columns = (empty, empty) if both is None else (both.rows, both.columns)
    one, other, n_ways = h[:, rows, columns], h[:, columns, rows], len(rows)
    first, second = setups.of[rows, columns], setups.of[columns, rows]
    if setups.repeated is not None:
        again_rows, again_columns, again = setups.repeats.T
        rows, columns = np.r_[rows, again_rows], np.r_[columns, again_columns]
        one = np.concatenate([one, h[:, again_rows, again_columns]], axis=1)
        other = np.concatenate([other, setups.repeated], axis=1)
        first, second = np.r_[first, setups.of[again_rows, again_columns]], np.r_[second, again]
    if not rows.size:
        return None
    values, near = np.ascontiguousarray((one - other).T), near_squares(np.stack([one, other], axis=1))
    both_near = near.sum(axis=1).T
    usual = medians(near.T).sum(axis=1)
    relative, floor, shape = parts_with_floor(np.square(abs(values)), both_near, usual, freq)
    noise = np.maximum(relative[:, None] * both_near + (floor * usual)[:, None] * shape, TINY)
    number = np.arange(len(rows))
    of_setups = np.zeros((len(rows), len(setups.names)))
    np.add.at(of_setups, (number, first), 1)
    np.add.at(of_setups, (number, second), -1)
    return _Differences(
        rows, columns, values, (one + other).T / 2, noise, _of_channels(rows, columns, n_ways), of_setups,
        number < n_ways,
    )  # fmt: skip


class _Factors(NamedTuple):
    """Factors of the functions in the relative differences of each pair.

    Attributes
    ----------
    value, variance : ndarray, shape (n_pairs, 2, n_functions)
        Factors, and their variance if lines were independent.
    left : ndarray, shape (n_pairs, 2, n_freq)
        Residual of the differences along and across h, over their noise.
    solve : callable
        Function that returns factors of other differences, and their residual, by the same weights.
    turning : ndarray, shape (n_pairs, n_freq)
        Complex factor that rotates and weights differences; 0 on outlying lines.
    """

    value: FloatArray
    variance: FloatArray
    left: FloatArray
    solve: Callable[[ComplexArray], tuple[FloatArray, FloatArray]]
    turning: ComplexArray


def _factors(
    differences: _Differences, span: tuple[float, float], freq: FloatArray, number: int, *, resonant: bool = False
) -> _Factors:
    functions, (of_gains, of_phases) = _functions(span, number, freq.tobytes(), resonant), _mixtures(span, resonant)
    mean, root = differences.mean, np.sqrt(differences.noise)
    outlying = line_levels(differences.values / root, is_residual=False).factor > 1
    inverse = np.where(outlying, 0, 1 / root)
    size = abs(mean)
    turning = (mean.conj() / np.maximum(size, TINY)) * inverse
    size = size * inverse
    gain = functions[0]
    of_gain = np.linalg.pinv((size[:, None] ** 2 * gain) @ gain.T, hermitian=True)
    # The functions of phase and gain are equal except for the first ones, so that one inverse is sufficient.
    both, first = np.stack([of_gain, of_gain], axis=1), min(_OF_SQUARES, number)
    mixture = (of_phases @ of_gains.T)[:first, :first]
    both[:, 1, :first] = mixture @ both[:, 1, :first]
    both[:, 1, :, :first] = both[:, 1, :, :first] @ mixture.T

    def solve(turned: ComplexArray) -> tuple[FloatArray, FloatArray]:
        # A real factor changes the part along h, an imaginary one the part across it.
        parts = np.stack([turned.real, turned.imag], axis=1)
        along = np.stack([(size * parts[:, i]) @ own.T for i, own in enumerate(functions)], axis=1)
        value = (both @ along[..., None])[..., 0]
        for i, own in enumerate(functions):
            parts[:, i] -= size * (value[:, i] @ own)
        return value, parts

    value, left = solve(differences.values * turning)
    level = np.square(left).sum(axis=(1, 2)) / max(2 * np.count_nonzero(~outlying), 1)
    variance = np.maximum(np.einsum("pfaa->pfa", both) * level[:, None, None], TINY)
    return _Factors(value, variance, left, solve, turning)


def _squares(factors: _Factors, weight: FloatArray, differences: _Differences) -> FloatArray:
    """Return weighted sums of squares of set-ups, channels, and the remainder, shape (3, 6, 2, n_functions).

    Each level is orthogonal to the levels before. The entries are its sum, its degrees of freedom, and its means for
    independent noise and for a unit of variance of each set-up, of each channel, and of each FRF.
    """
    # Pairs last; weights may be the same for all functions.
    w, value, noise = (np.moveaxis(one, 0, -1) for one in (weight, factors.value, factors.variance))
    root = np.sqrt(w)
    weighted = [root[..., None] * one for one in (differences.of_setups, differences.of_channels)]
    taken: FloatArray = np.zeros((*w.shape, 0))
    of_all, of_noise = root * value, noise * w
    sums = np.zeros((3, 6, *value.shape[:-1]))
    units = [np.square(one).sum(axis=(-2, -1)) for one in weighted]
    for i, whole in enumerate((np.square(of_all).sum(axis=-1), w.shape[-1], of_noise.sum(axis=-1), *units)):
        sums[2, i] = whole
    sums[2, 5] = 2 * w.sum(axis=-1)
    for number, own in enumerate(weighted):
        if not own.any():
            continue
        basis = _orthogonal_part(own, taken)
        taken = np.concatenate([taken, basis], axis=-1)
        share = np.square(basis).sum(axis=-1)
        sums[number, 0] = np.square((of_all[..., None, :] @ basis)[..., 0, :]).sum(axis=-1)
        sums[number, 1] = basis.any(axis=-2).sum(axis=-1)
        sums[number, 2] = (share * of_noise).sum(axis=-1)
        for unit, one in enumerate(weighted):
            sums[number, 3 + unit] = np.square(basis.swapaxes(-1, -2) @ one).sum(axis=(-2, -1))
        sums[number, 5] = 2 * (share * w).sum(axis=-1)
    sums[2] = np.maximum(sums[2] - sums[0] - sums[1], 0)
    # The remainder contains no set-ups and no channels.
    sums[2, 3:5] = 0
    return sums


def _orthogonal_part(columns: FloatArray, taken: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the part of columns orthogonal to a given basis, padded by zero columns."""
    size = np.linalg.norm(columns, axis=(-2, -1))[..., None]
    left = columns - taken @ (taken.swapaxes(-1, -2) @ columns)
    u, value, _ = np.linalg.svd(left, full_matrices=False)
    return np.asarray(np.where((value > _RANK * size)[..., None, :], u, 0))


def _variances(
    tested: FloatArray,
    all_sized: Callable[[], FloatArray],
    at: tuple[int, int],
    reference: FloatArray,
    said: float | None,
    *,
    always: bool,
) -> FloatArray:
    """Return variance and degrees of freedom of set-ups, channels and FRFs, shape (2, 3), by sums of `_squares`.

    The first sums test whether they exceed sums of noise. The size follows from sums of all parts and functions, which
    are computed only if they do. Set-ups have the stated variance, unless they exceed it. Without a stated variance,
    `always` returns the estimate without a test.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = np.where(reference[:, 1] > 0, reference[:, 0] / reference[:, 2], 0)
    found, degrees_noise = np.zeros((2, 3)), reference[:, 1].copy()
    for kind in (2, 1, 0):
        degrees = tested[kind, 1]
        if kind == 0 and said is not None:
            found[:, 0] = said**2, np.inf
        expected = noise[kind] * tested[kind, 2] + found[0] @ tested[kind, 3:]
        if degrees == 0 or expected <= 0:
            continue
        is_more = special.fdtrc(degrees, degrees_noise[kind], tested[kind, 0] / expected) < _CHANCE
        if kind == 0 and always and said is None and (sized := all_sized()[:, :, *at])[0, 3] > 0:
            found[:, 0] = sized[0, 0] / sized[0, 3], degrees
        elif is_more:
            sized = all_sized()[:, :, *at]
            found[0, kind] = 0
            expected = noise[kind] * sized[kind, 2] + found[0] @ sized[kind, 3:]
            if sized[kind, 0] > expected:
                found[0, kind] = (sized[kind, 0] - expected) / sized[kind, 3 + kind]
                found[1, kind] = degrees * (1 - expected / sized[kind, 0]) ** 2
                degrees_noise[:kind] = degrees
    return found


def _deviations(
    factors: _Factors, differences: _Differences, setups: SetUps, variance: FloatArray, span: tuple[float, float]
) -> tuple[SetUpDeviation, ...]:
    """Return the set-ups that differ from the mean of those compared by more than noise, channels and FRFs explain."""
    linked = differences.of_setups.any(axis=0)
    design = differences.of_setups[:, linked]
    n_slow = variance.shape[-1]
    freq = np.linspace(*span, 201)
    functions, found = _functions(span, n_slow, freq.tobytes()), []
    for part, name in enumerate(("gain", "phase")):
        values, errors = (np.zeros((design.shape[1], freq.size)) for _ in range(2))
        for i in range(n_slow):
            noise, own = factors.variance[:, part, i], 2 * variance[2, part, i]
            inverse = np.linalg.pinv(design / np.sqrt(noise + own)[:, None]) / np.sqrt(noise + own)
            of_channels = inverse @ differences.of_channels
            spread = (inverse**2) @ (noise + own) + variance[1, part, i] * (of_channels**2).sum(axis=1)
            estimate = inverse @ factors.value[:, part, i]
            if i == 0 or variance[0, part, i] > 0:
                values += estimate[:, None] * functions[part, i]
                errors += spread[:, None] * functions[part, i] ** 2
        errors = np.sqrt(errors)
        for number, value, error in zip(np.flatnonzero(linked), values, errors, strict=True):
            at = int(abs(value).argmax())
            if abs(value[at]) > _NAMED * error[at]:
                inside = freq[abs(value) > abs(value[at]) / 2]
                is_delay = part == 1 and not variance[0, 1, 1:].any()
                delay = -float(value[at] / (2 * np.pi * freq[at])) if is_delay else np.nan
                band = (float(inside[0]), float(inside[-1]))
                found.append(
                    SetUpDeviation(
                        setups.names[int(number)], name, float(value[at]), float(error[at]), band, delay,
                        float(abs(value[at])),
                    )
                )  # fmt: skip
    return tuple(found)


def _higher_resonances(
    factors: _Factors, differences: _Differences, setups: SetUps, freq_hz: FloatArray
) -> tuple[SetUpDeviation, ...]:
    """Return set-ups with higher or lower resonances than the mean, by masses of sensors or by temperature."""
    slope = freq_hz * np.gradient(differences.mean, freq_hz, axis=1)
    # h(f / (1 + d)) = h - d f dh/df, with gain and phase, and with level and correlation of the residual.
    _, moved = factors.solve(-slope * factors.turning)
    information = np.maximum(np.square(moved).sum(axis=(1, 2)), TINY)
    higher = (factors.left * moved).sum(axis=(1, 2)) / information
    left = factors.left - higher[:, None, None] * moved
    inside = factors.turning.any(axis=0)
    level = np.maximum(np.square(left).sum(axis=(1, 2)) / max(2 * np.count_nonzero(inside), 1), TINY)
    rest = (left[:, 0] + 1j * left[:, 1]) / np.sqrt(2 * level)[:, None]
    variance = line_correlation(np.where(inside, rest, np.nan)) * level / information
    linked = np.flatnonzero(differences.of_setups.any(axis=0))
    inverse = np.linalg.pinv(differences.of_setups[:, linked] / np.sqrt(variance)[:, None]) / np.sqrt(variance)
    values, errors = inverse @ higher, np.sqrt(inverse**2 @ variance)
    usual = np.asarray(medians((abs(slope) / np.maximum(abs(differences.mean), TINY)).T))
    steep = freq_hz[usual > usual.max() / 2]
    band, found = (float(steep[0]), float(steep[-1])), []
    for number, value, error in zip(linked.tolist(), values.tolist(), errors.tolist(), strict=True):
        if abs(value) > _NAMED * error:
            change = abs(value) * float(usual.max())
            found.append(SetUpDeviation(setups.names[number], "resonances", value, error, band, np.nan, change))
    return tuple(found)
