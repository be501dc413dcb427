"""README and docs: their texts, the steps that they show, and whether what is printed agrees with what they show."""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from decimal import Decimal
from itertools import groupby
from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[3]
PAGES = ("*.md", "docs/*.md", "cases/*/README.md", "fortran/README.md", "python/packaging/README.md")
DOCUMENTS = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in sorted([path for pattern in PAGES for path in ROOT.glob(pattern)])
}
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


def blocks(language: str, text: str) -> list[str]:
    """Blocks of a language that run; those whose first line says that they are fragments are left out."""
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


class Step(NamedTuple):
    """What a reader of a page does: commands of a shell or Python, and what the page shows of the output."""

    language: str
    code: str
    shown: str | None = None


def commands_shown(block: str) -> Iterator[Step]:
    """Yield the commands of a block, which have a prompt, each with the lines up to the next prompt."""
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, shown = re.match(r"((?:[^\n]*\\\n)*[^\n]*\n?)(.*)", part, re.DOTALL).groups()
        yield Step("sh", command, shown)


def steps(page: str) -> list[Step]:
    """Return all steps of a page in their order: blocks that are no fragments, and commands on cases in tables."""
    found: list[Step] = []
    pattern = r"^ *```(\w+)\n(.*?)^ *```|^\|[^\n]*?`(jointfrf [^`\n]*cases/[^`\n]+)`"
    for language, indented, command in re.findall(pattern, page, re.DOTALL | re.MULTILINE):
        block = dedent(indented)
        if command:
            found.append(Step("sh", command))
        elif block.startswith("$ "):
            found += commands_shown(block)
        elif language == "text":
            assert found, "a page begins with an output"
            assert found[-1].shown is None, f"an output that belongs to no step: {block}"
            found[-1] = found[-1]._replace(shown=block)
        else:
            found.append(Step(language, block))
    return found


def follow(page: str, folder: Path) -> Iterator[tuple[Step, str]]:
    """Do the steps of a page in a folder that has the cases, as a reader does; yield each with its output."""
    (folder / "cases").symlink_to(ROOT / "cases")
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    named = {"__name__": "__main__"}
    for step in steps(page):
        with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()) as printed:
            if step.language == "python":
                exec(step.code, named)
            else:
                assert step.language == "sh", f"a block of {step.language} is no step"
                command = ["sh", "-ec", step.code]
                done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
                assert done.returncode == 0, f"{step.code}: {done.stderr}"
                print(done.stdout, end="")
        yield step, printed.getvalue()


def same_word(printed: str, shown: str) -> bool:
    """Whether a word is printed as shown; its number may have more digits, and is then rounded to those shown."""
    if printed == shown:
        return True
    numbers = [(Decimal(a), Decimal(b)) for a, b in zip(_NUMBER.findall(printed), _NUMBER.findall(shown), strict=False)]
    rounded = all(abs(a - b) <= Decimal(1).scaleb(int(b.as_tuple().exponent)) / 2 for a, b in numbers)
    return bool(numbers) and rounded and _NUMBER.sub("0", printed) == _NUMBER.sub("0", shown)


def _words(text: str) -> list[str]:
    return [word for word in text.split() if set(word) != {"-"}]


def agree(printed: str, shown: str) -> None:
    """All words agree with those shown, but for rules of dashes; a line `...` stands for any lines.

    Numbers agree to the last digit that is shown: a page rounds those whose last digits depend on the processor.
    """
    found, at, anchored = _words(printed), 0, True
    for left_out, lines in groupby(shown.splitlines(), lambda line: line.strip() == "..."):
        if left_out:
            anchored = False
            continue
        wanted = _words("\n".join(lines))
        places = [at] if anchored else range(at, len(found) - len(wanted) + 1)
        begin = next((i for i in places if _same(found[i : i + len(wanted)], wanted)), None)
        assert begin is not None, f"not printed: {_first_difference(found[at:], wanted)}\n{printed}"
        at, anchored = begin + len(wanted), True
    assert at == len(found) or not anchored, f"printed, but not shown: {' '.join(found[at:])}"


def _same(found: list[str], wanted: list[str]) -> bool:
    return len(found) == len(wanted) and all(map(same_word, found, wanted))


def _first_difference(found: list[str], wanted: list[str]) -> str:
    i = next((i for i, pair in enumerate(zip(found, wanted, strict=False)) if not same_word(*pair)), len(found))
    return f"{' '.join(wanted[max(i - 4, 0) : i + 5])!r}, but {' '.join(found[max(i - 4, 0) : i + 5])!r}"
