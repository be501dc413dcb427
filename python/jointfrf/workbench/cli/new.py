"""`jointfrf new`: the files of a case, or of an assembly, to begin with."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from jointfrf.choices import CASE_KINDS
from jointfrf.files import OwnFolder
from jointfrf.toml.documents import key_template, schema_of
from jointfrf.workbench.assembly_file.keys import AssemblyKeys, PartsKeys
from jointfrf.workbench.assembly_file.template import TEMPLATE
from jointfrf.workbench.cases.catalogue import kind_named
from jointfrf.workbench.cli.arguments.new import ASSEMBLY, STUDY
from jointfrf.workbench.cli.usage import Output, UsageError

__all__ = ["run"]

#: Name of the schema beside a new case.
_SCHEMA = "case.schema.json"


def run(options: argparse.Namespace) -> int:
    """Carry out the command."""
    if options.kind == ASSEMBLY:
        return _new_assembly(options)
    is_study = options.kind == STUDY
    top = kind_named(CASE_KINDS[0] if is_study else options.kind).keys
    schema = json.dumps(schema_of(top), indent=1) + "\n"
    if options.schema:
        print(schema, end="")  # for a file, whatever else is asked for
        return 0
    folder = options.folder or Path(f"my-{options.kind}")
    case = folder / "case.toml"
    if case.exists() or case.is_symlink():
        raise UsageError(f"{case} exists; name another folder")
    design = {"study": {"realisations": 20, "factors": {"noise": [0.01, 0.05], "lines": [50, 200]}}}
    examples = {**top.examples, **(design if is_study else {})}
    own = OwnFolder(folder).make()
    own.write(_SCHEMA, schema)
    own.write(case.name, key_template(top, f"#:schema ./{_SCHEMA}", examples))
    command = f"jointfrf {'study' if is_study else 'run'} {folder}"
    out = Output(options)
    out.say(f"wrote {case} and {folder / _SCHEMA}; edit it, then: {command}")
    out.give({"case": str(case), "schema": str(folder / _SCHEMA), "command": command})
    return 0


def _new_assembly(options: argparse.Namespace) -> int:
    schema = json.dumps(_of_either(schema_of(AssemblyKeys), schema_of(PartsKeys)), indent=1) + "\n"
    if options.schema:
        print(schema, end="")
        return 0
    folder = options.folder or Path("my-assembly")
    path, beside = folder / "assembly.toml", folder / "assembly.schema.json"
    if path.exists() or path.is_symlink():
        raise UsageError(f"{path} exists; name another folder")
    own = OwnFolder(folder).make()
    own.write(beside.name, schema)
    own.write(path.name, TEMPLATE)
    command = f"jointfrf identify TEST.uff --model {path}"
    out = Output(options)
    out.say(f"wrote {path} and {beside}; edit it, then: {command}")
    out.give({"assembly": str(path), "schema": str(beside), "command": command})
    return 0


def _of_either(*schemas: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of files of several forms."""
    defined = {name: one for schema in schemas for name, one in schema["$defs"].items()}
    return {"$schema": schemas[0]["$schema"], "anyOf": [{"$ref": one["$ref"]} for one in schemas], "$defs": defined}
