"""Tables of channels: position and direction of each sensor and impact, and its side of the joint."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import Channel, ChannelPlace, ChannelRole, JointSide
from jointfrf.io.csv_file import TextTable, read_text_table
from jointfrf.io.pyfbs import is_pyfbs_heading, places_of_sheets
from jointfrf.io.units import parse_unit
from jointfrf.io.xlsx_file import is_sheet, read_sheet, sheet_names
from jointfrf.kernel.arguments import one_line
from jointfrf.spelling import did_you_mean
from jointfrf.toml.declared import Keys, NotNegative, key, keys_of, read_keys
from jointfrf.toml.table import TomlTable, read_toml

__all__ = ["ChannelKeys", "ChannelTableKeys", "places_of_table", "read_channel_table"]

#: A column and its unit.
_COLUMN = re.compile(r"(\w+) ?(?:[(\[]([^()\[\]]*)[)\]])?")
#: Directions of a sensor along the axes.
_TRIAXIAL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
#: Largest deviation of the length of a direction from 1: rounding to two digits, as in (0.71, 0, -0.71).
_UNIT = 1e-2
_Three = tuple[float, float, float]
_Node = Annotated[int, Meta(ge=1)]


class ChannelKeys(Keys):
    """One table for each channel, or for each node with several."""

    channel: Annotated[str | None, key("Name of the channel in the file of FRFs: `101:+x`.", absent="`node`")] = None
    node: Annotated[_Node | None, key("Instead: all channels along x, y, z of this node in the file.")] = None
    side: Annotated[JointSide | None, key("Side of the joint.", absent="by `--j` and `--k`")] = None
    role: Annotated[ChannelRole, key("As what the channel counts; `both`: what the file has.")] = "both"
    at: Annotated[
        _Three | None, key("Position.", "`unit`", takes="three numbers", absent="coordinates of the file")
    ] = None
    direction: Annotated[
        _Three | None, key("Direction of a `channel`.", takes="three numbers", absent="by its name")
    ] = None
    axes: Annotated[
        tuple[_Three, _Three, _Three] | None,
        key("Directions of x, y, z of a `node`'s sensor.", takes="three lists of three numbers", absent="x, y, z"),
    ] = None
    weight: Annotated[NotNegative, key("In the virtual point; 0 leaves the channel out.")] = 1.0


class ChannelTableKeys(Keys):
    """Channels around a joint."""

    unit: Annotated[Literal["m", "mm", "cm", "in"], key("Unit of positions.")] = "m"
    channel: Annotated[tuple[ChannelKeys, ...], key("The channels.")]


#: Columns of a CSV file.
_COLUMNS = ("channel", "node", "side", "role", "x", "y", "z", "direction_x", "direction_y", "direction_z", "weight")


def read_channel_table(path: str | PathLike[str], *, position_unit: str = "") -> tuple[ChannelPlace, ...]:
    r"""Return the places of channels from a TOML or CSV file, or from an Excel workbook.

    Parameters
    ----------
    path : path-like
        Name of the file. ``.toml``: tables ``[[channel]]`` with the keys of `ChannelKeys`, and ``unit`` of positions
        (``"m"``, ``"mm"``, ``"cm"``, ``"in"``; m by default). Any other name: one row for each channel, cells between
        commas, semicolons or tabs. The heading has words out of channel, node, side, role, x, y, z, direction_x,
        direction_y, direction_z, weight, with units of positions as in ``x [mm]``. A sheet ``book.xlsx#SHEET`` has the
        same columns. ``test.xlsx#Channels_AB,Impacts_AB`` names two sheets of pyFBS.
    position_unit : str
        Unit of the positions of sheets of pyFBS, which do not state it: ``mm``.

    Returns
    -------
    tuple of ChannelPlace
        Places of the channels in the order of the file.

    Raises
    ------
    FileContentError
        The file cannot be read, or something in it is wrong: one sentence with the row or the table.

    See Also
    --------
    read_frfs : FRFs of the channels.
    jointfrf.joint_channels : transform from the channels to joint DOFs.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import jointfrf as jf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "channels.csv"
    ...     _ = path.write_text("channel,side,x [mm],y [mm],z [mm]\n101:-z,j,12.5,0,6\n")
    ...     (place,) = jf.io.read_channel_table(path)
    >>> str(place.channel), place.side, place.position.tolist(), place.unit.tolist()
    ('101:-z', 'j', [0.0125, 0.0, 0.006], [0.0, 0.0, -1.0])
    """
    file = Path(path)
    if is_sheet(file) and "," in file.name.partition("#")[2]:
        return places_of_sheets(file, position_unit)
    if position_unit:
        raise FileContentError(f"the unit {position_unit} of positions has no effect on {file}; leave it out")
    if file.suffix.lower() == ".toml":
        return _places_of(read_keys(read_toml(file), ChannelTableKeys))
    found = tuple(place for row in _csv_rows(file) for place in _places(row))
    if not found:
        raise FileContentError(f"{file} has no channels; add a row for each")
    return found


def places_of_table(table: TomlTable) -> tuple[ChannelPlace, ...]:
    """Return the places in the keys ``unit`` and ``[[channel]]`` of a TOML file; see `read_channel_table`."""
    own = {name: value for name, value in table.content.items() if name in keys_of(ChannelTableKeys).names}
    return _places_of(read_keys(replace(table, content=own), ChannelTableKeys))


def _places_of(keys: ChannelTableKeys) -> tuple[ChannelPlace, ...]:
    unit = parse_unit(keys.unit)
    assert unit is not None
    return tuple(place for row in keys.channel for place in _places(row, unit.to_si))


def _csv_rows(file: Path) -> Iterator[ChannelKeys]:
    """Yield the rows of a CSV file as tables [[channel]] with positions in m."""
    book, sheets = sheet_names(file)
    table = read_sheet(book, sheets[0] if sheets else None) if is_sheet(file) else read_text_table(file)
    if is_pyfbs_heading(table.heading):
        raise FileContentError(
            f"{file} has columns of pyFBS; name the sheets of channels and impacts, {book.stem}.xlsx#Channels,Impacts, "
            "or use jointfrf.io.from_pyfbs"
        )
    columns = [_column(file, word) for word in table.heading]
    names = [name for name, _ in columns]
    if len(set(names)) < len(names):
        raise FileContentError(f"{file}: a column is named twice ({', '.join(names)}); leave one out")
    for where, cells in table.rows:
        given = {name: cell for name, cell in zip(names, cells, strict=True) if cell}
        yield read_keys(TomlTable(_csv_values(table, where, given, dict(columns)), where), ChannelKeys)


def _column(file: Path, word: str) -> tuple[str, float]:
    """Return the name of a column, and its unit in m."""
    match = _COLUMN.fullmatch(" ".join(word.split()))
    name = match[1].lower() if match else word.strip()
    if name not in _COLUMNS or match is None:
        hint = did_you_mean(name, _COLUMNS)
        raise FileContentError(f"{file}: unknown column {one_line(name)}; use one of {', '.join(_COLUMNS)}{hint}")
    if match[2] is None:
        return name, 1.0
    unit = parse_unit(match[2])
    if name not in ("x", "y", "z") or unit is None or unit.exponents != (1, 0, 0):
        raise FileContentError(f"{file}: column {one_line(word.strip())}: only x, y, z have a unit, such as mm or in")
    return name, unit.to_si


def _csv_values(table: TextTable, where: str, given: Mapping[str, str], scales: Mapping[str, float]) -> dict[str, Any]:
    """Return the cells of a row as values of a TOML table."""

    def number(name: str) -> float:
        try:
            value = table.number(given[name])
        except ValueError:
            value = float("nan")
        if not np.isfinite(value):
            raise FileContentError(f"{where}: {name} must be a number, not {given[name]!r}")
        return value

    values: dict[str, Any] = {name: given[name] for name in ("channel", "side", "role") if name in given}
    for vector, names in (("at", ("x", "y", "z")), ("direction", ("direction_x", "direction_y", "direction_z"))):
        there = [name for name in names if name in given]
        if there and len(there) < 3:
            missing = next(name for name in names if name not in given)
            raise FileContentError(f"{where}: {there[0]} is given without {missing}; add {missing}")
        if there:
            values[vector] = [number(name) * scales[name] for name in names]
    if "node" in given:
        values["node"] = int(given["node"]) if given["node"].isdecimal() else given["node"]
    if "weight" in given:
        values["weight"] = number("weight")
    return values


def _places(row: ChannelKeys, unit: float = 1.0) -> list[ChannelPlace]:
    """Return the channels that a table names, with positions in this unit, m."""
    where, at = row.table.where, None if row.at is None else unit * np.array(row.at)
    if (row.channel is None) == (row.node is None):
        raise FileContentError(f"{where}: name either channel or node")
    if row.direction is not None and row.node is not None:
        raise FileContentError(f"{where}: direction belongs to a channel; give axes of the node")
    if row.axes is not None and row.channel is not None:
        raise FileContentError(f"{where}: axes belong to a node; give direction of the channel")
    if row.channel is not None:
        channel = row.build(partial(Channel.parse, row.channel))
        direction = None if row.direction is None else _unit(row, "direction", row.direction)
        return [ChannelPlace(channel, row.side, row.role, at, direction, row.weight, where=where)]
    assert row.node is not None
    return [
        ChannelPlace(Channel(row.node, axis), row.side, row.role, at, _unit(row, "axes", one), row.weight, True, where)
        for axis, one in zip("xyz", row.axes or _TRIAXIAL, strict=True)
    ]


def _unit(row: ChannelKeys, name: str, vector: _Three) -> NDArray[np.float64]:
    length = float(np.linalg.norm(vector))
    if not abs(length - 1) < _UNIT:
        raise FileContentError(f"{row.table.where}: {name} must have length 1, not {length:g}")
    return np.array(vector) / length
