"""Matrices of Nastran: DMIG cards of punch files and bulk data; OUTPUT2 and OUTPUT4 files, by pyYeti."""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import ReadLimit
from jointfrf.workbench.fe.bulk import bulk_cards, bulk_number, is_bulk
from jointfrf.workbench.fe.matrix_format import (
    ENTRY,
    ROW,
    MatrixFormat,
    StoredMatrix,
    Symmetry,
    chosen_name,
    matrix_of_entries,
    matrix_of_labels,
)

__all__ = ["NASTRAN_DMIG", "NASTRAN_OP2", "NASTRAN_OP4"]

#: Form of a matrix: square, symmetric.
_SQUARE, _SYMMETRIC = 1, 6
#: Bytes of memory for a byte of text: lines, words, labels.
_TIMES = 6


class _Dmig:
    """A matrix of which cards are read."""

    def __init__(self, form: int, kind: int) -> None:
        self.form, self.kind = form, kind
        self.labels, self.values = array("q"), array("d")


def _read_dmig(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    limit.take(_TIMES * path.stat().st_size)
    found: dict[str, _Dmig] = {}
    for _, fields in bulk_cards(path, {"DMIG"}):
        title = fields[0].upper()
        if _whole(fields[1], path) == 0 and title not in found:
            found[title] = _Dmig(_whole(fields[2], path), _whole(fields[3] or "2", path))
            continue
        if title not in found:
            raise FileContentError(f"{path} cannot be read as DMIG cards: {title!r} has no card that begins it")
        _add_column(found[title], fields, path)
    if not found:
        raise FileContentError(f"{path} contains no DMIG cards")
    title = chosen_name(path, name, list(found))
    own = found[title]
    if own.form not in (_SQUARE, _SYMMETRIC):
        raise FileContentError(f"{path}: {title} is of form {own.form}; write a square matrix, form 1 or 6")
    if own.kind > 2:
        raise FileContentError(f"{path}: {title} must contain real numbers, not complex ones")
    if not own.values:
        raise FileContentError(f"{path}: {title} has no entries")
    labels = np.array(own.labels, np.int64).reshape(-1, 4)
    symmetric: Symmetry = "stated" if own.form == _SYMMETRIC else "no"
    return matrix_of_labels(path, labels, np.array(own.values), limit, "Nastran", symmetric=symmetric)


def _add_column(own: _Dmig, fields: list[str], path: Path) -> None:
    """Add the entries of a card: a column, then rows with their values."""
    column = (_whole(fields[1], path), _whole(fields[2] or "0", path))
    rest = fields[4:]
    for at in range(0, len(rest) - 2, 4):
        if not rest[at]:
            continue
        own.labels.extend((_whole(rest[at], path), _whole(rest[at + 1] or "0", path), *column))
        own.values.append(bulk_number(rest[at + 2], path))


def _whole(word: str, path: Path) -> int:
    if not word.isdecimal() or len(word) > 15:
        raise FileContentError(f"{path} cannot be read as DMIG cards: {word[:20]!r} is no whole number")
    return int(word)


NASTRAN_DMIG = MatrixFormat(
    name="Nastran DMIG",
    suffixes=(".pch", ".bdf", ".dat"),
    content="real square matrices, `K...`, `M...`, `B...`, `K4...`; scalar points are modal coordinates, `901:q`",
    read=_read_dmig,
    is_own=lambda path, head: path.suffix.lower() in (".pch", ".bdf", ".dat", ".asm", ".blk") and is_bulk(head),
)


#: An entry takes four bytes in a binary file at least.
_LEAST = 4


def _read_op4(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
    op4 = import_extra("pyyeti.nastran.op4")
    limit.take(ENTRY * (path.stat().st_size // _LEAST + 1) // 2)
    names, sizes, forms, _ = op4.dir(str(path), verbose=False)
    chosen = chosen_name(path, name, names)
    (rows, columns), form = sizes[names.index(chosen)], forms[names.index(chosen)]
    if rows != columns:
        raise FileContentError(f"{path}: {chosen} must be a square matrix, not one of shape {(rows, columns)}")
    limit.take(ROW * rows)
    # By entries: an array of the stated size is never made.
    found = sparse.coo_array(op4.load(str(path), [chosen], into="list", sparse=True)[1][0])
    symmetric: Symmetry = "stated" if form == _SYMMETRIC else "no"
    row, column = found.row.astype(np.int64), found.col.astype(np.int64)
    matrix, completed = matrix_of_entries(path, row, column, found.data, rows, limit, symmetric=symmetric)
    return StoredMatrix(matrix, None, "Nastran", completed)


NASTRAN_OP4 = MatrixFormat(
    name="Nastran OUTPUT4",
    suffixes=(".op4",),
    content="text or binary, of either byte order; names of DOFs from `EXTRN` cards (`.pch`)",
    read=_read_op4,
    is_own=lambda path, head: path.suffix.lower() == ".op4",
    needs="pyyeti",
)


#: Bytes of an entry of a full array, with a copy.
_FULL = 16


def _read_op2(path: Path, name: str, limit: ReadLimit) -> StoredMatrix:
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
        raise FileContentError(f"{path}: {chosen} must contain real numbers, not complex ones")
    return StoredMatrix(sparse.csr_array(found), None, "Nastran")


NASTRAN_OP2 = MatrixFormat(
    name="Nastran OUTPUT2",
    suffixes=(".op2",),
    content="matrix blocks such as `KHH`; names of DOFs from `EXTRN` cards (`.pch`)",
    read=_read_op2,
    is_own=lambda path, head: path.suffix.lower() == ".op2",
    needs="pyyeti",
)
