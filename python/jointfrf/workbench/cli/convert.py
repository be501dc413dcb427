"""`jointfrf convert`: measured FRFs of one file or several into one file of another format."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointfrf.io import FrfSet, read_frfs, write_frfs
from jointfrf.workbench.cli.frf import check_target
from jointfrf.workbench.cli.measured_file import reading_options
from jointfrf.workbench.cli.usage import Output, UsageError

__all__ = ["run"]


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    *sources, target = args.files
    if not sources:
        raise UsageError("the file to write is missing: jointfrf convert IN ... OUT")
    check_target(target)
    if any(target.exists() and source.exists() and target.samefile(source) for source in sources):
        raise UsageError(f"{target} is also a file to read; name another file to write")
    frfs = read_frfs(
        *sources,
        **reading_options(args),
        nodes=None if args.nodes is None else args.nodes.numbers,
        averages=args.averages,
    )
    if args.band is not None:
        frfs = frfs.select(args.band)
    write_frfs(target, frfs)
    out = Output(args)
    out.say(frfs.summary(), f"wrote {target}")
    out.give(_described(frfs, target))
    return 0


def _described(frfs: FrfSet, target: Path) -> dict[str, object]:
    return {
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
