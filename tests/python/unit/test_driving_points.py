"""Quantity and sign of driving points, passivity and dead channels, on receptances summed from modes."""

from __future__ import annotations

import numpy as np

import jointfrf as jf
from measurement_errors import circular, structure

NAMES = ["j:y", "j:theta_z", "k:y", "k:theta_z"]
WRONG = {"quantity", "driving-point-sign"}


def codes(freq: np.ndarray, h: np.ndarray, names: list[str] = NAMES, **options) -> dict[str, jf.Finding]:
    """Errors and warnings of the check by their codes."""
    return {one.code: one for one in jf.check_frfs(freq, h, names, **options).findings if one.severity != "note"}


def test_virtual_rotations_below_the_noise_of_channels_are_not_dead():
    """Sensors 1 mm apart show rotations by differences of 1 %: these are not judged, others are."""
    s = structure("3.3")
    arms = np.array([[1.0, -5e-4], [1.0, 5e-4]])
    near, wide = np.kron(np.eye(2), arms), np.kron(np.eye(2), arms * [1.0, 100.0])
    channels = dict(names=None, responses=["1:y", "2:y", "3:y", "4:y"], forces=["5:y", "6:y", "7:y", "8:y"])
    for sensors, impacts in ((near, wide), (wide, near), (near, near)):
        h = sensors @ s.gamma @ impacts.T
        transform = np.linalg.inv(sensors), np.linalg.inv(impacts)
        assert not codes(s.freq, h, **channels, transform=transform, dofs=["y", "theta"])
        assert WRONG & set(codes(s.freq, -h, **channels, transform=transform, dofs=["y", "theta"]))


def test_noise_of_weak_pairs_is_no_error_of_reciprocity():
    """Noise of 60 % scatters h_pq / h_qp by more than a half; it differs from line to line."""
    s = structure("3.3")
    for seed in range(20):
        h = jf.pollute(s.gamma, 0.01, seed=seed)
        noise = 0.6 * circular(np.random.default_rng(seed), h.shape)
        h[:, 0, 3] *= 1 + noise[:, 0, 3]
        h[:, 3, 0] *= 1 + noise[:, 3, 0]
        assert jf.check_frfs(s.freq, h, NAMES).ok, seed
    wrong = s.gamma.copy()
    wrong[:, 0, 3] = s.gamma[:, 0, 0]
    assert "reciprocity" in codes(s.freq, jf.pollute(wrong, 0.01, seed=0))
