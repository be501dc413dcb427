"""Matrix Market files."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.workbench.fe.matrix_format import ENTRY, ROW, MatrixFormat, StoredMatrix, matrix_of_entries

__all__ = ["MARKET"]

#: Bytes of an entry in a file, at least: with row and column (``1 1 1``), or by itself.
_LEAST = {"coordinate": 6, "array": 2}
#: Longest comment at the beginning, lines.
_COMMENT = 100_000


def _read(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    # Not by scipy.io.mmread: numbers of rows beyond the matrix crash it (scipy 1.17).
    if path.suffix.lower() in (".gz", ".bz2"):
        raise FileContentError(f"{path} is compressed; unpack it")
    form, symmetry, sizes, lines = _header(path)
    rows, columns, entries = sizes if form == "coordinate" else (*sizes, sizes[0] * sizes[1])
    if rows != columns or rows < 1:
        raise FileContentError(f"{path} must contain a square matrix, not one of shape {(rows, columns)}")
    is_half = symmetry != "general"
    stored = rows * (rows + 1) // 2 if is_half and form == "array" else entries
    if stored * _LEAST[form] > path.stat().st_size + _LEAST[form]:
        raise ValueError(f"it does not contain the {stored} entries that it states")
    limit.take(ENTRY * entries + ROW * rows)
    width = 3 if form == "coordinate" else 1
    found = np.loadtxt(path, comments="%", skiprows=lines, ndmin=2, encoding="latin-1", max_rows=stored + 1)
    if found.shape != (stored, width):
        raise ValueError(f"it contains {found.shape[0]} lines of {found.shape[1]} numbers, not {stored} of {width}")
    if form == "array":
        if not is_half:
            return StoredMatrix(sparse.csr_array(found.reshape(columns, rows).T))
        whole = np.zeros((rows, rows))
        whole.T[np.triu_indices(rows)] = found[:, 0]  # the lower triangle by columns
        return StoredMatrix(sparse.csr_array(whole + np.tril(whole, -1).T), completed="the lower triangle")
    places = found[:, :2].astype(np.int64)
    if (places != found[:, :2]).any():
        raise ValueError("numbers of rows and columns must be whole numbers")
    matrix, completed = matrix_of_entries(
        path, places[:, 0] - 1, places[:, 1] - 1, found[:, 2], rows, limit, symmetric="stated" if is_half else "no"
    )
    return StoredMatrix(matrix, completed=completed)


def _header(path: Path) -> tuple[str, str, tuple[int, ...], int]:
    """Return form, symmetry, sizes, and the number of lines before the entries."""
    with path.open(encoding="latin-1") as file:
        words = next(file).lower().split()
        if len(words) != 5 or words[:2] != ["%%matrixmarket", "matrix"] or words[2] not in _LEAST:
            raise ValueError("its first line must be like '%%MatrixMarket matrix coordinate real symmetric'")
        _, _, form, field, symmetry = words
        if field not in ("real", "integer", "double", "unsigned-integer"):
            raise FileContentError(f"{path} must contain real numbers, not {field} ones")
        if symmetry not in ("general", "symmetric", "hermitian"):
            raise FileContentError(f"{path} must contain a symmetric matrix, not a {symmetry} one")
        for number, line in enumerate(islice(file, _COMMENT), 2):
            if line.strip() and not line.startswith("%"):
                sizes = tuple(int(word) for word in line.split())
                if len(sizes) != (3 if form == "coordinate" else 2) or min(sizes) < 0:
                    raise ValueError(f"line {number} must contain its sizes, not {line.strip()[:40]!r}")
                return form, symmetry, sizes, number
    raise ValueError("it ends before its sizes")


MARKET = MatrixFormat(
    name="Matrix Market",
    suffixes=(".mtx",),
    content="`coordinate` or `array`; of `symmetric` ones the other triangle is filled in",
    read=_read,
    is_own=lambda path, head: (
        head.lstrip().startswith(b"%%MatrixMarket") or path.suffix.lower() in (".mtx", ".gz", ".bz2")
    ),
)
