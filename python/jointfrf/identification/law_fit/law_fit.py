"""What a fit of laws found, with its uncertainty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import ArrayLike

from jointfrf.identification.fitted_parameters import FittedParameters
from jointfrf.identification.parameter_table import unit_of
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["LawFit"]


@dataclass(frozen=True)
class LawFit(FittedParameters):
    """Parameters of the laws of a joint, found without models of the structures, and their uncertainty.

    Attributes
    ----------
    joint : LawJoint
        The joint found.
    parameters : dict of str to float
        By name, ``"k_y"``, ``"tau_y"``, in the order of the covariance.
    covariance : ndarray, shape (p, p)
        Covariance of the parameters.
    noise_level, residual_level : float
        Median of the noise relative to the FRFs, and what the residual shows of it.
    freq_hz : ndarray, shape (n_freq,)
        Lines used, Hz.
    k_lines : ndarray, shape (n_freq, n, n)
        K*(w) of each line by itself, N/m; NaN where a line could not be inverted.
    is_converged : bool
    warnings : tuple of str
        What a reader must know before using the numbers.
    notes : tuple of str
        How the numbers came about.
    intervals : callable
        From a probability to the interval of each parameter.
    """

    joint: LawJoint
    parameters: dict[str, float]
    covariance: FloatArray
    noise_level: float
    residual_level: float
    freq_hz: FloatArray
    k_lines: ComplexArray = field(repr=False)
    is_converged: bool
    intervals: Callable[[float], dict[str, tuple[float, float]]] = field(repr=False, compare=False)
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the joint DOFs."""
        return self.joint.dofs

    def k_joint(self, freq_hz: ArrayLike) -> ComplexArray:
        """Complex joint stiffness found, shape (n_freq, n, n), N/m, rotational N m/rad.

        Raises
        ------
        ValueError
            A DOF is rigid: `joint.compliance` has it.
        """
        return self.joint.dynamic_stiffness(freq_hz)

    def unit(self, parameter: str) -> str:
        """Return the unit of a parameter; ValueError where the fit has none of this name."""
        return unit_of(parameter, self.joint.quantities)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the lines, as plain numbers and text, ready for JSON (an open interval ends at None)."""
        return {
            "method": "compliance",
            "dofs": list(self.dofs),
            "laws": {",".join(dict.fromkeys(pair)): type(law).__name__ for pair, law in self.joint.laws.items()},
            "rigid": list(self.joint.rigid),
            **self._plain(self.joint.quantities),
        }

    def __str__(self) -> str:
        """Return a table of the parameters with their intervals, and the warnings."""
        said = f"\nrigid: {', '.join(self.joint.rigid)}" if self.joint.rigid else ""
        return self._shown("compliance", self.joint.quantities, said)
