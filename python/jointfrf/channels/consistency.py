"""How far measured FRFs of an interface agree with rigid motion, and whether FRFs are those of a passive structure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.channels.virtual_point import VirtualPoint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_lines, as_square, check_finite_lines, check_type

__all__ = ["Consistency", "DrivingPointCheck", "driving_point_check", "impact_consistency", "sensor_consistency"]

#: Residuals below this share of the motion are round-off: no channel is to blame.
_ROUND_OFF = 1e-10


class Consistency(NamedTuple):
    """Agreement of channels with the rigid interface modes of a virtual point.

    Attributes
    ----------
    overall : ndarray, shape (n_freq,)
        Size of the filtered over that of the measured responses, 0 to 1; 1: all motion is rigid.
    specific : ndarray, shape (n_freq, m)
        Agreement of each channel with its filtered response, 0 to 1. One bad channel also spoils those next to it.
    blame : ndarray, shape (n_freq, m)
        Share of the inconsistency that is gone when this channel is left out, 0 to 1. Exactly 1 for a channel that
        alone is wrong, in sign, gain, phase or name, whatever the others do; below 1 for the others. 0 where there is
        no inconsistency, and for channels that the others cannot check (`VirtualPoint.redundancy` 0).
    """

    overall: FloatArray
    specific: FloatArray
    blame: FloatArray


def sensor_consistency(h: ArrayLike, point: VirtualPoint) -> Consistency:
    """Sensor consistency: how far the responses of a group of channels show rigid motion.

    Parameters
    ----------
    h : array_like, shape (n_freq, m, n_in)
        FRFs of the channels of `point` to any forces, m/N, or accelerances.
    point : VirtualPoint
        Of the channels.

    Returns
    -------
    Consistency

    Raises
    ------
    ValueError
        Wrong shape; NaN or Inf in a line.

    Notes
    -----
    With the measured u and the filtered responses u~ = R T u, for each line:

    - overall: |u~| / |u|, with |u|^2 = u^H W u. A residual of 10 % of the motion gives 0.995, one of 44 % gives 0.9.
    - specific: (u~_i + u_i)(u~_i + u_i)* / (2 (u~_i u~_i* + u_i u_i*)), the form of a coherence: 1 for equal, 0.5 where
      one is zero, 0 for opposite values.
    - blame: w_i |r_i|^2 / (1 - (R T)_ii) over r^H W r, with r = u - u~.

    Numerators and denominators are summed over the columns of `h`, so that forces do not cancel. The source takes the
    responses to one combination of forces f: pass ``h @ f``. A line or channel without motion gives NaN.

    Where some directions move much more than others, their noise hides an error of the small ones: give `point` the
    weights 1 / variance of the noise, for noise relative to each FRF ``1 / np.mean(abs(h) ** 2, axis=(0, 2))``.

    References
    ----------
    M. V. van der Seijs, D. D. van den Bosch, D. J. Rixen, D. de Klerk, COMPDYN 2013 (see `virtual_point`). For the
    share of a residual that an observation explains: W. Baarda, A testing procedure for use in geodetic networks, 1968.

    Examples
    --------
    Three channels on a line show y = 1, 2, 3: a rotation; with the sign of the last wrong they do not.

    >>> from jointfrf import sensor_consistency
    >>> from jointfrf import virtual_point
    >>> vp = virtual_point([[-1, 0, 0], [0, 0, 0], [1, 0, 0]], [[0, 1, 0]] * 3, [0, 0, 0], ["y", "theta_z"])
    >>> sensor_consistency([[[1.0], [2.0], [3.0]]], vp).overall.round(6).tolist()
    [1.0]
    >>> wrong = sensor_consistency([[[1.0], [2.0], [-3.0]]], vp)
    >>> wrong.overall.round(3).tolist(), wrong.blame.round(3).tolist()
    ([0.756], [[1.0, 1.0, 1.0]])

    Three channels less two DOFs leave one residual: it cannot say which of them is wrong.
    """
    check_type("point", point, VirtualPoint)
    measured = as_lines("h", h, point.modes.shape[0])
    check_finite_lines("h", measured)
    weight = point.weights[:, None]
    filtered = point.modes @ (point.transform @ measured)
    residual = measured - filtered
    with np.errstate(invalid="ignore"):
        overall = np.sqrt(_power(weight * _square(filtered), (1, 2)) / _power(weight * _square(measured), (1, 2)))
        both = _power(_square(filtered), 2) + _power(_square(measured), 2)
        specific = _power(_square(filtered + measured), 2) / (2 * both)

    redundancy = point.redundancy
    checked = (redundancy > _ROUND_OFF) & (point.weights > 0)
    explained = np.zeros(specific.shape)
    left = _power(weight * _square(residual), 2)
    explained[:, checked] = left[:, checked] / redundancy[checked]
    whole = left.sum(axis=1, keepdims=True)
    above_rounding = whole > _ROUND_OFF**2 * _power(weight * _square(measured), (1, 2))[:, None]
    where = np.broadcast_to(above_rounding, explained.shape)
    blame = np.divide(explained, whole, out=np.zeros_like(explained), where=where)
    return Consistency(overall, specific, blame)


def impact_consistency(h: ArrayLike, point: VirtualPoint) -> Consistency:
    """Impact consistency: how far a group of impacts acts as forces and moments on a rigid interface.

    Parameters
    ----------
    h : array_like, shape (n_freq, n_out, m)
        FRFs of any responses to the impacts of `point`, m/N, or accelerances.
    point : VirtualPoint
        Of the impacts: their positions and the directions of their forces.

    Returns
    -------
    Consistency
        With impacts for channels.

    Raises
    ------
    ValueError
        Wrong shape; NaN or Inf in a line.

    Notes
    -----
    As `sensor_consistency`, for each row y of `h` and its filtered y~ = y T^T R^T. Summed over the rows of `h`; the
    source takes one combination of responses w: pass ``w @ h``, as a row.

    Examples
    --------
    >>> from jointfrf import impact_consistency
    >>> from jointfrf import virtual_point
    >>> vp = virtual_point([[-1, 0, 0], [0, 0, 0], [1, 0, 0]], [[0, 1, 0]] * 3, [0, 0, 0], ["y", "theta_z"])
    >>> impact_consistency([[[1.0, 2.0, 3.0]]], vp).specific.round(6).tolist()
    [[1.0, 1.0, 1.0]]
    """
    check_type("point", point, VirtualPoint)
    lines = as_lines("h", h, None, point.modes.shape[0])
    return sensor_consistency(np.ascontiguousarray(lines.swapaxes(1, 2)), point)


class DrivingPointCheck(NamedTuple):
    """Whether FRFs can be those of a reciprocal, passive structure.

    Attributes
    ----------
    reciprocity : ndarray, shape (n_freq, n, n)
        Agreement of H_ab with H_ba, 0 to 1, as the specific consistency.
    driving_point : ndarray, shape (n_freq, n)
        Im H_aa / |H_aa|: above zero the force at a DOF takes power out of the structure.
    passivity : ndarray, shape (n_freq,)
        Above zero some combination of forces takes power out of the structure; the size is relative to that of the
        line, so that 1 % noise gives some 0.01.
    """

    reciprocity: FloatArray
    driving_point: FloatArray
    passivity: FloatArray


def driving_point_check(h: ArrayLike) -> DrivingPointCheck:
    """Reciprocity and passivity of receptances between the same DOFs, as those of a virtual point must have.

    Parameters
    ----------
    h : array_like, shape (n_freq, n, n)
        Receptance; rotations and translations may be mixed.

    Returns
    -------
    DrivingPointCheck

    Raises
    ------
    ValueError
        Wrong shape; NaN or Inf in a line.

    Notes
    -----
    Forces f at exp(+i w t) put the power -(w/2) f^H S f into a structure, S = (H - H^H)/2i. A passive one takes power
    from any f: no eigenvalue of S is above zero, hence Im H_aa <= 0 (reciprocal or not). `passivity` is the largest
    eigenvalue of S over the largest singular value of H, both with every DOF divided by the root of its mean |H_aa|.
    A wrong sign between sensors and impacts, or of a DOF on one side only, shows in `driving_point`.

    References
    ----------
    M. V. van der Seijs and others, COMPDYN 2013 (see `virtual_point`), on reciprocity.

    Examples
    --------
    >>> import jointfrf as jf
    >>> from jointfrf import driving_point_check
    >>> h = jf.chain([1.0, 2.0], [3.0, 3.0], [0.1, 0.1], ground="start").receptance([0.1, 0.2])
    >>> check = driving_point_check(h)
    >>> bool((check.driving_point < 0).all() and (check.passivity < 0).all()), round(float(check.reciprocity.min()), 12)
    (True, 1.0)
    >>> bool((driving_point_check(-h).passivity > 0).all())
    True
    """
    lines = as_square("h", h)
    check_finite_lines("h", lines)
    diagonal = np.einsum("faa->fa", lines)
    across = lines.swapaxes(1, 2)
    with np.errstate(invalid="ignore"):
        reciprocity = _square(lines + across) / (2 * (_square(lines) + _square(across)))
        driving_point = diagonal.imag / abs(diagonal)
    mean = np.sqrt(abs(diagonal).mean(axis=0))
    size = np.where(mean > 0, mean, 1)
    scaled = lines / np.outer(size, size)
    active = np.linalg.eigvalsh((scaled - scaled.conj().swapaxes(1, 2)) / 2j)[:, -1]
    with np.errstate(invalid="ignore"):
        return DrivingPointCheck(reciprocity, driving_point, active / np.linalg.norm(scaled, 2, axis=(1, 2)))


def _square(values: ComplexArray) -> FloatArray:
    square: FloatArray = values.real**2 + values.imag**2
    return square


def _power(squares: FloatArray, axis: int | tuple[int, ...]) -> FloatArray:
    power: FloatArray = squares.sum(axis=axis)
    return power
