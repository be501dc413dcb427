"""The study of the readings as tables."""

from __future__ import annotations

import re
from collections.abc import Sequence

from jointfrf.cases.known_joint.readings.ranking import Total, best_by_choice, by_table
from jointfrf.cases.known_joint.readings.reading import Reading
from jointfrf.cases.known_joint.readings.study import Explained
from jointfrf.report.table import Cell, Table

__all__ = ["altogether_table", "choices_table", "source_tables", "values_table"]

_READING = ("number", "law", "level is", "common to", "reciprocal", "relative to")
_LINES = ("lines, Hz", "level")
_FOUND = ("inside", "of", "log density")
_NOTE = (
    "Inside: printed values between the 2.5 and 97.5 percentile of the realisations. Log density: sum over the "
    "printed values of the logarithm of the density of asinh(value / actual value). Level: share of the printed one."
)


def _cells(reading: Reading, spacing: float, share: float) -> tuple[Cell, ...]:
    named = (reading.parts, reading.law, reading.level_means, reading.sharing, "yes" if reading.reciprocal else "no")
    return (*named, reading.reference, f"{spacing:g}", f"{share:g}")


def _found(one: Explained | Total, count: int) -> tuple[Cell, ...]:
    return str(one.inside), str(count), one.log_density


def altogether_table(every: Sequence[Total], top: int | None = None) -> Table:
    """Build the table of readings by what they explain of all printed values; the first `top` of them."""
    shown = every if top is None else every[:top]
    rows = tuple((*_cells(one.reading, one.spacing, one.share), *_found(one, one.count)) for one in shown)
    columns = (*_READING, *_LINES, *_FOUND)
    return Table("altogether", "All printed values", columns, rows, note=_NOTE, percentages=("log density",))


def choices_table(every: Sequence[Total]) -> Table:
    """Build the table of the best reading with each choice held."""
    rows = tuple((question, choice, *_found(one, one.count)) for question, choice, one in best_by_choice(every))
    title = "The best that a reading with this choice explains"
    return Table("choices", title, ("question", "choice", *_FOUND), rows, note=_NOTE, percentages=("log density",))


def source_tables(explained: Sequence[Explained], top: int | None = None) -> list[Table]:
    """Build a table of readings for each printed table; the first `top` of them."""
    tables = []
    for source, own in by_table(explained).items():
        rows = tuple(
            (one.table.way, *_cells(one.reading, one.spacing, one.share), *_found(one, len(one.scores)))
            for one in (own if top is None else own[:top])
        )
        key = re.sub(r"[^a-z0-9]+", "-", source.lower()).strip("-")
        note = f"{_NOTE} Readings that are the same one here stand once."
        columns = ("method, bands", *_READING, *_LINES, *_FOUND)
        title = source[:1].upper() + source[1:]
        tables.append(Table(key, title, columns, rows, note=note, percentages=("log density",)))
    return tables


def values_table(explained: Sequence[Explained]) -> Table:
    """Build the table of every printed value beside the realisations of every reading."""
    rows = tuple(
        (
            one.table.source, one.table.way, *_cells(one.reading, one.spacing, one.share), value.name, value.value,
            found.median, found.low, found.high, found.percentile, "inside" if found.inside else "outside",
            found.log_density,
        )
        for one in explained
        for value, found in zip(one.table.values, one.scores, strict=True)
    )  # fmt: skip
    columns = (
        "source", "method, bands", *_READING, *_LINES, "value", "thesis", "median", "2.5 %", "97.5 %", "percentile", "",
        "log density",
    )  # fmt: skip
    return Table("values", "Every printed value", columns, rows)
