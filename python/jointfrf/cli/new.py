"""`jointfrf new`: the files of a case to begin with."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from jointfrf.cases.catalogue import KINDS
from jointfrf.cli.usage import Output, UsageError
from jointfrf.files import write_file
from jointfrf.toml.documents import key_template, schema_of

__all__ = ["add_arguments", "run"]

#: Name of the schema beside a new case.
_SCHEMA = "case.schema.json"
#: A case whose file has a design of factors.
_STUDY = "study"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Write the case.toml of a new case, with a comment beside each key, and a JSON Schema with which editors "
        f"complete it. It runs as it is. KIND is {', '.join(KINDS)}, or {_STUDY}: a case with a design of factors."
    )
    parser.add_argument("kind", metavar="KIND", choices=(*KINDS, _STUDY), help="kind of the case")
    parser.add_argument("folder", nargs="?", type=Path, metavar="FOLDER", help="new folder of the case (my-KIND)")
    parser.add_argument("--schema", action="store_true", help="instead: print the JSON Schema of case.toml")


def run(options: argparse.Namespace) -> int:
    """Carry out the command."""
    is_study = options.kind == _STUDY
    top = KINDS[next(iter(KINDS)) if is_study else options.kind].keys
    schema = json.dumps(schema_of(top), indent=1) + "\n"
    if options.schema:
        print(schema, end="")  # for a file, whatever else is asked for
        return 0
    folder = options.folder or Path(f"my-{options.kind}")
    case = folder / "case.toml"
    if case.exists() or case.is_symlink():
        raise UsageError(f"{case} exists: name another folder")
    design = {"study": {"realisations": 20, "factors": {"noise": [0.01, 0.05], "lines": [50, 200]}}}
    examples = {**top.examples, **(design if is_study else {})}
    folder.mkdir(parents=True, exist_ok=True)
    write_file(folder / _SCHEMA, schema)
    write_file(case, key_template(top, f"#:schema ./{_SCHEMA}", examples))
    command = f"jointfrf {'study' if is_study else 'run'} {folder}"
    out = Output(options)
    out.say(f"wrote {case} and {folder / _SCHEMA}; edit it, then: {command}")
    out.give({"case": str(case), "schema": str(folder / _SCHEMA), "command": command})
    return 0
