"""The parameters of a joint from values of its compliance with their covariance: weighted nonlinear least squares."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.joint_terms import JointModel
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "SHARE_OF_VALUE",
    "Fitted",
    "Task",
    "first_parameters",
    "gauss_newton",
    "inverse_information",
    "ran_off",
]

#: No parameter need move by less than this share of its value.
SHARE_OF_VALUE = 1e-11
#: Beyond this share of the size of a rigid joint a parameter may have run off.
_RAN_OFF = 1e-8
_STEPS = 60
#: A stiffness stops growing when its compliance is this share of the error that 100 % noise would leave.
_RIGID = 1e-9


class Task(NamedTuple):
    """Squares to be minimised: |value - K*(theta)^-1|^2 with their weights.

    The entries of C that the model does not move, zero beside the diagonal, tell of the noise in the others: they
    enter by `pull` and `rest`.

    Attributes
    ----------
    model : JointModel
    value : ndarray, shape (r, n_freq, q)
        Measured entries of C, those that the model moves.
    weight : ndarray, shape (r, n_freq, q, q)
        Their block of the inverse covariance.
    pull : ndarray, shape (r, n_freq, q)
        The other entries times their covariance with these, in the inverse covariance.
    rest : ndarray, shape (r,)
        Weighted squares of the other entries.
    equations : ndarray, shape (r,)
        Complex equations.
    """

    model: JointModel
    value: ComplexArray
    weight: ComplexArray
    pull: ComplexArray
    rest: FloatArray
    equations: FloatArray

    def of(self, which: NDArray[np.intp]) -> Task:
        """Return the task of some realisations."""
        value, weight, pull = (x[which] for x in (self.value, self.weight, self.pull))
        return Task(self.model, value, weight, pull, self.rest[which], self.equations[which])


class Fitted(NamedTuple):
    """A minimum, with a leading axis over realisations r.

    Attributes
    ----------
    theta : ndarray, shape (r, p)
    information : ndarray, shape (r, p, p)
        Re(J^H W J).
    compliance : ndarray
        C of the model.
    cost : ndarray, shape (r,)
        Sum of the weighted squares, inf where theta is not possible.
    settled : ndarray of bool, shape (r,)
        Whether nothing moves any more.
    """

    theta: FloatArray
    information: FloatArray
    compliance: ComplexArray
    cost: FloatArray
    settled: NDArray[np.bool_]


def inverse_information(information: FloatArray) -> FloatArray:
    """Inverse of information matrices of parameters of very different size; a pseudo-inverse where one is not seen."""
    size = np.sqrt(np.maximum(np.einsum("raa->ra", information), np.finfo(float).tiny))
    outer = size[:, :, None] * size[:, None, :]
    inverse: FloatArray = np.linalg.pinv(information / outer, hermitian=True) / outer
    return inverse


def line_information(task: Task, compliance: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return S^H W S, shape (r, n_freq, n_pairs, n_pairs), and S^H, where S is `JointModel.slope`."""
    slope = task.model.slope(compliance)
    adjoint = slope.conj().swapaxes(-1, -2)
    return adjoint @ (task.weight @ slope), adjoint


def _summed(factors: ComplexArray, per_line: ComplexArray) -> FloatArray:
    """Sum S^H W S over the lines, with the functions of frequency: Re(J^H W J), shape (r, p, p)."""
    letters, pairs = len(factors), per_line.shape[-1]
    products = (factors.conj()[:, None] * factors).reshape(letters**2, -1)
    whole = (products @ per_line.reshape(*per_line.shape[:2], -1)).real
    whole = whole.reshape(-1, letters, letters, pairs, pairs).swapaxes(2, 3)
    return np.ascontiguousarray(whole).reshape(-1, letters * pairs, letters * pairs)


def _at(theta: FloatArray, task: Task) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return C of the model, the weighted residual, and the sum of the weighted squares."""
    compliance = task.model.compliance(theta)
    left = task.value - task.model.moved(compliance)
    weighted = (task.weight @ left[..., None])[..., 0] + task.pull
    cost = (left.conj() * (weighted + task.pull)).real.sum(axis=(1, 2)) + task.rest
    return compliance, weighted, np.where(np.isfinite(cost), cost, np.inf)


def gauss_newton(theta: FloatArray, limit: FloatArray, task: Task, tolerance: float) -> Fitted:
    """Minimise the weighted squares from `theta` on; Levenberg's damping where a step does less than it promised.

    No parameter exceeds its `limit`, shape (r, p). It stops when no parameter moves by more than `tolerance` standard
    errors.
    """
    r, p = theta.shape
    factors = task.model.basis.factors
    damping = np.zeros(r)
    compliance, weighted, cost = _at(theta, task)
    for _ in range(_STEPS):
        per_line, adjoint = line_information(task, compliance)
        information = _summed(factors, per_line)
        gradient = (factors.conj() @ (adjoint @ weighted[..., None])[..., 0]).real.reshape(r, p)
        size = np.sqrt(np.maximum(np.einsum("raa->ra", information), np.finfo(float).tiny))
        scaled = information / (size[:, :, None] * size[:, None, :]) + damping[:, None, None] * np.eye(p)
        inverse = np.linalg.pinv(scaled, hermitian=True)
        step = (inverse @ (gradient / size)[..., None])[..., 0] / size
        step = np.clip(theta + step, -limit, limit) - theta
        # One standard error is about this in units of 1/size.
        noise = np.maximum(cost, 0) / np.maximum(2 * task.equations, 1)
        error = np.sqrt(np.maximum(np.einsum("raa->ra", inverse), 0) * noise[:, None])
        settled = (abs(step) * size <= tolerance * error + SHARE_OF_VALUE * abs(theta) * size).all(axis=1)
        compliance_new, weighted_new, cost_new = _at(theta + step, task)
        promised = (step * (2 * gradient - (information @ step[..., None])[..., 0])).sum(axis=1)
        round_off = 1e-14 * (abs(cost) + task.rest)
        better = cost_new <= cost + round_off
        kept = cost - cost_new >= promised / 4 - round_off
        damping = np.where(~better, np.maximum(10 * damping, 1e-3), np.where(kept, damping / 10, damping))
        damping[damping < 1e-6] = 0
        theta = np.where(better[:, None], theta + step, theta)
        compliance = np.where(better.reshape(r, *[1] * (compliance.ndim - 1)), compliance_new, compliance)
        weighted = np.where(better[:, None, None], weighted_new, weighted)
        cost = np.where(better, cost_new, cost)
        if (settled | (damping > 1e8)).all():
            break
    return Fitted(theta, information, compliance, cost, settled)


def first_parameters(task: Task, tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Return first parameters, and the size at which a joint is as good as rigid: both of shape (r, p)."""
    linear, limit = _linear_start(task)
    starts = [_mean_start(task), linear]
    if not task.model.is_diagonal:
        starts.append(np.clip(_coupled_start(task), -limit, limit))
    return _from_starts(starts, limit, task, tolerance), limit


def _own(task: Task, dof: int) -> tuple[ComplexArray, FloatArray]:
    """Return the compliance of a DOF by itself and its weight, both of shape (r, n_freq)."""
    at = int(np.flatnonzero((task.model.rows == dof) & (task.model.columns == dof))[0])
    return task.value[..., at], task.weight[..., at, at].real


def _linear_start(task: Task) -> tuple[FloatArray, FloatArray]:
    """First parameters, and their limit.

    Each DOF by itself, from K*(theta) C = 1 by weighted linear least squares, twice, the second time with the weights
    of the first K*. It finds damping at once, but noise draws it towards zero.
    """
    basis, n, r = task.model.basis, task.model.n, len(task.value)
    theta = np.zeros((r, len(basis.factors), len(basis.pairs)))
    rigid = np.empty((r, n))
    for d in range(n):
        value, own = _own(task, d)
        rigid[:, d] = np.sqrt(own.sum(axis=1)) / _RIGID
        slope = value[..., None] * basis.factors.T
        scale = np.sqrt((abs(slope) ** 2).sum(axis=1, keepdims=True))
        slope = slope / np.where(scale > 0, scale, 1)
        stiffness = np.ones_like(own)
        for _ in range(2):
            pull = (own / stiffness**2)[..., None] * slope.conj()
            normal = (pull.swapaxes(1, 2) @ slope).real
            found = (np.linalg.pinv(normal, hermitian=True) @ pull.real.sum(axis=1)[..., None])[..., 0]
            theta[..., d] = found / np.where(scale > 0, scale, 1)[:, 0]
            model = abs(theta[..., d] @ basis.factors)
            stiffness = np.maximum(model, 1e-3 * model.max(axis=1, keepdims=True))
            stiffness = np.where(stiffness > 0, stiffness, 1)
    of_pair = np.sqrt(rigid[:, basis.pairs[:, 0]] * rigid[:, basis.pairs[:, 1]])
    limit = of_pair[:, None, :] / abs(basis.factors).max(axis=1)[:, None]
    return theta.reshape(r, -1), limit.reshape(r, -1)


def _mean_start(task: Task) -> FloatArray:
    """Return stiffnesses from the weighted mean of the real compliance of each DOF, everything else zero.

    Noise does not bias it; much damping does.
    """
    theta = np.zeros((len(task.value), len(task.model.basis.names)))
    for d in range(task.model.n):
        value, own = _own(task, d)
        mean = (own * value.real).sum(axis=1) / own.sum(axis=1)
        # A compliance lost in noise starts from what the noise would let through.
        theta[:, d] = 1 / np.maximum(mean, 1e-3 / np.sqrt(own.sum(axis=1)))
    return theta


def _coupled_start(task: Task) -> FloatArray:
    """First parameters of all DOFs together, from K*(theta) C = 1 by weighted linear least squares.

    Exact without noise, however strongly the DOFs are coupled; noise draws it towards zero.
    """
    model, factors, pairs = task.model, task.model.basis.factors, task.model.basis.pairs
    r, n_freq, n = *task.value.shape[:2], model.n
    c = np.empty((r, n_freq, n, n), np.complex128)
    c[..., model.rows, model.columns] = c[..., model.columns, model.rows] = task.value
    # All DOFs in units of their own compliance.
    size = np.sqrt(np.median(abs(np.einsum("rfaa->rfa", c)), axis=1))
    c /= (size[:, :, None] * size[:, None, :])[:, None]
    own = np.stack([_own(task, d)[1] for d in range(n)], axis=-1) * size[:, None] ** 4
    slope = np.zeros((r, n_freq, n, n, len(pairs)), np.complex128)
    for i, (a, b) in enumerate(pairs):
        slope[..., a, :, i] = c[..., b, :]
        slope[..., b, :, i] = c[..., a, :]
    adjoint = slope.reshape(r, n_freq, n * n, -1).conj().swapaxes(-1, -2) * own.min(axis=2)[..., None, None]
    scale = abs(factors).max(axis=1)
    factors = factors / scale[:, None]
    normal = _summed(factors, adjoint @ slope.reshape(r, n_freq, n * n, -1))
    right = (factors.conj() @ (adjoint @ np.eye(n).reshape(-1, 1))[..., 0]).real.reshape(r, -1)
    theta = (np.linalg.pinv(normal, hermitian=True) @ right[..., None])[..., 0].reshape(r, len(scale), -1)
    units = size[:, pairs[:, 0]] * size[:, pairs[:, 1]]
    first: FloatArray = (theta / scale[:, None] / units[:, None]).reshape(r, -1)
    return first


def ran_off(theta: FloatArray, limit: FloatArray) -> NDArray[np.bool_]:
    """Whether a parameter ran off towards a rigid joint; shape (r,)."""
    return np.asarray((abs(theta) >= _RAN_OFF * limit).any(axis=1))


def _from_starts(starts: Sequence[FloatArray], limit: FloatArray, task: Task, tolerance: float) -> FloatArray:
    """Minimise from the best start; where this runs off, comes out negative or does not settle also from the others.

    Of each realisation the lowest minimum is kept.
    """
    costs = np.array([_at(start, task)[2] for start in starts])
    order = np.argsort(costs, axis=0, kind="stable")[..., None]
    first, *others = np.take_along_axis(np.array(starts), order, axis=0)
    found = gauss_newton(first, limit, task, tolerance)
    theta, cost = found.theta, found.cost
    of_dofs = theta.reshape(*theta.shape[:1], len(task.model.basis.factors), -1)[..., : task.model.n]
    doubtful = np.flatnonzero(ran_off(theta, limit) | ~found.settled | (of_dofs < 0).any(axis=(1, 2)))
    for start in others if doubtful.size else ():
        other = gauss_newton(start[doubtful], limit[doubtful], task.of(doubtful), tolerance)
        lower = other.cost < cost[doubtful]
        theta[doubtful[lower]] = other.theta[lower]
        cost[doubtful[lower]] = other.cost[lower]
    return theta
