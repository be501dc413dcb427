"""Verdicts: on natural frequencies beside the expected ones, and how many of all tables fit."""

from __future__ import annotations

from collections.abc import Sequence

from jointfrf.workbench.cases.keys import ExpectedFrequencies
from jointfrf.workbench.report.table import Cell, Table

__all__ = ["agreement", "failing_rows", "frequency_table", "verdict", "verdict_sentence"]


def verdict(good: bool | None) -> str:
    """Say whether something fits; nothing where that is not known."""
    return "" if good is None else "fits" if good else "does not fit"


def frequency_table(
    title: str,
    columns: Sequence[str],
    groups: Sequence[tuple[Sequence[Sequence[Cell]], Sequence[float], ExpectedFrequencies | None]],
    note: str,
) -> Table:
    """Build the table of natural frequencies beside the expected ones.

    Parameters
    ----------
    title : str
    columns : sequence of str
        What names a mode.
    groups : sequence of (names, frequencies, expected)
        Modes: the cells that name each, their frequencies in Hz, and what is known of them.
    note : str

    Returns
    -------
    Table
    """
    cells: list[tuple[Cell, ...]] = []
    for names, frequencies, expected in groups:
        for i, (name, freq) in enumerate(zip(names, frequencies, strict=True)):
            known = difference = good = None
            if expected is not None and i < len(expected.values):
                known = expected.values[i]
                difference = (freq / known - 1) * 100
                good = abs(difference) <= expected.within_percent
            cells.append((*name, freq, known, difference, verdict(good)))
    all_columns = (*columns, "found, Hz", "expected, Hz", "difference, %", "")
    failing = failing_rows(cells)
    return Table("natural-frequencies", title, all_columns, tuple(cells), failing, note, percentages=("difference, %",))


def failing_rows(cells: Sequence[Sequence[Cell]]) -> tuple[int, ...]:
    """Return the rows whose last cell says that they do not fit."""
    return tuple(i for i, row in enumerate(cells) if row[-1] == verdict(False))


def agreement(tables: Sequence[Table]) -> Table:
    """Build the table that counts the verdicts of others, for each noise and each set of bands by itself.

    Parameters
    ----------
    tables : sequence of Table

    Returns
    -------
    Table
        How many rows fit, and which parameters do not.
    """
    cells: list[tuple[Cell, ...]] = []
    for table in tables:
        groups: dict[tuple[Cell, ...], list[tuple[Cell, bool]]] = {}
        for i, row in enumerate(table.rows):
            named = dict(zip(table.columns, row, strict=True))
            if named.get("", verdict(None)) != verdict(None):
                own = groups.setdefault((named.get("noise"), named.get("bands")), [])
                own.append((named.get("parameter"), i not in table.failing))
        for group, judged in groups.items():
            good = sum(fits for _, fits in judged)
            others = ", ".join(str(name) for name, fits in judged if name is not None and not fits)
            cells.append((table.title, *group, f"{good} of {len(judged)}", others, verdict(good == len(judged))))
    columns = ("table", "noise", "bands", "rows that fit", "parameters that do not", "")
    return Table("agreement", "What fits", columns, tuple(cells), failing_rows(cells))


def verdict_sentence(summary: Sequence[Table]) -> str:
    """Say how many of the comparisons counted by `agreement` fit, and in which tables others do not; "" without any."""
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
