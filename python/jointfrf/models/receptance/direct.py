"""Receptance of a model by solving with its dynamic stiffness on every line (2.28)-(2.29)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_real, checked_out
from jointfrf.kernel.call import N_FREQ, run
from jointfrf.kernel.status import LineStatus, OnSingular, check_lines
from jointfrf.models.matrices import ModelMatrices
from jointfrf.models.ports import Ports
from jointfrf.models.receptance.factors import Factors, SingularMatrixError, SparseSolver

__all__ = ["SINGULAR", "solve_banded", "solve_dense", "solve_sparse"]

#: A fine mesh in mixed units has rcond 1e-13 and still gives nine digits: only below this is a line singular.
SINGULAR = float(np.finfo(np.float64).eps)


def solve_dense(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    outputs: NDArray[np.int32],
    inputs: NDArray[np.int32],
    on_singular: OnSingular,
    out: ComplexArray | None = None,
) -> tuple[ComplexArray, LineStatus]:
    """Solve with full matrices, zgesv; DOFs counted from 1.

    Returns
    -------
    h : ndarray, shape (n_freq, n_out, n_in)
        m/N.
    status : LineStatus
        With the reciprocal condition of each line; lines that are ill-conditioned give no warning yet.
    """
    n, shape, omega = matrices.n, (freq_hz.size, outputs.size, inputs.size), 2 * np.pi * freq_hz
    args: list[Any] = [n, N_FREQ, *shape[1:], omega, matrices.dense("stiffness"), matrices.dense("mass")]
    for name in ("damping", "structural_damping"):
        matrix = matrices.dense(name)
        args += [0, np.zeros((1, n))] if matrix is None else [n, matrix]
    args += [matrices.loss_factor, outputs, inputs]
    return run("receptance", args, shape, {"omega": omega}, freq_hz, on_singular, 0.0, out)


def solve_banded(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    outputs: NDArray[np.int32],
    inputs: NDArray[np.int32],
    on_singular: OnSingular,
    out: ComplexArray | None = None,
) -> tuple[ComplexArray, LineStatus]:
    """Solve in band storage, zgbsv or an elimination of many lines side by side; DOFs counted from 1.

    Returns
    -------
    h : ndarray, shape (n_freq, n_out, n_in)
        m/N.
    status : LineStatus
        With the reciprocal condition of each line; lines that are ill-conditioned give no warning yet.
    """
    n, shape, omega = matrices.n, (freq_hz.size, outputs.size, inputs.size), 2 * np.pi * freq_hz
    kl, ku = matrices.widths

    def stored(name: str) -> FloatArray | None:
        """Return LAPACK's band storage, transposed: row j holds column j."""
        if matrices.named[name] is None:
            return None
        entries = sparse.coo_array(matrices.named[name])
        values = as_real(name, entries.data, (None,))
        band = np.zeros((n, kl + ku + 1))
        np.add.at(band, (entries.col, ku + entries.row - entries.col), values)
        return band

    args: list[Any] = [n, kl, ku, N_FREQ, *shape[1:], omega, stored("stiffness"), stored("mass")]
    for name in ("damping", "structural_damping"):
        band = stored(name)
        args += [0, np.zeros((1, kl + ku + 1))] if band is None else [n, band]
    args += [matrices.loss_factor, outputs, inputs]
    return run("receptance_banded", args, shape, {"omega": omega}, freq_hz, on_singular, 0.0, out)


def solve_sparse(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    outputs: Ports,
    inputs: Ports,
    on_singular: OnSingular,
    out: ComplexArray | None = None,
) -> tuple[ComplexArray, LineStatus, str]:
    """Solve by a sparse factorisation of every line.

    Returns
    -------
    h : ndarray, shape (n_freq, n_out, n_in)
        m/N.
    status : LineStatus
        With the reciprocal condition of each line; lines that are ill-conditioned give no warning yet.
    solver : str
        Library and order of elimination.
    """
    shape = (freq_hz.size, len(outputs), len(inputs))
    result = np.empty(shape, np.complex128) if out is None else checked_out(out, shape, (), {})
    solver, is_symmetric = SparseSolver(), matrices.are_symmetric
    status = LineStatus(np.zeros(freq_hz.size, np.int32), np.ones(freq_hz.size))
    forces = inputs.forces().astype(np.complex128)
    for i, omega in enumerate(2 * np.pi * freq_hz):
        z = matrices.dynamic_stiffness(omega)
        try:
            factors = solver.factor(z, is_symmetric)
        except SingularMatrixError:
            result[i], status.line_info[i], status.rcond[i] = np.nan, 1, 0
            continue
        result[i] = outputs.of(factors.solve(forces))
        status.rcond[i] = _reciprocal_condition(z, factors)
        if not np.isfinite(result[i]).all():
            result[i], status.line_info[i], status.rcond[i] = np.nan, -2, 0
    check_lines("receptance", status, {}, freq_hz, on_singular)
    return result, status, solver.used


def _reciprocal_condition(z: sparse.csc_matrix, factors: Factors) -> float:
    """Estimate 1 / (||Z|| ||Z^-1||) in the 1-norm by a few solutions."""

    def adjoint(b: ComplexArray) -> ComplexArray:
        return factors.solve(b, "H")

    inverse = sparse_linalg.LinearOperator(
        z.shape, matvec=factors.solve, rmatvec=adjoint, matmat=factors.solve, rmatmat=adjoint, dtype=np.complex128
    )
    size = float(sparse_linalg.onenormest(inverse, t=1) * abs(z).sum(axis=0).max())
    return 1 / size if size > 0 else 0.0
