"""Fortran in free form: statements with their lines, comments, lists."""

from __future__ import annotations

import pathlib
import re
from dataclasses import dataclass


class ConventionError(Exception):
    """A place of a source that does not follow the conventions, and what to write there."""

    def __init__(self, file: str, line: int, message: str) -> None:
        super().__init__(f"{file}:{line}: {message}")


@dataclass(frozen=True)
class Statement:
    """One statement, or one comment, preprocessor or empty line, whose `text` is empty.

    `line` is the number of its first line, counted from 1; `raw` are its lines as they stand in the file.
    """

    line: int
    text: str
    raw: tuple[str, ...]


@dataclass(frozen=True)
class Source:
    """The lines of one file."""

    file: str
    lines: tuple[str, ...]

    @classmethod
    def read(cls, path: pathlib.Path) -> Source:
        """Read a file."""
        return cls(path.name, tuple(path.read_text(encoding="utf-8").splitlines()))

    def error(self, line: int, message: str) -> ConventionError:
        """Return the error for a line, counted from 1."""
        return ConventionError(self.file, line, message)

    def statements(self) -> list[Statement]:
        """Join lines that are continued."""
        found = []
        first = 0
        while first < len(self.lines):
            last = first
            parts = [_code(self.lines[first])]
            while parts[-1].endswith("&"):
                last += 1
                if last == len(self.lines):
                    raise self.error(first + 1, "the file ends within this statement")
                if self.lines[last].startswith("#"):
                    raise self.error(last + 1, "no preprocessor line may stand within a statement")
                parts += [code.removeprefix("&") for code in [_code(self.lines[last])] if code]
            text = " ".join(part.removesuffix("&").strip() for part in parts)
            found.append(Statement(first + 1, text, self.lines[first : last + 1]))
            first = last + 1
        return found

    def comment_above(self, line: int) -> list[tuple[int, str]]:
        """Return the block of `!>` lines that ends above a line, each with its number and without `!> `."""
        block: list[tuple[int, str]] = []
        while line > 1 and self.lines[line - 2].lstrip().startswith("!>"):
            line -= 1
            block.insert(0, (line, re.sub(r"^\s*!> ?", "", self.lines[line - 1]).rstrip()))
        return block


def _code(line: str) -> str:
    """Return a line without comment and surrounding blanks; nothing of a preprocessor line."""
    if line.startswith("#"):
        return ""
    quote = ""
    for i, character in enumerate(line):
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        elif character == "!":
            return line[:i].strip()
    return line.strip()


def split_list(text: str) -> list[str]:
    """Split at commas that stand outside parentheses."""
    items, depth = [""], 0
    for character in text:
        depth += (character == "(") - (character == ")")
        if character == "," and depth == 0:
            items.append("")
        else:
            items[-1] += character
    return [item.strip() for item in items if item.strip()]


def wrap_list(
    start: str, items: list[str], end: str, indent: int | None = None, separator: str = ", ", width: int = 120
) -> list[str]:
    """Write a statement whose list may need several lines, each continued by `&`.

    `indent` is that of the lines that follow; without it, they begin below the first item.
    """
    blanks = " " * (len(start) if indent is None else indent)
    lines = [start]
    for i, item in enumerate(items):
        word = item + (separator if i < len(items) - 1 else end)
        if len(lines[-1]) + len(word.rstrip()) + 2 > width and lines[-1].strip():
            lines[-1] = lines[-1].rstrip() + " &"
            lines.append(blanks)
        lines[-1] += word
    return [line.rstrip() for line in lines]
