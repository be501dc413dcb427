"""Matrices of CalculiX (`*FREQUENCY, SOLVER=MATRIXSTORAGE`), and of Abaqus (`*MATRIX OUTPUT`) in its text formats."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointfrf.files import ReadLimit
from jointfrf.workbench.fe.matrix_format import MatrixFormat, StoredMatrix, matrix_of_entries, matrix_of_labels

__all__ = ["ABAQUS", "CALCULIX"]

#: A line is ``1 1 1.`` at least.
_LEAST_LINE = 6


def _triplets(path: Path, limit: ReadLimit, columns: int, delimiter: str | None = None) -> np.ndarray:
    """Return the numbers of a text table, shape (m, columns); lines that begin with ``*`` are left out.

    Raises
    ------
    ValueError
        A line contains something else, or numbers of rows are no whole numbers.
    """
    limit.take(8 * columns * (path.stat().st_size // _LEAST_LINE + 1) // 2)
    found = np.loadtxt(path, comments="*", delimiter=delimiter, ndmin=2, encoding="latin-1")
    if found.shape[0] == 0 or found.shape[1] != columns:
        raise ValueError(f"a line must contain {columns} numbers, not {found.shape[1] if found.size else 0}")
    places = found[:, :-1]
    if not np.isfinite(places).all() or (places != np.rint(places)).any() or abs(places).max() > 2**53:
        raise ValueError("numbers of rows and columns must be whole numbers")
    return found


def _read_calculix(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    found = _triplets(path, limit, 3)
    rows, columns = found[:, 0].astype(np.int64) - 1, found[:, 1].astype(np.int64) - 1
    n = int(max(rows.max(), columns.max())) + 1
    matrix, completed = matrix_of_entries(path, rows, columns, found[:, 2], n, limit, symmetric="possible")
    return StoredMatrix(matrix, program="CalculiX", completed=completed)


CALCULIX = MatrixFormat(
    name="CalculiX",
    suffixes=(".sti", ".mas"),
    content="`*FREQUENCY, SOLVER=MATRIXSTORAGE`; names of DOFs from the `.dof` beside it",
    read=_read_calculix,
    is_own=lambda path, head: path.suffix.lower() in (".sti", ".mas"),
    dof_suffix=".dof",
)


#: Numbers of a line: node and DOF of row and column, and the entry; or row, column, entry.
_LABELS, _COORDINATE = 5, 3


def _first_line(head: bytes) -> str:
    """Return the first line that is no comment and no keyword."""
    lines = (line.strip() for line in head.decode("latin-1").splitlines())
    return next((line for line in lines if line and not line.startswith("*")), "")


def _fields(line: str) -> list[str]:
    return [word.strip() for word in line.split(",")] if "," in line else line.split()


def _is_own(path: Path, head: bytes) -> bool:
    if path.suffix.lower() != ".mtx" or head.lstrip().startswith(b"%%"):
        return False
    return len(_fields(_first_line(head))) in (_LABELS, _COORDINATE)


def _read_abaqus(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    with path.open("rb") as file:
        line = _first_line(file.read(1 << 13))
    columns, delimiter = len(_fields(line)), "," if "," in line else None
    found = _triplets(path, limit, columns, delimiter)
    if columns == _LABELS:
        return matrix_of_labels(path, found[:, :4].astype(np.int64), found[:, 4], limit, "Abaqus")
    rows, cols = found[:, 0].astype(np.int64) - 1, found[:, 1].astype(np.int64) - 1
    n = int(max(rows.max(), cols.max())) + 1
    matrix, completed = matrix_of_entries(path, rows, cols, found[:, 2], n, limit, symmetric="possible")
    return StoredMatrix(matrix, None, "Abaqus", completed)


ABAQUS = MatrixFormat(
    name="Abaqus",
    suffixes=(".mtx",),
    content="`*MATRIX OUTPUT` with `FORMAT=MATRIX INPUT` or `LABELS`, which name their DOFs, or `COORDINATE`",
    read=_read_abaqus,
    is_own=_is_own,
)
