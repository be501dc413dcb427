"""Degrees of freedom by name: rotations, units, the parameters of a joint, rigid motion."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.directions import DIRECTIONS, PLACES, direction_names
from jointfrf.kernel.arguments import FloatArray, as_names, as_real, check_type
from jointfrf.spelling import did_you_mean, some_of

__all__ = [
    "DIRECTIONS",
    "UNITS",
    "Parameter",
    "ParameterKind",
    "compliance_unit",
    "direction_names",
    "direction_places",
    "is_rotation",
    "joint_parameters",
    "parameter_name",
    "parameters_shared",
    "point_and_direction",
    "rigid_motion",
    "rigid_offset",
    "similar_dof",
]

#: A rotation whose name may omit the axis, as in a plane: theta, Mtheta, rot1.
_ROTATION = re.compile(r"m?(theta|phi|rot|r[xyz])", re.IGNORECASE)
#: Part of the name of a parameter after the point.
_OF_POINT = re.compile("[khc]_")

#: Units of numbers of a joint between two DOFs of which 0, 1 or 2 are rotations.
UNITS = {
    "stiffness": ("N/m", "N", "N m/rad"),
    "damping": ("N s/m", "N s", "N m s/rad"),
    "time": ("s",) * 3,
    "frequency": ("Hz",) * 3,
    "number": ("1",) * 3,
}

#: Stiffness k, hysteretic stiffness h = eta k, viscous damping c of K*(w) = k + i h + i w c.
ParameterKind = Literal["k", "h", "c"]


def point_and_direction(dof: str) -> tuple[str, str]:
    """Return the point and the direction of a DOF such as ``"bolt1.y"``, one of several joint points.

    Examples
    --------
    >>> from jointfrf.dofs import point_and_direction
    >>> point_and_direction("bolt1.theta_x"), point_and_direction("y")
    (('bolt1', 'theta_x'), ('', 'y'))
    """
    point, _, direction = dof.rpartition(".")
    return (point, direction) if point and direction and "/" not in dof else ("", dof)  # ../x is a path


def parameter_name(kind: str, row: str, column: str) -> str:
    """Return the name of a number of a joint between two DOFs: first the point, if both have the same.

    Examples
    --------
    >>> from jointfrf.dofs import parameter_name
    >>> parameter_name("k", "y", "y"), parameter_name("c", "bolt1.y", "bolt1.rz"), parameter_name("k", "a.y", "b.y")
    ('k_y', 'bolt1.c_y,rz', 'k_a.y,b.y')
    """
    (point, own), (other, across) = point_and_direction(row), point_and_direction(column)
    if point != other:
        point, own, across = "", row, column
    name = f"{kind}_{own}" + (f",{across}" if row != column else "")
    return f"{point}.{name}" if point else name


def parameters_shared(names: Sequence[str], same: Sequence[Sequence[str]]) -> NDArray[np.intp]:
    """Return for each parameter the number of the remaining parameter with its value.

    Parameters
    ----------
    names : sequence of str, length q
        Names of the parameters.
    same : sequence of sequence of str
        Points with equal joints: a parameter ``"bolt2.k_y"`` equals the parameter of the first point of its list.

    Returns
    -------
    ndarray of int, shape (q,)
        Number of the remaining parameter.

    Raises
    ------
    ValueError
        Equal points whose parameters have other names.

    Examples
    --------
    >>> from jointfrf.dofs import parameters_shared
    >>> parameters_shared(["a.k_y", "b.k_y", "c.k_y", "k_a.y,b.y"], [["a", "b"]]).tolist()
    [0, 0, 1, 2]
    """
    owner = {point: points[0] for points in same for point in points}
    for points in same:
        first, *rest = ([name for name in names if name.rpartition(".")[0] == point] for point in points)
        for point, own in zip(points[1:], rest, strict=True):
            if [name[len(point) :] for name in own] != [name[len(points[0]) :] for name in first]:
                raise ValueError(
                    f"same: {points[0]} and {point} must have the same DOFs and terms in one order, not "
                    f"{', '.join(first)} and {', '.join(own)}"
                )
    kept: dict[str, int] = {}
    found = []
    for name in names:
        point, _, rest_of_name = name.rpartition(".")
        shared = f"{owner[point]}.{rest_of_name}" if point in owner else name
        found.append(kept.setdefault(shared, len(kept)))
    return np.array(found, np.intp)


def is_rotation(dof: str) -> bool:
    """Return whether a DOF is a rotation: by a name for `direction_places`, or one like theta, Mtheta, phi, rot.

    Examples
    --------
    >>> from jointfrf.dofs import is_rotation
    >>> [is_rotation(dof) for dof in ("y", "Fx", "theta", "Mtheta_z", "rx", "Mx", "0", "bolt1.rx")]
    [False, False, True, True, True, True, False, True]
    """
    dof = point_and_direction(dof)[1]
    place = PLACES.get(dof.lower())
    return _ROTATION.match(dof) is not None if place is None else place >= 3


@dataclass(frozen=True)
class Parameter:
    """One number of a joint: a kind of stiffness or damping between two DOFs, or of one DOF if both are the same.

    Attributes
    ----------
    kind : {"k", "h", "c"}
        Kind: stiffness, hysteretic stiffness eta k, viscous damping.
    row, column : str
        Names of the DOFs.

    Examples
    --------
    >>> from jointfrf.dofs import Parameter
    >>> str(Parameter("k", "theta", "theta")), Parameter("c", "y", "theta").unit
    ('k_theta', 'N s')
    >>> Parameter.parse("k_y,theta").is_cross
    True
    """

    kind: ParameterKind
    row: str
    column: str

    @classmethod
    def of_dof(cls, kind: ParameterKind, dof: str) -> Parameter:
        """Return the parameter of one DOF."""
        return cls(kind, dof, dof)

    @classmethod
    def parse(cls, name: str) -> Parameter:
        """Return the parameter of a name such as ``"k_y"``, ``"c_y,theta"`` or ``"bolt1.k_y"``.

        Raises
        ------
        ValueError
            No such name.
        """
        check_type("a parameter", name, str)
        point, direction = point_and_direction(name)
        of_point = bool(point) and _OF_POINT.match(direction) is not None and "," not in point
        kind, underscore, dofs = (direction if of_point else name).partition("_")
        row, _, column = dofs.partition(",")
        if of_point and row:
            row, column = f"{point}.{row}", column and f"{point}.{column}"
        if kind not in get_args(ParameterKind) or not underscore or not row or dofs.endswith(","):
            raise ValueError(f"a parameter must be named k_<dof>, h_<dof> or c_<dof>, not {reprlib.repr(name)}")
        return cls(cast(ParameterKind, kind), row, column or row)

    def __str__(self) -> str:
        return self.name

    @property
    def name(self) -> str:
        """Name ``"k_<dof>"``, or ``"k_<dof>,<dof>"`` for a cross term, after the common point, ``"bolt1.k_y"``."""
        return parameter_name(self.kind, self.row, self.column)

    @property
    def is_cross(self) -> bool:
        """Whether it couples two DOFs."""
        return self.row != self.column

    @property
    def unit(self) -> str:
        """Unit: N/m, between a displacement and a rotation N, N m/rad; the same times seconds for damping."""
        rotations = is_rotation(self.row) + is_rotation(self.column)
        return UNITS["damping" if self.kind == "c" else "stiffness"][rotations]


def joint_parameters(
    dofs: Sequence[str], kinds: Sequence[ParameterKind] = ("k", "c"), *, cross: bool = False
) -> tuple[Parameter, ...]:
    """Return the parameters of a joint: for each kind first all DOFs, then, with `cross`, all pairs.

    Examples
    --------
    >>> from jointfrf.dofs import joint_parameters
    >>> [str(parameter) for parameter in joint_parameters(["y", "theta"])]
    ['k_y', 'k_theta', 'c_y', 'c_theta']
    """
    pairs = [(dof, dof) for dof in dofs]
    if cross:
        pairs += [(a, b) for i, a in enumerate(dofs) for b in dofs[i + 1 :]]
    return tuple(Parameter(kind, *pair) for kind in kinds for pair in pairs)


def similar_dof(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence that proposes a known DOF; empty if none is similar.

    Parts name rotations differently: a rotation at the same node precedes a name that only looks similar.

    Examples
    --------
    >>> from jointfrf.dofs import similar_dof
    >>> similar_dof("A/3:theta", ["A/3:y", "A/3:theta_z"]), similar_dof("3:theta_z", ["3:y", "3:theta"])
    ('; did you mean A/3:theta_z?', '; did you mean 3:theta?')
    """
    names = list(known)
    node, mark, direction = name.rpartition(":")
    if is_rotation(direction):
        here = {one: one[len(node + mark) :] for one in names if one.startswith(node + mark)}
        turns = [one for one, own in here.items() if is_rotation(own)]
        same = [one for one in turns if PLACES.get(here[one].lower(), -1) == PLACES.get(direction.lower())]
        if turns:
            return f"; did you mean {some_of(same or turns, 3, ' or ')}?"
    return did_you_mean(name, names)


def compliance_unit(response: str, force: str) -> str:
    """Return the unit of a receptance or compliance between two DOFs: m/N, m/(N m), rad/N or rad/(N m)."""
    motion = "rad" if is_rotation(response) else "m"
    return motion + ("/(N m)" if is_rotation(force) else "/N")


def direction_places(dofs: Sequence[str]) -> NDArray[np.intp]:
    """Return the place of each DOF among `DIRECTIONS`, counted from 0, shape (n,); errors as in `direction_names`."""
    return np.array([DIRECTIONS.index(name) for name in direction_names(as_names("dofs", dofs))], np.intp)


def rigid_motion(points: FloatArray, about: FloatArray) -> FloatArray:
    """Return displacements of points that follow a reference point, u = u_R + theta x r.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Positions of the points, m.
    about : ndarray, shape (3,)
        Reference point, m.

    Returns
    -------
    ndarray, shape (n, 3, 6)
        Displacements for unit motions x, y, z, theta_x, theta_y, theta_z.
    """
    r = points - about
    motion = np.zeros((len(points), 3, 6))
    motion[:, [0, 1, 2], [0, 1, 2]] = 1
    for axis in range(3):
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], r)
    return motion


def rigid_offset(dofs: Sequence[str], offset: ArrayLike) -> FloatArray:
    """Return the motion of a point rigidly connected to another one: u_new = u + theta x offset, theta_new = theta.

    Parameters
    ----------
    dofs : sequence of str
        Names of the n DOFs, in any order: x, y, z (or ux, ...), theta_x, theta_y, theta_z (or rx, rot_x, ...). Missing
        ones are zero.
    offset : array_like, shape (3,)
        Vector from the old point to the new one along x, y, z, m.

    Returns
    -------
    ndarray, shape (n, n)
        Matrix T of q_new = T q and, for forces, f = T^T f_new. The inverse has the opposite offset: T(-offset) = T^-1.

    Raises
    ------
    ValueError
        A name that is not known or comes twice, a wrong shape, NaN or Inf.

    See Also
    --------
    Joint.moved : a joint at another reference point.
    virtual_point : transform from channels to a point.

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
