"""Entries of a matrix of FRFs that are measured twice, are zero, or have common poles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ZERO", "EntryGroup", "connected", "entry_groups", "own_size", "reciprocity_noise"]

#: Share of sqrt|h_pp h_qq|, or of the usual size in its row and column, below which an FRF is zero to rounding.
ZERO = 1e-8
#: Relative difference of a pair below which it was made reciprocal: it is one measurement.
_RECIPROCAL = 1e-9
#: Number of times that rows and columns are scaled in turn, until each has a largest entry near 1.
_SCALINGS = 4


def own_size(h: ComplexArray) -> FloatArray:
    """Return |h_pp h_qq|, the size against which an FRF h_pq is zero or not; shape of h."""
    diagonal = abs(np.diagonal(h, axis1=-2, axis2=-1))
    return diagonal[..., :, None] * diagonal[..., None, :]


def reciprocity_noise(h: ComplexArray) -> FloatArray:
    """Return the relative noise level from the differences h_pq - h_qp, robustly.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)
        FRFs of a reciprocal structure, measured in both directions.

    Returns
    -------
    ndarray, shape (r,)
        Relative noise level; 0 if h is symmetric.

    Notes
    -----
    For circular noise of level s, |h_pq - h_qp|^2 / (|h_pq|^2 + |h_qp|^2) is s^2 times an exponential variable, whose
    median is log 2. A few wrong FRFs do not change a median. FRFs that are zero to rounding are omitted.
    """
    m = h.shape[-1]
    p, q = np.triu_indices(m, 1)
    above, below = h[..., p, q], h[..., q, p]
    size = abs(above) ** 2 + abs(below) ** 2
    counts = size > 2 * ZERO**2 * own_size(h)[..., p, q]
    ratio = np.divide(abs(above - below) ** 2, size, out=np.zeros_like(size), where=counts)
    medians = [np.median(own[some]) if some.any() else 0.0 for own, some in zip(ratio, counts, strict=True)]
    return np.asarray(np.sqrt(np.array(medians) / np.log(2)))


@dataclass(frozen=True)
class EntryGroup:
    """Entries that are coupled with each other and with no entry of another group.

    Attributes
    ----------
    rows, columns : ndarray of int, shape (n_entries,)
        Places of the entries; for a reciprocal pair the place above the diagonal.
    paired : ndarray of bool, shape (n_entries,)
        Whether the entry is one of a reciprocal pair.
    repeated : ndarray of bool, shape (n_entries,)
        Whether the pair contains two measurements; False if it was made reciprocal before.
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    paired: NDArray[np.bool_]
    repeated: NDArray[np.bool_]

    def means(self, h: ComplexArray, variance: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Return the entries and their variance, one a row; two measurements give their weighted mean."""
        mean = np.ascontiguousarray(h[:, self.rows, self.columns].T)
        spread = np.ascontiguousarray(variance[:, self.rows, self.columns].T)
        rows, columns, twice = self.rows[self.repeated], self.columns[self.repeated], self.repeated
        other, other_variance = h[:, columns, rows].T, variance[:, columns, rows].T
        share = other_variance / (spread[twice] + other_variance)
        mean[twice] = share * mean[twice] + (1 - share) * other
        spread[twice] *= share
        return mean, spread

    def put(self, values: ComplexArray | FloatArray, into: ComplexArray | FloatArray) -> None:
        """Write values, one entry a row, to both places of a pair."""
        into[:, self.rows, self.columns] = values.T
        rows, columns = self.rows[self.paired], self.columns[self.paired]
        into[:, columns, rows] = values[self.paired].T


def entry_groups(h: ComplexArray, *, reciprocal: bool) -> list[EntryGroup]:
    """Return the groups; entries that are zero to rounding belong to none.

    Parameters
    ----------
    h : ndarray, shape (n_freq, n_out, n_in)
        FRFs.
    reciprocal : bool
        Whether entries (p, q) and (q, p) of square matrices are the same FRF.

    Returns
    -------
    list of EntryGroup
        Groups of coupled entries.
    """
    counts = _counting(h)
    n_out, n_in = counts.shape
    reciprocal = reciprocal and n_out == n_in
    if reciprocal:
        counts |= counts.T
    links = np.zeros((n_out + n_in, n_out + n_in), np.bool_)
    links[:n_out, n_out:] = counts
    if reciprocal:
        links[:n_out, n_out:] |= np.diag(counts.any(axis=0))
    label = connected(links)
    if reciprocal:
        counts = np.triu(counts)
    rows, columns = np.nonzero(counts)
    groups = []
    for one in np.unique(label[rows]):
        own = label[rows] == one
        p, q = rows[own], columns[own]
        paired = (p != q) & reciprocal
        repeated = paired.copy()
        one, two = h[:, p[paired], q[paired]], h[:, q[paired], p[paired]]
        repeated[paired] = (abs(one - two) > _RECIPROCAL * (abs(one) + abs(two))).mean(axis=0) > 0.5
        groups.append(EntryGroup(p, q, paired, repeated))
    return groups


def connected(links: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return for each node the number of its connected set, in the order of their first nodes.

    Parameters
    ----------
    links : ndarray of bool, shape (n, n)
        Whether two nodes are linked, in either direction.

    Returns
    -------
    ndarray of int, shape (n,)
        Number of the set of each node.

    Examples
    --------
    >>> import numpy as np
    >>> connected(np.array([[0, 0, 1], [0, 0, 0], [0, 0, 0]], bool)).tolist()
    [0, 1, 0]
    """
    label = np.full(len(links), -1)
    both = links | links.T
    for node in range(len(links)):
        if label[node] < 0:
            reached = both[node] | (np.arange(len(links)) == node)
            while (more := both[reached].any(axis=0) & ~reached).any():
                reached |= more
            label[reached] = label.max() + 1
    return label


def _counting(h: ComplexArray) -> NDArray[np.bool_]:
    """Return whether each entry is not zero, for any units of its row and column."""
    size = np.sqrt((h.real**2 + h.imag**2).mean(axis=0))
    for _ in range(_SCALINGS):
        for axis in (0, 1):
            largest = size.max(axis=axis, keepdims=True)
            size = size / np.where(largest > 0, largest, 1)
    return np.asarray(size > ZERO)
