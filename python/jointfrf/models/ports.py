"""Where a model is driven and observed: single DOFs, or weighted sums of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.kernel.arguments import FloatArray, as_array, as_dofs, as_real

__all__ = ["Ports", "as_ports", "directions"]


@dataclass(eq=False)
class Ports:
    """Responses, or forces, of a model.

    Parameters
    ----------
    n : int
        Number of DOFs.
    picked : ndarray of int, or None
        The DOFs, counted from 1, where each port is one of them.
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
        """Weights of the DOFs for each port, shape (m, n); small models never ask for them."""
        if self.picked is None:
            return cast(sparse.csr_array, self.sums)
        entries = (np.ones(self.picked.size), (np.arange(self.picked.size), self.picked - 1))
        return sparse.csr_array(entries, shape=(self.picked.size, self.n))

    @property
    def needed(self) -> NDArray[np.int32]:
        """DOFs with a weight, ascending, counted from 1; the first where no port has one."""
        found = np.unique(self.weights.indices) if self.weights.nnz else np.zeros(1)
        return found.astype(np.int32) + np.int32(1)

    def of(self, shapes: NDArray[Any]) -> NDArray[Any]:
        """Return the displacements at the ports from those of all DOFs, shape (n, k) to (m, k)."""
        found: NDArray[Any] = self.weights @ shapes if self.picked is None else shapes[self.picked - 1]
        return found

    def forces(self) -> FloatArray:
        """Return unit forces at the ports, shape (n, m)."""
        found: FloatArray = self.weights.T.toarray()
        return found


def as_ports(name: str, value: Any, n: int) -> Ports:
    """Check DOFs counted from 0, or a matrix of weights of shape (m, n); all DOFs for None."""
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
    found: FloatArray = weights[list(rows.values())].T.toarray()
    return found
