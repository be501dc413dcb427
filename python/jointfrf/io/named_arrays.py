"""Files of named arrays (NPZ, HDF5, MATLAB): the own layout, exports of programs, or arrays of scripts."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields as dataclass_fields
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, ROUND_OFF, Channel, FrfSet
from jointfrf.frf.setups import SetUps
from jointfrf.io.file_format import TIME_DATA, FrfArrays, FrfMapping
from jointfrf.io.functions import LooseFunction, arrays_of_functions, functions_of_sdynpy, functions_of_testlab
from jointfrf.kernel.arguments import as_array, check_type, one_line
from jointfrf.spelling import some_of

__all__ = ["arrays_of_fields", "fields_of"]

#: Field that identifies the own layout; its value is the number of the layout.
_MARK = "jointfrf_frfs"
#: Layout that is written, and the layout without a checksum, which is read as well.
_LAYOUT, _UNCHECKED = 2, 1
#: Field with a checksum of all others; layout 1 lacks it, so that edited files are written as layout 1.
_CHECKSUM = "sha256"
#: Fields of every file in the own layout; units by how often a receptance is differentiated.
_REQUIRED = ("freq_hz", "h", "responses", "excitations", "quantity")
_UNITS = ("m/N", "m/s/N", "m/s^2/N")
#: All fields of the own layout.
_FIELDS = (_MARK, *_REQUIRED, "unit", "coherence", "averages", "nodes", "coordinates", "setups", "setup_of",
           "setup_gains", "setup_repeats", "setup_repeated", _CHECKSUM)  # fmt: skip


#: Names, in lower case, of fields that are used if the user names none.
_KNOWN = {
    "freq_hz": ("freq_hz", "freq", "freqs", "f", "f_hz", "frequency", "frequencies", "frequency_hz", "freqv",
                "omega", "w"),
    "h": ("h", "frf", "frfs", "y", "h1", "h2", "hv", "hxy", "tf", "xfer", "accelerance", "inertance", "mobility",
          "receptance"),
    "responses": ("responses", "response", "response_dofs", "rsp", "outputs", "output", "out_dofs", "channels"),
    "excitations": ("excitations", "excitation", "references", "reference", "reference_dofs", "ref", "inputs",
                    "input", "in_dofs", "impacts"),
    "response_nodes": ("response_nodes",),
    "response_directions": ("response_directions",),
    "excitation_nodes": ("excitation_nodes",),
    "excitation_directions": ("excitation_directions",),
    "quantity": ("quantity",),
    "unit": ("unit", "units", "frf_unit"),
    "coherence": ("coherence", "coh", "gamma2", "coherences"),
    "averages": ("averages", "n_averages", "navg", "n_avg", "number_of_averages"),
}  # fmt: skip
#: Options with an effect on functions one by one, and on arrays that are identified by their names.
_TAKEN_BY_SDYNPY = ("direction", "components")
_TAKEN_BY_TESTLAB = ("responses", "excitations", *_TAKEN_BY_SDYNPY)
_TAKEN_BY_ARRAYS = (*(each.name for each in dataclass_fields(FrfMapping)), "frequency")
#: Fields with parts of FRFs that the user may name.
_PARTS = ("real", "imag", "magnitude", "phase_deg", "phase_rad")
#: Frequencies that the user gives: a list of numbers, or first one and spacing.
_LITERAL = re.compile(r"[,:]|^[0-9.]+$")
#: Nodes that the user gives, one by one or as ranges; longer ranges are slips.
_NODES, _MOST_NODES = re.compile(r"\d{1,18}(?::\d{1,18})?(?:,\d{1,18}(?::\d{1,18})?)*"), 100_000
#: Number of fields that a message names, and number of characters of each.
_SHOWN, _NAME = 12, 30
#: Names of FRFs that state their quantity, and of frequencies in rad/s.
_QUANTITIES = ("accelerance", "inertance", "mobility", "receptance")
_RADIANS = ("omega", "w")
#: Names of times, which files of FRFs do not have.
_TIMES = ("t", "time", "times", "time_s")


def arrays_of_fields(
    fields: Mapping[str, Any], mapping: FrfMapping, where: str, limit: ReadLimit, *, keeps_shapes: bool = True
) -> FrfArrays:
    """Find the FRFs among the named arrays of a file and return them.

    Parameters
    ----------
    fields : mapping
        Arrays by name, structures and groups as mappings inside.
    mapping : FrfMapping
        Fields by their meaning, if that is not clear.
    where : str
        Name of the file, with which messages begin.
    limit : ReadLimit
        Limit of memory.
    keeps_shapes : bool
        Whether the format keeps axes of length 1 and texts unchanged, as the checksum of the own layout needs.

    Raises
    ------
    FileContentError
        Something is missing, damaged, or not the only one of its kind.
    """
    if keeps_shapes and (_MARK in fields or _CHECKSUM in fields):
        return _own_arrays(fields, where)
    functions, notes = functions_of_sdynpy(fields, mapping, where), list[str]()
    exported = None if mapping.names_frfs else functions_of_testlab(fields, mapping, where)
    if exported is not None:
        functions, notes = exported
    if functions:
        found = arrays_of_functions(functions, where, limit)
        found.notes[:0] = notes
        found.takes = _TAKEN_BY_SDYNPY if exported is None else _TAKEN_BY_TESTLAB
        return found
    return _mapped_arrays(fields, mapping, where, limit)


def fields_of(frfs: FrfSet) -> dict[str, NDArray[Any]]:
    """Return arrays of a set, texts as arrays of texts.

    Raises
    ------
    ValueError
        An FRF is NaN or infinite on some lines only, or there is none.
    """
    check_type("frfs", frfs, FrfSet)
    frfs.check_whole()
    fields: dict[str, NDArray[Any]] = {
        _MARK: np.array(_LAYOUT),
        "freq_hz": frfs.freq_hz,
        "h": frfs.h,
        "responses": np.array([str(channel) for channel in frfs.responses]),
        "excitations": np.array([str(channel) for channel in frfs.excitations]),
        "quantity": np.array(frfs.quantity),
        "unit": np.array(_UNITS[POWER_OF_I_OMEGA[frfs.quantity]]),
    }
    if frfs.coherence is not None:
        fields["coherence"] = frfs.coherence
    if frfs.averages is not None:
        fields["averages"] = frfs.averages
    if frfs.coordinates:
        nodes = sorted(frfs.coordinates)
        fields["nodes"] = np.array(nodes)
        fields["coordinates"] = np.array([frfs.coordinates[node] for node in nodes])
    if frfs.setups is not None:
        fields |= _fields_of_setups(frfs.setups)
    fields[_CHECKSUM] = np.array(_checksum(fields))
    return fields


def _fields_of_setups(setups: SetUps) -> dict[str, NDArray[Any]]:
    gain = np.nan if setups.gain is None else setups.gain
    fields = {
        "setups": np.array(setups.names),
        "setup_of": setups.of,
        "setup_gains": np.array([gain, setups.common_gain]),
    }
    if setups.repeated is not None:
        fields |= {"setup_repeats": setups.repeats, "setup_repeated": setups.repeated}
    return fields


def _setups_of(fields: Mapping[str, Any], where: str) -> SetUps | None:
    """Return the set-ups of a file in the own layout."""
    if "setups" not in fields:
        return None
    try:
        gain, common = as_array("setup_gains", fields.get("setup_gains", [np.nan, 0.0])).ravel().tolist()
        return SetUps(
            [str(name) for name in np.ravel(fields["setups"])],
            fields["setup_of"],
            None if np.isnan(gain) else gain,
            common,
            fields.get("setup_repeats", np.zeros((0, 3), np.intp)),
            fields.get("setup_repeated"),
        )
    except (KeyError, ValueError, TypeError) as error:
        what = "setup_of is missing" if isinstance(error, KeyError) else str(error)
        raise FileContentError(f"{where}: the set-ups do not fit each other: {what}") from error


def _checksum(fields: Mapping[str, Any]) -> str:
    """Return the SHA-256 of names, shapes and values, which also changes if a field was lost or renamed."""
    found = hashlib.sha256()
    for name in sorted(fields):
        if name == _CHECKSUM:
            continue
        if not _is_array(fields[name]):  # added by another program
            found.update(name.encode())
            continue
        value = np.asarray(fields[name])
        is_text = value.dtype.kind in "US"
        content = "\n".join(map(str, value.ravel().tolist())).encode() if is_text else _values(value).tobytes()
        found.update(f"{name} {value.shape} ".encode() + content)
    return found.hexdigest()


def _is_array(value: Any) -> bool:
    """Return whether a value contains numbers or texts: no group, no list of groups or cells."""
    return np.asarray(value).dtype.kind in "biufcSU"


def _values(value: NDArray[Any]) -> NDArray[Any]:
    """Return values in one type and byte order, whatever a program that copied the file has chosen."""
    return np.ascontiguousarray(value, dtype="<c16" if value.dtype.kind == "c" else "<f8")


def _own_arrays(fields: Mapping[str, Any], where: str) -> FrfArrays:
    """Return FRFs of a file in the own layout."""
    if _MARK not in fields:
        raise FileContentError(f"{where} lacks {_MARK}")
    wrong = next((name for name in _FIELDS if not _is_array(fields.get(name, 0))), None)
    if wrong is not None:
        what = "a group" if isinstance(fields[wrong], Mapping) else "neither numbers nor texts"
        raise FileContentError(f"{where} is damaged: {wrong} is {what}, not an array; write the file again")
    layout = np.asarray(fields[_MARK])
    if layout.size != 1 or layout.dtype.kind not in "iu" or int(layout.item()) not in (_LAYOUT, _UNCHECKED):
        raise FileContentError(
            f"{where} has layout {fields[_MARK]!s:.20}, this version of jointfrf reads layouts "
            f"{_UNCHECKED} and {_LAYOUT}"
        )
    required = _REQUIRED if int(layout.item()) == _UNCHECKED else (*_REQUIRED, _CHECKSUM)
    missing = [name for name in required if name not in fields]
    if missing:
        raise FileContentError(f"{where} lacks {', '.join(missing)}")
    if _CHECKSUM in fields and str(fields[_CHECKSUM]) != _checksum(fields):
        raise FileContentError(f"{where} is damaged or was edited: its content does not fit its field {_CHECKSUM}")
    nodes, places = np.asarray(fields.get("nodes", [])), np.asarray(fields.get("coordinates", np.zeros((0, 3))))
    if nodes.dtype.kind not in "iuf" or places.shape != (nodes.size, 3) or not np.isfinite(places).all():
        raise FileContentError(
            f"{where}: coordinates have shape {places.shape}, expected three for each of {nodes.size} nodes"
        )
    return FrfArrays(
        fields["freq_hz"],
        fields["h"],
        "freq,out,in",
        fields["responses"],
        fields["excitations"],
        str(fields["quantity"]),
        str(fields.get("unit") or _UNITS[POWER_OF_I_OMEGA.get(str(fields["quantity"]), 0)]),
        fields.get("coherence"),
        fields.get("averages"),
        {int(node): place.astype(np.float64) for node, place in zip(nodes.ravel(), places, strict=True)},
        _setups_of(fields, where),
        takes=(),
    )


def _mapped_arrays(content: Mapping[str, Any], mapping: FrfMapping, where: str, limit: ReadLimit) -> FrfArrays:
    """FRFs by the names of fields."""
    flat = dict(_flattened(content))
    if not flat:
        raise FileContentError(f"{where} contains no arrays; give a file of FRFs")
    found = {name: _field(flat, name, getattr(mapping, name), where) for name in _KNOWN}
    times = [path for path in flat if path.rpartition(".")[2].lower() in _TIMES]
    if times and found["h"] is None and not mapping.names_frfs:
        raise FileContentError(f"{where} has times ({times[0]}) and no FRFs; {TIME_DATA}")
    if found["freq_hz"] is None:
        raise FileContentError(
            f"{where} has no field for the frequencies; give mapping freq_hz=..., a field out of {_names(flat)}, or "
            "first one and spacing, 5:0.5"
        )
    path, h = _frfs(found, flat, mapping, where)
    responses, excitations = (_channels(found, what, where) for what in ("response", "excitation"))
    quantity, last = _text(found["quantity"]), path.rpartition(".")[2].lower()
    arrays = FrfArrays(
        None,
        h,
        mapping.axes or "",
        responses,
        excitations,
        quantity or (last if last in _QUANTITIES else ""),
        _text(found["unit"]),
        _value(found["coherence"]),
        _value(found["averages"]),
        frequency_unit=_frequency_unit(found["freq_hz"][0]),
        takes=_TAKEN_BY_ARRAYS,
    )
    number = _number_of_functions(arrays)
    arrays.freq_hz = _frequencies(found["freq_hz"], flat, arrays, number, where)
    if number is None:
        return arrays
    found_one_by_one = _one_by_one(arrays, mapping, number, where, limit)
    found_one_by_one.takes = _TAKEN_BY_ARRAYS
    return found_one_by_one


def _frequency_unit(path: str) -> str:
    """Return the unit in the name of a field of frequencies; empty: Hz, unless the user states another."""
    name = path.rpartition(".")[2].lower()
    return "rad/s" if name in _RADIANS else "Hz" if "hz" in name else ""


def _frfs(
    found: Mapping[str, tuple[str, Any] | None], flat: Mapping[str, Any], mapping: FrfMapping, where: str
) -> tuple[str, Any]:
    """Path and values of the FRFs: complex, or made of two fields with their parts."""
    parts = [name for name in _PARTS if getattr(mapping, name) is not None]
    if not parts:
        if found["h"] is None:
            raise FileContentError(f"{where} has no field for the FRFs; give mapping h=... out of {_names(flat)}")
        return found["h"]
    if set(parts) not in ({"real", "imag"}, {"magnitude", "phase_deg"}, {"magnitude", "phase_rad"}):
        raise FileContentError(
            f"{where}: mapping names {' and '.join(parts)} of the FRFs; give real= and imag=, or magnitude= and "
            "phase_deg= or phase_rad="
        )
    values = []
    for name in parts:
        path, value = _field(flat, name, getattr(mapping, name), where) or ("", None)
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            raise FileContentError(f"{where}: {path} contains no real numbers, which mapping {name}= takes")
        values.append(array.astype(np.float64))
    one, other = values
    if one.shape != other.shape:
        raise FileContentError(f"{where}: {' and '.join(parts)} have the shapes {one.shape} and {other.shape}")
    if parts[0] == "real":
        return "", one + 1j * other
    if one.min(initial=0.0) < 0.0:
        raise FileContentError(f"{where}: magnitudes are negative, {one.min():g}; give linear values, not dB")
    return "", one * np.exp(1j * (np.deg2rad(other) if parts[1] == "phase_deg" else other))


def _number_of_functions(arrays: FrfArrays) -> int | None:
    """Return the number of FRFs stored one by one, with response and excitation each; None if they are a matrix."""
    count, shape = _count(arrays.responses), [n for n in np.shape(arrays.h) if n != 1]
    is_list = count == _count(arrays.excitations) and len(shape) == 2 and count in shape and not arrays.axes
    return count if is_list else None


def _count(labels: Any) -> int | None:
    return None if labels is None else 1 if isinstance(labels, str) else len(labels)


def _one_by_one(arrays: FrfArrays, mapping: FrfMapping, number: int, where: str, limit: ReadLimit) -> FrfArrays:
    """Return functions, each with a response and an excitation, as a matrix."""
    n, namer, kinds = np.size(arrays.freq_hz), mapping.namer, [(False, arrays.h)]
    kinds += [] if arrays.coherence is None else [(True, arrays.coherence)]
    functions = []
    for is_coherence, values in kinds:
        array = np.squeeze(np.asarray(values))
        if sorted(array.shape) != sorted((n, number)):
            raise FileContentError(f"{where}: {number} functions at {n} lines have the sizes {array.shape}")
        columns = array.T if array.shape == (n, number) else array
        try:
            functions += [
                LooseFunction(
                    namer.channel("responses", response),
                    namer.channel("excitations", excitation),
                    np.ravel(arrays.freq_hz),
                    column,
                    is_coherence,
                    arrays.unit,
                    arrays.quantity,
                    arrays.frequency_unit,
                )
                for response, excitation, column in zip(arrays.responses, arrays.excitations, columns, strict=True)
            ]
        except ValueError as error:
            raise FileContentError(f"{where} {error}") from error
    return arrays_of_functions(functions, where, limit)


def _frequencies(
    found: tuple[str, Any], flat: Mapping[str, Any], arrays: FrfArrays, number: int | None, where: str
) -> Any:
    """Return frequencies in the unit of a field: values of a field, listed by the user, or first and spacing."""
    path, values = found
    if path or not isinstance(values, str):
        return np.asarray(values)
    if ":" not in values:
        return np.array([_one_number(word, flat, where) for word in values.split(",")])
    start, step, *end = (_one_number(word, flat, where) for word in values.split(":"))
    if not step > 0 or end[1:]:
        raise FileContentError(
            f"{where}: mapping freq_hz={values} is not like 5:0.5, first frequency and spacing in Hz"
        )
    n = np.size(arrays.h) / (number or (_count(arrays.responses) or 1) * (_count(arrays.excitations) or 1))
    if end:
        n = np.floor((end[0] - start) / step * (1 + ROUND_OFF)) + 1
    if n != int(n) or not 0 < n <= np.size(arrays.h):
        raise FileContentError(
            f"{where}: {np.size(arrays.h)} values are no whole number of lines of the named channels; correct "
            "mapping responses= and excitations="
        )
    return start + step * np.arange(int(n))


def _one_number(word: str, flat: Mapping[str, Any], where: str) -> float:
    """Return a number, or the number in a field of this name."""
    value = np.ravel(np.asarray(flat.get(word.strip(), word)))
    try:
        (number,) = value.astype(np.float64).tolist()
    except (ValueError, TypeError) as error:
        raise FileContentError(
            f"{where}: {one_line(word)} in mapping freq_hz= is not a number or a field with one number"
        ) from error
    return float(number)


def _channels(found: Mapping[str, tuple[str, Any] | None], what: str, where: str) -> Any:
    """Return the channels of a side for `channels_of`: one field, or separate nodes and directions."""
    apart = found[f"{what}_nodes"], found[f"{what}_directions"]
    if apart == (None, None) or (found[f"{what}s"] is not None and None in apart):
        return _value(found[f"{what}s"])
    if found[f"{what}s"] is not None:
        raise FileContentError(f"{where} has {what}s as names and as nodes and directions; leave one out of mapping")
    if apart[0] is None or apart[1] is None:
        missing = f"{what}_{'nodes' if apart[0] is None else 'directions'}"
        raise FileContentError(f"{where} has no field {missing}; give mapping {missing}=...")
    nodes, directions = (np.ravel(np.asarray(each[1])) for each in apart if each is not None)
    if 1 not in (nodes.size, directions.size) and nodes.size != directions.size:
        raise FileContentError(f"{where} has {nodes.size} nodes of {what}s, but {directions.size} directions")
    nodes, directions = np.broadcast_arrays(nodes, directions)
    if nodes.dtype.kind not in "iuf" or not (nodes == np.floor(nodes)).all():
        raise FileContentError(f"{where}: the nodes of the {what}s ({apart[0][0]}) are not whole numbers")
    if directions.dtype.kind in "iuf":
        return np.column_stack([nodes, directions])
    return [f"{int(node)}:{str(way).strip()}" for node, way in zip(nodes, directions, strict=True)]


def _flattened(content: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield fields by their paths: structures by points, structure arrays by an index from 1."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f"{before}{name}.")
        elif isinstance(value, list) and value and all(isinstance(each, Mapping) for each in value):
            for number, each in enumerate(value, start=1):
                yield from _flattened(each, f"{before}{name}({number}).")
        else:
            yield f"{before}{name}", value


def _field(flat: Mapping[str, Any], name: str, given: Any, where: str) -> tuple[str, Any] | None:
    """Return path and value of a field that the user names, or of the only one of a known name.

    The path is empty if the user gives the value itself.
    """
    if given is not None and not isinstance(given, str):
        return "", given
    if given is not None:
        path = given if given in flat else given.replace("(1)", "")  # a single structure is no array
        if path in flat:
            return path, flat[path]
        if "(:)" in given:
            return given, _of_all(flat, given, where)
        if name in ("responses", "excitations") and ("," in given or ":" in given):
            return "", [each.strip() for each in given.split(",")]
        if name == "unit" or (name == "freq_hz" and _LITERAL.search(given)):
            return "", given
        if name.endswith("_nodes") and _NODES.fullmatch(given):
            return "", _nodes(given, where)
        if name.endswith("_directions") and _is_direction(given):
            return "", given
        inside = [path for path in flat if path.startswith((f"{given}.", f"{given}("))]
        what = f"{given} is a group" if inside else f"it has no field {given!r}"
        raise FileContentError(f"{where}: {what}; use one of {_names(inside or list(flat))}")
    found = [path for path in flat if path.rpartition(".")[2].lower() in _KNOWN[name]]
    if len(found) > 1:
        raise FileContentError(f"{where} has several fields for {name}; give mapping {name}=... out of {_names(found)}")
    return (found[0], flat[found[0]]) if found else None


def _nodes(given: str, where: str) -> list[int]:
    """Return nodes that the user lists, 1,2,3 or ranges 1:81, ends included."""
    ends = [[int(number) for number in word.split(":")] for word in given.split(",")]
    if any(pair[0] > pair[-1] or pair[-1] - pair[0] > _MOST_NODES for pair in ends):
        raise FileContentError(f"{where}: {given} is no list of nodes such as 1,2 or 1:81")
    return [node for pair in ends for node in range(pair[0], pair[-1] + 1)]


def _is_direction(word: str) -> bool:
    try:
        return bool(Channel(1, word))
    except ValueError:
        return False


def _of_all(flat: Mapping[str, Any], given: str, where: str) -> Any:
    """Return the arrays of all structures of an array; the first axis counts the structures."""
    before, _, behind = given.partition("(:)")
    values: list[NDArray[Any]] = []
    while (path := f"{before}({len(values) + 1}){behind}") in flat:
        values.append(np.asarray(flat[path]))
    if not values or any(each.shape != values[0].shape for each in values):
        shown = some_of([" x ".join(map(str, each.shape)) for each in values], _SHOWN)
        raise FileContentError(f"{where}: {given} names no arrays of one size ({shown or 'none'})")
    return values[0].tolist() if values[0].dtype.kind == "U" and len(values) == 1 else np.stack(values)


def _names(paths: Collection[str]) -> str:
    shown = [name if len(name) <= _NAME else f"{name[: _NAME - 3]}..." for name in islice(paths, _SHOWN)]
    return some_of(shown, _SHOWN) + (f" and {len(paths) - _SHOWN} more" if len(paths) > _SHOWN else "") or "nothing"


def _value(found: tuple[str, Any] | None) -> Any:
    return None if found is None else found[1]


def _text(found: tuple[str, Any] | None) -> str:
    if found is None:
        return ""
    texts = [str(each).strip() for each in np.ravel(found[1])]
    return texts[0] if len(set(texts)) == 1 else ""
