"""Squares of a fit of laws about its minimum, as profiles of the likelihood take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.identification.compliance_fit.line_forms import LineForms
from jointfrf.identification.law_fit.law_coordinates import LawCoordinates
from jointfrf.identification.model_fit.likelihood import Linearised
from jointfrf.identification.model_fit.unknowns import ParameterVector
from jointfrf.kernel.arguments import FloatArray

__all__ = ["FormSquares"]


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
