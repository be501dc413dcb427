"""A unit of time that most processors share: `numpy.linalg.inv` of 20 000 complex matrices of order 4."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

_LINES, _ORDER = 20_000, 4
#: Inversions whose least time is a unit.
_REPETITIONS = 5


def unit_timer() -> Callable[[], float]:
    """Return a function that measures the unit, CPU seconds."""
    real, imaginary = np.random.default_rng(0).standard_normal((2, _LINES, _ORDER, _ORDER))
    matrices = real + 1j * imaginary

    def measure() -> float:
        seconds = []
        for _ in range(_REPETITIONS):
            start = time.process_time()
            np.linalg.inv(matrices)
            seconds.append(time.process_time() - start)
        return min(seconds)

    return measure
