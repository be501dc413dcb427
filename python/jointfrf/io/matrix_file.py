"""Matrices of a model, and the names of its DOFs, from files."""

from __future__ import annotations

import pickle
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
from scipy import sparse

from jointfrf.dofs import DIRECTIONS
from jointfrf.errors import FileContentError, first_line
from jointfrf.files import check_file

__all__ = ["read_dof_names", "read_matrix"]

#: What readers of numpy and scipy raise for a file that is not what its name says, or is damaged.
_UNREADABLE = (
    OSError, ValueError, TypeError, KeyError, EOFError, OverflowError, MemoryError, pickle.UnpicklingError,
    zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def read_matrix(path: Path, name: str) -> sparse.csr_array:
    """Read a real square matrix by its entries.

    Parameters
    ----------
    path : Path
        A Matrix Market file, or with the suffix ``.npz`` one of `scipy.sparse.save_npz` or `numpy.savez`.
    name : str
        The array of an NPZ file that holds several.

    Returns
    -------
    sparse array, shape (n, n)

    Raises
    ------
    FileContentError
        The file cannot be read, or does not hold a finite real square matrix.
    """
    if path.exists():
        check_file(path)
    try:
        found = _read_npz(path, name) if path.suffix.lower() == ".npz" else _read_market(path)
    except FileContentError:
        raise
    except _UNREADABLE as error:
        kind = "an NPZ" if path.suffix.lower() == ".npz" else "a Matrix Market"
        raise FileContentError(f"{path} cannot be read as {kind} file: {first_line(error)}") from error
    return _checked(path, found)


def _read_market(path: Path) -> Any:
    rows, columns, _, _, field, _ = scipy.io.mminfo(path)
    if field not in ("real", "integer", "double", "unsigned-integer"):
        raise FileContentError(f"{path} must hold real numbers, not {field} ones")
    _check_square(path, (rows, columns))
    return scipy.io.mmread(path)


def _read_npz(path: Path, name: str) -> Any:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        if "format" in archive.files:
            return sparse.load_npz(path)
        chosen = name if name in archive.files else archive.files[0] if len(archive.files) == 1 else ""
        if not chosen:
            held = ", ".join(archive.files) or "nothing"
            raise FileContentError(f"{path} must hold one array, or one called {name!r}; it holds {held}")
        return archive[chosen]


def _check_square(path: Path, shape: tuple[int, ...]) -> None:
    if len(shape) != 2 or shape[0] != shape[1] or not shape[0]:
        raise FileContentError(f"{path} must hold a square matrix, not one of shape {tuple(shape)}")


def _checked(path: Path, found: Any) -> sparse.csr_array:
    """Return real finite entries of a square matrix."""
    _check_square(path, found.shape)
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
    if path.exists():
        check_file(path)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileContentError(f"{path} cannot be read as a text file: {error}") from error
    names = []
    for number, line in enumerate(lines, 1):
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
