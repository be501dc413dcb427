"""Models whose nodes have places, and reference points that patches of nodes follow or whose mean motion they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from jointfrf.dofs import DIRECTIONS, direction_places, rigid_motion
from jointfrf.kernel.arguments import FloatArray, as_positive, as_real, check_choice, check_type, one_line
from jointfrf.models.model import Model

__all__ = ["Coupling", "PointModel", "PointPatch", "Region", "couple_points", "rigid_body"]

Coupling = Literal["rigid", "distributing"]
#: Relative motion of the nodes of a patch below which it does not determine a motion of its point.
_HELD = 1e-6
#: Relative difference of the sizes of two regions, by their meshes, up to which they are equal.
_SAME_SIZE = 0.01


class Region(NamedTuple):
    """A line or a face of a model on which a joint acts per length or area.

    Attributes
    ----------
    per : {"m", "m^2"}
        Unit: "m" for a line, "m^2" for a face.
    size : float
        Length, m, or area, m^2.
    centre : ndarray, shape (3,)
        Centre, m.
    terms : int
        Number of polynomials of the motion.
    extent : ndarray, shape (3,)
        Extent along the axes, m.
    """

    per: Literal["m", "m^2"]
    size: float
    centre: FloatArray
    terms: int
    extent: FloatArray

    def __str__(self) -> str:
        return (
            f"{'a line' if self.per == 'm' else 'a face'} of {self.size:.4g} {self.per} with {self.terms} polynomials"
        )

    def matches(self, other: Region) -> bool:
        """Return whether both have the same kind, size and polynomials."""
        is_alike = self.per == other.per and self.terms == other.terms
        return is_alike and bool(np.isclose(self.size, other.size, rtol=_SAME_SIZE))

    def ports(self, name: str, direction: str) -> tuple[str, ...]:
        """Return the names of the coefficients of the motion in a direction, by the name of the region."""
        return tuple(f"{name}~{i}:{direction}" for i in range(self.terms))


@dataclass(frozen=True, kw_only=True)
class PointModel(Model):
    """A model with motions that are sums of DOFs, and with places of its nodes.

    Attributes
    ----------
    places : mapping of str to ndarray, shape (3,)
        Positions of nodes and reference points, m.
    shown : mapping of str to sparse array, shape (1, n)
        Motions that are no DOFs, by names like DOFs, ``"tip:theta_x"``: weights of the DOFs.
    regions : mapping of str to Region
        Lines and faces on which joints act per length or area; their ports are among `shown`.
    """

    places: Mapping[str, FloatArray] = field(default_factory=dict)
    shown: Mapping[str, sparse.csr_array] = field(default_factory=dict)
    regions: Mapping[str, Region] = field(default_factory=dict)

    def region_ports(self, dof: str) -> tuple[str, ...]:
        """Return the ports of a region by the end of a joint, ``"weld:z"``; none for other DOFs."""
        check_type("dof", dof, str)
        name, _, direction = dof.rpartition(":")
        found = self.regions[name].ports(name, direction) if name in self.regions else ()
        return found if set(found) <= self.shown.keys() else ()

    def ports(self, *names: str) -> list[int] | sparse.csr_array:
        """Return DOFs, or weights for motions in `shown`, as argument of `jointfrf.receptance`.

        Raises
        ------
        ValueError
            The model has no motion of this name.
        """
        if not any(name in self.shown for name in names):
            return super().ports(*names)
        unit = sparse.eye_array(len(self.dofs), format="csr")
        rows = [self.shown[name] if name in self.shown else unit[[self.index(name)]] for name in names]
        return sparse.csr_array(sparse.vstack(rows))


def rigid_body(
    mass: float,
    inertia: ArrayLike,
    points: Mapping[str, ArrayLike],
    *,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    moves: Sequence[str] = DIRECTIONS,
) -> PointModel:
    """Return a model of a rigid body with named points.

    Parameters
    ----------
    mass : float
        Mass, kg.
    inertia : array_like, shape (3,) or (3, 3)
        Moments of inertia about axes through the centre of mass along x, y, z, or the tensor, kg m^2.
    points : mapping of str to array_like, shape (3,)
        Positions of the points, m; each has six DOFs, ``"foot:x"`` to ``"foot:theta_z"``.
    centre : array_like, shape (3,)
        Centre of mass, m; its DOFs are ``"centre:x"``, ...
    moves : sequence of str
        Directions in which it is free, among x, y, z, theta_x, theta_y, theta_z; all further directions are fixed.

    Returns
    -------
    PointModel
        Rigid body.

    Raises
    ------
    ValueError
        A mass or an inertia that is not positive, a point named ``centre``, a direction that does not exist.

    See Also
    --------
    chain : chains of masses and springs.
    Substructure : a part of an assembly.

    Examples
    --------
    >>> import jointfrf as jf
    >>> plate = jf.rigid_body(2.0, [0.1, 0.1, 0.2], {"edge": [0.5, 0.0, 0.0]})
    >>> h = plate.receptance([1.0], ["edge:z"])[0, 0, 0]
    >>> bool(abs(h * (2 * 3.141592653589793) ** 2 + 1 / 2.0 + 0.5**2 / 0.1) < 1e-9)
    True
    """
    own = as_positive("mass", mass)
    is_tensor = np.asarray(inertia, object).ndim == 2
    tensor = as_real("inertia", inertia, (3, 3)) if is_tensor else np.diag(as_real("inertia", inertia, (3,)))
    if not np.allclose(tensor, tensor.T) or np.linalg.eigvalsh(tensor)[0] <= 0:
        raise ValueError("inertia must be symmetric and positive definite")
    check_type("points", points, Mapping)
    at = {"centre": as_real("centre", centre, (3,))}
    for name, place in points.items():
        if not isinstance(name, str) or not name or name == "centre" or ":" in name or "/" in name:
            raise ValueError(f"points: a point cannot be named {one_line(name)}")
        at[name] = as_real(f"points: {name}", place, (3,))
    free = np.sort(direction_places(moves))
    if not free.size:
        raise ValueError("moves must name at least one direction")
    whole = np.zeros((6, 6))
    whole[[0, 1, 2], [0, 1, 2]], whole[3:, 3:] = own, tensor
    shown = {}
    for name, place in at.items():
        motion = np.eye(6)
        motion[:3] = rigid_motion(place[None], at["centre"])[0]
        for i, direction in enumerate(DIRECTIONS):
            if name != "centre" or i not in free:
                shown[f"{name}:{direction}"] = sparse.csr_array(motion[[i]][:, free])
    n = free.size
    return PointModel(
        stiffness=sparse.csr_array((n, n)), mass=sparse.csr_array(whole[np.ix_(free, free)]),
        dofs=tuple(f"centre:{DIRECTIONS[i]}" for i in free), places=at, shown=shown,
    )  # fmt: skip


@dataclass(frozen=True)
class PointPatch:
    """Nodes of a reference point.

    Attributes
    ----------
    name : str
        Name of the point; its DOFs are ``"name:x"`` to ``"name:theta_z"``.
    nodes : tuple of str
        Nodes of the patch.
    coupling : {"rigid", "distributing"}
        Coupling: the nodes follow the point as a rigid body (RBE2, ``*RIGID BODY``), or the point has their mean motion
        and distributes forces over them (RBE3, distributing ``*COUPLING``), which adds no stiffness.
    at : ndarray, shape (3,), or None
        Position of the point, m; by default the mean of its nodes.
    """

    name: str
    nodes: tuple[str, ...]
    coupling: Coupling = "distributing"
    at: FloatArray | None = None


@dataclass(frozen=True)
class _Followers:
    """DOFs of a patch, counted from 0, their motion for unit motions of the point, shape (m, 6), and the point."""

    dofs: list[int]
    motion: FloatArray
    at: FloatArray


def couple_points(model: PointModel, patches: Sequence[PointPatch]) -> PointModel:
    """Return a model with additional reference points.

    Parameters
    ----------
    model : PointModel
        Model with the places of the nodes of the patches.
    patches : sequence of PointPatch
        Nodes of each point.

    Returns
    -------
    PointModel
        Model in which DOFs of a rigid patch are replaced by DOFs of its point; `shown` still has their names, and the
        points of distributing patches.

    Raises
    ------
    ValueError
        A node without place or DOFs; a node in two rigid patches; a patch that does not determine its point.

    Notes
    -----
    Rigid: u = T q with u_i = u_R + theta x r_i. Distributing: q_R = (R^T R)^-1 R^T u is the rigid motion nearest to the
    motion of the nodes; the transpose distributes forces at the point.
    """
    number = {dof: i for i, dof in enumerate(model.dofs)}
    taken = {name.partition(":")[0] for name in (*model.dofs, *model.shown)}
    followers: dict[str, _Followers] = {}
    owner: dict[str, str] = {}
    for patch in patches:
        check_choice("coupling", patch.coupling, get_args(Coupling))
        if patch.name in taken or patch.name in followers or ":" in patch.name or not patch.name:
            raise ValueError(f"a point cannot be named {patch.name!r}: a node or a point has this name, or it has none")
        followers[patch.name] = _followers(model, number, patch)
        for node in patch.nodes if patch.coupling == "rigid" else ():
            if node in owner:
                raise ValueError(f"node {node} follows both {owner[node]} and {patch.name}")
            owner[node] = patch.name
    rigid = {one.name: followers[one.name] for one in patches if one.coupling == "rigid"}
    places = {**model.places, **{name: one.at for name, one in followers.items()}}
    expansion, dofs = _expansion(model.dofs, rigid)
    shown = {name: sparse.csr_array(row @ expansion) for name, row in model.shown.items()}
    for name, one in followers.items():
        if name in rigid:
            shown |= {model.dofs[dof]: expansion[[dof]] for dof in one.dofs}
        else:
            at = (np.repeat(np.arange(6), len(one.dofs)), np.tile(one.dofs, 6))
            weights = sparse.coo_array((np.linalg.pinv(one.motion).ravel(), at), shape=(6, len(model.dofs)))
            rows = sparse.csr_array(sparse.csr_array(weights) @ expansion)
            shown |= {f"{name}:{direction}": rows[[i]] for i, direction in enumerate(DIRECTIONS)}
    if not rigid:
        return replace(model, places=places, shown=shown)
    changed = {
        one.name: sparse.csr_array(expansion.T @ sparse.csr_array(matrix) @ expansion)
        for one in fields(Model)
        if (matrix := getattr(model, one.name)) is not None and one.name not in ("dofs", "loss_factor")
    }
    return replace(model, **changed, dofs=dofs, places=places, shown=shown)


def _followers(model: PointModel, number: Mapping[str, int], patch: PointPatch) -> _Followers:
    """Return the DOFs of the nodes of a patch, and their motion for a motion of its point."""
    if not patch.nodes:
        raise ValueError(f"point {patch.name}: it has no nodes")
    missing = [node for node in patch.nodes if node not in model.places]
    if missing:
        raise ValueError(f"point {patch.name}: the place of node {missing[0]} is not known")
    where = np.array([model.places[node] for node in patch.nodes])
    at = where.mean(axis=0) if patch.at is None else np.asarray(patch.at, float)
    motion = rigid_motion(where, at)
    dofs: list[int] = []
    rows: list[FloatArray] = []
    turning = patch.coupling == "rigid" or len(patch.nodes) < 3
    for i, node in enumerate(patch.nodes):
        names = [f"{node}:{direction}" for direction in DIRECTIONS]
        absent = [name for name in names[:3] if name not in number]
        if absent:
            why = "it is fixed or belongs to another constraint of the file"
            if any(f"{node}:local_{direction}" in number for direction in DIRECTIONS[:3]):
                why = "its directions are local; write the model in global ones"
            raise ValueError(f"point {patch.name}: node {node} has no DOF {absent[0]}: {why}")
        dofs += [number[name] for name in names[:3]]
        rows += list(motion[i])
        for axis in range(3):
            if turning and names[3 + axis] in number:
                dofs.append(number[names[3 + axis]])
                rows.append(np.eye(6)[3 + axis])
    whole = np.array(rows)
    # Rotations times the size of the patch are displacements, too.
    size = max(float(np.ptp(where, axis=0).max()), 1e-12)
    seen = np.linalg.svd(whole * np.r_[np.ones(3), np.full(3, 1 / size)], compute_uv=False)
    if len(whole) < 6 or seen[-1] <= _HELD * seen[0]:
        raise ValueError(
            f"point {patch.name} cannot rotate with its nodes; give three that are not on one line, or nodes with "
            "rotations"
        )
    return _Followers(dofs, whole, at)


def _expansion(dofs: tuple[str, ...], rigid: Mapping[str, _Followers]) -> tuple[sparse.csr_array, tuple[str, ...]]:
    """Return u = T q, and the names of q: DOFs that follow no point, then six of each point."""
    free = np.ones(len(dofs), bool)
    for one in rigid.values():
        free[one.dofs] = False
    kept = np.flatnonzero(free)
    rows, columns, values = [kept], [np.arange(kept.size)], [np.ones(kept.size)]
    names = [dofs[i] for i in kept]
    for name, one in rigid.items():
        at = np.argwhere(one.motion)
        rows.append(np.asarray(one.dofs)[at[:, 0]])
        columns.append(len(names) + at[:, 1])
        values.append(one.motion[tuple(at.T)])
        names += [f"{name}:{direction}" for direction in DIRECTIONS]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(sparse.coo_array(entries, shape=(len(dofs), len(names)))), tuple(names)
