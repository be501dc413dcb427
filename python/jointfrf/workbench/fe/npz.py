"""Matrices in NPZ files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.io.npz_file import npz_fields
from jointfrf.workbench.fe.matrix_format import ROW, MatrixFormat, StoredMatrix

__all__ = ["NPZ"]


def _read(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    fields = npz_fields(path, limit)
    if "format" in fields:
        limit.take(ROW * int(max(np.ravel(fields["shape"]), default=0)))
        return StoredMatrix(sparse.load_npz(path))
    chosen = name if name in fields else next(iter(fields)) if len(fields) == 1 else ""
    if not chosen:
        held = ", ".join(fields) or "nothing"
        raise FileContentError(f"{path} must contain one array, or one called {name!r}; it contains {held}")
    return StoredMatrix(fields[chosen])


NPZ = MatrixFormat(
    name="NPZ",
    suffixes=(".npz",),
    content="`scipy.sparse.save_npz`, or `numpy.savez` of one array or of arrays named like the keys",
    read=_read,
    is_own=lambda path, head: path.suffix.lower() == ".npz" or head.startswith(b"PK"),
)
