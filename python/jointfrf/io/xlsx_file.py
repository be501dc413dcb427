"""Sheets of Excel workbooks (.xlsx) as tables; the package openpyxl reads them."""

from __future__ import annotations

import warnings
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import ReadLimit, check_file, damage_named
from jointfrf.io.csv_file import TextTable
from jointfrf.kernel.arguments import one_line
from jointfrf.spelling import did_you_mean, some_of

__all__ = ["is_sheet", "read_sheet", "sheet_names"]

_SUFFIX = ".xlsx"
#: Number of sheets that a message names.
_SHOWN = 12


def is_sheet(path: Path) -> bool:
    """Return whether a path names a workbook, or sheets of one: ``test.xlsx``, ``test.xlsx#Channels_AB``."""
    return path.name.partition("#")[0].lower().endswith(_SUFFIX)


def sheet_names(path: Path) -> tuple[Path, list[str]]:
    """Return the workbook and the sheets that a path names after a ``#``, between commas."""
    file, _, names = path.name.partition("#")
    return path.with_name(file), [name.strip() for name in names.split(",") if name.strip()]


def read_sheet(path: Path, sheet: str | None = None) -> TextTable:
    """Return a sheet as a table: the first row that is not empty is the heading.

    Parameters
    ----------
    path : Path
        Name of the workbook.
    sheet : str, optional
        Name of the sheet; the only one by default.

    Returns
    -------
    TextTable
        Cells as texts, numbers in the form of Python; rows without a value are omitted.

    Raises
    ------
    FileContentError
        The file is no workbook or damaged, there is no such sheet, or it is empty.
    MissingPackageError
        The package openpyxl is not installed.
    """
    openpyxl = import_extra("openpyxl")
    check_file(path)
    others = (zipfile.BadZipFile, zlib.error, SyntaxError, LookupError, AttributeError)
    with damage_named(path, "an Excel workbook", *others), path.open("rb") as stream, warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # for styles and validations, which are not read
        _check_parts(path)
        book = openpyxl.load_workbook(stream, read_only=True, data_only=True, keep_links=False)
        name = _chosen(path, sheet, list(book.sheetnames))
        rows = [list(row) for row in book[name].iter_rows(values_only=True)]
    filled = [(i, row) for i, row in enumerate(rows, start=1) if any(cell not in (None, "") for cell in row)]
    if not filled:
        raise FileContentError(f"{path}: sheet {name} is empty; name another one as {path.name}#NAME")
    heading = [_text(cell) for cell in filled[0][1]]
    width = max((i for i, word in enumerate(heading, start=1) if word), default=0)
    return TextTable({}, heading[:width], _rows(f"{path}: sheet {name}", filled[1:], width), False)


def _check_parts(path: Path) -> None:
    """Check the unpacked size of the parts of the file, and that none defines entities."""
    limit = ReadLimit(path)
    with zipfile.ZipFile(path) as archive:
        for part in archive.infolist():
            limit.take(part.file_size)
        for part in archive.infolist():
            if part.filename.endswith((".xml", ".rels")) and b"<!DOCTYPE" in archive.read(part):
                raise FileContentError(f"{path} defines entities ({part.filename}), as no workbook does; save it again")


def _chosen(path: Path, sheet: str | None, known: list[str]) -> str:
    if sheet is None and len(known) == 1:
        return known[0]
    if sheet not in known:
        which = "has several sheets" if sheet is None else f"has no sheet {one_line(sheet)}"
        hint = "" if sheet is None else did_you_mean(sheet, known)
        raise FileContentError(f"{path} {which}; name one as {path.name}#NAME, out of {some_of(known, _SHOWN)}{hint}")
    return sheet


def _rows(where: str, rows: list[tuple[int, list[Any]]], width: int) -> Iterator[tuple[str, list[str]]]:
    for number, row in rows:
        cells = [_text(cell) for cell in row]
        if any(cells[width:]):
            raise FileContentError(f"{where}, row {number} has {len(cells)} columns, the heading has {width}")
        yield f"{where}, row {number}", [*cells, *[""] * (width - len(cells))][:width]


def _text(cell: Any) -> str:
    if cell is None:
        return ""
    is_whole = isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15
    return (str(int(cell)) if is_whole else str(cell)).strip()
