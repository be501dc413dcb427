"""Joints as text for finite-element programs, read back by small readers of their own, and run by CalculiX."""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from calculix_deck import frequency_step, natural_frequencies
from jointfrf.dofs import rigid_offset
from jointfrf.io.card_link import card_real
from jointfrf.workbench.fe.bulk import bulk_number

CCX = shutil.which("ccx")
DOFS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
NODES = (102, 202)
PLACE = {(node, i + 1): 6 * side + i for side, node in enumerate(NODES) for i in range(6)}


def random_matrix(seed, n, scale):
    """Positive definite, of very different sizes of entries."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((n, n)) * scale
    return root @ root.T


SIZES = np.array([1e3, 2e2, 1e4, 30.0, 7.0, 90.0])[:, None]
COUPLED = jf.Joint(
    random_matrix(1, 6, SIZES),
    random_matrix(2, 6, SIZES / 100),
    ("theta_y", "x", "z", "y", "theta_z", "theta_x"),
    structural_damping=random_matrix(3, 6, SIZES / 10),
)
DIAGONAL = jf.Joint(
    [6.0123456789012e5, -7.123456789012345e3, 4 / 3 * 1e8],
    [20.0 / 3, 0, 1e-3 / 7],
    ("UY", "rx", "theta_z"),
    loss_factor=[0.01, 0, 0.3],
)


def expected(joint):
    """[[K, -K], [-K, K]] of stiffness, damping and hysteretic damping at x ... theta_z of nodes j and k, (12, 12)."""
    names = [{"UY": "y", "rx": "theta_x"}.get(dof, dof) for dof in joint.dofs]
    whole = np.zeros((3, 12, 12))
    relative = np.zeros((len(names), 12))
    for row, name in zip(relative, names, strict=True):
        row[[DOFS.index(name), 6 + DOFS.index(name)]] = 1, -1
    for matrix, own in zip(whole, (joint.stiffness, joint.damping, joint.hysteretic_stiffness), strict=True):
        matrix += relative.T @ own @ relative
    return whole


def spring(matrix, a, b, value):
    """Energy value (u_a - u_b)^2 / 2."""
    for row, column, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
        matrix[row, column] += sign * value


def keywords(text):
    """(keyword, parameters, rows) of an input of Abaqus or CalculiX."""
    found = []
    for line in text.splitlines():
        assert len(line) < 256
        if line.startswith("**"):
            continue
        words = [word.strip() for word in line.split(",")]
        if line.startswith("*"):
            pairs = (word.partition("=")[::2] for word in words[1:])
            found.append((words[0], {name.strip(): value.strip() for name, value in pairs}, []))
        else:
            assert all(len(word) <= 20 for word in words)
            found[-1][2].append(words)
    return found


def read_springs(text, place=PLACE):
    """Matrices (3, 12, 12) from SPRING2 and DASHPOT2."""
    whole = np.zeros((3, 12, 12))
    ends, seen = {}, set()
    for word, parameters, rows in keywords(text):
        name = parameters["ELSET"]
        if word == "*ELEMENT":
            ((number, a, b),) = rows
            assert number not in seen
            seen.add(number)
            ends[name] = (parameters["TYPE"], int(a), int(b))
            continue
        kind, a, b = ends.pop(name)
        assert kind == {"*SPRING": "SPRING2", "*DASHPOT": "DASHPOT2"}[word]
        (dof_a, dof_b), values = rows
        at = place[a, int(dof_a)], place[b, int(dof_b)]
        assert len(values) == (2 if "COMPLEX STIFFNESS" in parameters else 1)
        for target, value in zip((0, 2) if word == "*SPRING" else (1,), values, strict=False):
            spring(whole[target], *at, float(value))
    assert not ends
    return whole


def read_abaqus_matrices(text):
    *inputs, (last, used, _) = keywords(text)
    assert last == "*MATRIX ASSEMBLE"
    order = {"STIFFNESS": 0, "VISCOUS DAMPING": 1, "STRUCTURAL DAMPING": 2}
    target = {name: order[kind] for kind, name in used.items()}
    whole = np.zeros((3, 12, 12))
    for word, parameters, rows in inputs:
        assert (word, parameters["TYPE"]) == ("*MATRIX INPUT", "SYMMETRIC")
        for a, i, b, j, value in rows:
            row, column = PLACE[int(a), int(i)], PLACE[int(b), int(j)]
            assert whole[target[parameters["NAME"]], row, column] == 0
            whole[target[parameters["NAME"]], row, column] = float(value)
            whole[target[parameters["NAME"]], column, row] = float(value)
    return whole


def read_connector(text, places):
    """Frequencies, and K, C by frequency, (n, 12, 12), of one CONN3D2: motion of K as J, rotating, sees it."""
    found, freq = {}, []
    for word, parameters, rows in keywords(text):
        if word == "*ELEMENT":
            assert parameters["TYPE"] == "CONN3D2"
            assert [int(x) for x in rows[0][1:]] == list(NODES)
        elif word == "*CONNECTOR SECTION":
            assert rows == [["CARTESIAN", "CARDAN"]]
        elif word in ("*CONNECTOR ELASTICITY", "*CONNECTOR DAMPING"):
            values = [float(x) for row in rows for x in row]
            size = 22 if parameters.get("FREQUENCY DEPENDENCE") == "ON" else 21
            assert len(values) % size == 0
            assert all(len(row) == 8 for i, row in enumerate(rows) if i % 3 < 2)
            matrices = []
            for own in np.reshape(values, (-1, size)):
                matrix = np.zeros((6, 6))
                matrix.T[np.tril_indices(6)] = own[:21]  # 11, 12, 22, 13, ...: column after column
                matrices.append(matrix + matrix.T - np.diag(matrix.diagonal()))
            freq = np.reshape(values, (-1, size))[:, 21:].ravel()
            found[word] = np.array(matrices)
        else:
            assert word == "*CONNECTOR BEHAVIOR"
    apart = np.subtract(places[1], places[0])
    seen = np.zeros((6, 12))
    for i, unit in enumerate(np.eye(12)):
        u_j, turn_j, u_k, turn_k = unit.reshape(4, 3)
        seen[:, i] = [*(u_k - u_j - np.cross(turn_j, apart)), *(turn_k - turn_j)]
    none = np.zeros((1, 6, 6))
    order = ("*CONNECTOR ELASTICITY", "*CONNECTOR DAMPING")
    return freq, *(seen.T @ found.get(word, none) @ seen for word in order)


#: A joint whose stiffness and damping depend on frequency, with cross terms or without.
LAWS = {
    "y": jf.StandardLinearSolid(6e5, 2e5, 1e-3),
    "theta_z": jf.FractionalZener(5e3, 1e3, 2e-4, 0.6),
    "x": jf.SpringLaw(1e6, h=2e4),
}
TABLE_HZ = [10.0, 60.0, 200.0, 900.0]


def of_laws(joint):
    """K* of both sides over the table, (n, 12, 12), at x ... theta_z of nodes that lie at the joint."""
    relative = np.zeros((len(joint.dofs), 12))
    for row, dof in zip(relative, joint.dofs, strict=True):
        row[[DOFS.index(dof), 6 + DOFS.index(dof)]] = 1, -1
    return relative.T @ joint.dynamic_stiffness(TABLE_HZ) @ relative


def moved(matrix, positions, point):
    """The same for nodes elsewhere: rigid arms lead to the point."""
    arms = np.zeros((12, 12))
    for side, place in enumerate(positions):
        own = slice(6 * side, 6 * side + 6)
        arms[own, own] = rigid_offset(DOFS, np.subtract(point, place))
    return arms.T @ matrix @ arms


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("beside", [False, True])
def test_laws_as_tables_of_abaqus(coupled, beside):
    laws = LAWS | ({("y", "theta_z"): jf.StandardLinearSolid(2e3, 1e2, 1e-3)} if coupled else {})
    joint = jf.LawJoint(laws)
    positions, point = (
        ([[0.1, 0.2, 0.3], [0.15, 0.2, 0.28]], [0.12, 0.21, 0.3]) if beside else (2 * [[0, 0, 0]], [0, 0, 0])
    )
    text = joint.export("abaqus", NODES, table_hz=TABLE_HZ, positions=positions, points=point, faces=[[1], [2]])
    text = text[: text.index("*NSET")]
    exact = moved(of_laws(joint), positions, point)
    if coupled or beside:
        freq, stiffness, damping = read_connector(text, positions)
        np.testing.assert_allclose(freq, TABLE_HZ, rtol=1e-13)
    else:
        stiffness, damping = np.zeros((2, len(TABLE_HZ), 12, 12))
        at = None
        for word, parameters, rows in keywords(text):
            if word == "*ELEMENT":
                at = parameters["TYPE"]
                continue
            assert (word, at) in (("*SPRING", "SPRING2"), ("*DASHPOT", "DASHPOT2"))
            (dof, same), *lines = rows
            assert dof == same
            np.testing.assert_allclose([float(row[1]) for row in lines], TABLE_HZ, rtol=1e-13)
            for matrix, row in zip(stiffness if word == "*SPRING" else damping, lines, strict=True):
                spring(matrix, int(dof) - 1, 5 + int(dof), float(row[0]))
    found = stiffness + 2j * np.pi * np.array(TABLE_HZ)[:, None, None] * damping
    np.testing.assert_allclose(found, exact, atol=1e-12 * abs(exact).max())


@pytest.mark.parametrize("units", ["SI", "mm-kg-ms"])
def test_laws_as_tables_of_nastran(units):
    joint = jf.LawJoint(LAWS)
    cards = nastran_fields(joint.export("nastran", NODES, table_hz=TABLE_HZ, number=77, units=units))
    names = [card[0] for card in cards]
    assert names == ["CBUSH", "PBUSH", "PBUSHT", *["TABLED1"] * 6]
    tables = {}
    for card in cards[3:]:
        assert card[2:9] == [""] * 7
        values = [nastran_real(word) for word in card[9 : card.index("ENDT")]]
        tables[card[1]] = np.reshape(values, (-1, 2))
    groups = {}
    for i in range(2):
        word, *numbers = cards[2][2 + 8 * i : 9 + 8 * i]
        groups[word] = numbers
    assert cards[2][1] == cards[1][1] == "77"
    si = {"SI": (1.0, 1.0, 1.0), "mm-kg-ms": (1e6, 1.0, 1e-3)}[units]  # N/m, N m/rad of a unit; s
    exact = joint.dynamic_stiffness(TABLE_HZ)
    for i, dof in enumerate(DOFS):
        if dof not in joint.dofs:
            assert groups["K"][i] == groups["B"][i] == ""
            continue
        own = exact[:, joint.dofs.index(dof), joint.dofs.index(dof)]
        k, b = (tables[groups[word][i]] for word in "KB")
        np.testing.assert_allclose(k[:, 0], np.array(TABLE_HZ) * si[2], rtol=1e-12)
        scale = si[1] if dof.startswith("theta") else si[0]
        np.testing.assert_allclose(k[:, 1] * scale, own.real, rtol=1e-10)
        omega = 2 * np.pi * k[:, 0]  # per unit of time
        np.testing.assert_allclose(omega * b[:, 1] * scale, own.imag, rtol=1e-10)
        assert nastran_real(cards[1][3 + i]) == pytest.approx(k[0, 1], rel=1e-10)  # for other analyses


def test_a_constant_joint_as_a_connector():
    positions, point = [[0.1, 0.2, 0.3], [0.15, 0.2, 0.28]], [0.12, 0.21, 0.3]
    text = WITHOUT_LOSS.export("abaqus", NODES, connector=True, positions=positions, points=point, faces=[[1], [2]])
    _, stiffness, damping = read_connector(text[: text.index("*NSET")], positions)
    for found, exact in zip((stiffness[0], damping[0]), expected(WITHOUT_LOSS), strict=False):
        np.testing.assert_allclose(found, moved(exact, positions, point), atol=1e-12 * abs(exact).max())
    assert "acts at node 202" in WITHOUT_LOSS.export("abaqus", NODES, connector=True)


def nastran_fields(text):
    """Cards as lists of fields without the first and the tenth of every line of eight."""
    found = []
    for line in text.splitlines():
        if line.startswith("$"):
            continue
        assert len(line) <= 72
        first = line[:8].strip()
        width, count = (16, 4) if first.endswith("*") else (8, 8)
        fields = [line[8 + width * i : 8 + width * (i + 1)].strip() for i in range(count)]
        if first == "*":
            found[-1] += fields
        else:
            found.append([first.rstrip("*"), *fields])
    return found


def nastran_real(field):
    """A real number: with a point, the exponent with or without its letter; empty is zero."""
    match = re.fullmatch(r"([+-]?\d+\.\d*)(?:E?([+-]\d+))?", field)
    assert match or field == "", field
    return float(f"{match[1]}E{match[2] or 0}") if match else 0.0


def read_bush(text):
    bush, pbush = nastran_fields(text)
    assert bush[0] == "CBUSH"
    assert bush[8] == "0"  # directions of the basic system
    assert bush[2] == pbush[1]
    a, b = int(bush[3]), int(bush[4])
    assert pbush[0] == "PBUSH"
    groups = {"K": np.zeros(6), "B": np.zeros(6), "GE": np.zeros(6)}
    rows = [pbush[2 + 8 * i : 9 + 8 * i] for i in range((len(pbush) - 2 + 7) // 8)]
    for word, *values in rows:
        groups[word] = np.array([nastran_real(value) for value in values])
    whole = np.zeros((3, 12, 12))
    for i in range(6):
        at = PLACE[a, i + 1], PLACE[b, i + 1]
        for target, value in enumerate((groups["K"][i], groups["B"][i], groups["GE"][i] * groups["K"][i])):
            spring(whole[target], *at, value)
    return whole


def read_dmig(text):
    control = re.search(r"case control: (.*)", text)[1]
    order = {"K2GG": 0, "B2GG": 1, "K42GG": 2}
    target = {name: order[word] for word, name in (pair.split(" = ") for pair in control.split(", "))}
    whole = np.zeros((3, 12, 12))
    for word, name, *rest in nastran_fields(text):
        assert word == "DMIG"
        if rest[0] == "0":
            assert rest[1:4] == ["6", "2", "0"]  # symmetric, double precision
            continue
        column = PLACE[int(rest[0]), int(rest[1])]
        for node, dof, value, empty in zip(*(rest[i::4] for i in (3, 4, 5, 6)), strict=False):
            assert empty == ""
            row = PLACE[int(node), int(dof)]
            assert whole[target[name], row, column] == 0
            whole[target[name], row, column] = whole[target[name], column, row] = nastran_real(value)
    return whole


def read_matrix27(text):
    """Execute the few commands of APDL."""
    whole = np.zeros((3, 12, 12))
    kinds, reals, active = {}, {}, {}
    for line in text.splitlines():
        assert len(line) <= 128
        command, *words = line.split(",")
        if command == "ET":
            assert words[1:4] == ["MATRIX27", "", "0"]
            kinds[words[0]] = {"4": 0, "5": 1}[words[4]]
        elif command == "R":
            active["set"] = words[0]
            reals[words[0]] = words[1:]
        elif command == "RMORE":
            assert len(words) <= 6
            reals[active["set"]] += words
        elif command in ("TYPE", "REAL"):
            active[command] = words[0]
        elif command == "EN":
            nodes = [int(word) for word in words[1:]]
            constants = iter(map(float, reals[active["REAL"]]))
            for i in range(12):
                for j in range(i, 12):
                    at = [PLACE[nodes[p // 6], p % 6 + 1] for p in (i, j)]
                    whole[kinds[active["TYPE"]], at[0], at[1]] = next(constants)
                    whole[kinds[active["TYPE"]], at[1], at[0]] = whole[kinds[active["TYPE"]], at[0], at[1]]
            assert next(constants, None) is None
        else:
            assert command.startswith("!")
    return whole


WITHOUT_LOSS = jf.Joint(COUPLED.stiffness, COUPLED.damping, COUPLED.dofs)


@pytest.mark.parametrize(
    ("joint", "program", "options", "reader", "digits"),
    [
        (DIAGONAL, "abaqus", {}, read_springs, 13),
        (DIAGONAL, "abaqus", {"full_matrix": True}, read_abaqus_matrices, 13),
        (COUPLED, "abaqus", {}, read_abaqus_matrices, 13),
        (DIAGONAL, "nastran", {}, read_bush, 11),
        (DIAGONAL, "nastran", {"full_matrix": True}, read_dmig, 11),
        (COUPLED, "nastran", {}, read_dmig, 11),
        (WITHOUT_LOSS, "ansys", {}, read_matrix27, 12),
    ],
)
def test_text_holds_the_joint(joint, program, options, reader, digits):
    found = reader(joint.export(program, NODES, element=9001, number=77, **options))
    for ours, exact in zip(found, expected(joint), strict=True):
        np.testing.assert_allclose(ours, exact, rtol=10.0**-digits * 2, atol=1e-13 * abs(exact).max())


@pytest.mark.parametrize(
    ("joint", "program", "options", "message"),
    [
        (COUPLED, "abaqus", {"connector": True}, "a connector element has no hysteretic damping; write a table"),
        (DIAGONAL, "nastran", {"connector": True}, "connector elements are for abaqus"),
        (WITHOUT_LOSS, "abaqus", {"connector": True, "full_matrix": True}, "exclude each other"),
        (WITHOUT_LOSS, "abaqus", {"connector": True, "positions": [[0, 0, 0], [1, 0, 0]],
                                  "points": [[0, 0, 0], [0.5, 0, 0]]}, "needs one reference point"),
        (COUPLED, "nastran", {"table_hz": TABLE_HZ}, "PBUSHT of nastran has tables of single directions"),
        (DIAGONAL, "ansys", {"table_hz": TABLE_HZ}, "ansys has no tables over frequency"),
        (DIAGONAL, "calculix", {"table_hz": TABLE_HZ}, "calculix has no tables over frequency"),
        (DIAGONAL, "abaqus", {"table_hz": [0.0, 5.0]}, "at least two frequencies above 0 Hz"),
        (DIAGONAL, "abaqus", {"table_hz": [5.0]}, "at least two frequencies above 0 Hz"),
        (DIAGONAL, "abaqus", {"table_hz": TABLE_HZ, "full_matrix": True}, "full_matrix has no tables"),
    ],
)  # fmt: skip
def test_what_no_connector_and_no_table_holds(joint, program, options, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        joint.export(program, NODES, **options)


def test_calculix_springs_add_up_to_the_matrix():
    place = {
        (node, i + 1): 6 * side + 3 * turn + i
        for side, pair in enumerate(((1, 2), (3, 4)))
        for turn, node in enumerate(pair)
        for i in range(3)
    }
    text = COUPLED.export("calculix", (1, 3), rotation_nodes=(2, 4), damping=False)
    assert "damping left out" in text
    stiffness, *none = read_springs(text, place)
    exact = expected(COUPLED)[0]
    # The springs cancel on the diagonal.
    np.testing.assert_allclose(stiffness, exact, rtol=1e-12, atol=1e-12 * abs(exact).max())
    assert not np.any(none)


def test_hysteretic_damping_without_stiffness_is_written_as_a_matrix():
    joint = jf.Joint([0.0], dofs=["z"], structural_damping=[5.0])
    np.testing.assert_allclose(read_dmig(joint.export("nastran", NODES)), expected(joint))
    np.testing.assert_allclose(read_springs(joint.export("abaqus", NODES)), expected(joint))


def test_a_fit_is_exported_as_its_joint():
    freq = np.linspace(0.5, 10, 100)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    h = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]
    fit = jf.identify(freq, jf.pollute(h, 0.01, seed=3), ["x"], damping="viscous")
    found = read_springs(jf.cards(fit, "abaqus", NODES, element=5))
    assert found[0, 0, 6] == pytest.approx(-fit.stiffness[0], rel=1e-12)
    assert found[1, 0, 0] == pytest.approx(fit.damping[0], rel=1e-12)


@pytest.mark.parametrize(
    ("joint", "arguments", "options", "message"),
    [
        (DIAGONAL, ("marc", NODES), {}, "program must be one of"),
        (DIAGONAL, ("abaqus", (1, 1)), {}, "nodes must be two different nodes"),
        (DIAGONAL, ("abaqus", (1, 2, 3)), {}, "nodes must be two different nodes"),
        (DIAGONAL, ("nastran", (1, 123456789)), {}, "nodes must be an integer from 1 to 99999999"),
        (DIAGONAL, ("nastran", NODES), {"element": 0}, "element must be an integer"),
        (DIAGONAL, ("nastran", NODES), {"number": 1.5}, "number must be an integer"),
        (COUPLED, ("nastran", NODES), {"number": 1234567}, "at most six digits"),
        (DIAGONAL, ("calculix", NODES), {}, "damping=False"),
        (DIAGONAL, ("calculix", NODES), {"damping": False}, "calculix has rotations at ROT NODEs"),
        (DIAGONAL, ("calculix", NODES), {"full_matrix": True}, "full_matrix is not for calculix"),
        (DIAGONAL, ("abaqus", NODES), {"rotation_nodes": (5, 6)}, "rotation_nodes are for calculix"),
        (DIAGONAL, ("ansys", NODES), {}, "no hysteretic damping"),
        (jf.Joint([1.0]), ("abaqus", NODES), {}, "dofs must be among x, y, z"),
        (jf.Joint([[1.0, 2.0], [3.0, 9.0]], dofs=["x", "y"]), ("abaqus", NODES), {}, "must be symmetric"),
    ],
)
def test_what_cannot_be_written_is_said(joint, arguments, options, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        joint.export(*arguments, **options)


# Two rigid bricks between which only the joint acts: size, m; density, kg/m^3; reference point from the centre, m.
BRICKS = (((0.10, 0.06, 0.04), 7800.0, (0.05, 0.01, 0.0)), ((0.08, 0.05, 0.07), 2700.0, (-0.04, 0.0, 0.02)))


def rigid_model(size, density, reference):
    """Mass matrix at the reference point by the theorem of Huygens and Steiner."""
    mass = density * np.prod(size)
    squares = np.square(size)
    inertia = mass / 12 * np.diag(squares.sum() - squares)
    to_centre = -np.array(reference)
    cross = np.cross(np.eye(3), to_centre)  # rows e_i x r: u_centre = u + theta x r
    shift = np.hstack([np.eye(3), cross.T])
    m = mass * shift.T @ shift
    m[3:, 3:] += inertia
    return jf.Model(np.zeros((6, 6)), m, DOFS)


#: Where the REF NODEs are from the reference points of the joint, m, and where these are.
BESIDE = np.array([[0.02, -0.01, 0.015], [-0.01, 0.03, 0.0]])
APART = np.array([[0.0, 0, 0], [0.001, 0, 0]])


def rigid_bricks(joint_cards, beside=0 * BESIDE):
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]) - 0.5
    lines = ["*NODE, NSET=ALL"]
    for body, (size, _, reference) in enumerate(BRICKS):
        at = -np.array(reference) + body * np.array([0.001, 0, 0])
        node = at + reference + beside[body]
        points = [*(at + corners * size), node, node]
        lines += [f"{10 * body + i}, " + ", ".join(f"{x:.12g}" for x in p) for i, p in enumerate(points, 1)]
    for body, (_, density, _) in enumerate(BRICKS):
        first = 10 * body
        lines += [f"*ELEMENT, TYPE=C3D8, ELSET=E{body}"]
        lines += [f"{body + 1}, " + ", ".join(str(first + i) for i in range(1, 9))]
        lines += [f"*MATERIAL, NAME=M{body}", "*ELASTIC", "210e9, 0.3", "*DENSITY", f"{density}"]
        lines += [f"*SOLID SECTION, ELSET=E{body}, MATERIAL=M{body}"]
        lines += [f"*NSET, NSET=N{body}", ", ".join(str(first + i) for i in range(1, 9))]
        lines += [f"*RIGID BODY, NSET=N{body}, REF NODE={first + 9}, ROT NODE={first + 10}"]
    # Clamped bricks beside them, of far higher frequencies: the eigensolver wants four times as many DOFs as modes.
    for i in range(5):
        numbers = range(100 + 10 * i, 108 + 10 * i)
        points = 0.01 * corners + np.array([1.0 + i, 1.0, 1.0])
        lines += [
            "*NODE",
            *(f"{k}, {x:.12g}, {y:.12g}, {z:.12g}" for k, (x, y, z) in zip(numbers, points, strict=True)),
        ]
        lines += ["*ELEMENT, TYPE=C3D8, ELSET=E2", f"{3 + i}, " + ", ".join(map(str, numbers))]
        lines += ["*BOUNDARY", *(f"{k}, 1, 3" for k in numbers[:4])]
    lines += ["*SOLID SECTION, ELSET=E2, MATERIAL=M0"]
    return "\n".join([*lines, joint_cards + "*STEP", *frequency_step(12), "*END STEP", ""])


@pytest.mark.skipif(CCX is None, reason="CalculiX (ccx) is not on PATH")
@pytest.mark.parametrize("kind", ["diagonal", "coupled", "nodes beside the joint"])
def test_natural_frequencies_of_calculix(kind, tmp_path):
    stiffness = np.diag([1e6, 3e6, 2e6, 1e3, 4e3, 2e3])
    if kind == "coupled":
        sizes = np.sqrt(stiffness.diagonal())
        angle = np.random.default_rng(5).standard_normal((6, 6))
        stiffness = sizes[:, None] * (np.eye(6) + 0.1 * (angle + angle.T)) * sizes
    joint = jf.Joint(stiffness, dofs=DOFS)
    a, b = (rigid_model(*brick) for brick in BRICKS)
    ours = jf.assemble(a, b, joint, range(6), range(6)).natural_frequencies()[6:]
    beside = BESIDE if kind.startswith("nodes") else 0 * BESIDE
    places = {"positions": APART + beside, "points": APART}
    cards = joint.export("calculix", (9, 19), rotation_nodes=(10, 20), element=100, **places)
    assert ("SPRING1" in cards) == kind.startswith("nodes")
    text = rigid_bricks(cards, beside)
    theirs = natural_frequencies(CCX, text, tmp_path)
    np.testing.assert_allclose(theirs[6:], ours, rtol=1e-6)


# Nodes of a model beside a joint: motions of its two points by rigid-body kinematics, written out without matrices.
AT_J, AT_K = np.array([0.10, -0.02, 0.03]), np.array([0.14, 0.05, -0.01])
PLACES_OF_JOINT = {
    "midway": (AT_J + AT_K) / 2,
    "on the line": AT_J + 0.2 * (AT_K - AT_J),
    "beside the line": np.array([0.11, 0.03, 0.02]),
    "at node j": AT_J,
    "one for each side": np.array([[0.11, 0.03, 0.02], [0.12, 0.03, 0.02]]),
}


def energy(matrix, points, motion):
    """Twice the energy of K q q where q is the difference of the motions of the points that follow the nodes."""
    ends = []
    for node, point, own in zip((AT_J, AT_K), np.broadcast_to(points, (2, 3)), np.reshape(motion, (2, 6)), strict=True):
        ends.append(np.concatenate([own[:3] + np.cross(own[3:], point - node), own[3:]]))
    q = ends[0] - ends[1]
    return q @ matrix @ q


def read_placed_bush(text):
    """CBUSH with a spring at a place: on the line by S, or by S1, S2, S3 in a system that begins at grid GA."""
    systems = {}
    for fields in nastran_fields(text):
        if fields[0] == "CORD2R":
            values = [nastran_real(field) for field in fields[3:12]]
            assert fields[2] == "0"
            origin, z_axis, xz = (np.array(values[i : i + 3]) for i in (0, 3, 6))
            np.testing.assert_allclose([z_axis - origin, xz - origin], [[0, 0, 1], [1, 0, 0]], atol=1e-9)
            systems[fields[1]] = origin
        elif fields[0] == "CBUSH":
            assert (fields[3], fields[4], fields[8]) == ("102", "202", "0")
            s, ocid, *offset = (fields[9:14] + [""] * 5)[:5]
            if s:
                assert not ocid
                point = AT_J + nastran_real(s) * (AT_K - AT_J)
            else:
                point = systems[ocid] + [nastran_real(field) for field in offset]
        else:
            assert fields[0] == "PBUSH"
            k = np.array([nastran_real(field) for field in fields[3:9]])
    return k, point


@pytest.mark.parametrize("place", PLACES_OF_JOINT)
@pytest.mark.parametrize("program", ["nastran", "nastran matrix", "abaqus", "ansys", "calculix"])
def test_nodes_that_lie_beside_the_joint_have_arms(place, program):
    points, k = PLACES_OF_JOINT[place], np.diag([2e6, 3e6, 5e6, 2e3, 3e3, 1e3])
    joint = jf.Joint(k, dofs=DOFS)
    more = {"positions": [AT_J, AT_K], "points": points}
    readers = {"abaqus": read_abaqus_matrices, "ansys": read_matrix27, "nastran matrix": read_dmig}
    motions = np.random.default_rng(8).standard_normal((6, 12)) * np.tile([1e-3] * 3 + [1e-2] * 3, 2)
    if program == "nastran":
        text = joint.export("nastran", NODES, **more)
        if np.ndim(points) == 2:
            assert "DMIG" in text  # a CBUSH has one place
            return
        found, point = read_placed_bush(text)
        np.testing.assert_allclose(point, points, atol=1e-9)
        np.testing.assert_allclose(np.diag(found), k, rtol=1e-10)
        return
    if program == "calculix":
        whole = read_springs_of_any_kind(joint.export("calculix", (1, 3), rotation_nodes=(2, 4), **more))
    else:
        word, _, full = program.partition(" ")
        whole = readers[program](joint.export(word, NODES, full_matrix=bool(full), **more))[0]
    for motion in motions:
        assert motion @ whole @ motion == pytest.approx(energy(k, points, motion), rel=1e-9)
    for axis, offset in enumerate(np.eye(3)):
        turn = np.concatenate([np.cross(offset, AT_J), offset, np.cross(offset, AT_K), offset])
        if np.ndim(points) == 1:  # turned as one body about the origin: no force
            assert abs(whole @ turn).max() < 1e-9 * abs(whole).max()
        assert abs(whole @ np.tile(np.eye(6)[axis], 2)).max() < 1e-9 * abs(whole).max()


def read_springs_of_any_kind(text):
    """Stiffness, (12, 12), from SPRING1 and SPRING2 of rigid bodies with REF NODEs 1, 3 and ROT NODEs 2, 4."""
    place = {(node, i + 1): 3 * (node - 1) + i for node in range(1, 5) for i in range(3)}
    whole, ends = np.zeros((12, 12)), {}
    for word, parameters, rows in keywords(text):
        name = parameters["ELSET"]
        if word == "*ELEMENT":
            ends[name] = [int(node) for node in rows[0][1:]]
            assert parameters["TYPE"] == f"SPRING{len(ends[name])}"
            continue
        at = [place[node, int(dof)] for node, dof in zip(ends[name], rows[0], strict=True)]
        value = float(rows[1][0])
        if len(at) == 1:
            whole[at[0], at[0]] += value
        else:
            spring(whole, *at, value)
    return whole


def equations(program, text, turning):
    """Rows of factors of x ... theta_z of nodes j and k, and the place of the first term of each."""
    place = dict(PLACE) | {(node, i): 6 * side + 2 + i for side, node in enumerate(turning) for i in (1, 2, 3)}
    if program in ("abaqus", "calculix"):
        terms = [[word for row in rows[1:] for word in row] for key, _, rows in keywords(text) if key == "*EQUATION"]
        found = [[(int(n), int(d), float(x)) for n, d, x in batched(one, 3)] for one in terms]
    elif program == "nastran":
        found = []
        for card in (one for one in nastran_fields(text) if one[0] == "MPC"):
            own = card[2:8] + [word for at in range(9, len(card), 8) for word in card[at + 1 : at + 7]]
            found.append([(int(n), int(d), nastran_real(x)) for n, d, x in batched(own, 3) if n])
    else:
        found = []
        for line in (one for one in text.splitlines() if one.startswith("CE,")):
            _, which, zero, *words = line.split(",")
            assert float(zero) == 0
            if which == "NEXT":
                found.append([])
            ways = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")
            found[-1] += [(int(n), ways.index(d) + 1, float(x)) for n, d, x in batched(words, 3)]
    rows = np.zeros((len(found), 12))
    for row, one in zip(rows, found, strict=True):
        for node, dof, factor in one:
            row[place[node, dof]] += factor
    return rows, [place[one[0][:2]] for one in found]


def batched(words, n):
    return [words[at : at + n] for at in range(0, len(words) - n + 1, n)]


@pytest.mark.parametrize("alone", [True, False])
@pytest.mark.parametrize("place", PLACES_OF_JOINT)
@pytest.mark.parametrize("program", ["abaqus", "calculix", "nastran", "ansys"])
def test_rigid_dofs_of_nodes_that_lie_beside_the_joint(program, place, alone):
    """The equations hold what coincides at the joint, whatever the nodes do, and eliminate each DOF once."""
    rigid, turning = ("z", "theta_y", "x", "theta_z"), (301, 302) if program == "calculix" else ()
    laws = {} if alone else {"y": jf.SpringLaw(1e6), "theta_x": jf.SpringLaw(1e3)}
    points = PLACES_OF_JOINT[place]
    joint = jf.LawJoint(laws, rigid=rigid)
    text = joint.export(program, NODES, rotation_nodes=turning or None, positions=[AT_J, AT_K], points=points)
    rows, firsts = equations(program, text, turning)
    ends = np.broadcast_to(points, (2, 3))
    sides = [rigid_offset(DOFS, end - at) for end, at in zip(ends, (AT_J, AT_K), strict=True)]
    relative = np.hstack([sides[0], -sides[1]])[[DOFS.index(dof) for dof in rigid]]
    left = rows - np.linalg.lstsq(relative.T, rows.T, rcond=None)[0].T @ relative
    assert abs(left).max() < 1e-10
    assert np.linalg.matrix_rank(rows) == len(rigid) == len(set(firsts))
    for i, first in enumerate(firsts):
        assert np.count_nonzero(rows[:, first]) == 1
        assert rows[i, first] == 1
    assert "reference point of the joint" in text
    assert "let nodes of their faces follow" in text


def test_arms_take_all_kinds_of_damping_along():
    joint = jf.Joint([1e6], [20.0], ["z"], loss_factor=[0.1])
    text = joint.export("nastran", NODES, positions=[AT_J, AT_K], points=[0, 0, 0], full_matrix=True)
    stiffness, damping, hysteretic = read_dmig(text)
    np.testing.assert_allclose(damping, 2e-5 * stiffness, atol=1e-12)
    np.testing.assert_allclose(hysteretic, 0.1 * stiffness, atol=1e-6)
    assert "rigid arms from the nodes to the joint: -0.1, 0.02, -0.03 m (j)" in text


def test_nodes_at_the_joint_need_no_arms():
    text = DIAGONAL.export("abaqus", NODES, positions=[AT_J, AT_J], points=AT_J)
    assert read_springs(text).tolist() == read_springs(DIAGONAL.export("abaqus", NODES)).tolist()
    plain = DIAGONAL.export("nastran", NODES, positions=[AT_J, AT_J], points=AT_J)
    np.testing.assert_allclose(read_bush(plain)[0], read_bush(DIAGONAL.export("nastran", NODES))[0])
    assert "midway between them" not in plain
    assert "midway between them" in DIAGONAL.export("nastran", NODES)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"points": AT_J}, "points needs positions"),
        ({"positions": [1e3 * AT_J, 1e3 * AT_K]}, r"a node lies 45 m from the reference point of the joint"),
        ({"units": "inch"}, "units must be"),
        ({"faces": [[1, 2, 3]]}, "faces must be two lists of nodes"),
        ({"faces": [[1, 2], [2, 3]]}, "faces must contain each node once, and not the nodes of the joint, as 2"),
        ({"faces": [[1, 2], [102, 3]]}, "and not the nodes of the joint, as 102"),
        ({"positions": AT_J, "points": AT_J}, "positions must have shape"),
        ({"positions": [AT_J, AT_K], "points": [np.nan, 0, 0]}, "points"),
    ],
)
def test_wrong_places(options, message):
    with pytest.raises(ValueError, match=message):
        DIAGONAL.export("abaqus", NODES, **options)


def test_comments_are_lines_that_programs_read():
    long = "k_y = 1 N/m: " + "words of a comment that goes on and on " * 5
    for program, mark in (("abaqus", "**"), ("nastran", "$"), ("ansys", "!")):
        text = WITHOUT_LOSS.export(program, NODES, comments=[long, "naïve"])
        lines = [line for line in text.splitlines() if line.startswith(mark + " ")]
        assert all(len(line) <= 72 for line in lines if "comment" in line)
        assert "".join(lines).count("on and on") >= 4
        assert f"{mark} na?ve" in lines
    with pytest.raises(TypeError, match="comments must be a sequence"):
        DIAGONAL.export("abaqus", NODES, comments="one")


READERS = {"abaqus": read_abaqus_matrices, "ansys": read_matrix27, "nastran": read_dmig}


@pytest.mark.parametrize("units", ["mm-t-s", "mm-kg-ms"])
@pytest.mark.parametrize("program", READERS)
def test_units_of_the_model(program, units):
    """1 N/m is 1e-3 N/mm, 1 N m/rad 1e3 N mm/rad, 1 N s/m 1e-3 N s/mm; with kN and ms 1e-6 kN/mm, 1, 1e-3 kN ms/mm."""
    joint = jf.Joint(random_matrix(1, 6, SIZES), random_matrix(2, 6, SIZES / 100), DOFS)
    length, force, time = {"mm-t-s": (1e3, 1.0, 1.0), "mm-kg-ms": (1e3, 1e-3, 1e3)}[units]
    turn = np.tile([1.0, 1, 1, length, length, length], 2)  # N m to N mm
    change = force / length * np.outer(turn, turn)
    in_mm = {"positions": [1e3 * AT_J, 1e3 * AT_K], "points": [0, 0, 0]}
    for at, of_si in (({}, {}), (in_mm, {"positions": [AT_J, AT_K], "points": [0, 0, 0]})):
        text = joint.export(program, NODES, units=units, full_matrix=True, **at)
        si = READERS[program](joint.export(program, NODES, full_matrix=True, **of_si))
        found = READERS[program](text)
        np.testing.assert_allclose(found[0], si[0] * change, rtol=1e-9, atol=1e-9 * abs(si[0] * change).max())
        np.testing.assert_allclose(found[1], si[1] * change * time, rtol=1e-9, atol=1e-9 * abs(si[1] * change).max())
    assert f"({units})" in text
    assert "reference point of the joint: (0, 0, 0) mm" in text
    assert "their lengths: 106.3 mm (j), 149 mm (k)" in text


def test_a_mass_of_the_joint_in_tonnes():
    joint = jf.LawJoint({"y": jf.SpringLaw(1e5)}, mass={"y": 0.02})
    assert "1.0000000000000E-05" in joint.export("abaqus", NODES, units="mm-t-s")


def test_the_point_midway_is_stated():
    text = COUPLED.export("nastran", NODES, positions=[AT_J, AT_K], full_matrix=True)
    assert "reference point of the joint: (0.12, 0.015, 0.01) m, midway between" in text
    same = COUPLED.export("nastran", NODES, positions=[AT_J, AT_K], points=(AT_J + AT_K) / 2, full_matrix=True)
    np.testing.assert_array_equal(read_dmig(text), read_dmig(same))


@pytest.mark.parametrize(
    ("program", "word"), [("abaqus", "PIN NSET"), ("calculix", "*RIGID BODY"), ("nastran", "RBE2"), ("ansys", "CERIG")]
)
def test_bodies_of_faces_are_cards_or_a_sketch(program, word):
    spring = jf.Joint([1e6], dofs=["z"])
    where = {"positions": [AT_J, AT_K], "rotation_nodes": (103, 203) if program == "calculix" else None}
    mark = {"nastran": "$", "ansys": "!"}.get(program, "**")
    sketch = spring.export(program, NODES, **where)
    assert [line for line in sketch.splitlines() if word in line and line.startswith(mark)]
    assert not [line for line in sketch.splitlines() if word in line and not line.startswith(mark)]
    whole = spring.export(program, NODES, faces=[range(1, 12), [21, 22, 23]], **where)
    assert [line for line in whole.splitlines() if word in line and not line.startswith(mark)]
    assert word not in spring.export(program, NODES, rotation_nodes=where["rotation_nodes"])


#: pyNastran 1.4 takes numpy below 2, which is not that of these tests: a Python that has it, named by the environment.
PYNASTRAN = os.environ.get("PYNASTRAN_PYTHON", "")
PARSE = """
import json, sys
from pyNastran.bdf.bdf import BDF
model = BDF(debug=None)
model.read_bdf(sys.argv[1], punch=True, xref=False)
bush, spring = model.elements, model.properties
found = {"bush": {n: [e.eid, e.pid, e.Ga(), e.Gb(), e.cid, e.s, e.ocid, [x for x in e.si if x is not None]]
                  for n, e in bush.items()},
         "spring": {n: [p.Ki, p.Bi, p.GEi] for n, p in spring.items()},
         "systems": {n: [list(map(float, c.e1)), list(map(float, c.e2)), list(map(float, c.e3))]
                     for n, c in model.coords.items() if n},
         "mpc": [[c.nodes, c.components, c.coefficients] for own in model.mpcs.values() for c in own],
         "rigid": {n: [e.gn, e.cm, list(e.Gmi)] for n, e in model.rigid_elements.items()},
         "dmig": {n: [m.matrix_form, list(map(list, m.GCi)), list(map(list, m.GCj)), list(map(float, m.Real))]
                  for n, m in model.dmig.items()}}
print(json.dumps(found, default=lambda one: one.item()))
"""


def parsed(text, tmp_path):
    (tmp_path / "joint.bdf").write_text(text)
    (tmp_path / "parse.py").write_text(PARSE)
    run = subprocess.run([PYNASTRAN, "-W", "ignore", tmp_path / "parse.py", tmp_path / "joint.bdf"],
                         capture_output=True, text=True, check=False)  # fmt: skip
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout.splitlines()[-1])


@pytest.mark.skipif(not PYNASTRAN, reason="PYNASTRAN_PYTHON names no Python that has pyNastran")
def test_pynastran_reads_what_is_written(tmp_path):
    k = np.array([2e6, 3e6, 5e6, 2e3, 3e3, 1e3])
    joint = jf.Joint(k, [20.0] * 6, DOFS, loss_factor=[0.01] * 6)
    where = {"positions": [1e3 * AT_J, 1e3 * AT_K], "points": [110.0, 30.0, 20.0], "units": "mm-t-s"}
    faces = [range(1, 12), [21, 22, 23]]
    found = parsed(joint.export("nastran", NODES, element=50, number=7, faces=faces, **where), tmp_path)
    ((_, number, a, b, system, s, at_system, offset),) = found["bush"].values()
    assert (number, a, b, system) == (7, *NODES, 0)
    assert s in (0.5, None)
    origin, z_axis, xz = (np.array(one) for one in found["systems"][str(at_system)])
    np.testing.assert_allclose(origin + offset, where["points"], atol=1e-9)
    np.testing.assert_allclose([z_axis - origin, xz - origin], [[0, 0, 1], [1, 0, 0]], atol=1e-9)
    ki, bi, ge = found["spring"]["7"]
    np.testing.assert_allclose(ki, k * np.array([1e-3] * 3 + [1e3] * 3), rtol=1e-9)
    np.testing.assert_allclose(bi, 20.0 * np.array([1e-3] * 3 + [1e3] * 3), rtol=1e-9)
    np.testing.assert_allclose(ge, 0.01, rtol=1e-9)
    assert found["rigid"] == {"51": [102, "123", list(range(1, 12))], "52": [202, "123", [21, 22, 23]]}
    rigid = jf.LawJoint({}, rigid=["x", "theta_z"])
    text = rigid.export("nastran", NODES, positions=[[0, 0, 0], [0.01, 0.02, 0]], points=[0.002, 0.01, 0.003])
    assert parsed(text, tmp_path)["mpc"] == [
        [[102, 102, 202, 202, 202], ["1", "5", "1", "5", "6"], [1.0, 0.003, -1.0, -0.003, -0.02]],
        [[102, 202], ["6", "6"], [1.0, -1.0]],
    ]
    text = COUPLED.export("nastran", NODES, positions=[AT_J, AT_K], points=[0.11, 0.03, 0.02], number=3)
    matrices = parsed(text, tmp_path)["dmig"]
    for name, expected_one in zip(("KJ3", "BJ3", "HJ3"), read_dmig(text), strict=True):
        form, rows, columns, values = matrices[name]
        assert form == 6
        whole = np.zeros((12, 12))
        for row, column, value in zip(rows, columns, values, strict=True):
            at = PLACE[row[0], row[1]], PLACE[column[0], column[1]]
            whole[at] = whole[at[::-1]] = value
        np.testing.assert_allclose(whole, expected_one, rtol=1e-9)


NUMBERS = [1.0, 123456.789012345678, -2.0 / 3.0, 6.02214076e23, -1.0 / 3e7, 1e100 / 7, -1e-100 / 7, 1e-300, -1.5e308]


@pytest.mark.parametrize("value", NUMBERS)
def test_a_number_of_a_card_comes_back(value):
    for columns, letter, digits in ((20, "E", 12), (19, "E", 12), (16, "", 8)):
        text = card_real(value, columns, letter)
        assert len(text) <= columns
        again = bulk_number(text, Path("own"))
        assert abs(again - value) <= 10.0**-digits * abs(value)


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 5e-324])
def test_a_number_that_is_none_is_not_written(value):
    with pytest.raises(ValueError, match="a card cannot contain"):
        card_real(value)


PLACES_APART = {"positions": [[0, 0, 0], [0, 0, 5.0]]}


@pytest.mark.parametrize("program", ["abaqus", "calculix", "nastran", "ansys"])
@pytest.mark.parametrize("options", [{}, {"units": "mm-t-s"}, {"units": "mm-kg-ms"}, PLACES_APART])
@pytest.mark.parametrize("k", [1e308, 1e305, 6e307, -1e120 / 7, 1e-120 / 7, 1e-300, 5e-324, 7e5])
def test_every_number_of_a_card_is_finite_and_fits_its_field(program, options, k):
    """Or the export is an error; all warnings of numpy are errors in the tests."""
    joint = jf.Joint([k], dofs=["y"])
    if program == "calculix" and options is PLACES_APART:
        options = options | {"rotation_nodes": (3, 4)}
    try:
        text = joint.export(program, (1, 2), **options)
    except ValueError as error:
        assert "a card cannot contain" in str(error) or "is out of range" in str(error)  # noqa: PT017
        assert k != 7e5
        return
    mark = {"nastran": "$", "ansys": "!"}.get(program, "*")
    lines = [line for line in text.splitlines() if not line.startswith(mark)]
    words = [word.strip() for line in lines for word in line.split(",")]
    if program == "nastran":
        assert all(len(line) <= 72 for line in lines)
        words = [line[at : at + 16].strip() for line in lines for at in range(8, 72, 16)]
    assert not [word for word in words if word.strip("-").upper() in ("INF", "NAN", "INFINITY")]
    assert all(len(word) <= 20 for word in words)
    metres = {"mm-t-s": 1e3, "mm-kg-ms": 1e6}.get(options.get("units"), 1.0)
    found = [abs(bulk_number(word, Path("own"))) for word in words if re.fullmatch(r"-?\d\.\d+E?[+-]\d+", word)]
    assert any(abs(one - abs(k) / metres) <= 1e-8 * abs(k) / metres for one in found)


@pytest.mark.parametrize("program", ["abaqus", "calculix", "nastran", "ansys"])
def test_numbers_that_are_counted_up_have_eight_columns(program):
    joint = jf.Joint([1e6, 1e6], [0, 0] if program == "calculix" else [5.0, 5.0], dofs=["x", "y"])
    faces = {"faces": ([11, 12, 13], [21, 22, 23])} if program == "nastran" else {}
    with pytest.raises(ValueError, match="element must be an integer from 1 to 99999999, not 100000000"):
        joint.export(program, (1, 2), element=99_999_999, **faces)
