"""Squares to be minimised: residuals of the FRFs over their noise, and how far priors are off."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.minimise import Linearised
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.parameters import ParameterVector
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Likelihood", "LogLikelihood", "WeightedResiduals"]


@dataclass(frozen=True)
class WeightedResiduals(ABC):
    """Squares of weighted differences between measured and predicted FRFs, and of priors.

    Attributes
    ----------
    prediction : Prediction
    vector : ParameterVector
    measured : ndarray, shape (n_freq, n_o, n_i)
        m/N.
    weight : ndarray, shape (n_freq, n_o, n_i)
        1 over the standard deviation of real and imaginary part; 0 for what is not measured.
    """

    prediction: Prediction
    vector: ParameterVector
    measured: ComplexArray
    weight: FloatArray

    @property
    def unit(self) -> float:
        """The squares are those of real numbers over their standard deviation."""
        return 1.0

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values of the coordinates."""
        return self.vector.bounds

    @property
    def longest(self) -> FloatArray:
        """Largest step of each coordinate."""
        return self.vector.longest

    @property
    def used(self) -> NDArray[np.bool_]:
        """What is measured, shape (n_freq, n_o, n_i)."""
        return self.weight > 0

    @abstractmethod
    def difference(self, y: ComplexArray) -> ComplexArray:
        """Return the difference between measured and predicted FRFs."""

    @abstractmethod
    def scale(self, y: ComplexArray) -> ComplexArray | FloatArray:
        """Return minus the derivative of the weighted difference by the predicted FRFs."""

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares; inf where a line is singular, or errors of a model make its mass negative."""
        try:
            y = self.prediction.frfs(self.vector, self.vector.to_values(x))
        except np.linalg.LinAlgError:
            return np.inf
        squares = _squares(self.difference(y) * self.weight) + float((self.vector.pulls(x) ** 2).sum())
        return squares if np.isfinite(squares) else np.inf

    def linearised(self, x: FloatArray) -> Linearised:
        """Return the squares with information and gradient."""
        vector = self.vector
        y, slopes = self.prediction.linearised(vector, vector.to_values(x))
        residual = np.ascontiguousarray((self.difference(y) * self.weight).ravel())
        slopes *= self.scale(y)
        pulls, of_pulls, by_x = vector.pulls(x), vector.pull_slopes(x), vector.slope(x)
        real = slopes.reshape(len(slopes), -1).view(np.float64)
        information = (real @ real.T) * np.outer(by_x, by_x) + np.diag(of_pulls**2)
        gradient = (real @ residual.view(np.float64)) * by_x - of_pulls * pulls
        cost = _squares(residual) + float((pulls**2).sum())
        return Linearised(cost if np.isfinite(cost) else np.inf, information, gradient)


class Likelihood(WeightedResiduals):
    """-2 log likelihood of measured FRFs with circular noise, and of priors, but for a constant."""

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

    def difference(self, y: ComplexArray) -> ComplexArray:
        """Return measured minus predicted FRFs, m/N."""
        return self.measured - y

    def scale(self, y: ComplexArray) -> FloatArray:
        """Return the weight."""
        return self.weight


class LogLikelihood(WeightedResiduals):
    """Squares of ln(measured / predicted): broad minima, for FRFs whose resonances are far off."""

    def difference(self, y: ComplexArray) -> ComplexArray:
        """Return ln(measured / predicted), 0 where there is no FRF."""
        known = (self.weight > 0) & (self.measured != 0) & (y != 0)
        return np.log(np.where(known, self.measured, 1) / np.where(known, y, 1))

    def scale(self, y: ComplexArray) -> ComplexArray:
        """Return the weight over the predicted FRFs."""
        return np.asarray(self.weight / np.where(y == 0, 1, y))


def _squares(residual: ComplexArray) -> float:
    with np.errstate(all="ignore"):
        return float((residual.real**2 + residual.imag**2).sum())
