"""`jointfrf check`: whether measured FRFs are fit for an identification."""

from __future__ import annotations

import argparse

from jointfrf.channels.check.check import check_frfs, wrong_numbers
from jointfrf.channels.check.result import FrfCheck
from jointfrf.io import FrfSet
from jointfrf.workbench.cli.masses import check_masses, check_stated, scale_of_joint
from jointfrf.workbench.cli.measured_file import file_names, in_some_band, read_measured
from jointfrf.workbench.cli.measured_joint import MeasuredJoint, measured_joint
from jointfrf.workbench.cli.usage import Output, waiting

__all__ = ["check_joint", "run"]


#: Options that say which joint is in the file.
_OF_JOINT = ("j", "k", "dofs", "at", "at_k", "channels", "spacing", "axis")


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
    with waiting(f"reading {file_names(args)}"):
        measured = read_measured(args)
        frfs = measured.receptance()
    out.say(frfs.summary(), "")
    joint = None
    if any(getattr(args, name) is not None for name in _OF_JOINT):
        joint = measured_joint(args, frfs, is_look=True)
        check = check_joint(joint, measured)
        warned = [*joint.warnings(check)]
        check_stated(args)
        scale = scale_of_joint(joint)
        warned += check_masses(args, scale)
        out.say(*joint.text(), *scale.text(), *(f"warning: {text}" for text in warned))
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
