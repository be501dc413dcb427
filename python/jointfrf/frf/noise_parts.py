"""Noise by residuals or differences of reciprocal FRFs: relative and floor part, correlated and outlying lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointfrf.frf.entry_groups import EntryGroup
from jointfrf.frf.quantiles import medians
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.kernel.call import call, call_for_number

__all__ = [
    "ReciprocityDifferences",
    "acceleration_floor",
    "describes_better",
    "is_smooth",
    "line_correlation",
    "line_levels",
    "noise_parts",
    "parts_with_floor",
    "reciprocity_differences",
]

#: Difference of -2 log likelihood: odds of 20 to 1.
_CLEARLY = 6.0
#: Share of the median line below which a floor of acceleration is constant, because sensors end there.
_LOWEST = 1e-3
#: Largest square, relative to its expectation, that counts in a choice: outlying lines have more.
_CAPPED = 10.0
#: Number of standard deviations beyond which both directions of a pair have different noise.
_APART = 4.0


def noise_parts(squares: FloatArray, terms: FloatArray, *, robust: bool = False, common: bool = False) -> FloatArray:
    """Return non-negative parts of the variance, by maximum likelihood for exponentially distributed squares.

    Parameters
    ----------
    squares : ndarray, shape (n_entries, n_freq)
        Squares |e|^2, corrected for the part that smoothing has absorbed.
    terms : ndarray, shape (n_terms, n_entries, n_freq)
        Terms of E|e|^2 = sum over the terms of part times term. The first is |h|^2, by which lines are binned.
    robust : bool
        Whether to use medians of the bins, which a few lines with another error than noise do not change; they are as
        exact as the squares are exponentially distributed. Default False.
    common : bool
        Whether the second of two parts is equal in all entries, unless the squares clearly show that it differs,
        because few lines of an entry may show it; default False. Entries that do not clearly show one have none.

    Returns
    -------
    ndarray, shape (n_terms, n_entries)
        Parts of the variance.

    Notes
    -----
    The estimate is valid for any distribution of e with this variance; it is efficient for circular normal e.
    """
    parts = np.empty(terms.shape[:2])
    method = "C" if common else "R" if robust else "L"
    squares, terms = np.ascontiguousarray(squares), np.ascontiguousarray(terms)
    call("noise_parts", (method, *terms.shape, squares, terms, parts))
    return parts


def acceleration_floor(freq_hz: FloatArray) -> FloatArray:
    """Return the variance of receptances by noise that is constant in acceleration, 1 at the median line."""
    middle = float(medians(freq_hz))
    lowest = max(_LOWEST * middle, float(np.min(freq_hz, where=freq_hz > 0, initial=np.inf)))
    return np.asarray((middle / np.maximum(freq_hz, lowest)) ** 4) if middle > 0 else np.ones(freq_hz.size)


def describes_better(loss: float, other: float) -> bool:
    """Return whether -2 log likelihood of another floor is clearly lower."""
    return loss < other - _CLEARLY


def parts_with_floor(
    squares: FloatArray, near: FloatArray, usual: FloatArray, freq_hz: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a relative part and a floor of the variance by entry, robustly, and the shape of the floor.

    Parameters
    ----------
    squares : ndarray, shape (n_entries, n_freq)
        Squares |e|^2.
    near : ndarray, shape (n_entries, n_freq)
        |h|^2 over neighbouring lines.
    usual : ndarray, shape (n_entries,)
        Unit of the floor.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.

    Returns
    -------
    relative, floor : ndarray, shape (n_entries,)
        E|e|^2 = relative near + floor usual shape.
    shape : ndarray, shape (n_freq,)
        Constant in receptance or in accelerance, whichever describes the squares better.
    """
    found = []
    for shape in (np.ones(freq_hz.size), acceleration_floor(freq_hz)):
        unit = np.broadcast_to(usual[:, None], squares.shape)
        relative, floor = noise_parts(squares / shape, np.stack([near / shape, unit]), robust=True)
        loss = _robust_loss(squares, relative[:, None] * near + floor[:, None] * unit * shape)
        found.append((loss, relative, floor, shape))
    constant, accelerated = found
    return (accelerated if describes_better(accelerated[0], constant[0]) else constant)[1:]


def _robust_loss(squares: FloatArray, variance: FloatArray) -> float:
    """Return -2 log likelihood of exponentially distributed squares of this mean; none counts more than `_CAPPED`."""
    variance = np.maximum(variance, TINY)
    return 2 * float((np.log(variance) + np.minimum(squares / variance, _CAPPED)).sum())


@dataclass(frozen=True)
class LineLevels:
    """Noise power of lines, all entries together, relative to their variance.

    Attributes
    ----------
    usual : ndarray, shape (n_freq,)
        Slow variation over frequency; 1 if it is not significant.
    factor : ndarray, shape (n_freq,)
        Ratio of an outlying line to the lines around it; 1 for other lines.
    """

    usual: FloatArray
    factor: FloatArray


def line_levels(noise: ComplexArray, inflation: float = 1.0, *, is_residual: bool = True) -> LineLevels:
    """Return slow variation of the noise over frequency, and outlying lines.

    Parameters
    ----------
    noise : ndarray, shape (n_entries, n_freq)
        Noise of unit variance.
    inflation : float
        Number of lines that carry the noise of one independent line, default 1.
    is_residual : bool
        Whether the noise is measured minus smooth FRFs, which also shows missing modes; default True.

    Returns
    -------
    LineLevels
        Levels of all lines.
    """
    usual, factor = np.empty((2, noise.shape[1]))
    call("line_levels", (*noise.shape, np.ascontiguousarray(noise), inflation, int(is_residual), usual, factor))
    return LineLevels(usual, factor)


def is_smooth(values: ComplexArray) -> bool:
    """Return whether errors, shape (n_series, n_freq), are smooth: phases of neighbouring lines agree by more than 1/2.

    The agreement is the mean cosine of their difference; sizes do not count, because few lines may have most noise.
    """
    phasor = values / np.maximum(np.abs(values), TINY)
    return float((phasor[:, 1:] * phasor[:, :-1].conj()).real.mean()) > 0.5


def line_correlation(noise: ComplexArray, share: float = 0.0) -> float:
    """Return the number of neighbouring lines that carry the noise of one independent line.

    Parameters
    ----------
    noise : ndarray, shape (n_entries, n_freq)
        Noise of unit variance; NaN to exclude a value.
    share : float
        Part of the noise power that smoothing has absorbed, default 0 for noise without smoothing.

    Returns
    -------
    float
        Value of 1 + 2 sum of the autocorrelations up to the first that is not significant; at least 1.
    """
    found, _ = call_for_number("line_correlation", (*noise.shape, noise.astype(np.complex128), share))
    return found


@dataclass(frozen=True)
class ReciprocityDifferences:
    """h_pq - h_qp of the pairs that differ.

    Attributes
    ----------
    rows, columns : ndarray of int, shape (n_pairs,)
        Entries p and q.
    values : ndarray, shape (n_pairs, n_freq)
        Differences.
    """

    rows: np.ndarray
    columns: np.ndarray
    values: ComplexArray

    def pair_variance(self, variance: FloatArray) -> FloatArray:
        """Return the variance of the differences, shape (n_pairs, n_freq), from the variance of the FRFs."""
        total: FloatArray = (variance[:, self.rows, self.columns] + variance[:, self.columns, self.rows]).T
        return np.maximum(total, TINY)

    def parts(self, near: FloatArray, size: FloatArray, freq_hz: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return relative and floor parts of all entries by the differences.

        Parameters
        ----------
        near : ndarray, shape (n_freq, m, m)
            Squares |h|^2, or their means over neighbouring lines.
        size : ndarray, shape (m, m)
            Medians of `near`.
        freq_hz : ndarray, shape (n_freq,)
            Frequencies, Hz.

        Returns
        -------
        parts : ndarray, shape (2, m, m)
            Relative part, and floor relative to `size`. Both entries of a pair have the same parts; an entry that is in
            no pair has the means of entries in its row and column.
        shape : ndarray, shape (n_freq,)
            Dependence of the floor on frequency.
        """
        pair_size = size[self.rows, self.columns] + size[self.columns, self.rows]
        both: FloatArray = (near[:, self.rows, self.columns] + near[:, self.columns, self.rows]).T
        *of_pairs, shape = parts_with_floor(np.square(abs(self.values)), both, pair_size, freq_hz)
        means = np.zeros((2, *size.shape))
        means[:, self.rows, self.columns] = means[:, self.columns, self.rows] = of_pairs
        number = np.count_nonzero(means.any(axis=0), axis=0)
        by_row = means.sum(axis=1) / np.maximum(number, 1)
        by_row[:, number == 0] = np.mean(of_pairs, axis=1, keepdims=True)
        rest = ~means.any(axis=0)
        means[:, rest] = ((by_row[:, :, None] + by_row[:, None, :]) / 2)[:, rest]
        return means, shape

    def variance_of_parts(self, near: FloatArray, size: FloatArray, freq_hz: FloatArray) -> FloatArray:
        """Return the variance of all entries by `parts`, shape (n_freq, m, m)."""
        (relative, floor), shape = self.parts(near, size, freq_hz)
        return np.asarray(relative * near + floor * size * shape[:, None, None])

    def line_levels(self, variance: FloatArray, inflation: float = 1.0) -> LineLevels:
        """Return slow variation and outlying lines of the noise of FRFs of this variance (n_freq, m, m)."""
        noise = self.values / np.sqrt(self.pair_variance(variance))
        return line_levels(noise, inflation, is_residual=False)

    def asymmetry(self, h: ComplexArray) -> float:
        """Return the median of |h_pq - h_qp| over the root of both squares, if it is smooth over frequency; else 0."""
        relative = self._relative(h)
        return float(medians(np.abs(relative).ravel())) if is_smooth(relative) else 0.0

    def are_smooth(self, h: ComplexArray) -> bool:
        """Return whether the differences, relative to the FRFs (n_freq, m, m), are smooth over frequency."""
        return is_smooth(self._relative(h))

    def _relative(self, h: ComplexArray) -> ComplexArray:
        return np.asarray(self.values / np.sqrt(self.pair_variance(np.square(np.abs(h)))))

    def ratio(self, variance: FloatArray) -> float:
        """Return the ratio of the differences to their size for FRFs of this variance (n_freq, m, m), robustly."""
        squares = abs(self.values) ** 2 / self.pair_variance(variance)
        return float(np.sqrt(medians(squares.ravel()) / np.log(2)))

    def common_level(self, freq_hz: FloatArray, h: ComplexArray, smooth: ComplexArray) -> float:
        """Return one relative level if it describes the noise: all pairs, no floor, both directions; else 0.

        Parameters
        ----------
        freq_hz : ndarray, shape (n_freq,)
            Frequencies, Hz.
        h, smooth : ndarray, shape (n_freq, m, m)
            Measured and smooth FRFs.

        Notes
        -----
        The robust likelihood of the differences with one level is compared with the one with parts of each pair. The
        mean of ln(|h_pq - s|^2 / |h_qp - s|^2) is tested, whose variance is pi^2/3 a line.
        """
        squares, size = np.square(np.abs(self.values)), self.pair_variance(np.square(np.abs(h)))
        n_pairs, n_freq = squares.shape
        relative, floor, shape = parts_with_floor(squares, size, np.ones(n_pairs), freq_hz)
        described = relative[:, None] * size + floor[:, None] * shape
        ratio = squares / size
        power = float(np.minimum(ratio, _CAPPED * medians(ratio.ravel())).mean())
        gain = _robust_loss(squares, power * size) - _robust_loss(squares, described)
        left = np.maximum(abs(h - smooth) ** 2, TINY)
        apart = np.log(left[:, self.rows, self.columns] / left[:, self.columns, self.rows]).mean(axis=0)
        chance = _APART * np.pi / np.sqrt(3 * n_freq)
        is_common = gain < (2 * n_pairs - 1) * np.log(n_pairs * n_freq) and abs(apart).max() < chance
        return float(np.sqrt(power)) if is_common else 0.0

    def inflation(self, variance: FloatArray, line_factor: FloatArray) -> float:
        """Return the number of lines with the noise of one independent line; outlying lines do not count."""
        noise = self.values / np.sqrt(self.pair_variance(variance))
        return line_correlation(np.where(line_factor > 1, np.nan, noise))


def reciprocity_differences(h: ComplexArray, groups: Sequence[EntryGroup]) -> ReciprocityDifferences | None:
    """Return differences of reciprocal entries of measured FRFs.

    Parameters
    ----------
    h : ndarray, shape (n_freq, n_out, n_in)
        Measured FRFs.
    groups : sequence of EntryGroup
        Groups of entries of a reciprocal structure.

    Returns
    -------
    ReciprocityDifferences or None
        Differences; None if h is not square or was made reciprocal before. Entries that are zero to rounding do not
        count.
    """
    if h.shape[1] != h.shape[2]:
        return None
    rows = np.concatenate([group.rows[group.repeated] for group in groups] or [np.zeros(0, np.intp)])
    columns = np.concatenate([group.columns[group.repeated] for group in groups] or [np.zeros(0, np.intp)])
    if not rows.size:
        return None
    values = np.ascontiguousarray((h[:, rows, columns] - h[:, columns, rows]).T)
    return ReciprocityDifferences(rows, columns, values)
