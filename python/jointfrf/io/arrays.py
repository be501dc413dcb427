"""FRFs from arrays: axes, channels, quantity and unit are checked and converted to the form of a set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.io.file_format import FrfArrays, Reading
from jointfrf.io.pyfbs_tables import channels_of_tables, is_table, rows_of_table
from jointfrf.io.units import QUANTITIES, parse_frequency_unit, parse_unit
from jointfrf.kernel.arguments import as_array, check_type
from jointfrf.spelling import some_of

__all__ = ["as_frf_set", "contradiction", "finite_frfs", "frfs_of_arrays"]

#: Names of the axes of an array of FRFs.
_AXES = ("freq", "out", "in")
#: Orders of axes that follow from the sizes of an array, with responses before excitations.
_ORDERS = ([0, 1, 2], [1, 2, 0], [1, 0, 2])
#: Number of FRFs that a message names.
_SHOWN = 3


def frfs_of_arrays(
    freq_hz: ArrayLike,
    h: ArrayLike,
    responses: Any,
    excitations: Any,
    *,
    quantity: str | None = None,
    unit: str = "",
    axes: str = "freq,out,in",
    coherence: ArrayLike | None = None,
    averages: ArrayLike | None = None,
    source: str = "arrays",
) -> FrfSet:
    """Return a set of FRFs made of arrays, such as the arrays of pyFBS.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequency lines in Hz, increasing.
    h : array_like of complex, three axes in the order of `axes`
        FRFs in `unit`; NaN on all lines if there is none.
    responses, excitations : sequence of str, Channel or (int, int); or a table
        Channels of one side, in one of these forms:

        - names such as ``102:+y``
        - pairs of node and direction code (1 to 6 are x, y, z, rx, ry, rz; negative against the axis)
        - a table of pyFBS, mapping or DataFrame, for both sides, with columns ``Position_1`` to ``Position_3`` (m) and
          ``Direction_1`` to ``Direction_3``; channels at one place get one node, counted from 1
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity of the FRFs; by default the quantity of `unit`.
    unit : str
        Unit of the FRFs, such as ``g/N`` or ``(m/s^2)/N``; required.
    axes : str
        Order of the axes of `h` and `coherence`: ``freq,out,in``, ``out,in,freq``, ...
    coherence : array_like, shape of `h`, optional
        Ordinary coherence, 0 to 1.
    averages : number or array_like, shape (n_responses, n_excitations), optional
        Number of averages.
    source : str
        Name of the data in messages.

    Returns
    -------
    FrfSet
        FRFs in SI units.

    Raises
    ------
    FileContentError
        Sizes, names or units do not match, or values are not finite; the message states which.

    See Also
    --------
    read_frfs : FRFs of files.
    from_pyfbs : FRFs of pyFBS with the places of their channels.

    Examples
    --------
    >>> import numpy as np
    >>> frfs = frfs_of_arrays([10, 20], np.ones((2, 1, 2)), ["1:y"], ["1:y", "2:y"], unit="mm/s^2/N")
    >>> frfs.quantity, frfs.h[0, 0].real.tolist()
    ('accelerance', [0.001, 0.001])
    """
    for name, value in (("unit", unit), ("axes", axes), ("source", source)):
        check_type(name, value, str)
    reading = Reading.checked(quantity)
    coordinates: Mapping[int, NDArray[np.float64]] = {}
    if is_table(responses) or is_table(excitations):
        rows = rows_of_table("responses", responses, 1.0), rows_of_table("excitations", excitations, 1.0)
        found = channels_of_tables(*rows)
        if found.oblique:
            raise ValueError(f"{found.oblique[0][0].where} does not point along an axis; use jointfrf.io.from_pyfbs")
        responses, excitations, coordinates = found.responses, found.excitations, found.coordinates
    content = FrfArrays(freq_hz, h, axes, responses, excitations, "", unit, coherence, averages, coordinates)
    frfs = as_frf_set(content, source, reading)
    reading.warn()
    return frfs


def as_frf_set(content: FrfArrays, where: str, reading: Reading) -> FrfSet:
    """Return a set made of the content of a file.

    Parameters
    ----------
    content : FrfArrays
        Content of the file, in its units and order.
    where : str
        Name of the file, with which messages begin.
    reading : Reading
        Statements of the user.

    Raises
    ------
    FileContentError
        Something does not match; the message is one sentence.
    """
    try:
        freq_hz = _frequencies(content.freq_hz) * _hertz(content, reading)
        responses, excitations = _channels(content, reading)
        shape = (freq_hz.size, len(responses), len(excitations))
        h = _in_order("FRFs", content.h, content.axes, shape).astype(np.complex128)
        used, factor = _quantity(content, (*responses, *excitations), reading)
        coherence = None
        if content.coherence is not None:
            coherence = _in_order("coherence", content.coherence, content.axes, shape).astype(np.float64)
        averages = content.averages
        if averages is not None:
            averages = _numbers("averages", averages)
            averages = averages.reshape(shape[1:] if averages.size == shape[1] * shape[2] else averages.shape)
        stated = f"{content.quantity or 'FRFs of an unnamed quantity'} [{content.unit or 'no unit'}]"
        stated += f", unit stated: {reading.units.frf}" if reading.units.frf else ""
        with np.errstate(over="ignore", invalid="ignore"):
            h *= factor
        places = content.coordinates
        setups = None if content.setups is None else content.setups.times(factor)
        whole = FrfSet(freq_hz, responses, excitations, h, used, places, where, coherence, averages, stated, setups)
        found, left_out = finite_frfs(whole)
    except (ValueError, TypeError, OverflowError) as error:
        raise FileContentError(f"{where}: {error}") from error
    reading.notes.extend(f"{where}: {each}" for each in (*content.notes, *left_out) if each)
    return found


def finite_frfs(frfs: FrfSet) -> tuple[FrfSet, list[str]]:
    """Return FRFs without a line at 0 Hz that is not finite, and without FRFs that contain NaN or Inf.

    Parameters
    ----------
    frfs : FrfSet
        FRFs of a file.

    Returns
    -------
    FrfSet
        FRFs without the line at 0 Hz if an FRF is not finite there, as after division by a spectrum of zero; without
        FRFs that are not finite on other lines.
    list of str
        Omitted lines and FRFs, one sentence each.

    Raises
    ------
    ValueError
        No FRF remains, or the set has set-ups, from which no FRF can be omitted.
    """
    if frfs.setups is not None:
        frfs.check_whole()
        return frfs, []
    bad, notes = ~np.isfinite(frfs.h) & frfs.measured, []
    if frfs.freq_hz[0] == 0.0 and bad[0].any():
        if frfs.freq_hz.size == 1:
            raise ValueError("it contains only NaN or Inf at 0 Hz")
        notes.append(f"the line at 0 Hz contains NaN or Inf in {_pairs(frfs, bad[0])} and is left out")
        coherence = None if frfs.coherence is None else frfs.coherence[1:]
        frfs, bad = replace(frfs, freq_hz=frfs.freq_hz[1:], h=frfs.h[1:], coherence=coherence), bad[1:]
    is_out = bad.any(axis=0)
    for i, j in np.argwhere(is_out):
        held = bad[:, i, j]
        notes.append(
            f"FRF {frfs.responses[i]} / {frfs.excitations[j]} is left out: NaN or Inf on {held.sum()} of {held.size} "
            f"lines, first at {frfs.freq_hz[held.argmax()]:g} Hz"
        )
    if is_out.any():
        frfs = replace(frfs, h=np.where(is_out, np.nan, frfs.h))
    if not frfs.measured.any():
        raise ValueError(notes[-1] if notes else "there is no FRF")
    return frfs, notes


def _pairs(frfs: FrfSet, chosen: NDArray[np.bool_]) -> str:
    names = [f"{frfs.responses[i]} / {frfs.excitations[j]}" for i, j in np.argwhere(chosen)]
    return some_of(names, _SHOWN)


def contradiction(said: str, wanted: str, where: str) -> str:
    """Return the end of a sentence on a contradiction between a file and its user; it begins with the file."""
    return f"states {said} ({where}), not {wanted}; leave quantity and unit out, or give unit and force_quantity"


def _numbers(what: str, values: Any) -> NDArray[Any]:
    found = as_array(f"the {what}", values)
    if found.dtype.kind not in "biufc":
        raise ValueError(f"the {what} are not numbers")
    return found


def _frequencies(values: Any) -> NDArray[np.float64]:
    freq_hz = _numbers("frequencies", values)
    freq_hz = freq_hz.reshape(-1) if freq_hz.size == max(freq_hz.shape, default=1) else freq_hz
    if freq_hz.ndim != 1 or not freq_hz.size or freq_hz.dtype.kind == "c":
        raise ValueError(f"the frequencies have shape {np.shape(values)}, expected one column of real numbers")
    if not np.isfinite(freq_hz).all() or freq_hz[0] < 0 or (np.diff(freq_hz) <= 0).any():
        raise ValueError("the frequencies do not increase from 0 Hz or more")
    return freq_hz.astype(np.float64)


def _hertz(content: FrfArrays, reading: Reading) -> float:
    """Return the unit of the frequencies in Hz, stated by the user or by the file."""
    label = content.frequency_unit
    stated = parse_frequency_unit(reading.units.frequency)
    factor = reading.agreed("frequencies", stated, parse_frequency_unit(label), label)
    if factor is None and label:
        raise ValueError(f"the unit '{label}' of the frequencies is not understood; give unit= with frequency=Hz")
    return 1.0 if factor is None else factor


def _channels(content: FrfArrays, reading: Reading) -> tuple[tuple[Channel, ...], tuple[Channel, ...]]:
    sides = "responses", "excitations"
    missing = [side for side in sides if getattr(content, side) is None]
    if missing:
        held = " x ".join(map(str, np.shape(content.h)))
        ways = " and ".join(f"mapping {side}=..." for side in missing)
        raise ValueError(f"the FRFs ({held}) have no names of {' and '.join(missing)}; give {ways}, such as 1:x,2:x")
    namer = reading.mapping.namer
    responses, excitations = (namer.channels(side, getattr(content, side)) for side in sides)
    return responses, excitations


def _in_order(what: str, values: Any, axes: str, shape: tuple[int, int, int]) -> NDArray[Any]:
    """Return values with axes frequency, response, excitation; programs may have dropped axes of length 1."""
    array = _numbers(what, values)
    fitting = []
    for order in [_order(axes)] if axes else _ORDERS:
        ordered = tuple(shape[axis] for axis in order)
        if _without_ones(array.shape) == _without_ones(ordered):
            fitting.append(np.moveaxis(array.reshape(ordered), [0, 1, 2], order))
    if not fitting:
        held = " x ".join(map(str, array.shape))
        wanted = "{} lines, {} responses, {} excitations".format(*shape)
        hint = f" in the order {axes}" if axes else "; give axes="
        raise ValueError(f"the {what} have the sizes {held}, which do not fit {wanted}{hint}")
    if any(not np.array_equal(fitting[0], other, equal_nan=True) for other in fitting[1:]):
        raise ValueError(
            f"which axis of the {what} is frequency is not clear from the sizes; give axes=, such as freq,out,in"
        )
    return np.ascontiguousarray(fitting[0])


def _order(axes: str) -> list[int]:
    names = [name.strip() for name in str(axes).split(",")]
    if sorted(names) != sorted(_AXES):
        raise ValueError(f"axes {axes!r} do not name freq, out and in; give them in their order, such as out,in,freq")
    return [_AXES.index(name) for name in names]


def _without_ones(shape: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(n for n in shape if n != 1)


def _quantity(content: FrfArrays, channels: tuple[Channel, ...], reading: Reading) -> tuple[str, float]:
    """Return the quantity and its factor to SI."""
    quantity = reading.quantity
    unit = parse_unit(content.unit)
    said = content.quantity.strip().lower()
    if said == "inertance":
        said = "accelerance"
    if said and said not in POWER_OF_I_OMEGA:
        raise ValueError(f"unknown quantity {content.quantity!r}; use one of {', '.join(POWER_OF_I_OMEGA)}")
    by_unit = QUANTITIES.get(unit.exponents, "") if unit else ""
    if said and by_unit and said != by_unit and not quantity:
        raise ValueError(f"the unit '{content.unit}' does not fit {said}; give quantity=")
    agreed = {said, by_unit} - {""}
    if quantity and len(agreed) == 1 and agreed != {quantity} and not reading.forced:
        raise ValueError(f"the file {contradiction(agreed.pop(), quantity, content.unit or 'no unit')}")
    used = quantity or said or by_unit
    found = unit.to_si if unit and used and by_unit == used else None
    factor = reading.agreed("FRFs", reading.units.frf_to_si, found, content.unit)
    if factor is None:
        why = f"the unit '{content.unit}' {'does not fit ' + used if unit and used else 'is not understood'}"
        raise ValueError(f"{why if content.unit else 'the FRFs have no unit'}; give unit=, such as g/N or (m/s^2)/N")
    if factor != 1.0 and any(channel.is_rotation for channel in channels):
        raise ValueError(f"the unit '{reading.units.ratio or content.unit}' is none of rotations; give SI units")
    return used, factor
