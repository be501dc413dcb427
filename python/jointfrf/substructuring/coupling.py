"""Receptances of two substructures joined by a complex joint stiffness (2.24)-(2.26)."""

from __future__ import annotations

from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, as_dofs, as_joint_lines, as_square, optional_frequency
from jointfrf.kernel.call import N_FREQ, run
from jointfrf.kernel.status import OnSingular

__all__ = ["couple"]


def couple(
    h_a: ArrayLike,
    h_b: ArrayLike,
    k_joint: ArrayLike,
    dofs_a: ArrayLike,
    dofs_b: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Receptance of the assembly of A and B through a flexible joint, all blocks.

    Parameters
    ----------
    h_a : array_like, shape (n_freq, n_a, n_a)
        Receptance of A, m/N (rotational rows rad/N, rotational columns m/(N m)).
    h_b : array_like, shape (n_freq, n_b, n_b)
        Receptance of B.
    k_joint : array_like, shape (n_freq, n_j, n_j) or (n_j, n_j)
        Complex joint stiffness K*, N/m (rotational N m/rad). A DOF without stiffness is allowed.
    dofs_a, dofs_b : array_like of int, shape (n_j,)
        Joint DOFs j of A and k of B, counted from 0, in the same order.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies in Hz, to name a bad line.
    on_singular : {"raise", "nan"}
        Whether a bad line raises or becomes NaN.
    out : ndarray of complex128, optional
        Where the result goes, as in `invert`.

    Returns
    -------
    ndarray, shape (n_freq, n_a + n_b, n_a + n_b)
        DOFs of A, then DOFs of B.

    Raises
    ------
    SingularLineError
        The joint and the substructures resonate without damping at a line.
    ValueError
        Wrong shapes or DOFs; NaN or Inf in a line.

    Notes
    -----
    Eq. (2.26) with Z^-1 = (I + K* (H_jj + H_kk))^-1 K*. In the thesis the entry jj lacks its first term H_jj.

    Examples
    --------
    Two masses of 1 kg, 2 N/m to ground each, coupled by 3 N/m, at rest:

    >>> import numpy as np, jointfrf as jf
    >>> h = np.full((1, 1, 1), 0.5)
    >>> jf.couple(h, h, [[3.0]], [0], [0]).real.round(4).tolist()
    [[[0.3125, 0.1875], [0.1875, 0.3125]]]
    """
    a = as_square("h_a", h_a, later=True)
    n_freq, n_a, _ = a.shape
    b = as_square("h_b", h_b, n_freq, later=True)
    n_b = b.shape[1]
    j = as_dofs("dofs_a", dofs_a, n_a)
    k = as_dofs("dofs_b", dofs_b, n_b)
    if j.size != k.size or j.size == 0:
        raise ValueError(f"dofs_a and dofs_b must name the same number of DOFs, at least one: {j.size} and {k.size}")
    joint = as_joint_lines("k_joint", k_joint, j.size, n_freq)
    freq = optional_frequency(freq_hz, n_freq)
    args = (n_a, n_b, j.size, N_FREQ, a, b, joint, j, k)
    shape = (n_freq, n_a + n_b, n_a + n_b)
    return run("couple", args, shape, {"h_a": a, "h_b": b, "k_joint": joint}, freq, on_singular, out=out)[0]
