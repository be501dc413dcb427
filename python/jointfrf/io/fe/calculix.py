"""Matrices that CalculiX stores (`*FREQUENCY, SOLVER=MATRIXSTORAGE`): `.sti`, `.mas`, and names of rows in `.dof`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointfrf.files import ReadLimit
from jointfrf.io.fe.matrix_format import MatrixFormat, StoredMatrix, matrix_of_entries

__all__ = ["CALCULIX", "triplets"]

#: A line is ``1 1 1.`` at least.
_LEAST = 6


def triplets(path: Path, limit: ReadLimit, columns: int, delimiter: str | None = None) -> np.ndarray:
    """Return the numbers of a text table, shape (m, columns); lines that begin with ``*`` are left out.

    Raises
    ------
    ValueError
        A line holds something else, or numbers of rows are no whole numbers.
    """
    limit.take(8 * columns * (path.stat().st_size // _LEAST + 1) // 2)
    found = np.loadtxt(path, comments="*", delimiter=delimiter, ndmin=2, encoding="latin-1")
    if found.shape[0] == 0 or found.shape[1] != columns:
        raise ValueError(f"a line must hold {columns} numbers, not {found.shape[1] if found.size else 0}")
    places = found[:, :-1]
    if not np.isfinite(places).all() or (places != np.rint(places)).any() or abs(places).max() > 2**53:
        raise ValueError("numbers of rows and columns must be whole numbers")
    return found


def _read(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    found = triplets(path, limit, 3)
    rows, columns = found[:, 0].astype(np.int64) - 1, found[:, 1].astype(np.int64) - 1
    n = int(max(rows.max(), columns.max())) + 1
    matrix, completed = matrix_of_entries(path, rows, columns, found[:, 2], n, limit, symmetric=True)
    return StoredMatrix(matrix, program="CalculiX", completed=completed)


CALCULIX = MatrixFormat(
    name="CalculiX",
    suffixes=(".sti", ".mas"),
    content="`*FREQUENCY, SOLVER=MATRIXSTORAGE`; names of DOFs from the `.dof` beside it",
    read=_read,
    is_own=lambda path, head: path.suffix.lower() in (".sti", ".mas"),
    dof_suffix=".dof",
)
