"""Flexible sides as random effects: columns next to the columns of the joint, with a prior variance.

A side has a compliance between channels and joint, and one between its mass and its channels. The first is in series
with the joint: its diagonal belongs to C as seen, and its cross terms change the fit of a joint without them. The
second is a constant in the FRFs of the side. Both are estimated with the joint, so that flexibility which the FRFs
exclude does not widen the intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import line_slices
from jointfrf.identification.manifold.group_fit import GroupFit, fitted_frfs
from jointfrf.identification.manifold.on_manifold import FrfEntries, LineData
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["FlexibleFit", "fit_with_flexible_sides"]

#: Number of lines in one chunk.
_PIECE = 64


class FlexibleFit(NamedTuple):
    """The joint as seen through flexible sides, linearised at the fit of a joint between rigid sides.

    Attributes
    ----------
    step : ndarray, shape (p,)
        Change of the coordinates.
    noise : ndarray, shape (p,)
        Variance of the coordinates by noise, over their variance between rigid sides.
    sides : ndarray, shape (p,)
        Variance of the coordinates by flexibility that noise does not exclude, over the same.
    """

    step: FloatArray
    noise: FloatArray
    sides: FloatArray


def fit_with_flexible_sides(group: GroupFit, size: FloatArray) -> FlexibleFit | None:
    """Return the change of a fit by random flexibility of the sides; None if a DOF is rigid or has unknown cross terms.

    Parameters
    ----------
    group : GroupFit
        Fit of a group of n DOFs with p coordinates.
    size : ndarray, shape (n,)
        Standard deviation of the compliance of the sides for each DOF, m/N or rad/(N m).
    """
    p, rigid = group.x.size, group.joint.matrix(group.joint.compliance(group.x)[:1])
    if group.problem.unknown.any() or not np.isfinite(size).all() or np.linalg.matrix_rank(rigid) != size.size:
        return None
    information, right = _normal_equations(group, np.sqrt(size))
    prior = np.diag(np.r_[np.zeros(p), np.ones(len(right) - p)])
    covariance = inverse_information(2 * information + prior)
    own = np.diagonal(inverse_information(2 * information[:p, :p]))
    by_noise = np.einsum("ij,jk,ik->i", covariance[:p], 2 * information, covariance[:p])
    by_sides = (covariance[:p, p:] ** 2).sum(axis=1)
    return FlexibleFit(2 * (covariance @ right)[:p], by_noise / own, by_sides / own)


def _normal_equations(group: GroupFit, root: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return Re(A^H A) and Re(A^H r) of the coordinates and the flexibility, FRFs of the free sides eliminated."""
    lines, total = np.flatnonzero(group.used), list[FloatArray]()
    for own in line_slices(lines.size, _PIECE):
        columns = _columns(group, root, lines[own])
        flat = columns.reshape(-1, columns.shape[2])
        total = [np.sum([*total, (flat.conj().T @ flat).real], axis=0)]
    return total[0][:-1, :-1], total[0][:-1, -1]


def _columns(group: GroupFit, root: FloatArray, lines: NDArray[np.intp]) -> ComplexArray:
    """Return whitened columns of coordinates, flexibility and residual, orthogonal to changes of the free sides.

    FRFs between the joint DOFs change by gamma_:j X gamma_j: for a change of side j, by (K u)^T dC (K u) for a change
    of the joint with relative motion u, and by a constant for a side with flexible channels.
    """
    data, joint = group.problem.data.on_lines(lines), group.joint.on_lines(lines)
    entries, n, at = data.entries, data.entries.n, joint.compliance(group.x)
    gamma = fitted_frfs(group, lines)
    both = gamma, gamma.swapaxes(1, 2)
    upper, across = np.triu_indices(n), np.triu_indices(n, 1)
    # R^-1 u = (K* + Z) u.
    apart = [one[:, :n] - one[:, n:] for one in both]
    force = [np.linalg.solve(joint.matrix(at), one) for one in apart]
    pull = [root[:, None] * (f - data.reference[:, None] * u) for f, u in zip(force, apart, strict=True)]
    free = [
        _products(entries, [one[:, side] for one in both], entries.free, is_symmetric=entries.reciprocal)
        for side in (slice(n), slice(n, None))
    ]
    units = root[:, None] * np.eye(2 * n).reshape(2, 1, n, 2 * n)
    constants = np.concatenate([_products(entries, [unit, unit], upper) for unit in units], axis=2)
    columns = np.concatenate(
        [
            _products(entries, force, (joint.rows, joint.columns)) @ joint.slope(group.x, at),
            np.broadcast_to(constants, (len(gamma), *constants.shape[1:])),
            _products(entries, pull, across),
            (data.measured - entries.take(gamma))[:, :, None],
        ],
        axis=2,
    )
    basis = np.linalg.qr(_whitened(data, np.concatenate(free, axis=2)))[0]
    columns = _whitened(data, columns)
    return columns - basis @ (basis.conj().swapaxes(1, 2) @ columns)


def _products(
    entries: FrfEntries,
    motion: Sequence[NDArray[Any]],
    pairs: tuple[NDArray[np.intp], NDArray[np.intp]],
    *,
    is_symmetric: bool = True,
) -> ComplexArray:
    """Return the entries of the products of two motions for pairs of DOFs, symmetric if stated, shape (., q, pairs)."""
    right, left = motion
    (a, b), rows, columns = pairs, entries.rows, entries.columns
    found = left[:, a][:, :, rows] * right[:, b][:, :, columns]
    if is_symmetric:
        found = found + np.where((a != b)[:, None], left[:, b][:, :, rows] * right[:, a][:, :, columns], 0)
    return np.asarray(found.swapaxes(1, 2), np.complex128)


def _whitened(data: LineData, columns: ComplexArray) -> ComplexArray:
    """Return columns of the entries in units of uncorrelated noise."""
    own: ComplexArray = columns * data.inverse_std[:, :, None]
    return own if data.correlation is None else np.asarray(data.correlation @ own)
