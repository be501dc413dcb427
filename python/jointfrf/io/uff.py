"""FRFs of Universal Files, read and written (datasets 58, 151, 164, 2411)."""

from __future__ import annotations

import codecs
from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointfrf.choices import FRF_FORMATS
from jointfrf.errors import FileContentError
from jointfrf.files import HEAD, ReadLimit, head_of, write_file
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, ROUND_OFF, Channel, FrfSet, same_frf
from jointfrf.frf.merge import same_lines
from jointfrf.io.arrays import contradiction, finite_frfs
from jointfrf.io.file_format import TIME_DATA, FileFormat, Reading
from jointfrf.io.functions import difference_of, repetition_note
from jointfrf.io.labels import DIRECTION_CODES, ChannelNamer
from jointfrf.io.uff_axes import NodeAxes, global_channels, node_axes, node_coordinates
from jointfrf.io.uff_file import UniversalFile, name_some
from jointfrf.io.uff_function import (
    DELIMITER,
    FunctionHeader,
    axis_record,
    function_dataset,
    function_values,
    kind_of_frf,
    ordinate_factor,
    ordinate_quantity,
    place_fields,
    read_header,
)
from jointfrf.io.uff_window import note_exponential_windows
from jointfrf.io.units import parse_frequency_unit
from jointfrf.kernel.arguments import check_type
from jointfrf.spelling import some_of

__all__ = ["UNIVERSAL_FILE", "read_uff", "write_uff"]

#: Function types of dataset 58.
_TIME_HISTORY, _FRF, _COHERENCE = 1, 4, 6
#: Number of decades beyond which values are in the wrong byte order: those of a measurement span fewer.
_MOST_DECADES = 60
#: Number of kinds of ordinates that a message names.
_SHOWN = 3
#: Number of columns of a line of text.
_WIDTH = 80
#: Codes of directions in Universal Files.
_CODES = {direction: code for code, direction in DIRECTION_CODES.items()}
#: Records of the axes of a coherence, which has no unit.
_COHERENCE_AXES = [axis_record(0, "Coherence", "NONE"), axis_record(0, "NONE", "NONE")]


_Number = TypeVar("_Number", np.float64, np.complex128)


@dataclass(frozen=True, slots=True)
class _Frf:
    """Place of an FRF in the file, and its meaning."""

    dataset: int
    header: FunctionHeader
    channels: tuple[Channel, Channel]
    quantity: str
    factor: float
    stated: str

    def __str__(self) -> str:
        return f"{self.channels[0]} / {self.channels[1]}"


@dataclass
class _Content:
    """Content of the headers of the file.

    Attributes
    ----------
    frfs : list of _Frf
        FRFs that are wanted and can be used.
    coherences : list of (int, FunctionHeader, (Channel, Channel))
        Dataset, header, response and reference of coherences.
    functions : dict of int to list of int
        Datasets by the type of their function.
    unusable : dict of str to list of int
        Datasets of FRFs that cannot be used, by the reason.
    numbered : dict of int to set of int
        Numbers that the nodes of the file have in the set; several if components have equal node numbers.
    """

    frfs: list[_Frf] = field(default_factory=list)
    coherences: list[tuple[int, FunctionHeader, tuple[Channel, Channel]]] = field(default_factory=list)
    functions: dict[int, list[int]] = field(default_factory=dict)
    unusable: dict[str, list[int]] = field(default_factory=dict)
    numbered: dict[int, set[int]] = field(default_factory=dict)


class _UnusableFrfError(Exception):
    """Reason for which an FRF of a sound file is omitted."""


def read_uff(
    path: str | PathLike[str],
    quantity: str | None = None,
    *,
    force_quantity: bool = False,
    nodes: Collection[int] | None = None,
    limit_gb: float | None = None,
    unit: str = "",
) -> FrfSet:
    """Return the FRFs of a Universal File.

    Parameters
    ----------
    path : path-like
        Name of an ASCII or binary (58b) Universal File.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity of every FRF of the file, if its data types do not state it or contradict its units. By default it
        follows from the file.
    force_quantity : bool
        Whether `quantity` and `unit` are used even if data types and units of the file agree on another one, default
        False.
    nodes : collection of int, optional
        Nodes between which FRFs are read; all by default. Headers are read first, and then only the wanted FRFs.
    limit_gb, unit : optional
        Largest size in GB, and unit of the FRFs; see `read_frfs`.

    Returns
    -------
    FrfSet
        All FRFs of motion per force (function type 4), in SI units, channels in the order of the file, with their
        coherence (function type 6) if the file contains it. If quantities are mixed, all are converted to the one that
        is differentiated most often.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        The file cannot be read, lacks something such as a unit, or contradicts `quantity` or `unit`. The message states
        the error and the dataset, counted from 1.

    Warns
    -----
    FileContentWarning
        Data were omitted; each kind is reported once, with its datasets:

        - a dataset that the end of the file cuts short
        - FRFs without node or direction, of unknown kind or not of motion per force (an error if no others remain)
        - further FRFs between the same channels
        - a line at 0 Hz that is not a number
        - local coordinates, and coordinates without a unit
        - FRFs in local directions that cannot be transformed

    See Also
    --------
    read_frfs : read files of any format.
    write_uff : write a Universal File.

    Notes
    -----
    Units come from the labels of dataset 58. Without labels, the values are divided by the length and force factors of
    dataset 164, according to its definition [1]_; coordinates always are. A label that is not understood is an error.

    Directions of nodes with a local displacement system (datasets 15, 2411, 18, 2420) become global ones. Axes along
    global ones only rename the channels. Other axes need all three directions of a node, as responses or as forces.

    References
    ----------
    .. [1] Structural Dynamics Research Laboratory, University of Cincinnati, Universal File Formats, datasets 58 and
       164. https://www.ceas3.uc.edu/sdrluff/

    Examples
    --------
    >>> import jointfrf.io
    >>> frfs = jointfrf.io.read_uff("lap_joint.uff")  # doctest: +SKIP
    >>> h = frfs.receptance().matrix(["102:+y", "202:+y"], ["102:+y", "202:+y"])  # doctest: +SKIP
    """
    reading = Reading.checked(quantity, force_quantity, nodes, unit=unit)
    reading.check_options(UNIVERSAL_FILE.takes, str(path))
    file = Path(path)
    head_of(file, limit_gb)
    found = _read(file, ReadLimit(file, limit_gb), reading)
    reading.warn()
    return found


def _read(path: Path, limit: ReadLimit, reading: Reading) -> FrfSet:
    """Return the FRFs of a file; if it is one of several, coherences alone are enough, and FRFs are then NaN."""
    file = UniversalFile(path, reading)
    content = _describe(file, reading)
    only_coherence = reading.is_part and not content.frfs and not content.unusable and content.coherences
    if not content.frfs and not only_coherence:
        raise _no_frf(file, content, reading.nodes)
    for reason, numbers in content.unusable.items():
        file.note(f"FRF left out: {reason}", *numbers)
    for kind, numbers in content.functions.items():
        if kind not in (_FRF, _COHERENCE):
            file.note(f"not read, no FRF: {file.function_name(kind)}", *numbers)
    first, again = _unique(content.frfs)
    pairs = [frf.channels for frf in first] or [channels for *_, channels in content.coherences]
    matrix = _Matrix(pairs)
    freq_hz, h, common = _values(file, first, matrix, limit)
    if freq_hz is not None and h is not None:
        _note_repetitions(file, again, matrix, common, freq_hz, h)
    freq_hz, coherence = _coherence(file, content, matrix, freq_hz, limit)
    if h is None:
        limit.take(matrix.bytes(freq_hz.size))
        h = np.full((freq_hz.size, *matrix.shape), np.nan + 0j)
    coordinates, axes = _of_nodes(file, content, {channel.node for pair in pairs for channel in pair})
    responses, excitations = matrix.responses, matrix.excitations
    if axes:
        limit.take(matrix.bytes(freq_hz.size))
        responses, excitations, h, coherence = _in_global_axes(file, axes, matrix, h, coherence)
    note_exponential_windows(file)
    stated = _some(frf.stated for frf in first)
    found = FrfSet(freq_hz, responses, excitations, h, common, coordinates, str(path), coherence, None, stated)
    left_out: list[str] = []
    if first:
        try:
            found, left_out = finite_frfs(found)
        except ValueError as error:
            raise file.error(f"contains no FRF that can be used: {error}") from error
    reading.notes.extend([*file.notes(), *(f"{path}: {each}" for each in left_out)])
    return found


def _of_nodes(
    file: UniversalFile, content: _Content, wanted: Collection[int]
) -> tuple[dict[int, NDArray[np.float64]], NodeAxes]:
    """Return coordinates and local axes of the nodes of the set.

    Datasets do not distinguish nodes of several components with the same number: these have no coordinates, and their
    local axes cannot be computed.
    """
    shared = [node for node, numbers in content.numbered.items() if len(numbers) > 1]
    number_of = {node: next(iter(numbers)) for node, numbers in content.numbered.items() if len(numbers) == 1}
    nodes = [node for node, number in number_of.items() if number in wanted]
    places = {number_of[node]: place for node, place in node_coordinates(file, nodes).items()}
    if shared and file.datasets(15, 2411):
        file.note(f"coordinates of {name_some('node', shared)} are left out: several components have these numbers")
    axes = {number_of[node]: own for node, own in node_axes(file, nodes).items()}
    unknown = {number: None for node in node_axes(file, shared) for number in content.numbered[node]}
    return places, axes | unknown


def _in_global_axes(
    file: UniversalFile,
    axes: NodeAxes,
    matrix: _Matrix,
    h: NDArray[np.complex128],
    coherence: NDArray[np.float64] | None,
) -> tuple[tuple[Channel, ...], tuple[Channel, ...], NDArray[np.complex128], NDArray[np.float64] | None]:
    """Return channels, FRFs and coherences in global directions; a sum of channels has no coherence."""
    rows, responses, h = global_channels(file, axes, matrix.responses, h)
    columns, excitations, h = global_channels(file, axes, matrix.excitations, h.swapaxes(1, 2))
    if not (responses and excitations):
        raise file.error(
            "contains FRFs in local directions only; set the displacement system of the nodes to 0 and state "
            "directions in a channel table"
        )
    if coherence is not None:
        unknown = (np.array(rows) < 0)[:, None] | (np.array(columns) < 0)
        coherence = np.where(unknown, np.nan, coherence[:, rows][:, :, columns])
    return responses, excitations, h.swapaxes(1, 2), coherence


class _Matrix:
    """Rows and columns of FRFs in the order in which the file names their channels."""

    def __init__(self, pairs: list[tuple[Channel, Channel]]) -> None:
        self.responses = tuple(dict.fromkeys(pair[0] for pair in pairs))
        self.excitations = tuple(dict.fromkeys(pair[1] for pair in pairs))
        self.shape = len(self.responses), len(self.excitations)
        row_of = {channel: i for i, channel in enumerate(self.responses)}
        column_of = {channel: j for j, channel in enumerate(self.excitations)}
        self.place_of = {pair: (row_of[pair[0]], column_of[pair[1]]) for pair in pairs}

    def bytes(self, n_freq: int) -> int:
        """Return the number of bytes of all its FRFs."""
        return 16 * n_freq * self.shape[0] * self.shape[1]


def _describe(file: UniversalFile, reading: Reading) -> _Content:
    """Return the wanted and usable FRFs, and the content of their headers."""
    content, headers = _Content(), dict[int, FunctionHeader]()
    for number in file.datasets(58):
        with file.damage_named(number):
            headers[number] = read_header(file.content(number, HEAD))
        content.functions.setdefault(headers[number].kind, []).append(number)
    namer = reading.mapping.namer
    for kind in (_FRF, _COHERENCE):
        numbers = content.functions.get(kind, [])
        names = [reading.mapping.names_of(side, len(numbers), str(file.path)) for side in ("responses", "excitations")]
        for place, number in enumerate(numbers):
            header = headers[number]
            given = [None if own is None else own[place] for own in names]
            try:
                channels = _channels(file, header, namer, given, content)
                if reading.nodes is not None and not {each.node for each in channels} <= reading.nodes:
                    continue
                if kind == _COHERENCE:
                    content.coherences.append((number, header, channels))
                else:
                    content.frfs.append(_describe_frf(file, number, header, channels, reading))
            except _UnusableFrfError as error:
                if reading.nodes is not None and not {header.response[1], header.reference[1]} <= reading.nodes:
                    continue
                if kind == _COHERENCE:
                    file.note(f"coherence left out: {error}", number)
                else:
                    content.unusable.setdefault(str(error), []).append(number)
    return content


def _no_frf(file: UniversalFile, content: _Content, nodes: Collection[int] | None) -> FileContentError:
    """Return the error for a file without any FRF, without a usable one, or without a wanted one."""
    if content.unusable:
        why = "; ".join(f"{reason} ({name_some('dataset', numbers)})" for reason, numbers in content.unusable.items())
        return file.error(f"contains no FRF that can be used: {why}")
    if _FRF in content.functions and nodes is not None:
        return file.error(f"contains no FRF between {name_some('node', sorted(nodes))}")
    times = f"; {TIME_DATA}" if _TIME_HISTORY in content.functions else ""
    return file.error(f"contains {file.held_without_frf(content.functions)}{times}")


def _describe_frf(
    file: UniversalFile, number: int, header: FunctionHeader, channels: tuple[Channel, Channel], reading: Reading
) -> _Frf:
    """Return quantity and factor to SI of one FRF."""
    quantity, forced = reading.quantity, reading.forced
    _check_form(file, number, header)
    numerator, denominator = header.numerator, header.denominator
    other = kind_of_frf(numerator, denominator)
    if other is not None:
        raise _UnusableFrfError(f"it is {other}, not motion per force")
    system = file.unit_system(number)
    said = ordinate_quantity(numerator, denominator, channels)
    if quantity and said and said != quantity and not forced:
        contradicts = False
        with suppress(ValueError):  # if the file contradicts itself, the caller decides
            ordinate_factor(numerator, denominator, channels, said, system, uses_labels=True, note=lambda _: None)
            contradicts = True
        if contradicts:
            words = f"{numerator.words} per {denominator.words} in dataset {number}"
            raise file.error(contradiction(said, quantity, words))
    found = quantity or said
    if found is None:
        raise _UnusableFrfError(f"data types {numerator} per {denominator} do not state its quantity; give quantity=")
    try:
        by_file, why = ordinate_factor(
            numerator,
            denominator,
            channels,
            found,
            system,
            uses_labels=quantity is None,
            note=lambda sentence: file.note(sentence, number),
        )
    except ValueError as error:
        raise file.error(f"contradicts itself in dataset {number}: {error}; give quantity=") from error
    factor = _agreed_factor(file, number, channels, by_file, f"{numerator.label}' / '{denominator.label}")
    if factor is None:
        raise file.error(f"cannot be scaled: {why} (dataset {number}); give unit=, such as g/N or (m/s^2)/N")
    if not 0.0 < factor < np.inf:
        raise file.error(f"has a unit in dataset {number} that cannot be converted to SI")
    stated = f"{numerator.words} per {denominator.words}"
    stated += f", unit stated: {file.reading.units.frf}" if file.reading.units.frf else ""
    return _Frf(number, header, channels, found, factor, stated)


def _agreed_factor(
    file: UniversalFile, number: int, channels: tuple[Channel, Channel], by_file: float | None, label: str
) -> float | None:
    """Return the factor to SI by the unit that the user states for translations per force, and by the file."""
    stated = file.reading.units.frf_to_si
    if stated is not None and any(channel.is_rotation for channel in channels):
        if by_file is None and stated != 1.0:
            raise file.error(
                f"has a rotation in dataset {number} ({channels[0]} / {channels[1]}), of which unit= is no unit; give "
                "SI units"
            )
        return by_file or 1.0
    try:
        return file.reading.agreed("FRFs", stated, by_file, label)
    except ValueError as error:
        raise file.error(f"(dataset {number}): {error}") from error


def _check_form(file: UniversalFile, number: int, header: FunctionHeader) -> None:
    """Raise an error for forms of dataset 58 that would be read wrongly."""
    if header.number_type in (2, 4):
        raise _UnusableFrfError("its values are real numbers, without phase")
    if header.number_type not in (5, 6):
        raise file.error(f"is damaged: ordinate data type {header.number_type} in dataset {number}")
    if not header.is_supported:
        raise file.error(f"contains binary numbers in dataset {number} that are not IEEE 754 after 11 lines of text")


def _channels(
    file: UniversalFile, header: FunctionHeader, namer: ChannelNamer, given: Sequence[Any], content: _Content
) -> tuple[Channel, Channel]:
    """Return response and reference: by their names if the user gives them, else by the header."""
    found = []
    sides = ("response", header.response, given[0]), ("reference", header.reference, given[1])
    for role, (entity, node, code), name in sides:
        if name is None and node < 1:
            raise _UnusableFrfError(f"it names no {role} node (node {node}); give mapping responses= and excitations=")
        if name is None and code not in DIRECTION_CODES and (code != 0 or namer.direction is None):
            raise _UnusableFrfError(f"it names no {role} direction (code {code}); give mapping direction=z")
        component = "" if entity.upper() == "NONE" else entity
        try:
            if name is None:
                found.append(namer.numbered(component, node, DIRECTION_CODES.get(code, ""), f"{role}s"))
                content.numbered.setdefault(node, set()).add(found[-1].node)
            else:
                found.append(namer.channel(f"{role}s", name))
        except ValueError as error:
            raise file.error(str(error)) from error
    return found[0], found[1]


def _unique(frfs: list[_Frf]) -> tuple[list[_Frf], list[tuple[_Frf, _Frf]]]:
    """Return the first FRF between the same channels, and each further one with the first."""
    first: dict[tuple[Channel, Channel], _Frf] = {}
    again = []
    for frf in frfs:
        kept = first.setdefault(frf.channels, frf)
        if kept is not frf:
            again.append((kept, frf))
    return list(first.values()), again


def _note_repetitions(
    file: UniversalFile,
    again: list[tuple[_Frf, _Frf]],
    matrix: _Matrix,
    common: str,
    lines: NDArray[np.float64],
    h: NDArray[np.complex128],
) -> None:
    """Add notes on repeated FRFs between the same channels, and their difference from the one in use."""
    worst, numbers = (0.0, ""), []
    for kept, frf in again:
        freq_hz, value = _read_function(file, frf.dataset, frf.header, str(frf), np.complex128)
        if not same_lines(lines, freq_hz):
            file.note("a further FRF between the same channels is left out: it has other frequency lines", frf.dataset)
            continue
        share = difference_of(h[:, *matrix.place_of[frf.channels]], _as_common(frf, common, freq_hz, value))
        worst = max(worst, (share, f"{frf}, dataset {kept.dataset} is used"))
        numbers.append(frf.dataset)
    if numbers:
        file.note(repetition_note(*worst, len(numbers)), *numbers)


def _as_common(
    frf: _Frf, common: str, freq_hz: NDArray[np.float64], value: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Return an FRF in SI units, converted to the common quantity."""
    power = POWER_OF_I_OMEGA[common] - POWER_OF_I_OMEGA[frf.quantity]
    with np.errstate(over="ignore", invalid="ignore"):
        return value * frf.factor * (2j * np.pi * freq_hz) ** power if power else value * frf.factor


def _values(
    file: UniversalFile, frfs: list[_Frf], matrix: _Matrix, limit: ReadLimit
) -> tuple[NDArray[np.float64] | None, NDArray[np.complex128] | None, str]:
    """Return frequency lines, the FRFs in SI units, and their common quantity."""
    common = max((frf.quantity for frf in frfs), key=POWER_OF_I_OMEGA.__getitem__, default="receptance")
    lines: NDArray[np.float64] | None = None
    h: NDArray[np.complex128] | None = None
    for frf in frfs:
        freq_hz, value = _read_function(file, frf.dataset, frf.header, str(frf), np.complex128)
        if lines is None or h is None:
            lines = freq_hz
            limit.take(matrix.bytes(freq_hz.size))
            h = np.full((freq_hz.size, *matrix.shape), np.nan + 0j)
        elif not same_lines(lines, freq_hz):
            held = [f"{_lines(f)} in dataset {each.dataset} ({each})" for f, each in ((lines, frfs[0]), (freq_hz, frf))]
            raise file.error(f"contains FRFs at different frequencies: {held[0]}, {held[1]}")
        h[:, *matrix.place_of[frf.channels]] = _as_common(frf, common, freq_hz, value)
    return lines, h, common


def _coherence(
    file: UniversalFile, content: _Content, matrix: _Matrix, lines: NDArray[np.float64] | None, limit: ReadLimit
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Return frequency lines, and the coherence of the FRFs; None if the file contains none of it."""
    found: NDArray[np.float64] | None = None
    for number, header, channels in content.coherences:
        place = next((matrix.place_of[pair] for pair in same_frf(*channels) if pair in matrix.place_of), None)
        if place is None:
            continue
        freq_hz, value = _read_function(file, number, header, f"coherence {channels[0]} / {channels[1]}", np.float64)
        lines = freq_hz if lines is None else lines
        if not same_lines(lines, freq_hz):
            file.note("coherence left out: its frequency lines differ from the lines of the FRFs", number)
            continue
        if np.isnan(value[0]) and freq_hz[0] == 0.0:
            value[0] = 0.0  # 0/0: there is no signal
        if not (value.min() >= 0.0 and value.max() <= 1.0 + ROUND_OFF):
            file.note("coherence left out: it is not from 0 to 1", number)
            continue
        if found is None:
            limit.take(matrix.bytes(lines.size) // 2)
            found = np.full((lines.size, *matrix.shape), np.nan)
        if np.isfinite(found[0, *place]):
            file.note("a second coherence between the same channels is left out", number)
            continue
        found[:, *place] = value
    if lines is None:
        raise file.error("contains no coherence that can be used")
    return lines, found


def _read_function(
    file: UniversalFile, dataset: int, header: FunctionHeader, name: str, dtype: type[_Number]
) -> tuple[NDArray[np.float64], NDArray[_Number]]:
    """Return frequencies in Hz and values in the file's units of one function."""
    if header.number_type not in (2, 4, 5, 6):
        raise file.error(f"is damaged: ordinate data type {header.number_type} in dataset {dataset} ({name})")
    with file.damage_named(dataset):
        lines, value = function_values(file.content(dataset), header)
    n = header.n_values
    if np.iscomplexobj(value) and dtype is np.float64:
        value = value.real
    if n < 1 or not n <= value.size <= n + 1:
        raise file.error(f"is damaged: dataset {dataset} ({name}) has {value.size} of {n} values")
    if header.is_binary and _is_scrambled(value):
        raise file.error(f"is damaged: in dataset {dataset} ({name}) the byte order is not the one that is stated")
    freq_hz = lines[:n] * _hertz(file, dataset, header, name)
    if not np.isfinite(freq_hz).all() or freq_hz[0] < 0.0 or (np.diff(freq_hz) <= 0.0).any():
        raise file.error(f"is damaged: the frequencies of dataset {dataset} ({name}) do not increase from 0 Hz or more")
    return freq_hz, np.array(value[:n], dtype=dtype)


def _hertz(file: UniversalFile, dataset: int, header: FunctionHeader, name: str) -> float:
    """Return the unit of the abscissa in Hz, stated by the user or by the file."""
    kind, label = header.abscissa.data_type, header.abscissa.label
    if kind not in (0, 1, 18):
        raise file.error(f"gives dataset {dataset} ({name}) over {header.abscissa.name}, not frequency")
    # Time is in s in every Universal File, so that a frequency without a label is in Hz.
    found = parse_frequency_unit("Hz" if not label and kind == 18 else label)
    try:
        factor = file.reading.agreed("frequencies", parse_frequency_unit(file.reading.units.frequency), found, label)
    except ValueError as error:
        raise file.error(f"(dataset {dataset}): {error}") from error
    if factor is None:
        why = f"the unit '{label}' of the frequencies is not understood" if label else "the frequencies have no unit"
        raise file.error(f"cannot be scaled: {why} (dataset {dataset}); give unit= with frequency=Hz, kHz or rad/s")
    return factor


def _is_scrambled(value: NDArray[Any]) -> bool:
    """Return whether values span more decades than any measurement, as numbers in the wrong byte order do."""
    parts = abs(np.ascontiguousarray(value).view(np.float64))
    parts = parts[np.isfinite(parts) & (parts > 0.0)]
    return bool(parts.size and np.log10(parts.max()) - np.log10(parts.min()) > _MOST_DECADES)


def _lines(freq_hz: NDArray[np.float64]) -> str:
    return f"{freq_hz.size} lines {freq_hz[0]:.6g} to {freq_hz[-1]:.6g} Hz"


def _some(texts: Iterable[str]) -> str:
    """Join the first few different texts."""
    return some_of(list(dict.fromkeys(texts)), _SHOWN, "; ")


def write_uff(
    path: str | PathLike[str], frfs: FrfSet, *, title: str = "", binary: bool = True, single: bool = False
) -> None:
    """Write measured FRFs as a Universal File.

    Parameters
    ----------
    path : path-like
        Name of the file, in a folder that exists; an older file is replaced as a whole or not at all.
    frfs : FrfSet
        FRFs to write, in their quantity; missing ones (NaN on all lines) are omitted. Coordinates and coherence are
        written if they are known. The format has no place for numbers of averages.
    title : str
        Title in one line of ASCII, at most 80 characters, for the header and for every FRF.
    binary : bool
        Whether to write dataset 58b: the values as IEEE numbers, little-endian. Unevenly spaced lines are always
        written as text, because programs differ in how they read them from 58b.
    single : bool
        Whether to write values in single precision, as most test systems do, not in double.

    Raises
    ------
    ValueError
        The title cannot be written, an FRF is NaN or infinite on some lines, or there is no FRF.
    OSError
        The file cannot be written; nothing is left behind.

    See Also
    --------
    read_uff : read the FRFs again.

    Notes
    -----
    Units are SI and stated twice, by dataset 164 and by the labels of each FRF. The definition of the datasets [1]_ has
    13 columns for a frequency: frequencies of 1 Hz and more come back to 1e-9 of themselves. Values come back to 12
    digits from text (6 with `single`), exactly from binary. No date is written: the same FRFs give the same bytes.

    References
    ----------
    .. [1] Structural Dynamics Research Laboratory, University of Cincinnati, Universal File Formats, datasets 58, 151,
       164 and 2411. https://www.ceas3.uc.edu/sdrluff/

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from jointfrf.io import Channel, FrfSet, read_uff, write_uff
    >>> point = (Channel(1, "+y"),)
    >>> frfs = FrfSet(np.array([10.0, 20.0]), point, point, np.array([[[1.0 + 2.0j]], [[3.0]]]), "mobility")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "point.uff"
    ...     write_uff(path, frfs)
    ...     again = read_uff(path)
    >>> again.quantity, again.h[:, 0, 0].tolist()
    ('mobility', [(1+2j), (3+0j)])
    """
    check_type("frfs", frfs, FrfSet)
    check_type("title", title, str)
    if not (title.isascii() and title.isprintable() and len(title) <= _WIDTH):
        raise ValueError(f"title {title!r} is not one line of at most {_WIDTH} ASCII characters")
    frfs.check_whole()
    parts = [_dataset(*records) for records in (_title_records(title), _unit_records(), _node_records(frfs)) if records]
    for i, j in np.argwhere(frfs.measured):
        channels = frfs.responses[i], frfs.excitations[j]
        places = " ".join(place_fields(each.node, each.sign * _CODES["+" + each.axis]) for each in channels)
        functions: list[tuple[str, int, list[str], NDArray[Any]]] = [("FRF", _FRF, _ordinate(frfs, *channels), frfs.h)]
        if frfs.coherence is not None and np.isfinite(frfs.coherence[:, i, j]).all():
            functions.append(("coherence", _COHERENCE, _COHERENCE_AXES, frfs.coherence))
        for name, kind, axes, values in functions:
            texts = f"{name} {channels[0]} / {channels[1]}", title
            parts.append(
                function_dataset(texts, kind, places, axes, frfs.freq_hz, values[:, i, j], binary=binary, single=single)
            )
    write_file(Path(path), b"".join(parts))


def _dataset(*records: str) -> bytes:
    return "\n".join([DELIMITER, *records, DELIMITER, ""]).encode("ascii")


def _title_records(title: str) -> list[str]:
    none = f"{'NONE':<10}{'NONE':<10}"
    return ["   151", "NONE", title or "NONE", "jointfrf", f"{none}{0:10d}{0:10d}{0:10d}", none, "jointfrf", none]


def _unit_records() -> list[str]:
    factors = "".join(_double(1.0, 17) for _ in range(3))
    return ["   164", f"{1:10d}{'SI: m, N':<20}{2:10d}", factors, _double(273.15, 17)]


def _node_records(frfs: FrfSet) -> list[str]:
    records = []
    for node, place in sorted(frfs.coordinates.items()):
        records += [f"{node:10d}{0:10d}{0:10d}{1:10d}", "".join(_double(x, 16) for x in place)]
    return ["  2411", *records] if records else []


def _ordinate(frfs: FrfSet, response: Channel, excitation: Channel) -> list[str]:
    """Write records 9 and 10 of an FRF: displacement, velocity or acceleration per force."""
    power = POWER_OF_I_OMEGA[frfs.quantity]
    motion = ("rad" if response.is_rotation else "m") + ("", "/s", "/s^2")[power]
    force = "N m" if excitation.is_rotation else "N"
    return [axis_record((8, 11, 12)[power], "Response", motion), axis_record(13, "Excitation", force)]


def _double(value: float, digits: int) -> str:
    """Write a number in 25 columns with the exponent letter of Fortran's double precision."""
    return f"{value:25.{digits - 1}E}".replace("E", "D")


def _begins_dataset(head: bytes) -> bool:
    lines = head.removeprefix(codecs.BOM_UTF8).splitlines()
    return next((line for line in lines if line.strip()), b"").strip() == b"-1"


UNIVERSAL_FILE = FileFormat(
    name=FRF_FORMATS["uff"].name,
    suffixes=FRF_FORMATS["uff"].suffixes,
    content="datasets 58 and 58b (FRFs, coherence), 15, 2411 (nodes), 164 (units), 18, 2420 (axes)",
    has_mark=_begins_dataset,
    looks_alike=lambda path, _: path.suffix.lower() in (".uff", ".unv"),
    read=_read,
    write=write_uff,
    takes=("responses", "excitations", "direction", "components", "frequency", "coordinates"),
)
