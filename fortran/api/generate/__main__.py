"""The command that the build runs: one output from api.F90."""

from __future__ import annotations

import argparse
import pathlib
import re
import sys
from collections.abc import Sequence

from generate import c_header, include_file, reference, signatures, symbols, work_forms
from generate.reader import read_api
from generate.routines import Api
from generate.source import ConventionError, Source


def fill(template: str, values: dict[str, str]) -> str:
    """Replace each `@name@` of a template."""
    return re.sub(r"@(\w+)@", lambda found: values[found[1]], template)


def write(path: pathlib.Path, text: str) -> None:
    """Write a file, unless it is there with this text: what depends on it is then not built again."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def generate(api: Api, options: argparse.Namespace) -> None:
    """Write what is asked for."""
    if options.what == "names":
        print(*(routine.name for routine in api.routines))
    elif options.what == "reference":
        for name, text in reference.write(api, options.version).items():
            write(options.output / name, text)
    elif options.what == "work":
        write(options.output, work_forms.write(api))
    elif options.what == "signatures":
        write(options.output, signatures.write(api))
    elif options.what == "symbols":
        write(options.output, symbols.write(api))
    else:
        header = options.what == "header"
        values = c_header.values(api) if header else include_file.values(api, options.integer_bytes)
        write(options.output, fill(options.template.read_text(encoding="utf-8"), values))


def main(arguments: Sequence[str]) -> int:
    """Run the command; 1 and one sentence where a source does not follow the conventions."""
    parser = argparse.ArgumentParser(prog="generate")
    parser.add_argument("what", choices=["header", "include", "work", "signatures", "symbols", "reference", "names"])
    parser.add_argument("--template", type=pathlib.Path, help="of header or include file")
    parser.add_argument("--integer-bytes", type=int, choices=[4, 8], default=4, help="for the include file")
    parser.add_argument("--version", default="", help="for the reference")
    parser.add_argument("--output", type=pathlib.Path, help="file, or folder of the reference")
    parser.add_argument("sources", nargs="+", type=pathlib.Path, help="api.F90, then those that declare values")
    options = parser.parse_args(arguments)
    first, *others = map(Source.read, options.sources)
    try:
        generate(read_api(first, others), options)
    except ConventionError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
