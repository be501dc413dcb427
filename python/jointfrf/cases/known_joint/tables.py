"""The tables of a case: numbers beside the source's, as text, CSV and JSON."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from jointfrf.cases.known_joint.compute import CaseResult
from jointfrf.cases.known_joint.read import Observed
from jointfrf.frf.bands import Band

__all__ = [
    "Row",
    "Table",
    "as_csv",
    "as_text",
    "case_json",
    "frf_name",
    "identified_rows",
    "make_tables",
    "number",
    "to_json",
    "written",
]

Cell = str | float | None

_NOISE_FREE_LIMIT = 1e-6
#: An equation is exact up to this many roundings of the FRFs it takes.
_ROUNDINGS = 100
_PERCENTAGES = ("difference %", "RMSE %", "limit %", "percentile")


@dataclass(frozen=True)
class Row:
    """One parameter identified by one method at one noise level.

    `published`, `source`, `percentile` and `fits` are None where the source has no number. `percentile` is the share of
    realisations below the published value, percent; it fits inside the `central` percent.
    """

    noise: str
    method: str
    bands: str
    parameter: str
    unit: str
    actual: float
    source: str | None
    published: float | None
    median: float
    low: float
    high: float
    rmse_percent: float
    percentile: float | None
    fits: bool | None
    central: float | None = None


@dataclass(frozen=True)
class Table:
    """A table: cells are texts or numbers; `failing` names rows whose last cell says that something does not fit."""

    key: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    failing: tuple[int, ...] = ()
    note: str = ""


def identified_rows(result: CaseResult) -> list[Row]:
    """Rows for every parameter, method, noise level and set of bands, beside the source's number where it has one."""
    case = result.case
    rows = []
    for found in result.identified:
        published = [
            table
            for table in case.expected.tables
            if table.values and (table.noise, table.method) == (found.noise, found.method)
            and table.bands in ("", found.bands)
        ]  # fmt: skip
        for p, parameter in enumerate(case.parameters):
            values, actual = found.theta[:, p], float(case.actual[p])
            low, median, high = (float(x) for x in np.percentile(values, [2.5, 50, 97.5]))
            error = float(np.sqrt(((values - actual) ** 2).mean()) / abs(actual) * 100) if actual else float("nan")
            common = (found.noise, found.method, found.bands, parameter, case.units[p], actual)
            beside = [(t.source, t.values[parameter], t.central) for t in published if parameter in t.values]
            nothing: list[tuple[str | None, float | None, float | None]] = [(None, None, None)]
            for source, value, central in beside or nothing:
                share = None if value is None else float((values < value).mean() * 100)
                fits = None if share is None or central is None else abs(share - 50) <= central / 2
                rows.append(Row(*common, source, value, median, low, high, error, share, fits, central))
    return rows


def make_tables(result: CaseResult) -> list[Table]:
    """Build all tables of a case, the source's own first."""
    rows = identified_rows(result)
    sources = list(dict.fromkeys(row.source for row in rows if row.source is not None))
    tables = [_published(source, [row for row in rows if row.source == source]) for source in sources]
    tables += _published_errors(result)
    tables += [_frequencies(result), _identified(rows, result.n_realisations), *_limits(result, rows)]
    tables += [_bands(result), _regenerated(result), _noise_free(result)]
    return tables


def _published(source: str, rows: list[Row]) -> Table:
    columns = ("noise", "bands", "parameter", "unit", "actual", "thesis", "median", "2.5 %", "97.5 %", "percentile", "")
    cells = tuple(
        (
            row.noise, row.bands, row.parameter, row.unit, row.actual, row.published, row.median, row.low, row.high,
            row.percentile, "fits" if row.fits else "does not fit",
        )
        for row in rows
    )  # fmt: skip
    failing = tuple(i for i, row in enumerate(rows) if not row.fits)
    note = (
        "The thesis' value comes from one realisation of the noise; ours are a distribution. The percentile is the "
        f"share of realisations below the thesis' value; it fits inside the central {rows[0].central:g} %."
    )
    return Table(_key(source), source[0].upper() + source[1:], columns, cells,
                 failing, note)  # fmt: skip


def _frequencies(result: CaseResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    failing = []
    directed = any(modes.directions for modes in result.modes.values())
    expected = {joint: (values, within) for joint, _, values, within in result.case.expected.frequencies}
    for joint, modes in result.modes.items():
        values, within = expected.get(joint, ((), 0.0))
        for i, freq in enumerate(modes.freq_hz):
            known = values[i] if i < len(values) else None
            difference = None if known is None else (float(freq) / known - 1) * 100
            if difference is not None and abs(difference) > within:
                failing.append(len(cells))
            verdict = "" if difference is None else "fits" if abs(difference) <= within else "does not fit"
            most = (modes.directions[i],) if directed else ()
            cells.append((joint, str(i + 1), *most, float(freq), known, difference, verdict))
    columns = ("joint", "mode", *(("mostly in",) if directed else ()), "Hz", "expected Hz", "difference %", "")
    note = "; ".join(f"{joint} joint: {source}" for joint, source, _, _ in result.case.expected.frequencies)
    return Table(
        "natural-frequencies", "Natural frequencies of the assembly", columns, tuple(cells), tuple(failing), note
    )


def _identified(rows: list[Row], count: int) -> Table:
    columns = ("noise", "method", "bands", "parameter", "unit", "actual", "median", "2.5 %", "97.5 %", "RMSE %")
    seen = dict.fromkeys(
        (r.noise, r.method, r.bands, r.parameter, r.unit, r.actual, r.median, r.low, r.high, r.rmse_percent)
        for r in rows
    )
    return Table("identified", f"Identified joint parameters, {count} realisations", columns, tuple(seen))


def _limits(result: CaseResult, rows: list[Row]) -> list[Table]:
    cells: list[tuple[Cell, ...]] = []
    for table in result.case.expected.tables:
        for parameter, limit in table.rmse_below.items():
            row = next(
                r for r in rows if (r.noise, r.method, r.parameter) == (table.noise, table.method, parameter)
                and table.bands in ("", r.bands)
            )  # fmt: skip
            verdict = "fits" if row.rmse_percent < limit else "does not fit"
            cells.append((row.noise, row.method, row.bands, parameter, row.rmse_percent, limit, verdict))
    if not cells:
        return []
    failing = tuple(i for i, cell in enumerate(cells) if cell[-1] != "fits")
    columns = ("noise", "method", "bands", "parameter", "RMSE %", "limit %", "")
    return [Table("limits", "Root-mean-square errors and their limits", columns, tuple(cells), failing)]


def _in_words(bands: list[Band]) -> str:
    return ", ".join(f"{low:g}-{high:g}" for low, high in bands) or "none"


def _bands(result: CaseResult) -> Table:
    sets = result.case.band_sets
    cells = tuple(
        (
            parameter,
            "; ".join(dict.fromkeys(_in_words(s.bands[parameter]) for s in sets)),
            *(_in_words(result.proposals[one.key, parameter]) for one in result.case.observed),
        )
        for parameter in result.case.parameters
    )
    proposed = tuple(f"proposed from {frf_name(result, one)}, Hz" for one in result.case.observed)
    columns = ("parameter", "bands of the case, Hz", *proposed)
    note = "Proposed: where the smoothed sensitivity of the FRF stays within 20 dB of its largest value."
    return Table("bands", "Sensitive bands", columns, cells, (), note)


def _regenerated(result: CaseResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    for r in result.regenerated:
        for b, band in enumerate(r.bands):
            spread = [float(x) for e in (r.amplitude[b], r.frequency[b]) for x in np.percentile(e, [50, 2.5, 97.5])]
            where = "all lines" if band is None else _in_words([band])
            named = (r.identified.noise, r.identified.method, r.identified.bands, frf_name(result, r.observed), where)
            cells.append((*named, *spread))
    columns = ("noise", "method", "bands", "FRF", "errors in, Hz",
               "amplitude %", "2.5 %", "97.5 %", "frequency %", "2.5 %", "97.5 %")  # fmt: skip
    title = "Errors of the regenerated FRFs: amplitude (4.11) and frequency (4.12)"
    return Table("regenerated", title, columns, tuple(cells), (), "Median and percentiles over realisations.")


def frf_name(result: CaseResult, observed: Observed) -> str:
    """Name an observed FRF: "H_ss", with its direction where the case names one."""
    name = f"H_{observed.point * 2}"
    return name if observed.key == observed.point else f"{name} {result.case.joint.dofs[observed.dof]}"


def _published_errors(result: CaseResult) -> list[Table]:
    """Tables of the source with errors of regenerated FRFs, beside the distributions; with the first set of bands."""
    columns = ("FRF", "band, Hz", "method", "error", "thesis", "median", "2.5 %", "97.5 %", "percentile")
    rows: dict[str, list[tuple[Cell, ...]]] = {}
    for known in result.case.expected.errors:
        found = next(
            r for r in result.regenerated if r.observed.key == known.observed
            and (r.identified.noise, r.identified.method) == (known.noise, known.method)
        )  # fmt: skip
        band = found.bands.index(known.band)
        for what, published, values in (
            ("amplitude (4.11)", known.amplitude, found.amplitude[band]),
            ("frequency (4.12)", known.frequency, found.frequency[band]),
        ):
            low, median, high = (float(x) for x in np.percentile(values, [2.5, 50, 97.5]))
            share = None if published is None else float((values < published).mean() * 100)
            named = (frf_name(result, found.observed), _in_words([known.band]), known.method, what)
            rows.setdefault(known.source, []).append((*named, published, median, low, high, share))
    note = "Errors in percent of one realisation in the thesis; ours are a distribution."
    return [
        Table(_key(source), f"{source[0].upper()}{source[1:]}: errors of the regenerated FRFs, percent", columns,
              tuple(own), (), note)
        for source, own in rows.items()
    ]  # fmt: skip


def _key(source: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", source.lower()).strip("-")


def _noise_free(result: CaseResult) -> Table:
    limit = {"short form": 1e-10}
    cells, failing = [], []
    for i, (method, (error, rounding)) in enumerate(result.noise_free.items()):
        fits = error <= max(limit.get(method, _NOISE_FREE_LIMIT), _ROUNDINGS * rounding)
        what = "ismm against -(gamma^-1)_jk" if method == "short form" else f"{method} against K*"
        cells.append((what, f"{error:.1e}", f"{rounding:.1e}", "exact" if fits else "does not fit"))
        if not fits:
            failing.append(i)
    columns = ("without noise", "largest relative error", "of one rounding", "")
    note = "The third column is what K* moves by when the last bits of the FRFs that the equation takes do."
    return Table("noise-free", "The equations without noise", columns, tuple(cells), tuple(failing), note)


def written(table: Table) -> list[list[str]]:
    """Write the cells of a table for a reader: values with five digits, percentages with three."""
    digits = [3 if table.key == "regenerated" or column in _PERCENTAGES else 5 for column in table.columns]
    return [[number(cell, d) for cell, d in zip(row, digits, strict=True)] for row in table.rows]


def number(value: Cell, digits: int = 5) -> str:
    """Write a cell for a reader: `digits` significant digits, plain where that is short."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if not np.isfinite(value):
        return str(value)
    if value == 0 or 1e-3 <= abs(value) < 10**6:
        places = digits if value == 0 else max(0, digits - 1 - int(np.floor(np.log10(abs(value)))))
        text = f"{value:.{places}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.') if '.' in mantissa else mantissa}e{int(exponent)}"


def as_text(table: Table) -> str:
    """Write a table in aligned columns, numbers to the right."""
    cells = written(table)
    is_number = [any(isinstance(row[c], float) for row in table.rows) for c in range(len(table.columns))]
    widths = [max(len(row[c]) for row in [list(table.columns), *cells]) for c in range(len(table.columns))]

    def line(row: list[str] | tuple[str, ...]) -> str:
        padded = (x.rjust(w) if right else x.ljust(w) for x, w, right in zip(row, widths, is_number, strict=True))
        return "  ".join(padded).rstrip()

    return "\n".join([table.title, line(table.columns), "  ".join("-" * w for w in widths), *map(line, cells)])


def as_csv(table: Table) -> str:
    """Write a table as CSV, numbers in full."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([column or "verdict" for column in table.columns])
    writer.writerows([["" if cell is None else cell for cell in row] for row in table.rows])
    return text.getvalue()


def case_json(case: Any, count: int, tables: list[Table]) -> dict[str, Any]:
    """Return what the JSON of every kind of case begins with, and its tables."""
    return {
        "case": case.name,
        "title": case.title,
        "section": case.section,
        "realisations": count,
        "seed": case.seed,
        "frequency_hz": {"first": case.freq_hz[0], "last": case.freq_hz[-1], "lines": case.freq_hz.size},
        "tables": {table.key: {"title": table.title, "columns": table.columns, "rows": table.rows} for table in tables},
    }


def to_json(result: CaseResult, tables: list[Table]) -> dict[str, Any]:
    """Return all numbers of a case as a structure for JSON."""
    case = result.case
    return {
        **case_json(case, result.n_realisations, tables),
        "natural_frequencies_hz": {joint: modes.freq_hz.tolist() for joint, modes in result.modes.items()},
        "identified": [asdict(row) for row in identified_rows(result)],
        "noise_free_relative_error": {method: found.error for method, found in result.noise_free.items()},
        "proposed_bands_hz": {
            f"{frf_name(result, one)} {name}": result.proposals[one.key, name]
            for one in case.observed for name in case.parameters
        },
    }  # fmt: skip
