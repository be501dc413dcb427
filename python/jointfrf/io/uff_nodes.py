"""Coordinates of nodes in a Universal File (datasets 15 and 2411)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.io.uff_file import UniversalFile, name_some

__all__ = ["node_coordinates"]

_FIELDS = ("node_nums", "def_cs", "disp_cs", "x", "y", "z")
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
            rows = _node_rows(file.read(number))
        except (FileContentError, ValueError):
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


def _node_rows(content: Mapping[str, Any]) -> NDArray[np.float64]:
    """Node, definition system, displacement system and coordinates of every node, shape (n, 6)."""
    rows = np.array([content[name] for name in _FIELDS], dtype=np.float64).T
    if rows.ndim != 2 or not np.isfinite(rows).all():
        raise ValueError("not a table of finite numbers")
    return rows


def _coordinate_systems(file: UniversalFile) -> dict[int, _Axes]:
    """Coordinate systems that the file defines, by their labels."""
    systems: dict[int, _Axes] = {}
    for number in file.datasets(18, 2420):
        try:
            content = file.read(number)
            systems |= _axes_by_points(content) if content["type"] == 18 else _axes_by_matrix(content)
        except (FileContentError, ValueError, LookupError):
            file.note("the coordinate systems cannot be read and are taken as global", number)
    return systems


def _axes_by_points(content: Mapping[str, Any]) -> dict[int, _Axes]:
    """Dataset 18: origin, a point on the x axis and one in the xz plane, in a reference system."""
    systems = {}
    for i, label in enumerate(content["cs_num"]):
        origin = content["ref_o"][i]
        x, in_xz = content["x_point"][i] - origin, content["xz_point"][i] - origin
        y = np.cross(in_xz, x)
        is_global = content["cs_type"][i] == 0 and content["ref_cs_num"][i] == 0
        is_aligned = x[0] > 0.0 and y[1] > 0.0 and _is_zero(x[1:], x) and _is_zero(y[::2], y)
        systems[int(label)] = _Axes(not (is_global and is_aligned), not _is_zero(origin, x))
    return systems


def _axes_by_matrix(content: Mapping[str, Any]) -> dict[int, _Axes]:
    """Dataset 2420: three rows of rotation and one of translation."""
    systems = {}
    for label, kind, matrix in zip(content["CS_sys_labels"], content["CS_types"], content["CS_matrices"], strict=True):
        turned = kind != 0 or not np.allclose(matrix[:3], np.eye(3), atol=_TOLERANCE)
        systems[int(label)] = _Axes(turned, not _is_zero(matrix[3], matrix[0]))
    return systems


def _is_zero(values: NDArray[np.float64], scale: NDArray[np.float64]) -> bool:
    return bool(np.abs(values).max() <= _TOLERANCE * np.linalg.norm(scale))
