"""Noise by residuals or differences of reciprocal FRFs: relative and floor part, correlated and outlying lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.entry_groups import EntryGroup
from jointfrf.frf.quantiles import medians, quantiles
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = [
    "NoiseTerms",
    "ReciprocityDifferences",
    "line_correlation",
    "line_levels",
    "noise_parts",
    "reciprocity_differences",
]

#: Entries are binned by |h|^2 into so many bins: within one the variance is nearly the same.
_BINS = 32
#: Points of the grids of the logarithm of the odds of two parts, each about the best of the last, and the reach of the
#: first: |h|^2 of lightly damped structures spans 14 decades, e^32, and either part may count at its end of them. Odds
#: are known to 1 % in the end.
_GRIDS = tuple(np.linspace(-1, 1, points)[:, None] for points in (65, 25, 25))
_WIDEST = 40.0
#: A running median is taken at so many lines within its reach: neighbouring windows share most of their lines.
_STEPS = 5
#: Iterations of the likelihood of the parts; each lowers it, and the best of the starts is taken.
_ITERATIONS = 60
#: Initial value of the parts beside the one that a start begins with, relative to it.
_BESIDE = 1e-3
#: Probability of calling one line of a sweep without outliers outlying.
_FALSE_ALARM = 1e-2
#: More outlying lines in a row than this may be a mode that smooth FRFs miss: it is one where neighbours correlate.
_SHORT_RUN = 3
_ALIKE = 0.5
#: Lines of a running median: so many, for a standard error of 22 % with one entry, and so many times those that
#: correlate.
_USUAL = 41
_USUAL_CORRELATED = 5
#: A standard deviation of the logarithm of running medians so many times that of independent lines, and of at
#: least 15 %, as smaller ones hardly change weights, is a variation over frequency.
_VARIES = 2.5
_VARIES_LEAST = 0.15
#: An autocorrelation below so many standard deviations of that of independent lines, which these exceed with a
#: probability of 0.6 %, ends the sum.
_SIGNIFICANT = 2.5
#: Both directions of a pair have noise of other size beyond so many standard deviations.
_APART = 4.0
#: Residuals beyond so many medians are cut to that, for correlations: 0.2 % of circular normal ones.
_CUT = 3.0


def noise_parts(squares: FloatArray, terms: FloatArray, *, robust: bool = False) -> FloatArray:
    """Non-negative parts of the variance, by maximum likelihood for exponentially distributed squares.

    Parameters
    ----------
    squares : ndarray, shape (n_entries, n_freq)
        |e|^2, corrected for what smoothing has taken up.
    terms : ndarray, shape (n_terms, n_entries, n_freq)
        E|e|^2 = sum over the terms of part times term. The first is |h|^2, which lines are binned by.
    robust : bool
        Whether medians of the bins count, which some lines with another error than noise do not change; as exact as
        the squares are exponentially distributed.

    Returns
    -------
    ndarray, shape (n_terms, n_entries)

    Notes
    -----
    The likelihood is -sum(log v + y/v). For two terms its maximum is found on a grid of the share of the second,
    refined twice, the size of both following from the share; for more terms by multiplicative updates
    part *= sqrt(sum term y/v^2 / sum term/v), which never lower the likelihood, from one start a term with that term
    nearly alone, and one with all alike. The estimate holds for any distribution of e with this variance; it is
    efficient for circular normal e.
    """
    return NoiseTerms(terms).parts(squares, robust=robust)


class NoiseTerms:
    """Terms of a variance as `noise_parts` takes them, binned once for several squares.

    Parameters
    ----------
    terms : ndarray, shape (n_terms, n_entries, n_freq)
    """

    def __init__(self, terms: FloatArray) -> None:
        n_freq = terms.shape[2]
        self._order: NDArray[np.intp] | None = None
        # Of more than two terms the variance is not the same within a bin.
        if len(terms) == 2 and n_freq > _BINS:
            self._edges = np.arange(_BINS + 1) * n_freq // _BINS
            # Half of the time that a partition at all edges takes.
            self._order = np.argsort(terms[0], axis=1)
            self._order += np.arange(0, terms[0].size, n_freq)[:, None]
            self._count = np.diff(self._edges).astype(float)
            binned = np.stack([self._means(np.take(term, self._order)) for term in terms])
        else:
            self._count, binned = np.ones(n_freq), terms
        self._size = np.maximum(binned @ self._count, TINY) / self._count.sum()
        self._terms = binned / self._size[:, :, None]

    def parts(self, squares: FloatArray, *, robust: bool = False) -> FloatArray:
        """Return the parts as `noise_parts` does, shape (n_terms, n_entries)."""
        y = squares
        if self._order is not None:
            y = np.take(squares, self._order)
            y = _bin_medians(y, self._edges) / np.log(2) if robust else self._means(y)
        found = (_two_parts if len(self._terms) == 2 else _several_parts)(y, self._terms, self._count)
        return np.asarray(found / self._size)

    def _means(self, values: FloatArray) -> FloatArray:
        """Return means over the bins."""
        return np.asarray(np.add.reduceat(values, self._edges[:-1], axis=1) / self._count)


def _two_parts(y: FloatArray, a: FloatArray, count: FloatArray) -> FloatArray:
    """Parts of two terms of mean 1, shape (2, n_entries)."""
    centre, reach, entries = np.zeros(len(y)), _WIDEST, np.arange(len(y))
    weighted, total, first = count * y, count.sum(), np.maximum(a[0], TINY)
    for grid in _GRIDS:
        # Variances over the part of the first, shape (grid, n_entries, n_bins), and what this part is for them.
        odds = np.exp(centre + reach * grid)
        v = odds[:, :, None] * a[1]
        v += first
        part = (weighted / v).sum(axis=2) / total
        loss = np.log(v, out=v) @ count + total * np.log(np.maximum(part, TINY))
        best = loss.argmin(axis=0), entries
        centre, reach = np.log(odds[best]), 2 * reach / (len(grid) - 1)
    return np.asarray(part[best] * np.stack([np.ones(len(y)), odds[best]]))


def _several_parts(y: FloatArray, a: FloatArray, count: FloatArray) -> FloatArray:
    """Parts of any number of terms of mean 1, shape (n_terms, n_entries)."""
    n_terms = len(a)
    starts = np.concatenate([np.eye(n_terms) + _BESIDE, np.ones((1, n_terms)) / n_terms])
    parts = starts[:, :, None] * ((y * count).sum(axis=1) / count.sum())
    for _ in range(_ITERATIONS):
        v = np.maximum(np.einsum("ste,teb->seb", parts, a), TINY)
        up = np.einsum("teb,seb->ste", a, count * y / v**2)
        down = np.einsum("teb,seb->ste", a, count / v)
        parts *= np.sqrt(up / np.maximum(down, TINY))
    v = np.maximum(np.einsum("ste,teb->seb", parts, a), TINY)
    best = (count * (np.log(v) + y / v)).sum(axis=2).argmin(axis=0)
    return np.asarray(parts[best, :, np.arange(parts.shape[2])].T)


def _bin_medians(values: FloatArray, edges: NDArray[np.intp]) -> FloatArray:
    """Medians over bins of values, shape (n_entries, n_bins): of all bins of one length at once."""
    length = np.diff(edges)
    found = np.empty((len(values), len(length)))
    for one in np.unique(length):
        own = np.flatnonzero(length == one)
        found[:, own] = medians(values[:, edges[own][:, None] + np.arange(one)])
    return found


@dataclass(frozen=True)
class LineLevels:
    """Noise power of lines, all entries together, relative to their variance.

    Attributes
    ----------
    usual : ndarray, shape (n_freq,)
        Slow variation over frequency; 1 where there is none that is significant.
    factor : ndarray, shape (n_freq,)
        By how much an outlying line exceeds the lines around; 1 for other lines.
    """

    usual: FloatArray
    factor: FloatArray


def line_levels(noise: ComplexArray, inflation: float = 1.0, *, is_residual: bool = True) -> LineLevels:
    """Find slow variation of the noise over frequency, and outlying lines.

    Parameters
    ----------
    noise : ndarray, shape (n_entries, n_freq)
        Noise of unit variance.
    inflation : float
        Lines that carry the noise of one independent line.
    is_residual : bool
        Whether the noise is measured minus smooth, in which modes that are missed show, too.

    Returns
    -------
    LineLevels

    Notes
    -----
    The mean square over the entries is compared with its running median. Its distribution without outliers is taken to
    be a gamma distribution whose shape follows from the quartiles of its logarithm, so entries that share their noise
    and noise that is not circular are allowed for. The running median, relative to its own median, is the slow
    variation if its spread is well above that of medians of so many independent lines. Of a residual more than a few
    lines in a row are outlying only where it jumps from line to line: else smooth FRFs do not fit there.
    """
    line = (noise.real**2 + noise.imag**2).mean(axis=0)
    n_freq = len(line)
    reach = int(min(max(_USUAL, _USUAL_CORRELATED * inflation), n_freq)) // 2
    usual = np.maximum(_running_median(line, reach), TINY)
    factor: FloatArray = line / usual
    quarter, three_quarters = quantiles(np.log(np.maximum(factor, TINY)), (0.25, 0.75))
    shape = (1.349 / max(three_quarters - quarter, 1e-3)) ** 2
    limit = special.gammainccinv(shape, _FALSE_ALARM / n_freq) / special.gammaincinv(shape, 0.5)
    by_chance = np.sqrt(inflation / (shape * (2 * reach + 1)))
    low, high = quantiles(np.log(usual), (0.1, 0.9))
    varies = (high - low) / 2.56 > max(_VARIES * by_chance, _VARIES_LEAST)
    slow = usual / medians(usual) if varies else np.ones(n_freq)
    outlying = factor > limit
    if is_residual:
        outlying &= ~_missed(noise, outlying)
    return LineLevels(slow, np.where(outlying, factor, 1.0))


def _missed(residual: ComplexArray, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the chosen lines are in long runs with a smooth residual."""
    missed = np.zeros_like(chosen)
    if np.count_nonzero(chosen) <= _SHORT_RUN:
        return missed
    steps = np.diff(np.pad(chosen.astype(int), 1))
    for first, end in zip(np.flatnonzero(steps > 0), np.flatnonzero(steps < 0), strict=True):
        if end - first > _SHORT_RUN:
            run = residual[:, first:end] / np.sqrt((abs(residual[:, first:end]) ** 2).sum(axis=0))
            alike = (run[:, 1:] * run[:, :-1].conj()).sum(axis=0).real.mean()
            missed[first:end] = alike > _ALIKE
    return missed


def _running_median(values: FloatArray, reach: int) -> FloatArray:
    """Median over so many lines on either side, interpolated between every few lines."""
    middles, windows = _windows(len(values), reach)
    return np.asarray(np.interp(np.arange(len(values)), middles, medians(values[windows])))


@lru_cache(maxsize=16)
def _windows(n: int, reach: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return middle lines, and the lines of the window about each; beyond the ends they are reflected."""
    middles = np.append(np.arange(0, n - 1, max(1, reach // _STEPS)), n - 1)
    around = np.pad(np.arange(n), reach, mode="reflect")
    return middles, around[middles[:, None] + np.arange(2 * reach + 1)]


def line_correlation(noise: ComplexArray, share: float = 0.0) -> float:
    """How many neighbouring lines carry the noise of one independent line.

    Parameters
    ----------
    noise : ndarray, shape (n_entries, n_freq)
        Noise of unit variance; NaN where it is not to count.
    share : float
        Part of the noise power that smoothing has taken up, 0 for noise that no smooth FRF was subtracted from.

    Returns
    -------
    float
        1 + 2 sum of the autocorrelations up to the first that is not significant; at least 1.
    """
    n_freq = noise.shape[1]
    size: FloatArray = np.abs(noise)
    known: NDArray[np.bool_] = np.isfinite(size)
    whole = bool(known.all())
    size = np.where(known, size, 0)
    if n_freq < 16 or not size.any():
        return 1.0
    usual = medians(size) if whole else np.nanmedian(np.where(known, size, np.nan), axis=1)
    limit = _CUT * usual[:, None]
    cut = np.where(known, noise, 0) * np.where(size > limit, limit / np.where(size > limit, size, 1), 1)
    n_lags = n_freq // 4
    whole_pairs = len(noise) * (n_freq - np.arange(n_lags, dtype=float))
    pairs = whole_pairs if whole else np.maximum(_autocorrelation(known.astype(float), n_lags), 1)
    rho = _autocorrelation(cut, n_lags) / pairs
    rho = (rho / rho[0] * (1 - share) + share)[1:]
    small = rho < _SIGNIFICANT / np.sqrt(pairs[0])
    last = int(small.argmax()) if small.any() else len(rho)
    lags = np.arange(1, last + 1)
    return float(max(1.0, 1 + 2 * (rho[:last] * (1 - lags / n_freq)).sum()))


def _autocorrelation(x: ComplexArray | FloatArray, n_lags: int) -> FloatArray:
    """Return sums over entries and lines of Re x_l conj(x_(l+lag)), lag 0 to n_lags - 1."""
    length = 1 << int(np.ceil(np.log2(x.shape[1] + n_lags)))
    power = (abs(np.fft.fft(x, length, axis=1)) ** 2).sum(axis=0)
    return np.fft.ifft(power).real[:n_lags]


@dataclass(frozen=True)
class ReciprocityDifferences:
    """h_pq - h_qp of the pairs that differ.

    Attributes
    ----------
    rows, columns : ndarray of int, shape (n_pairs,)
    values : ndarray, shape (n_pairs, n_freq)
    """

    rows: np.ndarray
    columns: np.ndarray
    values: ComplexArray

    def pair_variance(self, variance: FloatArray) -> FloatArray:
        """Return the variance of the differences, shape (n_pairs, n_freq), by that of the FRFs."""
        total: FloatArray = (variance[:, self.rows, self.columns] + variance[:, self.columns, self.rows]).T
        return np.maximum(total, TINY)

    def variance_of_parts(self, near: FloatArray, size: FloatArray) -> FloatArray:
        """Return the variance of all entries from relative and floor parts of the differences.

        Parameters
        ----------
        near : ndarray, shape (n_freq, m, m)
            |h|^2 over neighbouring lines.
        size : ndarray, shape (m, m)
            Its medians.

        Returns
        -------
        ndarray, shape (n_freq, m, m)
            Both entries of a pair are given the same parts; an entry that is in no pair has the means of those in its
            row and column, floors relative to the median of |h|^2.
        """
        pair_size = size[self.rows, self.columns] + size[self.columns, self.rows]
        both: FloatArray = (near[:, self.rows, self.columns] + near[:, self.columns, self.rows]).T
        flat = np.broadcast_to(pair_size[:, None], both.shape)
        parts = noise_parts(np.square(abs(self.values)), np.stack([both, flat]), robust=True)
        means = np.zeros((2, *size.shape))
        means[:, self.rows, self.columns] = means[:, self.columns, self.rows] = parts
        number = np.count_nonzero(means.any(axis=0), axis=0)
        by_row = means.sum(axis=1) / np.maximum(number, 1)
        by_row[:, number == 0] = parts.mean(axis=1, keepdims=True)
        rest = ~means.any(axis=0)
        means[:, rest] = ((by_row[:, :, None] + by_row[:, None, :]) / 2)[:, rest]
        return np.asarray(means[0] * near + means[1] * size)

    def line_levels(self, variance: FloatArray, inflation: float = 1.0) -> LineLevels:
        """Return slow variation and outlying lines of the noise of FRFs of this variance (n_freq, m, m)."""
        noise = self.values / np.sqrt(self.pair_variance(variance))
        return line_levels(noise, inflation, is_residual=False)

    def ratio(self, variance: FloatArray) -> float:
        """Return the differences over what FRFs of this variance (n_freq, m, m) have, robustly."""
        squares = abs(self.values) ** 2 / self.pair_variance(variance)
        return float(np.sqrt(medians(squares.ravel()) / np.log(2)))

    def common_level(self, h: ComplexArray, smooth: ComplexArray) -> float:
        """Return the relative level of the noise where one is enough: for all pairs, no floor, both directions; else 0.

        Parameters
        ----------
        h, smooth : ndarray, shape (n_freq, m, m)
            Measured and smooth FRFs.

        Notes
        -----
        By the likelihood of the differences with one level against that with parts of each pair, and by the mean of
        ln(|h_pq - s|^2 / |h_qp - s|^2), whose variance is pi^2/3 a line.
        """
        squares, size = np.square(np.abs(self.values)), self.pair_variance(np.square(np.abs(h)))
        n_pairs, n_freq = squares.shape
        parts = noise_parts(squares, np.stack([size, np.ones_like(size)]))
        described = np.maximum(parts[0][:, None] * size + parts[1][:, None], TINY)
        power = float((squares / size).mean())
        common = power * size
        gain = 2 * float((np.log(common / described) + squares / common - squares / described).sum())
        left = np.maximum(abs(h - smooth) ** 2, TINY)
        apart = np.log(left[:, self.rows, self.columns] / left[:, self.columns, self.rows]).mean(axis=0)
        chance = _APART * np.pi / np.sqrt(3 * n_freq)
        is_common = gain < (2 * n_pairs - 1) * np.log(n_pairs * n_freq) and abs(apart).max() < chance
        return float(np.sqrt(power)) if is_common else 0.0

    def inflation(self, variance: FloatArray, line_factor: FloatArray) -> float:
        """Return how many lines carry the noise of one independent line; outlying lines do not count."""
        noise = self.values / np.sqrt(self.pair_variance(variance))
        return line_correlation(np.where(line_factor > 1, np.nan, noise))


def reciprocity_differences(h: ComplexArray, groups: Sequence[EntryGroup]) -> ReciprocityDifferences | None:
    """Differences of reciprocal entries of measured FRFs.

    Parameters
    ----------
    h : ndarray, shape (n_freq, n_out, n_in)
    groups : sequence of EntryGroup
        Of the entries of a reciprocal structure.

    Returns
    -------
    ReciprocityDifferences or None
        None where h is not square or was made reciprocal before. Entries that are zero to rounding do not count.
    """
    if h.shape[1] != h.shape[2]:
        return None
    rows = np.concatenate([group.rows[group.repeated] for group in groups] or [np.zeros(0, np.intp)])
    columns = np.concatenate([group.columns[group.repeated] for group in groups] or [np.zeros(0, np.intp)])
    if not rows.size:
        return None
    values = np.ascontiguousarray((h[:, rows, columns] - h[:, columns, rows]).T)
    return ReciprocityDifferences(rows, columns, values)
