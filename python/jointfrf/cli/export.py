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
from jointfrf.cli.joint_file import JointFile, read_joint_file
from jointfrf.cli.output import Output
from jointfrf.files import write_file
from jointfrf.io.cards import CardOptions
from jointfrf.kernel.arguments import FloatArray

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Write a joint as input of a finite-element program: abaqus (springs and dashpots, or matrices), calculix "
        "(springs), nastran (CBUSH, or DMIG) or ansys (MATRIX27), with comments on what each number is worth."
    )
    parser.add_argument("joint", type=Path, help="JSON file of identify --save, or a TOML file with dofs and stiffness")
    parser.add_argument(
        "export",
        type=parse_export,
        metavar="PROGRAM:J,K",
        help="program and nodes j and k of its model: nastran:9001,9002; calculix: two ROT NODEs more for rotations",
    )
    add_joint_place(parser)
    add_card_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    found = read_joint_file(args.joint)
    request = card_request(
        args, found.joint.dofs, damping=found.damping, cross=found.cross, points=_points(args, found)
    )  # fmt: skip
    assert request is not None
    if found.fit is not None:
        text = written_cards(found.fit, request, found.about)
    else:
        options: CardOptions = {**request.options, "comments": found.about}
        text = found.joint.export(request.program, request.nodes, **options)
        if request.output is not None:
            write_file(request.output, text)
    written = [] if args.output is None else [str(args.output)]
    out.say(f"wrote {args.output}" if written else text.rstrip("\n"))
    out.give({"source": str(args.joint), "program": request.program, "cards": text, "written": written})
    return 0


def _points(args: argparse.Namespace, found: JointFile) -> FloatArray | None:
    if args.joint_at is not None:
        return np.tile(args.joint_at, (2, 1))
    return found.points
