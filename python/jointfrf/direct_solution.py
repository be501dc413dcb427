"""Receptance of a model by solving with its dynamic stiffness on every line (2.28)-(2.29)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf._sweep import N_FREQ, ComplexArray, FloatArray, OnSingular, as_real, run
from jointfrf.model_matrices import ModelMatrices

__all__ = ["SINGULAR", "solve_banded", "solve_dense"]

#: A fine mesh in mixed units has rcond 1e-13 and still gives nine digits: only singular to working precision is told.
SINGULAR = float(np.finfo(np.float64).eps)


def solve_dense(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    outputs: NDArray[np.int32],
    inputs: NDArray[np.int32],
    on_singular: OnSingular,
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Solve with full matrices, zgesv; DOFs counted from 1.

    Returns
    -------
    ndarray, shape (n_freq, n_out, n_in)
        m/N.
    """
    n, shape, omega = matrices.n, (freq_hz.size, outputs.size, inputs.size), 2 * np.pi * freq_hz
    args: list[Any] = [n, N_FREQ, *shape[1:], omega, matrices.dense("stiffness"), matrices.dense("mass")]
    for name in ("damping", "structural_damping"):
        matrix = matrices.dense(name)
        args += [0, np.zeros((1, n))] if matrix is None else [n, matrix]
    args += [matrices.loss_factor, outputs, inputs]
    return run("receptance", args, shape, {"omega": omega}, freq_hz, on_singular, SINGULAR, out)[0]


def solve_banded(
    freq_hz: FloatArray,
    matrices: ModelMatrices,
    outputs: NDArray[np.int32],
    inputs: NDArray[np.int32],
    on_singular: OnSingular,
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Solve in band storage, zgbsv or an elimination of many lines side by side; DOFs counted from 1.

    Returns
    -------
    ndarray, shape (n_freq, n_out, n_in)
        m/N.
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
    return run("receptance_banded", args, shape, {"omega": omega}, freq_hz, on_singular, SINGULAR, out)[0]
