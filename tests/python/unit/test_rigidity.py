"""What is not rigid between channels: transforms without a channel, deformation found back, DOFs that are left out."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.joint_channels import left_out_dofs
from jointfrf.identification.manifold.transforms import (
    ChannelModes,
    deformation_compliance,
    deformation_variance,
    left_out,
    modes_of,
)
from rigid_bodies import AROUND, BODY_A, BODY_B, DOFS, POINT, along, triaxial

FREQ = np.linspace(20.0, 200.0, 30)


def channels_of(weights=None):
    sides = [jf.virtual_point(*triaxial(p), POINT, weights=weights) for p in (POINT + AROUND, POINT - 0.8 * AROUND)]
    return sides, jf.virtual_interface(*sides)


def rigid_frfs():
    """Of two bodies that are not connected."""
    h = np.zeros((FREQ.size, 24, 24), complex)
    for body, places, rows in (
        (BODY_A, POINT + AROUND, slice(12)),
        (BODY_B, POINT - 0.8 * AROUND, slice(12, 24)),
    ):
        channels = along(*triaxial(places))
        h[:, rows, rows] = body.receptance(FREQ, channels, channels)
    return h


@pytest.mark.parametrize("weighted", [False, True])
def test_a_channel_left_out_is_least_squares_without_it(weighted):
    weights = np.linspace(0.5, 2, 12) if weighted else np.ones(12)
    _, interface = channels_of(weights)
    for channel, one in enumerate(left_out(ChannelModes(interface.transform, interface.modes))):
        keep = weights.copy()
        if channel < 12:
            keep[channel] = 0
            expected = jf.virtual_point(*triaxial(POINT + AROUND), POINT, weights=keep).transform
            np.testing.assert_allclose((interface.transform + one.change)[:6, :12], expected, rtol=1e-8, atol=1e-9)


def test_channels_that_no_other_replaces_are_not_left_out():
    """Of three points the middle alone shows the displacement; the outer ones can be replaced."""
    places = {i: (0.01 * i, 0, 0) for i in (1, 2, 3)} | {i + 3: (0.01 * i, 0, 0.1) for i in (1, 2, 3)}
    sides = jf.interface([1, 2, 3], [4, 5, 6], ["y", "theta_z"], places)
    np.testing.assert_allclose(sides.transform @ sides.modes, np.eye(4), atol=1e-12)
    found = list(left_out(ChannelModes(sides.transform, sides.modes)))
    assert [one.redundancy for one in found] == pytest.approx([0.5] * 4)
    # Without the first, the slope is that of the other two.
    np.testing.assert_allclose((sides.transform + found[0].change)[1, :3], [0, -100, 100], atol=1e-9)
    two = jf.interface([1, 3], [4, 6], ["y", "theta_z"], places)
    assert not list(left_out(ChannelModes(two.transform, two.modes)))


def test_rigid_bodies_show_no_deformation():
    _, interface = channels_of()
    h, modes = rigid_frfs(), ChannelModes(interface.transform, interface.modes)
    assert deformation_variance(h, modes, modes).max() < 1e-20 * abs(h).max() ** 2
    np.testing.assert_allclose(modes_of(interface.transform, h), interface.modes, atol=1e-12)


def test_a_compliance_of_every_channel_is_found_back():
    """Bodies whose channels sit on springs of one compliance each, noise of lines far apart in size."""
    sides, interface = channels_of()
    rng = np.random.default_rng(1)
    modes = ChannelModes(interface.transform, interface.modes)
    springs = 3e-9
    h = rigid_frfs() + springs * np.eye(24)
    level = np.where(np.arange(FREQ.size) % 2, 1e-10, 1e-7)[:, None, None]
    h = h + level * (rng.standard_normal(h.shape) + 1j * rng.standard_normal(h.shape))
    found = deformation_compliance(h, np.broadcast_to(2 * level**2, h.shape), modes, modes)
    expected = springs * sum((side.transform**2).sum(axis=1) for side in sides)
    np.testing.assert_allclose(found, expected, rtol=0.02)
    exact = deformation_variance(rigid_frfs() + springs * np.eye(24), modes, modes)
    # Residual of an independent error: its mean square over the entries is that of the error, in rows and in columns.
    assert exact[:, :12, :12].sum(axis=(1, 2)).mean() == pytest.approx(2 * 12 * springs**2, rel=1e-6)


def test_of_channels_that_do_not_check_each_other_nothing_is_said():
    t = np.eye(4)
    modes = ChannelModes(t, t)
    assert deformation_compliance(np.ones((3, 4, 4), complex), np.ones((3, 4, 4)), modes, modes) is None


def test_modes_of_a_matrix_that_channels_do_not_follow_are_not_taken():
    """The outer points of a central difference move with the middle, which their weights alone do not tell."""
    places = {i: (0.01 * i, 0, 0) for i in (1, 2, 3)} | {i + 3: (0.01 * i, 0, 0.1) for i in (1, 2, 3)}
    sides = jf.interface([1, 2, 3], [4, 5, 6], ["y", "theta_z"], places)
    motion = sides.modes @ np.random.default_rng(0).standard_normal((5, 4, 3))
    motion = motion + sides.modes[:, ::2].sum(axis=1)[None, :, None] * 5
    assert modes_of(sides.transform, motion) is None
    assert modes_of(np.ones((2, 4)), motion[:, :4]) is None


def test_an_offset_takes_a_rotation_for_a_displacement():
    """Sensors 6 mm above the point show x - 0.006 theta_z; a DOF that is not in their way is not named."""
    places = {1: (-0.01, 0.006, 0), 2: (0.01, 0.006, 0)}
    positions, directions = jf.channel_geometry(["1:x", "2:x", "1:y", "2:y"], places)
    side = jf.virtual_point(positions[:2], directions[:2], [0, 0, 0], ["x"])
    interface = jf.virtual_interface(side, side)
    found = left_out_dofs(np.ones((3, 4, 4), complex), interface)
    assert {(one.side, one.dof, one.into) for one in found} == {("j", "theta_z", "x"), ("k", "theta_z", "x")}
    assert found[0].weight == pytest.approx(-0.006)
    assert np.isnan(found[0].share)
    whole = [jf.virtual_point(positions, directions, [0, 0, 0], dofs) for dofs in (["x", "y"], ["x", "y", "theta_z"])]
    x, theta = 2.0, 100.0
    motion = whole[1].modes @ np.array([x, 0.0, theta])
    h = np.tile(np.r_[motion, motion][None, :, None], (3, 1, 2)).astype(complex)
    named = {(one.dof, one.into): one for one in left_out_dofs(h, jf.virtual_interface(whole[0], whole[0]))}
    assert named["theta_z", "x"].share == pytest.approx(0.6 / (2 - 0.6))
    assert not [dof for dof, _ in named if dof == "z"]
    assert left_out_dofs(h, jf.virtual_interface(whole[1], whole[1])) == ()


def test_the_bending_expected_between_points_is_that_of_difference_error():
    places = {i: (0.01 * i, 0, 0) for i in (1, 2, 3, 4)}
    sides = jf.interface([1, 2], [3, 4], ["y", "theta_z"], places, bending_stiffness=30.0)
    expected = jf.difference_error([-0.005, 0.005], 30.0, 1.0).compliance
    np.testing.assert_allclose(sides.compliance, [0, expected])
    assert DOFS[5] == sides.dofs[1]
