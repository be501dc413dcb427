"""What measured FRFs show of their own noise, and which of them are coupled at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert

__all__ = ["LOST", "ZERO", "gamma_noise", "neighbour_mean", "own_size", "reciprocity_noise", "uncoupled_groups"]

#: The first linearisation uses the mean of this many lines on either side, without the line itself: weights must not
#: follow the noise they weigh.
_NEIGHBOURS = 2
#: A line is left out where the relative noise of gamma_jk, which has to be inverted, exceeds this: first order ends
#: there.
LOST = 0.35
#: An FRF below this share of sqrt|h_pp h_qq| is zero, but for round-off.
ZERO = 1e-8


def own_size(h: ComplexArray) -> FloatArray:
    """Return |h_pp h_qq|, the size against which an FRF h_pq is zero or not; shape of h."""
    diagonal = abs(np.diagonal(h, axis1=-2, axis2=-1))
    size: FloatArray = diagonal[..., :, None] * diagonal[..., None, :]
    return size


def reciprocity_noise(h: ComplexArray) -> FloatArray:
    """Relative noise level from the differences h_pq - h_qp, robustly: shape (r,), 0 where h is reciprocal.

    For circular noise of level s, |h_pq - h_qp|^2 / (|h_pq|^2 + |h_qp|^2) is s^2 times an exponential variable, whose
    median is log 2. A median does not see a few bad FRFs. FRFs that are zero but for round-off do not count.
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
    """Mean of the lines around each line, without itself, shape (r, n_freq, m, m)."""
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
    """Relative noise of gamma_jk, which has to be inverted: shape (r, n_freq), to be small against 1.

    With E = gamma_jk^-1 dgamma_jk and Q_ab = E|E_ab|^2 the terms of (1 + E)^-1 = 1 - E + E^2 - ... have the mean
    squares Q, Q^2, ...: the measure is the square root of the largest eigenvalue of Q, whatever the units. Without
    `whole`, the largest standard deviation on the diagonal of E.
    """
    n = transform.shape[0] // 2
    spread = level[:, None, None, None] ** 2 * (abs(h) ** 2 if variance is None else variance)
    gamma_jk = transform[:n] @ h @ transform[n:].T
    inverse = invert(gamma_jk.reshape(-1, n, n), on_singular="nan").reshape(gamma_jk.shape)
    moved = abs(inverse @ transform[:n]) ** 2 @ spread @ (transform[n:] ** 2).T
    if not whole:
        ratio: FloatArray = np.sqrt(np.diagonal(moved, axis1=2, axis2=3).max(axis=2))
        return ratio
    finite = np.isfinite(moved).all(axis=(2, 3))
    ratio = np.full(finite.shape, np.inf)
    ratio[finite] = np.sqrt(abs(np.linalg.eigvals(moved[finite])).max(axis=1))
    return ratio


def uncoupled_groups(h: ComplexArray, transform: FloatArray) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Joint DOFs, and the measured points they are made of, between which h is zero on all lines.

    Where a structure is symmetric, the FRFs between some DOFs vanish; what they would tell is exact, and the problem
    falls apart.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)
    transform : ndarray, shape (2 n, m)

    Returns
    -------
    list of (dofs, points)
        In the order of their first DOF; each in ascending order. Points that no DOF is made of are left out.
    """
    n, m = transform.shape[0] // 2, transform.shape[1]
    made_of = (transform[:n] != 0) | (transform[n:] != 0)
    coupled = np.zeros((n + m, n + m), bool)
    coupled[:n, n:] = made_of
    coupled[n:, n:] = (abs(h) ** 2 > ZERO**2 * own_size(h)).any(axis=(0, 1))
    _, label = sparse.csgraph.connected_components(sparse.csr_array(coupled), directed=False)
    groups = [
        (np.flatnonzero(label[:n] == own), np.flatnonzero(label[n:] == own))
        for own in dict.fromkeys(label[:n].tolist())
    ]
    if all(points.size for _, points in groups):
        return groups
    return [(np.arange(n), np.arange(m))]
