"""Factors that wrong units bring."""

from __future__ import annotations

import math
from typing import Final

__all__ = ["unit_of_factor"]

_GRAVITY, _INCH, _POUND = 9.80665, 0.0254, 4.4482216
#: Factor of h, response over force, and what brings it; of displacements and forces, of rotations and moments.
_KNOWN: Final[tuple[tuple[tuple[float, str], ...], ...]] = (
    (
        (1e3, "millimetres instead of metres"),
        (1e6, "micrometres instead of metres"),
        (1 / _INCH, "inches instead of metres"),
        (1 / _GRAVITY, "g instead of m/s^2"),
        (_GRAVITY, "m/s^2 where g is stated"),
        (1 / _POUND, "forces in lbf instead of N"),
        (1e-3, "forces in kN instead of N"),
    ),
    (
        (180 / math.pi, "degrees instead of radians"),
        (1e3, "mrad instead of rad, or moments in N mm instead of N m"),
        (1e6, "microradians instead of radians"),
    ),
)


def unit_of_factor(factor: float, is_rotation: bool, tolerance: float) -> str | None:
    """Return the units that explain a ratio of response to force; None if none does within a relative tolerance."""
    for known, what in _KNOWN[is_rotation]:
        if abs(math.log(factor / known)) < tolerance:
            return what
    return None
