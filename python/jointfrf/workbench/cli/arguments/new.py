"""Arguments of `jointfrf new`."""

from __future__ import annotations

from pathlib import Path

from jointfrf.choices import CASE_KINDS
from jointfrf.workbench.cli.parser import CommandParser, one_of

__all__ = ["ASSEMBLY", "STUDY", "add_arguments"]

#: A case whose file has a design of factors.
STUDY = "study"
#: No case: what `jointfrf identify --model` reads.
ASSEMBLY = "assembly"


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Write the case.toml of a new case, with a comment for each key, and a JSON Schema for editors. The case runs "
        f"unchanged. KIND is {', '.join(CASE_KINDS)}, or {STUDY}: a case with a design of factors; or {ASSEMBLY}: an "
        "assembly.toml for identify --model."
    )
    parser.examples.append("jointfrf new known-joint my-case")
    kinds = (*CASE_KINDS, STUDY, ASSEMBLY)
    parser.add_argument("kind", metavar="KIND", choices=kinds, type=one_of(kinds), help="kind of the case")
    parser.add_argument(
        "folder", nargs="?", type=Path, metavar="FOLDER", help="new folder of the case (default: my-KIND)"
    )
    parser.option("--schema", "print the JSON Schema of case.toml instead")
