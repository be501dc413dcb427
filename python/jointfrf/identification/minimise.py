"""Squares of a likelihood, and their minimum by Levenberg-Marquardt steps inside bounds."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.parameters import ParameterVector
from jointfrf.kernel.arguments import FloatArray

__all__ = ["Linearised", "Minimum", "Squares", "inverse_information", "minimise"]


class Linearised(NamedTuple):
    """Squares about a point: cost, half of their second derivatives, and minus half of their first.

    Attributes
    ----------
    cost : float
    information : ndarray, shape (p, p)
    gradient : ndarray, shape (p,)
    """

    cost: float
    information: FloatArray
    gradient: FloatArray


class Squares(Protocol):
    """A sum of squares of the coordinates of the free parameters."""

    @property
    def vector(self) -> ParameterVector:
        """The parameters."""

    def cost(self, x: FloatArray) -> float:
        """Return the sum."""

    def linearised(self, x: FloatArray) -> Linearised:
        """Return it with its derivatives."""


#: Levenberg's parameter: first value, factors where a step succeeds and fails, largest value.
_FIRST, _LOWERED, _RAISED, _LARGEST = 1e-3, 0.1, 8.0, 1e9


#: A minimum is found when a step promises less than this of squares that are 1 for one residual.
_LEAST = 1e-4


#: Or when two steps in a row gain less than this.
_SMALL = 1e-3


#: No step changes a logarithm, or standard deviations of a prior, by more than this; damping may be anything.
_LONGEST = 4.0


class Minimum(NamedTuple):
    """A minimum of squares.

    Attributes
    ----------
    x : ndarray, shape (p,)
        Coordinates.
    cost : float
    information : ndarray, shape (p, p)
        Half of the second derivatives.
    converged : bool
    at_bound : ndarray of bool, shape (p,)
    """

    x: FloatArray
    cost: float
    information: FloatArray
    converged: bool
    at_bound: NDArray[np.bool_]


def minimise(
    squares: Squares, start: FloatArray, held: int | None = None, steps: int = 40, least: float = _LEAST
) -> Minimum:
    """Minimise squares from a start.

    Parameters
    ----------
    squares : Squares
    start : ndarray, shape (p,)
        Coordinates.
    held : int, optional
        A coordinate that keeps its value.
    steps : int
        At most so many linearisations.
    least : float
        The iteration ends when the next step promises to lower the squares by less.
    """
    lower, upper = squares.vector.bounds
    longest = np.where(squares.vector.is_log | squares.vector.has_prior, _LONGEST, np.inf)
    free = np.arange(start.size) != (-1 if held is None else held)
    x = np.where(free, np.clip(start, lower, upper), start)
    damping, at, converged, small = _FIRST, squares.linearised(x), False, 0
    for _ in range(steps):
        if not np.isfinite(at.information).all():
            break
        moving = free & ~_pressed(x, at, lower, upper)
        step, promised = _step(at, moving, 0.0)
        if promised < least:
            converged = True
            break
        while damping <= _LARGEST:
            step, left = _step(at, moving, damping)
            if left < 0.1 * least:
                damping = 2 * _LARGEST
                break
            there = np.where(free, np.clip(x + np.clip(step, -longest, longest), lower, upper), x)
            cost = squares.cost(there)
            if cost < at.cost:
                break
            damping *= _RAISED
        if damping > _LARGEST:
            # No step lowers the squares: they are at the rounding of their sum.
            converged = promised < max(10 * least, 1e-6 * at.cost)
            break
        gain = at.cost - cost
        damping = max(damping * _LOWERED, 1e-9)
        x, at = there, squares.linearised(there)
        small = small + 1 if gain < _SMALL + 1e-12 * cost else 0
        if small == 2:
            # In a direction that the squares hardly hold, steps promise more than they gain.
            converged = True
            break
    return Minimum(x, at.cost, at.information, converged, (x <= lower) | (x >= upper))


def _pressed(x: FloatArray, at: Linearised, lower: FloatArray, upper: FloatArray) -> NDArray[np.bool_]:
    """Return which coordinates are pressed against their bound."""
    return ((x <= lower) & (at.gradient < 0)) | ((x >= upper) & (at.gradient > 0))


def _step(at: Linearised, moving: NDArray[np.bool_], damping: float) -> tuple[FloatArray, float]:
    """Return the step, and by how much it promises to lower the squares."""
    step, places = np.zeros(moving.size), np.flatnonzero(moving)
    if not places.size:
        return step, 0.0
    size = np.sqrt(np.maximum(np.diagonal(at.information), np.finfo(float).tiny))
    scaled = (at.information / np.outer(size, size))[np.ix_(places, places)]
    gradient = (at.gradient / size)[places]
    found = np.linalg.lstsq(scaled + damping * np.eye(places.size), gradient, rcond=1e-13)[0]
    step[places] = found / size[places]
    return step, float(found @ gradient)


#: Directions of less information than this share of the largest are not seen.
_SEEN = 1e-15


def inverse_information(information: FloatArray) -> FloatArray:
    """Inverse of information matrices of parameters of very different size; a pseudo-inverse where one has none.

    Parameters
    ----------
    information : ndarray, shape (..., p, p)
    """
    size = np.sqrt(np.maximum(np.einsum("...aa->...a", information), np.finfo(float).tiny))
    value, vector = np.linalg.eigh(information / (size[..., :, None] * size[..., None, :]))
    length = abs(value)
    seen = length > _SEEN * length.max(axis=-1, keepdims=True)
    own = vector / size[..., :, None]
    inverse: FloatArray = (own * np.where(seen, 1 / np.where(seen, value, 1), 0)[..., None, :]) @ own.swapaxes(-1, -2)
    return inverse
