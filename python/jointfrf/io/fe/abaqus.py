"""Matrices of Abaqus (`*MATRIX GENERATE`, `*MATRIX OUTPUT`), in each of its three text formats."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointfrf.files import ReadLimit
from jointfrf.io.fe.calculix import triplets
from jointfrf.io.fe.matrix_format import MatrixFormat, StoredMatrix, matrix_of_entries, matrix_of_labels

__all__ = ["ABAQUS"]

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


def _read(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    with path.open("rb") as file:
        line = _first_line(file.read(1 << 13))
    columns, delimiter = len(_fields(line)), "," if "," in line else None
    found = triplets(path, limit, columns, delimiter)
    if columns == _LABELS:
        return matrix_of_labels(path, found[:, :4].astype(np.int64), found[:, 4], limit, "Abaqus")
    rows, cols = found[:, 0].astype(np.int64) - 1, found[:, 1].astype(np.int64) - 1
    n = int(max(rows.max(), cols.max())) + 1
    matrix, completed = matrix_of_entries(path, rows, cols, found[:, 2], n, limit, symmetric=True)
    return StoredMatrix(matrix, None, "Abaqus", completed)


ABAQUS = MatrixFormat(
    name="Abaqus",
    suffixes=(".mtx",),
    content="`*MATRIX OUTPUT` with `FORMAT=MATRIX INPUT` or `LABELS`, which name their DOFs, or `COORDINATE`",
    read=_read,
    is_own=_is_own,
)
