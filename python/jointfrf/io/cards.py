"""A joint as text for finite-element programs: springs and dashpots, or matrices, between two nodes."""

from __future__ import annotations

import reprlib
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypedDict, get_args

import numpy as np

from jointfrf.dofs import DIRECTIONS, direction_places
from jointfrf.kernel.arguments import FloatArray, check_choice

__all__ = ["CardFormat", "CardOptions", "cards"]

CardFormat = Literal["abaqus", "calculix", "nastran", "ansys"]

#: Largest number of a node, an element or a property: eight columns.
_LARGEST = 99_999_999
#: How far from symmetric, relative to the largest entry, round-off may leave a matrix.
_ROUND_OFF = 1e-10


class CardOptions(TypedDict, total=False):
    """What `Joint.export` takes beside the program and the nodes."""

    element: int
    number: int
    rotation_nodes: Sequence[int] | None
    damping: bool
    full_matrix: bool


class _Link(NamedTuple):
    """A joint in all six directions: stiffness, viscous and hysteretic damping, shape (6, 6), and its numbers."""

    stiffness: FloatArray
    damping: FloatArray
    hysteretic: FloatArray
    nodes: tuple[int, ...]
    element: int
    number: int
    note: str

    @property
    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.stiffness, self.damping, self.hysteretic


def cards(
    program: CardFormat,
    dofs: Sequence[str],
    matrices: tuple[FloatArray, FloatArray, FloatArray],
    nodes: Sequence[int],
    *,
    element: int = 1,
    number: int = 1,
    rotation_nodes: Sequence[int] | None = None,
    damping: bool = True,
    full_matrix: bool = False,
) -> str:
    """Write a joint as input of a finite-element program; `Joint.export` describes arguments and errors.

    Parameters
    ----------
    program : {"abaqus", "calculix", "nastran", "ansys"}
        Whose input.
    dofs : sequence of str
        Names of the n DOFs.
    matrices : tuple of three ndarray, shape (n, n)
        Stiffness, viscous damping, hysteretic damping; N/m, N s/m, N/m and their like for rotations.
    nodes, element, number, rotation_nodes, damping, full_matrix
        As for `Joint.export`.

    Returns
    -------
    str
        Lines of input.
    """
    check_choice("program", program, get_args(CardFormat))
    places = direction_places(dofs)
    wide = []
    for name, matrix in zip(("stiffness", "damping", "hysteretic damping"), matrices, strict=True):
        if abs(matrix - matrix.T).max() > _ROUND_OFF * abs(matrix).max():
            raise ValueError(f"the {name} of the joint must be symmetric to be exported")
        whole = np.zeros((6, 6))
        whole[np.ix_(places, places)] = (matrix + matrix.T) / 2
        wide.append(whole)
    note = f"DOFs {', '.join(DIRECTIONS[place] for place in sorted(places))}; SI units, written by jointfrf"
    if not damping:
        note += ", damping left out"
        wide[1:] = [np.zeros((6, 6)), np.zeros((6, 6))]
    numbers = _two_nodes("nodes", nodes)
    turning = () if rotation_nodes is None else _two_nodes("rotation_nodes", rotation_nodes)
    if program == "calculix" and full_matrix:
        raise ValueError("full_matrix is not for calculix, which reads no matrices: leave it out")
    if turning and program != "calculix":
        raise ValueError(f"rotation_nodes are for calculix: the nodes of {program} have rotations of their own")
    element, number = _number("element", element), _number("number", number)
    link = _Link(wide[0], wide[1], wide[2], (*numbers, *turning), element, number, note)
    if program == "calculix":
        lines = _calculix(link)
    elif program == "ansys":
        lines = _ansys(link)
    elif program == "abaqus":
        lines = _abaqus_matrices(link) if full_matrix or _coupled(link) else _abaqus_springs(link)
    else:
        lines = _nastran_matrices(link) if full_matrix or _coupled(link) else _nastran_bush(link)
    return "\n".join(lines) + "\n"


def _number(name: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 0 < value <= _LARGEST:
        raise ValueError(f"{name} must be an integer from 1 to {_LARGEST}, not {reprlib.repr(value)}")
    return int(value)


def _two_nodes(name: str, nodes: Sequence[int]) -> tuple[int, int]:
    if len(nodes) != 2 or nodes[0] == nodes[1]:
        raise ValueError(f"{name} must be two different nodes, not {reprlib.repr(nodes)}")
    return _number(name, nodes[0]), _number(name, nodes[1])


def _coupled(link: _Link) -> bool:
    return any(np.count_nonzero(matrix - np.diag(matrix.diagonal())) > 0 for matrix in link.matrices)


def _both_sides(matrix: FloatArray) -> FloatArray:
    """[[K, -K], [-K, K]]: the joint resists the difference of the motions j and k, shape (12, 12)."""
    return np.kron(np.array([[1.0, -1.0], [-1.0, 1.0]]), matrix)


def _upper_entries(matrix: FloatArray, nodes: tuple[int, ...]) -> list[tuple[int, int, int, int, float]]:
    """(node, DOF, node, DOF, entry), DOFs from 1, of the upper triangle row by row."""
    whole = _both_sides(matrix)
    found = [(r, c) for r in range(12) for c in range(r, 12) if whole[r, c] != 0]
    return [(nodes[r // 6], r % 6 + 1, nodes[c // 6], c % 6 + 1, float(whole[r, c])) for r, c in found]


def _real(value: float) -> str:
    """14 digits: Abaqus and CalculiX read 20 columns."""
    return f"{value:.13E}"


def _abaqus_springs(link: _Link) -> list[str]:
    lines = [f"** {link.note}"]
    element = link.element
    joined = f"{link.nodes[0]}, {link.nodes[1]}"
    for i in range(6):
        k, c, h = (float(matrix[i, i]) for matrix in link.matrices)
        of_dof = f"{i + 1}, {i + 1}"
        if k != 0 or h != 0:
            name = f"JOINT{link.number}_K{i + 1}"
            lines += [f"*ELEMENT, TYPE=SPRING2, ELSET={name}", f"{element}, {joined}"]
            lines += [f"*SPRING, ELSET={name}" + (", COMPLEX STIFFNESS" if h else ""), of_dof]
            lines += [f"{_real(k)}, {_real(h)}" if h else _real(k)]
            element += 1
        if c != 0:
            name = f"JOINT{link.number}_C{i + 1}"
            lines += [f"*ELEMENT, TYPE=DASHPOT2, ELSET={name}", f"{element}, {joined}"]
            lines += [f"*DASHPOT, ELSET={name}", of_dof, _real(c)]
            element += 1
    return lines


def _abaqus_matrices(link: _Link) -> list[str]:
    lines = [
        f"** {link.note}",
        "** matrices take part in steps of the SIM architecture, not in direct steady-state ones",
    ]
    used = []
    words = ("STIFFNESS", "VISCOUS DAMPING", "STRUCTURAL DAMPING")
    for letter, word, matrix in zip("KCH", words, link.matrices, strict=True):
        if matrix.any():
            name = f"JOINT{link.number}_{letter}"
            used.append(f"{word}={name}")
            lines += [f"*MATRIX INPUT, NAME={name}, TYPE=SYMMETRIC"]
            lines += [f"{a}, {i}, {b}, {j}, {_real(x)}" for a, i, b, j, x in _upper_entries(matrix, link.nodes)]
    if used:
        lines.append("*MATRIX ASSEMBLE, " + ", ".join(used))
    return lines


def _calculix(link: _Link) -> list[str]:
    """Springs between DOFs; K_ab q_a q_b, with q = u_j - u_k, is four springs that cancel on the diagonal."""
    if link.damping.any() or link.hysteretic.any():
        raise ValueError("calculix has no dashpot between DOFs and no complex spring: damping=False leaves damping out")
    if link.stiffness[3:].any() and len(link.nodes) < 4:
        raise ValueError(
            "rotation_nodes must name the ROT NODEs of the two rigid bodies: calculix has rotations nowhere else"
        )

    def at(side: int, place: int) -> tuple[int, int]:
        return (link.nodes[side], place + 1) if place < 3 else (link.nodes[2 + side], place - 2)

    springs: list[tuple[tuple[int, int], tuple[int, int], float]] = []
    for a in range(6):
        for b in range(a, 6):
            k = float(link.stiffness[a, b])
            if k != 0 and a == b:
                springs.append((at(0, a), at(1, a), k))
            elif k != 0:
                springs += [(at(0, a), at(0, b), -k), (at(0, a), at(1, b), k)]
                springs += [(at(1, a), at(0, b), k), (at(1, a), at(1, b), -k)]
    lines = [f"** {link.note}"]
    for i, ((node_a, dof_a), (node_b, dof_b), k) in enumerate(springs):
        name = f"JOINT{link.number}_{i + 1}"
        lines += [f"*ELEMENT, TYPE=SPRING2, ELSET={name}", f"{link.element + i}, {node_a}, {node_b}"]
        lines += [f"*SPRING, ELSET={name}", f"{dof_a}, {dof_b}", _real(k)]
    return lines


def _field(value: float) -> str:
    """As many digits as 16 columns hold: the exponent without E and without zeros in front."""
    if value == 0:
        return "0.0"
    for digits in range(13, 8, -1):
        mantissa, exponent = f"{value:.{digits}E}".split("E")
        text = f"{mantissa}{int(exponent):+d}"
        if len(text) <= 16:
            return text
    raise ValueError(f"{value:g} does not fit into a field of 16 columns")


def _large(first: str, fields: Sequence[str | int | float]) -> list[str]:
    """Lines of a large-field card, four fields of 16 columns each."""
    words = [_field(x) if isinstance(x, float) else str(x) for x in fields]
    rows = [words[i : i + 4] for i in range(0, len(words), 4)]
    return [
        f"{first + '*' if i == 0 else '*':<8}" + "".join(f"{word:>16}" for word in row).rstrip()
        for i, row in enumerate(rows)
    ]


def _nastran_bush(link: _Link) -> list[str]:
    k, c, h = (matrix.diagonal() for matrix in link.matrices)
    if ((k == 0) & (h != 0)).any():
        return _nastran_matrices(link)  # GE is a multiple of K
    eta = np.divide(h, k, out=np.zeros(6), where=k != 0)
    # Continuations begin with an empty field, then the letter and six values.
    fields: list[str | int | float] = [link.number, "K", *k.tolist()]
    for word, values in (("B", c), ("GE", eta)):
        if values.any():
            fields += ["", word, *values.tolist()]
    j, k_side = link.nodes[:2]
    blank = " " * 8
    return [
        f"$ {link.note}",
        "$ exact where the two grids coincide: CBUSH puts rigid arms between grids that are apart",
        f"CBUSH   {link.element:8d}{link.number:8d}{j:8d}{k_side:8d}{blank}{blank}{blank}{0:8d}",
        *_large("PBUSH", fields),
    ]


def _nastran_matrices(link: _Link) -> list[str]:
    names = {"K2GG": f"KJ{link.number}", "B2GG": f"BJ{link.number}", "K42GG": f"HJ{link.number}"}
    used = [(command, names[command], m) for command, m in zip(names, link.matrices, strict=True) if m.any()]
    if any(len(name) > 8 for _, name, _ in used):
        raise ValueError("number must have at most six digits: it is part of a name of eight characters")
    lines = [f"$ {link.note}", "$ case control: " + ", ".join(f"{command} = {name}" for command, name, _ in used)]
    for _, name, matrix in used:
        lines.append(f"DMIG    {name:<8}{0:8d}{6:8d}{2:8d}{0:8d}")
        column = None
        for node_a, dof_a, node_b, dof_b, value in _upper_entries(matrix, link.nodes):
            # Symmetric: the entry of a row of the upper triangle is that of a column of the lower one.
            if (node_a, dof_a) != column:
                column = (node_a, dof_a)
                lines += _large("DMIG", [name, node_a, dof_a, "", node_b, dof_b, value])
            else:
                lines += _large("", [node_b, dof_b, value])
    return lines


def _ansys(link: _Link) -> list[str]:
    """MATRIX27 elements: the upper triangle row by row, UX ... ROTZ of node j, then of node k."""
    if link.hysteretic.any():
        raise ValueError("ansys' MATRIX27 has no hysteretic damping: damping=False leaves damping out")
    lines = [f"! {link.note}; directions are those of the nodal coordinate systems"]
    i = 0
    for option, matrix in ((4, link.stiffness), (5, link.damping)):
        if not matrix.any():
            continue
        constants = [f"{value:.12E}" if value else "0" for value in _both_sides(matrix)[np.triu_indices(12)]]
        kind = link.number + i
        lines.append(f"ET,{kind},MATRIX27,,0,{option}")
        for first in range(0, len(constants), 6):
            head = f"R,{kind}," if first == 0 else "RMORE,"
            lines.append(head + ",".join(constants[first : first + 6]))
        lines += [f"TYPE,{kind}", f"REAL,{kind}", f"EN,{link.element + i},{link.nodes[0]},{link.nodes[1]}"]
        i += 1
    return lines
