"""Comparison of results with `expected.toml`: rows with verdicts, their tables, and numbers of rows that fit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.cases.keys import ExpectedFrequencies
from jointfrf.workbench.report.axes import percentiles
from jointfrf.workbench.report.table import Cell, Table

__all__ = [
    "Compared",
    "Ranked",
    "agreement",
    "compared_frequencies",
    "compared_table",
    "ranked",
    "tables_of_sources",
    "verdict_sentence",
]

_FITS, _DOES_NOT_FIT = "fits", "does not fit"


class Compared(NamedTuple):
    """Row of results and its verdict: whether it fits the expected number, or None without an expected number."""

    cells: tuple[Cell, ...]
    fits: bool | None


class Ranked(NamedTuple):
    """Rank of an expected value among realisations.

    Attributes
    ----------
    median, low, high : float
        Percentiles 50, 2.5 and 97.5 of the realisations.
    percentile : float or None
        Percentage of the realisations below the expected value; None without an expected value.
    fits : bool or None
        Whether the expected value lies between `low` and `high`.
    """

    median: float
    low: float
    high: float
    percentile: float | None
    fits: bool | None


def ranked(values: FloatArray, expected: float | None) -> Ranked:
    """Return the percentiles of realisations, and the rank of an expected value among them."""
    low, median, high = percentiles(values)
    if expected is None:
        return Ranked(median, low, high, None, None)
    return Ranked(median, low, high, float((values < expected).mean() * 100), low <= expected <= high)


def compared_table(
    key: str,
    title: str,
    columns: Sequence[str],
    rows: Iterable[Compared],
    note: str = "",
    percentages: tuple[str, ...] = (),
) -> Table:
    """Return the table of compared rows, with their verdicts in the last column."""
    own = list(rows)
    words = {True: _FITS, False: _DOES_NOT_FIT, None: ""}
    cells = tuple((*row.cells, words[row.fits]) for row in own)
    failing = tuple(i for i, row in enumerate(own) if row.fits is not None and not row.fits)
    return Table(key, title, (*columns, ""), cells, failing, note, percentages)


def tables_of_sources(
    what: str,
    columns: Sequence[str],
    rows: Iterable[tuple[str, Compared]],
    note: str,
    percentages: tuple[str, ...] = (),
) -> list[Table]:
    """Return one table for each source of expected numbers; its title is the source followed by `what`."""
    by_source: dict[str, list[Compared]] = {}
    for source, row in rows:
        by_source.setdefault(source, []).append(row)
    return [
        compared_table(
            re.sub(r"[^a-z0-9]+", "-", source.lower()).strip("-"), source[:1].upper() + source[1:] + what, columns,
            own, note, percentages,
        )
        for source, own in by_source.items()
    ]  # fmt: skip


def compared_frequencies(
    title: str,
    columns: Sequence[str],
    groups: Iterable[tuple[Sequence[tuple[Cell, ...]], Sequence[float], ExpectedFrequencies | None]],
    note: str,
) -> Table:
    """Return the table of natural frequencies next to the expected ones.

    Parameters
    ----------
    title : str
        Title of the table.
    columns : sequence of str
        Headings of the cells that name a mode.
    groups : iterable of (names, frequencies, expected)
        Groups of modes: cells that name each mode, frequencies in Hz, and expected frequencies or None.
    note : str
        Note below the table.

    Returns
    -------
    Table

    See Also
    --------
    agreement : Table that counts the verdicts.
    """
    rows = []
    for names, frequencies, expected in groups:
        known = () if expected is None else expected.values
        for i, (name, freq) in enumerate(zip(names, frequencies, strict=True)):
            if expected is None or i >= len(known):
                rows.append(Compared((*name, freq, None, None), None))
                continue
            difference = (freq / known[i] - 1) * 100
            rows.append(Compared((*name, freq, known[i], difference), abs(difference) <= expected.within_percent))
    headings = (*columns, "found, Hz", "expected, Hz", "difference, %")
    return compared_table("natural-frequencies", title, headings, rows, note, ("difference, %",))


def agreement(tables: Sequence[Table]) -> Table:
    """Return the table that counts the verdicts of other tables for each noise and each set of bands.

    Parameters
    ----------
    tables : sequence of Table
        Tables with verdicts.

    Returns
    -------
    Table
        Numbers of rows that fit, and parameters that do not fit.

    See Also
    --------
    verdict_sentence : Summary in one sentence.
    """
    rows = []
    for table in tables:
        groups: dict[tuple[Cell, ...], list[tuple[Cell, bool]]] = {}
        for i, row in enumerate(table.rows):
            named = dict(zip(table.columns, row, strict=True))
            if named.get(""):
                own = groups.setdefault((named.get("noise"), named.get("bands")), [])
                own.append((named.get("parameter"), i not in table.failing))
        for group, judged in groups.items():
            good = sum(fits for _, fits in judged)
            others = ", ".join(str(name) for name, fits in judged if name is not None and not fits)
            cells = (table.title, *group, f"{good} of {len(judged)}", others)
            rows.append(Compared(cells, good == len(judged)))
    columns = ("table", "noise", "bands", "rows that fit", "parameters that do not")
    return compared_table("agreement", "What fits", columns, rows)


def verdict_sentence(summary: Sequence[Table]) -> str:
    """Return the number of comparisons in `agreement` that fit, and the tables with misfits; "" without comparisons."""
    table = next((one for one in summary if one.key == "agreement" and one.rows), None)
    if table is None:
        return ""
    total, failing = len(table.rows), list(dict.fromkeys(str(table.rows[i][0]) for i in table.failing))
    if not failing:
        return f"All {total} comparisons with what is known of the case fit." if total > 1 else "What is known fits."
    good = total - len(table.failing)
    return (
        f"{good} of {total} comparisons with what is known of the case fit. Not all rows fit in: {'; '.join(failing)}."
    )
