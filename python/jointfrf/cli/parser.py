"""The parser of the command line: one subcommand at a time, and what a misspelt word looks like."""

from __future__ import annotations

import argparse
import importlib
import math
import re
import sys
from collections.abc import Callable, Collection, Sequence
from typing import Any, NoReturn

from jointfrf.spelling import did_you_mean, visible

__all__ = ["COMMANDS", "CommandParser", "command_parser", "one_of", "top_parser"]

#: The commands, each the module of its name, and what they do.
COMMANDS = {
    "identify": "identify a joint from a file of measured FRFs",
    "check": "look at measured FRFs: what is wrong, in which channel, what to do",
    "convert": "measured FRFs of one file or several into another format",
    "export": "a saved joint as input of a finite-element program",
    "couple": "FRFs of the assembly of two substructures and a joint",
    "validate": "a joint found: the assembly that it makes of its parts, or of others, beside the measured one",
    "decouple": "a joint from FRFs of the assembly away from it and of both substructures",
    "frf": "receptances of a model",
    "plan": "which sensors and hits show a joint best, before anything is measured",
    "levels": "one joint at several levels: stiffness and loss factor over amplitude",
    "pool": "fits of one joint in several assemblies: mean, spread, the next assembly",
    "run": "run cases: tables, figures and a report each",
    "cases": "list the cases that come with jointfrf",
    "new": "the files of a new case, with a comment beside each key",
    "study": "many realisations of a case over a design of factors: error, bias and coverage beside the bound",
    "completion": "a script that completes commands and options in bash, zsh or fish",
}
#: Options of earlier versions, and what there is instead.
_REMOVED = {
    "--accept-bent": "; amplitude-dependent FRFs are fitted with wider intervals, and --accept CODE accepts errors"
}
#: A value that begins like an option: -0.06,0,0
_NEGATIVE = re.compile(r"-\.?\d")


class CommandParser(argparse.ArgumentParser):
    """A parser whose errors suggest what was meant; options are written in full.

    Attributes
    ----------
    arguments : list of argparse.Action
        All that were added, in their order.
    repeated : set of str
        Destinations of options that may be given several times.
    """

    def __init__(self, **options: Any) -> None:
        self.arguments: list[argparse.Action] = []
        self.repeated: set[str] = set()
        super().__init__(allow_abbrev=False, **options)
        self._add: Callable[..., argparse.Action] = super().add_argument

    def add_argument(self, *names: str, **options: Any) -> argparse.Action:
        """Add an argument as argparse does."""
        self.arguments.append(super().add_argument(*names, **options))
        return self.arguments[-1]

    def heading(self, title: str) -> None:
        """Put the options that follow under a heading of the help."""
        self._add = self.add_argument_group(title).add_argument

    def option(
        self,
        name: str,
        what: str,
        kind: Callable[[str], Any] | Collection[str] | None = None,
        default: Any = None,
        *,
        repeated: bool = False,
    ) -> None:
        """Add an option.

        Parameters
        ----------
        name : str
            Such as ``"--noise LEVEL"``; without a value, ``"--json"``, it is a flag.
        what : str
            Its help.
        kind : callable or tuple of str
            What makes a value of a word; or the words there are.
        default : optional
        repeated : bool
            Whether it may be given several times: its value is then a list.
        """
        word, _, metavar = name.partition(" ")
        options: dict[str, Any] = {"help": what, "default": default}
        if isinstance(kind, Collection):
            options |= {"choices": kind, "type": one_of(kind)}
        elif metavar:
            options |= {"metavar": metavar, "type": kind}
        else:
            options |= {"action": "store_true", "default": False}
        if repeated:
            options["action"] = "append"
        self.arguments.append(self._add(word, **options))
        self.repeated |= {self.arguments[-1].dest} if repeated else set()

    @property
    def options(self) -> dict[str, argparse.Action]:
        """The options by each of their names."""
        return {name: action for action in self.arguments for name in action.option_strings}

    def error(self, message: str) -> NoReturn:
        """Print the usage of this command and what is wrong."""
        self.print_usage(sys.stderr)
        self.exit(2, f"jointfrf: error: {visible(message)}\n")

    def parse_words(self, words: Sequence[str]) -> argparse.Namespace:
        """Parse words; an unknown option is named with the one it looks like.

        Values such as -0.06,0,0 may follow their option. Destinations of the options given are in `given`.
        """
        joined, options = self._joined(words), self.options
        found = self.parse_args(joined)
        found.given = {options[name].dest for name in map(_name, joined) if name in options}
        return found

    def _joined(self, words: Sequence[str]) -> list[str]:
        """Join options with values that begin with a minus; unknown options end the program with a suggestion."""
        options, joined = self.options, list[str]()
        waiting = iter(words)
        for word in waiting:
            if word == "--":
                return [*joined, word, *waiting]
            joined.append(word)
            if not word.startswith("-") or word == "-" or _NEGATIVE.match(word):
                continue
            name = _name(word)
            if name not in options:
                hint = _REMOVED.get(name) or did_you_mean(name, options)
                self.error(f"unknown option {name}{hint}")
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


def one_of(known: Collection[str]) -> Callable[[str], str]:
    """Return a type of words that accepts only known ones."""

    def taken(word: str) -> str:
        if word not in known:
            raise argparse.ArgumentTypeError(f"{word!r} is none of {', '.join(known)}{did_you_mean(word, known)}")
        return word

    return taken


def _add_common(parser: CommandParser) -> None:
    """Describe the options that every command has."""
    parser.heading("output and defaults")
    parser.option("--json", "print the result as JSON")
    parser.option("--quiet", "print nothing but warnings and errors")
    parser.option(
        "--config FILE",
        "channels and defaults of a project (default: jointfrf.toml in the working directory, where there is one)",
    )
    parser.option("--no-config", "do not look for jointfrf.toml")
    parser.option(
        "--limit-gb GB",
        "how large one file may be, and what it may take in memory (default: 16 GB; 1 GB, or 10 times the file)",
        _gigabytes,
    )


def _gigabytes(word: str) -> float:
    try:
        found = float(word)
    except ValueError:
        found = 0.0
    if not 0 < found < math.inf:
        raise argparse.ArgumentTypeError(f"must be a number of GB above 0, not {word!r}")
    return found


def command_parser(name: str, parser: CommandParser | None = None) -> CommandParser:
    """Return the parser of a command; only its module is imported."""
    parser = parser or CommandParser(prog=f"jointfrf {name}")
    module = importlib.import_module(f"jointfrf.cli.{name}")
    module.add_arguments(parser)
    _add_common(parser)
    parser.set_defaults(action=module.run)
    return parser


class _Version(argparse.Action):
    """Prints the version, which takes time to find."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version

        print(f"jointfrf {version('jointfrf')}")
        parser.exit()


def top_parser() -> tuple[CommandParser, dict[str, CommandParser]]:
    """Return the parser of `jointfrf` itself, and those of its commands, still without their options."""
    parser = CommandParser(
        prog="jointfrf",
        description="Stiffness and damping of joints from FRFs.",
        epilog="jointfrf COMMAND --help lists the options of a command. Exit status: 0 good, 1 something in the data "
        "or the files is wrong, 2 wrong usage, 130 interrupted.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    return parser, {name: commands.add_parser(name, help=what) for name, what in COMMANDS.items()}
