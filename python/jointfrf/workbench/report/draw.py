"""Figures drawn by matplotlib, without global state, as PNG and as SVG."""

from __future__ import annotations

import io
import re
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from jointfrf.extras import check_extras
from jointfrf.spelling import visible
from jointfrf.workbench.report.axes import format_axis
from jointfrf.workbench.report.figure import Figure, Panel, Surface

__all__ = ["STYLES", "Drawing", "Style", "draw", "laid_out", "shortened"]


class Drawing(NamedTuple):
    """A figure as files: PNG for documents (empty by default), and SVG."""

    png: bytes
    svg: bytes


class Style(NamedTuple):
    """Style of a curve; lengths of dashes and gaps in widths of the line, None for dots without a line."""

    colour: str
    dashes: tuple[float, ...] | None
    width: float
    marker: str = ""


#: Styles that also differ by lightness and dashes, for prints in grey.
STYLES = {
    "actual": Style("#000000", (), 1.5),
    "initial": Style("#8c8c8c", (4, 1.6), 1.2),
    "measured": Style("#e07b00", (), 0.7),
    "mean": Style("#c0392b", (5, 1.5), 2.2),
    "stiffness": Style("#8e7cc3", (), 2.4),
    "stiffness-initial": Style("#4b3d80", (7, 2), 1.2),
    "damping": Style("#2e7d4f", (4, 1.5, 1, 1.5, 1, 1.5), 1.3),
    "ismm": Style("#1b4f9c", (), 1.1),
    "ismm-kj": Style("#1b4f9c", (5, 1), 1.1),
    "inverse-substructuring": Style("#1b4f9c", (4, 1.6), 1.1),
    "compliance": Style("#e07b00", (6, 1.6, 1, 1.6), 1.5),
    "decoupling-rr": Style("#c0392b", (4, 1.6), 1.1),
    "decoupling-rs": Style("#5aa469", (1, 1.65), 1.5),
    "decoupling-sr": Style("#9b72b0", (3, 1, 1, 1), 1.1),
    "decoupling-ss": Style("#d96a9a", (6, 2), 1.3),
    "low": Style("#2f7fbf", (1, 1.65), 1.4),
    "high": Style("#e07b00", (4, 1.6), 1.2),
    "faint": Style("#a8a8a8", (), 0.3),
    "dots": Style("#8c8c8c", None, 1.0, "."),
    "wide": Style("#eeb574", (), 4.0),
    "fitted": Style("#16365f", (), 1.1),
    "difference": Style("#8c8c8c", (), 0.7),
    "outlying": Style("#7b1a10", None, 1.0, "x"),
    "ismm-points": Style("#1b4f9c", (), 1.1, "o"),
    "compliance-points": Style("#e07b00", (6, 1.6, 1, 1.6), 1.5, "D"),
    "third-points": Style("#5aa469", (5, 1), 1.1, "s"),
    "fourth-points": Style("#9b72b0", (3, 1, 1, 1), 1.1, "^"),
    "fifth-points": Style("#c0392b", (1, 1.65), 1.5, "v"),
}
#: Bands of several names, light to dark.
_SHADES = ("#ececec", "#d2d2d2", "#bdbdbd")
#: Dots an inch of a PNG file, and of images inside an SVG file; size of markers, points.
_RESOLUTION, _RESOLUTION_INSIDE, _MARKER = 130, 96, 2.5
#: Width of thin curves, as a share of the usual width.
_THIN = 0.55
#: Styles of curves with so much detail that they are drawn as images.
_DENSE = ("faint", "dots")
#: Opacity of the area around the middle of a distribution.
_ON_TOP, _HALO = ("ismm", "compliance"), 1.2
#: Largest number of values along x, with one panel and with several panels in a row.
_MOST, _MOST_BESIDE = 10, 5
#: Size of a heading, points.
_HEADING = 10
#: Size of a figure, inches: fits the text width of A4.
_WIDTH, _PANEL_HEIGHT, _SPACE_HEIGHT = 7.0, 2.75, 1.5
#: Height of a panel of intervals: its frame, and each.
_INTERVALS = (0.7, 0.36)
#: Directions on the page of a drawing in space, to the right and up, and towards the reader: z lies along, y up.
_VIEW = np.array([[-0.419, 0.0, 0.908], [0.410, 0.893, 0.189], [-0.810, 0.451, -0.374]])
#: Arrows that show the axes of space: their length as a share of the height of what is drawn, and place of the letters.
_ARROW, _LETTER = 0.28, 1.45
#: Settings that keep texts as texts and leave out points within 0.2 pixels of a line.
_SETTINGS = {"svg.fonttype": "none", "path.simplify_threshold": 0.2}
#: Settings of sizes for a page of text width, and of grids behind the curves.
_FONTS = {"font.sans-serif": ["DejaVu Sans"], "font.size": 8.5, "axes.titlesize": 9,
          "legend.fontsize": 7.5, "axes.grid": True, "grid.alpha": 0.3,
          "grid.linewidth": 0.5, "axes.axisbelow": True, "lines.solid_capstyle": "round"}  # fmt: skip


def draw(figure: Figure, png: bool = True) -> Drawing:
    """Draw a figure, and return its files.

    Parameters
    ----------
    figure : Figure
        Figure as data.
    png : bool
        Whether to draw a PNG file, too, which takes two fifths longer; default True.

    Returns
    -------
    Drawing
        Files, which are equal for equal data.
    """
    canvas = laid_out(figure)
    pixels, vectors = io.BytesIO(), io.BytesIO()
    with _settings(figure):
        canvas.set_dpi(_RESOLUTION if png else _RESOLUTION_INSIDE)
        canvas.draw_without_rendering()
        canvas.set_layout_engine("none")  # for each file matplotlib would find the layout again
        # No version and no date inside.
        if png:
            canvas.savefig(pixels, format="png", dpi=_RESOLUTION, metadata={"Software": None})
        canvas.savefig(vectors, format="svg", dpi=_RESOLUTION_INSIDE, metadata={"Date": None, "Creator": None})
    return Drawing(pixels.getvalue(), shortened(vectors.getvalue().decode()).encode())


def laid_out(figure: Figure) -> Any:
    """Return a figure as `matplotlib.figure.Figure`, not yet drawn."""
    check_extras("matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas
    from matplotlib.text import Text

    heights = _row_heights(figure)
    with _settings(figure):
        canvas = Canvas(figsize=(_WIDTH, sum(heights) + 0.4), layout="constrained")
        FigureCanvasAgg(canvas)
        grid = canvas.add_gridspec(len(heights), figure.columns, height_ratios=heights)
        axes = []
        for i, panel in enumerate(figure.panels):
            row, column = divmod(i, figure.columns)
            if not panel.is_blank:
                axes.append(canvas.add_subplot(grid[row, column]))
                _draw_panel(axes[-1], panel, figure.columns)
                names = [[interval.label for interval in own.intervals] for own in figure.panels[i - 1 : i + 1]]
                if column and panel.intervals and names[0] == names[1]:
                    axes[-1].tick_params(labelleft=False)
        _draw_axes_of_space([ax for ax in axes if not ax.axison])
        _add_legend(canvas, axes)
        if figure.heading:
            canvas.suptitle(figure.heading, fontsize=_HEADING)
        for text in canvas.findobj(Text):
            if words := text.get_text():
                text.set_text(_drawable(words))
        canvas.align_ylabels(axes)
    return canvas


def _settings(figure: Figure) -> Any:
    """Return the settings of matplotlib for a figure, for a `with` block.

    All settings are replaced, because a `matplotlibrc` in the working directory is untrusted: `text.usetex` starts
    programs.
    """
    from matplotlib import style

    return style.context(["default", {**_FONTS, **_SETTINGS, "svg.hashsalt": figure.key}])


@lru_cache(1000)
def _drawable(words: str) -> str:
    """Return a text that can be drawn: wrong formulas and invisible characters are escaped."""
    from matplotlib.mathtext import MathTextParser

    words = visible(words, "\n")
    try:
        if "$" in words:
            MathTextParser("path").parse(words)
    except ValueError:
        words = words.replace("$", r"\$")
    return words


def _row_heights(figure: Figure) -> list[float]:
    """Return the heights of the rows of panels, inches."""
    rows = [figure.panels[i : i + figure.columns] for i in range(0, len(figure.panels), figure.columns)]
    heights = []
    for row in rows:
        intervals = _INTERVALS[0] + _INTERVALS[1] * max(len(panel.intervals) for panel in row)
        usual = (
            _SPACE_HEIGHT
            if all(panel.is_blank or (panel.surface and panel.surface.in_space) for panel in row)
            else _PANEL_HEIGHT
        )
        heights.append(max(usual * max(panel.height for panel in row), intervals if intervals > _PANEL_HEIGHT else 0))
    return [1.25 * height for height in heights] if len(figure.panels) == 1 else heights


def _draw_panel(ax: Any, panel: Panel, beside: int) -> None:
    most = _MOST_BESIDE if beside > 1 else _MOST
    if panel.surface is not None:
        _draw_surface(ax, panel.surface)
    elif panel.intervals:
        _draw_intervals(ax, panel)
    else:
        _draw_curves(ax, panel)
    if ax.axison:
        format_axis(ax.xaxis, panel.x_label, most=most, log=panel.log_x)
    if ax.axison and not panel.intervals:
        format_axis(ax.yaxis, panel.y_label, log=panel.log_y, step=panel.y_step)
        ax.tick_params(labelbottom=bool(panel.x_label))
    ax.set_title(panel.title, y=1.0)  # no numbers above the panel make way for it


def _add_legend(canvas: Any, axes: list[Any]) -> None:
    """Add one legend below all panels, with each label once."""
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if found:
        columns = max(1, min(len(found), 5, 110 // max(len(label) + 8 for label in found)))
        canvas.legend(found.values(), found.keys(), loc="outside lower center", ncols=columns, frameon=False)


def _look(style: str, share: float = 1.0) -> dict[str, Any]:
    """Return colour, dashes and width of a line for matplotlib."""
    colour, dashes, width, _ = STYLES[style]
    return {"color": colour, "ls": "" if dashes is None else (0, dashes) if dashes else "-", "lw": share * width}


def _draw_curves(ax: Any, panel: Panel) -> None:
    from matplotlib.patheffects import Normal, Stroke

    for i, (label, bands) in enumerate(panel.shades):
        for b, (low, high) in enumerate(bands):
            ax.axvspan(low, high, color=_SHADES[i % len(_SHADES)], lw=0, zorder=0, label=None if b else label)
    for ribbon in panel.ribbons:
        colour = STYLES[ribbon.style].colour
        ax.fill_between(ribbon.x, ribbon.low, ribbon.high, color=colour, alpha=0.25, lw=0, label=ribbon.label)
    for curve in panel.curves:
        look, dense = _look(curve.style, _THIN if curve.thin else 1.0), curve.style in _DENSE
        (line,) = ax.plot(
            curve.x, curve.y, label=curve.label or None, rasterized=dense, zorder=1.5 if dense else 2,
            marker=STYLES[curve.style].marker, ms=_MARKER, **look,
        )  # fmt: skip
        if panel.ribbons and curve.style in _ON_TOP:
            line.set_path_effects([Stroke(linewidth=look["lw"] + _HALO, foreground="#ffffff"), Normal()])
    for level in panel.levels:
        look = _look(level.style)
        if not level.bands:
            ax.axhline(level.value, label=level.label, zorder=1.9, **look)
        for b, (low, high) in enumerate(level.bands):
            ax.plot([low, high], [level.value] * 2, label=None if b else level.label, **look)
    for i, (label, bands) in enumerate(panel.strips):
        for b, (low, high) in enumerate(bands):
            ax.axvspan(low, high, 0.01 + 0.03 * i, 0.03 + 0.03 * i, color=("#000000", "#7f7f7f")[i % 2], lw=0,
                       label=None if b else label)  # fmt: skip
    if panel.log_y:
        ax.set_yscale("log")
    if panel.log_x:
        ax.set_xscale("log")
    if panel.x_limits:
        ax.set_xlim(*panel.x_limits)
    elif panel.curves:
        ax.set_xlim(min(c.x[0] for c in panel.curves), max(c.x[-1] for c in panel.curves))
    if panel.y_limits:
        ax.set_ylim(*panel.y_limits)


def _draw_surface(ax: Any, surface: Surface) -> None:
    """Draw shaded quadrilaterals in space or in a plane, light where the value is small."""
    from matplotlib.collections import PolyCollection

    faces, values, edges = surface.faces, surface.values, surface.edges
    if surface.in_space:
        order = np.argsort((faces @ _VIEW[2]).mean(axis=1))  # near faces are drawn last
        faces, values = (faces @ _VIEW[:2].T)[order], values[order]
        edges = None if edges is None else edges @ _VIEW[:2].T
    if edges is not None:
        ax.add_collection(PolyCollection(list(edges), facecolors="none", edgecolors="#c8c8c8", linewidths=0.3,
                                         rasterized=True))  # fmt: skip
    patches = PolyCollection(list(faces), cmap="YlGnBu", edgecolors="#404040", linewidths=0.12, rasterized=True)
    patches.set_array(values)
    patches.set_clim(0.0, max(float(values.max(initial=0)), np.finfo(float).tiny))
    ax.add_collection(patches)
    ax.autoscale_view()
    ax.set_aspect("equal")
    if surface.in_space:
        ax.set_axis_off()
    if surface.label:
        bar = ax.figure.colorbar(patches, ax=ax, shrink=0.8, pad=0.02)
        format_axis(bar.ax.yaxis, surface.label)


def _draw_axes_of_space(axes: list[Any]) -> None:
    """Set one scale for drawings in space, and draw arrows along the axes in a free corner."""
    for ax in axes:
        ax.set_xlim(min(one.get_xlim()[0] for one in axes), max(one.get_xlim()[1] for one in axes))
        ax.set_ylim(min(one.get_ylim()[0] for one in axes), max(one.get_ylim()[1] for one in axes))
        length = _ARROW * np.ptp(ax.get_ylim())
        origin = np.array([ax.get_xlim()[0] + 0.8 * length, ax.get_ylim()[1] - 1.2 * length])
        for letter, direction in zip("xyz", _VIEW[:2].T, strict=True):
            ax.annotate("", origin + length * direction, origin, annotation_clip=False,
                        arrowprops={"arrowstyle": "-|>", "lw": 0.8, "color": "#303030", "shrinkA": 0, "shrinkB": 0,
                                    "mutation_scale": 6})  # fmt: skip
            place = origin + _LETTER * length * direction
            ax.text(*place, letter, ha="center", va="center", style="italic", fontsize=7.5, color="#303030")


def _draw_intervals(ax: Any, panel: Panel) -> None:
    places = np.arange(len(panel.intervals))[::-1]
    middle = np.array([i.median for i in panel.intervals])
    spread = np.array([[i.median - i.low for i in panel.intervals], [i.high - i.median for i in panel.intervals]])
    colour = STYLES["ismm"].colour
    label = ", ".join(panel.interval_names).replace(" to ", "-")
    ax.errorbar(middle, places, xerr=spread, fmt="o", color=colour, ms=4, capsize=3, lw=1.3, label=label)
    known = [(i.published, place) for i, place in zip(panel.intervals, places, strict=True) if i.published is not None]
    if known:
        ax.plot(*zip(*known, strict=True), "D", color="#e07b00", mec="black", mew=0.6, ms=5, label="thesis")
    for level in panel.levels:
        ax.axvline(level.value, label=level.label, zorder=1, **_look(level.style))
    ax.set_yticks(places, [i.label for i in panel.intervals])
    ax.set_ylim(-0.7, len(places) - 0.3)
    ax.set_ylabel(panel.y_label)
    if panel.x_limits:
        left, right = panel.x_limits
        ax.set_xlim(left, right)
        # An arrowhead marks an interval that reaches beyond the axis.
        for interval, place in zip(panel.intervals, places, strict=True):
            for edge, marker, reaches in ((left, "<", interval.low < left), (right, ">", interval.high > right)):
                if reaches:
                    ax.plot([edge], [place], marker, color=colour, ms=6, clip_on=False, zorder=5)


#: What `shortened` looks for: places, and numbers in them.
_PLACES = re.compile(r' (?:d|x|y|transform)="[^"]*"')
_DECIMALS = re.compile(r"(?<!\d)\d++\.\d{3,}")


def shortened(svg: str) -> str:
    r"""Return a drawing of matplotlib without comments, with places in hundredths of a typographic point.

    Examples
    --------
    >>> from jointfrf.workbench.report.draw import shortened
    >>> shortened('<g id="a"> <path d="M 1.2345 2 \nL 2.5 2.25 \n" style="fill: none"/> </g>')
    '<g id="a"><path d="M 1.23 2 L 2.5 2.25 " style="fill: none"/></g>'
    """
    svg = svg[max(svg.find("<svg"), 0) :]
    svg = re.sub(r"<metadata>(?:(?!</?metadata>).)*</metadata>|<!--(?:(?!-->|<!--).)*-->", "", svg, flags=re.DOTALL)
    svg = re.sub(r"\s+", " ", svg).replace("> <", "><")
    return _PLACES.sub(lambda place: _DECIMALS.sub(lambda number: f"{float(number[0]):.2f}", place[0]), svg)
