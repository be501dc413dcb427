"""Tables of a case of a known joint: what was identified, and what a source prints beside what follows exactly."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.cases.comparison import agreement, failing_rows, frequency_table, verdict
from jointfrf.workbench.cases.keys import FITTED, Observed
from jointfrf.workbench.cases.known_joint.compute import KnownJointResult, SensitiveBands, contrast
from jointfrf.workbench.cases.known_joint.decoupling import decoupling_bounds
from jointfrf.workbench.cases.known_joint.keys import ExpectedErrors, ExpectedParameters, ExpectedRegions
from jointfrf.workbench.cases.known_joint.realisations import Identified
from jointfrf.workbench.cases.known_joint.regenerate import RegeneratedFrf
from jointfrf.workbench.report.axes import bands_in_words, percentiles
from jointfrf.workbench.report.table import Cell, Table

__all__ = ["Row", "build_numbers", "build_summary", "build_tables", "identified_rows"]

#: Stands for the frequency of a peak that is not there.
NO_PEAK = "no peak in the band"
#: Joints by their names in tables.
JOINT_NAMES = {"initial": "first estimate", "actual": "actual"}
#: What the table of regions says of either.
_OF_JOINT = ("proposed, Hz", "inside, dB")
#: Twice as sensitive, dB.
_TWICE = 20 * np.log10(2)


def key_of(source: str) -> str:
    """Key of the table of a source."""
    return re.sub(r"[^a-z0-9]+", "-", source.lower()).strip("-")


def title_of(source: str) -> str:
    """Name of a source at the start of a title."""
    return source[:1].upper() + source[1:]


def frf_name(result: KnownJointResult, observed: Observed) -> str:
    """Name an observed FRF: "H_ss", with its direction where the case names one."""
    name = f"H_{observed.point * 2}"
    return name if observed.key == observed.point else f"{name} {result.case.joint.dofs[observed.dof]}"


def printed_parameter_tables(result: KnownJointResult) -> list[Table]:
    """Table of the FRFs regenerated from printed parameters; none where there are none."""
    lines = result.case.expected.printed
    if lines is None or not result.printed:
        return []
    cells: list[tuple[Cell, ...]] = []
    for one in result.printed:
        known = one.known
        observed = next(o for o in result.case.observed if o.key == known.observed)
        seen = f", {1e3 * float(np.linalg.norm(known.offset)):.3g} mm away" if known.offset else ""
        named = (known.source, frf_name(result, observed) + seen, bands_in_words([known.band]), known.method)
        for what, published, found, good in (
            ("amplitude (4.11)", known.amplitude, one.amplitude, one.amplitude_fits),
            ("frequency (4.12)", known.frequency, one.frequency, one.frequency_fits),
        ):
            cells.append((*named, what, published, NO_PEAK if found is None else found, verdict(good)))
    columns = ("source", "FRF", "band, Hz", "method", "error", "thesis, %", "from the printed parameters, %", "")
    note = (
        f"On lines {lines.step:g} Hz apart, without noise: what differs is the model, the lines or the printed"
        f" digits. It fits within {lines.amplitude_within_percent:g} % of the printed amplitude error, and within "
        f"{lines.lines_within:g} lines of the printed frequency error; an empty cell fits where there is no peak."
    )
    title = "Errors of FRFs regenerated from the printed parameters"
    return [Table("printed-parameters", title, columns, tuple(cells), failing_rows(cells), note, columns[6:7])]


def region_tables(result: KnownJointResult) -> list[Table]:
    """Tables of the regions that the source finds sensitive, one for each source."""
    rows: dict[str, list[tuple[Cell, ...]]] = {}
    for known in result.case.expected.regions:
        rows.setdefault(known.source, []).extend(_region_rows(result, known))
    of_joints = (f"{joint}: {what}" for joint in JOINT_NAMES.values() for what in _OF_JOINT)
    columns = ("parameter", "FRF", "region, Hz", *of_joints, "")
    note = (
        "Inside: median sensitivity of the FRF on the lines of the region relative to that on the lines outside all "
        "regions of the parameter. A region fits where the FRF is at least twice as sensitive inside (6 dB), with the "
        "first estimate of the joint, which is what a user has, or with the actual joint."
    )
    return [
        Table(key_of(source), f"{title_of(source)}: sensitive regions", columns, tuple(own), failing_rows(own), note,
              tuple(column for column in columns if column.endswith("dB")))
        for source, own in rows.items()
    ]  # fmt: skip


def _region_rows(result: KnownJointResult, known: ExpectedRegions) -> list[tuple[Cell, ...]]:
    observed = next(o for o in result.case.observed if o.key == known.observed)
    rows = []
    for band in known.bands:
        cells: list[Cell] = [known.parameter, frf_name(result, observed), bands_in_words([band])]
        levels = []
        for sensitive in result.sensitive.values():
            level = _level(result, sensitive, known, band)
            levels.append(level)
            cells += [_proposed(sensitive, observed, known.parameter), level]
        rows.append((*cells, verdict(any(level is not None and level >= _TWICE for level in levels))))
    return rows


def _level(result: KnownJointResult, sensitive: SensitiveBands, known: ExpectedRegions, band: Band) -> float | None:
    change = sensitive.sensitivities[known.observed].change[result.case.parameters.index(known.parameter)]
    return contrast(result.exact.freq_hz, change, band, known.bands)


def _proposed(sensitive: SensitiveBands, observed: Observed, parameter: Parameter) -> str:
    return bands_in_words(sensitive.proposals[observed.key, parameter]) or "none"


def band_table(result: KnownJointResult) -> Table:
    """Table of the bands of the case beside those proposed with either joint."""
    sets, observed = result.case.band_sets, result.case.observed
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (
            parameter,
            "; ".join(dict.fromkeys(bands_in_words(s.bands[parameter]) for s in sets)),
            JOINT_NAMES[joint],
            *(_proposed(sensitive, one, parameter) for one in observed),
        )
        for parameter in result.case.parameters
        for joint, sensitive in result.sensitive.items()
    )
    proposed = tuple(f"proposed from {frf_name(result, one)}, Hz" for one in observed)
    columns = ("parameter", "bands of the case, Hz", "joint", *proposed)
    note = (
        "Proposed: where the smoothed sensitivity of the FRF stays within 20 dB of its largest value. Before the "
        "identification a user has the first estimate only."
    )
    return Table("bands", "Sensitive bands", columns, cells, note=note)


#: Relative errors without noise, and between ISMM and its short form, that "fit": those of rounding are smaller.
_NOISE_FREE_LIMIT, _SHORT_FORM_LIMIT = 1e-6, 1e-10
#: An equation is exact up to this many roundings of the FRFs it takes.
_ROUNDINGS = 100
#: Headings of distributions: of values, and of errors, which have three digits.
_SPREAD = ("median", "2.5 %", "97.5 %")
_SPREAD_OF_ERRORS = ("median, %", *_SPREAD[1:])


@dataclass(frozen=True)
class Row:
    """One parameter identified by one method at one noise level.

    `published`, `source`, `percentile` and `fits` are None where the source has no number. `percentile` is the share of
    realisations below the published value, percent; it fits between `low` and `high`, the 2.5 and 97.5 percentile.
    """

    noise: str
    method: str
    bands: str
    parameter: Parameter
    actual: float
    source: str | None
    published: float | None
    median: float
    low: float
    high: float
    rmse_percent: float
    percentile: float | None
    fits: bool | None

    def numbers(self) -> dict[str, Any]:
        """Return the row for JSON."""
        content = vars(self).copy()
        named = {key: content.pop(key) for key in ("noise", "method", "bands", "parameter")}
        return named | {"parameter": self.parameter.name, "unit": self.parameter.unit} | content


def identified_rows(result: KnownJointResult) -> list[Row]:
    """Rows for every parameter, method, noise level and set of bands, beside the source's number where it has one."""
    rows = []
    for found in result.identified:
        published = [
            table
            for table in result.case.expected.identified
            if table.values and (table.noise, table.method) == (found.noise, found.method)
            and table.bands in ("", found.bands)
        ]  # fmt: skip
        for p, parameter in enumerate(result.case.parameters):
            beside = [table for table in published if parameter.name in table.values]
            for table in beside or (None,):
                rows.append(_row(found, parameter, found.theta[:, p], float(result.case.actual[p]), table))
    return rows


def _row(found: Identified, parameter: Parameter, values: Any, actual: float, table: ExpectedParameters | None) -> Row:
    low, median, high = percentiles(values)
    named = (found.noise, found.method, found.bands, parameter, actual)
    error = float(np.sqrt(((values - actual) ** 2).mean()) / abs(actual) * 100) if actual else float("nan")
    if table is None:
        return Row(*named, None, None, median, low, high, error, None, None)
    published = table.values[parameter.name]
    share = float((values < published).mean() * 100)
    return Row(*named, table.source, published, median, low, high, error, share, low <= published <= high)


def build_tables(result: KnownJointResult) -> list[Table]:
    """Build all tables of a case, the source's own first."""
    rows = identified_rows(result)
    sources = list(dict.fromkeys(row.source for row in rows if row.source is not None))
    return [
        *(_published(source, [row for row in rows if row.source == source]) for source in sources),
        *_published_errors(result),
        *printed_parameter_tables(result),
        *region_tables(result),
        *_frequencies(result),
        _identified(rows, result.n_realisations),
        *_bounds(result),
        *_blocks(result),
        *_limits(result, rows),
        band_table(result),
        _regenerated(result),
        _noise_free(result),
    ]


def _published(source: str, rows: list[Row]) -> Table:
    columns = ("noise", "bands", "parameter", "unit", "actual", "thesis", *_SPREAD, "percentile", "")
    cells = tuple(
        (
            row.noise, row.bands, row.parameter, row.parameter.unit, row.actual, row.published, row.median, row.low,
            row.high, row.percentile, verdict(row.fits),
        )
        for row in rows
    )  # fmt: skip
    failing = tuple(i for i, row in enumerate(rows) if not row.fits)
    note = (
        "The value of the thesis comes from one realisation of the noise; ours are a distribution. The percentile is "
        "the share of realisations below the value of the thesis; it fits between the 2.5 and 97.5 percentile shown."
    )
    return Table(key_of(source), title_of(source), columns, cells, failing, note, percentages=("percentile",))


def _frequencies(result: KnownJointResult) -> list[Table]:
    """Table of the natural frequencies; none without models."""
    if not result.modes:
        return []
    directed = any(modes.directions for modes in result.modes.values())
    expected = result.case.expected
    groups = []
    for joint, modes in result.modes.items():
        named = JOINT_NAMES[joint]
        names = [(named, str(i + 1), *((modes.directions[i],) if directed else ())) for i in range(modes.freq_hz.size)]
        groups.append((names, modes.freq_hz.tolist(), expected.frequencies_with(joint)))
    columns = ("joint", "mode", *(("mostly in",) if directed else ()))
    note = "; ".join(f"{JOINT_NAMES[one.joint]}: {one.source}" for one in expected.frequencies)
    return [frequency_table("Natural frequencies of the assembly", columns, groups, note)]


def _identified(rows: list[Row], count: int) -> Table:
    columns = ("noise", "method", "bands", "parameter", "unit", "actual", *_SPREAD, "RMSE, %")
    # Once, even where the source has it twice.
    seen = dict.fromkeys(
        (r.noise, r.method, r.bands, r.parameter, r.parameter.unit, r.actual, r.median, r.low, r.high, r.rmse_percent)
        for r in rows
    )
    title = f"Identified joint parameters, {count} realisations"
    return Table("identified", title, columns, tuple(seen), percentages=("RMSE, %",))


def _bounds(result: KnownJointResult) -> list[Table]:
    """Table of the decoupling fit beside its bound; none where no case applies it to noise that has one."""
    cells: list[tuple[Cell, ...]] = []
    for name, bound in decoupling_bounds(result.case, result.exact).items():
        theta = next(one.theta for one in result.identified if (one.noise, one.method) == (name, "decoupling-fit"))
        for p, (parameter, actual) in enumerate(zip(result.case.parameters, result.case.actual.tolist(), strict=True)):
            error = 100 * float(np.sqrt(((theta[:, p] / actual - 1) ** 2).mean()))
            least = 100 * float(bound[p])
            cells.append((name, parameter, parameter.unit, actual, error, least, error / least))
    if not cells:
        return []
    columns = ("noise", "parameter", "unit", "actual", "RMSE, %", "bound, %", "ratio")
    note = (
        "Bound: the Cramer-Rao bound of all FRFs between internal points with the FRFs of the substructures, for "
        "circular noise of the variance that the noise has. Noise that changes no phase can be undercut, and need not "
        "reach it."
    )
    title = "The decoupling fit beside its bound"
    return [Table("bounds", title, columns, tuple(cells), note=note, percentages=("RMSE, %", "bound, %"))]


def _blocks(result: KnownJointResult) -> list[Table]:
    """Table of ISMM from both off-diagonal blocks of (2.48); none where ISMM is not applied."""
    published = {(r.noise, r.bands, r.parameter): r.published for r in identified_rows(result) if r.method == "ismm"}
    cells: list[tuple[Cell, ...]] = []
    for found in result.identified:
        for p, parameter in enumerate(result.case.parameters if len(found.theta_kj) else ()):
            named = (found.noise, found.bands, parameter, parameter.unit, float(result.case.actual[p]))
            low_jk, median_jk, high_jk = percentiles(found.theta[:, p])
            low_kj, median_kj, high_kj = percentiles(found.theta_kj[:, p])
            known = published[found.noise, found.bands, parameter]
            cells.append((*named, known, median_jk, low_jk, high_jk, median_kj, low_kj, high_kj))
    if not cells:
        return []
    columns = ("noise", "bands", "parameter", "unit", "actual", "thesis",
               *(f"{block}: {what}" for block in ("D_jk", "D_kj") for what in _SPREAD))  # fmt: skip
    note = (
        "D (2.48) holds -Delta twice. Without noise both blocks give the same joint; the noise of the FRFs is not "
        "symmetric, so that with it they are two estimates. All other tables take D_jk."
    )
    return [Table("blocks", "ISMM from either block of the modification", columns, tuple(cells), note=note)]


def _limits(result: KnownJointResult, rows: list[Row]) -> list[Table]:
    cells: list[tuple[Cell, ...]] = []
    for table in result.case.expected.identified:
        for name, limit in table.rmse_below.items():
            row = next(
                r for r in rows if (r.noise, r.method, r.parameter.name) == (table.noise, table.method, name)
                and table.bands in ("", r.bands)
            )  # fmt: skip
            good = verdict(row.rmse_percent < limit)
            cells.append((row.noise, row.method, row.bands, row.parameter, row.rmse_percent, limit, good))
    if not cells:
        return []
    failing = tuple(i for i, cell in enumerate(cells) if cell[-1] != "fits")
    columns = ("noise", "method", "bands", "parameter", "RMSE, %", "limit, %", "")
    title = "Root-mean-square errors and their limits"
    return [Table("limits", title, columns, tuple(cells), failing, percentages=("RMSE, %", "limit, %"))]


def _regenerated(result: KnownJointResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    for r in result.regenerated:
        found = r.identified
        for b, band in enumerate(r.bands):
            where = "all lines" if band is None else bands_in_words([band])
            named = (found.noise, found.method, found.bands, frf_name(result, r.observed), where)
            cells.append((*named, *_spread(r.amplitude[b]), *_spread(r.frequency[b])))
    errors = (f"{error}: {what}" for error in ("amplitude", "frequency") for what in _SPREAD_OF_ERRORS)
    columns = ("noise", "method", "bands", "FRF", "band, Hz", *errors)
    title = "Errors of the regenerated FRFs: amplitude (4.11) and frequency (4.12)"
    note = f"Median and percentiles over realisations with a peak in the band. {NO_PEAK}: not even half have one."
    return Table("regenerated", title, columns, tuple(cells), note=note, percentages=columns)


def _spread(errors: FloatArray) -> tuple[Cell, Cell, Cell]:
    """Median, 2.5 and 97.5 percentile over realisations with a peak in the band, where at least half have one."""
    with_peak = errors[np.isfinite(errors)]
    if with_peak.size < errors.size / 2:
        return NO_PEAK, None, None
    low, median, high = percentiles(with_peak)
    return median, low, high


def _published_errors(result: KnownJointResult) -> list[Table]:
    """Tables of the source with errors of regenerated FRFs, beside the distributions; with the first set of bands."""
    columns = ("FRF", "band, Hz", "method", "error", "thesis, %", *_SPREAD_OF_ERRORS, "percentile", "")
    rows: dict[str, list[tuple[Cell, ...]]] = {}
    for known in result.case.expected.regenerated:
        found = next(
            r for r in result.regenerated if r.observed.key == known.observed
            and (r.identified.noise, r.identified.method) == (known.noise, known.method)
        )  # fmt: skip
        rows.setdefault(known.source, []).extend(_error_rows(frf_name(result, found.observed), known, found))
    note = (
        "Errors of one realisation in the thesis; ours are a distribution over realisations with a peak in "
        f"the band. {NO_PEAK}: not even half have one, because the largest value lies at an edge of the band."
    )
    return [
        Table(
            key_of(source), f"{title_of(source)}: errors of the regenerated FRFs", columns, tuple(own),
            failing_rows(own), note,
            percentages=(*_SPREAD_OF_ERRORS, "percentile"),
        )
        for source, own in rows.items()
    ]  # fmt: skip


def _error_rows(frf: str, known: ExpectedErrors, found: RegeneratedFrf) -> list[tuple[Cell, ...]]:
    band = found.bands.index(known.band)
    rows: list[tuple[Cell, ...]] = []
    for what, published, values in (
        ("amplitude (4.11)", known.amplitude, found.amplitude[band]),
        ("frequency (4.12)", known.frequency, found.frequency[band]),
    ):
        median, low, high = _spread(values)
        share = good = None
        if published is not None:
            good = isinstance(low, float) and isinstance(high, float) and low <= published <= high
            share = float((values[np.isfinite(values)] < published).mean() * 100) if low is not None else None
        named = (frf, bands_in_words([known.band]), known.method, what)
        rows.append((*named, published, median, low, high, share, verdict(good)))
    return rows


def _noise_free(result: KnownJointResult) -> Table:
    cells, failing = [], []
    for i, (method, (error, rounding)) in enumerate(result.noise_free.items()):
        limit = _SHORT_FORM_LIMIT if method == "short form" else _NOISE_FREE_LIMIT
        exact = error <= max(limit, _ROUNDINGS * rounding)
        what = "ismm against -(gamma^-1)_jk" if method == "short form" else f"{method} against K*"
        cells.append((what, f"{error:.1e}", f"{rounding:.1e}", "exact" if exact else "does not fit"))
        if not exact:
            failing.append(i)
    columns = ("equation", "largest relative error", "change by one rounding", "")
    note = "By one rounding: the change of K* when the last bits of the FRFs that the equation takes change."
    return Table("noise-free", "The equations without noise", columns, tuple(cells), tuple(failing), note)


def build_numbers(result: KnownJointResult) -> dict[str, Any]:
    """Return the numbers of a case for JSON, beside its tables."""
    case = result.case
    return {
        "natural_frequencies_hz": {joint: modes.freq_hz.tolist() for joint, modes in result.modes.items()},
        "identified": [row.numbers() for row in identified_rows(result)],
        "noise_free_relative_error": {method: found.error for method, found in result.noise_free.items()},
        **{
            key: {
                f"{frf_name(result, one)} {parameter.name}": result.sensitive[joint].proposals[one.key, parameter]
                for one in case.observed for parameter in case.parameters
            }
            for key, joint in (("proposed_bands_hz", "actual"), ("proposed_bands_of_first_estimate_hz", "initial"))
        },
    }  # fmt: skip


def build_summary(result: KnownJointResult, tables: list[Table]) -> list[Table]:
    """Return short tables: how much fits, and how far the methods are from the actual joint."""
    return [agreement(tables), *_methods(identified_rows(result))]


def _methods(rows: list[Row]) -> list[Table]:
    """Root-mean-square errors of all methods at noise levels where there are several."""
    tables = []
    for count, noise in enumerate(dict.fromkeys(row.noise for row in rows), 1):
        errors: dict[str, dict[Cell, float]] = {}
        for row in rows:
            if row.noise == noise:
                name = row.method if row.method in FITTED else f"{row.method} ({row.bands})"
                errors.setdefault(name, {})[row.parameter] = row.rmse_percent
        if len(errors) > 1:
            parameters = next(iter(errors.values()))
            cells = tuple((parameter, *(own[parameter] for own in errors.values())) for parameter in parameters)
            title = f"Root-mean-square errors by method, noise {noise}"
            columns = ("parameter", *(f"{name}, %" for name in errors))
            tables.append(Table(f"methods-{count}", title, columns, cells, percentages=columns))
    return tables
