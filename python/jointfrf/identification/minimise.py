"""Squares of a likelihood, and their minimum by Levenberg-Marquardt steps inside bounds."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import TINY, FloatArray

__all__ = ["Minimum", "NormalEquations", "Squares", "full_step", "inverse_information", "minimise"]

#: Levenberg's parameter: first value, factors where a step succeeds and fails, smallest and largest value.
_FIRST, _LOWERED, _RAISED, _SMALLEST, _LARGEST = 1e-3, 0.1, 8.0, 1e-9, 1e9
#: The iteration converges if a step predicts a decrease of -2 log likelihood below the first value, or if two steps in
#: a row decrease it by less than the second.
_LEAST, _SMALL = 1e-4, 1e-3
#: Rounding of a sum of squares: a relative decrease below this is zero.
_ROUNDING = 1e-12
#: Directions with less information than this share of the largest are rounding: in a step, and in an inverse.
_NOT_SOLVED, _SEEN = 1e-13, 1e-15


class NormalEquations(NamedTuple):
    """Sum of squares about a point: cost, half of its second derivatives, and minus half of its gradient.

    Attributes
    ----------
    cost : float
        Sum of squares.
    information : ndarray, shape (p, p)
        Half of the second derivatives.
    gradient : ndarray, shape (p,)
        Minus half of the first derivatives.
    """

    cost: float
    information: FloatArray
    gradient: FloatArray


class Squares(Protocol):
    """A sum of squares as a function of coordinates, shape (p,)."""

    @property
    def unit(self) -> float:
        """Factor by which the sum is divided to give -2 log likelihood."""

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values of the coordinates."""

    def longest(self, x: FloatArray) -> FloatArray:
        """Return the largest step of each coordinate from a point."""

    def cost(self, x: FloatArray) -> float:
        """Return the sum; inf outside the range of the model."""

    def linearised(self, x: FloatArray) -> NormalEquations:
        """Return the sum with its derivatives; NaN outside the range of the model."""


class Minimum(NamedTuple):
    """A minimum of squares.

    Attributes
    ----------
    x : ndarray, shape (p,)
        Coordinates.
    cost : float
        Sum of squares.
    information : ndarray, shape (p, p)
        Half of the second derivatives.
    gradient : ndarray, shape (p,)
        Minus half of the first derivatives: zero except for coordinates at a bound.
    converged : bool
        Whether the iteration converged.
    at_bound : ndarray of bool, shape (p,)
        Whether each coordinate is at a bound.
    promised : float
        Predicted decrease of the cost by the next step, if the iteration ended before a minimum.
    """

    x: FloatArray
    cost: float
    information: FloatArray
    gradient: FloatArray
    converged: bool
    at_bound: NDArray[np.bool_]
    promised: float = 0.0


def minimise(
    squares: Squares,
    start: FloatArray,
    held: int | None = None,
    steps: int = 40,
    least: float = _LEAST,
    small: float = _SMALL,
) -> Minimum:
    """Minimise squares from initial values and return the minimum.

    Parameters
    ----------
    squares : Squares
        Objective.
    start : ndarray, shape (p,)
        Initial coordinates.
    held : int, optional
        Number of a coordinate that stays fixed.
    steps : int
        Maximum number of linearisations.
    least, small : float
        Tolerances of -2 log likelihood. The iteration ends when the next step predicts a decrease below `least`, or
        when two steps in a row decreased it by less than `small`. If squares hardly determine a direction, the
        predicted decrease exceeds the actual one.
    """
    lower, upper = squares.bounds
    least, small = least * squares.unit, small * squares.unit
    free = np.arange(start.size) != (-1 if held is None else held)
    x = np.where(free, np.clip(start, lower, upper), start)
    damping, at, converged, count = _FIRST, squares.linearised(x), False, 0
    for _ in range(steps):
        if not np.isfinite(at.information).all():
            break
        way = _Steps(at, np.flatnonzero(free & _can_move(at, x, squares.bounds)))
        promised = way.step(0.0)[1]
        if promised < least:
            converged = True
            break
        longest = squares.longest(x)
        while damping <= _LARGEST:
            step, left = way.step(damping)
            if left < 0.1 * least:
                damping = 2 * _LARGEST
                break
            there = np.where(free, np.clip(x + np.clip(step, -longest, longest), lower, upper), x)
            cost = squares.cost(there)
            if cost < at.cost:
                break
            damping *= _RAISED
        if damping > _LARGEST:
            # No step lowers the squares: the decrease is below the rounding of their sum.
            converged = promised < max(10 * least, 1e-6 * at.cost)
            break
        gain = at.cost - cost
        damping = max(damping * _LOWERED, _SMALLEST)
        x, at = there, squares.linearised(there)
        count = count + 1 if gain < small + _ROUNDING * cost else 0
        if count == 2:
            converged = True
            break
    left = 0.0
    if not converged and np.isfinite(at.information).all():
        left = _Steps(at, np.flatnonzero(free & _can_move(at, x, squares.bounds))).step(0.0)[1]
    return Minimum(x, at.cost, at.information, at.gradient, converged, (x <= lower) | (x >= upper), left)


def full_step(at: NormalEquations, x: FloatArray, bounds: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, float]:
    """Return the minimum of the quadratic model at a point, and the predicted decrease."""
    step, promised = _Steps(at, np.flatnonzero(_can_move(at, x, bounds))).step(0.0)
    return np.clip(x + step, *bounds), promised


def _can_move(at: NormalEquations, x: FloatArray, bounds: tuple[FloatArray, FloatArray]) -> NDArray[np.bool_]:
    """Return which coordinates are not at a bound against which the gradient points."""
    lower, upper = bounds
    return ~(((x <= lower) & (at.gradient < 0)) | ((x >= upper) & (at.gradient > 0)))


class _Steps:
    """Steps from a point at any damping, by the eigenvectors of the scaled information."""

    def __init__(self, at: NormalEquations, moving: NDArray[np.intp]) -> None:
        self.moving, self.p = moving, at.gradient.size
        self.size = np.sqrt(np.maximum(np.diagonal(at.information), TINY))[moving]
        scaled = at.information[np.ix_(moving, moving)] / np.outer(self.size, self.size)
        self.value, self.vector = np.linalg.eigh(scaled)
        self.along = self.vector.T @ (at.gradient[moving] / self.size)

    def step(self, damping: float) -> tuple[FloatArray, float]:
        """Return the step, and the predicted decrease of the squares."""
        step, value = np.zeros(self.p), self.value + damping
        length = abs(value)
        seen = length > _NOT_SOLVED * length.max(initial=0)
        part = np.where(seen, self.along / np.where(seen, value, 1), 0)
        step[self.moving] = (self.vector @ part) / self.size
        return step, float(part @ self.along)


def inverse_information(information: FloatArray, *, open_ends: bool = False) -> FloatArray:
    """Return the inverse of information matrices with parameters of very different size, or a pseudo-inverse.

    Parameters
    ----------
    information : ndarray, shape (..., p, p)
        Information matrices.
    open_ends : bool
        Whether directions without information get the variance of rounding, for printed parameters. By default their
        variance is zero, as in a pseudo-inverse.
    """
    size = np.sqrt(np.maximum(np.einsum("...aa->...a", information), TINY))
    value, vector = np.linalg.eigh(information / (size[..., :, None] * size[..., None, :]))
    length = abs(value)
    seen = length > _SEEN * length.max(axis=-1, keepdims=True)
    if open_ends:
        length = np.maximum(length, _SEEN * length.max(axis=-1, keepdims=True))
        value, seen = length, length > 0
    own = vector / size[..., :, None]
    inverse: FloatArray = (own * np.where(seen, 1 / np.where(seen, value, 1), 0)[..., None, :]) @ own.swapaxes(-1, -2)
    return inverse
