"""A Universal File as numbered datasets, indexed without reading the whole file into memory; units."""

from __future__ import annotations

import codecs
import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple

from jointfrf.errors import FileContentError
from jointfrf.files import HEAD
from jointfrf.io.file_format import Reading
from jointfrf.io.uff_function import DamagedNumbersError
from jointfrf.io.units import UnitSystem
from jointfrf.spelling import some_of

__all__ = ["UniversalFile", "index_datasets", "name_some"]

#: The -1 of a delimiter, which blanks may follow up to column 128.
_DELIMITER = re.compile(rb"-1[ \t]{0,122}(?=[\r\n]|\Z)")
#: Largest number of blanks before it; numbers in columns have more.
_INDENT = 5
#: Pattern after binary numbers, where no line need end.
_AFTER_NUMBERS = re.compile(rb"\s{0,4}?( {4}-1)[ \t]{0,122}(?=[\r\n]|\Z)")
#: Bytes that show whether a place is a delimiter: blanks before and behind, line ends.
_REACH = 140
#: Number of bytes of a dataset from its delimiter on that contain its type.
_TYPE = 300
#: Number of bytes of the file in memory: fewer take longer, more do not take less time.
_CHUNK = 1 << 22
#: Bytes of a value by the data type of record 7, and of the abscissa before it if the spacing is uneven.
_VALUE_BYTES = {2: 4, 4: 8, 5: 8, 6: 16}
_ABSCISSA_BYTES = 4


class Dataset(NamedTuple):
    """First byte of the opening delimiter, first byte of the closing one, and the type; 0 if it has none."""

    start: int
    end: int
    kind: int


def index_datasets(path: Path) -> tuple[list[Dataset], bool]:
    """Find the datasets of a file.

    Parameters
    ----------
    path : Path
        Name of a file, read in chunks; binary numbers are skipped by their stated length if a delimiter follows them.

    Returns
    -------
    list of Dataset
        Datasets in the order of the file; empty if there is no delimiter.
    bool
        Whether the file ends inside a dataset.
    """
    with path.open("rb") as file:
        window = _Window(file)
        found: list[Dataset] = []
        opening = window.find(0)
        while opening is not None:
            start = opening[0]
            closing = window.after_binary(start) or window.find(opening[1])
            if closing is None:
                return found, True
            found.append(Dataset(start, closing[0], _kind(window.part(start, HEAD))))
            opening = window.find(closing[1])
        return found, False


class _Window:
    """A part of a file that moves along it."""

    def __init__(self, file: BinaryIO) -> None:
        self.file, self.start, self.content = file, 0, b""

    def part(self, position: int, count: int) -> bytes:
        """Return some bytes of the file; fewer at its end."""
        place = position - self.start
        if place < 0 or place + count > len(self.content):
            self._move(position)
            place = 0
        return self.content[place : place + count]

    def find(self, position: int) -> tuple[int, int] | None:
        """Return begin and end of the line of the next delimiter."""
        while True:
            before = max(position - _INDENT - 1, 0)  # where its line may begin
            if not self.start <= before < self.start + len(self.content):
                self._move(before)
            found = self._search(position - self.start)
            is_last = len(self.content) < _CHUNK
            if found is not None and (is_last or found[1] + _REACH <= len(self.content)):
                return self.start + found[0], self.start + found[1]
            if is_last:
                return None
            # Again from the place at which the window may cut a delimiter.
            end = self.start + len(self.content)
            position = max(position, end - _REACH) if found is None else self.start + found[0]
            self._move(max(position - _INDENT - 1, 0))

    def _search(self, place: int) -> tuple[int, int] | None:
        """Return begin and end of the first delimiter in the window."""
        for match in _DELIMITER.finditer(self.content, place):
            start = match.start()
            indent = self.content[max(start - _INDENT, 0) : start]
            begin = start - len(indent) + len(indent.rstrip(b" \t"))
            is_first = self.start == 0 and begin in (0, 3) and self.content[:begin] in (b"", codecs.BOM_UTF8)
            if is_first or (begin and self.content[begin - 1 : begin] in (b"\r", b"\n")):
                return begin, match.end()
        return None

    def after_binary(self, start: int) -> tuple[int, int] | None:
        """Return begin and end of the delimiter after the binary numbers of a dataset 58b, by their length.

        The stated length is used, or, if no delimiter follows there, the length by record 7: some programs state
        another.
        """
        head = self.part(start, HEAD)
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
                return numbers + length + match.start(1), numbers + length + match.end()
        return None

    def _move(self, position: int) -> None:
        self.file.seek(position)
        self.start, self.content = position, self.file.read(_CHUNK)


def _length_of_values(record: bytes) -> int:
    """Return the number of bytes of the values by record 7; 0 if it does not state them."""
    try:
        kind, count, is_even = int(record[:10]), int(record[10:20]), int(record[20:30])
    except ValueError:
        return 0
    size = _VALUE_BYTES.get(kind, 0)
    return max(count, 0) * (size + (0 if is_even else _ABSCISSA_BYTES))


def _kind(head: bytes) -> int:
    try:
        return int(head[:_TYPE].splitlines()[1][:6])
    except (ValueError, IndexError):
        return 0


#: Number of datasets or nodes that a message names.
_NUMBERS_SHOWN = 5
#: Content of datasets that are not read, for messages.
_DATASETS = {
    15: "nodes", 18: "coordinate systems", 55: "data at nodes", 82: "trace lines", 151: "header", 164: "units",
    1858: "qualifiers of dataset 58", 2400: "model header", 2411: "nodes", 2412: "elements", 2414: "analysis data",
    2420: "coordinate systems", 2429: "groups", 2467: "groups",
}  # fmt: skip
#: Types of functions in dataset 58 that are no FRFs, for messages.
_FUNCTIONS = {
    1: "time history", 2: "auto spectrum", 3: "cross spectrum", 5: "transmissibility", 6: "coherence",
    7: "auto correlation", 8: "cross correlation", 9: "power spectral density", 12: "spectrum", 25: "impulse response",
    26: "multiple coherence", 27: "order function",
}  # fmt: skip


class UniversalFile:
    """A file divided into datasets, which are counted from 1 as their users count them.

    Raises
    ------
    FileContentError
        It is no Universal File; every method raises it if the file is damaged.
    """

    def __init__(self, path: Path, reading: Reading | None = None) -> None:
        self.path, self.reading = path, reading or Reading()
        self._notes: dict[str, list[int]] = {}
        self._systems: dict[int, UnitSystem] | None = None
        self._index, is_cut = index_datasets(path)
        if not self._index:
            raise self.error(
                "ends inside its first dataset" if is_cut else "is not a Universal File: no dataset delimiters (-1)"
            )
        self.types = [dataset.kind for dataset in self._index]
        self._numbers: dict[int, list[int]] = {}
        for number, kind in enumerate(self.types, start=1):
            self._numbers.setdefault(kind, []).append(number)
        for number, kind in enumerate(self.types, start=1):
            if kind <= 0:
                raise self.error(f"is damaged: dataset {number} has no type, a delimiter (-1) is missing before it")
        if is_cut:
            self.note("ends inside a dataset, which is left out", len(self.types) + 1)

    def error(self, sentence: str) -> FileContentError:
        """Return an exception whose message is the file's name and a sentence about it."""
        return FileContentError(f"{self.path} {sentence}")

    @contextmanager
    def damage_named(self, dataset: int) -> Iterator[None]:
        """Turn errors from reading a damaged dataset into one sentence."""
        try:
            yield
        except (ValueError, LookupError, OverflowError) as error:
            where = f"dataset {dataset} (type {self.types[dataset - 1]})"
            why = str(error) if isinstance(error, DamagedNumbersError) else "it cannot be read"
            raise self.error(f"is damaged in {where}: {why}; export it again") from error

    def note(self, sentence: str, *datasets: int) -> None:
        """Add a note for the user about some datasets."""
        self._notes.setdefault(sentence, []).extend(datasets)

    def notes(self) -> list[str]:
        """Return every note once, with its datasets."""
        notes = ((text, list(dict.fromkeys(datasets))) for text, datasets in self._notes.items())
        return [f"{self.path}: {text} ({name_some('dataset', datasets)})" for text, datasets in notes]

    def datasets(self, *kinds: int) -> list[int]:
        """Return the numbers of the datasets of some types."""
        if len(kinds) == 1:
            return self._numbers.get(kinds[0], [])
        return sorted(number for kind in kinds for number in self._numbers.get(kind, ()))

    def function_name(self, kind: int, count: int = 1) -> str:
        """Return the name of a type of function of dataset 58."""
        return f"{_plural(_FUNCTIONS.get(kind, 'function of another kind'), count)} (dataset 58, function type {kind})"

    def held_without_frf(self, functions: Mapping[int, Sequence[int]]) -> str:
        """Return the content of a file in words: the functions of dataset 58, by their types, or else datasets."""
        if functions:
            held = [f"{len(own)} {self.function_name(kind, len(own))}" for kind, own in functions.items()]
            return f"{', '.join(held)} and no FRF"
        kinds = [f"{kind} ({_DATASETS[kind]})" if kind in _DATASETS else str(kind) for kind in sorted(set(self.types))]
        return f"{_plural('dataset', len(kinds))} {', '.join(kinds)} and no FRF (dataset 58, function type 4)"

    def content(self, dataset: int, most: int | None = None) -> bytes:
        """Return the bytes of a dataset from its delimiter on, or the first of them."""
        place = self._index[dataset - 1]
        size = place.end - place.start
        with self.path.open("rb") as file:
            file.seek(place.start)
            return file.read(size if most is None else min(size, most))

    def records(self, dataset: int) -> list[str]:
        """Return the lines of a dataset of text after its type, with exponents in the form of Python."""
        lines = self.content(dataset).decode("utf-8", "replace").splitlines()[2:]
        return [line.replace("D", "E").replace("d", "e") for line in lines]

    def unit_system(self, dataset: int) -> UnitSystem | None:
        """Return the units of a dataset: the last dataset 164 before it, else the first of the file, else None."""
        if self._systems is None:
            self._systems = {number: self._read_unit_system(number) for number in self.datasets(164)}
        numbers = self.datasets(164)
        return self._systems[numbers[max(bisect_left(numbers, dataset) - 1, 0)]] if numbers else None

    def _read_unit_system(self, dataset: int) -> UnitSystem:
        with self.damage_named(dataset):
            records = self.records(dataset)
            int(records[0][:10])
            length, force, *_ = (float(word) for word in " ".join(records[1:]).split())
        for name, factor in (("length", length), ("force", force)):
            if not 1e-30 < factor < 1e30:
                raise self.error(f"has the {name} factor {factor:g} in its units (dataset {dataset})")
        return UnitSystem(length, force)


def _plural(name: str, count: int) -> str:
    first, of, rest = name.partition(" of ")
    for ending, plural in (("y", "ies"), ("um", "a"), ("", "s")):
        if first.endswith(ending):
            return name if count == 1 else f"{first.removesuffix(ending)}{plural}{of}{rest}"
    return name


def name_some(what: str, numbers: Sequence[int]) -> str:
    """Name the first few of some things, as in ``datasets 3, 4 and 12 more``."""
    return f"{what}{'s' if len(numbers) > 1 else ''} {some_of(numbers, _NUMBERS_SHOWN)}"
