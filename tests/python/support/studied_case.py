"""A small study: case 3.1 on a hundred lines, by two estimators."""

import numpy as np

import jointfrf as jf

CASE, N = "3.1", 10
DESIGN = jf.StudyDesign({"lines": [100]}, noises=["5 %"], estimators=["ismm", "compliance"])
#: The same on the command line.
WORDS = ("3.1", "--factor", "lines=100", "--noise", "5 %", "--estimator", "ismm", "--estimator", "compliance")


def broken_off(freq_hz, gamma, dofs):
    """An estimator of one's own: K* of the line in the middle."""
    k = jf.inverse_substructuring(gamma)[len(gamma) // 2, 0, 0]
    return np.array([k.real, k.imag / (2 * np.pi * freq_hz[len(gamma) // 2])])


def doubled(h, seed, number):
    """A noise of one's own: every FRF times a number."""
    return h * (1 + 0.01 * seed + number)


def same(a: jf.StudyResult, b: jf.StudyResult) -> bool:
    """Whether two studies hold the same numbers, bit for bit."""
    return len(a.groups) == len(b.groups) and all(
        np.array_equal(x, y, equal_nan=True)
        for group in range(len(a.groups))
        for x, y in zip(a.estimates(group), b.estimates(group), strict=True)
    )
