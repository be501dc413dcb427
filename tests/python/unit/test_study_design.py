"""Designs of studies: points, and the case at each."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.studies.design import parse_factor

FOLDER = find_case("3.3")
CASE = read_case(FOLDER)


def only(factors, **how):
    ((_, case, _),) = jf.StudyDesign(factors, **how).cases(FOLDER)
    return case


def test_every_combination_or_one_at_a_time():
    factors = {"noise": [0.01, 0.05], "lines": [10, 20, 40]}
    full = jf.StudyDesign(factors).points
    assert len(full) == 6
    assert full[4] == {"noise": 0.05, "lines": 20}
    single = jf.StudyDesign(factors, "one-at-a-time").points
    assert single == [{"noise": 0.01}, {"noise": 0.05}, {"lines": 10}, {"lines": 20}, {"lines": 40}]
    assert jf.StudyDesign().points == [{}]


def test_named_factors_change_the_case():
    case = only({"noise": [0.02]})
    assert [(noise.level, noise.name) for noise in case.noises] == [(0.02, "real-uniform-std")]
    case = only({"noise": [0.02]}, noises=["10 %", "5 % complex"])
    assert [(one.name, one.level) for one in case.noises] == [(one.name, 0.02) for one in CASE.noises]
    assert np.diff(only({"spacing": [2.5]}).freq_hz) == pytest.approx(2.5)
    freq = only({"lines": [158]}).freq_hz
    assert (freq.size, freq[0], freq[-1]) == (158, 15.0, 800.0)
    case = only({"stiffness": [10], "damping": [0.5]})
    assert case.joint.stiffness.diagonal().tolist() == [6e6, 5e4]
    assert case.joint.damping.diagonal().tolist() == [10.0, 0.75]
    assert (case.initial.stiffness == CASE.initial.stiffness).all()


def test_keys_of_the_case_file_are_factors():
    case = only({"joint[1].stiffness": [7.0], "joint[0].damping*": [3], "frequency.last": [700.0]})
    assert case.joint.stiffness.diagonal().tolist() == [6e5, 7.0]
    assert case.joint.damping.diagonal().tolist() == [60.0, 1.5]
    assert case.freq_hz[-1] == 700.0
    assert {noise.kind for noise in only({"noise.kind": ["complex"]}).noises} == {"complex"}


def test_a_rubber_mount_has_the_same_factors():
    ((_, case, _),) = jf.StudyDesign({"noise": [0.03], "stiffness": [2.0]}).cases(find_case("rubber-mount"))
    assert case.noise == 0.03
    assert case.actual["k_y"] == 2 * read_case(find_case("rubber-mount")).actual["k_y"]


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ({"noise": [-1.0]}, r"case.toml with noise = -1.0: .*level must be a number, at least 0, not -1.0"),
        ({"lines": [1]}, "lines is 1; give a whole number, at least 2"),
        ({"joint.stifness": [1.0]}, "unknown factor 'joint.stifness'"),
        ({"joint[7].stiffness": [1.0]}, "unknown factor"),
        ({"joint..stiffness": [1.0]}, "is no key; write one such as joint.stiffness"),
        ({"joint.dof*": [2.0]}, "dof = 'Fy' cannot be multiplied by 2.0"),
        ({"substructure_a.elements": [2.5]}, "elements must be a whole number, at least 1, not 2.5"),
        ({"frequency.last": [100.0]}, "no frequency line"),
    ],
)
def test_what_the_case_does_not_take_is_said(factors, message):
    with pytest.raises(jf.FileContentError, match=message):
        list(jf.StudyDesign(factors).cases(FOLDER))


def test_factors_without_sense():
    with pytest.raises(ValueError, match="has no values; give at least one"):
        jf.StudyDesign({"noise": []})
    with pytest.raises(ValueError, match="a value twice: 1, 1"):
        jf.StudyDesign({"noise": [1, 1]})
    with pytest.raises(ValueError, match="arrangement must be one of"):
        jf.StudyDesign({}, "fractional")


def test_values_may_come_from_an_array():
    """Their kind is that of a case file: numpy's whole numbers would be refused as numbers of lines."""
    assert only({"lines": np.array([60])}).freq_hz.size == 60


def test_words_of_the_command_line():
    assert parse_factor("noise=0.01, 1e-1") == ("noise", [0.01, 0.1])
    assert parse_factor("joint.stiffness*=2,3") == ("joint.stiffness*", [2, 3])
    assert parse_factor("noise.kind=complex,real-normal") == ("noise.kind", ["complex", "real-normal"])
    assert parse_factor("noise.reciprocal=true") == ("noise.reciprocal", [True])
    for word in ("noise", "=1", "noise="):
        with pytest.raises(ValueError, match="NAME=VALUE"):
            parse_factor(word)
