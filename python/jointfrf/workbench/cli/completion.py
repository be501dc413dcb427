"""`jointfrf completion`: a script for a shell that completes commands and options."""

from __future__ import annotations

from pathlib import Path

from jointfrf.extras import import_extra
from jointfrf.workbench.cli.arguments.completion import CompletionArguments
from jointfrf.workbench.cli.parser import COMMANDS, command_parser, top_parser
from jointfrf.workbench.cli.usage import Output

__all__ = ["run"]


def run(args: CompletionArguments) -> int:
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
