"""The report of one identification: what was found in sentences that can be quoted, from what, and how well it fits."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import get_args

import numpy as np

from jointfrf.dofs import ParameterKind, is_rotation, parameter_name, point_and_direction
from jointfrf.frf.calibration import shows_calibration
from jointfrf.identification.fit_cards import cards
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.result import UNDETERMINED, Fit, FittedParameter, is_undetermined
from jointfrf.io.card_link import CardFormat
from jointfrf.kernel.arguments import FloatArray, check_type
from jointfrf.kernel.call import get_engine
from jointfrf.workbench.report.axes import bands_in_words, prefixed_unit
from jointfrf.workbench.report.chart import Chart, count_points
from jointfrf.workbench.report.document import (
    Document,
    Listing,
    Part,
    Section,
    Sketch,
    Words,
    words_of_findings,
    write_document,
)
from jointfrf.workbench.report.figure import Figure
from jointfrf.workbench.report.fit import fit_figures, information_figure, information_table, shown_name
from jointfrf.workbench.report.fit_frfs import (
    ComparedFrfs,
    compare_frfs,
    compare_model,
    frf_figures,
    reciprocity_map,
    residual_map,
)
from jointfrf.workbench.report.fit_model import assurance_map, band_map, next_parts, unknowns_table
from jointfrf.workbench.report.receptance import noise_figure
from jointfrf.workbench.report.sketch import (
    SketchedPart,
    assembly_sketch,
    interface_points,
    interface_sketch,
    point_table,
)
from jointfrf.workbench.report.table import Cell, Table

__all__ = [
    "ReportOptions",
    "finding_sentences",
    "fit_document",
    "parameter_table",
    "quality_sentences",
    "seen_table",
    "with_unit",
    "write_report",
]

#: Points of all curves of a page together, each about nine bytes, and of a curve at least.
_POINTS, _LEAST = 130_000, 240
#: FRFs that are shown at once; the others when the reader asks for them.
_AT_ONCE = 6
#: Sentences on parameters before the first figure.
_FIRST_FOUND = 3
#: Lines of cards that are printed at most.
_PRINTED = 40
#: Relative changes of parameters that are shown at least.
_SHOWN_CHANGE = 1e-4
#: What is said above the charts of a fit with models.
_HOW_MODEL = (
    "The joint found, from all frequency lines together; the shaded band is the 95 % interval of the real part. Drag "
    "across a chart to zoom in, double-click for the whole band."
)
#: Programs of cards as they call themselves.
_PROGRAMS = {"abaqus": "Abaqus", "calculix": "CalculiX", "nastran": "Nastran", "ansys": "Ansys",
             "code_aster": "Code_Aster", "lsdyna": "LS-DYNA", "subdyn": "SubDyn"}  # fmt: skip


@dataclass(frozen=True)
class ReportOptions:
    """What a report says beside the fit.

    The file measured, the command typed, nodes j and k of cards, and parts drawn.
    """

    source: str = ""
    command: str = ""
    nodes: Sequence[int] = (1, 2)
    parts: Sequence[SketchedPart] = ()


def write_report(
    fit: Fit,
    path: Path | str,
    *,
    source: str = "",
    command: str = "",
    nodes: Sequence[int] = (1, 2),
    parts: Sequence[SketchedPart] = (),
) -> Path:
    """Write a page on a fit: one HTML file with all that is needed to judge and to quote the joint, no link to another.

    Parameters
    ----------
    fit : Fit
    path : Path or str
        In a folder that exists.
    source : str
        Name of the file that was measured.
    command : str
        How the fit was made, as typed.
    nodes : sequence of two or four int
        Nodes j and k of the finite-element cards; then ROT NODEs of CalculiX.
    parts : sequence of SketchedPart
        All parts of an assembly with the places of their nodes, as `MeasuredAssembly.sketched`: they are drawn with
        channels and joints.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        The fit does not hold the measured FRFs: it was loaded, or is a mean over bands.
    MissingPackageError
        jinja2 is missing.
    OSError
        The file cannot be written.
    """
    check_type("fit", fit, Fit)
    check_type("parts", parts, Sequence)
    for part in parts:
        check_type("parts", part, SketchedPart)
    return write_document(fit_document(fit, ReportOptions(source, command, nodes, parts)), path)


def fit_document(fit: Fit, options: ReportOptions) -> Document:
    """Return the report of a fit as sections and their parts.

    Raises
    ------
    ValueError
        The fit does not hold the measured FRFs.
    """
    data = fit.data
    if data is None:
        raise ValueError(
            "this fit contains no measured FRFs for a report; call identify with the FRFs and method 'compliance', and "
            "report its fit"
        )
    sections = _joint_sections(fit, data, options) if isinstance(data, FitData) else _model_sections(fit, options)
    title = f"Joint identified from {options.source}" if options.source else "Joint identified from FRFs"
    responses, forces = (
        (data.response_names, data.force_names) if isinstance(data, FitData) else (fit.responses, fit.forces)
    )
    about = (
        f"Joint DOFs {', '.join(fit.dofs)}; {len(responses)} response{_plural(responses)}, {len(forces)} "
        f"force{_plural(forces)}; {_span(fit.freq_hz)}; method {fit.method}."
    )
    return Document(title, about, sections)


def _plural(names: Sequence[str]) -> str:
    return "" if len(names) == 1 else "s"


def _model_sections(fit: Fit, options: ReportOptions) -> list[Section]:
    """Return the sections of a fit of an assembly."""
    up = np.argsort(fit.freq_hz, kind="stable")
    compared = compare_model(fit)
    frfs, joint = frf_figures(compared, fit.freq_hz, up), fit_figures(fit)
    most = _most_points([*frfs, *joint])
    what = "real and imaginary part of joint stiffness K* and compliance C"
    shown = _charts(frfs, most, fit, _what_frfs(fit))
    headline = shown.pop(compared.worst)
    return [
        _summary(fit, compared, _as_headline(headline)),
        _doubts(fit),
        Section("joint", "Channels", [*_drawn(fit, options), _channels(fit)]),
        Section(
            "stiffness",
            "Stiffness and compliance over frequency",
            [Words([_HOW_MODEL]), *_charts(joint, most, fit, what)],
        ),
        _frf_section(fit, compared, shown, most),
        Section("maps", "Agreement and residual", [assurance_map(fit), residual_map(compared), band_map(fit)]),
        Section("unknowns", "Unknowns of the models", [one for one in [unknowns_table(fit)] if one]),
        Section("next", "What to measure next", next_parts(fit)),
        Section("noise", "Noise", _noise_parts(fit, None, most)),
        _blind_spots(fit, is_square=fit.responses == fit.forces),
        Section("cards", "Input of finite-element programs", _cards(fit, options.nodes)),
        Section("made", "How this was made", [_made(fit, options)]),
    ]


def _drawn(fit: Fit, options: ReportOptions) -> list[Part]:
    sketch = assembly_sketch(options.parts, fit.responses, fit.forces) if options.parts else None
    return [] if sketch is None else [sketch]


def _channels(fit: Fit) -> Table:
    """Return where was measured and driven, with what is attached."""
    assert isinstance(fit.data, ModelData)
    whole = fit.data.assembly
    attached = [name for one in whole.attachments for name in one.names[:1]]
    rows: list[tuple[Cell, ...]] = [
        ("responses", ", ".join(fit.responses)),
        ("forces", ", ".join(fit.forces)),
        *((f"joint {name} between".replace("  ", " "), f"{', '.join(one.j)} and {', '.join(one.k) or 'the ground'}")
          for name, one in whole.joints.items()),
        *([("attached", ", ".join(attached))] if attached else []),
    ]  # fmt: skip
    return Table("channels", "DOFs of the assembly", ("what", "which"), tuple(rows))


def _joint_sections(fit: Fit, data: FitData, options: ReportOptions) -> list[Section]:
    """Return the sections of a fit of FRFs between all joint DOFs."""
    up = np.argsort(fit.freq_hz, kind="stable")
    compared = compare_frfs(data, fit.dofs)
    frfs = frf_figures(compared, fit.freq_hz, up)
    joint = fit_figures(fit)
    shares = data.information()[up]
    information = information_figure(fit, fit.freq_hz[up], shares)
    noise = _noise_figure(fit, data)
    most = _most_points([*frfs, *joint, *(one for one in (information, noise) if one is not None)])
    shown = _charts(frfs, most, fit, _what_frfs(fit))
    headline = shown.pop(compared.worst)
    return [
        _summary(fit, compared, _as_headline(headline)),
        _doubts(fit),
        Section("joint", "The joint and its channels", _geometry(fit, data, options)),
        Section(
            "stiffness",
            "Stiffness and compliance over frequency",
            [
                Words([_how_joint(fit)]),
                *_charts(joint, most, fit, "real and imaginary part of joint stiffness K* and compliance C"),
                *_charts([information] if information else [], most, fit, "share of the information by frequency"),
                information_table(fit, fit.freq_hz[up], shares),
            ],
        ),
        _frf_section(fit, compared, shown, most),
        Section("maps", "Residual and reciprocity by channel", _maps(compared)),
        Section("noise", "Noise", _noise_parts(fit, noise, most)),
        _blind_spots(fit, is_square=data.reciprocal and data.response_names == data.force_names),
        Section("cards", "Input of finite-element programs", _cards(fit, options.nodes)),
        Section("made", "How this was made", [_made(fit, options)]),
    ]


def _span(freq_hz: FloatArray) -> str:
    if freq_hz.size == 1:
        return f"one frequency line, {freq_hz[0]:g} Hz"
    return f"{freq_hz.size} frequency lines from {freq_hz.min():g} to {freq_hz.max():g} Hz"


def _most_points(figures: Iterable[Figure]) -> int:
    """Return how many points a curve may have so that the page stays small."""
    counts = np.sort(np.array(count_points(figures)))
    for done, size in enumerate(counts):
        rest = counts.size - done
        if counts[:done].sum() + rest * size > _POINTS:
            return max(_LEAST, int((_POINTS - counts[:done].sum()) / rest))
    return int(counts[-1])


def _charts(figures: Iterable[Figure], most: int, fit: Fit, what: str) -> list[Chart]:
    span = f"{fit.freq_hz.min():g} to {fit.freq_hz.max():g} Hz"
    return [Chart(replace(figure, heading=""), f"{figure.caption}: {what}, {span}", most) for figure in figures]


def _summary(fit: Fit, compared: ComparedFrfs, first: Part) -> Section:
    # What the reader sees first is the worst; the first figure is on the first screen of a phone, too.
    worst = [Words([fit.warnings[0]], "warnings")] if fit.warnings else []
    known = compared.residual[np.isfinite(compared.residual)]
    of_channels = float(np.sqrt((known**2).mean())) if known.size else np.nan
    found = finding_sentences(fit)
    return Section(
        "summary",
        "Summary",
        [
            *worst,
            Words(found[:_FIRST_FOUND], "findings"),
            first,
            *([Words(found[_FIRST_FOUND:], "findings")] if found[_FIRST_FOUND:] else []),
            Words(quality_sentences(fit, of_channels)),
            parameter_table(fit),
            *([seen_table(fit)] if fit.seen else []),
        ],
    )


def _doubts(fit: Fit) -> Section:
    return Section("doubts", "Warnings and notes" if fit.warnings else "Notes", words_of_findings(fit.findings))


def _geometry(fit: Fit, data: FitData, options: ReportOptions) -> list[Part]:
    if data.interface is None:
        names = ", ".join(data.response_names)
        known = f"Responses {names}" + (
            "" if names == ", ".join(data.force_names) else f"; forces {', '.join(data.force_names)}"
        )
        return [Words([f"The positions of the channels are not known, so there is no sketch. {known}."])]
    points = interface_points(data.interface)
    if not data.interface.placed:
        return [Words(["The file has no positions of these points, so there is no sketch."]), point_table(points)]
    sketch: Sketch = interface_sketch(data.interface, points, fit.dofs)
    return [sketch, point_table(points)]


def _how_joint(fit: Fit) -> str:
    return (
        "Lines: the joint found, from all frequency lines together; the shaded band is the 95 % interval of k. Dots of "
        "K*: each line inverted by itself, which scatters, and is biased towards zero where noise hides the joint. "
        "Dots of C: each line as the fit sees it, without that bias. "
        + ("Dots are as seen between the virtual points, lines of the joint alone. " if fit.seen else "")
        + "Drag across a chart to zoom in, double-click for "
        "the whole band; with the keyboard + and − zoom, arrows move, 0 shows all."
    )


def _word(fit: Fit) -> str:
    return "predicted" if isinstance(fit.data, ModelData) else "regenerated"


def _what_frfs(fit: Fit) -> str:
    return f"measured and {_word(fit)}, modulus and phase"


def _as_headline(chart: Chart) -> Chart:
    caption = f"{chart.figure.caption}: of the FRFs drawn the one that fits worst"
    return replace(chart, figure=replace(chart.figure, caption=caption))


def _frf_section(fit: Fit, compared: ComparedFrfs, charts: Sequence[Chart], most: int) -> Section:
    total = len(compared.rows) * len(compared.columns)
    total = (int(np.isfinite(compared.residual).sum()) if isinstance(fit.data, ModelData) else total) - compared.silent
    drawn = len(compared.entries)
    where = "channels" if compared.of_channels else "joint DOFs"
    is_model = isinstance(fit.data, ModelData)
    sentences = [
        "Predicted FRFs follow from the models, the joint and all other numbers found: where they leave the measured "
        "ones by more than noise, these do not explain the data."
        if is_model
        else "Regenerated FRFs are those nearest to the measured ones that any two structures with the joint found "
        "between them can have: where they leave the measured ones by more than noise, the joint does not explain the "
        "data."
    ]
    if any(one.code == "model-error" for one in fit.findings):
        sentences[-1] += " The errors of the models that are named above are in them."
    loud = " that hold more than noise" if compared.silent else ""
    sentences.append(
        f"All {total} FRFs between the {where}{loud} are on this page, the one that fits worst in the summary."
        if drawn == total
        else f"{drawn} of {total} FRFs between the {where}{loud} are on this page: in the summary the one of them that "
        "fits worst, here first those with response and force at one place, then those across the joint; the maps "
        "below are of all."
    )
    if compared.silent:
        sentences[-1] += f" {compared.silent} hold noise only, such as those that are zero by symmetry."
    if len(charts) > _AT_ONCE:
        sentences[-1] += f" On paper there are the first {_AT_ONCE}."
    if fit.freq_hz.size > most:
        sentences.append(
            f"Curves of more than {most} lines are drawn through the smallest and the largest value of each of "
            f"{most // 2} parts of the band, so that no peak is lost; all numbers are from all lines."
        )
    word = _word(fit)
    more = f"{len(charts) - _AT_ONCE} more FRFs"
    return Section(
        "frfs",
        f"Measured and {word} FRFs",
        [Words(sentences), *charts[:_AT_ONCE]],
        (more if charts[_AT_ONCE:] else "", charts[_AT_ONCE:]),
    )


def _maps(compared: ComparedFrfs) -> list[Part]:
    reciprocity = reciprocity_map(compared)
    return [residual_map(compared), *([reciprocity] if reciprocity else [])]


def _noise_figure(fit: Fit, data: FitData) -> Figure | None:
    if data.noise is None:
        return None
    return noise_figure(fit.freq_hz, data.measured, data.noise, data.response_names, data.force_names)


def _noise_parts(fit: Fit, figure: Figure | None, most: int) -> list[Part]:
    if figure is None:
        known = f"Noise of {100 * fit.noise_level:.2g} % of the FRFs (median) was used; how it varies is not kept."
        return [Words([known])]
    return list(_charts([figure], most, fit, "measured and smooth FRFs and the noise found in them"))


def _hidden_changes(fit: Fit) -> Callable[[str, str], str]:
    """Return a function from the name and the size of an error to a sentence on its effect; empty if it is unknown."""
    known = fit.data.hidden_errors() if isinstance(fit.data, FitData) else {}

    def sentence(name: str, size: str) -> str:
        if name not in known:
            return ""
        shares = [
            (own, 100 * change / fit.value[own])
            for own, change in known[name].items()
            if own in fit.value and abs(change) >= _SHOWN_CHANGE * abs(fit.value[own]) > 0
        ]
        changes = ", ".join(f"{own} by {share:+.2g} %" for own, share in shares)
        return f" In this test {size} changes {changes}." if changes else f" In this test {size} changes little."

    return sentence


def _blind_spots(fit: Fit, *, is_square: bool) -> Section:
    """Say which errors of a test no FRF shows: no interval holds them."""
    assert fit.data is not None
    if any(one.code == "calibration-errors" for one in fit.findings):
        seen = (
            "Sensors and hammers of the same DOFs differ by what the note on calibration says. What both have in "
            "common does not show; the intervals take it to be as large as the difference."
        )
    elif is_square and shows_calibration(fit.data.measured):
        seen = (
            "h_pq and h_qp differ by no more than noise: sensors and hammers agree. An error that sensor and hammer "
            "of a DOF have in common does not show, and is in no interval."
        )
    else:
        seen = (
            "No h_pq and h_qp were both measured on lines enough: nothing shows whether sensors and hammers are "
            "calibrated, and no interval allows for it."
        )
    changes = _hidden_changes(fit)
    others = [
        "A gain that all FRFs share: it changes stiffness and damping by the same factor.",
        f"A delay of all impacts relative to the responses.{changes('delay', '1 µs')}",
        "Sensors that all resonate at one frequency f₀: FRFs at f are too large by (f/f₀)²."
        f"{changes('resonance', 'f₀ at ten times the highest line')}",
        "Noise of the measured force: H1 estimates are too small by its share in the power of the force; H2 estimates "
        f"of noisy responses are too large.{changes('force-noise', '1 % of the power')}",
        "Exponential windows: with exp(-σt) a stiffness grows by c σ, unless σ was given (window_decay). A Hann window "
        "on the decaying response of an impact adds damping.",
        "Sensors and impacts that are not at their stated places, unless you stated the error of the positions "
        "(position_error): an error of 1 mm between two points changes the rotation between them by 1 mm over their "
        f"distance.{changes('position', '1 mm at each point')}",
    ]
    return Section("blind", "What this test cannot know", [Words([seen, *others])])


def _cards(fit: Fit, nodes: Sequence[int]) -> list[Part]:
    """Return the joint as input of each program, or why there is none."""
    j, k = nodes[:2]
    listings, unsupported = [], []
    changes = fit.laws is not None and any(law.constant_terms is None for law in fit.laws.laws.values())
    freq_hz = float(f"{np.sqrt(fit.freq_hz.min() * fit.freq_hz.max()):.3g}") if changes else None
    of_points = {point: (j + 4 * i, k + 4 * i) for i, point in enumerate(fit.points)}
    for program in get_args(CardFormat):
        is_calculix = program == "calculix"
        rotation = (tuple(nodes[2:4]) or (max(j, k) + 1, max(j, k) + 2)) if is_calculix else ()
        # Nodes of the next joint point follow those of this one.
        ends = {point: (*own, *(node + 4 * i for node in rotation)) for i, (point, own) in enumerate(of_points.items())}
        name = _PROGRAMS[program] + (" (stiffness only)" if is_calculix else "")
        try:
            text = cards(
                fit, program, ends or (j, k), damping=not is_calculix, freq_hz=freq_hz,
                rotation_nodes=None if ends else rotation or None,
            )  # fmt: skip
        except ValueError as error:
            unsupported.append(f"{_PROGRAMS[program]}: {error}.")
        else:
            listings.append(Listing(name, text, printed=text.count("\n") <= _PRINTED))
    pairs = [f"{a} and {b} ({point})" for point, (a, b) in of_points.items()]
    where = (
        f"In SI units, between nodes {', '.join(pairs)} on sides j and k, along the global axes."
        if pairs
        else f"In SI units, between node {j} on side j and node {k} on side k, along the global axes."
    )
    if freq_hz is not None:
        where += f" The laws are taken at {freq_hz:g} Hz: cards hold constants."
    if not all(listing.printed for listing in listings):
        where += f" Those of more than {_PRINTED} lines are on the screen only, not on paper."
    return [Words([where]), *listings, *([Words(unsupported, "notes")] if unsupported else [])]


def _made(fit: Fit, options: ReportOptions) -> Table:
    """Return what is needed to get the same again."""
    import scipy

    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    when = datetime.fromtimestamp(int(epoch), UTC) if epoch else datetime.now(UTC)
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}"
    rows: list[tuple[Cell, ...]] = [
        *([("file", options.source)] if options.source else []),
        *([("command", options.command)] if options.command else []),
        *(
            [
                (
                    "bands",
                    "; ".join(f"{dof} {bands_in_words(own)} Hz" for dof, own in zip(fit.dofs, fit.bands, strict=True)),
                )
            ]
            if fit.bands
            else []
        ),
        ("versions", f"{versions}, engine {get_engine()}, {platform.system()} {platform.machine()}"),
        ("written on", f"{when:%Y-%m-%d}"),
    ]
    return Table("versions", "Command and versions", ("what", "which"), tuple(rows))


#: A residual up to this many times the noise is called that of the noise.
_NOISE = 1.1
#: Significant digits of an uncertainty.
_DIGITS = 2
#: Of all intervals of the page.
_PROBABILITY = 0.95


def with_unit(value: float, unit: str, uncertainty: float | None = None) -> str:
    """Write a value with its unit and prefix, to two digits of its uncertainty, four digits without one.

    Examples
    --------
    >>> from jointfrf.workbench.report.fit_page import with_unit
    >>> with_unit(9.9955e6, "N/m", 6.5e3), with_unit(4999.93, "N m/rad", 103.0), with_unit(0.9756, "N m s/rad", 0.04)
    ('9.9955 MN/m', '5000 N m/rad', '0.976 N m s/rad')
    """
    shown, size = prefixed_unit(unit, abs(value))
    return f"{_rounded(value / size, None if uncertainty is None else uncertainty / size)} {shown}".rstrip()


def _rounded(value: float, uncertainty: float | None) -> str:
    if uncertainty is None or not np.isfinite(uncertainty) or uncertainty <= 0:
        return f"{value:.4g}"
    places = _DIGITS - 1 - int(np.floor(np.log10(uncertainty)))
    return f"{round(value, places):.{max(places, 0)}f}"


def _named(term: FittedParameter) -> str:
    """Name a parameter of one DOF in words."""
    kind = {"k": "stiffness", "h": "hysteretic stiffness", "c": "viscous damping"}.get(term.kind)
    if kind is None:
        return f"parameter {term.kind} of {term.row}"
    point, direction = point_and_direction(term.row)
    axis, where = direction.rpartition("_")[2].lstrip("r"), f" at {point}" if point else ""
    if is_rotation(term.row) and axis in ("x", "y", "z"):
        return f"{'rotational ' if term.kind != 'c' else ''}{kind} about {axis}{where}"
    return f"{kind} {'of' if is_rotation(term.row) else 'along'} {direction}{where}"


def finding_sentences(fit: Fit) -> list[str]:
    """Return one sentence a parameter, its value and where it lies with 95 % probability; one for all cross terms."""
    intervals = fit.confidence_interval(_PROBABILITY)
    sentences = [] if fit.laws is None or not fit.laws.rigid else [f"Rigid: {', '.join(fit.laws.rigid)}."]
    for term, value in zip(fit.parameters, fit.value.values(), strict=True):
        if term.origin != "joint":
            continue
        low, high = intervals[term.name]
        name = _named(term)
        if not term.is_cross:
            sentences.append(f"{name[0].upper()}{name[1:]} ({term.name}): {_value_sentence(term, value, low, high)}")
    dof_of = {parameter_name("eta", dof, dof): dof for dof in fit.dofs}
    for name, eta in fit.loss_factors.items():
        of = FittedParameter(name, "", "eta", dof_of[name], dof_of[name])
        sentences.append(f"Loss factor of {of.row} ({name}): {_value_sentence(of, eta.value, eta.low, eta.high)}")
    rest = [term.name for term in fit.parameters if term.origin != "joint"]
    if rest:
        sentences.append(f"Fitted with it, values in the table: {', '.join(rest)}.")
    cross = [term.name for term in fit.parameters if term.is_cross and term.origin == "joint"]
    if cross:
        clear = [name for name in cross if not intervals[name][0] <= 0 <= intervals[name][1]]
        which = f"{len(clear)} of {len(cross)}: {', '.join(clear)}" if clear else f"none of {len(cross)}"
        sentences.append(f"Cross terms significantly different from zero (values in the table): {which}.")
    return sentences


def _value_sentence(term: FittedParameter, value: float, low: float, high: float) -> str:
    if term.kind == "k":
        if not np.isfinite(high):
            if not low > 0:
                return "cannot be distinguished from rigid; the data give no bound."
            bound, best = with_unit(low, term.unit), with_unit(float(f"{value:.2g}"), term.unit)
            return f"cannot be distinguished from rigid; at least {bound} (95 %), best estimate {best}."
        if not low > 0:
            return f"not significantly different from zero, a free DOF; at most {with_unit(high, term.unit)} (95 %)."
    if not (np.isfinite(low) and np.isfinite(high)):
        return "not determined by the data."
    reach = (high - low) / 2
    shown, size = prefixed_unit(term.unit, abs(value))
    ends = " and ".join(_rounded(limit / size, reach / size) for limit in (low, high))
    share = f" (±{100 * reach / abs(value):.2g} %)" if abs(value) > reach else ""
    zero = "; not significantly different from zero" if low < 0 < high else ""
    unit = f" {shown}" if shown else ""
    return f"{_rounded(value / size, reach / size)}{unit}, with 95 % probability between {ends}{unit}{share}{zero}."


def quality_sentences(fit: Fit, of_channels: float = np.nan) -> list[str]:
    """Return sentences on noise and residual, and on lines that were left out.

    Parameters
    ----------
    fit : Fit
    of_channels : float
        Residual between the channels over the noise, root mean square over all lines of the band and all FRFs.
    """
    sentences = []
    if np.isfinite(fit.noise_level) and fit.noise_level > 0:
        of_fitted = fit.residual_level / fit.noise_level
        whole = of_fitted if fit.test is None else max(of_fitted, fit.test.whole)
        ratio = float(np.nanmax([whole, of_channels]))
        explains, explain = ("joint explains", "joint as described does")
        if isinstance(fit.data, ModelData):
            explains, explain = ("models and the joint explain", "models and the joint as described do")
        verdict = (
            f"the {explains} the FRFs to within their noise."
            if ratio < _NOISE
            else f"the {explain} not explain all that the FRFs show."
        )
        sentences.append(
            f"The noise of the FRFs is {100 * fit.noise_level:.2g} % (median); what the fit leaves unexplained is "
            f"{100 * fit.residual_level:.2g} %, {of_fitted:.3g} times the noise"
            f"{_elsewhere(of_fitted, whole, of_channels)}: {verdict}"
        )
    if isinstance(fit.data, FitData):
        out = np.count_nonzero(~fit.data.fitted, axis=0)
        total = len(fit.data.fitted)
        names = [f"{n} of {total} for {dof}" for dof, n in zip(fit.dofs, out, strict=True) if n]
        if names:
            sentences.append(
                f"Lines left out, outside the bands or because they do not fit the joint found: {', '.join(names)}."
            )
    if fit.warnings:
        sentences.append("Read the warnings below before quoting these numbers.")
    return sentences


def _elsewhere(of_fitted: float, whole: float, of_channels: float) -> str:
    """Say what residuals beside that of the lines fitted are, where they are larger."""
    found = ""
    if whole > _NOISE * of_fitted:
        found += f"; with the lines left out it is {whole:.3g} times the noise"
    if of_channels > _NOISE * max(whole, 1):
        found += f"; between single channels, whose sides are taken as rigid, {of_channels:.3g} times (map below)"
    return found


def parameter_table(fit: Fit) -> Table:
    """Return the parameters with standard errors and intervals."""
    intervals, errors = fit.confidence_interval(_PROBABILITY), fit.std_error
    has_prior = any(one.prior for one in fit.parameters)
    rows: list[tuple[Cell, ...]] = []
    for term, value in zip(fit.parameters, fit.value.values(), strict=True):
        low, high = intervals[term.name]
        is_open = not (np.isfinite(low) and np.isfinite(high))
        ends: tuple[Cell, ...] = tuple(limit if np.isfinite(limit) else "open" for limit in (low, high))
        error: Cell = "" if is_open else errors[term.name]
        shown: Cell = f"about {value:.2g}" if is_open else value
        if is_undetermined(low, high):
            shown, ends = UNDETERMINED, ("", "")
        prior = "" if term.prior is None else f"{term.prior[0]:.4g} ± {term.prior[1]:.2g}"
        believed = (prior,) if has_prior else ()
        rows.append((shown_name(term), shown, error, *ends, *believed, term.unit))
    for name, eta in fit.loss_factors.items():
        known: tuple[Cell, ...] = (eta.value, eta.std_error, eta.low, eta.high)
        shown_eta = (UNDETERMINED, "", "", "") if is_undetermined(eta.low, eta.high) else known
        rows.append((name, *shown_eta, *([""] if has_prior else []), "1"))
    note = "K*(ω) = k + i h + i ω c, time convention exp(+iωt)"
    note += "; η = h/k" if fit.loss_factors else ""
    if any(term.origin == "joint" and term.kind not in get_args(ParameterKind) for term in fit.parameters):
        note = "Laws: docs/model-fit.md; time convention exp(+iωt)"
    prior_column = ("prior",) if has_prior else ()
    columns = ("parameter", "value", "standard error", "95 % from", "95 % to", *prior_column, "unit")
    if fit.seen:
        note += "; of the joint alone, without what its sides give way"
    return Table("parameters", "Parameters of the joint", columns, tuple(rows), note=note + ".")


def seen_table(fit: Fit) -> Table:
    """Return the stiffness as seen between virtual points, and what makes the interval of the joint alone wide."""
    rows: list[tuple[Cell, ...]] = []
    for term in fit.parameters:
        one = fit.seen.get(term.name)
        if one is not None:
            ends = (limit if np.isfinite(limit) else "open" for limit in (one.value, one.low, one.high))
            shares = (f"{100 * share:.0f} %" for share in (one.sides, one.inertia, one.noise))
            rows.append((shown_name(term), *ends, term.unit, *shares))
    columns = ("parameter", "as seen", "95 % from", "95 % to", "unit", "width by sides", "by inertia", "by noise")
    note = (
        "Static stiffness of the joint and its sides together, and shares of sides, inertia and noise in the squared "
        "width of the interval of the joint alone."
    )
    return Table("seen", "Stiffness as seen between the virtual points", columns, tuple(rows), note=note)
