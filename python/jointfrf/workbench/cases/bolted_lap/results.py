"""Tables, numbers and figures of a bolted lap."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.cases.bolted_lap.compute import LINES, BoltedLapResult, RegeneratedTip
from jointfrf.workbench.cases.bolted_lap.frfs import TIP_DIRECTIONS
from jointfrf.workbench.cases.comparison import agreement, compared_frequencies
from jointfrf.workbench.report.axes import FREQUENCY, bulk_limits, parameter_label, parameter_lines, percentiles
from jointfrf.workbench.report.figure import Curve, Figure, Interval, Level, Panel, Surface
from jointfrf.workbench.report.receptance import ReceptanceCurve, receptance_panels
from jointfrf.workbench.report.table import Cell, Table, number

__all__ = ["above_limit", "build_figures", "build_numbers", "build_summary", "build_tables"]


def build_tables(result: BoltedLapResult) -> list[Table]:
    """Return all tables."""
    transfer = f"Transfer to a beam B of {result.case.beams.lengths[2]:g} m"
    return [
        _contact(result),
        _convergence(result),
        _frequencies(result),
        _identified(result),
        _resonances(result, "resonances", "Resonances of the tip, regenerated with the identified joint"),
        _resonances(result, "transfer", transfer, transferred=True),
        _noise(result),
        _noise_resonances(result),
        _unmeasured(result),
    ]


def _contact(result: BoltedLapResult) -> Table:
    state = result.state
    cells: list[tuple[Cell, ...]] = []
    for name, one in state.interfaces.items():
        slip = one.slip_ratio[one.closed]
        cells.append(
            (
                name, float(one.normal_force), state.force, float(one.pressure.max()) / 1e6,
                f"{np.count_nonzero(one.closed)} of {one.closed.size}", str(np.count_nonzero(one.slipping)),
                float(slip.max(initial=0)),
            )
        )  # fmt: skip
    columns = ("interface", "force, N", "preload, N", "largest pressure, MPa", "closed", "slipping", "slip ratio")
    note = (
        f"Elongation of the bolt {1e6 * state.elongation:.1f} µm; the lap is closed up to "
        f"{1e3 * state.contact_radius:.1f} mm from the axis. "
        "The slip ratio is tangential force over friction times normal force, at most 1."
    )
    return Table("contact", "Preloaded contact", columns, tuple(cells), (), note)


def _convergence(result: BoltedLapResult) -> Table:
    cells = tuple(
        (str(i + 1), str(one.closed), str(one.slipping), str(one.changed), float(one.residual))
        for i, one in enumerate(result.state.history)
    )
    columns = ("iteration", "pairs closed", "slipping", "changed", "residual")
    note = "The iteration ends where no pair opens, closes, sticks or slips any more."
    return Table("convergence", "Convergence of the contact", columns, cells, (), note)


def _frequencies(result: BoltedLapResult) -> Table:
    expected, found = result.case.expected, result.natural_frequencies.tolist()
    names = [(str(i + 1),) for i in range(len(found))]
    title = "Natural frequencies of the preloaded assembly"
    return compared_frequencies(title, ("mode",), [(names, found, expected)], expected.source if expected else "")


def _identified(result: BoltedLapResult) -> Table:
    shown = [one.found for one in result.regenerated if np.isfinite(one.found.theta).all()]
    cells: list[tuple[Cell, ...]] = []
    for p, parameter in enumerate(result.case.parameters):
        cells.append((parameter, parameter.unit, *(float(found.theta[p]) for found in shown)))
    columns = ("parameter", "unit", *(f"{found.route}, {found.estimator}" for found in shown))
    note = (
        "Without noise. Band means are those of -(gamma^-1)_jk, which ISMM reduces to, over the bands of table 4-2; "
        "the multi-point connection is condensed to six DOFs. There are no true values: the reference points take the "
        "mean rigid motion of the faces under head and nut, with all their entries."
    )
    return Table("identified", "Identified joint parameters", columns, tuple(cells), (), note)


def _resonances(result: BoltedLapResult, key: str, title: str, *, transferred: bool = False) -> Table:
    peaks = result.transferred_peaks if transferred else result.peaks
    cells: list[tuple[Cell, ...]] = []
    for one in result.regenerated:
        errors = one.transferred_errors if transferred else one.errors
        row: list[Cell] = []
        for amplitude, frequency, found in zip(*errors, strict=True):
            row += [float(frequency), float(amplitude)] if found else [above_limit(frequency), None]
        cells.append((*one.found[:2], *row))
    columns = ["joint DOFs by", "estimator"]
    for peak in peaks:
        columns += [f"{peak.direction} {peak.freq_hz:.3g} Hz: {error}, %" for error in ("frequency", "amplitude")]
    note = (
        "Errors (4.12) and (4.11), on lines as close as the loss factor asks for. A resonance is sought "
        "within 15 % of the actual one, and not beyond the valleys beside it: 'above' means that there is no peak "
        "up to that limit of the search. "
        f"'reference points, {LINES}' couples the beams by the full 6 x 6 K*(w). What remains there comes "
        "neither from noise nor from rotations: a joint between two points has no mass, and the beams also press on "
        "each other, which it leaves out."
    )
    return Table(key, title, tuple(columns), tuple(cells), (), note, percentages=tuple(columns))


def _noise(result: BoltedLapResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    free = {one.found[:2]: one.found.theta for one in result.regenerated}
    for study in result.noisy:
        reference = free[study.route, study.estimator]
        for p, parameter in enumerate(result.case.parameters):
            low, median, high = percentiles(study.theta[:, p])
            named = (study.noise, study.route, study.estimator, parameter, parameter.unit)
            cells.append((*named, float(reference[p]), median, low, high))
    columns = ("noise", "joint DOFs by", "estimator", "parameter", "unit", "without noise", "median", "2.5 %", "97.5 %")
    title = f"Identified joint parameters with noise, {result.n_realisations} realisations"
    return Table("noise", title, columns, tuple(cells))


def above_limit(frequency_error: float) -> str:
    """Return the text of an error (4.12) that is the limit of the search."""
    return f"above {number(float(frequency_error), 2)}"


def _noise_resonances(result: BoltedLapResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    for study in result.noisy:
        medians = np.median(study.shift, axis=0)
        most_found = study.found.mean(axis=0) > 0.5
        row = [float(x) if found else above_limit(x) for x, found in zip(medians, most_found, strict=True)]
        lost = np.count_nonzero(~study.found)
        cells.append((study.noise, study.route, study.estimator, *row, f"{lost} of {study.found.size}"))
    of_peaks = (f"{peak.direction} {peak.freq_hz:.3g} Hz: frequency, %" for peak in result.peaks)
    columns = ("noise", "joint DOFs by", "estimator", *of_peaks, "not found")
    note = "Median errors (4.12). 'above': most realisations have no peak up to the limit of the search."
    title = f"Resonances of the tip with noise, {result.n_realisations} realisations"
    return Table("noise-resonances", title, columns, tuple(cells), (), note)


def _unmeasured(result: BoltedLapResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    for p, (parameter, actual) in enumerate(zip(result.case.parameters, result.case.actual, strict=True)):
        ratios = (float(one.theta[p] / actual) for one in result.unmeasured)
        cells.append((parameter, parameter.unit, float(actual), *ratios))
    columns = ("parameter", "unit", "actual", *(f"{one.name}: found / actual" for one in result.unmeasured))
    shifts = "; ".join(f"{one.name} {' / '.join(number(float(x), 2) for x in one.shift)}" for one in result.unmeasured)
    note = (
        "Exact FRFs of the beams with the joint of table 4-1; the entries named are set to zero. Largest error of a "
        f"resonance of the tip in x / y with the joint that is found, percent: {shifts}."
    )
    return Table("unmeasured", "Effect of entries that cannot be measured (4.3.3.1)", columns, tuple(cells), (), note)


def build_numbers(result: BoltedLapResult) -> dict[str, Any]:
    """Return the numbers of a case for JSON, without its tables."""
    return {
        "n_dofs": result.n_dofs,
        "preload_newton": result.state.force,
        "elongation_m": result.state.elongation,
        "natural_frequencies_hz": result.natural_frequencies.tolist(),
    }


def build_summary(result: BoltedLapResult, tables: list[Table]) -> list[Table]:
    """Return short tables with the number of rows that fit, the preload, and the largest errors of the resonances."""
    fits = agreement(tables)
    return [*([fits] if fits.rows else []), _preload(result), _worst_errors(result)]


def _preload(result: BoltedLapResult) -> Table:
    state = result.state
    slipping = sum(int(np.count_nonzero(one.slipping)) for one in state.interfaces.values())
    cells: tuple[tuple[Cell, ...], ...] = (
        ("preload", number(state.force), "N"),
        ("elongation of the bolt", f"{1e6 * state.elongation:.1f}", "µm"),
        ("iterations of the contact", str(len(state.history)), ""),
        ("slipping pairs", str(slipping), ""),
        ("lap closed up to this distance from the axis", f"{1e3 * state.contact_radius:.1f}", "mm"),
    )
    return Table("preload", "Preload", ("quantity", "value", "unit"), cells)


def _worst_errors(result: BoltedLapResult) -> Table:
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (*named, *(_worst(result, named, d, transferred) for transferred in (False, True) for d in "yx"))
        for named in dict.fromkeys(one.found[:2] for one in result.regenerated)
    )
    beams = (f"{beams}: {direction}, %" for beams in ("same beams", "other beam B") for direction in "yx")
    columns = ("joint DOFs by", "estimator", *beams)
    title = "Largest error (4.12) of a resonance of the tip"
    return Table("worst", title, columns, cells, percentages=columns)


def _worst(result: BoltedLapResult, named: tuple[str, str], direction: str, transferred: bool) -> str:
    """Return the text of the largest error (4.12) of a resonance in a direction, percent."""
    peaks = result.transferred_peaks if transferred else result.peaks
    one = next(r for r in result.regenerated if r.found[:2] == named)
    errors = one.transferred_errors if transferred else one.errors
    own = [i for i, peak in enumerate(peaks) if peak.direction == direction]
    worst = max((float(errors.frequency[i]) for i in own), default=0.0)
    return number(worst, 2) if errors.found[own].all() else above_limit(worst)


#: Routes and estimators in figures of FRFs, and their styles.
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


def build_figures(result: BoltedLapResult) -> list[Figure]:
    """Return all figures."""
    makers: tuple[Callable[[BoltedLapResult], Iterator[Figure]], ...] = (
        _pressure, _regenerated, _lines, _unmeasured_frfs, _noise_frfs,
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
            shades = (("band", tuple(result.case.bands.bands[parameter])),)
            levels = (Level("compliance fit, virtual points", fitted[parameter], "compliance"),)
            limits = bulk_limits(list(lines.values()), [fitted[parameter]])
            panels.append(
                Panel("", FREQUENCY, parameter_label(parameter), curves, (), levels, shades=shades, y_limits=limits)
            )
        caption = f"Joint {what} line by line, by different routes to the FRFs of the joint DOFs, without noise"
        yield Figure(f"lines-{kind}", caption, tuple(panels), 2)


def _unmeasured_frfs(result: BoltedLapResult) -> Iterator[Figure]:
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


def _noise_frfs(result: BoltedLapResult) -> Iterator[Figure]:
    panels = []
    for p, peak in enumerate(result.peaks):
        intervals = []
        for study in result.noisy:
            intervals.append(Interval(f"{study.route},\n{study.estimator}", *percentiles(study.shift[:, p])))
        title = f"{peak.direction}, {peak.freq_hz:.3g} Hz"
        panels.append(Panel(title, "frequency error (4.12), %", "", intervals=tuple(intervals)))
    # All panels have the same range, so that errors of 10 % and of 0.1 % look different.
    every = [interval.high for panel in panels for interval in panel.intervals]
    panels = [replace(panel, x_limits=(0.0, 1.05 * max(every))) for panel in panels]
    if panels and result.noisy:
        caption = (
            "Errors of the regenerated resonances with noise: median and percentiles; 15 % is the limit of the search"
        )
        yield Figure("noise", caption, tuple(panels), 2)
