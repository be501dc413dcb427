"""`jointfrf cases`: the cases that come with the package."""

from __future__ import annotations

import argparse

from jointfrf.cases.catalogue import list_cases, read_case

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command: there are none."""
    parser.description = "List the cases that come with jointfrf."


def run(options: argparse.Namespace) -> int:
    """Carry out the command."""
    found = [read_case(folder) for folder in list_cases()]
    width = max((len(case.name) for case in found), default=0)
    for case in found:
        print(f"{case.name.ljust(width)}  {case.title}")
    return 0
