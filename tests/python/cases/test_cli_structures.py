"""`jointfrf frf`, `couple`, `decouple`, `export`: from models to FRFs of an assembly, and back to the joint."""

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy import linalg, sparse

import jointfrf as jf
from command import run_command
from jointfrf.io import read_frfs

SECTION = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
A = jf.beam(0.3, 4, ends=("clamped", "free"), **SECTION)
B = jf.beam(0.225, 3, **SECTION)
JOINT = jf.Joint([6e5, 5e3], [20.0, 1.5], ["y", "theta_z"])
FREQ_HZ = np.arange(20.0, 401.0, 4.0)
MODEL = """
model = "beam"
length = {length}
elements = {elements}
element = "euler-bernoulli"
axial = false
ends = ["{first}", "free"]
youngs_modulus = 67e9
density = 2700.0
width = 0.025
height = 0.006
loss_factor = 0.01
"""
JOINT_TOML = 'dofs = ["y", "rz"]\nstiffness = [6e5, 5e3]\ndamping = [20.0, 1.5]\n'
LINES = ["--band", "20:400", "--step", "4"]
COUPLE = ["couple", "a.toml", "b.uff", "--joint", "joint.toml", "--j", "5", "--k", "1", "--renumber-b", "100"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Models of both beams, FRFs of B, and those of the assembly, each written by the command."""
    place = tmp_path_factory.mktemp("structures")
    (place / "a.toml").write_text(MODEL.format(length=0.3, elements=4, first="clamped"))
    (place / "b.toml").write_text(MODEL.format(length=0.225, elements=3, first="free"))
    (place / "joint.toml").write_text(JOINT_TOML)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for words in (["frf", "b.toml", *LINES, "--output", "b.uff"], [*COUPLE, "--output", "c.npz"]):
            result = run_command(*words)
            assert result.returncode == 0, result.stderr
    return place


@pytest.fixture(autouse=True)
def _there(folder, monkeypatch):
    monkeypatch.chdir(folder)


def test_receptances_of_a_model():
    frfs = read_frfs("b.uff")
    assert [str(channel) for channel in frfs.responses[:3]] == ["1:+y", "1:+rz", "2:+y"]
    np.testing.assert_allclose(frfs.h, B.receptance(FREQ_HZ), rtol=1e-9, atol=1e-20)
    assert frfs.coordinates[4].tolist() == pytest.approx([0.225, 0, 0])


def test_receptances_of_matrices(tmp_path):
    for name, matrix in (("k", B.stiffness), ("m", B.mass)):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", sparse.coo_array(matrix))
    (tmp_path / "dofs.txt").write_text("\n".join(B.dofs))
    words = ["--stiffness", tmp_path / "k.mtx", "--mass", tmp_path / "m.mtx", "--dof-names", tmp_path / "dofs.txt"]
    target = tmp_path / "b.csv"
    said = run_command(
        "frf",
        *words,
        "--loss-factor",
        "0.01",
        "--lines-of",
        "b.uff",
        "--points",
        "1:y,1:theta",
        "--output",
        target,
        "--json",
    )
    assert said.returncode == 0, said.stderr
    assert json.loads(said.stdout)["channels"] == ["1:+y", "1:+rz"]
    np.testing.assert_allclose(read_frfs(target).h, B.receptance(FREQ_HZ, [0, 1]), rtol=1e-6, atol=1e-20)


def test_the_assembly_is_that_of_the_matrices():
    found = read_frfs("c.npz")
    at = A.index("5:y", "5:theta"), B.index("1:y", "1:theta")
    whole = jf.assemble(A, B, JOINT, *at)
    exact = whole.receptance(FREQ_HZ)
    assert [channel.node for channel in found.responses] == [n for n in (2, 3, 4, 5, 101, 102, 103, 104) for _ in "yr"]
    np.testing.assert_allclose(found.h, exact, rtol=1e-6, atol=1e-9 * abs(exact).max())


def test_the_joint_comes_back_from_the_assembly():
    words = ["identify", "c.npz", "--j", "5", "--k", "101", "--dofs", "y,rz", "--damping", "viscous", "--noise", "1e-4"]
    fit = json.loads(run_command(*words, "--json").stdout)["fits"][0]["parameters"]
    for name, value in (("k_y", 6e5), ("k_theta_z", 5e3), ("c_y", 20), ("c_theta_z", 1.5)):
        assert fit[name]["value"] == pytest.approx(value, rel=1e-5)


@pytest.mark.parametrize("equation", ["rr", "rs", "sr", "ss"])
def test_the_joint_comes_back_by_decoupling(equation, tmp_path):
    points = ["--r", "3:y,3:rz", "--s", "4:y,4:rz", "--renumber-b", "100"]
    words = ["decouple", "a.toml", "b.uff", "c.npz", "--j", "5", "--k", "1", "--dofs", "y,rz", *points]
    lines, saved = tmp_path / "k.csv", tmp_path / "joint.json"
    result = run_command(*words, "--equation", equation, "--output", lines, "--save", saved)
    assert result.returncode == 0, result.stderr
    assert f"method decoupling-{equation}" in result.stdout
    rows = lines.read_text().splitlines()
    assert rows[0].startswith('frequency [Hz],"Re K_y,y","Im K_y,y"')
    table = np.array([[float(x) for x in row.split(",")] for row in rows[1:]])
    np.testing.assert_allclose(table[:, 0], FREQ_HZ)
    np.testing.assert_allclose(table[:, 1], 6e5, rtol=1e-3)
    np.testing.assert_allclose(table[:, 2], 2 * np.pi * FREQ_HZ * 20, rtol=0.1, atol=60)
    assert jf.load(saved).stiffness == pytest.approx([6e5, 5e3], rel=1e-3)


def test_a_virtual_point_couples_channels_around_the_joint(tmp_path):
    """Two points a side that follow a rigid end: the assembly is that of the end itself."""
    from jointfrf.io import Channel, FrfSet, write_npz

    for name, model, end, node, x in (("a", A, ("5:y", "5:theta"), 10, 0.0), ("b", B, ("1:y", "1:theta"), 20, 0.0)):
        arms = np.array([[1, -0.01], [1, 0.02]])  # y of points at x - 10 mm and x + 20 mm
        h = arms @ model.receptance(FREQ_HZ, model.index(*end)) @ arms.T
        ends = (Channel(node, "y"), Channel(node + 1, "y"))
        places = {node: np.array([x - 0.01, 0, 0]), node + 1: np.array([x + 0.02, 0, 0])}
        write_npz(tmp_path / f"{name}.npz", FrfSet(FREQ_HZ, ends, ends, h, coordinates=places))
    words = ["--joint", "joint.toml", "--j", "10,11", "--k", "20:21", "--at", "0,0,0", "--output", tmp_path / "c.npz"]
    result = run_command("couple", tmp_path / "a.npz", tmp_path / "b.npz", *words)
    assert result.returncode == 0, result.stderr
    exact = read_frfs("c.npz").matrix(["5:y", "5:rz", "101:y", "101:rz"], ["5:y", "5:rz", "101:y", "101:rz"])
    arms = np.kron(np.eye(2), [[1, -0.01], [1, 0.02]])
    found = read_frfs(tmp_path / "c.npz").h
    np.testing.assert_allclose(found, arms @ exact @ arms.T, rtol=1e-6, atol=1e-9 * abs(exact).max())


def test_a_joint_by_hand_is_exported():
    result = run_command("export", "joint.toml", "abaqus:1,2")
    assert result.returncode == 0
    assert "** from joint.toml" in result.stdout
    assert result.stdout.count("DASHPOT2") == 2
    # Nodes that are apart: the joint acts midway, rigid bodies are sketched; in mm.
    words = ["--nodes-at", "0,0,0,0,0,20", "--units", "mm-t-s"]
    result = run_command("export", "joint.toml", "ansys:1,2", *words)
    assert "! reference point of the joint: (0, 0, 10) mm, midway" in result.stdout
    assert "!   CERIG,1,(nodes of the face on side j),UXYZ" in result.stdout
    result = run_command("export", "joint.toml", "ansys:1,2", *words, "--joint-at", "0,0,0", "--faces", "11,12:21")
    assert "! reference point of the joint: (0, 0, 0) mm" in result.stdout
    assert result.stdout.endswith("CERIG,1,11,UXYZ\nCERIG,1,12,UXYZ\nCERIG,2,21,UXYZ\n")
    result = run_command("export", "joint.toml", "nastran:1,2", "--nodes-at", "0,0,0,0,0,20000")
    assert "a node lies 1e+04 m from the reference point of the joint; give positions and points in m" in result.stderr
    assert result.returncode == 2


@pytest.mark.parametrize("program", ["nastran", "abaqus", "ansys"])
def test_negative_dashpots_of_a_joint_by_hand_are_left_out(program, tmp_path):
    """By the rule of fits; arms that meet a negative diagonal say nothing of a root."""
    values = {"damping": (-3, 5), "structural_damping": (2e4, -7e3)}
    if program == "ansys":  # which has no hysteretic damping
        del values["structural_damping"]
    texts = {}
    for name, keep in (("given", 1), ("without", 0)):
        lines = [f"{key} = {[v if v > 0 else keep * v for v in pair]}" for key, pair in values.items()]
        (tmp_path / f"{name}.toml").write_text("\n".join(['dofs = ["x", "y"]', "stiffness = [1e6, 2e6]", *lines]))
        words = ["export", tmp_path / f"{name}.toml", f"{program}:1,2", "--nodes-at", "0.01,0,0.1,-0.01,0,0.1"]
        for more in ([], ["--all-damping"]):
            result = run_command(*words, *more)
            assert (result.returncode, result.stderr) == (0, "")
            texts[name, bool(more)] = result.stdout.replace(f"{name}.toml", "file")
    left_out = [line for line in texts["given", False].splitlines() if "negative, left out" in line]
    assert [line.split()[1] for line in left_out] == ["c_x", "h_y"][: len(values)]
    rest = [line for line in texts["given", False].splitlines() if line not in left_out]
    assert rest == texts["without", False].splitlines()
    assert texts["given", True] not in (texts["given", False], texts["without", True])


LAWS = """
[[law]]
dof = "y"
law = "standard-linear-solid"
values = { k = 6e5, k_m = 3e5, tau = 2e-3 }

[[law]]
dof = "rz"
law = "spring"
values = { k = 5e3, h = 50.0 }
"""


def test_laws_are_exported_as_tables_that_a_straight_line_between_lines_meets(tmp_path):
    (tmp_path / "laws.toml").write_text(LAWS)
    joint = jf.read_joint(tmp_path / "laws.toml")
    result = run_command("export", tmp_path / "laws.toml", "abaqus:1,2", "--frequency", "5:500")
    assert (result.returncode, result.stderr) == (0, "")
    spring, dashpot, turning, turning_damper = (
        np.array([line.split(", ") for line in part.splitlines()[4:]], float)
        for part in result.stdout.split("*ELEMENT")[1:]
    )
    freq = np.geomspace(5, 500, 1000)
    exact = joint.dynamic_stiffness(freq)
    for i, (k, c) in enumerate(((spring, dashpot), (turning, turning_damper))):
        real, damping = (np.interp(freq, own[:, 1], own[:, 0]) for own in (k, c))
        found = real + 2j * np.pi * freq * damping
        assert abs(found / exact[:, i, i] - 1).max() < 2e-3
    assert spring[[0, -1], 1].tolist() == [5, 500]
    assert len(spring) <= 129
    result = run_command("export", tmp_path / "laws.toml", "nastran:1,2", "--frequency", "5:500")
    assert result.stdout.count("TABLED1*") == 4
    one = run_command("export", tmp_path / "laws.toml", "abaqus:1,2", "--frequency", "5").stdout
    assert "StandardLinearSolid of y at 5 Hz" in one
    connector = run_command("export", "joint.toml", "abaqus:1,2", "--connector")
    assert "*CONNECTOR DAMPING" in connector.stdout
    assert (connector.returncode, connector.stderr) == (0, "")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["ansys:1,2", "--frequency", "5:500"], "no tables over frequency; name one frequency by --frequency HZ"),
        (["abaqus:1,2", "--frequency", "500:5"], "'500:5' is no band or frequency above 0 Hz"),
        (["abaqus:1,2"], "depends on frequency; state one frequency by --frequency HZ"),
        (["nastran:1,2", "--frequency", "5", "--connector"], "are for abaqus, not for nastran; leave --connector out"),
        (["abaqus:1,2", "--frequency", "5", "--connector"], "write a table over frequency by --frequency LOW:HIGH"),
    ],
)  # fmt: skip
def test_tables_that_cannot_be_written(tmp_path, words, message):
    (tmp_path / "laws.toml").write_text(LAWS)
    result = run_command("export", tmp_path / "laws.toml", *words)
    assert result.returncode == 2
    assert message in result.stderr


WRONG = [
    (["frf", "b.toml", *LINES], 2, "--output is missing"),
    (["frf", "b.toml", "--output", "x.xls", *LINES], 2, "x.xls has no suffix of a format"),
    (["frf", "b.toml", "--output", "x.npz"], 2, "frequency lines are missing"),
    (["frf", "b.toml", "--output", "x.npz", "--step", "1"], 2, "--step without a band"),
    (["frf", "b.toml", "--output", "x.npz", "--band", "1:1e9", "--step", "1"], 2, "use at most 1000000"),
    (["frf", "b.toml", "--output", "x.npz", "--band", "9:1", "--step", "1"], 2, "gives no lines"),
    (["frf", "b.toml", "--output", "x.npz", *LINES, "--points", "9:y"], 1, "the model has no DOF '9:y'"),
    (["frf", "b.toml", "--output", "x.npz", *LINES, "--mass", "m.mtx"], 2, "are both given; leave out one"),
    (["frf", "--output", "x.npz", *LINES, "--mass", "m.mtx"], 2, "or add --stiffness and --dof-names"),
    (["frf", "b.uff", "--output", "x.npz", *LINES], 2, "is no TOML file of a model"),
    (["frf", "no.toml", "--output", "x.npz", *LINES], 1, "no.toml cannot be read"),
    (["frf", "joint.toml", "--output", "x.npz", *LINES], 1, "the key 'model' is missing"),
    ([*COUPLE[:-2], "--output", "x.npz"], 1, "is in a.toml and in b.uff; add a number"),
    (["couple", "a.toml", "b.toml", *COUPLE[3:], "--output", "x.npz"], 2, "models need frequency lines"),
    ([*COUPLE[:7], "--output", "x.npz"], 2, "--k is missing"),
    ([*COUPLE, "--output", "x.npz", "--j", "9"], 1, "has no FRF at node 9"),
    ([*COUPLE, "--output", "x.npz", "--j", "4,5"], 2, "give the virtual point by --at X,Y,Z"),
    ([*COUPLE, "--output", "x.npz", "--at", "0,0,0"], 1, "a.toml has no coordinates of node 5"),
    ([*COUPLE, "--output", "x.npz", "--joint", "no.json"], 1, "there is no file no.json"),
    ([*COUPLE, "--output", "x.npz", "--joint", "b.uff"], 1, "b.uff is no file of a joint"),
    (["decouple", "a.toml", "b.uff", "c.npz", "--j", "5"], 2, "--k, --dofs and --s are missing; equation ss needs"),
    (["export", "joint.toml", "nastran:1"], 2, "is no program with nodes j and k"),
    (["export", "joint.toml", "abacus:1,2"], 2, "did you mean abaqus?"),
    (["export", "joint.toml", "ansys:1,1"], 2, "names a node twice"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "status", "message"), WRONG)
def test_what_is_wrong_is_one_sentence(words, status, message):
    before = set(Path().iterdir())
    result = run_command(*words)
    assert message in result.stderr
    assert result.returncode == status
    assert result.stderr.splitlines()[-1].startswith("jointfrf: error: ")
    assert set(Path().iterdir()) == before


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("stiffness", "stifness", "unknown key 'stifness'"),
        ("[6e5, 5e3]", "[6e5]", "joint.toml"),
        ("[6e5, 5e3]", '["a", "b"]', "joint.toml"),
        ('"rz"', '"rw"', "rw"),
    ],
)
def test_a_joint_by_hand_that_is_wrong(tmp_path, old, new, message):
    (tmp_path / "joint.toml").write_text(JOINT_TOML.replace(old, new))
    result = run_command("export", tmp_path / "joint.toml", "abaqus:1,2")
    assert result.returncode in (1, 2)
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1


VALIDATE = ["validate", "a.toml", "b.uff", "c.npz", *COUPLE[3:]]


def test_the_assembly_itself_is_validated_without_error():
    content = json.loads(run_command(*VALIDATE, "--json").stdout)
    assert max(content["largest"].values()) < 1e-9
    assert content["responses"] == [str(channel) for channel in read_frfs("c.npz").responses]


def test_a_wrong_joint_shows_in_every_error(tmp_path):
    (tmp_path / "soft.toml").write_text(JOINT_TOML.replace("5e3", "5e2"))
    words = [word if word != "joint.toml" else tmp_path / "soft.toml" for word in VALIDATE]
    result = run_command(*words, "--band", "40:300", "--json", "--output", tmp_path / "made.npz")
    content = json.loads(result.stdout)
    measured, made = read_frfs("c.npz").select((40, 300)), read_frfs(tmp_path / "made.npz")
    other = jf.Joint([6e5, 5e2], [20.0, 1.5], ["y", "theta_z"])
    freq = made.freq_hz
    tip = [A.dofs.index("5:y"), A.dofs.index("5:theta")]
    h = jf.couple(A.receptance(freq), B.receptance(freq), other, tip, [0, 1], freq_hz=freq)
    np.testing.assert_allclose(made.h, h, rtol=1e-8, atol=1e-16)
    expected = [
        [jf.amplitude_error(measured.h[:, i, j], h[:, i, j], freq, refine=True) for j in range(h.shape[2])]
        for i in range(3)
    ]
    np.testing.assert_allclose(content["amplitude_error"][:3], expected, rtol=1e-6)
    assert content["median"]["difference"] > 20
    assert content["median"]["frequency_error"] > 1


def test_a_joint_is_transferred_to_another_part(tmp_path):
    longer = jf.beam(0.25, 3, **SECTION)
    tip = [A.dofs.index("5:y"), A.dofs.index("5:theta")]
    h = jf.couple(A.receptance(FREQ_HZ), longer.receptance(FREQ_HZ), JOINT, tip, [0, 1], freq_hz=FREQ_HZ)
    h = jf.pollute(h, 0.01, seed=1)
    n = h.shape[1]
    # a test at two points of A and the end of B, of which one FRF is missing, and of a point that no part has
    some = [0, 2, n - 2]
    names = [jf.io.Channel(node, "y") for node in (2, 3, 104, 999)]
    own = np.concatenate([h[:, some][:, :, some], np.ones((len(h), 1, 3))], axis=1)
    own[:, 1, 2] = np.nan
    jf.io.write_frfs(tmp_path / "test.npz", jf.io.FrfSet(FREQ_HZ, tuple(names), tuple(names[:3]), own))
    (tmp_path / "long.toml").write_text(MODEL.format(length=0.25, elements=3, first="free"))
    words = ["validate", "a.toml", tmp_path / "long.toml", tmp_path / "test.npz", *COUPLE[3:]]
    result = run_command(*words)
    assert result.returncode == 0, result.stderr
    assert "regenerated and measured: 8 FRFs, 20 to 400 Hz" in result.stdout
    assert "not in the parts, and not compared: 999:+y" in result.stdout
    content = json.loads(run_command(*words, "--json").stdout)
    assert content["difference"][1][2] is None
    assert 0.8 < content["median"]["difference"] < 1.2
    assert content["median"]["amplitude_error"] < 3


@pytest.mark.parametrize(
    ("words", "status", "error"),
    [
        (VALIDATE[:4], 2, "--joint, --j and --k are missing"),
        (["validate", "a.toml", "b.uff", "c.npz", *COUPLE[3:-1], "300"], 0, ""),
        ([*VALIDATE, "--band", "1000:2000"], 1, "no frequency line"),
        ([*VALIDATE, "--output", "none/x.npz"], 2, "folder none does not exist"),
    ],
)
def test_validate_says_what_is_wrong(words, status, error):
    result = run_command(*words)
    assert result.returncode == status
    assert error in result.stderr


def modes_of_b(path, damping=0.01):
    """Write all modes of beam B as arrays, at the same places as the model, and return that model."""
    k, m = (np.asarray(one.toarray() if sparse.issparse(one) else one).real for one in (B.stiffness, B.mass))
    squared, shapes = linalg.eigh(k, m)
    omega = np.sqrt(np.maximum(squared, 0))
    omega[squared < 1e-9 * squared[-1]] = 0
    names = [dof.replace("theta", "theta_z") for dof in B.dofs]
    np.savez(path, Fn=omega / (2 * np.pi), Xi=np.full(omega.size, damping), Phi=shapes, modal_mass=np.ones(omega.size),
             dofs=names)  # fmt: skip
    c = m @ shapes @ np.diag(2 * damping * omega) @ shapes.T @ m
    return jf.Model(k, m, B.dofs, damping=c)


@pytest.mark.parametrize("more", ["", 'joint = ["1:y", "1:theta_z"]\n'])
def test_parts_by_modes(tmp_path, more):
    """`frf` writes their receptances, `couple` takes them as a side: as the model has it whose modes they are."""
    model = modes_of_b(tmp_path / "modes.npz")
    modes = tmp_path / "modes.toml"
    modes.write_text('model = "modes"\nfile = "modes.npz"\n' + more)
    expected = model.receptance(FREQ_HZ, range(len(B.dofs)))
    result = run_command("frf", modes, *LINES, "--output", tmp_path / "b.npz")
    assert result.returncode == 0, result.stderr
    assert "modes.npz: 6 modes of 8 DOFs" in result.stdout
    assert "2 rigid motions" in result.stdout
    written = read_frfs(tmp_path / "b.npz")
    np.testing.assert_allclose(written.h, expected, rtol=1e-6, atol=1e-9 * abs(expected).max())
    coupled = []
    for side in (modes, tmp_path / "b.npz"):
        out = tmp_path / f"c{len(coupled)}.npz"
        words = [
            "a.toml",
            side,
            "--joint",
            "joint.toml",
            "--j",
            "5",
            "--k",
            "1",
            "--renumber-b",
            "100",
            "--output",
            out,
        ]
        result = run_command("couple", *words, *(LINES if side is modes else []))
        assert result.returncode == 0, result.stderr
        coupled.append(read_frfs(out))
    np.testing.assert_allclose(coupled[0].h, coupled[1].h, rtol=1e-9)


def test_a_wrong_part_by_modes_is_one_sentence(tmp_path):
    (tmp_path / "modes.toml").write_text('model = "modes"\nfile = "none.npz"\n')
    result = run_command("frf", tmp_path / "modes.toml", *LINES, "--output", tmp_path / "b.npz")
    assert result.returncode == 1
    assert "none.npz does not exist" in result.stderr
    assert result.stderr.count("\n") == 1
    modes_of_b(tmp_path / "none.npz")
    result = run_command("frf", tmp_path / "modes.toml", *LINES, "--points", "9:y", "--output", tmp_path / "b.npz")
    assert result.returncode == 1
    assert "unknown DOF '9:y'; use a DOF of the modes" in result.stderr
