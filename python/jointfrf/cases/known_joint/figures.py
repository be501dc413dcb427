"""The figures of a case, as data."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from jointfrf.cases.known_joint.compute import CaseResult
from jointfrf.cases.known_joint.read import Observed
from jointfrf.cases.known_joint.study import Identified, regenerate
from jointfrf.cases.known_joint.tables import identified_rows
from jointfrf.frf.bands import Band
from jointfrf.frf.noise import pollute
from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.plots import Curve, Figure, Interval, Level, Panel, Ribbon, symbol
from jointfrf.report.solid_modes import solid_modes
from jointfrf.solids.solid import SolidModel

__all__ = ["make_figures"]

_FREQUENCY = "frequency, Hz"
_METHOD_NAMES = {
    "ismm": "ISMM",
    "inverse-substructuring": "inverse substructuring",
    "compliance": "compliance fit",
    "decoupling-rr": "decoupling (2.53)",
    "decoupling-rs": "decoupling (2.54)",
    "decoupling-sr": "decoupling (2.55)",
    "decoupling-ss": "decoupling (2.56)",
}
#: Stiffness of the curves beside the actual one in a sensitivity figure.
_VARIED = ((0.5, "low"), (2.0, "high"))
#: Points of a mode shape on each beam; elements bend cubically between their nodes.
_SHAPE_POINTS = 100
#: Panels that still fit below each other.
_ONE_COLUMN = 4
#: Noise levels side by side.
_MOST_LEVELS = 3
#: A parameter whose sensitivity stays below this share of the largest one does not move an FRF.
_UNMOVED = 1e-4
#: How much room curves get around the values that matter.
_ROOM = 0.15
#: How far an axis reaches from the actual value, in actual values.
_FURTHEST = 3.0


def make_figures(result: CaseResult) -> list[Figure]:
    """Build all figures of a case that its data allow.

    Parameters
    ----------
    result : CaseResult

    Returns
    -------
    list of Figure
    """
    makers: tuple[Callable[[CaseResult], Iterator[Figure]], ...] = (
        _modes, _receptances, _polluted, _sensitivities, _identified, _noise, _methods, _regenerated,
    )  # fmt: skip
    return [figure for make in makers for figure in make(result)]


def _figure(result: CaseResult, key: str, caption: str, panels: list[Panel], columns: int = 1) -> Figure:
    return Figure(key, caption, result.case.expected.figure(key), tuple(panels), columns)


def _modulus(result: CaseResult, point: str, dof: int = 0) -> str:
    unit = "rad/(N m)" if result.case.rotational[dof] else "m/N"
    return f"$|H_{{{point}}}|$, {unit}"


def _label(result: CaseResult, observed: Observed) -> str:
    """Label of an axis."""
    return _modulus(result, observed.point * 2, observed.dof)


def _place(result: CaseResult, observed: Observed) -> str:
    """Where an observed FRF is taken, in words."""
    named = "" if observed.key == observed.point else f", {result.case.joint.dofs[observed.dof]}"
    return f"point {observed.point}{named}"


def _unit(result: CaseResult, parameter: str) -> str:
    return dict(zip(result.case.parameters, result.case.units, strict=True))[parameter]


def _modes(result: CaseResult) -> Iterator[Figure]:
    case, modes = result.case, result.modes["actual"]
    if isinstance(case.a.model, SolidModel) and isinstance(case.b.model, SolidModel):
        panels = solid_modes(modes, case.a.model, case.b.model)
        yield _figure(result, "modes", "Mode shapes of the assembly; shade: displacement", panels, 2)
        return
    if case.a.x is None or case.b.x is None:
        return
    positions = {"A": case.a.x, "B": case.a.x[-1] + case.b.x}
    panels = []
    for mode, freq in enumerate(modes.freq_hz):
        shape = dict(zip(modes.dofs, modes.shapes[:, mode], strict=True))
        largest = max((abs(v), v) for dof, v in shape.items() if dof.endswith(":y"))[1]
        curves = []
        for side, x in positions.items():
            # A node without DOFs is clamped.
            y, theta = (
                np.array([shape.get(f"{side}/{node + 1}:{direction}", 0.0) for node in range(x.size)]) / largest
                for direction in ("y", "theta")
            )
            fine = np.linspace(x[0], x[-1], max(_SHAPE_POINTS, x.size))
            deflection = CubicHermiteSpline(x, y, theta)(fine)
            curves.append(Curve(f"beam {side}", fine, deflection, "actual" if side == "A" else "high"))
        panels.append(Panel(f"mode {mode + 1}: {freq:.1f} Hz", "x, m", "deflection, relative", tuple(curves)))
    yield _figure(result, "modes", "Mode shapes of the assembly", panels, 2)


def _receptances(result: CaseResult) -> Iterator[Figure]:
    exact = result.exact
    for one in result.case.observed:
        at = exact.where(one.point).start + one.dof
        curves = (
            Curve("first estimate", exact.freq_hz, np.abs(exact.h_initial[:, at, at]), "initial"),
            Curve("actual joint", exact.freq_hz, np.abs(exact.h_c[:, at, at]), "actual"),
        )
        panel = Panel("", _FREQUENCY, _label(result, one), curves, log_y=True)
        place = _place(result, one)
        caption = f"Receptance of the assembly at {place}, with the first estimate and with the actual joint"
        yield _figure(result, f"receptance-{one.key}", caption, [panel])


def _polluted(result: CaseResult) -> Iterator[Figure]:
    exact = result.exact
    gamma = exact.interface(exact.h_c)
    extent = exact.freq_hz[-1] - exact.freq_hz[0]
    # Noise does not show on the whole range: one tenth of it is drawn large beside.
    close = (exact.freq_hz[0] + 0.45 * extent, exact.freq_hz[0] + 0.55 * extent)
    inside = (exact.freq_hz >= close[0]) & (exact.freq_hz <= close[1])
    panels = []
    for noise in result.case.noises[:_MOST_LEVELS]:
        h = pollute(
            gamma, noise.level, noise.kind, result.case.seed, relative_to=noise.relative_to,
            reciprocal=noise.reciprocal, block=noise.block,
        )  # fmt: skip
        for lines in (np.ones(inside.size, bool), inside):
            freq = exact.freq_hz[lines]
            curves = (
                Curve("exact", freq, np.abs(gamma[lines, 0, 0]), "actual"),
                Curve("polluted", freq, np.abs(h[lines, 0, 0]), "measured"),
            )
            panels.append(Panel(f"noise: {noise.name}", _FREQUENCY, _modulus(result, "jj"), curves, log_y=True))
    caption = "Receptance of the assembly at the joint, exact and polluted (one realisation); right: close up"
    yield _figure(result, "polluted", caption, panels, 2)


def _sensitivities(result: CaseResult) -> Iterator[Figure]:
    case, exact = result.case, result.exact
    for one in case.observed:
        found = result.sensitivities[one.key]
        at = exact.where(one.point).start + one.dof
        reach = abs(found.change).max(axis=1)
        for d, dof in enumerate(case.joint.dofs):
            if reach[d] < _UNMOVED * reach.max():
                continue
            name = symbol(f"k_{dof}")
            curves = [Curve(f"actual {name}", exact.freq_hz, np.abs(exact.h_c[:, at, at]), "actual")]
            for factor, style in _VARIED:
                varied = case.actual.copy()
                varied[d] *= factor
                h = np.abs(regenerate(exact, varied[None], one.point, one.dof)[0])
                curves.append(Curve(f"{factor:g} {name}", exact.freq_hz, h, style))
            shades = _shades(result, f"k_{dof}")
            proposed = tuple(result.proposals[one.key, f"k_{dof}"])
            panels = [
                Panel("", _FREQUENCY, _label(result, one), tuple(curves), shades=shades, log_y=True),
                _sensitivity_panel(result, one.point, dof, found.in_db, shades, proposed),
            ]
            caption = f"Sensitivity of the receptance at {_place(result, one)}, to k_{dof} and c_{dof}"
            yield _figure(result, f"sensitivity-{one.key}-{dof}", caption, panels)


def _sensitivity_panel(
    result: CaseResult,
    point: str,
    dof: str,
    in_db: FloatArray,
    shades: tuple[tuple[str, tuple[Band, ...]], ...],
    proposed: tuple[Band, ...],
) -> Panel:
    freq, parameters = result.exact.freq_hz, result.case.parameters
    rows = {letter: in_db[parameters.index(f"{letter}_{dof}")] for letter in "kc"}
    curves = tuple(
        Curve(f"to {symbol(f'{letter}_{dof}')}", freq, row, style)
        for (letter, row), style in zip(rows.items(), ("actual", "high"), strict=True)
    )
    label = f"change of $H_{{{point * 2}}}$ per 1 %, dB"
    strips = ((f"proposed for {symbol(f'k_{dof}')}", proposed),)
    return Panel("", _FREQUENCY, label, curves, shades=shades, strips=strips)


def _shades(result: CaseResult, parameter: str) -> tuple[tuple[str, tuple[Band, ...]], ...]:
    """Bands of a parameter, each once, the widest below."""
    different = dict.fromkeys(tuple(band_set.bands[parameter]) for band_set in result.case.band_sets)
    widest = sorted(different, key=lambda bands: -sum(high - low for low, high in bands))
    words = {bands: ", ".join(f"{low:g}-{high:g}" for low, high in bands) for bands in widest}
    return tuple((f"band {words[bands]} Hz", bands) for bands in widest)


def _parameter_lines(result: CaseResult, found: Identified, p: int) -> FloatArray:
    """Re K* or Im K*/w of parameter p over frequency, shape (n_kept, n_freq)."""
    n = result.exact.n
    k = found.k_lines[:, :, p % n]
    return k.real if p < n else k.imag / (2 * np.pi * result.exact.freq_hz)


def _limits(actual: float, values: FloatArray) -> tuple[float, float]:
    """Limits of an axis that show the bulk of the values and the actual one."""
    low, high = np.percentile(values[np.isfinite(values)], [4, 96])
    low, high = min(low, actual), max(high, actual)
    size = _FURTHEST * abs(actual) if actual else np.inf
    low, high = max(low, actual - size), min(high, actual + size)
    room = _ROOM * max(high - low, 0.2 * abs(actual))
    return float(low - room), float(high + room)


def _line_panel(result: CaseResult, found: Identified, p: int, within: tuple[Band, ...] | None) -> Panel:
    """Draw an identified parameter over frequency: everywhere, or inside bands with its mean."""
    freq, parameter = result.exact.freq_hz, result.case.parameters[p]
    lines = _parameter_lines(result, found, p)
    actual, median = float(result.case.actual[p]), float(np.median(found.theta[:, p]))
    inside = np.ones(freq.size, bool)
    levels: tuple[Level, ...] = (Level("actual", actual, "actual"),)
    title, limits = "all lines", None
    if within is not None:
        limits = (within[0][0], within[-1][1])
        inside = (freq >= limits[0]) & (freq <= limits[1])
        title = "band " + ", ".join(f"{low:g}-{high:g}" for low, high in within) + " Hz"
        levels += (Level("median of the band means", median, "high", within),)
    low, middle, high = np.percentile(lines[:, inside], [2.5, 50, 97.5], axis=0)
    x = freq[inside]
    shown = tuple(
        Curve("" if i else "single realisations", x, line[inside], "faint") for i, line in enumerate(lines[:2])
    )
    return Panel(
        title, _FREQUENCY, f"{symbol(parameter)}, {_unit(result, parameter)}",
        (*shown, Curve("median", x, middle, "ismm")),
        (Ribbon("2.5-97.5 %", x, low, high, "ismm"),),
        levels,
        shades=_shades(result, parameter) if within is None else (),
        x_limits=limits,
        y_limits=_limits(actual, np.stack([low, high])),
    )  # fmt: skip


def _identified(result: CaseResult) -> Iterator[Figure]:
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
        yield _figure(result, f"identified-{parameter}", caption, panels, 1 if len(panels) == 1 else 2)


def _noise(result: CaseResult) -> Iterator[Figure]:
    rows = identified_rows(result)
    panels = []
    for p, parameter in enumerate(result.case.parameters):
        own = [row for row in rows if row.parameter == parameter]
        intervals = tuple(
            Interval(f"{_METHOD_NAMES[r.method]}, {r.noise}\n{r.bands}", r.low, r.median, r.high, r.published)
            for r in own
        )
        actual = float(result.case.actual[p])
        label = f"{symbol(parameter)}, {result.case.units[p]}"
        panels.append(Panel("", label, "", levels=(Level("actual", actual, "actual"),), intervals=intervals))
    caption = "Identified parameters at all noise levels: median and percentiles over realisations"
    yield _figure(result, "noise", caption, panels, 1 if len(panels) <= _ONE_COLUMN else 2)


def _methods(result: CaseResult) -> Iterator[Figure]:
    """Compare methods line by line, where there are several that work line by line."""
    first_noise, first_set = result.case.noises[0].name, result.case.band_sets[0]
    found = [f for f in result.identified if f.noise == first_noise and f.bands == first_set.name]
    if len(found) < 2:
        return
    freq = result.exact.freq_hz
    for p, parameter in enumerate(result.case.parameters):
        bands = tuple(first_set.bands[parameter])
        actual = float(result.case.actual[p])
        inside = (freq >= bands[0][0]) & (freq <= bands[-1][1])
        levels = (Level("actual", actual, "actual"),)
        label = f"{symbol(parameter)}, {_unit(result, parameter)}"
        shown = [f for f in found if f.method in ("ismm", "decoupling-ss")] or found[:2]
        single, medians = [], []
        for f in found:
            lines = _parameter_lines(result, f, p)[:, inside]
            medians.append(Curve(_METHOD_NAMES[f.method], freq[inside], np.median(lines, axis=0), f.method))
            if f in shown:
                single.append(Curve(_METHOD_NAMES[f.method], freq[inside], lines[0], f.method))
        everything = np.stack([c.y for c in single + medians])
        room = {"levels": levels, "y_limits": _limits(actual, everything)}
        panels = [
            Panel("one realisation", _FREQUENCY, label, tuple(single), **room),  # type: ignore[arg-type]
            Panel("median of the realisations", _FREQUENCY, label, tuple(medians), **room),  # type: ignore[arg-type]
        ]
        yield _figure(result, f"methods-{parameter}", f"Identified {parameter} by different methods", panels)


def _regenerated(result: CaseResult) -> Iterator[Figure]:
    exact, first_noise = result.exact, result.case.noises[0].name
    names = (result.case.band_sets[0].name, "all lines")
    for one in result.case.observed:
        at = exact.where(one.point).start + one.dof
        actual = Curve("actual", exact.freq_hz, np.abs(exact.h_c[:, at, at]), "actual")
        panels = []
        for r in result.regenerated:
            found = r.identified
            if r.observed != one or found.noise != first_noise or found.bands not in names:
                continue
            low, _, high = r.percentiles
            curve = Curve("regenerated, one realisation", exact.freq_hz, np.abs(r.first), "high")
            ribbon = Ribbon("2.5-97.5 %", exact.freq_hz, low, high, "ismm")
            title = f"{_METHOD_NAMES[found.method]} ({found.bands})"
            panels.append(
                Panel(
                    title, _FREQUENCY, _label(result, one), (actual, curve), (ribbon,),
                    shades=(("errors counted in", one.bands),) if one.bands else (), log_y=True,
                )
            )  # fmt: skip
        caption = f"Receptance of the assembly at {_place(result, one)}, regenerated from the identified parameters"
        yield _figure(result, f"regenerated-{one.key}", caption, panels, 1 if len(panels) < 3 else 2)
