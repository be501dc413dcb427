"""Squares to be minimised: residuals of the FRFs over their noise, and deviations from priors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.minimise import NormalEquations
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
        FRFs of the assembly.
    vector : ParameterVector
        Parameters.
    measured : ndarray, shape (n_freq, n_o, n_i)
        Measured receptances, m/N.
    weight : ndarray, shape (n_freq, n_o, n_i)
        Inverse standard deviation of real and imaginary part; 0 if not measured.
    """

    prediction: Prediction
    vector: ParameterVector
    measured: ComplexArray
    weight: FloatArray

    @property
    def unit(self) -> float:
        """Unit of the squares, which are squares of real numbers over their standard deviation."""
        return 1.0

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values of the coordinates."""
        return self.vector.bounds

    def longest(self, x: FloatArray) -> FloatArray:
        """Return the largest step of each coordinate from a point."""
        return self.vector.longest(x)

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which FRFs are measured, shape (n_freq, n_o, n_i)."""
        return self.weight > 0

    @abstractmethod
    def difference(self, y: ComplexArray) -> ComplexArray:
        """Return the difference between measured and predicted FRFs."""

    @abstractmethod
    def weigh_slopes(self, y: ComplexArray, slopes: ComplexArray) -> ComplexArray:
        """Return minus derivatives of the weighted difference from derivatives of the FRFs, which may be changed."""

    def weighted(self, frfs: ComplexArray) -> ComplexArray:
        """Return differences of FRFs, frequency first of the last three axes, by their standard deviation."""
        return frfs * self.weight

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares; inf if a line is singular, or model errors make the mass negative."""
        try:
            y = self.prediction.frfs(self.vector, self.vector.to_values(x))
        except np.linalg.LinAlgError:
            return np.inf
        squares = _squares(self.weighted(self.difference(y))) + float((self.vector.pulls(x) ** 2).sum())
        return squares if np.isfinite(squares) else np.inf

    def linearised(self, x: FloatArray) -> NormalEquations:
        """Return the squares with information and gradient; infinite squares if `cost` is infinite."""
        try:
            predicted = self.prediction.linearised(self.vector, self.vector.to_values(x))
        except np.linalg.LinAlgError:
            return NormalEquations(np.inf, np.full((x.size, x.size), np.nan), np.full(x.size, np.nan))
        return self.about(x, *predicted)

    def about(self, x: FloatArray, y: ComplexArray, slopes: ComplexArray) -> NormalEquations:
        """Return the same from the prediction and its derivatives, which may be changed."""
        vector = self.vector
        residual = np.ascontiguousarray(self.weighted(self.difference(y)).ravel())
        slopes = np.ascontiguousarray(self.weigh_slopes(y, slopes))
        pulls, of_pulls, by_x = vector.pulls(x), vector.pull_slopes(x), vector.slope(x)
        real = slopes.reshape(len(slopes), -1).view(np.float64)
        information = (real @ real.T) * np.outer(by_x, by_x) + of_pulls.T @ of_pulls
        gradient = (real @ residual.view(np.float64)) * by_x - of_pulls.T @ pulls
        cost = _squares(residual) + float((pulls**2).sum())
        return NormalEquations(cost if np.isfinite(cost) else np.inf, information, gradient)


@dataclass(frozen=True)
class Likelihood(WeightedResiduals):
    """-2 log likelihood of measured FRFs with circular noise, and of priors, up to a constant.

    Attributes
    ----------
    whitening : ndarray, shape (n_freq, n_o n_i, n_o n_i), optional
        Lower triangles that make the FRFs of a line independent and of unit variance, if their noise is correlated; by
        default `weight` does.
    """

    whitening: ComplexArray | None = None

    @classmethod
    def of_variance(
        cls,
        prediction: Prediction,
        vector: ParameterVector,
        measured: ComplexArray,
        variance: FloatArray,
        inflation: float,
        shared: ComplexArray | None = None,
    ) -> Likelihood:
        """Return the likelihood for noise of this variance E|e|^2, infinite if nothing was measured.

        `shared`, shape (n_freq, n_o, n_i, n_sources), is the effect of independent errors with E|e|^2 = 1 on the FRFs.
        The covariance of the noise of a line is diag(inflation variance) + shared shared^H.
        """
        usable = np.isfinite(variance) & (variance > 0)
        inverse = np.sqrt(2 / (inflation * np.where(usable, variance, 1)))
        weight = np.where(usable, inverse, 0)
        whitening: ComplexArray | None = None
        if shared is not None:
            # In units of the noise of each FRF alone, whose weight is the weight of its real part.
            scaled = (shared * weight[..., None] / np.sqrt(2)).reshape(len(weight), -1, shared.shape[-1])
            covariance = scaled @ scaled.conj().swapaxes(1, 2)
            covariance[:, range(scaled.shape[1]), range(scaled.shape[1])] += 1
            lower = np.linalg.cholesky(covariance)
            whitening = np.asarray(np.linalg.inv(lower) * weight.reshape(len(weight), 1, -1), np.complex128)
        return cls(prediction, vector, np.where(usable, measured, 0), weight, whitening)

    def with_noise(self, factor: float) -> Likelihood:
        """Return the likelihood for noise whose standard deviation is larger by a factor."""
        whitening = None if self.whitening is None else self.whitening / factor
        return replace(self, weight=self.weight / factor, whitening=whitening)

    def difference(self, y: ComplexArray) -> ComplexArray:
        """Return measured minus predicted FRFs, m/N."""
        return self.measured - y

    def weighted(self, frfs: ComplexArray) -> ComplexArray:
        """Return differences of FRFs over their noise."""
        if self.whitening is None:
            return frfs * self.weight
        flat = frfs.reshape(*frfs.shape[:-2], -1, 1)
        return np.asarray((self.whitening @ flat).reshape(frfs.shape))

    def carried_back(self, weighted: ComplexArray) -> ComplexArray:
        """Return the adjoint of `weighted`."""
        if self.whitening is None:
            return weighted * self.weight
        flat = weighted.reshape(*weighted.shape[:-2], -1, 1)
        return np.asarray((self.whitening.conj().swapaxes(1, 2) @ flat).reshape(weighted.shape))

    @property
    def precision(self) -> FloatArray:
        """Squares for a unit error of each FRF alone, shape (n_freq, n_o, n_i)."""
        if self.whitening is None:
            return np.asarray(self.weight**2)
        return np.asarray((abs(self.whitening) ** 2).sum(axis=1).reshape(self.weight.shape))

    def weigh_slopes(self, y: ComplexArray, slopes: ComplexArray) -> ComplexArray:
        """Return derivatives of the FRFs over their noise."""
        if self.whitening is not None:
            return self.weighted(slopes)
        slopes *= self.weight
        return slopes


class LogLikelihood(WeightedResiduals):
    """Squares of ln(measured / predicted): broad minima, for initial values with distant resonances."""

    def difference(self, y: ComplexArray) -> ComplexArray:
        """Return ln(measured / predicted), 0 if there is no FRF."""
        known = (self.weight > 0) & (self.measured != 0) & (y != 0)
        return np.log(np.where(known, self.measured, 1) / np.where(known, y, 1))

    def weigh_slopes(self, y: ComplexArray, slopes: ComplexArray) -> ComplexArray:
        """Return derivatives of the logarithms times their weight."""
        slopes *= self.weight / np.where(y == 0, 1, y)
        return slopes


def _squares(residual: ComplexArray) -> float:
    with np.errstate(all="ignore"):
        return float((residual.real**2 + residual.imag**2).sum())
