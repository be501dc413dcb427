"""Quantity and sign of driving points, passivity and dead channels, on receptances summed from modes."""

from __future__ import annotations

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.check.driving_points import _excess
from measurement_errors import circular, structure

NAMES = ["j:y", "j:theta_z", "k:y", "k:theta_z"]
WRONG = {"quantity", "driving-point-sign"}


def codes(freq: np.ndarray, h: np.ndarray, names: list[str] = NAMES, **options) -> dict[str, jf.Finding]:
    """Errors and warnings of the check by their codes."""
    return {one.code: one for one in jf.check_frfs(freq, h, names, **options).findings if one.severity != "note"}


def modes(rng: np.random.Generator, band: tuple[float, float], n: int, n_rigid: int) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies of rigid modes and of modes in a band, and shapes at four DOFs."""
    omega = 2 * np.pi * np.r_[np.zeros(n_rigid), rng.uniform(*band, n)]
    return omega, rng.standard_normal((4, omega.size))


def receptances(freq: np.ndarray, omega: np.ndarray, shapes: np.ndarray, loss: float) -> np.ndarray:
    """FRFs with one loss factor for all modes, shape (n_freq, 4, 4)."""
    share = 1 / (omega**2 * (1 + 1j * loss) - (2 * np.pi * freq[:, None]) ** 2)
    return (share[:, None] * shapes) @ shapes.T


def recorded(freq: np.ndarray, omega: np.ndarray, shapes: np.ndarray, ratio: float, end: float) -> np.ndarray:
    """Spectra of impulse responses up to time `end`: the integral of exp((pole - i w) t) by mode."""
    pole = omega * (1j * np.sqrt(1 - ratio**2) - ratio)
    s = 2j * np.pi * freq[:, None]
    share = sum(
        (1 - np.exp((p - s) * end)) / (s - p) / (2j * sign * pole.imag) for p, sign in ((pole, 1), (pole.conj(), -1))
    )
    return (share[:, None] * shapes) @ shapes.T


def free_bodies(seed: int, level: float) -> tuple[np.ndarray, np.ndarray]:
    """Free bodies below their resonances: mass line, antiresonance and compliance of the modes above."""
    rng = np.random.default_rng(seed)
    freq = np.arange(4.0, 25.1, 0.5)
    omega, shapes = modes(rng, (30.0, 90.0), 4, 2)
    shapes[:, :2] *= rng.uniform(0.1, 0.6)
    h = receptances(freq, omega, shapes, 0.02)
    return freq, h * (1 + level * circular(rng, h.shape))


@pytest.mark.parametrize("level", [0.0, 0.01])
def test_receptances_around_an_antiresonance_are_receptances(level):
    """Slopes of |h| in a band without a resonance are between -20 and 20."""
    for seed in range(40):
        assert not WRONG & set(codes(*free_bodies(seed, level))), seed


@pytest.mark.parametrize("power", [0, 2])
def test_another_sign_or_quantity_is_found_there(power):
    """Both have Im h > 0; the message names both unless slopes exclude one."""
    for seed in range(40):
        freq, h = free_bodies(seed, 0.001)
        found = codes(freq, -h * (2 * np.pi * freq[:, None, None]) ** power)
        named = WRONG & set(found)
        assert len(named) == 1, seed
        (code,) = named
        if code != ("quantity" if power else "driving-point-sign"):
            assert "wrong sign" in found[code].text or "or are accelerances" in found[code].text, seed


@pytest.mark.parametrize("loss", [0.0, 0.002, 0.05, 0.2])
def test_slopes_of_passive_receptances_stay_within_their_bounds(loss):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        freq = np.geomspace(5, rng.uniform(20, 200), 300)
        omega, shapes = modes(rng, (5, 400), int(rng.integers(1, 9)), int(rng.integers(0, 3)))
        driving = np.einsum("faa->fa", receptances(freq, omega, shapes, loss))
        assert _excess(2 * np.pi * freq, driving) < 0.02, seed


def test_slopes_exclude_masses_as_stiffnesses():
    omega = np.geomspace(10, 100, 50)
    one = np.ones((50, 1), complex)
    assert _excess(omega, -one) == pytest.approx(2)  # accelerance of a mass, with the sign of receptances
    assert _excess(omega, one / omega[:, None] ** 2) == pytest.approx(2)  # stiffness over (i w)^2, of that sign
    assert _excess(omega, -one / omega[:, None] ** 2) == pytest.approx(0, abs=1e-9)
    assert _excess(omega, one) == pytest.approx(0, abs=1e-9)


def test_records_that_end_early_are_no_wrong_sign():
    """They turn the modes by different phases. A sensor that is reversed beside right ones is still named."""
    freq, active = np.arange(20.0, 1000.0, 2.0), 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        omega, shapes = modes(rng, (30, 1100), 25, 0)
        h = recorded(freq, omega, shapes, 0.001, 0.5)
        h = h + 0.01 * np.median(abs(h), axis=0) * circular(rng, h.shape)
        found = codes(freq, h)
        assert not WRONG & set(found), seed
        active += "passivity" in found
        h[:, 3] *= -1
        assert codes(freq, h)["driving-point-sign"].about == ("k:theta_z",), seed
        assert len(WRONG & set(codes(freq, -recorded(freq, omega, shapes, 0.02, 2.0)))) == 1, seed
    assert active > 10


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
