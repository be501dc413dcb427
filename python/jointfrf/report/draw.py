"""Figures drawn by matplotlib, without global state."""

from __future__ import annotations

import io
from typing import Any, NamedTuple

import numpy as np

from jointfrf.report.figure import Figure, Panel, Surface

__all__ = ["STYLES", "Style", "draw"]


class Style(NamedTuple):
    """How a curve is drawn; dashes as matplotlib takes them."""

    colour: str
    dashes: Any
    width: float
    marker: str = ""


#: Told apart by lightness and dashes when printed grey.
STYLES = {
    "actual": Style("#000000", "-", 1.5),
    "initial": Style("#8c8c8c", "--", 1.2),
    "measured": Style("#e07b00", "-", 0.7),
    "ismm": Style("#1b4f9c", "-", 1.1),
    "ismm-kj": Style("#1b4f9c", (0, (5, 1)), 1.1),
    "inverse-substructuring": Style("#1b4f9c", "--", 1.1),
    "compliance": Style("#e07b00", "-.", 1.5),
    "decoupling-rr": Style("#c0392b", "--", 1.1),
    "decoupling-rs": Style("#5aa469", ":", 1.5),
    "decoupling-sr": Style("#9b72b0", (0, (3, 1, 1, 1)), 1.1),
    "decoupling-ss": Style("#d96a9a", (0, (6, 2)), 1.3),
    "low": Style("#2f7fbf", ":", 1.4),
    "high": Style("#e07b00", "--", 1.2),
    "faint": Style("#6b6b6b", "-", 0.4),
    "dots": Style("#8c8c8c", "", 1.0, "."),
}
_SHADES = ("#ececec", "#d2d2d2", "#bdbdbd")
_RESOLUTION, _MARKER = 130, 2.5
_HEADING = 10
#: Size of a figure, inches: fits the text width of A4.
_WIDTH, _PANEL_HEIGHT, _SPACE_HEIGHT = 7.0, 2.75, 1.5
#: Directions on the page of a drawing in space, to the right and up, and towards the reader: z lies along, y up.
_VIEW = np.array([[-0.419, 0.0, 0.908], [0.410, 0.893, 0.189], [-0.810, 0.451, -0.374]])
_FONTS = {"font.size": 8.5, "axes.titlesize": 9, "legend.fontsize": 7.5, "axes.grid": True, "grid.alpha": 0.3,
          "grid.linewidth": 0.5, "axes.axisbelow": True, "lines.solid_capstyle": "round"}  # fmt: skip


def draw(figure: Figure) -> bytes:
    """Draw a figure.

    Parameters
    ----------
    figure : Figure

    Returns
    -------
    bytes
        A PNG file.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    rows = -(-len(figure.panels) // figure.columns)
    height = max(_PANEL_HEIGHT, *(0.9 + 0.34 * len(panel.intervals) for panel in figure.panels))
    if len(figure.panels) == 1:
        height *= 1.25
    if all(_in_space(panel) for panel in figure.panels):
        height = _SPACE_HEIGHT
    # The settings hold inside this block only.
    with matplotlib.rc_context(_FONTS):  # type: ignore[arg-type]
        canvas = Canvas(figsize=(_WIDTH, rows * height + 0.4), layout="constrained")
        FigureCanvasAgg(canvas)
        axes = []
        for i, panel in enumerate(figure.panels):
            ax = canvas.add_subplot(rows, figure.columns, i + 1)
            axes.append(ax)
            if panel.surface is not None:
                _draw_surface(ax, panel.surface, panel.title, (panel.x_label, panel.y_label))
            else:
                (_draw_intervals if panel.intervals else _draw_curves)(ax, panel)
        _add_legend(canvas, axes)
        if figure.heading:
            canvas.suptitle(figure.heading, fontsize=_HEADING)
        png = io.BytesIO()
        # No version inside: the same data give the same file.
        canvas.savefig(png, format="png", dpi=_RESOLUTION, metadata={"Software": None})
    return png.getvalue()


def _in_space(panel: Panel) -> bool:
    return panel.surface is not None and panel.surface.faces.shape[2] == 3


def _add_legend(canvas: Any, axes: list[Any]) -> None:
    """One legend below all panels, each label once: it never covers data."""
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if found:
        columns = max(1, min(len(found), 5, 110 // max(len(label) + 8 for label in found)))
        canvas.legend(found.values(), found.keys(), loc="outside lower center", ncols=columns, frameon=False)


def _draw_curves(ax: Any, panel: Panel) -> None:
    for i, (label, bands) in enumerate(panel.shades):
        for b, (low, high) in enumerate(bands):
            ax.axvspan(low, high, color=_SHADES[i % len(_SHADES)], lw=0, zorder=0, label=None if b else label)
    for ribbon in panel.ribbons:
        colour = STYLES[ribbon.style].colour
        ax.fill_between(ribbon.x, ribbon.low, ribbon.high, color=colour, alpha=0.3, lw=0, label=ribbon.label)
    for curve in panel.curves:
        colour, dashes, width, marker = STYLES[curve.style]
        look = {"color": colour, "ls": dashes, "lw": width, "marker": marker, "ms": _MARKER}
        ax.plot(curve.x, curve.y, label=curve.label or None, **look)
    for level in panel.levels:
        colour, dashes, width, _ = STYLES[level.style]
        if not level.bands:
            ax.axhline(level.value, color=colour, ls=dashes, lw=width, label=level.label)
        for b, (low, high) in enumerate(level.bands):
            ax.plot([low, high], [level.value] * 2, color=colour, ls=dashes, lw=2.2, label=None if b else level.label)
    for i, (label, bands) in enumerate(panel.strips):
        for b, (low, high) in enumerate(bands):
            ax.axvspan(low, high, 0.01 + 0.03 * i, 0.03 + 0.03 * i, color=("#000000", "#7f7f7f")[i % 2], lw=0,
                       label=None if b else label)  # fmt: skip
    if panel.log_y:
        ax.set_yscale("log")
    if panel.x_limits:
        ax.set_xlim(*panel.x_limits)
    elif panel.curves:
        ax.set_xlim(min(c.x[0] for c in panel.curves), max(c.x[-1] for c in panel.curves))
    if panel.y_limits:
        ax.set_ylim(*panel.y_limits)
    ax.set(title=panel.title or None, xlabel=panel.x_label, ylabel=panel.y_label)


def _draw_surface(ax: Any, surface: Surface, title: str, labels: tuple[str, str]) -> None:
    """Draw shaded quadrilaterals in space or in a plane, light where the value is small."""
    from matplotlib.collections import PolyCollection

    faces, values, edges = surface.faces, surface.values, surface.edges
    if faces.shape[2] == 3:
        order = np.argsort((faces @ _VIEW[2]).mean(axis=1))  # what is near is drawn last
        faces, values = (faces @ _VIEW[:2].T)[order], values[order]
        edges = None if edges is None else edges @ _VIEW[:2].T
    if edges is not None:
        ax.add_collection(PolyCollection(list(edges), facecolors="none", edgecolors="#c8c8c8", linewidths=0.3))
    patches = PolyCollection(list(faces), cmap="YlGnBu", edgecolors="#404040", linewidths=0.12)
    patches.set_array(values)
    patches.set_clim(0.0, max(float(values.max(initial=0)), np.finfo(float).tiny))
    ax.add_collection(patches)
    ax.autoscale_view()
    ax.set_aspect("equal")
    ax.set_title(title)
    if surface.faces.shape[2] == 3:
        ax.set_axis_off()
    else:
        ax.set(xlabel=labels[0], ylabel=labels[1])
    if surface.label:
        ax.figure.colorbar(patches, ax=ax, label=surface.label, shrink=0.8, pad=0.02)


def _draw_intervals(ax: Any, panel: Panel) -> None:
    places = np.arange(len(panel.intervals))[::-1]
    middle = np.array([i.median for i in panel.intervals])
    spread = np.array([[i.median - i.low for i in panel.intervals], [i.high - i.median for i in panel.intervals]])
    colour = STYLES["ismm"].colour
    ax.errorbar(middle, places, xerr=spread, fmt="o", color=colour, ms=4, capsize=3, lw=1.3, label="median, 2.5-97.5 %")
    known = [(i.published, place) for i, place in zip(panel.intervals, places, strict=True) if i.published is not None]
    if known:
        ax.plot(*zip(*known, strict=True), "D", color="#e07b00", mec="black", mew=0.6, ms=5, label="thesis")
    for level in panel.levels:
        shade, dashes, width, _ = STYLES[level.style]
        ax.axvline(level.value, color=shade, ls=dashes, lw=width, label=level.label, zorder=1)
    ax.set_yticks(places, [i.label for i in panel.intervals])
    ax.set_ylim(-0.7, len(places) - 0.3)
    if panel.x_limits:
        ax.set_xlim(*panel.x_limits)
    ax.set(title=panel.title or None, xlabel=panel.x_label, ylabel=panel.y_label or None)
