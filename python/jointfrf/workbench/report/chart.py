"""Figures as parts of a page: curves as paths of an SVG image of any width, axes as text; a script zooms."""

from __future__ import annotations

import colorsys
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.report.axes import numbered_axis
from jointfrf.workbench.report.draw import STYLES, Style
from jointfrf.workbench.report.figure import Curve, Figure, Panel, Ribbon

__all__ = ["Chart", "chart_view", "style_rules", "thinned_dots", "thinned_line"]

#: Units of the paths along x and y, finer than a screen for zooming.
_WIDE, _HIGH = 20000, 8000
#: Distance above and below the panel up to which a curve is drawn, in heights of the panel.
_OFF = 3
#: Largest number of values along x and along y, for a narrow screen.
_MOST_X, _MOST_Y = 6, 5
#: Ratio of a step along x to its neighbours above which a curve has a gap.
_GAP = 6.0
#: Width of dots and of marks of outlying lines, points.
_DOT, _CROSS = 2.4, 4.0
#: Lightness of colours on a dark page: from, to.
_DARK = (0.36, 0.92)


@dataclass(frozen=True)
class Chart:
    """A figure that readers can zoom, with its description in words (`alt`) and the most points of a curve (`most`)."""

    figure: Figure
    alt: str
    most: int = 4000


def chart_view(chart: Chart) -> dict[str, Any]:
    """Return the fields of a chart for the template."""
    figure = chart.figure
    panels = [_panel_view(panel, chart.most) for panel in figure.panels if not panel.is_blank]
    legend: dict[str, str] = {}
    for panel in figure.panels:
        for curve in panel.curves:
            legend.setdefault(curve.label, f"s-{curve.style}")
        for ribbon in panel.ribbons:
            legend.setdefault(ribbon.label, f"r-{ribbon.style}")
    return {
        "key": figure.key,
        "caption": figure.caption,
        "alt": chart.alt,
        "legend": legend,
        "panels": panels,
        "columns": figure.columns,
        "wide": _WIDE,
        "high": _HIGH,
    }


def _panel_view(panel: Panel, most: int) -> dict[str, Any]:
    x_ends, y_ends = _limits(panel)
    x_axis = numbered_axis(panel.x_label, *x_ends, _MOST_X)
    y_axis = numbered_axis(panel.y_label, *y_ends, _MOST_Y, log=panel.log_y, step=panel.y_step)
    low, high = np.log10(y_ends).tolist() if panel.log_y else y_ends

    def place_x(x: FloatArray) -> FloatArray:
        return (x - x_ends[0]) / (x_ends[1] - x_ends[0]) * _WIDE

    def place_y(y: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore", invalid="ignore"):
            up = ((np.log10(y) if panel.log_y else y) - low) / (high - low)
        return (1 - np.clip(np.where(np.isfinite(up), up, np.nan), -_OFF, 1 + _OFF)) * _HIGH

    x_places, y_places = place_x(np.array(x_axis.values)).tolist(), place_y(np.array(y_axis.values)).tolist()
    return {
        "title": panel.title,
        "y_label": y_axis.label,
        "x_label": panel.x_label,
        "unit": panel.y_label.rpartition(", ")[2],
        "limits": {
            "x": x_ends, "y": (low, high), "log": panel.log_y, "size": y_axis.size, "step": panel.y_step,
        },
        "x_ticks": [(100 * place / _WIDE, text) for place, text in zip(x_places, x_axis.texts, strict=True)],
        "y_ticks": [(100 * (1 - place / _HIGH), text) for place, text in zip(y_places, y_axis.texts, strict=True)],
        "grid": "".join([f"M{p:.0f} 0V{_HIGH}" for p in x_places] + [f"M0 {p:.0f}H{_WIDE}" for p in y_places]),
        "areas": [{"style": f"r-{own.style}", "path": _area(own, place_x, place_y)} for own in panel.ribbons],
        "curves": [
            {"style": f"s-{curve.style}", "label": curve.label, "path": _path(curve, place_x, place_y, most)}
            for curve in panel.curves
        ],
        "height": panel.height,
    }  # fmt: skip


def _limits(panel: Panel) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the limits along x and y of the panel, or of its curves."""
    low = min((float(curve.x[0]) for curve in panel.curves if curve.x.size), default=0.0)
    high = max((float(curve.x[-1]) for curve in panel.curves if curve.x.size), default=0.0)
    x_ends = panel.x_limits or ((low, high) if high > low else (low - 0.5, high + 0.5))
    if panel.y_limits is not None:
        return x_ends, panel.y_limits
    values = np.concatenate([curve.y for curve in panel.curves])
    values = values[np.isfinite(values) & ((values > 0) | (not panel.log_y))]
    values = np.log10(values) if panel.log_y else values
    low, high = (float(values.min()), float(values.max())) if values.size else (-1.0, 1.0)
    room = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    return x_ends, (10.0 ** (low - room), 10.0 ** (high + room)) if panel.log_y else (low - room, high + room)


def _path(curve: Curve, place_x: Any, place_y: Any, most: int) -> str:
    """Return a curve as steps from point to point, and dots as lines without a length."""
    dots = STYLES[curve.style].dashes is None
    kept = (thinned_dots if dots else thinned_line)(np.asarray(curve.y, np.float64), most)
    x, y = (np.round(place(values[kept])) for place, values in ((place_x, curve.x), (place_y, curve.y)))
    known = np.isfinite(y)
    if dots:
        points = np.stack([x[known], y[known]], axis=1).astype(int)
        steps = np.diff(points, axis=0, prepend=np.zeros((1, 2), int))
        return "".join(f"m{a} {b}h0" for a, b in steps.tolist())
    pieces, at = [], np.zeros(2, int)
    part = _parts(np.asarray(curve.x, np.float64))[kept]
    cuts = np.flatnonzero(np.diff(part) | (np.diff(known.astype(int)) != 0)) + 1
    for first, end in pairwise([0, *cuts.tolist(), known.size]):
        if not known[first:end].any():
            continue
        points = np.stack([x[first:end], y[first:end]], axis=1).astype(int)
        steps = np.diff(points, axis=0, prepend=at[None])
        moved = " ".join(f"{a} {b}" for a, b in steps.tolist())
        pieces.append(f"m{moved.replace(' -', '-')}" + ("h0" if end == first + 1 else ""))
        at = points[-1]
    return "".join(pieces)


def _parts(x: FloatArray) -> NDArray[np.intp]:
    """Return the number of the part of a curve for each point; between parts, as between bands, there are no lines."""
    step = np.diff(x)
    beside = np.fmax(np.r_[-np.inf, step[:-1]], np.r_[step[1:], -np.inf])
    return np.r_[0, np.cumsum((beside > 0) & (step > _GAP * beside))] if step.size > 1 else np.zeros(x.size, np.intp)


def _area(ribbon: Ribbon, place_x: Any, place_y: Any) -> str:
    x = np.r_[ribbon.x, ribbon.x[::-1]]
    y = np.r_[ribbon.low, ribbon.high[::-1]]
    points = np.stack([place_x(x), place_y(y)], axis=1)
    return "M" + "L".join(f"{a:.0f} {b:.0f}" for a, b in points) + "Z"


def style_rules(charts: Iterable[Chart]) -> str:
    """Return the rules of style of all curves of charts: on a light page and on paper, then on a dark page."""
    panels = [panel for chart in charts for panel in chart.figure.panels]
    lines = dict.fromkeys(curve.style for panel in panels for curve in panel.curves)
    areas = dict.fromkeys(area.style for panel in panels for area in panel.ribbons)
    light = [_line_rule(name, STYLES[name]) for name in lines]
    light += [f".r-{name}{{fill:{STYLES[name].colour};fill-opacity:.25}}" for name in areas]
    dark = [f".s-{name}{{stroke:{_on_dark(STYLES[name].colour)}}}" for name in lines]
    dark += [f".r-{name}{{fill:{_on_dark(STYLES[name].colour)}}}" for name in areas]
    return "\n".join(light) + "\n@media screen and (prefers-color-scheme: dark){" + "".join(dark) + "}"


def _line_rule(name: str, style: Style) -> str:
    rule = f"fill:none;stroke:{style.colour};stroke-linejoin:round;"
    if style.dashes is None:
        cap, width = ("round", _DOT) if style.marker == "." else ("square", _CROSS)
        return f".s-{name}{{{rule}stroke-width:{width:g};stroke-linecap:{cap}}}"
    dashes = " ".join(f"{max(style.width, 1) * part:.3g}" for part in style.dashes)
    rest = f"stroke-dasharray:{dashes}" if dashes else "stroke-linecap:round"
    return f".s-{name}{{{rule}stroke-width:{style.width:g};{rest}}}"


def _on_dark(colour: str) -> str:
    """Return a colour with the distance from black that it has from white."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    hue, light, much = colorsys.rgb_to_hls(red, green, blue)
    least, most = _DARK
    found = colorsys.hls_to_rgb(hue, least + (most - least) * (1 - light), much)
    return "#" + "".join(f"{round(255 * part):02x}" for part in found)


#: Number of dots of a column that are kept: its extremes, and some between.
_DOTS = 5


def thinned_line(y: FloatArray, most: int) -> NDArray[np.intp]:
    """Return points of a curve: the lowest and the highest of each of `most` / 2 columns of neighbouring points.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Values in the order of x; NaN makes a gap, which is kept if it is at least a column wide.
    most : int
        Largest number of points.

    Returns
    -------
    ndarray of int
        Indices of the points, increasing.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.workbench.report.chart import thinned_line
    >>> thinned_line(np.array([0.0, 5.0, 1.0, 2.0, -7.0, 3.0, 4.0, 0.0]), 4).tolist()
    [0, 1, 4, 6]
    """
    if y.size <= most:
        return np.arange(y.size)
    width = int(np.ceil(y.size / max(most // 2, 1)))
    starts = np.arange(0, y.size, width)
    columns = np.full((starts.size, width), np.nan)
    columns.flat[: y.size] = y
    finite = np.isfinite(columns)
    lowest = np.where(finite, columns, np.inf).argmin(axis=1)
    highest = np.where(finite, columns, -np.inf).argmax(axis=1)
    return np.unique(np.concatenate([starts + lowest, starts + highest]))


def thinned_dots(y: FloatArray, most: int) -> NDArray[np.intp]:
    """Return dots: the lowest, the highest, and evenly spread dots of each column of neighbours; see `thinned_line`.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.workbench.report.chart import thinned_dots
    >>> y = np.sin(np.arange(1000.0) ** 2)
    >>> kept = thinned_dots(y, 100)
    >>> bool(kept.size <= 100), bool(y[kept].max() == y.max())
    (True, True)
    """
    if y.size <= most:
        return np.arange(y.size)
    columns = max(most // _DOTS, 1)
    evenly = np.linspace(0, y.size - 1, (_DOTS - 2) * columns).astype(np.intp)
    return np.unique(np.concatenate([thinned_line(y, 2 * columns), evenly]))
