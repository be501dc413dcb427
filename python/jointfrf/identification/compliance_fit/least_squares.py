"""Weighted nonlinear least squares: the parameters of a joint from values of its compliance with their covariance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.joint_terms import JointModel
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "SHARE_OF_VALUE",
    "LeastSquares",
    "Minimum",
    "inverse_information",
    "line_information",
    "minimise",
    "model_at",
    "summed",
]

#: A parameter that changes by less than this share of its value has converged.
SHARE_OF_VALUE = 1e-11
_STEPS = 60


class LeastSquares(NamedTuple):
    """Squares to be minimised: |value - K*(theta)^-1|^2 with their weights.

    Entries of C that the parameters do not change, zero off the diagonal, are correlated with the others by their
    noise: they enter by `other_gradient` and `other_squares`.

    Attributes
    ----------
    model : JointModel
    value : ndarray, shape (r, n_freq, q)
        Measured entries of C that the parameters change.
    weight : ndarray, shape (r, n_freq, q, q)
        Their block of the inverse covariance.
    other_gradient : ndarray, shape (r, n_freq, q)
        What the other entries add to the weighted residual: their block of the inverse covariance times them.
    other_squares : ndarray, shape (r,)
        Weighted squares of the other entries.
    equations : ndarray, shape (r,)
        Number of complex equations.
    """

    model: JointModel
    value: ComplexArray
    weight: ComplexArray
    other_gradient: ComplexArray
    other_squares: FloatArray
    equations: FloatArray

    def of(self, which: NDArray[np.intp]) -> LeastSquares:
        """Return the problem of some realisations."""
        value, weight, gradient = (x[which] for x in (self.value, self.weight, self.other_gradient))
        return LeastSquares(self.model, value, weight, gradient, self.other_squares[which], self.equations[which])


class Minimum(NamedTuple):
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
    converged : ndarray of bool, shape (r,)
        Whether the last step was negligible.
    """

    theta: FloatArray
    information: FloatArray
    compliance: ComplexArray
    cost: FloatArray
    converged: NDArray[np.bool_]


def inverse_information(information: FloatArray) -> FloatArray:
    """Inverse of information matrices of parameters of very different size; a pseudo-inverse where one has none.

    Parameters
    ----------
    information : ndarray, shape (..., p, p)
    """
    size = np.sqrt(np.maximum(np.einsum("...aa->...a", information), np.finfo(float).tiny))
    outer = size[..., :, None] * size[..., None, :]
    inverse: FloatArray = np.linalg.pinv(information / outer, hermitian=True) / outer
    return inverse


def line_information(problem: LeastSquares, compliance: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return S^H W S, shape (r, n_freq, n_pairs, n_pairs), and S^H, where S is `JointModel.slope`."""
    slope = problem.model.slope(compliance)
    adjoint = slope.conj().swapaxes(-1, -2)
    return adjoint @ (problem.weight @ slope), adjoint


def summed(factors: ComplexArray, per_line: ComplexArray) -> FloatArray:
    """Return S^H W S summed over the lines with the functions of frequency: Re(J^H W J), shape (r, p, p)."""
    kinds, pairs = len(factors), per_line.shape[-1]
    products = (factors.conj()[:, None] * factors).reshape(kinds**2, -1)
    whole = (products @ per_line.reshape(*per_line.shape[:2], -1)).real
    whole = whole.reshape(-1, kinds, kinds, pairs, pairs).swapaxes(2, 3)
    return np.ascontiguousarray(whole).reshape(-1, kinds * pairs, kinds * pairs)


def model_at(theta: FloatArray, problem: LeastSquares) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return C of the model, the weighted residual, and the sum of the weighted squares."""
    compliance = problem.model.compliance(theta)
    residual = problem.value - problem.model.entries(compliance)
    weighted = (problem.weight @ residual[..., None])[..., 0] + problem.other_gradient
    cost = (residual.conj() * (weighted + problem.other_gradient)).real.sum(axis=(1, 2)) + problem.other_squares
    return compliance, weighted, np.where(np.isfinite(cost), cost, np.inf)


def minimise(theta: FloatArray, limit: FloatArray, problem: LeastSquares, tolerance: float) -> Minimum:
    """Minimise the weighted squares by Gauss-Newton steps, damped after Levenberg where one gains less than predicted.

    Parameters
    ----------
    theta : ndarray, shape (r, p)
        Initial parameters.
    limit : ndarray, shape (r, p)
        Largest absolute value of each parameter.
    problem : LeastSquares
    tolerance : float
        It ends when no parameter changes by more than this many standard errors.
    """
    r, p = theta.shape
    factors = problem.model.basis.factors
    damping = np.zeros(r)
    compliance, weighted, cost = model_at(theta, problem)
    for _ in range(_STEPS):
        per_line, adjoint = line_information(problem, compliance)
        information = summed(factors, per_line)
        gradient = (factors.conj() @ (adjoint @ weighted[..., None])[..., 0]).real.reshape(r, p)
        size = np.sqrt(np.maximum(np.einsum("raa->ra", information), np.finfo(float).tiny))
        scaled = information / (size[:, :, None] * size[:, None, :]) + damping[:, None, None] * np.eye(p)
        inverse = np.linalg.pinv(scaled, hermitian=True)
        step = (inverse @ (gradient / size)[..., None])[..., 0] / size
        step = np.clip(theta + step, -limit, limit) - theta
        # One standard error is about this in units of 1/size.
        noise = np.maximum(cost, 0) / np.maximum(2 * problem.equations, 1)
        error = np.sqrt(np.maximum(np.einsum("raa->ra", inverse), 0) * noise[:, None])
        converged = (abs(step) * size <= tolerance * error + SHARE_OF_VALUE * abs(theta) * size).all(axis=1)
        compliance_new, weighted_new, cost_new = model_at(theta + step, problem)
        predicted = (step * (2 * gradient - (information @ step[..., None])[..., 0])).sum(axis=1)
        round_off = 1e-14 * (abs(cost) + problem.other_squares)
        better = cost_new <= cost + round_off
        kept = cost - cost_new >= predicted / 4 - round_off
        damping = np.where(~better, np.maximum(10 * damping, 1e-3), np.where(kept, damping / 10, damping))
        damping[damping < 1e-6] = 0
        theta = np.where(better[:, None], theta + step, theta)
        compliance = np.where(better.reshape(r, *[1] * (compliance.ndim - 1)), compliance_new, compliance)
        weighted = np.where(better[:, None, None], weighted_new, weighted)
        cost = np.where(better, cost_new, cost)
        if (converged | (damping > 1e8)).all():
            break
    return Minimum(theta, information, compliance, cost, converged)
