"""`jointfrf identify --side-j --side-k`: models of sides as files, and channels found in them by place or by name."""

import json
from pathlib import Path

import pytest

from command import run_command

CASE = Path(__file__).resolve().parents[3] / "cases" / "bending-sides"
JOINT = ("--at", "0,0,0", "--j", "101:104", "--k", "201:204", "--dofs", "y,rz")


def run(*words, expect=0):
    result = run_command("identify", *words)
    assert result.returncode == expect, result.stderr
    return result


def found(*words):
    content = json.loads(run(CASE / "test.uff", *JOINT, "--json", *words).stdout)
    return content["fits"][0]


def test_models_of_the_sides_find_the_joint_that_virtual_points_do_not():
    fit = found("--side-j", CASE / "side_j.toml", "--side-k", CASE / "side_k.toml")
    seen = found()
    for name, k in (("k_y", 2e8), ("k_theta_z", 1.5e5)):
        low, high = fit["parameters"][name]["confidence_interval_95"]
        assert low < k < high
        assert fit["parameters"][name]["value"] == pytest.approx(k, rel=0.05)
        # Without models both springs are seen in series, and the interval says so.
        assert seen["seen"][name]["value"] < 0.6 * k
        low, high = seen["parameters"][name]["confidence_interval_95"]
        assert low < k
        assert high is None or high > k
        assert seen["parameters"][name]["std_error"] is None or high is not None
    assert fit["seen"] == {}


def part(folder, name, **changes):
    text = (CASE / f"{name}.toml").read_text()
    for key, value in changes.items():
        (line,) = (own for own in text.splitlines() if own.startswith(f"{key} ="))
        text = text.replace(line, f"{key} = {value}")
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def test_the_nearest_node_of_a_coarse_part_is_said(tmp_path):
    coarse = part(tmp_path, "side_j", elements="14", joint='["15:y", "15:theta"]')
    printed = run(CASE / "test.uff", *JOINT, "--side-j", coarse, "--side-k", CASE / "side_k.toml").stdout
    assert "side by" in printed
    assert "nearest nodes: 101:+y at node 14, 1.4 mm off" in printed


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"elements": "3", "joint": '["4:y", "4:theta"]'}, "channel 101:+y at (-20, 0, 0) mm from the joint is"),
        ({"joint": '["31:y"]'}, "1 DOFs; name the 2 DOFs of the joint"),
        ({"joint": '["31:y", "99:theta"]'}, "99:theta"),
        ({"unknown": "{ weight = 0.1 }"}, "weight"),
    ],
)
def test_a_part_that_does_not_fit_is_one_sentence(tmp_path, changes, message):
    wrong = part(tmp_path, "side_j", **changes)
    said = run(CASE / "test.uff", *JOINT, "--side-j", wrong, "--side-k", CASE / "side_k.toml", expect=1).stderr
    assert message in said
    assert "Traceback" not in said


def test_one_side_alone_or_another_method_is_refused():
    words = (CASE / "test.uff", *JOINT, "--side-j", CASE / "side_j.toml")
    assert "give both --side-j and --side-k" in run(*words, expect=2).stderr
    words += ("--side-k", CASE / "side_k.toml", "--method", "inverse-substructuring")
    assert "need method compliance" in run(*words, expect=2).stderr
