"""Figures of a case of a known joint, as data."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band
from jointfrf.frf.noise_model import estimate_noise
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.cases.keys import Observed
from jointfrf.workbench.cases.known_joint.compute import KnownJointResult
from jointfrf.workbench.cases.known_joint.expected import identified_rows
from jointfrf.workbench.cases.known_joint.modes import mode_panels
from jointfrf.workbench.cases.known_joint.realisations import ALL_LINES, Identified
from jointfrf.workbench.cases.known_joint.regenerate import RegeneratedFrf, regenerate
from jointfrf.workbench.report.axes import (
    FREQUENCY,
    bands_in_words,
    bulk_limits,
    modulus_label,
    parameter_label,
    parameter_lines,
    percentile_lines,
    percentiles,
    symbol,
)
from jointfrf.workbench.report.figure import Curve, Figure, Interval, Level, NamedBands, Panel, Ribbon
from jointfrf.workbench.report.receptance import ReceptanceCurve, noise_figure, receptance_panels, side_by_side

__all__ = ["build_figures"]

#: Names of the methods in legends, with the equations of the thesis.
_METHOD_NAMES = {
    "ismm": "ISMM",
    "ismm-kj": "ISMM, D_kj",
    "inverse-substructuring": "inverse substructuring",
    "compliance": "compliance fit",
    "decoupling-rr": "decoupling (2.53)",
    "decoupling-rs": "decoupling (2.54)",
    "decoupling-sr": "decoupling (2.55)",
    "decoupling-ss": "decoupling (2.56)",
    "decoupling-fit": "fit of (2.53)-(2.56)",
}
#: Methods whose figures also show a single realisation.
_SINGLE = ("ismm", "decoupling-ss")
#: Stiffness of the additional curves in a sensitivity figure, relative to the actual stiffness.
_VARIED = ((0.5, "low"), (2.0, "high"))
#: Panels that still fit on a page.
_ONE_FIGURE = 6
#: Joint DOFs whose FRFs across the joint are drawn in addition to the driving-point FRFs.
_BOTH_SIDES = 3
#: Noise levels side by side.
_MOST_LEVELS = 3
#: A parameter whose sensitivity stays below this share of the largest one does not change an FRF visibly.
_UNMOVED = 1e-4


def build_figures(result: KnownJointResult) -> list[Figure]:
    """Return the figures of a case; figures without data are left out.

    Parameters
    ----------
    result : KnownJointResult

    Returns
    -------
    list of Figure
    """
    makers: tuple[Callable[[KnownJointResult], Iterator[Figure]], ...] = (
        _modes, _receptances, _polluted, _noise_found, _sensitivities, _identified, _noise, _methods, _regenerated,
    )  # fmt: skip
    return [figure for make in makers for figure in make(result)]


def _label(result: KnownJointResult, observed: Observed) -> str:
    """Return the label of an axis."""
    return modulus_label(observed.point * 2, result.case.joint.dofs[observed.dof])


def _place(result: KnownJointResult, observed: Observed) -> str:
    """Return the position of an observed FRF in words."""
    named = "" if observed.key == observed.point else f", {result.case.joint.dofs[observed.dof]}"
    return f"point {observed.point}{named}"


def _curve(result: KnownJointResult, label: str, h: ComplexArray, observed: Observed, style: str) -> ReceptanceCurve:
    """Return the curve of an observed FRF from the FRFs of the assembly."""
    at = result.exact.at(observed)
    return ReceptanceCurve(label, result.exact.freq_hz, h[:, at, at], style)


def _modes(result: KnownJointResult) -> Iterator[Figure]:
    if not result.modes:
        return
    caption, panels = mode_panels(result.case, result.modes["actual"])
    if panels:
        yield Figure("modes", caption, tuple(panels), 2)


def _receptances(result: KnownJointResult) -> Iterator[Figure]:
    exact = result.exact
    for one in result.case.observed:
        curves = (
            _curve(result, "first estimate", exact.h_initial, one, "initial"),
            _curve(result, "actual joint", exact.h_c, one, "actual"),
        )
        place = _place(result, one)
        caption = f"Receptance of the assembly at {place}, with the first estimate and with the actual joint"
        yield Figure(f"receptance-{one.key}", caption, receptance_panels("", _label(result, one), curves))


def _polluted(result: KnownJointResult) -> Iterator[Figure]:
    exact = result.exact
    gamma = exact.interface(exact.h_c)
    extent = exact.freq_hz[-1] - exact.freq_hz[0]
    # Noise is invisible on the whole range, so one tenth of the range is also drawn enlarged.
    close = (exact.freq_hz[0] + 0.45 * extent, exact.freq_hz[0] + 0.55 * extent)
    inside = (exact.freq_hz >= close[0]) & (exact.freq_hz <= close[1])
    label = modulus_label("jj", exact.dofs[0])
    pairs = []
    for noise in result.case.noises[:_MOST_LEVELS]:
        h = noise.pollute(gamma, result.case.seed)
        for lines in (np.ones(inside.size, bool), inside):
            freq = exact.freq_hz[lines]
            curves = (
                ReceptanceCurve("exact", freq, gamma[lines, 0, 0], "actual"),
                ReceptanceCurve("polluted", freq, h[lines, 0, 0], "measured"),
            )
            pairs.append(receptance_panels(f"noise: {noise.name}", label, curves))
    caption = "Receptance of the assembly at the joint, exact and polluted (one realisation); right: close up"
    yield Figure("polluted", caption, side_by_side(pairs, 2), 2)


def _noise_found(result: KnownJointResult) -> Iterator[Figure]:
    """Yield the noise estimated from polluted FRFs of the first noise level, with one response for each joint DOF."""
    exact, n = result.exact, len(result.case.joint.dofs)
    if not result.case.noises:
        return
    h = result.case.noises[0].pollute(exact.interface(exact.h_c), result.case.seed)
    names = [f"{side}:{dof}" for side in "jk" for dof in result.case.joint.dofs]
    entries = [(d, other) for d in range(n) for other in ((d, n + d) if n <= _BOTH_SIDES else (d,))]
    figure = noise_figure(exact.freq_hz, h, estimate_noise(exact.freq_hz, h), names, names, entries=entries)
    caption = f"{figure.caption}; from one realisation of {result.case.noises[0].name} alone"
    yield replace(figure, key="noise-found", caption=caption, heading="")


def _sensitivities(result: KnownJointResult) -> Iterator[Figure]:
    for one in result.case.observed:
        reach = abs(result.sensitive["actual"].sensitivities[one.key].change).max(axis=1)
        for d, dof in enumerate(result.case.joint.dofs):
            if reach[d] < _UNMOVED * reach.max():
                continue
            stiffness, damping = Parameter.of_dof("k", dof), Parameter.of_dof("c", dof)
            panels = (*_varied_panels(result, one, d), _sensitivity_panel(result, one, stiffness, damping))
            caption = f"Sensitivity of the receptance at {_place(result, one)}, to {stiffness} and {damping}"
            yield Figure(f"sensitivity-{one.key}-{dof}", caption, panels)


def _varied_panels(result: KnownJointResult, one: Observed, d: int) -> tuple[Panel, Panel]:
    """Return panels of an FRF with the actual stiffness of a DOF, with less and with more."""
    exact, parameter = result.exact, result.case.parameters[d]
    name = symbol(parameter)
    curves = [_curve(result, f"actual {name}", exact.h_c, one, "actual")]
    for factor, style in _VARIED:
        varied = result.case.actual.copy()
        varied[d] *= factor
        h = regenerate(exact, varied[None], one.point, one.dof)[0]
        curves.append(ReceptanceCurve(f"{factor:g} {name}", exact.freq_hz, h, style))
    modulus, phase = receptance_panels("", _label(result, one), curves, shades=_shades(result, parameter))
    return modulus, replace(phase, x_label="")


def _sensitivity_panel(result: KnownJointResult, one: Observed, stiffness: Parameter, damping: Parameter) -> Panel:
    """Return the panel of the sensitivity of an FRF to stiffness and damping of a DOF, with the proposed bands."""
    sensitive = result.sensitive
    actual, initial = (sensitive[joint].sensitivities[one.key].in_db for joint in ("actual", "initial"))
    drawn = ((stiffness, actual, "", "stiffness"), (stiffness, initial, ", first estimate", "stiffness-initial"),
             (damping, actual, "", "damping"))  # fmt: skip
    curves = tuple(
        Curve(
            f"sensitivity to {symbol(parameter)}{of}",
            result.exact.freq_hz,
            in_db[result.case.parameters.index(parameter)],
            style,
        )
        for parameter, in_db, of, style in drawn
    )
    label = f"change of $H_{{{one.point * 2}}}$ per 1 %, dB"
    key = (one.key, stiffness)
    strips = ((f"proposed for {symbol(stiffness)}", tuple(sensitive["actual"].proposals[key])),
              ("proposed from the first estimate", tuple(sensitive["initial"].proposals[key])))  # fmt: skip
    return Panel("", FREQUENCY, label, curves, shades=_shades(result, stiffness), strips=strips)


def _shades(result: KnownJointResult, parameter: Parameter) -> NamedBands:
    """Return the bands of a parameter without duplicates, the widest first."""
    different = dict.fromkeys(tuple(band_set.bands[parameter]) for band_set in result.case.band_sets)
    widest = sorted(different, key=lambda bands: -sum(high - low for low, high in bands))
    return tuple((f"band {bands_in_words(bands)} Hz", bands) for bands in widest)


def _lines(result: KnownJointResult, found: Identified, p: int) -> FloatArray:
    """Return Re K* or Im K*/w of parameter p over frequency, shape (n_kept, n_freq)."""
    k_lines = found.k_lines[:, :, p % result.exact.n]
    return parameter_lines(k_lines, result.exact.freq_hz, result.case.parameters[p])


def _line_panel(result: KnownJointResult, found: Identified, p: int, within: tuple[Band, ...] | None) -> Panel:
    """Return the panel of an identified parameter over all frequencies, or inside bands with its mean."""
    freq, parameter, lines = result.exact.freq_hz, result.case.parameters[p], _lines(result, found, p)
    actual, median = float(result.case.actual[p]), float(np.median(found.theta[:, p]))
    inside = np.ones(freq.size, bool)
    levels, fitted = _known_and_fitted(result, found.noise, p)
    title, limits = ALL_LINES, None
    if within is not None:
        limits = (within[0][0], within[-1][1])
        inside = (freq >= limits[0]) & (freq <= limits[1])
        title = f"band {bands_in_words(within)} Hz"
        levels += (Level("median of the band means", median, "mean", within),)
    low, middle, high = percentile_lines(lines[:, inside])
    x = freq[inside]
    shown = tuple(
        Curve("" if i else "single realisations", x, line[inside], "faint") for i, line in enumerate(lines[:2])
    )
    return Panel(
        title, FREQUENCY, parameter_label(parameter),
        (*shown, Curve("median", x, middle, "ismm")),
        (Ribbon("2.5-97.5 %", x, low, high, "ismm"), *fitted),
        levels,
        shades=_shades(result, parameter) if within is None else (),
        x_limits=limits,
        y_limits=bulk_limits([low, high], around=actual),
    )  # fmt: skip


def _known_and_fitted(result: KnownJointResult, noise: str, p: int) -> tuple[tuple[Level, ...], tuple[Ribbon, ...]]:
    """Return the level of the actual parameter, and the ribbon of the compliance fits over realisations of a noise."""
    levels = [Level("actual", float(result.case.actual[p]), "actual")]
    fits = [f for f in result.identified if (f.noise, f.method) == (noise, "compliance")]
    ribbons = []
    for fit in fits:
        low, median, high = percentiles(fit.theta[:, p])
        ends = result.exact.freq_hz[[0, -1]]
        levels.append(Level("compliance fit, median", median, "compliance"))
        ribbons.append(Ribbon("compliance fit, 2.5-97.5 %", ends, np.full(2, low), np.full(2, high), "compliance"))
    return tuple(levels), tuple(ribbons)


def _identified(result: KnownJointResult) -> Iterator[Figure]:
    """Yield figures of the first noise level and the first method with values line by line."""
    by_band = [f for f in result.identified if f.k_lines.size]
    if not by_band:
        return
    first = by_band[0]
    sets = [f for f in by_band if (f.noise, f.method) == (first.noise, first.method)]
    for p, parameter in enumerate(result.case.parameters):
        panels = [_line_panel(result, first, p, None)]
        seen = []
        for found in sets:
            bands = next(s.bands[parameter] for s in result.case.band_sets if s.name == found.bands)
            if bands not in seen:
                seen.append(bands)
                panels.append(_line_panel(result, found, p, tuple(bands)))
        caption = f"Identified {parameter} by {_METHOD_NAMES[first.method]}, noise {first.noise}"
        yield Figure(f"identified-{parameter}", caption, tuple(panels), 1 if len(panels) == 1 else 2)


def _noise(result: KnownJointResult) -> Iterator[Figure]:
    rows, parameters = identified_rows(result), result.case.parameters
    panels = []
    for p, parameter in enumerate(parameters):
        intervals = tuple(
            Interval(f"{_METHOD_NAMES[r.method]}, {r.noise}\n{r.bands}", r.low, r.median, r.high, r.published)
            for r in rows if r.parameter == parameter
        )  # fmt: skip
        levels = (Level("actual", float(result.case.actual[p]), "actual"),)
        panels.append(Panel("", parameter_label(parameter), "", levels=levels, intervals=intervals))
    caption = "Identified parameters at all noise levels: median and percentiles over realisations"
    if len(panels) <= _ONE_FIGURE:
        yield Figure("noise", caption, tuple(panels), 2)
        return
    for kind, what in (("k", "stiffness"), ("c", "damping")):
        own = tuple(panel for parameter, panel in zip(parameters, panels, strict=True) if parameter.kind == kind)
        yield Figure(f"noise-{kind}", f"{caption}: {what}", own, 2)


def _methods(result: KnownJointResult) -> Iterator[Figure]:
    """Yield the comparison of methods line by line, if at least two methods work line by line."""
    if not result.case.band_sets:
        return
    first_noise, first_set = result.case.noises[0].name, result.case.band_sets[0]
    found = [f for f in result.identified if f.noise == first_noise and f.bands == first_set.name]
    if len(found) < 2:
        return
    for p, parameter in enumerate(result.case.parameters):
        panels = _method_panels(result, found, p, tuple(first_set.bands[parameter]))
        yield Figure(f"methods-{parameter}", f"Identified {parameter} by different methods", panels)


def _method_panels(
    result: KnownJointResult, found: list[Identified], p: int, bands: tuple[Band, ...]
) -> tuple[Panel, ...]:
    """Return panels of one realisation of two methods, and of the medians of all methods."""
    freq, actual = result.exact.freq_hz, float(result.case.actual[p])
    low, high = bands[0][0], bands[-1][1]
    inside = (freq >= low) & (freq <= high)
    shown = [f for f in found if f.method in _SINGLE] or found[:2]
    single, medians = [], []
    for f in found:
        lines = _lines(result, f, p)[:, inside]
        medians.append(Curve(_METHOD_NAMES[f.method], freq[inside], np.median(lines, axis=0), f.method))
        if f in shown:
            single.append(Curve(_METHOD_NAMES[f.method], freq[inside], lines[0], f.method, thin=True))
    limits = bulk_limits([curve.y for curve in single + medians], around=actual)
    label, (levels, fitted) = parameter_label(result.case.parameters[p]), _known_and_fitted(result, found[0].noise, p)
    both = (("one realisation", single), ("median of the realisations", medians))
    return tuple(
        Panel(title, FREQUENCY, label, tuple(curves), fitted, levels, x_limits=(low, high), y_limits=limits)
        for title, curves in both
    )


def _regenerated(result: KnownJointResult) -> Iterator[Figure]:
    noise = result.case.noises[0].name
    names = (*(one.name for one in result.case.band_sets[:1]), ALL_LINES)
    for one in result.case.observed:
        found = [r for r in result.regenerated
                 if r.observed == one and r.identified.noise == noise and r.identified.bands in names]  # fmt: skip
        columns = 1 if len(found) < 3 else 2
        panels = side_by_side([_regenerated_panels(result, r) for r in found], columns)
        caption = f"Receptance of the assembly at {_place(result, one)}, regenerated from the identified parameters"
        yield Figure(f"regenerated-{one.key}", caption, panels, columns)
        if one.bands:
            zoomed = _zoomed(result, one, [r for r in found if r.identified.method in _SINGLE] or found[:2])
            yield Figure(f"zoom-{one.key}", f"{caption}, where errors are counted", zoomed)


def _zoomed(result: KnownJointResult, one: Observed, found: list[RegeneratedFrf]) -> tuple[Panel, ...]:
    """Return one panel for each band with one realisation of some methods and the actual FRF."""
    freq, panels = result.exact.freq_hz, []
    lines = [("actual", _curve(result, "actual", result.exact.h_c, one, "actual").h, "actual")]
    lines += [(_METHOD_NAMES[r.identified.method], r.first, r.identified.method) for r in found]
    for low, high in one.bands:
        inside = (freq >= low) & (freq <= high)
        curves = tuple(Curve(name, freq[inside], np.abs(h[inside]), style) for name, h, style in lines)
        title = f"{low:g} to {high:g} Hz, one realisation"
        panels.append(Panel(title, FREQUENCY, _label(result, one), curves, x_limits=(low, high), log_y=True))
    return tuple(panels)


def _regenerated_panels(result: KnownJointResult, regenerated: RegeneratedFrf) -> tuple[Panel, Panel]:
    exact, one, found = result.exact, regenerated.observed, regenerated.identified
    low, _, high = regenerated.percentiles
    curves = (
        _curve(result, "actual", exact.h_c, one, "actual"),
        ReceptanceCurve("regenerated, one realisation", exact.freq_hz, regenerated.first, "high"),
    )
    return receptance_panels(
        f"{_METHOD_NAMES[found.method]} ({found.bands})", _label(result, one), curves,
        (Ribbon("2.5-97.5 %", exact.freq_hz, low, high, "ismm"),),
        (("errors counted in", one.bands),) if one.bands else (),
    )  # fmt: skip
