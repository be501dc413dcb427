"""Quadratic forms of the compliance of a joint, one on every line: the squares of a fit, and a minimum of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from jointfrf.frf.bands import is_long, line_slices
from jointfrf.identification.minimise import Linearised, inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray

if TYPE_CHECKING:
    from jointfrf.identification.manifold.coordinates import JointCoordinates

__all__ = ["FormMinimum", "FormSquares", "LineForms", "LineParts"]


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


class FormSquares:
    """Sum of the forms of all lines as a function of the coordinates of a joint.

    Parameters
    ----------
    forms : LineForms
    joint : JointCoordinates
    """

    #: A complex residual has the mean square 1: its real and imaginary part 1/2 each.
    unit = 0.5

    def __init__(self, forms: LineForms, joint: JointCoordinates) -> None:
        self.forms, self.joint = forms, joint
        self.bounds = joint.lower, joint.upper
        self.longest = np.full(joint.lower.size, np.inf)
        self._last: tuple[FloatArray, float, ComplexArray, ComplexArray] | None = None

    def _at(self, x: FloatArray) -> tuple[float, ComplexArray, ComplexArray]:
        """Return the sum, the entries of C and the weighted residual; those of the last coordinates are kept."""
        if self._last is None or not np.array_equal(self._last[0], x):
            entries = self.joint.compliance(x)
            with np.errstate(all="ignore"):
                squares, residual = self.forms.at(entries)
            cost = float(squares.sum())
            self._last = x.copy(), cost if np.isfinite(cost) else np.inf, entries, residual
        return self._last[1:]

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares; inf where K* is singular."""
        return self._at(x)[0]

    def linearised(self, x: FloatArray) -> Linearised:
        """Return it with its derivatives."""
        cost, entries, residual = self._at(x)
        return Linearised(cost, *self.joint.normal_equations(x, entries, self.forms.weight, residual))


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

    def of_lines(self, lines: slice = slice(None)) -> LineParts:
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
        return LineParts(*joint.line_parts(self.x, entries, forms.weight, forms.at(entries)[1]))
