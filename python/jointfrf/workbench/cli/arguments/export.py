"""Arguments of `jointfrf export`, and of the cards of `jointfrf identify`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import cast, get_args

from jointfrf.choices import CardFormat, UnitSystemName
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.arguments.measured_file import nodes, numbers, point, words
from jointfrf.workbench.cli.parser import CommandParser
from jointfrf.workbench.cli.usage import positive

__all__ = ["CardNodes", "add_arguments", "add_card_arguments", "parse_export"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Write a joint as input of a finite-element program: abaqus (springs and dashpots, or matrices), calculix "
        "(springs, and dashpots with --damping-nodes), nastran (CBUSH, or DMIG), ansys (MATRIX27), code_aster "
        "(DISCRET), lsdyna (discrete beam, or DMIG) or subdyn (spring element, no damping), with the interval of each "
        "number as a comment."
    )
    parser.examples += [
        "jointfrf export joint.json nastran:9001,9002 --output joint.bdf",
        "jointfrf export joint.json calculix:9001,9002,9003,9004 --nodes-at 0.05,0,0,0.07,0,0 --output joint.inp",
    ]
    parser.add_argument(
        "joint", type=Path, metavar="JOINT", help="JSON file of identify --save, or a TOML file of constants or laws"
    )
    parser.add_argument(
        "export",
        type=parse_export,
        metavar="PROGRAM:J,K",
        help="program and nodes j and k of its model: nastran:9001,9002; rotations of calculix need two ROT NODEs "
        "after them; several joints: nastran:fl=9001,9002:fr=9003,9004",
    )
    parser.option(
        "--frequency HZ",
        "frequency at which frequency-dependent laws are evaluated; LOW:HIGH writes tables over frequency (abaqus, "
        "nastran, code_aster)",
        _frequency,
    )
    parser.option("--point NAME", "joint point to write, from a fit of several joint points: bolt1")
    parser.option(
        "--joint-at X,Y,Z",
        "reference point of the joint in the model, in its unit of length",
        point,
        otherwise="the saved reference point",
    )
    add_card_arguments(parser)


def _frequency(text: str) -> float | tuple[float, float]:
    low, colon, high = text.partition(":")
    (found,) = numbers(low, 1, ("frequency", "HZ or LOW:HIGH"))
    last = numbers(high, 1, ("frequency", "LOW:HIGH in Hz"))[0] if colon else found
    if not found > 0 or (colon and not found < last):
        raise argparse.ArgumentTypeError(f"{text!r} is no band or frequency above 0 Hz; use HZ or LOW:HIGH")
    return (float(found), float(last)) if colon else float(found)


#: Nodes j and k of a joint, and ROT NODEs of CalculiX; of several joints by their names.
CardNodes = list[int] | dict[str, list[int]]


def parse_export(text: str) -> tuple[CardFormat, CardNodes]:
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
            f"{text!r} is no program with nodes j and k; use abaqus:9001,9002, for several joints "
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


def add_card_arguments(parser: CommandParser) -> None:
    """Describe what belongs to the cards of any program."""
    parser.option("--output FILE", "file for the cards: joint.bdf", Path)
    parser.option(
        "--nodes-at XJ,YJ,ZJ,XK,YK,ZK",
        "positions of the two nodes of the model, in its unit of length; rigid arms connect them to the reference "
        "point of the joint",
        _positions,
        otherwise="the reference point",
    )
    parser.option("--units", "units of the model", get_args(UnitSystemName), "SI")
    parser.option(
        "--faces J1,J2,...:K1,K2,...",
        "nodes of solid elements that follow the two nodes as rigid bodies",
        _faces,
        otherwise="with --model the nodes of rigid reference points, else a comment to fill in",
    )
    parser.option("--element N", "first number of new elements", positive, 1)
    parser.option("--property N", "first number of new properties", positive, 1)
    parser.option(
        "--damping-nodes N",
        "first number of auxiliary nodes for dashpots (calculix)",
        positive,
        otherwise="stiffness only in calculix",
    )
    parser.option("--full-matrix", "write matrices even if springs suffice (abaqus, nastran, lsdyna)")
    parser.option(
        "--connector", "write a connector element, for direct steady-state steps, instead of matrices (abaqus)"
    )
    parser.option("--all-damping", "include dashpots that are negative or not significantly above zero")
    parser.option("--bounds", "include stiffnesses with an unbounded interval, by their best estimates")
    parser.option("--no-damping", "leave out all damping")
