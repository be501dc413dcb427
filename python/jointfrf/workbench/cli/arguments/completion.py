"""Arguments of `jointfrf completion`."""

from __future__ import annotations

from jointfrf.workbench.cli.parser import CommandParser, one_of

__all__ = ["add_arguments"]

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
