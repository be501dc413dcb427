"""A joint as input of Code_Aster, LS-DYNA and SubDyn, whose inputs differ from the cards of all other programs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointfrf.io.card_link import CardLink, card_integer, card_real, dmig
from jointfrf.kernel.arguments import FloatArray

__all__ = ["code_aster_cards", "code_aster_equation", "lsdyna_cards", "lsdyna_equation", "subdyn_cards"]

#: Displacements of Code_Aster by their numbers.
_ASTER_DOFS = ("DX", "DY", "DZ", "DRX", "DRY", "DRZ")
#: Numbers in a line of Code_Aster; columns of a field of LS-DYNA, and digits of a number in it.
_IN_A_LINE, _COLUMNS, _DIGITS = 4, 10, 4
#: Mass and inertia of a discrete beam of LS-DYNA, which must not be zero: kg and kg m^2.
_SMALL_MASS, _SMALL_INERTIA = 1e-6, 1e-9


def code_aster_cards(link: CardLink) -> list[str]:
    """Write discrete elements: K_TR_L and A_TR_L, and with hysteretic damping H two elements of stiffness.

    K + i H is the sum of K - H without a loss factor, and of H with the loss factor 1 (AMOR_HYST).
    """
    name = f"JOINT{link.number}"
    groups = (name, f"{name}_H") if link.hysteretic.any() else (name,)
    lines = link.comments("#")
    lines += ["# a group of one SEG2 between the nodes in the mesh (.mail):"]
    for i, group in enumerate(groups):
        cell = f"J{card_integer('element', link.element + i)}"
        ends = f"N{link.nodes[0]} N{link.nodes[1]}"
        lines += [f"#   SEG2 / {cell} {ends} / FINSF / GROUP_MA / {group} {cell} / FINSF"]
    lines += [f"# AFFE_MODELE: _F(GROUP_MA={groups!r}, PHENOMENE='MECANIQUE',", "#   MODELISATION='DIS_TR')"]
    where = "" if link.table is None else "[freq], frequency by frequency"
    lines += [f"# AFFE_CARA_ELEM(MODELE=..., DISCRET={name}{where})"]
    if link.table is None:
        return [*lines, f"{name} = (", *_discrete(link, groups, *link.matrices), ")"]
    none, table = np.zeros((6, 6)), zip(link.table.freq, link.table.stiffness, link.table.damping, strict=True)
    rows = [
        line
        for freq, stiffness, damping in table
        for line in (f"{float(freq)!r}: (", *_discrete(link, groups, stiffness, damping, none), "),")
    ]
    return [*lines, f"{name} = {{", *rows, "}"]


def _discrete(
    link: CardLink, groups: Sequence[str], stiffness: FloatArray, damping: FloatArray, hysteretic: FloatArray
) -> list[str]:
    """Write the occurrences of DISCRET of stiffness, viscous and hysteretic damping."""
    parts = [(groups[0], "K_TR_L", stiffness - hysteretic, ""), (groups[0], "A_TR_L", damping, "")]
    if len(groups) > 1:
        parts.append((groups[1], "K_TR_L", hysteretic, "AMOR_HYST=1.0, "))
    lines = []
    for group, word, matrix, more in parts:
        whole = link.both_sides(matrix)
        words = [card_real(float(whole[row, column])) for column in range(12) for row in range(column + 1)]
        if word == "A_TR_L" and not matrix.any():
            continue
        lines.append(f"  _F(GROUP_MA='{group}', REPERE='GLOBAL', SYME='OUI', CARA='{word}', {more}VALE=(")
        lines += [f"    {', '.join(words[at : at + _IN_A_LINE])}," for at in range(0, len(words), _IN_A_LINE)]
        lines.append("  )),")
    return lines


def code_aster_equation(ends: Sequence[tuple[int, int, float]]) -> list[str]:
    """Write an equation of displacements, (node, DOF, factor), for LIAISON_DDL of AFFE_CHAR_MECA."""
    nodes = ", ".join(f"'N{node}'" for node, _, _ in ends)
    dofs = ", ".join(f"'{_ASTER_DOFS[dof - 1]}'" for _, dof, _ in ends)
    factors = ", ".join(f"{factor:.12g}" for *_, factor in ends)
    return [
        "# AFFE_CHAR_MECA(LIAISON_DDL=...",
        f"_F(NOEUD=({nodes}),",
        f"   DDL=({dofs}),",
        f"   COEF_MULT=({factors}), COEF_IMPO=0.0),",
    ]


def lsdyna_cards(link: CardLink, *, as_matrix: bool) -> list[str]:
    """Write a discrete beam of six directions, or a file of DMIG for ELEMENT_DIRECT_MATRIX_INPUT.

    Raises
    ------
    ValueError
        There is hysteretic damping.
    """
    if link.hysteretic.any():
        raise ValueError("lsdyna has no hysteretic damping of elements; leave damping out with damping=False")
    return _lsdyna_matrices(link) if as_matrix else _lsdyna_beam(link)


def _lsdyna_beam(link: CardLink) -> list[str]:
    """Write an element of zero length, whose axes are the global ones, of *MAT_LINEAR_ELASTIC_DISCRETE_BEAM."""
    number, units = link.number, link.units
    mass, inertia = _SMALL_MASS / units.mass, _SMALL_INERTIA / (units.mass * units.length**2)
    k, c = (list(map(float, matrix.diagonal())) for matrix in (link.stiffness, link.damping))
    return [
        *link.comments("$"),
        f"$ the element adds {_SMALL_MASS:g} kg and {_SMALL_INERTIA:g} kg m^2, as LS-DYNA asks for",
        "*PART",
        f"JOINT{number}",
        _row(number, number, number),
        "*SECTION_BEAM",
        _row(number, 6, 1.0, 2, 0, 0.0),
        _row(1.0, inertia, 0, 0.0, 0.0),
        "*MAT_LINEAR_ELASTIC_DISCRETE_BEAM",
        _row(number, mass, *k),
        _row(*c),
        _row(*[0.0] * 6),
        "*ELEMENT_BEAM",
        "".join(f"{value:8d}" for value in (link.element, number, *link.nodes[:2], 0)),
    ]


def _row(*values: float) -> str:
    """Return fields of ten columns; reals have five digits there."""
    return "".join(f"{_field(value):>{_COLUMNS}}" for value in values)


def _field(value: float) -> str:
    if isinstance(value, int):
        return str(card_integer("number", value)) if value else "0"
    return card_real(value, _COLUMNS, digits=_DIGITS - (value < 0)) if value else "0.0"


def _lsdyna_matrices(link: CardLink) -> list[str]:
    """Write the file of DMIG, with the keyword that names it in its comments."""
    names = {word: f"{word[0]}J{link.number}" for word in ("KJ", "BJ")}
    used = [(names["KJ"], link.stiffness), *([(names["BJ"], link.damping)] if link.damping.any() else [])]
    if any(len(name) > 8 for name, _ in used):
        raise ValueError("number must have at most six digits, as a part of a name of eight characters")
    lines = [
        *link.comments("$"),
        "$ save as joint.dmig; in the keyword deck (NE 0: large fields):",
        "$ *ELEMENT_DIRECT_MATRIX_INPUT",
        f"$ {link.element:8d}{1:10d}",
        "$ joint.dmig",
        f"$ {'':10}{names['BJ'] if len(used) > 1 else '':>10}{names['KJ']:>10}",
    ]
    for name, matrix in used:
        lines += dmig(link, name, matrix)
    return lines


def lsdyna_equation(ends: Sequence[tuple[int, int, float]], number: int) -> list[str]:
    """Write an equation of displacements, (node, DOF, factor)."""
    return ["*CONSTRAINED_LINEAR_GLOBAL", _row(number), *(_row(*end) for end in ends)]


def subdyn_cards(link: CardLink) -> list[str]:
    """Write rows of three tables of SubDyn: a member of type 5, its stiffness, and the global axes.

    Raises
    ------
    ValueError
        There is damping, nodes are apart from the reference point, or units are not SI.
    """
    if link.damping.any() or link.hysteretic.any():
        raise ValueError(
            "subdyn has no damping between joints; leave damping out with damping=False, and use its modal damping"
        )
    if link.has_arms:
        raise ValueError("a spring of subdyn has no arms; place both joints at the reference point")
    if link.units.name != "SI":
        raise ValueError(f"subdyn has units m, N, s; write units SI, not {link.units.name}")
    k = [card_real(float(link.stiffness[row, column])) for row in range(6) for column in range(row, 6)]
    names = [f"k{row + 1}{column + 1}" for row in range(6) for column in range(row, 6)]
    number = link.number
    ends = " ".join(map(str, link.nodes[:2]))
    return [
        *link.comments("!"),
        "! one row for each of three tables; raise NMembers, NSpringPropSets and NCOSMs by 1 each",
        "! MEMBERS: MemberID MJointID1 MJointID2 MPropSetID1 MPropSetID2 MType COSMID",
        f"{link.element} {ends} {number} {number} 5 {number}",
        f"! SPRING ELEMENT PROPERTIES: PropSetID {' '.join(names)}",
        f"{number} {' '.join(k)}",
        "! MEMBER COSINE MATRICES: COSMID COSM11 COSM12 ... COSM33",
        f"{number} 1.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0",
    ]
