"""Rational Krylov reduction of a model with one loss factor or proportional damping, with an error estimate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.kernel.call import RCOND_LIMIT
from jointfrf.models.factors import Factors, SingularMatrixError, SparseSolver
from jointfrf.models.matrices import ModelMatrices, Ports, directions
from jointfrf.models.modal import Modes, RigidModes, find_rigid_modes, no_rigid_modes

__all__ = ["reduce_model", "spot_error"]

#: Ratio of the rounding of modes of a reduced model to the rounding of a direct solution, limited by the rounding of a
#: solution with the smallest reciprocal condition that gives no warning: four digits.
_LOSS: Final = 30
_MOST_ROUNDING: Final = float(np.finfo(np.float64).eps) / RCOND_LIMIT
#: Number of steps of the iteration; share of the previous step above which a step has reached rounding, if it is also
#: below this share of the solution.
_STEPS, _SHRINKS, _ROUNDED = 12, 0.5, 1e-6
#: Number of initial shifts; of solutions at each for every force, and in all: few forces need more of them.
_FIRST_SHIFTS, _MOMENTS, _VECTORS = 1, 4, 40
#: Largest number of shifts, and of vectors as a share of the DOFs.
_MOST_SHIFTS, _MOST_VECTORS = 40, 0.5
#: Error below which a refinement that gains less than a factor of three has reached the round-off of the model.
_NEAR = 1e-4
#: Relative size of a direction below which it is not new.
_NEW_DIRECTION = 1e-12
#: Number of lines whose residual is computed, and of lines that are solved directly.
_CANDIDATES, _SPOTS = 40, 4
#: Number of DOFs from which on solutions of the whole model at these lines use iteration instead of factors of a line;
#: and from which on they still cost as much as the rest, so that only the worst line is compared.
_ITERATED, _LARGE, _FEW_SPOTS = 2_000, 10_000, 1


@dataclass(frozen=True)
class TwoLevels:
    """Solutions of a large model by real factors at one shift and by the modes of its reduced model.

    Parameters
    ----------
    shift : float
        Shift s, (rad/s)^2.
    factors : Factors
        Factors of K - s M.
    modes : Modes
        Modes of the reduced model, including rigid-body modes.
    shapes : ndarray, shape (n, n_modes)
        Shapes of the modes, 1/sqrt(kg).
    n_rigid : int
        Number of rigid-body modes, which come first: solutions do not contain them.
    tolerance : float
        Share of the solution below which the difference to the reduced model ends the iteration.

    Notes
    -----
    Let Z = alpha K - beta M, and P = K - s M. A step adds P^-1 r / alpha of the residual r. This multiplies an error in
    mode r by (beta/alpha - s) / (w_r^2 - s), which is small for modes above the band. The step then adds the
    contribution of the modes of the reduced model to the residual, which removes the error in these modes. The fixed
    point is the solution of the whole model for any reduced model, whose quality only sets the speed of convergence
    [1]_. A complex factorisation takes four times as long as the factorisation of P and twice its memory.

    References
    ----------
    .. [1] Y. Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., SIAM, 2003, sec. 13.4: two-grid cycles.
    """

    shift: float
    factors: Factors
    modes: Modes
    shapes: FloatArray
    n_rigid: int
    tolerance: float

    def solve(
        self, matrices: ModelMatrices, omega: float, forces: ComplexArray, outputs: Ports
    ) -> tuple[ComplexArray, ComplexArray] | None:
        """Return the solution of Z x = b.

        Returns
        -------
        x : ndarray, shape (n, n_forces)
            Solution.
        step : ndarray, shape (n_out, n_forces)
            Last step at the responses, which is rounding; zeros if the tolerance was met before.
        None
            The iteration does not converge.
        """
        assert matrices.proportional is not None
        _, b, eta = matrices.proportional
        alpha = 1 + 1j * eta + 1j * omega * b
        z = matrices.dynamic_stiffness(omega)
        x = self._coarse(omega, forces)
        start, before = outputs.of(x), np.inf
        for _ in range(_STEPS):
            smooth = self.factors.solve(forces - z @ x) / alpha
            x = x + smooth
            coarse = self._coarse(omega, forces - z @ x)
            x = x + coarse
            seen, step = outputs.of(x), outputs.of(smooth + coarse)
            length, size = abs(step).max(initial=0), abs(seen).max(initial=0)
            if not np.isfinite(length):
                return None
            if length > _SHRINKS * before:
                return (x, step) if length <= _ROUNDED * size else None
            if abs(seen - start).max(initial=0) + 2 * length <= self.tolerance * size and before < np.inf:
                return x, np.zeros_like(step)
            before = length
        return None

    def _coarse(self, omega: float, forces: ComplexArray) -> ComplexArray:
        """Return the motion of the elastic modes of the reduced model under forces."""
        elastic = slice(self.n_rigid, None)
        modes, shapes = self.modes, self.shapes[:, elastic]
        stiffness = modes.stiffness[elastic] * (1 + 1j * modes.loss_factor[elastic])
        denominator = stiffness - omega**2 + 1j * omega * modes.damping[elastic]
        taken = np.divide(1, denominator, out=np.zeros_like(denominator), where=denominator != 0)
        return shapes @ (taken[:, None] * (shapes.T @ forces))


def spot_error(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    modes: Modes,
    outputs: Ports,
    inputs: Ports,
    rigid: RigidModes | None = None,
    near: TwoLevels | None = None,
    solver: SparseSolver | None = None,
) -> tuple[float, float]:
    """Return the largest difference to solutions of the whole model at a few lines, and its limit by rounding.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_lines,)
        A few frequencies, Hz.
    rigid : RigidModes, optional
        Modes that are solved by their mass alone.
    near : TwoLevels, optional
        Solver of a large model; if it does not converge, and by default, complex factors of each line are used.
    solver : SparseSolver, optional
        Solver with the order of elimination.

    Returns
    -------
    error : float
        Error relative to the largest entry of the line; inf if there is no solution.
    attainable : float
        Multiple of the last step of a refinement of the solutions, which is all rounding; at most the rounding of the
        worst conditioned line that gives no warning.
    """
    found = modes.lines(freq_hz, "nan")[0]
    parts = no_rigid_modes(matrices.n) if rigid is None else rigid
    own = parts.dynamic_stiffness(matrices, 2 * np.pi * freq_hz)
    forces = inputs.forces()
    straining = parts.straining_forces(forces).astype(np.complex128)
    seen, driven = outputs.of(parts.shapes), parts.shapes.T @ forces
    errors, rounding = np.full(freq_hz.size, np.inf), 0.0
    by_line = solver or SparseSolver()
    for i, omega in enumerate(2 * np.pi * freq_hz):
        if not own[i].all():  # no stiffness resists the body: superposition names the line as singular
            errors[i] = 0
            continue
        solved = None if near is None else near.solve(matrices, omega, straining, outputs)
        if solved is None:
            try:
                solved = _by_factors(by_line, matrices, omega, straining, outputs, parts)
            except SingularMatrixError:
                continue
        x, step = solved
        exact = outputs.of(parts.strains(x)) + seen @ (driven / own[i][:, None])
        size = max(abs(exact).max(initial=0), TINY)
        error = abs(found[i] - exact).max(initial=0) / size
        errors[i] = error if np.isfinite(error) else np.inf
        rounding = max(rounding, float(abs(step).max(initial=0) / size))
    return float(errors.max(initial=0)), min(_LOSS * rounding, _MOST_ROUNDING)


def _by_factors(
    solver: SparseSolver, matrices: ModelMatrices, omega: float, forces: ComplexArray, outputs: Ports, parts: RigidModes
) -> tuple[NDArray[Any], ComplexArray]:
    """Return the refined solution by complex factors of a line, and its last step at the responses."""
    z = matrices.dynamic_stiffness(omega)
    factors = solver.factor(z, matrices.are_symmetric)
    x = factors.solve(forces)
    step = factors.solve(forces - z @ x)
    return x + step, outputs.of(parts.strains(step))


@dataclass(frozen=True)
class Reduction:
    """A reduced model that is ready for superposition.

    Parameters
    ----------
    modes : Modes
        Modes of the reduced model.
    error_estimate : float
        Largest difference to a direct solution, relative to the largest entry of its line.
    checked_hz : ndarray
        Lines of this comparison, Hz.
    n_vectors : int
        Size of the reduced model.
    attainable : float
        Rounding of a direct solution, times a factor for a sum of modes; 2.2e-4 at most.
    shapes : ndarray, shape (n, n_vectors)
        Shapes of the modes in all DOFs, 1/sqrt(kg): a basis for models that differ little.
    solver : str
        Library and order of elimination of the factors.
    """

    modes: Modes
    error_estimate: float
    checked_hz: FloatArray
    n_vectors: int
    attainable: float
    shapes: FloatArray
    solver: str


def reduce_model(
    freq_hz: FloatArray, matrices: ModelMatrices, outputs: Ports, inputs: Ports, tolerance: float
) -> Reduction:
    """Return a projection of a model on solutions at a few frequencies, refined until the tolerance or stagnation.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies of later requests, Hz.
    matrices : ModelMatrices
        Symmetric K and M, damping a M + b K and one loss factor.
    outputs, inputs : Ports
        Responses and forces.
    tolerance : float
        Wanted relative error of a line.

    Returns
    -------
    Reduction
        Reduced model; its error estimate may exceed the tolerance.

    Raises
    ------
    ValueError
        K or M is not symmetric, or the damping couples the modes.

    Notes
    -----
    The space is spanned by (K - s M)^-1 B, (K - s M)^-1 M (K - s M)^-1 B, ... at real shifts s = w^2, with unit forces
    B at inputs and outputs. With damping a M + b K and a loss factor the undamped space is valid for all dampings.
    Because it is also valid for outputs, errors of the projection enter the receptance squared. The residual shows the
    lines at which the reduced model is worst. There and at both ends (for a large model at the worst line only) it is
    compared with a direct solution. The error between these lines is not bounded.

    A free structure also moves as a rigid body. Rounding gives these motions a stiffness, which would spoil any
    solution near 0 Hz, reduced or direct. They are computed first and kept out of the space. The same applies to
    motions on springs so soft that K loses half of its digits. They enter separately as r r^T / (w_r^2 - w^2), with
    w_r = 0 for a free motion.

    Cost: a factorisation of a real matrix for the rigid-body modes and one for each shift, of a complex matrix for each
    line of comparison; 40 solutions or more a shift.

    References
    ----------
    .. [1] Z. Bai, Y. Su, Dimension reduction of large-scale second-order dynamical systems via a second-order Arnoldi
       method, SIAM J. Sci. Comput. 26 (2005) 1692-1709.
    """
    matrices.check_symmetric("method 'krylov' cannot be used, 'sparse' or 'dense' can")
    if matrices.proportional is None:
        raise ValueError("damping couples the modes, which 'krylov' cannot do; use method 'sparse' or 'dense'")
    task = _Reducer(freq_hz, matrices, outputs, inputs, tolerance)
    low, high = float(freq_hz.min()), float(freq_hz.max())
    place = (1 - np.cos(np.pi * (np.arange(_FIRST_SHIFTS) + 0.5) / _FIRST_SHIFTS)) / 2
    shifts = [(2 * np.pi * f) ** 2 for f in low + place * (high - low)]
    best: Reduction | None = None
    vain = 0
    new = shifts
    while True:
        for shift in new:
            task.extend(shift)
        found, worst = task.project()
        gained = best is None or found.error_estimate < best.error_estimate / 3
        if best is None or found.error_estimate < best.error_estimate:
            best = found
        vain = 0 if gained or found.error_estimate > _NEAR else vain + 1
        enough = len(shifts) >= _MOST_SHIFTS or task.basis.shape[1] > _MOST_VECTORS * matrices.n
        if best.error_estimate <= max(tolerance, best.attainable) or vain >= 2 or enough:
            return best
        new = [shift for shift in (2 * np.pi * worst) ** 2 if shift not in shifts][: 1 + len(shifts) // 2]
        if not new:
            return best
        shifts = shifts + new


class _Reducer:
    """A model, its ports, and the present space: orthonormal, without rigid-body modes."""

    def __init__(
        self, freq_hz: FloatArray, matrices: ModelMatrices, outputs: Ports, inputs: Ports, tolerance: float
    ) -> None:
        assert matrices.proportional is not None
        self.freq_hz, self.matrices, self.outputs, self.inputs = freq_hz, matrices, outputs, inputs
        self.tolerance = tolerance
        self.k, self.m = matrices.sparse("stiffness"), matrices.sparse("mass")
        self.a, self.b, self.eta = matrices.proportional
        self.forces = directions(outputs, inputs)
        self.solver = SparseSolver()
        self.rigid = find_rigid_modes(self.k, self.m, self.solver)
        self.basis = np.zeros((matrices.n, 0))
        self.last: tuple[float, Factors] | None = None  # for one shift only: large factors fill the memory

    def extend(self, shift: float) -> None:
        """Add the solutions at one more shift."""
        self.last = None
        try:
            factors = self.solver.factor(self.k - shift * self.m)
        except SingularMatrixError:  # the next shift is used
            return
        self.last = shift, factors
        vectors = [factors.solve(self.rigid.straining_forces(self.forces))]
        for _ in range(max(_MOMENTS, -(-_VECTORS // self.forces.shape[1])) - 1):
            last = self.rigid.strains(vectors[-1] / np.linalg.norm(vectors[-1], axis=0))
            vectors.append(factors.solve(self.m @ last))
        block = self.rigid.strains(np.hstack(vectors))
        if not np.isfinite(block).all():
            return
        block = block / np.linalg.norm(block, axis=0)
        for _ in range(2):  # twice is enough
            block = block - self.basis @ (self.basis.T @ block)
        q, r, _ = linalg.qr(block, mode="economic", pivoting=True)
        q = q[:, abs(np.diagonal(r)) > _NEW_DIRECTION]
        q = q - self.basis @ (self.basis.T @ q)
        self.basis = np.hstack([self.basis, linalg.qr(q, mode="economic")[0]])

    def modes(self) -> tuple[FloatArray, FloatArray]:
        """Modes of the space, w^2 and shapes (n, k), without the rigid-body modes."""
        if not self.basis.shape[1]:
            return np.zeros(0), self.basis
        stiffness, mass = self.basis.T @ (self.k @ self.basis), self.basis.T @ (self.m @ self.basis)
        squared, shapes = linalg.eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
        return np.maximum(squared, 0), self.basis @ shapes

    def project(self) -> tuple[Reduction, FloatArray]:
        """Return the reduced model and the frequencies of its largest residuals, Hz, worst first."""
        freq, rigid = self.freq_hz, self.rigid
        size = self.basis.shape[1] + len(rigid)
        try:
            squared, shapes = self.modes()
        except (np.linalg.LinAlgError, ValueError):
            size = 0
        if not size:
            empty = np.zeros(0)
            none = Modes(empty, empty, empty, np.zeros((len(self.outputs), 0)), np.zeros((len(self.inputs), 0)), empty)
            found = Reduction(none, np.inf, empty, size, 0.0, np.zeros((self.matrices.n, 0)), self.solver.used)
            return found, freq[[freq.size // 2]]
        uncertainty = np.concatenate([rigid.uncertainty, np.zeros(squared.size)])
        squared = np.concatenate([rigid.stiffness, squared])
        shapes = np.hstack([rigid.shapes, shapes])
        damping, loss = self.a + self.b * squared, np.full(size, self.eta)
        modes = Modes(squared, damping, loss, self.outputs.of(shapes), self.inputs.of(shapes), uncertainty)
        worst = self._worst_lines(modes, shapes)
        spots = [worst[0], freq.argmin(), freq.argmax(), *worst[1:]]
        spots = spots[: _SPOTS if self.matrices.n < _LARGE else _FEW_SPOTS]
        if freq.min() == 0:  # where a structure on soft springs is worst conditioned
            spots.append(freq.argmin())
        lines = np.unique(spots)
        near = None
        if self.matrices.n >= _ITERATED and self.last is not None:
            near = TwoLevels(*self.last, modes, shapes, len(rigid), self.tolerance)
        error, attainable = spot_error(
            freq[lines], self.matrices, modes, self.outputs, self.inputs, self.rigid, near, self.solver
        )
        return Reduction(modes, error, freq[lines], size, attainable, shapes, self.solver.used), freq[worst]

    def _worst_lines(self, modes: Modes, shapes: FloatArray) -> NDArray[np.intp]:
        """Return lines among candidates in the order of their residual Z x - b, largest first."""
        freq, size = self.freq_hz, shapes.shape[1]
        # Lengths of sums of these columns equal lengths of sums of the columns of a small triangle.
        columns = np.hstack([self.k @ shapes, self.m @ shapes, self.inputs.forces()])
        triangle = linalg.qr(columns, mode="r")[0][: columns.shape[1]]
        by_k, by_m, forces = triangle[:, :size], triangle[:, size : 2 * size], triangle[:, 2 * size :]
        ascending = np.argsort(freq)
        spread = ascending[np.linspace(0, freq.size - 1, min(_CANDIDATES, freq.size)).astype(int)]
        residual = np.empty(spread.size)
        for i, omega in enumerate(2 * np.pi * freq[spread]):
            denominator = modes.stiffness * (1 + 1j * self.eta) - omega**2 + 1j * omega * modes.damping
            inverse = np.divide(1, denominator, out=np.zeros_like(denominator), where=denominator != 0)
            x = inverse[:, None] * modes.shapes_in.T
            elastic = (1 + 1j * self.eta + 1j * omega * self.b) * (by_k @ x)
            left = elastic + (1j * omega * self.a - omega**2) * (by_m @ x) - forces
            residual[i] = np.linalg.norm(left) / max(float(np.linalg.norm(elastic)), TINY)
        return np.take(spread, np.argsort(residual)[::-1])
