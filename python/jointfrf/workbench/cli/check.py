"""`jointfrf check`: whether measured FRFs are fit for an identification."""

from __future__ import annotations

from typing import Any

from jointfrf.channels.check.check import check_frfs, wrong_numbers
from jointfrf.channels.check.result import FrfCheck
from jointfrf.io import FrfSet, read_frfs
from jointfrf.workbench.cli.arguments.check import CheckArguments
from jointfrf.workbench.cli.arguments.measured_file import PlaceArguments
from jointfrf.workbench.cli.masses import check_masses, check_stated, scale_of_joint
from jointfrf.workbench.cli.measured_file import in_some_band
from jointfrf.workbench.cli.measured_joint import MeasuredJoint, measured_joint
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Output

__all__ = ["check_joint", "run"]


def check_joint(joint: MeasuredJoint, measured: FrfSet) -> FrfCheck:
    """Check the FRFs of the channels of a joint, on the lines in its bands, and the numbers of all FRFs of the file."""
    wrong = wrong_numbers(measured)
    if wrong is not None:
        return FrfCheck((wrong,), joint.freq_hz, joint.h, (), "anything else, as long as all numbers are wrong")
    if joint.every is not None:
        channels, h = joint.every
        return check_frfs(*in_some_band(joint.freq_hz, h, joint.bands), joint=channels, read_as=measured.quantity)
    lines, names = in_some_band(joint.freq_hz, joint.h, joint.bands), (joint.responses.channels, joint.forces.channels)
    return check_frfs(*lines, responses=names[0], forces=names[1], read_as=measured.quantity)


def run(args: CheckArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    with waiting(f"reading {args.source}"):
        measured = read_frfs(*args.files, **args.reading())
        frfs = measured.receptance()
    out.say(frfs.summary(), "")
    warned, content = list[str](), dict[str, Any](sources=args.files, quantity=frfs.stated)
    if args.changed(PlaceArguments):
        joint = measured_joint(args, frfs, is_look=True)
        check = check_joint(joint, measured)
        check_stated(args)
        scale = scale_of_joint(joint)
        warned = [*joint.warnings(check), *check_masses(args, scale)]
        out.say(*joint.text(), *scale.text(), *(f"warning: {text}" for text in warned))
        out.warn(*warned)
        content["joint"] = joint.to_dict()
    else:
        lines = in_some_band(frfs.freq_hz, frfs.h, args.band)
        check = check_frfs(*lines, responses=frfs.responses, forces=frfs.excitations, read_as=measured.quantity)
    out.say(f"{args.source}: {check}")
    out.warn(*check.warnings)
    out.give(content | check.to_dict() | {"warnings": [*warned, *check.warnings]})
    return 0 if check.ok and not warned else 1
