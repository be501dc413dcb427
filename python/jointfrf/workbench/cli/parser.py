"""The parser of the command line: one subcommand at a time, and what a misspelt word looks like."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from jointfrf.spelling import did_you_mean, visible
from jointfrf.workbench.cli.arguments.declaration import Arguments, DeclaredArgument, declared
from jointfrf.workbench.cli.usage import UsageError, listed

__all__ = ["COMMANDS", "CommandParser", "command_parser", "top_parser", "with_value"]

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
    """A parser whose errors suggest a known word; options are written in full.

    Attributes
    ----------
    arguments : list of argparse.Action
        All that were added, in their order.
    kind : type
        The class that declares them.
    """

    def __init__(self, **options: Any) -> None:
        self.arguments: list[argparse.Action] = []
        self.kind: type[Arguments] = Arguments
        super().__init__(allow_abbrev=False, **options)

    def add_argument(self, *names: str, **options: Any) -> argparse.Action:
        """Add an argument as argparse does."""
        self.arguments.append(super().add_argument(*names, **options))
        return self.arguments[-1]

    def declare(self, kind: type[Arguments]) -> None:
        """Add the arguments that a class declares, each group of options under its heading."""
        self.kind, self.description = kind, kind.description
        add, heading = super().add_argument, ""
        for one in declared(kind):
            if one.heading != heading and not one.is_positional:
                heading, add = one.heading, self.add_argument_group(one.heading).add_argument
            self.arguments.append(add(*([] if one.is_positional else [one.flag]), **_for_argparse(one)))
        ways = [f"{self._call(names)} [options]" for names in kind.ways or [()]]
        self.usage = kind.usage or "\n       ".join(ways).replace("%", "%%")

    @property
    def options(self) -> dict[str, argparse.Action]:
        """The options by each of their names."""
        return {name: action for action in self.arguments for name in action.option_strings}

    def arguments_of(self, found: argparse.Namespace, **about: Any) -> Arguments:
        """Return the values of the command line and the configuration as an instance of the class.

        Raises
        ------
        UsageError
            An option is missing that the only way to call the command requires.
        """
        (names, *others), options = self.kind.ways or [()], self.options
        missing = [name for name in names if name in options and getattr(found, options[name].dest) is None]
        if missing and not others:
            verb = "is" if len(missing) == 1 else "are"
            raise UsageError(f"{listed(missing)} {verb} missing: {self._call(names)}")
        values = {one.name: getattr(found, one.name) for one in declared(self.kind)}
        values |= {"given": frozenset(found.given), "configuration": found.configuration}
        return self.kind(**values, **about)

    def _call(self, names: Sequence[str]) -> str:
        """Return the command with positional arguments, and some options, each with its value."""
        positional = [action for action in self.arguments if not action.option_strings]
        shown = []
        for action in positional:
            name, is_many = str(action.metavar or action.dest), action.nargs in ("*", "+")
            if action.nargs in ("*", "?") and not self.kind.ways:
                shown.append(f"[{name} ...]" if is_many else f"[{name}]")
            elif action.nargs not in ("*", "?") or name in names:
                shown.append(f"{name} [{name} ...]" if is_many else name)
        return " ".join(
            [self.prog, *shown, *(with_value(self.options[name]) for name in names if name in self.options)]
        )

    def format_help(self) -> str:
        """Return the help, with the examples at its end."""
        shown = "".join(f"  {example}\n" for example in self.kind.examples)
        return super().format_help() + (f"\nexamples:\n{shown}" if shown else "")

    def error(self, message: str) -> NoReturn:
        """Print the usage of this command and the error."""
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
    if value is None or value is False or value == []:
        return ""
    values = value if isinstance(value, list | tuple) else [value]
    shown = ",".join(f"{one:g}" if isinstance(one, float) else str(one) for one in values)
    return f" (default: {shown})"


def with_value(action: argparse.Action) -> str:
    """Return an argument with its value, as a usage line and the tables of the documents show it."""
    value = str(action.metavar or (f"{{{','.join(map(str, action.choices))}}}" if action.choices else action.dest))
    name = action.option_strings[-1] if action.option_strings else ""
    return " ".join(word for word in (name, "" if action.nargs == 0 else value) if word)


def _for_argparse(one: DeclaredArgument) -> dict[str, Any]:
    """Return an argument as `ArgumentParser.add_argument` takes it."""
    text = (one.help + _default(one.otherwise or one.default)).replace("%", "%%")
    if one.is_flag:
        return {"action": "store_true", "help": text}
    about = {"help": text, "type": one.form.parse, "default": one.default, "choices": one.form.choices}
    if one.metavar:
        about["metavar"] = one.metavar
    if one.is_positional and (one.is_list or one.is_optional):
        about["nargs"] = ("*" if one.is_optional else "+") if one.is_list else "?"
    elif one.is_list:
        about["action"] = "append"
    return {"dest": one.name, **about}


def command_parser(name: str, parser: CommandParser | None = None) -> CommandParser:
    """Return the parser of a command; its arguments are imported, and nothing that carries it out."""
    parser = parser or CommandParser(prog=f"jointfrf {name}")
    module = importlib.import_module(f"jointfrf.workbench.cli.arguments.{name}")
    parser.declare(getattr(module, f"{name.capitalize()}Arguments"))
    return parser


class _Version(argparse.Action):
    """Prints the version, which takes time to find."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version

        print(f"jointfrf {version('jointfrf')}")
        parser.exit()


def top_parser() -> tuple[CommandParser, dict[str, CommandParser]]:
    """Return the parser of `jointfrf` itself, and the parsers of its commands, still without their options."""
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
