"""The joint in a measured file: which channels, how they give its DOFs, and what is to be said of them beforehand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest
from typing import Any

import numpy as np

from jointfrf.channels.check.result import FrfCheck
from jointfrf.channels.joint_channels import (
    ChannelAgreement,
    JointChannels,
    LeftOutDof,
    OffsetCoupling,
    SideAgreement,
    joint_channels_of_all,
    left_out_dofs,
    node_dofs,
    offset_couplings,
)
from jointfrf.channels.point_lines import Interface, interface
from jointfrf.dofs import is_rotation
from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import ChannelPlace, JointSide, places_of_nodes
from jointfrf.io import FrfSet, read_channel_table
from jointfrf.io.channel_table import places_of_table
from jointfrf.io.units import StatedUnits
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.toml.table import read_toml
from jointfrf.workbench.assembly_file.side_part import PlacedChannel
from jointfrf.workbench.cli.arguments.measured_file import JointArguments, PointArguments
from jointfrf.workbench.cli.arguments.words import Nodes, shown_nodes
from jointfrf.workbench.cli.measured_file import in_some_band
from jointfrf.workbench.cli.usage import UsageError, check_both, listed

__all__ = ["MeasuredJoint", "measured_joint"]


@dataclass(frozen=True)
class MeasuredJoint:
    """A joint as a file of FRFs shows it.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    h : ndarray, shape (n_freq, m_r, m_f)
        Receptances between its channels.
    responses, forces : Interface
        From the channels to the joint DOFs.
    channels : JointChannels or None
        Virtual points, if there are any.
    nodes : tuple of two lists of int
        On sides j and k.
    bands : list of (low, high), or None
        Hz; findings on channels are of these lines.
    every : (JointChannels, ndarray) or None
        The virtual points with the channels, too, that are left out because FRFs of them are missing, and the FRFs
        between all of them, NaN if there is none.
    is_of_points : bool
        Whether the channels are the DOFs of several joint points.
    """

    freq_hz: FloatArray
    h: ComplexArray
    responses: Interface
    forces: Interface
    channels: JointChannels | None
    nodes: tuple[list[int], list[int]]
    bands: list[tuple[float, float]] | None
    every: tuple[JointChannels, ComplexArray] | None = None
    is_of_points: bool = False

    def placed(self, side: int, coordinates: Mapping[int, FloatArray]) -> list[list[PlacedChannel]]:
        """Return the responses and the excitations of side 0 (j) or 1 (k), with their places from its reference."""
        found = []
        for kind, own in (("response", self.responses), ("excitation", self.forces)):
            n = len(own.dofs)
            rows = np.flatnonzero(own.transform[side * n : (side + 1) * n].any(axis=0))
            known = None if self.channels is None else self.channels.positions[kind, "jk"[side]]
            named = []
            for i, row in enumerate(rows):
                channel = own.channels[row]
                place = coordinates.get(channel.node) if known is None else known[i]
                place = None if place is None else place - own.references[side]
                named.append(PlacedChannel(channel, own.motion[row, 6 * side : 6 * side + 3], place))
            found.append(named)
        return found

    def known(self, frfs: FrfSet, *, is_noise_stated: bool) -> dict[str, Any]:
        """Return what `identify` takes of the channels: to the joint DOFs, set-ups, coherence where the file has it.

        Coherence is left out if the noise is stated.
        """
        names = self.responses.channels, self.forces.channels
        coherence = None if is_noise_stated else frfs.coherence_matrix(*names)
        shared = {} if coherence is None else {"coherence": coherence, "averages": frfs.least_averages(*names)}
        one_or_both = self.responses if self.is_square else (self.responses, self.forces)
        transform = None if self.is_of_points else one_or_both
        return {"transform": transform, "setups": frfs.setups_between(*names), **shared}

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the joint DOFs."""
        return self.responses.dofs

    @property
    def is_square(self) -> bool:
        """Whether responses and excitations are the same channels."""
        return self.responses is self.forces

    @cached_property
    def _lines(self) -> ComplexArray:
        return in_some_band(self.freq_hz, self.h, self.bands)[1]

    @cached_property
    def agreement(self) -> tuple[SideAgreement, ...]:
        """Share of each channel in motion that is not rigid; empty without virtual points."""
        return () if self.channels is None else self.channels.agreement(self._lines)

    @cached_property
    def left_out(self) -> tuple[LeftOutDof, ...]:
        """DOFs left out that enter those that are kept."""
        if self.is_of_points or np.isnan(self._lines).all(axis=0).any():
            return ()
        found = left_out_dofs(self._lines, self.responses)
        if not self.is_square:
            found += left_out_dofs(np.ascontiguousarray(self._lines.swapaxes(1, 2)), self.forces)
        return tuple({(one.side, one.dof, one.into): one for one in found if one.matters}.values())

    def _without(self, check: FrfCheck) -> MeasuredJoint:
        """Return the same without the channels in which errors were found; itself where the others do not suffice."""
        wrong = {name for finding in check.findings if finding.severity == "error" for name in finding.about}
        if self.channels is None or not wrong:
            return self
        sides = self.responses.channels, self.forces.channels
        bad = [
            [i for i, channel in enumerate(own) if wrong & {str(channel), f"{word} {channel}"}]
            for word, own in zip(("response", "force"), sides, strict=True)
        ]
        try:
            left = self.channels.without(*bad)
        except ValueError:
            return self
        rows, columns = (np.setdiff1d(np.arange(len(own)), gone) for own, gone in zip(sides, bad, strict=True))
        h = np.ascontiguousarray(self.h[:, rows][:, :, columns])
        return replace(self, h=h, responses=left.responses, forces=left.forces, channels=left)

    @property
    def offsets(self) -> tuple[OffsetCoupling, ...]:
        """Rotations that reference points which are apart turn into displacements."""
        return () if self.is_of_points else offset_couplings(self.responses)

    def warnings(self, check: FrfCheck) -> Iterator[str]:
        """Return warnings before the fit, in addition to the findings of the data check."""
        if any(finding.code == "coordinates-unit" and finding.severity == "error" for finding in check.findings):
            return
        yield from (str(one) for one in self._without(check).left_out)
        yield from (f"{one}; --at X,Y,Z gives both sides one" for one in self.offsets if one.is_left_out)

    def text(self) -> Iterator[str]:
        """Describe reference points, and channels compared with rigid motion, line by line."""
        one, other = self.responses.references
        if self.channels is not None and np.array_equal(one, other):
            yield f"virtual points at x, y, z = {_millimetres(one)} mm on both sides"
        elif self.channels is not None:
            yield f"virtual points at x, y, z = {_millimetres(one)} mm (j) and {_millimetres(other)} mm (k)"
        if np.linalg.norm(other - one) > 0:
            yield (
                f"reference points {1e3 * np.linalg.norm(other - one):.3g} mm apart: x, y, z = "
                f"{_millimetres(other - one)} mm"
            )
        yield from (str(one) for one in self.offsets if not one.is_left_out)
        if self.agreement:
            yield from ("", *_agreement_table(self.agreement))

    def to_dict(self) -> dict[str, Any]:
        """Return the joint and its channels, for JSON."""
        return {
            "nodes": {"j": self.nodes[0], "k": self.nodes[1]},
            "dofs": self.dofs,
            "reference_points_m": dict(zip("jk", self.responses.references, strict=True)),
            "responses": [str(channel) for channel in self.responses.channels],
            "excitations": [str(channel) for channel in self.forces.channels],
            "left_out": [one._asdict() for one in self.left_out],
            "offset_couplings": [one._asdict() for one in self.offsets],
            "agreement": [
                {
                    "kind": group.kind,
                    "side": group.side,
                    "not_rigid": _not_rigid(group),
                    "condition": group.condition,
                    "channels": {
                        str(one.channel): {"consistency": one.consistency, "blame": one.blame} for one in group.channels
                    },
                }
                for group in self.agreement
            ],
        }


def _millimetres(place: FloatArray) -> str:
    return ", ".join(f"{1e3 * value:.4g}" for value in place + 0.0)


def _not_rigid(group: SideAgreement) -> float:
    """Part of the motion that is not rigid, root mean square."""
    return float(np.sqrt(max(1 - group.rigid**2, 0)))


def _agreement_cell(one: ChannelAgreement | None) -> str:
    if one is None:
        return " " * 32
    blame = "  ?" if np.isnan(one.blame) else f"{100 * one.blame:.0f} %"
    return f"{one.channel!s:<12}{one.consistency:>12.3f}{blame:>8}"


def _agreement_table(groups: tuple[SideAgreement, ...]) -> Iterator[str]:
    """Write the channels of each side beside one another: consistency and blame."""
    for kind in ("response", "excitation"):
        j, k = (group for group in groups if group.kind == kind)
        for group in (j, k):
            yield (
                f"{kind}s of side {group.side}: {len(group.channels)} channels, condition {group.condition:.3g}; "
                f"{100 * _not_rigid(group):.2g} % of their motion is not rigid"
            )
        heading = f"  {'channel':<12}{'consistency':>12}{'blame':>8}"
        yield f"{heading}    {heading.strip()}"
        for pair in zip_longest(j.channels, k.channels):
            yield f"  {'    '.join(map(_agreement_cell, pair))}".rstrip()
        yield ""
    yield "consistency: 1 where a channel moves as the others say"
    yield "blame: share of what is not rigid on its side that is gone without it"


def measured_joint(
    args: JointArguments, frfs: FrfSet, bending_stiffness: float | None = None, *, is_look: bool = False
) -> MeasuredJoint:
    """Find the channels of a joint and the way to its DOFs; for a look at them FRFs may be missing.

    Raises
    ------
    UsageError
        An option is missing.
    FileContentError, ValueError
        Words and files do not fit each other.
    """
    table = _table(args)
    known = {channel.node for channel in (*frfs.responses, *frfs.excitations)}
    points = args.points if isinstance(args, PointArguments) else None
    dofs = _checked_dofs(args, points, known, table)
    if table is not None:
        places = _on_sides(table, args, known, frfs.source)
        nodes = _nodes_of(places, "j"), _nodes_of(places, "k")
    else:
        assert args.j is not None and args.k is not None  # noqa: PT018
        nodes, places = (args.j.among(known, frfs.source), args.k.among(known, frfs.source)), ()
    if args.at is not None:
        places = places or places_of_nodes(frfs, *nodes)
        every = joint_channels_of_all(frfs, places, args.at, dofs, at_k=args.at_k)
        whole = every, frfs.matrix(every.responses.channels, every.forces.channels, allow_missing=True)
        found, _ = every.without_missing(frfs.measured_between(every.responses.channels, every.forces.channels))
        return MeasuredJoint(
            frfs.freq_hz, found.gamma(frfs), found.responses, found.forces, found, nodes, args.band, whole
        )
    sides = (
        _points(points, nodes, dofs)
        if points is not None
        else _node_dofs(dofs, frfs, nodes) or _point_lines(args, frfs, nodes, dofs, bending_stiffness)
    )
    h = frfs.matrix(sides.channels, sides.channels, allow_missing=is_look)
    return MeasuredJoint(frfs.freq_hz, h, sides, sides, None, nodes, args.band, is_of_points=points is not None)


def _points(points: list[str], nodes: tuple[list[int], list[int]], dofs: list[str]) -> Interface:
    """Return the DOFs of several joint points, one node on each side for each."""
    if not len(points) == len(nodes[0]) == len(nodes[1]):
        raise UsageError(
            f"--points names {len(points)}, --j {len(nodes[0])} and --k {len(nodes[1])}; give one node on each "
            "side for each joint point"
        )
    if len(set(points)) != len(points):
        raise UsageError("--points names a joint point twice; give different names")
    pairs = [node_dofs(j, k, dofs, {}) for j, k in zip(*nodes, strict=True)]
    n = len(dofs)
    channels = [channel for side in range(2) for one in pairs for channel in one.channels[side * n : (side + 1) * n]]
    names = tuple(f"{name}.{dof}" for name, one in zip(points, pairs, strict=True) for dof in one.dofs)
    ends = np.zeros(3), np.zeros(3)
    return Interface(tuple(channels), np.eye(len(channels)), ends, names, np.zeros((len(channels), 12)), placed=False)


def _table(args: JointArguments) -> tuple[ChannelPlace, ...] | None:
    """Read the table of channels: the one that is named, or that of the project."""
    if args.channels is not None:
        is_pair = "#" in args.channels.name and "," in args.channels.name  # two sheets of pyFBS, which have no unit
        unit = StatedUnits.parsed(args.unit or "").coordinates if is_pair else ""
        return read_channel_table(args.channels, position_unit=unit)
    if args.configuration is None:
        return None
    table = read_toml(args.configuration)
    return places_of_table(table) if "channel" in table.content else None


def _checked_dofs(args: JointArguments, points: list[str] | None, known: set[int], table: object) -> list[str]:
    """Return the DOFs of the joint; raise an error for options that are missing or contradict each other."""
    needs = {
        "--j": (args.j or table, "the nodes on side j of the joint, such as --j 101,102"),
        "--k": (args.k or table, "the nodes on side k of the joint, such as --k 201,202"),
        "--dofs": (args.dofs, "the DOFs of the joint, such as --dofs y,rz"),
    }
    missing = [name for name, (value, _) in needs.items() if value is None]
    if missing:
        what = "; ".join(needs[name][1] for name in missing)
        verb = "is" if len(missing) == 1 else "are"
        nodes = "" if missing == ["--dofs"] else f" ({args.source} has nodes {shown_nodes(known)})"
        raise UsageError(f"{listed(missing)} {verb} missing: {what}{nodes}")
    if points is not None:
        for name, value in (("--at", args.at), ("--spacing", args.spacing), ("a table of channels", table)):
            if value is not None:
                raise UsageError(f"--points takes the nodes as joint points; leave out {name}")
    if args.at is None:
        for name, value in (("--at-k", args.at_k), ("a table of channels", table)):
            if value is not None:
                raise UsageError(f"{name} needs a reference point of the joint; add --at X,Y,Z")
    check_both(args, "spacing", "axis")
    if args.spacing is not None and args.at is not None:
        raise UsageError("--spacing is for nodes along a line, --at for virtual points; leave out one")
    if args.spacing is not None and not args.spacing > 0:
        raise UsageError(f"--spacing is {args.spacing:g}; give a positive number")
    return args.dofs or []


def _on_sides(
    table: tuple[ChannelPlace, ...], args: JointArguments, known: set[int], source: str
) -> tuple[ChannelPlace, ...]:
    """Return the channels of a table that belong to the joint, each with its side."""
    if args.j is None and args.k is None:
        return table
    named: tuple[tuple[JointSide, Nodes | None], ...] = (("j", args.j), ("k", args.k))
    sides: dict[int, JointSide] = {
        node: side for side, nodes in named for node in ([] if nodes is None else nodes.among(known, source))
    }
    kept = []
    for place in table:
        side = sides.get(place.channel.node, place.side if None in (args.j, args.k) else None)
        if side is not None:
            kept.append(replace(place, side=side))
    return tuple(kept)


def _nodes_of(places: tuple[ChannelPlace, ...], side: str) -> list[int]:
    return list(dict.fromkeys(place.channel.node for place in places if place.side == side))


def _node_dofs(dofs: list[str], frfs: FrfSet, nodes: tuple[list[int], list[int]]) -> Interface | None:
    """Return the DOFs of two nodes whose rotations are in the file, too."""
    if len(nodes[0]) != 1 or len(nodes[1]) != 1 or not any(map(is_rotation, dofs)):
        return None
    found = node_dofs(nodes[0][0], nodes[1][0], dofs, frfs.coordinates)
    there = {*frfs.responses, *frfs.excitations}
    turning = [channel for channel in found.channels if channel.is_rotation]
    return found if all(there & {channel, channel.opposite()} for channel in turning) else None


def _point_lines(
    args: JointArguments,
    frfs: FrfSet,
    nodes: tuple[list[int], list[int]],
    dofs: list[str],
    bending_stiffness: float | None,
) -> Interface:
    """Return the DOFs of points along lines; E I of the sides in N m^2 widens intervals of rotations."""
    places = dict(frfs.coordinates)
    if args.spacing is not None:
        for own in nodes:
            for i, node in enumerate(own):
                places[node] = args.spacing * i * np.eye(3)["xyz".index(args.axis or "x")]
    if len(nodes[0]) != len(nodes[1]):
        raise UsageError(
            f"--j and --k name {len(nodes[0])} and {len(nodes[1])} nodes; give equal numbers, or use virtual points by "
            "--at X,Y,Z"
        )
    for node in (*nodes[0], *nodes[1]):
        if node not in places and (len(nodes[0]) > 1 or any(is_rotation(dof) for dof in dofs)):
            raise FileContentError(
                f"{frfs.source} has no coordinates of node {node}; add --spacing and --axis, or --at and --channels"
            )
    at = {node: places.get(node, np.zeros(3)) for node in (*nodes[0], *nodes[1])}
    try:
        return interface(*nodes, dofs, at, bending_stiffness=bending_stiffness, highest_hz=frfs.freq_hz[-1])
    except ValueError as error:
        if args.spacing is not None or any(node not in frfs.coordinates for node in at):
            raise
        raise ValueError(f"{error}; or add --at X,Y,Z for virtual points of all channels") from error
