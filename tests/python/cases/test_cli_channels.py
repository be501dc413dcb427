"""`jointfrf identify` on a hammer test of 24 responses and 24 impacts around a six-DOF joint, as a new user runs it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from command import run_command
from hammer_test import JOINT, hammer_test, noisy
from jointfrf.io import Channel, write_npz, write_uff
from rigid_bodies import DOFS, POINT

AT = ",".join(f"{value:g}" for value in POINT)
#: As in the README: nodes of sensors and impacts together.
JOINT_WORDS = ["--at", AT, "--j", "101:199", "--k", "201:299", "--dofs", "x,y,z,rx,ry,rz"]
QUICK = ["--damping", "viscous", "--noise", "0.01"]


@pytest.fixture(scope="module")
def test_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("hammer") / "test.uff"
    write_uff(path, noisy(hammer_test()))
    return path


@pytest.fixture(scope="module")
def identified(test_file):
    folder = test_file.parent
    words = ["--save", folder / "joint.json", "--export", "nastran:9001,9002", "--output", folder / "joint.bdf"]
    result = run_command("identify", test_file, *JOINT_WORDS, *QUICK, "--band", "20:260", *words)
    assert result.returncode == 0, result.stderr
    return result, folder


def test_a_joint_from_test_files(identified):
    result, folder = identified
    said = result.stdout
    assert (
        "24 responses x 24 excitations; joint between points 101 to 104, 111 to 122 and 201 to 204, 211 to 222" in said
    )
    assert f"virtual points at x, y, z = 0, 0, {1e3 * POINT[2]:g} mm on both sides" in said
    assert "% of their motion is not rigid" in said
    assert "excitations of side k: 12 channels" in said
    for name in ("101:+x", "204:+z", "111:-x", "222:+z"):
        assert name in said
    saved = json.loads((folder / "joint.json").read_text())
    assert (saved["format"], saved["format_version"], saved["source"]) == ("jointfrf joint", 2, "test.uff")
    assert saved["reference_points_m"]["k"] == pytest.approx(list(POINT))
    exact = dict(zip([f"k_{dof}" for dof in DOFS], np.diagonal(JOINT.stiffness), strict=True))
    for name, value in exact.items():
        low, high = saved["parameters"][name]["confidence_interval_95"]
        assert low - 0.02 * value < value < high + 0.02 * value
        assert saved["parameters"][name]["value"] == pytest.approx(value, rel=0.05)
    cards = (folder / "joint.bdf").read_text()
    assert "$ from test.uff" in cards
    assert "CBUSH" in cards


def test_a_saved_joint_is_exported(identified, tmp_path):
    _, folder = identified
    said = run_command("export", folder / "joint.json", "nastran:9001,9002", "--output", tmp_path / "joint.bdf")
    assert said == (0, f"wrote {tmp_path / 'joint.bdf'}\n", "")
    one, other = ((place / "joint.bdf").read_text() for place in (folder, tmp_path))
    assert [line for line in other.splitlines() if "reference point" not in line] == [
        line for line in one.splitlines() if "reference point" not in line
    ]
    placed = run_command(
        "export", folder / "joint.json", "nastran:9001,9002", "--nodes-at", "0.01,0,0.1,-0.01,0,0.1", "--json"
    )
    assert "rigid arms from the nodes to the joint: -0.01, 0, 0 m (j)" in json.loads(placed.stdout)["cards"]


def test_a_wrong_channel_is_named(tmp_path):
    frfs = hammer_test()
    h = frfs.h.copy()
    h[:, 14] *= -1  # 201:+z
    write_uff(tmp_path / "wrong.uff", noisy(replace(frfs, h=h)))
    result = run_command("check", tmp_path / "wrong.uff", *JOINT_WORDS)
    assert result.returncode == 1
    (error,) = [line for line in result.stdout.splitlines() if line.startswith(("error", "warning"))]
    assert error.startswith("error: response 201:+z is -")
    assert "from the rigid motion of 11 neighbours" in error
    assert error.endswith("Reverse its sign or its direction [channel-sign]")
    content = json.loads(run_command("check", tmp_path / "wrong.uff", *JOINT_WORDS, "--json").stdout)
    (guilty,) = [g for g in content["joint"]["agreement"] if (g["kind"], g["side"]) == ("response", "k")]
    assert guilty["channels"]["201:+z"]["blame"] > 0.9


def test_a_dof_left_out_is_named_before_the_fit(test_file):
    words = ["--at", f"0,0.006,{POINT[2]}", *JOINT_WORDS[2:-1], "x,y,z", *QUICK]
    result = run_command("identify", test_file, *words, "--band", "20:120")
    assert "which is left out, enters" in result.stderr
    assert "fit theta_" in result.stderr


def test_an_offset_between_two_nodes_is_named_before_the_fit(tmp_path):
    """Points 6 mm apart along y: where both sides turn about z, they move against each other along x."""
    frfs = hammer_test()
    ends = (Channel(1, "+x"), Channel(2, "+x"))
    places = {1: np.zeros(3), 2: np.array([0, 0.006, 0])}
    write_uff(
        tmp_path / "two.uff", replace(frfs, responses=ends, excitations=ends, h=frfs.h[:, :2, :2], coordinates=places)
    )
    said = run_command("check", tmp_path / "two.uff", "--j", "1", "--k", "2", "--dofs", "x").stdout
    assert "couples x with theta_z, which is left out: -6 mm; --at X,Y,Z gives both sides one" in said
    assert "reference points 6 mm apart: x, y, z = 0, 6, 0 mm" in said


def test_several_files_of_one_test(test_file, tmp_path):
    """One file for each side of the impacts, as a test system writes them run by run."""
    frfs = noisy(hammer_test())
    for name, own in (("a.npz", slice(0, 12)), ("b.npz", slice(12, 24))):
        write_npz(tmp_path / name, replace(frfs, excitations=frfs.excitations[own], h=frfs.h[:, :, own]))
    words = [*JOINT_WORDS, *QUICK, "--band", "20:120", "--json"]
    parts = json.loads(run_command("identify", tmp_path / "a.npz", tmp_path / "b.npz", *words).stdout)
    whole = json.loads(run_command("identify", test_file, *words).stdout)
    assert [path[-5:] for path in parts["sources"]] == ["a.npz", "b.npz"]
    for name, found in whole["fits"][0]["parameters"].items():
        assert parts["fits"][0]["parameters"][name]["value"] == pytest.approx(found["value"], rel=1e-4), name


def csv_table(frfs):
    """The geometry of a test as a table, sensors and impacts."""
    rows = ["channel,side,role,x [mm],y [mm],z [mm]"]
    for role, channels in (("response", frfs.responses), ("excitation", frfs.excitations)):
        for channel in channels:
            x, y, z = 1e3 * frfs.coordinates[channel.node]
            rows.append(f"{channel},{'j' if channel.node < 200 else 'k'},{role},{x!r},{y!r},{z!r}")
    return "\n".join(rows).replace("np.float64(", "").replace(")", "") + "\n"


def test_a_table_of_channels_stands_for_the_coordinates_of_the_file(test_file, tmp_path, monkeypatch):
    frfs = noisy(hammer_test())
    write_npz(tmp_path / "bare.npz", replace(frfs, coordinates={}))
    (tmp_path / "channels.csv").write_text(csv_table(frfs))
    monkeypatch.chdir(tmp_path)
    words = [*QUICK, "--band", "20:120", "--json"]
    of_file = run_command("identify", test_file, *JOINT_WORDS, *words)
    missing = run_command("identify", "bare.npz", *JOINT_WORDS, *words)
    assert missing.returncode == 1
    assert "node 101 has no coordinates in bare.npz; add them to a table of channels" in missing.stderr
    of_table = run_command(
        "identify", "bare.npz", "--channels", "channels.csv", "--at", AT, "--dofs", "x,y,z,rx,ry,rz", *words
    )
    assert of_table.returncode == 0, of_table.stderr
    fits = [json.loads(result.stdout)["fits"][0]["parameters"] for result in (of_file, of_table)]
    for name, found in fits[0].items():
        assert fits[1][name]["value"] == pytest.approx(found["value"], rel=1e-5), name
    # The same as the project's own file, with everything that is always said.
    table = "".join(
        f'[[channel]]\nchannel = "{row[0]}"\nside = "{row[1]}"\nrole = "{row[2]}"\nat = [{", ".join(row[3:])}]\n'
        for row in (line.split(",") for line in csv_table(frfs).splitlines()[1:])
    )
    (tmp_path / "jointfrf.toml").write_text(
        f'dofs = ["x", "y", "z", "rx", "ry", "rz"]\nat = [{AT}]\nunit = "mm"\n{table}'
        '[identify]\ndamping = "viscous"\nnoise = 0.01\nband = [20, 120]\n'
    )
    of_project = run_command("identify", "bare.npz", "--json")
    assert of_project.returncode == 0, of_project.stderr
    assert json.loads(of_project.stdout)["fits"] == json.loads(of_table.stdout)["fits"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--at", "1,2"], "'1,2' is no point; use the form x,y,z in m"),
        (["--at", AT, "--j", "101:104"], "--k and --dofs are missing"),
        (["--at-k", AT, *JOINT_WORDS[2:]], "--at-k needs a reference point"),
        ([*JOINT_WORDS, "--spacing", "0.1", "--axis", "x"], "--spacing is for nodes along a line"),
        ([*JOINT_WORDS, "--export", "calculix:1,2"], "calculix has rotations at ROT NODEs of rigid bodies only"),
        ([*JOINT_WORDS, "--export", "ansys:1,2"], "use --damping viscous, or --no-damping"),
        ([*JOINT_WORDS, "--export", "nastrn:1,2"], "did you mean nastran?"),
        ([*JOINT_WORDS, "--output", "a.bdf"], "--output is for cards; add --export PROGRAM:J,K"),
        ([*JOINT_WORDS, "--export", "nastran:1,2", "--output", "no/a.bdf"], "--output: folder no does not exist"),
        ([*JOINT_WORDS, "--save", "no/joint.json"], "--save: folder no does not exist"),
        ([*JOINT_WORDS, "--save", "."], "--save: . is a folder; name a file"),
    ],
)
def test_wrong_usage(test_file, words, message):
    result = run_command("identify", test_file, *words)
    assert result.returncode == 2
    assert message in result.stderr.splitlines()[-1]


def test_words_and_files_that_do_not_fit(test_file, tmp_path):
    def said(*words, j="101:199"):
        words = [j if word == "101:199" else word for word in words]
        result = run_command("identify", test_file, *words)
        assert result.returncode == 1, result.stderr
        return result.stderr

    assert "nodes 301 to 399; use nodes of 101 to 104, 111 to 122" in said(
        *JOINT_WORDS[:3], "301:399", *JOINT_WORDS[4:]
    )
    assert "has no FRF at node 105" in said(*JOINT_WORDS[:3], "101:104,105", *JOINT_WORDS[4:])
    assert "do not lie on one line" in said(*JOINT_WORDS[2:])
    assert "add --at X,Y,Z for virtual points" in said(*JOINT_WORDS[2:])
    (tmp_path / "c.toml").write_text('[[channel]]\nchannel = "999:+x"\nside = "j"\n')
    assert "c.toml: [[channel]] number 1: " in said("--channels", tmp_path / "c.toml", "--at", AT, "--dofs", "x")
