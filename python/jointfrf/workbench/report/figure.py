"""Figures as data, independent of the program that draws them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import Band
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.report.table import csv_text

__all__ = [
    "Curve",
    "Figure",
    "Interval",
    "Level",
    "MovingBody",
    "NamedBands",
    "Panel",
    "Ribbon",
    "Surface",
    "deformed_surface",
    "figure_csv",
]

#: Names of bands and their limits, Hz.
NamedBands = tuple[tuple[str, tuple[Band, ...]], ...]


@dataclass(frozen=True)
class Curve:
    """A line: y over x, drawn in one of `draw.STYLES`; `thin` if it must not hide other lines."""

    label: str
    x: FloatArray
    y: FloatArray
    style: str
    thin: bool = False


@dataclass(frozen=True)
class Ribbon:
    """The area between two curves."""

    label: str
    x: FloatArray
    low: FloatArray
    high: FloatArray
    style: str


@dataclass(frozen=True)
class Level:
    """A value: a horizontal line, over `bands` only if they are given."""

    label: str
    value: float
    style: str
    bands: tuple[Band, ...] = ()


@dataclass(frozen=True)
class Interval:
    """A median with its 2.5 and 97.5 percentiles, and a published value."""

    label: str
    low: float
    median: float
    high: float
    published: float | None = None


@dataclass(frozen=True)
class Surface:
    """Quadrilaterals shaded by a value: in space, shape (n, 4, 3), seen from one side; or in a plane, (n, 4, 2).

    `edges` are other quadrilaterals of which only the outline is drawn.
    """

    faces: FloatArray
    values: FloatArray
    label: str = ""
    edges: FloatArray | None = None

    @property
    def in_space(self) -> bool:
        """Whether corners have three coordinates."""
        return bool(self.faces.shape[2] == 3)


@dataclass(frozen=True)
class Panel:
    """Axes of a figure.

    Labels are "quantity, unit". An empty `x_label` leaves out the numbers, too: the panel below shares them.
    `shades` are (label, bands) in Hz. `strips` are bands drawn as bars at the bottom. `y_step` is the distance of the
    numbers along y; without it the figure chooses. `height` is relative to other panels. `interval_names` are the names
    of the middle and the limits of intervals. A panel without content is left blank.
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...] = ()
    ribbons: tuple[Ribbon, ...] = ()
    levels: tuple[Level, ...] = ()
    intervals: tuple[Interval, ...] = ()
    shades: NamedBands = ()
    strips: NamedBands = ()
    log_y: bool = False
    log_x: bool = False
    x_limits: tuple[float, float] | None = None
    y_limits: tuple[float, float] | None = None
    surface: Surface | None = None
    y_step: float | None = None
    height: float = 1.0
    interval_names: tuple[str, str] = ("median", "2.5 to 97.5 %")

    @property
    def is_blank(self) -> bool:
        """Whether the panel is empty."""
        return not (self.curves or self.ribbons or self.levels or self.intervals or self.surface)


@dataclass(frozen=True)
class Figure:
    """Panels in rows of `columns`.

    Attributes
    ----------
    key : str
        Name of the files of the figure.
    caption : str
        Caption on a page.
    panels : tuple of Panel
        Panels, row by row.
    columns : int
        Number of panels in a row.
    number : str
        Number of the figure in the source, or empty.
    heading : str
        Title above the panels if the figure is a separate file.
    """

    key: str
    caption: str
    panels: tuple[Panel, ...] = ()
    columns: int = 1
    number: str = ""
    heading: str = ""


def figure_csv(figure: Figure) -> str:
    """Return the data of a figure as CSV, a line for each point: panel, curve, x, y and the upper limit of an area."""
    rows = ((panel.title or str(i), *row) for i, panel in enumerate(figure.panels, 1) for row in _panel_rows(panel))
    return csv_text([("panel", "curve", "x", "y", "y_high"), *rows])


def _panel_rows(panel: Panel) -> Iterator[tuple[object, ...]]:
    """Yield rows of a panel: curve, x, y and the upper limit of an area."""
    for curve in panel.curves:
        yield from ((curve.label, x, y, "") for x, y in zip(curve.x.tolist(), curve.y.tolist(), strict=True))
    for area in panel.ribbons:
        columns = (area.x.tolist(), area.low.tolist(), area.high.tolist())
        yield from ((area.label, *point) for point in zip(*columns, strict=True))
    yield from ((level.label, "", level.value, "") for level in panel.levels)
    for interval in panel.intervals:
        label = interval.label.replace("\n", ", ")
        middle, limits = panel.interval_names
        yield f"{label}: {middle}", "", interval.median, ""
        yield f"{label}: {limits}", "", interval.low, interval.high
        if interval.published is not None:
            yield f"{label}: thesis", "", interval.published, ""
    if panel.surface is not None:
        middles = panel.surface.faces.mean(axis=1)
        for middle, value in zip(middles.tolist(), panel.surface.values.tolist(), strict=True):
            yield panel.surface.label, " ".join(f"{x:.9g}" for x in middle), value, ""
    for label, bands in (*panel.shades, *panel.strips):
        yield from ((label, f"{low:g}-{high:g}", "", "") for low, high in bands)


#: Largest displacement drawn, as a share of the length of the structure.
_DEFLECTION = 0.12


@dataclass(frozen=True)
class MovingBody:
    """Surface of a body, and displacements of its nodes.

    Attributes
    ----------
    nodes : ndarray, shape (n_nodes, 3)
        Positions, m.
    faces : ndarray of int, shape (n_faces, 4)
        Nodes of the quadrilaterals on the outside, counted from 0.
    motion : ndarray, shape (n_nodes, 3)
        Displacements, of any size.
    """

    nodes: FloatArray
    faces: NDArray[np.integer]
    motion: FloatArray


def deformed_surface(bodies: Sequence[MovingBody]) -> Surface:
    """Return deformed bodies true to scale, darker where they move more, with outlines at rest.

    Parameters
    ----------
    bodies : sequence of MovingBody
        Bodies in a common motion.

    Returns
    -------
    Surface
        Values are displacements, as shares of the largest.
    """
    reach = _DEFLECTION * np.ptp(np.concatenate([body.nodes for body in bodies]), axis=0).max()
    sizes = [np.linalg.norm(body.motion, axis=1) for body in bodies]
    largest = max(float(size.max()) for size in sizes)
    drawn = [(body.nodes + reach / largest * body.motion)[body.faces] for body in bodies]
    values = [(size / largest)[body.faces].mean(axis=1) for body, size in zip(bodies, sizes, strict=True)]
    at_rest = [body.nodes[body.faces] for body in bodies]
    return Surface(np.concatenate(drawn), np.concatenate(values), edges=np.concatenate(at_rest))
