"""Tables of the options of all commands, from the parsers themselves.

python tests/python/support/option_tables.py docs/command-line.md    writes them into the page
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from jointfrf.workbench.cli.parser import COMMANDS, command_parser, with_value

_PLACE = re.compile(r"(<!-- options of (\w+) -->\n).*?(<!-- end -->\n)", re.DOTALL)
#: In the table of what all commands share.
COMMON = ("--help", "--json", "--quiet", "--config", "--no-config")


def _row(action: argparse.Action) -> str:
    name = ", ".join([*action.option_strings[:-1], with_value(action)])
    text = re.sub(r"\s+", " ", (action.help or "").replace("%%", "%"))
    if not action.option_strings and action.choices:
        text += f": {', '.join(map(str, action.choices))}"
    return "| `{}` | {} |".format(*(cell.replace("|", "\\|") for cell in (name, text)))


def option_table(command: str) -> str:
    """Return the table of the arguments of a command, those that all have left out."""
    arguments = command_parser(command).arguments
    rows = [_row(action) for action in arguments if not set(action.option_strings) & set(COMMON)]
    return "\n".join(["| argument | what |", "|---|---|", *rows]) + "\n"


def common_table() -> str:
    """Return the table of the options that all commands have."""
    rows = [_row(action) for action in command_parser("cases").arguments if set(action.option_strings) & set(COMMON)]
    return "\n".join(["| option | what |", "|---|---|", *rows]) + "\n"


def filled(page: str) -> str:
    """Return a page with its tables as they are now."""

    def table(match: re.Match[str]) -> str:
        word = match[2]
        return match[1] + (common_table() if word == "all" else option_table(word)) + match[3]

    return _PLACE.sub(table, page)


def commands_with_a_table(page: str) -> set[str]:
    return {match[2] for match in _PLACE.finditer(page)} & set(COMMANDS)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")
