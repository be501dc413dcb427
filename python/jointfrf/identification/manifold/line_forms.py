"""Quadratic forms of the compliance of a joint, one on every line; coordinates of a joint that minimise them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import is_long, line_slices
from jointfrf.identification.minimise import NormalEquations, inverse_information, minimise
from jointfrf.identification.scatter import LineParts
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "LEAST_GAIN",
    "STEPS",
    "FormMinimum",
    "FormSquares",
    "JointCoordinates",
    "LineForms",
    "NamedParameter",
]

#: Maximum number of steps of a minimiser.
STEPS = 100
#: Convergence: two steps decrease the sum of squares by less than this share of the squares of one residual, or one
#: step predicts a decrease below a share of it.
LEAST_GAIN, _PROMISED = 1e-6, 1e-3


class LineForms(NamedTuple):
    """Squares to be minimised: on every line c0 - 2 Re(d^H p) + d^H W d, with d = C(x) - C0.

    Attributes
    ----------
    compliance : ndarray, shape (n_freq, q)
        Entries C0 of C at the linearisation point, m/N.
    weight : ndarray, shape (n_freq, q, q)
        Information W on these entries.
    gradient : ndarray, shape (n_freq, q)
        Weighted residual p at this point.
    squares : ndarray, shape (n_freq,)
        Squares c0 of the residual at this point.
    """

    compliance: ComplexArray
    weight: ComplexArray
    gradient: ComplexArray
    squares: FloatArray

    def on_slice(self, lines: slice) -> LineForms:
        """Return some of the lines; neighbouring ones without a copy."""
        return LineForms._make(np.ascontiguousarray(one[lines]) for one in self)

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


class FormSquares:
    """Sum of the forms of all lines as a function of the coordinates of a joint.

    Parameters
    ----------
    forms : LineForms
        Forms of all lines.
    joint : JointCoordinates
        Coordinates of the joint.
    """

    #: A complex residual has the mean square 1, 1/2 in its real and in its imaginary part.
    unit = 0.5

    def __init__(self, forms: LineForms, joint: JointCoordinates) -> None:
        self.forms, self.joint = forms, joint
        self.bounds = joint.lower, joint.upper
        self._last: tuple[FloatArray, float, ComplexArray, ComplexArray] | None = None

    def longest(self, x: FloatArray) -> FloatArray:
        """Return the largest step of each coordinate: there is none."""
        return np.full(x.size, np.inf)

    def _at(self, x: FloatArray) -> tuple[float, ComplexArray, ComplexArray]:
        """Return the sum, the entries of C and the weighted residual; the last result is cached."""
        if self._last is None or not np.array_equal(self._last[0], x):
            entries = self.joint.compliance(x)
            with np.errstate(all="ignore"):
                squares, residual = self.forms.at(entries)
            cost = float(squares.sum())
            self._last = x.copy(), cost if np.isfinite(cost) else np.inf, entries, residual
        return self._last[1:]

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares; inf if K* is singular."""
        return self._at(x)[0]

    def linearised(self, x: FloatArray) -> NormalEquations:
        """Return the sum of the squares with its derivatives."""
        cost, entries, residual = self._at(x)
        return NormalEquations(cost, *self.joint.normal_equations(x, entries, self.forms.weight, residual))


@dataclass(frozen=True)
class FormMinimum:
    """A minimum of quadratic forms.

    Attributes
    ----------
    x : ndarray, shape (p,)
        Coordinates of the joint.
    cost : float
        Sum of the squares; inf if no step was possible.
    information : ndarray, shape (p, p)
        Half the second derivative, Re(J^H W J).
    gradient : ndarray, shape (p,)
        Minus half the gradient, Re(J^H r): zero except for coordinates at a bound.
    forms : LineForms
        Minimised forms.
    joint : JointCoordinates
        Coordinates of the joint.
    """

    x: FloatArray
    cost: float
    information: FloatArray
    gradient: FloatArray
    forms: LineForms
    joint: JointCoordinates

    def of_lines(self, lines: slice = slice(None)) -> LineParts:
        """Return the parts of neighbouring lines; the parts of a long sweep are not kept."""
        if is_long(len(self.forms.squares)):
            return self._parts(lines)
        return LineParts(*(part[lines] for part in self._all_parts))

    def of_groups(self, member: FloatArray) -> LineParts:
        """Return the sums over groups of lines; `member`, shape (n_groups, n_freq), is the share of each line."""
        gradient, information = np.zeros((len(member), self.x.size)), np.zeros((len(member), *self.information.shape))
        for own in line_slices(member.shape[1]):
            part = self.of_lines(own)
            gradient += member[:, own] @ part.gradient
            information += np.tensordot(member[:, own], part.information, 1)
        return LineParts(gradient, information)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the coordinates for squares in units of independent noise, shape (p, p)."""
        return inverse_information(2 * self.information)

    @cached_property
    def _all_parts(self) -> LineParts:
        return self._parts(slice(None))

    def _parts(self, lines: slice) -> LineParts:
        whole = lines == slice(None)
        joint, forms = (self.joint, self.forms) if whole else (self.joint.on_lines(lines), self.forms.on_slice(lines))
        entries = joint.compliance(self.x)
        return LineParts(*joint.line_parts(self.x, entries, forms.weight, forms.at(entries)[1]))


class NamedParameter(Protocol):
    """A parameter of a joint, of springs or of any law."""

    @property
    def name(self) -> str:
        """Its name."""


class JointCoordinates(ABC):
    """R = (K* + Z)^-1 of a joint as a function of coordinates x of length p, one for each parameter.

    Attributes
    ----------
    parameters : sequence, length p
        Parameters of the joint in the order of the coordinates.
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    n : int
        Number of joint DOFs.
    rows, columns : ndarray of int, shape (q,)
        Entries of R that the coordinates change, on and above its diagonal.
    lower, upper : ndarray, shape (p,)
        Smallest and largest value of each coordinate.
    dofs : ndarray of int, shape (p,)
        DOF of each parameter; for a cross term the DOF of its row.
    is_stiffness : ndarray of bool, shape (p,)
        Parameters that are the stiffness of one DOF.
    in_compliance : bool
        Whether the coordinates of stiffnesses are compliances a = 1/(k + z), 0 for a rigid DOF, and the coordinates of
        damping their rates: the n compliances first.
    rate_of_one : ndarray
        Rates at which damping is as large as stiffness on the highest line; only for these coordinates.
    springs : ndarray, shape (n,)
        Reference springs Z, N/m or N m/rad.
    """

    parameters: Sequence[NamedParameter]
    omega: FloatArray
    n: int
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    lower: FloatArray
    upper: FloatArray
    dofs: NDArray[np.intp]
    is_stiffness: NDArray[np.bool_]
    in_compliance = False
    rate_of_one: FloatArray = np.zeros(0)
    springs: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(one.name for one in self.parameters)

    @property
    def is_compliance(self) -> NDArray[np.bool_]:
        """Which coordinates are compliances, shape (p,)."""
        return self.is_stiffness & self.in_compliance

    def compliance_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of 1/k by the coordinates a = 1/(k + z) of stiffnesses, 1 elsewhere, shape (p,)."""
        slope, of = np.ones(x.size), self.is_compliance
        slope[of] = 1 / np.maximum((1 - self.springs[self.dofs[of]] * x[of]) ** 2, np.finfo(float).tiny)
        return slope

    def may_be_rigid(self, i: int) -> bool:
        """Return whether the coordinate of a parameter's DOF is its compliance."""
        return False

    @abstractmethod
    def on_lines(self, lines: slice | NDArray[np.intp]) -> JointCoordinates:
        """Return the same on some of the lines."""

    @abstractmethod
    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the entries of R that the coordinates change, shape (n_freq, q); NaN if K* + Z is singular."""

    @abstractmethod
    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return the derivatives of these entries by the coordinates, shape (n_freq, q, p)."""

    @abstractmethod
    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters, shape (p,)."""

    @abstractmethod
    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the coordinates of parameters."""

    @abstractmethod
    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the parameters by the coordinates, shape (p, p)."""

    def matrix(self, entries: ComplexArray) -> ComplexArray:
        """Return R of its entries, shape (n_freq, n, n); zero for entries that the coordinates do not change."""
        c = np.zeros((len(entries), self.n, self.n), np.complex128)
        c[:, self.rows, self.columns] = c[:, self.columns, self.rows] = entries
        return c

    def line_parts(
        self, x: FloatArray, entries: ComplexArray, weight: ComplexArray, residual: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Re(J^H r), shape (n_freq, p), and Re(J^H W J), shape (n_freq, p, p), of each line; J is the slope."""
        slope = self.slope(x, entries)
        adjoint = slope.conj().swapaxes(1, 2)
        return (adjoint @ residual[..., None])[..., 0].real, (adjoint @ (weight @ slope)).real

    def normal_equations(
        self, x: FloatArray, entries: ComplexArray, weight: ComplexArray, residual: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Re(J^H W J), shape (p, p), and Re(J^H r), shape (p,), of all lines."""
        gradient, information = self.line_parts(x, entries, weight, residual)
        return information.sum(axis=0), gradient.sum(axis=0)

    def minimise(
        self, forms: LineForms, start: FloatArray, held: int | None = None, least_gain: float = LEAST_GAIN
    ) -> FormMinimum:
        """Minimise quadratic forms by Levenberg-Marquardt steps inside the bounds.

        Parameters
        ----------
        forms : LineForms
            Quadratic forms.
        start : ndarray, shape (p,)
            Initial coordinates.
        held : int, optional
            Number of a coordinate that stays fixed.
        least_gain : float
            Decrease of the squares in two successive steps below which the iteration ends; a residual has mean square
            1.
        """
        squares = FormSquares(forms, self)
        small = least_gain / squares.unit
        found = minimise(squares, start, held, STEPS, _PROMISED * small, small)
        return FormMinimum(found.x, found.cost, found.information, found.gradient, forms, self)

    def lowest(
        self, forms: LineForms, start: FloatArray, held: int | None = None, least_gain: float = LEAST_GAIN
    ) -> FormMinimum:
        """Minimise like `minimise`, and from further initial values if a minimum may not be the lowest."""
        return self.minimise(forms, start, held, least_gain)

    def linearisation_point(self, minimum: FormMinimum, x: FloatArray) -> FloatArray:
        """Return coordinates for a linearisation near x, limited to the resolution of the data at a minimum."""
        return x

    def has_profile(self, i: int, x: FloatArray, covariance: FloatArray) -> bool:
        """Return whether noise is so far from normal in a coordinate that its interval needs a profile."""
        return False

    def of_profile(self, i: int) -> JointCoordinates:
        """Return the coordinates in which the likelihood of one parameter has its profile."""
        return self

    def value(self, i: int, x: FloatArray) -> float:
        """Return one of the parameters."""
        return float(self.theta(x)[i])

    def end(self, i: int, sign: int) -> float:
        """Return the limit of a parameter whose coordinate is unbounded below (-1) or above (1)."""
        return sign * np.inf

    def longest_reach(self, i: int) -> float:
        """Return the largest distance from a minimum for the first search of a limit."""
        return np.inf
