"""Channels, joint and deformation in space, to be turned and played: what a page shows where plotly is installed."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from jointfrf.dofs import DIRECTIONS, direction_names
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.report.document import Space
from jointfrf.report.sketch import SketchedPart, interface_points, moved_parts, rows_of_points

__all__ = ["space_of_fit"]

#: Frequency lines that may be chosen at most, peaks of the response among them at most; bytes of all of them together.
_LINES, _PEAKS, _BYTES = 160, 40, 600_000
#: The largest displacement is stored as this number of eight bits.
_FULL = 127


class _MovingPoint(NamedTuple):
    """A point: name, side 0 or 1, place in m, directions of its channels, shape (m, 3), and their rows in the FRFs."""

    name: str
    side: int
    place: FloatArray
    directions: FloatArray
    rows: Sequence[int]


def space_of_fit(fit: Fit, parts: Sequence[SketchedPart]) -> Space | None:
    """Return the view of a fit; None where places are not known.

    Parameters
    ----------
    fit : Fit
        With its data.
    parts : sequence of SketchedPart
        Both parts of a fit of an assembly; of more there is no view.

    Notes
    -----
    A deformation is what was measured at one line by one hit, and beside it what the fit makes of it (an operating
    deflection shape): a point moves by the smallest displacement that its channels show, and not at all in directions
    that none of them measures.
    """
    up = np.argsort(fit.freq_hz, kind="stable")
    data = fit.data
    if isinstance(data, FitData) and data.interface is not None and data.modes is not None:
        centres = np.array(data.interface.references)
        groups = rows_of_points(data.interface)
        points = [
            _MovingPoint(one.name, one.side, one.place, np.array(one.directions), rows)
            for one, (_, rows) in zip(interface_points(data.interface), groups, strict=True)
        ]
        names, forces, measured, modes = data.response_names, data.force_names, data.measured, data.modes
        grid: list[FloatArray] = []
        word = "regenerated with the joint found"

        def fitted(line: int) -> ComplexArray:
            return np.asarray(modes[0] @ data.regenerated(slice(line, line + 1))[0] @ modes[1].T)

    elif isinstance(data, ModelData) and len(parts) == 2:
        moved = moved_parts(parts)
        if moved is None:
            return None
        places, joints = moved
        reference = np.mean([next(iter(ends.values())) for ends in joints.values()], axis=0)
        centres, grid = np.array([reference, reference]), [np.array(list(own.values())) for own in places]
        points = _points_of_parts(fit.responses, [part.letter for part in parts], places)
        names, forces, measured, predicted = fit.responses, fit.forces, data.measured, data.predicted
        word = "predicted with the joint found"

        def fitted(line: int) -> ComplexArray:
            return np.asarray(predicted[line])

    else:
        return None
    if not points or not np.ptp(np.array([one.place for one in points]), axis=0).any():
        return None
    lines, peak = _chosen(np.nan_to_num(measured[up]), len(points) * len(forces))
    shown = [up[i] for i in lines]
    shapes = [_shapes(points, np.array([of(i) for i in shown])) for of in (lambda i: measured[i], fitted)]
    content = {
        "points": [one.name for one in points],
        "sides": [one.side for one in points],
        "at": _numbers(1e3 * np.array([one.place for one in points])),
        "centres": _numbers(1e3 * centres),
        "nodes": [_numbers(1e3 * own) for own in grid],
        "sensors": [[i, *_numbers(way)] for i, one in enumerate(points) for way in one.directions if way.any()],
        "freq": [float(f"{f:.6g}") for f in fit.freq_hz[shown]],
        "hits": [[name, *_hit(name, names, points)] for name in forces],
        "sources": ["measured", word],
        "shapes": _packed(shapes),
        "peak": lines.index(peak),
    }
    caption = (
        "Drag to turn, pinch or scroll to zoom. Thin arrows: measured directions; cone: the force; thick line: the "
        "joint. Deformation at one frequency line by one force, in the scale of its largest displacement; directions "
        "without a channel stay at rest"
    )
    return Space("space", caption, f"View in space of points {', '.join(one.name for one in points)}", content)


def _points_of_parts(
    responses: Sequence[str], letters: Sequence[str], places: Sequence[Mapping[str, FloatArray]]
) -> list[_MovingPoint]:
    """Return the nodes at which translations of an assembly are measured."""
    rows: dict[tuple[int, str], list[tuple[int, FloatArray]]] = {}
    for row, dof in enumerate(responses):
        letter, _, rest = dof.partition("/")
        node, _, direction = rest.rpartition(":")
        side, way = letters.index(letter) if letter in letters else -1, _way(direction)
        if side >= 0 and node in places[side] and way.any():
            rows.setdefault((side, node), []).append((row, way))
    return [
        _MovingPoint(f"{letters[side]}/{node}", side, places[side][node], np.array([way for _, way in own]),
               [row for row, _ in own])
        for (side, node), own in rows.items()
    ]  # fmt: skip


def _way(direction: str) -> FloatArray:
    """Return the unit vector of a direction such as ``-y``; zeros where it is no translation."""
    try:
        name = direction_names([direction.lstrip("+-")])[0]
    except ValueError:
        return np.zeros(3)
    unit = np.eye(6)[DIRECTIONS.index(name)][:3]
    return np.asarray(-unit if direction.startswith("-") else unit)


def _hit(name: str, responses: Sequence[str], points: Sequence[_MovingPoint]) -> list[Any]:
    """Return where a force acts, as the number of a point, and its direction; nothing where that is not known."""
    node, _, direction = name.rpartition(":")
    row = list(responses).index(name) if name in responses else -1
    for i, one in enumerate(points):
        if row in one.rows:
            return [i, *_numbers(one.directions[list(one.rows).index(row)])]
        if node == one.name and _way(direction).any():
            return [i, *_numbers(_way(direction))]
    return []


def _chosen(measured: ComplexArray, numbers: int) -> tuple[list[int], int]:
    """Return rising lines that may be chosen, evenly over the band and the highest peaks, and the highest of these."""
    from scipy.signal import find_peaks

    size = np.log(np.maximum(abs(measured).max(axis=(1, 2)), np.finfo(np.float64).tiny))
    found, how = find_peaks(size, prominence=np.log(2.0))
    highest = found[np.argsort(-how["prominences"], kind="stable")[:_PEAKS]]
    most = int(np.clip(_BYTES // (12 * numbers), 8, _LINES))
    even = np.linspace(0, size.size - 1, min(size.size, most)).astype(np.intp)
    lines = sorted({*even.tolist(), *highest.tolist()})
    return lines, int(highest[0]) if highest.size else lines[len(lines) // 2]


def _shapes(points: Sequence[_MovingPoint], frfs: ComplexArray) -> ComplexArray:
    """Return displacements of points, shape (lines, forces, points, 3): the smallest that their channels show."""
    known = np.nan_to_num(frfs)
    moved = [np.linalg.pinv(one.directions) @ known[:, list(one.rows)] for one in points]
    return np.asarray(np.moveaxis(np.array(moved), (0, 3), (2, 1)))


def _packed(shapes: Sequence[ComplexArray]) -> str:
    """Return real and imaginary parts of all shapes as bytes, those of one line and force in one scale."""
    both = np.array(shapes)
    size = abs(both).max(axis=(0, 3, 4), keepdims=True)
    scaled = _FULL * both / np.where(size > 0, size, 1)
    parts = np.stack([scaled.real, scaled.imag], axis=-1)
    return base64.b64encode(np.round(parts).astype(np.int8).tobytes()).decode()


def _numbers(values: FloatArray) -> list[Any]:
    return list((np.round(values, 4) + 0.0).tolist())
