"""In which order the DOFs of a large sparse matrix are eliminated, so that its factors stay small."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from jointfrf.extras import MissingPackageError, import_extra

__all__ = ["elimination_order"]

#: Parts of this many vertices are not cut any more.
_SMALL: Final = 64
#: A cut leaves at least this share of the vertices on either side.
_SHARE: Final = 0.3

Vertices = NDArray[np.intp]


def elimination_order(matrix: sparse.sparray | sparse.spmatrix) -> tuple[Vertices, str]:
    """Order the DOFs of a matrix by nested dissection of its graph.

    Parameters
    ----------
    matrix : sparse array, shape (n, n)
        Only which entries are there counts.

    Returns
    -------
    order : ndarray of int, shape (n,)
        ``matrix[order][:, order]`` has factors of few entries.
    name : {"METIS", "nested dissection"}
        METIS where the package pymetis is installed; else cuts through levels of a breadth-first search, whose factors
        hold about twice as many entries.

    References
    ----------
    .. [1] A. George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973) 345-363.
    .. [2] A. George, J. W. H. Liu, An automatic nested dissection algorithm for irregular finite element problems,
       SIAM J. Numer. Anal. 15 (1978) 1053-1069.
    """
    graph = _graph(matrix)
    try:
        metis = import_extra("pymetis")
    except MissingPackageError:
        metis = None
    if metis is None or not graph.shape[0]:  # METIS fails on a graph of nothing
        return _dissected(graph), "nested dissection"
    order, _ = metis.nested_dissection(metis.CSRAdjacency(graph.indptr, graph.indices))
    return np.asarray(order, np.intp), "METIS"


def _graph(matrix: sparse.sparray | sparse.spmatrix) -> sparse.csr_array:
    """Return the graph of a matrix and its transpose, without loops."""
    entries = sparse.coo_array(matrix)
    row, column = entries.coords
    apart = row != column
    ends = row[apart], column[apart]
    rows, columns = np.concatenate(ends), np.concatenate(ends[::-1])
    graph = sparse.csr_array((np.ones(rows.size), (rows, columns)), shape=entries.shape)
    graph.data[:] = 1
    return graph


def _dissected(graph: sparse.csr_array) -> Vertices:
    """Cut the graph again and again; of each cut both sides come first, and then what separates them."""
    order = np.empty(graph.shape[0], np.intp)
    pending = [(np.arange(graph.shape[0]), 0)] if graph.shape[0] else []
    while pending:
        vertices, start = pending.pop()
        part = sparse.csr_array(graph[vertices][:, vertices])
        sides = _cut(part) if vertices.size > _SMALL else None
        if sides is None:
            order[start : start + vertices.size] = vertices[csgraph.reverse_cuthill_mckee(part, symmetric_mode=True)]
            continue
        low, high, between = sides
        pending += [(vertices[low], start), (vertices[high], start + low.size)]
        order[start + low.size + high.size : start + vertices.size] = vertices[between]
    return order


def _cut(part: sparse.csr_array) -> tuple[Vertices, Vertices, Vertices] | None:
    """Return two sides and what separates them: a small level of distances from a far end; None if there is none."""
    distance = _distances(part, 0)
    near = np.isfinite(distance)
    if not near.all():  # not connected: nothing separates the parts
        return np.flatnonzero(near), np.flatnonzero(~near), np.zeros(0, np.intp)
    for _ in range(2):
        distance = _distances(part, int(distance.argmax()))
    sizes = np.bincount(distance.astype(int))
    below = np.cumsum(sizes) - sizes
    above = part.shape[0] - below - sizes
    levels = np.flatnonzero((below >= _SHARE * part.shape[0]) & (above >= _SHARE * part.shape[0]))
    if not levels.size:
        levels = np.flatnonzero((below > 0) & (above > 0))
        levels = levels[np.argsort(np.maximum(below, above)[levels])[:1]]
    if not levels.size:
        return None
    level = levels[sizes[levels].argmin()]
    # of the level only what touches the far side separates
    touching = np.zeros(part.shape[0], bool)
    touching[part[distance > level].indices] = True
    between = (distance == level) & touching
    return tuple(np.flatnonzero(x) for x in ((distance <= level) & ~between, distance > level, between))  # type: ignore[return-value]


def _distances(part: sparse.csr_array, start: int) -> NDArray[np.float64]:
    """Return the number of edges from one vertex to each; inf where there is no way."""
    found: NDArray[np.float64] = csgraph.dijkstra(part, unweighted=True, indices=start)
    return found
