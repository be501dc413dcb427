"""Laws of joints: K*(w) and its derivatives, what joints are made of them, coupling through them, cards."""

from importlib import import_module
from itertools import pairwise

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.laws import words

OMEGA = 2 * np.pi * np.linspace(5, 900, 60)
LAWS = {
    "viscous": jf.SpringLaw(6e5, c=20.0),
    "hysteretic": jf.SpringLaw(6e5, h=3e4),
    "both": jf.SpringLaw(6e5, c=20.0, h=3e4),
    "undamped": jf.SpringLaw(6e5, damping="none"),
    "solid": jf.StandardLinearSolid(1e5, 3e5, 4e-4),
    "zener": jf.FractionalZener(1e5, 8e5, 2e-4, 0.6),
    "power": jf.PowerLaw(1e5, 5e4, 0.4, 50.0),
    "own": jf.FunctionLaw(
        lambda w, v: v[0] * (1 + v[1] * np.sqrt(1j * w)),
        lambda w, v: np.array([1 + v[1] * np.sqrt(1j * w), v[0] * np.sqrt(1j * w)]),
        [("k", "stiffness", 0, np.inf), ("b", "number", 0, 1)],
        [2e5, 0.01],
    ),
}


def test_words_of_laws_are_those_of_their_classes():
    for word, (module, name) in words.LAWS.items():
        assert getattr(import_module(f"jointfrf.laws.{module}"), name).word == word


@pytest.mark.parametrize("name", LAWS)
def test_derivatives_are_those_of_the_stiffness(name):
    """Central differences of the fourth order."""
    law = LAWS[name]
    for i, value in enumerate(law.values):
        step = 1e-3 * (value or 1.0) * np.eye(len(law.values))[i]
        moved = [law.with_values(law.values + n * step).stiffness(OMEGA) for n in (-2, -1, 1, 2)]
        slope = (moved[0] - 8 * moved[1] + 8 * moved[2] - moved[3]) / (12 * step[i])
        assert np.allclose(law.slopes(OMEGA)[i], slope, rtol=1e-8, atol=1e-9 * abs(slope).max())


@pytest.mark.parametrize("name", LAWS)
def test_a_start_from_exact_lines_reproduces_them(name):
    law = LAWS[name]
    wrong = law.with_values([v * 3 if field.is_factor else v for v, field in zip(law.values, law.fields, strict=True)])
    k = law.stiffness(OMEGA)
    found = wrong.started(OMEGA, np.where(np.arange(OMEGA.size) % 7 == 3, np.nan, k))
    assert abs(found.stiffness(OMEGA) - k).max() < 0.15 * abs(k).max()


def test_a_zener_of_order_one_is_the_standard_linear_solid():
    both = [
        law.stiffness(OMEGA) for law in (jf.StandardLinearSolid(1e5, 3e5, 4e-4), jf.FractionalZener(1e5, 3e5, 4e-4, 1))
    ]
    assert np.allclose(*both, rtol=1e-12)


def test_stiffness_and_loss_factor_of_rubber_rise_with_frequency():
    k = LAWS["zener"].stiffness(2 * np.pi * np.linspace(1, 80, 50))
    assert (np.diff(k.real) > 0).all()
    assert (np.diff(k.imag / k.real) > 0).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: jf.SpringLaw(-1.0), "k of SpringLaw must lie in 0 to inf, not -1"),
        (lambda: jf.SpringLaw(1.0, c=2.0, damping="none"), "c is 2, but damping is 'none'"),
        (lambda: jf.FractionalZener(1, 1, 1, 1.5), "alpha of FractionalZener must lie in 0.001 to 1, not 1.5"),
        (lambda: jf.PowerLaw(1, 1, 0.5, 0.0), "reference_hz must be positive"),
        (lambda: jf.StandardLinearSolid(1, float("nan"), 1), "k_m"),
        (lambda: jf.LawJoint({"y": jf.SpringLaw(1.0)}, rigid=["y"]), "every DOF must have one law or be rigid"),
        (lambda: jf.LawJoint({"y": jf.SpringLaw(1.0), ("y", "x"): jf.SpringLaw(1.0)}), "the cross term y,x must be"),
        (lambda: jf.LawJoint({"y": jf.SpringLaw(1.0)}, mass={"x": 1.0}), "mass names 'x'"),
        (lambda: jf.LawJoint({"y": jf.SpringLaw(1.0)}, mass={"y": -1.0}), "must not be negative"),
        (
            lambda: jf.FunctionLaw(
                lambda w, v: v[0] + 0j * w, lambda w, v: 2 + 0j * w[None], [("k", "stiffness")], [1.0]
            ),
            "that by k is not the derivative",
        ),
    ],
)
def test_what_is_wrong_is_one_sentence(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def beams(freq):
    steel = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
    a, b = jf.beam(0.3, 6, ends=("clamped", "free"), **steel), jf.beam(0.225, 5, **steel)
    return a, b, a.receptance(freq), b.receptance(freq)


def test_coupling_through_laws_is_coupling_through_their_stiffness():
    freq = np.linspace(10, 800, 40)
    joint = jf.LawJoint(
        {"y": LAWS["zener"], "theta": LAWS["both"], ("y", "theta"): jf.SpringLaw(-300.0, is_cross=True)}
    )
    a, b, h_a, h_b = beams(freq)
    at = a.index("7:y", "7:theta"), b.index("1:y", "1:theta")
    found = jf.couple(h_a, h_b, joint, *at, freq_hz=freq)
    assert np.array_equal(found, jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), *at))
    with pytest.raises(ValueError, match="freq_hz is missing"):
        jf.couple(h_a, h_b, joint, *at)


def test_rigid_dofs_and_masses_couple_as_matrices_do():
    """Against one model: the rigid DOF eliminated, half of the mass added on either side."""
    freq = np.linspace(10, 800, 40)
    a, b, h_a, h_b = beams(freq)
    joint = jf.LawJoint({"theta": jf.SpringLaw(5e3, c=1.5)}, rigid=["y"], mass={"y": 0.04}, dofs=["y", "theta"])
    at_a, at_b = a.index("7:y", "7:theta"), b.index("1:y", "1:theta")
    found = jf.couple(h_a, h_b, joint, at_a, at_b, freq_hz=freq)
    whole = jf.assemble(a, b, jf.Joint([0.0, 5e3], [0.0, 1.5]), at_a, at_b)
    k, m, c, h = (
        np.asarray(x.toarray()) for x in (whole.stiffness, whole.mass, whole.damping, whole.structural_damping)
    )
    n_a, n = len(a.dofs), len(whole.dofs)
    j, other = at_a[0], n_a + at_b[0]
    m[j, j] += 0.02
    m[other, other] += 0.02
    t = np.eye(n)
    t[other, j] = 1
    t = np.delete(t, other, axis=1)
    reduced = [t.T @ x @ t for x in (k, m, c, h)]
    exact = t @ jf.receptance(freq, reduced[0], reduced[1], reduced[2], structural_damping=reduced[3]) @ t.T
    assert np.allclose(found, exact, rtol=1e-7, atol=1e-9 * abs(exact).max())
    with pytest.raises(ValueError, match="a rigid DOF has no finite stiffness"):
        joint.dynamic_stiffness(freq)
    assert np.allclose(joint.compliance(freq)[:, 0], 0)


def test_a_joint_of_laws_names_and_changes_its_parameters():
    joint = jf.LawJoint({"y": LAWS["solid"], "theta": LAWS["viscous"]}, mass={"y": 0.1})
    assert joint.names == ("k_y", "k_m_y", "tau_y", "k_theta", "c_theta", "m_y")
    assert [one.unit for one in joint.quantities] == ["N/m", "N/m", "s", "N m/rad", "N m s/rad", "kg"]
    assert np.array_equal(joint.with_values(2 * joint.values).values, 2 * joint.values)


def test_a_joint_of_matrices_is_one_of_laws():
    joint = jf.Joint([[6e5, -20], [-20, 5e3]], [20, 1.5], ["y", "theta"], loss_factor=[0.1, 0.0])
    same = jf.LawJoint.of_joint(joint)
    assert np.allclose(same.dynamic_stiffness([3.0, 70.0]), joint.dynamic_stiffness([3.0, 70.0]))
    back = same.constant_joint()
    for name in ("stiffness", "damping", "hysteretic_stiffness"):
        assert np.allclose(getattr(back, name), getattr(joint, name))


def test_cards_say_what_they_cannot_represent():
    mount = jf.LawJoint({"y": LAWS["zener"]}, rigid=["x", "z"], mass={"x": 0.3, "y": 0.3, "z": 0.3})
    with pytest.raises(ValueError, match="FractionalZener of y depends on frequency; state one frequency by freq_hz"):
        mount.export("abaqus", (1, 2))
    text = mount.export("abaqus", (1, 2), freq_hz=120.0)
    k = LAWS["zener"].stiffness(2 * np.pi * np.array([120.0]))[0]
    assert f"{k.real:.13E}, {k.imag:.13E}" in text
    assert text.startswith("** FractionalZener of y at 120 Hz")
    assert text.count("*EQUATION\n2\n1, 1, 1., 2, 1, -1.") == 1
    assert text.count(f"{0.15:.13E}") == 2
    text = mount.export("nastran", (1, 2), freq_hz=9.0)
    first, second = text[text.index("MPC*") :].splitlines()[:2]
    assert (first.split(), second.split()) == (["MPC*", "1", "1", "11.000000000000+0"], ["*", "2", "1-1.00000000000+0"])
    assert "CE,NEXT,0,1,UX,1,2,UX,-1" in mount.export("ansys", (1, 2), freq_hz=9.0, damping=False)
    with pytest.raises(ValueError, match="calculix has rotations at ROT NODEs"):
        jf.LawJoint({}, rigid=["theta_x"]).export("calculix", (1, 2))
    turning = jf.LawJoint({}, rigid=["y", "theta_x"]).export(
        "calculix", (1, 2), rotation_nodes=(3, 4), faces=([5], [6])
    )
    assert turning.count("*EQUATION\n2\n3, 1, 1., 4, 1, -1.") == turning.count("\n1, 2, 1., 2, 2, -1.") == 1
    assert "*NSET, NSET=JOINT1_J\n5\n*RIGID BODY, NSET=JOINT1_J, REF NODE=1, ROT NODE=3\n" in turning
    with pytest.raises(ValueError, match="a point mass is the same in all directions"):
        jf.LawJoint({}, rigid=["x", "y"], mass={"x": 1.0, "y": 2.0}).export("abaqus", (1, 2))
    with pytest.raises(ValueError, match="a mass in y"):
        jf.LawJoint({"y": LAWS["viscous"]}, mass={"y": 1.0}).constant_joint()


def test_elements_of_cards_have_different_numbers():
    joint = jf.LawJoint({"y": LAWS["viscous"]}, mass={"x": 0.3, "y": 0.3, "z": 0.3}, rigid=["x", "z"])
    lines = joint.export("abaqus", (1, 2), element=7).splitlines()
    numbers = [line.split(",")[0] for before, line in pairwise(lines) if before.startswith("*ELEMENT")]
    assert len(numbers) == len(set(numbers)) == 4
    assert numbers[0] == "7"


def test_matrices_of_an_assembly_hold_springs_and_masses_of_laws():
    """Against coupling of the FRFs."""
    freq = np.array([1.0, 2.9, 6.0])
    a, b = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    joint = jf.LawJoint({"x": jf.SpringLaw(2000.0, c=3.0, h=50.0)}, mass={"x": 0.4})
    whole = jf.assemble(a, b, joint, [1], [0]).receptance(freq)
    coupled = jf.couple(a.receptance(freq), b.receptance(freq), joint, [1], [0], freq_hz=freq)
    assert np.allclose(whole, coupled, rtol=1e-9)
    for other, message in (
        (jf.LawJoint({"x": LAWS["zener"]}), "a FractionalZener depends on frequency"),
        (jf.LawJoint({}, rigid=["x"]), "x is rigid"),
    ):
        with pytest.raises(ValueError, match=message):
            jf.assemble(a, b, other, [1], [0])


def test_cards_of_springs_take_positions_and_those_of_masses_do_not():
    arms = {"positions": [[0, 0, 0], [0, 0, 0.01]], "points": [0, 0, 0.005]}
    springs = jf.LawJoint({"y": LAWS["viscous"]})
    assert springs.export("nastran", (1, 2), **arms) == springs.constant_joint().export("nastran", (1, 2), **arms)
    with pytest.raises(ValueError, match="leave positions out"):
        jf.LawJoint({"y": LAWS["viscous"]}, mass={"y": 1.0}).export("nastran", (1, 2), **arms)
