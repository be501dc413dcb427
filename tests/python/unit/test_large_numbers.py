"""Matrices near the largest number there is: scaled by a power of two, they are ordinary ones."""

import numpy as np
import pytest

import jointfrf as jf


@pytest.mark.parametrize("engine", ["auto", "lapack"])
@pytest.mark.parametrize("n", [1, 2, 3, 4, 6, 8, 12, 24, 70])
@pytest.mark.parametrize("power", [995, 1015, 1023])
def test_inverse_and_solution_near_the_largest_number(random_lines, engine, n, power):
    a = random_lines(20, n)
    largest = np.maximum(abs(a.real), abs(a.imag)).max(axis=(1, 2), keepdims=True)
    a = a / (1.001 * largest)
    b = random_lines(20, n) / 1e3
    with jf.use_engine(engine):
        inverse, solution = jf.invert(a), jf.solve(a, b)
        # Both are computed from numbers that differ by a power of two only.
        found = jf.invert(a * 2.0**power) * 2.0**power
        solved = jf.solve(a * 2.0**power, b * 2.0**1000) * 2.0 ** (power - 1000)
    for one, other in ((found, inverse), (solved, solution)):
        size = abs(other).max(axis=(1, 2))
        condition = np.linalg.cond(a) if n > 1 else 1.0
        assert (abs(one - other).max(axis=(1, 2)) <= 1e-13 * n * condition * size).all()
