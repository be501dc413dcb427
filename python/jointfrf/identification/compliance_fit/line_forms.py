"""The problem for the parameters of a joint: a quadratic form of its compliance on every line, and its minimum."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.identification.compliance_fit.joint_terms import JointCoordinates
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["LEAST_GAIN", "FormMinimum", "LineForms", "inverse_information", "minimise_forms"]

_STEPS = 100
#: Levenberg's parameter: first value, factor where a step fails, largest value.
_FIRST, _RAISED, _LARGEST = 1e-4, 6.0, 1e10
#: A minimum is found when two steps gain less than this of the squares of one residual.
LEAST_GAIN = 1e-6


class LineForms(NamedTuple):
    """Squares to be minimised: on every line c0 - 2 Re(d^H p) + d^H W d, with d = C(x) - C0.

    Attributes
    ----------
    compliance : ndarray, shape (n_freq, q)
        Entries of C about which is linearised, C0, m/N.
    weight : ndarray, shape (n_freq, q, q)
        Information W on them.
    gradient : ndarray, shape (n_freq, q)
        p, the weighted residual there.
    squares : ndarray, shape (n_freq,)
        c0, squares of the residual there.
    """

    compliance: ComplexArray
    weight: ComplexArray
    gradient: ComplexArray
    squares: FloatArray

    def scaled(self, line_weight: FloatArray) -> LineForms:
        """Return the same with each line weighted."""
        w = line_weight
        return LineForms(self.compliance, self.weight * w[:, None, None], self.gradient * w[:, None], self.squares * w)

    def at(self, entries: ComplexArray) -> tuple[FloatArray, ComplexArray]:
        """Return the squares of each line, and its weighted residual, at other entries of C."""
        d = entries - self.compliance
        weighted = (self.weight @ d[..., None])[..., 0]
        squares = self.squares + (d.conj() * (weighted - 2 * self.gradient)).real.sum(axis=1)
        return squares, self.gradient - weighted


class FormMinimum(NamedTuple):
    """A minimum.

    Attributes
    ----------
    x : ndarray, shape (p,)
        Coordinates of the joint.
    cost : float
        Sum of the squares; inf where no step was possible.
    information : ndarray, shape (p, p)
        Re(J^H W J), half the second derivative.
    gradient : ndarray, shape (p,)
        Re(J^H r): zero but for coordinates at their bound.
    line_gradient : ndarray, shape (n_freq, p)
        Part of each line in the gradient.
    line_information : ndarray, shape (n_freq, p, p)
        Part of each line in the information.
    """

    x: FloatArray
    cost: float
    information: FloatArray
    gradient: FloatArray
    line_gradient: FloatArray
    line_information: FloatArray


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


def _at(forms: LineForms, joint: JointCoordinates, x: FloatArray) -> tuple[float, ComplexArray, ComplexArray]:
    entries = joint.compliance(x)
    with np.errstate(all="ignore"):
        squares, residual = forms.at(entries)
    cost = float(squares.sum())
    return cost if np.isfinite(cost) else np.inf, entries, residual


def minimise_forms(
    forms: LineForms,
    joint: JointCoordinates,
    start: FloatArray,
    held: int | None = None,
    least_gain: float = LEAST_GAIN,
) -> FormMinimum:
    """Minimise by Levenberg-Marquardt steps, coordinates not below their bounds.

    Parameters
    ----------
    forms : LineForms
    joint : JointCoordinates
    start : ndarray, shape (p,)
    held : int, optional
        A coordinate that keeps its value.
    least_gain : float
        The iteration ends when two steps in a row lower the squares by less; a residual has mean square 1.
    """
    lower, upper = joint.lower, joint.upper
    free = np.arange(start.size) != (-1 if held is None else held)
    x = np.where(free, np.clip(start, lower, upper), start)
    damping, small = _FIRST, 0
    cost, entries, residual = _at(forms, joint, x)
    for _ in range(_STEPS):
        information, gradient = joint.normal_equations(x, entries, forms.weight, residual)
        pressed = ((x <= lower) & (gradient < 0)) | ((x >= upper) & (gradient > 0))
        moving = np.flatnonzero(free & ~pressed)
        step = np.zeros_like(x)
        size = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
        scaled = (information / np.outer(size, size))[np.ix_(moving, moving)]
        done = moving.size == 0 or not np.isfinite(scaled).all()
        while not done and damping <= _LARGEST:
            damped = scaled + damping * np.eye(moving.size)
            step[moving] = np.linalg.lstsq(damped, (gradient / size)[moving], rcond=1e-13)[0] / size[moving]
            there = np.where(free, np.clip(x + step, lower, upper), x)
            new_cost, new_entries, new_residual = _at(forms, joint, there)
            if new_cost <= cost + 1e-13 * abs(cost):
                break
            damping = max(_RAISED * damping, 1e-6)
        if done or damping > _LARGEST:
            break
        gain, x, cost, entries, residual = cost - new_cost, there, new_cost, new_entries, new_residual
        damping = damping / _RAISED if damping > 1e-12 else damping
        small = small + 1 if gain <= least_gain * max(1.0, 1e-6 * cost) else 0
        if small == 2:
            break
    slope = joint.slope(x, entries)
    adjoint = slope.conj().swapaxes(1, 2)
    line_gradient = (adjoint @ residual[..., None])[..., 0].real
    line_information = (adjoint @ forms.weight @ slope).real
    return FormMinimum(
        x, cost, line_information.sum(axis=0), line_gradient.sum(axis=0), line_gradient, line_information
    )
