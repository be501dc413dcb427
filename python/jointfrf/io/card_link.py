"""Common parts of the cards of all programs: a joint in six directions, fields of numbers, marks of comments."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jointfrf.choices import CardFormat
from jointfrf.dofs import DIRECTIONS, rigid_offset
from jointfrf.io.units import ModelUnits
from jointfrf.kernel.arguments import FloatArray

__all__ = [
    "COMMENT_MARKS",
    "NO_ARM",
    "ROUND_OFF",
    "CardFormat",
    "CardLink",
    "CardTable",
    "card_integer",
    "card_real",
    "dmig",
    "large_card",
    "upper_entries",
]

#: Mark at the beginning of a comment line.
COMMENT_MARKS = {"abaqus": "**", "calculix": "**", "nastran": "$", "ansys": "!", "code_aster": "#", "lsdyna": "$",
                 "subdyn": "!"}  # fmt: skip
#: Largest number of a node, an element or a property: eight columns.
_LARGEST = 99_999_999
#: Columns of a large field of Nastran; least number of digits after the point.
_WIDE, _DIGITS = 16, 8
#: Relative asymmetry of a matrix, over its largest entry, that rounding may cause.
ROUND_OFF = 1e-10
#: Arms shorter than this are rounding, m.
NO_ARM = 1e-9


class CardTable(NamedTuple):
    """Stiffness and viscous damping over frequency, shape (n_freq, 6, 6), all in units of the model."""

    freq: FloatArray
    stiffness: FloatArray
    damping: FloatArray


class CardLink(NamedTuple):
    """A joint in all six directions: stiffness, viscous and hysteretic damping, shape (6, 6), and its numbers.

    `arms` (2, 3) are vectors from the nodes to the reference points of the joint on the two sides, m. `positions`
    (2, 3) are the places of the nodes, if known. All are in the `units` of the model. `faces` are nodes that follow the
    two nodes.
    """

    stiffness: FloatArray
    damping: FloatArray
    hysteretic: FloatArray
    nodes: tuple[int, ...]
    element: int
    number: int
    notes: tuple[str, ...]
    arms: FloatArray
    positions: FloatArray | None
    units: ModelUnits
    faces: tuple[tuple[int, ...], tuple[int, ...]] | None
    table: CardTable | None = None
    damping_nodes: int | None = None

    @property
    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Stiffness, viscous and hysteretic damping."""
        return self.stiffness, self.damping, self.hysteretic

    @property
    def has_arms(self) -> bool:
        """Return whether the distance of a node from the reference point is not zero."""
        return bool(self.arms.any())

    @property
    def has_one_point(self) -> bool:
        """Return whether both arms end at the same point."""
        if self.positions is None:
            return True
        ends = self.positions + self.arms
        return np.allclose(ends[0], ends[1], rtol=0, atol=NO_ARM / self.units.length)

    def both_sides(self, matrix: FloatArray) -> FloatArray:
        """Return T^T [[K, -K], [-K, K]] T, the stiffness against the relative motion of two points, shape (12, 12).

        T maps the motions of the nodes to the motions of the points that are rigidly connected to them.
        """
        whole = np.kron(np.array([[1.0, -1.0], [-1.0, 1.0]]), matrix)
        if not self.has_arms:
            return whole
        turn = np.zeros((12, 12))
        for side in range(2):
            own = slice(6 * side, 6 * side + 6)
            turn[own, own] = rigid_offset(DIRECTIONS, self.arms[side])
        moved = turn.T @ whole @ turn
        # Entries that cancel up to rounding are zero; diagonals of damping may be negative.
        size = np.sqrt(abs(moved.diagonal()))
        moved[abs(moved) < ROUND_OFF * np.outer(size, size)] = 0
        return np.asarray(moved + (moved.T - moved) / 2)

    def calculix_dof(self, place: int) -> tuple[int, int]:
        """Return node and DOF of one of twelve; rotations are displacements of the ROT NODEs."""
        side, direction = divmod(place, 6)
        if direction < 3:
            return self.nodes[side], direction + 1
        if len(self.nodes) < 4:
            raise ValueError("calculix has rotations at ROT NODEs of rigid bodies only; name the two in rotation_nodes")
        return self.nodes[2 + side], direction - 2

    def comments(self, mark: str) -> list[str]:
        """Return the notes as lines of comment."""
        return [f"{mark} {note}" for note in self.notes]


def card_integer(name: str, value: int) -> int:
    """Return a number of a node, an element or a property; raise ValueError if it has more than eight digits."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 0 < value <= _LARGEST:
        raise ValueError(f"{name} must be an integer from 1 to {_LARGEST}, not {reprlib.repr(value)}")
    return int(value)


def card_real(value: float, columns: int = 20, letter: str = "E", digits: int = _DIGITS) -> str:
    """Return a number as text with as many digits as its field takes, 14 at most.

    Parameters
    ----------
    value : float
        Number to write.
    columns : int
        Width of the field: Abaqus and CalculiX read 20, large fields of Nastran have 16.
    letter : str
        Letter of the exponent; without one the exponent has its sign and no zeros in front, as in Nastran.
    digits : int
        Least number of digits after the point, default 8.

    Raises
    ------
    ValueError
        The number is not finite, or so small that it has lost digits.

    Examples
    --------
    >>> from jointfrf.io.card_link import card_real
    >>> card_real(6e5), card_real(-6e5, 16, ""), card_real(-1.25e-120, 16, "")
    ('6.0000000000000E+05', '-6.00000000000+5', '-1.250000000-120')
    """
    if not np.isfinite(value) or 0 < abs(value) < np.finfo(np.float64).tiny:
        raise ValueError(f"a card cannot contain {value:g}; check joint, units and positions for a number out of range")
    text = ""
    for places in range(13, digits - 1, -1):
        mantissa, exponent = f"{value:.{places}E}".split("E")
        text = f"{mantissa}{letter}{exponent}" if letter else f"{mantissa}{int(exponent):+d}"
        if len(text) <= columns:
            break
    return text


def upper_entries(link: CardLink, matrix: FloatArray) -> list[tuple[int, int, int, int, float]]:
    """Return (node, DOF, node, DOF, entry), DOFs from 1, of the upper triangle row by row."""
    whole, nodes = link.both_sides(matrix), link.nodes
    found = [(r, c) for r in range(12) for c in range(r, 12) if whole[r, c] != 0]
    return [(nodes[r // 6], r % 6 + 1, nodes[c // 6], c % 6 + 1, float(whole[r, c])) for r, c in found]


def large_card(first: str, fields: Sequence[str | int | float]) -> list[str]:
    """Return lines of a large-field card, four fields of 16 columns each."""
    words = [(card_real(x, _WIDE, "") if x else "0.0") if isinstance(x, float) else str(x) for x in fields]
    rows = [words[i : i + 4] for i in range(0, len(words), 4)]
    return [
        f"{first + '*' if i == 0 else '*':<8}" + "".join(f"{word:>16}" for word in row).rstrip()
        for i, row in enumerate(rows)
    ]


def dmig(link: CardLink, name: str, matrix: FloatArray) -> list[str]:
    """Return the matrix of both nodes as DMIG: symmetric, double precision, large fields."""
    lines = [f"DMIG    {name:<8}{0:8d}{6:8d}{2:8d}{0:8d}"]
    column = None
    for node_a, dof_a, node_b, dof_b, value in upper_entries(link, matrix):
        # By symmetry, the entry of a row of the upper triangle is the entry of a column of the lower one.
        if (node_a, dof_a) != column:
            column = (node_a, dof_a)
            lines += large_card("DMIG", [name, node_a, dof_a, "", node_b, dof_b, value])
        else:
            lines += large_card("", [node_b, dof_b, value])
    return lines
