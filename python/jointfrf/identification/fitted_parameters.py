"""Parameters of a fit of laws with their uncertainty: what fits with models and without them have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from jointfrf.identification.parameter_table import ListedParameter, columns_of, wrapped
from jointfrf.kernel.arguments import FloatArray

__all__ = ["FittedParameters"]


class FittedParameters:
    """What a result has that holds parameters, their covariance and their intervals; a base of dataclasses."""

    parameters: dict[str, float]
    covariance: FloatArray
    noise_level: float
    residual_level: float
    freq_hz: FloatArray
    intervals: Callable[[float], dict[str, tuple[float, float]]]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]

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

    def _plain(self, fitted: Iterable[ListedParameter]) -> dict[str, Any]:
        """Return what every fit says, as plain numbers and text; an open interval ends at None."""
        intervals, errors = self.confidence_interval(0.95), self.std_error
        return {
            "parameters": {
                one.name: {
                    "value": float(self.parameters[one.name]),
                    "unit": one.unit,
                    "std_error": _finite(errors[one.name]),
                    "confidence_interval_95": [_finite(limit) for limit in intervals[one.name]],
                }
                for one in fitted
            },
            "correlation": [[float(value) for value in row] for row in self.correlation],
            "noise_level": _finite(self.noise_level),
            "residual_level": _finite(self.residual_level),
            "frequency_hz": [float(self.freq_hz.min()), float(self.freq_hz.max())],
            "n_lines": int(self.freq_hz.size),
            "warnings": list(self.warnings),
            "notes": list(self.notes),
        }

    def _shown(self, method: str, fitted: Sequence[ListedParameter], said: str = "", **columns: Sequence[str]) -> str:
        """Return a table of the parameters with their intervals, and the warnings.

        Parameters
        ----------
        method : str
        fitted : sequence of ListedParameter
        said : str
            What follows the number of lines in the head, and lines below it.
        **columns : sequence of str
            Further columns, before that of units.
        """
        intervals, errors = self.confidence_interval(0.95), self.std_error
        rows = [("parameter", "value", "std error", "95 % interval", *columns, "unit")]
        for number, one in enumerate(fitted):
            low, high = intervals[one.name]
            figures = (f"{self.parameters[one.name]:.5g}", f"{errors[one.name]:.2g}", f"{low:.4g} .. {high:.4g}")
            rows.append((one.name, *figures, *(cells[number] for cells in columns.values()), one.unit))
        first, *more = said.split("\n")
        head = [
            f"method {method}, {self.freq_hz.min():g} to {self.freq_hz.max():g} Hz, {self.freq_hz.size} lines{first}",
            f"noise {100 * self.noise_level:.2g} %, residual {100 * self.residual_level:.2g} % of the FRFs",
            *more,
        ]
        tail = [wrapped(f"note: {text}") for text in self.notes]
        tail += [wrapped(f"warning: {text}") for text in self.warnings]
        return "\n".join([*head, "", *columns_of(rows), *([""] if tail else []), *tail])


def _finite(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None
