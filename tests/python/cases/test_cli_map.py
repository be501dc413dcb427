"""`--map`, and `map` in TOML files: which field of a file is what, wherever a file of FRFs is read."""

import json
from pathlib import Path

import numpy as np
import pytest

from command import run_command
from jointfrf.io import read_frfs

BARS = Path(__file__).resolve().parents[3] / "cases" / "hammer-test" / "two_bars.uff"
JOINT = ["--j", "101,102", "--k", "201,202", "--dofs", "y", "--band", "20:150", "--spacing", "0.02", "--axis", "x"]
#: Fields that no script calls so, nodes and directions in arrays of their own.
MAP = {
    "h": "zz.A", "freq_hz": "zz.lines", "axes": "out,in,freq", "response_nodes": "zz.n",
    "response_directions": "zz.way", "excitation_nodes": "zz.n", "excitation_directions": "zz.codes",
}  # fmt: skip
UNITS = {"accelerance": "m/s^2/N", "receptance": "m/N"}
WORDS = [word for pair in MAP.items() for word in ("--map", "=".join(pair))]
BEAM = (
    'model = "beam"\nlength = {length}\nelements = 3\nelement = "euler-bernoulli"\naxial = false\n'
    'ends = ["{first}", "free"]\nyoungs_modulus = 67e9\ndensity = 2700.0\nwidth = 0.025\nheight = 0.006\n'
    "loss_factor = 0.01\n"
)
PARTS = ["--joint", "joint.toml", "--j", "4", "--k", "1", "--renumber-b", "100"]


def scripted(path, frfs):
    """FRFs as a script of MATLAB may leave them: a structure, nodes apart from directions."""
    import scipy.io

    codes = [{"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}[c.axis] for c in frfs.excitations]
    scipy.io.savemat(path, {"zz": {
        "A": np.ascontiguousarray(frfs.h.transpose(1, 2, 0)), "lines": frfs.freq_hz,
        "n": [c.node for c in frfs.responses], "way": np.array([c.axis for c in frfs.responses], object),
        "codes": codes,
    }})  # fmt: skip
    return path


def said(*words, expect=0):
    result = run_command(*words)
    assert result.returncode == expect, result.stderr
    return result


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A measured assembly, and the FRFs of a substructure and of an assembly, in files of such a script."""
    place = tmp_path_factory.mktemp("map")
    (place / "a.toml").write_text(BEAM.format(length=0.3, first="clamped"))
    (place / "b.toml").write_text(BEAM.format(length=0.225, first="free"))
    (place / "joint.toml").write_text('dofs = ["y", "rz"]\nstiffness = [6e5, 5e3]\ndamping = [20.0, 1.5]\n')
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        scripted("bars.mat", read_frfs(BARS))
        said("frf", "b.toml", "--band", "20:400", "--step", "20", "--output", "b.npz")
        scripted("b.mat", read_frfs("b.npz"))
        said("couple", "a.toml", "b.npz", *PARTS, "--output", "c.npz")
        scripted("c.mat", read_frfs("c.npz"))
    return place


@pytest.fixture(autouse=True)
def _there(folder, monkeypatch):
    monkeypatch.chdir(folder)


@pytest.mark.parametrize(
    ("plain", "mapped", "quantity"),
    [
        (["identify", BARS, *JOINT, "--method", "inverse-substructuring"], [BARS], "accelerance"),
        (["check", BARS], [BARS], "accelerance"),
        (["convert", BARS, "x.csv"], [BARS], "accelerance"),
        (["couple", "a.toml", "b.npz", *PARTS, "--output", "x.npz"], ["b.npz"], "receptance"),
        (["validate", "a.toml", "b.npz", "c.npz", *PARTS], ["b.npz", "c.npz"], "receptance"),
        (["decouple", "a.toml", "b.npz", "c.npz", "--j", "4", "--k", "1", "--dofs", "y,rz", "--s", "4:y,4:rz",
          "--renumber-b", "100"], ["b.npz", "c.npz"], "receptance"),
        (["frf", "a.toml", "--lines-of", "b.npz", "--output", "x.npz"], ["b.npz"], "receptance"),
    ],
)  # fmt: skip
def test_every_command_reads_what_is_mapped(plain, mapped, quantity):
    """The same result from the fields of a script as from a file that says all of itself."""
    other = {BARS: "bars.mat", "b.npz": "b.mat", "c.npz": "c.mat"}
    words = [other[word] if word in mapped else word for word in plain]
    found = []
    for each in (plain, [*words, *WORDS, "--unit", UNITS[quantity]]):
        numbers = sorted(_numbers(json.loads(said(*each, "--json").stdout)))
        target = next((word for word in each if str(word).startswith("x.")), None)
        found.append((numbers, None if target is None else read_frfs(target).h))
    np.testing.assert_allclose(found[1][0], found[0][0], rtol=1e-9)
    if found[0][1] is not None:
        np.testing.assert_allclose(found[1][1], found[0][1], rtol=1e-9)
    refused = run_command(*words, "--json")
    assert refused.returncode == 1
    assert "has no field for the frequencies" in refused.stderr
    assert "--map" in refused.stderr


def _numbers(content):
    if isinstance(content, dict):
        content = list(content.values())
    if isinstance(content, list):
        return [number for each in content for number in _numbers(each)]
    return [content] if isinstance(content, int | float) else []


def test_files_of_cases_and_assemblies_map_as_well(tmp_path):
    table = ", ".join(f'{name} = "{value}"' for name, value in MAP.items())
    part = f'model = "receptances"\nfile = "b.mat"\nunit = "m/N"\nmap = {{ {table} }}\n'
    text = (
        f'[A]\n{BEAM.format(length=0.3, first="clamped")}joint = ["4:y", "4:theta"]\n\n[B]\n{part}'
        'joint = ["1:y", "1:rz"]\n\n[joint]\ndofs = ["y", "theta_z"]\nstiffness = [5e5, 4e3]\n'
        'damping = [10.0, 1.0]\n\n[channels]\n"4:+y" = "A/4:y"\n"103:+y" = "B/3:y"\n"104:+y" = "B/4:y"\n'
    )
    Path("assembly.toml").write_text(text)
    result = said("identify", "c.npz", "--model", "assembly.toml", "--json", "--noise", "0.001")
    (fit,) = json.loads(result.stdout)["fits"]
    assert fit["parameters"]["k_y"]["value"] == pytest.approx(6e5, rel=1e-3)
    Path("assembly.toml").write_text(text.replace("axes =", "axis ="))
    result = said("identify", "c.npz", "--model", "assembly.toml", expect=1)
    assert "unknown field 'axis' in --map; use one of freq_hz, h, " in result.stderr


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"response_nodes": None}, "has no field response_nodes; give --map response_nodes=..."),
        ({"response_nodes": "zz.codes_"}, "has no field 'zz.codes_'"),
        ({"response_directions": "zz.lines"}, "has 6 nodes of responses, but 491 directions"),
        ({"response_nodes": "zz.way"}, "the nodes of the responses (zz.way) are not whole numbers"),
        ({"responses": "1:x"}, "has responses as names and as nodes and directions; leave one out of --map"),
        ({"h": None}, "has no field for the FRFs; give --map h=... out of zz.A, "),
    ],
)  # fmt: skip
def test_a_wrong_map_is_one_sentence(change, message):
    given = {name: value for name, value in (MAP | change).items() if value is not None}
    words = [word for pair in given.items() for word in ("--map", "=".join(pair))]
    result = said("check", "bars.mat", "--quantity", "accelerance", *words, expect=1)
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_project_may_say_the_map():
    Path("p.toml").write_text(f"unit = 'm/s^2/N'\nmap = {[f'{a}={b}' for a, b in MAP.items()]}\n")
    assert "36 receptances" in said("check", "bars.mat", "--config", "p.toml").stdout
