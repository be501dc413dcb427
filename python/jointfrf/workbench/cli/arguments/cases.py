"""Arguments of `jointfrf cases`."""

from jointfrf.workbench.cli.arguments.declaration import Arguments, flag

__all__ = ["CasesArguments"]


class CasesArguments(Arguments):
    """Arguments of the command."""

    description = "List the cases that come with jointfrf."
    examples = ("jointfrf cases",)

    keys: bool = flag("print all keys of case.toml and expected.toml (Markdown) instead")
