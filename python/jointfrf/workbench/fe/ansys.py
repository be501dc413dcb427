"""Matrices of Ansys: the `.full` file, by ansys-mapdl-reader; Harwell-Boeing files as `HBMAT` writes them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import ReadLimit
from jointfrf.workbench.fe.matrix_format import MatrixFormat, StoredMatrix, Symmetry, dof_name, matrix_of_entries

__all__ = ["ANSYS_FULL", "HARWELL_BOEING"]

#: Bytes of memory for a byte of the file: entries with row and column, of both matrices, and their sums.
_TIMES = 8


def _read_full(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    limit.take(_TIMES * path.stat().st_size)
    if name not in ("stiffness", "mass"):
        raise FileContentError(f"{path}: a .full file contains stiffness and mass, not {name}; name another file")
    reader = import_extra("ansys.mapdl.reader")
    named, k, m = reader.read_binary(str(path)).load_km(as_sparse=True)
    chosen = k if name == "stiffness" else m
    if chosen is None:
        raise FileContentError(f"{path} contains no {name}; name another file")
    entries = sparse.coo_array(chosen)
    matrix, completed = matrix_of_entries(
        path, entries.row.astype(np.int64), entries.col.astype(np.int64), entries.data, chosen.shape[0], limit,
        symmetric="possible",
    )  # fmt: skip
    dofs = tuple(dof_name(node, number + 1) for node, number in named.tolist())
    return StoredMatrix(matrix, dofs, "Ansys", completed)


ANSYS_FULL = MatrixFormat(
    name="Ansys .full",
    suffixes=(".full",),
    content="K and M, with nodes and directions",
    read=_read_full,
    is_own=lambda path, head: path.suffix.lower() == ".full",
    needs="ansys",
)


#: ``(10I8)``, ``(1P,4D20.12)``: numbers of a line, and the width of each.
_FORMAT = re.compile(r"\(\s*+(?:\d+P,?\s*+)?(\d*)\s*+[IEDFG](\d++)(?:\.\d++)?(?:E\d++)?\s*+\)", re.IGNORECASE)
#: Real, symmetric or not, assembled.
_KIND = re.compile(rb"^R[SU]A\s", re.IGNORECASE)


def _is_own(path: Path, head: bytes) -> bool:
    lines = head.splitlines()
    return len(lines) > 3 and re.match(rb"^[RCP][SUHZR][AE]\s", lines[2], re.IGNORECASE) is not None


def _read_hb(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    with path.open(encoding="latin-1") as file:
        next(file)
        cards = _whole_numbers(next(file))
        third = next(file)
        if not _KIND.match(third.encode("latin-1")):
            raise FileContentError(f"{path} must contain an assembled real matrix (RSA or RUA), not {third[:3]!r}")
        rows, columns, entries = _whole_numbers(third[3:])[:3]
        formats = _FORMAT.findall(next(file))
        if len(cards) > 4 and cards[4] > 0:
            next(file)  # of right-hand sides, which stand at the end
        if rows != columns or rows < 1:
            raise FileContentError(f"{path} must contain a square matrix, not one of shape {(rows, columns)}")
        if len(formats) < 3:
            raise ValueError("its fourth line must contain three formats such as (10I8)")
        if 2 * (rows + 2 * entries) > path.stat().st_size:
            raise ValueError(f"it does not contain the {entries} entries that it states")
        limit.take(100 * (rows + 2 * entries))
        starts, places, values = (
            _numbers(file, count, form) for count, form in zip((rows + 1, entries, entries), formats, strict=False)
        )
    begins = starts.astype(np.int64) - 1
    if begins[0] != 0 or begins[-1] != entries or (np.diff(begins) < 0).any():
        raise ValueError("the beginnings of its columns do not fit the number of its entries")
    of_column = np.repeat(np.arange(columns), np.diff(begins))
    symmetric: Symmetry = "stated" if third[1] in "Ss" else "no"
    matrix, completed = matrix_of_entries(
        path, places.astype(np.int64) - 1, of_column, values, rows, limit, symmetric=symmetric
    )
    return StoredMatrix(matrix, None, "Ansys", completed)


def _whole_numbers(text: str) -> list[int]:
    return [int(word) for word in text.split()]


def _numbers(file: Iterator[str], count: int, form: tuple[str, str]) -> NDArray[np.float64]:
    """Return the numbers of as many lines as they take; D may stand for E."""
    a_line, width = int(form[0] or 1), int(form[1])
    if not 0 < a_line * width <= 1000:
        raise ValueError("a line of it would have more than 1000 columns")
    words: list[str] = []
    for line in islice(file, -(-count // a_line)):
        text = line.rstrip("\r\n")
        words += [text[at : at + width] for at in range(0, min(len(text), a_line * width), width)]
    found = np.array([float(word.replace("D", "E").replace("d", "e")) for word in words[:count] if word.strip()])
    if found.size != count:
        raise ValueError(f"it contains {found.size} of {count} numbers")
    return found


HARWELL_BOEING = MatrixFormat(
    name="Harwell-Boeing",
    suffixes=(".hb", ".rsa", ".rua", ".matrix"),
    content="`HBMAT` of Ansys as text, other assembled real matrices; names of DOFs from the `.mapping` beside it",
    read=_read_hb,
    is_own=_is_own,
    dof_suffix=".mapping",
)
