"""Nodes and DOFs from files: coordinates and sets of nodes, names of the rows of matrices."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from jointfrf.dofs import DIRECTIONS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, check_file, damage_named, head_of, text_of
from jointfrf.io.file_format import Reading
from jointfrf.io.uff_axes import node_axes, node_coordinates
from jointfrf.io.uff_file import UniversalFile
from jointfrf.io.units import StatedUnits
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.fe.bulk import bulk_cards, bulk_number, is_bulk
from jointfrf.workbench.fe.matrix_format import dof_name

__all__ = ["NodeFile", "read_dof_names", "read_nodes"]

#: Bytes of memory for a byte of text: lines, words, arrays of three numbers.
_TIMES = 12
#: Bytes of memory of a name of a node in a set.
_NAME = 100
#: Keywords of decks that make nodes in other ways than by their coordinates.
_MAKERS = ("NGEN", "NFILL", "NCOPY", "NMAP")
#: Nodes are read up to this number: eight columns, and more where programs write more.
_LARGEST = 2**53


@dataclass
class NodeFile:
    """Nodes of a model.

    Attributes
    ----------
    coordinates : dict of str to ndarray, shape (3,)
        By the number of the node as a text, in the unit of length of the file; m of a Universal File.
    sets : dict of str to tuple of str
        Sets of nodes by their names, capital letters.
    turned : tuple of str
        Nodes with directions other than the basic system.
    is_si : bool
        Whether the file states its unit, so that coordinates are in m.
    """

    coordinates: dict[str, FloatArray] = field(default_factory=dict)
    sets: dict[str, tuple[str, ...]] = field(default_factory=dict)
    turned: tuple[str, ...] = ()
    is_si: bool = False

    def add(self, path: Path, node: str, words: Sequence[str]) -> None:
        """Keep a node; raises FileContentError."""
        numbers = [float(_exponent(word)) if word else 0.0 for word in words] + [0.0] * (3 - len(words))
        if not node.isdecimal() or int(node) > _LARGEST or not np.isfinite(numbers).all():
            raise FileContentError(f"{path}: node {node[:20]} must have a number and finite coordinates")
        before = self.coordinates.setdefault(str(int(node)), np.array(numbers))
        if not np.array_equal(before, numbers):
            places = " and ".join(f"({', '.join(f'{x:.6g}' for x in at)})" for at in (before, numbers))
            raise FileContentError(
                f"{path}: node {node} is defined twice, at {places}; give the nodes of all parts different numbers"
            )

    def named(self, dofs: Sequence[str]) -> tuple[str, ...]:
        """Return names of DOFs; nodes with directions of their own give ``local_x``, ..."""
        own = set(self.turned)
        parts = (dof.rpartition(":") for dof in dofs)
        return tuple(f"{node}{mark}{'local_' if node in own else ''}{way}" for node, mark, way in parts)


def _exponent(word: str) -> str:
    """Return a number with the exponent letter of Python: 1.D-1 is 0.1."""
    return word.replace("D", "E").replace("d", "e")


def read_nodes(path: Path, limit_gb: float | None = None) -> NodeFile:
    """Read the coordinates of nodes.

    Parameters
    ----------
    path : Path
        A deck of Abaqus or CalculiX (``*NODE``, ``*NSET``), bulk data of Nastran (``GRID``), a ``.cdb`` of Ansys
        (``NBLOCK``), a Universal File (datasets 15, 2411), or a text table of node, x, y, z.
    limit_gb : float, optional
        As for `jointfrf.io.read_frfs`.

    Raises
    ------
    FileContentError
        The file cannot be read, contains no nodes, or makes them in a way that is not read.
    """
    check_file(path, limit_gb)
    head = head_of(path, limit_gb)
    limit = ReadLimit(path, limit_gb)
    limit.take(_TIMES * path.stat().st_size)
    reader = next(read for is_own, read in _READERS if is_own(path, head))
    with damage_named(path, "a file of nodes", IndexError):
        found = reader(path, limit)
    if not found.coordinates:
        raise FileContentError(f"{path} has no nodes with coordinates")
    return found


# ---------------------------------------------------------------- decks of Abaqus and CalculiX


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    """Return the keyword of a line and its parameters, capital letters."""
    word, *rest = (part.strip() for part in line[1:].split(","))
    pairs = [(key.strip().upper(), value.strip()) for key, _, value in (part.partition("=") for part in rest if part)]
    return " ".join(word.upper().split()), {key: value if key == "INPUT" else value.upper() for key, value in pairs}


def _blocks(path: Path) -> Iterator[tuple[str, dict[str, str], list[list[str]]]]:
    """Yield keyword, parameters and data lines of a deck."""
    word, options, rows = "", dict[str, str](), list[list[str]]()
    for line in text_of(path).splitlines():
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if text.startswith("*"):
            yield word, options, rows
            (word, options), rows = _keyword(text), []
        else:
            rows.append([part.strip() for part in text.rstrip(",").split(",")])
    yield word, options, rows


def _of_deck(path: Path, limit: ReadLimit) -> NodeFile:
    found, sets, part = NodeFile(), dict[str, dict[str, None]](), ""
    parts: dict[str, str] = {}
    turned: list[str | None] = []
    for word, options, rows in _blocks(path):
        _check_keyword(path, word, options)
        part = options.get("NAME", "") if word == "PART" else "" if word == "END PART" else part
        if word == "NODE":
            for row in rows:
                found.add(path, row[0], row[1:4])
                if parts.setdefault(row[0], part) != part:
                    raise FileContentError(
                        f"{path}: parts {parts[row[0]]} and {part} both have a node {row[0]}; give the nodes of all "
                        "parts different numbers"
                    )
            if "NSET" in options:
                sets.setdefault(options["NSET"], {}).update(dict.fromkeys(str(int(row[0])) for row in rows))
        elif word == "NSET" and options.get("NSET"):
            members = sets.setdefault(options["NSET"], {})
            for row in rows:
                members.update(dict.fromkeys(_members(path, "GENERATE" in options, row, sets, limit)))
        elif word == "TRANSFORM":
            turned.append(options.get("NSET"))
    if not found.coordinates:
        included = [options.get("INPUT", "?") for word, options, _ in _blocks(path) if word == "INCLUDE"]
        hint = f"; it includes {included[0]}: name that file" if included else ""
        raise FileContentError(f"{path} has no nodes with coordinates{hint}")
    for name in turned:
        if name is not None and name not in sets:
            raise FileContentError(f"{path}: *TRANSFORM turns the set {name}, which is not there; write *NSET {name}")
    own = {node for name in turned for node in (found.coordinates if name is None else sets[name])}
    found.sets = {name: tuple(nodes) for name, nodes in sets.items()}
    found.turned = tuple(sorted(own, key=int))
    return found


def _check_keyword(path: Path, word: str, options: dict[str, str]) -> None:
    """Raise an error for nodes that are elsewhere, or made or moved in a way that is not read."""
    if word == "NODE" and "INPUT" in options:
        raise FileContentError(f"{path}: *NODE takes its nodes from {options['INPUT']}; name that file instead")
    if word in _MAKERS or (word == "NODE" and options.get("SYSTEM", "R") != "R"):
        raise FileContentError(f"{path}: *{word} makes nodes in a way that is not read; list them by *NODE")
    if word in ("INSTANCE", "SYSTEM"):
        raise FileContentError(f"{path}: *{word} moves nodes, which is not read; write a flat deck without it")


def _members(
    path: Path, generate: bool, row: list[str], sets: dict[str, dict[str, None]], limit: ReadLimit
) -> Iterable[str]:
    """Return the nodes that a line adds to a set: numbers, a range, other sets."""
    if generate:
        first, last, *step = (int(word) for word in row if word)
        stride = step[0] if step else 1
        if stride < 1 or not 0 <= first <= last:
            raise FileContentError(f"{path}: *NSET, GENERATE must count up in steps, not {', '.join(row)[:60]}")
        limit.take(_NAME * ((last - first) // stride + 1))
        return map(str, range(first, last + 1, stride))
    found: list[str] = []
    for word in filter(None, row):
        own = [str(int(word))] if word.isdecimal() else list(sets.get(word.upper(), ()))
        limit.take(_NAME * len(own))
        found += own
    return found


# ---------------------------------------------------------------- the others


def _of_bulk(path: Path, limit: ReadLimit) -> NodeFile:
    found = NodeFile()
    turned, local = [], []
    cards = list(bulk_cards(path, {"GRID", "GRDSET"}))
    defaults = next((fields for name, fields in cards if name == "GRDSET"), [""] * 8)
    for fields in (fields for name, fields in cards if name == "GRID"):
        number, placed, *rest = fields
        if (placed or defaults[1]) not in ("", "0"):
            local.append(number)
            continue
        found.add(path, number, [str(bulk_number(word, path)) if word else "0" for word in rest[:3]])
        if (rest[3] or defaults[5]) not in ("", "0"):
            turned.append(number)
    if local:
        raise FileContentError(
            f"{path}: {len(local)} GRIDs such as {local[0]} have coordinates in a local system (CP); write them in the "
            "basic system"
        )
    found.turned = tuple(str(int(number)) for number in turned)
    return found


#: Fields of a line of NBLOCK, such as (3i9,6e21.13e3) or (1i7,2i9,6e21.13); and the longest line.
_FORMAT, _LINE = re.compile(r"(\d{0,3}) {0,20}([ie]) {0,20}(\d{1,3})", re.IGNORECASE), 1000


def _of_ansys(path: Path, limit: ReadLimit) -> NodeFile:
    """Read NBLOCK: a format, then lines of node, other whole numbers, x, y, z, and three angles of its own axes."""
    found = NodeFile()
    lines = iter(text_of(path).splitlines())
    for line in lines:
        if not line.upper().startswith("NBLOCK"):
            continue
        form = next(lines, "")
        fields = [
            (kind.lower(), int(width)) for count, kind, width in _FORMAT.findall(form) for _ in range(int(count or 1))
        ]
        ends = np.cumsum([0, *(width for _, width in fields)]).tolist()
        reals = [i for i, (kind, _) in enumerate(fields) if kind == "e"]
        if not fields or fields[0][0] != "i" or len(reals) < 3 or ends[-1] > _LINE:
            raise FileContentError(
                f"{path}: {form.strip()[:40]!r} is no format of NBLOCK; write one like (3i9,6e21.13e3)"
            )
        for row in lines:
            words = [row[first:last].strip() for first, last in pairwise(ends)]
            if not words[0].isdecimal():
                break
            found.add(path, words[0], [words[i] for i in reals[:3]])
            if any(word and float(_exponent(word)) for word in (words[i] for i in reals[3:6])):
                found.turned += (str(int(words[0])),)
    return found


def _of_universal(path: Path, limit: ReadLimit) -> NodeFile:
    has_units = bool(UniversalFile(path).datasets(164))
    file = UniversalFile(path, Reading(units=StatedUnits(coordinates="" if has_units else "m")))
    numbers = {int(row.split()[0]) for number in file.datasets(15, 2411) for row in file.records(number) if row.split()
               and row.split()[0].isdecimal()}  # fmt: skip
    places = node_coordinates(file, numbers)
    turned = tuple(str(node) for node in sorted(node_axes(file, numbers)))
    return NodeFile({str(node): place for node, place in places.items()}, turned=turned, is_si=has_units)


def _of_table(path: Path, limit: ReadLimit) -> NodeFile:
    found = NodeFile()
    for number, line in enumerate(text_of(path).splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
        if not words or (not found.coordinates and not words[0].isdecimal()):
            continue  # a heading
        if len(words) != 4:
            raise FileContentError(f"{path}: line {number} must contain node, x, y, z, not {line.strip()[:40]!r}")
        found.add(path, words[0], words[1:])
    return found


def _begins_deck(head: bytes) -> bool:
    lines = head.decode("latin-1").upper().splitlines()
    return any(re.match(r"\s*\*\s*(NODE|HEADING|INCLUDE|PART|NSET|ELEMENT|MODEL)\b", line) for line in lines)


#: How the content of a file is recognised, and what reads it; a table of text is what is left.
_READERS: tuple[tuple[Callable[[Path, bytes], bool], Callable[[Path, ReadLimit], NodeFile]], ...] = (
    (lambda path, head: path.suffix.lower() == ".inp" or _begins_deck(head), _of_deck),
    (lambda path, head: re.match(rb"\s*-1\s", head) is not None, _of_universal),
    (lambda path, head: path.suffix.lower() == ".cdb" or b"NBLOCK" in head, _of_ansys),
    (lambda path, head: is_bulk(head), _of_bulk),
    (lambda path, head: True, _of_table),
)


#: Directions as Ansys names them.
_ANSYS = {"UX": "x", "UY": "y", "UZ": "z", "ROTX": "theta_x", "ROTY": "theta_y", "ROTZ": "theta_z"}
#: A line of the `.dof` file of CalculiX: node.direction.
_POINT = re.compile(r"\d+\.\d\d?\s*", re.ASCII)


def read_dof_names(path: Path) -> tuple[str, ...]:
    r"""Return the names of DOFs of a file, in the order of the rows.

    Parameters
    ----------
    path : Path
        Path of a file in one of these formats:

        - a text file with lines ``12:y``, ``12 y``, ``12 2`` (1 to 6 are x, y, z, theta_x, theta_y, theta_z), or
          ``12.2`` as in the ``.dof`` file of CalculiX; blank lines and comments after ``#`` are skipped;
        - the ``.mapping`` file of Ansys (row, node, ``UX``);
        - a file of Nastran with ``EXTRN`` cards.

    Returns
    -------
    tuple of str
        Names ``"node:direction"``.

    Raises
    ------
    FileContentError
        The file cannot be read, contains no names, or a line is something else.

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
        raise FileContentError(f"{path} contains no names of DOFs")
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
                raise FileContentError(f"{path}: an EXTRN card must contain points and DOFs, not {node} {dofs}"[:200])
            names += [dof_name(node, int(digit)) for digit in dofs]
    if not names:
        raise FileContentError(f"{path} contains no EXTRN card, which names the DOFs of its matrices")
    return tuple(names)
