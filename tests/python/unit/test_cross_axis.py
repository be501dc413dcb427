"""Impacts off axis: shares of other joint DOFs found from reciprocity, by columns that were mixed on purpose."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.frf.cross_axis import found_cross_axis

FREQ = np.arange(15.0, 800.0, 2.0)
SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
K, C = (6e5, 5e3), (20.0, 1.5)
ROTATIONS = np.array([False, True])


@pytest.fixture(scope="module")
def exact():
    a = jf.beam(0.3, 12, ends=("clamped", "free"), **SECTION)
    b = jf.beam(0.225, 9, **SECTION)
    h_a = a.receptance(FREQ, a.index("13:y", "13:theta"))
    h_b = b.receptance(FREQ, b.index("1:y", "1:theta"))
    return jf.couple(h_a, h_b, jf.Joint(K, C, ["y", "theta"]).dynamic_stiffness(FREQ), [0, 1], [0, 1])


def mixed(exact, share):
    """Forces with a moment, moments with a force: columns of the same side are added."""
    return exact + exact[:, :, [1, 0, 3, 2]] * share


def shares(seed):
    """Eccentric impacts, m, and forces of a moment exciter, 1/m."""
    return np.random.default_rng(seed).standard_normal(4) * [2e-4, 2e-1, 2e-4, 2e-1]


def test_shares_are_found_within_their_standard_errors(exact):
    z = []
    for seed in range(12):
        noisy = jf.pollute(mixed(exact, shares(seed)), 0.002, seed=seed)
        found = found_cross_axis(FREQ, noisy, exact, np.eye(4), ROTATIONS)
        assert found is not None
        assert found.channels.tolist() == [0, 1, 2, 3]
        assert found.dofs.tolist() == [1, 0, 3, 2]
        z += list((found.share - shares(seed)) / found.std_error)
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.4


def test_removal_leaves_the_mean_of_both_directions_and_no_difference(exact):
    h = mixed(exact, shares(3))
    found = found_cross_axis(FREQ, jf.pollute(h, 1e-5, seed=1), exact, np.eye(4), ROTATIONS)
    left = found.removed(h, exact)
    np.testing.assert_allclose(left + left.swapaxes(1, 2), h + h.swapaxes(1, 2), rtol=1e-12)
    before, after = (abs(one - one.swapaxes(1, 2)).max() for one in (h, left))
    assert after < 1e-2 * before


@pytest.mark.parametrize("kind", ["noise", "gains and delays", "common to a column", "own factors"])
def test_other_errors_are_no_shares(exact, kind):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        factor = {
            "noise": 1.0,
            "gains and delays": (1 + 0.01 * rng.standard_normal(4))
            * np.exp(-2j * np.pi * FREQ[:, None, None] * 2e-6 * rng.standard_normal(4)),
            "common to a column": 1 + 0.02 * rng.standard_normal((FREQ.size, 1, 4)),
            "own factors": 1 + 0.01 * rng.standard_normal((4, 4)),
        }[kind]
        assert found_cross_axis(FREQ, jf.pollute(exact * factor, 0.005, seed=seed), exact, np.eye(4), ROTATIONS) is None


def test_intervals_contain_the_joint_and_the_fit_names_the_channel(exact):
    truth = dict(zip(("k_y", "k_theta", "c_y", "c_theta"), (*K, *C), strict=True))
    held = []
    for seed in range(8):
        noisy = jf.pollute(mixed(exact, shares(seed)), 0.002, seed=seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fit = jf.identify(FREQ, noisy, ["y", "theta"], damping="viscous")
        named = next(one for one in fit.findings if one.code == "off-axis")
        assert named.severity == "warning"
        assert "impact less sensor" in str(named)
        limits = fit.confidence_interval()
        held += [limits[name][0] <= true <= limits[name][1] for name, true in truth.items()]
    assert np.mean(held) > 0.9
