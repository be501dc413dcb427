"""Text tables: a heading, and rows of cells between commas, semicolons or tabs."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

from jointfrf.errors import FileContentError
from jointfrf.files import text_of

__all__ = ["TextTable", "read_text_table"]


class TextTable(NamedTuple):
    """A table as it is in a file.

    Attributes
    ----------
    stated : dict of str
        What comments such as ``# unit: m/N`` say, by their word in small letters.
    heading : list of str
        Names of the columns.
    rows : list of (str, list of str)
        File and line, with which messages begin, and the cells; as many as the heading has.
    decimal_comma : bool
        Whether numbers may have one: not where commas are between the cells.
    """

    stated: dict[str, str]
    heading: list[str]
    rows: list[tuple[str, list[str]]]
    decimal_comma: bool

    def number(self, cell: str) -> float:
        """Return the number in a cell.

        Raises
        ------
        ValueError
            It is none.
        """
        return float(cell.replace(",", ".") if self.decimal_comma else cell)


def read_text_table(path: Path) -> TextTable:
    """Read a table; blank lines and lines that begin with ``#`` are no rows.

    Raises
    ------
    FileContentError
        It cannot be read, it is not a text file, it is empty, or a row has not as many cells as the heading.
    """
    stated: dict[str, str] = {}
    heading: list[str] = []
    rows: list[tuple[str, list[str]]] = []
    mark = ","
    for number, line in enumerate(text_of(path).splitlines(), start=1):
        text = line.strip("\x1a")  # the end of a file of DOS
        if not text.strip(",;\t "):
            continue
        if text.lstrip().startswith("#"):
            key, colon, value = text.lstrip("# ").partition(":")
            if colon:
                stated[key.strip().lower()] = value.strip(" ,;\t")
            continue
        mark = mark if heading else next((each for each in "\t;," if each in text), ",")
        try:
            (cells,) = csv.reader([text], delimiter=mark, skipinitialspace=True)
        except csv.Error as error:
            raise FileContentError(f"{path}: line {number} cannot be read: {error}") from error
        cells = [cell.strip() for cell in cells]
        if not heading:
            heading = cells
            continue
        if len(cells) != len(heading):
            raise FileContentError(f"{path}: line {number} has {len(cells)} columns, the heading has {len(heading)}")
        rows.append((f"{path}: line {number}", cells))
    if not heading:
        raise FileContentError(f"{path} is empty")
    return TextTable(stated, heading, rows, mark != ",")
