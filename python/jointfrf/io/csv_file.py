"""Text tables: rows of cells, and FRFs in them: a column of frequencies, and two columns for each FRF."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, text_of, write_file
from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.io.file_format import FileFormat, FrfArrays, Reading
from jointfrf.io.functions import LooseFunction, arrays_of_functions
from jointfrf.io.labels import ChannelNamer
from jointfrf.io.named_arrays import fields_of

__all__ = ["CSV", "TextTable", "read_text_table", "write_csv"]

#: Words of a heading, and the part of an FRF that they name.
_PARTS = {
    "real": "real", "re": "real", "imag": "imag", "imaginary": "imag", "im": "imag",
    "mag": "magnitude", "magnitude": "magnitude", "abs": "magnitude", "amplitude": "magnitude", "amp": "magnitude",
    "phase": "phase", "arg": "phase", "angle": "phase",
    "coherence": "coherence", "coh": "coherence",
}  # fmt: skip
#: A channel as in ``102:+y`` or ``bar:102 -Z``, and response / excitation; a unit in brackets; the first column.
_CHANNEL = r"(?<![^\s/,;()\[\]])[^\s/,;()\[\]]*?(?<!\d)\d++[\s:._]*+[+-]?r?[xyz][+-]?"
_PAIR = re.compile(rf"({_CHANNEL})\s*/\s*({_CHANNEL})(?![a-z])", re.IGNORECASE)
_UNIT = re.compile(r"\[([^\[\]]*)\]")
_FREQUENCY = re.compile(r"(f|freq|frequency|freq_hz|hz)\b", re.IGNORECASE)
#: Factors to Hz and to radians by the unit in brackets; Hz and degrees where there is none.
_HZ = {"": 1.0, "hz": 1.0, "khz": 1e3, "rad/s": 0.5 / np.pi}
_RADIANS = {"": np.pi / 180, "deg": np.pi / 180, "°": np.pi / 180, "rad": 1.0}


class TextTable(NamedTuple):
    """A table as it is in a file.

    Attributes
    ----------
    stated : dict of str
        What comments before the heading such as ``# unit: m/N`` say, by the word before the colon in lower case.
    heading : list of str
        Names of the columns.
    rows : iterator of (str, list of str)
        File and line, with which messages begin, and the cells; as many as the heading has. Each is read when it is
        asked for.
    decimal_comma : bool
        Whether numbers may have one: not where commas are between the cells.
    """

    stated: dict[str, str]
    heading: list[str]
    rows: Iterator[tuple[str, list[str]]]
    decimal_comma: bool

    def number(self, cell: str) -> float:
        """Return the number in a cell.

        Raises
        ------
        ValueError
            The cell holds something else.
        """
        return float(cell.replace(",", ".") if self.decimal_comma else cell)


def read_text_table(path: Path) -> TextTable:
    """Read a table; blank lines and lines that begin with ``#`` are no rows.

    Raises
    ------
    FileContentError
        It cannot be read, it is not a text file, it is empty, or, when the rows are read, one has not as many cells as
        the heading.
    """
    lines = (
        (f"{path}: line {number}", line.strip("\x1a"))  # the end of a file of DOS
        for number, line in enumerate(text_of(path).splitlines(), start=1)
        if line.strip(",;\t \x1a")
    )
    stated: dict[str, str] = {}
    for where, line in lines:
        if not line.lstrip().startswith("#"):
            mark = next((each for each in "\t;," if each in line), ",")
            heading = _cells(where, line, mark)
            return TextTable(stated, heading, _rows(lines, mark, len(heading)), mark != ",")
        key, colon, value = line.lstrip("# ").partition(":")
        if colon:
            stated[key.strip().lower()] = value.strip(" ,;\t")
    raise FileContentError(f"{path} is empty")


def _rows(lines: Iterator[tuple[str, str]], mark: str, count: int) -> Iterator[tuple[str, list[str]]]:
    for where, line in lines:
        if line.lstrip().startswith("#"):
            continue
        cells = _cells(where, line, mark)
        if len(cells) != count:
            raise FileContentError(f"{where} has {len(cells)} columns, the heading has {count}")
        yield where, cells


def _cells(where: str, line: str, mark: str) -> list[str]:
    try:
        (cells,) = csv.reader([line], delimiter=mark, skipinitialspace=True)
    except csv.Error as error:
        raise FileContentError(f"{where} cannot be read: {error}") from error
    return [cell.strip() for cell in cells]


def _read(path: Path, limit: ReadLimit, reading: Reading) -> FrfArrays:
    """Read columns whose names say response, excitation, part and unit, after one of frequencies."""
    table = read_text_table(path)
    where, first = str(path), table.heading[0]
    parts: dict[tuple[Channel, Channel], dict[str, tuple[str, NDArray[np.float64]]]] = {}
    if not _FREQUENCY.match(first):
        raise FileContentError(f"{where}: the first column must be the frequency, not {first[:40]!r}")
    hz = _unit_of(first).lower()
    if hz not in _HZ:
        raise FileContentError(f"{where}: the unit '{hz}' of the frequency is none of Hz, kHz, rad/s")
    numbers = np.array([_numbers(table, place, cells) for place, cells in table.rows])
    if not numbers.size or len(table.heading) < 2:
        raise FileContentError(f"{path} holds no table of numbers below a heading")
    namer = reading.mapping.namer
    for name, column in zip(table.heading[1:], numbers.T[1:], strict=True):
        pair, part = _column(name, where, namer)
        if part in parts.setdefault(pair, {}):
            raise FileContentError(f"{where} has two columns {name!r}")
        parts[pair][part] = _unit_of(name), column
    freq_hz = numbers[:, 0] * _HZ[hz]
    functions = [each for pair, columns in parts.items() for each in _functions(pair, columns, freq_hz, where)]
    found = arrays_of_functions(functions, where, limit)
    found.quantity = table.stated.get("quantity", "")
    found.unit = found.unit or table.stated.get("unit", "")
    if "averages" in table.stated:
        try:
            found.averages = float(table.stated["averages"])
        except ValueError as error:
            raise FileContentError(f"{where}: averages {table.stated['averages']!r} is not a number") from error
    return found


def _numbers(table: TextTable, place: str, cells: list[str]) -> list[float]:
    try:
        return [table.number(cell) for cell in cells]
    except ValueError:
        for i, cell in enumerate(cells, start=1):
            with suppress(ValueError):
                table.number(cell)
                continue
            raise FileContentError(f"{place}, column {i}: {cell[:30]!r} is not a number") from None
        raise


def _column(name: str, where: str, namer: ChannelNamer) -> tuple[tuple[Channel, Channel], str]:
    """Response, excitation and part that a heading names."""
    match = _PAIR.search(name)
    if match is not None:
        rest = _UNIT.sub(" ", name[: match.start()] + " " + name[match.end() :])
        named = {_PARTS[word] for word in re.findall(r"[a-z]+", rest.lower()) if word in _PARTS}
        if len(named) == 1:
            try:
                pair = namer.channel("heading", match[1]), namer.channel("heading", match[2])
            except ValueError as error:
                raise FileContentError(f"{where} {error}") from error
            return pair, named.pop()
    raise FileContentError(
        f"{where}: column {name[:60]!r} does not name response / excitation and real, imag, magnitude, phase or "
        "coherence, such as '102:+y / 101:+y real'"
    )


def _unit_of(name: str) -> str:
    match = _UNIT.search(name)
    return match[1].strip() if match else ""


def _functions(
    pair: tuple[Channel, Channel],
    columns: dict[str, tuple[str, NDArray[np.float64]]],
    freq_hz: NDArray[np.float64],
    where: str,
) -> list[LooseFunction]:
    """FRF of one pair of channels, and its coherence where there is one."""
    found = []
    parts = set(columns) - {"coherence"}
    if parts == {"real", "imag"}:
        unit, values = columns["real"][0], columns["real"][1] + 1j * columns["imag"][1]
        if columns["imag"][0] != unit:
            raise FileContentError(f"{where}: real and imag of {pair[0]} / {pair[1]} have different units")
    elif parts == {"magnitude", "phase"}:
        unit, angle = columns["magnitude"][0], columns["phase"][0].lower()
        if unit.lower().startswith("db") or angle not in _RADIANS:
            raise FileContentError(
                f"{where}: magnitude of {pair[0]} / {pair[1]} must be linear and phase in deg or rad, "
                f"not [{unit}] and [{angle}]"
            )
        values = columns["magnitude"][1] * np.exp(1j * _RADIANS[angle] * columns["phase"][1])
    else:
        held = " and ".join(sorted(columns))
        raise FileContentError(
            f"{where} has {held} of {pair[0]} / {pair[1]}: it takes real and imag, or magnitude and phase"
        )
    found.append(LooseFunction(*pair, freq_hz, values, unit=unit))
    if "coherence" in columns:
        found.append(LooseFunction(*pair, freq_hz, columns["coherence"][1], is_coherence=True))
    return found


def write_csv(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs as a text table, real and imaginary part and where it is known coherence.

    Parameters
    ----------
    path : path-like
        In a folder that exists; an older file is replaced as a whole or not at all.
    frfs : FrfSet
        The FRFs. Coordinates are not written; a number of averages only where it is one.

    Raises
    ------
    ValueError
        There is no FRF, or one is NaN or infinite on some lines only.
    OSError
        The file cannot be written; nothing is left behind.
    """
    fields: dict[str, Any] = fields_of(frfs)
    head = [f"# quantity: {fields['quantity']}"]
    averages = {} if frfs.averages is None else set(frfs.averages[frfs.measured])
    if len(averages) == 1 and not np.isnan(next(iter(averages))):
        head.append(f"# averages: {next(iter(averages)):g}")
    names, columns = ["frequency [Hz]"], [frfs.freq_hz]
    for i, j in np.argwhere(frfs.measured):
        pair, unit = f"{frfs.responses[i]} / {frfs.excitations[j]}", fields["unit"]
        names += [f"{pair} real [{unit}]", f"{pair} imag [{unit}]"]
        columns += [frfs.h[:, i, j].real, frfs.h[:, i, j].imag]
        if frfs.coherence is not None and np.isfinite(frfs.coherence[:, i, j]).all():
            names.append(f"{pair} coherence")
            columns.append(frfs.coherence[:, i, j])
    rows = [",".join(map(repr, row)) for row in np.stack(columns, axis=1).tolist()]
    write_file(Path(path), "\n".join([*head, ",".join(names), *rows, ""]))


def _looks_alike(_: Path, head: bytes) -> bool:
    """Whether the first line of a text has separators, or is a comment."""
    first = next((line for line in head.splitlines() if line.strip()), b"")
    is_text = head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" not in head
    return is_text and any(mark in first for mark in (b",", b";", b"\t", b"#"))


CSV = FileFormat(
    name="CSV",
    suffixes=(".csv", ".txt"),
    content="text table",
    looks_alike=_looks_alike,
    read=_read,
    write=write_csv,
)
