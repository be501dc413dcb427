"""The project's own layout of FRFs as named arrays, for NPZ and HDF5 files alike."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, FrfSet
from jointfrf.io.arrays import FrfArrays
from jointfrf.kernel.arguments import check_type

__all__ = ["MARK", "fields_of", "is_own", "own_arrays"]

#: The field that says whose layout it is; its value is the number of the layout.
MARK = "jointfrf_frfs"
#: The layout that is written, and the one without a checksum, which is read, too.
_LAYOUT, _UNCHECKED = 2, 1
#: The field with a checksum of all others, which layout 1 lacks; who edits a file writes layout 1 without it.
_CHECKSUM = "sha256"
_REQUIRED = ("freq_hz", "h", "responses", "excitations", "quantity")
_UNITS = ("m/N", "m/s/N", "m/s^2/N")


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
        MARK: np.array(_LAYOUT),
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
    fields[_CHECKSUM] = np.array(_checksum(fields))
    return fields


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


def is_own(fields: Mapping[str, Any]) -> bool:
    """Whether a file is one of our own, by its mark or, where that is damaged, by its checksum."""
    return MARK in fields or _CHECKSUM in fields


def own_arrays(fields: Mapping[str, Any], where: str) -> FrfArrays:
    """FRFs of the fields of a file in the own layout.

    Raises
    ------
    FileContentError
        A field is missing, or the layout is of a later version.
    """
    if MARK not in fields:
        raise FileContentError(f"{where} lacks {MARK}")
    layout = np.asarray(fields[MARK])
    if layout.size != 1 or layout.dtype.kind not in "iu" or int(layout.item()) not in (_LAYOUT, _UNCHECKED):
        raise FileContentError(
            f"{where} has layout {fields[MARK]!s:.20}, this version of jointfrf reads layouts "
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
        str(fields.get("unit", "")),
        fields.get("coherence"),
        fields.get("averages"),
        {int(node): place.astype(np.float64) for node, place in zip(nodes.ravel(), places, strict=True)},
    )
