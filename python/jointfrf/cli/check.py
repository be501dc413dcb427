"""`jointfrf check`: whether measured FRFs are fit for an identification."""

from __future__ import annotations

import argparse

from jointfrf.channels.check.check import check_frfs, wrong_numbers
from jointfrf.channels.check.result import FrfCheck
from jointfrf.cli.measured_file import add_file_arguments, file_names, in_some_band, read_measured
from jointfrf.cli.measured_joint import MeasuredJoint, measured_joint
from jointfrf.cli.parser import CommandParser
from jointfrf.cli.usage import Output
from jointfrf.io import FrfSet

__all__ = ["add_arguments", "check_joint", "run"]


#: Options that say which joint is in the file.
_OF_JOINT = ("j", "k", "dofs", "at", "at_k", "channels", "spacing", "axis")


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Look at measured FRFs: what the file holds; quantity, time convention, sign, gain, delay and units of each "
        "channel, dead, doubled and exchanged channels, reciprocity, passivity, bad lines, missing FRFs. With --j, --k "
        "and --dofs the channels of the joint, with --at also each beside the rigid motion of the others, and the "
        "reference point beside the channels, else all channels. Exit status 0: neither errors nor warnings; 1: some."
    )
    add_file_arguments(parser)


def check_joint(joint: MeasuredJoint, measured: FrfSet) -> FrfCheck:
    """Check the FRFs of the channels of a joint, on the lines in its bands, and the numbers of all FRFs of the file."""
    wrong = wrong_numbers(measured)
    if wrong is not None:
        return FrfCheck((wrong,), joint.freq_hz, joint.h, (), "anything else, as long as all numbers are wrong")
    if joint.every is not None:
        channels, h = joint.every
        return check_frfs(*in_some_band(joint.freq_hz, h, joint.bands), joint=channels, read_as=measured.quantity)
    names = joint.responses.channels, joint.forces.channels
    lines = in_some_band(joint.freq_hz, joint.h, joint.bands)
    return check_frfs(*lines, responses=names[0], forces=names[1], read_as=measured.quantity)


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    measured = read_measured(args)
    frfs = measured.receptance()
    out.say(frfs.summary(), "")
    joint = None
    if any(getattr(args, name) is not None for name in _OF_JOINT):
        joint = measured_joint(args, frfs, is_look=True)
        check = check_joint(joint, measured)
        warned = [*joint.warnings(check)]
        out.say(*joint.text(), *(f"warning: {text}" for text in warned))
        out.warn(*warned)
    else:
        lines = in_some_band(frfs.freq_hz, frfs.h, args.band)
        names = frfs.responses, frfs.excitations
        check, warned = check_frfs(*lines, responses=names[0], forces=names[1], read_as=measured.quantity), []
    out.say(f"{file_names(args)}: {check}")
    out.warn(*check.warnings)
    about = {} if joint is None else {"joint": joint.to_dict()}
    content = {"sources": [str(path) for path in args.files], "quantity": frfs.stated, **check.to_dict(), **about}
    out.give(content | {"warnings": [*warned, *check.warnings]})
    return 0 if check.ok and not warned else 1
