"""Coordinates of nodes in a Universal File (datasets 15 and 2411)."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.io.uff_file import UniversalFile, name_some

__all__ = ["node_coordinates"]

_TOLERANCE = 1e-5


@dataclass(frozen=True)
class _Axes:
    """How a coordinate system differs from the global cartesian one."""

    turned: bool = False
    shifted: bool = False


def node_coordinates(file: UniversalFile, nodes: Collection[int]) -> dict[int, NDArray[np.float64]]:
    """Coordinates of nodes.

    Parameters
    ----------
    file : UniversalFile
        Takes notes of what cannot be used: local coordinates, local directions, an unknown unit.
    nodes : collection of int
        The nodes wanted.

    Returns
    -------
    dict of int to ndarray, shape (3,)
        Global cartesian coordinates in m of those nodes of which the file gives them.

    Notes
    -----
    Dataset 2411 holds coordinates of the part; dataset 15 holds them in the definition system of each node. A system
    that no dataset (18, 2420) defines is taken as global.
    """
    coordinates: dict[int, NDArray[np.float64]] = {}
    axes = _coordinate_systems(file)
    for number in file.datasets(15, 2411):
        try:
            rows = _node_rows(file.records(number))
        except ValueError:
            file.note("the coordinates of nodes cannot be read and are left out", number)
            continue
        rows = rows[np.isin(rows[:, 0], list(nodes))]
        turned = [int(row[0]) for row in rows if axes.get(int(row[2]), _Axes()).turned]
        if turned:
            file.note(
                f"directions at {name_some('node', turned)} are those of local axes and are taken as they are", number
            )
        if file.types[number - 1] == 15:
            local = np.array([axes.get(int(row[1]), _Axes()) != _Axes() for row in rows], dtype=bool)
            if local.any():
                names = name_some("node", [int(row[0]) for row in rows[local]])
                file.note(f"coordinates of {names} are local and are left out", number)
            rows = rows[~local]
        system = file.unit_system(number)
        if system is None and rows.size:
            file.note("the coordinates have no unit (there is no dataset 164): m is assumed", number)
        coordinates |= {int(row[0]): row[3:] / (system.length if system else 1.0) for row in rows}
    return coordinates


def _node_rows(records: list[str]) -> NDArray[np.float64]:
    """Node, definition system, displacement system and coordinates of every node, shape (n, 6)."""
    rows = np.array(" ".join(records).split(), dtype=np.float64).reshape(-1, 7)
    if not np.isfinite(rows).all():
        raise ValueError("not a table of finite numbers")
    return np.delete(rows, 3, axis=1)  # the colour


def _coordinate_systems(file: UniversalFile) -> dict[int, _Axes]:
    """Coordinate systems that the file defines, by their labels."""
    systems: dict[int, _Axes] = {}
    for number in file.datasets(18, 2420):
        try:
            records = file.records(number)
            systems |= _axes_by_points(records) if file.types[number - 1] == 18 else _axes_by_matrix(records)
        except (ValueError, LookupError, OverflowError):
            file.note("the coordinate systems cannot be read and are taken as global", number)
    return systems


def _axes_by_points(records: list[str]) -> dict[int, _Axes]:
    """Dataset 18: origin, a point on the x axis and one in the xz plane, in a reference system."""
    systems = {}
    for first in range(0, len(records), 4):
        label, kind, reference, *_ = (int(float(word)) for word in records[first].split())
        line = f"{records[first + 2]:<78}{records[first + 3]}"
        origin, on_x, in_xz = np.array([float(line[13 * i : 13 * i + 13]) for i in range(9)]).reshape(3, 3)
        x, y = on_x - origin, np.cross(in_xz - origin, on_x - origin)
        is_aligned = x[0] > 0.0 and y[1] > 0.0 and _is_zero(x[1:], x) and _is_zero(y[::2], y)
        systems[label] = _Axes(not (kind == 0 and reference == 0 and is_aligned), not _is_zero(origin, x))
    return systems


def _axes_by_matrix(records: list[str]) -> dict[int, _Axes]:
    """Dataset 2420: after part and name, of each system three rows of rotation and one of translation."""
    systems = {}
    for first in range(2, len(records), 6):
        label, kind, *_ = (int(word) for word in records[first].split())
        matrix = np.array(" ".join(records[first + 2 : first + 6]).split(), dtype=np.float64).reshape(4, 3)
        turned = kind != 0 or not np.allclose(matrix[:3], np.eye(3), atol=_TOLERANCE)
        systems[label] = _Axes(turned, not _is_zero(matrix[3], matrix[0]))
    return systems


def _is_zero(values: NDArray[np.float64], scale: NDArray[np.float64]) -> bool:
    return bool(np.abs(values).max() <= _TOLERANCE * np.linalg.norm(scale))
