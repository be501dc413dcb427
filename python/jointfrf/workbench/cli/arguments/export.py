"""Arguments of `jointfrf export`."""

import argparse
from pathlib import Path
from typing import Annotated

from jointfrf.workbench.cli.arguments.cards import CardArguments, CardProgram
from jointfrf.workbench.cli.arguments.declaration import Form, option, positional
from jointfrf.workbench.cli.arguments.words import Point, numbers

__all__ = ["ExportArguments"]


def _frequency(text: str) -> float | tuple[float, float]:
    low, colon, high = text.partition(":")
    (found,) = numbers(low, 1, ("frequency", "HZ or LOW:HIGH"))
    last = numbers(high, 1, ("frequency", "LOW:HIGH in Hz"))[0] if colon else found
    if not found > 0 or (colon and not found < last):
        raise argparse.ArgumentTypeError(f"{text!r} is no band or frequency above 0 Hz; use HZ or LOW:HIGH")
    return (found, last) if colon else found


class ExportArguments(CardArguments):
    """Arguments of the command."""

    description = (
        "Write a joint as input of a finite-element program: abaqus (springs and dashpots, or matrices), calculix "
        "(springs, and dashpots with --damping-nodes), nastran (CBUSH, or DMIG), ansys (MATRIX27), code_aster "
        "(DISCRET), lsdyna (discrete beam, or DMIG) or subdyn (spring element, no damping), with the interval of each "
        "number as a comment."
    )
    examples = (
        "jointfrf export joint.json nastran:9001,9002 --output joint.bdf",
        "jointfrf export joint.json calculix:9001,9002,9003,9004 --nodes-at 0.05,0,0,0.07,0,0 --output joint.inp",
    )

    joint: Path = positional("JSON file of identify --save, or a TOML file of constants or laws", "JOINT")
    export: CardProgram = positional(
        "program and nodes j and k of its model: nastran:9001,9002; rotations of calculix need two ROT NODEs after "
        "them; several joints: nastran:fl=9001,9002:fr=9003,9004",
        "PROGRAM:J,K",
    )
    frequency: Annotated[float | tuple[float, float], Form("HZ", _frequency)] | None = option(
        "frequency at which frequency-dependent laws are evaluated; LOW:HIGH writes tables over frequency (abaqus, "
        "nastran, code_aster)"
    )
    point: str | None = option("joint point to write, from a fit of several joint points: bolt1", "NAME")
    joint_at: Point | None = option(
        "reference point of the joint in the model, in its unit of length", otherwise="the saved reference point"
    )
