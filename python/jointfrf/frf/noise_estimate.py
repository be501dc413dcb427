"""What measured FRFs show of their own noise."""

from __future__ import annotations

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ZERO", "own_size", "reciprocity_noise"]

#: An FRF below this share of sqrt|h_pp h_qq| is zero to rounding.
ZERO = 1e-8


def own_size(h: ComplexArray) -> FloatArray:
    """Return |h_pp h_qq|, the size against which an FRF h_pq is zero or not; shape of h."""
    diagonal = abs(np.diagonal(h, axis1=-2, axis2=-1))
    size: FloatArray = diagonal[..., :, None] * diagonal[..., None, :]
    return size


def reciprocity_noise(h: ComplexArray) -> FloatArray:
    """Relative noise level from the differences h_pq - h_qp, robustly.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)
        FRFs of a reciprocal structure, measured in both directions.

    Returns
    -------
    ndarray, shape (r,)
        0 where h is symmetric.

    Notes
    -----
    For circular noise of level s, |h_pq - h_qp|^2 / (|h_pq|^2 + |h_qp|^2) is s^2 times an exponential variable, whose
    median is log 2. A few wrong FRFs do not change a median. FRFs that are zero to rounding are left out.
    """
    m = h.shape[-1]
    p, q = np.triu_indices(m, 1)
    above, below = h[..., p, q], h[..., q, p]
    size = abs(above) ** 2 + abs(below) ** 2
    counts = size > 2 * ZERO**2 * own_size(h)[..., p, q]
    ratio = np.divide(abs(above - below) ** 2, size, out=np.zeros_like(size), where=counts)
    medians = [np.median(own[some]) if some.any() else 0.0 for own, some in zip(ratio, counts, strict=True)]
    level: FloatArray = np.sqrt(np.array(medians) / np.log(2))
    return level
