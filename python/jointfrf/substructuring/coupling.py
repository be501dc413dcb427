"""Receptances of substructures joined by a complex stiffness (2.24)-(2.26), masses, constraints; model mixing."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.noise_model import estimate_noise
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_dof_pairs,
    as_dofs,
    as_frequency,
    as_joint_lines,
    as_lines,
    as_not_negative,
    as_number,
    as_real,
    as_square,
    check_choice,
    check_finite_lines,
    checked_out,
    optional_frequency,
)
from jointfrf.kernel.call import N_FREQ, OnSingular, run
from jointfrf.kernel.linear_algebra import solve_lines
from jointfrf.laws.law_joint import Connection, LawJoint

__all__ = [
    "connect", "connection_forces", "couple", "lost_rcond", "motions_across", "redundant_ties", "semm",
    "semm_standard_error",
]  # fmt: skip

SemmMethod = Literal["original", "extended"]


def connection_forces(
    between: ComplexArray, link: Connection, freq_hz: FloatArray | None = None, on_singular: OnSingular = "raise"
) -> ComplexArray:
    """Return W of Y = H - H E W E^T H: forces of connections by the free motions across them.

    Parameters
    ----------
    between : ndarray, shape (n_freq, q, q)
        E^T H E: receptances of the structures across the connections before they are connected, m/N.
    link : Connection
        Connection S f = T u with q motions u = E^T x.

    Returns
    -------
    ndarray, shape (n_freq, q, q)
        Matrix (S + T E^T H E)^-1 T, N/m; S = 0 is the dual form of a constraint, S = 1 the form of a modification
        (2.35).

    Raises
    ------
    SingularLineError
        A line is singular to working precision, unless `on_singular` is "nan".
    """
    link = _without_redundant(link)
    left = link.s + link.t @ between
    # A constraint and a stiffness have rows of very different size.
    size = abs(left).max(axis=2, keepdims=True)
    size[size == 0] = 1
    return solve_lines(left / size, link.t / size, freq_hz, on_singular, lost_rcond(left.shape[1]))


def lost_rcond(q: int) -> float:
    """Return the reciprocal condition number below which rounding leaves no digit of the solution of q equations."""
    return q * float(np.finfo(np.float64).eps)


def redundant_ties(ends: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Return which rigid ties follow from earlier ones.

    Parameters
    ----------
    ends : ndarray of int, shape (m, 2)
        DOFs that each tie makes equal; one number represents the ground.

    Notes
    -----
    The ties are the incidence matrix of a graph: its rank is the size of a spanning forest, and a tie that closes a
    cycle adds none.
    """
    parent: dict[int, int] = {}

    def root(dof: int) -> int:
        while (above := parent.get(dof, dof)) != dof:
            parent[dof] = dof = parent.get(above, above)  # path halving
        return dof

    found = np.zeros(len(ends), bool)
    for i, (one, other) in enumerate(ends.tolist()):
        first, second = root(one), root(other)
        found[i] = first == second
        parent[first] = second
    return found


def _without_redundant(link: Connection) -> Connection:
    """Return a connection with zero forces in rigid connections that follow from others: S = 1, T = 0 there."""
    rigid = np.flatnonzero(~link.s.any(axis=(0, 2)))
    if rigid.size < 2 or not len(link.s):
        return link
    dofs = np.where(link.pattern[:, rigid], np.arange(1, len(link.pattern) + 1)[:, None], 0)
    spare = rigid[redundant_ties(np.sort(np.pad(dofs, [(1, 0), (0, 0)]), axis=0)[-2:].T)]  # 0 for the ground
    if not spare.size:
        return link
    s, t = link.s.copy(), link.t.copy()
    s[:, spare, spare], t[:, spare] = 1, 0
    return link._replace(s=s, t=t)


def motions_across(h: ComplexArray, pattern: FloatArray) -> ComplexArray:
    """Return H E, shape (n_freq, n, q), of H of shape (n_freq, n, m).

    Notes
    -----
    A column of E has one or two entries: with many connections a dense product takes ten times as long.
    """
    found = np.zeros((*h.shape[:2], pattern.shape[1]), np.complex128)
    for rows, factors in _entries(pattern.shape, pattern.tobytes()):
        found += h[:, :, rows] * factors
    return found


@lru_cache(maxsize=8)  # a fit connects the same DOFs thousands of times
def _entries(shape: tuple[int, ...], pattern: bytes) -> list[tuple[NDArray[np.intp], FloatArray]]:
    """Return rows and values of the first, the second, ... entry of each column; the rest of a column is zero."""
    values = np.frombuffer(pattern).reshape(shape)
    is_entry = values != 0
    rows = np.argsort(~is_entry, axis=0, kind="stable")[: int(is_entry.sum(axis=0).max(initial=0))]
    return list(zip(rows, np.take_along_axis(values, rows, axis=0), strict=True))


def connect(
    h: ComplexArray, link: Connection, freq_hz: FloatArray | None = None, on_singular: OnSingular = "raise"
) -> ComplexArray:
    """Return the receptances with the connections, shape (n_freq, m, m)."""
    to_out = motions_across(h, link.pattern)
    to_in = motions_across(h.swapaxes(1, 2), link.pattern).swapaxes(1, 2)
    between = motions_across(to_in, link.pattern)
    w = connection_forces(between, link, freq_hz, on_singular)
    return np.ascontiguousarray(h - to_out @ w @ to_in)


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
    """Return the receptance of the assembly of A and B through a flexible joint, all blocks.

    Parameters
    ----------
    h_a : array_like, shape (n_freq, n_a, n_a)
        Receptance of A, m/N (rotational rows rad/N, rotational columns m/(N m)).
    h_b : array_like, shape (n_freq, n_b, n_b)
        Receptance of B, m/N.
    k_joint : array_like, shape (n_freq, n_j, n_j) or (n_j, n_j)
        Complex joint stiffness K*, N/m (rotational N m/rad); a DOF may have no stiffness. Or, with `freq_hz`, a `Joint`
        or a `LawJoint`, which may have rigid DOFs and masses.
    dofs_a, dofs_b : array_like of int, shape (n_j,)
        Joint DOFs j of A and k of B, counted from 0, in the same order.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies, Hz, for the message about a singular line; needed for a `Joint` or `LawJoint`.
    on_singular : {"raise", "nan"}
        Whether a singular line raises an error (default) or becomes NaN.
    out : ndarray of complex128, optional
        Array for the result, see `invert`.

    Returns
    -------
    ndarray, shape (n_freq, n_a + n_b, n_a + n_b)
        Receptance, m/N, for DOFs of A, then DOFs of B.

    Raises
    ------
    SingularLineError
        The joint and the substructures resonate without damping at a line.
    ValueError
        Wrong shapes or DOFs; NaN or Inf in a line.

    See Also
    --------
    couple_bodies : any number of bodies and joints.
    assemble : matrices of the assembly of two models.

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
    j, k = as_dof_pairs(("dofs_a", dofs_a, n_a), ("dofs_b", dofs_b, n_b))
    if isinstance(k_joint, Joint | LawJoint):
        if freq_hz is None:
            raise ValueError("freq_hz is missing, on which the stiffness of a joint depends; give it")
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
    """Return the receptance with constraints and masses, too."""
    n_a, n = a.shape[1], a.shape[1] + b.shape[1]
    h = np.zeros((freq_hz.size, n, n), np.complex128)
    for name, lines in (("h_a", a), ("h_b", b)):
        check_finite_lines(name, lines, freq_hz)
    h[:, :n_a, :n_a], h[:, n_a:, n_a:] = a, b
    joint.check_at_points("couple connects points")
    link = joint.connection(2 * np.pi * freq_hz)
    pattern = np.zeros((n, link.pattern.shape[1]))
    pattern[np.concatenate([dofs[0], n_a + dofs[1]])] = link.pattern
    found = connect(h, link._replace(pattern=pattern), freq_hz, on_singular)
    if out is None:
        return found
    checked_out(out, found.shape, (a, b), {})[...] = found
    return out


def semm(
    h_model: ArrayLike,
    h_measured: ArrayLike,
    outputs: ArrayLike,
    inputs: ArrayLike | None = None,
    *,
    method: SemmMethod = "extended",
    rcond: float = 1e-12,
    freq_hz: ArrayLike | None = None,
) -> ComplexArray:
    """Return measured FRFs expanded to all DOFs of a model.

    Parameters
    ----------
    h_model : array_like, shape (n_freq, n, n)
        FRFs of the parent model between all wanted DOFs g, m/N.
    h_measured : array_like, shape (n_freq, m_o, m_i)
        Measured FRFs, m/N.
    outputs, inputs : array_like of int, shape (m_o,), (m_i,)
        DOFs of the model at which responses and forces were measured, counted from 0; `inputs` are the `outputs` by
        default.
    method : {"original", "extended"}
        Part of the parent model that is removed: the measured DOFs only, or all of its DOFs, so that less of the model
        remains in the result.
    rcond : float
        Ratio to the largest singular value below which singular values are zero in the pseudo-inverses.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies, Hz, for the message about a singular line.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        FRFs, m/N. At the measured DOFs they are the measurement: its noise is expanded, too (`semm_standard_error`).

    Raises
    ------
    ValueError
        Wrong shapes or DOFs, NaN or Inf in a line.

    See Also
    --------
    semm_standard_error : standard errors of the expanded FRFs.
    identify_model : fit of a joint to the measured FRFs without expansion.

    Notes
    -----
    Original: Y = Y_gg - Y_gb Y_bb^-1 (Y_bb - Y_meas) Y_bb^-1 Y_bg. Extended: Y = Y_gg - Y_gg Y_bg^+ (Y_bb - Y_meas)
    Y_gb^+ Y_gg, with pseudo-inverses. Both are the parent model, minus the removed one, plus the measurement, coupled
    at the measured and, for "extended", at all DOFs. To identify a joint with known noise, `identify_model` uses the
    same FRFs without expanding them.

    References
    ----------
    .. [1] S. W. B. Klaassen, M. V. van der Seijs, D. de Klerk, System equivalent model mixing, Mech. Syst. Signal
       Process. 105 (2018) 90-112.

    Examples
    --------
    A chain whose first spring is 10 % softer in the model, measured at its first mass:

    >>> import numpy as np, jointfrf as jf
    >>> freq = np.array([1.0])
    >>> real = jf.chain([5, 3], [2500, 3500], ground="start").receptance(freq)
    >>> model = jf.chain([5, 3], [2250, 3500], ground="start").receptance(freq)
    >>> mixed = jf.semm(model, real[:, :1, :1], [0], method="original")
    >>> bool(np.allclose(mixed, real))
    True
    """
    found = _expansion(h_model, outputs, inputs, method, rcond)
    measured = as_lines("h_measured", h_measured, found.outputs.size, found.inputs.size, len(found.model))
    freq = optional_frequency(freq_hz, len(measured))
    for name, lines in (("h_model", found.model), ("h_measured", measured)):
        check_finite_lines(name, lines, freq)
    wrong = found.model[:, found.outputs][:, :, found.inputs] - measured
    left, right = found.factors()
    mixed: ComplexArray = found.model - left @ wrong @ right
    return np.ascontiguousarray(mixed)


def semm_standard_error(
    h_model: ArrayLike,
    h_measured: ArrayLike,
    outputs: ArrayLike,
    inputs: ArrayLike | None = None,
    *,
    noise: float | ArrayLike | None = None,
    method: SemmMethod = "extended",
    rcond: float = 1e-12,
    freq_hz: ArrayLike | None = None,
) -> FloatArray:
    """Return the standard error of each FRF that `semm` expands, by noise of the measured ones.

    Parameters
    ----------
    h_model, h_measured, outputs, inputs, method, rcond
        FRFs and options; see `semm`.
    noise : float or array_like, shape (n_freq, m_o, m_i), optional
        Relative noise of the measured FRFs, or E|e|^2 of each, (m/N)^2. By default `estimate_noise` estimates it, which
        needs `freq_hz`.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies, Hz.

    Returns
    -------
    ndarray of float, shape (n_freq, n, n)
        Standard error sqrt(E|e|^2), m/N, of real and imaginary part together. In 95 % of cases |Y - true| is below 1.73
        standard errors, and each part is within 1.96 / sqrt(2) standard errors.

    Raises
    ------
    ValueError
        Wrong shapes or DOFs, NaN or Inf in a line, noise that is negative; FRFs whose noise cannot be estimated.

    See Also
    --------
    semm : the expanded FRFs.
    estimate_noise : noise of measured FRFs.

    Notes
    -----
    Y is linear in the measured FRFs, Y = ... + L Y_meas R. The result is therefore exact for circular noise that is
    independent between them: E|e_ab|^2 = sum |L_ap|^2 E|e_pq|^2 |R_qb|^2. If the FRFs were made reciprocal before, h_pq
    and h_qp have one noise, with |L_ap R_qb + L_aq R_pb|^2 for each pair. Errors of the parent model are not included.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.array([1.0])
    >>> model = jf.chain([5, 3], [2250, 3500], ground="start").receptance(freq)
    >>> error = jf.semm_standard_error(model, model[:, :1, :1], [0], noise=0.01, method="original")
    >>> np.round(error / abs(model), 4)[0, 0].tolist()
    [0.01, 0.01]
    """
    expansion = _expansion(h_model, outputs, inputs, method, rcond)
    shape = (len(expansion.model), expansion.outputs.size, expansion.inputs.size)
    measured = as_lines("h_measured", h_measured, shape[1], shape[2], shape[0])
    freq = optional_frequency(freq_hz, shape[0])
    for name, lines in (("h_model", expansion.model), ("h_measured", measured)):
        check_finite_lines(name, lines, freq)
    is_square = np.array_equal(expansion.outputs, expansion.inputs)
    if noise is None:
        if freq is None:
            raise ValueError("freq_hz is missing, from which the noise of h_measured is found; give it, or noise")
        found = estimate_noise(freq, measured, reciprocal=is_square)
        if found.source == "none":
            raise ValueError("h_measured has too few lines or too little noise to estimate it; give noise")
        variance = found.variance
    elif np.ndim(noise) == 0:
        variance = np.asarray(as_not_negative("noise", noise) ** 2 * abs(measured) ** 2, np.float64)
    else:
        variance = as_real("noise", noise, shape)
        if (variance < 0).any():
            raise ValueError("noise must be variances E|e|^2 of each measured FRF, none below 0")
    left, right = expansion.factors()
    total = abs(left) ** 2 @ variance @ abs(right) ** 2
    if is_square and np.allclose(measured, measured.swapaxes(1, 2), rtol=1e-9, atol=0):
        # 2 Re of the cross products of h_pq and h_qp.
        off = np.where(np.eye(shape[1], dtype=bool), 0, variance)
        across = np.einsum("lap,lpq,laq,lqb,lpb->lab", left, off, left.conj(), right, right.conj(), optimize=True)
        total = total + across.real
    return np.sqrt(np.maximum(total, 0))


class _Expansion(NamedTuple):
    """A parent model, the places of the measured DOFs, and the method of expansion."""

    model: ComplexArray
    outputs: NDArray[np.int32]
    inputs: NDArray[np.int32]
    method: SemmMethod
    rcond: float

    def factors(self) -> tuple[ComplexArray, ComplexArray]:
        """Return L and R: Y changes by L (Y_meas - Y_bb) R."""
        model, out, into = self.model, self.outputs, self.inputs
        if self.method == "original":
            inverse = np.linalg.pinv(model[:, out][:, :, into], rcond=self.rcond)
            return model[:, :, into] @ inverse, inverse @ model[:, out]
        left = model @ np.linalg.pinv(model[:, out], rcond=self.rcond)
        return left, np.linalg.pinv(model[:, :, into], rcond=self.rcond) @ model


def _expansion(
    h_model: ArrayLike, outputs: ArrayLike, inputs: ArrayLike | None, method: SemmMethod, rcond: float
) -> _Expansion:
    """Check the arguments of `semm` and return the expansion."""
    check_choice("method", method, get_args(SemmMethod))
    model = as_lines("h_model", h_model)
    n, columns = model.shape[1:]
    if n != columns:
        raise ValueError(f"h_model must be square, not {n} x {columns}")
    out = as_dofs("outputs", outputs, n) - 1
    into = out if inputs is None else as_dofs("inputs", inputs, n) - 1
    return _Expansion(model, out, into, method, as_number("rcond", rcond))
