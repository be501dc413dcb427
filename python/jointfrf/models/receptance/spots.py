"""How far a sum of modes is from solutions with the whole model, at a few lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.status import RCOND_LIMIT
from jointfrf.models.matrices import ModelMatrices
from jointfrf.models.ports import Ports
from jointfrf.models.receptance.factors import Factors, SingularMatrixError, SparseSolver
from jointfrf.models.receptance.modal import Modes
from jointfrf.models.receptance.rigid_modes import RigidModes, held

__all__ = ["TwoLevels", "spot_error"]

#: Rounding may move the modes of a reduced model by this many times what it moves a direct solution by, but no more
#: than what rounding leaves of a solution with the smallest reciprocal condition that gives no warning: four digits.
_LOSS: Final = 30
_MOST_ROUNDING: Final = float(np.finfo(np.float64).eps) / RCOND_LIMIT
#: Steps of the iteration; a step that is longer than this share of the one before has reached rounding, if it is
#: shorter than this share of the solution.
_STEPS, _SHRINKS, _ROUNDED = 12, 0.5, 1e-6


@dataclass(frozen=True)
class TwoLevels:
    """Solutions of a large model by real factors at one shift and by the modes of its reduced model.

    Parameters
    ----------
    shift : float
        s, (rad/s)^2.
    factors : Factors
        Of K - s M.
    modes : Modes
        Of the reduced model, as a rigid body or not.
    shapes : ndarray, shape (n, n_modes)
        Their shapes, 1/sqrt(kg).
    n_rigid : int
        How many of the modes, the first ones, are those of a rigid body: what is solved for has no part in them.
    tolerance : float
        The iteration ends where the difference to the reduced model is sure to be below this share of the solution.

    Notes
    -----
    With Z = alpha K - beta M, and P = K - s M, a step adds P^-1 r / alpha of the residual r, which leaves
    (beta/alpha - s) / (w_r^2 - s) of an error in mode r: little in the modes above the band. Then it adds what
    the modes of the reduced model take of the residual, which leaves nothing in the modes that it holds. The fixed
    point is the solution with the whole model, whatever the reduced model: its quality only sets how fast it is
    reached [1]_. A complex factorisation takes four times as long as that of P and twice its memory.

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
        """Solve Z x = b.

        Returns
        -------
        x : ndarray, shape (n, n_forces)
        step : ndarray, shape (n_out, n_forces)
            Last step at the responses: rounding; zeros where the tolerance was met before.
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
        """Return what the elastic modes of the reduced model take of forces."""
        elastic = slice(self.n_rigid, None)
        modes, shapes = self.modes, self.shapes[:, elastic]
        stiffness = modes.stiffness[elastic] * (1 + 1j * modes.loss_factor[elastic])
        denominator = stiffness - omega**2 + 1j * omega * modes.damping[elastic]
        taken = np.divide(1, denominator, out=np.zeros_like(denominator), where=denominator != 0)
        found: ComplexArray = shapes @ (taken[:, None] * (shapes.T @ forces))
        return found


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
    """Largest difference to solutions with the whole model at a few lines, and how small rounding lets it become.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_lines,)
        A few frequencies, Hz.
    rigid : RigidModes, optional
        What is solved by its mass alone.
    near : TwoLevels, optional
        How a large model is solved; where it does not converge, and by default, by complex factors of each line.
    solver : SparseSolver, optional
        One that holds the order of elimination.

    Returns
    -------
    error : float
        Relative to the largest entry of the line; inf where there is no solution.
    attainable : float
        A multiple of the last step of a refinement of the solutions, which is all rounding; no more than the
        rounding of the worst conditioned line that gives no warning.
    """
    found = modes.lines(freq_hz, "nan")[0]
    parts = held(matrices.n) if rigid is None else rigid
    own = parts.dynamic_stiffness(matrices, 2 * np.pi * freq_hz)
    forces = inputs.forces()
    straining = parts.straining_forces(forces).astype(np.complex128)
    seen, driven = outputs.of(parts.shapes), parts.shapes.T @ forces
    errors, rounding = np.full(freq_hz.size, np.inf), 0.0
    by_line = solver or SparseSolver()
    for i, omega in enumerate(2 * np.pi * freq_hz):
        if not own[i].all():  # nothing holds the body: superposition names the line as singular
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
        size = max(abs(exact).max(initial=0), np.finfo(float).tiny)
        error = abs(found[i] - exact).max(initial=0) / size
        errors[i] = error if np.isfinite(error) else np.inf
        rounding = max(rounding, float(abs(step).max(initial=0) / size))
    return float(errors.max(initial=0)), min(_LOSS * rounding, _MOST_ROUNDING)


def _by_factors(
    solver: SparseSolver,
    matrices: ModelMatrices,
    omega: float,
    forces: ComplexArray,
    outputs: Ports,
    parts: RigidModes,
) -> tuple[NDArray[Any], ComplexArray]:
    """Return the refined solution by complex factors of a line, and its last step at the responses."""
    z = matrices.dynamic_stiffness(omega)
    factors = solver.factor(z, matrices.are_symmetric)
    x = factors.solve(forces)
    step = factors.solve(forces - z @ x)
    return x + step, outputs.of(parts.strains(step))
