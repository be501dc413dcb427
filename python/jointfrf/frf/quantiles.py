"""Medians and quantiles of finite numbers, without the overhead of numpy for axes, weights and NaN."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointfrf.kernel.arguments import FloatArray

__all__ = ["medians", "quantiles"]

#: Largest length of rows that are sorted: this takes no longer than a partition at one place, after which the next
#: lower number has to be searched.
_SHORT = 64


def medians(values: FloatArray) -> FloatArray:
    """Return medians over the last axis, as `numpy.median` does.

    Parameters
    ----------
    values : ndarray, shape (..., n), n > 0
        Numbers without NaN.

    Examples
    --------
    >>> import numpy as np
    >>> medians(np.array([[3.0, 1.0, 2.0, 8.0], [1.0, 1.0, 7.0, 9.0]])).tolist()
    [2.5, 4.0]
    """
    n = values.shape[-1]
    half = n // 2
    if n <= _SHORT:
        ordered = np.sort(values, axis=-1)
        return np.asarray((ordered[..., (n - 1) // 2] + ordered[..., half]) / 2)
    ordered = np.partition(values, half, axis=-1)
    middle = ordered[..., half]
    return np.asarray(middle if n % 2 else (ordered[..., :half].max(axis=-1) + middle) / 2)


def quantiles(values: FloatArray, shares: Sequence[float]) -> list[float]:
    """Return quantiles of all numbers, interpolated between neighbours, as `numpy.quantile` does.

    Parameters
    ----------
    values : ndarray, shape (n,), n > 0
        Numbers without NaN.
    shares : sequence of float
        Probabilities of the quantiles, 0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> quantiles(np.array([4.0, 0.0, 1.0, 3.0, 2.0]), [0.25, 0.9])
    [1.0, 3.6]
    """
    ordered = np.sort(values)
    found = []
    for share in shares:
        place = share * (ordered.size - 1)
        below = int(place)
        low, high = ordered[below], ordered[min(below + 1, ordered.size - 1)]
        found.append(float(low + (high - low) * (place - below)))
    return found
