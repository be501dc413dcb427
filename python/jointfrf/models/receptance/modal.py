"""Receptance of a model as a sum over modes, all of them or those of a reduced model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import N_FREQ, run
from jointfrf.kernel.status import RCOND_LIMIT, LineStatus, OnSingular, check_lines
from jointfrf.models.matrices import ModelMatrices
from jointfrf.models.ports import Ports
from jointfrf.models.receptance.direct import SINGULAR
from jointfrf.models.receptance.rigid_modes import RigidModes, eigh, find_rigid_modes, mode_condition, resistance

__all__ = ["Modes", "all_modes"]

#: A modal damping matrix is diagonal if nothing beside its diagonal exceeds this share of it.
_DIAGONAL = 1e-8


@dataclass(frozen=True)
class Modes:
    """Modes with unit modal masses.

    Parameters
    ----------
    stiffness : ndarray, shape (n_modes,)
        w_r^2, (rad/s)^2.
    damping : ndarray, shape (n_modes,)
        Viscous, 2 zeta w_r, rad/s.
    loss_factor : ndarray, shape (n_modes,)
        eta of each mode.
    shapes_out, shapes_in : ndarray, shape (n_out, n_modes), (n_in, n_modes)
        Shapes at responses and forces, 1/sqrt(kg).
    uncertainty : ndarray, shape (n_modes,)
        Uncertainty of w_r^2 by rounding of K, (rad/s)^2, of modes that it may hide, see `RigidModes`; else 0.
    """

    stiffness: FloatArray
    damping: FloatArray
    loss_factor: FloatArray
    shapes_out: FloatArray
    shapes_in: FloatArray
    uncertainty: FloatArray

    def receptance(self, freq_hz: FloatArray, on_singular: OnSingular, out: ComplexArray | None = None) -> ComplexArray:
        """Sum of phi phi^T / (w_r^2 (1 + i eta) - w^2 + i w c) over the modes.

        Returns
        -------
        ndarray, shape (n_freq, n_out, n_in)
            m/N.
        """
        result, status = self.lines(freq_hz, on_singular, out)
        check_lines("receptance", status, {}, freq_hz, "nan", RCOND_LIMIT)
        return result

    def lines(
        self, freq_hz: FloatArray, on_singular: OnSingular, out: ComplexArray | None = None
    ) -> tuple[ComplexArray, LineStatus]:
        """Return the sum and the status of each line; lines that are ill-conditioned give no warning yet.

        Their reciprocal condition is that of all modes where it is below the machine's precision, and otherwise such
        that eps / rcond is the relative change of a mode by its uncertainty.
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
        result, status = run("receptance_modal", args, shape, {"omega": omega}, freq_hz, on_singular, 0.0, out)
        rcond = np.where(status.rcond < SINGULAR, status.rcond, 1.0)
        known = self.uncertainty > 0
        complex_stiffness = self.stiffness[known] * (1 + 1j * self.loss_factor[known])
        left = complex_stiffness + omega[:, None] * (1j * self.damping[known] - omega[:, None])
        rcond = np.minimum(rcond, mode_condition(left, self.uncertainty[known]))
        return result, LineStatus(status.line_info, rcond)


def all_modes(matrices: ModelMatrices, outputs: Ports, inputs: Ports) -> tuple[Modes, RigidModes]:
    """Return all modes of a model whose damping does not couple them, and those as a rigid body among them.

    Raises
    ------
    ValueError
        K or M is not symmetric, M is not positive definite, or damping couples the modes.

    Notes
    -----
    An eigenvalue solver knows every w^2 within rounding of the largest one; rigid-body modes, and those of a soft
    suspension, are found apart, see `find_rigid_modes`.
    """
    for name in ("stiffness", "mass"):
        if not matrices.is_symmetric(name):
            raise ValueError(f"{name} is not symmetric: method 'modal' cannot be used, 'dense' or 'sparse' can")
    k, m = matrices.dense("stiffness"), matrices.dense("mass")
    assert k is not None
    assert m is not None
    try:
        squared, shapes = eigh(k, m)
    except np.linalg.LinAlgError as error:
        raise ValueError("mass is not positive definite: method 'modal' cannot be used") from error
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
            raise ValueError(f"{name} couples the modes: method 'modal' cannot be used, 'dense' or 'sparse' can")
        return diagonal

    structural = modal("structural_damping")
    alone = resistance(matrices, "structural_damping", rigid.shapes)
    structural[: len(rigid)] = alone
    stiffness[: len(rigid)] = np.where(rigid.stiffness > 0, rigid.stiffness, SINGULAR * alone)  # held by H alone
    losses = matrices.loss_factor + np.divide(structural, stiffness, out=np.zeros(matrices.n), where=stiffness > 0)
    modes = Modes(stiffness, modal("damping"), losses, outputs.of(shapes), inputs.of(shapes), uncertainty)
    return modes, rigid
