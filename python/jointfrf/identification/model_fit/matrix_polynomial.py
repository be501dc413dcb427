"""Arrays as polynomials of a few numbers: what a function builds slowly, with derivatives."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial import chebyshev

from jointfrf.kernel.arguments import FloatArray

__all__ = ["MatrixPolynomial"]

#: Total degree of polynomials of one, two or three numbers, and of more.
_DEGREE, _DEGREE_OF_MANY = 5, 3
#: Points for each coefficient.
_POINTS = 1.6


class MatrixPolynomial:
    """Arrays as polynomials, by least squares at Chebyshev-distributed points.

    Parameters
    ----------
    build : callable
        ``build(values)`` returns arrays whose shapes do not change; `values` has shape (u,).
    centre, reach : ndarray, shape (u,)
        Middle of the box in which the polynomials are made, and half of its sides, positive.

    Notes
    -----
    Of a matrix that goes with the third power of a length, the error is about 1e-8 for a reach of 5 %.
    """

    def __init__(
        self, build: Callable[[FloatArray], Sequence[FloatArray]], centre: FloatArray, reach: FloatArray
    ) -> None:
        self.centre, self.reach = centre, reach
        u = centre.size
        degree = _DEGREE if u <= 3 else _DEGREE_OF_MANY
        self.powers = np.array([p for p in itertools.product(range(degree + 1), repeat=u) if sum(p) <= degree])
        count = len(self.powers) + 2 if u == 1 else int(_POINTS * len(self.powers)) + u
        even = (np.arange(count) + 0.5) / count
        generator = np.random.default_rng(0)
        spread = np.stack([even if i == 0 else generator.permutation(even) for i in range(u)], axis=1)
        points = np.cos(np.pi * spread)
        built = [build(centre + reach * point) for point in points]
        self.shapes = [np.shape(one) for one in built[0]]
        flat = np.array([np.concatenate([np.ravel(one) for one in arrays]) for arrays in built])
        self.coefficients = np.linalg.lstsq(np.array([self._terms(point) for point in points]), flat, rcond=None)[0]

    def _terms(self, point: FloatArray, slope_of: int | None = None) -> FloatArray:
        """Return the terms at a point of the unit box, or their derivative by one of its coordinates."""
        terms = np.ones(len(self.powers))
        for i, x in enumerate(point):
            unit = np.eye(int(self.powers.max()) + 1)
            if i == slope_of:
                own = np.array([chebyshev.chebval(x, chebyshev.chebder(row)) for row in unit])
            else:
                own = chebyshev.chebval(x, unit)
            terms *= own[self.powers[:, i]]
        return terms

    def _arrays(self, flat: FloatArray) -> list[FloatArray]:
        found, at = [], 0
        for shape in self.shapes:
            size = int(np.prod(shape))
            found.append(flat[at : at + size].reshape(shape))
            at += size
        return found

    def at(self, values: FloatArray) -> list[FloatArray]:
        """Return the arrays."""
        return self._arrays(self._terms((values - self.centre) / self.reach) @ self.coefficients)

    def slope(self, values: FloatArray, i: int) -> list[FloatArray]:
        """Return their derivatives by one of the numbers."""
        terms = self._terms((values - self.centre) / self.reach, i) / self.reach[i]
        return self._arrays(terms @ self.coefficients)
