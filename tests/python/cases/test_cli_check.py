"""`jointfrf check` on the simulated hammer test, as it is and with errors."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from hammer_test import hammer_test, noisy
from jointfrf.io import read_uff, write_uff

BARS = Path(__file__).resolve().parents[3] / "cases" / "hammer-test" / "two_bars.uff"
JOINT_OF_BARS = ["--j", "101,102", "--k", "201,202", "--dofs", "y,theta_z"]


@pytest.fixture
def wrong(tmp_path):
    """The sign of the sensor at point 102 turned."""
    frfs = read_uff(BARS)
    h = frfs.h.copy()
    h[:, [str(channel) for channel in frfs.responses].index("102:+y")] *= -1
    file = tmp_path / "wrong.uff"
    write_uff(file, replace(frfs, h=h))
    return file


@pytest.mark.parametrize("words", [[], JOINT_OF_BARS, [*JOINT_OF_BARS, "--band", "100:800"]])
def test_good_data(words):
    result = run_command("check", BARS, *words)
    assert (result.returncode, result.stderr) == (0, "")
    assert "nothing found" in result.stdout


@pytest.mark.parametrize("words", [[], JOINT_OF_BARS])
def test_an_error_is_named_with_its_channel(wrong, words):
    result = run_command("check", wrong, *words)
    assert result.returncode == 1
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("error")]
    assert "the response 102:+y points against its force" in line
    assert line.endswith("[driving-point-sign]")


def test_identify_stops_at_it_unless_it_is_accepted(wrong, tmp_path):
    words = ["identify", wrong, *JOINT_OF_BARS, "--save", tmp_path / "joint.json"]
    result = run_command(*words)
    assert (result.returncode, result.stdout) == (1, "")
    (line,) = result.stderr.splitlines()
    assert line.startswith("jointfrf: error: the response 102:+y points")
    assert line.endswith("say --accept driving-point-sign [driving-point-sign]")
    assert not (tmp_path / "joint.json").exists()
    assert run_command(*words, "--accept", "sign").returncode == 2
    frfs = read_uff(BARS)
    write_uff(wrong, replace(frfs, h=-frfs.h))  # of all sensors
    assert run_command(*words).stderr.endswith("say --accept driving-point-sign [driving-point-sign]\n")
    accepted = run_command(*words, "--accept", "driving-point-sign", "--json")
    assert accepted.returncode == 0, accepted.stderr
    for content in (json.loads(accepted.stdout)["fits"][0], json.loads((tmp_path / "joint.json").read_text())):
        assert content["findings"][0]["code"] == "driving-point-sign"


@pytest.fixture
def parts(tmp_path):
    """Two chains and their assembly, of which B has one sensor reversed, and the words that name joint and files."""
    freq = np.linspace(0.5, 10, 300)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    whole = jf.couple(a, b, jf.Joint([2000.0], [3.0], ["x"]).dynamic_stiffness(freq), [1], [0])
    b = b * np.array([-1.0, 1.0])[:, None]
    for name, h, nodes in (("a", a, (1, 2)), ("b", b, (11, 12)), ("whole", whole, (1, 2, 11, 12))):
        channels = tuple(jf.io.Channel(node, "+x") for node in nodes)
        noisy_h = jf.pollute(h, 0.005, seed=len(name))
        jf.io.write_frfs(tmp_path / f"{name}.npz", jf.io.FrfSet(freq, channels, channels, noisy_h, "receptance"))
    (tmp_path / "joint.toml").write_text('dofs = ["x"]\nstiffness = [2000.0]\ndamping = [3.0]\n')
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ["couple", "a.npz", "b.npz", "--joint", "joint.toml", "--j", "2", "--k", "11", "--output", "ab.npz"],
        ["decouple", "a.npz", "b.npz", "whole.npz", "--j", "2", "--k", "11", "--dofs", "x", "--s", "12:x"],
        ["validate", "a.npz", "b.npz", "whole.npz", "--joint", "joint.toml", "--j", "2", "--k", "11"],
    ],
)
def test_commands_of_parts_warn_of_a_reversed_sensor(parts, monkeypatch, words):
    monkeypatch.chdir(parts)
    result = run_command(*words)
    assert result.returncode == 0, result.stderr
    (line,) = result.stderr.splitlines()
    assert line.startswith("jointfrf: warning: b.npz: the response 11:+x points against its force")
    assert line.endswith("[driving-point-sign]")


def test_frfs_that_are_missing(tmp_path):
    frfs = read_uff(BARS)
    h = frfs.h.copy()
    h[:, 0, 1] = np.nan
    file = tmp_path / "part.uff"
    write_uff(file, replace(frfs, h=h))
    result = run_command("check", file, "--quiet")
    assert result.returncode == 1
    (line,) = result.stderr.splitlines()
    channels = f"{frfs.responses[0]} / {frfs.excitations[1]}"
    assert f"1 of {h[0].size} FRFs missing: {channels}" in line


@pytest.fixture
def points(tmp_path):
    """A hammer test on virtual points: its set, how it is written, and the words that name its joint."""
    frfs = noisy(hammer_test())

    def write(h=frfs.h, **more):
        file = tmp_path / "points.uff"
        write_uff(file, replace(frfs, h=h, **more))
        return file

    words = ["--j", "101:104,111:122", "--k", "201:204,211:222", "--dofs", "x,y,z,rx,ry,rz", "--at", "0,0,0.1"]
    return frfs, write, words


def errors_of(result):
    return [line for line in result.stdout.splitlines() if line.startswith(("error", "warning"))]


def test_good_virtual_points(points):
    _, write, words = points
    result = run_command("check", write(), *words)
    assert (result.returncode, errors_of(result)) == (0, [])


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (-1.0, "[channel-sign]"),
        pytest.param(9.81, "[channel-unit]", marks=pytest.mark.long),
    ],
)
def test_a_bad_sensor_is_one_error(points, factor, said):
    frfs, write, words = points
    h = frfs.h.copy()
    h[:, [str(channel) for channel in frfs.responses].index("102:+y")] *= factor
    result = run_command("check", write(h), *words)
    assert result.returncode == 1
    (line,) = errors_of(result)
    assert line.startswith("error")
    assert said in line
    assert "nothing found" not in result.stdout
    # and a fit of less than six DOFs warns of that, not of what follows from it
    few = ["y" if word == "x,y,z,rx,ry,rz" else word for word in words]
    fit = run_command("identify", write(h), *few, "--json")
    content = json.loads(fit.stdout)
    assert sum("102:+y" in text for text in content["warnings"]) == 1


def test_one_missing_frf_stops_nothing(points):
    frfs, write, words = points
    h = frfs.h.copy()
    h[:, 4, 7] = np.nan
    sensor = [str(channel) for channel in frfs.responses].index("203:+z")
    h[:, sensor] *= -1
    result = run_command("check", write(h), *words)
    assert result.returncode == 1
    error, warning = errors_of(result)
    assert "response 203:+z is -" in error
    assert f"{frfs.responses[4]} / {frfs.excitations[7]}" in warning
    assert "a fit leaves out" in warning
    h[:, sensor] *= -1
    fit = run_command("identify", write(h), *words, "--json")
    assert fit.returncode == 0, fit.stderr
    assert any("1 of 576 FRFs missing" in text for text in json.loads(fit.stdout)["warnings"])


def test_coordinates_and_reference_point_in_different_units(points):
    frfs, write, words = points
    large = {node: 1e3 * np.asarray(place) for node, place in frfs.coordinates.items()}
    result = run_command("check", write(coordinates=large), *words)
    (line,) = errors_of(result)
    assert result.returncode == 1
    assert "coordinates look like millimetres" in line
    far = run_command("check", write(), *words[:-1], "0,0,100")
    (line,) = errors_of(far)
    assert "error: the reference point at 0, 0, 100 m looks like millimetres" in line


@pytest.mark.parametrize("on_points", [True, False])
def test_a_mobility_labelled_accelerance_is_cured_once(points, on_points, tmp_path):
    if on_points:
        frfs, write, words = points
        file = write(frfs.h / (2j * np.pi * frfs.freq_hz[:, None, None]))
    else:
        frfs, words = read_uff(BARS), JOINT_OF_BARS
        assert frfs.quantity == "accelerance"
        file = tmp_path / "bars.uff"
        write_uff(file, replace(frfs, h=frfs.h / (2j * np.pi * frfs.freq_hz[:, None, None])))
    result = run_command("check", file, *words)
    (line,) = errors_of(result)
    assert "mobilities read as accelerance" in line
    assert "Read the file as mobilities: `--unit m/s/N --force-quantity`" in line
    cured = run_command("check", file, *words, "--unit", "m/s/N", "--force-quantity")
    assert (cured.returncode, errors_of(cured)) == (0, [])
