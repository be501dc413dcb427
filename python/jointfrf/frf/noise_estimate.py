"""What measured FRFs show of their own noise."""

from __future__ import annotations

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert

__all__ = ["ZERO", "gamma_noise", "neighbour_mean", "own_size", "reciprocity_noise"]

#: Lines on either side of a line that its neighbour mean is taken over.
_NEIGHBOURS = 2
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


def neighbour_mean(h: ComplexArray) -> ComplexArray:
    """Mean of the lines around each line, without the line itself: an estimate whose noise is not that of the line.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)

    Returns
    -------
    ndarray, shape (r, n_freq, m, m)
        `h` itself where it has one line only.
    """
    n_freq = h.shape[1]
    if n_freq < 2:
        return h
    total = np.zeros_like(h)
    count = np.zeros(n_freq)
    for shift in range(1, min(_NEIGHBOURS, n_freq - 1) + 1):
        total[:, shift:] += h[:, :-shift]
        total[:, :-shift] += h[:, shift:]
        count[shift:] += 1
        count[:-shift] += 1
    return total / count[None, :, None, None]


def gamma_noise(
    h: ComplexArray, transform: FloatArray, level: FloatArray, variance: FloatArray | None, *, whole: bool = True
) -> FloatArray:
    """Relative noise of gamma_jk, the block that is inverted.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)
        Measured FRFs.
    transform : ndarray, shape (2 n, m)
        T of gamma = T h T^T, DOFs j, then k.
    level : ndarray, shape (r,)
        Noise level.
    variance : ndarray, shape (n_freq, m, m), optional
        E|e|^2 of h for unit level; |h|^2 where it is None.
    whole : bool
        Whether all terms of the inverse are judged, or the diagonal of E only.

    Returns
    -------
    ndarray, shape (r, n_freq)
        Small against 1 where first-order error propagation through the inverse holds.

    Notes
    -----
    With E = gamma_jk^-1 dgamma_jk and Q_ab = E|E_ab|^2 the terms of (1 + E)^-1 = 1 - E + E^2 - ... have the mean
    squares Q, Q^2, ...: the measure is the square root of the largest eigenvalue of Q, independent of units. Without
    `whole` it is the largest standard deviation on the diagonal of E.
    """
    n = transform.shape[0] // 2
    spread = level[:, None, None, None] ** 2 * (abs(h) ** 2 if variance is None else variance)
    gamma_jk = transform[:n] @ h @ transform[n:].T
    inverse = invert(gamma_jk.reshape(-1, n, n), on_singular="nan").reshape(gamma_jk.shape)
    squares = abs(inverse @ transform[:n]) ** 2 @ spread @ (transform[n:] ** 2).T
    if not whole:
        ratio: FloatArray = np.sqrt(np.diagonal(squares, axis1=2, axis2=3).max(axis=2))
        return ratio
    finite = np.isfinite(squares).all(axis=(2, 3))
    ratio = np.full(finite.shape, np.inf)
    ratio[finite] = np.sqrt(abs(np.linalg.eigvals(squares[finite])).max(axis=1))
    return ratio
