"""Squares to be minimised: residuals of the FRFs over their noise, and how far priors are off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.minimise import Linearised
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.parameters import ParameterVector
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Likelihood", "LogLikelihood"]


@dataclass(frozen=True)
class Likelihood:
    """-2 log likelihood of measured FRFs with circular noise, and of priors, but for a constant.

    Attributes
    ----------
    prediction : Prediction
    vector : ParameterVector
    measured : ndarray, shape (n_freq, n_o, n_i)
        m/N.
    inverse_std : ndarray, shape (n_freq, n_o, n_i)
        sqrt(2 / E|e|^2) over the root of the inflation; 0 for what is not measured.
    """

    prediction: Prediction
    vector: ParameterVector
    measured: ComplexArray
    inverse_std: FloatArray

    @classmethod
    def of_variance(
        cls,
        prediction: Prediction,
        vector: ParameterVector,
        measured: ComplexArray,
        variance: FloatArray,
        inflation: float,
    ) -> Likelihood:
        """Return the likelihood for noise of this variance E|e|^2, infinite where nothing is measured."""
        usable = np.isfinite(variance) & (variance > 0)
        inverse = np.sqrt(2 / (inflation * np.where(usable, variance, 1)))
        return cls(prediction, vector, np.where(usable, measured, 0), np.where(usable, inverse, 0))

    @property
    def used(self) -> NDArray[np.bool_]:
        """What is measured, shape (n_freq, n_o, n_i)."""
        return self.inverse_std > 0

    def residual(self, x: FloatArray) -> ComplexArray:
        """Return measured minus predicted over sqrt(E|e|^2 / 2 inflation), shape (n_freq, n_o, n_i)."""
        y = self.prediction.frfs(self.vector, self.vector.to_values(x))
        return (self.measured - y) * self.inverse_std

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares; inf where a line is singular."""
        squares = _squares(self.residual(x)) + float((self.vector.pulls(x) ** 2).sum())
        return squares if np.isfinite(squares) else np.inf

    def linearised(self, x: FloatArray) -> Linearised:
        """Return the squares with information and gradient."""
        y, slopes = self.prediction.linearised(self.vector, self.vector.to_values(x))
        residual = ((self.measured - y) * self.inverse_std).ravel()
        slopes *= self.inverse_std
        return _with_priors(self.vector, x, residual, slopes.reshape(len(slopes), -1))


@dataclass(frozen=True)
class LogLikelihood:
    """Squares of ln(measured / predicted), with a common level: broad minima, for FRFs whose resonances are far off.

    Attributes
    ----------
    prediction, vector, measured
        As of `Likelihood`.
    weight : ndarray, shape (n_freq, n_o, n_i)
        1 over the standard deviation taken; 0 for what is not measured.
    """

    prediction: Prediction
    vector: ParameterVector
    measured: ComplexArray
    weight: FloatArray

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares."""
        y = self.prediction.frfs(self.vector, self.vector.to_values(x))
        squares = _squares(self.log_ratio(y) * self.weight) + float((self.vector.pulls(x) ** 2).sum())
        return squares if np.isfinite(squares) else np.inf

    def log_ratio(self, y: ComplexArray) -> ComplexArray:
        """Return ln(measured / predicted), 0 where there is no FRF."""
        known = (self.weight > 0) & (self.measured != 0) & (y != 0)
        return np.log(np.where(known, self.measured, 1) / np.where(known, y, 1))

    def linearised(self, x: FloatArray) -> Linearised:
        """Return the squares with information and gradient."""
        y, slopes = self.prediction.linearised(self.vector, self.vector.to_values(x))
        residual = (self.log_ratio(y) * self.weight).ravel()
        slopes *= self.weight / np.where(y == 0, 1, y)
        return _with_priors(self.vector, x, residual, slopes.reshape(len(slopes), -1))


def _squares(residual: ComplexArray) -> float:
    with np.errstate(all="ignore"):
        return float((residual.real**2 + residual.imag**2).sum())


def _with_priors(vector: ParameterVector, x: FloatArray, residual: ComplexArray, flat: ComplexArray) -> Linearised:
    """Return the squares of FRFs and priors; `flat`, (p, n), holds derivatives by the values, over noise."""
    pulls, slopes, by_x = vector.pulls(x), vector.pull_slopes(x), vector.slope(x)
    real = flat.view(np.float64)
    information = (real @ real.T) * np.outer(by_x, by_x) + np.diag(slopes**2)
    gradient = (real @ np.ascontiguousarray(residual).view(np.float64)) * by_x - slopes * pulls
    cost = _squares(residual) + float((pulls**2).sum())
    return Linearised(cost if np.isfinite(cost) else np.inf, information, gradient)
