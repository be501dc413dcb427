"""Errors of models, and how far joints that are alike scatter: as believed, or by the evidence of the FRFs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from jointfrf.identification.minimise import Linearised, Minimum, inverse_information, minimise
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.parameters import CommonMean, FitParameter, ParameterVector
from jointfrf.kernel.arguments import FloatArray

__all__ = ["ModelError", "spread_factors", "with_model_error", "with_spreads"]

#: Terms of a part at most, and numbers that their derivatives may take: 400 MB.
_TERMS, _NUMBERS = 90, 25_000_000
#: Where the search begins: models of one material and simple shape are as good.
_FIRST = 3e-3
#: No entry of a modal matrix is off by more: it would not be positive definite.
_LARGEST = 0.3
#: Levels that are compared, in steps of a factor of 1.12; at the last one, where errors beyond the band are ninefold,
#: the parts are not what the models describe, or something else is wrong.
_LEVELS = np.geomspace(1e-6, _LARGEST / 9, 93)
#: The level is found when it changes by less than this factor, or after so many fits.
_SETTLED, _FITS = 1.15, 5
#: -2 log evidence must be lower by this much than without errors: less is chance.
_LEAST_GAIN = 1.0
#: Levels whose -2 log evidence is higher by this are excluded: with 95 %, as by chi-squared of one degree.
_EXCLUDED = 3.84
#: What is believed of a spread relative to its mean: parts of one kind differ by some tens of percent at most.
_USUAL_SPREAD = 0.3
#: Spreads over which variances are averaged, relative to the mean: all that the prior and the likelihood leave.
_SPREADS = np.geomspace(1e-3, 3.0, 40)
#: Steps to the spreads of a minimum at most, and the change from which on they have settled.
_SPREAD_STEPS, _SPREAD_SETTLED = 500, 1e-3


class ModelError(NamedTuple):
    """Errors of the models that no unknown describes, as the intervals allow for them.

    Attributes
    ----------
    level : float
        Standard deviation of the relative errors of modal stiffnesses and masses that the FRFs show; 0 where they show
        none.
    gain : float
        -2 log evidence without errors minus that with this level.
    largest : float
        The largest level that the FRFs do not exclude: what is believed of a part is allowed for up to this.
    """

    level: float
    gain: float
    largest: float

    def of_part(self, believed: float) -> float:
        """Return the level of a part by what is believed of it (`Substructure.model_error`)."""
        return max(self.level, min(self.largest, believed))


@dataclass(frozen=True)
class _Levels:
    """-2 log evidence by the level, from squares about a point whose error terms have priors of some deviation."""

    at: Linearised
    x: FloatArray
    weight: FloatArray
    deviation: FloatArray

    def evidence(self, level: float) -> float:
        """Return -2 log evidence but for a constant: squares minimised, and their volume over that of the priors."""
        n = self.x.size - self.weight.size
        z, ratio = self.x[n:], level * self.weight / self.deviation
        information = self.at.information.copy()
        information[range(n, self.x.size), range(n, self.x.size)] += 1 / ratio**2 - 1
        gradient = self.at.gradient.copy()
        gradient[n:] += z * (1 - 1 / ratio**2)
        squares = self.at.cost + float((z**2 * (1 / ratio**2 - 1)).sum())
        size = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
        try:
            factor = linalg.cholesky(information / np.outer(size, size), lower=True)
        except linalg.LinAlgError:
            return np.inf
        step = linalg.solve_triangular(factor, gradient / size, lower=True)
        volume = 2 * float(np.log(np.diagonal(factor)).sum() + np.log(size).sum() + np.log(ratio).sum())
        return squares - float(step @ step) + volume

    def error(self) -> ModelError:
        """Return what the FRFs show, and do not exclude."""
        costs = np.array([self.evidence(float(one)) for one in _LEVELS])
        best = int(np.argmin(costs))
        gain, largest = float(costs[0] - costs[best]), _LEVELS[np.flatnonzero(costs <= costs[best] + _EXCLUDED)[-1]]
        return ModelError(float(_LEVELS[best]) if gain > _LEAST_GAIN else 0.0, gain, float(largest))


def with_model_error(
    likelihood: Likelihood, minimum: Minimum, *, is_sought: bool = True, at_most: float = np.inf
) -> tuple[Likelihood, Minimum, ModelError] | None:
    """Fit with errors of the models as the FRFs show them, and as are believed; None where there are none.

    Parameters
    ----------
    likelihood : Likelihood
    minimum : Minimum
        Without errors of the models.
    is_sought : bool
        Whether errors that the FRFs show are allowed for where they are not believed.
    at_most : float
        Level above which no fit is made: None where the squares about the minimum show a larger one.

    Notes
    -----
    The level maximises the evidence, the likelihood integrated over all parameters and errors, by Laplace's method at
    the minimum, which moves with it [1]_. What joint and unknowns can mimic leaves no trace in it: so a part has at
    least the level that is believed of it, as far as the evidence does not exclude it. A level that is absurdly high is
    no error of the models, and not allowed for.

    References
    ----------
    .. [1] D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447.
    """
    prediction, n = likelihood.prediction, minimum.x.size
    is_believed = any(side.part.error_level > 0 for side in prediction.sides)
    if not (is_sought or is_believed):
        return None
    most = min(_TERMS, int(_NUMBERS / max(likelihood.measured.size, 1)) // len(prediction.sides))
    for side in prediction.sides:
        side.allow_errors(most)
    weight = _deviations(prediction, ModelError(1.0, 0.0, 0.0))
    deviation, x = _FIRST * weight, np.concatenate([minimum.x, np.zeros(weight.size)])
    error = ModelError(0.0, 0.0, 0.0)
    for turn in range(_FITS):
        own = replace(likelihood, vector=_with_errors(likelihood.vector, prediction, deviation))
        if turn:
            at = minimise(own, x, least=1e-2, small=1e-1)
            x, about = at.x, Linearised(at.cost, at.information, at.gradient)
        else:
            about = own.linearised(x)
        error = _Levels(about, x, weight, deviation).error()
        if not is_sought or (turn and error.level == _LEVELS[-1]):
            error = error._replace(level=0.0)
        found = _deviations(prediction, error)
        if not found.any() or (turn == 0 and error.level > at_most):
            return None
        ratio = np.maximum(found, _LEVELS[0] * weight) / deviation
        x[n:] /= ratio
        deviation = deviation * ratio
        if turn and max(ratio.max(), 1 / ratio.min()) < _SETTLED:
            break
    own = replace(likelihood, vector=_with_errors(likelihood.vector, prediction, deviation))
    return own, minimise(own, x), error


def with_spreads(likelihood: Likelihood, minimum: Minimum) -> tuple[Likelihood, Minimum]:
    """Fit with the spreads of joints that are alike which the FRFs show, or which were given relative to the means.

    Notes
    -----
    A spread s maximises the evidence, the means integrated, times s exp(-s / 30 %): this prior keeps it from zero where
    few joints differ by no more than their errors [1]_, and from infinity where the FRFs hardly tell it. By the
    algorithm of expectation and maximisation on the squares about the minimum, which moves with the spreads.

    References
    ----------
    .. [1] Y. Chung, S. Rabe-Hesketh, V. Dorie, A. Gelman, J. Liu, A nondegenerate penalized likelihood estimator for
       variance parameters in multilevel models, Psychometrika 78 (2013) 685-709.
    """
    for _ in range(_FITS if likelihood.vector.means else 0):
        vector = likelihood.vector
        means = _spreads(vector, minimum)
        likelihood = replace(likelihood, vector=replace(vector, means=means))
        minimum = minimise(likelihood, minimum.x)
        moved = [max(a.std / b.std, b.std / a.std) for a, b in zip(means, vector.means, strict=True)]
        if max(moved) < _SETTLED:
            break
    return likelihood, minimum


@dataclass(frozen=True)
class _SharedPriors:
    """Squares about a minimum without the priors that members share with their means, and these priors.

    Attributes
    ----------
    information, gradient : ndarray, shapes (p, p), (p,)
        Of the squares in coordinates, about the minimum: about zero, rounding would hide differences of the evidence.
    apart : ndarray, shape (r,)
        Members less their mean at the minimum, in units of their values or logarithms.
    rows : ndarray, shape (r, p)
        Members less their mean, in units of their values or logarithms.
    of_row : ndarray, shape (r,)
        Of which mean.
    sizes : ndarray
        What spreads are relative to.
    """

    information: FloatArray
    gradient: FloatArray
    apart: FloatArray
    rows: FloatArray
    of_row: NDArray[np.intp]
    sizes: FloatArray

    @classmethod
    def of(cls, vector: ParameterVector, minimum: Minimum) -> _SharedPriors:
        own = vector.pull_slopes(minimum.x)[vector.free.size :]
        information = minimum.information - own.T @ own
        gradient = minimum.gradient + own.T @ (own @ minimum.x)
        of_row = np.repeat(np.arange(len(vector.means)), [len(one.members) for one in vector.means])
        std, values = np.array([one.std for one in vector.means]), vector.to_values(minimum.x)
        sizes = [1.0 if vector.all[one.mean].is_log else abs(values[one.mean]) for one in vector.means]
        floor = np.finfo(float).tiny
        rows = own * std[of_row, None]
        return cls(information, gradient, rows @ minimum.x, rows, of_row, np.maximum(sizes, floor))

    def with_spreads(self, std: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Return information and gradient with the priors, and the squares of these at the minimum."""
        shared, apart = self.rows / std[self.of_row, None], self.apart / std[self.of_row]
        return self.information + shared.T @ shared, self.gradient - shared.T @ apart, float(apart @ apart)


def _spreads(vector: ParameterVector, minimum: Minimum) -> tuple[CommonMean, ...]:
    """Return the means with the standard deviations that a minimum found with others shows."""
    shared, means = _SharedPriors.of(vector, minimum), vector.means
    std, count = np.array([one.std for one in means]), np.array([len(one.members) for one in means])
    given = np.array([np.nan if one.relative is None else one.relative for one in means]) * shared.sizes
    is_given = np.isfinite(given)
    std = np.where(is_given, given, std)
    for _ in range(0 if is_given.all() else _SPREAD_STEPS):
        information, gradient, _ = shared.with_spreads(std)
        covariance = inverse_information(information)
        apart = shared.apart + shared.rows @ (covariance @ gradient)
        own = np.einsum("ri,ij,rj->r", shared.rows, covariance, shared.rows)
        squares = np.bincount(shared.of_row, apart**2 + own)
        likely = [_most_likely(*one) for one in zip(squares, count, shared.sizes, strict=True)]
        other = np.where(is_given, given, likely)
        is_settled = abs(np.log(other / std)).max() < _SPREAD_SETTLED
        std = other
        if is_settled:
            break
    return tuple(one._replace(std=float(value)) for one, value in zip(means, std, strict=True))


def spread_factors(vector: ParameterVector, minimum: Minimum) -> FloatArray:
    """Return by how much variances of the coordinates grow because spreads that were found are not known, shape (p,).

    Notes
    -----
    The law of total variance over the posterior of each spread: few joints, or joints that the FRFs do not separate,
    leave it wide.
    """
    shared = _SharedPriors.of(vector, minimum)
    std = np.array([one.std for one in vector.means])
    variance = np.diagonal(inverse_information(shared.with_spreads(std)[0]))
    factor = np.ones(minimum.x.size)
    for q, one in enumerate(vector.means):
        if one.relative is not None:
            continue
        levels = _SPREADS * shared.sizes[q]
        logs, x, own = [], [], []
        for level in levels:
            information, gradient, at = shared.with_spreads(np.where(np.arange(std.size) == q, level, std))
            covariance = inverse_information(information)
            size = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
            volume = np.linalg.slogdet(information / np.outer(size, size))[1] + 2 * np.log(size).sum()
            x.append(covariance @ gradient)
            own.append(np.diagonal(covariance))
            squares = at - gradient @ x[-1] + volume + 2 * len(one.members) * np.log(level)
            # The prior, and one power of the level for levels that rise by a factor.
            logs.append(2 * np.log(level) - level / (_USUAL_SPREAD * shared.sizes[q]) - squares / 2)
        weight = np.exp(np.array(logs) - max(logs))
        weight /= weight.sum()
        mean = weight @ np.array(x)
        total = weight @ (np.array(own) + (np.array(x) - mean) ** 2)
        factor += np.maximum(total / np.maximum(variance, np.finfo(float).tiny) - 1, 0)
    return factor


def _most_likely(squares: float, count: int, size: float) -> float:
    """Return the spread at the largest likelihood times its prior: (m - 1) s^2 + s^3 / u = squares."""
    from scipy.optimize import brentq  # takes long to import, and is seldom needed

    usual, largest = _USUAL_SPREAD * size, float(np.sqrt(squares / (count - 1)))
    return float(brentq(lambda s: (count - 1) * s**2 + s**3 / usual - squares, 0.0, largest, rtol=1e-9))


def _deviations(prediction: Prediction, error: ModelError) -> FloatArray:
    """Return the standard deviations of the error terms of all parts."""
    found = [
        error.of_part(side.part.error_level) * np.array([term.weight for term in side.errors.terms])
        for side in prediction.sides
        if side.errors is not None
    ]
    return np.concatenate([np.zeros(0), *found])


def _with_errors(vector: ParameterVector, prediction: Prediction, deviation: FloatArray) -> ParameterVector:
    """Return a vector to which the error terms of all parts are added."""
    found, left = list(vector.all), iter(deviation.tolist())
    for side in prediction.sides:
        for i, term in enumerate(side.errors.terms if side.errors is not None else ()):
            name = f"{side.name}/{term.matrix} {term.row + 1} {term.column + 1}"
            place = (side.name, i)
            found.append(FitParameter(name, "1", "error", place, 0.0, next(left), -_LARGEST, _LARGEST, False, True))
    return ParameterVector(tuple(found), vector.means)
