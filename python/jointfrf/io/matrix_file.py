"""Matrices of a model, and the names of its DOFs, from files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from scipy import sparse

from jointfrf.dofs import DIRECTIONS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, check_file, damage_named, text_of
from jointfrf.io.npz_file import npz_fields

__all__ = ["read_dof_names", "read_matrix"]

#: Bytes of an entry in a Matrix Market file, at least: with row and column (``1 1 1``), or by itself.
_LEAST = {"coordinate": 6, "array": 2}
#: Bytes of memory of an entry with row and column, and of a row, intermediate results included.
_ENTRY, _ROW = 48, 32


def read_matrix(path: Path, name: str, limit_gb: float | None = None) -> sparse.csr_array:
    """Read a real square matrix by its entries.

    Parameters
    ----------
    path : Path
        A Matrix Market file, or with the suffix ``.npz`` one of `scipy.sparse.save_npz` or `numpy.savez`.
    name : str
        The array of an NPZ file that holds several.
    limit_gb : float, optional
        As for `jointfrf.io.read_frfs`.

    Returns
    -------
    sparse array, shape (n, n)

    Raises
    ------
    FileContentError
        The file cannot be read, or does not hold a finite real square matrix.
    """
    is_npz = path.suffix.lower() == ".npz"
    with damage_named(path, "an NPZ file" if is_npz else "a Matrix Market file"):
        if path.exists():
            check_file(path, limit_gb)
        limit = ReadLimit(path, limit_gb)
        found = _read_npz(path, name, limit) if is_npz else _read_market(path, limit)
        _check_square(path, found.shape)
        limit.take(_ROW * found.shape[0])
    return _checked(path, found)


def _read_market(path: Path, limit: ReadLimit) -> Any:
    if path.suffix.lower() in (".gz", ".bz2"):  # which scipy unpacks, to whatever size
        raise FileContentError(f"{path} is compressed: unpack it")
    rows, columns, entries, form, field, _ = scipy.io.mminfo(path)
    if field not in ("real", "integer", "double", "unsigned-integer"):
        raise FileContentError(f"{path} must hold real numbers, not {field} ones")
    _check_square(path, (rows, columns))
    if entries * _LEAST[form] > path.stat().st_size + _LEAST[form]:
        raise ValueError(f"it does not hold the {entries} entries that it states")
    limit.take(_ENTRY * entries + _ROW * rows)
    return scipy.io.mmread(path)


def _read_npz(path: Path, name: str, limit: ReadLimit) -> Any:
    fields = npz_fields(path, limit)
    if "format" in fields:
        limit.take(_ROW * int(max(np.ravel(fields["shape"]), default=0)))
        return sparse.load_npz(path)
    chosen = name if name in fields else next(iter(fields)) if len(fields) == 1 else ""
    if not chosen:
        held = ", ".join(fields) or "nothing"
        raise FileContentError(f"{path} must hold one array, or one called {name!r}; it holds {held}")
    return fields[chosen]


def _check_square(path: Path, shape: tuple[int, ...]) -> None:
    if len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
        raise FileContentError(f"{path} must hold a square matrix, not one of shape {tuple(shape)}")


def _checked(path: Path, found: Any) -> sparse.csr_array:
    """Return real finite entries of a square matrix."""
    if found.dtype.kind not in "biuf":
        what = "complex" if found.dtype.kind == "c" else str(found.dtype)
        raise FileContentError(f"{path} must hold real numbers, not {what} ones")
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
        raise FileContentError(f"{path} holds NaN or Inf in row {row}, column {column}, counted from 1")
    return matrix


def read_dof_names(path: Path) -> tuple[str, ...]:
    r"""Read the names of DOFs from a text file, one a line.

    Parameters
    ----------
    path : Path
        Lines such as ``12:y``, or node and DOF, ``12 y`` or ``12 2`` (1 to 6: x, y, z, theta_x, theta_y, theta_z).
        Blank lines and what follows a ``#`` are skipped.

    Returns
    -------
    tuple of str
        ``"node:direction"``.

    Raises
    ------
    FileContentError
        The file cannot be read, holds no names, or a line is something else.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "dofs.txt"
    ...     _ = path.write_text("# node, DOF\n1 2\n1 6\n2:y\n")
    ...     read_dof_names(path)
    ('1:y', '1:theta_z', '2:y')
    """
    names = []
    for number, line in enumerate(text_of(path).splitlines(), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        if len(words) > 2:
            raise FileContentError(f"{path}: line {number} must be like '12:y' or '12 2', not {line.strip()[:40]!r}")
        if len(words) == 2:
            words[1] = _direction(path, number, words[1])
        names.append(":".join(words))
    if not names:
        raise FileContentError(f"{path} holds no names of DOFs")
    return tuple(names)


def _direction(path: Path, number: int, word: str) -> str:
    """Return the direction of a numbered DOF; a word is one already."""
    if not word.isdecimal():
        return word
    if not 1 <= int(word) <= len(DIRECTIONS):
        raise FileContentError(f"{path}: line {number}: a DOF has a number from 1 to {len(DIRECTIONS)}, not {word}")
    return DIRECTIONS[int(word) - 1]
