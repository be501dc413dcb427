"""Virtual point transformation: exact on rigid bodies, noise, what is not seen, six DOFs of a joint."""

import os
import warnings
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.virtual_point import (
    append_virtual_point,
    channel_geometry,
    impact_consistency,
    sensor_consistency,
    virtual_point,
    virtual_points,
)
from jointfrf.io import read_uff
from rigid_bodies import (
    AROUND,
    BODY_A,
    BODY_B,
    DOFS,
    POINT,
    UNIT_MOTIONS,
    along,
    motion,
    rigid_shapes,
    scattered,
    six,
    triaxial,
)

FREQ = np.array([20.0, 45.0, 110.0])
DATA = Path(os.environ.get("JOINTFRF_TEST_DATA", Path(__file__).resolve().parents[4] / "shared" / "data"))
LAP = DATA / "lap_joint" / "lap_joint.uff"
SOURCE_ORDER = ("x", "theta_y", "y", "theta_x", "z", "theta_z")


@pytest.mark.parametrize("dofs", [DOFS, SOURCE_ORDER, DOFS[::-1]])
def test_a_rigid_body_is_transformed_exactly(dofs):
    """Sensors and impacts at different random places and directions against Newton and Euler at the point."""
    sensors, impacts = scattered(9, 1), scattered(14, 2)
    h = BODY_A.receptance(FREQ, along(*sensors), along(*impacts))
    t_u, t_f = virtual_point(*sensors, POINT, dofs), virtual_point(*impacts, POINT, dofs)
    order = [DOFS.index(dof) for dof in dofs]
    exact = BODY_A.receptance(FREQ, six(POINT), six(POINT))[:, order][:, :, order]
    found = jf.transform(h, t_u.transform, t_f.transform)
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-11 * abs(exact).max())
    assert t_u.dofs == dofs
    for consistency in (sensor_consistency(h, t_u), impact_consistency(h, t_f)):
        np.testing.assert_allclose(consistency.overall, 1, rtol=1e-12)
        np.testing.assert_allclose(consistency.specific, 1, rtol=1e-12)
        assert not consistency.blame.any()


def test_some_dofs_of_a_plane_motion():
    """Channels in a plane show the three motions in it, and the others do not disturb them where they are absent."""
    places = POINT + np.array([[0.02, 0, 0], [-0.02, 0.01, 0], [0.0, -0.02, 0]])
    vp = virtual_point(np.repeat(places, 2, axis=0), np.tile(np.eye(3)[:2], (3, 1)), POINT, ["theta_z", "y", "x"])
    channels = along(np.repeat(places, 2, axis=0), np.tile(np.eye(3)[:2], (3, 1)))
    u = [motion(c, POINT, np.array([1.0, 2.0, 0.0]), np.array([0, 0, 30.0])) for c in channels]
    np.testing.assert_allclose(vp.transform @ u, [30, 2, 1], rtol=1e-12)
    np.testing.assert_allclose(vp.modes @ [30, 2, 1], u, rtol=1e-12)


def test_weights_are_those_of_weighted_least_squares():
    rng = np.random.default_rng(3)
    positions, directions = scattered(12, 4)
    weights = rng.uniform(0.2, 5, 12)
    weights[7] = 0
    vp = virtual_point(positions, directions, POINT, weights=weights)
    u = rng.standard_normal(12)
    rows = np.array([[motion(c, POINT, *q) for q in UNIT_MOTIONS] for c in along(positions, directions)])
    root = np.sqrt(weights)
    expected = np.linalg.lstsq(root[:, None] * rows, root * u, rcond=None)[0]
    np.testing.assert_allclose(vp.transform @ u, expected, rtol=1e-9)
    rest = np.arange(12) != 7
    without = virtual_point(positions[rest], directions[rest], POINT, weights=weights[rest])
    np.testing.assert_allclose(vp.transform[:, rest], without.transform, rtol=1e-9, atol=1e-12)
    assert not vp.transform[:, 7].any()
    assert vp.redundancy[rest].sum() == pytest.approx(11 - 6)


@pytest.mark.parametrize("places", [3, 4, 6])
def test_noise_is_reduced_as_least_squares_says(places):
    """Variance of the DOFs over 9, 12 and 18 channels: formula against scatter, and (R^T R)^-1 by hand."""
    angle = 2 * np.pi * np.arange(places) / places
    ring = 0.03 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    vp = virtual_point(*triaxial(POINT + ring), POINT)
    # n triaxial sensors on a ring of radius r: 1/n; 2/(n r^2) about the axes in its plane, 1/(n r^2) about its own.
    by_hand = np.array([1, 1, 1, 2 / 0.03**2, 2 / 0.03**2, 1 / 0.03**2]) / places
    np.testing.assert_allclose(vp.noise_gain**2, by_hand, rtol=1e-9)
    rng = np.random.default_rng(5)
    noise = rng.standard_normal((20000, 3 * places)) @ vp.transform.T
    np.testing.assert_allclose(noise.var(axis=0), by_hand, rtol=0.05)


def test_condition_does_not_depend_on_units_and_tells_of_a_far_point():
    positions, directions = scattered(9, 6)
    here = virtual_point(positions, directions, POINT).condition
    assert virtual_point(1e3 * positions, directions, 1e3 * POINT).condition == pytest.approx(here)
    assert 1 < here < 10
    assert virtual_point(positions, directions, POINT + 40 * POINT).condition > 10 * here


def test_three_points_on_a_line_against_central_differences(random_lines):
    places = [[-0.01, 0, 0], [0, 0, 0], [0.01, 0, 0]]
    vp = virtual_point(places, [[0, 1, 0]] * 3, [0, 0, 0], ["y", "theta_z"])
    any_h = random_lines(4, 3)
    rotation = jf.transform(any_h, vp.transform, vp.transform)[:, 1, 1]
    np.testing.assert_allclose(rotation, jf.central_difference(any_h, 0.01)[:, 1, 1], rtol=1e-12)
    line = along(np.array(places), np.tile([0, 1, 0], (3, 1)))
    rigid = BODY_A.receptance(FREQ, line, line)
    exact = BODY_A.receptance(FREQ, six([0, 0, 0]), six([0, 0, 0]))[:, [1, 5]][:, :, [1, 5]]
    for found in (jf.transform(rigid, vp.transform, vp.transform), jf.central_difference(rigid, 0.01)):
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-12 * abs(exact).max())
    minus = virtual_point(places, [[0, 0, 1]] * 3, [0, 0, 0], ["z", "theta_y"])
    np.testing.assert_allclose(minus.transform[1], [50, 0, -50], atol=1e-9)  # theta_y = -du_z/dx
    two = virtual_point(places[::2], [[0, 1, 0]] * 2, [0, 0, 0], ["y", "theta_z"])
    np.testing.assert_allclose(two.transform, jf.difference_weights([-0.01, 0.01]), atol=1e-10)


LINE = [[0.0, 0, -0.01], [0, 0, 0], [0, 0, 0.02]]
SLANTED = [[-0.01, -0.01, 0.0], [0, 0, 0], [0.01, 0.01, 0]]


@pytest.mark.parametrize(
    ("positions", "directions", "more", "message"),
    [
        (LINE, np.eye(3), {}, "3 channels with weight are too few for 6 DOFs"),
        (LINE, np.eye(3), {"weights": [1, 0, 1], "dofs": ["x", "y", "z"]}, "2 channels with weight"),
        (*triaxial(LINE), {}, "the channels do not show theta_z$"),
        (*triaxial(SLANTED), {}, "the channels cannot distinguish theta_x, theta_y$"),
        (LINE, [[0, 1, 0]] * 3, {"dofs": ["x", "y", "theta_z"]}, "do not show x, theta_z$"),
        (LINE, [[0, 1, 0]] * 3, {"point": [1, 0, 0], "dofs": ["y", "theta_z"]}, "cannot distinguish y, theta_z"),
        (LINE, np.eye(3), {"dofs": ["x", "phi"]}, "dofs must be among x, y, z, theta_x, theta_y, theta_z, not 'phi'"),
        (LINE, np.eye(3), {"dofs": ["x", "x"]}, "dofs must name each direction once, not x, x"),
        (LINE, np.eye(3), {"dofs": []}, "dofs must name at least one DOF"),
        (LINE, 2 * np.eye(3), {"dofs": ["x"]}, "that of channel 0 has length 2"),
        (LINE, np.eye(3)[:2], {"dofs": ["x"]}, r"directions must have shape \(3, 3\)"),
        (LINE, np.eye(3), {"dofs": ["x"], "weights": [1, -1, 1]}, "weights must not be negative: channel 1"),
        (LINE, np.eye(3), {"dofs": ["x"], "weights": [1, 1]}, r"weights must have shape \(3\)"),
        (LINE, np.eye(3), {"dofs": ["x"], "point": [0, 0]}, r"point must have shape \(3\)"),
    ],
)
def test_what_cannot_be_built_is_said(positions, directions, more, message):
    with pytest.raises(ValueError, match=message):
        virtual_point(positions, directions, **{"point": [0, 0, 0], **more})


def test_rounded_directions_are_brought_to_length_one():
    rounded = virtual_point([[0, 0, 0]] * 2, [[0.71, 0.71, 0], [0, 0, 1]], [0, 0, 0], ["y", "z"])
    np.testing.assert_allclose(rounded.modes, [[np.sqrt(0.5), 0], [0, 1]], rtol=1e-12)
    assert virtual_point([[0, 0, 0]], [[1, 0, 0]], [0, 0, 0], "x").redundancy == pytest.approx(0)


def test_two_sides():
    j, k = virtual_point(*scattered(7, 1), POINT), virtual_point(*scattered(9, 2), POINT)
    both = virtual_points(j, k)
    assert both.shape == (12, 16)
    np.testing.assert_array_equal(both[:6, :7], j.transform)
    np.testing.assert_array_equal(both[6:, 7:], k.transform)
    assert not both[:6, 7:].any()
    assert not both[6:, :7].any()
    with pytest.raises(ValueError, match="same DOFs in the same order, not x and y"):
        virtual_points(virtual_point(*scattered(3, 1), POINT, "x"), virtual_point(*scattered(3, 1), POINT, "y"))


def test_channels_by_name():
    coordinates = {1: (0, 0, 0.01), 7: (0.1, 0, 0)}
    positions, directions = channel_geometry(["7:-z", "1y"], coordinates)
    np.testing.assert_array_equal(positions, [[0.1, 0, 0], [0, 0, 0.01]])
    np.testing.assert_array_equal(directions, [[0, 0, -1], [0, 1, 0]])
    assert channel_geometry([], {})[0].shape == (0, 3)
    with pytest.raises(ValueError, match="node 2 has no coordinates; add them"):
        channel_geometry(["2:x"], coordinates)
    with pytest.raises(ValueError, match=r"1:\+rx is a rotation"):
        channel_geometry(["1:rx"], coordinates)


@pytest.fixture(scope="module")
def six_dof_joint():
    """Two bodies, with modes that move their rigid patches, and a fully coupled joint at the point."""
    freq = np.arange(20.0, 220, 3)
    rng = np.random.default_rng(5)
    coupling = rng.uniform(-0.3, 0.3, (6, 6))
    coupling = (coupling + coupling.T) / 2
    np.fill_diagonal(coupling, 1)
    size = np.sqrt([1e7, 1e7, 1e7, 1e4, 1e4, 1e4])
    joint = jf.Joint(size[:, None] * coupling * size, [200, 200, 300, 0.5, 0.5, 0.3], DOFS)
    sides, bodies = [], []
    for body, places, seed in ((BODY_A, POINT + AROUND, 1), (BODY_B, POINT - 0.8 * AROUND, 2)):
        patch = triaxial(places)
        channels = six(POINT) + along(*patch)
        modes = rigid_shapes(channels, POINT, 4, seed, (250, 900))
        bodies.append(body.receptance(freq, channels, channels, modes))
        sides.append(virtual_point(*patch, POINT))
    whole = jf.couple(*bodies, joint.dynamic_stiffness(freq), range(6), range(6))
    measured = [*range(6, 18), *range(24, 36)]
    return freq, joint, whole[:, measured][:, :, measured], sides, bodies, whole


@pytest.mark.long
def test_a_fully_coupled_joint_is_identified(six_dof_joint):
    """Translations only, 0.3 % noise: all 21 stiffnesses lie where their standard errors say."""
    freq, joint, gamma, sides, _, _ = six_dof_joint
    t = virtual_points(*sides)
    fit = jf.identify(freq, gamma, DOFS, transform=t, cross="fit", noise=1e-4)
    assert abs(fit.k_joint(freq) - joint.dynamic_stiffness(freq)).max() < 1e-6 * abs(joint.stiffness).max()
    np.testing.assert_allclose(fit.stiffness, np.diag(joint.stiffness), rtol=1e-6)

    noisy = jf.identify(freq, jf.pollute(gamma, 0.003, seed=3), DOFS, transform=t, cross="fit")
    assert not noisy.warnings
    off = []
    for name, value in noisy.value.items():
        pair = name[2:].split(",")
        a, b = DOFS.index(pair[0]), DOFS.index(pair[-1])
        exact = (joint.stiffness if name[0] == "k" else joint.damping)[a, b]
        off.append((value - exact) / noisy.std_error[name])
    assert len(off) == 42
    assert max(abs(np.array(off))) < 4.5
    # Intervals that allow for sides that are not rigid are somewhat wider than noise makes them.
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.5
    # The joint alone is extrapolated from C of single lines where noise hides whether the sides bend.
    np.testing.assert_allclose(noisy.stiffness, np.diag(joint.stiffness), rtol=0.01)


def test_over_determination_sharpens_the_joint(six_dof_joint):
    """Four triaxial sensors a side against three: smaller errors, as the fit itself says."""
    freq, _, gamma, sides, _, _ = six_dof_joint
    few = [virtual_point(p[:9], d[:9], POINT) for p, d in (triaxial(POINT + AROUND), triaxial(POINT - 0.8 * AROUND))]
    nine = [*range(9), *range(12, 21)]
    variance = np.full(gamma.shape, 1e-22)  # equal in all FRFs, as least squares with equal weights takes it
    options = dict(damping="viscous", cross="fit")
    many = jf.identify(freq, gamma, DOFS, transform=virtual_points(*sides), noise=variance, **options)
    fewer = jf.identify(
        freq,
        gamma[:, nine][:, :, nine],
        DOFS,
        transform=virtual_points(*few),
        noise=variance[:, :18, :18],
        **options,
    )
    for dof in DOFS:
        assert many.std_error[f"k_{dof}"] < fewer.std_error[f"k_{dof}"]


def test_bodies_coupled_at_virtual_points(six_dof_joint):
    """Appended points, K into the channels of both sides: against the joint at the real points."""
    freq, joint, _, sides, (h_a, h_b), whole = six_dof_joint
    k = joint.dynamic_stiffness(freq)
    a, b = (append_virtual_point(h, np.arange(6, 18), side) for h, side in zip((h_a, h_b), sides, strict=True))
    assert a.shape[1:] == (24, 24)
    again = jf.couple(a, b, k, range(18, 24), range(18, 24))
    own = [*range(18), *range(24, 42)]
    np.testing.assert_allclose(again[:, own][:, :, own], whole, rtol=1e-7, atol=1e-9 * abs(whole).max())


def test_only_the_rigid_motion_of_deforming_patches_is_coupled(random_lines):
    """Against (Z + B^T K B)^-1 with B = [T_j, -T_k]; the transformation then gives K back exactly."""
    m_j, m_k = 8, 10
    j, k = virtual_point(*scattered(m_j, 1), POINT), virtual_point(*scattered(m_k, 2), POINT)
    h = [random_lines(3, m, seed=m) for m in (m_j, m_k)]
    stiffness = 0.01 * random_lines(3, 6)
    extended = [
        append_virtual_point(one, np.arange(side.modes.shape[0]), side) for one, side in zip(h, (j, k), strict=True)
    ]
    at = [np.arange(m_j, m_j + 6), np.arange(m_k, m_k + 6)]
    coupled = jf.couple(*extended, stiffness, *at)
    own = [*range(m_j), *range(m_j + 6, m_j + 6 + m_k)]
    gamma = coupled[:, own][:, :, own]
    z = np.zeros((3, m_j + m_k, m_j + m_k), complex)
    z[:, :m_j, :m_j], z[:, m_j:, m_j:] = np.linalg.inv(h[0]), np.linalg.inv(h[1])
    across = np.hstack([j.transform, -k.transform])
    np.testing.assert_allclose(gamma, np.linalg.inv(z + across.T @ stiffness @ across), rtol=1e-7, atol=1e-9)
    t = virtual_points(j, k)
    found = jf.inverse_substructuring(jf.transform(gamma, t, t))
    np.testing.assert_allclose(found, stiffness, rtol=1e-6, atol=1e-8)
    with pytest.raises(ValueError, match="channels must name the 8 channels of the point, not 7"):
        append_virtual_point(h[0], np.arange(7), j)
    with pytest.raises(ValueError, match="channels names DOF 8"):
        append_virtual_point(h[0], np.arange(1, 9), j)


@pytest.mark.skipif(not LAP.exists(), reason="the measured files are not beside the project (JOINTFRF_TEST_DATA)")
def test_a_bolted_lap_joint_in_six_dofs():
    """Solid elements with contact: ten channels a side are rigid, and a joint of six DOFs fits to the noise."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.FileContentWarning)
        frfs = read_uff(LAP).receptance()
    axes = {2: "y", 3: "y", 4: "y", 5: "y", 6: "x", 7: "x", 8: "x", 9: "z", 10: "z", 11: "z"}
    names = [[f"{side}{node:02d}:+{axis}" for node, axis in axes.items()] for side in (1, 2)]
    sides = [virtual_point(*channel_geometry(n, frfs.coordinates), [0, 0, 0.2875], SOURCE_ORDER) for n in names]
    h = frfs.matrix(names[0] + names[1], names[0] + names[1])
    for own, side, rows in zip(names, sides, (slice(0, 10), slice(10, 20)), strict=True):
        assert sensor_consistency(h[:, rows], side).overall.min() > 0.999
        # noise is relative: channels that move little are known better
        weights = 1 / np.mean(abs(h[:, rows]) ** 2, axis=(0, 2))
        weighted = virtual_point(*channel_geometry(own, frfs.coordinates), [0, 0, 0.2875], SOURCE_ORDER, weights)
        for wrong in (5, 8):  # 107:+x, 110:+z, which other channels check best
            turned = h[:, rows].copy()
            turned[:, wrong] *= -1
            assert np.median(sensor_consistency(turned, weighted).blame, axis=0).argmax() == wrong
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        fit = jf.identify(
            frfs.freq_hz, h, SOURCE_ORDER, bands=(20, 550), transform=virtual_points(*sides), cross="ignore"
        )
    assert fit.noise_level == pytest.approx(0.01, rel=0.05)
    # What is not rigid in the channels adds to their variance.
    assert 0.006 < fit.residual_level < 0.011
