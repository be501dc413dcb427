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
    """Return the inverse of every line.

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies, Hz, for the message about a singular line.
    on_singular : {"raise", "nan"}
        Whether a singular line raises an error (default) or becomes NaN, in this line only.
    out : ndarray of complex128, shape (n_freq, n, n), optional
        Array for the result, in C order, without memory in common with an input; a new array by default.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        Inverses; `out` if it was given.

    Raises
    ------
    SingularLineError
        A line is singular. All lines are computed first: `out` contains the good ones, and NaN in the singular ones.
    OverflowError
        The result of a line overflows.
    ValueError
        Wrong shape; NaN or Inf in a line; `out` does not fit.

    Warns
    -----
    IllConditionedWarning
        The reciprocal condition number of a line is below `jointfrf.RCOND_LIMIT`.

    See Also
    --------
    solve : solution with right-hand sides.
    sweep : lines of a sweep larger than memory.

    Notes
    -----
    Input and `out` may be `numpy.memmap` larger than memory: they are processed in chunks of lines, with
    bit-identical results. `set_engine` chooses the engine.

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
    """Return the reciprocal condition number 1/(|A| |A^-1|) of every line.

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.

    Returns
    -------
    ndarray, shape (n_freq,)
        Reciprocal condition number; 0 if the line is singular or contains NaN or Inf.

    See Also
    --------
    invert : the inverse, with a warning for ill-conditioned lines.

    Notes
    -----
    In the infinity norm with |re| + |im| for the modulus, which is within a factor 2 of the norm with the modulus.

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
    """Return the solution of A X = B on every line.

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.
    b : array_like, shape (n_freq, n, n_rhs)
        Right-hand sides.
    freq_hz, on_singular, out
        Frequencies, Hz, treatment of singular lines, and array for the result; see `invert`.

    Returns
    -------
    ndarray, shape (n_freq, n, n_rhs)
        Solutions X.

    Raises
    ------
    SingularLineError, ValueError
        An error of `invert`.

    See Also
    --------
    invert : inverse of every line.

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
    """Return solutions like `solve` for checked arrays; below `singular_rcond` a line is singular."""
    args = (a.shape[1], b.shape[2], N_FREQ, a, b)
    return run("solve", args, b.shape, {"a": a, "b": b}, freq_hz, on_singular, singular_rcond=singular_rcond)[0]
