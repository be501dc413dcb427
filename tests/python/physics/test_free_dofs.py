"""Joints with a DOF that is free: found, said, with a bound above; and damping that is not decided."""

import warnings

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.arange(15.0, 801.0, 4.0)
DOFS = ["y", "theta"]


def beams(joint):
    """FRFs at the joint of two beams, (n_freq, 4, 4)."""
    section = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
    a = jf.beam(0.3, 12, ends=("clamped", "free"), **section)
    b = jf.beam(0.225, 9, **section)
    h_a = a.receptance(FREQ, a.index("13:y", "13:theta"))
    h_b = b.receptance(FREQ, b.index("1:y", "1:theta"))
    return jf.couple(h_a, h_b, joint.dynamic_stiffness(FREQ), [0, 1], [0, 1])


def fits(joint, damping, level, count=12):
    exact = beams(joint)
    for seed in range(count):
        with pytest.warns(jf.IdentificationWarning):
            yield jf.identify(FREQ, jf.pollute(exact, level, seed=seed), DOFS, damping=damping)


@pytest.mark.parametrize(
    ("c", "damping", "level"),
    [
        ((20.0, 0.1), "viscous", 0.01),
        pytest.param((20.0, 0.1), "viscous", 0.05, marks=pytest.mark.long),
        pytest.param((0.0, 0.0), "none", 0.01, marks=pytest.mark.long),
    ],
)
def test_a_free_dof_is_found_and_bounded(c, damping, level):
    held = []
    for fit in fits(jf.Joint([6e5, 0.0], c, DOFS), damping, level):
        low, high = fit.confidence_interval()["k_theta"]
        # 1/k of the rigid end of the scale would be 0 here: the structure itself has 1e3 N m/rad around the joint.
        assert 0 <= low < high < 10
        held.append(low == 0)
        if low == 0:
            assert any("k_theta is not significantly different from zero" in one for one in fit.warnings)
        assert fit.value["k_y"] == pytest.approx(6e5, rel=0.02)
        if c[1]:
            assert fit.value["c_theta"] == pytest.approx(c[1], rel=0.05)
    assert np.mean(held) > 0.7


def test_a_soft_dof_is_not_free():
    """30 N m/rad is far softer than the beams, and known."""
    exact = beams(jf.Joint([6e5, 30.0], [20.0, 0.01], DOFS))
    for seed in range(4):
        fit = jf.identify(FREQ, jf.pollute(exact, 0.01, seed=seed), DOFS, damping="viscous")
        low, high = fit.confidence_interval()["k_theta"]
        assert 20 < low < 30.5
        assert 29.5 < high < 40


@pytest.mark.parametrize(
    ("damping", "seeds"),
    [("viscous", (0, 60)), ("auto", (10,)), pytest.param("auto", (0, 1, 2, 27), marks=pytest.mark.long)],
)
def test_a_hinge_has_both_bounds(damping, seeds):
    """Rigid in y and free in theta, as a pin with some friction: 1/k and k are zero in one fit.

    With the FRFs nearest to 10 and 27 for those of the structure, 1/k of y would seem known a million times better; 60
    ends at a compliance so small that nothing of its damping is left.
    """
    exact = beams(jf.Joint([1e11, 0.0], [0.0, 0.1], DOFS))
    for seed in seeds:
        with pytest.warns(jf.IdentificationWarning):
            fit = jf.identify(FREQ, jf.pollute(exact, 0.01, seed=seed), DOFS, damping=damping)
        limits = fit.confidence_interval()
        low, high = limits["k_y"]
        assert 1e6 < low < 1e11
        assert high == np.inf
        low, high = limits["k_theta"]
        assert low == 0
        assert 0.05 < high < 1
        assert any("k_y cannot be distinguished from rigid: at least" in one for one in fit.warnings)
        assert any("k_theta is not significantly different from zero" in one for one in fit.warnings)
        low, high = limits["c_theta"]
        assert low < 0.1 < high
        assert fit.value["c_theta"] == pytest.approx(0.1, rel=0.01)


@pytest.mark.parametrize(
    ("damping", "seeds"),
    [
        pytest.param("none", [(0.01, 0), (0.01, 1), (0.01, 18), (0.01, 21), (0.05, 1)], marks=pytest.mark.long),
        ("viscous", [(0.01, 1)]),
    ],
)
def test_a_pin_without_damping_is_free(damping, seeds):
    """Nothing but noise is in gamma_jk of theta: no joint in compliances is near it, one in k of theta is."""
    exact, held = beams(jf.Joint([1e11, 0.0], [0.0, 0.0], DOFS)), []
    for level, seed in seeds:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fit = jf.identify(FREQ, jf.pollute(exact, level, seed=seed), DOFS, damping=damping)
        limits = fit.confidence_interval()
        assert limits["k_y"][0] < 1e11 < limits["k_y"][1]
        # The beams have 1e3 N m/rad there.
        assert 0 <= limits["k_theta"][0] < limits["k_theta"][1] < 10
        held.append(limits["k_theta"][0] == 0)
    assert any(held)
    assert damping != "none" or limits["k_y"][0] > 1e8


def test_damping_that_is_not_decided_has_the_interval_of_all_kinds():
    """Lines in a narrow band cannot tell viscous from hysteretic damping."""
    freq = np.linspace(4.0, 4.4, 60)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    exact = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]
    fit = jf.identify(freq, jf.pollute(exact, 0.05, seed=1), ["x"])
    assert any("[damping-averaged]" in one for one in fit.notes)
    intervals = fit.confidence_interval()
    low, high = intervals["c_x"]
    assert low <= 0 < 3 < high
    low, high = intervals["h_x"]
    assert low <= 0 < 3 * 2 * np.pi * 4.2 < high
    viscous = jf.identify(freq, jf.pollute(exact, 0.05, seed=1), ["x"], damping="viscous")
    assert viscous.confidence_interval()["c_x"][0] > 0
