"""Structured meshes of eight-node bricks, extruded from plane quadrilaterals; displacements of points between nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from jointfrf.kernel.arguments import FloatArray, as_array, as_count, as_not_negative, as_real, check_type

__all__ = ["NEAR", "Mesh", "Plan", "disc", "extrude", "holed_rectangle", "interpolation", "join_plans", "rectangle"]

#: Nodes within this share of the height, or length, of a body lie in a plane.
NEAR = 1e-6
#: Points nearer than this share of the extent of a mesh are one node.
_SAME = 1e-7
#: Half the side of the square in the middle of a disc, as a share of the radius.
_CORE = 0.55
#: Faces of a brick, counter-clockwise from outside.
_FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
#: Corners of a brick in its own coordinates, in the order of its nodes.
_CORNERS: Final = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], float)
#: Steps of Newton's method in a brick; distorted ones need five.
_STEPS: Final = 12
#: Elements tried for each point, nearest centres first, before all are.
_FIRST: Final = 16


@dataclass(frozen=True)
class Plan:
    """Quadrilaterals in the plane of z and x, counter-clockwise there.

    Attributes
    ----------
    points : ndarray, shape (n_points, 2)
        z and x, m.
    quads : ndarray of int, shape (n_quads, 4)
        Points of each, counted from 0.
    """

    points: FloatArray
    quads: NDArray[np.int32]


@dataclass(frozen=True)
class Mesh:
    """Nodes and eight-node bricks.

    Attributes
    ----------
    nodes : ndarray, shape (n_nodes, 3)
        x, y, z, m.
    elements : ndarray of int, shape (n_elements, 8)
        Nodes of each, counted from 0: lower face counter-clockwise seen from above, then the upper face.
    """

    nodes: FloatArray
    elements: NDArray[np.int32]

    def __post_init__(self) -> None:
        as_real("nodes", self.nodes, (None, 3))
        elements = as_array("elements", self.elements)
        if elements.ndim != 2 or elements.shape[1] != 8 or elements.dtype.kind not in "iu":
            raise ValueError(
                f"elements must contain eight node numbers each, not {elements.dtype} of shape {elements.shape}"
            )
        if elements.size and not (elements.min() >= 0 and elements.max() < len(self.nodes)):
            raise ValueError(f"elements must name nodes 0 to {len(self.nodes) - 1}")

    def near(self, point: ArrayLike) -> int:
        """Return the node at a point.

        Raises
        ------
        ValueError
            There is none.
        """
        place = as_real("point", point, (3,))
        distance, found = cKDTree(self.nodes).query(place)
        if distance > 10 * _SAME * _extent(self.nodes):
            at = ", ".join(f"{1e3 * x:g}" for x in place)
            raise ValueError(f"no node lies at x, y, z = {at} mm; the nearest is {1e3 * distance:.3g} mm away")
        return int(found)

    def faces(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return the outer faces, shape (n_faces, 4), seen counter-clockwise from outside, and their elements."""
        every = self.elements[:, _FACES].reshape(-1, 4)
        _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
        outer = np.sort(first[count == 1])
        return every[outer], (outer // len(_FACES)).astype(np.int32)


def rectangle(z: ArrayLike, x: ArrayLike) -> Plan:
    """Rectangle with grid lines at given places.

    Parameters
    ----------
    z, x : array_like, shape (n_z,), (n_x,)
        Ascending, m.

    Returns
    -------
    Plan
    """
    lines = [as_real(name, value, (None,)) for name, value in (("z", z), ("x", x))]
    for name, line in zip("zx", lines, strict=True):
        if line.size < 2 or (np.diff(line) <= 0).any():
            raise ValueError(f"{name} must contain at least two grid lines in ascending order")
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    number = np.arange(grid[..., 0].size).reshape(grid.shape[:2])
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    return Plan(grid.reshape(-1, 2), quads.reshape(-1, 4).astype(np.int32))


def holed_rectangle(
    centre: ArrayLike, reach: tuple[float, float, float], radii: Sequence[float], divisions: int, layers: int = 1
) -> Plan:
    """Rectangle around a round hole: rings at given radii, then layers that pass from the circle to the edges.

    Parameters
    ----------
    centre : array_like, shape (2,)
        z and x of the middle of the hole, m.
    reach : tuple of float
        How far the rectangle reaches from there: to lower z, to higher z, and along x to either side, m.
    radii : sequence of float
        Radius of the hole, then of the rings around it, m.
    divisions : int
        Quadrilaterals along an edge.
    layers : int
        Quadrilaterals from the last circle to the edges.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        The circles do not grow, or leave the rectangle; numbers of quadrilaterals below 1.
    """
    as_count("layers", layers)
    if not radii or not _grow([*radii, min(reach)]):
        raise ValueError(
            f"radii {', '.join(f'{1e3 * r:g}' for r in radii)} mm must grow from the hole outwards, to less than "
            f"{1e3 * min(reach):g} mm at the nearest edge"
        )
    circle, square = _around(divisions)
    edge = square * np.where(square[:, :1] < 0, [reach[0], reach[2]], [reach[1], reach[2]])
    rows = [r * circle for r in radii]
    rows += [rows[-1] + (edge - rows[-1]) * (i / layers) for i in range(1, layers + 1)]
    return _rings(np.asarray(centre, float), rows)


def disc(centre: ArrayLike, radii: Sequence[float], divisions: int, layers: int = 1) -> Plan:
    """Disc: a square core, layers from it to the first circle, then rings.

    Parameters
    ----------
    centre : array_like, shape (2,)
        z and x of the middle, m.
    radii : sequence of float
        Ascending, m.
    divisions : int
        Quadrilaterals along a side of the core.
    layers : int
        Quadrilaterals from the core to the first circle.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        The circles do not grow; numbers of quadrilaterals below 1.
    """
    as_count("layers", layers)
    if not radii or not _grow(radii):
        raise ValueError(f"radii {', '.join(f'{1e3 * r:g}' for r in radii)} mm must grow from the middle outwards")
    circle, square = _around(divisions)
    core = _CORE * radii[0]
    rows = [core * square + (radii[0] * circle - core * square) * (i / layers) for i in range(layers + 1)]
    rows += [r * circle for r in radii[1:]]
    place = np.asarray(centre, float)
    lines = np.linspace(-core, core, divisions + 1)
    return join_plans(rectangle(place[0] + lines, place[1] + lines), _rings(place, rows))


def _grow(radii: Sequence[float]) -> bool:
    return all(b > a for a, b in pairwise([0.0, *radii]))


def _around(divisions: int) -> tuple[FloatArray, FloatArray]:
    """Points once around, counter-clockwise: on the unit circle, and on the square of half side 1."""
    as_count("divisions", divisions)
    along = np.linspace(-1, 1, divisions + 1)[:-1]
    side = np.stack([np.ones(divisions), along], axis=1)
    arc = np.stack([np.cos(np.pi / 4 * along), np.sin(np.pi / 4 * along)], axis=1)
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    quarters = [np.linalg.matrix_power(turn, i) for i in range(4)]
    return np.concatenate([arc @ q for q in quarters]), np.concatenate([side @ q for q in quarters])


def _rings(centre: FloatArray, rows: Sequence[FloatArray]) -> Plan:
    """Quadrilaterals between closed rows of points, the innermost first."""
    number = np.arange(len(rows) * len(rows[0])).reshape(len(rows), -1)
    after = np.roll(number, -1, axis=1)
    quads = np.stack([number[:-1], number[1:], after[1:], after[:-1]], axis=-1)
    return Plan(centre + np.concatenate(rows), quads.reshape(-1, 4).astype(np.int32))


def join_plans(*plans: Plan) -> Plan:
    """One plan of several; points at the same place become one."""
    points = np.concatenate([p.points for p in plans])
    starts = np.cumsum([0, *(len(p.points) for p in plans[:-1])])
    quads = np.concatenate([p.quads + start for p, start in zip(plans, starts, strict=True)])
    number, kept = _merged(points)
    return Plan(points[kept], number[quads])


def extrude(*parts: tuple[Plan, ArrayLike]) -> Mesh:
    """Bricks over the quadrilaterals of plans, between heights y; nodes at the same place become one.

    Parameters
    ----------
    *parts : (Plan, array_like of shape (n_layers + 1,))
        Plan and ascending heights, m, of each part of one body.

    Returns
    -------
    Mesh
        Layers of a part from the lowest up.
    """
    nodes, elements, start = [], [], 0
    for plan, heights in parts:
        y = as_real("heights", heights, (None,))
        if y.size < 2 or (np.diff(y) <= 0).any():
            raise ValueError("heights must contain at least two values in ascending order")
        count = len(plan.points)
        layer = np.empty((y.size, count, 3))
        layer[:, :, 0], layer[:, :, 1], layer[:, :, 2] = plan.points[:, 1], y[:, None], plan.points[:, 0]
        nodes.append(layer.reshape(-1, 3))
        base = start + count * np.arange(y.size - 1)[:, None, None] + plan.quads
        elements.append(np.concatenate([base, base + count], axis=2).reshape(-1, 8))
        start += layer.size // 3
    every = np.concatenate(nodes)
    number, kept = _merged(every)
    return Mesh(every[kept], number[np.concatenate(elements)])


def _extent(points: FloatArray) -> float:
    return float(np.ptp(points, axis=0).max())


def _merged(points: FloatArray) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
    """Return the new number of every point, and which points are kept, in their order."""
    pairs = cKDTree(points).query_pairs(_SAME * _extent(points), output_type="ndarray")
    first = np.arange(len(points))
    # The lower number of a pair stays; pairs of one place all name its lowest point, since all are near each other.
    np.minimum.at(first, pairs[:, 1], pairs[:, 0])
    kept = np.flatnonzero(first == np.arange(len(points)))
    number = np.full(len(points), -1, np.int32)
    number[kept] = np.arange(kept.size)
    return number[first], kept


def interpolation(
    mesh: Mesh,
    points: ArrayLike,
    directions: str | Sequence[str] | ArrayLike = "xyz",
    *,
    elements: ArrayLike | None = None,
    tolerance: float = 1e-6,
) -> sparse.csr_array:
    """Weights that give displacements of points from those of the nodes.

    Parameters
    ----------
    mesh : Mesh
    points : array_like, shape (n_points, 3)
        x, y, z, m: inside bricks or on their faces.
    directions : str, sequence of str, or array_like of shape (m, 3)
        Of the displacements: a string of axes serves every point, "xyz" gives three rows a point, the points slowest; a
        sequence holds one of "x", "y", "z" for each point; an array one vector for each point, made a unit vector.
    elements : array_like of int, optional
        Bricks that are searched, counted from 0: a body, where two of them touch. All by default.
    tolerance : float
        How far a point may lie off the bricks, m; the nearest point of a brick is taken for it.

    Returns
    -------
    csr_array, shape (m, 3 n_nodes)
        Multiply it with `SolidModel.expansion` for weights of the DOFs of a model.

    Raises
    ------
    ValueError
        A point that lies off the bricks, an invalid direction.

    Notes
    -----
    Trilinear functions of the eight nodes; the inner functions of "incompatible" bricks vanish there and are left out.
    Facets replace round faces: between their nodes a hole is a little narrower than its circle.

    Examples
    --------
    The middle of the upper face of a brick of 1 x 1 x 2 m follows its four nodes:

    >>> from jointfrf.workbench.solids.mesh import interpolation
    >>> from jointfrf.workbench.solids.mesh import extrude, rectangle
    >>> brick = extrude((rectangle([0, 2], [0, 1]), [0, 1]))
    >>> weights = interpolation(brick, [[0.5, 1.0, 1.0]], "y")
    >>> weights.shape, weights.data.tolist()
    ((1, 24), [0.25, 0.25, 0.25, 0.25])
    """
    check_type("mesh", mesh, Mesh)
    places = as_real("points", points, (None, 3))
    as_not_negative("tolerance", tolerance, "m")
    point, vectors = _rows(len(places), directions)
    bricks = _chosen(mesh, elements)
    found, weights = _located(mesh, bricks, places, tolerance)
    nodes = mesh.elements[bricks[found]]
    weights[abs(weights) < np.finfo(float).eps] = 0
    values = weights[point][:, :, None] * vectors[:, None, :]
    columns = 3 * nodes[point].astype(np.int64)[:, :, None] + np.arange(3)
    rows = np.broadcast_to(np.arange(len(point))[:, None, None], values.shape)
    shape = (len(point), 3 * len(mesh.nodes))
    matrix = sparse.csr_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape)
    matrix.eliminate_zeros()
    return matrix


def _rows(count: int, directions: str | Sequence[str] | ArrayLike) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the point and the unit vector of every row."""
    if isinstance(directions, str):
        if not directions or any(axis not in "xyz" for axis in directions):
            raise ValueError(f"directions must be made of x, y and z, not {directions!r}")
        every = np.eye(3)[["xyz".index(axis) for axis in directions]]
        return np.repeat(np.arange(count), len(every)), np.tile(every, (count, 1))
    given = list(directions) if isinstance(directions, Sequence) else directions
    if isinstance(given, list) and any(isinstance(one, str) for one in given):
        if len(given) != count or any(one not in ("x", "y", "z") for one in given):
            raise ValueError(f"directions must name x, y or z for each of the {count} points")
        return np.arange(count), np.eye(3)[["xyz".index(one) for one in given]]
    vectors = as_real("directions", given, (count, 3))
    length = np.linalg.norm(vectors, axis=1)
    if not length.all():
        raise ValueError(f"directions must not contain a zero vector, as point {int(length.argmin())} has")
    return np.arange(count), vectors / length[:, None]


def _chosen(mesh: Mesh, elements: ArrayLike | None) -> NDArray[np.intp]:
    if elements is None:
        return np.arange(len(mesh.elements))
    chosen = np.asarray(elements)
    if chosen.ndim != 1 or chosen.size == 0 or chosen.dtype.kind not in "iu":
        raise ValueError("elements must be a list of element numbers, at least one")
    if chosen.min() < 0 or chosen.max() >= len(mesh.elements):
        raise ValueError(f"elements must lie between 0 and {len(mesh.elements) - 1}")
    return chosen.astype(np.intp)


def _located(
    mesh: Mesh, bricks: NDArray[np.intp], places: FloatArray, tolerance: float
) -> tuple[NDArray[np.intp], FloatArray]:
    """Return for each point the brick that holds it, as a position in `bricks`, and the weights of its nodes."""
    tree = cKDTree(mesh.nodes[mesh.elements[bricks]].mean(axis=1))
    best = np.zeros(len(places), np.intp)
    weights = np.zeros((len(places), len(_CORNERS)))
    distance = np.full(len(places), np.inf)
    left = np.arange(len(places))
    for count in (min(_FIRST, len(bricks)), len(bricks)):
        for i in left.tolist():
            near = np.atleast_1d(tree.query(places[i], count)[1])
            near = near[near < len(bricks)]  # none of a point too far away for its distance to be a number
            if not near.size:
                continue
            functions, off = _nearest(mesh.nodes[mesh.elements[bricks[near]]], places[i])
            closest = int(off.argmin())
            best[i], weights[i], distance[i] = near[closest], functions[closest], off[closest]
        left = np.flatnonzero(distance > tolerance)
    if left.size:
        at = ", ".join(f"{1e3 * x:g}" for x in places[left[0]])
        raise ValueError(
            f"points: number {left[0]} at x, y, z = {at} mm lies {1e3 * distance[left[0]]:.3g} mm off the bricks"
        )
    return best, weights


def _nearest(corners: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the shape functions of each brick (n, 8, 3) at its point nearest to a place, about, and how far it is."""
    own = np.zeros((len(corners), 3))
    for _ in range(_STEPS):
        factors = 1 + own[:, None, :] * _CORNERS
        functions = factors.prod(axis=2) / 8
        slopes = np.stack([factors[:, :, a] * factors[:, :, b] for a, b in ((1, 2), (0, 2), (0, 1))], axis=2)
        jacobian = np.einsum("enj,eni->eij", slopes * _CORNERS / 8, corners)
        miss = place - np.einsum("en,eni->ei", functions, corners)
        # Outside, where the functions may fold over, there is nothing to look for.
        own = np.clip(own + np.linalg.solve(jacobian, miss[:, :, None])[:, :, 0], -1, 1)
    functions = (1 + own[:, None, :] * _CORNERS).prod(axis=2) / 8
    return functions, np.linalg.norm(place - np.einsum("en,eni->ei", functions, corners), axis=1)
