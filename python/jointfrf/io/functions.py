"""FRFs that a file contains one by one, as Simcenter Testlab and sdynpy write them, combined into a matrix."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.frf.frf_set import Channel
from jointfrf.frf.merge import same_lines
from jointfrf.io.file_format import TIME_DATA, FrfArrays, FrfMapping
from jointfrf.io.labels import ChannelNamer
from jointfrf.io.units import SAME_FACTOR, parse_frequency_unit, parse_unit, si_label
from jointfrf.spelling import some_of

__all__ = [
    "LooseFunction",
    "arrays_of_functions",
    "difference_of",
    "functions_of_sdynpy",
    "functions_of_testlab",
    "repetition_note",
]

#: The function types of time histories and FRFs in sdynpy, as in Universal Files.
_TIME, _FRF = 1, 4
#: Beginnings of the types of FRFs, and types of ordinary coherence, in Testlab: letters and digits in lower case.
_FRF_TYPES = ("frf", "frequencyresponse", "h1", "h2", "hv", "transferfunction", "inertance", "accelerance", "mobility",
              "receptance")  # fmt: skip
_COHERENCE_TYPES = ("coherence", "ordinarycoherence", "coherencefunction")
#: Number of types of functions that a message names.
_SHOWN = 5


class LooseFunction(NamedTuple):
    """One FRF, or the coherence of one if its values are real."""

    response: Channel
    excitation: Channel
    freq_hz: NDArray[np.float64]
    values: NDArray[Any]
    is_coherence: bool = False
    unit: str = ""
    quantity: str = ""
    frequency_unit: str = ""

    def __str__(self) -> str:
        return f"{'coherence' if self.is_coherence else 'FRF'} {self.response} / {self.excitation}"


def arrays_of_functions(functions: Sequence[LooseFunction], where: str, limit: ReadLimit | None) -> FrfArrays:
    """Return functions as matrices.

    Returns
    -------
    FrfArrays
        Matrices with the first of several FRFs between the same channels; a note states the largest difference of
        further ones.

    Raises
    ------
    FileContentError
        There is no FRF; functions differ in frequency lines, units or quantities; the matrix of all channels is
        beyond the limit.
    """
    frfs = [each for each in functions if not each.is_coherence]
    if not frfs:
        raise FileContentError(f"{where} contains no FRF")
    first = frfs[0]
    responses = tuple(dict.fromkeys(each.response for each in frfs))
    excitations = tuple(dict.fromkeys(each.excitation for each in frfs))
    row_of = {channel: i for i, channel in enumerate(responses)}
    column_of = {channel: j for j, channel in enumerate(excitations)}
    shape = (first.freq_hz.size, len(responses), len(excitations))
    if limit is not None:
        limit.take(3 * 8 * shape[0] * shape[1] * shape[2])
    h, coherence = np.full(shape, np.nan + 0j), np.full(shape, np.nan)
    seen: set[tuple[Channel, Channel, bool]] = set()
    again: list[tuple[float, str]] = []
    for each in functions:
        if each.values.shape != each.freq_hz.shape:
            raise FileContentError(f"{where}: {each} has {each.values.size} values at {each.freq_hz.size} lines")
        if not same_lines(each.freq_hz, first.freq_hz):
            raise FileContentError(f"{where}: {first} and {each} have different frequency lines")
        is_first = (*each[:2], each.is_coherence) not in seen
        seen.add((*each[:2], each.is_coherence))
        if each.is_coherence:
            if is_first and each.response in row_of and each.excitation in column_of:
                coherence[:, row_of[each.response], column_of[each.excitation]] = each.values
            continue
        if each[5:] != first[5:]:
            said = [f"{one.quantity} [{one.unit or 'no unit'}]".strip() for one in (first, each)]
            raise FileContentError(f"{where}: {first} is {said[0]}, {each} is {said[1]}; export them alike")
        place = (slice(None), row_of[each.response], column_of[each.excitation])
        if is_first:
            h[place] = each.values
        else:
            again.append((difference_of(h[place], np.asarray(each.values, np.complex128)), str(each)))
    known = None if np.isnan(coherence).all() else coherence
    notes = [repetition_note(*max(again), len(again))] if again else []
    return FrfArrays(
        first.freq_hz, h, "freq,out,in", responses, excitations, first.quantity, first.unit, known, notes=notes,
        frequency_unit=first.frequency_unit,
    )  # fmt: skip


def difference_of(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> float:
    """Return the difference of two FRFs between the same channels: median over the lines, relative to the first."""
    size = abs(one)
    with np.errstate(invalid="ignore", over="ignore"):
        apart = abs(one - other)[size > 0] / size[size > 0]
    known = apart[np.isfinite(apart)]
    return float(np.median(known)) if known.any() else 0.0


def repetition_note(share: float, which: str, count: int) -> str:
    """State that repeated FRFs between the same channels are omitted, and the largest difference from the first."""
    apart = f"they differ by up to {100 * share:.2g} % ({which})" if share else "their values are the same"
    plural = "s" if count > 1 else ""
    return f"{count} further FRF{plural} between the same channels left out, the first is used; {apart}"


def functions_of_sdynpy(fields: Mapping[str, Any], mapping: FrfMapping, where: str) -> list[LooseFunction]:
    """Return the functions of a structured array of sdynpy (`NDDataArray.save`); none if there is no such array.

    Raises
    ------
    FileContentError
        They are not FRFs, or not each between one response and one reference.
    """
    data, kind = fields.get("data"), fields.get("function_type")
    names = set(data.dtype.names or ()) if isinstance(data, np.ndarray) else set()
    is_short = {"abscissa_start", "abscissa_step"} <= set(fields)
    if not (names >= {"ordinate", "coordinate"} and ("abscissa" in names or is_short)):
        return []
    if kind != _FRF:
        hint = TIME_DATA if kind == _TIME else f"save FRFs (type {_FRF})"
        raise FileContentError(f"{where} contains functions of type {kind} of sdynpy; {hint}")
    found, namer = [], mapping.namer
    for row in np.ravel(np.asarray(data)):
        try:
            places = [(each["node"], each["direction"]) for each in np.ravel(row["coordinate"])]
            channels = [namer.channel("coordinates", place) for place in places]
        except (ValueError, TypeError) as error:
            raise FileContentError(f"{where} {error}") from error
        if len(channels) != 2:
            raise FileContentError(f"{where} has functions without one response and one reference each")
        values = np.ravel(row["ordinate"])
        found.append(LooseFunction(channels[0], channels[1], _abscissa(fields, row, values.size, where), values))
    return found


def _abscissa(fields: Mapping[str, Any], row: Any, size: int, where: str) -> NDArray[np.float64]:
    """Return the lines of a function of sdynpy: one by one, or by start and step of all functions."""
    if "abscissa" in row.dtype.names:
        return np.ravel(row["abscissa"])
    try:
        start, step = (float(np.asarray(fields[name]).item()) for name in ("abscissa_start", "abscissa_step"))
    except (ValueError, TypeError) as error:
        raise FileContentError(f"{where} is damaged: abscissa_start and abscissa_step are not numbers") from error
    return np.asarray(start + step * np.arange(size))


class _Column(NamedTuple):
    """One function of a structure of Testlab: lines, values, unit, and the names of its channels if there are any."""

    freq_hz: NDArray[np.float64]
    values: NDArray[Any]
    is_coherence: bool
    unit: str
    response: str | None
    excitation: str | None
    frequency_unit: str


def functions_of_testlab(fields: Any, mapping: FrfMapping, where: str) -> tuple[list[LooseFunction], list[str]] | None:
    """Return the FRFs and coherences of all structures of Simcenter Testlab, with notes on functions that are not read.

    Returns
    -------
    list of LooseFunction, list of str; or None
        FRFs with coherences, and notes; None without such a structure.

    Raises
    ------
    FileContentError
        A structure is damaged or does not name its channels, or there is no FRF.
    """
    columns: list[_Column] = []
    others: Counter[str] = Counter()
    is_export = False
    for record in _records(fields):
        is_export = True
        columns += _columns(record, where, others)
    if not is_export:
        return None
    left_out = some_of([f"{count} of type {name}" for name, count in others.items()], _SHOWN)
    frfs = [each for each in columns if not each.is_coherence]
    if not frfs:
        raise FileContentError(f"{where} contains no FRF, but functions ({left_out or 'coherences'}); export FRFs")
    coherences = [each for each in columns if each.is_coherence]
    namer = mapping.namer
    found = [each for own in (frfs, coherences) for each in _named(own, mapping, namer, where)]
    return found, [f"not read, no FRF: functions ({left_out})"] if others else []


def _named(columns: Sequence[_Column], mapping: FrfMapping, namer: ChannelNamer, where: str) -> Iterator[LooseFunction]:
    """Return functions of one kind with their channels, named by the user in their order, or else by the file."""
    sides = []
    for side, key, own in (
        ("responses", "primary_channel", [each.response for each in columns]),
        ("excitations", "reference_channel", [each.excitation for each in columns]),
    ):
        labels = mapping.names_of(side, len(columns), where) or own
        if None in labels:
            raise FileContentError(
                f"{where} does not name the {side} of its functions ({key}); give mapping {side}=..., one name for "
                f"each of {len(columns)}, or one for all"
            )
        try:
            sides.append([namer.channel(side, label) for label in labels])
        except ValueError as error:
            raise FileContentError(f"{where} {error}") from error
    for response, excitation, each in zip(*sides, columns, strict=True):
        yield LooseFunction(
            response, excitation, each.freq_hz, each.values, each.is_coherence, each.unit,
            frequency_unit=each.frequency_unit,
        )  # fmt: skip


def _records(content: Any) -> Iterator[Mapping[str, Any]]:
    """Yield structures of Testlab, at any depth."""
    if isinstance(content, Mapping):
        if {"x_values", "y_values"} <= set(content):
            yield content
        else:
            for value in content.values():
                yield from _records(value)
    elif isinstance(content, list) or (isinstance(content, np.ndarray) and content.dtype == object):
        for value in content:
            yield from _records(value)


def _columns(record: Mapping[str, Any], where: str, others: Counter[str]) -> Iterator[_Column]:
    """Yield FRFs and coherences of one structure, a column each; further functions are counted."""
    about = record.get("function_record")
    about = about if isinstance(about, Mapping | list) else {}
    types = [each.get("type") for each in about] if isinstance(about, list) else _texts(about.get("type"))
    kinds = [_kind(" ".join(_texts(each))) for each in types] or [""]
    read = ("frf", "coherence", "")
    if not set(kinds) & set(read):
        others.update(kinds)
        return
    x_values, y_values = _part(record, "x_values", where), _part(record, "y_values", where)
    values = np.asarray(_needed(y_values, "values", where))
    if "" in kinds and values.dtype.kind != "c":  # no type: a spectrum or a time history of the same export
        others["none"] += 1
        return
    freq_hz = _lines(x_values, values, where)
    columns = values.reshape(freq_hz.size, -1)
    if values.ndim == 2 and values.shape[0] != freq_hz.size:
        columns = values.T
    n = columns.shape[1]
    if len(kinds) not in (1, n):
        raise FileContentError(f"{where} is damaged: {len(kinds)} types of {n} functions")
    names = [_channel_names(about, key, n) for key in ("primary_channel", "reference_channel")]
    unit = ""
    for i, kind in enumerate(kinds * n if len(kinds) == 1 else kinds):
        if kind not in read:
            others[kind] += 1
            continue
        if kind != "coherence" and not unit:
            unit = _unit(y_values)
        response, excitation = (None if own is None else own[i] for own in names)
        is_coherence = kind == "coherence"
        own_unit = "" if is_coherence else unit
        yield _Column(freq_hz, columns[:, i], is_coherence, own_unit, response, excitation, _frequency_unit(x_values))


def _kind(name: str) -> str:
    """Return ``frf``, ``coherence``, or the type of a function in the file; no text if it has none."""
    letters = "".join(filter(str.isalnum, name.lower()))
    if letters.startswith(_FRF_TYPES):
        return "frf"
    return "coherence" if letters in _COHERENCE_TYPES else name.strip()


def _channel_names(about: Any, key: str, n: int) -> list[str] | None:
    """Return the names of the channels of n functions."""
    if isinstance(about, list):
        each_of = [_point_names(each.get(key), 1) for each in about]
        return None if None in each_of or len(each_of) != n else [own[0] for own in each_of if own]
    names = _point_names(about.get(key), n)
    return names * n if names is not None and len(names) == 1 else names if names and len(names) == n else None


def _part(record: Mapping[str, Any], name: str, where: str) -> Mapping[str, Any]:
    part = record.get(name)
    if not isinstance(part, Mapping):
        raise FileContentError(f"{where} is damaged: {name} of a function is not a structure")
    return part


def _needed(part: Mapping[str, Any], name: str, where: str) -> Any:
    if name not in part:
        raise FileContentError(f"{where} is damaged: a function has no {name}")
    return part[name]


def _lines(x_values: Mapping[str, Any], values: NDArray[Any], where: str) -> NDArray[np.float64]:
    """Return frequencies by start, increment and number, or one by one, as many as one axis of the values has."""
    if values.dtype.kind not in "biufc" or values.ndim not in (1, 2):
        raise FileContentError(f"{where} is damaged: the values of a function are no columns of numbers")
    try:
        if "increment" in x_values:
            start, step, n = (
                float(np.ravel(x_values[name])[0]) for name in ("start_value", "increment", "number_of_values")
            )
            size = int(n)
        else:
            given = np.asarray(x_values["values"], dtype=np.float64).reshape(-1)
            start, step, size = 0.0, 0.0, given.size
    except (ValueError, TypeError, LookupError, OverflowError) as error:
        raise FileContentError(f"{where} is damaged: the frequencies of a function cannot be read") from error
    if size < 1 or size not in values.shape:
        raise FileContentError(f"{where} is damaged: {values.size} values at {size:.6g} frequency lines")
    return np.asarray(start + step * np.arange(size)) if "increment" in x_values else given


def _unit(y_values: Mapping[str, Any]) -> str:
    """Return the unit of the values.

    The label is the unit in the display of Testlab. Values are saved in SI (MKS), and the factor converts them to the
    label: 0.101972 for g. If label, factor and text disagree, the returned label is not understood.
    """
    quantity, label = _axis(y_values)
    unit = parse_unit(label)
    if unit is None:
        return label
    transformation = quantity.get("unit_transformation")
    given = transformation.get("factor") if isinstance(transformation, Mapping) else None
    is_mks = "MKS" in " ".join(_texts(quantity.get("info"))).upper()
    if given is None and not is_mks:
        return label if unit.to_si == 1.0 else f"{label}, no factor"
    factor = 1.0 / unit.to_si if given is None else float(np.ravel(given)[0])
    return si_label(unit.exponents) if abs(factor * unit.to_si - 1.0) < SAME_FACTOR else f"{label}, factor {factor:g}"


def _frequency_unit(x_values: Mapping[str, Any]) -> str:
    """Return the unit of the frequencies; any other than Hz, which need not be the unit of the values, with a word."""
    _, label = _axis(x_values)
    return label if not label or parse_frequency_unit(label) == 1.0 else f"{label}, saved in MKS"


def _axis(values: Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
    """Return the description of an axis, and its label."""
    quantity = values.get("quantity")
    quantity = quantity if isinstance(quantity, Mapping) else {}
    return quantity, (_texts(quantity.get("label")) or [""])[0].replace("\0", " ").strip()


def _point_names(channel: Any, n: int) -> list[str] | None:
    """Return names of points with their directions, from fields that exports have under several names."""
    if isinstance(channel, Mapping):
        points = next((_texts(channel[key]) for key in ("point_id", "label", "name", "point") if key in channel), [])
        ways = next((_texts(channel[key]) for key in ("direction", "point_direction") if key in channel), [])
        if len(points) != len(ways) or not ways:
            return points or None
        return [f"{point}:{way}" for point, way in zip(points, ways, strict=True)]
    if isinstance(channel, list | np.ndarray) and n == len(channel):
        names = [_point_names(each, 1) for each in channel]
        return None if any(each is None for each in names) else [each[0] for each in names if each]
    return None


def _texts(value: Any) -> list[str]:
    if value is None:
        return []
    if isinstance(value, str):
        return [value]
    return [str(each) for each in np.ravel(np.asarray(value, dtype=object))]
