"""Joint stiffness by FRF decoupling, any of the four equations (2.53)-(2.56)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, as_dofs, as_lines, as_square, check_choice, optional_frequency
from jointfrf.kernel.call import N_FREQ, run
from jointfrf.kernel.status import OnSingular

__all__ = ["Equation", "decouple"]

Equation = Literal["rr", "rs", "sr", "ss"]


def decouple(
    equation: Equation,
    h_a: ArrayLike,
    h_b: ArrayLike,
    h_c: ArrayLike,
    dofs_j: ArrayLike,
    dofs_k: ArrayLike,
    dofs_r: ArrayLike | None = None,
    dofs_s: ArrayLike | None = None,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Joint stiffness from FRFs of the assembly away from the joint and of both substructures.

    Parameters
    ----------
    equation : {"rr", "rs", "sr", "ss"}
        Responding and excited point: (2.53), (2.54), (2.55), (2.56).
    h_a : array_like, shape (n_freq, n_a, n_a)
        Receptance of A, m/N.
    h_b : array_like, shape (n_freq, n_b, n_b)
        Receptance of B.
    h_c : array_like, shape (n_freq, n, n)
        Measured receptance of the assembly between the points that `equation` names.
    dofs_j, dofs_k : array_like of int, shape (n,)
        Joint DOFs of A and of B, counted from 0, in the same order.
    dofs_r, dofs_s : array_like of int, shape (n,), optional
        Internal DOFs r of A and s of B; needed where `equation` names the point.
    freq_hz, on_singular, out
        As in `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        K*, N/m.

    Raises
    ------
    SingularLineError, ValueError
        As in `couple`.

    Notes
    -----
    All four are K* = (P M^-1 Q - H_jj - H_kk)^-1; for "ss", P = H_ks, M = H_ss - H_ss^C, Q = H_sk. They are exact
    without noise and very sensitive to it, to the model of both substructures, and to the band.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = jf.chain([1.0, 1.0], [2.0, 2.0], ground="start").receptance([0.1])
    >>> b = jf.chain([1.0, 1.0], [2.0, 2.0], ground="end").receptance([0.1])
    >>> c = jf.couple(a, b, [[3.0]], [1], [0])
    >>> jf.decouple("rr", a, b, c[:, :1, :1], [1], [0], dofs_r=[0]).real.round(10).tolist()
    [[[3.0]]]
    """
    check_choice("equation", equation, get_args(Equation))
    a = as_square("h_a", h_a, later=True)
    n_freq, n_a, _ = a.shape
    b = as_square("h_b", h_b, n_freq, later=True)
    n_b = b.shape[1]
    j = as_dofs("dofs_j", dofs_j, n_a)
    k = as_dofs("dofs_k", dofs_k, n_b)
    n = j.size
    if k.size != n or n == 0:
        raise ValueError(f"dofs_j and dofs_k must name the same number of DOFs, at least one: {n} and {k.size}")
    internal = []
    for point, dofs, total in (("r", dofs_r, n_a), ("s", dofs_s, n_b)):
        if point not in equation:
            internal.append(np.zeros(n, np.int32))
            continue
        if dofs is None:
            raise ValueError(f"equation {equation!r} needs dofs_{point}")
        where = as_dofs(f"dofs_{point}", dofs, total)
        if where.size != n:
            raise ValueError(f"dofs_{point} must name {n} DOFs, as many as the joint has, not {where.size}")
        internal.append(where)
    c = as_lines("h_c", h_c, n, n, n_freq, later=True)
    freq = optional_frequency(freq_hz, n_freq)
    args = (equation, n_a, n_b, n, N_FREQ, a, b, c, j, k, *internal)
    sweeps = {"h_a": a, "h_b": b, "h_c": c}
    return run("decouple", args, (n_freq, n, n), sweeps, freq, on_singular, out=out)[0]
