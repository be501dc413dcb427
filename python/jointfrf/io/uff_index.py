"""Where the datasets of a Universal File begin and end, found without holding the file in memory."""

from __future__ import annotations

import re
from pathlib import Path
from typing import BinaryIO, NamedTuple

__all__ = ["Dataset", "index_datasets"]

_DELIMITER = re.compile(rb"(?<![^\r\n])    -1(?=[\r\n]|\Z| {74})")
#: After binary numbers no line need end.
_AFTER_NUMBERS = re.compile(rb"\s{0,4}?    -1(?=[\r\n]|\Z| {74})")
_REACH = 96
_CHUNK = 1 << 22
#: The first two lines of a dataset and the text before binary numbers take no more than this.
_HEAD = 1 << 13
#: Bytes of a value by the data type of record 7, and of the abscissa before it where the spacing is uneven.
_VALUE_BYTES = {2: 4, 4: 8, 5: 8, 6: 16}
_ABSCISSA_BYTES = 4


class Dataset(NamedTuple):
    """First byte of the opening delimiter, first byte of the closing one, and the type; 0 where it has none."""

    start: int
    end: int
    kind: int


def index_datasets(path: Path) -> tuple[list[Dataset], bool]:
    """Find the datasets of a file.

    Parameters
    ----------
    path : Path
        A file, read in chunks; binary numbers are skipped by their stated length where a delimiter follows them.

    Returns
    -------
    list of Dataset
        Empty where there is no delimiter.
    bool
        Whether the file ends inside a dataset.
    """
    with path.open("rb") as file:
        window = _Window(file)
        found: list[Dataset] = []
        start = window.find(0)
        while start is not None:
            end = window.after_binary(start) or window.find(start + 6)
            if end is None:
                return found, True
            found.append(Dataset(start, end, _kind(window.part(start, _HEAD))))
            start = window.find(end + 6)
        return found, False


class _Window:
    """A part of a file, moved along."""

    def __init__(self, file: BinaryIO) -> None:
        self.file, self.start, self.content = file, 0, b""

    def part(self, position: int, count: int) -> bytes:
        """Return some bytes of the file; fewer at its end."""
        place = position - self.start
        if place < 0 or place + count > len(self.content):
            self._move(position)
            place = 0
        return self.content[place : place + count]

    def find(self, position: int) -> int | None:
        """Return the place of the next delimiter."""
        while True:
            before = max(position - 1, 0)  # whether a line begins
            if not self.start <= before < self.start + len(self.content):
                self._move(before)
            match = self._search(position - self.start)
            is_last = len(self.content) < _CHUNK
            if match is not None and (is_last or match.end() + _REACH <= len(self.content)):
                return self.start + match.start()
            if is_last:
                return None
            # Once more from where the window may cut a delimiter.
            end = self.start + len(self.content)
            position = max(position, end - _REACH) if match is None else self.start + match.start()
            self._move(max(position - 1, 0))

    def _search(self, place: int) -> re.Match[bytes] | None:
        """Return the first delimiter in the window; looking for its six bytes first is ten times as fast."""
        while (place := self.content.find(b"    -1", place)) >= 0:
            if match := _DELIMITER.match(self.content, place):
                return match
            place += 1
        return None

    def after_binary(self, start: int) -> int | None:
        """Return the place of the delimiter after the binary numbers of a dataset 58b, by their length.

        The one that is stated, or, where no delimiter follows there, the one that record 7 gives: some programs state
        another.
        """
        head = self.part(start, _HEAD)
        lines = head.split(b"\n", 13)
        if len(lines) < 14 or lines[1][6:7].lower() != b"b":
            return None
        try:
            n_lines, n_bytes = int(lines[1][19:31]), int(lines[1][31:43])
        except ValueError:
            return None
        if n_lines != 11 or n_bytes < 0:
            return None
        numbers = start + sum(len(line) + 1 for line in lines[:13])
        for length in (n_bytes, _length_of_values(lines[8])):
            match = _AFTER_NUMBERS.match(self.part(numbers + length, _REACH))
            if match is not None:
                return numbers + length + match.end() - 6
        return None

    def _move(self, position: int) -> None:
        self.file.seek(position)
        self.start, self.content = position, self.file.read(_CHUNK)


def _length_of_values(record: bytes) -> int:
    """Return how many bytes the values take that record 7 describes; 0 where it does not say."""
    try:
        kind, count, is_even = int(record[:10]), int(record[10:20]), int(record[20:30])
    except ValueError:
        return 0
    size = _VALUE_BYTES.get(kind, 0)
    return max(count, 0) * (size + (0 if is_even else _ABSCISSA_BYTES))


def _kind(head: bytes) -> int:
    try:
        return int(head.splitlines()[1][:6])
    except (ValueError, IndexError):
        return 0
