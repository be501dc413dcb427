"""Inverse and solution of one matrix per frequency line."""

from __future__ import annotations

from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_lines, as_square, optional_frequency
from jointfrf.kernel.call import N_FREQ, OnSingular, run

__all__ = ["invert", "reciprocal_condition", "solve", "solve_lines"]


def invert(
    a: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Inverse of every line.

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies in Hz, to name a bad line.
    on_singular : {"raise", "nan"}
        Whether a bad line raises or becomes NaN, in this line only.
    out : ndarray of complex128, shape (n_freq, n, n), optional
        Where the result goes, in C order, without memory in common with an input; a new array by default.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        `out` where it was given.

    Raises
    ------
    SingularLineError
        A line is singular. All lines are done first: `out` holds the good ones, and NaN in the bad ones.
    OverflowError
        The result of a line overflows.
    ValueError
        Wrong shape; NaN or Inf in a line; `out` does not fit.

    Warns
    -----
    IllConditionedWarning
        rcond of a line is below `jointfrf.RCOND_LIMIT`.

    Notes
    -----
    Input and `out` may be `numpy.memmap` larger than memory: they are processed in chunks of lines, with
    bit-identical results. `set_engine` chooses what inverts the lines.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> (jf.invert(np.array([[[2.0, 0], [0, 4]]])).real + 0.0).tolist()
    [[[0.5, 0.0], [0.0, 0.25]]]
    """
    lines = as_square("a", a, later=True)
    n_freq, n, _ = lines.shape
    freq = optional_frequency(freq_hz, n_freq)
    return run("invert", (n, N_FREQ, lines), lines.shape, {"a": lines}, freq, on_singular, out=out)[0]


def reciprocal_condition(a: ArrayLike) -> FloatArray:
    """Reciprocal condition number 1/(|A| |A^-1|) of every line.

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.

    Returns
    -------
    ndarray, shape (n_freq,)
        0 where the line is singular or holds NaN or Inf.

    Notes
    -----
    In the infinity norm with |re| + |im| for the modulus: within a factor 2 of that with the modulus itself.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.reciprocal_condition(np.array([np.diag([1.0, 1e-3]), np.zeros((2, 2))])).tolist()
    [0.001, 0.0]
    """
    lines = as_square("a", a, later=True)
    args = (lines.shape[1], N_FREQ, lines)
    return run("invert", args, lines.shape, {"a": lines}, None, "nan")[2]


def solve(
    a: ArrayLike,
    b: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Solve A X = B on every line.

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.
    b : array_like, shape (n_freq, n, n_rhs)
        Right-hand sides.
    freq_hz, on_singular, out
        As in `invert`.

    Returns
    -------
    ndarray, shape (n_freq, n, n_rhs)

    Raises
    ------
    SingularLineError, ValueError
        As in `invert`.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.solve(np.array([[[2.0, 0], [0, 4]]]), np.array([[[2.0], [2.0]]])).real.tolist()
    [[[1.0], [0.5]]]
    """
    lines = as_square("a", a, later=True)
    n_freq, n, _ = lines.shape
    right = as_lines("b", b, n, None, n_freq, later=True)
    freq = optional_frequency(freq_hz, n_freq)
    args = (n, right.shape[2], N_FREQ, lines, right)
    return run("solve", args, right.shape, {"a": lines, "b": right}, freq, on_singular, out=out)[0]


def solve_lines(
    a: ComplexArray, b: ComplexArray, freq_hz: FloatArray | None, on_singular: OnSingular, singular_rcond: float
) -> ComplexArray:
    """Solve as `solve` does for checked arrays; below `singular_rcond` a line is singular."""
    args = (a.shape[1], b.shape[2], N_FREQ, a, b)
    return run("solve", args, b.shape, {"a": a, "b": b}, freq_hz, on_singular, singular_rcond=singular_rcond)[0]
