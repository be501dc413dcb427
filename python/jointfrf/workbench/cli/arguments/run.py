"""Arguments of `jointfrf run`."""

from __future__ import annotations

from pathlib import Path

from jointfrf.workbench.cli.parser import CommandParser
from jointfrf.workbench.cli.usage import positive

__all__ = ["add_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = "Run cases by name, number or folder; without any, all cases that come with jointfrf."
    parser.examples.append("jointfrf run 3.1 --realisations 20 --out results")
    parser.add_argument("cases", nargs="*", metavar="CASE", help="name, number, or folder with a case.toml")
    parser.option("--out DIR", "folder for the results", Path, Path("results"))
    parser.option("--realisations N", "number of realisations", positive, otherwise="the number in the case")
    parser.option("--at-most N", "largest number of realisations of a case", positive)
    parser.option("--png", "write figures as PNG files, too")
    parser.option("--jobs N", "number of processes", positive, otherwise="all cores")
