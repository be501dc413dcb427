"""`jointfrf cases`: the cases that come with the package."""

from __future__ import annotations

from jointfrf.workbench.cases.catalogue import case_title, key_page, list_cases
from jointfrf.workbench.cli.arguments.cases import CasesArguments
from jointfrf.workbench.cli.usage import Output

__all__ = ["run"]


def run(options: CasesArguments) -> int:
    """Carry out the command."""
    if options.keys:
        print(key_page(), end="")  # a page for a file, whatever else is asked for
        return 0
    out = Output(options)
    found = {folder: case_title(folder) for folder in list_cases()}
    width = max((len(folder.name) for folder in found), default=0)
    out.say(*(f"{folder.name.ljust(width)}  {title}" for folder, title in found.items()))
    out.give({"cases": [{"name": folder.name, "title": title, "folder": str(folder.resolve())}
                        for folder, title in found.items()]})  # fmt: skip
    return 0
