"""Which field of a file is what: by the names that scripts use, or as the user says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches
from typing import Any

import numpy as np

from jointfrf.errors import FileContentError
from jointfrf.io.arrays import FrfArrays

__all__ = ["FrfMapping", "as_mapping", "mapped_arrays"]

#: Names, in lower case, that are taken for a field where the user names none.
_KNOWN = {
    "freq_hz": ("freq_hz", "freq", "freqs", "f", "f_hz", "frequency", "frequencies", "frequency_hz", "freqv",
                "omega", "w"),
    "h": ("h", "frf", "frfs", "y", "h1", "h2", "hv", "hxy", "tf", "xfer", "accelerance", "inertance", "mobility",
          "receptance"),
    "responses": ("responses", "response", "response_dofs", "rsp", "outputs", "output", "out_dofs", "channels"),
    "excitations": ("excitations", "excitation", "references", "reference", "reference_dofs", "ref", "inputs",
                    "input", "in_dofs", "impacts"),
    "quantity": ("quantity",),
    "unit": ("unit", "units", "frf_unit"),
    "coherence": ("coherence", "coh", "gamma2", "coherences"),
    "averages": ("averages", "n_averages", "navg", "n_avg", "number_of_averages"),
}  # fmt: skip
_QUANTITIES = ("accelerance", "inertance", "mobility", "receptance")
_RADIANS = ("omega", "w")


@dataclass(frozen=True)
class FrfMapping:
    """Which field of a file is what; None: by the names that scripts use.

    Parameters
    ----------
    freq_hz, h, coherence, averages, quantity, unit : str, optional
        Names of fields; inside structures or groups with points between, ``test.frf``.
    responses, excitations : str or sequence of str, optional
        The field that holds the names of the channels, or these names.
    axes : str, optional
        Order of the axes: ``freq,out,in``, ``out,in,freq``, ...; by the sizes where they say it.
    """

    freq_hz: str | None = None
    h: str | None = None
    responses: Any = None
    excitations: Any = None
    axes: str | None = None
    quantity: str | None = None
    unit: str | None = None
    coherence: str | None = None
    averages: str | None = None


def as_mapping(given: Mapping[str, Any] | FrfMapping | None) -> FrfMapping:
    """Take what the user says.

    Raises
    ------
    ValueError
        It says something of a field that there is not.
    """
    if isinstance(given, FrfMapping):
        return given
    if not isinstance(given, Mapping | None):
        raise TypeError(f"mapping must be a mapping or an FrfMapping, not {type(given).__name__}")
    names = [each.name for each in fields(FrfMapping)]
    for name in given or {}:
        if name not in names:
            near = get_close_matches(str(name), names, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise ValueError(f"mapping names {name!r}, which is none of {', '.join(names)}{hint}")
    return FrfMapping(**(given or {}))


def mapped_arrays(content: Mapping[str, Any], mapping: FrfMapping, where: str) -> FrfArrays:
    """FRFs of the fields of a file.

    Parameters
    ----------
    content : mapping
        Fields by name, structures and groups as mappings inside.
    mapping : FrfMapping
        What the user says.
    where : str
        The file, with which messages begin.

    Returns
    -------
    FrfArrays

    Raises
    ------
    FileContentError
        A field is missing or not the only one of its kind.
    """
    flat = dict(_flattened(content))
    found = {name: _field(flat, name, getattr(mapping, name), where) for name in _KNOWN}
    freq, h = found["freq_hz"], found["h"]
    for each, name, what in ((freq, "freq_hz", "frequencies"), (h, "h", "FRFs")):
        if each is None:
            known = ", ".join(_KNOWN[name])
            raise FileContentError(
                f"{where} has no field for the {what} ({known}): say which of {_names(flat)} by mapping"
            )
    assert freq is not None
    assert h is not None
    path, values = freq
    freq_hz = np.asarray(values)
    if path.rpartition(".")[2].lower() in _RADIANS and freq_hz.dtype.kind in "iuf":
        freq_hz = freq_hz / (2 * np.pi)
    quantity = _text(found["quantity"])
    last = h[0].rpartition(".")[2].lower()
    return FrfArrays(
        freq_hz,
        h[1],
        mapping.axes or "",
        _value(found["responses"]),
        _value(found["excitations"]),
        quantity or (last if last in _QUANTITIES else ""),
        _text(found["unit"]),
        _value(found["coherence"]),
        _value(found["averages"]),
    )


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
    shown = [name if len(name) <= 30 else f"{name[:27]}..." for name in list(flat)[:12]]
    return ", ".join(shown) + (f" and {len(flat) - 12} more" if len(flat) > 12 else "") if shown else "nothing"


def _value(found: tuple[str, Any] | None) -> Any:
    return None if found is None else found[1]


def _text(found: tuple[str, Any] | None) -> str:
    if found is None:
        return ""
    texts = [str(each).strip() for each in np.ravel(found[1])]
    return texts[0] if len(set(texts)) == 1 else ""
