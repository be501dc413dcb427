"""Displacements of any points of a mesh of bricks, by the shape functions of the elements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from jointfrf.kernel.arguments import FloatArray, as_number, as_real, check_type
from jointfrf.solids.mesh import Mesh

__all__ = ["interpolation"]

#: Corners of a brick in its own coordinates, in the order of its nodes.
_CORNERS: Final = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], float)
#: Steps of Newton's method in a brick; distorted ones need five.
_STEPS: Final = 12
#: Elements tried for each point, nearest centres first, before all are.
_FIRST: Final = 16


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

    >>> from jointfrf.solids.interpolation import interpolation
    >>> from jointfrf.solids.mesh import extrude, rectangle
    >>> brick = extrude((rectangle([0, 2], [0, 1]), [0, 1]))
    >>> weights = interpolation(brick, [[0.5, 1.0, 1.0]], "y")
    >>> weights.shape, weights.data.tolist()
    ((1, 24), [0.25, 0.25, 0.25, 0.25])
    """
    check_type("mesh", mesh, Mesh)
    places = as_real("points", points, (None, 3))
    if as_number("tolerance", tolerance) < 0:
        raise ValueError(f"tolerance must not be negative, not {tolerance:g} m")
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
        raise ValueError(f"directions must not hold a zero vector, as point {int(length.argmin())} has")
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
