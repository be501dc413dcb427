"""Arguments of `jointfrf new`."""

from pathlib import Path
from typing import Annotated

from jointfrf.choices import CASE_KINDS
from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, flag, one_of, positional

__all__ = ["ASSEMBLY", "STUDY", "NewArguments"]

#: A case whose file has a design of factors.
STUDY = "study"
#: No case: what `jointfrf identify --model` reads.
ASSEMBLY = "assembly"
_KINDS = (*CASE_KINDS, STUDY, ASSEMBLY)


class NewArguments(Arguments):
    """Arguments of the command."""

    description = (
        "Write the case.toml of a new case, with a comment for each key, and a JSON Schema for editors. The case runs "
        f"unchanged. KIND is {', '.join(CASE_KINDS)}, or {STUDY}: a case with a design of factors; or {ASSEMBLY}: an "
        "assembly.toml for identify --model."
    )
    examples = ("jointfrf new known-joint my-case",)

    kind: Annotated[str, Form("KIND", one_of(_KINDS), choices=_KINDS)] = positional("kind of the case", "KIND")
    folder: Path | None = positional("new folder of the case (default: my-KIND)", "FOLDER", optional=True)
    schema: bool = flag("print the JSON Schema of case.toml instead")
