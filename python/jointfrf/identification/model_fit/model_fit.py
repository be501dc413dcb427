"""What a fit of a model found, with its uncertainty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import ArrayLike

from jointfrf.identification.fitted_parameters import FittedParameters
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.fit import OpenDirection
from jointfrf.identification.parameter_table import unit_of
from jointfrf.identification.parameters import FitParameter
from jointfrf.identification.residual_test import ResidualTest
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["ModelFit"]


@dataclass(frozen=True)
class ModelFit(FittedParameters):
    """Parameters of a joint and unknowns of the models, found together, and their uncertainty.

    Attributes
    ----------
    assembly : Assembly
        What was fitted.
    joint : LawJoint
        The joint found.
    parameters : dict of str to float
        Free parameters in the order of the covariance: those of the joint (``"k_y"``, ``"tau_y"``), then unknowns
        (``"A/youngs_modulus"``, ``"mass A/151:y"``, ``"gain of response B/226:y"``).
    covariance : ndarray, shape (p, p)
        Covariance of the parameters, priors included.
    fitted : tuple of FitParameter
        The free parameters: units, priors, limits.
    noise_level, residual_level : float
        Median of the noise relative to the FRFs, and what the residual shows of it.
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    responses, forces : tuple of str
        Channels.
    predicted : ndarray, shape (n_freq, n_o, n_i)
        FRFs of the assembly found, m/N.
    residual : ndarray, shape (n_freq, n_o, n_i)
        Measured minus predicted over the standard deviation of the noise; NaN where nothing was measured.
    test : ResidualTest
        Whether the residual is noise.
    open_directions : tuple of OpenDirection
        What the FRFs do not hold.
    is_converged : bool
    warnings : tuple of str
        What a reader must know before using the numbers.
    notes : tuple of str
        How the numbers came about.
    intervals : callable
        From a probability to the interval of each parameter.
    """

    assembly: Assembly
    joint: LawJoint
    parameters: dict[str, float]
    covariance: FloatArray
    fitted: tuple[FitParameter, ...]
    noise_level: float
    residual_level: float
    freq_hz: FloatArray
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    predicted: ComplexArray = field(repr=False)
    residual: ComplexArray = field(repr=False)
    test: ResidualTest
    open_directions: tuple[OpenDirection, ...]
    is_converged: bool
    intervals: Callable[[float], dict[str, tuple[float, float]]] = field(repr=False, compare=False)
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def joint_parameters(self) -> dict[str, float]:
        """Those of the parameters that belong to the joint."""
        return {one.name: self.parameters[one.name] for one in self.fitted if one.origin == "joint"}

    def k_joint(self, freq_hz: ArrayLike) -> ComplexArray:
        """Complex joint stiffness found, shape (n_freq, n, n), N/m, rotational N m/rad."""
        return self.joint.dynamic_stiffness(freq_hz)

    def unit(self, parameter: str) -> str:
        """Return the unit of a parameter; ValueError where the fit has none of this name."""
        return unit_of(parameter, self.fitted)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the lines, as plain numbers and text, ready for JSON (an open interval ends at None)."""
        told = self._plain(self.fitted)
        for one in self.fitted:
            told["parameters"][one.name]["prior"] = None if one.std is None else [one.value, one.std]
        return {
            "method": "model",
            "dofs": list(self.joint.dofs),
            "rigid": list(self.joint.rigid),
            "residual_is_noise": self.test.is_noise,
            "responses": list(self.responses),
            "forces": list(self.forces),
            **told,
        }

    def __str__(self) -> str:
        """Return a table of the parameters with their intervals, and the warnings."""
        prior = ["" if one.std is None else f"{one.value:.4g} +- {one.std:.2g}" for one in self.fitted]
        said = f", {len(self.responses)} responses x {len(self.forces)} forces"
        return self._shown("model", self.fitted, said, prior=prior)
