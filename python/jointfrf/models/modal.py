"""Receptance of a model as a sum over modes; separate rigid-body modes, whose stiffness rounding of K hides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import N_FREQ, RCOND_LIMIT, LineStatus, OnSingular, check_lines, run
from jointfrf.models.factors import SingularMatrixError, SparseSolver, factor
from jointfrf.models.matrices import ModelMatrices, Operand, Ports

__all__ = [
    "SINGULAR",
    "ModalFrfs",
    "Modes",
    "RigidModes",
    "all_modes",
    "find_rigid_modes",
    "mode_condition",
    "no_rigid_modes",
]

#: Reciprocal condition below which a line is singular: a fine mesh in mixed units has 1e-13 and still nine digits.
SINGULAR = _EPS = float(np.finfo(np.float64).eps)
#: Number of roundings of its terms within which r^T K r is zero: an entry of K is a sum of some tens of rounded terms.
_ROUNDINGS = 32
#: Modes are separate if K r loses half of all digits, and w^2 of the next mode is higher by this factor.
_SOFT, _GAP = _EPS**0.5, 100
#: Initial number of modes; the shift of the inverse iteration in roundings, so that the factors of K + shift M keep two
#: digits of a free structure; largest number of iterations, and the change of w^2 at which they end.
_BLOCK, _SHIFT, _ITERATIONS, _SETTLED = 8, 100, 20, 0.1
#: Block size of LAPACK: with less work space it may use fewer columns.
_LAPACK_BLOCK = 64
#: Largest share of the diagonal that entries off it may have in a diagonal modal damping matrix.
_DIAGONAL = 1e-8


@dataclass(frozen=True)
class RigidModes:
    """Modes far below all others: motions without strain, mechanisms, and a structure on its soft suspension.

    Parameters
    ----------
    shapes, momenta : ndarray, shape (n, k)
        Shapes r with unit modal masses, and M r.
    stiffness : ndarray, shape (k,)
        Modal stiffness w_r^2 = r^T K r, (rad/s)^2; 0 if it may be rounding.
    uncertainty : ndarray, shape (k,)
        Possible error of w_r^2, (rad/s)^2, by a rounding of its terms. If w_r^2 was set to zero, the error is its
        original value if this is more than a rounding, else zero.
    """

    shapes: FloatArray
    momenta: FloatArray
    stiffness: FloatArray
    uncertainty: FloatArray

    def __len__(self) -> int:
        """Return the number of modes."""
        return self.stiffness.size

    def dynamic_stiffness(self, matrices: ModelMatrices, omega: FloatArray) -> ComplexArray:
        """Return r^T Z r = w_r^2 (1 + i eta) + i r^T H r + i w r^T C r - w^2, shape (n_freq, k), (rad/s)^2."""
        structural, viscous = (resistance(matrices, x, self.shapes) for x in ("structural_damping", "damping"))
        w = omega[:, None]
        elastic = (1 + 1j * matrices.loss_factor) * self.stiffness
        return np.asarray(elastic + 1j * (structural + w * viscous) - w**2, np.complex128)

    def straining_forces(self, forces: FloatArray) -> FloatArray:
        """Return forces that do not accelerate these modes, b - M r r^T b."""
        return forces - self.momenta @ (self.shapes.T @ forces)

    def strains(self, motion: NDArray[Any]) -> NDArray[Any]:
        """Return motion without its part in these modes, x - r r^T M x."""
        return np.asarray(motion - self.shapes @ (self.momenta.T @ motion))


def no_rigid_modes(n: int) -> RigidModes:
    """Return no rigid-body modes, for a structure of n DOFs that is not free."""
    return RigidModes(np.zeros((n, 0)), np.zeros((n, 0)), np.zeros(0), np.zeros(0))


def resistance(matrices: ModelMatrices, name: str, shapes: FloatArray) -> FloatArray:
    """Return r^T A r of each shape, shape (k,); 0 if it may be rounding of A, or the model has none."""
    if matrices.named[name] is None:
        return np.zeros(shapes.shape[1])
    matrix = matrices.operand(name)
    found = np.einsum("ij,ij->j", shapes, matrix @ shapes)
    return np.where(abs(found) <= _ROUNDINGS * _EPS * _terms(abs(matrix), shapes), 0, found)


def mode_condition(dynamic_stiffness: ComplexArray, uncertainty: FloatArray) -> FloatArray:
    """Return the reciprocal condition of lines, shape (n_freq,), from r^T Z r of modes that rounding may hide.

    eps / rcond is the relative change of a mode by the uncertainty of its w_r^2; 0 if no stiffness resists the mode.
    """
    left = abs(dynamic_stiffness)
    rcond = np.divide(_EPS * left, uncertainty, out=np.ones_like(left), where=uncertainty > 0)
    return np.asarray(np.where(left > 0, rcond, 0).min(axis=1, initial=1.0))


def find_rigid_modes(k: Operand, m: Operand, solver: SparseSolver | None = None) -> RigidModes:
    """Return the modes whose stiffness rounding hides, by inverse iteration of a block of vectors.

    Parameters
    ----------
    k, m : ndarray or sparse array, shape (n, n)
        Symmetric stiffness and mass, both of one kind.
    solver : SparseSolver, optional
        Solver that is also used for other sparse matrices of this pattern.

    Returns
    -------
    RigidModes
        Separate modes. Empty if the structure is not free, if M has no mass in a motion that K does not resist, or if
        no gap separates them from the modes above.

    Notes
    -----
    Subspace iteration with a shift [1]_: (K + s M)^-1 M on a block of vectors, and its Ritz values. The shift s is 100
    roundings of the mean of the terms of w^2. The factors thus exist even if K is singular, and every other mode
    decreases by s / w^2 in an iteration. Rounding of the entries of K may change w_r^2 by eps |r|^T |K| |r|, for any
    units of its rows [2]_. Below some of these roundings w_r^2 is set to zero, and the structure is free in r. The
    result does not depend on the modes that the forces reach, or on the order of sums of a processor.

    Cost: a factorisation of a real matrix of the structure of K, and 8 solutions with it in each of 3 to 5 iterations;
    less than one of the shifts of a reduction.

    References
    ----------
    .. [1] B. N. Parlett, The Symmetric Eigenvalue Problem, SIAM, 1998, ch. 14: subspace iteration, Rayleigh-Ritz.
    .. [2] N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM, 2002, sec. 7.2: componentwise
       condition.
    """
    n, magnitudes = k.shape[0], abs(k)
    size = min(_BLOCK, n)
    while True:
        found = _lowest_modes(k, magnitudes, m, size, solver)
        if found is None:
            return no_rigid_modes(n)
        squared, shapes, terms = found
        known = np.maximum(squared, _EPS * terms)
        soft = np.logical_and.accumulate(known <= _SOFT * terms)
        if size == n or not soft.all():
            break
        size = min(2 * size, n)
    above = np.full(size, np.inf if size == n else 0.0)
    above[:-1] = known[1:]
    apart = np.flatnonzero(soft & (above >= _GAP * known))
    count = apart[-1] + 1 if apart.size else 0
    if not count:
        return no_rigid_modes(n)
    # separate again from higher modes, whose w^2 is large enough to spoil the last digits of these
    squared, shapes, terms = _ritz(k, magnitudes, m, shapes[:, :count])
    rounding = _EPS * terms
    free = squared <= _ROUNDINGS * rounding
    uncertainty = np.where(free, np.where(squared <= rounding, 0, squared), rounding)
    return RigidModes(shapes, m @ shapes, np.where(free, 0, squared), uncertainty)


def _lowest_modes(
    k: Operand, magnitudes: Operand, m: Operand, size: int, solver: SparseSolver | None
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return w^2, shapes (n, size) and the terms of w^2 of the lowest modes; None if K + s M is singular."""
    masses = m.diagonal()
    with_mass = masses > 0
    unit = np.sqrt(np.divide(1, masses, out=np.zeros_like(masses), where=with_mass))  # unit mass in every DOF
    mean = float(unit @ (magnitudes @ unit)) / max(1, int(with_mass.sum())) or 1.0
    scale = np.sqrt(masses + magnitudes.diagonal() / mean) if (masses >= 0).all() else np.zeros(0)
    if not scale.all() or not scale.size:
        return None
    shifted = k + (_SHIFT * _EPS * mean) * m
    try:
        factors = factor(shifted) if solver is None else solver.factor(shifted)
    except SingularMatrixError:
        return None
    shapes = np.random.default_rng(0).standard_normal((k.shape[0], size)) / scale[:, None]
    last = np.full(size, np.inf)
    for _ in range(_ITERATIONS):
        try:
            basis = orthonormal(scale[:, None] * factors.solve(m @ shapes)) / scale[:, None]
            squared, shapes, terms = _ritz(k, magnitudes, m, basis)
        except np.linalg.LinAlgError:  # no mass in some motion
            return None
        if ((squared <= _ROUNDINGS * _EPS * terms) | (squared >= (1 - _SETTLED) * last)).all():
            break
        last = squared
    return squared, shapes, terms


def _ritz(k: Operand, magnitudes: Operand, m: Operand, basis: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Ritz values of a space, Ritz vectors with unit modal masses, and the terms of the values."""
    squared, mixed = eigh(basis.T @ (k @ basis), basis.T @ (m @ basis))
    shapes = basis @ mixed
    return squared, shapes, _terms(magnitudes, shapes)


def _terms(magnitudes: Operand, shapes: FloatArray) -> FloatArray:
    """Return |r|^T |A| |r| of each shape, shape (k,), from |A|."""
    lengths = abs(shapes)
    return np.asarray(np.einsum("ij,ij->j", lengths, magnitudes @ lengths))


def eigh(k: FloatArray, m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return w^2, ascending, and shapes of unit modal mass of K x = w^2 M x; the lower triangles are read.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite, an entry is not finite, or there is no convergence.
    """
    _check_finite(k, m)
    squared, shapes, info = lapack.dsygvd(k, m, uplo="L")
    if info:
        raise np.linalg.LinAlgError(f"dsygvd: info {info}")
    return squared, shapes


def orthonormal(a: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the columns, shape (n, k), k <= n.

    Raises
    ------
    numpy.linalg.LinAlgError
        An entry is not finite.
    """
    _check_finite(a)
    n_work = _LAPACK_BLOCK * a.shape[1]
    reflectors, scales, _, _ = lapack.dgeqrf(a, lwork=n_work)
    return np.asarray(lapack.dorgqr(reflectors, scales, lwork=n_work)[0])


def _check_finite(*arrays: FloatArray) -> None:
    for array in arrays:
        if np.count_nonzero(np.isfinite(array)) != array.size:
            raise np.linalg.LinAlgError("an entry is NaN or Inf")


@dataclass(frozen=True)
class Modes:
    """Modes with unit modal masses.

    Parameters
    ----------
    stiffness : ndarray, shape (n_modes,)
        Modal stiffness w_r^2, (rad/s)^2.
    damping : ndarray, shape (n_modes,)
        Viscous modal damping 2 zeta w_r, rad/s.
    loss_factor : ndarray, shape (n_modes,)
        Loss factor eta of each mode.
    shapes_out, shapes_in : ndarray, shape (n_out, n_modes), (n_in, n_modes)
        Shapes at responses and forces, 1/sqrt(kg).
    uncertainty : ndarray, shape (n_modes,)
        Uncertainty of w_r^2 by rounding of K, (rad/s)^2, for modes that it may hide, see `RigidModes`; else 0.
    """

    stiffness: FloatArray
    damping: FloatArray
    loss_factor: FloatArray
    shapes_out: FloatArray
    shapes_in: FloatArray
    uncertainty: FloatArray

    def receptance(self, freq_hz: FloatArray, on_singular: OnSingular, out: ComplexArray | None = None) -> ComplexArray:
        """Return the sum of phi phi^T / (w_r^2 (1 + i eta) - w^2 + i w c) over the modes.

        Returns
        -------
        ndarray, shape (n_freq, n_out, n_in)
            Receptances, m/N.
        """
        result, status = self.lines(freq_hz, on_singular, out)
        check_lines("receptance", status, {}, freq_hz, "nan", RCOND_LIMIT)
        return result

    def lines(
        self, freq_hz: FloatArray, on_singular: OnSingular, out: ComplexArray | None = None
    ) -> tuple[ComplexArray, LineStatus]:
        """Return the sum and the status of each line; lines that are ill-conditioned give no warning yet.

        The reciprocal condition of a line includes all modes if it is below the machine's precision. Otherwise
        eps / rcond is the relative change of a mode by its uncertainty.
        """
        shape = (freq_hz.size, self.shapes_out.shape[0], self.shapes_in.shape[0])
        omega = 2 * np.pi * freq_hz
        args = (
            self.stiffness.size,
            N_FREQ,
            *shape[1:],
            omega,
            self.stiffness,
            self.damping,
            self.loss_factor,
            np.ascontiguousarray(self.shapes_out),
            np.ascontiguousarray(self.shapes_in),
        )
        result, line_info, found = run(
            "receptance_modal", args, shape, {"omega": omega}, freq_hz, on_singular, 0.0, out
        )
        rcond = np.where(found < SINGULAR, found, 1.0)
        known = self.uncertainty > 0
        complex_stiffness = self.stiffness[known] * (1 + 1j * self.loss_factor[known])
        left = complex_stiffness + omega[:, None] * (1j * self.damping[known] - omega[:, None])
        rcond = np.minimum(rcond, mode_condition(left, self.uncertainty[known]))
        return result, LineStatus(line_info, rcond)


def all_modes(matrices: ModelMatrices, outputs: Ports, inputs: Ports) -> tuple[Modes, RigidModes]:
    """Return all modes of a model whose damping does not couple them, and the rigid-body modes among them.

    Raises
    ------
    ValueError
        K or M is not symmetric, M is not positive definite, or damping couples the modes.

    Notes
    -----
    An eigenvalue solver gives every w^2 within rounding of the largest one. Rigid-body modes, and modes of a soft
    suspension, are therefore computed separately, see `find_rigid_modes`.
    """
    matrices.check_symmetric("method 'modal' cannot be used, 'dense' or 'sparse' can")
    k, m = matrices.dense("stiffness"), matrices.dense("mass")
    assert k is not None
    assert m is not None
    try:
        squared, shapes = eigh(k, m)
    except np.linalg.LinAlgError as error:
        raise ValueError("mass is not positive definite; use another method than 'modal'") from error
    rigid = find_rigid_modes(matrices.operand("stiffness"), matrices.operand("mass"))
    shapes = np.hstack([rigid.shapes, rigid.strains(shapes[:, len(rigid) :])])
    stiffness = np.concatenate([rigid.stiffness, np.maximum(squared[len(rigid) :], 0)])
    uncertainty = np.concatenate([rigid.uncertainty, np.zeros(matrices.n - len(rigid))])

    def modal(name: str) -> FloatArray:
        matrix = matrices.dense(name)
        if matrix is None:
            return np.zeros(matrices.n)
        projected = shapes.T @ matrix @ shapes
        diagonal = np.diagonal(projected).copy()
        rest = abs(projected - np.diag(diagonal)).max(initial=0)
        if rest > _DIAGONAL * abs(diagonal).max(initial=0):
            raise ValueError(f"{name} couples the modes, which 'modal' cannot do; use method 'dense' or 'sparse'")
        return diagonal

    structural = modal("structural_damping")
    alone = resistance(matrices, "structural_damping", rigid.shapes)
    structural[: len(rigid)] = alone
    stiffness[: len(rigid)] = np.where(rigid.stiffness > 0, rigid.stiffness, SINGULAR * alone)  # resisted by H alone
    losses = matrices.loss_factor + np.divide(structural, stiffness, out=np.zeros(matrices.n), where=stiffness > 0)
    modes = Modes(stiffness, modal("damping"), losses, outputs.of(shapes), inputs.of(shapes), uncertainty)
    return modes, rigid


@dataclass(frozen=True, eq=False)
class ModalFrfs:
    """Modes of a structure between n DOFs, in SI units.

    Attributes
    ----------
    dofs : tuple of str, length n
        Names of the DOFs.
    poles : ndarray, shape (m,)
        Poles s of the upper half plane, rad/s.
    shapes : ndarray, shape (n, m)
        Shapes psi, scaled so that the residues are psi psi^T.
    rigid : ndarray, shape (n, k)
        Motions at 0 Hz, phi / sqrt(modal mass).
    lower, upper : ndarray, shape (n, n)
        Residuals L and U of modes below and above the band, N^-1 m s^-2 and m/N.

    Notes
    -----
    H = sum_r psi_r psi_r^T / (i w - s_r) + the same of complex conjugates - (phi phi^T + L) / w^2 + U.
    """

    dofs: tuple[str, ...]
    poles: ComplexArray
    shapes: ComplexArray
    rigid: FloatArray
    lower: FloatArray
    upper: FloatArray

    def receptance(self, freq_hz: FloatArray, at: Sequence[int]) -> ComplexArray:
        """Return the receptances between DOFs, counted from 0, on lines above 0 Hz; shape (n_freq, m, m), m/N."""
        omega = 2 * np.pi * freq_hz[:, None]
        own = np.asarray(at, np.intp)
        h = np.zeros((freq_hz.size, own.size, own.size), np.complex128)
        for poles, shapes in ((self.poles, self.shapes[own]), (self.poles.conj(), self.shapes[own].conj())):
            h += np.einsum("pm,fm,qm->fpq", shapes, 1 / (1j * omega - poles), shapes, optimize=True)
        low = self.rigid[own] @ self.rigid[own].T + self.lower[np.ix_(own, own)]
        return h - low / omega[:, :, None] ** 2 + self.upper[np.ix_(own, own)]

    def with_residuals(self, freq_hz: FloatArray, h: ComplexArray, at: Sequence[int]) -> ModalFrfs:
        """Return the same with L and U of measured FRFs, by least squares of relative errors.

        Parameters
        ----------
        freq_hz : ndarray, shape (n_freq,)
            Frequencies, Hz, above 0.
        h : ndarray, shape (n_freq, k, k)
            Receptances, m/N; NaN if not measured: then h_qp replaces h_pq, or there are no residuals.
        at : sequence of int
            Numbers of their DOFs.
        """
        lower, upper = self.lower.copy(), self.upper.copy()
        left = h - self.receptance(freq_hz, at)
        terms = np.stack([-1 / (2 * np.pi * freq_hz) ** 2, np.ones(freq_hz.size)], axis=1)
        for p, a in enumerate(at):
            for q, b in enumerate(at[: p + 1]):
                found = [(left[:, i, j], abs(h[:, i, j])) for i, j in {(p, q), (q, p)} if np.isfinite(h[:, i, j]).all()]
                if not found:
                    continue
                rows = np.concatenate([terms / size[:, None] for _, size in found])
                sides = np.concatenate([own.real / size for own, size in found])
                scale = np.linalg.norm(rows, axis=0)
                low, high = np.linalg.lstsq(rows / scale, sides, rcond=None)[0] / scale
                lower[a, b] = lower[b, a] = self.lower[a, b] + low
                upper[a, b] = upper[b, a] = self.upper[a, b] + high
        return replace(self, lower=lower, upper=upper)
