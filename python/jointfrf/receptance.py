"""Receptance of a model from its matrices (2.28)-(2.29)."""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, sparse

from jointfrf._sweep import (
    N_FREQ,
    ComplexArray,
    FloatArray,
    OnSingular,
    as_dofs,
    as_frequency,
    as_number,
    as_real,
    check_choice,
    run,
)

__all__ = ["Method", "receptance"]

Method = Literal["auto", "dense", "banded", "modal"]
Matrix = Any  # array_like or scipy sparse array

#: A fine mesh in mixed units has rcond 1e-13 and still gives nine digits: only singular to working precision is told.
_SINGULAR = float(np.finfo(np.float64).eps)
#: A matrix with a wider band than this share of its size is solved as a dense one.
_BAND_LIMIT = 0.25
#: A modal damping matrix is diagonal if nothing beside its diagonal exceeds this share of it.
_PROPORTIONAL = 1e-8


def receptance(
    freq_hz: ArrayLike,
    stiffness: Matrix,
    mass: Matrix,
    damping: Matrix | None = None,
    loss_factor: float = 0.0,
    structural_damping: Matrix | None = None,
    outputs: ArrayLike | None = None,
    inputs: ArrayLike | None = None,
    method: Method = "auto",
    *,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Receptance ((1 + i eta) K + i H + i w C - w^2 M)^-1 at chosen DOFs.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies in Hz.
    stiffness, mass : array_like or scipy sparse array, shape (n, n)
        K in N/m, M in kg.
    damping : array_like or sparse array, shape (n, n), optional
        Viscous damping C, N s/m.
    loss_factor : float
        eta of the whole stiffness.
    structural_damping : array_like or sparse array, shape (n, n), optional
        Structural damping H, N/m.
    outputs, inputs : array_like of int, optional
        DOFs of responses and of forces, counted from 0; all by default.
    method : {"auto", "dense", "banded", "modal"}
        "dense": zgesv on every line. "banded": band LU on every line (zgbsv). Both take any damping. "modal": all
        modes once, then their sum; exact, for symmetric K and M and damping that the undamped modes diagonalise.
        "auto" solves banded where K and M have a narrow band, else dense.
    on_singular : {"raise", "nan"}
        Whether a bad line raises or becomes NaN.
    out : ndarray of complex128, shape (n_freq, n_out, n_in), optional
        Where the result goes, as in `invert`.

    Returns
    -------
    ndarray, shape (n_freq, n_out, n_in)
        m/N (rotational rows rad/N, rotational columns m/(N m)).

    Raises
    ------
    SingularLineError
        A line hits an undamped natural frequency, or 0 Hz of a free structure.
    ValueError
        Wrong shapes or DOFs, NaN or Inf; "modal" with damping that couples the modes.

    Notes
    -----
    Eqs. (2.28), (2.29), with i w C for viscous damping. Cost a line: n^3 (dense), n b^2 (band of b diagonals),
    n n_out n_in (modal).

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.receptance([0.0], [[2.0]], [[1.0]], loss_factor=1.0).tolist()
    [[[(0.25-0.25j)]]]
    """
    check_choice("method", method, get_args(Method))
    freq = as_frequency(freq_hz)
    omega = 2 * np.pi * freq
    matrices = {
        "stiffness": stiffness,
        "mass": mass,
        "damping": damping,
        "structural_damping": structural_damping,
    }
    eta = as_number("loss_factor", loss_factor)
    n = _check_square(matrices)
    to = as_dofs("outputs", np.arange(n) if outputs is None else outputs, n, unique=False)
    into = as_dofs("inputs", np.arange(n) if inputs is None else inputs, n, unique=False)
    if method == "auto":
        method = "banded" if _has_band(matrices, n) else "dense"
    chosen = {"dense": _dense, "banded": _banded, "modal": _modal}[method]
    return chosen(freq, omega, matrices, eta, to, into, on_singular, out)


def _check_square(matrices: dict[str, Matrix]) -> int:
    """Check the shapes; return n."""
    n: int | None = None
    for name, matrix in matrices.items():
        if matrix is None:
            if name in ("stiffness", "mass"):
                raise ValueError(f"{name} is missing")
            continue
        shape = matrix.shape if sparse.issparse(matrix) else np.shape(matrix)
        if len(shape) != 2 or shape[0] != shape[1] or (n is not None and shape[0] != n):
            wanted = "(n, n)" if n is None else f"({n}, {n})"
            raise ValueError(f"{name} must have shape {wanted}, not {tuple(shape)}")
        n = shape[0]
    assert n is not None
    return n


def _as_dense(name: str, matrix: Matrix, n: int) -> FloatArray:
    return as_real(name, matrix.toarray() if sparse.issparse(matrix) else matrix, (n, n))


def _widths(matrices: dict[str, Matrix]) -> tuple[int, int]:
    """Return the number of diagonals below and above the main one, over all matrices."""
    below = above = 0
    for matrix in matrices.values():
        if matrix is not None:
            entries = sparse.coo_array(matrix)
            distance = entries.col.astype(np.int64) - entries.row
            below = max(below, -int(distance.min(initial=0)))
            above = max(above, int(distance.max(initial=0)))
    return below, above


def _has_band(matrices: dict[str, Matrix], n: int) -> bool:
    return n > 8 and sum(_widths(matrices)) < _BAND_LIMIT * n


def _dense(
    freq: FloatArray,
    omega: FloatArray,
    matrices: dict[str, Matrix],
    loss_factor: float,
    to: NDArray[np.int32],
    into: NDArray[np.int32],
    on_singular: OnSingular,
    out: ComplexArray | None,
) -> ComplexArray:
    n = _check_square(matrices)
    given = {name: None if m is None else _as_dense(name, m, n) for name, m in matrices.items()}
    args: list[Any] = [n, N_FREQ, to.size, into.size, omega, given["stiffness"], given["mass"]]
    for name in ("damping", "structural_damping"):
        matrix = given[name]
        args += [0, np.zeros((1, n))] if matrix is None else [n, matrix]
    args += [loss_factor, to, into]
    shape = (freq.size, to.size, into.size)
    return run("receptance", args, shape, {"omega": omega}, freq, on_singular, _SINGULAR, out)[0]


def _banded(
    freq: FloatArray,
    omega: FloatArray,
    matrices: dict[str, Matrix],
    loss_factor: float,
    to: NDArray[np.int32],
    into: NDArray[np.int32],
    on_singular: OnSingular,
    out: ComplexArray | None,
) -> ComplexArray:
    n = _check_square(matrices)
    kl, ku = _widths(matrices)

    def stored(name: str) -> FloatArray | None:
        """Return LAPACK's band storage, transposed: row j holds column j."""
        if matrices[name] is None:
            return None
        entries = sparse.coo_array(matrices[name])
        values = as_real(name, entries.data, (None,))
        band = np.zeros((n, kl + ku + 1))
        np.add.at(band, (entries.col, ku + entries.row - entries.col), values)
        return band

    args: list[Any] = [n, kl, ku, N_FREQ, to.size, into.size, omega, stored("stiffness"), stored("mass")]
    for name in ("damping", "structural_damping"):
        band = stored(name)
        args += [0, np.zeros((1, kl + ku + 1))] if band is None else [n, band]
    args += [loss_factor, to, into]
    shape = (freq.size, to.size, into.size)
    return run("receptance_banded", args, shape, {"omega": omega}, freq, on_singular, _SINGULAR, out)[0]


def _modal(
    freq: FloatArray,
    omega: FloatArray,
    matrices: dict[str, Matrix],
    loss_factor: float,
    to: NDArray[np.int32],
    into: NDArray[np.int32],
    on_singular: OnSingular,
    out: ComplexArray | None,
) -> ComplexArray:
    n = _check_square(matrices)
    given = {name: None if m is None else _as_dense(name, m, n) for name, m in matrices.items()}
    for name in ("stiffness", "mass"):
        matrix = given[name]
        assert matrix is not None
        if abs(matrix - matrix.T).max(initial=0) > 1e-10 * abs(matrix).max(initial=0):
            raise ValueError(f"{name} is not symmetric: method 'modal' cannot be used, 'dense' or 'banded' can")
    try:
        squared, shapes = linalg.eigh(given["stiffness"], given["mass"])
    except np.linalg.LinAlgError as error:
        raise ValueError("mass is not positive definite: method 'modal' cannot be used") from error

    def modal(name: str) -> FloatArray:
        matrix = given[name]
        if matrix is None:
            return np.zeros(n)
        projected = shapes.T @ matrix @ shapes
        diagonal = np.diagonal(projected).copy()
        rest = abs(projected - np.diag(diagonal)).max(initial=0)
        if rest > _PROPORTIONAL * abs(diagonal).max(initial=0):
            raise ValueError(f"{name} couples the modes: method 'modal' cannot be used, 'dense' or 'banded' can")
        return diagonal

    stiffness = np.maximum(squared, 0)
    structural = modal("structural_damping")
    losses = loss_factor + np.divide(structural, stiffness, out=np.zeros(n), where=stiffness > 0)
    at_out, at_in = np.ascontiguousarray(shapes[to - 1]), np.ascontiguousarray(shapes[into - 1])
    args = (n, N_FREQ, to.size, into.size, omega, stiffness, modal("damping"), losses, at_out, at_in)
    shape = (freq.size, to.size, into.size)
    return run("receptance_modal", args, shape, {"omega": omega}, freq, on_singular, _SINGULAR, out)[0]
