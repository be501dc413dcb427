"""Intervals by profile likelihood."""

from __future__ import annotations

import numpy as np
from scipy import special

from jointfrf.identification.minimise import Minimum, Squares, minimise
from jointfrf.kernel.arguments import FloatArray

__all__ = ["ProfileIntervals"]

#: Squares on the way of the linear prediction that differ less than this from those of a parabola need no profile.
_PARABOLA = 0.1
#: Steps in search of a limit, and how near to it squares must come.
_STEPS, _NEAR = 12, 0.03
#: Linearisations at a value of the parameter that is held.
_HELD_STEPS = 6


class ProfileIntervals:
    """Intervals of all free parameters, by their probability.

    Parameters
    ----------
    likelihood : Squares
    minimum : Minimum
    covariance : ndarray, shape (p, p)
        Of the coordinates, for independent noise as told.
    factor : float
        By how much variances exceed that.

    Notes
    -----
    A limit is where the squares, minimised over all other parameters, exceed their minimum by the quantile of chi^2
    times the factor. The others are first taken to follow linearly; where the squares are a parabola on that way, the
    limit follows from it without a minimisation.
    """

    def __init__(self, likelihood: Squares, minimum: Minimum, covariance: FloatArray, factor: float) -> None:
        self.likelihood, self.minimum, self.covariance, self.factor = likelihood, minimum, covariance, factor
        self._known: dict[tuple[int, float], tuple[float, float]] = {}

    def __call__(self, probability: float) -> dict[str, tuple[float, float]]:
        """Return the interval of every free parameter that contains the true one with the given probability."""
        return {one.name: self.of(i, probability) for i, one in enumerate(self.likelihood.vector.fitted)}

    def of(self, i: int, probability: float) -> tuple[float, float]:
        """Return the interval of one free parameter, by its number."""
        if (i, probability) not in self._known:
            limit = float(special.ndtri((1 + probability) / 2)) ** 2 * self.factor
            self._known[i, probability] = self._limit(i, -1, limit), self._limit(i, 1, limit)
        return self._known[i, probability]

    def _limit(self, i: int, sign: int, limit: float) -> float:
        """Return the limit of one parameter on one side, in its unit; its bound, or infinity, where there is none."""
        vector, best = self.likelihood.vector, self.minimum
        one, bound = vector.fitted[i], vector.bounds[sign > 0][i]
        open_end = np.inf if sign > 0 and one.is_log else (0.0 if one.is_log else vector.limits[sign > 0][i])
        own = float(self.covariance[i, i])
        if not (np.isfinite(own) and own > 0):
            return float(open_end)
        along = self.covariance[:, i] / own
        reach, low, low_excess, high = float(np.sqrt(limit)) * np.sqrt(own), 0.0, 0.0, np.inf
        if one.is_log:
            reach = min(reach, 1.5)
        quadratic = limit * (reach**2 / (limit * own))
        for step in range(_STEPS):
            at_bound = sign * (best.x[i] + sign * reach - bound) >= 0
            if at_bound:
                reach = sign * (bound - best.x[i])
            excess = self._excess(i, sign * reach * along, minimised=step > 0)
            if step == 0:
                if abs(excess / quadratic - 1) < _PARABOLA:
                    return self._value(i, sign * reach * np.sqrt(limit / excess))
                excess = self._excess(i, sign * reach * along, minimised=True)
            if abs(excess / limit - 1) < _NEAR:
                break
            if excess < limit:
                if at_bound:
                    return float(open_end)
                low, low_excess = reach, excess
            else:
                high = reach
            reach = _next(low, low_excess, reach, excess, high, limit)
        return self._value(i, sign * reach)

    def _excess(self, i: int, step: FloatArray, *, minimised: bool) -> float:
        """Return the squares beyond their minimum at a value of one parameter, on the linear way or minimised."""
        lower, upper = self.likelihood.vector.bounds
        there = np.clip(self.minimum.x + step, lower, upper)
        likelihood = self.likelihood
        cost = minimise(likelihood, there, i, _HELD_STEPS, 1e-2).cost if minimised else likelihood.cost(there)
        return max(cost - self.minimum.cost, 1e-12)

    def _value(self, i: int, step: float) -> float:
        vector = self.likelihood.vector
        x = self.minimum.x.copy()
        x[i] += step
        lower, upper = vector.bounds
        return float(vector.to_values(np.clip(x, lower, upper))[vector.free[i]])


def _next(low: float, low_excess: float, reach: float, excess: float, high: float, limit: float) -> float:
    """Return where to look next: by the parabola from the last point, inside what is known."""
    guess = reach * float(np.sqrt(limit / max(excess, 1e-6 * limit)))
    if np.isfinite(high):
        inner = low + (high - low) * np.array([0.1, 0.9])
        return float(np.clip(guess, *inner))
    return float(min(guess, 4 * reach)) if guess > reach else 1.5 * reach
