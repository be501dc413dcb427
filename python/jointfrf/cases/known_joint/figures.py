"""The figures of a case of a known joint, as data."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from jointfrf.cases.definitions import Observed
from jointfrf.cases.known_joint.compute import KnownJointResult
from jointfrf.cases.known_joint.modes import mode_panels
from jointfrf.cases.known_joint.regenerate import RegeneratedFrf, regenerate
from jointfrf.cases.known_joint.study import ALL_LINES, Identified
from jointfrf.cases.known_joint.tables import identified_rows
from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.report.axes import (
    FREQUENCY,
    bands_in_words,
    bulk_limits,
    modulus_label,
    parameter_label,
    parameter_lines,
    percentile_lines,
    symbol,
)
from jointfrf.report.figure import Curve, Figure, Interval, Level, NamedBands, Panel, Ribbon

__all__ = ["known_joint_figures"]

_METHOD_NAMES = {
    "ismm": "ISMM",
    "ismm-kj": "ISMM, D_kj",
    "inverse-substructuring": "inverse substructuring",
    "compliance": "compliance fit",
    "decoupling-rr": "decoupling (2.53)",
    "decoupling-rs": "decoupling (2.54)",
    "decoupling-sr": "decoupling (2.55)",
    "decoupling-ss": "decoupling (2.56)",
}
#: Methods of which a single realisation is drawn, too.
_SINGLE = ("ismm", "decoupling-ss")
#: Stiffness of the curves beside the actual one in a sensitivity figure.
_VARIED = ((0.5, "low"), (2.0, "high"))
#: Panels that still fit below each other.
_ONE_COLUMN = 4
#: Noise levels side by side.
_MOST_LEVELS = 3
#: A parameter whose sensitivity stays below this share of the largest one does not change an FRF visibly.
_UNMOVED = 1e-4


def known_joint_figures(result: KnownJointResult) -> list[Figure]:
    """Build all figures of a case that its data allow.

    Parameters
    ----------
    result : KnownJointResult

    Returns
    -------
    list of Figure
    """
    makers: tuple[Callable[[KnownJointResult], Iterator[Figure]], ...] = (
        _modes, _receptances, _polluted, _sensitivities, _identified, _noise, _methods, _regenerated,
    )  # fmt: skip
    return [figure for make in makers for figure in make(result)]


def _label(result: KnownJointResult, observed: Observed) -> str:
    """Label of an axis."""
    return modulus_label(observed.point * 2, result.case.joint.dofs[observed.dof])


def _place(result: KnownJointResult, observed: Observed) -> str:
    """Where an observed FRF is taken, in words."""
    named = "" if observed.key == observed.point else f", {result.case.joint.dofs[observed.dof]}"
    return f"point {observed.point}{named}"


def _modulus(result: KnownJointResult, h: ComplexArray, observed: Observed) -> FloatArray:
    """Modulus of an observed FRF among those of the assembly."""
    at = result.exact.at(observed)
    return np.abs(h[:, at, at])


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
            Curve("first estimate", exact.freq_hz, _modulus(result, exact.h_initial, one), "initial"),
            Curve("actual joint", exact.freq_hz, _modulus(result, exact.h_c, one), "actual"),
        )
        panel = Panel("", FREQUENCY, _label(result, one), curves, log_y=True)
        place = _place(result, one)
        caption = f"Receptance of the assembly at {place}, with the first estimate and with the actual joint"
        yield Figure(f"receptance-{one.key}", caption, (panel,))


def _polluted(result: KnownJointResult) -> Iterator[Figure]:
    exact = result.exact
    gamma = exact.interface(exact.h_c)
    extent = exact.freq_hz[-1] - exact.freq_hz[0]
    # Noise does not show on the whole range: one tenth of it is drawn large beside.
    close = (exact.freq_hz[0] + 0.45 * extent, exact.freq_hz[0] + 0.55 * extent)
    inside = (exact.freq_hz >= close[0]) & (exact.freq_hz <= close[1])
    label = modulus_label("jj", exact.dofs[0])
    panels = []
    for noise in result.case.noises[:_MOST_LEVELS]:
        h = noise.pollute(gamma, result.case.seed)
        for lines in (np.ones(inside.size, bool), inside):
            freq = exact.freq_hz[lines]
            curves = (
                Curve("exact", freq, np.abs(gamma[lines, 0, 0]), "actual"),
                Curve("polluted", freq, np.abs(h[lines, 0, 0]), "measured"),
            )
            panels.append(Panel(f"noise: {noise.name}", FREQUENCY, label, curves, log_y=True))
    caption = "Receptance of the assembly at the joint, exact and polluted (one realisation); right: close up"
    yield Figure("polluted", caption, tuple(panels), 2)


def _sensitivities(result: KnownJointResult) -> Iterator[Figure]:
    for one in result.case.observed:
        reach = abs(result.sensitivities[one.key].change).max(axis=1)
        for d, dof in enumerate(result.case.joint.dofs):
            if reach[d] < _UNMOVED * reach.max():
                continue
            stiffness, damping = Parameter.of_dof("k", dof), Parameter.of_dof("c", dof)
            panels = (_varied_panel(result, one, d), _sensitivity_panel(result, one, stiffness, damping))
            caption = f"Sensitivity of the receptance at {_place(result, one)}, to {stiffness} and {damping}"
            yield Figure(f"sensitivity-{one.key}-{dof}", caption, panels)


def _varied_panel(result: KnownJointResult, one: Observed, d: int) -> Panel:
    """Draw an FRF with the actual stiffness of a DOF, with less and with more."""
    exact, parameter = result.exact, result.case.parameters[d]
    name = symbol(parameter)
    curves = [Curve(f"actual {name}", exact.freq_hz, _modulus(result, exact.h_c, one), "actual")]
    for factor, style in _VARIED:
        varied = result.case.actual.copy()
        varied[d] *= factor
        h = np.abs(regenerate(exact, varied[None], one.point, one.dof)[0])
        curves.append(Curve(f"{factor:g} {name}", exact.freq_hz, h, style))
    shades = _shades(result, parameter)
    return Panel("", FREQUENCY, _label(result, one), tuple(curves), shades=shades, log_y=True)


def _sensitivity_panel(result: KnownJointResult, one: Observed, stiffness: Parameter, damping: Parameter) -> Panel:
    """Draw the sensitivity of an FRF to stiffness and damping of a DOF, and the bands that follow."""
    actual, initial = (found[one.key].in_db for found in (result.sensitivities, result.from_initial.sensitivities))
    drawn = ((stiffness, actual, "", "actual"), (stiffness, initial, ", first estimate", "initial"),
             (damping, actual, "", "high"))  # fmt: skip
    curves = tuple(
        Curve(
            f"to {symbol(parameter)}{of}", result.exact.freq_hz, in_db[result.case.parameters.index(parameter)], style
        )
        for parameter, in_db, of, style in drawn
    )
    label = f"change of $H_{{{one.point * 2}}}$ per 1 %, dB"
    key = (one.key, stiffness)
    strips = ((f"proposed for {symbol(stiffness)}", tuple(result.proposals[key])),
              ("proposed from the first estimate", tuple(result.from_initial.proposals[key])))  # fmt: skip
    return Panel("", FREQUENCY, label, curves, shades=_shades(result, stiffness), strips=strips)


def _shades(result: KnownJointResult, parameter: Parameter) -> NamedBands:
    """Bands of a parameter, each once, the widest below."""
    different = dict.fromkeys(tuple(band_set.bands[parameter]) for band_set in result.case.band_sets)
    widest = sorted(different, key=lambda bands: -sum(high - low for low, high in bands))
    return tuple((f"band {bands_in_words(bands)} Hz", bands) for bands in widest)


def _lines(result: KnownJointResult, found: Identified, p: int) -> FloatArray:
    """Re K* or Im K*/w of parameter p over frequency, shape (n_kept, n_freq)."""
    k_lines = found.k_lines[:, :, p % result.exact.n]
    return parameter_lines(k_lines, result.exact.freq_hz, result.case.parameters[p])


def _line_panel(result: KnownJointResult, found: Identified, p: int, within: tuple[Band, ...] | None) -> Panel:
    """Draw an identified parameter over frequency: everywhere, or inside bands with its mean."""
    freq, parameter, lines = result.exact.freq_hz, result.case.parameters[p], _lines(result, found, p)
    actual, median = float(result.case.actual[p]), float(np.median(found.theta[:, p]))
    inside = np.ones(freq.size, bool)
    levels: tuple[Level, ...] = (Level("actual", actual, "actual"),)
    title, limits = ALL_LINES, None
    if within is not None:
        limits = (within[0][0], within[-1][1])
        inside = (freq >= limits[0]) & (freq <= limits[1])
        title = f"band {bands_in_words(within)} Hz"
        levels += (Level("median of the band means", median, "high", within),)
    low, middle, high = percentile_lines(lines[:, inside])
    x = freq[inside]
    shown = tuple(
        Curve("" if i else "single realisations", x, line[inside], "faint") for i, line in enumerate(lines[:2])
    )
    return Panel(
        title, FREQUENCY, parameter_label(parameter),
        (*shown, Curve("median", x, middle, "ismm")),
        (Ribbon("2.5-97.5 %", x, low, high, "ismm"),),
        levels,
        shades=_shades(result, parameter) if within is None else (),
        x_limits=limits,
        y_limits=bulk_limits([low, high], around=actual),
    )  # fmt: skip


def _identified(result: KnownJointResult) -> Iterator[Figure]:
    """Figures of the first noise level and the first method with values line by line."""
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
    rows = identified_rows(result)
    panels = []
    for p, parameter in enumerate(result.case.parameters):
        intervals = tuple(
            Interval(f"{_METHOD_NAMES[r.method]}, {r.noise}\n{r.bands}", r.low, r.median, r.high, r.published)
            for r in rows if r.parameter == parameter
        )  # fmt: skip
        levels = (Level("actual", float(result.case.actual[p]), "actual"),)
        panels.append(Panel("", parameter_label(parameter), "", levels=levels, intervals=intervals))
    caption = "Identified parameters at all noise levels: median and percentiles over realisations"
    yield Figure("noise", caption, tuple(panels), 1 if len(panels) <= _ONE_COLUMN else 2)


def _methods(result: KnownJointResult) -> Iterator[Figure]:
    """Compare methods line by line, where there are several that work line by line."""
    first_noise, first_set = result.case.noises[0].name, result.case.band_sets[0]
    found = [f for f in result.identified if f.noise == first_noise and f.bands == first_set.name]
    if len(found) < 2:
        return
    for p, parameter in enumerate(result.case.parameters):
        panels = _method_panels(result, found, p, tuple(first_set.bands[parameter]))
        yield Figure(f"methods-{parameter}", f"Identified {parameter} by different methods", panels)


def _method_panels(
    result: KnownJointResult, found: list[Identified], p: int, bands: tuple[Band, ...]
) -> tuple[Panel, Panel]:
    """One realisation of two methods, and the medians of all."""
    freq, actual = result.exact.freq_hz, float(result.case.actual[p])
    inside = (freq >= bands[0][0]) & (freq <= bands[-1][1])
    shown = [f for f in found if f.method in _SINGLE] or found[:2]
    single, medians = [], []
    for f in found:
        lines = _lines(result, f, p)[:, inside]
        medians.append(Curve(_METHOD_NAMES[f.method], freq[inside], np.median(lines, axis=0), f.method))
        if f in shown:
            single.append(Curve(_METHOD_NAMES[f.method], freq[inside], lines[0], f.method))
    limits = bulk_limits([curve.y for curve in single + medians], around=actual)
    label, levels = parameter_label(result.case.parameters[p]), (Level("actual", actual, "actual"),)
    return (
        Panel("one realisation", FREQUENCY, label, tuple(single), levels=levels, y_limits=limits),
        Panel("median of the realisations", FREQUENCY, label, tuple(medians), levels=levels, y_limits=limits),
    )


def _regenerated(result: KnownJointResult) -> Iterator[Figure]:
    first_noise, names = result.case.noises[0].name, (result.case.band_sets[0].name, ALL_LINES)
    for one in result.case.observed:
        panels = tuple(
            _regenerated_panel(result, r)
            for r in result.regenerated
            if r.observed == one and r.identified.noise == first_noise and r.identified.bands in names
        )
        caption = f"Receptance of the assembly at {_place(result, one)}, regenerated from the identified parameters"
        yield Figure(f"regenerated-{one.key}", caption, panels, 1 if len(panels) < 3 else 2)


def _regenerated_panel(result: KnownJointResult, regenerated: RegeneratedFrf) -> Panel:
    exact, one, found = result.exact, regenerated.observed, regenerated.identified
    low, _, high = regenerated.percentiles
    curves = (
        Curve("actual", exact.freq_hz, _modulus(result, exact.h_c, one), "actual"),
        Curve("regenerated, one realisation", exact.freq_hz, np.abs(regenerated.first), "high"),
    )
    return Panel(
        f"{_METHOD_NAMES[found.method]} ({found.bands})", FREQUENCY, _label(result, one), curves,
        (Ribbon("2.5-97.5 %", exact.freq_hz, low, high, "ismm"),),
        shades=(("errors counted in", one.bands),) if one.bands else (), log_y=True,
    )  # fmt: skip
