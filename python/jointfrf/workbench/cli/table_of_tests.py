"""Tables of several tests: a row for each, with its file or numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jointfrf.errors import FileContentError
from jointfrf.io.csv_file import read_text_table
from jointfrf.spelling import did_you_mean

__all__ = ["labels_of", "read_rows"]


def read_rows(path: Path, names: Sequence[str], *, numbers: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return the rows of a CSV table by the names of the columns.

    Parameters
    ----------
    path : Path
    names : sequence of str
        Columns that the table must have.
    numbers : sequence of str
        Columns of numbers; all others are texts.

    Raises
    ------
    FileContentError
        A column is missing or exists twice, there is no row, or a cell is no number.
    """
    table = read_text_table(path)
    for name in names:
        if name not in table.heading:
            raise FileContentError(f"{path}: column {name} is missing; add it{did_you_mean(name, table.heading)}")
    if len(set(table.heading)) < len(table.heading):
        raise FileContentError(f"{path}: two columns have the same name; rename one")
    rows = []
    for where, cells in table.rows:
        row: dict[str, Any] = dict(zip(table.heading, cells, strict=True))
        for name in (one for one in numbers if one in row):
            try:
                row[name] = table.number(row[name])
            except ValueError:
                raise FileContentError(f"{where}: {name} {row[name]!r} is no number; correct it") from None
        rows.append(row)
    if not rows:
        raise FileContentError(f"{path}: has no rows; add one for each test")
    return rows


def labels_of(files: Sequence[Path]) -> list[str]:
    """Return a name for each file: without folder and suffix, if all of these are different."""
    labels = [path.stem for path in files]
    return labels if len(set(labels)) == len(labels) else [str(path) for path in files]
