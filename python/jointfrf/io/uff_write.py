"""FRFs as a Universal File (datasets 151, 164, 2411 and 58)."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.files import write_file
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.kernel.arguments import check_type

__all__ = ["write_uff"]

_DELIMITER = "    -1"
_AXES = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}
_DATA_TYPES = (8, 11, 12)  # displacement, velocity, acceleration
_FORCE, _FREQUENCY = 13, 18
_PER_TIME = ("", "/s", "/s^2")
_FRF, _COHERENCE = 4, 6
_N_TEXT_LINES = 11
_WIDTH = 80
#: How far, relative to it, a line may lie from where an even spacing puts it.
_EVEN = 1e-9


def write_uff(
    path: str | PathLike[str], frfs: FrfSet, *, title: str = "", binary: bool = True, single: bool = False
) -> None:
    """Write measured FRFs as a Universal File.

    Parameters
    ----------
    path : path-like
        In a folder that exists; an older file is replaced as a whole or not at all.
    frfs : FrfSet
        The FRFs, in the quantity that they have; those that are not there (NaN on all lines) are left out. Coordinates
        and coherence are written where they are known. The format has no place for numbers of averages.
    title : str
        One line of ASCII, at most 80 characters, for the header and for every FRF.
    binary : bool
        Dataset 58b: the values as IEEE numbers, little-endian. Unevenly spaced lines are written as text all the
        same, because programs differ in how they read them from 58b.
    single : bool
        Values in single precision, as most test systems write them, not in double.

    Raises
    ------
    ValueError
        The title cannot be written, an FRF is NaN or infinite on some lines, or there is no FRF.
    OSError
        The file cannot be written; nothing is left behind.

    See Also
    --------
    jointfrf.io.read_uff : The way back.

    Notes
    -----
    Units are SI and stated twice, by dataset 164 and by the labels of each FRF. The definition of the datasets [1]_ has
    13 columns for a frequency: frequencies of 1 Hz and more come back to 1e-9 of themselves. Values come back to 12
    digits from text (6 where `single`), exactly from binary. No date is written: the same FRFs give the same bytes.

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
    parts = [_header(title), _units(), _nodes(frfs)]
    for i, j in np.argwhere(frfs.measured):
        values = frfs.h[:, i, j]
        place = _place(frfs.responses[i], frfs.excitations[j])
        head = _Head(place, f"FRF {frfs.responses[i]} / {frfs.excitations[j]}", title, _FRF, axes=_ordinate(frfs, i, j))
        parts.append(_function(head, frfs.freq_hz, values, binary, single))
        if frfs.coherence is not None and np.isfinite(frfs.coherence[:, i, j]).all():
            name = f"coherence {frfs.responses[i]} / {frfs.excitations[j]}"
            head = _Head(place, name, title, _COHERENCE, [_axis(0, "Coherence", "NONE"), _axis(0, "NONE", "NONE")])
            parts.append(_function(head, frfs.freq_hz, frfs.coherence[:, i, j], binary, single))
    write_file(Path(path), b"".join(parts))


def _dataset(kind: str, *records: str) -> bytes:
    return "\n".join([_DELIMITER, kind, *records, _DELIMITER, ""]).encode("ascii")


def _header(title: str) -> bytes:
    none = f"{'NONE':<10}{'NONE':<10}"
    return _dataset(
        "   151", "NONE", title or "NONE", "jointfrf", f"{none}{0:10d}{0:10d}{0:10d}", none, "jointfrf", none
    )


def _units() -> bytes:
    factors = "".join(_double(1.0, 17) for _ in range(3))
    return _dataset("   164", f"{1:10d}{'SI: m, N':<20}{2:10d}", factors, _double(273.15, 17))


def _nodes(frfs: FrfSet) -> bytes:
    records = []
    for node, place in sorted(frfs.coordinates.items()):
        records += [f"{node:10d}{0:10d}{0:10d}{1:10d}", "".join(_double(x, 16) for x in place)]
    return _dataset("  2411", *records) if records else b""


class _Head(NamedTuple):
    """What the records before the numbers say of one function."""

    place: str
    name: str
    title: str
    kind: int
    axes: list[str]


def _ordinate(frfs: FrfSet, i: int, j: int) -> list[str]:
    """Write records 9 and 10 of an FRF."""
    power = POWER_OF_I_OMEGA[frfs.quantity]
    motion = ("rad" if frfs.responses[i].is_rotation else "m") + _PER_TIME[power]
    force = "N m" if frfs.excitations[j].is_rotation else "N"
    return [_axis(_DATA_TYPES[power], "Response", motion), _axis(_FORCE, "Excitation", force)]


def _function(
    head: _Head,
    freq_hz: NDArray[np.float64],
    values: NDArray[np.complex128] | NDArray[np.float64],
    binary: bool,
    single: bool,
) -> bytes:
    """Dataset 58 or 58b of one FRF or of its coherence."""
    start, step = _spacing(freq_hz)
    is_even, is_complex = step is not None, np.iscomplexobj(values)
    number_type = (5 if single else 6) if is_complex else (2 if single else 4)
    records = [
        head.name,
        head.title or "NONE",
        *["NONE"] * 3,
        f"{head.kind:5d}{0:10d}{0:5d}{0:10d} {head.place}",
        f"{number_type:10d}{values.size:10d}{int(is_even):10d}{start}{step or _short(0.0)}{_short(0.0)}",
        _axis(_FREQUENCY, "Frequency", "Hz"),
        *head.axes,
        _axis(0, "NONE", "NONE"),
    ]
    if not (binary and is_even):
        return _dataset("    58", *records, *_text(freq_hz, values, is_even, single))
    data = values.astype(("<c8" if single else "<c16") if is_complex else ("<f4" if single else "<f8")).tobytes()
    kind = f"    58b{1:6d}{2:6d}{_N_TEXT_LINES:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    text = "\n".join([_DELIMITER, kind, *records, ""]).encode("ascii")
    return text + data + f"\n{_DELIMITER}\n".encode("ascii")


def _place(*channels: Channel) -> str:
    """Fields of record 6 that name response and reference."""
    return " ".join(f"{'NONE':<10}{each.node:10d}{each.sign * _AXES[each.axis]:4d}" for each in channels)


def _axis(data_type: int, label: str, unit: str) -> str:
    return f"{data_type:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}"


def _spacing(freq_hz: NDArray[np.float64]) -> tuple[str, str | None]:
    """First line and spacing as they are written; no spacing where it is uneven."""
    step = (freq_hz[-1] - freq_hz[0]) / max(freq_hz.size - 1, 1)
    texts = _short(freq_hz[0]), _short(step)
    written = float(texts[0]) + float(texts[1]) * np.arange(freq_hz.size)
    is_even = np.allclose(written, freq_hz, rtol=_EVEN, atol=0.0)
    return texts if is_even else (_short(0.0), None)


def _text(
    freq_hz: NDArray[np.float64], values: NDArray[np.complex128] | NDArray[np.float64], is_even: bool, single: bool
) -> list[str]:
    """Record 12: four or six numbers a line; with an uneven spacing, each value after its frequency."""
    numbers = [f"{x:13.5E}" if single else f"{x:20.11E}" for x in np.ascontiguousarray(values).view(np.float64)]
    if is_even:
        a_line = 6 if single else 4
        return ["".join(numbers[i : i + a_line]) for i in range(0, len(numbers), a_line)]
    of_each = 2 if np.iscomplexobj(values) else 1
    parts = [(_short(f), *numbers[of_each * i : of_each * (i + 1)]) for i, f in enumerate(freq_hz)]
    a_line = (6 if single else 4) // (1 + of_each) if single or of_each == 1 else 1
    return ["".join(x for part in parts[i : i + a_line] for x in part) for i in range(0, len(parts), a_line)]


def _short(value: float) -> str:
    """Write a number in 13 columns, with its point and as many digits as they hold."""
    texts = (f"{value:#.{digits}g}" for digits in range(12, 4, -1))
    return f"{next(text for text in texts if len(text) < 13):>13}"


def _double(value: float, digits: int) -> str:
    """Write a number in 25 columns with the exponent letter of Fortran's double precision."""
    return f"{value:25.{digits - 1}E}".replace("E", "D")
