"""Consistency of channels with rigid motion: definitions, flexible modes, wrong signs; passive and reciprocal FRFs."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.virtual_point import driving_point_check, impact_consistency, sensor_consistency, virtual_point
from rigid_bodies import AROUND, BODY_A, POINT, UNIT_MOTIONS, along, motion, rigid_shapes, scattered, six, triaxial

FREQ = np.array([20.0, 45.0, 110.0])


def test_one_flexible_mode_lowers_consistency_most_where_it_moves_most():
    """A bracket under sensor 5 resonates: its channel alone is not rigid."""
    channels = along(*scattered(12, 8))
    shape = np.zeros(12)
    shape[5] = 0.6
    freq = np.arange(20.0, 300, 5)
    vp = virtual_point(*scattered(12, 8), POINT)
    forces = along(*scattered(4, 9))
    h = BODY_A.receptance(freq, channels, forces, [(150.0, shape, np.full(4, 0.5))])
    found = sensor_consistency(h, vp)
    assert found.overall.max() < 1
    assert freq[found.overall.argmin()] == 150
    assert found.overall.min() < 0.9
    assert found.specific.mean(axis=0).argmin() == 5
    # at the resonance the channel drags others along; the blame stays where it belongs
    assert (found.specific.argmin(axis=1) != 5).any()
    np.testing.assert_allclose(found.blame[:, 5], 1, rtol=1e-6)
    assert np.delete(found.blame, 5, axis=1).max() < 0.95
    assert found.specific[0, 5] > 0.99 > found.specific[freq == 150, 5]


def test_indicators_against_their_definitions():
    """A bending mode; the source's formulas with one combination of forces, and leaving out channels one by one."""
    rng = np.random.default_rng(10)
    positions, directions = scattered(10, 11)
    weights = rng.uniform(0.5, 2, 10)
    vp = virtual_point(positions, directions, POINT, weights=weights)
    bending = np.einsum("ma,ma->m", directions, (positions - POINT) ** 2) * 300
    h = BODY_A.receptance(FREQ, along(positions, directions), six(POINT), [(80.0, bending, np.ones(6))])
    u = h @ rng.standard_normal((6, 1))
    found = sensor_consistency(u, vp)
    root = np.sqrt(weights)

    def fit(line, keep):
        """Least squares over some channels: filtered responses and the sum of squares that is left."""
        rows = np.array([[motion(c, POINT, *q) for q in UNIT_MOTIONS] for c in along(positions, directions)])
        q = np.linalg.lstsq((root[:, None] * rows)[keep], root[keep] * u[line, keep, 0], rcond=None)[0]
        return rows @ q, (abs(root * (u[line, :, 0] - rows @ q))[keep] ** 2).sum()

    for line in range(3):
        all_channels = np.ones(10, bool)
        filtered, left = fit(line, all_channels)
        measured = u[line, :, 0]
        assert found.overall[line] == pytest.approx(np.linalg.norm(root * filtered) / np.linalg.norm(root * measured))
        coherence = abs(filtered + measured) ** 2 / (2 * (abs(filtered) ** 2 + abs(measured) ** 2))
        np.testing.assert_allclose(found.specific[line], coherence, rtol=1e-9)
        for i in range(10):
            without = fit(line, np.arange(10) != i)[1]
            assert found.blame[line, i] == pytest.approx(1 - without / left, rel=1e-6)
    assert (found.overall < 1).all()


@pytest.mark.parametrize("wrong", range(12))
def test_a_wrong_sign_is_found(wrong):
    """Of any channel, with noise: by the blame of the sensor, and, where the impact is wrong, of the impact."""
    positions, directions = triaxial(POINT + AROUND)
    vp = virtual_point(positions, directions, POINT)
    channels = along(positions, directions)
    h = jf.pollute(BODY_A.receptance(np.linspace(20, 200, 20), channels, channels), 0.01, seed=wrong)
    good = sensor_consistency(h, vp)
    assert good.overall.min() > 0.999
    assert np.median(good.blame, axis=0).max() < 0.5
    h[:, wrong] *= -1
    found = sensor_consistency(h, vp)
    assert (found.blame.argmax(axis=1) == wrong).all()
    assert found.blame[:, wrong].min() > 0.99
    assert (found.specific[:, wrong] < 0.9).all()
    assert impact_consistency(h, vp).overall.min() > 0.999
    h[:, wrong] *= -1
    h[:, :, wrong] *= -1
    assert sensor_consistency(h, vp).overall.min() > 0.999
    assert (impact_consistency(h, vp).blame.argmax(axis=1) == wrong).all()


def test_channels_that_nothing_checks_are_not_blamed():
    """Six channels for six DOFs: everything fits, and nothing is checked."""
    positions, directions = scattered(6, 1)
    vp = virtual_point(positions, directions, POINT)
    np.testing.assert_allclose(vp.redundancy, 0, atol=1e-9)
    found = sensor_consistency(np.random.default_rng(0).standard_normal((2, 6, 3)), vp)
    np.testing.assert_allclose(found.overall, 1)
    assert not found.blame.any()
    still = sensor_consistency(np.zeros((1, 6, 1)), vp)
    assert np.isnan(still.overall).all()
    assert not still.blame.any()
    with pytest.raises(ValueError, match="NaN or Inf in line 1"):
        sensor_consistency([np.ones((6, 1)), np.full((6, 1), np.nan)], vp)
    with pytest.raises(ValueError, match="h must have shape"):
        sensor_consistency(np.ones((1, 5, 1)), vp)


def test_driving_point_check():
    positions, directions = triaxial(POINT + AROUND)
    channels = along(positions, directions)
    vp = virtual_point(positions, directions, POINT)
    modes = rigid_shapes(channels, POINT, 8, 1, (30, 300))
    h = BODY_A.receptance(np.linspace(20, 300, 50), channels, channels, modes)
    at_point = jf.transform(h, vp.transform, vp.transform)
    good = driving_point_check(at_point)
    np.testing.assert_allclose(good.reciprocity, 1, rtol=1e-9)
    assert good.driving_point.max() < 0
    assert good.passivity.max() < 0
    noisy = driving_point_check(jf.pollute(at_point, 0.01, seed=1))
    assert 0 < noisy.passivity.max() < 0.03
    assert 0.99 < noisy.reciprocity.min() < 1
    # theta_y of the sensors with the wrong sign
    sign = np.diag([1.0, 1, 1, 1, -1, 1])
    wrong = driving_point_check(sign @ at_point)
    assert (wrong.driving_point[:, 4] > 0).all()
    assert np.delete(wrong.driving_point, 4, axis=1).max() < 0
    assert wrong.passivity.min() > 0
    np.testing.assert_allclose(wrong.reciprocity[:, 4, 0], 0, atol=1e-9)
    # every driving point takes power, yet opposite forces give it back: eigenvalues of Im H are -3 and 1
    active = driving_point_check([[[-1j, -2j], [-2j, -1j]]])
    assert active.driving_point.max() == -1
    assert active.passivity[0] == pytest.approx(1 / 3)
