"""Comparison of a case of a known joint with its `expected.toml`, in one table for each source of numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band, in_bands
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.cases.comparison import (
    Compared,
    Ranked,
    compared_frequencies,
    compared_table,
    ranked,
    tables_of_sources,
)
from jointfrf.workbench.cases.keys import Observed
from jointfrf.workbench.cases.known_joint.compute import KnownJointResult, SensitiveBands
from jointfrf.workbench.cases.known_joint.keys import ExpectedErrors, ExpectedParameters, ExpectedRegions
from jointfrf.workbench.cases.known_joint.realisations import Identified
from jointfrf.workbench.report.axes import bands_in_words
from jointfrf.workbench.report.table import Cell, Table

__all__ = [
    "JOINT_NAMES",
    "NO_PEAK",
    "SPREAD",
    "SPREAD_OF_ERRORS",
    "Row",
    "comparisons",
    "contrast",
    "frf_name",
    "identified_rows",
    "proposed_bands",
    "rmse_limits",
    "spread_of_errors",
]

#: Cell in the place of the frequency of a missing peak.
NO_PEAK = "no peak in the band"
#: Joints by their names in tables.
JOINT_NAMES = {"initial": "first estimate", "actual": "actual"}
#: Headings of distributions of values, and of errors with three digits.
SPREAD = ("median", "2.5 %", "97.5 %")
SPREAD_OF_ERRORS = ("median, %", *SPREAD[1:])
#: A sensitive region fits if its sensitivity is twice as large, dB.
_TWICE = 20 * np.log10(2)
#: Half of the last printed digit of errors, percent.
_LAST_DIGIT = 0.005


def frf_name(result: KnownJointResult, observed: Observed) -> str:
    """Return the name of an observed FRF: "H_ss", with its direction if the case names one."""
    name = f"H_{observed.point * 2}"
    return name if observed.key == observed.point else f"{name} {result.case.joint.dofs[observed.dof]}"


@dataclass(frozen=True)
class Row:
    """One parameter identified by one method at one noise level.

    `source`, `published`, `percentile` and `fits` are None if the source has no number. `percentile` is the share of
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


def _belongs(table: ExpectedParameters, found: Identified) -> bool:
    return (table.noise, table.method) == (found.noise, found.method) and table.bands in ("", found.bands)


def identified_rows(result: KnownJointResult) -> list[Row]:
    """Return one row for every parameter, method, noise level and set of bands, with its published value, if any."""
    rows = []
    for found in result.identified:
        published = [table for table in result.case.expected.identified if table.values and _belongs(table, found)]
        for p, parameter in enumerate(result.case.parameters):
            values, actual = found.theta[:, p], float(result.case.actual[p])
            error = float(np.sqrt(((values - actual) ** 2).mean()) / abs(actual) * 100) if actual else float("nan")
            numbers: list[tuple[str | None, float | None]] = [
                (table.source, table.values[parameter.name]) for table in published if parameter.name in table.values
            ]
            for source, number in numbers or [(None, None)]:
                rank = ranked(values, number)
                rows.append(Row(found.noise, found.method, found.bands, parameter, actual, source, number,
                                *rank[:3], error, *rank[3:]))  # fmt: skip
    return rows


def comparisons(result: KnownJointResult, rows: list[Row]) -> list[Table]:
    """Return the tables that compare a result with published numbers and expected frequencies."""
    expected = result.case.expected
    frequencies = []
    if result.modes:
        note = "; ".join(f"{JOINT_NAMES[one.joint]}: {one.source}" for one in expected.frequencies)
        directed = ("mostly in",) if any(modes.directions for modes in result.modes.values()) else ()
        groups = [
            ([(JOINT_NAMES[joint], str(i + 1), *modes.directions[i : i + 1]) for i in range(modes.freq_hz.size)],
             modes.freq_hz.tolist(), expected.frequencies_with(joint))
            for joint, modes in result.modes.items()
        ]  # fmt: skip
        title = "Natural frequencies of the assembly"
        frequencies = [compared_frequencies(title, ("joint", "mode", *directed), groups, note)]
    return [
        *_published_parameters(rows),
        *_published_errors(result),
        *_errors_of_printed_parameters(result),
        *_regions(result),
        *frequencies,
    ]


def _published_parameters(rows: list[Row]) -> list[Table]:
    columns = ("noise", "bands", "parameter", "unit", "actual", "thesis", *SPREAD, "percentile")
    compared = (
        (row.source, Compared((row.noise, row.bands, row.parameter, row.parameter.unit, row.actual, row.published,
                               row.median, row.low, row.high, row.percentile), row.fits))
        for row in rows if row.source is not None
    )  # fmt: skip
    note = (
        "The value of the thesis comes from one realisation of the noise; ours are a distribution. The percentile is "
        "the share of realisations below the value of the thesis; it fits between the 2.5 and 97.5 percentile shown."
    )
    return tables_of_sources("", columns, compared, note, ("percentile",))


def rmse_limits(result: KnownJointResult, rows: list[Row]) -> list[Table]:
    """Return the table of root-mean-square errors and their limits; an empty list without limits."""
    compared = []
    for table in result.case.expected.identified:
        for name, limit in table.rmse_below.items():
            row = next(
                r for r in rows if (r.noise, r.method, r.parameter.name) == (table.noise, table.method, name)
                and table.bands in ("", r.bands)
            )  # fmt: skip
            cells = (row.noise, row.method, row.bands, row.parameter, row.rmse_percent, limit)
            compared.append(Compared(cells, row.rmse_percent < limit))
    columns = ("noise", "method", "bands", "parameter", "RMSE, %", "limit, %")
    title = "Root-mean-square errors and their limits"
    return [compared_table("limits", title, columns, compared, percentages=columns[4:])] if compared else []


def spread_of_errors(errors: FloatArray, published: float | None = None) -> tuple[tuple[Cell, ...], bool | None]:
    """Return median, 2.5 and 97.5 percentile and rank of the errors of a peak, and the verdict on the published error.

    Realisations without a peak in the band are left out; if more than half have none, the median is `NO_PEAK`.
    """
    with_peak = errors[np.isfinite(errors)]
    if with_peak.size < errors.size / 2:
        return (NO_PEAK, None, None, None), None if published is None else False
    rank: Ranked = ranked(with_peak, published)
    return rank[:4], rank.fits


def _published_errors(result: KnownJointResult) -> list[Table]:
    """Return published errors of regenerated FRFs next to the distributions, with the first set of bands."""
    columns = ("FRF", "band, Hz", "method", "error", "thesis, %", *SPREAD_OF_ERRORS, "percentile")
    note = (
        "Errors of one realisation in the thesis; ours are a distribution over realisations with a peak in "
        f"the band. {NO_PEAK}: not even half have one, because the largest value lies at an edge of the band."
    )

    def rows() -> Iterator[tuple[str, Compared]]:
        for known in result.case.expected.regenerated:
            found = next(
                r for r in result.regenerated if r.observed.key == known.observed
                and (r.identified.noise, r.identified.method) == (known.noise, known.method)
            )  # fmt: skip
            named = (frf_name(result, found.observed), bands_in_words([known.band]), known.method)
            band = found.bands.index(known.band)
            for what, published, errors in (
                ("amplitude (4.11)", known.amplitude, found.amplitude[band]),
                ("frequency (4.12)", known.frequency, found.frequency[band]),
            ):
                cells, fits = spread_of_errors(errors, published)
                yield known.source, Compared((*named, what, published, *cells), fits)

    what = ": errors of the regenerated FRFs"
    return tables_of_sources(what, columns, rows(), note, (*SPREAD_OF_ERRORS, "percentile"))


def _errors_of_printed_parameters(result: KnownJointResult) -> list[Table]:
    """Return the table of FRFs regenerated from printed parameters; an empty list without such parameters."""
    lines = result.case.expected.printed
    if lines is None or not result.printed:
        return []

    def place(known: ExpectedErrors) -> str:
        observed = next(one for one in result.case.observed if one.key == known.observed)
        away = f", {1e3 * float(np.linalg.norm(known.offset)):.3g} mm away" if known.offset else ""
        return frf_name(result, observed) + away

    rows = []
    for known, amplitude, frequency, one_line in result.printed:
        for what, published, found, within in (
            ("amplitude (4.11)", known.amplitude, amplitude,
             lines.amplitude_within_percent / 100 * (known.amplitude or 0)),
            ("frequency (4.12)", known.frequency, frequency, lines.lines_within * one_line),
        ):  # fmt: skip
            fits = found is published
            if found is not None and published is not None:
                fits = abs(found - published) <= within + _LAST_DIGIT
            named = (known.source, place(known), bands_in_words([known.band]), known.method, what)
            rows.append(Compared((*named, published, NO_PEAK if found is None else found), fits))
    columns = ("source", "FRF", "band, Hz", "method", "error", "thesis, %", "from the printed parameters, %")
    note = (
        f"On lines {lines.step:g} Hz apart, without noise: what differs is the model, the lines or the printed"
        f" digits. It fits within {lines.amplitude_within_percent:g} % of the printed amplitude error, and within "
        f"{lines.lines_within:g} lines of the printed frequency error; an empty cell fits where there is no peak."
    )
    title = "Errors of FRFs regenerated from the printed parameters"
    return [compared_table("printed-parameters", title, columns, rows, note, columns[6:])]


def _regions(result: KnownJointResult) -> list[Table]:
    """Return the tables of the published sensitive regions."""
    of_joints = (f"{joint}: {what}" for joint in JOINT_NAMES.values() for what in ("proposed, Hz", "inside, dB"))
    columns = ("parameter", "FRF", "region, Hz", *of_joints)
    note = (
        "Inside: median sensitivity of the FRF on the lines of the region relative to that on the lines outside all "
        "regions of the parameter. A region fits where the FRF is at least twice as sensitive inside (6 dB), with the "
        "first estimate of the joint, which is what a user has, or with the actual joint."
    )
    rows = ((known.source, row) for known in result.case.expected.regions for row in _region_rows(result, known))
    percentages = tuple(column for column in columns if column.endswith("dB"))
    return tables_of_sources(": sensitive regions", columns, rows, note, percentages)


def _region_rows(result: KnownJointResult, known: ExpectedRegions) -> Iterator[Compared]:
    observed = next(one for one in result.case.observed if one.key == known.observed)
    p = result.case.parameters.index(known.parameter)
    for band in known.bands:
        cells: list[Cell] = [known.parameter, frf_name(result, observed), bands_in_words([band])]
        levels = []
        for sensitive in result.sensitive.values():
            change = sensitive.sensitivities[known.observed].change[p]
            levels.append(contrast(result.exact.freq_hz, change, band, known.bands))
            cells += [proposed_bands(sensitive, observed, known.parameter), levels[-1]]
        yield Compared(tuple(cells), any(level is not None and level >= _TWICE for level in levels))


def contrast(freq_hz: FloatArray, change: ComplexArray, region: Band, regions: Sequence[Band]) -> float | None:
    """Return the sensitivity of an FRF inside a region relative to the sensitivity outside all regions, dB.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines, Hz.
    change : ndarray, shape (n_freq,)
        Row of `Sensitivity.change`.
    region : (low, high)
        Limits of the region, Hz.
    regions : sequence of (low, high)
        All published regions of the parameter, Hz.

    Returns
    -------
    float or None
        Median of the modulus over the lines inside, divided by the median over the lines outside, dB. Medians are used
        because resonances and antiresonances are narrow. None if a median is zero, or if no line is outside.
    """
    outside = ~in_bands(freq_hz, regions)
    if not outside.any():
        return None
    within, without = (float(np.median(abs(change[lines]))) for lines in (in_bands(freq_hz, [region]), outside))
    return float(20 * np.log10(within / without)) if within > 0 and without > 0 else None


def proposed_bands(sensitive: SensitiveBands, observed: Observed, parameter: Parameter) -> str:
    """Return the text of the bands that are proposed for a parameter from an observed FRF."""
    return bands_in_words(sensitive.proposals[observed.key, parameter]) or "none"
