"""Intervals by profile likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.identification.minimise import Minimum, NormalEquations, Squares, inverse_information, minimise
from jointfrf.kernel.arguments import FloatArray

__all__ = ["FunctionIntervals", "Intervals", "ProfileIntervals", "ProfiledCoordinates"]

#: Relative difference of the squares along the linear prediction from a parabola below which no profile is needed, and
#: relative tolerance of the squares at a limit; the third value is the tolerance if squares are cheap.
_PARABOLA, _NEAR, _PRECISE = 0.1, 0.03, 2e-4
#: If squares stay below this share of a limit without a minimisation, the next reach, by the parabola, is at least
#: twice as far.
_FAR_BELOW = 0.25
#: Maximum number of steps in search of a limit; the second value applies if squares are cheap.
_STEPS, _MANY_STEPS = 12, 30
#: Number of linearisations with one parameter fixed, and the predicted decrease at the last one.
_HELD_STEPS, _HELD_LEAST = 24, 1e-2
#: Step of a difference, in standard errors, and tolerance of the value of a fixed function, in the same unit.
_SLOPE, _HELD = 1e-3, 1e-2
#: Width of a bracket relative to the tolerance of the squares at which the search ends.
_WALL = 0.3
#: Shares of the bracket between which a limit is sought.
_INSIDE = np.array([0.1, 0.9])


#: Function of the values of all parameters, the numbers of those that it uses, and a probability.
FunctionIntervals = Callable[[Callable[[FloatArray], float], NDArray[np.intp], float], tuple[float, float] | None]


class ProfiledCoordinates(Protocol):
    """Coordinates of parameters of which each has a profile."""

    def value(self, i: int, x: FloatArray) -> float:
        """Return the value of parameter i at coordinates x."""

    def end(self, i: int, sign: int) -> float:
        """Return the limit of a parameter whose coordinate is unbounded below (-1) or above (1)."""

    def longest_reach(self, i: int) -> float:
        """Return the largest distance from the minimum for the first search of a limit."""


class _ProfilePoint(NamedTuple):
    """Point of a profile: distance of its parameter from the minimum, coordinates, derivative of the coordinates."""

    reach: float
    x: FloatArray
    along: FloatArray


class ProfileIntervals:
    """Intervals of parameters by the profile of their likelihood.

    Parameters
    ----------
    squares : Squares
        Objective.
    coordinates : ProfiledCoordinates
        Coordinates of the parameters.
    x, cost
        Coordinates and squares at the minimum.
    covariance : ndarray, shape (p, p)
        Covariance of the coordinates for independent noise of the given level.
    factor : float
        Ratio of the variances to this covariance.
    least : callable, optional
        Function ``least(start, i)`` that returns the squares minimised over all coordinates except number i, if that is
        cheap: limits are then precise.

    Notes
    -----
    At a limit the squares, minimised over all other parameters, exceed their minimum by the quantile of chi^2
    multiplied by the factor. All other parameters first follow linearly. If the squares are a parabola along this line,
    the limit follows from it without a minimisation.
    """

    def __init__(
        self,
        squares: Squares,
        coordinates: ProfiledCoordinates,
        x: FloatArray,
        cost: float,
        covariance: FloatArray,
        factor: float,
        least: Callable[[FloatArray, int], float] | None = None,
    ) -> None:
        self.squares, self.coordinates, self.x, self.cost = squares, coordinates, x, cost
        self.covariance, self.factor = covariance, factor
        self.least = least
        self.steps = _STEPS if least is None else _MANY_STEPS
        self.parabola, self.near = (_PARABOLA, _NEAR) if least is None else (_PRECISE, _PRECISE)

    def of(self, i: int, probability: float) -> tuple[float, float]:
        """Return the interval of parameter number i with this coverage probability."""
        low, high = sorted((self.limit(i, -1, probability), self.limit(i, 1, probability)))
        return low, high

    def limit(self, i: int, sign: int, probability: float) -> float:
        """Return the limit of one parameter below (-1) or above (1) in its coordinate, or its end without a limit."""
        return self._limit(i, sign, float(special.ndtri((1 + probability) / 2)) ** 2 * self.factor * self.squares.unit)

    def _limit(self, i: int, sign: int, limit: float) -> float:
        """Return the distance at which the squares exceed their minimum by a limit."""
        bound, end = self.squares.bounds[sign > 0][i], self.coordinates.end(i, sign)
        own = float(self.covariance[i, i])
        if not (np.isfinite(own) and own > 0):
            return end
        along, variance = self._followed(i, self.covariance / self.squares.unit)
        reach = min(float(np.sqrt(limit * variance)), self.coordinates.longest_reach(i))
        low, high, unsure = 0.0, np.inf, np.inf
        below, above = 0.0, np.inf  # roots of the excess over the excess at the limit
        points = [_ProfilePoint(0.0, self.x, sign * along)]
        quadratic = reach**2 / variance
        for step in range(self.steps):
            at_bound = sign * (self.x[i] + sign * reach - bound) >= 0
            if at_bound:
                reach = sign * (bound - self.x[i])
            there, excess = self._predicted(points, reach, i, sign)
            if step == 0 and abs(excess / quadratic - 1) < self.parabola:
                return self._value(i, sign * reach * np.sqrt(limit / excess))
            if excess > _FAR_BELOW * limit:
                # The profile is no higher than the squares on this line, or at the present other coordinates.
                excess = self._excess(self.squares.cost(self._there(np.eye(1, self.x.size, i)[0] * sign * reach)))
            if excess > _FAR_BELOW * limit and self.least is not None:
                excess = self._excess(self.least(there, i))
            elif excess > _FAR_BELOW * limit:
                found = self._minimised(there, i)
                excess = self._excess(found.cost)
                if excess > limit and self._excess(found.cost - 2 * found.promised) < limit:
                    # The profile may still be below the limit here; a start nearer to it converges sooner.
                    unsure, reach = reach, (low + reach) / 2
                    continue
                if np.isfinite(found.information).all():
                    nearby = self._followed(i, inverse_information(found.information / self.squares.unit))[0]
                    points.append(_ProfilePoint(reach, found.x, sign * nearby))
            # Beyond the bound of a positive parameter the squares rise steeply.
            if abs(excess / limit - 1) < self.near or high - low < _WALL * self.near * reach:
                break
            if excess < limit:
                if at_bound:
                    return end
                low, below = reach, float(np.sqrt(excess / limit))
            else:
                high, above = reach, float(np.sqrt(excess / limit))
            if high == np.inf:  # by the parabola from the last point
                reach = min(reach / max(below, 1e-3), 4 * reach, unsure)
            else:  # by the chord of the root of the excess
                reach = low + (high - low) * float(np.clip((1 - below) / (above - below), *_INSIDE))
        else:
            if min(high, unsure) == np.inf:
                return end
        return self._value(i, sign * reach)

    def _followed(self, i: int, covariance: FloatArray) -> tuple[FloatArray, float]:
        """Return the change of all coordinates for a unit change of number i, and the variance of number i.

        Coordinates that the squares hardly determine stay: derivatives do not predict such distant values.
        """
        longest = np.array([self.coordinates.longest_reach(j) for j in range(self.x.size)])
        follows = (np.diagonal(covariance) <= longest**2) | (np.arange(self.x.size) == i)
        found = covariance[np.ix_(follows, follows)]
        if not follows.all():
            shared = covariance[np.ix_(follows, ~follows)]
            found = found - shared @ np.linalg.pinv(covariance[np.ix_(~follows, ~follows)]) @ shared.T
        at, along = int(follows[:i].sum()), np.zeros(self.x.size)
        along[follows] = found[:, at] / found[at, at]
        return along, float(found[at, at])

    def _predicted(self, points: Sequence[_ProfilePoint], reach: float, i: int, sign: int) -> tuple[FloatArray, float]:
        """Return coordinates at a reach, by the tangent or the chord of the profile that is lower, and their excess."""
        below = max((one for one in points if one.reach <= reach), key=lambda one: one.reach)
        above = min((one for one in points if one.reach > reach), key=lambda one: one.reach, default=None)
        starts = [one.x + (reach - one.reach) * one.along for one in (below, above) if one is not None]
        if above is not None:
            starts.append(below.x + (above.x - below.x) * (reach - below.reach) / (above.reach - below.reach))
        found = []
        for start in starts:
            start[i] = self.x[i] + sign * reach
            there = np.clip(start, *self.squares.bounds)
            found.append((self._excess(self.squares.cost(there)), there))
        excess, there = min(found, key=lambda one: one[0])
        return there, excess

    def of_function(self, function: Callable[[FloatArray], float], probability: float) -> tuple[float, float] | None:
        """Return the interval of a function of the coordinates by minimising the squares with the function fixed.

        None if it does not change with the coordinates, or has no derivative.
        """
        best, x = function(self.x), self.x
        steps = _SLOPE * np.sqrt(np.maximum(np.diagonal(self.covariance), 0)) * np.eye(x.size)
        size = np.maximum(np.diagonal(steps), np.finfo(float).tiny)
        slope = np.array([function(x + step) - function(x - step) for step in steps]) / (2 * size)
        variance = float(slope @ self.covariance @ slope)
        if not (np.isfinite(variance) and variance > 0):
            return None
        unit, along = self.squares.unit, self.covariance @ slope / variance
        limit = float(special.ndtri((1 + probability) / 2)) ** 2 * self.factor * unit
        ends = []
        for sign in (-1, 1):
            reach, low, high = float(np.sqrt(limit * variance / unit)), 0.0, np.inf
            there = self._there(sign * reach * along)
            excess = self._excess(self.squares.cost(there))
            if abs(excess / limit - 1) < self.parabola:
                ends.append(function(self._there(sign * reach * np.sqrt(limit / excess) * along)))
                continue
            minimised = sign * along  # change of the minimum for a change of the fixed function by 1
            for _ in range(_STEPS):
                held = _HeldFunction(self.squares, function, best + sign * reach, variance)
                starts = [self._there(reach * way) for way in (minimised, sign * along)]
                there = minimise(held, min(starts, key=held.cost), None, _HELD_STEPS, _HELD_LEAST).x
                minimised = (there - self.x) / reach
                excess = self._excess(self.squares.cost(there))
                if abs(excess / limit - 1) < self.near:
                    break
                low, high = (reach, high) if excess < limit else (low, reach)
                guess = reach * float(np.sqrt(limit / max(excess, 1e-6 * limit)))
                reach = (
                    min(guess, 4 * reach) if high == np.inf else float(np.clip(guess, *(low + (high - low) * _INSIDE)))
                )
            else:
                if low == 0:  # no accepted value was found: the squares were not minimised
                    return None
            ends.append(best + sign * reach if high < np.inf or excess > (1 - 2 * self.near) * limit else sign * np.inf)
        return ends[0], ends[1]

    def _minimised(self, start: FloatArray, i: int) -> Minimum:
        found = minimise(self.squares, start, i, _HELD_STEPS, _HELD_LEAST)
        if np.isfinite(found.cost):
            return found
        # The linear prediction of the other coordinates left the range of the model.
        alone = np.where(np.arange(start.size) == i, start, self.x)
        return minimise(self.squares, alone, i, _HELD_STEPS, _HELD_LEAST)

    def _there(self, step: FloatArray) -> FloatArray:
        return np.asarray(np.clip(self.x + step, *self.squares.bounds))

    def _excess(self, cost: float) -> float:
        return max(cost - self.cost, 1e-12)

    def _value(self, i: int, step: float) -> float:
        x = self.x.copy()
        x[i] += step
        return self.coordinates.value(i, np.asarray(np.clip(x, *self.squares.bounds)))


class _HeldFunction:
    """Squares with a function of the coordinates fixed at a value, by a penalty on its distance."""

    def __init__(
        self, squares: Squares, function: Callable[[FloatArray], float], value: float, variance: float
    ) -> None:
        self.squares, self.function, self.value = squares, function, value
        self.unit, self.bounds, self.longest = squares.unit, squares.bounds, squares.longest
        self.weight = squares.unit / (_HELD**2 * variance)

    def cost(self, x: FloatArray) -> float:
        """Return the sum of the squares."""
        return self.squares.cost(x) + self.weight * (self.function(x) - self.value) ** 2

    def linearised(self, x: FloatArray) -> NormalEquations:
        """Return the sum with its derivatives; derivatives of the function by differences."""
        at = self.squares.linearised(x)
        if not np.isfinite(at.cost):
            return at
        steps = _SLOPE / np.sqrt(np.maximum(np.diagonal(at.information) / self.unit, np.finfo(float).tiny))
        ends = [(self.function(x + step), self.function(x - step)) for step in steps * np.eye(x.size)]
        slope = np.array([one - other for one, other in ends]) / (2 * steps)
        apart = self.value - self.function(x)
        return NormalEquations(
            at.cost + self.weight * apart**2,
            at.information + self.weight * np.outer(slope, slope),
            at.gradient + self.weight * apart * slope,
        )


class Intervals:
    """Intervals of all parameters of a fit, by their probability.

    Parameters
    ----------
    names : sequence of str
        Names of the parameters.
    limits : callable
        Function ``limits(i, probability)`` that returns the interval of parameter i.
    of_function : callable
        Function ``of_function(function, used, probability)`` that returns the interval of a function of all values,
        which depends on the parameters with the numbers `used`; None if it follows from the covariance.
    """

    def __init__(
        self, names: Sequence[str], limits: Callable[[int, float], tuple[float, float]], of_function: FunctionIntervals
    ) -> None:
        self.names, self._limits, self.of_function = tuple(names), limits, of_function
        self._known: dict[tuple[str, float], tuple[float, float]] = {}

    def of(self, name: str, probability: float) -> tuple[float, float]:
        """Return the interval of one parameter with the given coverage probability."""
        if (name, probability) not in self._known:
            self._known[name, probability] = self._limits(self.names.index(name), probability)
        return self._known[name, probability]

    def shared(self, names: Sequence[str], which: NDArray[np.intp]) -> Intervals:
        """Return the intervals of parameters of equal points; `which` has the number of the shared one of each."""

        def limits(i: int, probability: float) -> tuple[float, float]:
            return self.of(self.names[which[i]], probability)

        def of_function(
            function: Callable[[FloatArray], float], used: NDArray[np.intp], probability: float
        ) -> tuple[float, float] | None:
            return self.of_function(lambda values: function(values[which]), np.unique(which[used]), probability)

        return Intervals(names, limits, of_function)

    def __call__(self, probability: float) -> dict[str, tuple[float, float]]:
        """Return the interval of every parameter."""
        return {name: self.of(name, probability) for name in self.names}
