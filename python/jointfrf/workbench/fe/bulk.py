"""Bulk data of Nastran: cards in small, large and free fields."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from jointfrf.errors import FileContentError
from jointfrf.files import text_of

__all__ = ["bulk_cards", "bulk_number", "is_bulk"]

#: Columns of a field, and of the first one; fields of a line between name and continuation.
_SMALL, _LARGE, _FIRST = 8, 16, 8
_FIELDS = {_SMALL: 8, _LARGE: 4}


def bulk_cards(path: Path, names: Collection[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield the cards of some names with their fields, continuations included.

    Parameters
    ----------
    path : Path
    names : collection of str
        Capital letters.

    Yields
    ------
    name : str
    fields : list of str
        Without blanks around; empty ones stay.
    """
    name, fields = "", list[str]()
    for line in text_of(path).splitlines():
        text = line.partition("$")[0].rstrip()
        if not text:
            continue
        head, found = _fields_of(text)
        if head in ("", "+", "*") or head[:1] in "+*":
            if name:
                fields += found
            continue
        if name:
            yield name, fields
        name, fields = (head, found) if head in names else ("", [])
    if name:
        yield name, fields


def _fields_of(text: str) -> tuple[str, list[str]]:
    """Return the name of a line, and its fields."""
    if "," in text:
        head, *rest = (word.strip() for word in text.split(","))
        name = head.upper().removesuffix("*")
        return name, (rest + [""] * 8)[:8]
    head = text[:_FIRST].strip().upper()
    is_large = "*" in head
    width = _LARGE if is_large else _SMALL
    count = _FIELDS[width]
    padded = text.ljust(_FIRST + width * count)
    name = head.removesuffix("*").strip() if not head.startswith(("*", "+")) else ""
    return name, [padded[_FIRST + i * width : _FIRST + (i + 1) * width].strip() for i in range(count)]


def bulk_number(word: str, path: Path) -> float:
    """Return a number as Nastran writes it: ``1.5-3`` and ``1.5D-3`` are 0.0015.

    Raises
    ------
    FileContentError
        It is none.
    """
    text = word.upper().replace("D", "E")
    if "E" not in text:
        at = max(text.rfind("-"), text.rfind("+"))
        if at > 0:
            text = f"{text[:at]}E{text[at:]}"
    try:
        return float(text)
    except ValueError:
        raise FileContentError(f"{path} cannot be read as bulk data of Nastran: {word[:20]!r} is no number") from None


def is_bulk(head: bytes) -> bool:
    """Return whether a file begins like bulk data."""
    words = ("GRID", "DMIG", "EXTRN", "SPOINT", "CORD2R", "BEGIN BULK", "BEGIN SUPER", "SEBULK", "ASET")
    lines = head.decode("latin-1").upper().splitlines()
    return any(line.startswith(words) for line in lines)
