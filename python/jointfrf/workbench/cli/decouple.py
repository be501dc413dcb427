"""`jointfrf decouple`: a joint from FRFs of the assembly away from it, and of both substructures."""

from __future__ import annotations

import warnings
from typing import cast

import numpy as np

from jointfrf.channels.check.check import warn_of_sets
from jointfrf.choices import StiffnessMethod
from jointfrf.errors import FileContentError, IdentificationWarning
from jointfrf.files import write_file
from jointfrf.identification.band_means import identify_band_mean
from jointfrf.identification.record import fit_to_dict, save
from jointfrf.identification.result import Fit
from jointfrf.io import Channel, FrfSet
from jointfrf.kernel.arguments import ComplexArray
from jointfrf.workbench.cli.arguments.decouple import DecoupleArguments
from jointfrf.workbench.cli.arguments.words import Nodes, shown_nodes
from jointfrf.workbench.cli.couple import joint_channels_of, renumbered
from jointfrf.workbench.cli.frf import measured_sets, own_matrix, read_structures
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Output, UsageError, listed, warn_of_ignored

__all__ = ["run"]


def run(args: DecoupleArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    _check(args)
    a, b, assembly = read_structures([args.a, args.b, args.assembly], None, **args.reading())
    b = renumbered(b, args.renumber_b)
    s = None if args.s is None else [Channel(c.node + args.renumber_b, c.direction) for c in args.s]
    unused = [f"--{point}" for point in ("r", "s") if point not in args.equation]
    warn_of_ignored(args, unused, f"equation {args.equation} does not use {'it' if len(unused) == 1 else 'them'}")
    warn_of_sets(*measured_sets(args.a, a, args.b, b), assembly)
    h_a, dofs_j, dofs_r = _side(a, args.j, args.dofs, args.r)
    h_b, dofs_k, dofs_s = _side(b, args.k.shifted(args.renumber_b), args.dofs, s)
    responses, forces = ((args.r if point == "r" else s) or [] for point in args.equation)
    with warnings.catch_warnings(), waiting("decoupling"):
        warnings.simplefilter("ignore", IdentificationWarning)  # they stand in the table
        fit = identify_band_mean(
            a.freq_hz, assembly.matrix(responses, forces), cast(StiffnessMethod, f"decoupling-{args.equation}"),
            args.dofs, args.band, h_a=h_a, h_b=h_b, dofs_j=dofs_j, dofs_k=dofs_k, dofs_r=dofs_r, dofs_s=dofs_s,
        )  # fmt: skip
    if args.save is not None:
        save(fit, args.save)
        out.written.append(args.save)
    if args.output is not None:
        write_file(args.output, _line_table(fit))
        out.written.append(args.output)
    out.warn(*fit.warnings)
    out.say(fit)
    out.give({"equation": args.equation, "fits": [fit_to_dict(fit, lines=False)], "written": out.written})
    return 0


def _check(args: DecoupleArguments) -> None:
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


def _side(
    frfs: FrfSet, at: Nodes, dofs: list[str], internal: list[Channel] | None
) -> tuple[ComplexArray, list[int], list[int] | None]:
    """Return FRFs between the channels of a substructure, and which of these are at the joint and which internal."""
    (node,) = at.among({channel.node for channel in (*frfs.responses, *frfs.excitations)}, frfs.source)
    names, h = own_matrix(frfs)
    at_joint = joint_channels_of(node, dofs)
    for channel in (*at_joint, *(internal or ())):
        if channel not in names:
            raise FileContentError(
                f"{frfs.source} has no FRFs with {channel} as response and as excitation; name another channel"
            )
    return (
        h,
        [names.index(one) for one in at_joint],
        None if internal is None else [names.index(one) for one in internal],
    )


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
