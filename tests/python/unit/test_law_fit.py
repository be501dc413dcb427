"""Joints of laws from FRFs between all joint DOFs, without models: `identify(..., joint=...)`."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.describe import poor_laws
from jointfrf.identification.manifold.coordinates import LawCoordinates

FREQ = np.linspace(12, 620, 153)
SECTION = {"density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01, "youngs_modulus": 67e9}
JOINTS = {
    "zener": (
        jf.LawJoint({"y": jf.FractionalZener(2e5, 6e5, 3e-4, 0.7), "theta": jf.SpringLaw(5e3, c=1.5)}),
        jf.LawJoint({"y": jf.FractionalZener(1e4, 1e4, 1e-3, 0.5), "theta": jf.SpringLaw(1e2, c=0.1)}),
    ),
    "rigid": (
        jf.LawJoint({"y": jf.StandardLinearSolid(2e5, 6e5, 5e-4)}, rigid=["theta"]),
        jf.LawJoint({"y": jf.StandardLinearSolid(1e5, 1e5, 1e-3)}, rigid=["theta"]),
    ),
    "cross": (
        jf.LawJoint({
            "y": jf.SpringLaw(6e5, c=20.0), "theta": jf.SpringLaw(5e3, c=1.5),
            ("y", "theta"): jf.SpringLaw(-1e4, c=0.5, is_cross=True),
        }),
        jf.LawJoint({
            "y": jf.SpringLaw(1e5, c=2.0), "theta": jf.SpringLaw(1e3, c=0.5),
            ("y", "theta"): jf.SpringLaw(1.0, c=0.5, is_cross=True),
        }),
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("limits", "code"),
    [
        ((1e5, 4e5), "poorly-determined"),
        ((1.1e5, 2.9e5), ""),
        ((1e5, np.inf), "stiffness-unbounded"),
        ((0.0, 4e5), "stiffness-zero"),
    ],
)
def test_parameters_that_the_data_do_not_determine(limits, code):
    fit = jf.Fit.of_springs("model", ("y",), {"k_y": 2e5}, np.array([[25e8]]), 0.01, 0.01, FREQ)
    found = [one.code for one in poor_laws(fit, {"k_y": True}, lambda name: limits)]
    assert found == ([code] if code else [])


@pytest.fixture(scope="module")
def sides():
    a = jf.beam(0.3, 6, ends=("clamped", "free"), **SECTION)
    b = jf.beam(0.225, 5, **SECTION)
    return a.receptance(FREQ, a.ports("7:y", "7:theta")), b.receptance(FREQ, b.ports("1:y", "1:theta"))


def measured(sides, joint, level, seed):
    return jf.pollute(jf.couple(*sides, joint, [0, 1], [0, 1], freq_hz=FREQ), level, seed=seed)


def fitted(gamma, guess, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jf.identify(FREQ, gamma, joint=guess, **options)


@pytest.mark.parametrize("name", JOINTS)
def test_frfs_nearly_without_noise_give_the_joint(sides, name):
    true, guess = JOINTS[name]
    fit = fitted(measured(sides, true, 1e-5, 1), guess)
    assert fit.is_converged
    assert np.allclose(list(fit.value.values()), true.values, rtol=2e-3)
    assert fit.residual_level == pytest.approx(fit.noise_level, rel=0.15)
    assert fit.joint.rigid == true.rigid


@pytest.mark.parametrize("name", ["rigid", "cross"])
def test_errors_are_those_that_are_said(sides, name):
    """Errors over their standard error have the mean square 1; intervals hold about 95 %."""
    true, guess = JOINTS[name]
    squares, inside = [], []
    for seed in range(6):
        fit = fitted(measured(sides, true, 0.03, seed), guess)
        limits = fit.confidence_interval(0.95)
        for name_, value in zip(true.names, true.values, strict=True):
            squares.append(((fit.value[name_] - value) / fit.std_error[name_]) ** 2)
            inside.append(limits[name_][0] <= value <= limits[name_][1])
    assert 0.4 < np.mean(squares) < 2.2
    assert np.mean(inside) > 0.83


def test_springs_as_laws_are_those_of_the_plain_fit(sides):
    joint = jf.Joint([6e5, 5e3], [20, 1.5], ["y", "theta"])
    gamma = measured(sides, joint, 0.03, 5)
    plain = jf.identify(FREQ, gamma, ["y", "theta"], damping="viscous")
    laws = fitted(gamma, jf.LawJoint.of_joint(jf.Joint([1e5, 1e3], [1, 0.1], ["y", "theta"])))
    for name, value in laws.value.items():
        assert abs(value - plain.value[name]) < 0.3 * plain.std_error[name]
        assert laws.std_error[name] == pytest.approx(plain.std_error[name], rel=0.2)


def test_a_law_that_is_wrong_leaves_more_than_noise(sides):
    true, _ = JOINTS["zener"]
    with pytest.warns(jf.IdentificationWarning):
        fit = jf.identify(FREQ, measured(sides, true, 0.01, 1), joint=jf.LawJoint.of_joint(
            jf.Joint([1e5, 1e3], [1, 0.1], ["y", "theta"])
        ))  # fmt: skip
    assert any("[residual-large]" in text for text in fit.warnings)
    assert any("[frequency-dependent]" in text for text in fit.warnings)


def test_the_derivative_of_the_compliance_is_that_of_differences():
    joint = JOINTS["zener"][0]
    coordinates = LawCoordinates(joint, 2 * np.pi * FREQ, np.array([1e5, 1e3]))
    x = coordinates.coordinates(joint.values)
    slope = coordinates.slope(x, coordinates.compliance(x))
    for i in range(x.size):
        step = 1e-4 * np.eye(x.size)[i]
        ends = [coordinates.compliance(x + n * step) for n in (-2, -1, 1, 2)]
        differences = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step[i])
        assert np.allclose(slope[:, :, i], differences, rtol=1e-7, atol=1e-9 * abs(differences).max())


def test_the_result_in_words_and_numbers(sides):
    true, guess = JOINTS["rigid"]
    fit = fitted(measured(sides, true, 0.02, 3), guess)
    text = str(fit)
    assert "rigid: theta" in text
    assert "tau_y" in text
    assert fit.unit("tau_y") == "s"
    with pytest.raises(ValueError, match=r"unknown parameter 'k_z'; use one of k_y"):
        fit.unit("k_z")  # was StopIteration, which ends a generator without a word
    content = jf.fit_to_dict(fit)
    words = [(law["dof"], law["law"]) for law in content["joint"]["law"]]
    assert words == [("y", "standard-linear-solid"), ("theta", "rigid")]
    assert content["parameters"]["k_y"]["confidence_interval_95"][0] < fit.value["k_y"]
    assert fit.k_lines.shape == (FREQ.size, 2, 2)
    with pytest.raises(ValueError, match="a rigid DOF has no finite stiffness"):
        fit.k_joint(FREQ)
    with pytest.raises(ValueError, match="probability must lie between"):
        fit.confidence_interval(1.0)


def test_dofs_may_stand_in_the_order_of_the_frfs(sides):
    true, guess = JOINTS["cross"]
    gamma = measured(sides, true, 0.02, 4)
    order = [1, 0, 3, 2]
    turned = fitted(gamma[:, order][:, :, order], guess, dofs=["theta", "y"])
    straight = fitted(gamma, guess)
    for name, value in straight.value.items():
        assert turned.value[name] == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize(
    ("joint", "options", "message"),
    [
        (jf.LawJoint({"y": jf.SpringLaw(1.0)}, rigid=["theta"], mass={"y": 0.1}), {}, "joint has a mass in y"),
        (jf.LawJoint({}, rigid=["y", "theta"]), {}, "all DOFs are rigid"),
        (JOINTS["zener"][1], {"dofs": ["y", "z"]}, "dofs must be the DOFs of joint"),
        (JOINTS["zener"][1], {"damping": "viscous"}, "damping and cross do not go with joint"),
        (JOINTS["zener"][1], {"cross": "zero"}, "damping and cross do not go with joint"),
        (jf.LawJoint({"y": jf.SpringLaw(1.0)}), {}, "dofs must name 2"),
    ],
)
def test_what_cannot_be_fitted_is_one_sentence(sides, joint, options, message):
    with pytest.raises(ValueError, match=message):
        jf.identify(FREQ, measured(sides, JOINTS["zener"][0], 0.02, 1), joint=joint, **options)


def test_a_joint_that_is_none_is_named(sides):
    with pytest.raises(TypeError, match="joint must be a LawJoint"):
        jf.identify(FREQ, measured(sides, JOINTS["zener"][0], 0.02, 1), joint=jf.SpringLaw(1.0))
