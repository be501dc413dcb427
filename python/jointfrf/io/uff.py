"""FRFs of a Universal File (dataset 58)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.io.uff_file import UniversalFile, name_some
from jointfrf.io.uff_nodes import node_coordinates
from jointfrf.io.uff_ordinate import DATA_TYPES, Axis, kind_of_frf, ordinate_factor, ordinate_quantity

__all__ = ["read_uff"]

_DATASETS = {
    15: "nodes",
    18: "coordinate systems",
    55: "data at nodes",
    82: "trace lines",
    151: "header",
    164: "units",
    1858: "qualifiers of dataset 58",
    2400: "model header",
    2411: "nodes",
    2412: "elements",
    2414: "analysis data",
    2420: "coordinate systems",
    2429: "groups",
    2467: "groups",
}
_FUNCTIONS = {
    1: ("time history", "time histories"),
    2: ("auto spectrum", "auto spectra"),
    3: ("cross spectrum", "cross spectra"),
    5: ("transmissibility", "transmissibilities"),
    6: ("coherence", "coherences"),
    7: ("auto correlation", "auto correlations"),
    8: ("cross correlation", "cross correlations"),
    9: ("power spectral density", "power spectral densities"),
    12: ("spectrum", "spectra"),
    25: ("impulse response", "impulse responses"),
    26: ("multiple coherence", "multiple coherences"),
    27: ("order function", "order functions"),
}
_OTHER_FUNCTION = ("function of another kind", "functions of another kind")
_FRF = 4
_DIRECTIONS = {1: "+x", 2: "+y", 3: "+z", 4: "+rx", 5: "+ry", 6: "+rz"}
_DIRECTIONS |= {-code: "-" + direction[1:] for code, direction in _DIRECTIONS.items()}
_HZ = {"": 1.0, "hz": 1.0, "khz": 1e3, "rad/s": 0.5 / np.pi, "rad/sec": 0.5 / np.pi, "rpm": 1.0 / 60.0}
_SAME_LINES = 1e-5


@dataclass(frozen=True)
class _Frf:
    """Where an FRF stands in the file, and what it means."""

    dataset: int
    channels: tuple[Channel, Channel]
    entities: tuple[str, str]
    quantity: str
    factor: float

    def __str__(self) -> str:
        return f"{self.channels[0]} / {self.channels[1]}"


class _UnusableFrfError(Exception):
    """Why an FRF of a sound file is left out."""


def read_uff(path: str | PathLike[str], quantity: str | None = None) -> FrfSet:
    """Read the FRFs of a Universal File.

    Parameters
    ----------
    path : path-like
        An ASCII or binary (58b) Universal File.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        What every FRF of the file is, where its data types do not say it or confuse displacement, velocity and
        acceleration. Default: by the file.

    Returns
    -------
    FrfSet
        All FRFs of motion per force (function type 4), in SI units, channels in the order of the file. Where the file
        mixes quantities, all are given as the one that is differentiated most often.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        The file cannot be read, or lacks something; the message says what, and in which dataset, counted from 1.
    MissingPackageError
        The package pyuff is not installed.

    Warns
    -----
    FileContentWarning
        Something was assumed or left out; each is said once, with the datasets it is about. Left out are a dataset
        that the end of the file cuts short, FRFs without node or direction, of unknown kind or not of motion per force
        (if no others remain, that is an error), further FRFs between the same channels, a line at 0 Hz that is not a
        number, local coordinates. Assumed are units.

    Notes
    -----
    Units come from the labels of dataset 58 where they are understood. Otherwise the values are divided by the length
    and force factors of dataset 164, as its definition [1]_ says; coordinates always are.

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
    if quantity is not None and quantity not in POWER_OF_I_OMEGA:
        raise ValueError(f"quantity {quantity!r} is none of {', '.join(POWER_OF_I_OMEGA)}")
    file = UniversalFile(Path(path))
    frfs = _unique(file, _describe(file, quantity))
    freq_hz, values, common = _values(file, frfs)
    responses = tuple(dict.fromkeys(frf.channels[0] for frf in frfs))
    excitations = tuple(dict.fromkeys(frf.channels[1] for frf in frfs))
    row_of = {channel: i for i, channel in enumerate(responses)}
    column_of = {channel: i for i, channel in enumerate(excitations)}
    h = np.full((freq_hz.size, len(responses), len(excitations)), np.nan + 0j)
    for frf, value in zip(frfs, values, strict=True):
        h[:, row_of[frf.channels[0]], column_of[frf.channels[1]]] = value
    coordinates = node_coordinates(file, {channel.node for channel in (*responses, *excitations)})
    file.warn(stacklevel=3)
    return FrfSet(freq_hz, responses, excitations, h, common, coordinates, str(path))


def _describe(file: UniversalFile, quantity: str | None) -> list[_Frf]:
    """Find the FRFs that can be used, and what their headers say."""
    headers = {number: file.read(number, header_only=True) for number in file.datasets(58)}
    frfs = {number: header for number, header in headers.items() if header["func_type"] == _FRF}
    if not frfs:
        raise file.error(f"holds {_contents(file, headers)}")
    found: list[_Frf] = []
    reasons: dict[str, list[int]] = {}
    for number, header in frfs.items():
        try:
            found.append(_describe_frf(file, number, header, quantity))
        except _UnusableFrfError as error:
            reasons.setdefault(str(error), []).append(number)
    if not found:
        why = "; ".join(f"{reason} ({name_some('dataset', numbers)})" for reason, numbers in reasons.items())
        raise file.error(f"holds no FRF that can be used: {why}")
    for reason, numbers in reasons.items():
        file.note(f"FRF left out: {reason}", *numbers)
    return found


def _describe_frf(file: UniversalFile, number: int, header: dict[str, Any], quantity: str | None) -> _Frf:
    """Channels, quantity and factor to SI of one FRF."""
    _check_form(file, number, header)
    numerator, denominator = Axis.of(header, "ordinate"), Axis.of(header, "orddenom")
    other = kind_of_frf(numerator, denominator)
    if other is not None:
        raise _UnusableFrfError(f"it is {other}, not motion per force")
    channels = _channel(header, "rsp", "response"), _channel(header, "ref", "reference")
    found = quantity or ordinate_quantity(numerator, denominator, channels)
    if found is None:
        raise _UnusableFrfError(f"its data types {numerator} per {denominator} do not say what it is; give quantity=")
    system = file.unit_system(number)
    try:
        factor = ordinate_factor(
            numerator,
            denominator,
            channels,
            found,
            system,
            trust_labels=quantity is None,
            note=lambda sentence: file.note(sentence, number),
        )
    except ValueError as error:
        raise file.error(f"contradicts itself in dataset {number}: {error}; give quantity=") from error
    if not 0.0 < factor < np.inf:
        raise file.error(f"has a unit in dataset {number} that cannot be converted to SI")
    return _Frf(number, channels, (header["rsp_ent_name"], header["ref_ent_name"]), found, factor)


def _check_form(file: UniversalFile, number: int, header: dict[str, Any]) -> None:
    """Refuse forms of dataset 58 that would be read wrongly."""
    if header["ord_data_type"] in (2, 4):
        raise _UnusableFrfError("its values are real numbers, without phase")
    if header["ord_data_type"] not in (5, 6):
        raise file.error(f"is damaged: ordinate data type {header['ord_data_type']} in dataset {number}")
    form = header.get("byte_ordering", 1), header.get("fp_format", 2), header.get("n_ascii_lines", 11)
    if header["binary"] and (form[0] not in (1, 2) or form[1:] != (2, 11)):
        raise file.error(f"holds binary numbers in dataset {number} that are not IEEE 754 after 11 lines of text")


def _channel(header: dict[str, Any], prefix: str, role: str) -> Channel:
    node, direction = header[f"{prefix}_node"], header[f"{prefix}_dir"]
    if node < 1:
        raise _UnusableFrfError(f"it names no {role} node (node {node})")
    if direction not in _DIRECTIONS:
        raise _UnusableFrfError(f"it names no {role} direction (code {direction})")
    return Channel(node, _DIRECTIONS[direction])


def _unique(file: UniversalFile, frfs: list[_Frf]) -> list[_Frf]:
    """Keep the first of FRFs between the same channels; refuse two structures that share their numbers."""
    first: dict[tuple[Channel, Channel], _Frf] = {}
    for frf in frfs:
        kept = first.setdefault(frf.channels, frf)
        if kept.entities != frf.entities:
            names = ["'{}' / '{}'".format(*each.entities) for each in (kept, frf)]
            raise file.error(
                f"holds FRF {frf} for the entities {names[0]} (dataset {kept.dataset}) and {names[1]} (dataset "
                f"{frf.dataset}): node numbers must be unique in the file"
            )
        if kept is not frf:
            file.note("a second FRF between the same channels is left out", frf.dataset)
    return list(first.values())


def _values(file: UniversalFile, frfs: list[_Frf]) -> tuple[NDArray[np.float64], list[NDArray[np.complex128]], str]:
    """Frequency lines, the FRFs in SI units, and the one quantity they are all given as."""
    common = max((frf.quantity for frf in frfs), key=POWER_OF_I_OMEGA.__getitem__)
    lines: NDArray[np.float64] | None = None
    values = []
    for frf in frfs:
        freq_hz, value = _read_frf(file, frf)
        if lines is None:
            lines = freq_hz
        elif lines.shape != freq_hz.shape or not np.allclose(freq_hz, lines, rtol=_SAME_LINES, atol=0.0):
            held = [f"{_lines(f)} in dataset {each.dataset} ({each})" for f, each in ((lines, frfs[0]), (freq_hz, frf))]
            raise file.error(f"holds FRFs at different frequencies: {held[0]}, {held[1]}")
        power = POWER_OF_I_OMEGA[common] - POWER_OF_I_OMEGA[frf.quantity]
        with np.errstate(over="ignore", invalid="ignore"):
            values.append(value * frf.factor * (2j * np.pi * freq_hz) ** power if power else value * frf.factor)
    assert lines is not None
    return *_without_bad_zero_line(file, frfs, lines, values), common


def _read_frf(file: UniversalFile, frf: _Frf) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies in Hz and values in the file's units of one FRF."""
    content = file.read(frf.dataset)
    n, value = content["num_pts"], np.asarray(content["data"], dtype=np.complex128)
    if n < 1 or not n <= value.size <= n + 1:
        raise file.error(f"is damaged: dataset {frf.dataset} ({frf}) holds {value.size} of {n} values")
    kind = content["abscissa_spec_data_type"]
    if kind not in (0, 1, 18):
        raise file.error(
            f"gives the FRF in dataset {frf.dataset} ({frf}) over {DATA_TYPES.get(kind, kind)}, not frequency"
        )
    label = content["abscissa_axis_units_lab"].strip().lower()
    label = "" if label == "none" else label
    if label not in _HZ or (not label and kind != 18):
        file.note(f"the unit '{label}' of the frequencies is not known: Hz is assumed", frf.dataset)
    freq_hz = np.asarray(content["x"], dtype=np.float64)[:n] * _HZ.get(label, 1.0)
    if freq_hz.size != n or not np.isfinite(freq_hz).all() or freq_hz[0] < 0.0 or (np.diff(freq_hz) <= 0.0).any():
        raise file.error(
            f"is damaged: the frequencies of dataset {frf.dataset} ({frf}) do not increase from 0 Hz or more"
        )
    return freq_hz, value[:n]


def _without_bad_zero_line(
    file: UniversalFile, frfs: list[_Frf], freq_hz: NDArray[np.float64], values: list[NDArray[np.complex128]]
) -> tuple[NDArray[np.float64], list[NDArray[np.complex128]]]:
    """Drop a line at 0 Hz with NaN or Inf, as division by a zero spectrum leaves it; refuse them elsewhere."""
    drop = False
    for frf, value in zip(frfs, values, strict=True):
        bad = freq_hz[~np.isfinite(value)]
        if bad.size and bad[-1] > 0.0:
            first = bad[bad > 0.0][0]
            raise file.error(f"holds NaN or Inf in dataset {frf.dataset} ({frf}), first at {first:g} Hz")
        if bad.size:
            file.note("the line at 0 Hz holds NaN or Inf and is dropped", frf.dataset)
            drop = True
    if drop and freq_hz.size == 1:
        raise file.error("holds nothing but NaN or Inf at 0 Hz")
    return (freq_hz[1:], [value[1:] for value in values]) if drop else (freq_hz, values)


def _contents(file: UniversalFile, headers: dict[int, dict[str, Any]]) -> str:
    """Say what a file without FRFs holds."""
    if headers:
        functions = Counter(header["func_type"] for header in headers.values())
        held = ", ".join(f"{_count(n, kind)} (dataset 58, function type {kind})" for kind, n in functions.items())
        return f"{held} and no FRF"
    kinds = [f"{kind} ({_DATASETS[kind]})" if kind in _DATASETS else str(kind) for kind in sorted(set(file.types))]
    return f"dataset{'s' if len(kinds) > 1 else ''} {', '.join(kinds)} and no FRF (dataset 58, function type {_FRF})"


def _count(n: int, function_type: int) -> str:
    singular, plural = _FUNCTIONS.get(function_type, _OTHER_FUNCTION)
    return f"{n} {singular if n == 1 else plural}"


def _lines(freq_hz: NDArray[np.float64]) -> str:
    return f"{freq_hz.size} lines {freq_hz[0]:.6g} to {freq_hz[-1]:.6g} Hz"
