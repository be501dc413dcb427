"""K*(w) of a joint as a sum of terms, its compliance, and the derivatives of this by the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import Parameter, ParameterKind, joint_parameters
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert

__all__ = ["Basis", "CrossTerms", "DampingTerms", "JointModel", "joint_basis"]

#: Terms of K* beside its stiffness.
DampingTerms = Literal["none", "viscous", "hysteretic", "both"]
#: Terms that couple the DOFs of a joint: none, and this is used; perhaps, but not sought; fitted.
CrossTerms = Literal["zero", "ignore", "fit"]


class Basis(NamedTuple):
    """K*(w) as a sum of parameters times terms: a function of frequency times a pair of DOFs.

    Attributes
    ----------
    parameters : tuple of Parameter
        All pairs of the first kind, then of the next.
    factors : ndarray, shape (n_kinds, n_freq)
        Function of frequency of each kind: 1, i, i w.
    pairs : ndarray of int, shape (n_pairs, 2)
        Row and column of each entry of K* that is sought; the first n are the diagonal.
    """

    parameters: tuple[Parameter, ...]
    factors: ComplexArray
    pairs: NDArray[np.intp]

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return int(self.pairs.max()) + 1

    def on_lines(self, lines: NDArray[np.intp]) -> Basis:
        """Return the same terms on some of the lines."""
        return self._replace(factors=self.factors[:, lines])

    def of_dofs(self, dofs: NDArray[np.intp]) -> tuple[Basis, NDArray[np.intp]]:
        """Return the terms between some of the DOFs, and which of the parameters these are."""
        inside = np.flatnonzero(np.isin(self.pairs, dofs).all(axis=1))
        which = (np.arange(len(self.factors))[:, None] * len(self.pairs) + inside).ravel()
        pairs = np.searchsorted(dofs, self.pairs[inside])
        return Basis(tuple(self.parameters[i] for i in which), self.factors, pairs), which


def joint_basis(omega: FloatArray, dofs: Sequence[str], damping: DampingTerms, cross: CrossTerms) -> Basis:
    """Return the terms of K*(w) = k + i h + i w c asked for; symmetric cross terms where `cross` is "fit"."""
    factors: dict[ParameterKind, NDArray[np.complexfloating]] = {"k": np.ones(omega.size, np.complex128)}
    if damping in ("hysteretic", "both"):
        factors["h"] = np.full(omega.size, 1j)
    if damping in ("viscous", "both"):
        factors["c"] = 1j * omega
    parameters = joint_parameters(dofs, tuple(factors), cross=cross == "fit")
    place = {dof: i for i, dof in enumerate(dofs)}
    pairs = [(place[one.row], place[one.column]) for one in parameters[: len(parameters) // len(factors)]]
    return Basis(parameters, np.array(list(factors.values())), np.array(pairs, np.intp))


class JointModel:
    """C = K*(theta)^-1 and its derivatives, by elements where K* is diagonal.

    C is symmetric, so that the model has one value for C_ab and C_ba.

    Attributes
    ----------
    n : int
        Number of joint DOFs.
    is_diagonal : bool
        Whether C is diagonal.
    rows, columns : ndarray of int, shape (q,)
        Entries of C that the parameters change: those of the diagonal, or of the upper triangle.
    """

    def __init__(self, basis: Basis) -> None:
        self.basis, self.n = basis, basis.n
        self.is_diagonal = len(basis.pairs) == self.n
        self.rows, self.columns = np.diag_indices(self.n) if self.is_diagonal else np.triu_indices(self.n)

    def compliance(self, theta: FloatArray) -> ComplexArray:
        """Return C of parameters of shape (r, p): its diagonal, shape (r, n_freq, n), or (r, n_freq, n, n)."""
        factors, pairs = self.basis.factors, self.basis.pairs
        values = factors.T @ theta.reshape(len(theta), len(factors), len(pairs))
        if self.is_diagonal:
            with np.errstate(divide="ignore", invalid="ignore"):
                diagonal: ComplexArray = 1 / values
            return diagonal
        k = np.empty((*values.shape[:2], self.n, self.n), np.complex128)
        k[..., pairs[:, 0], pairs[:, 1]] = k[..., pairs[:, 1], pairs[:, 0]] = values
        return invert(k.reshape(-1, self.n, self.n), on_singular="nan").reshape(k.shape)

    def entries(self, compliance: ComplexArray) -> ComplexArray:
        """Return the entries of C that the parameters change, shape (r, n_freq, q)."""
        return compliance if self.is_diagonal else compliance[..., self.rows, self.columns]

    def slope(self, compliance: ComplexArray) -> ComplexArray:
        """Return their derivatives -C B C by each pair of DOFs, shape (r, n_freq, q, n_pairs).

        That by a parameter is this times the function of frequency of its kind.
        """
        if self.is_diagonal:
            return -(compliance**2)[..., None] * np.eye(self.n)
        a, b = self.basis.pairs.T
        left, right = compliance[..., a], -compliance[..., b]  # (..., n, n_pairs); C is symmetric
        slope: ComplexArray = left[..., self.rows, :] * right[..., self.columns, :]
        other = left[..., self.columns, :] * right[..., self.rows, :]
        other[..., a == b] = 0
        slope += other
        return slope
