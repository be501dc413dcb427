"""`jointfrf cases`: the cases that come with the package."""

from __future__ import annotations

import argparse

from jointfrf.cases.catalogue import case_title, key_page, list_cases
from jointfrf.cli.parser import CommandParser
from jointfrf.cli.usage import Output

__all__ = ["add_arguments", "run"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = "List the cases that come with jointfrf."
    parser.examples.append("jointfrf cases")
    parser.option("--keys", "print all keys of case.toml and expected.toml (Markdown) instead")


def run(options: argparse.Namespace) -> int:
    """Carry out the command."""
    if options.keys:
        print(key_page(), end="")  # a page for a file, whatever else is asked for
        return 0
    out = Output(options)
    found = {folder: case_title(folder) for folder in list_cases()}
    width = max((len(folder.name) for folder in found), default=0)
    out.say(*(f"{folder.name.ljust(width)}  {title}" for folder, title in found.items()))
    out.give({"cases": [{"name": folder.name, "title": title, "folder": str(folder.resolve())}
                        for folder, title in found.items()]})  # fmt: skip
    return 0
