"""Comparison of results with `expected.toml`: rows with verdicts, tables of them, and how many fit."""

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
    """A row of results, and whether it fits the expected number; None without such a number."""

    cells: tuple[Cell, ...]
    fits: bool | None


class Ranked(NamedTuple):
    """An expected value among realisations.

    Attributes
    ----------
    median, low, high : float
        50, 2.5 and 97.5 percentile of the realisations.
    percentile : float or None
        Share of the realisations below the expected value, percent; None without an expected value.
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
    """Return one table for each source of expected numbers; its title is the source, then `what`."""
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
    columns : sequence of str
        Headings of the cells that name a mode.
    groups : iterable of (names, frequencies, expected)
        Modes: the cells that name each, their frequencies in Hz, and the expected frequencies.
    note : str

    Returns
    -------
    Table
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
    """Return the table that counts the verdicts of others, separately for each noise and each set of bands.

    Parameters
    ----------
    tables : sequence of Table

    Returns
    -------
    Table
        How many rows fit, and which parameters do not.
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
    """Return how many of the comparisons counted by `agreement` fit, and the tables of the rest; "" without any."""
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
