"""The figures of a bolted lap joint, as data."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from jointfrf.cases.bolted_lap.compute import DIRECTIONS, LINES, BoltedResult
from jointfrf.cases.bolted_lap.tables import parameters
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.report.plots import Curve, Figure, Interval, Level, Panel, Surface, symbol

__all__ = ["bolted_figures"]

_FREQUENCY = "frequency, Hz"
#: Routes and estimators whose FRFs are drawn, and their styles.
_DRAWN = (
    (("Measurements 1-4", "band mean"), "ismm"),
    (("virtual points", "compliance fit"), "compliance"),
    (("reference points", LINES), "low"),
)
_LINE_STYLES = {
    "Measurements 1-4": "ismm",
    "central differences": "decoupling-rs",
    "virtual points": "compliance",
    "multi-point": "decoupling-rr",
    "reference points": "low",
}
_PATTERN_STYLES = ("actual", "low", "high", "decoupling-rr")
#: Figures of contact pressure, and the interfaces on them.
_PRESSED = {"a": ("head", "lap"), "b": ("lap", "nut"), "bolt": ("head", "nut")}
_FACES = {"head": "under the head", "lap": "between the beams", "nut": "under the nut"}


def bolted_figures(result: BoltedResult) -> list[Figure]:
    """Build all figures."""
    makers: tuple[Callable[[BoltedResult], Iterator[Figure]], ...] = (
        _pressure, _regenerated, _lines, _unmeasured, _noise,
    )  # fmt: skip
    return [figure for make in makers for figure in make(result)]


def _figure(result: BoltedResult, key: str, caption: str, panels: list[Panel], columns: int = 1) -> Figure:
    return Figure(key, caption, result.case.figures.get(key, ""), tuple(panels), columns)


def _pressure(result: BoltedResult) -> Iterator[Figure]:
    maps = result.state.pressure_maps()
    for body, names in _PRESSED.items():
        panels = []
        for name in names:
            one = maps[name]
            corners = 1e3 * one.points[one.quads]
            surface = Surface(corners, 1e-6 * one.pressure[one.quads].mean(axis=1), "pressure, MPa")
            panels.append(Panel(_FACES[name], "z, mm", "x, mm", surface=surface))
        title = {"a": "beam A", "b": "beam B", "bolt": "the bolt"}[body]
        yield _figure(result, f"pressure-{body}", f"Contact pressure on {title}, seen along y", panels, 2)


def _regenerated(result: BoltedResult) -> Iterator[Figure]:
    freq = result.case.freq_hz
    for key, actual, what in (
        ("regenerated", result.actual, "regenerated"),
        ("transferred", result.transferred, f"with a beam B of {result.case.lengths[2]:g} m"),
    ):
        for d, direction in reversed(list(enumerate(DIRECTIONS))):
            curves = [Curve("solid model", freq, np.abs(actual[:, d]), "actual")]
            for (route, estimator), style in _DRAWN:
                one = next(r for r in result.regenerated if (r.found.route, r.found.estimator) == (route, estimator))
                h = one.h if key == "regenerated" else one.transferred
                curves.append(Curve(f"{route}, {estimator}", freq, np.abs(h[:, d]), style))
            label = f"$|H_{{ss}}|$ in {direction}, m/N"
            panel = Panel("", _FREQUENCY, label, tuple(curves), log_y=True)
            caption = f"Receptance of the tip in {direction}, {what}, from the identified joint"
            yield _figure(result, f"{key}-{direction}", caption, [panel])


def _values(k_lines: ComplexArray, p: int, freq: FloatArray) -> FloatArray:
    """Re K* or Im K*/w of a parameter."""
    k = k_lines[:, p % 6, p % 6]
    return k.real if p < 6 else k.imag / (2 * np.pi * freq)


def _limits(values: list[FloatArray]) -> tuple[float, float]:
    """Limits of an axis that show the bulk of the values."""
    every = np.concatenate(values)
    low, high = np.percentile(every[np.isfinite(every)], [6, 94])
    # Round-off is not to fill a panel.
    room = max(0.15 * (high - low), 0.05 * max(abs(low), abs(high)))
    return float(low - room), float(high + room)


def _lines(result: BoltedResult) -> Iterator[Figure]:
    freq = result.case.freq_hz
    for letter, first in (("k", 0), ("c", 6)):
        panels = []
        for p, (name, unit) in list(enumerate(parameters(result)))[first : first + 6]:
            lines = {route: _values(k, p, freq) for route, k in result.k_lines.items()}
            curves = tuple(Curve(route, freq, values, _LINE_STYLES[route]) for route, values in lines.items())
            bands = tuple(result.case.bands_of(name[2:]))
            label = f"{symbol(name)}, {unit}"
            panels.append(
                Panel("", _FREQUENCY, label, curves, shades=(("band", bands),), y_limits=_limits(list(lines.values())))
            )
        what = "stiffness" if letter == "k" else "damping"
        caption = f"Joint {what} line by line, by different routes to the FRFs of the joint DOFs, without noise"
        yield _figure(result, f"lines-{letter}", caption, panels, 2)


def _unmeasured(result: BoltedResult) -> Iterator[Figure]:
    freq, joint = result.case.freq_hz, result.case.joint
    actual = np.concatenate([np.diagonal(joint.stiffness), np.diagonal(joint.damping)])
    for key, pattern in (("unmeasured-x", 1), ("unmeasured-z", 2), ("unmeasured-all", 3)):
        one = result.unmeasured[pattern]
        for letter, first in (("k", 0), ("c", 6)):
            panels = []
            for p, (name, unit) in list(enumerate(parameters(result)))[first : first + 6]:
                values = _values(one.k_lines, p, freq)
                curve = Curve("found", freq, values, "high")
                level = Level("actual", float(actual[p]), "actual")
                limits = _limits([values, np.full(freq.size, actual[p])])
                panels.append(
                    Panel("", _FREQUENCY, f"{symbol(name)}, {unit}", (curve,), levels=(level,), y_limits=limits)
                )
            what = "stiffness" if letter == "k" else "damping"
            caption = f"Effect of unmeasured FRFs on {what}, exact data: {one.name}"
            yield _figure(result, f"{key}-{letter}", caption, panels, 2)


def _noise(result: BoltedResult) -> Iterator[Figure]:
    panels = []
    for p, peak in enumerate(result.peaks):
        intervals = []
        for study in result.noisy:
            low, middle, high = np.percentile(study.shift[:, p], [2.5, 50, 97.5])
            label = f"{study.route},\n{study.estimator}"
            intervals.append(Interval(label, float(low), float(middle), float(high)))
        title = f"{peak.direction}, {peak.freq_hz:g} Hz"
        panels.append(Panel(title, "frequency error (4.12), %", "", intervals=tuple(intervals)))
    if panels and result.noisy:
        caption = "Errors of the regenerated resonances with noise: median and percentiles"
        yield _figure(result, "noise", caption, panels, 2)
