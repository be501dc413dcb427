"""Matrices of Nastran in OUTPUT2 files, by pyYeti."""

from __future__ import annotations

from pathlib import Path

from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import ReadLimit
from jointfrf.io.fe.matrix_format import MatrixFormat, StoredMatrix, chosen_name

__all__ = ["NASTRAN_OP2"]

#: Bytes of an entry of a full array, with a copy.
_FULL = 16


def _read(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    with import_extra("pyyeti.nastran.op2").OP2(str(path)) as file:
        # Sizes first: an array of the stated size is made.
        shapes = {block.name: block.size for block in file.dblist if block.dbtype > 0}
        chosen = chosen_name(path, name, list(shapes))
        rows, columns = shapes[chosen]
        if rows != columns or rows <= 0:
            raise FileContentError(f"{path}: {chosen} must be a square matrix, not one of shape {(rows, columns)}")
        limit.take(_FULL * rows * columns)
        found = file.rdop2mats([chosen])[chosen]
    if found.dtype.kind == "c":
        raise FileContentError(f"{path}: {chosen} must hold real numbers, not complex ones")
    return StoredMatrix(sparse.csr_array(found), None, "Nastran")


NASTRAN_OP2 = MatrixFormat(
    name="Nastran OUTPUT2",
    suffixes=(".op2",),
    content="matrix blocks such as `KHH`; names of DOFs from `EXTRN` cards (`.pch`)",
    read=_read,
    is_own=lambda path, head: path.suffix.lower() == ".op2",
    needs="pyyeti",
)
