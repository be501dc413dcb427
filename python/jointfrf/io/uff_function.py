"""Dataset 58 of Universal Files, one function: its records and numbers, read and written; quantity and factor to SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.files import HEAD
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel
from jointfrf.io.units import SAME_FACTOR, Exponents, Unit, UnitSystem, parse_unit

__all__ = [
    "DELIMITER",
    "Axis",
    "DamagedNumbersError",
    "FunctionHeader",
    "axis_record",
    "function_dataset",
    "function_values",
    "kind_of_frf",
    "ordinate_factor",
    "ordinate_quantity",
    "place_fields",
    "read_header",
]

#: The line before and after a dataset.
DELIMITER = "    -1"
#: Number of lines before the numbers: delimiter, type, five of text, records 6 to 11; a 58b states it after the type.
_N_LINES, _N_TEXT_LINES = 13, 11


def _cuts(*widths: int) -> list[slice]:
    """Return the columns of fields of these widths."""
    ends = list(accumulate(widths))
    return [slice(start, end) for start, end in zip([0, *ends], ends, strict=False)]


#: Columns of the type line of 58b, of record 6, of record 7, and of records 8 to 11.
_BINARY, _PLACE = _cuts(6, 1, 6, 6, 12, 12), _cuts(5, 10, 5, 10, 11, 10, 4, 11, 10, 4)
_FORM, _AXIS = _cuts(10, 10, 10, 13, 13, 13), _cuts(10, 5, 5, 5, 21, 21)
#: Fields of record 6 that are numbers.
_PLACE_NUMBERS = (0, 1, 2, 3, 5, 6, 8, 9)
#: Columns of an abscissa: by the definition, and in files of other programs before values in double precision.
_ABSCISSA_WIDTHS = (13, 20)
#: Bytes of a number, and numbers of a value, by the ordinate data type of record 7.
_NUMBERS = {2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)}
#: Quantities by the data types of records 8 to 11.
_DATA_TYPES = {
    0: "unknown", 1: "general", 2: "stress", 3: "strain", 5: "temperature", 6: "heat flux", 8: "displacement",
    9: "reaction force", 11: "velocity", 12: "acceleration", 13: "excitation force", 15: "pressure", 16: "mass",
    17: "time", 18: "frequency", 19: "rpm", 20: "order",
}  # fmt: skip
#: Data types that name no quantity; data types of forces; data types of motions.
_UNSAID = (0, 1)
_FORCES = (9, 13)
_QUANTITY = {8: "receptance", 11: "mobility", 12: "accelerance"}
#: Largest relative distance of a line from an even spacing: rounding to 13 columns.
_EVEN = 1e-9


@dataclass(frozen=True)
class Axis:
    """Data type and unit label of the abscissa, or of the ordinate's numerator or denominator (records 8 to 10)."""

    data_type: int
    label: str
    unit: Unit | None

    @property
    def name(self) -> str:
        """The data type in words."""
        return _DATA_TYPES.get(self.data_type, f"data type {self.data_type}")

    @property
    def words(self) -> str:
        """Data type and unit as text."""
        return f"{self.name} [{self.label or 'no unit'}]"

    def __str__(self) -> str:
        return f"{self.data_type} ({self.name}, unit '{self.label or 'NONE'}')"


@lru_cache(256)  # a file repeats a few of them in thousands of functions
def _axis(record: bytes) -> Axis:
    """Return an axis from its record."""
    text = _text(record)
    words = _fields(text, _AXIS, range(4))
    data_type, *_ = map(int, words[:4])  # and three unused exponents
    label = _unit_label(record) if words == _columns(text, _AXIS) else words[5]
    label = "" if label.upper() == "NONE" else label
    return Axis(data_type, label, parse_unit(label))


def _text(record: bytes) -> str:
    """Return a record as text: UTF-8, else Latin-1, in which older programs write micro signs and powers."""
    try:
        return record.decode("utf-8").replace("\0", " ")
    except UnicodeDecodeError:
        return record.decode("latin-1").replace("\0", " ")


def _unit_label(record: bytes) -> str:
    """Return the unit label: programs fill the 20 columns of names and labels by characters or by bytes of UTF-8."""
    found = []
    for fields in (_text(record)[_AXIS[5]], _text(record[_AXIS[5]])):
        label = fields.strip()
        if fields[:1].strip() == "" and label not in found:  # a blank before the label
            found.append(label)
    labels = [label for label in found if label]
    return "' or '".join(labels)  # which is not understood if there are two


class DamagedNumbersError(ValueError):
    """The numbers of a dataset cannot be read; the message is the end of a sentence."""


class FunctionHeader(NamedTuple):
    """Content of the records before the numbers; for response and reference: entity, node and direction code."""

    kind: int
    response: tuple[str, int, int]
    reference: tuple[str, int, int]
    number_type: int
    n_values: int
    is_even: bool
    start: float
    step: float
    abscissa: Axis
    numerator: Axis
    denominator: Axis
    is_binary: bool
    is_big_endian: bool
    is_supported: bool
    length: int
    n_lines: int


def read_header(content: bytes) -> FunctionHeader:
    """Return the header in the records before the numbers.

    Parameters
    ----------
    content : bytes
        Bytes of the dataset from its delimiter on, or the beginning of them.

    Raises
    ------
    ValueError, LookupError
        The dataset is damaged.
    """
    lines = content[:HEAD].splitlines(keepends=True)[:_N_LINES]
    records = [_text(line.rstrip(b"\r\n")) for line in lines]
    place, form = _fields(records[7], _PLACE, _PLACE_NUMBERS), _fields(records[8], _FORM, range(6))
    is_binary = records[1][6:7].lower() == "b"
    order, floating_point, n_lines, _ = map(int, _columns(records[1], _BINARY)[2:]) if is_binary else (1, 2, 11, 0)
    start, step, _ = map(_number, form[3:])
    abscissa, numerator, denominator, _ = (_axis(line.rstrip(b"\r\n")) for line in lines[9:13])
    return FunctionHeader(
        int(place[0]),
        (place[4], _whole(place[5]), _whole(place[6])),
        (place[7], _whole(place[8]), _whole(place[9])),
        int(form[0]),
        int(form[1]),
        int(form[2]) != 0,
        start,
        step,
        abscissa,
        numerator,
        denominator,
        is_binary,
        order == 2,
        order in (1, 2) and (floating_point, n_lines) == (2, _N_TEXT_LINES),  # IEEE 754 after 11 lines of text
        sum(map(len, lines)),
        len(lines),
    )


def function_values(content: bytes, header: FunctionHeader) -> tuple[NDArray[np.float64], NDArray[Any]]:
    """Return the numbers of a dataset.

    Parameters
    ----------
    content : bytes
        Bytes of the dataset from its delimiter on.
    header : FunctionHeader
        Header of the dataset.

    Returns
    -------
    abscissa, ordinate : ndarray, shape (n,)
        Numbers in the dataset, even if the header states another count; without zeros that fill the last line of text.

    Raises
    ------
    DamagedNumbersError
        A line of text contains something else than numbers.
    """
    size, parts = _NUMBERS[header.number_type]
    data = content[header.length :]
    rows = _binary_rows(data, header, size, parts) if header.is_binary else _text_rows(data, header, size, parts)
    abscissa = rows[:, 0] if not header.is_even else header.start + header.step * np.arange(float(len(rows)))
    values = np.ascontiguousarray(rows[:, rows.shape[1] - parts :])
    return abscissa, (values if parts == 1 else values.view(np.complex128))[:, 0]


def _binary_rows(data: bytes, header: FunctionHeader, size: int, parts: int) -> NDArray[np.float64]:
    """Return a row of numbers for each value; some programs put line ends after the numbers."""
    order = ">" if header.is_big_endian else "<"
    kinds: list[Any] = [("y", f"{order}f{size}", (parts,))]
    if not header.is_even:  # four bytes by the definition, but pyuff writes eight with double precision
        is_long = len(data) >= header.n_values * size * (parts + 1)
        kinds.insert(0, ("x", f"{order}f{size if is_long else 4}"))
    kind = np.dtype(kinds)
    rows = np.frombuffer(data, kind, len(data) // kind.itemsize)
    values = rows["y"].astype(np.float64)
    return values if header.is_even else np.column_stack([rows["x"].astype(np.float64), values])


def _text_rows(data: bytes, header: FunctionHeader, size: int, parts: int) -> NDArray[np.float64]:
    """Return a row of numbers for each value.

    By the definition values are in columns, 6E13.5 in single precision, else 4E20.12, after an abscissa E13.5. Numbers
    between blanks are read in any columns; the columns count if numbers touch each other.
    """
    lines = data.decode("ascii", "replace").splitlines(keepends=True)
    width, wanted = 13 if size == 4 else 20, header.n_values
    of_each = parts + (not header.is_even)
    found = None
    for widths in ([], *([first] * (of_each - parts) + [width] * parts for first in _ABSCISSA_WIDTHS)):
        by_line = _numbers_of(lines, widths)
        numbers = [number for line in by_line for number in line]
        if len(by_line) == len(lines):
            last = next((len(line) for line in reversed(by_line) if line), 0)
            filling = numbers[of_each * wanted :]
            if wanted > 0 and 0 < len(filling) < last and not any(filling):
                numbers = numbers[: of_each * wanted]
            if found is None or len(numbers) == of_each * wanted:
                found = numbers
            if len(found) == of_each * wanted:
                break
        else:
            bad = len(by_line)
    if found is None:
        raise DamagedNumbersError(f"line {header.n_lines + bad + 1} of it is not numbers: {lines[bad].strip()[:40]!r}")
    count = len(found) // of_each
    return np.array(found[: count * of_each], np.float64).reshape(count, of_each)


def _numbers_of(lines: list[str], widths: list[int]) -> list[list[float]]:
    """Return the numbers of each line, between blanks or in columns of these widths, up to the first other line."""
    cuts = _cuts(*widths * (max(map(len, lines), default=0) // sum(widths) + 1)) if widths else []
    found = []
    try:
        for line in lines:
            words = line.split()
            if widths:
                words = [word for word in (line[cut] for cut in cuts if cut.stop <= len(line)) if not word.isspace()]
            try:
                found.append(list(map(float, words)))
            except ValueError:
                found.append(list(map(_number, words)))
    except ValueError:
        pass
    return found


def _number(word: str) -> float:
    """Return a number of Fortran; NaN for its words in old run-time libraries."""
    text = word.strip().replace("D", "E").replace("d", "e")
    if "#" in text or (text and not text.strip("*")):  # 1.#QNAN of Windows; stars for numbers that do not fit
        return math.nan
    return float(text)


def _columns(record: str, cuts: list[slice]) -> list[str]:
    """Return the fields of a record."""
    return [record[cut].strip() for cut in cuts]


def _fields(record: str, cuts: list[slice], numbers: Iterable[int]) -> list[str]:
    """Return the fields of a record: in the columns of the definition, or without numbers there, between blanks."""
    fields = _columns(record, cuts)
    if all(_is_number(fields[i]) for i in numbers if fields[i]):
        return fields
    words = record.split(None, len(cuts) - 1)
    return words if len(words) == len(cuts) and all(_is_number(words[i]) for i in numbers) else fields


def _is_number(word: str) -> bool:
    try:
        _number(word)
    except ValueError:
        return False
    return " " not in word


def _whole(word: str) -> int:
    """Return a whole number, 0 if it is missing."""
    try:
        return int(word)
    except ValueError:
        return 0


def kind_of_frf(numerator: Axis, denominator: Axis) -> str | None:
    """Return None if the data types do not contradict motion per force, else the kind of the function."""
    is_motion = numerator.data_type in (*_QUANTITY, *_UNSAID)
    is_force = denominator.data_type in (*_FORCES, *_UNSAID)
    return None if is_motion and is_force else f"{numerator.name} per {denominator.name}"


def ordinate_quantity(numerator: Axis, denominator: Axis, channels: tuple[Channel, Channel]) -> str | None:
    """Return the quantity by the data types, or by the unit labels; None if both do not determine it."""
    said = numerator.unit.exponents if numerator.unit else None
    said_below = denominator.unit.exponents if denominator.unit else None
    for name, power in POWER_OF_I_OMEGA.items():
        motion, force, ratio = _exponents(*channels, power)
        is_silent = numerator.data_type in _UNSAID
        is_named = _QUANTITY.get(numerator.data_type) == name
        is_force = denominator.data_type in _FORCES or said_below == force
        if (is_named or is_silent) and said == ratio:
            return name
        if (is_named or (is_silent and said == motion)) and is_force:
            return name
    return None


def ordinate_factor(
    numerator: Axis,
    denominator: Axis,
    channels: tuple[Channel, Channel],
    quantity: str,
    system: UnitSystem | None,
    uses_labels: bool,
    note: Callable[[str], None],
) -> tuple[float | None, str]:
    """Return the factor of the ordinate to SI units, by the labels or, without labels, by dataset 164.

    Returns
    -------
    float or None
        Factor; None if a unit is missing, not understood or does not match the quantity.
    str
        Reason if there is no factor.

    Raises
    ------
    ValueError
        A label contradicts the quantity and `uses_labels` is set.
    """
    motion, force, ratio = _exponents(*channels, POWER_OF_I_OMEGA[quantity])
    if numerator.unit is not None and numerator.unit.exponents == ratio:
        return _checked(numerator, numerator.unit, system, note), ""
    factors = []
    for axis, exponents, what in ((numerator, motion, "response"), (denominator, force, "excitation")):
        if axis.unit is not None and axis.unit.exponents == exponents:
            factors.append(_checked(axis, axis.unit, system, note))
        elif axis.unit is not None:
            why = f"the unit '{axis.label}' does not fit the {what} of {quantity} {channels[0]} / {channels[1]}"
            if uses_labels:
                raise ValueError(why)
            return None, why
        elif axis.label:
            return None, f"the unit '{axis.label}' of the {what} is not understood"
        elif system is None:
            return None, f"the {what} has no unit"
        else:
            factors.append(system.to_si(exponents))
    return factors[0] / factors[1], ""


def _exponents(response: Channel, excitation: Channel, power: int) -> tuple[Exponents, Exponents, Exponents]:
    """Return exponents of length, force, time of the motion, of the force or moment, and of their ratio."""
    motion = (0 if response.is_rotation else 1, 0, -power)
    force = (1 if excitation.is_rotation else 0, 1, 0)
    return motion, force, (motion[0] - force[0], -1, -power)


def _checked(axis: Axis, unit: Unit, system: UnitSystem | None, note: Callable[[str], None]) -> float:
    """Return the factor of a label; add a note if dataset 164 contradicts it (no system of 164 has g)."""
    by_system = unit.to_si if system is None else system.to_si(unit.exponents)
    if not math.isclose(unit.to_si, by_system, rel_tol=SAME_FACTOR) and not axis.label.lower().startswith("g"):
        note(f"the unit '{axis.label}' contradicts dataset 164: the unit is used")
    return unit.to_si


def function_dataset(
    texts: tuple[str, str],
    kind: int,
    places: str,
    axes: list[str],
    freq_hz: NDArray[np.float64],
    values: NDArray[np.complex128] | NDArray[np.float64],
    *,
    binary: bool,
    single: bool,
) -> bytes:
    """Return a function as lines of a dataset.

    Parameters
    ----------
    texts : tuple of str
        Name and title.
    kind : int
        Function type.
    places : str
        Response and reference, from `place_fields`.
    axes : list of str
        Records 9 and 10, from `axis_record`.
    freq_hz, values : ndarray, shape (n_freq,)
        Frequencies, Hz, and values.
    binary, single : bool
        Form and precision of the values; see `write_uff`.
    """
    start, step = _spacing(freq_hz)
    is_even, is_complex = step is not None, np.iscomplexobj(values)
    number_type = (5 if single else 6) if is_complex else (2 if single else 4)
    records = [
        texts[0],
        texts[1] or "NONE",
        *["NONE"] * 3,
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {places}",
        f"{number_type:10d}{values.size:10d}{int(is_even):10d}{start}{step or _short(0.0)}{_short(0.0)}",
        axis_record(18, "Frequency", "Hz"),
        *axes,
        axis_record(0, "NONE", "NONE"),
    ]
    if not (binary and is_even):
        numbers = _text_lines(freq_hz, values, is_even, single)
        return "\n".join([DELIMITER, "    58", *records, *numbers, DELIMITER, ""]).encode("ascii")
    data = values.astype(("<c8" if single else "<c16") if is_complex else ("<f4" if single else "<f8")).tobytes()
    first = f"    58b{1:6d}{2:6d}{_N_TEXT_LINES:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    text = "\n".join([DELIMITER, first, *records, ""]).encode("ascii")
    return text + data + f"\n{DELIMITER}\n".encode("ascii")


def place_fields(node: int, direction_code: int) -> str:
    """Return the fields of record 6 that name a response or a reference."""
    return f"{'NONE':<10}{node:10d}{direction_code:4d}"


def axis_record(data_type: int, label: str, unit: str) -> str:
    """Return one of the records 8 to 11."""
    return f"{data_type:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}"


def _spacing(freq_hz: NDArray[np.float64]) -> tuple[str, str | None]:
    """Return first line and spacing as text; no spacing if it is uneven."""
    step = (freq_hz[-1] - freq_hz[0]) / max(freq_hz.size - 1, 1)
    texts = _short(freq_hz[0]), _short(step)
    written = float(texts[0]) + float(texts[1]) * np.arange(freq_hz.size)
    is_even = np.allclose(written, freq_hz, rtol=_EVEN, atol=0.0)
    return texts if is_even else (_short(0.0), None)


def _text_lines(
    freq_hz: NDArray[np.float64], values: NDArray[np.complex128] | NDArray[np.float64], is_even: bool, single: bool
) -> list[str]:
    """Return record 12: four or six numbers a line; with an uneven spacing, each value after its frequency."""
    numbers = [f"{x:13.5E}" if single else f"{x:20.11E}" for x in np.ascontiguousarray(values).view(np.float64)]
    if is_even:
        a_line = 6 if single else 4
        return ["".join(numbers[i : i + a_line]) for i in range(0, len(numbers), a_line)]
    of_each = 2 if np.iscomplexobj(values) else 1
    parts = [(_short(f), *numbers[of_each * i : of_each * (i + 1)]) for i, f in enumerate(freq_hz)]
    a_line = (6 if single else 4) // (1 + of_each) if single or of_each == 1 else 1
    return ["".join(x for part in parts[i : i + a_line] for x in part) for i in range(0, len(parts), a_line)]


def _short(value: float) -> str:
    """Return a number in 13 columns, with its point and as many digits as possible."""
    texts = (f"{value:#.{digits}g}" for digits in range(12, 4, -1))
    return f"{next(text for text in texts if len(text) < 13):>13}"
