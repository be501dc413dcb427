"""Receptances of two substructures joined by a complex joint stiffness (2.24)-(2.26)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.joint import Joint
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_dofs,
    as_frequency,
    as_joint_lines,
    as_square,
    check_finite_lines,
    checked_out,
    optional_frequency,
)
from jointfrf.kernel.call import N_FREQ, run
from jointfrf.kernel.status import OnSingular
from jointfrf.laws.law_joint import LawJoint
from jointfrf.substructuring.connection import connect

__all__ = ["couple"]


def couple(
    h_a: ArrayLike,
    h_b: ArrayLike,
    k_joint: ArrayLike | Joint | LawJoint,
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
        Complex joint stiffness K*, N/m (rotational N m/rad). A DOF without stiffness is allowed. Or a `Joint` or
        `LawJoint`, with `freq_hz`: the latter may have rigid DOFs and masses.
    dofs_a, dofs_b : array_like of int, shape (n_j,)
        Joint DOFs j of A and k of B, counted from 0, in the same order.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies in Hz, to name a bad line; needed for a `Joint` or `LawJoint`.
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
    if isinstance(k_joint, Joint | LawJoint):
        if freq_hz is None:
            raise ValueError("freq_hz is needed: the stiffness of a joint depends on frequency")
        if len(k_joint.dofs) != j.size:
            raise ValueError(f"the joint has {len(k_joint.dofs)} DOFs, dofs_a and dofs_b name {j.size}")
        if isinstance(k_joint, LawJoint) and (k_joint.rigid or k_joint.mass):
            return _coupled(a, b, k_joint, (j - 1, k - 1), as_frequency(freq_hz, n_freq), on_singular, out)
        k_joint = k_joint.dynamic_stiffness(as_frequency(freq_hz, n_freq))
    joint = as_joint_lines("k_joint", k_joint, j.size, n_freq)
    freq = optional_frequency(freq_hz, n_freq)
    args = (n_a, n_b, j.size, N_FREQ, a, b, joint, j, k)
    shape = (n_freq, n_a + n_b, n_a + n_b)
    return run("couple", args, shape, {"h_a": a, "h_b": b, "k_joint": joint}, freq, on_singular, out=out)[0]


def _coupled(
    a: ComplexArray,
    b: ComplexArray,
    joint: LawJoint,
    dofs: tuple[NDArray[np.int32], NDArray[np.int32]],
    freq_hz: FloatArray,
    on_singular: OnSingular,
    out: ComplexArray | None,
) -> ComplexArray:
    """Couple through constraints and masses, too."""
    n_a, n = a.shape[1], a.shape[1] + b.shape[1]
    h = np.zeros((freq_hz.size, n, n), np.complex128)
    for name, lines in (("h_a", a), ("h_b", b)):
        check_finite_lines(name, lines, freq_hz)
    h[:, :n_a, :n_a], h[:, n_a:, n_a:] = a, b
    link = joint.connection(2 * np.pi * freq_hz)
    pattern = np.zeros((n, link.pattern.shape[1]))
    pattern[np.concatenate([dofs[0], n_a + dofs[1]])] = link.pattern
    found = connect(h, link._replace(pattern=pattern), freq_hz, on_singular)
    if out is None:
        return found
    checked_out(out, found.shape, (a, b), {})[...] = found
    return out
