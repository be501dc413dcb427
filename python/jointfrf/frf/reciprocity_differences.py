"""Differences of reciprocal entries: noise that no model enters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.frf.noise_parts import LineLevels, line_correlation, line_levels
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ReciprocityDifferences", "reciprocity_differences"]

#: FRFs that differ less than this from their transpose were made reciprocal: the difference does not show their noise.
_RECIPROCAL = 1e-9


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

    def line_levels(self, variance: FloatArray, inflation: float = 1.0) -> LineLevels:
        """Return slow variation and outlying lines of the noise of FRFs of this variance (n_freq, m, m)."""
        return line_levels(abs(self.values) ** 2 / self._variance(variance), inflation)

    def inflation(self, variance: FloatArray, line_factor: FloatArray) -> float:
        """Return how many lines carry the noise of one independent line; outlying lines do not count."""
        noise = self.values / np.sqrt(self._variance(variance))
        return line_correlation(np.where(line_factor > 1, np.nan, noise))


def reciprocity_differences(h: ComplexArray) -> ReciprocityDifferences | None:
    """Differences of reciprocal entries of measured FRFs.

    Parameters
    ----------
    h : ndarray, shape (n_freq, n_out, n_in)

    Returns
    -------
    ReciprocityDifferences or None
        None where h is not square or was made reciprocal before.
    """
    if h.shape[1] != h.shape[2]:
        return None
    rows, columns = np.triu_indices(h.shape[1], 1)
    one, two = h[:, rows, columns], h[:, columns, rows]
    shown = (abs(one - two) > _RECIPROCAL * (abs(one) + abs(two))).mean(axis=0) > 0.5
    if not shown.any():
        return None
    values = np.ascontiguousarray((one - two)[:, shown].T)
    return ReciprocityDifferences(rows[shown], columns[shown], values)
