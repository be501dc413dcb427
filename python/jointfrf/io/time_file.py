"""Files of time records: a text table or a MATLAB file with instants and the signals of sensors."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, check_file
from jointfrf.io.csv_file import TextTable, read_text_table
from jointfrf.io.hdf5_file import hdf5_fields
from jointfrf.io.mat_file import mat_fields
from jointfrf.io.units import Unit, parse_unit
from jointfrf.kernel.arguments import FloatArray, as_positive, check_type

__all__ = ["TimeRecord", "read_time_record"]

Motion = Literal["displacement", "velocity", "acceleration"]
#: Names of instants, and of the sampling rate or its inverse in MATLAB files.
_TIMES = ("t", "time", "times", "zeit", "temps", "tiempo", "tempo", "tijd", "tid", "x")
_RATES, _STEPS = ("fs", "rate", "samplerate", "sample_rate", "sampling_rate"), ("dt", "ts", "delta_t", "tinc")
#: Quantities by exponents of length, force and time; a rotation has no length.
_QUANTITIES: dict[tuple[int, int, int], Motion] = {
    (1, 0, 0): "displacement", (1, 0, -1): "velocity", (1, 0, -2): "acceleration",
    (0, 0, 0): "displacement", (0, 0, -1): "velocity", (0, 0, -2): "acceleration",
}  # fmt: skip
_BEGINNING_OF_MATLAB_7_3 = b"\x89HDF"


class TimeRecord(NamedTuple):
    """Instants (n,) in s, signals (n, n_sensors) in SI units, names of the sensors, and their quantities.

    A quantity is empty if the file states no unit.
    """

    time: FloatArray
    signals: FloatArray
    sensors: tuple[str, ...]
    motion: tuple[Motion | Literal[""], ...]


def read_time_record(
    path: str | PathLike[str], *, skip_lines: int = 0, rate: float | None = None, unit: str = "",
    limit_gb: float | None = None,
) -> TimeRecord:  # fmt: skip
    r"""Return a time record from a text table (CSV) or a MATLAB file.

    Parameters
    ----------
    path : Path or str
        Name of a table whose first column is time, with one column for each sensor below a heading such as
        ``time [s],A/1:y [m/s^2]``; a line below the heading may contain the units. Or of a MATLAB file with a vector of
        instants (``t``, ``time``) or a number (``fs``, ``dt``), and a vector or matrix for the sensors.
    skip_lines : int
        Number of lines before the heading of a table, default 0.
    rate : float, optional
        Sampling rate in Hz, if the file has no instants or rounds them; all columns without a name of times are then
        sensors.
    unit : str
        Unit of the signals without one, such as ``"g"``, default SI.
    limit_gb : float, optional
        Largest size of the content in memory, GB, see `read_frfs`.

    Returns
    -------
    TimeRecord
        Instants and signals.

    Raises
    ------
    FileContentError
        The file cannot be read, has no instants, or a cell is no number.
    MissingPackageError
        A MATLAB file of version 7.3, and h5py is not installed.

    See Also
    --------
    jointfrf.decay_of_mode : frequency and damping over amplitude of a free decay.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import jointfrf as jf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "decay.csv"
    ...     _ = path.write_text("time [s],A/1:y [mm/s^2]\n0,0\n0.001,2\n")
    ...     record = jf.io.read_time_record(path)
    >>> record.signals[:, 0].tolist(), record.motion
    ([0.0, 0.002], ('acceleration',))
    """
    where = Path(path)
    check_file(where)
    check_type("unit", unit, str)
    default = None if not unit else _known_unit(unit, "unit", str(where))
    if rate is not None:
        rate = as_positive("rate", rate, "Hz")
    if where.suffix.lower() == ".mat":
        names, units, values = _of_matlab(where, ReadLimit(where, limit_gb))
    else:
        names, units, values = _of_table(where, skip_lines)
    first = names[0].lower() in _TIMES
    if rate is None and not first:
        raise FileContentError(
            f"{where}: the first column is {names[0]!r}, no time; name it time, or state the sampling rate"
        )
    sensors, signals = names[1:] if first else names, values[:, 1:] if first else values
    units_of_sensors = units[1:] if first else units
    if not sensors:
        raise FileContentError(f"{where} has times and no sensors; add a column for each sensor")
    if len(set(sensors)) < len(sensors):
        raise FileContentError(f"{where}: two sensors have the same name; rename one")
    time = np.arange(len(values)) / rate if rate is not None else values[:, 0] * _seconds(units[0], str(where))
    parsed = [_known_unit(one, name, str(where)) if one else default for one, name in
              zip(units_of_sensors, sensors, strict=True)]  # fmt: skip
    factors = np.array([1.0 if one is None else one.to_si for one in parsed])
    quantities: list[Motion | Literal[""]] = ["" if one is None else _QUANTITIES[one.exponents] for one in parsed]
    for name, signal in zip(sensors, signals.T, strict=True):
        if not np.isfinite(signal).all():
            at = time[int(np.argmin(np.isfinite(signal)))]
            raise FileContentError(f"{where}: {name!r} has no finite value at {at:g} s; leave out these samples")
    return TimeRecord(time, signals * factors, tuple(sensors), tuple(quantities))


def _known_unit(label: str, name: str, where: str) -> Unit:
    found = parse_unit(label)
    if found is None or found.exponents not in _QUANTITIES:
        raise FileContentError(f"{where}: {name} has the unit {label!r}, no motion; use m, m/s, m/s^2, g, rad or alike")
    return found


def _seconds(label: str, where: str) -> float:
    found = parse_unit(label) if label else Unit(1.0, (0, 0, 1))
    if found is None or found.exponents != (0, 0, 1):
        raise FileContentError(f"{where}: time has the unit {label!r}; use s or ms")
    return found.to_si


def _split(name: str) -> tuple[str, str]:
    """Return a name and its unit in brackets at the end: `acc1 [m/s^2]`, `time (s)`."""
    whole = name.rstrip()
    start = max(whole.rfind(bracket) for bracket in "([{")
    unit = whole[start + 1 : -1]
    if start < 0 or whole[-1] not in ")]}" or any(bracket in unit for bracket in ")]}"):
        return name, ""
    return whole[:start].strip(), unit.strip()


def _of_table(path: Path, skip_lines: int) -> tuple[list[str], list[str], FloatArray]:
    table = read_text_table(path, skip_lines)
    numbers, names = list[list[float]](), list(table.heading)
    if _all_numbers(table, names):
        raise FileContentError(
            f"{path}: the first line contains numbers; add a heading with time and the names of the sensors"
        )
    names, units = (list(one) for one in zip(*map(_split, names), strict=True))
    for where, cells in table.rows:
        try:
            numbers.append([table.number(cell) for cell in cells])
        except ValueError:
            if not numbers and not any(_is_number(table, cell) for cell in cells):
                units = [cell.strip("[](){} ") for cell in cells]
                continue
            wrong = next((name, cell) for name, cell in zip(names, cells, strict=True) if not _is_number(table, cell))
            raise FileContentError(f"{where}: {wrong[0]} {wrong[1]!r} is no number; correct it") from None
    if not numbers:
        raise FileContentError(f"{path} has no numbers below its heading")
    return names, units, np.array(numbers)


def _is_number(table: TextTable, cell: str) -> bool:
    try:
        table.number(cell)
    except ValueError:
        return False
    return True


def _all_numbers(table: TextTable, cells: list[str]) -> bool:
    return all(_is_number(table, cell) for cell in cells)


def _of_matlab(path: Path, limit: ReadLimit) -> tuple[list[str], list[str], FloatArray]:
    with path.open("rb") as file:
        is_hdf5 = file.read(512).startswith((b"MATLAB 7.3", _BEGINNING_OF_MATLAB_7_3))
    fields = _flat(hdf5_fields(path, limit) if is_hdf5 else mat_fields(path, limit))
    time = next((fields.pop(name) for name in list(fields) if name.lower() in _TIMES and np.ndim(fields[name])), None)
    signals = {name: np.asarray(value, float) for name, value in fields.items() if _is_signal(value)}
    if not signals:
        shown = ", ".join(fields) or "nothing"
        raise FileContentError(f"{path} has no signals among {shown}; store a vector or a matrix of the sensors")
    n = len(time) if time is not None else max(max(one.shape) for one in signals.values())
    names, columns = list[str](), list[FloatArray]()
    for name, value in signals.items():
        rows = value[:, None] if value.ndim == 1 else value if value.shape[0] == n else value.T
        if rows.shape[0] != n:
            raise FileContentError(f"{path}: {name} has {' x '.join(map(str, value.shape))} values for {n} instants")
        names += [name] if rows.shape[1] == 1 else [f"{name}{i}" for i in range(1, rows.shape[1] + 1)]
        columns += list(rows.T)
    if time is None:
        step = _step(fields)
        time = None if step is None else np.arange(n) * step
    if time is not None:
        names, columns = ["time", *names], [np.asarray(time, float), *columns]
    return names, [""] * len(names), np.array(columns).T


def _flat(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the variables, and variables inside structures."""
    found: dict[str, Any] = {}
    for name, value in fields.items():
        found |= _flat(value) if isinstance(value, Mapping) else {name: value}
    return found


def _is_signal(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.ndim in (1, 2) and max(value.shape) > 1


def _step(fields: Mapping[str, Any]) -> float | None:
    for name, value in fields.items():
        if name.lower() in (*_RATES, *_STEPS) and np.ndim(value) == 0:
            return float(value) if name.lower() in _STEPS else 1 / float(value)
    return None
