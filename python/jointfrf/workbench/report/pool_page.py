"""Page of pooled fits of one joint: a forest plot of each parameter, and tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from jointfrf.kernel.arguments import check_type
from jointfrf.workbench.pooling.parameter import Estimate, FactorSpread, FactorTrend, PooledParameter, shown_chance
from jointfrf.workbench.pooling.pool import PooledFits, place_of
from jointfrf.workbench.report.axes import prefixed_unit
from jointfrf.workbench.report.document import (
    Document,
    Section,
    Words,
    section_of_command,
    words_of_findings,
    write_document,
)
from jointfrf.workbench.report.figure import Figure, Interval, Level, Panel
from jointfrf.workbench.report.table import Table, csv_text, without_repeats

__all__ = ["forest_figure", "pool_csv", "write_pool"]


#: Largest number of fits in the heading of the page; the plots name all.
_NAMED = 6


def forest_figure(one: PooledParameter, probability: float = 0.95) -> Figure:
    """Return the forest plot of a parameter: each fit, the mean, and the interval of the next assembly."""
    percent = f"{100 * probability:g} %"
    rows = [
        *zip(one.labels, one.estimates, strict=True),
        (f"mean, {percent}", one.mean),
        (f"next assembly, {percent}", one.next_one),
    ]
    panel = Panel(
        "", f"{one.name}, {one.unit}", "",
        intervals=tuple(Interval(_row_name(label, one), own.low, own.value, own.high) for label, own in rows),
        levels=(Level("mean", one.mean.value, "actual"),), interval_names=("value", "95 %"),
    )  # fmt: skip
    place = f", both at {place_of(one)}" if one.at else ""
    caption = f"{one.name} of each fit with its 95 % interval; the mean; where the next assembly lies{place}"
    return Figure(f"forest-{one.name.replace(',', '-')}", caption, (panel,))


def _row_name(label: str, one: PooledParameter) -> str:
    return f"{label} (outlying)" if label in one.outlying else label


def write_pool(pooled: PooledFits, path: Path | str, *, command: str = "") -> Path:
    """Write the page of pooled fits as one self-contained HTML file, and return its path.

    Parameters
    ----------
    pooled : PooledFits
        Result of `pool`.
    path : Path or str
        Path of the file, in a folder that exists.
    command : str
        Command that pooled the fits, default empty.

    Returns
    -------
    Path
        Path of the written file.

    Raises
    ------
    MissingPackageError
        jinja2 or matplotlib is missing.
    OSError
        The file cannot be written.

    See Also
    --------
    pool : mean and spread of a joint over several fits.
    """
    check_type("pooled", pooled, PooledFits)
    return write_document(_document(pooled, command), path)


def _document(pooled: PooledFits, command: str) -> Document:
    figures = [forest_figure(one, pooled.probability) for one in pooled.parameters.values()]
    sections = [
        Section("summary", "Summary", [Words(list(_sentences(pooled))), *words_of_findings(pooled.findings)]),
        Section("forest", "Fits, mean, and the next assembly", figures),
        Section("tables", "Tables", [_mean_table(pooled), _spread_table(pooled), _trend_table(pooled)]),
        section_of_command(command),
    ]
    named = f": {', '.join(pooled.labels)}" if len(pooled.labels) <= _NAMED else ""
    about = f"{len(pooled.labels)} fits of the same joint{named}."
    return Document(f"A joint from {len(pooled.labels)} fits", about, sections)


def _sentences(pooled: PooledFits) -> Iterator[str]:
    percent = f"{100 * pooled.probability:g} %"
    for one in pooled.parameters.values():
        spread = "; ".join(f"over {own.factor} {_spread(one, own.value)}" for own in one.spreads)
        unit, size = prefixed_unit(one.unit, abs(one.mean.value))
        value, low, high, least, most = (
            f"{number / size:.4g}"
            for number in (one.mean.value, one.mean.low, one.mean.high, one.next_one.low, one.next_one.high)
        )
        place = f" at {place_of(one)}" if one.at else ""
        yield (
            f"{one.name} = {value} {unit}{place} ({percent}: {low} to {high}); scatter {spread}; the next assembly"
            f"{place and ' there'} lies between {least} and {most} {unit} with {percent} probability."
        )


def _spread(one: PooledParameter, value: float) -> str:
    return f"{100 * value:.2g} %" if one.scale == "log" else f"{value:.2g} {one.unit}"


def _mean_table(pooled: PooledFits) -> Table:
    rows = tuple(
        (one.name, one.unit, one.mean.value, one.mean.low, one.mean.high, one.next_one.low, one.next_one.high,
         place_of(one), len(one.labels)) for one in pooled.parameters.values()
    )  # fmt: skip
    columns = ("parameter", "unit", "mean", "mean from", "mean to", "next from", "next to", "at", "fits")
    return without_repeats(Table("means", "Means, and the next assembly", columns, rows))


def _spread_table(pooled: PooledFits) -> Table:
    rows = tuple(
        (one.name, own.factor, own.levels, _spread(one, own.value), _spread(one, own.low), _spread(one, own.high),
         shown_chance(own.p_value)) for one in pooled.parameters.values() for own in one.spreads
    )  # fmt: skip
    columns = ("parameter", "factor", "levels", "spread", "from", "to", "p")
    return Table("spreads", "Spread beyond the errors of the fits (REML)", columns, rows)


def _trend_table(pooled: PooledFits) -> Table:
    rows = tuple(
        (one.name, own.factor, "exponent" if one.scale == "log" else f"{one.unit} by unit", own.value, own.low,
         own.high, shown_chance(own.p_value)) for one in pooled.parameters.values() for own in one.trends
    )  # fmt: skip
    return Table("trends", "Changes with a number", ("parameter", "factor", "as", "change", "from", "to", "p"), rows)


def pool_csv(pooled: PooledFits) -> str:
    """Return a CSV table with a line for each fit, mean, next assembly, spread and trend of each parameter."""
    rows: list[tuple[object, ...]] = [("parameter", "unit", "what", "of", "value", "low", "high", "p")]
    for one in pooled.parameters.values():
        lines: list[tuple[str, str, Estimate | FactorSpread | FactorTrend, object]] = [
            *(("fit", label, own, "") for label, own in zip(one.labels, one.estimates, strict=True)),
            ("mean", place_of(one), one.mean, ""), ("next assembly", place_of(one), one.next_one, ""),
            *(("spread", own.factor, own, own.p_value) for own in one.spreads),
            *(("trend", own.factor, own, own.p_value) for own in one.trends),
        ]  # fmt: skip
        rows += [(one.name, one.unit, what, of, own.value, own.low, own.high, p) for what, of, own, p in lines]
    return csv_text(rows)
