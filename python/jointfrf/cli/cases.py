"""`jointfrf cases`: the cases that come with the package."""

from __future__ import annotations

import argparse

from jointfrf.cases.catalogue import list_cases, read_case
from jointfrf.cases.key_page import key_page
from jointfrf.cli.parser import CommandParser
from jointfrf.cli.usage import Output

__all__ = ["add_arguments", "run"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = "List the cases that come with jointfrf."
    parser.option("--keys", "instead: print all keys of case.toml and expected.toml (Markdown)")


def run(options: argparse.Namespace) -> int:
    """Carry out the command."""
    if options.keys:
        print(key_page(), end="")  # a page for a file, whatever else is asked for
        return 0
    out = Output(options)
    found = [read_case(folder) for folder in list_cases()]
    width = max((len(case.name) for case in found), default=0)
    out.say(*(f"{case.name.ljust(width)}  {case.title}" for case in found))
    out.give({"cases": [{"name": case.name, "title": case.title, "folder": str(case.folder)} for case in found]})
    return 0
