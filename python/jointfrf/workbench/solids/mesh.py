"""Structured meshes of eight-node bricks, extruded from plane quadrilaterals, and interpolation between their nodes."""

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
#: Elements searched first for each point, those with the nearest centres; then all elements are searched.
_FIRST: Final = 16


@dataclass(frozen=True)
class Plan:
    """Quadrilaterals in the plane of z and x, each counter-clockwise from z to x.

    Attributes
    ----------
    points : ndarray, shape (n_points, 2)
        Coordinates z and x of the points, m.
    quads : ndarray of int, shape (n_quads, 4)
        Points of each quadrilateral, counted from 0.

    See Also
    --------
    rectangle, holed_rectangle, disc : Plans of single shapes.
    join_plans : One plan from several.
    extrude : Bricks over a plan.
    """

    points: FloatArray
    quads: NDArray[np.int32]


@dataclass(frozen=True)
class Mesh:
    """Nodes and eight-node bricks.

    Attributes
    ----------
    nodes : ndarray, shape (n_nodes, 3)
        Coordinates x, y, z of the nodes, m.
    elements : ndarray of int, shape (n_elements, 8)
        Nodes of each brick, counted from 0: lower face counter-clockwise as seen from above, then the upper face.

    See Also
    --------
    extrude : Mesh over the quadrilaterals of a plan.
    jointfrf.workbench.solids.solid.solid_model : Model of a mesh.
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
        """Return the number of the node at a point, counted from 0.

        Parameters
        ----------
        point : array_like, shape (3,)
            Coordinates x, y, z, m.

        Returns
        -------
        int

        Raises
        ------
        ValueError
            No node lies at the point.
        """
        place = as_real("point", point, (3,))
        distance, found = cKDTree(self.nodes).query(place)
        if distance > 10 * _SAME * _extent(self.nodes):
            at = ", ".join(f"{1e3 * x:g}" for x in place)
            raise ValueError(f"no node lies at x, y, z = {at} mm; the nearest is {1e3 * distance:.3g} mm away")
        return int(found)

    def faces(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return the outer faces and their elements.

        Returns
        -------
        faces : ndarray of int, shape (n_faces, 4)
            Nodes of each face, counter-clockwise as seen from outside.
        elements : ndarray of int, shape (n_faces,)
            Element of each face.
        """
        every = self.elements[:, _FACES].reshape(-1, 4)
        _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
        outer = np.sort(first[count == 1])
        return every[outer], (outer // len(_FACES)).astype(np.int32)


def rectangle(z: ArrayLike, x: ArrayLike) -> Plan:
    """Return a rectangle with given grid lines.

    Parameters
    ----------
    z, x : array_like, shape (n_z,), (n_x,)
        Coordinates of the grid lines in ascending order, m.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        Fewer than two grid lines, or lines that are not in ascending order.

    See Also
    --------
    holed_rectangle : Rectangle around a round hole.
    extrude : Bricks over a plan.
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
    """Return a rectangle around a round hole: rings of given radii, then layers from the last circle to the edges.

    Parameters
    ----------
    centre : array_like, shape (2,)
        Coordinates z and x of the centre of the hole, m.
    reach : tuple of float
        Distances from the centre to the edges, m: to lower z, to higher z, and along x on both sides.
    radii : sequence of float
        Radius of the hole, then radii of the rings around it, m.
    divisions : int
        Number of quadrilaterals along an edge.
    layers : int
        Number of quadrilaterals from the last circle to the edges, default 1.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        The circles do not grow, or leave the rectangle; numbers of quadrilaterals below 1.

    See Also
    --------
    rectangle : Rectangle without a hole.
    disc : Disc without a hole.
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
    """Return a disc: a square core, layers from the core to the first circle, then rings.

    Parameters
    ----------
    centre : array_like, shape (2,)
        Coordinates z and x of the centre, m.
    radii : sequence of float
        Radii of the circles in ascending order, m.
    divisions : int
        Number of quadrilaterals along a side of the core.
    layers : int
        Number of quadrilaterals from the core to the first circle, default 1.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        The circles do not grow; numbers of quadrilaterals below 1.

    See Also
    --------
    holed_rectangle : Rectangle around a round hole.
    extrude : Bricks over a plan.
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
    """Return points counter-clockwise on the unit circle, and on the square of half side 1."""
    as_count("divisions", divisions)
    along = np.linspace(-1, 1, divisions + 1)[:-1]
    side = np.stack([np.ones(divisions), along], axis=1)
    arc = np.stack([np.cos(np.pi / 4 * along), np.sin(np.pi / 4 * along)], axis=1)
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    quarters = [np.linalg.matrix_power(turn, i) for i in range(4)]
    return np.concatenate([arc @ q for q in quarters]), np.concatenate([side @ q for q in quarters])


def _rings(centre: FloatArray, rows: Sequence[FloatArray]) -> Plan:
    """Return the quadrilaterals between closed rows of points, the innermost first."""
    number = np.arange(len(rows) * len(rows[0])).reshape(len(rows), -1)
    after = np.roll(number, -1, axis=1)
    quads = np.stack([number[:-1], number[1:], after[1:], after[:-1]], axis=-1)
    return Plan(centre + np.concatenate(rows), quads.reshape(-1, 4).astype(np.int32))


def join_plans(*plans: Plan) -> Plan:
    """Return one plan from several; points at the same place are merged.

    Parameters
    ----------
    *plans : Plan
        Plans that touch each other.

    Returns
    -------
    Plan

    See Also
    --------
    extrude : Bricks over several plans.
    """
    points = np.concatenate([p.points for p in plans])
    starts = np.cumsum([0, *(len(p.points) for p in plans[:-1])])
    quads = np.concatenate([p.quads + start for p, start in zip(plans, starts, strict=True)])
    number, kept = _merged(points)
    return Plan(points[kept], number[quads])


def extrude(*parts: tuple[Plan, ArrayLike]) -> Mesh:
    """Return bricks over the quadrilaterals of plans, between heights y; nodes at the same place are merged.

    Parameters
    ----------
    *parts : (Plan, array_like of shape (n_layers + 1,))
        Plan and heights y of the layers of each part of one body; heights ascending, m.

    Returns
    -------
    Mesh
        Mesh of all parts; within a part, the lowest layer comes first.

    Raises
    ------
    ValueError
        Fewer than two heights, or heights that are not in ascending order.

    See Also
    --------
    rectangle, holed_rectangle, disc : Plans.
    jointfrf.workbench.solids.solid.solid_model : Model of a mesh.
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
    """Return the new number of every point, and the old numbers of the points that are kept."""
    pairs = cKDTree(points).query_pairs(_SAME * _extent(points), output_type="ndarray")
    first = np.arange(len(points))
    # The lower number of a pair is kept. All pairs at one place contain its lowest point.
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
    """Return the weights that map displacements of the nodes to displacements of points.

    Parameters
    ----------
    mesh : Mesh
        Mesh of bricks.
    points : array_like, shape (n_points, 3)
        Coordinates x, y, z of points inside bricks or on their faces, m.
    directions : str, sequence of str, or array_like of shape (n_points, 3)
        Directions of the displacements, default "xyz".

        - A string of axes applies to every point: "xyz" gives three rows for each point, point after point.
        - A sequence contains one of "x", "y", "z" for each point.
        - An array contains one vector for each point, which is normalised.
    elements : array_like of int, optional
        Bricks to be searched, counted from 0, such as one of two bodies in contact; all bricks by default.
    tolerance : float
        Largest distance of a point from the bricks, default 1e-6 m. The nearest point of a brick replaces the point.

    Returns
    -------
    csr_array, shape (m, 3 n_nodes)
        Weights of the nodal displacements, one row for each displacement. Multiply them by `SolidModel.expansion` to
        get weights of the DOFs of a model.

    Raises
    ------
    ValueError
        A point that lies off the bricks, an invalid direction.

    See Also
    --------
    jointfrf.workbench.solids.solid.mean_motion : Mean rigid motion of nodes about a point.

    Notes
    -----
    The weights are the trilinear shape functions of the eight nodes. The internal functions of "incompatible" bricks
    are zero at the nodes and are left out. Round faces are replaced by facets, so a hole is slightly narrower than its
    circle between the nodes.

    Examples
    --------
    The centre of the upper face of a brick of 1 x 1 x 2 m depends on the four nodes of this face:

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
    """Return for each point the brick that contains it, as a position in `bricks`, and the weights of its nodes."""
    tree = cKDTree(mesh.nodes[mesh.elements[bricks]].mean(axis=1))
    best = np.zeros(len(places), np.intp)
    weights = np.zeros((len(places), len(_CORNERS)))
    distance = np.full(len(places), np.inf)
    left = np.arange(len(places))
    for count in (min(_FIRST, len(bricks)), len(bricks)):
        for i in left.tolist():
            near = np.atleast_1d(tree.query(places[i], count)[1])
            near = near[near < len(bricks)]  # empty if the distance of a point overflows
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
    """Return shape functions of bricks, shape (n, 8, 3), near the point closest to a place, and its distance."""
    own = np.zeros((len(corners), 3))
    for _ in range(_STEPS):
        factors = 1 + own[:, None, :] * _CORNERS
        functions = factors.prod(axis=2) / 8
        slopes = np.stack([factors[:, :, a] * factors[:, :, b] for a, b in ((1, 2), (0, 2), (0, 1))], axis=2)
        jacobian = np.einsum("enj,eni->eij", slopes * _CORNERS / 8, corners)
        miss = place - np.einsum("en,eni->ei", functions, corners)
        # Iterates are clipped to the brick because the mapping may be singular outside.
        own = np.clip(own + np.linalg.solve(jacobian, miss[:, :, None])[:, :, 0], -1, 1)
    functions = (1 + own[:, None, :] * _CORNERS).prod(axis=2) / 8
    return functions, np.linalg.norm(place - np.einsum("en,eni->ei", functions, corners), axis=1)
