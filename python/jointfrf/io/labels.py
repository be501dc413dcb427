"""Names of channels as programs and tables write them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.frf_set import Channel
from jointfrf.kernel.arguments import one_line

__all__ = ["DIRECTION_CODES", "channels_of", "channels_of_table", "is_table"]

#: Directions by the codes of Universal Files, which sdynpy uses, too.
DIRECTION_CODES = {1: "+x", 2: "+y", 3: "+z", 4: "+rx", 5: "+ry", 6: "+rz"}
DIRECTION_CODES |= {-code: "-" + direction[1:] for code, direction in DIRECTION_CODES.items()}
#: ``102:+y``, ``bar:102:+Y``, ``Point102 -Z``, ``102RX``, and sdynpy's ``102Y+``.
_LABEL = re.compile(r"(?:.*\D)?(\d+)[\s:._]*([+-]?)(r?[xyz])([+-]?)", re.IGNORECASE)
#: Columns of the tables of channels of pyFBS.
_POSITION, _DIRECTION = ("Position_1", "Position_2", "Position_3"), ("Direction_1", "Direction_2", "Direction_3")
#: How far a direction may be off its axis, relative to its length, and channels of one node apart, m: rounding.
_ALONG, _SAME_PLACE = 1e-6, 1e-9


def channels_of(what: str, labels: Any) -> tuple[Channel, ...]:
    """Channels by their labels.

    Parameters
    ----------
    what : str
        What the labels name, for messages: ``responses``.
    labels : sequence
        Names with node and direction; pairs of node and direction code 1 to 6, negative against the axis; or a
        structured array with the fields ``node`` and ``direction``.

    Returns
    -------
    tuple of Channel

    Raises
    ------
    ValueError
        A label names no channel, or two are the same.
    """
    found = tuple(_channel(what, label) for label in _listed(labels))
    twice = next((channel for i, channel in enumerate(found) if channel in found[:i]), None)
    if twice is not None:
        raise ValueError(f"names {twice} twice in its {what}")
    return found


def _listed(labels: Any) -> list[Any]:
    """Labels one by one, nodes with their direction codes as pairs."""
    if isinstance(labels, str | Channel):
        return [labels]
    if not isinstance(labels, np.ndarray):
        return [label.item() if isinstance(label, np.ndarray) and label.size == 1 else label for label in labels]
    if labels.dtype.names and {"node", "direction"} <= set(labels.dtype.names):
        return [(row["node"], row["direction"]) for row in labels.ravel()]
    if labels.dtype.kind in "iuf" and labels.ndim == 2 and labels.shape[1] == 2:
        return [tuple(row) for row in labels]
    return list(labels.ravel())


def _channel(what: str, label: Any) -> Channel:
    if isinstance(label, Channel):
        return label
    if isinstance(label, tuple) and len(label) == 2:
        node, code = label
        if node == int(node) and node > 0 and code in DIRECTION_CODES:
            return Channel(int(node), DIRECTION_CODES[int(code)])
        raise ValueError(f"has node {node} with direction code {code} in its {what}: codes are 1 to 6, -1 to -6")
    match = _LABEL.fullmatch(str(label).strip())
    if match is None or int(match[1]) < 1:
        raise ValueError(
            f"has {one_line(str(label).strip())} in its {what}: expected a point and a direction, such as 102:+y"
        )
    return Channel(int(match[1]), f"{match[2] or match[4]}{match[3]}")


def is_table(labels: Any) -> bool:
    """Whether channels are given as a table of positions and directions, as pyFBS has them."""
    return all(_has(labels, name) for name in _DIRECTION) if hasattr(labels, "__getitem__") else False


def _has(table: Any, name: str) -> bool:
    names = table.keys() if isinstance(table, Mapping) else getattr(table, "columns", ())
    return name in list(names)


def channels_of_table(
    responses: Any, excitations: Any
) -> tuple[tuple[Channel, ...], tuple[Channel, ...], dict[int, NDArray[np.float64]]]:
    """Channels and coordinates of two tables of pyFBS.

    Parameters
    ----------
    responses, excitations : mapping or DataFrame
        Columns ``Position_1`` to ``Position_3`` in m and ``Direction_1`` to ``Direction_3``.

    Returns
    -------
    responses, excitations : tuple of Channel
        Channels at one place share a node; nodes are counted from 1 in the order of the tables.
    coordinates : dict of int to ndarray, shape (3,)

    Raises
    ------
    ValueError
        A column is missing, or a direction is not along an axis.
    """
    coordinates: dict[int, NDArray[np.float64]] = {}
    sides = []
    for what, table in (("responses", responses), ("excitations", excitations)):
        for name in (*_POSITION, *_DIRECTION):
            if not _has(table, name):
                raise ValueError(f"the table of the {what} has no column {name}")
        places, directions = (
            np.stack([np.asarray(table[name], dtype=np.float64) for name in names], axis=1)
            for names in (_POSITION, _DIRECTION)
        )
        rows = enumerate(zip(places, directions, strict=True), start=1)
        channels = tuple(Channel(_node(place, coordinates), _axis(what, row, way)) for row, (place, way) in rows)
        sides.append(channels_of(f"table of the {what}", channels))
    return sides[0], sides[1], coordinates


def _node(place: NDArray[np.float64], coordinates: dict[int, NDArray[np.float64]]) -> int:
    for node, known in coordinates.items():
        if abs(known - place).max() <= _SAME_PLACE:
            return node
    coordinates[len(coordinates) + 1] = place
    return len(coordinates)


def _axis(what: str, row: int, direction: NDArray[np.float64]) -> str:
    largest = int(np.argmax(abs(direction)))
    rest = np.delete(direction, largest)
    if not (np.isfinite(direction).all() and abs(rest).max() <= _ALONG * abs(direction[largest]) != 0.0):
        way = ", ".join(f"{x:g}" for x in direction)
        raise ValueError(
            f"row {row} of the {what} points along ({way}), not along an axis: `virtual_point` takes any direction"
        )
    return ("-" if direction[largest] < 0 else "+") + "xyz"[largest]
