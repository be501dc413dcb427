"""Text tables: rows of cells, and FRFs in them, with a column of frequencies and two columns for each FRF."""

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

from jointfrf.choices import FRF_FORMATS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, text_of, write_file
from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.io.file_format import TIME_DATA, FileFormat, FrfArrays, Reading
from jointfrf.io.functions import LooseFunction, arrays_of_functions
from jointfrf.io.labels import ChannelNamer
from jointfrf.io.named_arrays import fields_of
from jointfrf.io.units import QUANTITIES, StatedUnits, parse_frequency_unit, parse_level, parse_phase_unit, parse_unit

__all__ = ["CSV", "TextTable", "read_text_table", "write_csv"]

#: Words of a heading, and the part of an FRF that they name.
_PARTS = {
    "real": "real", "re": "real", "imag": "imag", "imaginary": "imag", "im": "imag",
    "mag": "magnitude", "magnitude": "magnitude", "abs": "magnitude", "amplitude": "magnitude", "amp": "magnitude",
    "phase": "phase", "arg": "phase", "angle": "phase",
    "coherence": "coherence", "coh": "coherence",
}  # fmt: skip
#: Further words of a heading: without a meaning, perhaps with a number; or a quantity. Any other word may be a scale.
_FILLERS = re.compile(
    r"\b(?:(?:part|of|the|value|values|component|function|response|transfer)|"
    r"(?:frf|h|hv|channel|ch|record|curve|trace|no)(?:\s?[#:]?\s?\d{1,4})?)\b[.:]?", re.IGNORECASE
)  # fmt: skip
_QUANTITY = re.compile(r"\b(receptance|mobility|accelerance|inertance)\b", re.IGNORECASE)
#: A channel as in ``102:+y`` or ``bar:102 -Z``, and response / excitation.
_CHANNEL = r"(?<![^\s/,;()\[\]])[^\s/,;()\[\]]*?(?<!\d)\d++[\s:._]*+[+-]?r?[xyz][+-]?"
_PAIR = re.compile(rf"({_CHANNEL})\s*/\s*({_CHANNEL})(?![a-z])", re.IGNORECASE)
#: Names of frequencies and of times in the first column.
_FREQUENCY = {
    "f", "freq", "freqs", "frequency", "frequencies", "frequenz", "frequenzen", "fréquence", "frequence", "fréquences",
    "frecuencia", "frequenza", "frequentie", "frekvens", "frequência", "hz", "omega", "ω", "w",
}  # fmt: skip
_TIME = {"t", "time", "times", "zeit", "temps", "tiempo", "tempo", "tijd", "tid"}
#: A name and its unit in brackets; separators if there are no brackets: `f, Hz`, `freq/Hz`, `freq_hz`, `f in Hz`.
_BRACKETED = re.compile(r"([^()\[\]{}<>]*)[(\[{<](.+)[)\]}>]")
_BETWEEN = re.compile(r"[\s,;:/_-]+(?:in )?")
#: Words of the first column, of which none is a logarithm.
_WORDS, _LOGARITHM = re.compile(r"[^\W\d_]*(?:[ _.-][^\W\d_]+)*"), re.compile(r"\b(log|lg|ln)\b", re.IGNORECASE)
_WORD, _UNIT_BEGINS = re.compile(r"[a-z]+", re.IGNORECASE), re.compile(r"[(\[{<]|\bdb\b", re.IGNORECASE)
#: Factors of coherences by their units.
_SHARES = {"": 1.0, "-": 1.0, "1": 1.0, "%": 0.01}
#: Number of lines searched for a heading behind a preamble, and pattern of a heading.
_PREAMBLE = 200
_HEADING = "frequency [Hz],102:+y / 101:+y real [(m/s^2)/N],102:+y / 101:+y imag [(m/s^2)/N]"


class TextTable(NamedTuple):
    """A table as it is in a file.

    Attributes
    ----------
    stated : dict of str
        Statements in comments before the heading such as ``# unit: m/N``, by the word before the colon in lower case.
    heading : list of str
        Names of the columns.
    rows : iterator of (str, list of str)
        File and line, with which messages begin, and the cells, one for each column. Rows are read on demand.
    decimal_comma : bool
        Whether numbers may have a decimal comma: not if commas separate cells.
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
            The cell contains something else.
        """
        return float(cell.replace(",", ".") if self.decimal_comma else cell)


def read_text_table(path: Path, skip_lines: int = 0) -> TextTable:
    """Read a table; blank lines and lines that begin with ``#`` are no rows.

    Parameters
    ----------
    path : Path
        Name of the file.
    skip_lines : int
        Number of lines at the beginning that are skipped, default 0.

    Raises
    ------
    FileContentError
        It cannot be read, it is not a text file, or it is empty. Reading the rows raises it if a row and the heading
        have different numbers of cells.
    """
    lines = (
        (f"{path}: line {number}", line.strip("\x1a"))  # the end of a file of DOS
        for number, line in enumerate(text_of(path).splitlines(), start=1)
        if number > skip_lines and line.strip(",;\t \x1a")
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
    """Return the FRFs of columns whose names state response, excitation, part and unit, after one of frequencies."""
    table = read_text_table(path, reading.skip_lines)
    where, units = str(path), reading.units
    frequency_unit = _frequency_unit(path, table.heading[0], units)
    columns = _columns(table.heading[1:], where, reading)
    numbers = np.array([_numbers(table, place, cells) for place, cells in table.rows])
    if not numbers.size or not columns:
        raise FileContentError(f"{path} contains no table of numbers below its heading")
    parts: dict[tuple[Channel, Channel], dict[str, _FrfPart]] = {}
    for column, values in zip(columns, numbers.T[1:], strict=True):
        if column.part in parts.setdefault(column.pair, {}):
            raise FileContentError(f"{where} has two columns {column.part} of {column.pair[0]} / {column.pair[1]}")
        parts[column.pair][column.part] = column._replace(values=values)
    stated = table.stated.get("unit", "")
    functions = [
        each for pair in parts.values() for each in _functions(pair, numbers[:, 0], stated, reading, where)
    ]  # fmt: skip
    found = arrays_of_functions(functions, where, limit)
    found.quantity = found.quantity or table.stated.get("quantity", "")
    found.frequency_unit = frequency_unit
    phases, levels = (any(each.part == part for each in columns) for part in ("phase", "magnitude"))
    found.takes = (
        "skip_lines",
        "frequency",
        "components",
        *(["responses", "excitations", "direction"] if reading.mapping.responses is not None else []),
        *(["phase"] if phases else []),
        *(["level"] if levels else []),
    )
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


def _frequency_unit(path: Path, name: str, units: StatedUnits) -> str:
    """Return the unit of the first column; empty if the user states it.

    Raises
    ------
    FileContentError
        The column is not the frequency, or its unit is missing.
    """
    word, unit = _name_and_unit(name)
    if parse_frequency_unit(unit) is not None or (word in _FREQUENCY and (units.frequency or unit)):
        return unit  # which the reader of all formats compares with the stated one, or rejects
    if word in _FREQUENCY:
        raise FileContentError(
            f"{path}: no unit in the heading {name[:40]!r}; write 'frequency [Hz]' or give unit= with frequency=Hz"
        )
    if word in _TIME or ((second := parse_unit(unit)) and second.exponents == (0, 0, 1)):
        raise FileContentError(f"{path} has times in its first column ({name[:40]!r}), no frequencies; {TIME_DATA}")
    raise FileContentError(_without_heading(path, name))


def _name_and_unit(name: str) -> tuple[str, str]:
    """Return the name of the first column in small letters, and its unit; both empty for anything but words."""
    text = " ".join(name.split())
    splits = [text[: place.start()] + "\n" + text[place.end() :] for place in _BETWEEN.finditer(text)]
    if match := _BRACKETED.fullmatch(text):
        splits = [f"{match[1]}\n{match[2]}"]
    found = [split.partition("\n")[::2] for split in (f"\n{text}", *splits, f"{text}\n")]
    word, unit = next((each for each in found if parse_frequency_unit(each[1]) is not None), found[1])
    word = word.strip(" ,;:/_.-")
    return ("", "") if not _WORDS.fullmatch(word) or _LOGARITHM.search(word) else (word.lower(), unit.strip())


def _without_heading(path: Path, name: str) -> str:
    """Return a message that a table has no heading, with the line on which one may follow."""
    for number, line in enumerate(text_of(path).splitlines()[:_PREAMBLE]):
        mark = next((each for each in "\t;," if each in line), ",")
        word, unit = _name_and_unit(line.partition(mark)[0])
        if _PAIR.search(line) and (word in _FREQUENCY or parse_frequency_unit(unit) is not None):
            return f"{path} has its heading on line {number + 1}; give skip_lines={number}"
    return (
        f"{path} has no heading that names frequencies and channels, but {name[:40]!r}. If it is a table of FRFs, "
        f"write one such as '{_HEADING}', or give skip_lines= to omit a preamble. Otherwise name a file of FRFs (.uff, "
        ".unv, .npz, .mat, .h5)"
    )


class _FrfPart(NamedTuple):
    """A column: response and excitation, part of the FRF, its unit and quantity in the heading, its numbers."""

    pair: tuple[Channel, Channel]
    part: str
    unit: str
    quantity: str
    values: NDArray[np.float64] = np.zeros(0)

    @property
    def name(self) -> str:
        """Name of the column in messages."""
        return f"{self.part} of {self.pair[0]} / {self.pair[1]}"


def _columns(names: list[str], where: str, reading: Reading) -> list[_FrfPart]:
    """Read the headings of all columns; a table without channels has the channels that the user names."""
    namer, sides = reading.mapping.namer, ("responses", "excitations")
    named = [side for side in sides if getattr(reading.mapping, side) is not None]
    if not named:
        return [_column(name, where, namer) for name in names]
    if len(named) == 1:
        missing = next(side for side in sides if side not in named)
        raise FileContentError(f"{where}: mapping names {named[0]} only; give mapping {missing}=... too")
    if any(_PAIR.search(name) for name in names):
        raise FileContentError(f"{where} names its channels; leave out mapping responses= and excitations=")
    parts = [_part_and_unit(name, where) for name in names]
    # An FRF begins when the first part of the previous one returns.
    numbers, held = list[int](), set[str]()
    for part, _, _ in parts:
        held = {part} if part in held else held | {part}
        numbers.append((numbers[-1] if numbers else 0) + (len(held) == 1))
    labels = [reading.mapping.names_of(side, numbers[-1], where) or [] for side in sides]
    try:
        pairs = [
            (namer.channel("responses", row), namer.channel("excitations", column))
            for row, column in zip(*labels, strict=True)
        ]
    except ValueError as error:
        raise FileContentError(f"{where} {error}") from error
    twice = next((pair for i, pair in enumerate(pairs) if pair in pairs[:i]), None)
    if twice is not None:
        raise FileContentError(f"{where}: mapping names {twice[0]} / {twice[1]} twice; name each FRF once")
    return [_FrfPart(pairs[number - 1], *part) for number, part in zip(numbers, parts, strict=True)]


def _column(name: str, where: str, namer: ChannelNamer) -> _FrfPart:
    """Read a heading with its channels."""
    match = _PAIR.search(name)
    if match is None:
        raise _unknown_column(name, where)
    before, after = name[: match.start()], name[match.end() :]
    if before.rstrip().endswith("(") and after.lstrip().startswith(")"):  # H(102:+y / 101:+y)
        before, after = before.rstrip()[:-1], after.lstrip()[1:]
    part = _part_and_unit(name, where, " ".join(f"{before} {after}".split()))
    try:
        pair = namer.channel("heading", match[1]), namer.channel("heading", match[2])
    except ValueError as error:
        raise FileContentError(f"{where} {error}") from error
    return _FrfPart(pair, *part)


def _part_and_unit(name: str, where: str, rest: str | None = None) -> tuple[str, str, str]:
    """Return part, unit and quantity: the rest without channels, part and words without a meaning is the unit."""
    rest = " ".join(name.split()) if rest is None else rest
    # Behind a bracket and dB only the unit follows, or a part that is nowhere before: [dB re 1 m/N] mag.
    named = _parts_in(rest, 0, _UNIT_BEGINS.search(rest)) or _parts_in(rest, _behind_brackets(rest), None)
    if len({part for part, _ in named}) != 1:
        raise _unknown_column(name, where)
    part, place = named[0]
    rest = f"{rest[: place.start()]} {rest[place.end() :]}"
    quantity = _QUANTITY.search(rest)
    unit = " ".join(_FILLERS.sub(" ", _QUANTITY.sub(" ", rest)).strip(" ,;:/_-|").split())
    return part, _without_in(unit), quantity[1].lower() if quantity else ""


def _unknown_column(name: str, where: str) -> FileContentError:
    return FileContentError(
        f"{where}: unknown column {name[:60]!r}; name response / excitation and part, '102:+y / 101:+y real [m/N]', "
        "or give mapping responses= and excitations="
    )


def _without_in(unit: str) -> str:
    """Return the unit of a heading without its brackets, or without the word of `real in m/N`, which is no inch."""
    if match := re.fullmatch(r"[(\[{<]([^()\[\]{}<>]*)[)\]}>]", unit):
        return match[1].strip()
    found = parse_unit(unit)
    return unit if found is not None and found.exponents in QUANTITIES else unit.removeprefix("in ")


def _behind_brackets(text: str) -> int:
    """Return the position behind the last bracket; the end without brackets."""
    return 1 + max(map(text.rfind, ")]}>")) or len(text)


def _parts_in(text: str, start: int, end: re.Match[str] | None) -> list[tuple[str, re.Match[str]]]:
    """Return the parts of an FRF that words name, and their positions."""
    words = _WORD.finditer(text, start, len(text) if end is None else end.start())
    return [(_PARTS[word[0].lower()], word) for word in words if word[0].lower() in _PARTS]


def _functions(
    columns: dict[str, _FrfPart], frequency: NDArray[np.float64], stated: str, reading: Reading, where: str
) -> list[LooseFunction]:
    """Return the FRF of one pair of channels, and its coherence if there is one."""
    pair = next(iter(columns.values())).pair
    parts = set(columns) - {"coherence"}
    if parts == {"real", "imag"}:
        real, imag = columns["real"], columns["imag"]
        if real.unit != imag.unit:
            raise FileContentError(f"{where}: real and imag of {pair[0]} / {pair[1]} have different units")
        unit, values = _one_unit(real, stated, where), real.values + 1j * imag.values
    elif parts == {"magnitude", "phase"}:
        magnitude, phase = columns["magnitude"], columns["phase"]
        unit, size = _linear(magnitude, _one_unit(magnitude, stated, where), reading, where)
        values = size * np.exp(1j * _radians(phase, reading, where) * phase.values)
    else:
        held = " and ".join(sorted(columns))
        raise FileContentError(
            f"{where} has {held} of {pair[0]} / {pair[1]}: it takes real and imag, or magnitude and phase"
        )
    quantity = next((each.quantity for each in columns.values() if each.quantity), "")
    found = [LooseFunction(*pair, frequency, values, unit=unit, quantity=quantity)]
    if "coherence" in columns:
        share = _SHARES.get(columns["coherence"].unit.strip("()[]{}<> "))
        if share is None:
            raise FileContentError(f"{where}: unit '{columns['coherence'].unit}' of a coherence; write none, or %")
        found.append(LooseFunction(*pair, frequency, share * columns["coherence"].values, is_coherence=True))
    return found


def _one_unit(column: _FrfPart, stated: str, where: str) -> str:
    """Return the unit of the heading, or the unit that a comment states for all columns."""
    if column.unit and stated and parse_unit(column.unit) != parse_unit(stated):
        raise FileContentError(
            f"{where}: the unit of {column.name} is '{column.unit}', a comment states '{stated}'; correct one"
        )
    return column.unit or stated


def _linear(column: _FrfPart, unit: str, reading: Reading, where: str) -> tuple[str, NDArray[np.float64]]:
    """Return unit and values of magnitudes, of levels with their reference as the unit."""
    stated, reference = reading.units.level, parse_level(unit)
    of_channels = f"of the magnitude of {column.pair[0]} / {column.pair[1]}"
    if stated and parse_unit(unit) is not None and not reading.forced:
        raise FileContentError(
            f"{where}: the unit {of_channels} is '{unit}', not {stated}; leave unit out, or force it"
        )
    if not stated and reference is None and re.search(r"db|log", unit, re.IGNORECASE):
        raise FileContentError(f"{where}: the unit '{unit}' {of_channels} has no reference; give unit='dB re 1 m/N'")
    if not stated and reference is None:
        return unit, column.values
    with np.errstate(over="ignore"):  # a later check names infinite values
        return reference or reading.units.ratio, np.asarray(10.0 ** (column.values / 20.0))


def _radians(column: _FrfPart, reading: Reading, where: str) -> float:
    """Return the unit of phases in rad, stated by the user or by the heading."""
    by_file = parse_phase_unit(column.unit)
    try:
        factor = reading.agreed("phases", parse_phase_unit(reading.units.phase), by_file, column.unit)
    except ValueError as error:
        raise FileContentError(f"{where}: {error}") from error
    if factor is None:
        why = f"the unit '{column.unit}' is not understood" if column.unit else "there is no unit"
        raise FileContentError(f"{where}: {why} of the {column.name}; give unit= with phase=deg or phase=rad")
    return factor


def write_csv(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs as a text table: real and imaginary part, and coherence if it is known.

    Parameters
    ----------
    path : path-like
        Name of the file, in a folder that exists; an older file is replaced as a whole or not at all.
    frfs : FrfSet
        FRFs to write. Coordinates are not written; averages only if all have the same number.

    Raises
    ------
    ValueError
        There is no FRF, or one is NaN or infinite on some lines only.
    OSError
        The file cannot be written; nothing is left behind.

    See Also
    --------
    write_frfs : write in the format of the suffix.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np, jointfrf as jf
    >>> frfs = jf.io.frfs_of_arrays([10.0, 20.0], np.ones((2, 1, 1)), ["1:y"], ["1:y"], unit="m/N")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "point.csv"
    ...     jf.io.write_csv(path, frfs)
    ...     print(path.read_text().splitlines()[-1])
    20.0,1.0,0.0
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


def _looks_alike(path: Path, head: bytes) -> bool:
    """Return whether a text has the suffix, or its first line has separators or is a comment."""
    first = next((line for line in head.splitlines() if line.strip()), b"")
    is_text = head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" not in head
    is_named = path.suffix.lower() in (".csv", ".txt")
    return is_text and (is_named or any(mark in first for mark in (b",", b";", b"\t", b"#")))


CSV = FileFormat(
    name=FRF_FORMATS["csv_file"].name,
    suffixes=FRF_FORMATS["csv_file"].suffixes,
    content="text table",
    looks_alike=_looks_alike,
    read=_read,
    write=write_csv,
)
