"""The tables of the formats of files of FRFs and of matrices, from the formats themselves.

python tests/python/support/format_table.py docs/files.md    writes it into the page
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from jointfrf.extras import extra_of
from jointfrf.io.formats import FORMATS
from jointfrf.workbench.fe.matrix_formats import MATRIX_FORMATS

_PLACE = re.compile(r"(<!-- (formats|matrices) -->\n).*?(<!-- end -->\n)", re.DOTALL)


def format_table() -> str:
    """Return one row for each format."""
    rows = [
        f"| {each.name} ({', '.join(each.suffixes)}): {each.content} | "
        f"{f'`{each.write.__name__}`' if each.write else ''} | {each.needs} |"
        for each in FORMATS
    ]
    return "\n".join(["| read | written by `write_frfs`, or | needs |", "|---|---|---|", *rows]) + "\n"


def matrix_table() -> str:
    """Return one row for each format of matrices."""
    rows = [
        f"| {each.name} ({', '.join(each.suffixes)}) | {each.content} | "
        f"{f'`jointfrf[{extra_of(each.needs)}]`' if each.needs else ''} |"
        for each in MATRIX_FORMATS
    ]
    return "\n".join(["| format | what is read | needs |", "|---|---|---|", *rows]) + "\n"


def filled(page: str) -> str:
    """Return a page with its tables as they are now."""
    tables = {"formats": format_table, "matrices": matrix_table}
    return _PLACE.sub(lambda match: match[1] + tables[match[2]]() + match[3], page)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")
