"""The formats of files of matrices, and `read_matrix`, which finds the format of a file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.extras import check_extras
from jointfrf.files import ReadLimit, check_file, damage_named, head_of
from jointfrf.workbench.fe.abaqus import ABAQUS, CALCULIX
from jointfrf.workbench.fe.ansys import ANSYS_FULL, HARWELL_BOEING
from jointfrf.workbench.fe.market import MARKET
from jointfrf.workbench.fe.matrix_format import ROW, MatrixFormat, StoredMatrix
from jointfrf.workbench.fe.nastran import NASTRAN_DMIG, NASTRAN_OP2, NASTRAN_OP4
from jointfrf.workbench.fe.npz import NPZ

__all__ = ["MATRIX_FORMATS", "format_of_matrix", "read_matrix"]

#: In the order in which they are asked whether a file is theirs; Matrix Market, whose suffix others use, comes last.
MATRIX_FORMATS: tuple[MatrixFormat, ...] = (
    NPZ,
    CALCULIX,
    ABAQUS,
    NASTRAN_DMIG,
    NASTRAN_OP4,
    NASTRAN_OP2,
    HARWELL_BOEING,
    ANSYS_FULL,
    MARKET,
)


def format_of_matrix(path: Path, head: bytes) -> MatrixFormat:
    """Return the format of a file by its name and its first bytes.

    Raises
    ------
    FileContentError
        It is of none.
    """
    found = next((one for one in MATRIX_FORMATS if one.is_own(path, head)), None)
    if found is None:
        known = ", ".join(f"{one.name} ({' '.join(one.suffixes)})" for one in MATRIX_FORMATS)
        raise FileContentError(f"{path} is of an unknown format of matrices; known are {known}")
    return found


def read_matrix(path: Path, name: str, limit_gb: float | None = None) -> StoredMatrix:
    """Read a real square matrix by its entries.

    Parameters
    ----------
    path : Path
        A file of one of `MATRIX_FORMATS`. ``FILE#NAME`` is the matrix of that name in a file of several.
    name : str
        ``stiffness``, ``mass``, ``damping`` or ``structural_damping``: which one, if a file contains several.
    limit_gb : float, optional
        As for `jointfrf.io.read_frfs`.

    Returns
    -------
    StoredMatrix
        Shape (n, n), in the units of the file.

    Raises
    ------
    FileContentError
        The file cannot be read, or does not contain a finite real square matrix.
    MissingPackageError
        A package for the format is not installed.
    """
    if not path.exists() and "#" in path.name:
        path, name = path.with_name(path.name.rpartition("#")[0]), path.name.rpartition("#")[2]
    check_file(path, limit_gb)
    chosen = format_of_matrix(path, head_of(path, limit_gb))
    if chosen.needs:
        check_extras(chosen.needs)
    kind = f"{'an' if chosen.name[0] in 'AEIONH' and not chosen.name.startswith('Har') else 'a'} {chosen.name} file"
    others = (Exception,) if chosen.needs else (StopIteration,)  # what a package raises for damage may be anything
    with damage_named(path, kind, *others):
        limit = ReadLimit(path, limit_gb)
        found = chosen.read(path, name, limit)
        shape = found.matrix.shape
        if len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
            raise FileContentError(f"{path} must contain a square matrix, not one of shape {tuple(shape)}")
        limit.take(ROW * shape[0])
    return replace(found, matrix=_checked(path, found.matrix), dof_suffix=chosen.dof_suffix)


def _checked(path: Path, found: object) -> sparse.csr_array:
    """Return real finite entries of a square matrix."""
    if found.dtype.kind not in "biuf":  # type: ignore[attr-defined]
        what = "complex" if found.dtype.kind == "c" else str(found.dtype)  # type: ignore[attr-defined]
        raise FileContentError(f"{path} must contain real numbers, not {what} ones")
    if hasattr(found, "check_format"):
        try:
            found.check_format(full_check=True)
        except ValueError as error:
            raise FileContentError(f"{path} is damaged: {error}") from error
    matrix = sparse.csr_array(found, dtype=np.float64)
    matrix.sum_duplicates()
    if not np.isfinite(matrix.data).all():
        entries = sparse.coo_array(matrix)
        bad = int(np.argmin(np.isfinite(entries.data)))
        row, column = entries.row[bad] + 1, entries.col[bad] + 1
        raise FileContentError(f"{path} contains NaN or Inf in row {row}, column {column}, counted from 1")
    return matrix
