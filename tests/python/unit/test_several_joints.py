"""Assemblies of several parts and joints: FRFs, derivatives, equal joints, common means, what cannot be separated."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.model.prediction import Prediction, parameter_vector

FEET = {"fl": (-0.3, -0.2, -0.25), "fr": (0.3, -0.2, -0.25), "rl": (-0.3, 0.2, -0.25), "rr": (0.3, 0.2, -0.25)}
POINTS = {**FEET, "top": (0.1, 0.05, 0.25), "side": (0.35, 0.0, 0.0), "front": (0.05, -0.3, 0.1)}
FREQ = np.arange(2.0, 60.0, 0.5)
RESPONSES = [f"machine/{point}:{axis}" for point in ("top", "side", "front") for axis in "xyz"]
FORCES = ["machine/side:x", "machine/front:y", "machine/top:z"]
START = jf.LawJoint({axis: jf.SpringLaw(5e4, h=1e3) for axis in "xyz"})


def machine(joints: dict[str, jf.LawJoint], **groups: object) -> jf.Assembly:
    body = jf.Substructure(jf.rigid_body(60.0, [2.2, 3.0, 3.6], POINTS), exact=True)
    placed = {name: jf.PlacedJoint(one, [f"machine/{name}:{axis}" for axis in "xyz"]) for name, one in joints.items()}
    return jf.Assembly.of_parts({"machine": body}, placed, **groups)


def mount(factors: np.ndarray) -> jf.LawJoint:
    sizes = dict(zip("xyz", np.array([1.2e5, 1.2e5, 3e5]) * factors, strict=True))
    return jf.LawJoint({axis: jf.SpringLaw(k, h=0.1 * k) for axis, k in sizes.items()})


def unequal(seed: int = 3) -> jf.Assembly:
    factors = np.exp(0.1 * np.random.default_rng(seed).standard_normal((4, 3)))
    return machine({name: mount(one) for name, one in zip(FEET, factors, strict=True)})


def fit_of(truth: jf.Assembly, guess: jf.Assembly) -> jf.Fit:
    h = jf.pollute(truth.receptance(FREQ, RESPONSES, FORCES), 0.03, seed=5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they are in the findings
        return jf.identify_model(FREQ, h, guess, RESPONSES, FORCES)


def chains() -> jf.Assembly:
    """Three chains in a ring, one of them on the ground: a loop, a rigid joint, a joint with a mass."""
    parts = {
        "a": jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")),
        "b": jf.Substructure(jf.chain([4, 2], [2000], [2], ground="none")),
        "c": jf.Substructure(jf.chain([1, 2], [900], [1], ground="none")),
    }
    joints = {
        "ab": jf.PlacedJoint(jf.LawJoint({"x": jf.SpringLaw(2000.0, c=3.0)}, mass={"x": 0.4}), ["a/2:x"], ["b/1:x"]),
        "bc": jf.PlacedJoint(jf.LawJoint({}, rigid=["x"]), ["b/2:x"], ["c/1:x"]),
        "ca": jf.PlacedJoint(jf.LawJoint({"x": jf.SpringLaw(700.0, c=1.0)}), ["c/2:x"], ["a/1:x"]),
        "ground": jf.PlacedJoint(jf.LawJoint({"x": jf.SpringLaw(300.0, c=2.0)}), ["b/2:x"]),
    }
    return jf.Assembly.of_parts(parts, joints)


def test_a_ring_with_a_rigid_joint_and_the_ground_is_that_of_its_matrices():
    whole, omega = chains(), 2 * np.pi * np.array([0.7, 3.1, 8.0])
    k, c, m = np.zeros((3, 6, 6))
    for first, part in enumerate(whole.parts.values()):
        own, model = slice(2 * first, 2 * first + 2), part.nominal_model
        for whole_matrix, one in ((k, model.stiffness), (c, model.damping), (m, model.mass)):
            whole_matrix[own, own] += one.toarray()
    for (i, j), (stiff, damp) in {(1, 2): (2000.0, 3.0), (5, 0): (700.0, 1.0)}.items():
        e = np.zeros(6)
        e[i], e[j] = 1, -1
        k += stiff * np.outer(e, e)
        c += damp * np.outer(e, e)
    k[3, 3] += 300.0
    c[3, 3] += 2.0
    m[1, 1] += 0.2
    m[2, 2] += 0.2
    held = np.delete(np.eye(6), 4, axis=1)
    held[4, 3] = 1  # c/1 moves as b/2
    names = [f"{part}/{i}:x" for part in "abc" for i in (1, 2)]
    found = whole.receptance(omega / 2 / np.pi, names, names)
    for w, h in zip(omega, found, strict=True):
        z = held.T @ (k + 1j * w * c - w**2 * m) @ held
        np.testing.assert_allclose(h, held @ np.linalg.inv(z) @ held.T, rtol=1e-10, atol=1e-16)


def test_derivatives_by_all_parameters_equal_and_alike_ones_too():
    whole = machine({name: START for name in FEET}, same=[["fl", "fr"]], alike={"rear": jf.Alike(["rl", "rr"], 0.1)})
    prediction = Prediction(whole, FREQ[::20], RESPONSES, FORCES)
    vector = parameter_vector(whole, ({}, {}), (), prediction.joint_stiffness())
    values = vector.with_means(vector.to_values(vector.to_coordinates(vector.values * 1.3)))
    x = vector.to_coordinates(values)
    _, slopes = prediction.linearised(vector, values)
    by_x = slopes * vector.slope(x)[:, None, None, None]
    for i in range(x.size):
        step = 1e-5 * np.eye(x.size)[i]
        ends = [prediction.frfs(vector, vector.to_values(x + sign * step)) for sign in (1, -1)]
        np.testing.assert_allclose(by_x[i], (ends[0] - ends[1]) / 2e-5, atol=1e-7 * abs(ends[0]).max())
        pulls = [vector.pulls(x + sign * step) for sign in (1, -1)]
        np.testing.assert_allclose(vector.pull_slopes(x)[:, i], (pulls[0] - pulls[1]) / 2e-5, rtol=1e-6, atol=1e-6)


def test_two_parts_by_either_door_are_one_assembly():
    a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"])
    b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"])
    joint = jf.Joint([2000.0], [3.0], dofs=["x"])
    pair = jf.Assembly(a, b, joint)
    parts = jf.Assembly.of_parts({"A": a, "B": b}, {"bolt": jf.PlacedJoint(joint, ["A/2:x"], ["B/1:x"])})
    named = ["A/1:x"], ["B/2:x"]
    np.testing.assert_array_equal(pair.receptance(FREQ, *named), parts.receptance(FREQ, *named))
    assert pair.joint.names == ("k_x", "c_x")
    assert parts.joint.names == ("bolt.k_x", "bolt.c_x")


def test_equal_mounts_have_one_set_of_parameters():
    truth = machine({name: mount(np.ones(3)) for name in FEET})
    fit = fit_of(truth, machine({name: START for name in FEET}, same=[list(FEET)]))
    assert [one.name for one in fit.parameters] == [f"fl.{kind}_{axis}" for axis in "xyz" for kind in "kh"]
    for name, (low, high) in fit.confidence_interval(0.99).items():
        actual = dict(zip(truth.joint.names, truth.joint.values, strict=True))[name]
        assert low < actual < high
        assert high - low < 0.05 * actual
    last = fit.at_point("rr")
    assert last.dofs == ("x", "y", "z")
    assert last.value["k_z"] == fit.value["fl.k_z"]
    np.testing.assert_array_equal(fit.stiffness_matrix[9:, 9:], fit.stiffness_matrix[:3, :3])
    same = jf.fit_from_dict(jf.fit_to_dict(fit))
    assert same.at_point("rr").confidence_interval(0.95) == last.confidence_interval(0.95)
    with pytest.raises(jf.FileContentError, match='"same" is damaged'):
        jf.fit_from_dict(jf.fit_to_dict(fit) | {"same": [["fl", "up"]]})
    assert f"{fit.value['fl.k_z']:.13E}" in jf.cards(last, "abaqus", (1, 2))


def test_mounts_that_are_alike_have_means_and_intervals_that_hold_the_truth():
    truth = unequal()
    fit = fit_of(truth, machine({name: START for name in FEET}, alike={"mounts": jf.Alike(list(FEET))}))
    actual = dict(zip(truth.joint.names, truth.joint.values, strict=True))
    intervals = fit.confidence_interval(0.95)
    assert all(intervals[name][0] < value < intervals[name][1] for name, value in actual.items())
    assert intervals["mounts.k_z"][0] < 3e5 < intervals["mounts.k_z"][1]
    # Vertical stiffnesses are separated, so that their spread does not matter; sideways only sums of two are.
    assert intervals["fl.k_z"][1] / intervals["fl.k_z"][0] < 1.01
    assert intervals["fl.k_x"][1] / intervals["fl.k_x"][0] > 1.2


@pytest.mark.long
def test_mounts_that_are_not_separated_are_named_with_the_sum_that_is_known():
    truth = unequal()
    fit = fit_of(truth, machine({name: START for name in FEET}))
    said = {
        one.about: one.text for one in fit.findings if one.code in ("direction-undetermined", "joints-not-separated")
    }
    assert set(said) == {
        (f"{a}.{kind}_{axis}", f"{b}.{kind}_{axis}")
        for axis, pairs in {"x": [("fl", "fr"), ("rl", "rr")], "y": [("fl", "rl"), ("fr", "rr")]}.items()
        for a, b in pairs
        for kind in "kh"
    }
    total = sum(truth.joints[name].joint.laws["x", "x"].values[0] for name in ("fl", "fr"))
    shown, error = said["fl.k_x", "fr.k_x"].partition("known is fl.k_x + fr.k_x = ")[2].partition(". ")[0].split(" +- ")
    assert abs(float(shown) - total) < 4 * float(error) + 1e-3 * total
    assert float(error) < 0.01 * total


@pytest.mark.parametrize(
    ("groups", "said"),
    [
        ({"same": [["fl", "up"]]}, "there are fl, fr, rl, rr"),
        ({"same": [["fl", "fr"], ["fr", "rl"]]}, "already in a group"),
        ({"alike": {"fl": jf.Alike(["rl", "rr"], 0.1)}}, "a group needs a new name"),
    ],
)
def test_groups_that_are_none(groups, said):
    with pytest.raises(ValueError, match=said):
        machine({name: START for name in FEET}, **groups)


def test_what_is_no_assembly_of_parts():
    with pytest.raises(ValueError, match="two do not show how they scatter"):
        jf.Alike(["a", "b"])
    with pytest.raises(ValueError, match="j names 1 DOFs, the joint has 3"):
        jf.PlacedJoint(START, ["machine/fl:x"])
    part = jf.Substructure(jf.chain([1.0], [], ground="none"))
    spring = jf.Joint([1.0], dofs=["x"])
    with pytest.raises(ValueError, match="no joint has the part b"):
        jf.Assembly.of_parts({"a": part, "b": part}, {"bolt": jf.PlacedJoint(spring, ["a/1:x"])})
    with pytest.raises(ValueError, match="none of a has such a DOF"):
        jf.Assembly.of_parts({"a": part}, {"bolt": jf.PlacedJoint(spring, ["a/2:x"])})
    with pytest.raises(TypeError, match="alike: 'mounts' must be"):
        machine({name: START for name in FEET}, alike={"mounts": ["fl", "fr"]})
    with pytest.raises(ValueError, match="a, b and with_joint need exactly two parts"):
        machine({name: START for name in FEET}).with_joint(START)
    with pytest.raises(TypeError, match="inertia must contain real numbers"):
        jf.rigid_body(1.0, [1.0, "x"], {})
