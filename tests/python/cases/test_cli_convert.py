"""`jointfrf convert`: what it writes, what it says, what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest

from command import run_command
from frf_files import FREQ_HZ, frf_set, full_set, names, write_mat
from jointfrf.io import read_frfs, write_npz

BARS = Path(__file__).resolve().parents[3] / "cases" / "hammer-test" / "two_bars.uff"


def run(*words, expect=0):
    result = run_command("convert", *words)
    assert result.returncode == expect, result.stderr
    assert "Traceback" not in result.stderr
    return result


@pytest.mark.parametrize("suffix", ["uff", "npz", "csv"])
def test_a_joint_is_the_same_from_every_format(tmp_path, suffix):
    words = ["--j", "101,102", "--k", "201,202", "--dofs", "y,theta_z", "--band", "20:150"]
    words += ["--spacing", "0.02", "--axis", "x"] if suffix == "csv" else []  # which holds no coordinates
    target = tmp_path / f"bars.{suffix}"
    run(BARS, target)
    table = [run_command("identify", path, *words).stdout.split("method compliance")[1] for path in (BARS, target)]
    assert table[0] == table[1]


def test_what_is_said(tmp_path):
    said = run(BARS, tmp_path / "a.npz").stdout.splitlines()
    assert said[0] == str(BARS)
    assert said[1] == "in the file: acceleration [m/s^2] per excitation force [N]"
    assert said[2].startswith("used as: 36 accelerances (m/s^2)/N")
    assert said[-1] == f"wrote {tmp_path / 'a.npz'}"
    assert run(BARS, tmp_path / "a.npz", "--quiet").stdout == ""
    found = json.loads(run("--json", "--nodes", "101,201", "--band", "20:30", BARS, tmp_path / "a.npz").stdout)
    assert found["responses"] == ["101:+y", "201:+y"]
    assert (found["frfs"], found["lines"], found["band_hz"]) == (4, 6, [20, 30])
    assert (found["quantity"], found["coherence"]) == ("accelerance", False)


def test_fields_of_a_matlab_file(tmp_path):
    given = frf_set()
    write_mat(tmp_path / "a.mat", f=FREQ_HZ, A=given.h.transpose(1, 2, 0), unit="m/s^2/N")
    result = run(tmp_path / "a.mat", tmp_path / "a.npz", expect=1)
    assert "has no field for the FRFs" in result.stderr
    fields = ["--map", "h=A", "--map", "axes=out,in,freq"]
    fields += ["--map", "responses=" + ",".join(names(given.responses)), "--map", "excitations=101:x,201:y"]
    run(tmp_path / "a.mat", tmp_path / "a.npz", *fields, "--averages", "5")
    found = read_frfs(tmp_path / "a.npz")
    np.testing.assert_array_equal(found.h, given.h)
    assert (found.averages == 5).all()


def test_several_files_become_one(tmp_path):
    write_npz(tmp_path / "a.npz", full_set())
    write_npz(tmp_path / "b.npz", full_set().at_nodes({101}))
    run(tmp_path / "a.npz", tmp_path / "b.npz", tmp_path / "c.npz")
    np.testing.assert_array_equal(read_frfs(tmp_path / "c.npz").h, full_set().h)
    write_npz(tmp_path / "b.npz", frf_set("mobility"))
    result = run(tmp_path / "a.npz", tmp_path / "b.npz", tmp_path / "d.npz", expect=1)
    assert "contradict each other: leave one out" in result.stderr
    assert not (tmp_path / "d.npz").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([BARS], "the file to write is missing"),
        ([BARS, "out.xlsx"], "out.xlsx has no suffix of a format that is written; use one of .uff, .unv"),
        ([BARS, "nowhere/out.npz"], "folder nowhere does not exist"),
        ([BARS, BARS], "two_bars.uff is also a file to read"),
        ([BARS, "a.npz", "--map", "H=A"], "'H=A' is not FIELD=NAME; use a field of freq_hz, h"),
        ([BARS, "a.npz", "--band", "high"], "'high' is no band; use the form 200:550"),
    ],
)
def test_wrong_usage(tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    before = BARS.read_bytes()
    assert message in run(*words, expect=2).stderr
    assert not list(tmp_path.iterdir())
    assert BARS.read_bytes() == before


@pytest.mark.parametrize("command", ["convert", "identify", "check"])
def test_a_quantity_against_the_file_must_be_forced(tmp_path, command):
    words = [command, BARS, *([tmp_path / "a.npz"] if command == "convert" else []), "--quantity", "mobility"]
    refused = run_command(*words)
    assert refused.returncode == 1
    assert "states accelerance (acceleration [m/s^2] per excitation force [N] in dataset" in refused.stderr
    forced = run_command(*words, "--force-quantity")
    assert "the unit 'm/s^2' does not fit the response of mobility" in forced.stderr
    assert "give --unit, such as g/N" in forced.stderr
    forced = run_command(*words, "--force-quantity", "--unit", "m/s/N")
    assert "states" not in forced.stderr
    assert "--unit" not in forced.stderr


def test_a_unit_that_the_file_does_not_state(tmp_path):
    given = frf_set()
    write_mat(tmp_path / "a.mat", f=FREQ_HZ, H=given.h, responses=names(given.responses),
              excitations=names(given.excitations))  # fmt: skip
    refused = run(tmp_path / "a.mat", tmp_path / "a.npz", expect=1).stderr
    assert refused.endswith("a.mat: the FRFs have no unit; give --unit, such as g/N or (m/s^2)/N\n")
    said = run(tmp_path / "a.mat", tmp_path / "a.npz", "--unit", "mm/s^2/N").stdout
    assert "in the file: FRFs of an unnamed quantity [no unit], unit stated: mm/s^2/N" in said
    np.testing.assert_allclose(read_frfs(tmp_path / "a.npz").h, 1e-3 * given.h)


def test_coherence_of_the_file_is_used_by_the_manifold(tmp_path):
    """A coherence that tells of more noise than there is makes no sense of it; one that is used changes the result."""
    frfs = read_frfs(BARS).select((20, 200))
    words = ["--j", "101", "--k", "201", "--dofs", "y"]
    said = []
    for coherence, averages in ((None, None), (np.full(frfs.h.shape, 0.999), 4.0)):
        path = tmp_path / f"{averages}.npz"
        write_npz(path, frfs.__class__(frfs.freq_hz, frfs.responses, frfs.excitations, frfs.h, frfs.quantity,
                                       frfs.coordinates, "", coherence, averages))  # fmt: skip
        result = run_command("identify", path, *words)
        assert result.returncode == 0, result.stderr
        said.append(result.stdout)
    assert said[0] != said[1]
