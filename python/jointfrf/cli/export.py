"""`jointfrf export`: a saved joint as input of a finite-element program."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from jointfrf.cli.card_options import (
    add_card_arguments,
    add_joint_place,
    card_request,
    parse_export,
    written_cards,
)
from jointfrf.cli.measured_file import numbers
from jointfrf.cli.output import Output
from jointfrf.cli.usage import UsageError
from jointfrf.files import write_file
from jointfrf.identification.joint_file import JointFile, read_joint_file
from jointfrf.io.cards import CardOptions
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Write a joint as input of a finite-element program: abaqus (springs and dashpots, or matrices), calculix "
        "(springs), nastran (CBUSH, or DMIG) or ansys (MATRIX27), with comments on what each number is worth."
    )
    parser.add_argument("joint", type=Path, help="JSON file of identify --save, or a TOML file of constants or laws")
    parser.add_argument(
        "export",
        type=parse_export,
        metavar="PROGRAM:J,K",
        help="program and nodes j and k of its model: nastran:9001,9002; calculix: two ROT NODEs more for rotations",
    )
    parser.add_argument(
        "--frequency",
        type=_frequency,
        metavar="HZ",
        help="where laws that depend on frequency are taken: cards hold k, c and h only",
    )
    add_joint_place(parser)
    add_card_arguments(parser)


def _frequency(text: str) -> float:
    (found,) = numbers(text, 1, "a frequency in Hz")
    if found <= 0:
        raise argparse.ArgumentTypeError(f"must be a frequency above 0 Hz, not {text!r}")
    return float(found)


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    found = read_joint_file(args.joint)
    damping, cross = _terms(_springs(found.joint, args.frequency))
    request = card_request(args, found.joint.dofs, damping=damping, cross=cross, points=_points(args, found))
    assert request is not None
    if found.fit is not None:
        text = written_cards(found.fit, request, found.about)
    else:
        options: CardOptions = {**request.options, "comments": found.about}
        if isinstance(found.joint, LawJoint):
            text = found.joint.export(request.program, request.nodes, freq_hz=args.frequency, **options)
        else:
            text = found.joint.export(request.program, request.nodes, **options)
        if request.output is not None:
            write_file(request.output, text)
    written = [] if args.output is None else [str(args.output)]
    out.say(f"wrote {args.output}" if written else text.rstrip("\n"))
    out.give({"source": str(args.joint), "program": request.program, "cards": text, "written": written})
    return 0


def _springs(joint: Joint | LawJoint, freq_hz: float | None) -> Joint | None:
    """Return the springs and dampers of a joint; None where it has none.

    Raises
    ------
    UsageError
        A law depends on frequency, and none was named.
    """
    if isinstance(joint, Joint):
        return joint
    try:
        return LawJoint(joint.laws).constant_joint(freq_hz) if joint.laws else None
    except ValueError as error:
        raise UsageError(str(error).replace("the freq_hz", "by --frequency HZ that")) from error


def _terms(joint: Joint | None) -> tuple[str, str]:
    """Return kinds of damping, and whether DOFs are coupled, in the words of `identify`."""
    if joint is None:
        return "none", "zero"
    kinds = {(True, True): "both", (True, False): "viscous", (False, True): "hysteretic", (False, False): "none"}
    k = joint.stiffness
    coupled = bool((k != np.diag(k.diagonal())).any())
    return kinds[bool(joint.damping.any()), bool(joint.hysteretic_stiffness.any())], "fit" if coupled else "zero"


def _points(args: argparse.Namespace, found: JointFile) -> FloatArray | None:
    if args.joint_at is not None:
        return np.tile(args.joint_at, (2, 1))
    return found.points
