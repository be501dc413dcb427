"""The problem for the parameters of a joint: a quadratic form of its compliance on every line, and its minimum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from jointfrf.frf.bands import is_long, line_slices
from jointfrf.identification.manifold.coordinates import (
    CoupledJoint,
    DiagonalJoint,
    JointCoordinates,
    LawCoordinates,
    terms_of,
)
from jointfrf.identification.minimise import Linearised, inverse_information
from jointfrf.identification.parameters import ParameterVector
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import call_for_number

__all__ = [
    "LEAST_GAIN",
    "FormMinimum",
    "FormSquares",
    "LineForms",
    "LineParts",
    "lowest_minimum",
    "minimise_forms",
    "within_reach",
]

_STEPS = 100
#: Levenberg's parameter: first value, factor where a step fails, largest value.
_FIRST, _RAISED, _LARGEST = 1e-4, 6.0, 1e10
#: From this value on damped equations are far from singular; below, directions of a smaller share than the second are
#: left alone.
_REGULAR, _NOT_SOLVED = 1e-9, 1e-13
#: A minimum is found when two steps gain less than this of the squares of one residual.
LEAST_GAIN = 1e-6
_TINY = float(np.finfo(float).tiny)


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

    def on_slice(self, lines: slice) -> LineForms:
        """Return neighbouring lines, without a copy."""
        return LineForms(self.compliance[lines], self.weight[lines], self.gradient[lines], self.squares[lines])

    def scaled(self, line_weight: FloatArray) -> LineForms:
        """Return the same with each line weighted."""
        w = line_weight
        if (w == 1).all():
            return self
        return LineForms(self.compliance, self.weight * w[:, None, None], self.gradient * w[:, None], self.squares * w)

    def at(self, entries: ComplexArray) -> tuple[FloatArray, ComplexArray]:
        """Return the squares of each line, and its weighted residual, at other entries of C."""
        d = entries - self.compliance
        weighted = (self.weight @ d[..., None])[..., 0]
        squares = self.squares + (d.conj() * (weighted - 2 * self.gradient)).real.sum(axis=1)
        return squares, self.gradient - weighted


class LineParts(NamedTuple):
    """What each line adds to the normal equations.

    Attributes
    ----------
    gradient : ndarray, shape (n_lines, p)
    information : ndarray, shape (n_lines, p, p)
    """

    gradient: FloatArray
    information: FloatArray


@dataclass(frozen=True)
class FormMinimum:
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
    forms : LineForms
    joint : JointCoordinates
    """

    x: FloatArray
    cost: float
    information: FloatArray
    gradient: FloatArray
    forms: LineForms
    joint: JointCoordinates

    def of_lines(self, lines: slice) -> LineParts:
        """Return the parts of neighbouring lines; those of a long sweep are not kept."""
        if is_long(len(self.forms.squares)):
            return self._parts(lines)
        return LineParts(*(part[lines] for part in self._all_parts))

    def of_groups(self, member: FloatArray) -> LineParts:
        """Return the sums over groups of lines; `member`, shape (n_groups, n_freq), says how much of a line."""
        gradient, information = np.zeros((len(member), self.x.size)), np.zeros((len(member), *self.information.shape))
        for own in line_slices(member.shape[1]):
            part = self.of_lines(own)
            gradient += member[:, own] @ part.gradient
            information += np.tensordot(member[:, own], part.information, 1)
        return LineParts(gradient, information)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the coordinates where the squares are in units of independent noise, shape (p, p)."""
        return inverse_information(2 * self.information)

    @cached_property
    def _all_parts(self) -> LineParts:
        return self._parts(slice(None))

    def _parts(self, lines: slice) -> LineParts:
        whole = lines == slice(None)
        joint, forms = (self.joint, self.forms) if whole else (self.joint.on_lines(lines), self.forms.on_slice(lines))
        entries = joint.compliance(self.x)
        slope = joint.slope(self.x, entries)
        residual = forms.at(entries)[1]
        if isinstance(joint, DiagonalJoint):
            # Each coordinate moves one entry.
            dofs = joint.dofs
            own = slope[:, dofs, np.arange(dofs.size)]
            adjoint = own.conj()
            weighted = adjoint[:, :, None] * forms.weight[:, dofs[:, None], dofs] * own[:, None, :]
            return LineParts((adjoint * residual[:, dofs]).real, weighted.real)
        adjoint = slope.conj().swapaxes(1, 2)
        return LineParts((adjoint @ residual[..., None])[..., 0].real, (adjoint @ (forms.weight @ slope)).real)

    @property
    def line_gradient(self) -> FloatArray:
        """Part of each line in the gradient, shape (n_freq, p)."""
        return self.of_lines(slice(None)).gradient

    @property
    def line_information(self) -> FloatArray:
        """Part of each line in the information, shape (n_freq, p, p)."""
        return self.of_lines(slice(None)).information


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
    if isinstance(joint, DiagonalJoint):
        return _minimise_diagonal(forms, joint, start, held, least_gain)
    return _minimise_general(forms, joint, start, held, least_gain)


def _minimise_diagonal(
    forms: LineForms, joint: DiagonalJoint, start: FloatArray, held: int | None, least_gain: float
) -> FormMinimum:
    """Minimise over the coordinates of a joint without cross terms, in the kernel."""
    terms, p, n_freq = joint.terms, start.size, len(forms.squares)
    dofs, kinds = (joint.dofs + 1).astype(np.int32), terms.kinds.astype(np.int32)
    sizes = (int(joint.by_rate), terms.n, p, n_freq, _STEPS, 0 if held is None else held + 1)
    x, information, gradient = np.array(start, np.float64), np.empty((p, p)), np.empty(p)
    lines = (terms.omega, *map(np.ascontiguousarray, forms))
    args = (*sizes, least_gain, dofs, kinds, joint.lower, joint.upper, *lines, x, information, gradient)
    cost, _ = call_for_number("fit_diagonal_joint", args)
    return FormMinimum(x, cost, information, gradient, forms, joint)


def _at(forms: LineForms, joint: JointCoordinates, x: FloatArray) -> tuple[float, ComplexArray, ComplexArray]:
    entries = joint.compliance(x)
    with np.errstate(all="ignore"):
        squares, residual = forms.at(entries)
    cost = float(squares.sum())
    return cost if np.isfinite(cost) else np.inf, entries, residual


def _normal_equations(
    forms: LineForms, joint: JointCoordinates, x: FloatArray, entries: ComplexArray, residual: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Return Re(J^H W J) and Re(J^H r) of all lines."""
    if isinstance(joint, CoupledJoint):
        return joint.normal_equations(x, entries, forms.weight, residual)
    slope = joint.slope(x, entries)
    adjoint = slope.conj().swapaxes(1, 2)
    return (adjoint @ (forms.weight @ slope)).real.sum(axis=0), (adjoint @ residual[..., None])[..., 0].real.sum(axis=0)


def _solution(damped: FloatArray, gradient: FloatArray, damping: float) -> FloatArray:
    """Return the step of damped equations; where they may be singular but for rounding, the shortest."""
    if damping > _REGULAR:
        return np.asarray(np.linalg.solve(damped, gradient), np.float64)
    return np.asarray(np.linalg.lstsq(damped, gradient, rcond=_NOT_SOLVED)[0], np.float64)


def _minimise_general(
    forms: LineForms, joint: JointCoordinates, start: FloatArray, held: int | None, least_gain: float
) -> FormMinimum:
    """Minimise over coordinates that may have bounds: of a joint with cross terms, or of any laws."""
    free = np.arange(start.size) != (-1 if held is None else held)
    x, damping, small = np.where(free, np.clip(start, joint.lower, joint.upper), start), _FIRST, 0
    cost, entries, residual = _at(forms, joint, x)
    information, gradient = _normal_equations(forms, joint, x, entries, residual)
    for _ in range(_STEPS):
        moving = free & ~(((x <= joint.lower) & (gradient < 0)) | ((x >= joint.upper) & (gradient > 0)))
        size = np.sqrt(np.maximum(np.diagonal(information), _TINY))
        scaled = (information / np.outer(size, size))[np.ix_(moving, moving)]
        done = not (np.isfinite(scaled).all() and moving.any())
        while not done and damping <= _LARGEST:
            damped, step = scaled + damping * np.eye(len(scaled)), np.zeros(x.size)
            step[moving] = _solution(damped, (gradient / size)[moving], damping) / size[moving]
            there = np.where(free, np.clip(x + step, joint.lower, joint.upper), x)
            new_cost, new_entries, new_residual = _at(forms, joint, there)
            if new_cost <= cost + 1e-13 * abs(cost):
                break
            damping = max(_RAISED * damping, 1e-6)
        if done or damping > _LARGEST:
            break
        gain, x, cost, entries, residual = cost - new_cost, there, new_cost, new_entries, new_residual
        information, gradient = _normal_equations(forms, joint, x, entries, residual)
        damping = damping / _RAISED if damping > 1e-12 else damping
        small = small + 1 if gain <= least_gain * max(1.0, 1e-6 * cost) else 0
        if small == 2:
            break
    return FormMinimum(x, cost, information, gradient, forms, joint)


#: Share of the largest rate beyond which a DOF is all damping.
_ALL_DAMPING = 0.1
#: Other starts are followed until a step gains less than this of the squares of one residual.
_COARSE = 1e-2


def within_reach(joint: JointCoordinates) -> FloatArray:
    """Return rates at which damping is as large as stiffness on the highest line, one for each damping parameter."""
    terms = terms_of(joint)
    fastest = max(float(terms.omega.max()), np.finfo(float).tiny)
    reach: FloatArray = np.where(terms.kinds[terms.n :] == 1, 1.0, 1 / fastest)
    return reach


def lowest_minimum(
    forms: LineForms,
    joint: JointCoordinates,
    start: FloatArray,
    held: int | None = None,
    least_gain: float = LEAST_GAIN,
) -> FormMinimum:
    """Minimise; where a DOF ends rigid or all damping, also from no damping and from some.

    Parameters
    ----------
    forms, joint, start, held, least_gain
        As in `minimise_forms`.

    Notes
    -----
    A compliance and its rate are a vector in polar coordinates: at a = 0 nothing moves the rate any more, not even from
    the wrong sign of damping.
    """
    found = minimise_forms(forms, joint, start, held, least_gain)
    if not isinstance(joint, DiagonalJoint) or joint.rates.size == 0:
        return found
    n = joint.terms.n
    of_rate = joint.dofs[joint.rates]
    rate = abs(found.x[joint.rates]) * (1.0 if joint.by_rate else found.x[of_rate])
    reach = within_reach(joint)
    caught = found.x[:n] <= 0
    np.logical_or.at(caught, of_rate, rate > _ALL_DAMPING * joint.largest_rate)
    if not caught.any():
        return found
    size = abs(forms.compliance).mean(axis=0)
    for share in (0.0, 1.0):
        x = found.x.copy()
        x[:n] = np.where(caught, size, x[:n])
        if held is not None:
            x[held] = start[held]
        other = share * reach / (1.0 if joint.by_rate else np.maximum(x[of_rate], np.finfo(float).tiny))
        moved = caught[of_rate] & (joint.rates != held)
        x[joint.rates] = np.where(moved, other, x[joint.rates])
        there = minimise_forms(forms, joint, x, held, max(least_gain, _COARSE))
        if there.cost < found.cost - _COARSE:
            found = minimise_forms(forms, joint, there.x, held, least_gain)
    return found


@dataclass(frozen=True)
class FormSquares:
    """-2 log likelihood of the compliance by the quadratic forms of the last linearisation.

    Attributes
    ----------
    joint : LawCoordinates
    forms : LineForms
    """

    joint: LawCoordinates
    forms: LineForms

    @property
    def vector(self) -> ParameterVector:
        """The parameters."""
        return self.joint.vector

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares; a residual has the mean square 1, real and imaginary part each."""
        with np.errstate(all="ignore"):
            squares = 2 * float(self.forms.at(self.joint.compliance(x))[0].sum())
        return squares if np.isfinite(squares) else np.inf

    def linearised(self, x: FloatArray) -> Linearised:
        """Return it with its derivatives."""
        entries = self.joint.compliance(x)
        slope = self.joint.slope(x, entries)
        squares, residual = self.forms.at(entries)
        adjoint = slope.conj().swapaxes(1, 2)
        information = 2 * (adjoint @ (self.forms.weight @ slope)).real.sum(axis=0)
        gradient = 2 * (adjoint @ residual[..., None])[..., 0].real.sum(axis=0)
        return Linearised(2 * float(squares.sum()), information, gradient)
