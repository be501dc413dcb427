"""Tables of a case of a known joint: comparisons with a source, and identified joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointfrf.workbench.cases.comparison import agreement
from jointfrf.workbench.cases.keys import FITTED
from jointfrf.workbench.cases.known_joint.compute import KnownJointResult
from jointfrf.workbench.cases.known_joint.decoupling import decoupling_bounds
from jointfrf.workbench.cases.known_joint.expected import (
    JOINT_NAMES,
    NO_PEAK,
    SPREAD,
    SPREAD_OF_ERRORS,
    Row,
    comparisons,
    frf_name,
    identified_rows,
    proposed_bands,
    rmse_limits,
    spread_of_errors,
)
from jointfrf.workbench.report.axes import bands_in_words, percentiles
from jointfrf.workbench.report.table import Cell, Table

__all__ = ["build_numbers", "build_summary", "build_tables"]

#: Relative errors without noise, and between ISMM and its short form, that "fit": those of rounding are smaller.
_NOISE_FREE_LIMIT, _SHORT_FORM_LIMIT = 1e-6, 1e-10
#: An equation is exact up to this multiple of its change by rounding of the FRFs.
_ROUNDINGS = 100


def build_tables(result: KnownJointResult) -> list[Table]:
    """Return all tables of a case; tables of the source come first."""
    rows = identified_rows(result)
    return [
        *comparisons(result, rows),
        _identified(rows, result.n_realisations),
        *_bounds(result),
        *_blocks(result, rows),
        *rmse_limits(result, rows),
        _bands(result),
        _regenerated(result),
        _noise_free(result),
    ]


def _identified(rows: list[Row], count: int) -> Table:
    columns = ("noise", "method", "bands", "parameter", "unit", "actual", *SPREAD, "RMSE, %")
    # A row appears once, even if the source lists it twice.
    seen = dict.fromkeys(
        (r.noise, r.method, r.bands, r.parameter, r.parameter.unit, r.actual, r.median, r.low, r.high, r.rmse_percent)
        for r in rows
    )
    title = f"Identified joint parameters, {count} realisations"
    return Table("identified", title, columns, tuple(seen), percentages=("RMSE, %",))


def _bounds(result: KnownJointResult) -> list[Table]:
    """Return the table of the decoupling fit and its bound; an empty list if no noise has a bound."""
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


def _blocks(result: KnownJointResult, rows: list[Row]) -> list[Table]:
    """Return the table of ISMM from both off-diagonal blocks of (2.48); an empty list if ISMM is not applied."""
    published = {(r.noise, r.bands, r.parameter): r.published for r in rows if r.method == "ismm"}
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
               *(f"{block}: {what}" for block in ("D_jk", "D_kj") for what in SPREAD))  # fmt: skip
    note = (
        "D (2.48) holds -Delta twice. Without noise both blocks give the same joint; the noise of the FRFs is not "
        "symmetric, so that with it they are two estimates. All other tables take D_jk."
    )
    return [Table("blocks", "ISMM from either block of the modification", columns, tuple(cells), note=note)]


def _bands(result: KnownJointResult) -> Table:
    """Return the table of the bands of the case and of the bands proposed with either joint."""
    sets, observed = result.case.band_sets, result.case.observed
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (
            parameter,
            "; ".join(dict.fromkeys(bands_in_words(s.bands[parameter]) for s in sets)),
            JOINT_NAMES[joint],
            *(proposed_bands(sensitive, one, parameter) for one in observed),
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


def _regenerated(result: KnownJointResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    for r in result.regenerated:
        found = r.identified
        for b, band in enumerate(r.bands):
            where = "all lines" if band is None else bands_in_words([band])
            named = (found.noise, found.method, found.bands, frf_name(result, r.observed), where)
            cells.append((*named, *spread_of_errors(r.amplitude[b])[0][:3], *spread_of_errors(r.frequency[b])[0][:3]))
    errors = (f"{error}: {what}" for error in ("amplitude", "frequency") for what in SPREAD_OF_ERRORS)
    columns = ("noise", "method", "bands", "FRF", "band, Hz", *errors)
    title = "Errors of the regenerated FRFs: amplitude (4.11) and frequency (4.12)"
    note = f"Median and percentiles over realisations with a peak in the band. {NO_PEAK}: not even half have one."
    return Table("regenerated", title, columns, tuple(cells), note=note, percentages=columns)


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
    """Return the numbers of a case for JSON, without its tables."""
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
    """Return short tables with the number of rows that fit and the errors of the methods."""
    return [agreement(tables), *_methods(identified_rows(result))]


def _methods(rows: list[Row]) -> list[Table]:
    """Return root-mean-square errors of all methods at noise levels with several methods."""
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
