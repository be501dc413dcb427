"""Matrices of Nastran in OUTPUT4 files, by pyYeti."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import ReadLimit
from jointfrf.io.fe.matrix_format import ENTRY, ROW, MatrixFormat, StoredMatrix, chosen_name

__all__ = ["NASTRAN_OP4"]

#: An entry takes four bytes in a binary file at least.
_LEAST = 4


def _read(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    op4 = import_extra("pyyeti.nastran.op4")
    limit.take(ENTRY * (path.stat().st_size // _LEAST + 1) // 2)
    names, sizes, forms, _ = op4.dir(str(path), verbose=False)
    chosen = chosen_name(path, name, names)
    (rows, columns), form = sizes[names.index(chosen)], forms[names.index(chosen)]
    if rows != columns:
        raise FileContentError(f"{path}: {chosen} must be a square matrix, not one of shape {(rows, columns)}")
    limit.take(ROW * rows)
    # By entries: an array of the stated size is never made.
    found = sparse.csr_array(op4.load(str(path), [chosen], into="list", sparse=True)[1][0])
    is_half = sparse.triu(found, 1).count_nonzero() == 0 or sparse.tril(found, -1).count_nonzero() == 0
    completed = ""
    if form == 6 and is_half and found.count_nonzero() > np.count_nonzero(found.diagonal()):
        completed = "upper" if sparse.tril(found, -1).count_nonzero() == 0 else "lower"
        found = sparse.csr_array(found + found.T - sparse.diags_array(found.diagonal()))
    return StoredMatrix(found, None, "Nastran", completed)


NASTRAN_OP4 = MatrixFormat(
    name="Nastran OUTPUT4",
    suffixes=(".op4",),
    content="text or binary, of either byte order; names of DOFs from `EXTRN` cards (`.pch`)",
    read=_read,
    is_own=lambda path, head: path.suffix.lower() == ".op4",
    needs="pyyeti",
)
