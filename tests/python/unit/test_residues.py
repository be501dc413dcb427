"""The driving point and the quantity of one column of FRFs by the residues of its modes."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.check.residues import resonances, strength_exponent

SENSORS = {f"s{i}{j}": (0.03 + 0.06 * i, 0.02 + 0.05 * j) for i in range(5) for j in range(5)}
FREQ = np.arange(20.0, 1000.0, 1.0)


@cache
def modes() -> tuple[np.ndarray, np.ndarray]:
    """Frequencies of a cantilever plate, and its shapes at the sensors."""
    model = jf.plate(
        0.3, 0.27, 0.005, youngs_modulus=70e9, density=2700.0, elements=(3, 3),
        edges=("free", "free", "clamped", "free"), points=SENSORS,
    )  # fmt: skip
    freq, shapes = model.modes(40)
    return freq, np.vstack([model.shown[f"{name}:z"] @ shapes for name in SENSORS])


def receptances(freq_hz: np.ndarray, force: str) -> np.ndarray:
    freq, shapes = modes()
    squared = (2 * np.pi * freq) ** 2
    share = 1 / ((1 + 0.006j) * squared - (2 * np.pi * freq_hz[:, None]) ** 2)
    return ((share * shapes[list(SENSORS).index(force)]) @ shapes.T)[..., None]


def column(force: str, background: float = 0.0, seed: int = 0) -> np.ndarray:
    """FRFs of all sensors with 1 % noise, and a background that is smooth in the accelerance, (m/s^2)/N."""
    h = receptances(FREQ, force)
    generator = np.random.default_rng(seed)
    slow = background * (1 + 0.3j * generator.standard_normal(len(SENSORS)) * (30 / FREQ[:, None]) ** 0.5)
    return jf.pollute(h, 0.01, seed=seed) - (slow / (2 * np.pi * FREQ[:, None]) ** 2)[..., None]


def codes(h: np.ndarray, said: str, band: tuple[float, float] = (20, 1000), **options: str) -> dict[str, jf.Finding]:
    own = (band[0] <= FREQ) & (band[1] >= FREQ)
    check = jf.check_frfs(FREQ[own], h[own], responses=[f"{name}:z" for name in SENSORS], forces=[said], **options)
    return {one.code: one for one in check.findings}


def test_residues_are_those_of_the_modes():
    """Of a model with proportional damping: phi_o phi_i, frequency and loss factor, by its eigenvectors."""
    freq, shapes = modes()
    own = shapes * shapes[list(SENSORS).index("s42")]
    # The denser lines follow the peaks; a parabola beside a peak holds the other modes to about 1e-3.
    lines = np.arange(20.0, 1000.0, 0.25)
    found = resonances(lines, receptances(lines, "s42")[:, :, 0])
    assert found.freq_hz.size >= 4
    for f, eta, residue in zip(found.freq_hz, found.loss_factor, found.residues, strict=True):
        mode = int(abs(freq - f).argmin())
        assert f == pytest.approx(freq[mode], rel=1e-4)
        assert eta == pytest.approx(0.006, rel=0.02)
        assert abs(residue - own[:, mode]).max() < 0.02 * abs(own[:, mode]).max()


@pytest.mark.parametrize("background", [0.0, 4.0])
@pytest.mark.parametrize("force", ["s42", "s33", "s14", "s01"])
def test_right_driving_point_is_left_alone_and_wrong_ones_are_named(force, background):
    h = column(force, background, seed=3)
    assert "driving-point-residues" not in codes(h, f"{force}:z")
    shown = resonances(FREQ, h[:, :, 0])
    own = shown.real
    for said in SENSORS:
        at = list(SENSORS).index(said)
        clear = abs(own[:, at]) > 0.3 * shown.strength
        has_both = (own[clear, at] > 0).any() and (own[clear, at] < 0).any()
        found = codes(h, f"{said}:z").get("driving-point-residues")
        if has_both:
            assert found is not None, said
            assert found.about == (f"{said}:z",)
            assert f"{force}:z" in found.numbers["others"]


def test_smooth_background_is_not_taken_for_another_quantity():
    """Between resonances a background outweighs the plate, and |h| falls faster than that of any receptance."""
    h = column("s42", 12.0, seed=1)
    found = codes(h, "s42:z", (20, 400), read_as="accelerance")
    assert "quantity" not in found
    assert "driving-point-sign" not in found


@pytest.mark.parametrize("power", [-2, 2])
def test_another_quantity_is_still_found(power):
    h = column("s42", seed=2) * (2j * np.pi * FREQ[:, None, None]) ** power
    assert strength_exponent(resonances(FREQ, h[:, :, 0])) == pytest.approx(power, abs=0.5)
    assert "quantity" in codes(h, "s42:z")


def test_sensor_against_the_force_is_found_despite_a_background():
    assert "driving-point-sign" in codes(-column("s42", 5.0, seed=4), "s42:z")


def test_no_resonance_is_no_evidence():
    """Of a rigid mass, of noise and of a few lines nothing is said."""
    generator = np.random.default_rng(5)
    mass = -1 / (2 * np.pi * FREQ[:, None]) ** 2 * np.ones(4)
    noise = generator.standard_normal((FREQ.size, 4)) + 1j * generator.standard_normal((FREQ.size, 4))
    for h in (mass + 0j, mass * (1 + 0.01 * noise), noise, mass[:3] + 0j):
        found = resonances(FREQ[: len(h)], h)
        assert strength_exponent(found) is None
