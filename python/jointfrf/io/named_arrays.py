"""Files of named arrays (NPZ, HDF5, MATLAB): the own layout, exports of programs, or arrays of scripts."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, FrfSet
from jointfrf.frf.setups import SetUps
from jointfrf.io.file_format import TIME_DATA, FrfArrays, FrfMapping
from jointfrf.io.functions import arrays_of_functions, functions_of_sdynpy, functions_of_testlab
from jointfrf.kernel.arguments import as_array, check_type
from jointfrf.spelling import some_of

__all__ = ["arrays_of_fields", "fields_of"]

#: The field that says whose layout it is; its value is the number of the layout.
_MARK = "jointfrf_frfs"
#: The layout that is written, and the one without a checksum, which is read as well.
_LAYOUT, _UNCHECKED = 2, 1
#: The field with a checksum of all others, which layout 1 lacks; who edits a file writes layout 1 without it.
_CHECKSUM = "sha256"
#: Fields of every file in the own layout; units by how often a receptance is differentiated.
_REQUIRED = ("freq_hz", "h", "responses", "excitations", "quantity")
_UNITS = ("m/N", "m/s/N", "m/s^2/N")


#: Names, in lower case, that are taken for a field where the user names none.
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
#: Options that have an effect on functions one by one, and on arrays that are found by their names.
_TAKEN_BY_SDYNPY = ("direction", "components")
_TAKEN_BY_TESTLAB = ("responses", "excitations", *_TAKEN_BY_SDYNPY)
_TAKEN_BY_ARRAYS = (*(each.name for each in dataclass_fields(FrfMapping)), "frequency")
#: Names of FRFs that say their quantity, and of frequencies in rad/s.
_QUANTITIES = ("accelerance", "inertance", "mobility", "receptance")
_RADIANS = ("omega", "w")
#: Names of times, which files of FRFs do not have.
_TIMES = ("t", "time", "times", "time_s")


def arrays_of_fields(
    fields: Mapping[str, Any], mapping: FrfMapping, where: str, limit: ReadLimit, *, keeps_shapes: bool = True
) -> FrfArrays:
    """Find the FRFs among the named arrays of a file.

    Parameters
    ----------
    fields : mapping
        Arrays by name, structures and groups as mappings inside.
    mapping : FrfMapping
        Which field is what, where that is not clear.
    where : str
        The file, with which messages begin.
    limit : ReadLimit
    keeps_shapes : bool
        Whether the format keeps axes of length 1 and texts as they are, as the checksum of the own layout needs.

    Raises
    ------
    FileContentError
        Something is missing, damaged, or not the only one of its kind.
    """
    if keeps_shapes and (_MARK in fields or _CHECKSUM in fields):
        return _own_arrays(fields, where)
    functions = functions_of_sdynpy(fields.get("data"), fields.get("function_type"), where)
    exported = functions_of_testlab(fields, mapping, where) if mapping.h is None else None
    if functions or exported is not None:
        found = arrays_of_functions(functions or exported or [], where, limit)
        return replace(found, takes=_TAKEN_BY_TESTLAB if exported is not None else _TAKEN_BY_SDYNPY)
    return _mapped_arrays(fields, mapping, where)


def fields_of(frfs: FrfSet) -> dict[str, NDArray[Any]]:
    """Arrays of a set, texts as arrays of texts.

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
    """Set-ups of a file in the own layout."""
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
    """SHA-256 of names, shapes and values: a field that was lost or renamed shows as a changed value does."""
    found = hashlib.sha256()
    for name in sorted(fields):
        if name == _CHECKSUM:
            continue
        value = np.asarray(fields[name])
        is_text = value.dtype.kind in "US"
        content = "\n".join(map(str, value.ravel().tolist())).encode() if is_text else _values(value).tobytes()
        found.update(f"{name} {value.shape} ".encode() + content)
    return found.hexdigest()


def _values(value: NDArray[Any]) -> NDArray[Any]:
    """Values in one type and byte order, whatever a program that copied the file has chosen."""
    return np.ascontiguousarray(value, dtype="<c16" if value.dtype.kind == "c" else "<f8")


def _own_arrays(fields: Mapping[str, Any], where: str) -> FrfArrays:
    """FRFs of a file in the own layout."""
    if _MARK not in fields:
        raise FileContentError(f"{where} lacks {_MARK}")
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


def _mapped_arrays(content: Mapping[str, Any], mapping: FrfMapping, where: str) -> FrfArrays:
    """FRFs by the names of fields."""
    flat = dict(_flattened(content))
    found = {name: _field(flat, name, getattr(mapping, name), where) for name in _KNOWN}
    freq, h = found["freq_hz"], found["h"]
    for each, name, what in ((freq, "freq_hz", "frequencies"), (h, "h", "FRFs")):
        if each is None:
            known = ", ".join(_KNOWN[name])
            times = [each for each in flat if each.rpartition(".")[2].lower() in _TIMES]
            if h is None and times:
                raise FileContentError(f"{where} has times ({times[0]}) and no FRFs ({known}); {TIME_DATA}")
            raise FileContentError(
                f"{where} has no field for the {what} ({known}): say which of {_names(flat)} by mapping"
            )
    assert freq is not None
    assert h is not None
    path, values = freq
    name = path.rpartition(".")[2].lower()
    frequency_unit = "rad/s" if name in _RADIANS else "Hz" if "hz" in name else ""
    quantity = _text(found["quantity"])
    last = h[0].rpartition(".")[2].lower()
    return FrfArrays(
        np.asarray(values),
        h[1],
        mapping.axes or "",
        _channels(found, "response", where),
        _channels(found, "excitation", where),
        quantity or (last if last in _QUANTITIES else ""),
        _text(found["unit"]),
        _value(found["coherence"]),
        _value(found["averages"]),
        frequency_unit=frequency_unit,
        takes=_TAKEN_BY_ARRAYS,
    )


def _channels(found: Mapping[str, tuple[str, Any] | None], what: str, where: str) -> Any:
    """Return the channels of a side as `channels_of` takes them: one field, or nodes and directions apart."""
    apart = found[f"{what}_nodes"], found[f"{what}_directions"]
    if apart == (None, None) or (found[f"{what}s"] is not None and None in apart):
        return _value(found[f"{what}s"])
    if found[f"{what}s"] is not None:
        raise FileContentError(f"{where} has {what}s as names and as nodes and directions: leave one out of mapping")
    if apart[0] is None or apart[1] is None:
        missing = f"{what}_{'nodes' if apart[0] is None else 'directions'}"
        raise FileContentError(f"{where} has no field {missing}: say which one holds it by mapping")
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
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def _field(flat: Mapping[str, Any], name: str, given: Any, where: str) -> tuple[str, Any] | None:
    """Path and value of a field: the one that the user names, else the only one of a known name."""
    if given is not None and not isinstance(given, str):
        return "", given
    if given is not None:
        if given in flat:
            return given, flat[given]
        if name in ("responses", "excitations") and ("," in given or ":" in given):
            return "", [each.strip() for each in given.split(",")]
        raise FileContentError(f"{where} has no field {given!r}; it has {_names(flat)}")
    found = [path for path in flat if path.rpartition(".")[2].lower() in _KNOWN[name]]
    if len(found) > 1:
        raise FileContentError(f"{where} has several fields for {name}: say which of {', '.join(found)} by mapping")
    return (found[0], flat[found[0]]) if found else None


def _names(flat: Mapping[str, Any]) -> str:
    shown = [name if len(name) <= 30 else f"{name[:27]}..." for name in flat]
    return some_of(shown, 12) or "nothing"


def _value(found: tuple[str, Any] | None) -> Any:
    return None if found is None else found[1]


def _text(found: tuple[str, Any] | None) -> str:
    if found is None:
        return ""
    texts = [str(each).strip() for each in np.ravel(found[1])]
    return texts[0] if len(set(texts)) == 1 else ""
