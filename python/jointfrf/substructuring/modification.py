"""Receptances of a modified structure (2.31)-(2.36); the joint by inverse structural modification (2.40)-(2.48)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import (
    ComplexArray,
    as_dofs,
    as_interface,
    as_joint_lines,
    as_square,
    check_choice,
    optional_frequency,
)
from jointfrf.kernel.call import N_FREQ, OnSingular, run

__all__ = ["find_modification", "inverse_substructuring", "ismm", "modify"]

#: Off-diagonal block of (2.48) from which K* is taken: rows of side j, or of side k.
Block = Literal["jk", "kj"]


def modify(
    alpha: ArrayLike,
    d: ArrayLike,
    dofs: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Return the receptance after a local modification.

    Parameters
    ----------
    alpha : array_like, shape (n_freq, n, n)
        Receptance before, m/N.
    d : array_like, shape (n_freq, n_m, n_m) or (n_m, n_m)
        Dynamic stiffness added at the modified DOFs, Delta K - w^2 Delta M + i Delta H (2.32), N/m.
    dofs : array_like of int, shape (n_m,)
        Modified DOFs, counted from 0.
    freq_hz, on_singular, out
        Frequencies, Hz, treatment of singular lines, and array for the result; see `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        Receptance gamma after the modification, m/N.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple`.

    See Also
    --------
    find_modification : the inverse.

    Notes
    -----
    Eqs. (2.34)-(2.36) for all DOFs a at once: gamma = alpha - alpha_am (I + D alpha_mm)^-1 D alpha_ma. Misprint in
    (2.36): the second line must read gamma_um = alpha_um (I - D_mm gamma_mm); it has alpha_mu.

    Examples
    --------
    A spring of 2 N/m doubled:

    >>> import jointfrf as jf
    >>> jf.modify([[[0.5]]], [[2.0]], [0]).real.tolist()
    [[[0.25]]]
    """
    before = as_square("alpha", alpha, later=True)
    n_freq, n, _ = before.shape
    where = as_dofs("dofs", dofs, n)
    if where.size == 0:
        raise ValueError("dofs must name at least one DOF")
    added = as_joint_lines("d", d, where.size, n_freq)
    freq = optional_frequency(freq_hz, n_freq)
    args = (n, where.size, N_FREQ, before, added, where)
    return run("modify", args, before.shape, {"alpha": before, "d": added}, freq, on_singular, out=out)[0]


def find_modification(
    alpha: ArrayLike,
    gamma: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Return the modification D = alpha^-1 (alpha - gamma) gamma^-1 that turns alpha into gamma (2.40), (2.47).

    Parameters
    ----------
    alpha, gamma : array_like, shape (n_freq, n, n)
        Receptances before and after at the modified DOFs, m/N.
    freq_hz, on_singular, out
        Frequencies, Hz, treatment of singular lines, and array for the result; see `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        Dynamic stiffness added, N/m.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple`.

    See Also
    --------
    modify : the inverse.
    ismm : K* of a joint by a modification.

    Notes
    -----
    The product form keeps its digits for a weak modification, where gamma^-1 - alpha^-1 cancels.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.find_modification([[[0.5]]], [[[0.25]]]).real.tolist()
    [[[2.0]]]
    """
    before = as_square("alpha", alpha, later=True)
    n_freq, n, _ = before.shape
    after = as_square("gamma", gamma, n_freq, later=True)
    if after.shape != before.shape:
        raise ValueError(f"gamma must have the shape of alpha, {before.shape}, not {after.shape}")
    freq = optional_frequency(freq_hz, n_freq)
    sweeps = {"alpha": before, "gamma": after}
    return run("find_modification", (n, N_FREQ, before, after), before.shape, sweeps, freq, on_singular, out=out)[0]


def _with_block_first(lines: ComplexArray, n: int, block: Block) -> ComplexArray:
    """Return FRFs in the order of sides that a block names: as they are, or a copy with sides j and k exchanged."""
    check_choice("block", block, get_args(Block))
    if block == "jk":
        return lines
    order = np.roll(np.arange(2 * n), n)
    return np.ascontiguousarray(lines[:, order[:, None], order])


def ismm(
    alpha: ArrayLike,
    gamma: ArrayLike,
    k_initial: ArrayLike,
    *,
    block: Block = "jk",
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Return the joint stiffness K* = K0 + Delta by the inverse structural modification method.

    Parameters
    ----------
    alpha : array_like, shape (n_freq, 2 n, 2 n)
        Calculated receptance of the assembly with K0 at joint DOFs j, then k, m/N.
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Measured receptance of the assembly at the same DOFs, m/N.
    k_initial : array_like, shape (n_freq, n, n) or (n, n)
        Initial value K0, N/m.
    block : {"jk", "kj"}
        Off-diagonal block from which K* is taken. Both contain the same joint and agree if gamma is symmetric. For
        measured FRFs, gamma_jk and gamma_kj have separate noise, and the blocks are two estimates. "kj" copies the
        FRFs, with the sides exchanged.
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
    inverse_substructuring : the same without a model.
    identify_band_mean : mean of K* over bands.

    Notes
    -----
    Eqs. (2.47), (2.48): D = alpha^-1 (alpha - gamma) gamma^-1 contains -Delta twice off its diagonal, so that
    K* = K0 - D_jk, and K* = K0 - D_kj. Only the chosen block is formed. If alpha was assembled through K0,
    substructures and initial value cancel, and the result equals `inverse_substructuring`. With any other alpha, such
    as a truncated modal model, it does not.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.full((1, 1, 1), 0.5)
    >>> alpha, gamma = (jf.couple(h, h, [[k]], [0], [0]) for k in (1.0, 3.0))
    >>> jf.ismm(alpha, gamma, [[1.0]]).real.round(12).tolist()
    [[[3.0]]]
    """
    calculated, n = as_interface("alpha", alpha)
    n_freq = calculated.shape[0]
    measured, m = as_interface("gamma", gamma, n_freq)
    if m != n:
        raise ValueError(f"gamma must have the shape of alpha, {calculated.shape}, not {measured.shape}")
    first = as_joint_lines("k_initial", k_initial, n, n_freq)
    calculated, measured = (_with_block_first(lines, n, block) for lines in (calculated, measured))
    freq = optional_frequency(freq_hz, n_freq)
    sweeps = {"alpha": calculated, "gamma": measured, "k_initial": first}
    args = (n, N_FREQ, calculated, measured, first)
    return run("ismm", args, first.shape, sweeps, freq, on_singular, out=out)[0]


def inverse_substructuring(
    gamma: ArrayLike,
    *,
    block: Block = "jk",
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Return the joint stiffness K* = -(gamma^-1)_jk, to which ISMM reduces, without model and initial value.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Measured receptance of the assembly at joint DOFs j, then k, m/N.
    block : {"jk", "kj"}
        Off-diagonal block from which K* is taken; see `ismm`.
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
    joint_compliance : K*^-1, with less bias by noise.
    ismm : K* with a model.

    Notes
    -----
    gamma^-1 = [[Z_A + K*, -K*], [-K*, Z_B + K*]]: the off-diagonal blocks contain the joint only.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.full((1, 1, 1), 0.5)
    >>> jf.inverse_substructuring(jf.couple(h, h, [[3.0]], [0], [0])).real.round(12).tolist()
    [[[3.0]]]
    """
    measured, n = as_interface("gamma", gamma)
    n_freq = measured.shape[0]
    measured = _with_block_first(measured, n, block)
    freq = optional_frequency(freq_hz, n_freq)
    shape, sweeps = (n_freq, n, n), {"gamma": measured}
    return run("inverse_substructuring", (n, N_FREQ, measured), shape, sweeps, freq, on_singular, out=out)[0]
