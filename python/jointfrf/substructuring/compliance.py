"""Joint compliance K*^-1 from interface FRFs with its covariance; joints between many channels without rotations."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.channels.virtual_point import VirtualPoint, check_sides
from jointfrf.errors import IdentificationWarning, SingularLineError
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_integer,
    as_interface,
    as_positive,
    as_real,
    as_square,
    check_finite_lines,
    optional_frequency,
)
from jointfrf.kernel.call import N_FREQ, OnSingular, run

__all__ = [
    "MultiPointJoint",
    "compliance_covariance",
    "compliance_factors",
    "joint_compliance",
    "multi_point_compliance",
    "multi_point_stiffness",
]

#: Ratio of the smallest to the largest singular value below which a matrix is singular, without truncation.
_SINGULAR = 1e-14


def joint_compliance(
    gamma: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Return the joint compliance C = K*^-1 without model, initial value or band.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Receptance of the assembly at joint DOFs j, then k, m/N.
    freq_hz, on_singular, out
        Frequencies, Hz, treatment of singular lines, and array for the result; see `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        Compliance C, m/N: relative displacement across the joint per force through it.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple`.

    See Also
    --------
    compliance_covariance : covariance of C by noise.
    inverse_substructuring : K* itself.
    identify : maximum likelihood from C of all lines.

    Notes
    -----
    C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj, exactly. Noise enters C almost linearly, but it enters K* through an
    inverse. A mean of K* over a band is biased towards zero if the noise exceeds the compliance; a mean of C is not.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.full((1, 1, 1), 0.5)
    >>> jf.joint_compliance(jf.couple(h, h, [[4.0]], [0], [0])).real.round(12).tolist()
    [[[0.25]]]
    """
    measured, n = as_interface("gamma", gamma)
    n_freq = measured.shape[0]
    freq = optional_frequency(freq_hz, n_freq)
    shape, sweeps = (n_freq, n, n), {"gamma": measured}
    return run("joint_compliance", (n, N_FREQ, measured), shape, sweeps, freq, on_singular, out=out)[0]


def compliance_factors(
    gamma: ArrayLike,
    transform: ArrayLike | None = None,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
) -> tuple[ComplexArray, ComplexArray]:
    """Return the derivative of the joint compliance by the measured FRFs: dC = U dh V, to first order.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Receptance of the linearisation, m/N.
    transform : array_like, shape (2 n, m), optional
        Matrix T of gamma = T h T^T; by default gamma itself was measured.
    freq_hz, on_singular
        Frequencies, Hz, and treatment of singular lines; see `couple`.

    Returns
    -------
    u : ndarray, shape (n_freq, n, m)
        Factor U.
    v : ndarray, shape (n_freq, m, n)
        Factor V.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple`.

    See Also
    --------
    joint_compliance : the compliance itself.
    compliance_covariance : covariance by these factors.

    Notes
    -----
    U = [L, -I] T and V = T^T [I; -R] with L = gamma_kk gamma_jk^-1 and R = gamma_jk^-1 gamma_jj.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> gamma = np.array([[[0.3125, 0.1875], [0.1875, 0.3125]]])
    >>> u, v = jf.compliance_factors(gamma)
    >>> dh = 1e-6 * np.array([[1.0, 2.0], [3.0, 4.0]])
    >>> change = jf.joint_compliance(gamma + dh) - jf.joint_compliance(gamma)
    >>> bool(abs(change - u @ dh @ v).max() < 1e-9)
    True
    """
    mean, n = as_interface("gamma", gamma)
    n_freq = mean.shape[0]
    t = as_real("transform", np.eye(2 * n) if transform is None else transform, (2 * n, None))
    m = t.shape[1]
    freq = optional_frequency(freq_hz, n_freq)
    args = (n, m, N_FREQ, mean, t)
    factors = run("compliance_factors", args, (n_freq, 2 * n, m), {"gamma": mean}, freq, on_singular)[0]
    return factors[:, :n], factors[:, n:].swapaxes(1, 2)


def compliance_covariance(
    gamma: ArrayLike,
    variance: ArrayLike,
    transform: ArrayLike | None = None,
    *,
    reciprocal: bool = True,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
) -> ComplexArray:
    """Return the covariance of the entries of the joint compliance by noise of the measured FRFs, to first order.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Receptance of the linearisation, m/N: a smoothed one, so that the weights do not follow the noise.
    variance : array_like, shape (n_freq, m, m)
        Noise variance E|e|^2 of the measured FRFs h, (m/N)^2; circular noise, independent between entries.
    transform : array_like, shape (2 n, m), optional
        Matrix T of gamma = T h T^T; by default gamma itself was measured.
    reciprocal : bool
        Whether h was symmetrised, (h + h^T)/2, before.
    freq_hz, on_singular
        Frequencies, Hz, and treatment of singular lines; see `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n * n, n * n)
        Covariance E[dC_ab conj(dC_cd)] at row a n + b, column c n + d, (m/N)^2.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple`.

    See Also
    --------
    joint_compliance : the compliance itself.
    compliance_factors : its derivative.

    Notes
    -----
    With dC = U dh V of `compliance_factors`.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> gamma = np.array([[[0.3125, 0.1875], [0.1875, 0.3125]]])
    >>> jf.compliance_covariance(gamma, 1e-4 * gamma**2, reciprocal=False).real.round(8).tolist()
    [[[8.49e-05]]]
    """
    mean, n = as_interface("gamma", gamma)
    n_freq = mean.shape[0]
    t = as_real("transform", np.eye(2 * n) if transform is None else transform, (2 * n, None))
    m = t.shape[1]
    spread = as_real("variance", variance, (n_freq, m, m))
    if (spread < 0).any():
        raise ValueError("variance must not be negative")
    freq = optional_frequency(freq_hz, n_freq)
    args = (int(reciprocal), n, m, N_FREQ, mean, t, spread)
    sweeps = {"gamma": mean, "variance": spread}
    return run("compliance_covariance", args, (n_freq, n * n, n * n), sweeps, freq, on_singular)[0]


class MultiPointJoint(NamedTuple):
    """A joint between the channels of both sides, and its equivalent at the virtual points.

    Attributes
    ----------
    lines : ndarray, shape (n_freq, m_j, m_k) or (n_freq, m_k, m_j)
        Stiffness, N/m, or compliance, m/N, between channels.
    equivalent : ndarray, shape (n_freq, n, n)
        Stiffness or compliance at the virtual points, including rotational rows and columns.
    rank : ndarray of int, shape (n_freq,)
        Number of singular values used in the inverse of each line.
    singular_values : ndarray, shape (n_freq, q)
        Singular values of the inverted matrix, m/N, in decreasing order.
    threshold : ndarray, shape (n_freq,)
        Size below which a singular value is noise, m/N; 0 if no noise was given.
    """

    lines: ComplexArray
    equivalent: ComplexArray
    rank: NDArray[np.intp]
    singular_values: FloatArray
    threshold: FloatArray


def multi_point_stiffness(
    gamma: ArrayLike,
    side_j: VirtualPoint,
    side_k: VirtualPoint,
    *,
    rank: int | None = None,
    noise: float | ArrayLike | None = None,
) -> MultiPointJoint:
    """Return the stiffness of a joint between all channels of both sides, and between their virtual points.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, m_j + m_k, m_j + m_k)
        Receptance of the assembly at the channels of side j, then k, m/N: translations only.
    side_j, side_k : VirtualPoint
        Virtual points of the m_j and m_k channels, with the same n DOFs in the same order.
    rank : int, optional
        Number of singular values of every line to use.
    noise : float or array_like, shape (n_freq, m_j + m_k, m_j + m_k), optional
        Noise in place of `rank`: relative noise level of each entry, 0.01 for 1 %, or the variance E|e|^2 of each,
        (m/N)^2. Singular values that noise alone can cause are not used. Without `rank` and `noise` all are used.

    Returns
    -------
    MultiPointJoint
        Joint with `lines` K_m = -(gamma^+)_jk, N/m, and `equivalent` R_j^T K_m R_k, N/m, N, N m/rad.

    Raises
    ------
    SingularLineError
        A line is singular to working precision, and no `rank` and no `noise` was given.
    ValueError
        Wrong shapes, rank or noise; different DOFs of the sides; NaN or Inf in a line.

    Warns
    -----
    IdentificationWarning
        On some lines fewer than 2 n singular values are used, so that a part of the equivalent joint is missing.

    See Also
    --------
    multi_point_compliance : the compliance, better for stiff joints.
    virtual_points : virtual points of both sides.

    Notes
    -----
    A massless joint exerts forces -S [u_j; u_k] on the channels, and gamma^-1 = diag(Z_A, Z_B) + S. Hence K_m = -S_jk
    is the force on each channel of j per displacement of each of k. If side k moves as a rigid body, the resultants on
    the point of j are R_j^T K_m R_k: the equivalent, a property of the joint alone. Its rotations need no rotational
    FRFs. This is exact in two cases:

    - The joint acts through the channels only, for instance by springs between them, and gamma is regular: flexible
      patches. A virtual point transformation would count the deformation as part of the joint here.
    - The patches are rigid. Then gamma has rank 2 n: ``rank=2 * n`` gives the joint of the virtual points, with
      K_m = T_j^T K T_k, of minimum norm, because the shares of the channels in the forces cannot be identified.

    For nearly rigid patches with noise, the small singular values are the deformation of the patches, and the inverse
    amplifies their noise. `rank` and `noise` omit them, and `rank` of the result is the number of values used.
    Truncation is a bias: the stiffer a joint, the smaller its relative motion, which is truncated first. For stiff
    joints use `multi_point_compliance`, or `identify` with `virtual_points`.

    The threshold by noise is the sum of two roots: of the largest row sum and of the largest column sum of the
    variances. This is the expected largest singular value of independent noise, exactly for equal variances and large
    matrices.

    To regenerate the assembly, use ``couple(h_a, h_b, lines, ...)`` if the channels are opposite each other, otherwise
    `append_virtual_point` and the equivalent.

    References
    ----------
    D. de Klerk, D. J. Rixen, S. N. Voormeeren, F. Pasteuning, Solving the RDoF problem in experimental dynamic
    substructuring, IMAC 2008.

    Examples
    --------
    Springs of 1 and 3 N/m between two free, rigid bars of 1 kg and 1 kg m^2, 1 m to the left and right of the middle.
    The resultant stiffnesses are 4 N/m and 4 N m/rad, coupled by 2 N.

    >>> import numpy as np, jointfrf as jf
    >>> from jointfrf import multi_point_stiffness
    >>> from jointfrf import virtual_point
    >>> side = virtual_point([[-1, 0, 0], [1, 0, 0]], [[0, 1, 0]] * 2, [0, 0, 0], ["y", "theta_z"])
    >>> x = np.array([-1.0, 1.0])
    >>> bar = -(1 + np.outer(x, x))[None]  # 1 rad/s
    >>> gamma = jf.couple(bar, bar, np.diag([1.0, 3.0]), [0, 1], [0, 1])
    >>> found = multi_point_stiffness(gamma, side, side)
    >>> (found.lines.real.round(9) + 0.0).tolist()
    [[[1.0, 0.0], [0.0, 3.0]]]
    >>> found.equivalent.real.round(9).tolist()
    [[[4.0, 2.0], [2.0, 4.0]]]
    """
    lines, m_j = _as_sides(gamma, side_j, side_k)
    by = _truncated_inverse(lines, rank, _variance(noise, lines), "gamma")
    _warn_if_truncated(by.used, 2 * len(side_j.dofs))
    stiffness = -by.inverse[:, :m_j, m_j:]
    equivalent = side_j.modes.T @ stiffness @ side_k.modes
    return MultiPointJoint(stiffness, equivalent, by.used, by.singular_values, by.threshold)


def multi_point_compliance(
    gamma: ArrayLike,
    side_j: VirtualPoint,
    side_k: VirtualPoint,
    *,
    rank: int | None = None,
    noise: float | ArrayLike | None = None,
) -> MultiPointJoint:
    """Return the compliance of a joint between all channels of both sides, and between their virtual points.

    Parameters
    ----------
    gamma, side_j, side_k
        Receptance and virtual points; see `multi_point_stiffness`.
    rank : int, optional
        Number of singular values of gamma_jk to use: the number of forces through the joint, n for a joint between
        virtual points.
    noise : float or array_like, optional
        Noise in place of `rank`; see `multi_point_stiffness`, for gamma_jk.

    Returns
    -------
    MultiPointJoint
        Joint with `lines` C_m = gamma_kk gamma_jk^+ gamma_jj - gamma_kj, m/N, rows k and columns j, and `equivalent`
        T_k C_m T_j^T, m/N, 1/N, rad/(N m).

    Raises
    ------
    SingularLineError, ValueError
        An error of `multi_point_stiffness`.

    Warns
    -----
    IdentificationWarning
        On some lines fewer than n singular values are used, so that a part of the equivalent joint is missing.

    See Also
    --------
    multi_point_stiffness : the stiffness, better for soft joints.
    joint_compliance : compliance at joint DOFs.

    Notes
    -----
    Noise enters almost linearly. Only gamma_jk is inverted, which has one singular value above the noise for each force
    through the joint; their number shows the kind of joint. A soft joint above its resonances transmits little force,
    and gamma_jk is below the noise: `multi_point_stiffness` is more accurate there.

    For a joint between virtual points, which acts on the patches as T^T g, the equivalent with ``rank=n`` is K*^-1 for
    rigid and for flexible patches; `joint_compliance` of the transformed receptances is K*^-1, too. For a joint of
    independent springs between opposite channels C_m is the inverse of their stiffness if all singular values are used.
    The equivalents of `multi_point_stiffness` and of this function are inverses of each other if the patches are rigid;
    otherwise their difference shows the deformation of the patches.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> from jointfrf import multi_point_compliance
    >>> from jointfrf import virtual_point
    >>> side = virtual_point([[-1, 0, 0], [1, 0, 0]], [[0, 1, 0]] * 2, [0, 0, 0], ["y", "theta_z"])
    >>> x = np.array([-1.0, 1.0])
    >>> bar = -(1 + np.outer(x, x))[None]
    >>> gamma = jf.couple(bar, bar, np.diag([1.0, 3.0]), [0, 1], [0, 1])
    >>> np.linalg.inv(multi_point_compliance(gamma, side, side).equivalent).real.round(9).tolist()
    [[[4.0, 2.0], [2.0, 4.0]]]
    """
    lines, m_j = _as_sides(gamma, side_j, side_k)
    variance = _variance(noise, lines)
    across = None if variance is None else variance[:, :m_j, m_j:]
    by = _truncated_inverse(lines[:, :m_j, m_j:], rank, across, "gamma_jk")
    _warn_if_truncated(by.used, len(side_j.dofs))
    compliance = lines[:, m_j:, m_j:] @ by.inverse @ lines[:, :m_j, :m_j] - lines[:, m_j:, :m_j]
    equivalent = side_k.transform @ compliance @ side_j.transform.T
    return MultiPointJoint(compliance, equivalent, by.used, by.singular_values, by.threshold)


def _as_sides(gamma: ArrayLike, side_j: VirtualPoint, side_k: VirtualPoint) -> tuple[ComplexArray, int]:
    """Return the lines and the number of channels of side j."""
    check_sides(side_j, side_k)
    lines = as_square("gamma", gamma)
    m_j, m_k = side_j.modes.shape[0], side_k.modes.shape[0]
    if lines.shape[1] != m_j + m_k:
        raise ValueError(
            f"gamma must contain the {m_j} channels of side_j, then the {m_k} of side_k, not {lines.shape[1]}"
        )
    check_finite_lines("gamma", lines)
    return lines, m_j


def _variance(noise: float | ArrayLike | None, lines: ComplexArray) -> FloatArray | None:
    if noise is None:
        return None
    if np.ndim(noise) == 0:
        return as_positive("noise", noise) ** 2 * (lines.real**2 + lines.imag**2)
    variance = as_real("noise", noise, lines.shape)
    if (variance < 0).any():
        raise ValueError("noise must not contain negative variances")
    return variance


class _TruncatedInverse(NamedTuple):
    """Pseudo-inverse of every line, the singular values, the number of values in use, and the threshold of noise."""

    inverse: ComplexArray
    used: NDArray[np.intp]
    singular_values: FloatArray
    threshold: FloatArray


def _truncated_inverse(
    lines: ComplexArray, rank: int | None, variance: FloatArray | None, name: str
) -> _TruncatedInverse:
    """Return the inverse by the chosen singular values: `rank` of them, those above the noise, or all."""
    n_freq, most = lines.shape[0], min(lines.shape[1:])
    if rank is not None and variance is not None:
        raise ValueError("rank and noise exclude one another; give one of them")
    if rank is not None and not 1 <= as_integer("rank", rank) <= most:
        raise ValueError(f"rank must lie between 1 and {most}, the singular values of {name}, not {rank}")
    left, size, right = np.linalg.svd(lines, full_matrices=False)
    threshold, used = np.zeros(n_freq), np.full(n_freq, most if rank is None else int(rank))
    if variance is not None:
        # the expected largest singular value of independent noise
        by_rows, by_columns = variance.sum(axis=2), variance.sum(axis=1)
        threshold = np.sqrt(by_rows.max(axis=1)) + np.sqrt(by_columns.max(axis=1))
        used = np.count_nonzero(size > threshold[:, None], axis=1)
    elif rank is None:
        _check_regular(size, name)
    keep = np.arange(most) < used[:, None]
    reciprocal = np.divide(1, size, out=np.zeros_like(size), where=keep & (size > 0))
    inverse = (right.conj().swapaxes(1, 2) * reciprocal[:, None, :]) @ left.conj().swapaxes(1, 2)
    return _TruncatedInverse(inverse, used, size, threshold)


def _check_regular(size: FloatArray, name: str) -> None:
    """Raise an error if the smallest singular value of a line is zero to working precision."""
    singular = np.flatnonzero(~(size[:, -1] > _SINGULAR * size[:, 0]))
    if singular.size:
        raise SingularLineError(
            f"{name} is singular in line {singular[0]}: rigid patches have no more singular values than rigid "
            "motions; give rank or noise",
            singular,
        )


def _warn_if_truncated(used: NDArray[np.intp], needed: int) -> None:
    lost = np.flatnonzero(used < needed)
    if lost.size:
        warnings.warn(
            f"{lost.size} of {used.size} lines use {used[lost].min()} to {needed - 1} of the {needed} singular values "
            "of the equivalent joint; give rank, or measure with less noise",
            IdentificationWarning,
            stacklevel=3,
        )
