"""`jointfrf check`: whether measured FRFs are fit for an identification."""

from __future__ import annotations

import argparse

from jointfrf.channels.check.check import check_frfs
from jointfrf.cli.measured_file import add_file_arguments, in_some_band, interface_of, read_receptances
from jointfrf.errors import FileContentError

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Look at the FRFs of a Universal File (dataset 58): quantity, time convention, sign, gain, delay and units of "
        "each channel, dead, doubled and exchanged channels, reciprocity, passivity, bad lines. With --j, --k and "
        "--dofs the channels of the joint, else all. Exit status 0: neither errors nor warnings; 1: some."
    )
    add_file_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    frfs = read_receptances(args)
    if args.j and args.k and args.dofs:
        channels = interface_of(args, frfs).channels
        responses, forces, h = channels, channels, frfs.matrix(channels, channels)
    else:
        missing = int((~frfs.measured).sum())
        if missing:
            raise FileContentError(
                f"{args.file}: {missing} FRFs are missing between its channels: name those of the joint, "
                "--j NODES --k NODES --dofs DOFS"
            )
        responses, forces, h = frfs.responses, frfs.excitations, frfs.h
    check = check_frfs(*in_some_band(frfs.freq_hz, h, args.band), responses=responses, forces=forces)
    print(f"{args.file.name}: {check}")
    return 0 if check.ok else 1
