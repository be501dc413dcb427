"""`jointfrf new`: the files of a case, or of an assembly, to begin with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from jointfrf.choices import CASE_KINDS
from jointfrf.files import OwnFolder
from jointfrf.toml.documents import key_template, schema_of
from jointfrf.workbench.assembly_file.keys import AssemblyKeys, PartsKeys
from jointfrf.workbench.assembly_file.template import TEMPLATE
from jointfrf.workbench.cases.catalogue import kind_named
from jointfrf.workbench.cli.arguments.new import ASSEMBLY, STUDY, NewArguments
from jointfrf.workbench.cli.usage import Output, UsageError

__all__ = ["run"]


def run(args: NewArguments) -> int:
    """Carry out the command."""
    is_case, is_study = args.kind != ASSEMBLY, args.kind == STUDY
    name = "case" if is_case else "assembly"
    top = kind_named(args.kind if args.kind in CASE_KINDS else CASE_KINDS[0]).keys
    keys = schema_of(top) if is_case else _of_either(schema_of(AssemblyKeys), schema_of(PartsKeys))
    schema = json.dumps(keys, indent=1) + "\n"
    if args.schema:
        print(schema, end="")  # for a file, whatever else is asked for
        return 0
    folder = args.folder or Path(f"my-{args.kind}")
    path, beside = folder / f"{name}.toml", folder / f"{name}.schema.json"
    if path.exists() or path.is_symlink():
        raise UsageError(f"{path} exists; name another folder")
    text = TEMPLATE
    if is_case:
        design = {"study": {"realisations": 20, "factors": {"noise": [0.01, 0.05], "lines": [50, 200]}}}
        text = key_template(top, f"#:schema ./{beside.name}", {**top.examples, **(design if is_study else {})})
    own = OwnFolder(folder).make()
    own.write(beside.name, schema)
    own.write(path.name, text)
    following = f"{'study' if is_study else 'run'} {folder}" if is_case else f"identify TEST.uff --model {path}"
    out = Output(args)
    out.say(f"wrote {path} and {beside}; edit it, then: jointfrf {following}")
    out.give({name: str(path), "schema": str(beside), "command": f"jointfrf {following}"})
    return 0


def _of_either(*schemas: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of files of several forms."""
    defined = {name: one for schema in schemas for name, one in schema["$defs"].items()}
    return {"$schema": schemas[0]["$schema"], "anyOf": [{"$ref": one["$ref"]} for one in schemas], "$defs": defined}
