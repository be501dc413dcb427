"""What FRFs show of their own noise."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.frf.noise_estimate import gamma_noise, neighbour_mean, reciprocity_noise


def test_noise_from_reciprocity_is_robust():
    h = np.ones((1, 2000, 3, 3), complex)
    noisy = jf.realisations(h[0], 0.03, seed=1)
    assert reciprocity_noise(noisy)[0] == pytest.approx(0.03, rel=0.05)
    noisy[0, :100, 0, 1] *= 50  # a few FRFs gone wrong
    assert reciprocity_noise(noisy)[0] == pytest.approx(0.03, rel=0.1)
    assert reciprocity_noise(h)[0] == 0


def test_noise_from_reciprocity_does_not_count_zeros():
    h = jf.realisations(np.ones((500, 6, 6), complex), 0.03, seed=1)
    inside = np.kron(np.eye(3), np.ones((2, 2))) > 0
    h = np.where(inside, h, 1e-14 * np.random.default_rng(1).standard_normal(h.shape))
    assert reciprocity_noise(h)[0] == pytest.approx(0.03, rel=0.1)
    assert reciprocity_noise(h * np.eye(6))[0] == 0


def test_noise_of_gamma_jk_by_sampling(beams):
    """The largest eigenvalue of the mean squares of gamma_jk^-1 dgamma_jk, and its independence of units."""
    gamma = beams.gamma(beams.joint)[::20]
    e = jf.realisations(gamma, 0.01, seed=3, count=4000) - gamma
    ratio = np.linalg.solve(gamma[:, :2, 2:], e[:, :, :2, 2:])
    sampled = np.sqrt(abs(np.linalg.eigvals((abs(ratio) ** 2).mean(axis=0))).max(axis=1))
    found = gamma_noise(gamma[None], np.eye(4), np.array([0.01]), None)[0]
    np.testing.assert_allclose(found, sampled, rtol=0.05)
    units = np.diag([1, 1e3, 1, 1e3])
    scaled = gamma_noise((units @ gamma @ units)[None], np.eye(4), np.array([0.01]), None)[0]
    np.testing.assert_allclose(scaled, found, rtol=1e-9)
    whole = np.sqrt((abs(ratio) ** 2).mean(axis=0)[:, [0, 1], [0, 1]].max(axis=1))
    diagonal = gamma_noise(gamma[None], np.eye(4), np.array([0.01]), None, whole=False)[0]
    np.testing.assert_allclose(diagonal, whole, rtol=0.05)


def test_the_mean_of_the_neighbours_does_not_hold_the_line_itself():
    h = np.arange(6.0).reshape(1, 6, 1, 1) ** 2 + 0j
    found = neighbour_mean(h)[0, :, 0, 0].real
    np.testing.assert_allclose(found, [(1 + 4) / 2, (0 + 4 + 9) / 3, 26 / 4, (1 + 4 + 16 + 25) / 4, 38 / 3, 25 / 2])
    np.testing.assert_array_equal(neighbour_mean(h[:, :1]), h[:, :1])
