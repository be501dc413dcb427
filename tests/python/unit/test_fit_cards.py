"""Cards of a fit: what each number is worth, and which damping is left out."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.result import Fit

NODES = (9001, 9002)


def comments(text):
    """All comments in one line."""
    lines = [line.lstrip("*$!").strip() for line in text.splitlines() if line[:2] in ("**", "$ ", "! ")]
    return " ".join(lines)


def fit_of(parameters, errors, dofs, **more):
    """A fit with given values and independent errors, intervals by the normal distribution."""
    n = len(dofs)
    freq = np.linspace(10, 500, 50)
    return Fit.of_springs(
        "inverse-substructuring", tuple(dofs), parameters, np.diag(np.square(errors)), 0.01, 0.01, freq,
        k_lines=np.ones((50, n, n), complex), bands=(((10.0, 500.0),),) * n, **more,
    )  # fmt: skip


FIT = fit_of(
    {"k_y": 1e7, "k_theta_z": 5e3, "c_y": 200.0, "c_theta_z": 0.01},
    [1e4, 10.0, 5.0, 0.02],
    ["y", "theta_z"],
    findings=(jf.Finding("residual-large", {"ratio": 1.5, "sigma": 9.0}),),
)


def test_every_number_stands_in_a_comment():
    text = jf.cards(FIT, "nastran", NODES, about=["from two_bars.uff"])
    assert "$ from two_bars.uff" in text
    assert "method inverse-substructuring, 10 to 500 Hz, 50 lines" in text
    assert "$ k_y = 1e+07, 9.98e+06 .. 1.002e+07 N/m" in text
    assert "$ c_y = 200, 190.2 .. 209.8 N s/m" in text
    assert "warning: the residual is 1.50 times the noise, 9 sigma above it" in comments(text)


def test_insignificant_damping_is_left_out_unless_asked():
    for program in ("abaqus", "nastran", "ansys"):
        text = jf.cards(FIT, program, NODES)
        assert "c_theta_z = 0.01, -0.0292 .. 0.0492 N m s/rad: not" in text
    assert "DASHPOT2, ELSET=JOINT1_C2" in jf.cards(FIT, "abaqus", NODES)
    assert "JOINT1_C6" not in jf.cards(FIT, "abaqus", NODES)
    asked = jf.cards(FIT, "abaqus", NODES, all_damping=True)
    assert "DASHPOT2, ELSET=JOINT1_C6" in asked
    assert "left out" not in asked
    assert "not significantly different from zero" in comments(asked)


def test_negative_damping_is_left_out():
    fit = fit_of({"k_y": 1e7, "c_y": -200.0}, [1e4, 5.0], ["y"])
    text = jf.cards(fit, "abaqus", NODES)
    assert "c_y = -200, -209.8 .. -190.2 N s/m: negative, left out" in text
    assert "DASHPOT" not in text
    asked = jf.cards(fit, "abaqus", NODES, all_damping=True)
    assert "DASHPOT2" in asked
    assert "puts power into the model" in asked


def test_cross_terms_go_with_the_damping_of_their_dofs():
    values = {"k_y": 1e7, "k_theta_z": 5e3, "k_y,theta_z": 1e4, "c_y": 200.0, "c_theta_z": -1.0, "c_y,theta_z": 3.0}
    fit = fit_of(values, [1e4, 10.0, 10.0, 5.0, 0.1, 0.1], ["y", "theta_z"])
    text = jf.cards(fit, "abaqus", NODES)
    assert "c_y,theta_z = 3, 2.804 .. 3.196 N s: left out with the damping of its DOFs" in comments(text)
    damping = text.split("NAME=JOINT1_C")[1].split("*")[0]
    assert {tuple(line.split(", ")[1:4:2]) for line in damping.splitlines()[1:]} == {("2", "2")}


def test_an_open_stiffness_is_said_to_be_one():
    fit = fit_of({"k_y": 1e9}, [1.0], ["y"], intervals=lambda probability: {"k_y": (4e8, np.inf)})
    with pytest.raises(ValueError, match="only a lower bound is known of k_y"):
        jf.cards(fit, "abaqus", NODES)
    text = jf.cards(fit, "abaqus", NODES, bounds=True).replace("\n** ", " ").replace("     ", " ")
    assert "k_y = 1e+09, 4e+08 .. inf N/m: best estimate, only the lower end is known" in text
    rigid = fit_of({"k_y": np.inf}, [1.0], ["y"], intervals=lambda probability: {"k_y": (4e8, np.inf)})
    with pytest.raises(ValueError, match="k_y cannot be distinguished from a rigid connection"):
        jf.cards(rigid, "abaqus", NODES)


def test_a_real_fit_and_its_saved_copy_give_the_same_cards(tmp_path):
    freq = np.linspace(0.5, 10, 100)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    h = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]
    fit = jf.identify(freq, jf.pollute(h, 0.01, seed=3), ["x"])
    jf.save(fit, tmp_path / "joint.json")
    again = jf.load(tmp_path / "joint.json")
    assert jf.cards(again, "nastran", NODES) == jf.cards(fit, "nastran", NODES)
