"""The compliance fit of one group of joint DOFs: linearise, minimise, correct the FRFs, until nothing changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.initial_parameters import diverged, initial_parameters
from jointfrf.identification.compliance_fit.least_squares import (
    SHARE_OF_VALUE,
    LeastSquares,
    Minimum,
    inverse_information,
    line_information,
    minimise,
)
from jointfrf.identification.compliance_fit.line_selection import EveryLine, LineSelection, Progress, ReliableLines
from jointfrf.identification.compliance_fit.linearised import DofGroup, GroupData, squares_of_lines
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["GroupEstimate", "fit_group"]

#: Linearisations at most.
_MOST = 40
#: The parameters of one linearisation are found to this share of the tolerance.
_INNER = 0.02
#: A stiffness that is negative by so many standard errors is doubted.
_BELOW = 3.0


class GroupEstimate(NamedTuple):
    """Result of `fit_group`; what is not said here is as in `ComplianceEstimate`.

    Attributes
    ----------
    squares : ndarray, shape (r,)
        Weighted squares of the residual.
    off_diagonal_squares : ndarray, shape (r,)
        Those of the entries of C off the diagonal of a diagonal joint, by themselves.
    equations, off_diagonal_equations : ndarray, shape (r,)
        Complex equations, and those of the entries off the diagonal.
    line_weight : ndarray, shape (r, n_freq)
        1 on lines used, 0 on lines left out.
    """

    theta: FloatArray
    covariance: FloatArray
    squares: FloatArray
    off_diagonal_squares: FloatArray
    equations: FloatArray
    off_diagonal_equations: FloatArray
    line_weight: FloatArray
    iterations: NDArray[np.intp]
    converged: NDArray[np.bool_]
    line_gradient: FloatArray
    line_information: FloatArray


def fit_group(data: GroupData, noise: FloatArray, level: FloatArray | None, tolerance: float) -> GroupEstimate:
    """Fit one group of DOFs: on every line, and where that fails on reliable lines.

    Parameters
    ----------
    data : GroupData
        Lines that are used, symmetrised if the structure is reciprocal.
    noise : ndarray, shape (r,)
        Noise level, to judge which lines are reliable.
    level : ndarray, shape (r,), optional
        Noise level to judge convergence; by default from the residual.
    tolerance : float
        As in `estimate`.
    """
    group = DofGroup(data)
    every = EveryLine(group)
    found = _iterate(group, every, level, tolerance)
    failed = every.oscillating | ~found.converged | _has_negative_stiffness(group, found)
    if failed.any():
        which = np.flatnonzero(failed)
        group = DofGroup(data.of(which).without_outliers(noise[which]))
        own_level = None if level is None else level[which]
        again = _iterate(group, ReliableLines(group, noise[which]), own_level, tolerance)
        for whole, part in zip(found, again, strict=True):
            whole[which] = part
    return found


def _iterate(group: DofGroup, lines: LineSelection, level: FloatArray | None, tolerance: float) -> GroupEstimate:
    """Linearise, minimise and correct the FRFs until the parameters converge."""
    true = group.data.initial
    theta = limit = np.empty(0)
    for step in range(1, _MOST + 1):
        weight = lines.weight(step)
        at = group.linearised(true)
        problem = group.least_squares(at, weight)
        if step == 1:
            theta, limit = initial_parameters(problem, _INNER * tolerance)
        elif lines.may_restart(step) and diverged(theta, limit).any():
            theta = initial_parameters(problem, _INNER * tolerance)[0]
        minimum = minimise(theta, limit, problem, _INNER * tolerance)
        residual = group.residual(at.linear, group.model.entries(minimum.compliance))
        of_lines = squares_of_lines(residual, at.weight)
        squares = (of_lines if weight is None else of_lines * weight).sum(axis=1)
        covariance = inverse_information(2 * minimum.information)
        change = _change(minimum.theta, theta, covariance)
        in_errors = _in_errors(change, squares, problem, level)
        progress = Progress(
            step, true, group.corrected(at, residual), at.spread, squares, problem.equations, change, in_errors,
            in_errors <= tolerance,
        )  # fmt: skip
        theta, true = minimum.theta, lines.next_frfs(progress)
        if lines.is_finished(progress):
            break
    line_weight = np.ones((group.r, group.n_freq)) if weight is None else weight
    return _result(group, problem, minimum, covariance, line_weight, progress)


def _change(theta: FloatArray, before: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the largest change of a parameter in standard errors of the covariance, shape (r,)."""
    error = np.sqrt(np.maximum(np.einsum("raa->ra", covariance), np.finfo(float).tiny))
    change = np.maximum(abs(theta - before) - SHARE_OF_VALUE * abs(theta), 0) / error
    largest: FloatArray = change.max(axis=1)
    return largest


def _in_errors(change: FloatArray, squares: FloatArray, problem: LeastSquares, level: FloatArray | None) -> FloatArray:
    """Return a change for unit level in standard errors at the level given, or at that of the residual."""
    if level is None:
        p = len(problem.model.basis.parameters)
        level = np.sqrt(squares / np.maximum(problem.equations - p / 2, 1))
    return np.divide(change, level, out=np.where(change > 0, np.inf, 0.0), where=level > 0)


def _has_negative_stiffness(group: DofGroup, found: GroupEstimate) -> NDArray[np.bool_]:
    """Whether a stiffness is clearly below zero: FRFs and parameters may have adapted to each other's errors."""
    variance = np.maximum(np.einsum("raa->ra", found.covariance), 0)
    error = np.sqrt(variance * (found.squares / found.equations)[:, None])
    return np.asarray((found.theta < -_BELOW * error)[:, : group.model.n].any(axis=1))


def _result(
    group: DofGroup,
    problem: LeastSquares,
    minimum: Minimum,
    covariance: FloatArray,
    line_weight: FloatArray,
    progress: Progress,
) -> GroupEstimate:
    """Put together what was found."""
    gradient, information = _of_lines(problem, minimum.compliance)
    return GroupEstimate(
        theta=minimum.theta,
        covariance=covariance,
        squares=progress.squares,
        off_diagonal_squares=group.off_diagonal_squares(problem),
        equations=problem.equations,
        off_diagonal_equations=group.off_diagonal_equations(line_weight),
        line_weight=line_weight,
        iterations=np.full(group.r, progress.step),
        converged=progress.converged,
        line_gradient=gradient,
        line_information=information,
    )


def _of_lines(problem: LeastSquares, compliance: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Gradient and information of each line, shapes (r, n_freq, p) and (r, n_freq, p, p)."""
    factors = problem.model.basis.factors
    per_line, adjoint = line_information(problem, compliance)
    residual = problem.value - problem.model.entries(compliance)
    weighted = problem.weight @ residual[..., None] + problem.other_gradient[..., None]
    gradient = factors.conj().T[:, :, None] * (adjoint @ weighted)[:, :, None, :, 0]
    products = factors.conj()[:, None] * factors
    whole = products.transpose(2, 0, 1)[:, :, None, :, None] * per_line[:, :, None, :, None, :]
    r, n_freq, p = *gradient.shape[:2], gradient.shape[2] * gradient.shape[3]
    return 2 * gradient.real.reshape(r, n_freq, p), 2 * whole.real.reshape(r, n_freq, p, p)
