"""Expected natural frequencies of an assembly, and the table that compares them with the computed ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from jointfrf.cases.toml_table import TomlTable
from jointfrf.report.table import Cell, Table

__all__ = ["ExpectedFrequencies", "agreement", "frequency_table", "read_expected_frequencies", "verdict"]


@dataclass(frozen=True)
class ExpectedFrequencies:
    """Known natural frequencies, lowest first, Hz, and how far the computed ones may lie from them, percent."""

    source: str
    values: tuple[float, ...]
    within: float


def read_expected_frequencies(table: TomlTable) -> ExpectedFrequencies:
    """Read the keys of expected frequencies from a table, and close it."""
    found = ExpectedFrequencies(table.text("source"), tuple(table.numbers("values")), table.number("within_percent", 0))
    table.close()
    return found


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
    failing = []
    for names, frequencies, expected in groups:
        for i, (name, freq) in enumerate(zip(names, frequencies, strict=True)):
            known = difference = good = None
            if expected is not None and i < len(expected.values):
                known = expected.values[i]
                difference = (freq / known - 1) * 100
                good = abs(difference) <= expected.within
            if good is not None and not good:
                failing.append(len(cells))
            cells.append((*name, freq, known, difference, verdict(good)))
    all_columns = (*columns, "Hz", "expected Hz", "difference %", "")
    return Table(
        "natural-frequencies", title, all_columns, tuple(cells), tuple(failing), note, percentages=("difference %",)
    )


def agreement(table: Table) -> list[str]:
    """Say how many natural frequencies agree; nothing where none is known."""
    known = sum(row[table.columns.index("expected Hz")] is not None for row in table.rows)
    if not known:
        return []
    good = known - len(table.failing)
    return [f"{good} of {known} natural frequencies of the assembly agree with the expected values."]
