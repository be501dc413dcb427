"""Matrices of a model as given: sizes, bands, symmetry, kind of damping; and its responses and forces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csc_matrix

from jointfrf.kernel.arguments import FloatArray, as_array, as_dofs, as_real

__all__ = ["Matrix", "ModelMatrices", "Operand", "Ports", "as_ports", "directions", "from_triangle", "is_symmetric"]

Matrix = Any  # array_like or scipy sparse array
Operand = Any  # ndarray or scipy sparse array

#: Difference of two entries, relative to the largest, up to which a matrix is symmetric.
_SYMMETRIC = 1e-10
#: Size up to which sparse matrices are turned into arrays: the overhead of scipy for their entries would exceed the
#: time of the computation.
_SMALL = 64
#: Size up to which products, sums and factors of arrays take no longer than of sparse matrices.
_FULL = 200
#: Difference of entries, relative to the largest, up to which damping is a M + b K.
_PROPORTIONAL = 1e-13


class ModelMatrices:
    """K, M, C, H and the loss factor of a model, checked.

    Parameters
    ----------
    stiffness, mass : array_like or scipy sparse array, shape (n, n)
        Stiffness K, N/m, and mass M, kg.
    damping : array_like or sparse array, shape (n, n), optional
        Viscous damping C, N s/m.
    structural_damping : array_like or sparse array, shape (n, n), optional
        Structural damping H, N/m.
    loss_factor : float
        Loss factor eta of the whole stiffness.

    Attributes
    ----------
    named : dict of str to ndarray, sparse array or None
        Matrices by their names in messages; sparse ones of a small model as arrays.
    n : int
        Number of DOFs.
    """

    def __init__(
        self,
        stiffness: Matrix,
        mass: Matrix,
        damping: Matrix | None,
        structural_damping: Matrix | None,
        loss_factor: float,
    ) -> None:
        self.loss_factor = loss_factor
        self.named: dict[str, Matrix | None] = {
            "stiffness": stiffness,
            "mass": mass,
            "damping": damping,
            "structural_damping": structural_damping,
        }
        n: int | None = None
        for name, given in self.named.items():
            matrix = given
            if matrix is None:
                if name in ("stiffness", "mass"):
                    raise ValueError(f"{name} is missing")
                continue
            is_array = isinstance(matrix, np.ndarray)
            is_sparse = not is_array and sparse.issparse(matrix)
            shape = matrix.shape if is_array or is_sparse else np.shape(matrix)
            if len(shape) != 2 or shape[0] != shape[1] or (n is not None and shape[0] != n):
                wanted = "(n, n)" if n is None else f"({n}, {n})"
                raise ValueError(f"{name} must have shape {wanted}, not {tuple(shape)}")
            self.n = n = int(shape[0])
            if is_sparse and n <= _SMALL:
                matrix, is_sparse = np.ascontiguousarray(matrix.toarray()), False
            if not is_sparse:
                matrix = self.named[name] = as_real(name, matrix, (n, n))
            half = _half(matrix)
            # With a stiffness that is not symmetric, as for rotors or friction, half a matrix may be meant.
            if half is not None and (name == "stiffness" or self.is_symmetric("stiffness")):
                raise ValueError(f"{name} contains its {half} triangle only; complete it by from_triangle")

    def dense(self, name: str) -> FloatArray | None:
        """Return a matrix as an array, shape (n, n); None if the model has none."""
        matrix = self.named[name]
        if matrix is None or isinstance(matrix, np.ndarray):
            return matrix
        return as_real(name, matrix.toarray(), (self.n, self.n))

    def sparse(self, name: str) -> sparse.csc_array:
        """Return a matrix by its entries, shape (n, n); empty if the model has none."""
        matrix = self.named[name]
        if matrix is None:
            return sparse.csc_array((self.n, self.n))
        found = sparse.csc_array(matrix)
        found.sum_duplicates()
        found.data = as_real(name, found.data, (None,))
        return found

    def operand(self, name: str) -> Operand:
        """Return a matrix in the form that is quicker to compute with; zeros if the model has none.

        That is an array, shape (n, n), for few DOFs, whatever was given, and `sparse` for more.
        """
        matrix = self.named[name]
        if self.n > _FULL:
            return self.sparse(name)
        if matrix is None:
            return np.zeros((self.n, self.n))
        return matrix if isinstance(matrix, np.ndarray) else self.sparse(name).toarray()

    def dynamic_stiffness(self, omega: float) -> csc_matrix:
        """Return Z = (1 + i eta) K + i H + i w C - w^2 M by its entries, N/m."""
        k, m, c, h = (self.sparse(name) for name in self.named)
        z = (1 + 1j * self.loss_factor) * k + 1j * h + 1j * omega * c - omega**2 * m
        return csc_matrix(z)

    @cached_property
    def widths(self) -> tuple[int, int]:
        """Number of diagonals below and above the main one, over all matrices."""
        below = above = 0
        for matrix in self.named.values():
            if matrix is not None:
                if sparse.issparse(matrix):
                    entries = sparse.coo_array(matrix)
                    distance = entries.col.astype(np.int64) - entries.row
                else:
                    rows, columns = np.nonzero(matrix)
                    distance = columns - rows
                below = max(below, -int(distance.min(initial=0)))
                above = max(above, int(distance.max(initial=0)))
        return below, above

    def is_symmetric(self, name: str) -> bool:
        """Return whether K or M is symmetric."""
        return is_symmetric(self.operand(name))

    def check_symmetric(self, otherwise: str) -> None:
        """Raise an error unless K and M are symmetric; `otherwise` is the consequence in the message."""
        for name in ("stiffness", "mass"):
            if not self.is_symmetric(name):
                raise ValueError(f"{name} is not symmetric: {otherwise}")

    @property
    def have_real_modes(self) -> bool:
        """Whether K and M are symmetric."""
        return self.is_symmetric("stiffness") and self.is_symmetric("mass")

    @cached_property
    def are_symmetric(self) -> bool:
        """Whether all matrices are symmetric."""
        return all(self.is_symmetric(name) for name, matrix in self.named.items() if matrix is not None)

    @cached_property
    def proportional(self) -> tuple[float, float, float] | None:
        """Coefficients (a, b, eta) if C = a M + b K and all structural damping is eta K, else None; 1/s, s, 1."""
        k, m = self.operand("stiffness"), self.operand("mass")
        viscous = _combination(self.operand("damping"), m, k)
        structural = _combination(self.operand("structural_damping"), 0 * m, k)
        if viscous is None or structural is None:
            return None
        return viscous[0], viscous[1], self.loss_factor + structural[1]


def is_symmetric(matrix: Operand) -> bool:
    """Return whether a matrix is symmetric to rounding."""
    return _is_own_transpose(matrix) or bool(_largest(matrix - matrix.T) <= _SYMMETRIC * _largest(matrix))


def from_triangle(matrix: Matrix) -> Matrix:
    """Return the symmetric matrix of which one triangle, with the diagonal, is given.

    Parameters
    ----------
    matrix : array_like or scipy sparse array, shape (n, n)
        Matrix with an empty second triangle, as finite-element programs write symmetric matrices.

    Returns
    -------
    ndarray or scipy sparse array, shape (n, n)
        Symmetric matrix.

    Raises
    ------
    ValueError
        The matrix is not square, or has entries on both sides of the diagonal.

    See Also
    --------
    Model : a model by its matrices.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.from_triangle([[2.0, 0.0], [-1.0, 2.0]]).tolist()
    [[2.0, -1.0], [-1.0, 2.0]]
    """
    whole = sparse.csc_array(matrix) if sparse.issparse(matrix) else as_array("matrix", matrix)
    if len(whole.shape) != 2 or whole.shape[0] != whole.shape[1]:
        raise ValueError(f"matrix must have shape (n, n), not {tuple(whole.shape)}")
    below, above = _sides(whole)
    if below and above:
        raise ValueError("matrix has entries on both sides of the diagonal; it is whole already")
    if sparse.issparse(whole):
        return whole + whole.T - sparse.diags_array(whole.diagonal())
    return whole + whole.T - np.diag(np.diagonal(whole))


def _is_own_transpose(matrix: Matrix) -> bool:
    """Return whether a matrix is an array that is bit-identical to its transpose, by a quick test."""
    if not isinstance(matrix, np.ndarray):
        return False
    if len(matrix) <= _SMALL and matrix.tobytes() == matrix.tobytes("F"):  # except for zeros of two signs
        return True
    return bool(np.count_nonzero(matrix == matrix.T) == matrix.size)


def _half(matrix: Matrix) -> str | None:
    """Return which triangle of a matrix has entries if the other is empty."""
    if _is_own_transpose(matrix):
        return None
    below, above = _sides(matrix)
    return None if below == above else "lower" if below else "upper"


def _sides(matrix: Matrix) -> tuple[bool, bool]:
    """Return whether a square matrix has entries below, and above its diagonal."""
    if sparse.issparse(matrix):
        entries = sparse.coo_array(matrix)
        at = entries.row[entries.data != 0], entries.col[entries.data != 0]
        return bool((at[0] > at[1]).any()), bool((at[0] < at[1]).any())
    rows, columns = np.nonzero(matrix)
    return bool((rows > columns).any()), bool((rows < columns).any())


def _largest(matrix: Operand) -> float:
    entries = matrix if isinstance(matrix, np.ndarray) else matrix.data
    return float(np.abs(entries).max(initial=0.0))


def _combination(c: Operand, m: Operand, k: Operand) -> tuple[float, float] | None:
    """Return a, b of C = a M + b K; the simplest pair that is valid."""
    if _largest(c) == 0:
        return 0.0, 0.0
    kk, mm, km = (k * k).sum(), (m * m).sum(), (k * m).sum()
    ck, cm = (c * k).sum(), (c * m).sum()
    choices = [(0.0, ck / kk if kk else 0.0), (cm / mm if mm else 0.0, 0.0)]
    if kk * mm - km**2 > 1e-8 * kk * mm:
        choices.append(tuple(np.array([cm * kk - ck * km, ck * mm - cm * km]) / (kk * mm - km**2)))
    for a, b in choices:
        if _largest(c - a * m - b * k) <= _PROPORTIONAL * _largest(c):
            return float(a), float(b)
    return None


@dataclass(eq=False)
class Ports:
    """Responses, or forces, of a model.

    Parameters
    ----------
    n : int
        Number of DOFs.
    picked : ndarray of int, or None
        DOF of each port, counted from 1, if each port is a DOF.
    sums : sparse array, shape (m, n), or None
        Otherwise weights of all DOFs for each port.
    """

    n: int
    picked: NDArray[np.int32] | None = None
    sums: sparse.csr_array | None = None

    def __len__(self) -> int:
        """Return the number of ports."""
        return int(self.weights.shape[0]) if self.picked is None else self.picked.size

    @cached_property
    def weights(self) -> sparse.csr_array:
        """Weights of the DOFs for each port, shape (m, n); not needed for small models."""
        if self.picked is None:
            return cast(sparse.csr_array, self.sums)
        entries = (np.ones(self.picked.size), (np.arange(self.picked.size), self.picked - 1))
        return sparse.csr_array(entries, shape=(self.picked.size, self.n))

    @property
    def needed(self) -> NDArray[np.int32]:
        """DOFs with a weight, ascending, counted from 1; the first if no port has one."""
        found = np.unique(self.weights.indices) if self.weights.nnz else np.zeros(1)
        return found.astype(np.int32) + np.int32(1)

    def of(self, shapes: NDArray[Any]) -> NDArray[Any]:
        """Return the displacements at the ports from displacements of all DOFs, shape (n, k) to (m, k)."""
        return self.weights @ shapes if self.picked is None else shapes[self.picked - 1]

    def forces(self) -> FloatArray:
        """Return unit forces at the ports, shape (n, m)."""
        return np.asarray(self.weights.T.toarray())


def as_ports(name: str, value: Any, n: int) -> Ports:
    """Return ports from DOFs counted from 0, or from a matrix of weights of shape (m, n); all DOFs for None."""
    if value is None:
        return Ports(n, np.arange(1, n + 1, dtype=np.int32))
    is_sparse = sparse.issparse(value)
    numbers = value if is_sparse else as_array(name, value)
    if is_sparse or numbers.ndim == 2:
        given = value if is_sparse else as_real(name, value, (None, None))
        if given.shape[1:] != (n,):
            raise ValueError(f"{name} must be DOFs, or weights of shape (m, {n}), not {tuple(given.shape)}")
        entries = sparse.coo_array(given)
        values = as_real(name, entries.data, (None,))
        weights = sparse.csr_array((values, (entries.row, entries.col)), shape=given.shape)
        weights.eliminate_zeros()
        return Ports(n, sums=weights)
    return Ports(n, as_dofs(name, numbers, n, unique=False))


def directions(*ports: Ports) -> FloatArray:
    """Return unit forces at all of the ports, each DOF or sum once, none without weights, shape (n, k)."""
    weights = sparse.vstack([p.weights for p in ports]).tocsr()
    if all(p.picked is not None for p in ports):
        dofs = np.unique(weights.indices)
        forces = np.zeros((weights.shape[1], dofs.size))
        forces[dofs, np.arange(dofs.size)] = 1
        return forces
    rows = {row.tobytes(): i for i, row in enumerate(weights.toarray()) if row.any()}
    return np.asarray(weights[list(rows.values())].T.toarray())
