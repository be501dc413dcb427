"""`jointfrf identify --points`: two plates with two bolts, six DOFs each; one of them as cards."""

import json
import runpy
from pathlib import Path

import pytest

from command import run_command

CASE = Path(__file__).resolve().parents[3] / "cases" / "two-bolts"
BOLTS = ("identify", CASE / "test.uff", "--j", "101,102", "--k", "201,202", "--dofs", "x,y,z,rx,ry,rz")
FITTED = ("--points", "bolt1,bolt2", "--cross", "points", "--damping", "hysteretic")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    saved = tmp_path_factory.mktemp("bolts") / "joint.json"
    result = run_command(*BOLTS, *FITTED, "--save", saved, "--json")
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout), saved


def test_both_bolts_are_found_inside_their_intervals(found):
    fit = found[0]["fits"][0]
    joint = runpy.run_path(str(CASE / "make.py"))["joint"]()
    # As the page of the case says.
    assert [joint.stiffness[i, i] for i in (0, 3, 6, 9)] == [4e6, 300.0, 0.7 * 4e6, 0.7 * 300.0]
    assert joint.stiffness[2, 3] == pytest.approx(-10392, abs=1)
    matrices = {"k": joint.stiffness, "h": joint.hysteretic_stiffness}
    inside, seen = 0, set()
    for one in fit["parameters"].values():
        a, b = (joint.dofs.index(dof) for dof in one["between"])
        low, high = one["confidence_interval_95"]
        true = matrices[one["kind"]][a, b]
        inside += low <= true <= high
        seen |= {(a, b)} if true else set()
        if a == b and one["kind"] == "k":
            assert one["value"] == pytest.approx(true, rel=0.05)
    # 48 parameters: 45.6 are expected inside 95 %, fewer than 42 with probability 0.01.
    assert len(fit["parameters"]) == 48
    assert inside >= 42
    assert len(seen) == 18
    assert fit["dofs"] == list(joint.dofs)
    assert fit["residual_is_noise"]


def test_one_point_of_a_saved_fit_becomes_cards(found):
    result = run_command("export", found[1], "nastran:1,2", "--point", "bolt2")
    assert result.returncode == 0, result.stderr
    assert "joint point bolt2" in result.stdout
    assert f"k_x = {found[0]['fits'][0]['parameters']['bolt2.k_x']['value']:.5g}" in result.stdout
    both = run_command("export", found[1], "nastran:bolt2=3,4:bolt1=1,2")
    assert both.returncode == 0, both.stderr
    elements = [line.split() for line in both.stdout.splitlines() if line.startswith("CBUSH") or "DMIG" in line]
    assert both.stdout.index("joint point bolt1") < both.stdout.index("joint point bolt2")
    assert elements
    for words, message in (
        ("nastran:bolt1=1,2", "--export must name the nodes of each joint, bolt1, bolt2"),
        ("nastran:bolt1=1,2:bolt1=3,4", "names bolt1 twice"),
        ("nastran:bolt1=1:bolt2=3,4", "must be a program with nodes j and k"),
    ):
        refused = run_command("export", found[1], words)
        assert refused.returncode == 2
        assert message in refused.stderr
    result = run_command("export", found[1], "nastran:1,2")
    assert result.returncode == 2
    assert "--point must be one joint point of the file (bolt1, bolt2)" in result.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--same", "bolt1,bolt2"), "--same is of several joint points: name them by --points"),
        (("--points", "bolt1"), "--points names 1, --j 2 and --k 2"),
        (("--points", "bolt1,bolt1"), "--points names a joint point twice"),
        (("--points", "bolt1,bolt2", "--at", "0,0,0"), "--at does not go with it"),
        (("--points", "bolt1,bolt2", "--export", "nastran:1,2"), "--export must name the nodes of each joint, bolt1"),
        (("--points", "bolt1,bolt2", "--model", CASE / "none.toml"), "it does not go with --model"),
    ],
)
def test_options_that_contradict_are_one_sentence(words, message):
    result = run_command(*BOLTS, *words)
    assert result.returncode == 2
    assert message in result.stderr
