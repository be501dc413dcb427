"""Errors of models: as large as believed, or larger where the evidence of the FRFs is for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import linalg

from jointfrf.identification.minimise import Linearised, Minimum, minimise
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.parameters import FitParameter, ParameterOrigin, ParameterVector
from jointfrf.kernel.arguments import FloatArray

__all__ = ["ModelError", "with_model_error"]

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
    likelihood: Likelihood, minimum: Minimum, *, is_sought: bool = True
) -> tuple[Likelihood, Minimum, ModelError] | None:
    """Fit with errors of the models as the FRFs show them, and as are believed; None where there are none.

    Parameters
    ----------
    likelihood : Likelihood
    minimum : Minimum
        Without errors of the models.
    is_sought : bool
        Whether errors that the FRFs show are allowed for where they are not believed.

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
    most = min(_TERMS, int(_NUMBERS / max(likelihood.measured.size, 1)) // 2)
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
        if not found.any():
            return None
        ratio = np.maximum(found, _LEVELS[0] * weight) / deviation
        x[n:] /= ratio
        deviation = deviation * ratio
        if turn and max(ratio.max(), 1 / ratio.min()) < _SETTLED:
            break
    own = replace(likelihood, vector=_with_errors(likelihood.vector, prediction, deviation))
    return own, minimise(own, x), error


def _deviations(prediction: Prediction, error: ModelError) -> FloatArray:
    """Return the standard deviations of the error terms of both parts."""
    found = [
        error.of_part(side.part.error_level) * np.array([term.weight for term in side.errors.terms])
        for side in prediction.sides
        if side.errors is not None
    ]
    return np.concatenate([np.zeros(0), *found])


def _with_errors(vector: ParameterVector, prediction: Prediction, deviation: FloatArray) -> ParameterVector:
    """Return a vector to which the error terms of both parts are added."""
    found, left = list(vector.all), iter(deviation.tolist())
    for side in prediction.sides:
        origin: ParameterOrigin = "error of A" if side.name == "A" else "error of B"
        for i, term in enumerate(side.errors.terms if side.errors is not None else ()):
            name = f"{side.name}/{term.matrix} {term.row + 1} {term.column + 1}"
            found.append(FitParameter(name, "1", origin, (i,), 0.0, next(left), -_LARGEST, _LARGEST, False, True))
    return ParameterVector(tuple(found))
