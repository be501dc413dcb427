"""What is not rigid between channels: deformation found back, DOFs that are left out."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.joint_channels import left_out_dofs
from jointfrf.identification.manifold.flexible_sides import FittedCompliance, SideBending, joint_alone, side_bending
from jointfrf.identification.manifold.transforms import ChannelModes, deformation_variance, modes_of
from rigid_bodies import AROUND, BODY_A, BODY_B, DOFS, POINT, along, triaxial

FREQ = np.linspace(20.0, 200.0, 30)


def channels_of(weights=None):
    sides = [jf.virtual_point(*triaxial(p), POINT, weights=weights) for p in (POINT + AROUND, POINT - 0.8 * AROUND)]
    return sides, jf.virtual_interface(*sides)


def rigid_frfs(freq=FREQ):
    """Of two bodies that are not connected."""
    h = np.zeros((freq.size, 24, 24), complex)
    for body, places, rows in (
        (BODY_A, POINT + AROUND, slice(12)),
        (BODY_B, POINT - 0.8 * AROUND, slice(12, 24)),
    ):
        channels = along(*triaxial(places))
        h[:, rows, rows] = body.receptance(freq, channels, channels)
    return h


def test_rigid_bodies_show_no_deformation():
    _, interface = channels_of()
    h, modes = rigid_frfs(), ChannelModes(interface.transform, interface.modes)
    assert deformation_variance(h, modes, modes).max() < 1e-20 * abs(h).max() ** 2
    np.testing.assert_allclose(modes_of(interface.transform, h), interface.modes, atol=1e-12)


def test_an_error_of_every_channel_is_found_back():
    """Residual of an independent error: its mean square over the entries is that of the error, in rows and columns."""
    _, interface = channels_of()
    modes = ChannelModes(interface.transform, interface.modes)
    springs = 3e-9
    exact = deformation_variance(rigid_frfs() + springs * np.eye(24), modes, modes)
    assert exact[:, :12, :12].sum(axis=(1, 2)).mean() == pytest.approx(2 * 12 * springs**2, rel=1e-6)


def joined(stiffness, freq=FREQ):
    """FRFs of both bodies with a joint, the channels of each on springs of their own or not."""
    sides, interface = channels_of()
    free, points = rigid_frfs(freq), interface.modes
    # Receptances of the points: of rigid bodies they give those of the channels.
    gamma = interface.transform @ free @ interface.transform.T
    coupled = jf.couple(gamma[:, :6, :6], gamma[:, 6:, 6:], np.tile(np.diag(stiffness), (freq.size, 1, 1)) + 0j,
                        range(6), range(6))  # fmt: skip
    return sides, ChannelModes(interface.transform, interface.modes), points @ coupled @ points.T


STIFFNESS = np.array([2e6, 3e6, 1e6, 900.0, 700.0, 500.0])


@pytest.mark.parametrize("springs", [0.0, 3e-9])
def test_bending_between_channels_is_found_back_whatever_the_joint(springs):
    """Channels on springs of one compliance s each: V is s T^T less its rigid part, 0 for T of least squares.

    One channel a side on a softer spring leaves what least squares do not take up.
    """
    sides, modes, h = joined(STIFFNESS)
    soft = np.zeros(24)
    soft[[2, 14]] = springs
    h = h + np.diag(soft)
    found = side_bending(h, h, 1e-30 * np.ones(h.shape), modes, modes)
    expected, among = np.zeros((2, 6))
    for side, at in zip(sides, (2, 14), strict=True):
        t, residual = side.transform, np.eye(12) - side.modes @ side.transform
        field = residual[:, at % 12, None] * soft[at] * t[None, :, at % 12]
        gain = np.linalg.norm(t, axis=1)
        expected += gain * np.sqrt(12 / 3) * np.sqrt((field**2).sum(axis=0) / 6)
        among += gain**2 * soft[at] * (residual[:, at % 12] ** 2).sum() / 6
    expected = np.hypot(expected, among / 2)
    np.testing.assert_allclose(found.low, expected, rtol=0.02, atol=1e-6 * 3e-9 * 1e3)
    # The same of a joint a hundred times as stiff.
    _, _, other = joined(100 * STIFFNESS)
    again = side_bending(other + np.diag(soft), other + np.diag(soft), 1e-30 * np.ones(h.shape), modes, modes)
    np.testing.assert_allclose(again.low, found.low, rtol=0.02, atol=1e-6 * 3e-9 * 1e3)


def test_noise_alone_is_no_bending_but_does_not_exclude_it():
    _, modes, h = joined(STIFFNESS)
    seen, high = [], []
    for seed in range(20):
        noisy = jf.pollute(h, 0.01, seed=seed)
        found = side_bending(noisy, h, (0.01 * abs(h)) ** 2, modes, modes)
        seen.append(found.low)
        high.append(found.high)
    # Noise is taken off: half of the squares fall below zero, on each of four fields a DOF.
    assert (np.median(seen, axis=0) < 0.7 * np.median(high, axis=0)).all()
    assert (np.array(high) > 0).mean() > 0.9


def test_of_channels_that_do_not_check_each_other_nothing_is_said():
    t = np.eye(4)
    modes = ChannelModes(t, t)
    h = np.ones((3, 4, 4)) + np.eye(4) + 0j
    assert side_bending(h, h, np.ones((3, 4, 4)), modes, modes) is None


def test_the_joint_alone_is_stiffer_than_seen_by_what_bends():
    """C(w) = 1e-8 (1 + x + x^2) of a trend: its intercept is found; bending moves the limits by calibrated factors."""
    omega = np.linspace(10.0, 1000.0, 200)
    x = (omega / 1000.0) ** 2
    rng = np.random.default_rng(1)
    noise = 1e-11 * (rng.standard_normal((200, 2)) + 1j * rng.standard_normal((200, 2)))
    c = 1e-8 * (1 + x + x**2)[:, None] + noise
    # Deformation beyond noise: the intercept counts.
    bending = SideBending(*(np.full(2, v) for v in (1e-10, 2e-10, 1e-2, 1e2, 1e3)))
    fitted = FittedCompliance(np.full(2, 2e-8), np.full(2, 1e-12), np.zeros(2), np.zeros(2), np.zeros(2, bool))
    found = joint_alone(omega, c, np.full((200, 2), 2e-22), fitted, bending, np.array([False, True]))
    np.testing.assert_allclose(found.seen, 1e-8, rtol=3e-3)
    low, high = found.limits
    assert (low < 1e-8).all()
    # Inertia changes the fit of all lines and the intercept in different ways: the interval contains both.
    assert (high > 2e-8).all()
    np.testing.assert_allclose(np.array([6.0, 16.0]) * 2e-10, found.stiffer)
    np.testing.assert_allclose(found.best, found.seen / (1 + np.array([1.1, 3.6]) * 1e-10 / found.seen), rtol=1e-12)
    # Channels a little off move all lines alike: their standard error adds to that of the scatter, in squares.
    off = fitted._replace(smooth=np.full(2, 1e-10))
    wider = joint_alone(omega, c, np.full((200, 2), 2e-22), off, bending, np.array([False, True]))
    np.testing.assert_allclose(wider.noise**2 - found.noise**2, (1.96 * 1e-10) ** 2, rtol=1e-9)
    # Without deformation beyond noise the fit of all lines counts, which is narrower.
    rigid = bending._replace(excess=np.zeros(2))
    narrow = joint_alone(omega, c, np.full((200, 2), 2e-22), fitted, rigid, np.array([False, True]))
    np.testing.assert_allclose(narrow.seen, 2e-8)
    np.testing.assert_allclose(narrow.noise, 1.96e-12, rtol=1e-3)


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


def test_the_bending_expected_between_points_is_the_strain_energy():
    """Of half a force, or of a force 1/(2 r), at both points, held in the middle."""
    places = {i: (0.01 * i, 0, 0) for i in (1, 2, 3, 4)}
    sides = jf.interface([1, 2], [3, 4], ["x", "y", "theta_z"], places, bending_stiffness=30.0)
    r = 0.005
    x = np.linspace(0, r, 2001)
    moment = {"y": (r - x) / 2, "theta_z": (r - x) / (2 * r)}
    expected = [0, *(2 * 2 * np.trapezoid(m**2, x) / 30.0 for m in moment.values())]
    np.testing.assert_allclose(sides.compliance, expected, rtol=1e-5)
    assert sides.compliance[2] == pytest.approx(jf.difference_error([-r, r], 30.0, 1.0).compliance)


@pytest.mark.filterwarnings("ignore::jointfrf.IdentificationWarning")
@pytest.mark.parametrize("softer", [1.0, 0.05])
def test_rigid_sides_cost_little_of_the_accuracy(softer):
    """1 % noise in acceleration: intervals contain the joint, and are nearly as narrow as noise allows."""
    freq = np.linspace(5.0, 150.0, 120)
    sides, _, h = joined((1 + 0.02j) * softer * STIFFNESS, freq)
    rng, squares = np.random.default_rng(3), (2 * np.pi * freq[:, None, None]) ** 2
    noise = rng.standard_normal(h.shape) + 1j * rng.standard_normal(h.shape)
    h = h + 0.005 * noise * np.median(abs(squares * h)) / squares
    fit = jf.identify(freq, h, DOFS, transform=jf.virtual_interface(*sides))
    limits = fit.confidence_interval(0.95)
    for name, true in zip([f"k_{d}" for d in DOFS], softer * STIFFNESS, strict=True):
        low, high = limits[name]
        assert low <= true <= high
        assert fit.value[name] == pytest.approx(true, rel=0.01)
        assert fit.seen[name].high - fit.seen[name].low < 0.06 * true
        assert high - low < 0.2 * true
