"""Write the outputs that a page shows anew: python tests/python/support/shown_outputs.py docs/quickstart.md...

Lines are broken to fit the site; numbers of more than nine digits are rounded to five. Of an output with lines `...`
each part is found by the line most like its first one, with as many lines as before.
"""

import re
import sys
import tempfile
import textwrap
from difflib import SequenceMatcher
from pathlib import Path

from documents import follow

WIDTH = 82


def as_shown(printed: str) -> str:
    """Return an output as a page shows it."""
    rounded = re.sub(r"\b\d\.\d{9,}E[+-]\d\d", lambda found: f"{float(found[0]):.4E}", printed)
    lines = []
    for line in rounded.rstrip().splitlines():
        indent = " " * (len(line) - len(line.lstrip()))
        sentence = len(line) > WIDTH and "  " not in line.strip() and set(line) != {"-"}
        broken = textwrap.wrap(line, WIDTH, subsequent_indent=indent + "    ", break_on_hyphens=False)
        lines += broken if sentence else [line.rstrip()]
    return "".join(line + "\n" for line in lines)


def shortened(printed: str, before: str) -> str:
    """Return the parts of an output between lines `...` that a page showed before."""
    lines, text, at = printed.splitlines(), [], 0
    for part in re.split(r"^(\.\.\.)\n", before, flags=re.MULTILINE):
        if part != "..." and part.strip():
            blank = len(part) - len(part.lstrip("\n"))
            first = part.lstrip("\n").partition("\n")[0]
            at += max(range(len(lines) - at), key=lambda i: SequenceMatcher(None, lines[at:][i], first).ratio()) - blank
            wanted = part.count("\n")
            text += lines[at : at + wanted]
            at += wanted
        elif part:
            text.append(part)
    return "".join(line + "\n" for line in text)


def renewed(page: str) -> str:
    """Do the steps of a page, and return the page with their outputs."""
    at = 0
    with tempfile.TemporaryDirectory() as folder:
        for step, printed in follow(page, Path(folder)):
            at = page.index(step.code, at) + len(step.code)
            if step.shown is not None:
                at = page.index(step.shown, at)
                shown = shortened(as_shown(printed), step.shown) if "...\n" in step.shown else as_shown(printed)
                page = page[:at] + shown + page[at + len(step.shown) :]
                at += len(shown)
    return page


if __name__ == "__main__":
    for path in map(Path, sys.argv[1:]):
        path.write_text(renewed(path.read_text(encoding="utf-8")), encoding="utf-8")
