"""Factors of matrices: the only interface to SuperLU, PARDISO, MUMPS and METIS, and to LAPACK for few DOFs."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse import csgraph
from scipy.sparse import linalg as sparse_linalg

from jointfrf.extras import MissingPackageError, import_extra
from jointfrf.kernel.arguments import FloatArray

__all__ = ["SYMMETRIC", "Factors", "SingularMatrixError", "SparseSolver", "elimination_order", "factor"]

Library = Literal["SuperLU", "PARDISO", "MUMPS"]
Array = NDArray[Any]

#: SuperLU on a matrix of symmetric structure: less fill than ordered by columns, pivots from the diagonal where good.
SYMMETRIC: Final[dict[str, Any]] = {
    "permc_spec": "MMD_AT_PLUS_A",
    "diag_pivot_thresh": 0.01,
    "options": {"SymmetricMode": True},
}
#: Number of DOFs from which on an order by dissection has smaller factors than one by minimum degree.
_DISSECTED: Final = 4_000
#: Number of DOFs from which on another library, if installed, is faster including its start-up.
_LARGE: Final = 20_000
#: Number of vertices below which a part is not cut.
_SMALL: Final = 64
#: Least share of the vertices on either side of a cut.
_SHARE: Final = 0.3
Vertices = NDArray[np.intp]


class SingularMatrixError(ArithmeticError):
    """A pivot of a factorisation is zero."""


@dataclass(frozen=True)
class Factors:
    """A factored matrix.

    Parameters
    ----------
    solver : callable
        Function of right-hand sides of the matrix's type, shape (n, k), and "N" or "H"; returns solutions.
    is_complex : bool
        Whether the matrix is complex.
    name : str
        Library and order of elimination.
    """

    solver: Callable[[Array, str], Array]
    is_complex: bool
    name: str

    def solve(self, b: Array, trans: Literal["N", "H"] = "N") -> Array:
        """Return x of A x = b, or A^H x = b; shape (n,) or (n, k); right-hand sides of a real matrix may be complex."""
        columns = b.reshape(b.shape[0], -1)
        if self.is_complex or not np.iscomplexobj(b):
            found = self.solver(columns.astype(np.complex128 if self.is_complex else np.float64), trans)
        else:
            both = self.solver(np.hstack([columns.real, columns.imag]), trans)
            found = both[:, : columns.shape[1]] + 1j * both[:, columns.shape[1] :]
        return found.reshape(b.shape)


class SparseSolver:
    """Factors matrices of one pattern, whose order of elimination is computed once.

    Parameters
    ----------
    library : {"SuperLU", "PARDISO", "MUMPS"}, optional
        Library; by default the fastest suitable one. For symmetric matrices of 20 000 DOFs or more this is PARDISO
        (package pypardiso; real ones only) or MUMPS (package python-mumps) if installed, else SuperLU.
    """

    def __init__(self, library: Library | None = None) -> None:
        self.library = library
        #: Library and order of elimination of the last factorisation.
        self.used = ""
        self._order: tuple[NDArray[np.intp], str] | None = None

    def factor(self, matrix: Any, is_symmetric: bool = True) -> Factors:
        """Return the factors of a matrix.

        Parameters
        ----------
        matrix : sparse array, shape (n, n)
            Real or complex matrix with the pattern of the earlier ones.
        is_symmetric : bool
            Whether A = A^T; PARDISO and MUMPS take one triangle and are used for symmetric matrices only.

        Raises
        ------
        SingularMatrixError
            A pivot is exactly zero.
        """
        factors = self._by_library(matrix, is_symmetric) or self._by_superlu(matrix)
        self.used = factors.name
        return factors

    def _by_library(self, matrix: Any, is_symmetric: bool) -> Factors | None:
        """Return factors by another library, if one is suitable."""
        for library in self._choices(matrix, is_symmetric):
            try:
                return _MAKERS[library](matrix)
            except (MissingPackageError, _NotFactoredError):
                if self.library is not None:
                    raise
        return None

    def _choices(self, matrix: Any, is_symmetric: bool) -> list[Library]:
        """Return the libraries to try before SuperLU, best first."""
        able: list[Library] = ["MUMPS"] if np.iscomplexobj(matrix) else ["PARDISO", "MUMPS"]
        if not is_symmetric or (self.library is None and matrix.shape[0] < _LARGE):
            return []
        return able if self.library is None else [name for name in able if name == self.library]

    def _by_superlu(self, matrix: Any) -> Factors:
        """Return factors by SuperLU; large matrices are ordered by dissection."""
        if matrix.shape[0] < _DISSECTED:
            own = _superlu(sparse.csc_matrix(matrix), **SYMMETRIC)
            return Factors(lambda b, trans: own.solve(b, trans=trans), np.iscomplexobj(matrix), "SuperLU")
        if self._order is None:
            self._order = elimination_order(matrix)
        order, name = self._order
        by_rows = sparse.csr_array(matrix)[order]
        permuted = sparse.csc_matrix(sparse.csc_array(by_rows)[:, order])
        permuted.sort_indices()
        factors = _superlu(permuted, **(SYMMETRIC | {"permc_spec": "NATURAL"}))

        def solve(b: Array, trans: str) -> Array:
            x = np.empty_like(b)
            x[order] = factors.solve(np.asfortranarray(b[order]), trans=trans)
            return x

        return Factors(solve, np.iscomplexobj(matrix), f"SuperLU, ordered by {name}")


def factor(matrix: Any, is_symmetric: bool = True) -> Factors:
    """Return the factors of one matrix: a real array by LAPACK, a sparse one like `SparseSolver.factor`."""
    return _by_lapack(matrix) if isinstance(matrix, np.ndarray) else SparseSolver().factor(matrix, is_symmetric)


class _NotFactoredError(RuntimeError):
    """A library failed, because of memory or of the matrix: SuperLU is used."""


def _superlu(matrix: sparse.csc_matrix, **options: Any) -> sparse_linalg.SuperLU:
    try:
        return sparse_linalg.splu(matrix, **options)
    except RuntimeError as error:
        raise SingularMatrixError("a pivot is zero") from error


def _by_lapack(matrix: FloatArray) -> Factors:
    """Return the factors of a real array."""
    lu, pivots, info = lapack.dgetrf(matrix)
    if info > 0:
        raise SingularMatrixError("a pivot is zero")

    def solve(b: Array, trans: str) -> Array:
        found: Array = lapack.dgetrs(lu, pivots, b, trans=trans == "H")[0]
        return found

    return Factors(solve, False, "LAPACK")


def _imported(module: str) -> Any:
    try:
        return import_extra(module)
    except MissingPackageError:
        raise
    except ImportError as error:  # a library to which it is linked is missing
        raise _NotFactoredError(str(error)) from error


def _upper_half(matrix: Any) -> sparse.csr_matrix:
    half = sparse.csr_matrix(sparse.triu(matrix, format="csr"))
    half.sort_indices()
    return half


def _by_pardiso(matrix: Any) -> Factors:
    """Return the factors of half of a real symmetric matrix by PARDISO of MKL."""
    wrapper = _imported("pypardiso").pardiso_wrapper
    half = _upper_half(matrix)
    try:
        solver = wrapper.PyPardisoSolver(mtype=-2)  # real, symmetric, indefinite
        solver.factorize(half)
    except (ImportError, wrapper.PyPardisoError, ValueError) as error:  # no library, no memory, a row of zeros
        raise _NotFactoredError(str(error)) from error

    def solve(b: Array, _: str) -> Array:
        found: Array = solver.solve(half, b)
        return found

    weakref.finalize(solve, solver.free_memory, everything=True)  # memory of the library
    return Factors(solve, False, "PARDISO")


def _by_mumps(matrix: Any) -> Factors:
    """Return the factors of half of a symmetric matrix, real or complex, by MUMPS."""
    mumps = _imported("mumps")
    context = mumps.Context()
    try:
        context.set_matrix(matrix, symmetric=True)
        context.factor()
    except mumps.MUMPSError as error:
        raise _NotFactoredError(str(error)) from error

    def solve(b: Array, trans: str) -> Array:
        if trans == "H" and np.iscomplexobj(b):  # A^H is the conjugate of A = A^T
            return np.asarray(context.solve(b.conj())).conj()
        return np.asarray(context.solve(b))

    return Factors(solve, np.iscomplexobj(matrix), "MUMPS")


#: Libraries that are tried before SuperLU.
_MAKERS: Final[dict[Library, Callable[[Any], Factors]]] = {"PARDISO": _by_pardiso, "MUMPS": _by_mumps}


def elimination_order(matrix: sparse.sparray | sparse.spmatrix) -> tuple[Vertices, str]:
    """Return the order of the DOFs of a matrix by nested dissection of its graph.

    Parameters
    ----------
    matrix : sparse array, shape (n, n)
        Matrix, of which only the pattern of entries counts.

    Returns
    -------
    order : ndarray of int, shape (n,)
        Order in which ``matrix[order][:, order]`` has factors of few entries.
    name : {"METIS", "nested dissection"}
        Method: METIS if the package pymetis is installed; else cuts through levels of a breadth-first search, whose
        factors have about twice as many entries.

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
    if metis is None or not graph.shape[0]:  # METIS fails on an empty graph
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
    """Return an order by repeated cuts of the graph: both sides of a cut first, then the separator."""
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
    """Return two sides and their separator: a small level of distances from a far end; None if there is none."""
    distance = _distances(part, 0)
    near = np.isfinite(distance)
    if not near.all():  # not connected: no separator is needed
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
    # only the vertices of the level that touch the far side separate
    touching = np.zeros(part.shape[0], bool)
    touching[part[distance > level].indices] = True
    between = (distance == level) & touching
    return tuple(np.flatnonzero(x) for x in ((distance <= level) & ~between, distance > level, between))  # type: ignore[return-value]


def _distances(part: sparse.csr_array, start: int) -> NDArray[np.float64]:
    """Return the number of edges from one vertex to each; inf if there is no path."""
    return np.asarray(csgraph.dijkstra(part, unweighted=True, indices=start))
