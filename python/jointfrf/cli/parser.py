"""The parser of the command line: one subcommand at a time, and what a misspelt word looks like."""

from __future__ import annotations

import argparse
import importlib
import math
import re
import sys
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

from jointfrf.spelling import did_you_mean, visible

__all__ = ["COMMANDS", "CommandParser", "command_parser", "options_of", "top_parser"]

#: The commands, each the module of its name, and what they do.
COMMANDS = {
    "identify": "identify a joint from a file of measured FRFs",
    "check": "look at measured FRFs: what is wrong, in which channel, what to do",
    "convert": "measured FRFs of one file or several into another format",
    "export": "a saved joint as input of a finite-element program",
    "couple": "FRFs of the assembly of two substructures and a joint",
    "decouple": "a joint from FRFs of the assembly away from it and of both substructures",
    "frf": "receptances of a model",
    "run": "run cases: tables, figures and a report each",
    "cases": "list the cases that come with jointfrf",
    "new": "the files of a new case, with a comment beside each key",
    "study": "many realisations of a case over a design of factors: error, bias and coverage beside the bound",
    "completion": "a script that completes commands and options in bash, zsh or fish",
}
#: A value that begins like an option: -0.06,0,0
_NEGATIVE = re.compile(r"-\.?\d")


class CommandParser(argparse.ArgumentParser):
    """A parser whose errors say what was meant; options are written in full."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        self._given: set[str] = set()

    def error(self, message: str) -> NoReturn:
        """Print the usage of this command and what is wrong."""
        self.print_usage(sys.stderr)
        self.exit(2, f"jointfrf: error: {visible(message)}\n")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is None or value in action.choices:
            return
        choices = [str(choice) for choice in action.choices]
        hint = did_you_mean(str(value), choices)
        raise argparse.ArgumentError(action, f"{str(value)!r} is none of {', '.join(choices)}{hint}")

    def parse_words(self, words: Sequence[str]) -> argparse.Namespace:
        """Parse words; an unknown option is named with the one it looks like.

        Values such as -0.06,0,0 may stand after their option.
        """
        joined = self._joined(words)
        self._given = {options_of(self)[name].dest for name in map(_name, joined) if name in options_of(self)}
        return self.parse_args(joined)

    def was_given(self, dest: str) -> bool:
        """Whether the words parsed last say something of an option."""
        return dest in self._given

    def converted(self, action: argparse.Action, text: str) -> Any:
        """Return the value of an option as if it stood on the command line.

        Raises
        ------
        argparse.ArgumentError
            It is not such a value.
        """
        value = self._get_value(action, text)
        self._check_value(action, value)
        return value

    def _joined(self, words: Sequence[str]) -> list[str]:
        """Join options with values that begin with a minus, and refuse unknown options."""
        options, joined = options_of(self), list[str]()
        waiting = iter(words)
        for word in waiting:
            if word == "--":
                return [*joined, word, *waiting]
            name = _name(word)
            if not word.startswith("-") or word == "-" or _NEGATIVE.match(word):
                joined.append(word)
                continue
            if name not in options:
                self.error(f"unknown option {name}{did_you_mean(name, options)}")
            joined.append(word)
            if name != word or options[name].nargs == 0:
                continue
            value = next(waiting, None)
            if value is not None and _NEGATIVE.match(value):
                joined[-1] = f"{word}={value}"
            elif value is not None:
                joined.append(value)
        return joined


def _name(word: str) -> str:
    return word.partition("=")[0]


def options_of(parser: argparse.ArgumentParser) -> dict[str, argparse.Action]:
    """Return the options of a parser by each of their names."""
    return {name: action for action in parser._actions for name in action.option_strings}


def _add_common(parser: argparse.ArgumentParser) -> None:
    """Describe the options that every command has."""
    group = parser.add_argument_group("output and defaults")
    group.add_argument("--json", action="store_true", help="print the result as JSON")
    group.add_argument("--quiet", action="store_true", help="print nothing but warnings and errors")
    group.add_argument(
        "--config",
        metavar="FILE",
        help="channels and defaults of a project (default: jointfrf.toml in the working directory, where there is one)",
    )
    group.add_argument("--no-config", action="store_true", help="do not look for jointfrf.toml")
    group.add_argument(
        "--limit-gb",
        type=_gigabytes,
        metavar="GB",
        help="how large one file may be, and what it may take in memory (default: 16 GB; 1 GB, or 10 times the file)",
    )


def _gigabytes(word: str) -> float:
    try:
        found = float(word)
    except ValueError:
        found = 0.0
    if not 0 < found < math.inf:
        raise argparse.ArgumentTypeError(f"must be a number of GB above 0, not {word!r}")
    return found


def command_parser(name: str, parser: argparse.ArgumentParser | None = None) -> CommandParser:
    """Return the parser of a command; only its module is imported."""
    found = CommandParser(prog=f"jointfrf {name}") if parser is None else parser
    assert isinstance(found, CommandParser)
    module = importlib.import_module(f"jointfrf.cli.{name}")
    module.add_arguments(found)
    _add_common(found)
    found.set_defaults(action=module.run)
    return found


class _Version(argparse.Action):
    """Prints the version, which takes time to find."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version

        print(f"jointfrf {version('jointfrf')}")
        parser.exit()


def top_parser(whole: Iterable[str] = ()) -> CommandParser:
    """Return the parser of `jointfrf` itself, with the options of the commands named in `whole`."""
    parser = CommandParser(
        prog="jointfrf",
        description="Stiffness and damping of joints from FRFs.",
        epilog="jointfrf COMMAND --help lists the options of a command. Exit status: 0 good, 1 something in the data "
        "or the files is wrong, 2 wrong usage, 130 interrupted.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, what in COMMANDS.items():
        command = commands.add_parser(name, help=what)
        if name in whole:
            command_parser(name, command)
    return parser
