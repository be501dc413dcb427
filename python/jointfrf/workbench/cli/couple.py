"""`jointfrf couple`: FRFs of the assembly of two substructures and a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from jointfrf.channels.check.check import warn_of_sets
from jointfrf.channels.virtual_point import append_virtual_point, channel_geometry, virtual_point
from jointfrf.dofs import direction_places
from jointfrf.errors import FileContentError
from jointfrf.frf.merge import merge_frfs
from jointfrf.identification.joint_file import read_joint_file
from jointfrf.io import Channel, FrfSet, write_frfs
from jointfrf.joint import Joint
from jointfrf.laws.law_joint import LawJoint
from jointfrf.substructuring.coupling import couple
from jointfrf.workbench.cli.arguments.couple import CoupleArguments
from jointfrf.workbench.cli.arguments.measured_file import ReadingArguments
from jointfrf.workbench.cli.arguments.structures import CouplingArguments
from jointfrf.workbench.cli.arguments.words import Nodes
from jointfrf.workbench.cli.frf import (
    CHANNEL_DIRECTIONS,
    is_model,
    lines_of,
    measured_sets,
    own_matrix,
    read_structures,
)
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Output, UsageError, warn_of_ignored

__all__ = ["coupled_parts", "joint_channels_of", "renumbered", "run"]


def renumbered(frfs: FrfSet, add: int, shift: Sequence[float] = (0.0, 0.0, 0.0)) -> FrfSet:
    """Return the same FRFs with other numbers of nodes, at places that are shifted."""
    try:
        sides = [tuple(Channel(c.node + add, c.direction) for c in side) for side in (frfs.responses, frfs.excitations)]
    except ValueError as error:
        raise UsageError(f"--renumber-b {add}: {error}") from error
    places = {node + add: np.asarray(place) + shift for node, place in frfs.coordinates.items()}
    return replace(frfs, responses=sides[0], excitations=sides[1], coordinates=places)


def joint_channels_of(node: int, dofs: Sequence[str]) -> list[Channel]:
    """Return the channels of a node in the directions of a joint."""
    return [Channel(node, CHANNEL_DIRECTIONS[place]) for place in direction_places(dofs)]


def run(args: CoupleArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    if is_model(args.a) and is_model(args.b):
        warn_of_ignored(args, ReadingArguments.names(), "both substructures are models")
    assembly, joint, _ = coupled_parts(args)
    write_frfs(args.output, assembly)
    out.say(assembly.summary(), f"wrote {args.output}")
    numbers: dict[str, object] = {"stiffness": joint.stiffness} if isinstance(joint, Joint) else {
        "parameters": {one.name: one.value for one in joint.quantities}, "rigid": list(joint.rigid)
    }  # fmt: skip
    out.give(
        {
            "written": str(args.output),
            "a": str(args.a),
            "b": str(args.b),
            "joint": {"file": str(args.joint), "dofs": joint.dofs, **numbers},
            "channels": [str(channel) for channel in assembly.responses],
            "lines": assembly.freq_hz.size,
            "band_hz": [assembly.freq_hz[0], assembly.freq_hz[-1]],
        }
    )
    return 0


def coupled_parts(args: CouplingArguments, *files: Path) -> tuple[FrfSet, Joint | LawJoint, list[FrfSet]]:
    """Return the FRFs of the assembly, its joint, and the FRFs of more files, merged, in the same band."""
    joint = read_joint_file(args.joint).joint
    a, b, *measured = read_structures([args.a, args.b, *files], lines_of(args), **args.reading())
    measured = measured if len(measured) < 2 else [merge_frfs(measured)]
    if args.band is not None:
        a, b, *measured = (each.select(args.band) for each in (a, b, *measured))
    b = renumbered(b, args.renumber_b, args.shift_b)
    warn_of_sets(*measured_sets(args.a, a, args.b, b), *measured)
    with waiting("coupling"):
        assembly = _coupled(a, b, joint, (args.j, args.k.shifted(args.renumber_b)), args.at)
    return assembly, joint, measured


def _coupled(
    a: FrfSet, b: FrfSet, joint: Joint | LawJoint, sides: tuple[Nodes, Nodes], at: tuple[float, ...] | None
) -> FrfSet:
    """Return the FRFs of the assembly at all channels of both."""
    channels, matrices, ends = [], [], []
    for frfs, side in ((a, sides[0]), (b, sides[1])):
        names, h = own_matrix(frfs)
        whole, at_joint = _with_joint(frfs, names, h, joint, side, at)
        channels.append(names)
        matrices.append(whole)
        ends.append(at_joint)
    shared = {c.node for c in channels[0]} & {c.node for c in channels[1]}
    if shared:
        raise FileContentError(
            f"node {min(shared)} is in {a.source} and in {b.source}; add a number to the nodes of B by --renumber-b N"
        )
    h = couple(matrices[0], matrices[1], joint, ends[0], ends[1], freq_hz=a.freq_hz)
    # Virtual points follow the channels of their side, and are not measured.
    n_a, own_a, own_b = matrices[0].shape[1], len(channels[0]), len(channels[1])
    kept = [*range(own_a), *range(n_a, n_a + own_b)]
    names = (*channels[0], *channels[1])
    places = {**a.coordinates, **b.coordinates}
    source = f"{a.source} and {b.source}, coupled"
    return FrfSet(a.freq_hz, names, names, h[:, kept][:, :, kept], coordinates=places, source=source)


def _with_joint(
    frfs: FrfSet,
    names: tuple[Channel, ...],
    h: np.ndarray,
    joint: Joint | LawJoint,
    side: Nodes,
    at: tuple[float, ...] | None,
) -> tuple[np.ndarray, list[int]]:
    """Return FRFs with the DOFs of the joint among them, and which these are."""
    found = side.among({channel.node for channel in names}, frfs.source)
    if at is not None:
        own = [i for i, channel in enumerate(names) if channel.node in found and not channel.is_rotation]
        missing = [node for node in found if node not in frfs.coordinates]
        if missing:
            raise FileContentError(
                f"{frfs.source} has no coordinates of node {missing[0]}; add them, or leave out --at"
            )
        geometry = channel_geometry([names[i] for i in own], frfs.coordinates)
        vp = virtual_point(*geometry, at, joint.dofs)
        whole = append_virtual_point(h, own, vp)
        return whole, list(range(len(names), whole.shape[1]))
    if len(found) != 1:
        raise UsageError(
            f"several nodes at the joint ({found[0]}, {found[1]}, ...); give the virtual point by --at X,Y,Z"
        )
    places = []
    for wanted in joint_channels_of(found[0], joint.dofs):
        if wanted not in names:
            raise FileContentError(
                f"{frfs.source} has no FRFs at joint DOF {wanted}; give nodes around the joint and --at X,Y,Z"
            )
        places.append(names.index(wanted))
    return h, places
