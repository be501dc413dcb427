"""Fewer points of long curves, without hiding a peak: the smallest and largest value of each column stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import FloatArray

__all__ = ["thinned_dots", "thinned_line"]

#: Dots of a column that are kept: its extremes, and some between.
_DOTS = 5


def thinned_line(y: FloatArray, most: int) -> NDArray[np.intp]:
    """Choose points of a curve: of each of `most` / 2 columns of neighbouring points the lowest and the highest.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Values in the order of x; NaN makes a gap, which stays where it is a column wide.
    most : int
        Points at most.

    Returns
    -------
    ndarray of int
        Increasing.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.report.thinning import thinned_line
    >>> thinned_line(np.array([0.0, 5.0, 1.0, 2.0, -7.0, 3.0, 4.0, 0.0]), 4).tolist()
    [0, 1, 4, 6]
    """
    if y.size <= most:
        return np.arange(y.size)
    starts = _columns(y.size, max(most // 2, 1))
    finite = np.isfinite(y)
    lowest = _first_where(y, np.minimum.reduceat(np.where(finite, y, np.inf), starts), starts)
    highest = _first_where(y, np.maximum.reduceat(np.where(finite, y, -np.inf), starts), starts)
    return np.unique(np.concatenate([lowest, highest]))


def thinned_dots(y: FloatArray, most: int) -> NDArray[np.intp]:
    """Choose dots: of each column of neighbours the lowest, the highest, and others evenly spread; as `thinned_line`.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.report.thinning import thinned_dots
    >>> y = np.sin(np.arange(1000.0) ** 2)
    >>> kept = thinned_dots(y, 100)
    >>> bool(kept.size <= 100), bool(y[kept].max() == y.max())
    (True, True)
    """
    if y.size <= most:
        return np.arange(y.size)
    columns = max(most // _DOTS, 1)
    evenly = np.linspace(0, y.size - 1, (_DOTS - 2) * columns).astype(np.intp)
    return np.unique(np.concatenate([thinned_line(y, 2 * columns), evenly]))


def _columns(size: int, count: int) -> NDArray[np.intp]:
    return np.linspace(0, size, count, endpoint=False).astype(np.intp)


def _first_where(y: FloatArray, value: FloatArray, starts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the first place in each column that holds its value; its first place where it holds none."""
    column = np.repeat(np.arange(starts.size), np.diff(np.append(starts, y.size)))
    hit = np.flatnonzero(y == value[column])
    found = starts.copy()
    own, first = np.unique(column[hit], return_index=True)
    found[own] = hit[first]
    return found
