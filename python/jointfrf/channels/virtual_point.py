"""Virtual point transformation of many translational channels, and how far they agree with rigid motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from jointfrf.channels.point_lines import Interface, transform
from jointfrf.dofs import DIRECTIONS, direction_names, direction_places, is_rotation, rigid_motion
from jointfrf.frf.frf_set import Channel
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_dofs,
    as_lines,
    as_names,
    as_real,
    as_square,
    check_finite_lines,
    check_type,
)

__all__ = [
    "ROUND_OFF",
    "UNSEEN",
    "Consistency",
    "DrivingPointCheck",
    "VirtualPoint",
    "append_virtual_point",
    "channel_geometry",
    "check_sides",
    "driving_point_check",
    "impact_consistency",
    "sensor_consistency",
    "virtual_interface",
    "virtual_point",
    "virtual_points",
]

#: A motion whose singular value is below this share of the largest counts as not observed.
UNSEEN = 1e-6
#: Directions may be rounded: their length may differ from one by this.
_UNIT = 1e-2
#: Residuals below this share of the motion are round-off: no channel is faulty.
ROUND_OFF = 1e-10


class VirtualPoint(NamedTuple):
    """Rigid motion of a group of channels about a point.

    Attributes
    ----------
    dofs : tuple of str
        Names of the n DOFs of the point.
    modes : ndarray, shape (m, n)
        Rigid interface modes R of u = R q: displacement of each channel for a unit of each DOF, 1 or m/rad.
    transform : ndarray, shape (n, m)
        T = (R^T W R)^-1 R^T W of q = T u, and of f = T^T m for forces: 1 or rad/m.
    weights : ndarray, shape (m,)
        Diagonal of W.
    condition : float
        Condition number of W^(1/2) R with rotations times the reach of the channels (root mean square distance to the
        point), so that it does not depend on units. 1 is best; above some hundreds the point lies far from the
        channels, or some DOF is poorly observed.
    point : ndarray, shape (3,)
        Position of the point, m.
    motion : ndarray, shape (m, 6)
        Displacement of each channel for a unit of x, y, z, theta_x, theta_y, theta_z of the point, 1 or m/rad; `modes`
        has the columns of the DOFs.
    """

    dofs: tuple[str, ...]
    modes: FloatArray
    transform: FloatArray
    weights: FloatArray
    condition: float
    point: FloatArray
    motion: FloatArray

    @property
    def noise_gain(self) -> FloatArray:
        """Standard deviation of each DOF for independent noise of standard deviation 1 in all channels, shape (n,).

        The root of the diagonal of T T^T, which is (R^T R)^-1 for equal weights: 1, or rad/m for rotations.
        """
        return np.asarray(np.sqrt((self.transform**2).sum(axis=1)))

    @property
    def redundancy(self) -> FloatArray:
        """Share of an error in a channel that stays in its residual, 1 - (R T)_ii, shape (m,).

        0: the other channels cannot check this one, its error goes into q unseen. The sum over all channels with
        weight is their number less n.
        """
        return np.asarray(1 - np.einsum("mn,nm->m", self.modes, self.transform))


def virtual_point(
    positions: ArrayLike,
    directions: ArrayLike,
    point: ArrayLike,
    dofs: Sequence[str] = DIRECTIONS,
    weights: ArrayLike | None = None,
) -> VirtualPoint:
    """Virtual point transformation of a group of translational channels on a part that moves as a rigid body.

    Parameters
    ----------
    positions : array_like, shape (m, 3)
        Positions of the channels, m. A triaxial accelerometer is three channels at one place.
    directions : array_like, shape (m, 3)
        Unit vector of each channel: of the measured motion, or of the force of an impact. They may be rounded to two
        digits and are brought to length one.
    point : array_like, shape (3,)
        The virtual point, m. Both sides of a joint need their points where the joint is to be described.
    dofs : sequence of str
        DOFs of the point, in the order wanted: ``"x"``, ``"y"``, ``"z"``, ``"theta_x"``, ``"theta_y"``,
        ``"theta_z"``, all or some. Those left out are taken as zero.
    weights : array_like, shape (m,), optional
        Weight of each channel, 0 to leave it out; equal by default. One over the variance of their noise gives q the
        least variance.

    Returns
    -------
    VirtualPoint

    Raises
    ------
    ValueError
        Wrong shapes, names, directions or weights, or fewer channels than DOFs. The message names DOFs that the
        channels do not show, or cannot distinguish.

    Notes
    -----
    A channel at r from the point with direction e shows e . (t + theta x r), so that its row of R is [e, r x e]. Its
    transpose takes forces at the channels to force and moment at the point, R^T f = m, and T^T distributes them back
    with least squares. The receptance of the point is T_u H T_f^T (`jointfrf.transform`); T_u and T_f may come from
    different channels. Motion that is not rigid is averaged out; `sensor_consistency` measures its share.

    References
    ----------
    M. V. van der Seijs, D. D. van den Bosch, D. J. Rixen, D. de Klerk, An improved methodology for the virtual point
    transformation of measured frequency response functions in dynamic substructuring, COMPDYN 2013.

    Examples
    --------
    Three channels on a line, 10 mm apart: the slope is the central difference.

    >>> import numpy as np
    >>> from jointfrf import virtual_point
    >>> places = [[-0.01, 0, 0], [0, 0, 0], [0.01, 0, 0]]
    >>> vp = virtual_point(places, [[0, 1, 0]] * 3, [0, 0, 0], dofs=["y", "theta_z"])
    >>> (vp.transform.round(4) + 0.0).tolist()
    [[0.3333, 0.3333, 0.3333], [-50.0, 0.0, 50.0]]
    >>> virtual_point(places, [[0, 1, 0]] * 3, [0, 0, 0], dofs=["y", "theta_x"])
    Traceback (most recent call last):
        ...
    ValueError: dofs: the channels do not show theta_x
    """
    place = as_real("positions", positions, (None, 3))
    m = place.shape[0]
    direction = _as_directions(directions, m)
    names = _as_names(dofs)
    weight = np.ones(m) if weights is None else as_real("weights", weights, (m,))
    if (weight < 0).any():
        raise ValueError(f"weights must not be negative: channel {int(np.argmax(weight < 0))} has {weight.min():g}")
    used = int(np.count_nonzero(weight))
    if used < len(names):
        raise ValueError(f"{used} channels with weight are too few for {len(names)} DOFs; add channels")

    reference = as_real("point", point, (3,))
    motion = np.einsum("mi,mij->mj", direction, rigid_motion(place, reference))
    modes = motion[:, direction_places(names)]
    reach = float(np.sqrt(np.average(((place - reference) ** 2).sum(axis=1), weights=weight))) or 1.0
    scale = np.array([reach if is_rotation(name) else 1.0 for name in names])
    root = np.sqrt(weight / weight.max())
    left, size, right = np.linalg.svd(root[:, None] * modes / scale, full_matrices=False)
    _check_seen(names, size, right)
    # (R^T W R)^-1 R^T W by the singular values of W^(1/2) R
    inverse = (right.T / size) @ left.T * root / scale[:, None]
    return VirtualPoint(names, modes, inverse, weight, float(size[0] / size[-1]), reference, motion)


def check_sides(side_j: VirtualPoint, side_k: VirtualPoint) -> None:
    """Raise unless both sides of a joint are virtual points with the same DOFs."""
    for name, side in (("side_j", side_j), ("side_k", side_k)):
        check_type(name, side, VirtualPoint)
    if side_j.dofs != side_k.dofs:
        both = f"{', '.join(side_j.dofs)} and {', '.join(side_k.dofs)}"
        raise ValueError(f"side_j and side_k must have the same DOFs in the same order, not {both}")


def virtual_points(side_j: VirtualPoint, side_k: VirtualPoint) -> FloatArray:
    """Put the transformations of both sides of a joint into one, for `identify`.

    Parameters
    ----------
    side_j, side_k : VirtualPoint
        Side j (on A) and side k (on B), of m_j and m_k channels, with the same n DOFs in the same order.

    Returns
    -------
    ndarray, shape (2 n, m_j + m_k)
        [[T_j, 0], [0, T_k]].

    Raises
    ------
    ValueError
        The sides have different DOFs.

    Notes
    -----
    ``identify(freq_hz, h, vp.dofs, transform=...)`` takes one transformation where impacts are at the places and in the
    directions of the channels, and with the method "compliance" a pair, of responses and of forces, where they are
    elsewhere. `virtual_interface` contains the geometry of the channels, too, so that the fit can test their rigidity.

    Examples
    --------
    >>> from jointfrf import virtual_point, virtual_points
    >>> side = virtual_point([[-0.01, 0, 0], [0.01, 0, 0]], [[0, 1, 0]] * 2, [0, 0, 0], ["y", "theta_z"])
    >>> virtual_points(side, side).round(6).tolist()[1]
    [-50.0, 50.0, 0.0, 0.0]
    """
    check_sides(side_j, side_k)
    return np.asarray(block_diag(side_j.transform, side_k.transform))


def virtual_interface(side_j: VirtualPoint, side_k: VirtualPoint) -> Interface:
    """Put the virtual points of both sides of a joint together with the geometry of their channels, for `identify`.

    Parameters
    ----------
    side_j, side_k : VirtualPoint
        As in `virtual_points`.

    Returns
    -------
    Interface
        Without names of channels.

    Raises
    ------
    ValueError
        The sides have different DOFs.

    Examples
    --------
    >>> import jointfrf as jf
    >>> side = jf.virtual_point([[-0.01, 0, 0], [0.01, 0, 0]], [[0, 1, 0]] * 2, [0, 0, 0], ["y", "theta_z"])
    >>> jf.virtual_interface(side, side).modes[:2].tolist()
    [[1.0, -0.01, 0.0, 0.0], [1.0, 0.01, 0.0, 0.0]]
    """
    both, motion = virtual_points(side_j, side_k), block_diag(side_j.motion, side_k.motion)
    return Interface((), both, (side_j.point, side_k.point), direction_names(side_j.dofs), motion)


def append_virtual_point(h: ArrayLike, channels: ArrayLike, point: VirtualPoint) -> ComplexArray:
    """Receptance of a structure with the DOFs of a virtual point behind its own.

    Parameters
    ----------
    h : array_like, shape (n_freq, n_all, n_all)
        Receptance, m/N.
    channels : array_like of int, shape (m,)
        Which DOFs of `h` are the channels of the point, counted from 0, in their order.
    point : VirtualPoint

    Returns
    -------
    ndarray, shape (n_freq, n_all + n, n_all + n)
        At its own DOFs, then at the point.

    Raises
    ------
    ValueError
        Wrong shapes or DOFs; NaN or Inf in a line.

    Notes
    -----
    With such receptances of A and B, `couple` joins the points by a joint of n DOFs and returns the assembly at all
    measured DOFs. The channels of both sides need not lie opposite one another. A joint force g acts as T^T g on the
    channels (weakened compatibility: only the rigid motion of the patches is coupled).

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf import append_virtual_point, virtual_point
    >>> vp = virtual_point([[-0.1, 0, 0], [0.1, 0, 0]], [[0, 1, 0]] * 2, [0, 0, 0], ["y"])
    >>> append_virtual_point(np.eye(3)[None], [1, 2], vp)[0, -1].real.round(12).tolist()
    [0.0, 0.5, 0.5, 0.5]
    """
    check_type("point", point, VirtualPoint)
    lines = as_square("h", h, later=True)
    n_all = lines.shape[1]
    at = as_dofs("channels", channels, n_all) - 1
    n, m = point.transform.shape
    if at.size != m:
        raise ValueError(f"channels must name the {m} channels of the point, not {at.size}")
    rows = np.zeros((n, n_all))
    rows[:, at] = point.transform
    whole = np.vstack([np.eye(n_all), rows])
    return transform(lines, whole, whole)


def channel_geometry(
    channels: Iterable[Channel | str], coordinates: Mapping[int, ArrayLike]
) -> tuple[FloatArray, FloatArray]:
    """Positions and directions of named channels, as `virtual_point` takes them.

    Parameters
    ----------
    channels : iterable of Channel or str
        Translational channels, such as ``"102:+y"``.
    coordinates : mapping of int to array_like, shape (3,)
        Positions of the nodes, m.

    Returns
    -------
    positions, directions : ndarray, shape (m, 3)

    Raises
    ------
    ValueError
        A node without coordinates, or a channel that is a rotation.

    Examples
    --------
    >>> from jointfrf import channel_geometry
    >>> positions, directions = channel_geometry(["1:+x", "2:-y"], {1: (0, 0, 0), 2: (0.02, 0, 0)})
    >>> positions.tolist(), directions.tolist()
    ([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0]], [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    """
    if not isinstance(channels, Iterable):
        raise TypeError("channels must be a sequence of channels")
    if not isinstance(coordinates, Mapping):
        raise TypeError("coordinates must be a mapping of nodes to x, y, z")
    named = [Channel.parse(channel) for channel in channels]
    for channel in named:
        if channel.is_rotation:
            raise ValueError(f"channels: {channel} is a rotation; use translations for a virtual point")
        if channel.node not in coordinates:
            raise ValueError(f"node {channel.node} has no coordinates; add them to coordinates")
    places = [as_real(f"coordinates of node {c.node}", coordinates[c.node], (3,)) for c in named]
    axes = [c.sign * np.eye(3)["xyz".index(c.axis)] for c in named]
    # adding zero turns -0 to 0
    return np.array(places).reshape(-1, 3), np.array(axes).reshape(-1, 3) + 0.0


def _as_directions(directions: ArrayLike, m: int) -> FloatArray:
    direction = as_real("directions", directions, (m, 3))
    length = np.linalg.norm(direction, axis=1)
    wrong = np.flatnonzero(abs(length - 1) > _UNIT)
    if wrong.size:
        raise ValueError(f"directions must be unit vectors: that of channel {wrong[0]} has length {length[wrong[0]]:g}")
    return np.asarray(direction / length[:, None])


def _as_names(dofs: Sequence[str]) -> tuple[str, ...]:
    names = (dofs,) if isinstance(dofs, str) else as_names("dofs", dofs)
    if not names:
        raise ValueError("dofs must name at least one DOF")
    direction_places(names)
    return names


def _check_seen(names: tuple[str, ...], size: FloatArray, right: FloatArray) -> None:
    """Raise where the channels do not show a motion, and name the DOFs it consists of."""
    blind = right[size <= UNSEEN * size[0]]
    if not len(blind):
        return
    share = np.sqrt((blind**2).sum(axis=0))
    unseen = [name for name, part in zip(names, share, strict=True) if part > 1 - UNSEEN]
    mixed = [name for name, part in zip(names, share, strict=True) if UNSEEN < part <= 1 - UNSEEN]
    faults = [f"do not show {', '.join(unseen)}"] if unseen else []
    faults += [f"cannot distinguish {', '.join(mixed)}"] if mixed else []
    raise ValueError(f"dofs: the channels {' and '.join(faults)}")


class Consistency(NamedTuple):
    """Agreement of channels with the rigid interface modes of a virtual point.

    Attributes
    ----------
    overall : ndarray, shape (n_freq,)
        Size of the filtered responses, relative to the measured ones, 0 to 1; 1: all motion is rigid.
    specific : ndarray, shape (n_freq, m)
        Agreement of each channel with its filtered response, 0 to 1. One bad channel also spoils those next to it.
    blame : ndarray, shape (n_freq, m)
        Share of the inconsistency that is gone when this channel is left out, 0 to 1. Exactly 1 for a channel that
        alone is wrong, in sign, gain, phase or name, for any motion; below 1 for all other channels. 0 without
        inconsistency, and for channels that have no redundancy (`VirtualPoint.redundancy` 0).
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
        Virtual point of the channels.

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

    If some directions move much more than others, their noise hides an error of the small ones. Then give `point` the
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

    Three channels less two DOFs leave one residual, which does not show which of them is wrong.
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
    checked = (redundancy > ROUND_OFF) & (point.weights > 0)
    explained = np.zeros(specific.shape)
    left = _power(weight * _square(residual), 2)
    explained[:, checked] = left[:, checked] / redundancy[checked]
    whole = left.sum(axis=1, keepdims=True)
    above_rounding = whole > ROUND_OFF**2 * _power(weight * _square(measured), (1, 2))[:, None]
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
        Virtual point of the impacts, with their positions and the directions of their forces.

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
    """Agreement of FRFs with a reciprocal, passive structure.

    Attributes
    ----------
    reciprocity : ndarray, shape (n_freq, n, n)
        Agreement of H_ab with H_ba, 0 to 1, as the specific consistency.
    driving_point : ndarray, shape (n_freq, n)
        Im H_aa / |H_aa|: above zero the force at a DOF takes power out of the structure.
    passivity : ndarray, shape (n_freq,)
        Above zero some combination of forces takes power out of the structure; the size is relative to the size
        of the line, so that 1 % noise gives some 0.01.
    """

    reciprocity: FloatArray
    driving_point: FloatArray
    passivity: FloatArray


def driving_point_check(h: ArrayLike) -> DrivingPointCheck:
    """Reciprocity and passivity of receptances between the same DOFs, for example of a virtual point.

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
    return values.real**2 + values.imag**2


def _power(squares: FloatArray, axis: int | tuple[int, ...]) -> FloatArray:
    return np.asarray(squares.sum(axis=axis))
