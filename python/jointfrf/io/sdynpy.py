"""To and from SDynPy and ESCDF: functions one by one, with coordinates and the frequency axis last."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.io.arrays import as_frf_set
from jointfrf.io.file_format import TIME_DATA, FrfArrays, Reading
from jointfrf.io.functions import LooseFunction, arrays_of_functions, functions_of_sdynpy
from jointfrf.io.labels import DIRECTION_CODES, ChannelNamer
from jointfrf.kernel.arguments import as_array, check_type, one_line

__all__ = ["from_escdf", "from_sdynpy", "to_escdf", "to_sdynpy"]

#: Function type of FRFs, as in Universal Files, and names of FRFs and time histories in ESCDF.
_FRF, _FRF_WORDS, _TIME_WORDS = 4, ("frequencyresponse", "frf", "transferfunction", "tf"), ("time", "th")
#: SI units by how often a receptance is differentiated.
_UNITS = ("m/N", "m/s/N", "m/s^2/N")
_CODES = {direction: code for code, direction in DIRECTION_CODES.items()}


def from_sdynpy(array: Any, *, unit: str, quantity: str | None = None, source: str = "SDynPy") -> FrfSet:
    """Return the FRFs of an array of SDynPy.

    Parameters
    ----------
    array : sdynpy.TransferFunctionArray, or structured ndarray
        Functions in any shape; fields ``abscissa`` (Hz), ``ordinate`` and ``coordinate`` (response, reference).
    unit : str
        Unit of the FRFs, such as ``m/s^2/N``. SDynPy does not store it.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity of the FRFs; by default the one of `unit`.
    source : str
        Name of the array in messages.

    Returns
    -------
    FrfSet
        FRFs in SI units; NaN if a pair of channels has no FRF.

    Raises
    ------
    FileContentError
        The functions are no FRFs, have several frequency axes, or a coordinate has no direction.
    TypeError
        It is no such array.

    See Also
    --------
    to_sdynpy : the inverse.
    read_frfs : read files of SDynPy.

    Examples
    --------
    >>> import numpy as np
    >>> import jointfrf as jf
    >>> point = (jf.io.Channel(1, "+y"),)
    >>> frfs = jf.io.FrfSet(np.array([10.0, 20.0]), point, point, np.ones((2, 1, 1)), "mobility")
    >>> jf.io.from_sdynpy(jf.io.to_sdynpy(frfs), unit="m/s/N").quantity
    'mobility'
    """
    reading = Reading.checked(quantity, unit=unit)
    kind = getattr(array, "function_type", _FRF)
    fields = {"data": as_array("array", array), "function_type": getattr(kind, "value", kind)}
    functions = functions_of_sdynpy(fields, reading.mapping, source)
    if not functions:
        raise TypeError(f"array must be an array of FRFs of SDynPy, not {type(array).__name__}")
    return _set_of(functions, source, reading)


def to_sdynpy(frfs: FrfSet) -> NDArray[Any]:
    """Return FRFs as a structured array of SDynPy.

    Parameters
    ----------
    frfs : FrfSet
        FRFs to convert; missing ones are omitted.

    Returns
    -------
    ndarray, structured; shape (n_responses, n_excitations), or (n_frfs,) if FRFs are missing
        Array whose ``.view(sdynpy.TransferFunctionArray)`` is an array of SDynPy. ``sdynpy.data.load`` reads the file
        of ``numpy.savez(path, data=array, function_type=4)``. Values are in SI units; the first comment states the
        unit.

    Raises
    ------
    ValueError
        There is no FRF, or one is NaN or infinite on some lines only.

    See Also
    --------
    from_sdynpy : the inverse.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> frfs = jf.io.frfs_of_arrays([10.0, 20.0], np.ones((2, 1, 1)), ["1:y"], ["1:y"], unit="m/N")
    >>> jf.io.to_sdynpy(frfs)["abscissa"].tolist()
    [[[10.0, 20.0]]]
    """
    check_type("frfs", frfs, FrfSet)
    frfs.check_whole()
    n = frfs.freq_hz.size
    comments = [(f"comment{i}", "<U80") for i in range(1, 6)]
    place = [("node", "<u8"), ("direction", "i1")]
    kind = [("abscissa", "<f8", (n,)), ("ordinate", "<c16", (n,)), *comments, ("coordinate", place, (2,))]
    found = np.zeros((len(frfs.responses), len(frfs.excitations)), dtype=kind)
    found["abscissa"], found["ordinate"] = frfs.freq_hz, np.moveaxis(frfs.h, 0, -1)
    found["comment1"] = f"{frfs.quantity}, {_UNITS[POWER_OF_I_OMEGA[frfs.quantity]]}"
    for side, channels in enumerate((frfs.responses, frfs.excitations)):
        for i, channel in enumerate(channels):
            row = found["coordinate"][i, :, 0] if side == 0 else found["coordinate"][:, i, 1]
            row["node"], row["direction"] = channel.node, _CODES[channel.direction]
    return found if frfs.measured.all() else found[frfs.measured]


def from_escdf(dataset: Any, *, unit: str | None = None, quantity: str | None = None, source: str = "ESCDF") -> FrfSet:
    """Return the FRFs of a dataset of type ``data`` of ESCDF.

    Parameters
    ----------
    dataset : escdf.Dataset, or mapping
        Properties ``data_type``, ``channel`` (response and reference of each function, ``101X+``), ``ordinate``
        (functions, lines), and ``abscissa`` or ``abscissa_start`` and ``abscissa_step``; ``ordinate_unit`` and
        ``abscissa_unit`` if there are any.
    unit : str, optional
        Unit of the FRFs, if the dataset does not state one that is understood.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity of the FRFs; by default the one of the unit.
    source : str
        Name of the dataset in messages.

    Returns
    -------
    FrfSet
        FRFs in SI units.

    Raises
    ------
    FileContentError
        A property is missing, the functions are no FRFs, or something does not fit.

    See Also
    --------
    to_escdf : the inverse.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> frfs = jf.io.frfs_of_arrays([10.0, 20.0], np.ones((2, 1, 1)), ["1:y"], ["1:y"], unit="m/N")
    >>> jf.io.from_escdf(jf.io.to_escdf(frfs)).quantity
    'receptance'
    """
    reading = Reading.checked(quantity, unit=unit or "")
    word = str(_property(dataset, "data_type", source)).strip().lower()
    letters = word.replace(" ", "").replace("_", "").replace("-", "")
    if not letters.startswith(_FRF_WORDS):
        hint = TIME_DATA if letters.startswith(_TIME_WORDS) else "name a dataset of FRFs"
        raise FileContentError(f"{source} contains data of type {one_line(word)}, not FRFs; {hint}")
    ordinate = as_array("ordinate", _property(dataset, "ordinate", source))
    channels = _texts("channel", _property(dataset, "channel", source), source)
    if ordinate.ndim != 2 or channels.shape != (len(ordinate), 2):
        raise FileContentError(
            f"{source} has ordinates {ordinate.shape} and channels {channels.shape}; expected (n, lines) and (n, 2)"
        )
    lines = _abscissa(dataset, ordinate.shape, source)
    units = []
    for name in ("ordinate_unit", "abscissa_unit"):
        own = _texts(name, _optional(dataset, name, ""), source).ravel()
        if own.size not in (1, len(ordinate)):
            raise FileContentError(f"{source} has {own.size} {name} of {len(ordinate)} functions; state one, or all")
        units.append(np.broadcast_to(own, len(ordinate)))
    namer = ChannelNamer()
    try:
        functions = [
            LooseFunction(namer.channel("channels", row), namer.channel("channels", column), lines[i], ordinate[i],
                          unit=str(units[0][i]), frequency_unit=str(units[1][i]))
            for i, (row, column) in enumerate(channels)
        ]  # fmt: skip
    except ValueError as error:
        raise FileContentError(f"{source} {error}") from error
    return _set_of(functions, source, reading)


def to_escdf(frfs: FrfSet) -> dict[str, Any]:
    """Return FRFs as the properties of a dataset of type ``data`` of ESCDF.

    Parameters
    ----------
    frfs : FrfSet
        FRFs to convert; missing ones are omitted.

    Returns
    -------
    dict of str
        Properties ``data_type``, ``channel``, ``ordinate``, ``ordinate_unit``, ``abscissa``, ``abscissa_unit``: set
        each as a property of ``escdf.classes.data(name)``.

    Raises
    ------
    ValueError
        There is no FRF, or one is NaN or infinite on some lines only.

    See Also
    --------
    from_escdf : the inverse.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> frfs = jf.io.frfs_of_arrays([10.0, 20.0], np.ones((2, 1, 1)), ["1:y"], ["1:y"], unit="m/N")
    >>> jf.io.to_escdf(frfs)["channel"].tolist()
    [['1Y+', '1Y+']]
    """
    check_type("frfs", frfs, FrfSet)
    frfs.check_whole()
    rows, columns = np.nonzero(frfs.measured)
    names = [[_name(frfs.responses[i]), _name(frfs.excitations[j])] for i, j in zip(rows, columns, strict=True)]
    return {
        "data_type": "frequency response function",
        "channel": np.array(names, dtype=object),
        "ordinate": np.ascontiguousarray(frfs.h[:, rows, columns].T),
        "ordinate_unit": _UNITS[POWER_OF_I_OMEGA[frfs.quantity]],
        "abscissa": frfs.freq_hz.copy(),
        "abscissa_unit": "Hz",
    }


def _name(channel: Channel) -> str:
    """Return a channel as SDynPy writes it: 101X+, 101RX-."""
    return f"{channel.node}{channel.axis.upper()}{channel.direction[0]}"


def _set_of(functions: list[LooseFunction], source: str, reading: Reading) -> FrfSet:
    content: FrfArrays = arrays_of_functions(functions, source, None)
    frfs = as_frf_set(content, source, reading)
    reading.warn()
    return replace(frfs, stated=f"functions of {source}")


def _texts(name: str, value: Any, source: str) -> NDArray[Any]:
    try:
        return np.asarray(value).astype(str)
    except (ValueError, TypeError) as error:
        raise FileContentError(f"{source}: {name} is no array of texts") from error


def _abscissa(dataset: Any, shape: tuple[int, ...], source: str) -> NDArray[np.float64]:
    """Return the lines of each function: one axis for all, one for each, or start and step."""
    start, step = (_optional(dataset, name, None) for name in ("abscissa_start", "abscissa_step"))
    try:
        if start is not None and step is not None:
            columns = [np.ravel(np.asarray(each, dtype=np.float64))[:, None] for each in (start, step)]
            return np.broadcast_to(columns[0] + columns[1] * np.arange(shape[1]), shape)
        return np.broadcast_to(np.asarray(_property(dataset, "abscissa", source), dtype=np.float64), shape)
    except (ValueError, TypeError) as error:
        raise FileContentError(
            f"{source}: the abscissa does not fit {shape[0]} functions of {shape[1]} lines"
        ) from error


def _property(dataset: Any, name: str, source: str) -> Any:
    found = _optional(dataset, name, None)
    if found is None:
        raise FileContentError(f"{source} has no {name}; name a dataset of type data")
    return found


def _optional(dataset: Any, name: str, otherwise: Any) -> Any:
    """Return the value of a property; ESCDF reads it from the file on indexing."""
    found = dataset.get(name) if isinstance(dataset, Mapping) else getattr(dataset, name, None)
    try:
        value = found if found is None or isinstance(found, str | np.ndarray | list | tuple) else found[...]
    except (TypeError, LookupError):  # a number; or a property of ESCDF without a value
        value = found if isinstance(found, int | float | np.generic) else None
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    return otherwise if value is None else value
