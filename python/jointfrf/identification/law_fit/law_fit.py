"""What a fit of laws found, with its uncertainty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.identification.parameter_table import columns_of, wrapped
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["LawFit"]


@dataclass(frozen=True)
class LawFit:
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

    @property
    def std_error(self) -> dict[str, float]:
        """Standard error of each parameter, in its unit."""
        errors = np.sqrt(np.maximum(np.diagonal(self.covariance), 0))
        return dict(zip(self.parameters, errors.tolist(), strict=True))

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the errors of all parameters, shape (p, p)."""
        size = np.sqrt(np.maximum(np.diagonal(self.covariance), np.finfo(float).tiny))
        return np.asarray(self.covariance / np.outer(size, size))

    def confidence_interval(self, probability: float = 0.95) -> dict[str, tuple[float, float]]:
        """Interval that contains the true parameter with the given probability, by profile likelihood.

        Raises
        ------
        ValueError
            The probability is not between 0 and 1.
        """
        if not 0 < probability < 1:
            raise ValueError(f"probability must lie between 0 and 1, not {probability}")
        return self.intervals(probability)

    def k_joint(self, freq_hz: ArrayLike) -> ComplexArray:
        """Complex joint stiffness found, shape (n_freq, n, n), N/m, rotational N m/rad.

        Raises
        ------
        ValueError
            A DOF is rigid: `joint.compliance` has it.
        """
        return self.joint.dynamic_stiffness(freq_hz)

    def unit(self, parameter: str) -> str:
        """Return the unit of a parameter."""
        return next(one.unit for one in self.joint.quantities if one.name == parameter)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the lines, as plain numbers and text, ready for JSON (an open interval ends at None)."""
        intervals, errors = self.confidence_interval(0.95), self.std_error

        def plain(number: float) -> float | None:
            return float(number) if np.isfinite(number) else None

        return {
            "method": "compliance",
            "dofs": list(self.dofs),
            "laws": {",".join(dict.fromkeys(pair)): type(law).__name__ for pair, law in self.joint.laws.items()},
            "rigid": list(self.joint.rigid),
            "parameters": {
                one.name: {
                    "value": float(self.parameters[one.name]),
                    "unit": one.unit,
                    "std_error": plain(errors[one.name]),
                    "confidence_interval_95": [plain(limit) for limit in intervals[one.name]],
                }
                for one in self.joint.quantities
            },
            "correlation": [[float(value) for value in row] for row in self.correlation],
            "noise_level": plain(self.noise_level),
            "residual_level": plain(self.residual_level),
            "frequency_hz": [float(self.freq_hz.min()), float(self.freq_hz.max())],
            "n_lines": int(self.freq_hz.size),
            "warnings": list(self.warnings),
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        """Return a table of the parameters with their intervals, and the warnings."""
        intervals, errors = self.confidence_interval(0.95), self.std_error
        rows = [("parameter", "value", "std error", "95 % interval", "unit")]
        for one in self.joint.quantities:
            low, high = intervals[one.name]
            value = f"{self.parameters[one.name]:.5g}"
            rows.append((one.name, value, f"{errors[one.name]:.2g}", f"{low:.4g} .. {high:.4g}", one.unit))
        span = f"{self.freq_hz.min():g} to {self.freq_hz.max():g} Hz, {self.freq_hz.size} lines"
        head = [
            f"method compliance, {span}",
            f"noise {100 * self.noise_level:.2g} %, residual {100 * self.residual_level:.2g} % of the FRFs",
        ]
        head += [f"rigid: {', '.join(self.joint.rigid)}"] if self.joint.rigid else []
        tail = [wrapped(f"note: {text}") for text in self.notes]
        tail += [wrapped(f"warning: {text}") for text in self.warnings]
        return "\n".join([*head, "", *columns_of(rows), *([""] if tail else []), *tail])
