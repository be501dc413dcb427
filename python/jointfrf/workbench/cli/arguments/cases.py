"""Arguments of `jointfrf cases`."""

from __future__ import annotations

from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = "List the cases that come with jointfrf."
    parser.examples.append("jointfrf cases")
    parser.option("--keys", "print all keys of case.toml and expected.toml (Markdown) instead")
