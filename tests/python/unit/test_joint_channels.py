"""The DOFs of a joint from sensors and impacts around it, and what each channel has to do with rigid motion."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import jointfrf as jf
from hammer_test import FREQ_HZ, JOINT, hammer_test, noisy
from jointfrf.channels.joint_channels import offset_couplings
from jointfrf.io import Channel
from rigid_bodies import DOFS, POINT

NODES_J, NODES_K = [*range(101, 123)], [*range(201, 223)]
J, K = ([node for node in side if node % 100 in (*range(1, 5), *range(11, 23))] for side in (NODES_J, NODES_K))


def sides(frfs, at=POINT, dofs=DOFS, **more):
    return jf.joint_channels(frfs, jf.places_of_nodes(frfs, J, K), at, dofs, **more)


def test_the_joint_comes_back_from_sensors_and_impacts_at_different_places():
    frfs = hammer_test().receptance()
    found = sides(frfs)
    assert len(found.responses.channels) == len(found.forces.channels) == 24
    gamma = found.responses.transform @ found.gamma(frfs) @ found.forces.transform.T
    k = jf.inverse_substructuring(gamma)
    exact = JOINT.dynamic_stiffness(FREQ_HZ)
    size = np.sqrt(abs(np.diagonal(exact, axis1=1, axis2=2)))
    assert abs((k - exact) / size[:, :, None] / size[:, None, :]).max() < 1e-6
    for group in found.agreement(found.gamma(frfs)):
        assert group.rigid == pytest.approx(1, abs=1e-9)
        assert all(one.consistency == pytest.approx(1, abs=1e-9) for one in group.channels)


@pytest.mark.parametrize(("kind", "name"), [("response", "203:+y"), ("excitation", "114:+x")])
def test_the_channel_that_is_wrong_is_to_blame(kind, name):
    frfs = noisy(hammer_test()).receptance()
    channels = frfs.responses if kind == "response" else frfs.excitations
    at = channels.index(Channel.parse(name)) if Channel.parse(name) in channels else None
    at = channels.index(Channel.parse(name).opposite()) if at is None else at
    h = frfs.h.copy()
    h[(slice(None), at) if kind == "response" else (slice(None), slice(None), at)] *= 1.6
    wrong = replace(frfs, h=h)
    found = sides(wrong)
    groups = found.agreement(found.gamma(wrong))
    (guilty,) = [group for group in groups if group.rigid < 0.9999]
    assert (guilty.kind, guilty.side) == (kind, "j" if name[0] == "1" else "k")
    blames = {(one.channel.node, one.channel.axis): one.blame for one in guilty.channels}
    worst = max(blames, key=blames.get)
    assert worst == (Channel.parse(name).node, Channel.parse(name).axis)
    assert blames[worst] > 0.9


def test_one_channel_both_ways_is_one():
    """A sensor along +z and a hammer along -z at one node: one place, found with its signs."""
    frfs = hammer_test()
    ends = (Channel(1, "+z"), Channel(2, "+z"))
    hits = tuple(channel.opposite() for channel in ends)
    small = replace(frfs, responses=ends, excitations=hits, h=frfs.h[:, :2, :2], coordinates={1: POINT, 2: POINT})
    found = jf.joint_channels(small, jf.places_of_nodes(small, [1], [2]), POINT, ["z"])
    assert found.responses is found.forces
    np.testing.assert_array_equal(found.gamma(small), -small.h)


def test_dofs_left_out_are_named():
    frfs = hammer_test().receptance()
    found = sides(frfs, at=POINT + np.array([0, 0.006, 0]), dofs=["x", "y", "z"])
    reported = {(one.dof, one.into) for one in found.left_out(found.gamma(frfs)) if one.matters}
    assert any(dof.startswith("theta") for dof, _ in reported)


def test_two_reference_points():
    frfs = hammer_test().receptance()
    found = sides(frfs, at_k=POINT + np.array([0, 0.01, 0]))
    np.testing.assert_allclose(found.responses.references[1] - found.responses.references[0], [0, 0.01, 0])
    reported = [str(one) for one in offset_couplings(found.responses)]
    assert reported == [
        "the offset between the reference points couples z with theta_x: 10 mm",
        "the offset between the reference points couples x with theta_z: -10 mm",
    ]


def test_what_is_wrong_is_said():
    frfs = hammer_test().receptance()
    places = jf.places_of_nodes(frfs, J, K)
    with pytest.raises(ValueError, match="channel 101:\\+x has no side"):
        jf.joint_channels(frfs, [replace(places[0], side=None), *places[1:]], POINT)
    with pytest.raises(ValueError, match=r"table: .* has no response 999:\+x"):
        jf.joint_channels(
            frfs, [*places, replace(places[0], channel=Channel(999, "x"), role="response", where="table")], POINT
        )
    with pytest.raises(ValueError, match="is listed twice as response"):
        jf.joint_channels(frfs, [*places, places[0]], POINT)
    bare = replace(frfs, coordinates={})
    with pytest.raises(ValueError, match=r"^node 101 has no coordinates in "):
        jf.joint_channels(bare, places, POINT)
    with pytest.raises(ValueError, match=r"^channels\.csv, line 2: node 101 has no coordinates in "):
        jf.joint_channels(bare, [replace(place, where="channels.csv, line 2") for place in places], POINT)
    few = [place for place in places if place.channel.node not in (101, 102, 103)]
    with pytest.raises(ValueError, match=r"responses of side j .*too few for 6 DOFs"):
        jf.joint_channels(frfs, few, POINT)
    with pytest.raises(ValueError, match="side k of the joint has no responses"):
        jf.joint_channels(frfs, [place for place in places if place.side == "j"], POINT)
    with pytest.raises(ValueError, match="node 101 is named on both sides"):
        jf.places_of_nodes(frfs, [101], [101])
    with pytest.raises(ValueError, match="node 5 has no channel"):
        jf.places_of_nodes(frfs, [5], [101])


def test_a_coupled_joint_of_few_lines_is_fitted_without_going_to_and_fro():
    """NormalEquations where it ended last, the fit of 42 terms to 123 lines jumped between two points."""
    frfs = noisy(hammer_test()).receptance()
    found = sides(frfs)
    transforms = (found.responses, found.forces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        warnings.simplefilter("ignore", jf.ConvergenceWarning)
        fit = jf.identify(FREQ_HZ, found.gamma(frfs), transform=transforms, damping="viscous", cross="fit")
    assert not any("[not-converged]" in warning for warning in fit.warnings)
    error = np.array([fit.value[f"k_{dof}"] for dof in DOFS]) / JOINT.stiffness.diagonal() - 1
    assert abs(error).max() < 0.02


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 5])
def test_a_coupled_joint_that_noise_half_hides_is_found_and_holds(seed):
    """Of lines alone k_theta_x begins 700 times too stiff; near the end steps lead to and fro in a flat direction.

    What the inertia of the sides adds to k_theta_x comes from lines whose own noise is up to 100 times the compliance:
    whether its interval is as wide as the value depends on the draw.
    """
    frfs = noisy(hammer_test(), seed=seed).receptance()
    found = jf.joint_channels(frfs, jf.places_of_nodes(frfs, J, K), POINT, DOFS)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"k_theta_x .*\[poorly-determined\]$", jf.IdentificationWarning)
        fit = jf.identify(frfs.freq_hz, found.gamma(frfs), transform=(found.responses, found.forces), cross="fit")
    assert fit.is_converged
    assert not [one for one in fit.findings if one.code in {"residual-large", "lines-rejected", "not-converged"}]
    assert np.array([fit.value[f"k_{dof}"] for dof in DOFS]) == pytest.approx(JOINT.stiffness.diagonal(), rel=0.1)
    intervals = fit.confidence_interval(0.99)
    for dof, k, c in zip(DOFS, JOINT.stiffness.diagonal(), JOINT.damping.diagonal(), strict=True):
        for name, true in ((f"k_{dof}", k), (f"c_{dof}", c)):
            if name in intervals:
                assert intervals[name][0] <= true <= intervals[name][1], name
