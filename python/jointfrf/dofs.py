"""Motion of points that are rigidly connected to another one."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.kernel.arguments import FloatArray, as_real

__all__ = ["direction_places", "rigid_motion", "rigid_offset"]

_AXES = "xyz"
#: Position among x, y, z, theta_x, theta_y, theta_z by name.
_PLACES = {prefix + axis: i for prefix in ("", "u", "u_") for i, axis in enumerate(_AXES)} | {
    prefix + axis: 3 + i for prefix in ("theta_", "theta", "r", "rot_", "rot") for i, axis in enumerate(_AXES)
}


def direction_places(dofs: Sequence[str]) -> NDArray[np.intp]:
    """Return where each DOF stands among x, y, z, theta_x, theta_y, theta_z, counted from 0, shape (n,).

    Raises
    ------
    ValueError
        A name that is not known or comes twice.
    """
    names = [str(dof).lower() for dof in dofs]
    unknown = [dof for dof, name in zip(dofs, names, strict=True) if name not in _PLACES]
    if unknown:
        raise ValueError(f"dofs must be among x, y, z, theta_x, theta_y, theta_z, not {reprlib.repr(unknown[0])}")
    places = np.array([_PLACES[name] for name in names], np.intp)
    if np.unique(places).size != places.size:
        raise ValueError(f"dofs must name each direction once, not {', '.join(dofs)}")
    return places


def rigid_motion(points: FloatArray, about: FloatArray) -> FloatArray:
    """Displacements of points that follow a reference point, u = u_R + theta x r.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        m.
    about : ndarray, shape (3,)
        Reference point, m.

    Returns
    -------
    ndarray, shape (n, 3, 6)
        For unit motions x, y, z, theta_x, theta_y, theta_z.
    """
    r = points - about
    motion = np.zeros((len(points), 3, 6))
    motion[:, [0, 1, 2], [0, 1, 2]] = 1
    for axis in range(3):
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], r)
    return motion


def rigid_offset(dofs: Sequence[str], offset: ArrayLike) -> FloatArray:
    """Motion of a point rigidly connected to another one: u_new = u + theta x offset, theta_new = theta.

    Parameters
    ----------
    dofs : sequence of str
        Names of the n DOFs, in any order: x, y, z (or ux, ...), theta_x, theta_y, theta_z (or rx, rot_x, ...). Those
        that are missing are taken as zero.
    offset : array_like, shape (3,)
        From the old point to the new one along x, y, z, m.

    Returns
    -------
    ndarray, shape (n, n)
        T of q_new = T q and, for forces, f = T^T f_new. The way back is the opposite offset: T(-offset) = T^-1.

    Raises
    ------
    ValueError
        A name that is not known or comes twice, a wrong shape, NaN or Inf.

    Notes
    -----
    Receptances at the new point are T H T^T. A stiffness between the old points is T^-T K T^-1 between the new ones,
    see `Joint.moved`.

    Examples
    --------
    A point 6 mm above: it moves along z when the body turns about x.

    >>> import jointfrf as jf
    >>> jf.rigid_offset(["y", "z", "theta_x"], [0, 0.006, 0]).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.006], [0.0, 0.0, 1.0]]
    """
    places = direction_places(dofs)
    point = as_real("offset", offset, (3,))
    whole = np.eye(6)
    whole[:3] = rigid_motion(point[None], np.zeros(3))[0]
    matrix: FloatArray = whole[np.ix_(places, places)]
    return matrix
