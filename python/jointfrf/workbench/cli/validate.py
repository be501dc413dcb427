"""`jointfrf validate`: a joint found, put between its parts or others, beside the measured assembly."""

from __future__ import annotations

import argparse
from dataclasses import replace

from jointfrf.channels.check.check import warn_of_sets
from jointfrf.errors import FileContentError
from jointfrf.frf.merge import merge_frfs
from jointfrf.identification.joint_file import read_joint_file
from jointfrf.identification.validation import compare_frfs
from jointfrf.io import FrfSet, write_frfs
from jointfrf.workbench.cli.couple import coupled, renumbered, shifted
from jointfrf.workbench.cli.frf import check_target, lines_of, measured_sets, read_structures
from jointfrf.workbench.cli.measured_file import reading_options
from jointfrf.workbench.cli.usage import Output, waiting

__all__ = ["run"]


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    if args.output is not None:
        check_target(args.output)
    found = read_joint_file(args.joint)
    a, b, *parts = read_structures([args.a, args.b, *args.measured], lines_of(args), **reading_options(args))
    measured = parts[0] if len(parts) == 1 else merge_frfs(parts)
    if args.band is not None:
        a, b, measured = (each.select(args.band) for each in (a, b, measured))
    b = renumbered(b, args.renumber_b, args.shift_b)
    warn_of_sets(*measured_sets(args.a, a, args.b, b), measured)
    with waiting("coupling"):
        assembly = coupled(a, b, found.joint, (args.j, shifted(args.k, args.renumber_b)), args.at)
    shared, unused = _shared(measured, assembly)
    own = shared.matrix(shared.responses, shared.excitations, allow_missing=True)
    made = assembly.matrix(shared.responses, shared.excitations)
    names = [[str(channel) for channel in side] for side in (shared.responses, shared.excitations)]
    check = compare_frfs(shared.freq_hz, own, made, *names)
    out.say(check, *([f"not in the parts, and not compared: {', '.join(unused)}"] if unused else []))
    written = []
    if args.output is not None:
        write_frfs(args.output, replace(shared, h=made, coherence=None, averages=None, source="regenerated"))
        written.append(str(args.output))
        out.say(f"wrote {args.output}")
    files = {"a": str(args.a), "b": str(args.b), "joint": str(args.joint), "measured": [str(f) for f in args.measured]}
    out.give({**files, **check.to_dict(), "unused": unused, "written": written})
    return 0


def _shared(measured: FrfSet, assembly: FrfSet) -> tuple[FrfSet, list[str]]:
    """Return the measured FRFs of channels that the parts have, and the names of the others."""
    known = {(c.node, c.axis) for c in assembly.responses}
    sides = measured.responses, measured.excitations
    rows, columns = ([i for i, c in enumerate(side) if (c.node, c.axis) in known] for side in sides)
    unused = list(dict.fromkeys(str(c) for side in sides for c in side if (c.node, c.axis) not in known))
    if not rows or not columns:
        raise FileContentError(
            f"{measured.source} and the parts share no {'response' if not rows else 'excitation'}; renumber the nodes "
            "of B by --renumber-b N"
        )
    own = replace(
        measured,
        responses=tuple(measured.responses[i] for i in rows),
        excitations=tuple(measured.excitations[i] for i in columns),
        h=measured.h[:, rows][:, :, columns],
        coherence=None,
        averages=None,
        setups=None,
    )
    return own, unused
