"""Arguments of `jointfrf plan`."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointfrf.workbench.cli.arguments.frf import add_line_arguments
from jointfrf.workbench.cli.arguments.noise import add_floor_argument
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_arguments"]

#: Nodes of a part that are candidates unless they are named: their information is computed for all pairs.
_CANDIDATES = 20


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Plan a test of an assembly of parts with models: the sensors and impacts that determine the joint best, the "
        "expected error of each parameter, the gain of one more sensor or impact, and the information by frequency."
    )
    parser.requires("--band", "--step")
    parser.examples += [
        "jointfrf plan cases/lap-beam/assembly.toml --band 20:1000 --step 2 --noise 0.02 --floor 0.01 --budget 5",
        "jointfrf plan cases/3.3-beams-1mm/case.toml --band 10:500 --step 1 --spacings 0.001,0.005,0.02",
    ]
    parser.add_argument(
        "model", type=Path, metavar="ASSEMBLY", help="assembly.toml with the expected joint, or case.toml"
    )
    add_line_arguments(parser)
    parser.option(
        "--sensors DOF,...",
        "possible places of sensors: A/7:y,B/@0.1,0,0:y",
        _dofs,
        otherwise="translations of --candidates nodes",
    )
    parser.option("--hits DOF,...", "possible places of impacts or shakers", _dofs, otherwise="as for --sensors")
    parser.option("--keep-sensors DOF,...", "sensors that are in every plan", _dofs)
    parser.option("--keep-hits DOF,...", "impacts that are in every plan", _dofs)
    parser.option("--candidates N", "number of nodes of each part, far from each other", int, _CANDIDATES)
    parser.heading("noise and sensors")
    parser.option("--noise LEVEL", "relative noise of one average of the FRFs; 0.01 means 1 %%", _positive, 0.01)
    add_floor_argument(parser)
    parser.option("--averages N", "number of averages of each FRF", _positive, 1.0)
    parser.option(
        "--sensor-mass KG", "mass of each sensor, if the models lack it: prints the change of the parameters", _positive
    )
    parser.option(
        "--spacings M,...",
        "spacings of finite differences for rotations, m, with case.toml: prints the change of the parameters: "
        "0.001,0.005", _spacings,
    )  # fmt: skip
    parser.heading("the goal")
    parser.option("--targets NAME,...", "parameters to be found: k_y,c_y", _dofs, otherwise="all of the joint")
    parser.option(
        "--criterion", "A: mean of the squared relative errors, D: volume of their ellipsoid", ("A", "D"), "A"
    )
    parser.option("--within ERROR", "relative error at which the plan ends: 0.02", _positive)
    parser.option("--budget COST", "largest total price of sensors and impacts", _positive)
    parser.option("--sensor-price COST", "price of one sensor", _positive, 1.0)
    parser.option("--hit-price COST", "price of one impact", _positive, 1.0)
    parser.option(
        "--spread S", "relative spread between assemblies: prints the number of assemblies to test; needs --next",
        _positive,
    )  # fmt: skip
    parser.option(
        "--next WIDTH", "relative half width of the prediction interval of the next assembly: 0.3; needs --spread",
        _positive,
    )  # fmt: skip
    parser.option("--report FILE", "HTML page with sensors, impacts and the information by frequency", Path)


def _positive(word: str) -> float:
    try:
        found = float(word)
    except ValueError:
        found = -1.0
    if not 0 < found < float("inf"):
        raise argparse.ArgumentTypeError(f"{word!r} is no number above zero; give one")
    return found


def _spacings(word: str) -> list[float]:
    return [_positive(part) for part in word.split(",")]


def _dofs(word: str) -> list[str]:
    """Return DOFs between commas; positions hold commas themselves."""
    found: list[str] = []
    for part in word.split(","):
        if found and "/@" in found[-1] and ":" not in found[-1]:
            found[-1] += f",{part}"
        else:
            found.append(part.strip())
    if not all(found):
        raise argparse.ArgumentTypeError(f"{word!r} is no list of DOFs; use the form A/7:y,B/3:y")
    return found
