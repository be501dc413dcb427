"""Receptances of a locally modified structure (2.31)-(2.36) and the inverse problem (2.40)."""

from __future__ import annotations

from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, as_dofs, as_joint_lines, as_square, optional_frequency
from jointfrf.kernel.call import N_FREQ, run
from jointfrf.kernel.status import OnSingular

__all__ = ["find_modification", "modify"]


def modify(
    alpha: ArrayLike,
    d: ArrayLike,
    dofs: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Receptance after a local modification.

    Parameters
    ----------
    alpha : array_like, shape (n_freq, n, n)
        Receptance before, m/N.
    d : array_like, shape (n_freq, n_m, n_m) or (n_m, n_m)
        Dynamic stiffness added at the modified DOFs, Delta K - w^2 Delta M + i Delta H (2.32), N/m.
    dofs : array_like of int, shape (n_m,)
        The modified DOFs, counted from 0.
    freq_hz, on_singular, out
        As in `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        gamma.

    Raises
    ------
    SingularLineError, ValueError
        As in `couple`.

    Notes
    -----
    Eqs. (2.34)-(2.36) for all DOFs at once: gamma = alpha - alpha_:m (I + D alpha_mm)^-1 D alpha_m:. Misprint in
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
        As in `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        Dynamic stiffness added, N/m.

    Raises
    ------
    SingularLineError, ValueError
        As in `couple`.

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
