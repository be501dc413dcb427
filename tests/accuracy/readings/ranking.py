"""Which reading explains most: of one printed table, and of all of them; as tables."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from jointfrf.workbench.report.table import Cell, Table

from .reading import Reading
from .study import Explained

_READING = ("number", "law", "level is", "common to", "reciprocal", "relative to")
_LINES = ("lines, Hz", "level")
_FOUND = ("inside", "of", "log density")
_NOTE = (
    "Inside: printed values between the 2.5 and 97.5 percentile of the realisations. Log density: sum over the "
    "printed values of the logarithm of the density of asinh(value / actual value). Level: share of the printed one."
)


@dataclass(frozen=True)
class Total:
    """What one reading explains of all printed tables, with one spacing of the lines.

    Attributes
    ----------
    reading : Reading
    spacing : float
        Hz; of all structures but those with a spacing of their own.
    share : float
        Level as a share of the printed one.
    parts : tuple of Explained
        One for each printed table: where it can be computed in several ways, the one of the largest density.
    """

    reading: Reading
    spacing: float
    share: float
    parts: tuple[Explained, ...]

    @property
    def inside(self) -> int:
        """Printed values inside the central 95 %."""
        return sum(part.inside for part in self.parts)

    @property
    def count(self) -> int:
        """Printed values."""
        return sum(len(part.scores) for part in self.parts)

    @property
    def log_density(self) -> float:
        """Sum over the printed values."""
        return sum(part.log_density for part in self.parts)


def totals(explained: Sequence[Explained], spacings: Sequence[float]) -> list[Total]:
    """Add up over all printed tables, the largest log density first.

    Parameters
    ----------
    explained : sequence of Explained
        Of all structures.
    spacings : sequence of float
        Hz.

    Returns
    -------
    list of Total
    """
    found: dict[tuple[Reading, float, float], dict[object, Explained]] = {}
    for one in explained:
        for spacing in spacings if one.own_spacing else (one.spacing,):
            parts = found.setdefault((one.reading, spacing, one.share), {})
            before = parts.get(one.table.content)
            if before is None or one.log_density > before.log_density:
                parts[one.table.content] = one
    every = [Total(reading, spacing, share, tuple(own.values())) for (reading, spacing, share), own in found.items()]
    return sorted(every, key=lambda total: -total.log_density)


def by_table(explained: Sequence[Explained]) -> dict[str, list[Explained]]:
    """Sort by printed table, the largest log density first; readings that are the same one there stand once.

    Parameters
    ----------
    explained : sequence of Explained

    Returns
    -------
    dict of str to list of Explained
        Source, with the level of the noise and the number of values.
    """
    found: dict[str, dict[tuple[object, ...], Explained]] = {}
    for one in explained:
        same = (one.table.way, one.spacing, one.share, one.scores)
        name = f"{one.table.source}, {100 * one.table.level:g} %, {len(one.scores)} values"
        found.setdefault(name, {}).setdefault(same, one)
    return {name: sorted(own.values(), key=lambda one: -one.log_density) for name, own in found.items()}


def best_by_choice(every: Sequence[Total]) -> list[tuple[str, str, Total]]:
    """Find the best reading with each single choice held: question, choice, best.

    Parameters
    ----------
    every : sequence of Total
        Sorted, as `totals` returns them.

    Returns
    -------
    list of (str, str, Total)
    """
    found: dict[tuple[str, str], Total] = {}
    for total in every:
        reading = total.reading
        for question, choice in (
            ("number", f"{reading.parts} {reading.law}, {reading.level_means}"),
            ("common to", reading.sharing),
            ("reciprocal", "yes" if reading.reciprocal else "no"),
            ("relative to", reading.reference),
            ("lines, Hz", f"{total.spacing:g}"),
            ("level, share of the printed one", f"{total.share:g}"),
        ):
            found.setdefault((question, choice), total)
    order = list(dict.fromkeys(question for question, _ in found))
    return [(*key, total) for key, total in sorted(found.items(), key=lambda item: order.index(item[0][0]))]


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
