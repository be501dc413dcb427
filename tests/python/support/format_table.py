"""The table of the formats of files of FRFs, from the formats themselves.

python tests/python/support/format_table.py docs/files.md    writes it into the page
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from jointfrf.io.formats import FORMATS

_PLACE = re.compile(r"(<!-- formats -->\n).*?(<!-- end -->\n)", re.DOTALL)


def format_table() -> str:
    """Return one row for each format."""
    rows = [
        f"| {each.name} ({', '.join(each.suffixes)}): {each.content} | "
        f"{f'`{each.write.__name__}`' if each.write else ''} | {each.needs} |"
        for each in FORMATS
    ]
    return "\n".join(["| read | written by `write_frfs`, or | needs |", "|---|---|---|", *rows]) + "\n"


def filled(page: str) -> str:
    """Return a page with its table as it is now."""
    return _PLACE.sub(lambda match: match[1] + format_table() + match[2], page)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")
