"""Several joint points at once: K* in blocks, each its own or equal, against truth and bound."""

import json

import numpy as np
import pytest
from scipy import stats
from trials import Trial

import jointfrf as jf
from cramer_rao import cramer_rao
from jointfrf.dofs import parameters_shared
from jointfrf.identification.manifold.coordinates import joint_terms

FREQ = np.linspace(20, 1500, 149)
DOFS = ("bolt1.y", "bolt1.theta_z", "bolt2.y", "bolt2.theta_z")
ONE, ETA, NOISE = np.array([[4e5, 600.0], [600.0, 40.0]]), 0.03, 0.01


def assembly(k_joint):
    """FRFs at both bolts of two beams that bend between them."""
    section = dict(youngs_modulus=70e9, density=2700.0, width=0.03, height=0.004, loss_factor=0.01)
    a, b = jf.beam(0.36, 24, **section), jf.beam(0.30, 20, **section)
    h_a = a.receptance(FREQ, a.ports("15:y", "15:theta", "23:y", "23:theta"))
    h_b = b.receptance(FREQ, b.ports("3:y", "3:theta", "11:y", "11:theta"))
    return jf.couple(h_a, h_b, k_joint, range(4), range(4))


def bolts(share):
    """Springs of two bolts, the second with a share of the stiffness of the first."""
    k = np.zeros((4, 4))
    k[:2, :2], k[2:, 2:] = ONE, share * ONE
    return jf.Joint(k, dofs=DOFS, structural_damping=ETA * k)


def truth(joint, one):
    a, b = DOFS.index(one.row), DOFS.index(one.column)
    return {"k": joint.stiffness, "h": joint.hysteretic_stiffness}[one.kind][a, b]


def count_inside(fit, joint):
    limits = fit.confidence_interval(0.95)
    return sum(limits[one.name][0] <= truth(joint, one) <= limits[one.name][1] for one in fit.parameters)


def bound(joint, gamma, same=()):
    """Standard errors by the Cramer-Rao bound, by differences, with points that share parameters."""
    terms = joint_terms(2 * np.pi * FREQ, DOFS, "hysteretic", "points")
    names = [one.name for one in terms.parameters]
    information = np.linalg.inv(cramer_rao(gamma, joint.dynamic_stiffness(FREQ), terms)) / NOISE**2
    shared = parameters_shared(names, same)
    fold = np.eye(shared.max() + 1)[shared]
    return dict(zip(names, np.sqrt(np.diag(fold @ np.linalg.inv(fold.T @ information @ fold) @ fold.T)), strict=True))


@pytest.fixture(scope="module")
def own():
    joint = bolts(0.7)
    gamma = assembly(joint.dynamic_stiffness(FREQ))
    options = dict(dofs=DOFS, cross="points", damping="hysteretic")
    return joint, gamma, jf.identify(FREQ, jf.pollute(gamma, NOISE, seed=1), **options)


def test_each_point_has_its_block_and_nothing_couples_them(own):
    joint, gamma, fit = own
    assert [one.name for one in fit.parameters][:6] == [
        "bolt1.k_y", "bolt1.k_theta_z", "bolt2.k_y", "bolt2.k_theta_z", "bolt1.k_y,theta_z", "bolt2.k_y,theta_z",
    ]  # fmt: skip
    assert not fit.stiffness_matrix[:2, 2:].any()
    assert count_inside(fit, joint) >= 11
    np.testing.assert_allclose(fit.stiffness, np.diag(joint.stiffness), rtol=0.01)
    expected = bound(joint, gamma)
    for name, error in fit.std_error.items():
        assert error == pytest.approx(expected[name], rel=0.3)


@pytest.mark.parametrize("cross", ["points", "zero"])
def test_equal_points_share_what_both_say(cross):
    joint = bolts(1.0) if cross == "points" else jf.Joint([4e5, 40.0] * 2, dofs=DOFS, loss_factor=ETA)
    gamma = assembly(joint.dynamic_stiffness(FREQ))
    noisy, same = jf.pollute(gamma, NOISE, seed=2), ["bolt1", "bolt2"]
    fit = jf.identify(FREQ, noisy, DOFS, cross=cross, damping="hysteretic", same=same)
    for name, value in fit.value.items():
        assert value == fit.value[name.replace("bolt2", "bolt1")]
    own = [one for one in fit.parameters if one.name.startswith("bolt1.")]
    squares = sum((fit.value[one.name] - truth(joint, one)) ** 2 / fit.std_error[one.name] ** 2 for one in own)
    assert squares < stats.chi2.ppf(0.999, len(own))
    assert any(one.code == "equal-points" and one.about == ("bolt1", "bolt2") for one in fit.findings)
    if cross == "points":
        expected = bound(joint, gamma, [same])
        for name, error in fit.std_error.items():
            assert error == pytest.approx(expected[name], rel=0.3)
        # The damping that is true is chosen for both, and nothing else moves.
        chosen = jf.identify(FREQ, noisy, DOFS, cross=cross, same=[same])
        assert {one.kind for one in chosen.parameters} == {"k", "h"}
        assert chosen.value == pytest.approx(fit.value, rel=1e-3)


def test_equal_points_with_laws_that_change_with_frequency():
    law = {"y": jf.StandardLinearSolid(3e5, 2e5, 5e-4), "theta_z": jf.SpringLaw(40.0, h=2.0)}
    laws = {f"{point}.{dof}": one for point in ("bolt1", "bolt2") for dof, one in law.items()}
    joint = jf.LawJoint(laws)
    gamma = jf.pollute(assembly(joint.dynamic_stiffness(FREQ)), NOISE, seed=3)
    guess = jf.LawJoint({
        dof: jf.StandardLinearSolid(1e5, 1e5, 1e-3) if dof.endswith(".y") else jf.SpringLaw(100.0, h=1.0)
        for dof in laws
    })  # fmt: skip
    alone, both = (jf.identify(FREQ, gamma, joint=guess, same=same) for same in (None, ["bolt1", "bolt2"]))
    assert both.laws.names == joint.names
    limits = both.confidence_interval(0.95)
    for name, value, true in zip(joint.names, both.laws.values, joint.values, strict=True):
        assert value == both.value[name] == both.value[name.replace("bolt2", "bolt1")]
        assert limits[name][0] < true < limits[name][1]
        assert both.std_error[name] < 0.9 * alone.std_error[name]


def test_laws_with_cross_terms_find_their_springs():
    joint = bolts(0.7)
    gamma = jf.pollute(assembly(joint.dynamic_stiffness(FREQ)), NOISE, seed=4)
    laws = {dof: jf.SpringLaw(1e7, h=1.0) for dof in DOFS}
    laws |= {(f"{p}.y", f"{p}.theta_z"): jf.SpringLaw(0.0, h=1.0, is_cross=True) for p in ("bolt1", "bolt2")}
    fit = jf.identify(FREQ, gamma, joint=jf.LawJoint(laws))
    springs = jf.identify(FREQ, gamma, DOFS, cross="points", damping="hysteretic")
    assert fit.value == pytest.approx({name: springs.value[name] for name in fit.value}, rel=1e-3)


def test_a_point_alone_and_files(own, tmp_path):
    _, _, fit = own
    point = fit.at_point("bolt2")
    assert fit.points == ("bolt1", "bolt2")
    assert point.points == ()
    assert point.dofs == ("y", "theta_z")
    np.testing.assert_array_equal(point.stiffness_matrix, fit.stiffness_matrix[2:, 2:])
    assert point.confidence_interval(0.9)["k_y,theta_z"] == fit.confidence_interval(0.9)["bolt2.k_y,theta_z"]
    assert point.loss_factors["eta_y"] == fit.loss_factors["bolt2.eta_y"]
    read = jf.load(jf.save(fit, tmp_path / "bolts.json"))
    assert read.points == fit.points
    assert read.at_point("bolt2").value == point.value
    text = jf.cards(fit, "nastran", {"bolt1": (11, 12), "bolt2": (21, 22)})
    names = [line.split()[1] for line in text.splitlines() if line.startswith("DMIG ")]
    assert len(set(names)) == len(names) == 4
    assert jf.cards(point, "nastran", (21, 22)).splitlines()[-1] == text.splitlines()[-1]
    with pytest.raises(ValueError, match=r"nodes must map each joint point, bolt1, bolt2, to its nodes"):
        jf.cards(fit, "nastran", (11, 12))
    with pytest.raises(ValueError, match=r"there is no joint point 'bolt3', only bolt1, bolt2"):
        fit.at_point("bolt3")
    json.dumps(jf.fit_to_dict(fit), allow_nan=False)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (dict(dofs=["y", "a", "b", "c"], cross="points"), 'cross "points" needs DOFs of points, such as "bolt1.y"'),
        (dict(same=["bolt1", "bolt3"]), "same names 'bolt3', which is no point of a DOF"),
        (dict(same=["bolt1"]), "same must name at least two points, each once"),
        (dict(same=["bolt1", "bolt2"], cross="ignore"), 'cross "ignore" does not go with it'),
        (dict(same=["bolt1", "bolt2"], damping=["none", "none", "both", "none"]), "must have the same DOFs and terms"),
    ],
)
def test_what_does_not_go_together_is_one_sentence(own, options, message):
    with pytest.raises(ValueError, match=message):
        jf.identify(FREQ, own[1], **{"dofs": DOFS, **options})


def test_equal_points_that_no_frf_connects_are_refused():
    beam = jf.beam(0.3, 6, youngs_modulus=70e9, density=2700.0, width=0.03, height=0.004, loss_factor=0.01)
    h = beam.receptance(FREQ, beam.ports("7:y"))
    one = jf.couple(h, 2 * h, np.full((FREQ.size, 1, 1), 1e5 + 3e3j), [0], [0])
    gamma = np.zeros((FREQ.size, 4, 4), complex)
    for i in (0, 1):
        gamma[:, i::2, i::2] = one
    with pytest.raises(ValueError, match=r"FRFs between equal points are zero, so that a.k_y, .* separate problems"):
        jf.identify(FREQ, jf.pollute(gamma, 0.01, seed=1), ["a.y", "b.y"], same=["a", "b"], damping="hysteretic")


def test_where_single_lines_lead_nowhere_the_joint_without_cross_terms_is_near_enough():
    # Noise hides the motion across a stiff joint on every line: starts from C of lines end at 20 times the noise.
    trial = Trial("two bolts", "complex", 0.01, cross="points", damping="hysteretic", kind="hysteretic")
    freq, gamma, joint = trial.draw(76)
    own = [i for i, dof in enumerate(joint.dofs) if dof.endswith((".x", ".theta_y", ".theta_z"))]
    at = np.r_[own, np.add(own, len(joint.dofs))]
    dofs = [joint.dofs[i] for i in own]
    fit = jf.identify(freq, gamma[:, at[:, None], at], dofs, damping="hysteretic", cross="points")
    assert fit.residual_level < 1.05 * fit.noise_level
    assert not fit.warnings
    for point, share in (("bolt1", 1), ("bolt2", 0.7)):
        assert fit.value[f"{point}.k_x"] == pytest.approx(share * 4e6, rel=0.01)
        assert fit.value[f"{point}.k_x,theta_y"] == pytest.approx(share * 0.2 * np.sqrt(4e6 * 500), rel=0.2)
