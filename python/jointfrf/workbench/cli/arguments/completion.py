"""Arguments of `jointfrf completion`."""

from typing import Literal

from jointfrf.workbench.cli.arguments.declaration import Arguments, positional

__all__ = ["CompletionArguments"]


class CompletionArguments(Arguments):
    """Arguments of the command."""

    description = (
        "Print a script that completes commands, options, their values and files. bash: write it to "
        "~/.local/share/bash-completion/completions/jointfrf; zsh: to _jointfrf in a folder of $fpath; fish: to "
        "~/.config/fish/completions/jointfrf.fish."
    )
    examples = ("jointfrf completion bash > jointfrf.bash",)

    shell: Literal["bash", "zsh", "fish"] = positional("shell of the script", "SHELL")
