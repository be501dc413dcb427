"""Writes what a study prints into the page that shows it: `tests/accuracy/run --write STUDY [OPTION...]`.

A study is one of `tests/accuracy/run`, or `run-NAME` of `tests/benchmarks`. A page has the command of its table before
it, `<!-- table: pools --draws 500 -->`, or `<!-- table 2 of: plans -->` for the second that is printed, and
`<!-- /table -->` after it. Tables of several commands, or beside those of an older version, have none: they were put
together.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
PAGES = tuple(HERE.parents[1] / "docs" / name for name in ("accuracy.md", "benchmarks.md", "checks.md"))
_MARKED = re.compile(r"<!-- table(?: (\d+) of)?: (.+?) -->\n(.*?)\n<!-- /table -->", re.DOTALL)


class Marked(NamedTuple):
    """A table of a page: its place, which of those that the command prints, the command, the table."""

    span: tuple[int, int]
    number: int
    words: str
    table: str


def marked(text: str) -> Iterator[Marked]:
    """Yield the tables of a page that have a command."""
    for one in _MARKED.finditer(text):
        yield Marked(one.span(3), int(one[1] or 1), one[2], one[3])


def tables_printed(text: str) -> list[str]:
    """Return the tables among the lines that a study prints."""
    return [one.group().rstrip("\n") for one in re.finditer(r"^\|.*\n\|[-|]+\|\n(?:\|.*\n)+", text, re.MULTILINE)]


def written(page: str, words: str, tables: list[str]) -> str:
    """Return a page with the tables that a command has printed."""
    for one in reversed([one for one in marked(page) if one.words == words]):
        if one.number > len(tables):
            raise SystemExit(f"{words}: prints {len(tables)} tables, not the {one.number} of the page")
        page = page[: one.span[0]] + tables[one.number - 1] + page[one.span[1] :]
    return page


def main() -> None:
    """Run a study, and write its tables."""
    words = " ".join(sys.argv[1:])
    known = sorted({one.words for path in PAGES for one in marked(path.read_text(encoding="utf-8"))})
    if words not in known:
        raise SystemExit(f"no table is of {words!r}; tables are of:\n  " + "\n  ".join(known))
    lines = []
    study, *options = sys.argv[1:]
    command = [HERE.parent / "benchmarks" / study] if study.startswith("run-") else [HERE / "run", study]
    with subprocess.Popen([*command, *options], stdout=subprocess.PIPE, text=True) as running:
        for line in running.stdout or ():
            print(line, end="", flush=True)
            lines.append(line)
    if running.returncode:
        raise SystemExit(running.returncode)
    for path in PAGES:
        text = path.read_text(encoding="utf-8")
        path.write_text(written(text, words, tables_printed("".join(lines))), encoding="utf-8")


if __name__ == "__main__":
    main()
