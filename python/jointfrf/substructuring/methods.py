"""Methods that give K*(w) line by line: decoupling (2.53)-(2.56), and a table of all with their arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.choices import StiffnessMethod
from jointfrf.kernel.arguments import (
    ComplexArray,
    as_dof_pairs,
    as_dofs,
    as_lines,
    as_square,
    check_choice,
    optional_frequency,
)
from jointfrf.kernel.call import N_FREQ, OnSingular, run
from jointfrf.substructuring.modification import inverse_substructuring, ismm

__all__ = ["STIFFNESS_METHODS", "JointFrfs", "StiffnessMethod", "decouple", "joint_stiffness"]

Equation = Literal["rr", "rs", "sr", "ss"]
#: Fields of the substructures that all decoupling equations need.
_SUBSTRUCTURES = ("h_a", "h_b", "dofs_j", "dofs_k")


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
    """Return the joint stiffness from FRFs of the assembly away from the joint and of both substructures.

    Parameters
    ----------
    equation : {"rr", "rs", "sr", "ss"}
        Responding and excited point: (2.53), (2.54), (2.55), (2.56).
    h_a : array_like, shape (n_freq, n_a, n_a)
        Receptance of A, m/N.
    h_b : array_like, shape (n_freq, n_b, n_b)
        Receptance of B, m/N.
    h_c : array_like, shape (n_freq, n, n)
        Measured receptance of the assembly between the points of `equation`, m/N.
    dofs_j, dofs_k : array_like of int, shape (n,)
        Joint DOFs of A and of B, counted from 0, in the same order.
    dofs_r, dofs_s : array_like of int, shape (n,), optional
        Internal DOFs r of A and s of B; needed if `equation` contains the point.
    freq_hz, on_singular, out
        Frequencies, Hz, treatment of singular lines, and array for the result; see `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        Dynamic stiffness K*, N/m.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple`.

    See Also
    --------
    inverse_substructuring : K* from FRFs at the joint.
    identify_model : fit of a joint to FRFs away from it.

    Notes
    -----
    All four are K* = (P M^-1 Q - H_jj - H_kk)^-1; for "ss", P = H_ks, M = H_ss - H_ss^C, Q = H_sk. They are exact
    without noise and very sensitive to it, to the models of both substructures, and to the band.

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
    j, k = as_dof_pairs(("dofs_j", dofs_j, n_a), ("dofs_k", dofs_k, n_b))
    n = j.size
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


@dataclass(frozen=True, kw_only=True)
class JointFrfs:
    """FRFs of a joint and its substructures; each method needs some of them.

    Attributes
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Measured receptance of the assembly at joint DOFs j, then k, m/N.
    alpha : array_like, shape (n_freq, 2 n, 2 n)
        Calculated receptance of the assembly with the initial value K0 at the same DOFs, m/N.
    k_initial : array_like, shape (n_freq, n, n) or (n, n)
        Initial value K0, N/m.
    h_a, h_b : array_like, shapes (n_freq, n_a, n_a), (n_freq, n_b, n_b)
        Receptances of the substructures, m/N.
    h_c : array_like, shape (n_freq, n, n)
        Measured receptance of the assembly between the internal points of a decoupling equation, m/N.
    """

    gamma: ArrayLike | None = None
    alpha: ArrayLike | None = None
    k_initial: ArrayLike | None = None
    h_a: ArrayLike | None = None
    h_b: ArrayLike | None = None
    h_c: ArrayLike | None = None
    dofs_j: ArrayLike | None = None
    dofs_k: ArrayLike | None = None
    dofs_r: ArrayLike | None = None
    dofs_s: ArrayLike | None = None


class LineMethod(NamedTuple):
    """How a method computes K*(w).

    Attributes
    ----------
    lines : callable
        Function of the needed fields by keyword, then `freq_hz` and `on_singular`.
    measured : {"gamma", "h_c"}
        Name of the measured field of `JointFrfs`.
    model : tuple of str
        Fields that come from models.
    """

    lines: Callable[..., ComplexArray]
    measured: Literal["gamma", "h_c"]
    model: tuple[str, ...] = ()


#: The methods by name.
STIFFNESS_METHODS: Mapping[StiffnessMethod, LineMethod] = {
    "ismm": LineMethod(ismm, "gamma", ("alpha", "k_initial")),
    "ismm-kj": LineMethod(partial(ismm, block="kj"), "gamma", ("alpha", "k_initial")),
    "inverse-substructuring": LineMethod(inverse_substructuring, "gamma"),
    "decoupling-rr": LineMethod(partial(decouple, "rr"), "h_c", (*_SUBSTRUCTURES, "dofs_r")),
    "decoupling-rs": LineMethod(partial(decouple, "rs"), "h_c", (*_SUBSTRUCTURES, "dofs_r", "dofs_s")),
    "decoupling-sr": LineMethod(partial(decouple, "sr"), "h_c", (*_SUBSTRUCTURES, "dofs_r", "dofs_s")),
    "decoupling-ss": LineMethod(partial(decouple, "ss"), "h_c", (*_SUBSTRUCTURES, "dofs_s")),
}


def joint_stiffness(
    method: StiffnessMethod, frfs: JointFrfs, *, freq_hz: ArrayLike | None = None, on_singular: OnSingular = "raise"
) -> ComplexArray:
    """Return the joint stiffness by one of the methods.

    Parameters
    ----------
    method : str
        Name of the method, a key of `STIFFNESS_METHODS`: (2.47) with D_jk or D_kj, its short form -(gamma^-1)_jk, or
        (2.53)-(2.56).
    frfs : JointFrfs
        FRFs, at least those that the method needs; further ones are ignored.
    freq_hz, on_singular
        Frequencies, Hz, and treatment of singular lines; see `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        Dynamic stiffness K*, N/m.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple`; a field that the method needs is missing.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> from jointfrf.substructuring.methods import JointFrfs, joint_stiffness
    >>> h = np.full((1, 1, 1), 0.5)
    >>> frfs = JointFrfs(gamma=jf.couple(h, h, [[3.0]], [0], [0]))
    >>> joint_stiffness("inverse-substructuring", frfs).real.round(12).tolist()
    [[[3.0]]]
    """
    check_choice("method", method, tuple(STIFFNESS_METHODS))
    own = STIFFNESS_METHODS[method]
    given = {name: getattr(frfs, name) for name in (own.measured, *own.model)}
    if any(value is None for value in given.values()):
        # The message names the measured FRFs only if they are missing themselves.
        needed = [name for name in given if name in own.model or given[name] is None]
        raise ValueError(f"method {method!r} needs {' and '.join(filter(None, (', '.join(needed[:-1]), needed[-1])))}")
    return own.lines(**given, freq_hz=freq_hz, on_singular=on_singular)
