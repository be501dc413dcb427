"""C of one group of joint DOFs, linearised about an estimate of the true FRFs, and what its residual does to these."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.frf_noise import ZERO, own_size
from jointfrf.identification.compliance_fit.joint_terms import Basis, Cross, JointModel
from jointfrf.identification.compliance_fit.least_squares import Task
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert, solve
from jointfrf.substructuring.compliance import compliance_covariance, compliance_factors, joint_compliance

__all__ = ["Data", "Group", "Linearised", "squares_of_lines"]

#: Neighbours that differ by more than so many times the noise are no guess of a line.
_FAR = 4.0


class Data(NamedTuple):
    """What is known of one group of DOFs; the names are those of `estimate`."""

    measured: ComplexArray
    near: ComplexArray
    transform: FloatArray
    variance: FloatArray | None
    reciprocal: bool
    cross: Cross
    basis: Basis
    used: NDArray[np.bool_]

    def made_reciprocal(self) -> Data:
        """Return the mean of h and its transpose."""
        measured, near = ((x + x.swapaxes(-1, -2)) / 2 for x in (self.measured, self.near))
        return self._replace(measured=measured, near=near)

    def near_enough(self, noise: FloatArray) -> Data:
        """Begin with the measured FRFs themselves on lines that differ from their neighbours by more than noise."""
        spread = np.maximum(abs(self.measured) ** 2, ZERO**2 * own_size(self.measured))
        spread = spread if self.variance is None else self.variance
        far = (abs(self.near - self.measured) ** 2 / spread).mean(axis=(2, 3)) > (_FAR * noise[:, None]) ** 2
        return self._replace(near=np.where(far[..., None, None], self.measured, self.near))

    def of(self, which: NDArray[np.intp]) -> Data:
        """Return some of the realisations."""
        return self._replace(measured=self.measured[which], near=self.near[which])

    def on_lines(self, lines: NDArray[np.intp]) -> Data:
        """Return some of the lines."""
        return self._replace(
            measured=self.measured[:, lines],
            near=self.near[:, lines],
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


class Group:
    """One group of DOFs: what its equations are."""

    def __init__(self, data: Data) -> None:
        self.data = data
        self.model = JointModel(data.basis)
        self.r, self.n_freq, self.m = data.measured.shape[:3]
        n = self.model.n
        moved = self.model.rows * n + self.model.columns
        #: Entries of C that are used, among all n * n.
        self.chosen = moved if data.cross == "ignore" else np.arange(n * n)
        #: Where among these are those that the model moves, and those of the other triangle, which move with them.
        self.moved = np.flatnonzero(np.isin(self.chosen, moved))
        self.two = np.flatnonzero(self.model.rows != self.model.columns)
        self.mirrored = self.model.columns[self.two] * n + self.model.rows[self.two]
        inside = (data.used[:, :, None] & data.used[:, None, :]).reshape(self.n_freq, n * n)
        self.blocked = ~inside[:, self.chosen]

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
        if self.chosen.size < n * n:
            covariance = covariance[:, self.chosen[:, None], self.chosen]
        linear = joint_compliance(gamma) + u @ (data.measured.reshape(-1, m, m) - flat) @ v
        return Linearised(
            u=u.reshape(r, n_freq, n, m),
            v=v.reshape(r, n_freq, m, n),
            spread=spread.reshape(true.shape),
            linear=linear.reshape(r, n_freq, n * n)[..., self.chosen],
            weight=_weights(covariance.reshape(r, n_freq, self.chosen.size, self.chosen.size), self.blocked),
        )

    def both(self, array: NDArray[Any], axis: int) -> NDArray[Any]:
        """Take the entries that the model moves, each with its mirror image added, along an axis."""
        taken = np.take(array, self.moved, axis)
        if self.two.size:
            np.moveaxis(taken, axis, 0)[self.two] += np.moveaxis(np.take(array, self.mirrored, axis), axis, 0)
        return taken

    def less(self, linear: ComplexArray, moved: ComplexArray) -> ComplexArray:
        """Return the entries of C less those of the model, shape (r, n_freq, q)."""
        rest = linear.copy()
        rest[..., self.moved] -= moved
        rest[..., self.mirrored] -= moved[..., self.two]
        return rest

    def task(self, at: Linearised, trust: FloatArray | None = None) -> Task:
        """Return the least-squares problem for the parameters; `trust`, shape (r, n_freq), takes weight off lines."""
        value = self.both(at.linear, 2)
        value[..., self.two] /= 2
        other = self.less(at.linear, value)
        weighted = (at.weight @ other[..., None])[..., 0]
        pull, rest = self.both(weighted, 2), (other.conj() * weighted).real.sum(axis=2)
        weight = self.both(self.both(at.weight, 3), 2)
        if trust is None:
            return Task(self.model, value, weight, pull, rest.sum(axis=1), self.equations())
        weight, pull = weight * trust[..., None, None], pull * trust[..., None]
        return Task(self.model, value, weight, pull, (rest * trust).sum(axis=1), self.equations(trust))

    def equations(self, trust: FloatArray | None = None) -> FloatArray:
        """Return the number of complex equations, shape (r,)."""
        per_line = np.count_nonzero(~self.blocked, axis=1).astype(float)
        return np.full(self.r, per_line.sum()) if trust is None else trust @ per_line

    def corrected(self, at: Linearised, residual: ComplexArray) -> ComplexArray:
        """Return the FRFs as the residual moves them: dh = S J^H W r, with J dh = U dh V."""
        n, data = self.model.n, self.data
        pull = np.zeros((self.r, self.n_freq, n * n), np.complex128)
        pull[..., self.chosen] = (at.weight @ residual[..., None])[..., 0]
        back = at.u.conj().swapaxes(-1, -2) @ pull.reshape(self.r, self.n_freq, n, n) @ at.v.conj().swapaxes(-1, -2)
        if data.reciprocal:
            back = (back + back.swapaxes(-1, -2)) / 2
        corrected = data.measured - at.spread * back
        return (corrected + corrected.swapaxes(-1, -2)) / 2 if data.reciprocal else corrected

    def squares_beside(self, task: Task) -> FloatArray:
        """Squares of the entries of C that the model does not move, weighted by their own covariance, shape (r,)."""
        q = self.moved.size
        if not self.model.is_diagonal or q == self.chosen.size:
            return np.zeros(self.r)
        blocked = np.diagonal(task.weight, axis1=2, axis2=3) == 0
        own = task.weight + blocked[..., None] * np.eye(q)
        known = solve(own.reshape(-1, q, q), task.pull.reshape(-1, q, 1)).reshape(task.pull.shape)
        squares: FloatArray = task.rest - (task.pull.conj() * known).real.sum(axis=(1, 2))
        return np.maximum(squares, 0)


def squares_of_lines(residual: ComplexArray, weight: ComplexArray) -> FloatArray:
    """Weighted squares of each line, shape (r, n_freq)."""
    squares: FloatArray = (residual.conj() * (weight @ residual[..., None])[..., 0]).real.sum(axis=2)
    return np.maximum(squares, 0)


def _weights(covariance: ComplexArray, blocked: NDArray[np.bool_]) -> ComplexArray:
    """Inverse covariance, zero for the entries left out."""
    q = covariance.shape[-1]
    # Rows of different units are brought to one size before the inversion.
    size = np.einsum("rfqq->rfq", covariance).real
    scale = np.where(size > 0, 1 / np.sqrt(np.where(size > 0, size, 1)), 1)
    if blocked.any():
        # An entry left out gets unit variance and no covariance; its row of the inverse is then dropped.
        scale = np.where(blocked, 0, scale)
        scaled = covariance * (scale[..., :, None] * scale[..., None, :]) + blocked[:, :, None] * np.eye(q)
    else:
        scaled = covariance * (scale[..., :, None] * scale[..., None, :])
    weight: ComplexArray = invert(scaled.reshape(-1, q, q)).reshape(covariance.shape)
    weight *= scale[..., :, None] * scale[..., None, :]
    return weight
