"""`jointfrf decouple`: a joint from FRFs of the assembly away from it, and of both substructures."""

from __future__ import annotations

import argparse
import warnings
from dataclasses import dataclass

import numpy as np

from jointfrf.channels.check.check import warn_of_sets
from jointfrf.errors import FileContentError, IdentificationWarning
from jointfrf.files import write_file
from jointfrf.identification.band_means import identify_band_mean
from jointfrf.identification.record import fit_to_dict, save
from jointfrf.identification.result import Fit
from jointfrf.io import Channel, FrfSet
from jointfrf.kernel.arguments import ComplexArray
from jointfrf.workbench.cli.arguments.decouple import METHODS
from jointfrf.workbench.cli.arguments.measured_file import Nodes, shown_nodes
from jointfrf.workbench.cli.couple import joint_channels_of, renumbered, shifted
from jointfrf.workbench.cli.frf import measured_sets, own_matrix, read_structures
from jointfrf.workbench.cli.measured_file import reading_options
from jointfrf.workbench.cli.usage import Output, UsageError, check_folder, listed, waiting, warn_of_ignored

__all__ = ["run"]


@dataclass(frozen=True)
class _Side:
    """One substructure: FRFs between its channels, and which of these are at the joint and which internal."""

    h: ComplexArray
    joint: list[int]
    internal: list[int] | None


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    _check(args)
    check_folder("--save", args.save)
    check_folder("--output", args.output)
    a, b, assembly = read_structures([args.a, args.b, args.assembly], None, **reading_options(args))
    b = renumbered(b, args.renumber_b)
    k = shifted(args.k, args.renumber_b)
    s = None if args.s is None else [Channel(c.node + args.renumber_b, c.direction) for c in args.s]
    at = {"r": args.r, "s": s}
    unused = [f"--{point}" for point in ("r", "s") if point not in args.equation]
    warn_of_ignored(args, unused, f"equation {args.equation} does not use {'it' if len(unused) == 1 else 'them'}")
    warn_of_sets(*measured_sets(args.a, a, args.b, b), assembly)
    side_a = _side(a, args.j, args.dofs, args.r)
    side_b = _side(b, k, args.dofs, s)
    measured = assembly.matrix(at[args.equation[0]], at[args.equation[1]])
    with warnings.catch_warnings(), waiting("decoupling"):
        warnings.simplefilter("ignore", IdentificationWarning)  # they stand in the table
        fit = identify_band_mean(
            a.freq_hz, measured, METHODS[args.equation], args.dofs, args.band,
            h_a=side_a.h, h_b=side_b.h, dofs_j=side_a.joint, dofs_k=side_b.joint,
            dofs_r=side_a.internal, dofs_s=side_b.internal,
        )  # fmt: skip
    written = []
    if args.save is not None:
        save(fit, args.save)
        written.append(args.save)
    if args.output is not None:
        write_file(args.output, _line_table(fit))
        written.append(args.output)
    out.warn(*fit.warnings)
    out.say(fit, *([""] if written else []), *(f"wrote {path}" for path in written))
    fits = [fit_to_dict(fit, lines=False)]
    out.give({"equation": args.equation, "fits": fits, "written": [str(path) for path in written]})
    return 0


def _check(args: argparse.Namespace) -> None:
    """Check that all is named that the equation needs."""
    wanted = {"--j": args.j, "--k": args.k, "--dofs": args.dofs}
    wanted |= {f"--{point}": getattr(args, point) for point in dict.fromkeys(args.equation)}
    missing = [name for name, value in wanted.items() if value is None]
    if missing:
        verb = "is" if len(missing) == 1 else "are"
        raise UsageError(f"{listed(missing)} {verb} missing; equation {args.equation} needs {listed(list(wanted))}")
    for name, channels in (("--r", args.r), ("--s", args.s)):
        if channels is not None and len(channels) != len(args.dofs):
            raise UsageError(f"{name} names {len(channels)} channels; give {len(args.dofs)}, one for each of --dofs")
    for name, side in (("--j", args.j), ("--k", args.k)):
        if len(side.numbers) != 1:
            raise UsageError(f"{name} names nodes {shown_nodes(side.numbers)}; give one node")


def _side(frfs: FrfSet, at: Nodes, dofs: list[str], internal: list[Channel] | None) -> _Side:
    """Find the DOFs of a substructure at the joint and inside."""
    (node,) = at.among({channel.node for channel in (*frfs.responses, *frfs.excitations)}, frfs.source)
    names, h = own_matrix(frfs)
    return _Side(
        h,
        _found(frfs, names, joint_channels_of(node, dofs)),
        None if internal is None else _found(frfs, names, internal),
    )


def _found(frfs: FrfSet, names: tuple[Channel, ...], wanted: list[Channel]) -> list[int]:
    for channel in wanted:
        if channel not in names:
            raise FileContentError(
                f"{frfs.source} has no FRFs with {channel} as response and as excitation; name another channel"
            )
    return [names.index(channel) for channel in wanted]


def _line_table(fit: Fit) -> str:
    """Write K* of each line, N/m and its like, as a CSV table."""
    pairs = [(p, q) for p in range(len(fit.dofs)) for q in range(len(fit.dofs))]
    names = [f"{part} K_{fit.dofs[p]},{fit.dofs[q]}" for p, q in pairs for part in ("Re", "Im")]
    rows = [",".join(["frequency [Hz]", *(f'"{name}"' for name in names)])]
    assert fit.k_lines is not None
    for freq, k in zip(fit.freq_hz, fit.k_lines, strict=True):
        values = [number for p, q in pairs for number in (k[p, q].real, k[p, q].imag)]
        rows.append(",".join(f"{number:.12g}" for number in (freq, *np.asarray(values))))
    return "\n".join(rows) + "\n"
