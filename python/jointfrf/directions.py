"""Names of the six directions of a point, in any spelling of files and of the thesis."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence

from jointfrf.spelling import did_you_mean

__all__ = ["DIRECTIONS", "PLACES", "direction_names"]

#: Directions of a point: displacements, then rotations, right-handed.
DIRECTIONS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")

#: Beginnings of names of directions, before the axis, in small letters; u, f and m as in files and in the thesis.
_AXES = "xyz"
_TRANSLATIONS = ("", "u", "u_", "f")
_ROTATIONS = ("theta_", "theta", "r", "rot_", "rot", "m", "mtheta_", "mtheta")
#: Position among `DIRECTIONS` by name, small letters.
PLACES = {prefix + axis: i for prefix in _TRANSLATIONS for i, axis in enumerate(_AXES)} | {
    prefix + axis: 3 + i for prefix in _ROTATIONS for i, axis in enumerate(_AXES)
}


def direction_names(dofs: Sequence[str]) -> tuple[str, ...]:
    """Return the names among `DIRECTIONS` of DOFs.

    Small or capital letters; x, ux, u_x and the thesis' Fx are displacements; theta_x, thetax, rx, rot_x, Mx and the
    thesis' Mtheta_x rotations.

    Raises
    ------
    ValueError
        A name that is not known or comes twice.
    """
    unknown = next((dof for dof in dofs if dof.lower() not in PLACES), None)
    if unknown is not None:
        hint = did_you_mean(unknown, DIRECTIONS)
        raise ValueError(f"dofs must be among {', '.join(DIRECTIONS)}, not {reprlib.repr(unknown)}{hint}")
    names = tuple(DIRECTIONS[PLACES[dof.lower()]] for dof in dofs)
    if len(set(names)) != len(names):
        raise ValueError(f"dofs must name each direction once, not {', '.join(dofs)}")
    return names
