"""`jointfrf completion`: a script for a shell that completes commands and options."""

from __future__ import annotations

import argparse

from jointfrf.cli.output import Output
from jointfrf.cli.parser import COMMANDS, top_parser
from jointfrf.extras import import_extra

__all__ = ["add_arguments", "run"]

_SHELLS = ("bash", "zsh", "fish")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Print a script that completes commands, options, their values and files. bash: jointfrf completion bash > "
        "~/.local/share/bash-completion/completions/jointfrf; zsh: jointfrf completion zsh > _jointfrf in a folder of "
        "$fpath; fish: jointfrf completion fish > ~/.config/fish/completions/jointfrf.fish."
    )
    parser.add_argument("shell", choices=_SHELLS, help="the shell")


def run(args: argparse.Namespace) -> int:
    """Carry out the command."""
    shtab = import_extra("shtab")
    parser = top_parser(whole=COMMANDS)
    _complete_files(parser, shtab.FILE)
    script = shtab.complete(parser, shell=args.shell)
    out = Output(args)
    out.say(script)
    out.give({"shell": args.shell, "script": script})
    return 0


def _complete_files(parser: argparse.ArgumentParser, files: object) -> None:
    """Say which options and arguments take files."""
    from pathlib import Path

    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, command in action.choices.items():
                command.description = COMMANDS[name]  # a short one
                _complete_files(command, files)
        elif action.type is Path or action.metavar == "FILE":
            action.complete = files  # type: ignore[attr-defined]
