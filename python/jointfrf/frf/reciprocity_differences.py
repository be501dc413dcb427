"""Differences of reciprocal entries: noise that no model enters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointfrf.frf.entry_groups import EntryGroup
from jointfrf.frf.noise_parts import LineLevels, line_correlation, line_levels, noise_parts
from jointfrf.frf.quantiles import medians
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ReciprocityDifferences", "reciprocity_differences"]


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

    def _variance(self, variance: FloatArray) -> FloatArray:
        total: FloatArray = (variance[:, self.rows, self.columns] + variance[:, self.columns, self.rows]).T
        return np.maximum(total, np.finfo(float).tiny)

    def variance_of_parts(self, near: FloatArray) -> FloatArray:
        """Return the variance of all entries from relative and floor parts of the differences.

        Parameters
        ----------
        near : ndarray, shape (n_freq, m, m)
            |h|^2 over neighbouring lines.

        Returns
        -------
        ndarray, shape (n_freq, m, m)
            Both entries of a pair are given the same parts; an entry that is in no pair has the means of those in its
            row and column, floors relative to the median of |h|^2.
        """
        size = medians(near.T).T
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
        variance: FloatArray = means[0] * near + means[1] * size
        return variance

    def line_levels(self, variance: FloatArray, inflation: float = 1.0) -> LineLevels:
        """Return slow variation and outlying lines of the noise of FRFs of this variance (n_freq, m, m)."""
        noise = self.values / np.sqrt(self._variance(variance))
        return line_levels(noise, inflation, is_residual=False)

    def inflation(self, variance: FloatArray, line_factor: FloatArray) -> float:
        """Return how many lines carry the noise of one independent line; outlying lines do not count."""
        noise = self.values / np.sqrt(self._variance(variance))
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
