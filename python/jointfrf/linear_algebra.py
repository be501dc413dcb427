"""Inverse and solution of one matrix per frequency line."""

from __future__ import annotations

from numpy.typing import ArrayLike

from jointfrf._sweep import ComplexArray, FloatArray, OnSingular, as_lines, as_square, optional_frequency, run

__all__ = ["invert", "reciprocal_condition", "solve"]


def invert(a: ArrayLike, *, freq_hz: ArrayLike | None = None, on_singular: OnSingular = "raise") -> ComplexArray:
    """Inverse of every line (zgetrf and zgetri).

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies in Hz, to name a bad line.
    on_singular : {"raise", "nan"}
        Whether a bad line raises or becomes NaN, in this line only.

    Returns
    -------
    ndarray, shape (n_freq, n, n)

    Raises
    ------
    SingularLineError
        A line is singular.
    ValueError
        Wrong shape; NaN or Inf in a line.

    Warns
    -----
    IllConditionedWarning
        rcond of a line is below `jointfrf.RCOND_LIMIT`.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> (jf.invert(np.array([[[2.0, 0], [0, 4]]])).real + 0.0).tolist()
    [[[0.5, 0.0], [0.0, 0.25]]]
    """
    lines = as_square("a", a)
    n_freq, n, _ = lines.shape
    freq = optional_frequency(freq_hz, n_freq)
    return run("invert", (n, n_freq, lines), lines.shape, {"a": lines}, freq, on_singular)[0]


def reciprocal_condition(a: ArrayLike) -> FloatArray:
    """Reciprocal condition number 1/(|A| |A^-1|) of every line, infinity norm.

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.

    Returns
    -------
    ndarray, shape (n_freq,)
        0 where the line is singular or holds NaN or Inf.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.reciprocal_condition(np.array([np.diag([1.0, 1e-3]), np.zeros((2, 2))])).tolist()
    [0.001, 0.0]
    """
    lines = as_square("a", a)
    n_freq, n, _ = lines.shape
    return run("invert", (n, n_freq, lines), lines.shape, {"a": lines}, None, "nan")[1].rcond


def solve(
    a: ArrayLike, b: ArrayLike, *, freq_hz: ArrayLike | None = None, on_singular: OnSingular = "raise"
) -> ComplexArray:
    """Solve A X = B on every line (zgesv).

    Parameters
    ----------
    a : array_like, shape (n_freq, n, n)
        One matrix a line.
    b : array_like, shape (n_freq, n, n_rhs)
        Right-hand sides.
    freq_hz, on_singular
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
    lines = as_square("a", a)
    n_freq, n, _ = lines.shape
    right = as_lines("b", b, n, None, n_freq)
    freq = optional_frequency(freq_hz, n_freq)
    args = (n, right.shape[2], n_freq, lines, right)
    return run("solve", args, right.shape, {"a": lines, "b": right}, freq, on_singular)[0]
