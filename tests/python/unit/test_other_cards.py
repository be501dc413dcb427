"""Cards of Code_Aster, LS-DYNA and SubDyn, and dashpots of CalculiX: read back by readers of their own.

Code_Aster: Python, which its command files are; LS-DYNA: the reader of PyDyna; SubDyn: that of OpenFAST; CalculiX
itself. None of Code_Aster, LS-DYNA and OpenFAST was run.
"""

import re
import shutil
import subprocess

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.dofs import rigid_offset

CCX = shutil.which("ccx")
DOFS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
SIZES = np.array([1e3, 2e3, 1e3, 30.0, 20.0, 25.0])
PLACES = np.array([[0.02, -0.01, 0.015], [0.0, 0.03, 0.0]])
POINT = np.array([0.01, 0.0, 0.02])


def positive(seed, scale=1.0):
    """A coupled, positive definite matrix of translations and rotations."""
    root = np.random.default_rng(seed).standard_normal((6, 6))
    return scale * SIZES[:, None] * (root @ root.T + np.eye(6)) * SIZES


COUPLED = jf.Joint(positive(1), positive(2, 1e-3), DOFS)
DIAGONAL = jf.Joint(np.diag(COUPLED.stiffness.diagonal()), np.diag(COUPLED.damping.diagonal()), DOFS)


def both_sides(matrix, places=None):
    """The energy of K q q for the motions of both nodes, (12, 12): q is the difference of the motions of the points."""
    arms = np.zeros((2, 3)) if places is None else POINT - places
    q = np.hstack([sign * rigid_offset(DOFS, arm) for sign, arm in zip((1, -1), arms, strict=True)])
    return q.T @ matrix @ q


# ---------------------------------------------------------------- Code_Aster


def run_aster(text, name="JOINT7"):
    """Execute the command file."""
    held = {"_F": dict}
    exec(text, held)
    return held[name]


def aster_matrix(occurrences):
    """K (1 + i AMOR_HYST) and C of occurrences of DISCRET: upper triangles, column by column."""
    found = {"K_TR_L": np.zeros((12, 12), complex), "A_TR_L": np.zeros((12, 12), complex)}
    for one in occurrences:
        assert (one["REPERE"], one["SYME"]) == ("GLOBAL", "OUI")
        assert len(one["VALE"]) == 78
        values, matrix = iter(one["VALE"]), np.zeros((12, 12))
        for column in range(12):
            for row in range(column + 1):
                matrix[row, column] = matrix[column, row] = next(values)
        found[one["CARA"]] += matrix * (1 + 1j * one.get("AMOR_HYST", 0.0))
    return found["K_TR_L"], found["A_TR_L"]


@pytest.mark.parametrize("apart", [False, True])
def test_discrete_elements_of_code_aster(apart):
    h = positive(3, 0.05)
    joint = jf.Joint(COUPLED.stiffness, COUPLED.damping, DOFS, structural_damping=h)
    places = PLACES if apart else None
    options = {"positions": PLACES, "points": POINT} if apart else {}
    text = joint.export("code_aster", (102, 202), number=7, element=31, **options)
    occurrences = run_aster(text)
    assert {one["GROUP_MA"] for one in occurrences} == {"JOINT7", "JOINT7_H"}
    assert "SEG2 / J31 N102 N202 / FINSF / GROUP_MA / JOINT7 J31" in text
    k, c = aster_matrix(occurrences)
    for found, exact in (
        (k, both_sides(joint.stiffness + 1j * h, places)),
        (c, both_sides(joint.damping, places)),
    ):
        np.testing.assert_allclose(found, exact, atol=1e-11 * abs(exact).max())


def test_tables_over_frequency_of_code_aster():
    joint = jf.LawJoint(
        {"y": jf.StandardLinearSolid(6e5, 2e5, 1e-3), "x": jf.SpringLaw(1e6), ("x", "y"): jf.SpringLaw(1e4)}
    )
    freq = np.array([10.0, 60.0, 900.0])
    tables = run_aster(joint.export("code_aster", (1, 2), table_hz=freq, number=7))
    assert list(tables) == freq.tolist()
    places = [DOFS.index(dof) for dof in joint.dofs]
    for f, own in zip(freq, joint.dynamic_stiffness(freq), strict=True):
        whole = np.zeros((6, 6), complex)
        whole[np.ix_(places, places)] = own
        k, c = aster_matrix(tables[float(f)])
        np.testing.assert_allclose(k + 2j * np.pi * f * c, both_sides(whole), atol=1e-11 * abs(own).max())


def test_rigid_dofs_of_code_aster_and_lsdyna():
    joint = jf.LawJoint({}, rigid=["x", "theta_z"])
    options = {"positions": [[0, 0, 0], [0.01, 0.02, 0]], "points": [0.002, 0.01, 0.003]}
    expected = [
        [(102, 1, 1), (102, 5, 0.003), (202, 1, -1), (202, 5, -0.003), (202, 6, -0.02)],
        [(102, 6, 1), (202, 6, -1)],
    ]
    text = joint.export("code_aster", (102, 202), **options)
    found = eval("[" + "\n".join(line for line in text.splitlines() if not line.startswith("#")) + "]", {"_F": dict})
    dofs = ["DX", "DY", "DZ", "DRX", "DRY", "DRZ"]
    for own, terms in zip(found, expected, strict=True):
        assert own["COEF_IMPO"] == 0.0
        assert [int(node[1:]) for node in own["NOEUD"]] == [node for node, _, _ in terms]
        assert [dofs.index(dof) + 1 for dof in own["DDL"]] == [dof for _, dof, _ in terms]
        np.testing.assert_allclose(own["COEF_MULT"], [factor for *_, factor in terms])
    blocks = joint.export("lsdyna", (102, 202), **options).split("*CONSTRAINED_LINEAR_GLOBAL\n")[1:]
    for block, terms in zip(blocks, expected, strict=True):
        rows = [[float(line[at : at + 10]) for at in range(0, len(line), 10)] for line in block.splitlines()[1:]]
        np.testing.assert_allclose(rows, terms, rtol=1e-4)


# ---------------------------------------------------------------- LS-DYNA


@pytest.mark.parametrize("units", ["SI", "mm-t-s"])
def test_discrete_beam_of_lsdyna(units):
    text = DIAGONAL.export("lsdyna", (102, 202), number=7, element=31, units=units)
    lines = [line for line in text.splitlines() if not line.startswith("$")]
    blocks = {}
    for line in lines:
        if line.startswith("*"):
            blocks[line] = []
            rows = blocks[line]
        else:
            rows.append(line)
    fields = {
        name: [[row[at : at + 10].strip() for at in range(0, len(row), 10)] for row in rows]
        for name, rows in blocks.items()
    }
    assert fields["*PART"][1] == ["7", "7", "7"]
    assert fields["*SECTION_BEAM"][0][:2] == ["7", "6"]
    assert [int(blocks["*ELEMENT_BEAM"][0][at : at + 8]) for at in range(0, 40, 8)] == [31, 7, 102, 202, 0]
    first, second, _ = fields["*MAT_LINEAR_ELASTIC_DISCRETE_BEAM"]
    scale = {"SI": np.ones(6), "mm-t-s": np.array([1e-3] * 3 + [1e3] * 3)}[units]
    np.testing.assert_allclose([float(one) for one in first[2:]], scale * DIAGONAL.stiffness.diagonal(), rtol=6e-5)
    np.testing.assert_allclose([float(one) for one in second], scale * DIAGONAL.damping.diagonal(), rtol=6e-5)


def test_the_reader_of_pydyna_takes_the_same_numbers():
    core = pytest.importorskip("ansys.dyna.core.lib.deck")
    deck = core.Deck()
    deck.loads("*KEYWORD\n" + DIAGONAL.export("lsdyna", (102, 202), number=7, element=31) + "*END\n")
    found = {type(one).__name__: one for one in deck.keywords}
    material, section = found["MatLinearElasticDiscreteBeam"], found["SectionBeam"]
    names = ("tkr", "tks", "tkt", "rkr", "rks", "rkt"), ("tdr", "tds", "tdt", "rdr", "rds", "rdt")
    for own, matrix in zip(names, (DIAGONAL.stiffness, DIAGONAL.damping), strict=True):
        np.testing.assert_allclose([getattr(material, name) for name in own], matrix.diagonal(), rtol=6e-5)
    assert (section.elform, section.cid, section.scoor) == (6, 0, 0.0)
    assert section.vol * material.ro == pytest.approx(1e-6)
    assert section.iner == pytest.approx(1e-9)
    beam = found["ElementBeam"].elements.iloc[0]
    assert [int(beam[name]) for name in ("eid", "pid", "n1", "n2")] == [31, 7, 102, 202]


@pytest.mark.parametrize("options", [{}, {"positions": PLACES, "points": POINT}])
def test_matrices_of_lsdyna_are_dmig(options):
    """The file is that of Nastran; the keyword that names it is in the comments."""
    text = COUPLED.export("lsdyna", (102, 202), number=7, element=31, **options)
    nastran = COUPLED.export("nastran", (102, 202), number=7, full_matrix=True, **options)
    cards = [[line for line in one.splitlines() if not line.startswith("$")] for one in (text, nastran)]
    assert cards[0] == cards[1]
    keyword = [line[2:] for line in text.splitlines() if line.startswith("$")][-4:]
    assert keyword[0] == "*ELEMENT_DIRECT_MATRIX_INPUT"
    assert [keyword[3][at : at + 10].strip() for at in (0, 10, 20)] == ["", "BJ7", "KJ7"]


# ---------------------------------------------------------------- SubDyn


def test_spring_element_of_subdyn(tmp_path):
    joint = jf.Joint(COUPLED.stiffness, dofs=DOFS)
    text = joint.export("subdyn", (5, 6), number=7, element=31)
    member, spring, cosines = (line.split() for line in text.splitlines() if not line.startswith("!"))
    assert member == ["31", "5", "6", "7", "7", "5", "7"]
    assert cosines == ["7", *("1.0" if i % 4 == 0 else "0.0" for i in range(9))]
    found, values = np.zeros((6, 6)), iter(map(float, spring[1:]))
    names = re.search(r"PropSetID (k11 .*)", text)[1].split()
    for name in names:
        row, column = int(name[1]) - 1, int(name[2]) - 1
        found[row, column] = found[column, row] = next(values)
    assert len(names) == 21
    np.testing.assert_allclose(found, joint.stiffness, rtol=1e-12)


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_the_reader_of_openfast_takes_the_same_rows(tmp_path):
    """The rows in the tables of an input; what follows them is missing, where the reader stops."""
    reader = pytest.importorskip("openfast_io.FAST_reader")
    joint = jf.Joint(COUPLED.stiffness, dofs=DOFS)
    text = joint.export("subdyn", (5, 6), number=7, element=31)
    member, spring, cosines = (line for line in text.splitlines() if not line.startswith("!"))
    empty = ["-", "0", "-", "-"]
    lines = ["-", "-", "-", "False", "0.01", "3", "True", "-", "3", "1", "0", "1.0", "0", "0. 0.", "0", "-", "-", "-"]
    lines += ["0. 0. 0. 0. 0. 0.", *3 * empty, "-", "1", "-", "-", member, *5 * empty, "-", "1", "-", "-", spring]
    (tmp_path / "sd.dat").write_text("\n".join([*lines, "-", "1", "-", "-", cosines, ""]))
    one = reader.InputReader_OpenFAST.__new__(reader.InputReader_OpenFAST)
    one.fst_vt = {"SubDyn": {}}
    with pytest.raises(IndexError):
        one.read_SubDyn(str(tmp_path / "sd.dat"))
    held = one.fst_vt["SubDyn"]
    members = [held[name][0] for name in ("MemberID", "MJointID1", "MJointID2", "MPropSetID1", "MType", "M_COSMID")]
    assert members == [31, 5, 6, 7, 5, 7]
    assert held["SpringPropSetID"] == held["COSMID"] == [7]
    found = [[float(held[f"k{min(a, b)}{max(a, b)}"][0]) for b in range(1, 7)] for a in range(1, 7)]
    np.testing.assert_allclose(found, joint.stiffness, rtol=1e-12)
    assert [held[f"COSM{a}{b}"][0] for a in (1, 2, 3) for b in (1, 2, 3)] == np.eye(3).ravel().tolist()


@pytest.mark.parametrize(
    ("program", "joint", "options", "message"),
    [
        ("subdyn", COUPLED, {}, "subdyn has no damping between joints; leave damping out with damping=False"),
        ("subdyn", DIAGONAL, {"damping": False, "units": "mm-t-s"}, "subdyn has units m, N, s; write units SI"),
        ("subdyn", DIAGONAL, {"damping": False, "positions": PLACES}, "a spring of subdyn has no arms"),
        ("lsdyna", jf.Joint([1e6], dofs=["x"], loss_factor=[0.1]), {}, "lsdyna has no hysteretic damping of elements"),
        ("lsdyna", COUPLED, {"number": 1234567}, "number must have at most six digits"),
        ("lsdyna", DIAGONAL, {"faces": [[11], [12]]}, "faces are not written for lsdyna; leave them out"),
        ("code_aster", DIAGONAL, {"damping_nodes": 9}, "damping_nodes are for calculix, not for code_aster"),
        ("calculix", DIAGONAL, {"rotation_nodes": (3, 4)}, "name the first of them by damping_nodes, or leave damping"),
        ("calculix", jf.Joint([1e6], dofs=["x"], loss_factor=[0.1]), {}, "calculix has no complex spring between DOFs"),
    ],
)
def test_a_joint_that_a_program_cannot_hold_is_one_sentence(program, joint, options, message):
    with pytest.raises(ValueError, match=message):
        joint.export(program, (1, 2), **options)


@pytest.mark.parametrize("program", ["code_aster", "lsdyna", "subdyn"])
def test_laws_without_a_counterpart(program):
    with pytest.raises(ValueError, match=f"point masses are not written for {program}"):
        jf.LawJoint({"y": jf.SpringLaw(1e6)}, mass={"y": 0.1}).export(program, (1, 2))
    if program != "code_aster":
        with pytest.raises(ValueError, match=f"{program} has no tables over frequency; name one frequency by freq_hz"):
            jf.LawJoint({"y": jf.SpringLaw(1e6)}).export(program, (1, 2), table_hz=[1.0, 2.0])


# ---------------------------------------------------------------- CalculiX


# Two rigid bricks between which only the joint acts: size, m; density, kg/m^3; reference point from the centre, m.
BRICKS = (((0.10, 0.06, 0.04), 7800.0, (0.05, 0.01, 0.0)), ((0.08, 0.05, 0.07), 2700.0, (-0.04, 0.0, 0.02)))
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]) - 0.5


def rigid_mass(size, density, reference):
    """Mass matrix at a point by the theorem of Huygens and Steiner."""
    mass, squares = density * np.prod(size), np.square(size)
    cross = np.cross(np.eye(3), -np.array(reference))  # rows e_i x r: u_centre = u + theta x r
    shift = np.hstack([np.eye(3), cross.T])
    found = mass * shift.T @ shift
    found[3:, 3:] += mass / 12 * np.diag(squares.sum() - squares)
    return found


def brick_deck(cards, beside):
    """Bricks as rigid bodies, and clamped ones beside them: the eigensolver wants four times as many DOFs as modes."""
    lines = ["*NODE, NSET=ALL"]
    for body, (size, _, reference) in enumerate(BRICKS):
        at = -np.array(reference)
        points = [*(at + CORNERS * size), beside[body], beside[body]]
        lines += [f"{10 * body + i}, " + ", ".join(f"{x:.12g}" for x in p) for i, p in enumerate(points, 1)]
    for body, (_, density, _) in enumerate(BRICKS):
        corners = ", ".join(str(10 * body + i) for i in range(1, 9))
        lines += [f"*ELEMENT, TYPE=C3D8, ELSET=E{body}", f"{body + 1}, {corners}"]
        lines += [f"*MATERIAL, NAME=M{body}", "*ELASTIC", "210e9, 0.3", "*DENSITY", f"{density}"]
        lines += [f"*SOLID SECTION, ELSET=E{body}, MATERIAL=M{body}", f"*NSET, NSET=N{body}", corners]
        lines += [f"*RIGID BODY, NSET=N{body}, REF NODE={10 * body + 9}, ROT NODE={10 * body + 10}"]
    for i in range(5):
        numbers = range(100 + 10 * i, 108 + 10 * i)
        points = 0.01 * CORNERS + np.array([1.0 + i, 1.0, 1.0])
        lines += ["*NODE", *(f"{k}, {x:.9g}, {y:.9g}, {z:.9g}" for k, (x, y, z) in zip(numbers, points, strict=True))]
        lines += ["*ELEMENT, TYPE=C3D8, ELSET=E2", f"{3 + i}, " + ", ".join(map(str, numbers))]
        lines += ["*BOUNDARY", *(f"{k}, 1, 3" for k in numbers[:4])]
    lines += ["*SOLID SECTION, ELSET=E2, MATERIAL=M0", cards.rstrip("\n")]
    lines += ["*NSET, NSET=OUT", "9, 10, 19, 20", "*STEP", "*FREQUENCY, STORAGE=YES", "12", "*END STEP"]
    lines += ["*STEP", "*STEADY STATE DYNAMICS", "20., 900., 8, 1.", "*CLOAD", "9, 1, 1.", "10, 2, 0.3"]
    return "\n".join([*lines, "*NODE PRINT, NSET=OUT", "U", "*END STEP", ""])


def steady_state(text, folder):
    """Frequencies and complex motions (n, 12) of the reference points."""
    (folder / "model.inp").write_text(text)
    done = subprocess.run([CCX, "model"], cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert "Job finished" in done.stdout, done.stdout[-2000:]
    content = (folder / "model.dat").read_text()
    rows = re.findall(r"for set OUT and time\s+(\S+)\n\n((?:\s+\d+ .*\n)+)", content)
    parts = [np.array([line.split()[1:] for line in block.splitlines()], float).ravel() for _, block in rows]
    freq = [float(f) for f, _ in rows]
    assert freq[::2] == freq[1::2]  # real part, then imaginary part
    found, at = np.unique(freq[::2], return_index=True)
    return found, np.array([parts[2 * i] + 1j * parts[2 * i + 1] for i in at])


@pytest.mark.skipif(CCX is None, reason="CalculiX (ccx) is not on PATH")
@pytest.mark.parametrize("kind", ["diagonal", "coupled", "nodes beside the joint"])
def test_calculix_computes_the_damped_response(kind, tmp_path):
    """Against the dynamic stiffness of two rigid bodies and the joint, inverted line by line."""
    k = np.diag([1e6, 3e6, 2e6, 1e3, 4e3, 2e3])
    size = np.sqrt([90.0, 60.0, 120.0, 0.05, 0.08, 0.04])
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0]
    c = np.diag(size**2) if kind == "diagonal" else size[:, None] * (turn * [1, 0.5, 0.2, 2, 1, 0]) @ turn.T * size
    places = 0.5 * PLACES if kind.startswith("nodes") else np.zeros((2, 3))
    cards = jf.Joint(k, c, DOFS).export(
        "calculix", (9, 19), rotation_nodes=(10, 20), element=100, damping_nodes=900, positions=places, points=[0, 0, 0]
    )
    assert cards.count("DASHPOTA") == (6 if kind == "diagonal" else 5)  # one direction of the coupled ones has none
    freq, found = steady_state(brick_deck(cards, places), tmp_path)
    mass = np.zeros((12, 12))
    for body, one in enumerate(BRICKS):
        move = rigid_offset(DOFS, -places[body])
        mass[6 * body : 6 * body + 6, 6 * body : 6 * body + 6] = move.T @ rigid_mass(*one) @ move
    offsets = np.hstack([sign * rigid_offset(DOFS, -at) for sign, at in zip((1, -1), places, strict=True)])
    load = np.zeros(12)
    load[[0, 4]] = 1.0, 0.3
    scale = np.tile([1.0] * 3 + [0.05] * 3, 2)
    for f, own in zip(freq, found, strict=True):
        omega = 2 * np.pi * f
        z = offsets.T @ (k + 1j * omega * c) @ offsets - omega**2 * mass
        exact = np.linalg.solve(z, load)
        assert abs(scale * (own - exact)).max() < 1e-4 * abs(scale * exact).max(), f
