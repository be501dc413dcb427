"""Noise with a floor that is constant in displacement, velocity or acceleration: no warning, and intervals hold."""

import itertools

import numpy as np
import pytest

import jointfrf as jf

SECTION = {"youngs_modulus": 70e9, "density": 2700.0, "width": 0.03, "height": 0.01}
TRUTH = {"k_y": 1e6, "k_theta": 1e3, "c_y": 20.0, "c_theta": 0.02}
#: Channels of displacements and of rotations have floors of their own.
OF_KIND = (np.array([0, 2]), np.array([1, 3]))


def free_bars(freq_hz):
    """FRFs at both sides of a joint between two free bars: at the lowest lines they move as rigid bodies."""
    a = jf.beam(0.4, 16, ends=("free", "free"), loss_factor=0.01, **SECTION)
    b = jf.beam(0.3, 12, ends=("free", "free"), loss_factor=0.01, **SECTION)
    h_a, h_b = a.receptance(freq_hz, a.index("17:y", "17:theta")), b.receptance(freq_hz, b.index("1:y", "1:theta"))
    joint = jf.Joint([TRUTH["k_y"], TRUTH["k_theta"]], [TRUTH["c_y"], TRUTH["c_theta"]], ["y", "theta"])
    return jf.couple(h_a, h_b, joint.dynamic_stiffness(freq_hz), [0, 1], [0, 1])


def with_floor(h, freq_hz, level, power, seed):
    """FRFs with a floor relative to the median FRF of each kind, constant in h w^power."""
    of_quantity = abs(h) * (freq_hz**power)[:, None, None]
    size = np.zeros(h.shape[1:])
    for rows, columns in itertools.product(OF_KIND, repeat=2):
        size[np.ix_(rows, columns)] = np.median(of_quantity[:, rows[:, None], columns])
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(h.shape) + 1j * rng.standard_normal(h.shape)
    return h + level * size * noise / np.sqrt(2) / (freq_hz**power)[:, None, None]


@pytest.mark.parametrize("step", [2.0, 20.0, 40.0])
@pytest.mark.parametrize(("level", "power"), [(1e-2, 0), (1e-2, 1), (1e-2, 2), (1e-5, 0), (1e-5, 2)])
def test_floors_give_no_warning(level, power, step):
    freq_hz = np.arange(20.0, 1000.0, step)
    exact, held = free_bars(freq_hz), []
    for seed in range(4):
        fit = jf.identify(freq_hz, with_floor(exact, freq_hz, level, power, seed), ["y", "theta"], damping="viscous")
        assert [str(one) for one in fit.findings if one.severity != "note"] == []
        limits = fit.confidence_interval()
        held += [limits[name][0] <= true <= limits[name][1] for name, true in TRUTH.items()]
    assert np.mean(held) > 0.8
