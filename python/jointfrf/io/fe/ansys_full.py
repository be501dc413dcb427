"""Matrices of the `.full` file of Ansys, by ansys-mapdl-reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import ReadLimit
from jointfrf.io.fe.matrix_format import MatrixFormat, StoredMatrix, dof_name, matrix_of_entries

__all__ = ["ANSYS_FULL"]

#: Bytes of memory for a byte of the file: entries with row and column, of both matrices, and their sums.
_TIMES = 8


def _read(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    limit.take(_TIMES * path.stat().st_size)
    if name not in ("stiffness", "mass"):
        raise FileContentError(f"{path}: of a .full file K and M are read, not {name}")
    reader = import_extra("ansys.mapdl.reader")
    named, k, m = reader.read_binary(str(path)).load_km(as_sparse=True)
    chosen = k if name == "stiffness" else m
    if chosen is None:
        raise FileContentError(f"{path} holds no {name}")
    entries = sparse.coo_array(chosen)
    matrix, completed = matrix_of_entries(
        path, entries.row.astype(np.int64), entries.col.astype(np.int64), entries.data, chosen.shape[0], limit,
        symmetric=True,
    )  # fmt: skip
    dofs = tuple(dof_name(node, number + 1) for node, number in named.tolist())
    return StoredMatrix(matrix, dofs, "Ansys", completed)


ANSYS_FULL = MatrixFormat(
    name="Ansys .full",
    suffixes=(".full",),
    content="K and M, with nodes and directions",
    read=_read,
    is_own=lambda path, head: path.suffix.lower() == ".full",
    needs="ansys",
)
