"""Joint DOFs from points along lines: displacements by interpolation, rotations by finite differences (2.57)-(2.59)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from jointfrf.channels.extent import extent_of, longest_extent
from jointfrf.dofs import DIRECTIONS, direction_names, direction_places, rigid_motion
from jointfrf.errors import FrfCheckWarning
from jointfrf.frf.frf_set import Channel, check_apart
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_lines,
    as_names,
    as_nodes,
    as_number,
    as_positive,
    as_real,
    optional_frequency,
)
from jointfrf.kernel.call import N_FREQ, OnSingular, info_of, run

__all__ = [
    "DifferenceError",
    "Interface",
    "central_difference",
    "difference_error",
    "difference_weights",
    "interface",
    "transform",
]

#: Axes of translations; the place of a rotation's axis is less by their number.
_AXES = DIRECTIONS[:3]
#: Points count as lying on a line along an axis when they stray from it by less than this share of its length.
_STRAY = 1e-3


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
        step = as_positive("spacing", spacing, "m")
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
    The rotation is the rotation of a chord. It differs from the rotation of the section by terms in spacing^2, and a
    moment made of two forces strains the material between them. `difference_error` estimates the error of a joint.

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
    """Errors of a rotational joint stiffness by finite differences.

    Attributes
    ----------
    compliance : float
        Addition to the rotational compliance of the joint, rad/(N m).
    bias : float
        The same as a share of the joint's compliance: at low frequency k is found as k / (1 + bias).
    noise_gain : float
        Ratio of the variances of rotational and translational receptances: sum of squared weights, squared, 1/m^4.
    """

    compliance: float
    bias: float
    noise_gain: float


def difference_error(spacing: float | ArrayLike, bending_stiffness: float, joint_stiffness: float) -> DifferenceError:
    """Estimate, before a test, the error of the rotational stiffness of a joint between beams by the spacing.

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
    points the beam bends under this couple. By strain energy, this adds dx/(6 E I) to the compliance of each side of
    the joint, dx/(3 E I) in all, at low frequency and for a joint in the middle of the points.

    Examples
    --------
    >>> import jointfrf as jf
    >>> error = jf.difference_error(0.005, bending_stiffness=30.15, joint_stiffness=5000.0)
    >>> round(error.bias, 3), round(error.compliance * 1e5, 2)
    (0.276, 5.53)
    """
    as_positive("bending_stiffness", bending_stiffness, "N m^2")
    as_positive("joint_stiffness", joint_stiffness, "N m/rad")
    t = difference_weights(spacing)
    reach = float(spacing) if np.ndim(spacing) == 0 else float(np.ptp(np.asarray(spacing))) / 2  # type: ignore[arg-type]
    compliance = reach / (3 * bending_stiffness)
    return DifferenceError(compliance, compliance * joint_stiffness, float((t[1] ** 2).sum() ** 2))


class Interface(NamedTuple):
    """How joint DOFs follow from measured channels.

    Attributes
    ----------
    channels : tuple of Channel
        Measured points and directions, side j, then side k: both the responses and the forces that are needed.
    transform : ndarray, shape (2 n, m)
        From the channels to the joint DOFs j, then k.
    references : tuple of ndarray, shape (3,)
        Reference points of the two sides, m: the middle of the points of each.
    dofs : tuple of str, length n
        Names of the joint DOFs.
    motion : ndarray, shape (m, 12)
        Motion of each channel for a unit of x, y, z, theta_x, theta_y, theta_z of the reference point of side j, then
        of side k, where the sides are rigid: 1 or m/rad.
    compliance : ndarray, shape (n,), or None
        Expected addition of the bending of the sides between the points to the compliance of each joint DOF, m/N or
        rad/(N m), if known.
    placed : bool
        Whether the positions of the points are known.
    """

    channels: tuple[Channel, ...]
    transform: FloatArray
    references: tuple[FloatArray, FloatArray]
    dofs: tuple[str, ...]
    motion: FloatArray
    compliance: FloatArray | None = None
    placed: bool = True

    @property
    def modes(self) -> FloatArray:
        """Motion of each channel for a unit of each joint DOF, j then k, shape (m, 2 n)."""
        at = direction_places(self.dofs)
        return self.motion[:, np.concatenate([at, at + len(DIRECTIONS)])]

    @property
    def mode_slopes(self) -> FloatArray:
        """Derivatives of `modes` by x, y and z of the position of a channel, shape (3, m, 2 n), 1/m and 1/rad."""
        at, half = direction_places(self.dofs), len(DIRECTIONS)
        slopes = np.zeros((3, *self.motion.shape))
        for axis, unit in enumerate(np.eye(3)):
            for first in (0, half):
                # The displacement theta x r of a point along e changes by e . (theta x dr) = theta . (dr x e).
                slopes[axis, :, first + 3 : first + half] = np.cross(unit, self.motion[:, first : first + 3])
        return slopes[:, :, np.concatenate([at, at + half])]


def interface(
    points_j: Sequence[int],
    points_k: Sequence[int],
    dofs: Sequence[str],
    coordinates: Mapping[int, NDArray[np.float64]],
    *,
    bending_stiffness: float | None = None,
    highest_hz: float | None = None,
) -> Interface:
    """Build the joint DOFs of both sides from points along lines.

    Parameters
    ----------
    points_j, points_k : sequence of int
        Nodes of side j (on A) and of side k (on B), each along one line parallel to an axis; one node suffices where no
        rotation is wanted.
    dofs : sequence of str
        Joint DOFs: ``"x"``, ``"y"``, ``"z"``, ``"theta_x"``, ``"theta_y"``, ``"theta_z"``.
    coordinates : mapping of int to array_like, shape (3,)
        Positions of the nodes, m.
    bending_stiffness : float, optional
        E I of the sides, N m^2, which gives the compliance that bending between the points adds to rotations
        (`difference_error`) and to displacements across the line; `identify` widens the intervals by it.
    highest_hz : float, optional
        Upper end of the band, Hz, for the warning.

    Returns
    -------
    Interface

    Raises
    ------
    ValueError
        A stiffness that is not positive, an unknown DOF, a node without coordinates, points that are not on a line
        along an axis, a rotation about the line of its points.

    Warns
    -----
    FrfCheckWarning
        The points of a side are more than 3 m apart, or more than 20 wave lengths.

    Notes
    -----
    A rotation about axis a of points along axis e is seen in the displacements along d, a x e = +-d:
    theta_x = -du_y/dz, theta_z = +du_y/dx, theta_y = -du_z/dx (2.57).

    Examples
    --------
    >>> import jointfrf as jf
    >>> places = {1: (0, 0, 0.00), 2: (0, 0, 0.02), 3: (0, 0, 0.00), 4: (0, 0, 0.02)}
    >>> sides = jf.interface([1, 2], [3, 4], ["y", "theta_x"], places)
    >>> [str(channel) for channel in sides.channels]
    ['1:+y', '2:+y', '3:+y', '4:+y']
    >>> sides.transform[:2, :2].tolist()
    [[0.5, 0.5], [50.0, -50.0]]
    """
    dofs = as_names("dofs", dofs)
    points_j, points_k = as_nodes("points_j", points_j), as_nodes("points_k", points_k)
    if not isinstance(coordinates, Mapping):
        raise TypeError("coordinates must be a mapping of nodes to x, y, z")
    if not dofs:
        raise ValueError("dofs must name at least one joint DOF")
    places = direction_places(dofs).tolist()
    check_apart(points_j, points_k)
    sides = [_one_side(points, places, coordinates) for points in (points_j, points_k)]
    (channels_j, rows_j, at_j), (channels_k, rows_k, at_k) = sides
    _warn_of_extent({"j": points_j, "k": points_k}, coordinates, highest_hz)
    motion = block_diag(_motion(channels_j, coordinates, at_j), _motion(channels_k, coordinates, at_k))
    compliance = None
    if bending_stiffness is not None:
        extents = [np.ptp([coordinates[node] for node in points], axis=0) for points in (points_j, points_k)]
        compliance = np.sum([_added_compliance(extent / 2, bending_stiffness) for extent in extents], axis=0)[places]
    transform = block_diag(rows_j, rows_k)
    return Interface((*channels_j, *channels_k), transform, (at_j, at_k), direction_names(dofs), motion, compliance)


def _added_compliance(reach: FloatArray, bending_stiffness: float) -> FloatArray:
    """Return the compliance that bending of a side between its points adds to each direction, shape (6,).

    The couple of forces at +-r adds r/(6 E I) to a rotation (`difference_error`). Half a force at each of +-r, read as
    the mean displacement, adds r^3/(6 E I) to a displacement across the line, likewise by strain energy.
    """
    r, line = float(reach.max()), int(reach.argmax())
    if r == 0:
        return np.zeros(2 * len(_AXES))
    rotation = difference_error([-r, r], bending_stiffness, 1.0).compliance / 2
    across = np.where(np.arange(len(_AXES)) == line, 0.0, r**2 * rotation)
    return np.concatenate([across, np.full(len(_AXES), rotation)])


def _warn_of_extent(
    sides: Mapping[str, Sequence[int]], coordinates: Mapping[int, NDArray[np.float64]], highest_hz: float | None
) -> None:
    """Warn of a side whose points are too far apart for a joint."""
    extents = {side: extent_of([coordinates[node] for node in points]) for side, points in sides.items()}
    side = max(extents, key=extents.__getitem__)
    if extents[side] > longest_extent(highest_hz):
        warnings.warn(
            f"the points of side {side} are {extents[side]:.3g} m apart, as if coordinates were in millimetres; give "
            "them in metres",
            FrfCheckWarning,
            stacklevel=3,
        )


def _motion(
    channels: Sequence[Channel], coordinates: Mapping[int, NDArray[np.float64]], about: FloatArray
) -> FloatArray:
    """Return the motion of channels for unit motions of a reference point, shape (m, 6)."""
    at = np.array([np.asarray(coordinates[channel.node], dtype=float) for channel in channels])
    return rigid_motion(at, about)[np.arange(len(at)), [_AXES.index(c.axis) for c in channels]]


def _one_side(
    points: Sequence[int], places: Sequence[int], coordinates: Mapping[int, NDArray[np.float64]]
) -> tuple[list[Channel], FloatArray, FloatArray]:
    if not points or len(set(points)) != len(points):
        raise ValueError(f"a side of the joint needs different nodes, not {', '.join(map(str, points)) or 'none'}")
    missing = [node for node in points if node not in coordinates]
    if missing:
        raise ValueError(f"node {missing[0]} has no coordinates; add them")
    at = np.array([as_real(f"coordinates of node {node}", coordinates[node], (3,)) for node in points])
    middle = (at.min(axis=0) + at.max(axis=0)) / 2
    extent = np.ptp(at, axis=0)
    along = int(np.argmax(extent))
    if len(points) > 1 and np.delete(extent, along).max() > _STRAY * extent[along]:
        names = ", ".join(map(str, points))
        raise ValueError(f"nodes {names} do not lie on one line parallel to an axis; name the points of one line")

    weights = np.vstack([np.ones(1), np.zeros(1)])
    if len(points) > 1:
        weights = difference_weights(at[:, along] - middle[along])
    needed = [
        (place, weights[0]) if place < len(_AXES) else _rotation(place - len(_AXES), points, along, weights[1])
        for place in places
    ]
    seen = sorted({axis for axis, _ in needed})
    channels = [Channel(node, f"+{_AXES[axis]}") for axis in seen for node in points]
    rows = np.zeros((len(places), len(channels)))
    for row, (axis, values) in zip(rows, needed, strict=True):
        first = seen.index(axis) * len(points)
        row[first : first + len(points)] = values
    return channels, rows, middle


def _rotation(about: int, points: Sequence[int], along: int, slope: FloatArray) -> tuple[int, FloatArray]:
    """Return the axis along which a rotation about another one is seen, and the weights of the points."""
    dof = f"theta_{_AXES[about]}"
    names = ", ".join(map(str, points))
    if len(points) < 2:
        raise ValueError(f"{dof} needs at least two nodes on each side, not {names}")
    if about == along:
        axis = _AXES[along]
        raise ValueError(f"{dof} cannot be found from nodes {names} along its axis {axis}; name nodes off that axis")
    normal = np.cross(np.eye(3)[about], np.eye(3)[along])
    seen = int(np.argmax(abs(normal)))
    return seen, normal[seen] * slope
