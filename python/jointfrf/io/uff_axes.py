"""Nodes of Universal Files: coordinates, and local axes of FRFs and modes at them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.frf_set import Channel
from jointfrf.io.uff_file import UniversalFile, name_some
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["NodeAxes", "global_channels", "node_axes", "node_coordinates"]

#: Largest difference of an axis from a global one, relative to its length: dataset 18 has six digits.
_TOLERANCE = 1e-5
#: Labels of the global system; programs that define no system write 1.
_GLOBAL = (0, 1)
#: Kinds of coordinate systems whose axes are known at a node.
_CARTESIAN, _CYLINDRICAL = 0, 1

#: Axes of nodes by their numbers: rows are the local axes in global components; None if they cannot be computed.
NodeAxes = Mapping[int, FloatArray | None]


@dataclass(frozen=True)
class _System:
    """A coordinate system.

    Attributes
    ----------
    axes : ndarray, shape (3, 3), or None
        Rows are its axes in global components; None if they refer to another system.
    origin : ndarray, shape (3,)
        Origin, m.
    kind : int
        Kind: 0 cartesian, 1 cylindrical, 2 spherical.
    """

    axes: FloatArray | None
    origin: FloatArray
    kind: int

    @property
    def is_global(self) -> bool:
        """Whether directions are the global ones."""
        return self.kind == _CARTESIAN and self.axes is not None and np.allclose(self.axes, np.eye(3), atol=_TOLERANCE)

    @property
    def is_shifted(self) -> bool:
        """Whether coordinates are not the global ones."""
        return not self.is_global or bool(abs(self.origin).max() > _TOLERANCE)

    def at(self, place: FloatArray) -> FloatArray | None:
        """Return the axes at a place, shape (3, 3): along radius, circumference and z of a cylindrical system."""
        if self.axes is None or self.kind == _CARTESIAN:
            return self.axes
        radial = self.axes @ (place - self.origin)
        radial[2] = 0
        radius = float(np.linalg.norm(radial))
        if self.kind != _CYLINDRICAL or radius <= _TOLERANCE * float(np.linalg.norm(place - self.origin)):
            return None
        x, y, _ = radial / radius
        return np.asarray(np.array([[x, y, 0], [-y, x, 0], [0, 0, 1]]) @ self.axes)


def node_coordinates(file: UniversalFile, nodes: Collection[int]) -> dict[int, NDArray[np.float64]]:
    """Return coordinates of nodes.

    Parameters
    ----------
    file : UniversalFile
        File, to which notes are added on data that cannot be used: local coordinates, an unknown unit.
    nodes : collection of int
        Numbers of the nodes.

    Returns
    -------
    dict of int to ndarray, shape (3,)
        Global cartesian coordinates, m, of the nodes for which the file states them.

    Notes
    -----
    Dataset 2411 contains coordinates of the part; dataset 15 contains them in the definition system of each node.
    """
    coordinates: dict[int, NDArray[np.float64]] = {}
    systems = _coordinate_systems(file)
    for number, rows in _tables(file, nodes):
        if file.types[number - 1] == 15:
            local = np.array([_is_other(systems, row[1], shifted=True) for row in rows], dtype=bool)
            if local.any():
                names = name_some("node", [int(row[0]) for row in rows[local]])
                file.note(f"coordinates of {names} are local and are left out", number)
            rows = rows[~local]
        metre = _metre(file, number)
        if metre is None and rows.size:
            file.note(
                "the coordinates have no unit (there is no dataset 164) and are left out; give unit= with "
                "coordinates=m", number
            )  # fmt: skip
            continue
        coordinates |= {int(row[0]): row[3:] * (metre or 1.0) for row in rows}
    return coordinates


def _metre(file: UniversalFile, number: int) -> float | None:
    """Return the unit of the coordinates of a dataset in m, stated by the user or by dataset 164."""
    system = file.unit_system(number)
    by_file = None if system is None else 1.0 / system.length
    try:
        return file.reading.agreed("coordinates", file.reading.units.coordinates_to_m, by_file, f"{by_file or 1.0:g} m")
    except ValueError as error:
        raise file.error(f"(dataset {number}): {error}") from error


def node_axes(file: UniversalFile, nodes: Collection[int]) -> dict[int, FloatArray | None]:
    """Return the axes of nodes whose displacement system is not the global one.

    Parameters
    ----------
    file : UniversalFile
        The file.
    nodes : collection of int
        Numbers of the nodes.

    Returns
    -------
    dict of int to ndarray, shape (3, 3), or None
        Axes as rows, in global components: global components are local ones times it. None if the file does not define
        the system, or defines it relative to another one.
    """
    systems, found = _coordinate_systems(file), dict[int, FloatArray | None]()
    for _, rows in _tables(file, nodes, is_noted=False):
        for row in rows:
            found.pop(int(row[0]), None)
            if _is_other(systems, row[2]):
                system = systems.get(int(row[2]))
                found[int(row[0])] = None if system is None else system.at(row[3:])
    return found


def _is_other(systems: Mapping[int, _System], label: float, *, shifted: bool = False) -> bool:
    """Return whether a label belongs to a system other than the global one."""
    system = systems.get(int(label))
    if system is None:
        return int(label) not in _GLOBAL
    return system.is_shifted if shifted else not system.is_global


def _tables(
    file: UniversalFile, nodes: Collection[int], *, is_noted: bool = True
) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Yield the datasets of nodes: node, definition system, displacement system and coordinates, shape (n, 6)."""
    wanted = list(nodes)
    for number in file.datasets(15, 2411):
        try:
            rows = np.array(" ".join(file.records(number)).split(), dtype=np.float64).reshape(-1, 7)
        except ValueError:
            rows = np.full((1, 7), np.nan)
        if np.isfinite(rows).all():
            yield number, np.delete(rows[np.isin(rows[:, 0], wanted)], 3, axis=1)  # without the colour
        elif is_noted:
            file.note("the coordinates of nodes cannot be read and are left out", number)


def _coordinate_systems(file: UniversalFile) -> dict[int, _System]:
    """Return the coordinate systems that the file defines, by their labels."""
    systems: dict[int, _System] = {}
    for number in file.datasets(18, 2420):
        try:
            read = _systems_by_points if file.types[number - 1] == 18 else _systems_by_matrix
            systems |= read(file.records(number))
        except (ValueError, LookupError, OverflowError):
            file.note("the coordinate systems cannot be read: directions that refer to them are local", number)
            systems |= {label: _System(None, np.zeros(3), _CARTESIAN) for label in _GLOBAL[1:] if label not in systems}
    return systems


def _systems_by_points(records: Sequence[str]) -> dict[int, _System]:
    """Read dataset 18: origin, a point on the x axis and one in the xz plane, in a reference system."""
    systems = {}
    for first in range(0, len(records), 4):
        label, kind, reference, _, _ = (int(float(word)) for word in records[first].split())
        line = f"{records[first + 2]:<78}{records[first + 3]}"
        origin, on_x, in_xz = np.array([float(line[13 * i : 13 * i + 13]) for i in range(9)]).reshape(3, 3)
        x, y = on_x - origin, np.cross(in_xz - origin, on_x - origin)
        with np.errstate(all="ignore"):  # points in one place are no axes
            axes = [one / np.linalg.norm(one) for one in (x, y, np.cross(x, y))]
        systems[label] = _System(_checked_axes(axes) if reference == 0 else None, origin, kind)
    return systems


def _systems_by_matrix(records: Sequence[str]) -> dict[int, _System]:
    """Read dataset 2420: after part and name, of each system three rows of axes and one of the origin."""
    systems = {}
    for first in range(2, len(records), 6):
        label, kind, _ = (int(word) for word in records[first].split())
        matrix = np.array(" ".join(records[first + 2 : first + 6]).split(), dtype=np.float64).reshape(4, 3)
        systems[label] = _System(_checked_axes(matrix[:3]), matrix[3], kind)
    return systems


def _checked_axes(axes: Sequence[FloatArray] | FloatArray) -> FloatArray:
    """Return axes that are orthogonal, of length 1 and right-handed; raise a ValueError for others."""
    found = np.array(axes, np.float64)
    if not np.allclose(found @ found.T, np.eye(3), atol=10 * _TOLERANCE) or np.linalg.det(found) < 0:
        raise ValueError("axes are not orthogonal")
    return found


def global_channels(
    file: UniversalFile, axes: NodeAxes, channels: Sequence[Channel], h: ComplexArray
) -> tuple[list[int], tuple[Channel, ...], ComplexArray]:
    """Convert channels at nodes with local axes to global directions.

    Parameters
    ----------
    file : UniversalFile
        File, to which notes are added.
    axes : mapping of int to ndarray, shape (3, 3), or None
        Local axes by node, see `node_axes`.
    channels : sequence of Channel, length m
        Channels with the directions of the file.
    h : ndarray, shape (n_freq, m, p)
        FRFs with these channels as rows; NaN if there is none.

    Returns
    -------
    kept : list of int
        Number of each remaining channel among `channels`, or -1 if it is a sum of several.
    channels : tuple of Channel
        Remaining channels in global directions.
    h : ndarray, shape (n_freq, len(kept), p)
        FRFs of the remaining channels.

    Notes
    -----
    Local axes along global ones only rename channels. Other axes need all three directions of a node; without them the
    channels are omitted.
    """
    groups: dict[tuple[int, bool], list[int]] = {}
    for i, channel in enumerate(channels):
        groups.setdefault((channel.node, channel.is_rotation), []).append(i)
    kept, named, rows = list[int](), list[Channel](), list[ComplexArray]()
    turned, lost = set[int](), set[int]()
    for (node, _), own in groups.items():
        turn = axes.get(node, np.eye(3))
        along = None if turn is None else [_along(channels[i], turn) for i in own]
        if along is not None and all(along):
            kept, named, rows = [*kept, *own], [*named, *filter(None, along)], [*rows, *(h[:, i] for i in own)]
        elif turn is not None and {channels[i].axis[-1] for i in own} == set("xyz") and len(own) == 3:
            three = {channels[i].axis[-1]: channels[i].sign * h[:, i] for i in own}
            local, prefix = np.stack([three[axis] for axis in "xyz"]), channels[own[0]].axis[:-1]
            kept += [-1] * 3
            named += [Channel(node, f"+{prefix}{axis}") for axis in "xyz"]
            rows += list(np.tensordot(turn.T, local, 1))
        else:
            lost.add(node)
            continue
        turned |= {node} & set(axes)
    places = file.datasets(15, 2411)
    if turned:
        file.note(f"local directions at {name_some('node', sorted(turned))} are turned to global ones", *places)
    if lost:
        file.note(
            f"directions at {name_some('node', sorted(lost))} are local and left out; measure all three, or set "
            "displacement systems to 0 and give a channel table",
            *places,
        )
    whole = np.stack(rows, axis=1) if rows else h[:, :0]
    return kept, tuple(named), whole


def _along(channel: Channel, turn: FloatArray) -> Channel | None:
    """Return the global channel of a local one whose axis is along a global one; else None."""
    axis = turn["xyz".index(channel.axis[-1])]
    place = int(abs(axis).argmax())
    if abs(abs(axis[place]) - 1) > _TOLERANCE or np.delete(abs(axis), place).max() > 10 * _TOLERANCE:
        return None
    sign = "+" if axis[place] * channel.sign > 0 else "-"
    return Channel(channel.node, f"{sign}{channel.axis[:-1]}{'xyz'[place]}")
