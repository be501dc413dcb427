"""Edges, lines and faces of a model on which a joint acts per length or area."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import Delaunay

from jointfrf.dofs import DIRECTIONS
from jointfrf.kernel.arguments import FloatArray, as_integer, as_names, as_positive, check_type, one_line
from jointfrf.models.points import PointModel, Region

__all__ = ["Degree", "NodeRegion", "Quadrature", "add_regions", "region_rows"]

#: Degree of the polynomials of the motion: total degree, or degrees along both directions of a face.
Degree = int | tuple[int, int]
#: Default total degrees of a line and of a face.
_DEGREES = {1: 6, 2: 4}
#: Largest distance of the points of a straight or plane region from the line or plane, as a share of its size.
_FLAT = 1e-3
#: Least new part of a polynomial of the motion that is independent.
_NEW = 1e-8


@dataclass(frozen=True)
class Quadrature:
    """Points of a region with their weights: an integral over it is the sum of weights times values.

    Attributes
    ----------
    at : ndarray, shape (m, 3)
        Positions of the points, m.
    weights : ndarray, shape (m,)
        Lengths in m, or areas in m^2.
    rows : mapping of str to sparse array, shape (m, n)
        Motions at the points from the DOFs of the model, by direction.
    """

    at: FloatArray
    weights: FloatArray
    rows: Mapping[str, sparse.csr_array]


@dataclass(frozen=True)
class NodeRegion:
    """Nodes of a model on a straight line or in a plane, on which a joint acts per length or area.

    Parameters
    ----------
    name : str
        Name of the region; ``"name:z"`` is the end of a joint.
    nodes : sequence of str
        Names of the nodes.
    degree : int or (int, int), optional
        Total degree of the polynomials that describe the motion, default 6 for a line and 4 for a face; or the degrees
        along both directions of a face, in the order of its axes.
    size : float, optional
        Length, m, or area, m^2; by default the distance between the outer nodes, for a face their convex hull.

    See Also
    --------
    add_regions : a model with regions.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.NodeRegion("weld", ["3", "4", "5"]).name
    'weld'
    """

    name: str
    nodes: Sequence[str]
    degree: Degree | None = None
    size: float | None = None

    def __post_init__(self) -> None:
        check_type("name", self.name, str)
        object.__setattr__(self, "nodes", as_names("nodes", self.nodes))


def add_regions(model: PointModel, regions: Sequence[NodeRegion]) -> PointModel:
    """Return a model with regions.

    Parameters
    ----------
    model : PointModel
        Model with the places of the nodes.
    regions : sequence of NodeRegion
        Regions to add.

    Returns
    -------
    PointModel
        The model with `regions`, on which joints act per length or area.

    Raises
    ------
    ValueError
        A node without a place, nodes that are on no line and in no plane, too few nodes for the degree, a name that is
        taken.
    TypeError
        `model` is no PointModel, or `regions` are no regions.

    See Also
    --------
    NodeRegion : nodes of a region.
    PlacedJoint : a joint on regions.

    Notes
    -----
    On a line, the weight of a node is half the distance between its neighbours. In a plane it is a third of the
    triangles of a Delaunay triangulation. These cover holes and notches: state the `size` of such a face.

    Examples
    --------
    A square of four nodes on a bedding of 1e6 N/m per m^2 moves at sqrt(1e6 * 0.04 / 8) / (2 pi) Hz:

    >>> import numpy as np, scipy.sparse as sp, jointfrf as jf
    >>> at = {"1": [0, 0, 0], "2": [0.2, 0, 0], "3": [0, 0.2, 0], "4": [0.2, 0.2, 0]}
    >>> model = jf.PointModel(sp.csr_array((4, 4)), 2 * sp.eye_array(4, format="csr"), tuple(f"{i}:z" for i in at),
    ...                       places={name: np.array(place, float) for name, place in at.items()})
    >>> part = jf.Substructure(jf.add_regions(model, [jf.NodeRegion("base", list(at), degree=1)]), exact=True)
    >>> bed = jf.PlacedJoint(jf.Joint([1e6], dofs=["z"]), ["plate/base:z"])
    >>> whole = jf.Assembly.of_parts({"plate": part}, {"bed": bed})
    >>> f = np.sqrt(1e6 * 0.04 / 8) / 2 / np.pi
    >>> h = whole.receptance([0.5 * f], ["plate/1:z"], ["plate/4:z"])
    >>> whole.joint.quantities[0].unit
    'N/m per m^2'
    """
    check_type("model", model, PointModel)
    if not isinstance(regions, Sequence) or not all(isinstance(one, NodeRegion) for one in regions):
        raise TypeError(f"regions must be a sequence of NodeRegion, not {one_line(regions)}")
    number = {dof: i for i, dof in enumerate(model.dofs)}
    shown, places, found = dict(model.shown), dict(model.places), dict(model.regions)
    taken = {name.rpartition(":")[0] for name in (*model.dofs, *model.shown)}
    for one in regions:
        if one.name in taken or one.name in found or not one.name or any(sign in one.name for sign in ":/~"):
            raise ValueError(f"region {one_line(one.name)}: choose another name, without : / and ~")
        missing = [node for node in one.nodes if node not in model.places]
        if missing or len(one.nodes) < 2:
            why = f"the place of node {missing[0]} is not known" if missing else "name at least two nodes"
            raise ValueError(f"region {one.name}: {why}")
        at = np.array([model.places[node] for node in one.nodes])
        rows = {}
        for direction in DIRECTIONS:
            own = [number.get(f"{node}:{direction}") for node in one.nodes]
            if None not in own:
                unit = (np.ones(len(own)), (np.arange(len(own)), own))
                rows[direction] = sparse.csr_array(unit, shape=(len(own), len(model.dofs)))
        if not rows:
            raise ValueError(f"region {one.name}: its nodes have no direction in common")
        weights = _weights(one.name, at)
        if one.size is not None:
            weights *= as_positive(f"region {one.name}: size", one.size) / weights.sum()
        found[one.name], terms = region_rows(one.name, Quadrature(at, weights, rows), one.degree)
        shown |= terms
        places[one.name] = found[one.name].centre
    return replace(model, shown=shown, places=places, regions=found)


def region_rows(name: str, own: Quadrature, degree: Degree | None) -> tuple[Region, dict[str, sparse.csr_array]]:
    """Return a region, and the motions that are its ports.

    Parameters
    ----------
    name : str
        Name of the region.
    own : Quadrature
        Points and weights.
    degree : int or (int, int), optional
        Degree of the polynomials of the motion.

    Returns
    -------
    Region
        The region.
    dict of str to sparse array, shape (1, n)
        Coefficients a_i of the motion u = sum a_i p_i by the names of `Region.ports`.

    Notes
    -----
    The polynomials p_i are orthonormal over the region: a_i is the integral of p_i u, and a stiffness k per length or
    area has the energy k/2 sum a_i^2, equal springs at all ports. Two regions at one place have the same polynomials,
    because order and signs follow from the axes.
    """
    local = _local(name, own.at)
    powers = _powers(name, local.shape[1], degree)
    low, high = local.min(axis=0), local.max(axis=0)
    scaled = 2 * (local - low) / (high - low) - 1
    tables = [legendre.legvander(axis, int(powers.max())) for axis in scaled.T]
    values = np.prod([table[:, powers[:, i]] for i, table in enumerate(tables)], axis=0)
    root = np.sqrt(own.weights)[:, None]
    q, r = np.linalg.qr(root * values)
    size = abs(np.diagonal(r))
    if len(powers) > len(values) or (size <= _NEW * size[0]).any():
        good = int((size > _NEW * size[0]).sum())
        raise ValueError(f"region {name}: its nodes determine {good} of {len(powers)} polynomials; lower degree")
    coefficients = sparse.csr_array((root * q * np.sign(np.diagonal(r))).T)
    total = float(own.weights.sum())
    kind: Literal["m", "m^2"] = "m" if local.shape[1] == 1 else "m^2"
    region = Region(kind, total, own.weights @ own.at / total, len(powers), np.ptp(own.at, axis=0))
    rows = {
        port: sparse.csr_array(row[None, :] if row.ndim == 1 else row)
        for direction, motion in own.rows.items()
        for port, row in zip(region.ports(name, direction), sparse.csr_array(coefficients @ motion), strict=True)
    }
    return region, rows


def _powers(name: str, dimension: int, degree: Degree | None) -> NDArray[np.intp]:
    """Return the degrees of each polynomial along each direction, the lowest total degree first."""
    own = _DEGREES[dimension] if degree is None else degree
    given = own if isinstance(own, tuple | list) else (own,) * dimension
    most = [as_integer(f"region {name}: degree", one) for one in given]
    if len(most) != dimension or min(most) < 0:
        raise ValueError(f"region {name}: degree must be a number from 0, or two of a face, not {one_line(own)}")
    grid = np.stack(np.meshgrid(*(np.arange(one + 1) for one in most), indexing="ij"), axis=-1).reshape(-1, dimension)
    if not isinstance(own, tuple | list):
        grid = grid[grid.sum(axis=1) <= own]
    return np.asarray(grid[np.lexsort((*grid.T, grid.sum(axis=1)))], np.intp)


def _local(name: str, at: FloatArray) -> FloatArray:
    """Return coordinates along a line, shape (m, 1), or in a plane, shape (m, 2), along the nearest axes."""
    centred = at - at.mean(axis=0)
    _, length, axes = np.linalg.svd(centred, full_matrices=False)
    length = np.r_[length, np.zeros(3 - length.size)]
    if length[0] == 0:
        raise ValueError(f"region {name}: all its points are at one place; use a reference point")
    if length[1] <= _FLAT * length[0]:
        along = axes[0] * np.sign(axes[0][abs(axes[0]).argmax()])
        return np.asarray((centred @ along)[:, None])
    if length[2] <= _FLAT * length[0]:
        return np.asarray(at[:, np.sort(np.argsort(abs(np.cross(axes[0], axes[1])), kind="stable")[:2])])
    raise ValueError(f"region {name}: its nodes lie on no straight line and in no plane; divide it")


def _weights(name: str, at: FloatArray) -> FloatArray:
    """Return the length or area of each node."""
    local = _local(name, at)
    if local.shape[1] == 1:
        order = np.argsort(local[:, 0], kind="stable")
        steps = np.diff(local[order, 0])
        found = np.zeros(len(at))
        found[order[:-1]] += steps / 2
        found[order[1:]] += steps / 2
        return found
    mesh, found = Delaunay(local), np.zeros(len(at))
    a, b, c = (at[mesh.simplices[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    np.add.at(found, mesh.simplices, areas[:, None] / 3)
    return found
