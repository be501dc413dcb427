"""From the channels around a joint to its DOFs: virtual points of sensors and impacts on both sides, DOFs left out."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.channels.point_lines import Interface
from jointfrf.channels.virtual_point import (
    VirtualPoint,
    impact_consistency,
    sensor_consistency,
    virtual_interface,
    virtual_point,
)
from jointfrf.dofs import DIRECTIONS, direction_names, direction_places, is_rotation
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.frf.frf_set import Channel, ChannelPlace, FrfSet, JointSide, check_apart
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray, as_real, check_type
from jointfrf.spelling import some_of

__all__ = [
    "PAIRS_SHOWN",
    "ChannelAgreement",
    "JointChannels",
    "LeftOutDof",
    "MissingFrfs",
    "OffsetCoupling",
    "SideAgreement",
    "joint_channels",
    "joint_channels_of_all",
    "left_out_dofs",
    "node_dofs",
    "offset_couplings",
]

#: Geometry below this share of the reach of the channels is rounding.
_NOTHING = 1e-6
#: The channels show a DOF when it is known to this part of a unit.
_SHOWN = 1e-6
#: Share of the motion of a DOF from which on another one that enters it is named.
_ENTERS = 0.05
#: Arms below this are rounding, m.
_NO_ARM = 1e-6
_Kind = Literal["response", "excitation"]
#: Missing FRFs that a message names.
PAIRS_SHOWN = 4
#: Sides of the joint, on A and on B.
_SIDES: tuple[JointSide, JointSide] = ("j", "k")
#: Directions of channels in the order of `DIRECTIONS`.
_CHANNELS = ("x", "y", "z", "rx", "ry", "rz")


class LeftOutDof(NamedTuple):
    """A DOF left out that enters one that is kept.

    Attributes
    ----------
    side : {"j", "k"}
    dof, into : str
        The DOF left out, and the one that its motion is attributed to.
    weight : float
        Unit of its motion there: 1, m, 1/m.
    share : float
        Its part in the motion found of that DOF, root mean square over lines and forces; NaN where the channels do not
        show the DOF.
    """

    side: str
    dof: str
    into: str
    weight: float
    share: float

    @property
    def matters(self) -> bool:
        """Whether it is a noticeable part of the motion found, or may be."""
        return not self.share < _ENTERS

    def __str__(self) -> str:
        unit = " m" if is_rotation(self.dof) > is_rotation(self.into) else ""
        size = (
            f"{100 * self.share:.0f} % of its motion"
            if np.isfinite(self.share)
            else "how much cannot be seen from these channels"
        )
        return (
            f"{self.weight:.3g}{unit} of {self.dof}, which is left out, enters {self.into} of side {self.side} "
            f"({size}): fit {self.dof}, too, or move the reference point or the channels"
        )


class OffsetCoupling(NamedTuple):
    """A rotation that an offset between the reference points of the two sides turns into relative displacement.

    Attributes
    ----------
    translation, rotation : str
        The DOF kept, and the rotation of both sides together.
    arm : float
        Relative displacement for a unit of the rotation, m.
    is_left_out : bool
        Whether the rotation is no DOF of the joint.
    """

    translation: str
    rotation: str
    arm: float
    is_left_out: bool

    def __str__(self) -> str:
        left = ", which is left out" if self.is_left_out else ""
        return (
            f"the offset between the reference points couples {self.translation} with {self.rotation}{left}: "
            f"{1e3 * self.arm:.3g} mm"
        )


def offset_couplings(interface: Interface) -> tuple[OffsetCoupling, ...]:
    """Find the rotations that an offset of the reference points turns into displacements of the joint.

    Parameters
    ----------
    interface : Interface

    Returns
    -------
    tuple of OffsetCoupling
        Empty where both sides have one reference point.

    Notes
    -----
    If both sides turn by theta as one body, points that are d apart move theta x d against each other: a joint
    between them resists that, and its stiffness is not diagonal.

    Examples
    --------
    >>> import jointfrf as jf
    >>> from jointfrf.channels.joint_channels import offset_couplings
    >>> sides = jf.interface([1], [2], ["x"], {1: (0, 0, 0), 2: (0, 0.006, 0)})
    >>> print(*offset_couplings(sides))
    the offset between the reference points couples x with theta_z, which is left out: -6 mm
    """
    apart = interface.references[1] - interface.references[0]
    kept = direction_places(interface.dofs)
    found = []
    for axis in range(3):
        moved = np.cross(np.eye(3)[axis], apart)
        rotation = DIRECTIONS[3 + axis]
        found += [
            OffsetCoupling(DIRECTIONS[place], rotation, float(moved[place]), 3 + axis not in kept)
            for place in kept
            if place < 3 and abs(moved[place]) > _NO_ARM
        ]
    return tuple(found)


def left_out_dofs(h: ComplexArray, interface: Interface) -> tuple[LeftOutDof, ...]:
    """Find the DOFs left out whose motion enters DOFs that are kept.

    Parameters
    ----------
    h : ndarray, shape (n_freq, m, m_in)
        FRFs of the channels of the interface.
    interface : Interface

    Returns
    -------
    tuple of LeftOutDof
        For each DOF left out, the kept DOF that it disturbs most on each side.

    Notes
    -----
    If the side turns, a channel 6 mm from the reference point along y shows x - 0.006 theta_z. With theta_z left out,
    T M contains -0.006 for its rigid motion M. The size of theta_z comes from all DOFs that the channels show.
    """
    n, found = len(interface.dofs), []
    for side in range(2):
        own = interface.transform[side * n : (side + 1) * n]
        at = np.flatnonzero(own.any(axis=0))
        motion = interface.motion[at][:, side * 6 : side * 6 + 6]
        inverse = np.linalg.pinv(motion)
        size = _rms(inverse @ h[:, at])
        shown = abs(np.diagonal(inverse @ motion) - 1) < _SHOWN
        of_kept = _rms(own @ h)
        weights = own[:, at] @ motion
        reach = np.sqrt((motion[:, 3:] ** 2).sum(axis=1).max())
        unit = np.array([1.0] * 3 + [1 / (reach or 1.0)] * 3)
        unit_kept = unit[[DIRECTIONS.index(dof) for dof in interface.dofs]]
        for d, dof in enumerate(DIRECTIONS):
            if dof in interface.dofs:
                continue
            relative = abs(weights[:, d]) * unit[d] / unit_kept
            if relative.max() < _NOTHING:
                continue
            weight = np.where(relative < _NOTHING, 0, weights[:, d])
            shares = abs(weight) * size[d] / np.maximum(of_kept, TINY)
            most = int((shares if shown[d] else relative).argmax())
            share = float(shares[most]) if shown[d] else np.nan
            found.append(LeftOutDof("jk"[side], dof, interface.dofs[most], float(weight[most]), share))
    return tuple(found)


def _rms(q: ComplexArray) -> FloatArray:
    """Return the root mean square of each row over its columns, and its median over lines."""
    return np.asarray(np.median(np.sqrt((abs(q) ** 2).mean(axis=2)), axis=0))


@dataclass(frozen=True)
class ChannelAgreement:
    """How far one channel agrees with the rigid motion of its side.

    Attributes
    ----------
    channel : Channel
    consistency : float
        Median over lines of the specific consistency, 0 to 1; 1: the channel moves as its neighbours predict.
    blame : float
        Mean over lines of the share of the inconsistency of its side that is gone without it, 0 to 1; NaN where the
        other channels cannot check it.
    """

    channel: Channel
    consistency: float
    blame: float


@dataclass(frozen=True)
class SideAgreement:
    """The channels of one kind on one side of a joint, compared with rigid motion.

    Attributes
    ----------
    kind : {"response", "excitation"}
    side : {"j", "k"}
    rigid : float
        Median over lines of the overall consistency, 0 to 1; 1: all motion is rigid.
    condition : float
        Condition number of the virtual point, `VirtualPoint.condition`.
    channels : tuple of ChannelAgreement
    """

    kind: _Kind
    side: JointSide
    rigid: float
    condition: float
    channels: tuple[ChannelAgreement, ...]


@dataclass(frozen=True)
class MissingFrfs:
    """A channel left out of its virtual point because FRFs of it are missing.

    Attributes
    ----------
    kind : {"response", "excitation"}
    side : {"j", "k"}
    channel : Channel
    others : int
        How many channels its virtual point has left.
    pairs : tuple of (Channel, Channel)
        Responses and excitations of the missing FRFs.
    """

    kind: _Kind
    side: JointSide
    channel: Channel
    others: int
    pairs: tuple[tuple[Channel, Channel], ...]

    def __str__(self) -> str:
        names = some_of([f"{output} / {input_}" for output, input_ in self.pairs], PAIRS_SHOWN)
        which = "the FRF" if len(self.pairs) == 1 else "FRFs"
        verb = "is" if len(self.pairs) == 1 else "are"
        return (
            f"{which} {names} (response / excitation) {verb} missing: {self.kind} {self.channel} is left out, "
            f"the virtual point of side {self.side} has {self.others} other {self.kind}s"
        )


@dataclass(frozen=True)
class JointChannels:
    """How the DOFs of a joint follow from the measured responses and excitations around it.

    Attributes
    ----------
    responses, forces : Interface
        From the responses, and from the excitations, to the joint DOFs; the same object where both are the same
        channels at the same places.
    points : mapping of (kind, side) to VirtualPoint
        ``("response", "j")``, ...
    positions : mapping of (kind, side) to ndarray, shape (m, 3)
        Positions of the channels of each virtual point, m.
    """

    responses: Interface
    forces: Interface
    points: Mapping[tuple[str, str], VirtualPoint]
    positions: Mapping[tuple[str, str], FloatArray]

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the joint DOFs."""
        return self.responses.dofs

    @property
    def transform(self) -> Interface | tuple[Interface, Interface]:
        """What `identify` takes as `transform`."""
        return self.responses if self.responses is self.forces else (self.responses, self.forces)

    def gamma(self, frfs: FrfSet) -> ComplexArray:
        """FRFs between the channels, shape (n_freq, m_r, m_f), as `identify` takes them.

        Raises
        ------
        FileContentError
            FRFs are missing.
        """
        check_type("frfs", frfs, FrfSet)
        return frfs.matrix(self.responses.channels, self.forces.channels)

    def without(self, responses: Iterable[int], excitations: Iterable[int]) -> JointChannels:
        """Return the same without some of its responses and excitations, by their places.

        Raises
        ------
        ValueError
            Those left do not show the DOFs of the joint.
        """
        dropped = {"response": set(responses), "excitation": set(excitations)}
        if not any(dropped.values()):
            return self
        points: dict[tuple[str, str], VirtualPoint] = {}
        positions: dict[tuple[str, str], FloatArray] = {}
        names: dict[str, list[Channel]] = {"response": [], "excitation": []}
        for kind, interface in (("response", self.responses), ("excitation", self.forces)):
            first = 0
            for side in _SIDES:
                point, where = self.points[kind, side], self.positions[kind, side]
                kept = np.array([i for i in range(len(where)) if first + i not in dropped[kind]], np.intp)
                names[kind] += [interface.channels[first + i] for i in kept]
                first += len(where)
                positions[kind, side] = where[kept]
                points[kind, side] = virtual_point(
                    where[kept], point.motion[kept, :3], point.point, point.dofs, point.weights[kept]
                )
        return _joined(names, points, positions)

    def without_missing(self, measured: NDArray[np.bool_]) -> tuple[JointChannels, tuple[MissingFrfs, ...]]:
        """Leave out as few channels as make all FRFs known, those that their virtual points can spare first.

        Parameters
        ----------
        measured : ndarray of bool, shape (m_r, m_f)
            Which FRFs between the channels there are.

        Raises
        ------
        FileContentError
            Those left do not show the DOFs of the joint.
        """
        left_out: list[tuple[int, int]] = []
        lacking = ~measured
        while lacking.any():
            left_out.append(_least_needed(self, lacking, left_out))
            np.moveaxis(lacking, left_out[-1][0], 0)[left_out[-1][1]] = False
        own = [[i for axis, i in left_out if axis == 0], [i for axis, i in left_out if axis == 1]]
        try:
            found = self.without(*own)
        except ValueError as error:
            names = ", ".join(f"{a} / {b}" for a, b in self._pairs(~measured)[:PAIRS_SHOWN])
            raise FileContentError(
                f"missing FRFs (response / excitation): {names}; without these channels {error}"
            ) from error
        return found, tuple(self._missing(found, axis, i, measured) for axis, i in left_out)

    def _pairs(self, lacking: NDArray[np.bool_]) -> list[tuple[Channel, Channel]]:
        rows, columns = self.responses.channels, self.forces.channels
        return [(rows[i], columns[j]) for i, j in zip(*np.nonzero(lacking), strict=True)]

    def _side_of(self, axis: int, place: int) -> tuple[_Kind, JointSide]:
        kind: _Kind = "response" if axis == 0 else "excitation"
        return kind, "j" if place < len(self.positions[kind, "j"]) else "k"

    def _missing(self, left: JointChannels, axis: int, place: int, measured: NDArray[np.bool_]) -> MissingFrfs:
        kind, side = self._side_of(axis, place)
        own = np.zeros_like(measured)
        np.moveaxis(own, axis, 0)[place] = True
        channel = (self.responses if axis == 0 else self.forces).channels[place]
        return MissingFrfs(kind, side, channel, len(left.positions[kind, side]), tuple(self._pairs(own & ~measured)))

    def agreement(self, h: ComplexArray) -> tuple[SideAgreement, ...]:
        """Sensor and impact consistency of both sides, and the part of each channel in it.

        Parameters
        ----------
        h : ndarray, shape (n_freq, m_r, m_f)
            As `gamma` gives them.

        Returns
        -------
        tuple of SideAgreement
            Responses of sides j and k, then excitations.
        """
        found = []
        for kind, interface in (("response", self.responses), ("excitation", self.forces)):
            first = 0
            for side in _SIDES:
                point = self.points[kind, side]
                own = slice(first, first + point.modes.shape[0])
                first = own.stop
                names = interface.channels[own]
                found.append(_agreement(kind, side, names, point, h[:, own] if kind == "response" else h[:, :, own]))
        return tuple(found)

    def left_out(self, h: ComplexArray) -> tuple[LeftOutDof, ...]:
        """Name DOFs left out whose motion enters one that is kept, of responses and of excitations."""
        found = left_out_dofs(h, self.responses)
        if self.forces is self.responses:
            return found
        return found + left_out_dofs(np.ascontiguousarray(h.swapaxes(1, 2)), self.forces)


def joint_channels(
    frfs: FrfSet,
    places: Iterable[ChannelPlace],
    at: ArrayLike,
    dofs: Sequence[str] = DIRECTIONS,
    *,
    at_k: ArrayLike | None = None,
) -> JointChannels:
    """Build the DOFs of a joint from all channels around it: virtual points of both sides.

    Parameters
    ----------
    frfs : FrfSet
        Which responses and excitations there are, and coordinates of nodes.
    places : iterable of ChannelPlace
        Channels on both sides, as `places_of_nodes` or `jointfrf.io.read_channel_table` list them.
    at : array_like, shape (3,)
        Reference point of the joint, m.
    dofs : sequence of str
        Joint DOFs.
    at_k : array_like, shape (3,), optional
        Reference point of side k, by default the reference point of side j.

    Returns
    -------
    JointChannels
        Without channels whose FRFs are missing, if the remaining channels suffice.

    Raises
    ------
    ValueError
        A channel without a side, without a place or not in the set, or named twice; too few channels on a side for the
        DOFs, or channels that do not show them.
    FileContentError
        FRFs are missing, and the channels that have all do not suffice.

    Warns
    -----
    FileContentWarning
        A channel is left out because an FRF of it is missing.

    Notes
    -----
    Sensors and impacts may be different channels: responses and excitations each have a virtual point on each side
    (`virtual_point`).

    Examples
    --------
    >>> import numpy as np
    >>> import jointfrf as jf
    >>> nodes = {1: (-0.01, 0, 0), 2: (0.01, 0, 0), 3: (-0.01, 0, 0), 4: (0.01, 0, 0)}
    >>> ends = tuple(jf.io.Channel(node, "y") for node in nodes)
    >>> frfs = jf.io.FrfSet(np.array([10.0]), ends, ends, np.ones((1, 4, 4)), coordinates=nodes)
    >>> sides = jf.joint_channels(frfs, jf.places_of_nodes(frfs, [1, 2], [3, 4]), [0, 0, 0], ["y", "rz"])
    >>> sides.dofs, sides.responses.transform[:2, :2].round(6).tolist()
    (('y', 'theta_z'), [[0.5, 0.5], [-50.0, 50.0]])
    """
    every = joint_channels_of_all(frfs, places, at, dofs, at_k=at_k)
    found, missing = every.without_missing(frfs.measured_between(every.responses.channels, every.forces.channels))
    for one in missing:
        warnings.warn(FileContentWarning(str(one)), stacklevel=2)
    return found


def joint_channels_of_all(
    frfs: FrfSet,
    places: Iterable[ChannelPlace],
    at: ArrayLike,
    dofs: Sequence[str] = DIRECTIONS,
    *,
    at_k: ArrayLike | None = None,
) -> JointChannels:
    """Build the DOFs of a joint as `joint_channels`, with all channels, whichever FRFs are missing."""
    reference = as_real("at", at, (3,))
    references = {"j": reference, "k": reference if at_k is None else as_real("at_k", at_k, (3,))}
    if not isinstance(places, Iterable):
        raise TypeError(f"places must be a list of ChannelPlace, not {type(places).__name__}")
    given = list(places)
    _check_known(frfs, given)
    chosen = {
        (kind, side): [place for place in given if place.side == side and _counts(place, kind, own)]
        for kind, own in (("response", frfs.responses), ("excitation", frfs.excitations))
        for side in _SIDES
    }
    points: dict[tuple[str, str], VirtualPoint] = {
        (kind, side): _point(frfs, kind, side, own, references[side], dofs) for (kind, side), own in chosen.items()
    }
    positions: dict[tuple[str, str], FloatArray] = {
        key: np.array([_position(frfs, place) for place in own]) for key, own in chosen.items()
    }
    names = {
        kind: [place.channel for side in _SIDES for place in chosen[kind, side]] for kind in ("response", "excitation")
    }
    return _joined(names, points, positions)


def _joined(
    names: Mapping[str, Sequence[Channel]],
    points: Mapping[tuple[str, str], VirtualPoint],
    positions: Mapping[tuple[str, str], FloatArray],
) -> JointChannels:
    one, other = (
        virtual_interface(points[kind, "j"], points[kind, "k"])._replace(channels=tuple(names[kind]))
        for kind in ("response", "excitation")
    )
    same = one.channels == other.channels and np.array_equal(one.transform, other.transform)
    return JointChannels(one, one if same else other, points, positions)


def _least_needed(
    joint: JointChannels, lacking: NDArray[np.bool_], left_out: Sequence[tuple[int, int]]
) -> tuple[int, int]:
    """Return the channel, axis and place, that lacks most FRFs; of equal ones one that its virtual point can spare."""
    best: tuple[tuple[int, int], tuple[int, int]] | None = None
    for axis in (0, 1):
        counts = lacking.sum(axis=1 - axis)
        for place in np.flatnonzero(counts):
            kind, side = joint._side_of(axis, int(place))
            gone = sum(1 for where, other in left_out if joint._side_of(where, other) == (kind, side))
            order = int(counts[place]), len(joint.positions[kind, side]) - gone
            if best is None or order > best[0]:
                best = order, (axis, int(place))
    assert best is not None
    return best[1]


def _is_there(channel: Channel, known: Sequence[Channel]) -> bool:
    return channel in known or channel.opposite() in known


def _counts(place: ChannelPlace, kind: str, known: Sequence[Channel]) -> bool:
    return place.role in (kind, "both") and place.weight > 0 and _is_there(place.channel, known)


def _check_known(frfs: FrfSet, places: Sequence[ChannelPlace]) -> None:
    """Check that each channel has a side, is a translation, is listed once, and is in the set."""
    check_type("frfs", frfs, FrfSet)
    seen: dict[tuple[int, str, str], ChannelPlace] = {}
    for place in places:
        check_type("place", place, ChannelPlace)
        where = f"{place.where}: " if place.where else ""
        if place.side is None:
            raise ValueError(f"{where}channel {place.channel} has no side; write j or k")
        if place.channel.is_rotation:
            raise ValueError(f"{where}channel {place.channel} is a rotation; use translations for a virtual point")
        for kind in ("response", "excitation") if place.role == "both" else (place.role,):
            key = place.channel.node, place.channel.axis, kind
            if key in seen:
                raise ValueError(f"{where}channel {place.channel} is listed twice as {kind}; keep one row")
            seen[key] = place
        known = {
            "response": frfs.responses,
            "excitation": frfs.excitations,
            "both": (*frfs.responses, *frfs.excitations),
        }[place.role]
        if not place.optional and not _is_there(place.channel, known):
            what = "channel" if place.role == "both" else place.role
            raise ValueError(f"{where}{frfs.source or 'the set'} has no {what} {place.channel}")


def _point(
    frfs: FrfSet, kind: str, side: str, places: Sequence[ChannelPlace], reference: FloatArray, dofs: Sequence[str]
) -> VirtualPoint:
    """Return the virtual point of the responses or excitations of a side."""
    if not places:
        raise ValueError(f"side {side} of the joint has no {kind}s; name the nodes of sensors and of impacts")
    positions = [_position(frfs, place) for place in places]
    weights = [place.weight for place in places]
    try:
        return virtual_point(positions, [place.unit for place in places], reference, dofs, weights)
    except ValueError as error:
        names = ", ".join(str(place.channel) for place in places[:6]) + (", ..." if len(places) > 6 else "")
        raise ValueError(f"{kind}s of side {side} ({names}): {error}") from error


def _position(frfs: FrfSet, place: ChannelPlace) -> NDArray[np.float64]:
    if place.position is not None:
        return place.position
    node = place.channel.node
    if node not in frfs.coordinates:
        where = f"{place.where}: " if place.where else ""
        raise ValueError(
            f"{where}node {node} has no coordinates in {frfs.source or 'the set'}; add them to a table of channels"
        )
    return np.asarray(frfs.coordinates[node], dtype=np.float64)


def _agreement(
    kind: _Kind | str, side: JointSide, names: Sequence[Channel], point: VirtualPoint, h: ComplexArray
) -> SideAgreement:
    # Directions that move much more than others would hide an error of the small ones behind their noise.
    of_each = (0, 2) if kind == "response" else (0, 1)
    power = np.mean(abs(h) ** 2, axis=of_each)
    weighted = _weighted(point, np.where(power > 0, power, power.max() or 1.0))
    check = sensor_consistency if kind == "response" else impact_consistency
    found = check(np.ascontiguousarray(h), weighted)
    with np.errstate(invalid="ignore"):
        specific, blame = np.nanmedian(found.specific, axis=0), np.nanmean(found.blame, axis=0)
    unchecked = weighted.redundancy < 1e-6
    return SideAgreement(
        kind,  # type: ignore[arg-type]
        side,
        float(np.nanmedian(found.overall)),
        point.condition,
        tuple(
            ChannelAgreement(name, float(one), float("nan") if free else float(share))
            for name, one, share, free in zip(names, specific, blame, unchecked, strict=True)
        ),
    )


def _weighted(point: VirtualPoint, power: FloatArray) -> VirtualPoint:
    """Return the same point with each channel weighted by the inverse of its power."""
    root = np.sqrt(point.weights / power)
    inverse = np.linalg.pinv(root[:, None] * point.modes) * root
    return point._replace(transform=inverse.astype(np.float64), weights=root**2)


def node_dofs(node_j: int, node_k: int, dofs: Sequence[str], coordinates: Mapping[int, ArrayLike]) -> Interface:
    """Take translations and rotations of two nodes as the DOFs of a joint, as a model or a coupled assembly gives them.

    Parameters
    ----------
    node_j, node_k : int
        Nodes on side j (on A) and on side k (on B).
    dofs : sequence of str
        Joint DOFs.
    coordinates : mapping of int to array_like, shape (3,)
        Positions of the nodes, m; a node that is missing is taken to lie where the other one is.

    Returns
    -------
    Interface
        Channels ``node:x`` ... ``node:rz`` of j, then of k; the transform is a unit matrix.

    Raises
    ------
    ValueError
        An unknown DOF, or both nodes are the same.

    Examples
    --------
    >>> from jointfrf.channels.joint_channels import node_dofs
    >>> [str(channel) for channel in node_dofs(3, 4, ["y", "theta_z"], {}).channels]
    ['3:+y', '3:+rz', '4:+y', '4:+rz']
    """
    check_apart([node_j], [node_k])
    places = direction_places(dofs)
    n = places.size
    channels = tuple(Channel(node, _CHANNELS[place]) for node in (node_j, node_k) for place in places)
    given = [np.asarray(coordinates[node], float) for node in (node_j, node_k) if node in coordinates]
    ends = given if len(given) == 2 else [np.zeros(3)] * 2
    motion = np.zeros((2 * n, 12))
    motion[np.arange(n), places] = 1
    motion[n + np.arange(n), 6 + places] = 1
    placed = len(given) == 2
    return Interface(channels, np.eye(2 * n), (ends[0], ends[1]), direction_names(dofs), motion, placed=placed)
