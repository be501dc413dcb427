"""`jointfrf check`: whether measured FRFs are fit for an identification."""

from __future__ import annotations

import argparse

from jointfrf.channels.check.check import check_frfs
from jointfrf.channels.check.finding import FrfCheck
from jointfrf.cli.measured_file import add_file_arguments, file_names, in_some_band, read_receptances
from jointfrf.cli.measured_joint import MeasuredJoint, measured_joint
from jointfrf.cli.parser import CommandParser
from jointfrf.cli.usage import Output
from jointfrf.errors import FileContentError

__all__ = ["add_arguments", "check_joint", "run"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Look at measured FRFs: what the file holds; quantity, time convention, sign, gain, delay and units of each "
        "channel, dead, doubled and exchanged channels, reciprocity, passivity, bad lines. With --j, --k and --dofs "
        "the channels of the joint, with --at also how they agree with rigid motion, else all channels. Exit status 0: "
        "neither errors nor warnings; 1: some."
    )
    add_file_arguments(parser)


def check_joint(joint: MeasuredJoint) -> FrfCheck:
    """Look at the FRFs of the channels of a joint, on the lines in its bands."""
    lines = in_some_band(joint.freq_hz, joint.h, joint.bands)
    names, forces = joint.responses.channels, joint.forces.channels
    if joint.is_square:
        return check_frfs(*lines, responses=names, forces=forces)
    transforms = joint.responses.transform, joint.forces.transform
    return check_frfs(*lines, responses=names, forces=forces, transform=transforms, dofs=joint.dofs)


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    frfs = read_receptances(args)
    out.say(frfs.summary(), "")
    joint = None
    if any(word is not None for word in (args.j, args.k, args.dofs, args.at, args.channels)):
        joint = measured_joint(args, frfs)
        check = check_joint(joint)
        warned = [*joint.warnings()]
        out.say(*joint.text(), *(f"warning: {text}" for text in warned))
        out.warn(*warned)
    else:
        missing = int((~frfs.measured).sum())
        if missing:
            raise FileContentError(
                f"{frfs.source}: {missing} FRFs are missing between its channels: name those of the joint, "
                "--j NODES --k NODES --dofs DOFS"
            )
        lines = in_some_band(frfs.freq_hz, frfs.h, args.band)
        check, warned = check_frfs(*lines, responses=frfs.responses, forces=frfs.excitations), []
    out.say(f"{file_names(args)}: {check}")
    out.warn(*(finding for finding in check.findings if finding.level != "note"))
    about = {} if joint is None else {"joint": joint.to_dict(), "warnings": warned}
    out.give({"sources": [str(path) for path in args.files], "quantity": frfs.stated, **check.to_dict(), **about})
    return 0 if check.ok and not warned else 1
