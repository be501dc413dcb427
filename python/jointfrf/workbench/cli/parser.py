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
from jointfrf.workbench.cli.usage import UsageError, listed

__all__ = ["COMMANDS", "CommandParser", "command_parser", "one_of", "top_parser", "with_value"]

#: The commands, each the module of its name, and what they do.
COMMANDS = {
    "identify": "identify a joint from measured FRFs",
    "check": "check measured FRFs: faults, the channels that have them, remedies",
    "convert": "convert measured FRFs to another file format",
    "export": "write a saved joint as input of a finite-element program",
    "couple": "compute the FRFs of two substructures coupled by a joint",
    "validate": "compare an assembly computed with an identified joint to a measured one",
    "decouple": "identify a joint by FRF decoupling, from FRFs away from it and both substructures",
    "frf": "compute receptances of a model",
    "plan": "choose sensors and impacts before a test",
    "levels": "find stiffness and loss factor over amplitude from tests at several levels",
    "pool": "pool fits of one joint in several assemblies: mean, spread, prediction",
    "run": "run cases: tables, figures and a report for each",
    "cases": "list the cases that come with jointfrf",
    "new": "write the files of a new case or assembly, with a comment for each key",
    "study": "run many realisations of a case over a design of factors: error, bias, coverage",
    "completion": "print a script that completes commands and options in bash, zsh or fish",
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
    ways : list of tuple of str
        The ways to call the command: the options that each one requires.
    examples : list of str
        Command lines that run where the files they name are.
    """

    def __init__(self, **options: Any) -> None:
        self.arguments: list[argparse.Action] = []
        self.repeated: set[str] = set()
        self.ways: list[tuple[str, ...]] = []
        self.examples: list[str] = []
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
        otherwise: str = "",
    ) -> None:
        """Add an option.

        Parameters
        ----------
        name : str
            Such as ``"--noise LEVEL"``; without a value, ``"--json"``, it is a flag.
        what : str
            Its help, without the default, which is appended.
        kind : callable or tuple of str
            What makes a value of a word; or the words there are.
        default : optional
            Value without the option.
        repeated : bool
            Whether it may be given several times: its value is then a list.
        otherwise : str
            The default in words, if it is no value: ``"all cores"``.
        """
        word, _, metavar = name.partition(" ")
        options: dict[str, Any] = {"help": what + _default(otherwise or default), "default": default}
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

    def requires(self, *names: str) -> None:
        """State a way to call the command: the options and positional arguments that it requires."""
        self.ways.append(names)

    def check_required(self, args: argparse.Namespace) -> None:
        """Check that the options of the only way to call the command are there, whoever gave them.

        Raises
        ------
        UsageError
            One is missing.
        """
        (names, *others), options = self.ways or [()], self.options
        missing = [name for name in names if name in options and getattr(args, options[name].dest) is None]
        if missing and not others:
            verb = "is" if len(missing) == 1 else "are"
            raise UsageError(f"{listed(missing)} {verb} missing: {self._call(names)}")

    def _call(self, names: Sequence[str]) -> str:
        """Return the command with positional arguments, and some options, each with its value."""
        positional = [action for action in self.arguments if not action.option_strings]
        shown = []
        for action in positional:
            name, is_many = str(action.metavar or action.dest), action.nargs in ("*", "+")
            if action.nargs in ("*", "?") and not self.ways:
                shown.append(f"[{name} ...]" if is_many else f"[{name}]")
            elif action.nargs not in ("*", "?") or name in names:
                shown.append(f"{name} [{name} ...]" if is_many else name)
        return " ".join(
            [self.prog, *shown, *(with_value(self.options[name]) for name in names if name in self.options)]
        )

    def describe_usage(self) -> None:
        """Show the ways to call the command in its usage, unless it has one; all other options are in the help."""
        ways = [f"{self._call(names)} [options]" for names in self.ways or [()]]
        self.usage = self.usage or "\n       ".join(ways).replace("%", "%%")

    def format_help(self) -> str:
        """Return the help, with the examples at its end."""
        shown = "".join(f"  {example}\n" for example in self.examples)
        return super().format_help() + (f"\nexamples:\n{shown}" if shown else "")

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


def _default(value: Any) -> str:
    """Return what stands for a default at the end of a help text; nothing for one that means no value."""
    if value is None or value == [] or value is False:
        return ""
    values = value if isinstance(value, list | tuple) else [value]
    shown = ",".join(f"{one:g}" if isinstance(one, float) else str(one) for one in values)
    return f" (default: {shown})".replace("%", "%%")


def with_value(action: argparse.Action) -> str:
    """Return an argument with its value, as a usage line and the tables of the documents show it."""
    value = str(action.metavar or (f"{{{','.join(map(str, action.choices))}}}" if action.choices else action.dest))
    name = action.option_strings[-1] if action.option_strings else ""
    return " ".join(word for word in (name, "" if action.nargs == 0 else value) if word)


def one_of(known: Collection[str]) -> Callable[[str], str]:
    """Return a type of words that accepts only known ones."""

    def taken(word: str) -> str:
        if word not in known:
            raise argparse.ArgumentTypeError(
                f"unknown value {word!r}; use one of {', '.join(known)}{did_you_mean(word, known)}"
            )
        return word

    return taken


def _add_common(parser: CommandParser) -> None:
    """Describe the options that every command has."""
    parser.heading("output and defaults")
    parser.option("--json", "print the result as JSON")
    parser.option("--quiet", "print only warnings and errors, no progress")
    parser.option(
        "--config FILE",
        "channels and default options of a project",
        otherwise="jointfrf.toml in the working directory, if it exists",
    )
    parser.option("--no-config", "ignore jointfrf.toml")
    parser.option(
        "--limit-gb GB",
        "largest size of one file, and largest memory to read it",
        _gigabytes,
        otherwise="16 GB; the larger of 1 GB and 10 times the file",
    )


def _gigabytes(word: str) -> float:
    try:
        found = float(word)
    except ValueError:
        found = 0.0
    if not 0 < found < math.inf:
        raise argparse.ArgumentTypeError(f"{word!r} is not a number above 0; use a size in GB")
    return found


def command_parser(name: str, parser: CommandParser | None = None) -> CommandParser:
    """Return the parser of a command; its arguments are imported, and nothing that carries it out."""
    parser = parser or CommandParser(prog=f"jointfrf {name}")
    importlib.import_module(f"jointfrf.workbench.cli.arguments.{name}").add_arguments(parser)
    _add_common(parser)
    parser.describe_usage()
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
        usage="jointfrf COMMAND [options]",
        description="Stiffness and damping of joints from FRFs.",
        epilog="jointfrf COMMAND --help lists the options of a command, with examples. Exit status: 0 success, 1 error "
        "in the data or the files, 2 wrong usage, 130 interrupted.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    return parser, {name: commands.add_parser(name, help=what) for name, what in COMMANDS.items()}
