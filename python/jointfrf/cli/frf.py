"""`jointfrf frf`: receptances of a model."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from jointfrf.cases.substructures import read_model
from jointfrf.cli.measured_file import words
from jointfrf.cli.output import Output
from jointfrf.cli.structure_file import (
    add_line_arguments,
    check_target,
    frfs_of_model,
    is_model,
    lines_of,
    write_frfs,
)
from jointfrf.cli.usage import UsageError, waiting
from jointfrf.io import read_frfs
from jointfrf.toml.table import TomlTable, read_toml

__all__ = ["add_arguments", "run"]

_MATRICES = ("stiffness", "mass", "damping", "structural_damping")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Compute receptances of a model and write them as a Universal File (.uff), NPZ, HDF5 or CSV. The model is "
        "a TOML file with the keys of a substructure of a case (chain, beam, brick-beam, matrices), or "
        "matrices named by options."
    )
    parser.add_argument("model", nargs="?", type=Path, help="TOML file of a model; or --stiffness and --mass")
    parser.add_argument("--output", type=Path, metavar="FILE", help="file to write: .uff, .npz, .h5 or .csv")
    add_line_arguments(parser)
    parser.add_argument("--lines-of", type=Path, metavar="FILE", help="instead: the lines of this file of FRFs")
    parser.add_argument(
        "--points", type=words, metavar="DOFS", help="DOFs of the model: 3:y,3:theta (default: all, where they are few)"
    )
    matrices = parser.add_argument_group("matrices of your own (Matrix Market, or NPZ)")
    for name, what in zip(_MATRICES, ("K, N/m", "M, kg", "viscous C, N s/m", "structural H, N/m"), strict=True):
        matrices.add_argument(f"--{name.replace('_', '-')}", metavar="FILE", help=what)
    matrices.add_argument("--loss-factor", type=float, metavar="ETA", help="loss factor of the stiffness (0)")
    matrices.add_argument("--dof-names", metavar="FILE", help="text file, one DOF a line: 12:y, or 12 2")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    if args.output is None:
        raise UsageError("--output is missing: the file to write, such as --output model.uff")
    check_target(args.output)
    structure = read_model(_table(args))
    freq_hz = lines_of(args)
    if args.lines_of is not None:
        if freq_hz is not None:
            raise UsageError("--lines-of and --step both name lines: leave one out")
        held = read_frfs(args.lines_of)
        freq_hz = (held if args.band is None else held.select(args.band)).freq_hz
    if freq_hz is None:
        raise UsageError("frequency lines are missing: --band LOW:HIGH --step HZ, or --lines-of FILE")
    source = str(args.model or args.stiffness)
    with waiting("receptances"):
        frfs, named = frfs_of_model(structure, freq_hz, args.points, source)
    write_frfs(args.output, frfs)
    out.say(frfs.summary(), *(f"node {number}: {name}" for name, number in named.items()), f"wrote {args.output}")
    out.give(
        {
            "written": str(args.output),
            "source": source,
            "channels": [str(channel) for channel in frfs.responses],
            "nodes": named,
            "lines": frfs.freq_hz.size,
            "band_hz": [frfs.freq_hz[0], frfs.freq_hz[-1]],
        }
    )
    return 0


def _table(args: argparse.Namespace) -> TomlTable:
    """Return the table of the model: that of the file, or one of the options."""
    given: dict[str, Any] = {name: getattr(args, name) for name in _MATRICES if getattr(args, name) is not None}
    if args.loss_factor is not None:
        given["loss_factor"] = args.loss_factor
    if args.dof_names is not None:
        given["dofs"] = args.dof_names
    if args.model is not None:
        if given:
            raise UsageError("a model and matrices by options are both named: leave one out")
        if not is_model(args.model):
            raise UsageError(f"{args.model} is no TOML file of a model; FRFs are converted by jointfrf convert")
        return read_toml(args.model)
    missing = [name for name, key in (("--stiffness", "stiffness"), ("--mass", "mass"), ("--dof-names", "dofs"))
               if key not in given]  # fmt: skip
    if missing:
        raise UsageError(f"{', '.join(missing)}: missing; or name the TOML file of a model")
    return TomlTable({"model": "matrices", **given}, "options")
