"""Arguments of cards of finite-element programs, of `jointfrf export` and `jointfrf identify`."""

import argparse
from typing import Annotated, cast, get_args

from jointfrf.choices import CardFormat, UnitSystemName
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, flag, option
from jointfrf.workbench.cli.arguments.words import Count, NewFile, nodes, numbers, words

__all__ = ["CardArguments", "CardNodes", "CardOptionArguments", "CardProgram", "TermArguments"]

#: Nodes j and k of a joint, and ROT NODEs of CalculiX; of several joints by their names.
CardNodes = list[int] | dict[str, list[int]]


def _program(text: str) -> tuple[CardFormat, CardNodes]:
    """Return program and nodes of words like abaqus:9001,9002, or abaqus:fl=9001,9002:fr=9003,9004."""
    program, _, rest = text.partition(":")
    known = get_args(CardFormat)
    if program not in known:
        raise argparse.ArgumentTypeError(
            f"unknown program {program!r}; use one of {', '.join(known)}{did_you_mean(program, known)}"
        )
    if "=" not in rest:
        return cast(CardFormat, program), _ends(text, program, rest)
    of_joints: dict[str, list[int]] = {}
    for part in rest.split(":"):
        name, _, own = part.partition("=")
        if not name or name in of_joints:
            raise argparse.ArgumentTypeError(
                f"{text!r} names {name or 'no joint'} {'twice' if name else f'for {own}'}; name each joint once"
            )
        of_joints[name] = _ends(text, program, own)
    return cast(CardFormat, program), of_joints


def _ends(text: str, program: str, rest: str) -> list[int]:
    """Return the nodes of one joint."""
    ends = list(nodes(rest).numbers) if rest else []
    if 0 < len(ends) < len(words(rest)):
        raise argparse.ArgumentTypeError(f"{text!r} names a node twice; give different nodes")
    if len(ends) not in (2, 4 if program == "calculix" else 2):
        raise argparse.ArgumentTypeError(
            f"{text!r} is no program with nodes j and k. Use abaqus:9001,9002, for several joints "
            "abaqus:fl=9001,9002:fr=9003,9004, with two more ROT NODEs for calculix"
        )
    return ends


def _faces(text: str) -> tuple[list[int], list[int]]:
    one, colon, other = text.partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(f"{text!r} is not two lists of nodes; use the form 11,12,13:21,22,23")
    return list(nodes(one).numbers), list(nodes(other).numbers)


def _positions(text: str) -> tuple[tuple[float, ...], ...]:
    found = numbers(text, 6, ("pair of points", "xj,yj,zj,xk,yk,zk"))
    return found[:3], found[3:]


CardProgram = Annotated[tuple[CardFormat, CardNodes], Form("PROGRAM:J,K", _program)]


class TermArguments(Arguments):
    """Terms of the joint that the cards contain; keywords of `jointfrf.identification.fit_cards.cards`."""

    all_damping: bool = flag("include dashpots that are negative or not significantly above zero")
    bounds: bool = flag("include stiffnesses with an unbounded interval, by their best estimates")


class CardOptionArguments(Arguments):
    """Form of the cards; keywords of `jointfrf.io.cards.CardOptions`."""

    units: UnitSystemName = option("units of the model", default="SI")
    faces: Annotated[tuple[list[int], list[int]], Form("J1,J2,...:K1,K2,...", _faces)] | None = option(
        "nodes of solid elements that follow the two nodes as rigid bodies",
        otherwise="with --model the nodes of rigid reference points, else a comment to fill in",
    )
    element: Count = option("first number of new elements", default=1)
    property: Count = option("first number of new properties", default=1, keyword="number")
    damping_nodes: Count | None = option(
        "first number of auxiliary nodes for dashpots (calculix)", otherwise="stiffness only in calculix"
    )
    full_matrix: bool = flag("write matrices even if springs suffice (abaqus, nastran, lsdyna)")
    connector: bool = flag("write a connector element, for direct steady-state steps, instead of matrices (abaqus)")


class CardArguments(CardOptionArguments, TermArguments):
    """The cards of any program."""

    export: CardProgram | None = None

    output: NewFile | None = option("file for the cards: joint.bdf")
    nodes_at: Annotated[tuple[tuple[float, ...], ...], Form("XJ,YJ,ZJ,XK,YK,ZK", _positions)] | None = option(
        "positions of the two nodes of the model, in its unit of length; rigid arms connect them to the reference "
        "point of the joint",
        otherwise="the reference point",
    )
    no_damping: bool = flag("leave out all damping")
