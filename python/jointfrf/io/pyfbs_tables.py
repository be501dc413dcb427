"""Tables of channels and impacts of pyFBS: a row for each, with position and direction."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.frf_set import Channel, ChannelPlace, ChannelRole, JointSide
from jointfrf.kernel.arguments import check_type, one_line
from jointfrf.spelling import some_of

__all__ = ["POSITION", "PyfbsChannels", "PyfbsRow", "channels_of_tables", "is_table", "rows_of_table"]

#: Columns of the tables.
POSITION, _DIRECTION = ("Position_1", "Position_2", "Position_3"), ("Direction_1", "Direction_2", "Direction_3")
#: Relative difference of two directions, and distance of channels of one node, m, that rounding may cause.
_ALONG, _SAME_PLACE = 1e-6, 1e-9
#: Words of the column Description that name DOFs of a virtual point.
_VIRTUAL = {f"{letter}{axis}": f"{turn}{axis}" for letters, turn in (("uf", ""), ("rm", "r"))
            for letter in letters for axis in "xyz"}  # fmt: skip
#: Words for rotations before pyFBS 1.0, and for torsion of the interface since then.
_EITHER = ("tx", "ty", "tz")
#: Other words: flexible modes of the interface.
_FLEXIBLE = ("ex", "ey", "ez", *(f"{letter}{a}{b}" for letter in "sb" for a in "xyz" for b in "xyz" if a != b))
#: Parts of the column Quantity of a rotation or a moment.
_TURNING = ("rot", "ang", "moment")
#: Number of rows and groupings that a message names.
_SHOWN = 6


class PyfbsRow(NamedTuple):
    """A row of a table: its place in the table, grouping, position in m, unit vector, and kind."""

    where: str
    grouping: str
    place: NDArray[np.float64]
    unit: NDArray[np.float64]
    is_rotation: bool
    is_virtual: bool


class PyfbsChannels(NamedTuple):
    """Channels that the rows of two tables represent.

    Attributes
    ----------
    responses, excitations : tuple of Channel
        Channels of the rows.
    places : tuple of ChannelPlace
        Places of the translations, in the order of the tables.
    coordinates : dict of int to ndarray, shape (3,)
        Positions of the nodes, m.
    oblique : tuple of (str, Channel)
        Rows whose direction differs from the direction in the name of their channel.
    """

    responses: tuple[Channel, ...]
    excitations: tuple[Channel, ...]
    places: tuple[ChannelPlace, ...]
    coordinates: dict[int, NDArray[np.float64]]
    oblique: tuple[tuple[PyfbsRow, Channel], ...]

    @property
    def note(self) -> str:
        """Return a sentence on channels with oblique directions; empty if there is none."""
        if not self.oblique:
            return ""
        shown = some_of([str(channel) for _, channel in self.oblique], _SHOWN)
        return (
            f"{shown} do not point along the axes of their names; name the same tables by --channels (channel places), "
            "which states their directions"
        )


def is_table(table: Any) -> bool:
    """Return whether channels are given as a table of positions and directions."""
    if isinstance(table, Sequence) and not isinstance(table, str) and len(table):
        table = table[0]
    return all(name in _columns(table) for name in _DIRECTION)


def _columns(table: Any) -> list[str]:
    return [str(name) for name in (table.keys() if isinstance(table, Mapping) else getattr(table, "columns", ()))]


def rows_of_table(what: str, table: Any, to_m: float) -> list[PyfbsRow]:
    """Return the rows of a table.

    Parameters
    ----------
    what : str
        Kind of the rows, for messages: ``responses``.
    table : mapping, DataFrame, or sequence of mappings
        Columns ``Position_1`` to ``Position_3`` and ``Direction_1`` to ``Direction_3``; ``Grouping``, ``Quantity``
        and ``Description`` if there are any.
    to_m : float
        Unit of the positions, m.

    Raises
    ------
    ValueError
        A column is missing, a position is no number, or a row has no direction that is understood.
    TypeError
        A row is no mapping.
    """
    if isinstance(table, Sequence):
        for i, row in enumerate(table, 1):
            check_type(f"row {i} of the {what}", row, Mapping)
        names = list(dict.fromkeys(str(name) for row in table for name in _columns(row)))
        table = {name: [row.get(name) for row in table] for name in names}
    known = _columns(table)
    for name in (*POSITION, *_DIRECTION):
        if name not in known:
            raise ValueError(f"the table of the {what} has no column {name}; it has {some_of(known, 12) or 'none'}")
    places, directions = (_vectors(what, table, names) for names in (POSITION, _DIRECTION))
    words = {
        name: list(table[name]) if name in known else [None] * len(places)
        for name in ("Grouping", "Quantity", "Description")
    }
    return [
        _row(f"row {i + 1} of the {what}", place, direction, {name: own[i] for name, own in words.items()})
        for i, (place, direction) in enumerate(zip(to_m * places, directions, strict=True))
    ]


def _vectors(what: str, table: Any, names: Sequence[str]) -> NDArray[np.float64]:
    try:
        found = np.stack([np.asarray(list(table[name]), dtype=np.float64) for name in names], axis=1)
    except (ValueError, TypeError) as error:
        raise ValueError(f"the columns {names[0]} to {names[2]} of the {what} are not numbers of one count") from error
    bad = ~np.isfinite(found).all(axis=1)
    if bad.any():
        raise ValueError(f"row {int(bad.argmax()) + 1} of the {what} has no number in {names[0]} to {names[2]}")
    return found


def _row(where: str, place: NDArray[np.float64], direction: NDArray[np.float64], words: Mapping[str, Any]) -> PyfbsRow:
    """Return a row; the DOF of a virtual point is named by its description."""
    word, quantity = (str(words[name] or "").strip().lower() for name in ("Description", "Quantity"))
    turns = any(part in quantity for part in _TURNING)
    if word in _FLEXIBLE or (word in _EITHER and not turns):
        hint = "; name rotations rx, ry, rz" if word in _EITHER else ""
        raise ValueError(
            f"{where} is {word}, a flexible mode of the interface, not a DOF of a joint; leave it out{hint}"
        )
    axis = _VIRTUAL.get(word, f"r{word[1]}" if word in _EITHER else "")
    length = float(np.linalg.norm(direction))
    if axis:
        unit = np.eye(3)["xyz".index(axis[-1])]
        if length > 0 and not np.linalg.norm(direction / length - unit) <= _ALONG:
            raise ValueError(f"{where} is {word} and points along {_written(direction)}; correct one of them")
        return PyfbsRow(where, _grouping(words["Grouping"]), place, unit, axis.startswith("r"), True)
    if not length > 0:
        raise ValueError(f"{where} has no direction; fill in Direction_1 to Direction_3")
    return PyfbsRow(where, _grouping(words["Grouping"]), place, direction / length, turns, False)


def _written(direction: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{x:g}" for x in direction) + ")"


def _grouping(value: Any) -> str:
    """Return a grouping as a text: numbers of a sheet may be 100, 100.0 or '100'."""
    try:
        return f"{float(value):g}"
    except (TypeError, ValueError):
        return "" if value is None else str(value).strip()


class _Node(NamedTuple):
    number: int
    row: PyfbsRow
    axes: dict[str, NDArray[np.float64]]

    def has(self, row: PyfbsRow) -> bool:
        return row.is_virtual == self.row.is_virtual and _at_one_place(row, self.row)

    def channel(self, row: PyfbsRow) -> Channel | None:
        """Return the channel of a direction at this node; None if all its names represent other directions."""
        turn = "r" if row.is_rotation else ""
        for axis, unit in self.axes.items():
            if axis.startswith(turn or ("x", "y", "z")) and np.linalg.norm(np.cross(unit, row.unit)) <= _ALONG:
                return Channel(self.number, ("-" if unit @ row.unit < 0 else "+") + axis)
        along = _along(row.unit)
        free = [turn + axis for axis in (along or "xyz") if turn + axis not in self.axes]
        if not free:
            return None
        unit = np.eye(3)["xyz".index(along)] if along else row.unit
        self.axes[free[0]] = unit
        return Channel(self.number, ("-" if unit @ row.unit < 0 else "+") + free[0])


def _along(unit: NDArray[np.float64]) -> str:
    """Return the axis that a unit vector lies along; empty if it is oblique."""
    largest = int(np.argmax(abs(unit)))
    return "xyz"[largest] if abs(np.delete(unit, largest)).max() <= _ALONG else ""


def channels_of_tables(
    responses: Sequence[PyfbsRow], excitations: Sequence[PyfbsRow], sides: Mapping[Any, JointSide] | None = None
) -> PyfbsChannels:
    """Name the channels of two tables.

    Parameters
    ----------
    responses, excitations : sequence of PyfbsRow
        Rows of the tables.
    sides : mapping of grouping to {"j", "k"}, optional
        Side of the joint of each grouping around it; the places of further groupings are omitted. By default all
        places, without a side.

    Returns
    -------
    PyfbsChannels
        Channels with their places. A virtual point has the number of its grouping as node. Other channels at one place
        with one grouping have one node, counted from 1, or from the largest virtual point. A direction along an axis
        has its name and sign. An oblique direction has the next free name of its node.
        oblique direction has the next free name of its node.

    Raises
    ------
    ValueError
        A row names a channel again, or there is no such grouping.
    """
    virtual = [row for row in (*responses, *excitations) if row.is_virtual]
    numbers = [int(row.grouping) if row.grouping.isdecimal() and int(row.grouping) > 0 else 0 for row in virtual]
    if 0 in numbers:
        raise ValueError(f"{virtual[numbers.index(0)].where} is a virtual point; its Grouping must be a number above 0")
    nodes: list[_Node] = []
    found = [_side_channels(what, rows, nodes, max(numbers, default=0))
             for what, rows in (("responses", responses), ("excitations", excitations))]  # fmt: skip
    chosen = None if sides is None else _sides(sides, {row.grouping for row in (*responses, *excitations)})
    roles: tuple[ChannelRole, ChannelRole] = ("response", "excitation")
    places = [
        ChannelPlace(channel, None if chosen is None else chosen[row.grouping], role, row.place, row.unit,
                     where=row.where)
        for role, rows, own in zip(roles, (responses, excitations), found, strict=True)
        for row, channel in zip(rows, own, strict=True)
        if not row.is_rotation and (chosen is None or row.grouping in chosen)
    ]  # fmt: skip
    oblique = tuple(
        (row, channel)
        for rows, own in zip((responses, excitations), found, strict=True)
        for row, channel in zip(rows, own, strict=True)
        if _along(row.unit) != channel.axis[-1]
    )
    return PyfbsChannels(found[0], found[1], tuple(places), {node.number: node.row.place for node in nodes}, oblique)


def _sides(sides: Mapping[Any, JointSide], known: Iterable[str]) -> dict[str, JointSide]:
    check_type("sides", sides, Mapping)
    found = {_grouping(name): side for name, side in sides.items()}
    groups = sorted(known)
    for name, side in found.items():
        if name not in groups:
            raise ValueError(f"no row has grouping {one_line(name)}; use one of {some_of(groups, _SHOWN) or 'none'}")
        if side not in ("j", "k"):
            raise ValueError(f"the side of grouping {name} must be j or k, not {one_line(side)}")
    return found


def _side_channels(what: str, rows: Sequence[PyfbsRow], nodes: list[_Node], above: int) -> tuple[Channel, ...]:
    """Return the channel of each row, for which nodes are added."""
    named: dict[int, Channel] = {}
    first = {i: next(j for j, other in enumerate(rows) if _at_one_place(other, row)) for i, row in enumerate(rows)}
    # At each place, directions along axes get their names first; oblique ones get the remaining names.
    for i in sorted(first, key=lambda i: (first[i], not _along(rows[i].unit), i)):
        row = rows[i]
        there = [node for node in nodes if node.has(row)]
        channel = next((one for one in (node.channel(row) for node in there) if one is not None), None)
        if channel is None:
            counted = sum(not node.row.is_virtual for node in nodes)
            node = _Node(int(row.grouping) if row.is_virtual else above + counted + 1, row, {})
            nodes.append(node)
            channel = node.channel(row)
            assert channel is not None
        earlier = next((j for j, one in named.items() if one in (channel, channel.opposite())), None)
        if earlier is not None:
            raise ValueError(f"{row.where} has the place and direction of row {earlier + 1}; leave one out")
        named[i] = channel
    return tuple(named[i] for i in range(len(rows)))


def _at_one_place(one: PyfbsRow, other: PyfbsRow) -> bool:
    return one.grouping == other.grouping and bool(abs(one.place - other.place).max() <= _SAME_PLACE)
