"""`jointfrf completion`: a script for a shell that completes commands and options."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointfrf.cli.parser import COMMANDS, CommandParser, command_parser, one_of, top_parser
from jointfrf.cli.usage import Output
from jointfrf.extras import import_extra

__all__ = ["add_arguments", "run"]

#: Shells that argcomplete writes for.
_SHELLS = ("bash", "zsh", "fish")


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Print a script that completes commands, options, their values and files. bash: write it to "
        "~/.local/share/bash-completion/completions/jointfrf; zsh: to _jointfrf in a folder of $fpath; fish: to "
        "~/.config/fish/completions/jointfrf.fish."
    )
    parser.examples.append("jointfrf completion bash > jointfrf.bash")
    parser.add_argument("shell", metavar="SHELL", choices=_SHELLS, type=one_of(_SHELLS), help="shell of the script")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    shtab = import_extra("shtab")
    parser, commands = top_parser()
    for name, command in commands.items():
        for argument in command_parser(name, command).arguments:
            if argument.type is Path or argument.metavar == "FILE":
                argument.complete = shtab.FILE  # type: ignore[attr-defined]
        command.description = COMMANDS[name]  # a short one
    script = shtab.complete(parser, shell=args.shell)
    out = Output(args)
    out.say(script)
    out.give({"shell": args.shell, "script": script})
    return 0
