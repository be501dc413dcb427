"""`jointfrf validate`: a joint found, put between its parts or others, beside the measured assembly."""

from __future__ import annotations

from dataclasses import replace

from jointfrf.errors import FileContentError
from jointfrf.identification.validation import compare_frfs
from jointfrf.io import FrfSet, write_frfs
from jointfrf.workbench.cli.arguments.validate import ValidateArguments
from jointfrf.workbench.cli.couple import coupled_parts
from jointfrf.workbench.cli.usage import Output

__all__ = ["run"]


def run(args: ValidateArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    assembly, _, (measured,) = coupled_parts(args, *args.measured)
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
