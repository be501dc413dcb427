"""Initial parameters of the least-squares problem, from several linear estimates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.least_squares import LeastSquares, minimise, model_at, summed
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["diverged", "initial_parameters"]

#: Beyond this share of the size of a rigid joint a parameter may have diverged.
_DIVERGED = 1e-8
#: A stiffness stops growing when its compliance is this share of the error that 100 % noise would leave.
_RIGID = 1e-9


def initial_parameters(problem: LeastSquares, tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Return initial parameters and the limits at which a joint is practically rigid, both of shape (r, p)."""
    linear, limit = _linear_start(problem)
    starts = [_mean_start(problem), linear]
    if not problem.model.is_diagonal:
        starts.append(np.clip(_coupled_start(problem), -limit, limit))
    return _from_starts(starts, limit, problem, tolerance), limit


def _own(problem: LeastSquares, dof: int) -> tuple[ComplexArray, FloatArray]:
    """Return the compliance of a DOF by itself and its weight, both of shape (r, n_freq)."""
    at = int(np.flatnonzero((problem.model.rows == dof) & (problem.model.columns == dof))[0])
    return problem.value[..., at], problem.weight[..., at, at].real


def _linear_start(problem: LeastSquares) -> tuple[FloatArray, FloatArray]:
    """Return initial parameters, and their limit.

    Each DOF by itself, from K*(theta) C = 1 by weighted linear least squares, twice, the second time with the weights
    of the first K*. It includes damping, but is biased towards zero by noise.
    """
    basis, n, r = problem.model.basis, problem.model.n, len(problem.value)
    theta = np.zeros((r, len(basis.factors), len(basis.pairs)))
    rigid = np.empty((r, n))
    for d in range(n):
        value, own = _own(problem, d)
        rigid[:, d] = np.sqrt(own.sum(axis=1)) / _RIGID
        slope = value[..., None] * basis.factors.T
        scale = np.sqrt((abs(slope) ** 2).sum(axis=1, keepdims=True))
        slope = slope / np.where(scale > 0, scale, 1)
        stiffness = np.ones_like(own)
        for _ in range(2):
            weighted = (own / stiffness**2)[..., None] * slope.conj()
            normal = (weighted.swapaxes(1, 2) @ slope).real
            found = (np.linalg.pinv(normal, hermitian=True) @ weighted.real.sum(axis=1)[..., None])[..., 0]
            theta[..., d] = found / np.where(scale > 0, scale, 1)[:, 0]
            model = abs(theta[..., d] @ basis.factors)
            stiffness = np.maximum(model, 1e-3 * model.max(axis=1, keepdims=True))
            stiffness = np.where(stiffness > 0, stiffness, 1)
    of_pair = np.sqrt(rigid[:, basis.pairs[:, 0]] * rigid[:, basis.pairs[:, 1]])
    limit = of_pair[:, None, :] / abs(basis.factors).max(axis=1)[:, None]
    return theta.reshape(r, -1), limit.reshape(r, -1)


def _mean_start(problem: LeastSquares) -> FloatArray:
    """Return stiffnesses from the weighted mean of the real compliance of each DOF, everything else zero.

    Not biased by noise, but by large damping.
    """
    theta = np.zeros((len(problem.value), len(problem.model.basis.parameters)))
    for d in range(problem.model.n):
        value, own = _own(problem, d)
        mean = (own * value.real).sum(axis=1) / own.sum(axis=1)
        # A compliance below the noise starts from the smallest one that the noise would show.
        theta[:, d] = 1 / np.maximum(mean, 1e-3 / np.sqrt(own.sum(axis=1)))
    return theta


def _coupled_start(problem: LeastSquares) -> FloatArray:
    """Return initial parameters of all DOFs together, from K*(theta) C = 1 by weighted linear least squares.

    Exact without noise, however strongly the DOFs are coupled; biased towards zero by noise.
    """
    model, factors, pairs = problem.model, problem.model.basis.factors, problem.model.basis.pairs
    r, n_freq, n = *problem.value.shape[:2], model.n
    c = np.empty((r, n_freq, n, n), np.complex128)
    c[..., model.rows, model.columns] = c[..., model.columns, model.rows] = problem.value
    # All DOFs in units of their own compliance.
    size = np.sqrt(np.median(abs(np.einsum("rfaa->rfa", c)), axis=1))
    c /= (size[:, :, None] * size[:, None, :])[:, None]
    own = np.stack([_own(problem, d)[1] for d in range(n)], axis=-1) * size[:, None] ** 4
    slope = np.zeros((r, n_freq, n, n, len(pairs)), np.complex128)
    for i, (a, b) in enumerate(pairs):
        slope[..., a, :, i] = c[..., b, :]
        slope[..., b, :, i] = c[..., a, :]
    adjoint = slope.reshape(r, n_freq, n * n, -1).conj().swapaxes(-1, -2) * own.min(axis=2)[..., None, None]
    scale = abs(factors).max(axis=1)
    factors = factors / scale[:, None]
    normal = summed(factors, adjoint @ slope.reshape(r, n_freq, n * n, -1))
    right = (factors.conj() @ (adjoint @ np.eye(n).reshape(-1, 1))[..., 0]).real.reshape(r, -1)
    theta = (np.linalg.pinv(normal, hermitian=True) @ right[..., None])[..., 0].reshape(r, len(scale), -1)
    units = size[:, pairs[:, 0]] * size[:, pairs[:, 1]]
    first: FloatArray = (theta / scale[:, None] / units[:, None]).reshape(r, -1)
    return first


def diverged(theta: FloatArray, limit: FloatArray) -> NDArray[np.bool_]:
    """Whether a parameter diverged towards a rigid joint; shape (r,)."""
    return np.asarray((abs(theta) >= _DIVERGED * limit).any(axis=1))


def _from_starts(
    starts: Sequence[FloatArray], limit: FloatArray, problem: LeastSquares, tolerance: float
) -> FloatArray:
    """Minimise from the best start; where this diverges, is negative or does not converge, also from the others.

    Of each realisation the lowest minimum is kept.
    """
    costs = np.array([model_at(start, problem)[2] for start in starts])
    order = np.argsort(costs, axis=0, kind="stable")[..., None]
    first, *others = np.take_along_axis(np.array(starts), order, axis=0)
    found = minimise(first, limit, problem, tolerance)
    theta, cost = found.theta, found.cost
    of_dofs = theta.reshape(*theta.shape[:1], len(problem.model.basis.factors), -1)[..., : problem.model.n]
    doubtful = np.flatnonzero(diverged(theta, limit) | ~found.converged | (of_dofs < 0).any(axis=(1, 2)))
    for start in others if doubtful.size else ():
        other = minimise(start[doubtful], limit[doubtful], problem.of(doubtful), tolerance)
        lower = other.cost < cost[doubtful]
        theta[doubtful[lower]] = other.theta[lower]
        cost[doubtful[lower]] = other.cost[lower]
    return theta
