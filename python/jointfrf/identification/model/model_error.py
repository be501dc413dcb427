"""Errors of a model that none of its unknowns describes: of its modal matrices, and of its mode shapes at points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ErrorTerm", "ModalErrors"]

#: Modes up to this multiple of the highest frequency mix with each other; above, only the stiffness may have an error.
_MIXED = 3.0
#: Power of the frequency with which errors of meshes grow beyond the band: 2 by the wave number times the size of solid
#: elements; 4 for beams in bending, whose wave number is proportional to the root of the frequency.
_GROWTH = 2.0
#: Share of the highest frequency below which a mode is a rigid body mode, without a stiffness error.
_RIGID = 1e-3


class ErrorTerm(NamedTuple):
    """An entry of the relative error of a modal matrix, or of the mode shapes at the channels.

    Attributes
    ----------
    matrix : {"K", "M", "P"}
        Stiffness, mass, or mode shapes.
    row, column : int
        Numbers of the modes, row <= column; for mode shapes the number of the DOF, and the mode.
    weight : float
        Standard deviation for a level of 1: 1 for modal stiffnesses and masses in the band, more beyond it.
    """

    matrix: str
    row: int
    column: int
    weight: float


class ModalErrors:
    """Relative errors of the modal stiffness and mass of a part.

    Parameters
    ----------
    k, m : ndarray, shape (r, r)
        Reduced matrices.
    highest : float
        Largest angular frequency measured, rad/s.
    most : int
        Largest number of terms of the matrices, and of the mode shapes.
    ports : ndarray, shape (m, r), optional
        Motion of the DOFs by the coordinates.
    at : sequence of int, optional
        DOFs at which mode shapes have errors: channels that no joint touches.

    Notes
    -----
    In mass-normalised modes K = diag(w_a^2) and M = 1. The errors are symmetric matrices G with independent normal
    entries, as in the Gaussian orthogonal ensemble: K + W G_K W, W = diag(w_a), and M + G_M. Entries on the diagonal
    have twice the variance of further entries. These are random matrices about a mean model [1]_, to first order of the
    dispersion. An error of E, of a section, a mass or a clamp is a realisation of them; rigid bodies stay free. Above
    the band the standard deviation grows with the square of the frequency, up to the ninefold.

    Errors of mode shapes are independent between modes and DOFs, relative to the root mean square of all modes in the
    band at the DOF. They change the residues of single FRFs, as positions of sensors, local flexibility and details of
    the part do, but no natural frequency.

    References
    ----------
    .. [1] C. Soize, A nonparametric model of random uncertainties for reduced matrix models in structural dynamics,
       Probabilistic Engineering Mechanics 15 (2000) 277-294.
    """

    def __init__(
        self, k: FloatArray, m: FloatArray, highest: float, most: int, ports: FloatArray | None = None,
        at: Sequence[int] = (),
    ) -> None:  # fmt: skip
        squared, shapes = linalg.eigh(k, m)
        w = np.sqrt(np.maximum(squared, 0))
        self.of_mass = m @ shapes
        self.of_stiffness = self.of_mass * w
        elastic = [a for a in range(w.size) if w[a] > _RIGID * highest]
        mixed = np.count_nonzero(w < _MIXED * highest)
        pairs = sorted(((a, b) for b in range(mixed) for a in range(b + 1)), key=lambda ab: (ab[1] - ab[0], ab[1]))
        root = np.sqrt(np.clip(w / highest, 1.0, _MIXED) ** _GROWTH)
        first = [ErrorTerm("K", a, a, float(root[a] ** 2)) for a in elastic if a < mixed]
        first += [ErrorTerm("M", a, a, float(root[a] ** 2)) for a in range(mixed)]
        first += [ErrorTerm("K", a, a, float(root[a] ** 2)) for a in elastic if a >= mixed]
        others = [
            ErrorTerm(matrix, a, b, float(np.sqrt(0.5) * root[a] * root[b]))
            for a, b in pairs
            if a != b
            for matrix in "KM"
            if matrix == "M" or a in elastic
        ]
        self.terms = (first + others)[:most]
        self.shape_terms = [ErrorTerm("P", i, a, 1.0) for a in range(mixed) for i in at][:most]
        self._ports = np.zeros((0, len(k))) if ports is None else ports
        self._sizes = np.sqrt(np.mean((self._ports @ shapes[:, :mixed]) ** 2, axis=1))

    def of_ports(self, errors: FloatArray) -> FloatArray:
        """Return the change of the motion of the DOFs for values of all terms of mode shapes, shape (m, r)."""
        change = np.zeros_like(self._ports)
        for term, value in zip(self.shape_terms, errors, strict=True):
            change[term.row] += value * self._sizes[term.row] * self.of_mass[:, term.column]
        return change

    def shape_slopes(
        self, shapes: FloatArray, left: ComplexArray, right: ComplexArray, out: ComplexArray, into: ComplexArray
    ) -> ComplexArray:
        """Return the derivatives by all terms of mode shapes, shape (q, n_freq, n_o, n_i).

        Parameters
        ----------
        shapes, left, right
            Modes and their coordinates, see `slopes`.
        out, into : ndarray, shapes (n_freq, n_o, m), (n_freq, m, n_i)
            Factors of dY = out dH into for the FRFs H between the DOFs.
        """
        turned = shapes.T @ self.of_mass[:, [one.column for one in self.shape_terms]]
        to_left, to_right = left @ turned, turned.T @ right
        rows = [one.row for one in self.shape_terms]
        size = self._sizes[rows][:, None, None, None]
        found = out[:, :, rows].transpose(2, 0, 1)[..., None] * to_right.swapaxes(0, 1)[:, :, None]
        found += to_left.transpose(2, 0, 1)[..., None] * into[:, rows].swapaxes(0, 1)[:, :, None]
        return np.asarray(found * size)

    def changes(self, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the changes of K and M for values of their terms, shape (r, r) each."""
        found = []
        for matrix, own in (("K", self.of_stiffness), ("M", self.of_mass)):
            g = np.zeros((own.shape[1],) * 2)
            for term, value in zip(self.terms, errors, strict=True):
                if term.matrix == matrix:
                    g[term.row, term.column] = g[term.column, term.row] = value
            used = g.any(axis=0)
            found.append(own[:, used] @ g[np.ix_(used, used)] @ own[:, used].T)
        return found[0], found[1]

    def slopes(
        self, shapes: FloatArray, of_k: complex, of_m: FloatArray, left: ComplexArray, right: ComplexArray
    ) -> ComplexArray:
        """Return -left dZ right for all terms, shape (q, n_freq, n_o, n_i).

        Parameters
        ----------
        shapes : ndarray, shape (r, r)
            Modes, of which `left` and `right` are coordinates.
        of_k : complex
            Factor of a change of K in Z: 1 + i eta times its factor.
        of_m : ndarray, shape (n_freq,)
            Factor of a change of M in -Z: w^2 times its factor.
        left, right : ndarray, shapes (n_freq, n_o, r), (n_freq, r, n_i)
            Factors of dZ, in modal coordinates.
        """
        found = np.empty((len(self.terms), of_m.size, left.shape[1], right.shape[2]), np.complex128)
        factors = {"K": np.full(of_m.size, -of_k), "M": of_m + 0j}
        for matrix, own in (("K", self.of_stiffness), ("M", self.of_mass)):
            turned = (shapes.T @ own).astype(complex)
            to_left = (left.reshape(-1, left.shape[2]) @ turned).reshape(*left.shape[:2], -1)
            to_left *= factors[matrix][:, None, None]
            to_right = turned.T @ right
            for i, term in enumerate(self.terms):
                if term.matrix != matrix:
                    continue
                a, b = term.row, term.column
                np.multiply(to_left[:, :, a, None], to_right[:, None, b], out=found[i])
                if a != b:
                    found[i] += to_left[:, :, b, None] * to_right[:, None, a]
        return found
