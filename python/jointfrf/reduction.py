"""Rational Krylov reduction of a model with one loss factor or proportional damping, and how its error is estimated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from jointfrf._sweep import ComplexArray, FloatArray
from jointfrf.model_matrices import ModelMatrices
from jointfrf.superposition import Modes

__all__ = ["Reduction", "reduce_model", "spot_error"]

#: Shifts to begin with, and solutions at each.
_FIRST_SHIFTS, _MOMENTS = 3, 3
#: Shifts are added up to this number, and vectors up to this share of the DOFs.
_MOST_SHIFTS, _MOST_VECTORS = 40, 0.5
#: Below this error a refinement that gains less than a factor of three has reached the round-off of the model.
_NEAR = 1e-4
#: Directions smaller than this share of their vector are not new.
_NEW_DIRECTION = 1e-12
#: Lines whose residual is looked at, and those of them that are solved directly.
_CANDIDATES, _SPOTS = 40, 4


@dataclass(frozen=True)
class Reduction:
    """A reduced model that is ready for superposition.

    Parameters
    ----------
    modes : Modes
        Modes of the reduced model.
    error_estimate : float
        Largest difference to a direct solution, relative to the largest entry of its line.
    n_vectors : int
        Size of the reduced model.
    """

    modes: Modes
    error_estimate: float
    n_vectors: int


def reduce_model(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    outputs: NDArray[np.int32],
    inputs: NDArray[np.int32],
    tolerance: float,
) -> Reduction:
    """Project a model on solutions at a few frequencies, more of them until the tolerance is met or no longer nearer.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies that will be asked for, Hz.
    matrices : ModelMatrices
        Symmetric K and M, damping a M + b K and one loss factor.
    outputs, inputs : ndarray of int
        DOFs, counted from 1.
    tolerance : float
        Wanted relative error of a line.

    Returns
    -------
    Reduction
        Its error estimate may exceed the tolerance.

    Raises
    ------
    ValueError
        K or M is not symmetric, or the damping couples the modes.

    Notes
    -----
    The space is spanned by (K - s M)^-1 B, (K - s M)^-1 M (K - s M)^-1 B, ... at real shifts s = w^2, with unit forces
    B at inputs and outputs. With damping a M + b K and a loss factor the undamped space serves all dampings; because it
    serves outputs too, errors of the projection enter the receptance squared. The residual says at which lines the
    reduced model is worst; there, and at both ends, it is compared with a direct solution. The error between these
    lines is not bounded.
    """
    for name in ("stiffness", "mass"):
        if not matrices.is_symmetric(name):
            raise ValueError(f"{name} is not symmetric: method 'krylov' cannot be used, 'dense' or 'banded' can")
    if matrices.proportional is None:
        raise ValueError("damping couples the modes: method 'krylov' cannot be used, 'dense' or 'banded' can")
    k, m = matrices.sparse("stiffness"), matrices.sparse("mass")
    dofs = np.unique(np.concatenate([outputs, inputs])) - 1
    forces = np.zeros((matrices.n, dofs.size))
    forces[dofs, np.arange(dofs.size)] = 1
    low, high = float(freq_hz.min()), float(freq_hz.max())
    place = (1 - np.cos(np.pi * (np.arange(_FIRST_SHIFTS) + 0.5) / _FIRST_SHIFTS)) / 2
    shifts = [(2 * np.pi * f) ** 2 for f in low + place * (high - low)]
    basis = np.zeros((matrices.n, 0))
    best: Reduction | None = None
    vain = 0
    new = shifts
    while True:
        for shift in new:
            basis = _extended(basis, k, m, forces, shift)
        found, worst = _project(freq_hz, matrices, k, m, basis, outputs, inputs)
        gained = best is None or found.error_estimate < best.error_estimate / 3
        if best is None or found.error_estimate < best.error_estimate:
            best = found
        vain = 0 if gained or found.error_estimate > _NEAR else vain + 1
        enough = len(shifts) >= _MOST_SHIFTS or basis.shape[1] > _MOST_VECTORS * matrices.n
        if best.error_estimate <= tolerance or vain >= 2 or enough:
            return best
        new = [shift for shift in (2 * np.pi * worst) ** 2 if shift not in shifts][: 1 + len(shifts) // 2]
        if not new:
            return best
        shifts = shifts + new


def _extended(
    basis: FloatArray, k: sparse.csc_array, m: sparse.csc_array, forces: FloatArray, shift: float
) -> FloatArray:
    """Return the basis with the solutions at one more shift, orthonormal."""
    try:
        factors = sparse_linalg.splu(sparse.csc_matrix(k - shift * m))
        vectors = [factors.solve(forces)]
        for _ in range(_MOMENTS - 1):
            last = vectors[-1] / np.linalg.norm(vectors[-1], axis=0)
            vectors.append(factors.solve(m @ last))
    except RuntimeError:  # exactly singular: the next shift will do
        return basis
    block = np.hstack(vectors)
    if not np.isfinite(block).all():
        return basis
    block = block / np.linalg.norm(block, axis=0)
    for _ in range(2):  # twice is enough
        block = block - basis @ (basis.T @ block)
    q, r, _ = linalg.qr(block, mode="economic", pivoting=True)
    q = q[:, abs(np.diagonal(r)) > _NEW_DIRECTION]
    q = q - basis @ (basis.T @ q)
    return np.hstack([basis, linalg.qr(q, mode="economic")[0]])


def _project(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    k: sparse.csc_array,
    m: sparse.csc_array,
    basis: FloatArray,
    outputs: NDArray[np.int32],
    inputs: NDArray[np.int32],
) -> tuple[Reduction, FloatArray]:
    """Return the reduced model and the frequencies where it is worst, Hz, worst first."""
    assert matrices.proportional is not None
    a, b, eta = matrices.proportional
    kv, mv = k @ basis, m @ basis
    reduced_k, reduced_m = basis.T @ kv, basis.T @ mv
    size = basis.shape[1]
    try:
        squared, shapes = linalg.eigh((reduced_k + reduced_k.T) / 2, (reduced_m + reduced_m.T) / 2)
    except (np.linalg.LinAlgError, ValueError):
        empty = np.zeros(0)
        none = Modes(empty, empty, empty, np.zeros((outputs.size, 0)), np.zeros((inputs.size, 0)))
        return Reduction(none, np.inf, size), freq_hz[[freq_hz.size // 2]]
    squared = np.maximum(squared, 0)
    whole = basis @ shapes
    modes = Modes(squared, a + b * squared, np.full(size, eta), whole[outputs - 1], whole[inputs - 1])
    worst = _worst_lines(freq_hz, modes, matrices, kv @ shapes, mv @ shapes, inputs)
    lines = np.unique([freq_hz.argmin(), freq_hz.argmax(), *worst[:_SPOTS]])
    error = float(spot_error(freq_hz[lines], matrices, modes, outputs, inputs).max())
    return Reduction(modes, error, size), freq_hz[worst]


def _worst_lines(
    freq_hz: FloatArray,
    modes: Modes,
    matrices: ModelMatrices,
    k_shapes: FloatArray,
    m_shapes: FloatArray,
    inputs: NDArray[np.int32],
) -> NDArray[np.intp]:
    """Lines among candidates in the order of their residual Z x - b, largest first."""
    assert matrices.proportional is not None
    a, b, eta = matrices.proportional
    ascending = np.argsort(freq_hz)
    spread = ascending[np.linspace(0, freq_hz.size - 1, min(_CANDIDATES, freq_hz.size)).astype(int)]
    residual = np.empty(spread.size)
    for i, omega in enumerate(2 * np.pi * freq_hz[spread]):
        denominator = modes.stiffness * (1 + 1j * eta) - omega**2 + 1j * omega * modes.damping
        x = (
            np.divide(1, denominator, out=np.zeros_like(denominator), where=denominator != 0)[:, None]
            * modes.shapes_in.T
        )
        stiff = 1 + 1j * eta + 1j * omega * b
        left = (stiff * k_shapes) @ x + ((1j * omega * a - omega**2) * m_shapes) @ x
        left[inputs - 1, np.arange(inputs.size)] -= 1
        residual[i] = np.linalg.norm(left) / max(np.linalg.norm(stiff * (k_shapes @ x)), np.finfo(float).tiny)
    order = np.argsort(residual)[::-1]
    return np.take(spread, order)


def spot_error(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    modes: Modes,
    outputs: NDArray[np.int32],
    inputs: NDArray[np.int32],
) -> FloatArray:
    """Difference to direct solutions, relative to the largest entry of each line; inf where there is none.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_lines,)
        A few frequencies, Hz.

    Returns
    -------
    ndarray, shape (n_lines,)
    """
    k, m, c, h = (matrices.sparse(name) for name in matrices.named)
    found = modes.receptance(freq_hz, "nan")
    forces = np.zeros((matrices.n, inputs.size), np.complex128)
    forces[inputs - 1, np.arange(inputs.size)] = 1
    errors = np.full(freq_hz.size, np.inf)
    for i, omega in enumerate(2 * np.pi * freq_hz):
        z = (1 + 1j * matrices.loss_factor) * k + 1j * h + 1j * omega * c - omega**2 * m
        try:
            exact: ComplexArray = sparse_linalg.splu(sparse.csc_matrix(z)).solve(forces)[outputs - 1]
        except RuntimeError:  # singular
            continue
        error = abs(found[i] - exact).max(initial=0) / max(abs(exact).max(initial=0), np.finfo(float).tiny)
        errors[i] = error if np.isfinite(error) else np.inf
    return errors
