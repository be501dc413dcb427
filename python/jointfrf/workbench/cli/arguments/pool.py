"""Arguments of `jointfrf pool`."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Pool fits of the same joint in several assemblies, at several torques, on several days: mean, spread between "
        "assemblies, significant factors, outlying assemblies, and the prediction interval of the next assembly."
    )
    parser.requires("FIT")
    parser.requires("--table")
    parser.examples += [
        "jointfrf pool --table cases/bolted-round-robin/tests.csv --trend torque",
        "jointfrf pool cases/bolted-round-robin/assembly_1_10_Nm.json cases/bolted-round-robin/assembly_1_15_Nm.json "
        "cases/bolted-round-robin/assembly_2_10_Nm.json --factor assembly=1,1,2",
    ]
    parser.add_argument("files", type=Path, nargs="*", metavar="FIT", help="JSON files of identify --save")
    parser.option(
        "--table FILE",
        "CSV table of the fits instead of FIT: columns file (relative to the table), optionally label, and one column "
        "for each factor",
        Path,
    )
    parser.option(
        "--factor NAME=GROUP,...",
        "group of each file: assembly=1,1,2,2 (files of one assembly are repeats), day=mon,mon,tue; may be repeated",
        _factor,
        repeated=True,
    )
    parser.option("--trend NAME", "numeric factor with a power law: torque; may be repeated", str, repeated=True)
    parser.option(
        "--common ERROR",
        "relative standard error that all files share (0.01), or all files of a group (day=0.01); may be repeated",
        _common, repeated=True,
    )  # fmt: skip
    parser.option(
        "--parameters NAME,...", "parameters to be pooled, or loss factors (eta_y)", _names,
        otherwise="all that the fits share",
    )  # fmt: skip
    parser.option("--probability P", "coverage probability of the intervals", _probability, 0.95)
    parser.option(
        "--transfer", "test whether one joint explains all files, each of another structure, instead of pooling"
    )
    parser.option(
        "--spread S", "relative spread between assemblies that is no significant difference; needs --transfer", _share,
        0.0,
    )  # fmt: skip
    parser.option("--report FILE", "HTML page with a forest plot of each parameter", Path)
    parser.option("--output FILE", "CSV table of the result", Path)


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


def _share(word: str) -> float:
    try:
        found = float(word)
    except ValueError:
        found = -1.0
    if not 0 <= found < float("inf"):
        raise argparse.ArgumentTypeError(f"{word!r} is no share; use a number such as 0.05")
    return found


def _common(word: str) -> tuple[str, float]:
    name, equals, share = word.rpartition("=")
    if equals and not name:
        raise argparse.ArgumentTypeError(f"{word!r} is no error; use the form ERROR or NAME=ERROR")
    return name, _share(share)


def _probability(word: str) -> float:
    found = _share(word)
    if not 0 < found < 1:
        raise argparse.ArgumentTypeError(f"{word!r} is no probability; use a number between 0 and 1")
    return found
