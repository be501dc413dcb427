"""Names of the rows of a matrix, from files."""

from __future__ import annotations

import re
from pathlib import Path

from jointfrf.dofs import DIRECTIONS
from jointfrf.errors import FileContentError
from jointfrf.files import check_file, head_of, text_of
from jointfrf.io.fe.bulk import bulk_cards, is_bulk
from jointfrf.io.fe.matrix_format import dof_name

__all__ = ["read_dof_names"]

#: Directions as Ansys names them.
_ANSYS = {"UX": "x", "UY": "y", "UZ": "z", "ROTX": "theta_x", "ROTY": "theta_y", "ROTZ": "theta_z"}
#: A line of the `.dof` file of CalculiX: node.direction.
_POINT = re.compile(r"\d+\.\d\d?\s*", re.ASCII)


def read_dof_names(path: Path) -> tuple[str, ...]:
    r"""Read the names of DOFs, in the order of the rows.

    Parameters
    ----------
    path : Path
        A text file with lines such as ``12:y``, or node and DOF, ``12 y`` or ``12 2`` (1 to 6: x, y, z, theta_x,
        theta_y, theta_z), or ``12.2`` as CalculiX writes it (``.dof``); blank lines and what follows a ``#`` are
        skipped. Or the ``.mapping`` of Ansys (row, node, ``UX``); or a file of Nastran with ``EXTRN`` cards.

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
    ...     _ = path.write_text("# node, DOF\n1 2\n1 6\n2:y\n3.1\n")
    ...     read_dof_names(path)
    ('1:y', '1:theta_z', '2:y', '3:x')
    """
    if not path.exists():
        text_of(path)  # which says so
    check_file(path)
    if is_bulk(head_of(path)):
        return _of_extrn(path)
    names = []
    for number, line in enumerate(text_of(path).splitlines(), 1):
        text = line.partition("#")[0].strip()
        words = text.split()
        if not words or (number == 1 and words[0].lower() == "matrix"):
            continue
        if len(words) == 3 and words[0].isdecimal() and words[2].upper() in _ANSYS:
            names.append(f"{words[1]}:{_ANSYS[words[2].upper()]}")
            continue
        if len(words) > 2:
            raise FileContentError(f"{path}: line {number} must be like '12:y' or '12 2', not {line.strip()[:40]!r}")
        if len(words) == 1 and _POINT.fullmatch(text):
            words = text.split(".")
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


def _of_extrn(path: Path) -> tuple[str, ...]:
    """Return the DOFs of an external superelement: pairs of point and DOFs, ``3 123456`` or ``901 0``."""
    names: list[str] = []
    for _, fields in bulk_cards(path, {"EXTRN"}):
        words = [word for word in fields if word]
        for node, dofs in zip(words[::2], words[1::2], strict=False):
            if not (node.isdecimal() and dofs.isdecimal()):
                raise FileContentError(f"{path}: an EXTRN card must hold points and DOFs, not {node} {dofs}"[:200])
            names += [dof_name(node, int(digit)) for digit in dofs]
    if not names:
        raise FileContentError(f"{path} holds no EXTRN card, which names the DOFs of its matrices")
    return tuple(names)
