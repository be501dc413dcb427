"""The figures of a bolted lap joint, as data."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from jointfrf.cases.bolted_lap.compute import LINES, BoltedLapResult, RegeneratedTip
from jointfrf.cases.bolted_lap.frfs import TIP_DIRECTIONS
from jointfrf.dofs import Parameter
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.report.axes import FREQUENCY, bulk_limits, parameter_label, parameter_lines, percentiles
from jointfrf.report.figure import Curve, Figure, Interval, Level, Panel, Surface
from jointfrf.report.receptance import ReceptanceCurve, receptance_panels

__all__ = ["bolted_lap_figures"]

#: Routes and estimators whose FRFs are drawn, and their styles.
_DRAWN = (
    (("Measurements 1-4", "band mean"), "ismm"),
    (("virtual points", "compliance fit"), "compliance"),
    (("reference points", LINES), "low"),
)
#: Styles of the lines of each route.
_LINE_STYLES = {
    "Measurements 1-4": "ismm",
    "central differences": "decoupling-rs",
    "virtual points": "decoupling-sr",
    "multi-point": "decoupling-rr",
    "reference points": "low",
}
#: Figures of contact pressure, and the interfaces on them.
_PRESSED = {"a": ("head", "lap"), "b": ("lap", "nut"), "bolt": ("head", "nut")}
#: Interfaces in words.
_FACES = {"head": "under the head", "lap": "between the beams", "nut": "under the nut"}


def bolted_lap_figures(result: BoltedLapResult) -> list[Figure]:
    """Build all figures."""
    makers: tuple[Callable[[BoltedLapResult], Iterator[Figure]], ...] = (
        _pressure, _regenerated, _lines, _unmeasured, _noise,
    )  # fmt: skip
    return [figure for make in makers for figure in make(result)]


def _pressure(result: BoltedLapResult) -> Iterator[Figure]:
    maps = result.state.pressure_maps()
    for body, names in _PRESSED.items():
        panels = []
        for name in names:
            one = maps[name]
            corners = 1e3 * one.points[one.quads]
            surface = Surface(corners, 1e-6 * one.pressure[one.quads].mean(axis=1), "pressure, MPa")
            panels.append(Panel(_FACES[name], "z, mm", "x, mm", surface=surface))
        title = {"a": "beam A", "b": "beam B", "bolt": "the bolt"}[body]
        yield Figure(f"pressure-{body}", f"Contact pressure on {title}, seen along y", tuple(panels), 2)


def _regenerated(result: BoltedLapResult) -> Iterator[Figure]:
    other = f"with a beam B of {result.case.beams.lengths[2]:g} m"
    for key, what in (("regenerated", "regenerated"), ("transferred", other)):
        for d, direction in reversed(list(enumerate(TIP_DIRECTIONS))):
            curves = _tip_curves(result, d, transferred=key == "transferred")
            panels = receptance_panels("", f"$|H_{{ss}}|$ in {direction}, m/N", curves)
            caption = f"Receptance of the tip in {direction}, {what}, from the identified joint"
            yield Figure(f"{key}-{direction}", caption, panels)


def _tip_curves(result: BoltedLapResult, d: int, *, transferred: bool) -> tuple[ReceptanceCurve, ...]:
    """Draw the FRF of the tip in a direction, of the solid model and as regenerated."""

    def regenerated(one: RegeneratedTip) -> ComplexArray:
        return one.transferred if transferred else one.h

    freq, actual = result.case.freq_hz, result.transferred if transferred else result.actual
    curves = [ReceptanceCurve("solid model", freq, actual[:, d], "actual")]
    for named, style in _DRAWN:
        one = next(r for r in result.regenerated if r.found[:2] == named)
        curves.append(ReceptanceCurve(", ".join(named), freq, regenerated(one)[:, d], style))
    return tuple(curves)


def _values(result: BoltedLapResult, k_lines: ComplexArray, parameter: Parameter) -> FloatArray:
    """Re K* or Im K*/w of a parameter, shape (n_freq,)."""
    at = result.case.joint.dofs.index(parameter.row)
    return parameter_lines(k_lines[:, at, at], result.case.freq_hz, parameter)


def _by_kind(result: BoltedLapResult) -> Iterator[tuple[str, str, list[tuple[Parameter, float]]]]:
    """Letter, name, and parameters with their known values: stiffness, then damping."""
    known = list(zip(result.case.parameters, result.case.actual.tolist(), strict=True))
    for kind, what in (("k", "stiffness"), ("c", "damping")):
        yield kind, what, [(parameter, value) for parameter, value in known if parameter.kind == kind]


def _lines(result: BoltedLapResult) -> Iterator[Figure]:
    freq = result.case.freq_hz
    # Over all lines: a constant.
    fit = next(one.found for one in result.regenerated if one.found[:2] == ("virtual points", "compliance fit"))
    fitted = dict(zip(result.case.parameters, fit.theta.tolist(), strict=True))
    for kind, what, parameters in _by_kind(result):
        panels = []
        for parameter, _ in parameters:
            lines = {route: _values(result, k, parameter) for route, k in result.k_lines.items()}
            curves = tuple(Curve(route, freq, values, _LINE_STYLES[route]) for route, values in lines.items())
            shades = (("band", tuple(result.case.bands_of(parameter.row))),)
            levels = (Level("compliance fit, virtual points", fitted[parameter], "compliance"),)
            limits = bulk_limits(list(lines.values()), [fitted[parameter]])
            panels.append(
                Panel("", FREQUENCY, parameter_label(parameter), curves, (), levels, shades=shades, y_limits=limits)
            )
        caption = f"Joint {what} line by line, by different routes to the FRFs of the joint DOFs, without noise"
        yield Figure(f"lines-{kind}", caption, tuple(panels), 2)


def _unmeasured(result: BoltedLapResult) -> Iterator[Figure]:
    freq = result.case.freq_hz
    for key, one in zip(("unmeasured-x", "unmeasured-z", "unmeasured-all"), result.unmeasured[1:], strict=True):
        fits = dict(zip(result.case.parameters, one.fitted.tolist(), strict=True))
        for kind, what, parameters in _by_kind(result):
            panels = []
            for parameter, actual in parameters:
                values, fitted = _values(result, one.k_lines, parameter), fits[parameter]
                curve = Curve("line by line", freq, values, "ismm")
                levels = (Level("actual", actual, "actual"), Level("compliance fit", fitted, "compliance"))
                limits = bulk_limits([values], [actual])
                title, label = f"compliance fit: {fitted / actual:.3g} of the actual", parameter_label(parameter)
                panels.append(Panel(title, FREQUENCY, label, (curve,), levels=levels, y_limits=limits))
            caption = f"Effect of unmeasured FRFs on {what}, exact data: {one.name}"
            yield Figure(f"{key}-{kind}", caption, tuple(panels), 2)


def _noise(result: BoltedLapResult) -> Iterator[Figure]:
    panels = []
    for p, peak in enumerate(result.peaks):
        intervals = []
        for study in result.noisy:
            intervals.append(Interval(f"{study.route},\n{study.estimator}", *percentiles(study.shift[:, p])))
        title = f"{peak.direction}, {peak.freq_hz:.3g} Hz"
        panels.append(Panel(title, "frequency error (4.12), %", "", intervals=tuple(intervals)))
    # One range for all: a resonance that is off by a tenth is to look different from one that is off by a thousandth.
    every = [interval.high for panel in panels for interval in panel.intervals]
    panels = [replace(panel, x_limits=(0.0, 1.05 * max(every))) for panel in panels]
    if panels and result.noisy:
        caption = (
            "Errors of the regenerated resonances with noise: median and percentiles; 15 % is the limit of the search"
        )
        yield Figure("noise", caption, tuple(panels), 2)
