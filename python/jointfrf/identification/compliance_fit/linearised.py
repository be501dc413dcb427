"""The linearised problem: C of one group of joint DOFs about an estimate of the true FRFs, with its weights."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.noise_estimate import ZERO, own_size
from jointfrf.identification.compliance_fit.joint_terms import Basis, CrossTerms, JointModel
from jointfrf.identification.compliance_fit.least_squares import LeastSquares
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert, solve
from jointfrf.substructuring.compliance import compliance_covariance, compliance_factors, joint_compliance

__all__ = ["DofGroup", "GroupData", "Linearised", "squares_of_lines"]

#: The mean of the neighbours is no estimate of a line from which it differs by more than so many times the noise.
_OUTLIER = 4.0


class GroupData(NamedTuple):
    """What is known of one group of DOFs.

    Attributes
    ----------
    measured : ndarray, shape (r, n_freq, m, m)
        Measured FRFs, m/N.
    initial : ndarray, shape (r, n_freq, m, m)
        FRFs about which is linearised first.
    transform : ndarray, shape (2 n, m)
        From measured points to joint DOFs j, then k.
    variance : ndarray, shape (n_freq, m, m), or None
        E|e|^2 of the measured FRFs for unit level, (m/N)^2; |h|^2 where it is None.
    reciprocal : bool
        Whether the structure is reciprocal.
    cross : {"zero", "ignore", "fit"}
        As in `estimate`.
    basis : Basis
        Terms of K*(w).
    used : ndarray of bool, shape (n_freq, n)
        Lines used for each DOF.
    """

    measured: ComplexArray
    initial: ComplexArray
    transform: FloatArray
    variance: FloatArray | None
    reciprocal: bool
    cross: CrossTerms
    basis: Basis
    used: NDArray[np.bool_]

    def symmetrised(self) -> GroupData:
        """Return the mean of the FRFs and their transposes."""
        measured, initial = ((x + x.swapaxes(-1, -2)) / 2 for x in (self.measured, self.initial))
        return self._replace(measured=measured, initial=initial)

    def without_outliers(self, noise: FloatArray) -> GroupData:
        """Begin with the measured FRFs themselves on lines that differ from their neighbours by more than noise."""
        spread = np.maximum(abs(self.measured) ** 2, ZERO**2 * own_size(self.measured))
        spread = spread if self.variance is None else self.variance
        outlier = (abs(self.initial - self.measured) ** 2 / spread).mean(axis=(2, 3)) > (_OUTLIER * noise[:, None]) ** 2
        return self._replace(initial=np.where(outlier[..., None, None], self.measured, self.initial))

    def of(self, which: NDArray[np.intp]) -> GroupData:
        """Return some of the realisations."""
        return self._replace(measured=self.measured[which], initial=self.initial[which])

    def on_lines(self, lines: NDArray[np.intp]) -> GroupData:
        """Return some of the lines."""
        return self._replace(
            measured=self.measured[:, lines],
            initial=self.initial[:, lines],
            variance=None if self.variance is None else self.variance[lines],
            basis=self.basis.on_lines(lines),
            used=self.used[lines],
        )


class Linearised(NamedTuple):
    """C about an estimate of the true FRFs, C(h) + U (measured - h) V, with its weights; over r and lines.

    Attributes
    ----------
    u, v : ndarray, shapes (r, n_freq, n, m), (r, n_freq, m, n)
    spread : ndarray, shape (r or 1, n_freq, m, m)
        Variance of the measured FRFs for unit level.
    linear : ndarray, shape (r, n_freq, q)
        The entries of C that are used.
    weight : ndarray, shape (r, n_freq, q, q)
        Inverse of their covariance for unit level.
    """

    u: ComplexArray
    v: ComplexArray
    spread: FloatArray
    linear: ComplexArray
    weight: ComplexArray


class DofGroup:
    """One group of DOFs and its equations.

    Attributes
    ----------
    entries : ndarray of int, shape (q,)
        Entries of C that are used, among all n * n.
    modelled : ndarray of int
        Where among these are those that the parameters change.
    off_diagonal, mirrored : ndarray of int
        Of the modelled entries those off the diagonal, and where in C the entries of the other triangle are that
        change with them.
    excluded : ndarray of bool, shape (n_freq, q)
        Entries of C not used on a line.
    """

    def __init__(self, data: GroupData) -> None:
        self.data = data
        self.model = JointModel(data.basis)
        self.r, self.n_freq, self.m = data.measured.shape[:3]
        n = self.model.n
        modelled = self.model.rows * n + self.model.columns
        self.entries = modelled if data.cross == "ignore" else np.arange(n * n)
        self.modelled = np.flatnonzero(np.isin(self.entries, modelled))
        self.off_diagonal = np.flatnonzero(self.model.rows != self.model.columns)
        self.mirrored = self.model.columns[self.off_diagonal] * n + self.model.rows[self.off_diagonal]
        inside = (data.used[:, :, None] & data.used[:, None, :]).reshape(self.n_freq, n * n)
        self.excluded = ~inside[:, self.entries]

    def linearised(self, true: ComplexArray) -> Linearised:
        """Linearise about an estimate of the true FRFs, shape (r, n_freq, m, m)."""
        data, r, n_freq, m = self.data, self.r, self.n_freq, self.m
        t, n = data.transform, self.model.n
        flat = true.reshape(-1, m, m)
        gamma = t @ flat @ t.T
        u, v = compliance_factors(gamma, t)
        if data.variance is None:
            spread = np.maximum(abs(flat) ** 2, ZERO**2 * own_size(flat))
        else:
            spread = np.tile(data.variance, (r, 1, 1))
        covariance = compliance_covariance(gamma, spread, t, reciprocal=data.reciprocal)
        if self.entries.size < n * n:
            covariance = covariance[:, self.entries[:, None], self.entries]
        linear = joint_compliance(gamma) + u @ (data.measured.reshape(-1, m, m) - flat) @ v
        return Linearised(
            u=u.reshape(r, n_freq, n, m),
            v=v.reshape(r, n_freq, m, n),
            spread=spread.reshape(true.shape),
            linear=linear.reshape(r, n_freq, n * n)[..., self.entries],
            weight=_weights(covariance.reshape(r, n_freq, self.entries.size, self.entries.size), self.excluded),
        )

    def _with_mirrored(self, array: NDArray[Any], axis: int) -> NDArray[Any]:
        """Take the modelled entries along an axis, those off the diagonal with their mirror image added."""
        taken = np.take(array, self.modelled, axis)
        if self.off_diagonal.size:
            np.moveaxis(taken, axis, 0)[self.off_diagonal] += np.moveaxis(np.take(array, self.mirrored, axis), axis, 0)
        return taken

    def residual(self, linear: ComplexArray, modelled: ComplexArray) -> ComplexArray:
        """Return the entries of C less those of the model, shape (r, n_freq, q)."""
        residual = linear.copy()
        residual[..., self.modelled] -= modelled
        residual[..., self.mirrored] -= modelled[..., self.off_diagonal]
        return residual

    def least_squares(self, at: Linearised, line_weight: FloatArray | None = None) -> LeastSquares:
        """Return the problem for the parameters; `line_weight`, shape (r, n_freq), between 0 and 1, reduces weights."""
        value = self._with_mirrored(at.linear, 2)
        value[..., self.off_diagonal] /= 2
        other = self.residual(at.linear, value)
        weighted = (at.weight @ other[..., None])[..., 0]
        gradient, squares = self._with_mirrored(weighted, 2), (other.conj() * weighted).real.sum(axis=2)
        weight = self._with_mirrored(self._with_mirrored(at.weight, 3), 2)
        if line_weight is None:
            return LeastSquares(self.model, value, weight, gradient, squares.sum(axis=1), self.equations())
        weight, gradient = weight * line_weight[..., None, None], gradient * line_weight[..., None]
        total = (squares * line_weight).sum(axis=1)
        return LeastSquares(self.model, value, weight, gradient, total, self.equations(line_weight))

    def equations(self, line_weight: FloatArray | None = None) -> FloatArray:
        """Return the number of complex equations, shape (r,)."""
        per_line = np.count_nonzero(~self.excluded, axis=1).astype(float)
        return np.full(self.r, per_line.sum()) if line_weight is None else line_weight @ per_line

    def corrected(self, at: Linearised, residual: ComplexArray) -> ComplexArray:
        """Return the FRFs that the residual implies: measured - S J^H W r, with J dh = U dh V."""
        n, data = self.model.n, self.data
        weighted = np.zeros((self.r, self.n_freq, n * n), np.complex128)
        weighted[..., self.entries] = (at.weight @ residual[..., None])[..., 0]
        back = at.u.conj().swapaxes(-1, -2) @ weighted.reshape(self.r, self.n_freq, n, n) @ at.v.conj().swapaxes(-1, -2)
        if data.reciprocal:
            back = (back + back.swapaxes(-1, -2)) / 2
        corrected = data.measured - at.spread * back
        return (corrected + corrected.swapaxes(-1, -2)) / 2 if data.reciprocal else corrected

    def off_diagonal_equations(self, line_weight: FloatArray) -> FloatArray:
        """Return the number of complex equations off the diagonal of a diagonal joint, shape (r,)."""
        if not self.model.is_diagonal:
            return np.zeros(self.r)
        diagonal = np.count_nonzero(~self.excluded[:, self.modelled], axis=1)
        number: FloatArray = self.equations(line_weight) - line_weight @ diagonal
        return number

    def off_diagonal_squares(self, problem: LeastSquares) -> FloatArray:
        """Squares of the entries of C off the diagonal of a diagonal joint, weighted by their own covariance alone."""
        q = self.modelled.size
        if not self.model.is_diagonal or q == self.entries.size:
            return np.zeros(self.r)
        gradient = problem.other_gradient
        excluded = np.diagonal(problem.weight, axis1=2, axis2=3) == 0
        own = problem.weight + excluded[..., None] * np.eye(q)
        known = solve(own.reshape(-1, q, q), gradient.reshape(-1, q, 1)).reshape(gradient.shape)
        squares: FloatArray = problem.other_squares - (gradient.conj() * known).real.sum(axis=(1, 2))
        return np.maximum(squares, 0)


def squares_of_lines(residual: ComplexArray, weight: ComplexArray) -> FloatArray:
    """Weighted squares of each line, shape (r, n_freq)."""
    squares: FloatArray = (residual.conj() * (weight @ residual[..., None])[..., 0]).real.sum(axis=2)
    return np.maximum(squares, 0)


def _weights(covariance: ComplexArray, excluded: NDArray[np.bool_]) -> ComplexArray:
    """Inverse covariance, zero for the entries excluded."""
    q = covariance.shape[-1]
    # Rows of different units are scaled to one size before the inversion.
    size = np.einsum("rfqq->rfq", covariance).real
    scale = np.where(size > 0, 1 / np.sqrt(np.where(size > 0, size, 1)), 1)
    if excluded.any():
        # An entry excluded gets unit variance and no covariance; its row of the inverse is then dropped.
        scale = np.where(excluded, 0, scale)
        scaled = covariance * (scale[..., :, None] * scale[..., None, :]) + excluded[:, :, None] * np.eye(q)
    else:
        scaled = covariance * (scale[..., :, None] * scale[..., None, :])
    weight: ComplexArray = invert(scaled.reshape(-1, q, q)).reshape(covariance.shape)
    weight *= scale[..., :, None] * scale[..., None, :]
    return weight
