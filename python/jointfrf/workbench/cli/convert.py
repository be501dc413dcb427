"""`jointfrf convert`: measured FRFs of one file or several into one file of another format."""

from __future__ import annotations

from jointfrf.io import read_frfs, write_frfs
from jointfrf.workbench.cli.arguments.convert import ConvertArguments
from jointfrf.workbench.cli.usage import Output, UsageError, check_frf_file

__all__ = ["run"]


def run(args: ConvertArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    *sources, target = args.files
    if not sources:
        raise UsageError("the file to write is missing: jointfrf convert IN ... OUT")
    check_frf_file("OUT", target)
    if any(target.exists() and source.exists() and target.samefile(source) for source in sources):
        raise UsageError(f"{target} is also a file to read; name another file to write")
    nodes = None if args.nodes is None else args.nodes.numbers
    frfs = read_frfs(*sources, **args.reading(), nodes=nodes, averages=args.averages)
    if args.band is not None:
        frfs = frfs.select(args.band)
    write_frfs(target, frfs)
    out = Output(args)
    out.say(frfs.summary(), f"wrote {target}")
    out.give(
        {
            "written": str(target),
            "sources": frfs.source.split(", "),
            "stated": frfs.stated,
            "quantity": frfs.quantity,
            "frfs": int(frfs.measured.sum()),
            "responses": [str(channel) for channel in frfs.responses],
            "excitations": [str(channel) for channel in frfs.excitations],
            "lines": frfs.freq_hz.size,
            "band_hz": [float(frfs.freq_hz[0]), float(frfs.freq_hz[-1])],
            "coherence": frfs.coherence is not None,
        }
    )
    return 0
