"""Page of one identification: results, data and goodness of fit."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import get_args

import numpy as np

from jointfrf.frf.calibration import shows_calibration
from jointfrf.identification.fit_cards import cards
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.result import Fit
from jointfrf.io.card_link import CardFormat
from jointfrf.kernel.arguments import FloatArray, check_type
from jointfrf.kernel.call import get_engine
from jointfrf.workbench.report.axes import bands_in_words
from jointfrf.workbench.report.chart import Chart
from jointfrf.workbench.report.document import (
    Document,
    Listing,
    Part,
    Section,
    Words,
    words_of_findings,
    write_document,
)
from jointfrf.workbench.report.figure import Figure
from jointfrf.workbench.report.fit import fit_figures, fit_information
from jointfrf.workbench.report.fit_frfs import ComparedFrfs, compare_fit, frf_figures, frf_maps
from jointfrf.workbench.report.fit_words import (
    finding_sentences,
    next_parts,
    parameter_table,
    quality_sentences,
    seen_table,
    unknowns_table,
)
from jointfrf.workbench.report.receptance import noise_figure
from jointfrf.workbench.report.sketch import (
    SketchedPart,
    assembly_sketch,
    interface_points,
    interface_sketch,
    point_table,
)
from jointfrf.workbench.report.table import Table

__all__ = ["ReportOptions", "fit_document", "write_report"]

#: Number of points of all curves of a page, each about nine bytes, and least number of points of a curve.
_POINTS, _LEAST = 130_000, 240
#: Number of FRFs that are shown without a click.
_AT_ONCE = 6
#: Number of sentences on parameters before the first figure.
_FIRST_FOUND = 3
#: Largest number of lines of cards that are printed.
_PRINTED = 40
#: Least relative change of a parameter that is shown.
_SHOWN_CHANGE = 1e-4
#: Names of programs of cards.
_PROGRAMS = {"abaqus": "Abaqus", "calculix": "CalculiX", "nastran": "Nastran", "ansys": "Ansys",
             "code_aster": "Code_Aster", "lsdyna": "LS-DYNA", "subdyn": "SubDyn"}  # fmt: skip


@dataclass(frozen=True)
class ReportOptions:
    """Contents of a report in addition to the fit.

    The measured file, the command, nodes j and k of cards, and the drawn parts.
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
    """Write the page of a fit as one self-contained HTML file, and return its path.

    Parameters
    ----------
    fit : Fit
        Result of `identify` or `identify_model`.
    path : Path or str
        Path of the file, in a folder that exists.
    source : str
        Name of the measured file, default empty.
    command : str
        Command that made the fit, default empty.
    nodes : sequence of two or four int
        Numbers of nodes j and k of the finite-element cards, then of ROT NODEs of CalculiX.
    parts : sequence of SketchedPart
        Parts of an assembly with the places of their nodes, as in `MeasuredAssembly.sketched`, for a drawing with
        channels and joints; default none.

    Returns
    -------
    Path
        Path of the written file.

    Raises
    ------
    ValueError
        The fit does not contain the measured FRFs, because it was loaded, or is a mean over bands.
    MissingPackageError
        jinja2 is missing.
    OSError
        The file cannot be written.

    See Also
    --------
    plot : figure of the joint over frequency.
    identify : fit of FRFs between joint DOFs.
    identify_model : fit of FRFs with models of the parts.
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
        The fit does not contain the measured FRFs.
    """
    data = fit.data
    if data is None:
        raise ValueError(
            "this fit contains no measured FRFs for a report; call identify with the FRFs and method 'compliance', and "
            "report its fit"
        )
    is_model, compared = isinstance(data, ModelData), compare_fit(fit)
    frfs, joint = frf_figures(compared, fit.freq_hz), fit_figures(fit)
    (information, shares), noise = fit_information(fit), _noise_figure(fit)
    figures = [one for one in (*frfs, *joint, information, noise) if one]
    most = max(_LEAST, _POINTS // sum(len(panel.curves) for figure in figures for panel in figure.panels))

    def charts(figures: Iterable[Figure | None], what: str) -> list[Chart]:
        what = f"{what}, {fit.freq_hz.min():g} to {fit.freq_hz.max():g} Hz"
        return [Chart(replace(one, heading=""), f"{one.caption}: {what}", most) for one in figures if one]

    shown = charts(frfs, f"measured and {'predicted' if is_model else 'regenerated'}, modulus and phase")
    worst = shown.pop(compared.worst)
    caption = f"{worst.figure.caption}: of the FRFs drawn the one that fits worst"
    known_noise = f"Noise of {100 * fit.noise_level:.2g} % of the FRFs (median) was used; how it varies is not kept."
    maps = "Agreement and residual" if is_model else "Residual and reciprocity by channel"
    sections = [
        _summary(fit, compared, replace(worst, figure=replace(worst.figure, caption=caption))),
        Section("doubts", "Warnings and notes" if fit.warnings else "Notes", words_of_findings(fit.findings)),
        _channels(fit, options),
        Section("stiffness", "Stiffness and compliance over frequency", [
            Words([_how_joint(fit)]),
            *charts(joint, "real and imaginary part of joint stiffness K* and compliance C"),
            *charts([information], "share of the information by frequency"),
            shares,
        ]),
        _frf_section(fit, compared, shown, most),
        Section("maps", maps, frf_maps(fit, compared)),
        Section("unknowns", "Unknowns of the models", [unknowns_table(fit)]),
        Section("next", "What to measure next", next_parts(fit)),
        Section("noise", "Noise", [
            Words([] if noise else [known_noise]),
            *charts([noise], "measured and smooth FRFs and the noise found in them"),
        ]),
        _blind_spots(fit),
        Section("cards", "Input of finite-element programs", _cards(fit, options.nodes)),
        Section("made", "How this was made", [_made(fit, options)]),
    ]  # fmt: skip
    title = f"Joint identified from {options.source or 'FRFs'}"
    counts = ", ".join(
        f"{len(names)} {kind}{'' if len(names) == 1 else 's'}"
        for kind, names in zip(("response", "force"), _channel_names(fit), strict=True)
    )
    return Document(
        title, f"Joint DOFs {', '.join(fit.dofs)}; {counts}; {_span(fit.freq_hz)}; method {fit.method}.", sections
    )


def _channel_names(fit: Fit) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of responses and forces."""
    data = fit.data
    return (data.response_names, data.force_names) if isinstance(data, FitData) else (fit.responses, fit.forces)


def _span(freq_hz: FloatArray) -> str:
    if freq_hz.size == 1:
        return f"one frequency line, {freq_hz[0]:g} Hz"
    return f"{freq_hz.size} frequency lines from {freq_hz.min():g} to {freq_hz.max():g} Hz"


def _summary(fit: Fit, compared: ComparedFrfs, first: Part) -> Section:
    """Return the summary with the worst warning and the first figure on top, on the first screen of a phone."""
    known = compared.residual[np.isfinite(compared.residual)]
    of_channels = float(np.sqrt((known**2).mean())) if known.size else np.nan
    found = finding_sentences(fit)
    return Section("summary", "Summary", [
        Words(fit.warnings[:1], "warnings"), Words(found[:_FIRST_FOUND], "findings"),
        first,
        Words(found[_FIRST_FOUND:], "findings"), Words(quality_sentences(fit, of_channels)),
        parameter_table(fit), seen_table(fit),
    ])  # fmt: skip


def _channels(fit: Fit, options: ReportOptions) -> Section:
    """Return the places of responses and forces: a sketch if places are known, and a table."""
    data, (responses, forces) = fit.data, _channel_names(fit)
    if isinstance(data, ModelData):
        attached = [name for one in data.assembly.attachments for name in one.names[:1]]
        joints = [
            (f"joint {name} between".replace("  ", " "), f"{', '.join(one.j)} and {', '.join(one.k) or 'the ground'}")
            for name, one in data.assembly.joints.items()
        ]
        rows = [("responses", ", ".join(responses)), ("forces", ", ".join(forces)), *joints]
        table = _pairs("channels", "DOFs of the assembly", [*rows, ("attached", ", ".join(attached))])
        sketch = assembly_sketch(options.parts, responses, forces) if options.parts else None
        return Section("joint", "Channels", [sketch, table])
    parts: list[Part]
    if data is None or data.interface is None:
        known = f"Responses {', '.join(responses)}" + (f"; forces {', '.join(forces)}" if forces != responses else "")
        parts = [Words([f"The positions of the channels are not known, so there is no sketch. {known}."])]
    else:
        points = interface_points(data.interface)
        unknown = "The file has no positions of these points, so there is no sketch."
        is_placed = data.interface.placed
        parts = [
            interface_sketch(data.interface, points, fit.dofs) if is_placed else Words([unknown]),
            point_table(points),
        ]
    return Section("joint", "The joint and its channels", parts)


def _pairs(key: str, title: str, rows: Sequence[tuple[str, str]]) -> Table:
    """Return a table of names and values without empty rows."""
    return Table(key, title, ("what", "which"), tuple(row for row in rows if row[1]))


def _how_joint(fit: Fit) -> str:
    """Return the text above the charts of the joint."""
    found = "found, from all frequency lines together; the shaded band is the 95 % interval of"
    zoom = "Drag across a chart to zoom in, double-click for the whole band"
    if isinstance(fit.data, ModelData):
        return f"The joint {found} the real part. {zoom}."
    return (
        f"Lines: the joint {found} k. Dots of "
        "K*: each line inverted by itself, which scatters, and is biased towards zero where noise hides the joint. "
        "Dots of C: each line as the fit sees it, without that bias. "
        + ("Dots are as seen between the virtual points, lines of the joint alone. " if fit.seen else "")
        + f"{zoom}; with the keyboard + and − zoom, arrows move, 0 shows all."
    )


def _frf_section(fit: Fit, compared: ComparedFrfs, charts: Sequence[Chart], most: int) -> Section:
    is_model = isinstance(fit.data, ModelData)
    total = int(np.isfinite(compared.residual).sum()) if is_model else compared.residual.size
    total -= compared.silent
    drawn = len(compared.entries)
    where = "channels" if compared.of_channels else "joint DOFs"
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
    heading = f"Measured and {'predicted' if is_model else 'regenerated'} FRFs"
    more = (f"{len(charts) - _AT_ONCE} more FRFs", charts[_AT_ONCE:])
    return Section("frfs", heading, [Words(sentences), *charts[:_AT_ONCE]], more)


def _noise_figure(fit: Fit) -> Figure | None:
    data = fit.data
    if not isinstance(data, FitData) or data.noise is None:
        return None
    return noise_figure(fit.freq_hz, data.measured, data.noise, data.response_names, data.force_names)


def _blind_spots(fit: Fit) -> Section:
    """Return the errors of a test that no FRF shows and no interval contains."""
    data, (responses, forces) = fit.data, _channel_names(fit)
    assert data is not None
    is_square = responses == forces and (isinstance(data, ModelData) or data.reciprocal)
    if any(one.code == "calibration-errors" for one in fit.findings):
        seen = (
            "Sensors and hammers of the same DOFs differ by what the note on calibration says. What both have in "
            "common does not show; the intervals take it to be as large as the difference."
        )
    elif is_square and shows_calibration(data.measured):
        seen = (
            "h_pq and h_qp differ by no more than noise: sensors and hammers agree. An error that sensor and hammer "
            "of a DOF have in common does not show, and is in no interval."
        )
    else:
        seen = (
            "No h_pq and h_qp were both measured on lines enough: nothing shows whether sensors and hammers are "
            "calibrated, and no interval allows for it."
        )
    known = data.hidden_errors() if isinstance(data, FitData) else {}

    def changes(name: str, size: str) -> str:
        """Return a sentence on the effect of an error of some size if it is known."""
        if name not in known:
            return ""
        shares = [
            (own, 100 * change / fit.value[own])
            for own, change in known[name].items()
            if own in fit.value and abs(change) >= _SHOWN_CHANGE * abs(fit.value[own]) > 0
        ]
        changed = ", ".join(f"{own} by {share:+.2g} %" for own, share in shares) or "little"
        return f" In this test {size} changes {changed}."

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
    return Section("blind", "Errors that this test cannot show", [Words([seen, *others])])


def _cards(fit: Fit, nodes: Sequence[int]) -> list[Part]:
    """Return the joint as input of each program, or the reason why there is none."""
    j, k = nodes[:2]
    listings, unsupported = [], []
    changes = fit.laws is not None and any(law.constant_terms is None for law in fit.laws.laws.values())
    freq_hz = float(f"{np.sqrt(fit.freq_hz.min() * fit.freq_hz.max()):.3g}") if changes else None
    of_points = {point: (j + 4 * i, k + 4 * i) for i, point in enumerate(fit.points)}
    for program in get_args(CardFormat):
        is_calculix = program == "calculix"
        rotation = (tuple(nodes[2:4]) or (max(j, k) + 1, max(j, k) + 2)) if is_calculix else ()
        # Nodes of the next joint point follow the nodes of this point.
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
    return [Words([where]), *listings, Words(unsupported, "notes")]


def _made(fit: Fit, options: ReportOptions) -> Table:
    """Return the data that reproduce the fit."""
    import scipy

    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    when = datetime.fromtimestamp(int(epoch), UTC) if epoch else datetime.now(UTC)
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}"
    bands = "; ".join(f"{dof} {bands_in_words(own)} Hz" for dof, own in zip(fit.dofs, fit.bands or [], strict=False))
    return _pairs("versions", "Command and versions", [
        ("file", options.source), ("command", options.command), ("bands", bands),
        ("versions", f"{versions}, engine {get_engine()}, {platform.system()} {platform.machine()}"),
        ("written on", f"{when:%Y-%m-%d}"),
    ])  # fmt: skip
