"""Arguments of `jointfrf pool`."""

import argparse
from pathlib import Path
from typing import Annotated

from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, flag, number, option, positional
from jointfrf.workbench.cli.arguments.words import NewFile, NewPage

__all__ = ["PoolArguments", "PoolOnlyArguments"]


def _names(word: str) -> list[str]:
    names = [one.strip() for one in word.split(",")]
    if not all(names):
        raise argparse.ArgumentTypeError(f"{word!r} is no list of names; separate them by commas")
    return names


def _factor(word: str) -> tuple[str, list[str]]:
    name, equals, groups = word.partition("=")
    if not (name and equals and groups):
        raise argparse.ArgumentTypeError(f"{word!r} is no factor; use the form NAME=GROUP,GROUP,...")
    return name, _names(groups)


_share = number(lambda found: found >= 0, "is no share; use a number such as 0.05")
_probability = number(lambda found: 0 < found < 1, "is no probability; use a number between 0 and 1")


def _common(word: str) -> tuple[str, float]:
    name, equals, share = word.rpartition("=")
    if equals and not name:
        raise argparse.ArgumentTypeError(f"{word!r} is no error; use the form ERROR or NAME=ERROR")
    return name, _share(share)


class PoolOnlyArguments(Arguments):
    """Options without effect on a test of one joint in several structures."""

    factor: list[Annotated[tuple[str, list[str]], Form("NAME=GROUP,...", _factor)]] = option(
        "group of each file: assembly=1,1,2,2 (files of one assembly are repeats), day=mon,mon,tue; may be repeated",
        default=[],
    )
    trend: list[str] = option("numeric factor with a power law: torque; may be repeated", "NAME", [])
    common: list[Annotated[tuple[str, float], Form("ERROR", _common)]] = option(
        "relative standard error that all files share (0.01), or all files of a group (day=0.01); may be repeated",
        default=[],
    )
    probability: Annotated[float, Form("P", _probability)] = option(
        "coverage probability of the intervals", default=0.95
    )
    report: NewPage | None = option("HTML page with a forest plot of each parameter")
    output: NewFile | None = option("CSV table of the result")


class PoolArguments(PoolOnlyArguments):
    """Arguments of the command."""

    description = (
        "Pool fits of the same joint in several assemblies, at several torques, on several days: mean, spread between "
        "assemblies, significant factors, outlying assemblies, and the prediction interval of the next assembly."
    )
    ways = (("FIT",), ("--table",))
    examples = (
        "jointfrf pool --table cases/bolted-round-robin/tests.csv --trend torque",
        "jointfrf pool cases/bolted-round-robin/assembly_1_10_Nm.json cases/bolted-round-robin/assembly_1_15_Nm.json "
        "cases/bolted-round-robin/assembly_2_10_Nm.json --factor assembly=1,1,2",
    )

    files: list[Path] = positional("JSON files of identify --save", "FIT", optional=True)
    table: Path | None = option(
        "CSV table of the fits instead of FIT: columns file (relative to the table), optionally label, and one column "
        "for each factor"
    )
    parameters: Annotated[list[str], Form("NAME,...", _names)] | None = option(
        "parameters to be pooled, or loss factors (eta_y)", otherwise="all that the fits share"
    )
    transfer: bool = flag("test whether one joint explains all files, each of another structure, instead of pooling")
    spread: Annotated[float, Form("S", _share)] = option(
        "relative spread between assemblies that is no significant difference; needs --transfer", default=0.0
    )
