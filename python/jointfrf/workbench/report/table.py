"""Tables as data, as aligned text, as CSV, and as formatted cells, with the verdict in the first column."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.spelling import visible

__all__ = [
    "VERDICT",
    "Cell",
    "Table",
    "as_text",
    "csv_cell",
    "csv_text",
    "number",
    "plain_rows",
    "shown",
    "table_csv",
    "turned",
    "without_repeats",
    "written",
]

Cell = str | float | Parameter | None

#: Heading of verdicts.
VERDICT = "verdict"
#: Significant digits of values and of percentages.
_DIGITS, _DIGITS_OF_PERCENT = 5, 3
#: Percentage below which a cell shows only this limit: no measurement and no model is so exact.
_LEAST_PERCENT = 1e-3
#: First characters of a formula of a spreadsheet.
_FORMULA = ("=", "+", "-", "@")
#: Numbers with blanks between, which are no formula.
_NUMBERS = re.compile(r"(?:[-+]?[\d.]++(?:e[-+]?\d++)? ?)++")


@dataclass(frozen=True)
class Table:
    """A table: cells are texts, numbers or parameters.

    Attributes
    ----------
    key : str
        Name of the file of the table, and of its place on a page.
    title : str
        Heading of the table.
    columns : tuple of str
        Headings of the columns, "quantity, unit". A column without a name contains verdicts and is shown first, see
        `shown`.
    rows : tuple of tuple
        Cells by row.
    failing : tuple of int
        Numbers of rows with a negative verdict.
    note : str
        Note below the table.
    percentages : tuple of str
        Columns that are written with three digits instead of five.
    """

    key: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    failing: tuple[int, ...] = ()
    note: str = ""
    percentages: tuple[str, ...] = ()

    @property
    def is_number(self) -> list[bool]:
        """Return for each column whether it contains numbers."""
        return [any(isinstance(row[c], float) for row in self.rows) for c in range(len(self.columns))]


def shown(table: Table) -> Table:
    """Return a table with its verdicts, if any, in a named first column.

    Examples
    --------
    >>> from jointfrf.workbench.report.table import Table, shown
    >>> table = shown(Table("k", "Stiffness", ("k, N/m", ""), ((2.0, "fits"),)))
    >>> table.columns, table.rows
    (('verdict', 'k, N/m'), (('fits', 2.0),))
    """
    if "" not in table.columns:
        return table
    at = table.columns.index("")

    def first(row: tuple[Cell, ...]) -> tuple[Cell, ...]:
        return (row[at], *row[:at], *row[at + 1 :])

    columns = (VERDICT, *table.columns[:at], *table.columns[at + 1 :])
    return replace(table, columns=columns, rows=tuple(first(row) for row in table.rows))


def without_repeats(table: Table) -> Table:
    """Return a table without percentiles that repeat their median, and without empty columns.

    Examples
    --------
    >>> from jointfrf.workbench.report.table import Table, without_repeats
    >>> columns = ("FRF", "peak: median, %", "peak: 2.5 %", "peak: 97.5 %", "thesis")
    >>> table = without_repeats(Table("e", "Errors", columns, (("a", 0.0, 0.0, 0.0, None), ("b", 1.0, 1.0, 1.0, ""))))
    >>> table.columns, table.rows
    (('FRF', 'peak: median, %'), (('a', 0.0), ('b', 1.0)))
    """
    ends = [c for c, name in enumerate(table.columns) if name.endswith("97.5 %") and c > 1]
    rows = [list(row) for row in table.rows]
    for row in rows:
        for c in ends:
            if row[c] == row[c - 1] == row[c - 2]:
                row[c] = row[c - 1] = None
    kept = [c for c in range(len(table.columns)) if not rows or any(row[c] not in (None, "") for row in rows)]
    return replace(
        table, columns=tuple(table.columns[c] for c in kept), rows=tuple(tuple(row[c] for c in kept) for row in rows)
    )


def turned(table: Table) -> Table:
    """Return a table of many columns with a row for each of its numbers, and a column for each row.

    Examples
    --------
    >>> from jointfrf.workbench.report.table import Table, turned
    >>> table = turned(Table("f", "Errors", ("by", "x, %", "y, %"), (("A", 1.0, 2.0), ("B", 3.0, 4.0))))
    >>> table.columns, table.rows
    (('by', 'A', 'B'), (('x, %', 1.0, 3.0), ('y, %', 2.0, 4.0)))
    """
    names = table.is_number.index(True) if any(table.is_number) else 1
    heads = tuple(", ".join(map(number, row[:names])) for row in table.rows)
    rows = tuple((column, *(row[c] for row in table.rows)) for c, column in enumerate(table.columns[names:], names))
    percentages = heads if set(table.columns[names:]) <= set(table.percentages) else ()
    columns = (", ".join(table.columns[:names]), *heads)
    return replace(table, columns=columns, rows=rows, failing=(), percentages=percentages)


def number(value: Cell, digits: int = _DIGITS) -> str:
    """Return the text of a cell with `digits` significant digits, without an exponent if it is short."""
    if value is None:
        return ""
    if isinstance(value, str | Parameter):
        return str(value)
    if not np.isfinite(value):
        return str(value)
    if value == 0 or 1e-3 <= abs(value) < 10**6:
        places = digits if value == 0 else max(0, digits - 1 - int(np.floor(np.log10(abs(value)))))
        text = f"{value + 0.0:.{places}f}"  # a zero has no sign
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.') if '.' in mantissa else mantissa}e{int(exponent)}"


def written(table: Table) -> list[list[str]]:
    """Return the texts of the cells of a table: values with five digits, percentages with three."""
    digits = [_DIGITS_OF_PERCENT if column in table.percentages else _DIGITS for column in table.columns]
    return [[_written(cell, d) for cell, d in zip(row, digits, strict=True)] for row in table.rows]


def _written(cell: Cell, digits: int) -> str:
    """Return the text of a cell, with a limit for a negligible percentage."""
    if digits == _DIGITS_OF_PERCENT and isinstance(cell, float) and 0 < abs(cell) < _LEAST_PERCENT:
        return f"{'< ' if cell > 0 else '> -'}{_LEAST_PERCENT:g}"
    return number(cell, digits)


def as_text(table: Table) -> str:
    """Return a table in aligned columns, numbers to the right."""
    table = shown(table)
    cells = written(table)
    widths = [max(len(row[c]) for row in [list(table.columns), *cells]) for c in range(len(table.columns))]

    def line(row: list[str] | tuple[str, ...]) -> str:
        padded = (x.rjust(w) if right else x.ljust(w) for x, w, right in zip(row, widths, table.is_number, strict=True))
        return "  ".join(padded).rstrip()

    return "\n".join([table.title, line(table.columns), "  ".join("-" * w for w in widths), *map(line, cells)])


def plain_rows(table: Table) -> list[list[str | float | None]]:
    """Return the rows with parameters by their names, for JSON and CSV."""
    return [[cell.name if isinstance(cell, Parameter) else cell for cell in row] for row in table.rows]


def csv_cell(cell: object) -> object:
    """Return a cell of a CSV file, with an apostrophe before a text that a spreadsheet would take for a formula.

    Examples
    --------
    >>> from jointfrf.workbench.report.table import csv_cell
    >>> csv_cell("=HYPERLINK(1)"), csv_cell("k_y"), csv_cell(-1.5), csv_cell(None)
    ("'=HYPERLINK(1)", 'k_y', -1.5, '')
    """
    if cell is None:
        return ""
    return _csv_text(cell) if isinstance(cell, str) else cell


@lru_cache(1000)
def _csv_text(cell: str) -> str:
    """Return the text of a cell; cached, because a curve has its name on every line."""
    text = visible(cell)
    return f"'{text}" if text.lstrip()[:1] in _FORMULA and not _NUMBERS.fullmatch(text) else text


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV, numbers in full."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(map(csv_cell, row) for row in rows)
    return text.getvalue()


def table_csv(table: Table) -> str:
    """Return a table as CSV."""
    table = shown(table)
    return csv_text([table.columns, *plain_rows(table)])
