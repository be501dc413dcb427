"""Rotational FRFs from translational ones by finite differences (2.57)-(2.59)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_lines, as_number, as_real, optional_frequency
from jointfrf.kernel.call import N_FREQ, info_of, run
from jointfrf.kernel.status import OnSingular

__all__ = ["DifferenceError", "central_difference", "difference_error", "difference_weights", "transform"]


def difference_weights(spacing: float | ArrayLike) -> FloatArray:
    """Weights of the displacements of points along a line for displacement and slope at the reference.

    Parameters
    ----------
    spacing : float or array_like, shape (m,)
        Spacing dx of three points, the middle one the reference (2.59); or the positions of m >= 2 points from the
        reference, m. The reference may lie between the points.

    Returns
    -------
    ndarray, shape (2, m)
        First row displacement, second row slope du/ds in 1/m.

    Raises
    ------
    ValueError
        Fewer than two points, two at one place, or a spacing that is not positive and finite.

    Examples
    --------
    >>> import jointfrf as jf
    >>> (jf.difference_weights(0.01) + 0.0).tolist()
    [[0.0, 1.0, 0.0], [-50.0, 0.0, 50.0]]
    >>> jf.difference_weights([-0.01, 0.01]).tolist()
    [[0.5, 0.5], [-50.0, 50.0]]
    """
    if np.ndim(spacing) == 0:
        step = as_number("spacing", spacing)
        if step <= 0:
            raise ValueError(f"spacing must be positive, not {step:g} m")
        spacing = np.array([-step, 0.0, step])
    offset = as_real("spacing", spacing, (None,))
    if offset.size < 2:
        raise ValueError("spacing must place at least two points")
    weights = np.empty((offset.size, 2))
    if info_of("difference_weights", (offset.size, offset, weights)) < 0:
        raise ValueError(f"offsets must be finite and no two equal: {offset.tolist()}")
    return weights.T


def central_difference(
    h: ArrayLike,
    spacing: float | ArrayLike,
    *,
    sign: float = 1.0,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Displacement and rotation receptances at a reference from translational ones along a line.

    Parameters
    ----------
    h : array_like, shape (n_freq, m, m)
        Measured receptance of the points, in their order along the line, m/N.
    spacing : float or array_like, shape (m,)
        As in `difference_weights`.
    sign : {1, -1}
        Rotation as slope or as minus the slope: theta_z = +du_y/dx, theta_y = -du_z/dx, theta_x = -du_y/dz.
    freq_hz, on_singular, out
        As in `couple`.

    Returns
    -------
    ndarray, shape (n_freq, 2, 2)
        [[H_yy, H_y,theta], [H_theta,y, H_theta,theta]] (2.57): m/N, m/(N m); rad/N, rad/(N m).

    Raises
    ------
    ValueError
        Wrong shapes or spacing; NaN or Inf in a line.

    Notes
    -----
    The rotation is that of a chord: it differs from that of the section by terms in spacing^2, and a moment made of two
    forces strains the material between them. `difference_error` estimates what this does to a joint.

    Examples
    --------
    A rigid bar of 1 kg and 1 kg m^2 at 1 rad/s, points at -0.1, 0 and 0.1 m: H = -(1 + x_p x_q).

    >>> import numpy as np, jointfrf as jf
    >>> x = np.array([-0.1, 0, 0.1])
    >>> jf.central_difference(-(1 + np.outer(x, x))[None], 0.1).real.round(12).tolist()
    [[[-1.0, 0.0], [0.0, -1.0]]]
    """
    if as_number("sign", sign) not in (1, -1):
        raise ValueError(f"sign must be 1 or -1, not {sign}")
    t = difference_weights(spacing) * np.array([[1.0], [sign]])
    lines = as_lines("h", h, t.shape[1], t.shape[1], later=True)
    return transform(lines, t, t, freq_hz=freq_hz, on_singular=on_singular, out=out)


def transform(
    h: ArrayLike,
    t_out: ArrayLike,
    t_in: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Receptance in other coordinates, T_out H T_in^T on every line: (2.57) for any points and DOFs.

    Parameters
    ----------
    h : array_like, shape (n_freq, m_out, m_in)
        Measured receptance.
    t_out, t_in : array_like, shapes (n_out, m_out) and (n_in, m_in)
        Real transformations of responses and of forces.
    freq_hz, on_singular, out
        As in `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n_out, n_in)

    Raises
    ------
    ValueError
        Wrong shapes; NaN or Inf in a line.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.transform([[[1.0, 2.0], [3.0, 4.0]]], [[1.0, 1.0]], [[1.0, -1.0]]).real.tolist()
    [[[-2.0]]]
    """
    lines = as_lines("h", h, later=True)
    n_freq, m_out, m_in = lines.shape
    left = as_real("t_out", t_out, (None, m_out))
    right = as_real("t_in", t_in, (None, m_in))
    freq = optional_frequency(freq_hz, n_freq)
    n_out, n_in = left.shape[0], right.shape[0]
    args = (n_out, n_in, m_out, m_in, N_FREQ, lines, left, right)
    return run("transform", args, (n_freq, n_out, n_in), {"h": lines}, freq, on_singular, out=out)[0]


class DifferenceError(NamedTuple):
    """What finite differences will do to a rotational joint stiffness.

    Attributes
    ----------
    compliance : float
        What they add to the rotational compliance of the joint, rad/(N m).
    bias : float
        The same as a share of the joint's compliance: at low frequency k is found as k / (1 + bias).
    noise_gain : float
        Variance of a rotational receptance over that of a translational one: sum of squared weights, squared, 1/m^4.
    """

    compliance: float
    bias: float
    noise_gain: float


def difference_error(spacing: float | ArrayLike, bending_stiffness: float, joint_stiffness: float) -> DifferenceError:
    """Estimate, before a test, what a spacing does to the rotational stiffness of a joint between beams.

    Parameters
    ----------
    spacing : float or array_like, shape (m,)
        As in `difference_weights`; the outermost points count.
    bending_stiffness : float
        E I of the beams, N m^2.
    joint_stiffness : float
        Rotational stiffness expected, N m/rad.

    Returns
    -------
    DifferenceError

    Raises
    ------
    ValueError
        A stiffness is not positive.

    Notes
    -----
    A moment is applied as two opposite forces at +-dx, and the rotation read from the displacements there. Between the
    points the beam bends under this couple: strain energy theory gives dx/(6 E I) more compliance on each side of the
    joint, dx/(3 E I) in all, at low frequency and for a joint in the middle of the points.

    Examples
    --------
    >>> import jointfrf as jf
    >>> error = jf.difference_error(0.005, bending_stiffness=30.15, joint_stiffness=5000.0)
    >>> round(error.bias, 3), round(error.compliance * 1e5, 2)
    (0.276, 5.53)
    """
    if not (
        as_number("bending_stiffness", bending_stiffness) > 0 and as_number("joint_stiffness", joint_stiffness) > 0
    ):
        raise ValueError("bending_stiffness and joint_stiffness must be positive")
    t = difference_weights(spacing)
    reach = float(spacing) if np.ndim(spacing) == 0 else float(np.ptp(np.asarray(spacing))) / 2  # type: ignore[arg-type]
    compliance = reach / (3 * bending_stiffness)
    return DifferenceError(compliance, compliance * joint_stiffness, float((t[1] ** 2).sum() ** 2))
