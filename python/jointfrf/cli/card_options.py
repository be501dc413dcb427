"""Cards of a finite-element program on the command line: which program, which nodes, where they go."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, cast, get_args

import numpy as np

from jointfrf.cli.measured_file import nodes, numbers, point, words
from jointfrf.cli.usage import UsageError, check_folder, positive
from jointfrf.files import write_file
from jointfrf.identification.fit_cards import cards
from jointfrf.identification.result import Fit
from jointfrf.io.cards import CardFormat, CardOptions
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.spelling import did_you_mean

__all__ = ["CardRequest", "add_card_arguments", "add_joint_place", "card_request", "parse_export", "written_cards"]


class CardRequest(NamedTuple):
    """What is to be written, and where.

    Attributes
    ----------
    program : str
    nodes : list of int
        j and k.
    options : CardOptions
    all_damping : bool
    output : Path or None
        None: to be printed.
    """

    program: CardFormat
    nodes: list[int]
    options: CardOptions
    all_damping: bool
    output: Path | None


def parse_export(text: str) -> tuple[CardFormat, list[int]]:
    """Return program and nodes of words like abaqus:9001,9002."""
    program, _, rest = text.partition(":")
    known = get_args(CardFormat)
    if program not in known:
        raise argparse.ArgumentTypeError(f"{program!r} is none of {', '.join(known)}{did_you_mean(program, known)}")
    ends = list(nodes(rest).numbers) if rest else []
    if 0 < len(ends) < len(words(rest)):
        raise argparse.ArgumentTypeError(f"{text!r} names a node twice")
    if len(ends) not in (2, 4 if program == "calculix" else 2):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a program and nodes j and k like abaqus:9001,9002; calculix takes two ROT NODEs more"
        )
    return cast(CardFormat, program), ends


def _positions(text: str) -> tuple[tuple[float, ...], ...]:
    found = numbers(text, 6, "xj,yj,zj,xk,yk,zk in m")
    return found[:3], found[3:]


def add_card_arguments(parser: argparse._ActionsContainer) -> None:
    """Describe what belongs to the cards of any program."""
    parser.add_argument("--output", type=Path, metavar="FILE", help="write the cards into this file: joint.bdf")
    parser.add_argument(
        "--nodes-at",
        type=_positions,
        metavar="XJ,YJ,ZJ,XK,YK,ZK",
        help="where the two nodes of the model are, m: rigid arms lead from them to the reference point of the joint "
        "(without it the nodes are taken to lie there)",
    )
    parser.add_argument("--element", type=positive, default=1, metavar="N", help="first number of new elements (1)")
    parser.add_argument("--property", type=positive, default=1, metavar="N", help="first number of properties (1)")
    parser.add_argument("--full-matrix", action="store_true", help="matrices where springs would do (abaqus, nastran)")
    parser.add_argument(
        "--all-damping", action="store_true", help="also dashpots that are negative or not significantly above zero"
    )
    parser.add_argument("--no-damping", action="store_true", help="no damping in the cards")


def card_request(
    args: argparse.Namespace, dofs: Sequence[str], *, damping: str, cross: str, points: FloatArray | None
) -> CardRequest | None:
    """Return what is to be written, after a look at whether the program can hold such a joint.

    Parameters
    ----------
    args : Namespace
    dofs : sequence of str
        Joint DOFs.
    damping, cross : str
        Terms that the joint may have.
    points : ndarray, shape (2, 3), or None
        Reference points of the sides, m.

    Raises
    ------
    UsageError
        The program cannot hold it, or a number is out of range.
    """
    if args.export is None:
        for name, given in (("--output", args.output), ("--nodes-at", args.nodes_at)):
            if given is not None:
                raise UsageError(f"{name} is for cards: say --export PROGRAM:J,K, too")
        return None
    check_folder("--output", args.output)
    program, ends = args.export
    options: CardOptions = {
        "element": args.element,
        "number": args.property,
        "rotation_nodes": ends[2:] or None,
        "damping": not args.no_damping and program != "calculix",  # it has none between DOFs; the text says so
        "full_matrix": args.full_matrix,
    }
    if args.nodes_at is not None:
        if points is None:
            raise UsageError("--nodes-at needs --joint-at X,Y,Z, the reference point of the joint")
        options["positions"], options["points"] = np.array(args.nodes_at), points
    request = CardRequest(program, ends[:2], options, args.all_damping, args.output)
    try:
        _probe(len(dofs), dofs, damping, cross).export(request.program, request.nodes, **options)
    except ValueError as error:
        raise UsageError(_refusal(str(error), damping)) from error
    return request


def _probe(n: int, dofs: Sequence[str], damping: str, cross: str) -> Joint:
    """Return a joint with every term that the one to be found may have."""
    matrix = np.eye(n) + (0.1 if cross == "fit" else 0.0) * (1 - np.eye(n))
    viscous = matrix if damping in ("viscous", "both", "auto") else None
    hysteretic = matrix if damping in ("hysteretic", "both", "auto") else None
    return Joint(matrix, viscous, dofs, structural_damping=hysteretic)


def _refusal(why: str, damping: str) -> str:
    """Say with the words of the command line what a program cannot hold."""
    if "hysteretic" in why:
        may = f"--damping {damping} may find" if damping == "auto" else f"--damping {damping} fits"
        return f"MATRIX27 of ansys holds no hysteretic damping, which {may}: say --damping viscous, or --no-damping"
    if "rotation_nodes must" in why:
        return "rotations of calculix need the ROT NODEs of both rigid bodies after their nodes: calculix:J,K,ROTJ,ROTK"
    return why.replace("full_matrix", "--full-matrix")


def written_cards(fit: Fit, request: CardRequest, about: Sequence[str]) -> str:
    """Return the cards of a fit, and write them where that is wanted."""
    text = cards(
        fit, request.program, request.nodes, about=about, all_damping=request.all_damping, **request.options
    )  # fmt: skip
    if request.output is not None:
        write_file(request.output, text)
    return text


def add_joint_place(parser: argparse._ActionsContainer) -> None:
    """Describe the reference point of a joint that a file does not tell."""
    parser.add_argument(
        "--joint-at", type=point, metavar="X,Y,Z", help="reference point of the joint in the model, m (default: saved)"
    )
