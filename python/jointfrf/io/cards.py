"""A joint as text for finite-element programs: springs and dashpots, or matrices, between two nodes."""

from __future__ import annotations

import reprlib
import textwrap
from collections.abc import Sequence
from typing import TypedDict, Unpack, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.dofs import DIRECTIONS, direction_places, rigid_offset
from jointfrf.io.card_link import (
    COMMENT_MARKS,
    NO_ARM,
    ROUND_OFF,
    CardFormat,
    CardLink,
    CardTable,
    card_integer,
    card_real,
    dmig,
    large_card,
    upper_entries,
)
from jointfrf.io.other_cards import (
    code_aster_cards,
    code_aster_equation,
    lsdyna_cards,
    lsdyna_equation,
    subdyn_cards,
)
from jointfrf.io.units import ModelUnits, UnitSystemName, model_units
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_nodes, as_real, check_choice
from jointfrf.spelling import visible

__all__ = ["CardFormat", "CardOptions", "card_integer", "card_real", "rigid_cards", "spring_cards", "table_cards"]

#: Length above which a rigid arm is an error, m: mm were probably taken for m.
_LONGEST_ARM = 10.0
#: Number of nodes in a line of a set of Abaqus and CalculiX, which take sixteen; of a continuation of Nastran.
_IN_A_LINE = 8
#: Relative distance of a point from the line between two nodes that rounding may cause.
_ON_LINE = 1e-9
#: Number of terms of an equation in a line of Abaqus and CalculiX.
_TERMS = 4
#: DOFs of Ansys by their numbers.
_ANSYS_DOFS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
#: Programs for which no cards are written for nodes that follow others.
_WITHOUT_FACES = ("code_aster", "lsdyna", "subdyn")
#: Number of characters of a comment line: Nastran reads 72 columns.
_COMMENT = 68


class CardOptions(TypedDict, total=False):
    """Options of `Joint.export` in addition to the program and the nodes."""

    element: int
    number: int
    rotation_nodes: Sequence[int] | None
    damping: bool
    full_matrix: bool
    positions: ArrayLike | None
    points: ArrayLike | None
    units: UnitSystemName
    faces: Sequence[Sequence[int]] | None
    comments: Sequence[str]
    connector: bool
    table_hz: ArrayLike | None
    damping_nodes: int | None


def spring_cards(
    program: CardFormat,
    dofs: Sequence[str],
    matrices: tuple[FloatArray, FloatArray, FloatArray],
    nodes: Sequence[int],
    **options: Unpack[CardOptions],
) -> str:
    """Return a joint as input of a finite-element program; `Joint.export` describes arguments and errors.

    Parameters
    ----------
    program : str
        Name of the program, one of `CardFormat`.
    dofs : sequence of str
        Names of the n DOFs.
    matrices : tuple of three ndarray, shape (n, n)
        Stiffness, viscous damping, hysteretic damping; N/m, N s/m, N/m and the corresponding units of rotations.
    nodes, **options
        Nodes and options; see `Joint.export`.

    Returns
    -------
    str
        Lines of input.
    """
    check_choice("program", program, get_args(CardFormat))
    link = _link(program, dofs, matrices, nodes, options)
    return _text(program, link, options)


def table_cards(
    program: CardFormat,
    dofs: Sequence[str],
    freq_hz: FloatArray,
    k_joint: ComplexArray,
    nodes: Sequence[int],
    **options: Unpack[CardOptions],
) -> str:
    """Return K* over frequency as tables of stiffness Re K* and viscous damping Im K*/w, for direct steady-state steps.

    Parameters
    ----------
    program : {"abaqus", "nastran", "code_aster"}
        Name of the program; other programs have no such tables.
    dofs : sequence of str
        Names of the n DOFs.
    freq_hz : ndarray, shape (n_freq,)
        Lines of the table, above 0 Hz, Hz.
    k_joint : ndarray, shape (n_freq, n, n)
        Dynamic stiffness, N/m, rotational N m/rad.
    nodes, **options
        Nodes and options; see `Joint.export`.

    Returns
    -------
    str
        Lines of input.
    """
    check_choice("program", program, get_args(CardFormat))
    if program not in ("abaqus", "nastran", "code_aster"):
        raise ValueError(f"{program} has no tables over frequency; name one frequency by freq_hz")
    if options.get("full_matrix", False):
        raise ValueError("full_matrix has no tables over frequency; leave one of them out")
    if freq_hz.size < 2 or not (freq_hz[0] > 0 and (np.diff(freq_hz) > 0).all()):
        raise ValueError("table_hz must contain at least two frequencies above 0 Hz that increase")
    lines = np.stack([k_joint.real, k_joint.imag / (2 * np.pi * freq_hz[:, None, None])])
    if not options.get("damping", True):
        lines[1] = 0
    link = _link(program, dofs, (lines[0, 0], lines[1, 0], 0 * lines[0, 0]), nodes, options)
    places, units = direction_places(dofs), link.units
    stiffness, damping = (
        np.array([_widened(name, matrix, seconds, places, units) for matrix in own])
        for name, own, seconds in (("stiffness", lines[0], 2), ("damping", lines[1], 1))
    )
    about = _text_lines([
        f"tables of {freq_hz.size} lines, {freq_hz[0]:.6g} to {freq_hz[-1]:.6g} Hz: Re K* and Im K*/w, linear between "
        "lines; for direct steady-state steps within these frequencies"
    ])  # fmt: skip
    table = CardTable(freq_hz * units.time, stiffness, damping)
    return _text(program, link._replace(table=table, notes=(*link.notes, *about)), options)


@np.errstate(over="ignore", invalid="ignore")  # `card_real` rejects the resulting numbers
def _text(program: CardFormat, link: CardLink, options: CardOptions) -> str:
    """Return the elements of a joint, and cards of the faces of its nodes."""
    is_connector = options.get("connector", False)
    if is_connector and program != "abaqus":
        raise ValueError(f"connector elements are for abaqus, not for {program}; leave connector out")
    if is_connector and options.get("full_matrix", False):
        raise ValueError("full_matrix and connector exclude each other; name one of them")
    is_matrix = options.get("full_matrix", False) or _coupled(link)
    if program == "calculix":
        lines = _calculix(link)
    elif program == "ansys":
        lines = _ansys(link)
    elif program == "code_aster":
        lines = code_aster_cards(link)
    elif program == "lsdyna":
        lines = lsdyna_cards(link, as_matrix=is_matrix or link.has_arms)
    elif program == "subdyn":
        lines = subdyn_cards(link)
    elif program == "abaqus":
        if is_connector or (link.table is not None and (is_matrix or link.has_arms)):
            lines = _abaqus_connector(link)
        else:
            lines = _abaqus_matrices(link) if is_matrix or link.has_arms else _abaqus_springs(link)
    else:
        lines = _nastran_matrices(link) if is_matrix and link.table is None else _nastran_bush(link)
    return "\n".join([*lines, *_bodies(program, link)]) + "\n"


def _link(
    program: CardFormat,
    dofs: Sequence[str],
    matrices: tuple[FloatArray, FloatArray, FloatArray],
    nodes: Sequence[int],
    options: CardOptions,
) -> CardLink:
    """Check the arguments of `cards` and return the joint in six directions."""
    places = direction_places(dofs)
    units = model_units(options.get("units", "SI"))
    names = ("stiffness", "damping", "hysteretic damping")
    wide = [_widened(name, m, s, places, units) for name, m, s in zip(names, matrices, (2, 1, 2), strict=True)]
    named = "SI units" if units.name == "SI" else f"units {units.words} ({units.name})"
    note = f"DOFs {', '.join(DIRECTIONS[place] for place in sorted(places))}; {named}, written by jointfrf"
    if not options.get("damping", True):
        note += ", damping left out"
        wide[1:] = [np.zeros((6, 6)), np.zeros((6, 6))]
    numbers = _two_nodes("nodes", nodes)
    turning_nodes = options.get("rotation_nodes")
    turning = () if turning_nodes is None else _two_nodes("rotation_nodes", turning_nodes)
    if program == "calculix" and options.get("full_matrix", False):
        raise ValueError("full_matrix is not for calculix, which reads no matrices; leave it out")
    if turning and program != "calculix":
        raise ValueError(f"rotation_nodes are for calculix, not for {program}; leave them out")
    element, number = (
        card_integer("element", options.get("element", 1)),
        card_integer("number", options.get("number", 1)),
    )
    positions, arms, where = _geometry(options, units)
    faces = _faces(options.get("faces"), numbers)
    notes = (note, *_text_lines(options.get("comments", ())), *_text_lines(where), *_arm_note(arms, units))
    first = options.get("damping_nodes")
    if first is not None and program != "calculix":
        raise ValueError(f"damping_nodes are for calculix, not for {program}; leave them out")
    auxiliary = None if first is None else card_integer("damping_nodes", first)
    return CardLink(
        wide[0], wide[1], wide[2], (*numbers, *turning), element, number, notes, arms, positions, units, faces,
        damping_nodes=auxiliary,
    )  # fmt: skip


def _widened(name: str, matrix: FloatArray, seconds: int, places: NDArray[np.intp], units: ModelUnits) -> FloatArray:
    """Return a matrix in all six directions, in units of the model."""
    if abs(matrix - matrix.T).max() > ROUND_OFF * abs(matrix).max():
        raise ValueError(f"the {name} of the joint must be symmetric to be exported")
    turns = places > 2
    rotations = turns.astype(int)[:, None] + turns
    scale = np.array([units.scale(seconds, count) for count in range(3)])
    with np.errstate(over="ignore", under="ignore"):
        scaled = (matrix + (matrix.T - matrix) / 2) / scale[rotations]
    if not np.isfinite(scaled).all() or ((scaled == 0) & (matrix != 0)).any():
        raise ValueError(f"the {name} of {abs(matrix).max():.3g} is out of range in units {units.words}; change it")
    whole = np.zeros((6, 6))
    whole[np.ix_(places, places)] = scaled
    return whole


def _geometry(options: CardOptions, units: ModelUnits) -> tuple[FloatArray | None, FloatArray, list[str]]:
    """Return the positions of the nodes, the arms from them to the reference points, and these points."""
    given, points = options.get("positions"), options.get("points")
    if given is None:
        if points is not None:
            raise ValueError("points needs positions of the two nodes")
        return None, np.zeros((2, 3)), []
    positions = as_real("positions", given, (2, 3))
    middle = positions.mean(axis=0)
    chosen = middle if points is None else np.asarray(points, dtype=np.float64)
    ends = as_real("points", np.broadcast_to(chosen, (2, 3)), (2, 3))
    arms = ends - positions
    arms[abs(arms) < NO_ARM / units.length] = 0
    longest = units.length * float(np.linalg.norm(arms, axis=1).max())
    unit = units.words.partition(",")[0]
    if longest > _LONGEST_ARM:
        raise ValueError(
            f"a node lies {longest / units.length:.4g} {unit} from the reference point of the joint; give positions "
            f"and points in {unit}, as in {units.name}"
        )
    same = np.allclose(ends[0], ends[1], rtol=0, atol=NO_ARM / units.length)
    texts = [f"({', '.join(f'{value:.6g}' for value in end + 0.0)}) {unit}" for end in ends]
    where = texts[0] if same else f"{texts[0]} on side j, {texts[1]} on side k"
    midway = ", midway between the nodes" if points is None and arms.any() else ""
    return positions, arms, [f"reference point of the joint: {where}{midway}"]


def _faces(
    given: Sequence[Sequence[int]] | None, nodes: tuple[int, int]
) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
    """Return the nodes that follow the two nodes of the joint."""
    if given is None:
        return None
    if isinstance(given, str) or len(given) != 2:
        raise ValueError("faces must be two lists of nodes, those that follow node j and those that follow node k")
    first, second = (tuple(card_integer("faces", node) for node in as_nodes("faces", own)) for own in given)
    twice = (set(first) & set(second)) | ({*first, *second} & set(nodes))
    if twice:
        raise ValueError(f"faces must contain each node once, and not the nodes of the joint, as {min(twice)}")
    return first, second


def _text_lines(comments: Sequence[str]) -> list[str]:
    """Return comments in lines that every program reads."""
    if isinstance(comments, str):
        raise TypeError("comments must be a sequence of texts, not one text")
    texts = [visible(" ".join(str(comment).split())) for comment in comments]
    lines = [line for text in texts for line in textwrap.wrap(text, _COMMENT, subsequent_indent="    ")]
    return [line.encode("ascii", "replace").decode("ascii") for line in lines]


def _arm_note(arms: FloatArray, units: ModelUnits) -> list[str]:
    if not arms.any():
        return []
    unit = units.words.partition(",")[0]
    both = [", ".join(f"{value:.6g}" for value in arm + 0.0) for arm in arms]
    lengths = np.linalg.norm(arms, axis=1)
    return [
        f"rigid arms from the nodes to the joint: {both[0]} {unit} (j), {both[1]} {unit} (k)",
        f"their lengths: {lengths[0]:.4g} {unit} (j), {lengths[1]:.4g} {unit} (k)",
    ]


def _bodies(program: CardFormat, link: CardLink) -> list[str]:
    """Return cards that make the nodes move with faces of solid elements, or a sketch in comments."""
    if program in _WITHOUT_FACES:
        if link.faces is not None:
            raise ValueError(f"faces are not written for {program}; leave them out and connect the faces there")
        return []
    if link.faces is not None:
        return _body_cards(program, link.nodes, link.faces, link.element, link.number)
    if not link.has_arms:
        return []
    names = ("(nodes of the face on side j)", "(nodes of the face on side k)")
    drawn = _body_cards(program, link.nodes, names, link.element, link.number)
    hint = "solid elements have no rotations: let nodes of their faces follow j and k, as in"
    mark = COMMENT_MARKS[program]
    return [f"{mark} {hint}", *(f"{mark}   {line}" for line in drawn)]


def rigid_cards(
    program: CardFormat, dofs: Sequence[str], nodes: Sequence[int], options: CardOptions, *, alone: bool
) -> str:
    """Return rigid DOFs of a joint as equations between the nodes, which rigid arms connect with the joint.

    Parameters
    ----------
    program, nodes, options
        Program, nodes and options; see `spring_cards`.
    dofs : sequence of str
        Names of the rigid DOFs.
    alone : bool
        Whether there are no springs, whose cards otherwise describe the place of the joint and the faces of its nodes.

    Returns
    -------
    str
        Equations u_j + theta_j x r_j - u_k - theta_k x r_k = 0 along each DOF. Rotations of CalculiX are displacements
        of the ROT NODEs. An equation contains no rotation that another one eliminates.
    """
    check_choice("program", program, get_args(CardFormat))
    if program == "subdyn":
        raise ValueError("subdyn has no equations between joints; connect rigid DOFs there by a rigid link")
    link = _link(program, dofs, (np.zeros((len(dofs), len(dofs))),) * 3, nodes, options)
    places = [int(place) for place in direction_places(dofs)]
    mark = COMMENT_MARKS[program]
    names = ", ".join(DIRECTIONS[place] for place in places)
    lines = link.comments(mark)[1:] if alone else []
    lines.append(f"{mark} rigid DOFs {names}: one equation each, written by jointfrf")
    if program == "nastran":
        lines.append(f"$ case control: MPC = {link.number}")
    relative = np.hstack([sign * rigid_offset(DIRECTIONS, arm) for sign, arm in zip((1, -1), link.arms, strict=True)])
    for place in places:
        row = relative[place].copy()
        if place < 3:
            for turn in (one for one in places if one > 2):  # theta_j is theta_k
                row[6 + turn], row[turn] = row[6 + turn] + row[turn], 0.0
        row[abs(row) < NO_ARM / link.units.length] = 0.0
        others = [i for i in range(12) if row[i] != 0 and i != place]
        lines += _equation(program, link, [(i, float(row[i])) for i in (place, *others)])
    return "\n".join([*lines, *(_bodies(program, link) if alone else [])]) + "\n"


def _equation(program: CardFormat, link: CardLink, terms: Sequence[tuple[int, float]]) -> list[str]:
    """Return the equation of a sum of terms, (DOF among twelve, factor); the first one is eliminated."""
    if program == "calculix":
        ends = [(*link.calculix_dof(i), factor) for i, factor in terms]
    else:
        ends = [(link.nodes[i // 6], i % 6 + 1, factor) for i, factor in terms]
    if program in ("abaqus", "calculix"):
        words = [f"{node}, {dof}, {f'{factor:.12g}' if factor % 1 else f'{factor:.0f}.'}" for node, dof, factor in ends]
        rows = [", ".join(words[at : at + _TERMS]) for at in range(0, len(words), _TERMS)]
        return ["*EQUATION", str(len(ends)), *rows]
    if program == "code_aster":
        return code_aster_equation(ends)
    if program == "lsdyna":
        return lsdyna_equation(ends, link.number + terms[0][0])
    if program == "ansys":
        words = [f"{node},{_ANSYS_DOFS[dof - 1]},{factor:.12g}" for node, dof, factor in ends]
        rows = [",".join(words[at : at + 3]) for at in range(0, len(words), 3)]
        return [f"CE,{'HIGH' if at else 'NEXT'},0,{row}" for at, row in enumerate(rows)]
    fields: list[str | int | float] = [link.number]
    for at, (node, dof, factor) in enumerate(ends):
        fields += [*(("", "") if at and at % 2 == 0 else ()), node, dof, factor]
    return large_card("MPC", fields)


def _body_cards(
    program: CardFormat,
    nodes: Sequence[int],
    faces: tuple[Sequence[int] | str, Sequence[int] | str],
    element: int,
    number: int,
) -> list[str]:
    lines: list[str] = []
    for side, face, node in zip("JK", faces, nodes, strict=False):
        name = f"JOINT{number}_{side}"
        words = [face] if isinstance(face, str) else [str(one) for one in face]
        rows = [", ".join(words[at : at + _IN_A_LINE]) for at in range(0, len(words), _IN_A_LINE)]
        if program in ("abaqus", "calculix"):
            lines += [f"*NSET, NSET={name}", *(f"{row}," if row != rows[-1] else row for row in rows)]
        if program == "calculix":
            turning = f", ROT NODE={nodes[2 + 'JK'.index(side)]}" if len(nodes) > 2 else ""
            lines.append(f"*RIGID BODY, NSET={name}, REF NODE={node}{turning}")
        elif program == "abaqus":
            lines.append(f"*RIGID BODY, REF NODE={node}, PIN NSET={name}")
        elif program == "nastran":
            fields = [str(card_integer("element", element + 1 + "JK".index(side))), str(node), "123", *words]
            lines += _small("RBE2", fields)
        else:
            lines += [f"CERIG,{node},{word},UXYZ" for word in words]
    return lines


def _small(name: str, words: Sequence[str]) -> list[str]:
    """Return lines of a small-field card, eight fields of 8 columns each; longer texts stay unchanged."""
    rows = [words[at : at + _IN_A_LINE] for at in range(0, len(words), _IN_A_LINE)]
    return [f"{name if i == 0 else '+':<8}" + "".join(f"{word:>8}" for word in row) for i, row in enumerate(rows)]


def _two_nodes(name: str, nodes: Sequence[int]) -> tuple[int, int]:
    two = as_nodes(name, nodes)
    if len(two) != 2 or two[0] == two[1]:
        raise ValueError(f"{name} must be two different nodes, not {reprlib.repr(nodes)}")
    return card_integer(name, two[0]), card_integer(name, two[1])


def _coupled(link: CardLink) -> bool:
    tables = [] if link.table is None else [link.table.stiffness, link.table.damping]
    return any(np.count_nonzero(matrix * (1 - np.eye(6))) > 0 for matrix in (*link.matrices, *tables))


def _abaqus_springs(link: CardLink) -> list[str]:
    lines = link.comments("**")
    element = link.element
    joined = f"{link.nodes[0]}, {link.nodes[1]}"
    for i in range(6):
        k, c, h = (float(matrix[i, i]) for matrix in link.matrices)
        of_dof = f"{i + 1}, {i + 1}"
        if link.table is not None:
            for word, kind, letter, values in (
                ("SPRING", "SPRING2", "K", link.table.stiffness[:, i, i]),
                ("DASHPOT", "DASHPOT2", "C", link.table.damping[:, i, i]),
            ):
                if values.any():
                    name = f"JOINT{link.number}_{letter}{i + 1}"
                    lines += [f"*ELEMENT, TYPE={kind}, ELSET={name}", f"{card_integer('element', element)}, {joined}"]
                    lines += [f"*{word}, ELSET={name}", of_dof]
                    lines += [f"{card_real(x)}, {card_real(f)}" for x, f in zip(values, link.table.freq, strict=True)]
                    element += 1
            continue
        if k != 0 or h != 0:
            name = f"JOINT{link.number}_K{i + 1}"
            lines += [f"*ELEMENT, TYPE=SPRING2, ELSET={name}", f"{card_integer('element', element)}, {joined}"]
            lines += [f"*SPRING, ELSET={name}" + (", COMPLEX STIFFNESS" if h else ""), of_dof]
            lines += [f"{card_real(k)}, {card_real(h)}" if h else card_real(k)]
            element += 1
        if c != 0:
            name = f"JOINT{link.number}_C{i + 1}"
            lines += [f"*ELEMENT, TYPE=DASHPOT2, ELSET={name}", f"{card_integer('element', element)}, {joined}"]
            lines += [f"*DASHPOT, ELSET={name}", of_dof, card_real(c)]
            element += 1
    return lines


def _abaqus_connector(link: CardLink) -> list[str]:
    """Return one connector element for direct steady-state steps: motion of node K relative to node J as a rigid body.

    The relative motion of the joint's point is the motion of node K plus the arm of K times the rotation of K against
    J.
    """
    if not link.has_one_point:
        raise ValueError("a connector element needs one reference point of both sides of the joint; name one in points")
    if link.table is None and link.hysteretic.any():
        raise ValueError(
            "a connector element has no hysteretic damping; write a table over frequency by table_hz=, or leave "
            "damping out with damping=False"
        )
    move = rigid_offset(DIRECTIONS, link.arms[1])
    name, j, k = f"JOINT{link.number}", *link.nodes[:2]
    lines = [*link.comments("**")]
    if link.positions is None:
        lines.append(f"** a connector acts at node {k} where its nodes are apart")
    lines += [f"*ELEMENT, TYPE=CONN3D2, ELSET={name}", f"{link.element}, {j}, {k}"]
    lines += [f"*CONNECTOR SECTION, ELSET={name}, BEHAVIOR={name}_B", "CARTESIAN, CARDAN"]
    lines.append(f"*CONNECTOR BEHAVIOR, NAME={name}_B")
    table = link.table or CardTable(np.zeros(1), link.stiffness[None], link.damping[None])
    for word, matrices in (("ELASTICITY", table.stiffness), ("DAMPING", table.damping)):
        if not matrices.any():
            continue
        lines.append(f"*CONNECTOR {word}" + (", FREQUENCY DEPENDENCE=ON" if link.table else ""))
        for freq, matrix in zip(table.freq, matrices, strict=True):
            moved = move.T @ matrix @ move
            words = [card_real(float(moved[row, column])) for column in range(6) for row in range(column + 1)]
            words += [card_real(float(freq))] if link.table else []
            lines += [", ".join(words[at : at + _IN_A_LINE]) for at in range(0, len(words), _IN_A_LINE)]
    return lines


def _abaqus_matrices(link: CardLink) -> list[str]:
    lines = [
        *link.comments("**"),
        "** matrices take part in steps of the SIM architecture, not in direct steady-state ones,",
        "** which take connector elements",
    ]
    used = []
    words = ("STIFFNESS", "VISCOUS DAMPING", "STRUCTURAL DAMPING")
    for letter, word, matrix in zip("KCH", words, link.matrices, strict=True):
        if matrix.any():
            name = f"JOINT{link.number}_{letter}"
            used.append(f"{word}={name}")
            lines += [f"*MATRIX INPUT, NAME={name}, TYPE=SYMMETRIC"]
            lines += [f"{a}, {i}, {b}, {j}, {card_real(x)}" for a, i, b, j, x in upper_entries(link, matrix)]
    if used:
        lines.append("*MATRIX ASSEMBLE, " + ", ".join(used))
    return lines


def _calculix(link: CardLink) -> list[str]:
    """Return springs that sum to the matrix: SPRING2 for each entry off the diagonal, SPRING1 for each row sum."""
    if link.hysteretic.any():
        raise ValueError("calculix has no complex spring between DOFs; leave damping out with damping=False")
    if link.damping.any() and link.damping_nodes is None:
        raise ValueError(
            "calculix takes dashpots between auxiliary nodes; name the first of them by damping_nodes, or leave "
            "damping out with damping=False"
        )
    whole = link.both_sides(link.stiffness)
    at = link.calculix_dof
    springs: list[tuple[list[tuple[int, int]], float]] = []
    for a in range(12):
        springs += [([at(a), at(b)], -float(whole[a, b])) for b in range(a + 1, 12) if whole[a, b] != 0]
        if abs(whole[a].sum()) > ROUND_OFF * abs(whole[a]).sum():
            springs.append(([at(a)], float(whole[a].sum())))
    lines = link.comments("**")
    for i, (ends, k) in enumerate(springs):
        name = f"JOINT{link.number}_{i + 1}"
        lines += [f"*ELEMENT, TYPE=SPRING{len(ends)}, ELSET={name}"]
        lines += [", ".join(map(str, (card_integer("element", link.element + i), *(node for node, _ in ends))))]
        lines += [f"*SPRING, ELSET={name}", ", ".join(str(dof) for _, dof in ends), card_real(k)]
    return [*lines, *_calculix_dashpots(link, link.element + len(springs))]


def _calculix_dashpots(link: CardLink, element: int) -> list[str]:
    """Write C = sum of c g g^T, each term as a dashpot between a fixed node and a node that moves by g^T (u_j - u_k).

    DASHPOTA acts along the line between its nodes, which are one unit apart along x.
    """
    if not link.damping.any():
        return []
    assert link.damping_nodes is not None
    lines = [
        "** dashpots act between auxiliary nodes whose displacement is, by an equation, that of",
        "**     the joint; for *STEADY STATE DYNAMICS and *MODAL DYNAMIC after",
        "**     *FREQUENCY, STORAGE=YES",
    ]
    sides = np.hstack([sign * rigid_offset(DIRECTIONS, arm) for sign, arm in zip((1, -1), link.arms, strict=True)])
    for i, (c, shape) in enumerate(_rank_one(link.damping)):
        free, held = (card_integer("damping_nodes", link.damping_nodes + 2 * i + at) for at in (0, 1))
        motion = shape @ sides
        motion[abs(motion) < ROUND_OFF * abs(motion).max()] = 0.0
        ends = [
            (free, 1, -1.0),
            *((*link.calculix_dof(at), float(motion[at])) for at in np.flatnonzero(motion).tolist()),
        ]
        words = [f"{node}, {dof}, {factor:.12E}" for node, dof, factor in ends]
        name = f"JOINT{link.number}_C{i + 1}"
        lines += ["*NODE", f"{free}, 0., 0., 0.", f"{held}, 1., 0., 0.", "*BOUNDARY", f"{free}, 2, 3", f"{held}, 1, 3"]
        lines += ["*EQUATION", str(len(ends))]
        lines += [", ".join(words[at : at + _TERMS]) for at in range(0, len(words), _TERMS)]
        lines += [f"*ELEMENT, TYPE=DASHPOTA, ELSET={name}", f"{card_integer('element', element + i)}, {free}, {held}"]
        lines += [f"*DASHPOT, ELSET={name}", "", card_real(c)]
    return lines


def _rank_one(matrix: FloatArray) -> list[tuple[float, FloatArray]]:
    """Return c and g of a symmetric matrix that is the sum of c g g^T; the largest entry of each g is 1."""
    coupled = [i for i in range(6) if np.count_nonzero(np.delete(matrix[i], i))]
    found = [(float(matrix[i, i]), np.eye(6)[i]) for i in range(6) if matrix[i, i] and i not in coupled]
    if not coupled:
        return found
    own = matrix[np.ix_(coupled, coupled)]
    size = np.sqrt(abs(own).max(axis=1))  # translations and rotations have different units
    values, vectors = np.linalg.eigh(own / np.outer(size, size))
    for value, vector in zip(values, vectors.T, strict=True):
        if abs(value) > ROUND_OFF * abs(values).max():
            shape = np.zeros(6)
            shape[coupled] = size * vector
            largest = shape[np.argmax(abs(shape))]
            found.append((float(value * largest**2), shape / largest))
    return found


def _nastran_bush(link: CardLink) -> list[str]:
    k, c, h = (matrix.diagonal() for matrix in link.matrices)
    if link.table is not None and (_coupled(link) or not link.has_one_point):
        raise ValueError(
            "PBUSHT of nastran has tables of single directions at one point; leave out terms between directions and "
            "reference points that are apart"
        )
    if ((k == 0) & (h != 0)).any():
        return _nastran_matrices(link)  # GE is a multiple of K
    eta = np.divide(h, k, out=np.zeros(6), where=k != 0)
    # Continuations begin with an empty field, then the letter and six values.
    fields: list[str | int | float] = [link.number, "K", *k.tolist()]
    for word, values in (("B", c), ("GE", eta)):
        if values.any():
            fields += ["", word, *values.tolist()]
    apart = [] if link.positions is not None else [
        "CBUSH puts rigid arms between grids that are apart: the joint then",
        "    acts midway between them",
    ]  # fmt: skip
    place = _bush_place(link)
    if place is None:
        return _nastran_matrices(link)
    system, where = place
    return [
        *link.comments("$"),
        *(f"$ {line}" for line in apart),
        *system,
        *_bush(link, where),
        *large_card("PBUSH", fields),
        *_bush_tables(link),
    ]


def _bush_tables(link: CardLink) -> list[str]:
    """Return PBUSHT and its tables; PBUSH contains the first line, for other analyses."""
    if link.table is None:
        return []
    fields: list[str | int | float] = [link.number]
    tables: list[str] = []
    number = link.number
    for word, matrices in (("K", link.table.stiffness), ("B", link.table.damping)):
        numbers: list[str | int | float] = []
        for i in range(6):
            values = matrices[:, i, i]
            numbers.append(card_integer("number", number) if values.any() else "")
            if values.any():
                pairs = [float(x) for pair in zip(link.table.freq, values, strict=True) for x in pair]
                tables += large_card("TABLED1", [number, "", "", "", "", "", "", "", *pairs, "ENDT"])
                number += 1
        if any(one != "" for one in numbers):
            fields += [*([] if fields == [link.number] else [""]), word, *numbers]
    return [*large_card("PBUSHT", fields), *tables]


def _bush(link: CardLink, where: list[str | int | float]) -> list[str]:
    """Return a CBUSH whose axes are the axes of the basic system."""
    numbers = [link.element, link.number, *link.nodes[:2]]
    if where:
        return large_card("CBUSH", [*numbers, "", "", "", 0, *where])
    return [f"{'CBUSH':<8}" + "".join(f"{number:8d}" for number in numbers) + " " * 24 + f"{0:8d}"]


def _bush_place(link: CardLink) -> tuple[list[str], list[str | int | float]] | None:
    """Return the place of a CBUSH: cards of a coordinate system, and the fields S, OCID, S1, S2, S3.

    None if the joint has different points on both sides: a CBUSH has one.
    """
    if link.positions is None or not link.has_arms:
        return [], []
    node_j, node_k = link.positions
    if not link.has_one_point:
        return None
    apart = node_k - node_j
    length = float(np.linalg.norm(apart))
    share = float(link.arms[0] @ apart) / length**2 if length > 0 else -1.0
    if 0 <= share <= 1 and np.linalg.norm(link.arms[0] - share * apart) <= _ON_LINE * length:
        return [], [share]
    # A coordinate system that begins at grid GA: the same place, whether S1 to S3 count from there or from the system.
    corners = [node_j, node_j + np.array([0.0, 0.0, 1.0]), node_j + np.array([1.0, 0.0, 0.0])]  # of any length
    fields: list[str | int | float] = [link.number, 0, *(float(x) for corner in corners for x in corner)]
    return large_card("CORD2R", fields), ["", link.number, *(float(x) for x in link.arms[0])]


def _nastran_matrices(link: CardLink) -> list[str]:
    names = {"K2GG": f"KJ{link.number}", "B2GG": f"BJ{link.number}", "K42GG": f"HJ{link.number}"}
    used = [(command, names[command], m) for command, m in zip(names, link.matrices, strict=True) if m.any()]
    if any(len(name) > 8 for _, name, _ in used):
        raise ValueError("number must have at most six digits, as a part of a name of eight characters")
    lines = [*link.comments("$"), "$ case control: " + ", ".join(f"{command} = {name}" for command, name, _ in used)]
    for _, name, matrix in used:
        lines += dmig(link, name, matrix)
    return lines


def _ansys(link: CardLink) -> list[str]:
    """Return MATRIX27 elements: the upper triangle row by row, UX ... ROTZ of node j, then of node k."""
    if link.hysteretic.any():
        raise ValueError("MATRIX27 of ansys has no hysteretic damping; leave damping out with damping=False")
    lines = [*link.comments("!"), "! directions are those of the nodal coordinate systems"]
    i = 0
    for option, matrix in ((4, link.stiffness), (5, link.damping)):
        if not matrix.any():
            continue
        constants = [card_real(value, 19) if value else "0" for value in link.both_sides(matrix)[np.triu_indices(12)]]
        kind, element = card_integer("number", link.number + i), card_integer("element", link.element + i)
        lines.append(f"ET,{kind},MATRIX27,,0,{option}")
        for first in range(0, len(constants), 6):
            head = f"R,{kind}," if first == 0 else "RMORE,"
            lines.append(head + ",".join(constants[first : first + 6]))
        lines += [f"TYPE,{kind}", f"REAL,{kind}", f"EN,{element},{link.nodes[0]},{link.nodes[1]}"]
        i += 1
    return lines
