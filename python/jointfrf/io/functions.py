"""FRFs that a file holds one by one, as Simcenter Testlab and sdynpy write them, put into a matrix."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.frf.frf_set import Channel
from jointfrf.frf.merge import same_lines
from jointfrf.io.file_format import FrfArrays, FrfMapping
from jointfrf.io.labels import channels_of
from jointfrf.io.units import SAME_FACTOR, parse_frequency_unit, parse_unit, si_label

__all__ = ["LooseFunction", "arrays_of_functions", "functions_of_sdynpy", "functions_of_testlab"]

#: The function type of FRFs in sdynpy, as in Universal Files.
_FRF = 4


class LooseFunction(NamedTuple):
    """One FRF, or with real values the coherence of one."""

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


def arrays_of_functions(functions: Sequence[LooseFunction], where: str, limit: ReadLimit) -> FrfArrays:
    """Put functions into matrices.

    Raises
    ------
    FileContentError
        There is no FRF; functions differ in frequency lines, units or quantities; one occurs twice; the matrix of
        all channels is beyond the limit.
    """
    frfs = [each for each in functions if not each.is_coherence]
    if not frfs:
        raise FileContentError(f"{where} holds no FRF")
    first = frfs[0]
    responses = tuple(dict.fromkeys(each.response for each in frfs))
    excitations = tuple(dict.fromkeys(each.excitation for each in frfs))
    row_of = {channel: i for i, channel in enumerate(responses)}
    column_of = {channel: j for j, channel in enumerate(excitations)}
    shape = (first.freq_hz.size, len(responses), len(excitations))
    limit.take(3 * 8 * shape[0] * shape[1] * shape[2])
    h, coherence = np.full(shape, np.nan + 0j), np.full(shape, np.nan)
    seen: set[tuple[Channel, Channel, bool]] = set()
    for each in functions:
        if each.values.shape != each.freq_hz.shape:
            raise FileContentError(f"{where}: {each} has {each.values.size} values at {each.freq_hz.size} lines")
        if not same_lines(each.freq_hz, first.freq_hz):
            raise FileContentError(f"{where}: {first} and {each} have different frequency lines")
        if (*each[:2], each.is_coherence) in seen:
            raise FileContentError(f"{where} holds {each} twice")
        seen.add((*each[:2], each.is_coherence))
        if each.is_coherence:
            if each.response in row_of and each.excitation in column_of:
                coherence[:, row_of[each.response], column_of[each.excitation]] = each.values
            continue
        if each[5:] != first[5:]:
            said = [f"{one.quantity} [{one.unit or 'no unit'}]".strip() for one in (first, each)]
            raise FileContentError(f"{where}: {first} is {said[0]}, {each} is {said[1]}: they must be alike")
        h[:, row_of[each.response], column_of[each.excitation]] = each.values
    known = None if np.isnan(coherence).all() else coherence
    return FrfArrays(
        first.freq_hz, h, "freq,out,in", responses, excitations, first.quantity, first.unit, known,
        frequency_unit=first.frequency_unit,
    )  # fmt: skip


def functions_of_sdynpy(data: Any, function_type: Any, where: str) -> list[LooseFunction]:
    """Return the functions of a structured array of sdynpy (`NDDataArray.save`); none where it is another array.

    Raises
    ------
    FileContentError
        They are not FRFs, or not each between one response and one reference.
    """
    if not (isinstance(data, np.ndarray) and set(data.dtype.names or ()) >= {"abscissa", "ordinate", "coordinate"}):
        return []
    if function_type != _FRF:
        raise FileContentError(f"{where} holds functions of type {function_type} of sdynpy, not FRFs (type {_FRF})")
    found = []
    for row in data.ravel():
        try:
            places = [(each["node"], each["direction"]) for each in np.ravel(row["coordinate"])]
            channels = [channels_of("coordinates", [place])[0] for place in places]
        except (ValueError, TypeError) as error:
            raise FileContentError(f"{where} {error}") from error
        if len(channels) != 2:
            raise FileContentError(f"{where} has functions without one response and one reference each")
        found.append(LooseFunction(channels[0], channels[1], np.ravel(row["abscissa"]), np.ravel(row["ordinate"])))
    return found


def functions_of_testlab(fields: Any, mapping: FrfMapping, where: str) -> list[LooseFunction] | None:
    """Return the FRFs and coherences of all structures that Simcenter Testlab exports; None without such a structure.

    Raises
    ------
    FileContentError
        A structure is damaged or does not name its channels.
    """
    records = list(_records(fields))
    return [each for record in records for each in _functions(record, mapping, where)] if records else None


def _records(content: Any) -> Iterator[Mapping[str, Any]]:
    """Structures of Testlab, wherever they stand."""
    if isinstance(content, Mapping):
        if {"x_values", "y_values"} <= set(content):
            yield content
        else:
            for value in content.values():
                yield from _records(value)
    elif isinstance(content, list) or (isinstance(content, np.ndarray) and content.dtype == object):
        for value in content:
            yield from _records(value)


def _functions(record: Mapping[str, Any], mapping: FrfMapping, where: str) -> Iterator[LooseFunction]:
    """FRFs and coherences of one structure, which holds a column for each."""
    about = record.get("function_record")
    about = about if isinstance(about, Mapping) else {}
    kind = " ".join(_texts(about.get("type"))).lower()
    is_coherence = "coherence" in kind
    x_values, y_values = _part(record, "x_values", where), _part(record, "y_values", where)
    values = np.asarray(_needed(y_values, "values", where))
    freq_hz = _lines(x_values, values, where)
    columns = values.reshape(freq_hz.size, -1)
    if values.ndim == 2 and values.shape[0] != freq_hz.size:
        columns = values.T
    if not (is_coherence or columns.dtype.kind == "c"):
        return  # spectra and time histories of the same export
    unit = "" if is_coherence else _unit(y_values)
    pairs = _pairs(about, columns.shape[1], mapping, where)
    for (response, excitation), column in zip(pairs, columns.T, strict=True):
        yield LooseFunction(
            response, excitation, freq_hz, column, is_coherence, unit, frequency_unit=_frequency_unit(x_values)
        )


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
    """Frequencies by start, increment and number, or one by one; as many as one axis of the values has."""
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

    The label is the unit in which Testlab shows them. They are saved in SI (MKS), and the factor goes from there to the
    label: 0.101972 of g. If label, factor and text disagree, the label that is returned is not understood.
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
    """Return the unit of the frequencies; any other than Hz, which need not be the one of the values, with a word."""
    _, label = _axis(x_values)
    return label if not label or parse_frequency_unit(label) == 1.0 else f"{label}, saved in MKS"


def _axis(values: Mapping[str, Any]) -> tuple[Mapping[str, Any], str]:
    """Return the description of an axis, and its label."""
    quantity = values.get("quantity")
    quantity = quantity if isinstance(quantity, Mapping) else {}
    return quantity, (_texts(quantity.get("label")) or [""])[0].replace("\0", " ").strip()


def _pairs(about: Mapping[str, Any], n: int, mapping: FrfMapping, where: str) -> list[tuple[Channel, Channel]]:
    """Response and excitation of each column."""
    sides = []
    for what, given, key in (
        ("responses", mapping.responses, "primary_channel"),
        ("excitations", mapping.excitations, "reference_channel"),
    ):
        labels = given if given is not None else _point_names(about.get(key), n)
        labels = labels.split(",") if isinstance(labels, str) else labels
        if labels is None or len(labels) not in (1, n):
            raise FileContentError(
                f"{where} does not name the {what} of its functions ({key}): say {what}= by mapping, such as 102:+y"
            )
        try:
            channels = [channels_of(what, [label])[0] for label in labels]
        except ValueError as error:
            raise FileContentError(f"{where} {error}; say {what}= by mapping") from error
        sides.append(channels * n if len(channels) == 1 else channels)
    return list(zip(*sides, strict=True))


def _point_names(channel: Any, n: int) -> list[str] | None:
    """Names of points with their directions, from fields that exports have under several names."""
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
