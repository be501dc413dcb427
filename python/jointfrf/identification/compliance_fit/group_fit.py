"""The compliance fit of one group of joint DOFs: linearise, fit, correct the FRFs, and again until nothing moves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.frf_noise import LOST, gamma_noise
from jointfrf.identification.compliance_fit.least_squares import (
    SHARE_OF_VALUE,
    Fitted,
    Task,
    first_parameters,
    gauss_newton,
    inverse_information,
    line_information,
    ran_off,
)
from jointfrf.identification.compliance_fit.linearised import Data, Group, squares_of_lines
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["GroupEstimate", "fit_group"]

#: Linearisations at most, first without and then with care.
_PLAIN, _CAREFUL = 40, 40
#: The parameters of one linearisation are found to this share of the tolerance.
_INNER = 0.02
#: From this linearisation on, FRFs move half way: lines with little more signal than noise would swing for long.
_FULL_STEPS = 4
#: A fit that then still moves by more standard errors than this, and by more than this share of the move before, is
#: begun anew, carefully.
_SWINGS, _SHRINKS = 5.0, 0.25
#: So is one with a stiffness that is negative by so many standard errors.
_BELOW = 3.0
#: A careful fit trusts lines little where the relative noise of gamma_jk exceeds this, for so many linearisations ...
_TRUSTED = 0.1
_SOFT_STEPS = 4
#: ... and leaves out those whose FRFs then still move by more than this share of their noise.
_UNSETTLED = 0.2


class GroupEstimate(NamedTuple):
    """Result of `fit_group`; what is not said here is as in `ComplianceEstimate`.

    Attributes
    ----------
    squares : ndarray, shape (r,)
        Weighted squares of the residual.
    squares_beside : ndarray, shape (r,)
        Those of the entries of C that the model does not move, by themselves.
    equations, equations_beside : ndarray, shape (r,)
        Complex equations, and those of the entries that the model does not move.
    trust : ndarray, shape (r, n_freq)
        1 on lines used, 0 on lines left out.
    """

    theta: FloatArray
    covariance: FloatArray
    squares: FloatArray
    squares_beside: FloatArray
    equations: FloatArray
    equations_beside: FloatArray
    trust: FloatArray
    iterations: NDArray[np.intp]
    converged: NDArray[np.bool_]
    line_gradient: FloatArray
    line_information: FloatArray


def fit_group(data: Data, noise: FloatArray, level: FloatArray | None, tolerance: float) -> GroupEstimate:
    """Fit one group of DOFs.

    Parameters
    ----------
    data : Data
        Lines that are used, made reciprocal if the structure is.
    noise : ndarray, shape (r,)
        Noise level, for what can be trusted.
    level : ndarray, shape (r,), optional
        Noise level to judge convergence; by default from the residual.
    tolerance : float
        As in `estimate`.
    """
    found, swings = _iterate(Group(data), level, tolerance)
    if swings.any():
        which = np.flatnonzero(swings)
        group = Group(data.of(which).near_enough(noise[which]))
        again = _iterate_carefully(group, noise[which], None if level is None else level[which], tolerance)
        for whole, part in zip(found, again, strict=True):
            whole[which] = part
    return found


def _iterate(group: Group, level: FloatArray | None, tolerance: float) -> tuple[GroupEstimate, NDArray[np.bool_]]:
    """Iterate until nothing moves; also return the realisations that are to be done carefully."""
    true = group.data.near
    swings = np.zeros(group.r, bool)
    last = np.full(group.r, np.inf)
    for step in range(1, _PLAIN + 1):
        at = group.linearised(true)
        task = group.task(at)
        if step == 1:
            theta, limit = first_parameters(task, _INNER * tolerance)
        before = theta
        found = gauss_newton(theta, limit, task, _INNER * tolerance)
        theta = found.theta
        residual = group.less(at.linear, group.model.moved(found.compliance))
        corrected = group.corrected(at, residual)
        true = corrected if step < _FULL_STEPS else (corrected + true) / 2
        squares = squares_of_lines(residual, at.weight).sum(axis=1)
        moved, far, converged, scatter = _moved(found, before, squares, task.equations, level, tolerance)
        if step == _FULL_STEPS:
            swings = (moved > _SWINGS) & (far > _SHRINKS * last) & ~converged
        last = far
        if step > 1 and (converged | swings).all():
            break
    trust = np.ones((group.r, group.n_freq))
    # A stiffness clearly below zero: FRFs and parameters may have settled on each other's errors.
    error = np.sqrt(np.maximum(np.einsum("raa->ra", scatter), 0) * (squares / task.equations)[:, None])
    below = (theta < -_BELOW * error)[:, : group.model.n].any(axis=1)
    return _result(group, task, found, scatter, squares, trust, step, converged), swings | ~converged | below


def _iterate_carefully(group: Group, noise: FloatArray, level: FloatArray | None, tolerance: float) -> GroupEstimate:
    """Iterate with little trust in noisy lines until the parameters are known, then without those that do not settle.

    A line on which noise hides the joint tells much that is wrong with little doubt, as long as it is linearised about
    FRFs that do not fit the joint.
    """
    true, p = group.data.near, len(group.model.basis.names)
    ratio = gamma_noise(group.data.measured, group.data.transform, noise, group.data.variance)
    soft = 1 / (1 + (ratio / _TRUSTED) ** 8)
    settled = ratio <= LOST
    for step in range(1, _CAREFUL + 1):
        trust = soft if step <= _SOFT_STEPS else settled.astype(float)
        at = group.linearised(true)
        task = group.task(at, trust)
        if step == 1:
            theta, limit = first_parameters(task, _INNER * tolerance)
        elif step <= _SOFT_STEPS and ran_off(theta, limit).any():
            theta = first_parameters(task, _INNER * tolerance)[0]
        before = theta
        found = gauss_newton(theta, limit, task, _INNER * tolerance)
        theta = found.theta
        residual = group.less(at.linear, group.model.moved(found.compliance))
        squares = (squares_of_lines(residual, at.weight) * trust).sum(axis=1)
        *_, converged, scatter = _moved(found, before, squares, task.equations, level, tolerance)
        corrected = group.corrected(at, residual)
        if step >= _SOFT_STEPS:
            own = np.maximum(noise, np.sqrt(squares / np.maximum(task.equations - p / 2, 1)))
            shift = np.sqrt((abs(corrected - true) ** 2 / at.spread).mean(axis=(2, 3)))
            rest = settled & (shift <= _UNSETTLED * own[:, None])
            enough = np.count_nonzero(rest, axis=1) >= max(2, p)
            settled = np.where(enough[:, None], rest, settled)
        true = corrected
        if step > _SOFT_STEPS + 1 and converged.all():
            break
    return _result(group, task, found, scatter, squares, trust, step, converged)


def _moved(
    found: Fitted,
    before: FloatArray,
    squares: FloatArray,
    equations: FloatArray,
    level: FloatArray | None,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], FloatArray]:
    """Return by how many standard errors a parameter moved at most, and whether that is little; and the covariance.

    First at the level given, or that of the residual, then for unit level, as is the covariance.
    """
    scatter = inverse_information(2 * found.information)
    own = np.sqrt(squares / np.maximum(equations - before.shape[1] / 2, 1)) if level is None else level
    error = np.sqrt(np.maximum(np.einsum("raa->ra", scatter), np.finfo(float).tiny))
    shift = np.maximum(abs(found.theta - before) - SHARE_OF_VALUE * abs(found.theta), 0)
    far: FloatArray = (shift / error).max(axis=1)
    moved = np.divide(far, own, out=np.where(far > 0, np.inf, 0.0), where=own > 0)
    return moved, far, moved <= tolerance, scatter


def _result(
    group: Group,
    task: Task,
    found: Fitted,
    scatter: FloatArray,
    squares: FloatArray,
    trust: FloatArray,
    step: int,
    converged: NDArray[np.bool_],
) -> GroupEstimate:
    """Put together what was found."""
    gradient, information = _of_lines(task, found.compliance)
    return GroupEstimate(
        theta=found.theta,
        covariance=scatter,
        squares=squares,
        squares_beside=group.squares_beside(task),
        equations=task.equations,
        equations_beside=group.equations(trust) - trust @ np.count_nonzero(~group.blocked[:, group.moved], axis=1)
        if group.model.is_diagonal
        else np.zeros(group.r),
        trust=trust,
        iterations=np.full(group.r, step),
        converged=converged,
        line_gradient=gradient,
        line_information=information,
    )


def _of_lines(task: Task, compliance: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Tell what each line pulls at the parameters, shape (r, n_freq, p), and knows of them, (r, n_freq, p, p)."""
    factors = task.model.basis.factors
    per_line, adjoint = line_information(task, compliance)
    left = task.value - task.model.moved(compliance)
    weighted = task.weight @ left[..., None] + task.pull[..., None]
    gradient = factors.conj().T[:, :, None] * (adjoint @ weighted)[:, :, None, :, 0]
    products = factors.conj()[:, None] * factors
    whole = products.transpose(2, 0, 1)[:, :, None, :, None] * per_line[:, :, None, :, None, :]
    r, n_freq, p = *gradient.shape[:2], gradient.shape[2] * gradient.shape[3]
    return 2 * gradient.real.reshape(r, n_freq, p), 2 * whole.real.reshape(r, n_freq, p, p)
