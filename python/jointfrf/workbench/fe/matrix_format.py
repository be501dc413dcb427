"""Declaration of a format of files of matrices, and the matrix of such a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.dofs import DIRECTIONS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit

__all__ = [
    "ENTRY", "ROW", "MatrixFormat", "StoredMatrix", "Symmetry", "chosen_name", "dof_name", "matrix_of_entries",
    "matrix_of_labels",
]  # fmt: skip

Symmetry = Literal["stated", "possible", "no"]

#: Bytes of memory of an entry with row and column, and of a row, intermediate results included.
ENTRY, ROW = 48, 32
#: Numbers of DOFs are smaller: six of a node, temperatures and the like behind them.
_NUMBERS = 1000
#: First letters of the names of matrices in files with several; K4 is the structural damping of Nastran.
_BEGINS: Mapping[str, tuple[str, ...]] = {
    "stiffness": ("K",), "mass": ("M",), "damping": ("B", "C"), "structural_damping": ("K4", "H"),
}  # fmt: skip


@dataclass(frozen=True)
class StoredMatrix:
    """A matrix of a file.

    Attributes
    ----------
    matrix : sparse array, shape (n, n)
        Both triangles.
    dofs : tuple of str or None
        Names of its rows, if the file contains them.
    program : str
        The program that writes such files; empty for formats of no program, whose numbers are in SI units.
    completed : str
        Entries that the file stores of a symmetric matrix, from which all other entries were completed: ``the upper
        triangle``, ``the lower triangle``, or ``each off-diagonal term once``; empty if the file stores all.
    dof_suffix : str
        Suffix of the second file, which names the DOFs; empty if there is none.
    """

    matrix: sparse.csr_array
    dofs: tuple[str, ...] | None = None
    program: str = ""
    completed: str = ""
    dof_suffix: str = ""


def _never(*_: object) -> bool:
    return False


@dataclass(frozen=True, kw_only=True)
class MatrixFormat:
    """A format of files of matrices.

    Attributes
    ----------
    name : str
    suffixes : tuple of str
        The usual ones.
    content : str
        Contents of such a file that are read, for the documentation.
    read : callable
        Called with the path, the name of the matrix and the limit of memory; returns a `StoredMatrix`.
    is_own : callable
        Whether a path and the first bytes of the file have this format.
    dof_suffix : str
        Suffix of a second file that names the DOFs; empty if the file names them itself.
    needs : str
        Name of the extra package that reads the format; empty if none is needed.
    """

    name: str
    suffixes: tuple[str, ...]
    content: str
    read: Callable[[Path, str, ReadLimit], StoredMatrix]
    is_own: Callable[[Path, bytes], bool] = _never
    dof_suffix: str = ""
    needs: str = ""


def dof_name(node: int | str, number: int) -> str:
    """Return the name of a DOF, 1 to 6 of a node; ``q`` for 0, a modal coordinate.

    Examples
    --------
    >>> dof_name(12, 5), dof_name(901, 0), dof_name(3, 11)
    ('12:theta_y', '901:q', '3:dof11')
    """
    if number == 0:
        return f"{node}:q"
    return f"{node}:{DIRECTIONS[number - 1]}" if 1 <= number <= len(DIRECTIONS) else f"{node}:dof{number}"


def matrix_of_entries(
    path: Path, rows: NDArray[np.int64], columns: NDArray[np.int64], values: NDArray[np.float64], n: int,
    limit: ReadLimit, *, symmetric: Symmetry,
) -> tuple[sparse.csr_array, str]:  # fmt: skip
    """Return a matrix of its entries, and the entries from which the rest was completed.

    Parameters
    ----------
    path : Path
    rows, columns : ndarray of int, shape (m,)
        Counted from 0; equal ones add up.
    values : ndarray, shape (m,)
    n : int
        Order.
    limit : ReadLimit
    symmetric : {"stated", "possible", "no"}
        "stated": the file states that the matrix is symmetric, and each off-diagonal term that is stored once is
        completed, in either triangle. "possible": the format stores symmetric matrices so, but does not state it; the
        matrix is completed if no off-diagonal term is stored on both sides.

    Raises
    ------
    FileContentError
        A row or column is none of the n.
    """
    for places in (rows, columns):
        if places.size and not 0 <= int(places.min()) <= int(places.max()) < n:
            bad = int(places.min()) if places.min() < 0 else int(places.max())
            raise FileContentError(f"{path} is damaged: it names row or column {bad + 1} of {n}")
    limit.take(ROW * n + 2 * ENTRY * values.size)
    found = sparse.csr_array(sparse.coo_array((values, (rows, columns)), shape=(n, n)))
    if symmetric == "no":
        return found, ""
    stored = sparse.csr_array(sparse.coo_array((np.ones(rows.size, bool), (rows, columns)), shape=(n, n)))
    once = sparse.csr_array(stored > stored.T)  # not stored on the other side of the diagonal
    is_whole = stored.nnz > once.nnz + np.count_nonzero(stored.diagonal())
    if not once.nnz or (symmetric == "possible" and is_whole):
        return found, ""
    sides = [name for name, cut in (("upper", sparse.triu), ("lower", sparse.tril)) if cut(once).nnz]
    text = f"the {sides[0]} triangle" if len(sides) == 1 else "each off-diagonal term once"
    return sparse.csr_array(found + found.multiply(once).T), text


def matrix_of_labels(
    path: Path, labels: NDArray[np.int64], values: NDArray[np.float64], limit: ReadLimit, program: str,
    *, symmetric: Symmetry = "possible",
) -> StoredMatrix:  # fmt: skip
    """Return a matrix whose rows and columns are named by node and DOF.

    Parameters
    ----------
    path : Path
    labels : ndarray of int, shape (m, 4)
        Node and DOF of the row, node and DOF of the column.
    values : ndarray, shape (m,)
    limit : ReadLimit
    program : str
    symmetric : {"stated", "possible", "no"}
        As for `matrix_of_entries`.
    """
    limit.take(4 * labels.nbytes)
    if (labels[:, 1::2] < 0).any() or (labels[:, 1::2] >= _NUMBERS).any():
        raise FileContentError(f"{path} is damaged: numbers of DOFs must be 0 to {_NUMBERS - 1}")
    codes = labels[:, ::2] * _NUMBERS + labels[:, 1::2]  # one number a DOF, which sorts by node, then by DOF
    named, places = np.unique(codes.T, return_inverse=True)
    rows, columns = places.reshape(2, -1)
    matrix, completed = matrix_of_entries(path, rows, columns, values, len(named), limit, symmetric=symmetric)
    dofs = tuple(dof_name(*divmod(code, _NUMBERS)) for code in named.tolist())
    return StoredMatrix(matrix, dofs, program, completed)


def chosen_name(path: Path, wanted: str, held: Sequence[str]) -> str:
    """Return which of the matrices of a file is wanted.

    Parameters
    ----------
    path : Path
        For messages.
    wanted : str
        ``stiffness``, ``mass``, ``damping``, ``structural_damping``, or a name in the file.
    held : sequence of str
        Names in the file.

    Raises
    ------
    FileContentError
        None or several may be meant.

    Examples
    --------
    >>> chosen_name(Path("a.op4"), "stiffness", ["kaax", "maax", "k4aax"])
    'kaax'
    """
    exact = [name for name in held if name.upper() == wanted.upper()]
    if exact or len(held) == 1:
        return (exact or list(held))[0]
    others = _BEGINS["structural_damping"] if wanted == "stiffness" else ()
    begins = _BEGINS.get(wanted, ())
    found = [one for one in held if one.upper().startswith(begins) and not (others and one.upper().startswith(others))]
    if begins and len(found) == 1:
        return found[0]
    what = f"no matrix {wanted}" if not found else f"several that may be the {wanted}"
    raise FileContentError(
        f"{path} contains {what}, but {', '.join(held[:12]) or 'nothing'}; name one after the file, {path.name}#NAME"
    )
