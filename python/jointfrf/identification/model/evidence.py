"""The level of the error of models by the evidence of the FRFs for it."""

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
#: Levels that are compared, in steps of a factor of 1.12; at the last one the parts are not what the models describe,
#: or something else is wrong.
_LEVELS = np.geomspace(1e-6, 0.1, 103)
#: Where the search begins: models of one material and simple shape are as good.
_FIRST = 3e-3
#: No entry of a modal matrix is off by more: it would not be positive definite.
_LARGEST = 0.3
#: The level is found when it changes by less than this factor, or after so many fits.
_SETTLED, _FITS = 1.15, 5
#: -2 log evidence must be lower by this much than without errors: less is chance, and widens nothing.
_LEAST_GAIN = 1.0


class ModelError(NamedTuple):
    """What the FRFs say of errors of the models that no unknown describes.

    Attributes
    ----------
    level : float
        Standard deviation of the relative errors of modal stiffnesses and masses.
    gain : float
        -2 log evidence without errors minus that with this level.
    """

    level: float
    gain: float


@dataclass(frozen=True)
class _Levels:
    """-2 log evidence by the level, from squares about a point whose error terms have priors of one level."""

    at: Linearised
    x: FloatArray
    n_shown: int
    level: float

    def evidence(self, level: float) -> float:
        """Return -2 log evidence but for a constant: squares minimised, and their volume over that of the priors."""
        n, z = self.n_shown, self.x[self.n_shown :]
        ratio = level / self.level
        information = self.at.information.copy()
        information[range(n, self.x.size), range(n, self.x.size)] += 1 / ratio**2 - 1
        gradient = self.at.gradient.copy()
        gradient[n:] += z * (1 - 1 / ratio**2)
        squares = self.at.cost + float((z**2).sum()) * (1 / ratio**2 - 1)
        size = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
        try:
            factor = linalg.cholesky(information / np.outer(size, size), lower=True)
        except linalg.LinAlgError:
            return np.inf
        step = linalg.solve_triangular(factor, gradient / size, lower=True)
        volume = 2 * float(np.log(np.diagonal(factor)).sum() + np.log(size).sum()) + 2 * z.size * float(np.log(ratio))
        return squares - float(step @ step) + volume


def with_model_error(likelihood: Likelihood, minimum: Minimum) -> tuple[Likelihood, Minimum, ModelError] | None:
    """Fit with errors of the models at the level that the FRFs show; None where they show none, or absurd ones.

    Notes
    -----
    The level maximises the evidence, the likelihood integrated over all parameters and errors, by Laplace's method at
    the minimum, which moves with it [1]_.

    References
    ----------
    .. [1] D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447.
    """
    prediction = likelihood.prediction
    most = min(_TERMS, int(_NUMBERS / max(likelihood.measured.size, 1)) // 2)
    for side in prediction.sides:
        side.allow_errors(most)
    level, x = _FIRST, np.concatenate([minimum.x, np.zeros(_count(prediction))])
    gain, at = 0.0, minimum
    for turn in range(_FITS):
        vector = _with_errors(likelihood.vector, prediction, level)
        own = replace(likelihood, vector=vector)
        if turn:
            at = minimise(own, x, least=1e-2, small=1e-1)
            x = at.x
            about = Linearised(at.cost, at.information, at.gradient)
        else:
            about = own.linearised(x)
        levels = _Levels(about, x, minimum.x.size, level)
        costs = np.array([levels.evidence(float(one)) for one in _LEVELS])
        best = int(np.argmin(costs))
        gain, found = float(costs[0] - costs[best]), float(_LEVELS[best])
        if not gain > _LEAST_GAIN or (turn and best == len(_LEVELS) - 1):
            return None
        is_settled = turn and max(found / level, level / found) < _SETTLED
        x = np.concatenate([x[: minimum.x.size], x[minimum.x.size :] * level / found])
        level = found
        if is_settled:
            break
    own = replace(likelihood, vector=_with_errors(likelihood.vector, prediction, level))
    return own, minimise(own, x), ModelError(level, gain)


def _count(prediction: Prediction) -> int:
    return sum(len(side.errors.terms) for side in prediction.sides if side.errors is not None)


def _with_errors(vector: ParameterVector, prediction: Prediction, level: float) -> ParameterVector:
    """Return a vector to which the error terms of both parts are added."""
    found = list(vector.all)
    for side in prediction.sides:
        origin: ParameterOrigin = "error of A" if side.name == "A" else "error of B"
        for i, term in enumerate(side.errors.terms if side.errors is not None else ()):
            std = level * term.weight
            name = f"{side.name}/{term.matrix} {term.row + 1} {term.column + 1}"
            found.append(FitParameter(name, "1", origin, (i,), 0.0, std, -_LARGEST, _LARGEST, False, True))
    return ParameterVector(tuple(found))
