"""Arguments of `jointfrf plan`."""

import argparse
from pathlib import Path
from typing import Annotated, Literal

from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, option, positional
from jointfrf.workbench.cli.arguments.measured_file import FloorArguments
from jointfrf.workbench.cli.arguments.structures import LineArguments
from jointfrf.workbench.cli.arguments.words import AboveZero, NewPage, above_zero

__all__ = ["GoalArguments", "PartsArguments", "PlanArguments"]

#: Nodes of a part that are candidates unless they are named: their information is computed for all pairs.
_CANDIDATES = 20


def _spacings(word: str) -> list[float]:
    return [above_zero(part) for part in word.split(",")]


def _names(word: str) -> list[str]:
    """Return names or DOFs between commas; positions of DOFs contain commas themselves."""
    found: list[str] = []
    for part in word.split(","):
        if found and "/@" in found[-1] and ":" not in found[-1]:
            found[-1] += f",{part}"
        else:
            found.append(part.strip())
    if not all(found):
        raise argparse.ArgumentTypeError(f"{word!r} is no list of DOFs; use a form such as A/7:y")
    return found


_Dofs = Annotated[list[str], Form("DOF,...", _names)]


class GoalArguments(Arguments):
    """The goal of a plan; keywords of `jointfrf.workbench.planning.plan.plan`."""

    heading = "the goal"

    targets: _Dofs | None = option("parameters to be found: k_y,c_y", "NAME,...", otherwise="all of the joint")
    criterion: Literal["A", "D"] = option(
        "A: mean of the squared relative errors, D: volume of their ellipsoid", default="A"
    )
    within: AboveZero | None = option("relative error at which the plan ends: 0.02", "ERROR")
    budget: AboveZero | None = option("largest total price of sensors and impacts", "COST")
    sensor_price: AboveZero = option("price of one sensor", "COST", 1.0)
    hit_price: AboveZero = option("price of one impact", "COST", 1.0)


class NextArguments(Arguments):
    """The next assembly."""

    spread: AboveZero | None = option(
        "relative spread between assemblies: prints the number of assemblies to test; needs --next", "S"
    )
    next: AboveZero | None = option(
        "relative half width of the prediction interval of the next assembly: 0.3; needs --spread", "WIDTH"
    )


class PartsArguments(GoalArguments, NextArguments):
    """Options for an assembly, not for a case."""

    heading = "candidates"

    sensors: _Dofs | None = option(
        "possible places of sensors: A/7:y,B/@0.1,0,0:y", otherwise="translations of --candidates nodes"
    )
    hits: _Dofs | None = option("possible places of impacts or shakers", otherwise="as for --sensors")
    keep_sensors: _Dofs | None = option("sensors that are in every plan")
    keep_hits: _Dofs | None = option("impacts that are in every plan")
    candidates: int = option("number of nodes of each part, far from each other", "N", _CANDIDATES)
    sensor_mass: AboveZero | None = option(
        "mass of each sensor, if the models lack it: prints the change of the parameters", "KG"
    )


class _DataArguments(FloorArguments):
    heading = "noise and sensors"

    noise: AboveZero = option("relative noise of one average of the FRFs; 0.01 means 1 %", "LEVEL", 0.01)
    averages: AboveZero = option("number of averages of each FRF", "N", 1.0)
    spacings: Annotated[list[float], Form("M,...", _spacings)] | None = option(
        "spacings of finite differences for rotations, m, with case.toml: prints the change of the parameters: "
        "0.001,0.005"
    )


class PlanArguments(LineArguments, PartsArguments, _DataArguments):
    """Arguments of the command."""

    description = (
        "Plan a test of an assembly of parts with models: the sensors and impacts that determine the joint best, the "
        "expected error of each parameter, the gain of one more sensor or impact, and the information by frequency."
    )
    ways = (("--band", "--step"),)
    examples = (
        "jointfrf plan cases/lap-beam/assembly.toml --band 20:1000 --step 2 --noise 0.02 --floor 0.01 --budget 5",
        "jointfrf plan cases/3.3-beams-1mm/case.toml --band 10:500 --step 1 --spacings 0.001,0.005,0.02",
    )

    model: Path = positional("assembly.toml with the expected joint, or case.toml", "ASSEMBLY")
    report: NewPage | None = option("HTML page with sensors, impacts and the information by frequency")
