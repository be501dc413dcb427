"""The fused study has the statistics of the realisations that `realisations` gives, and never stores them."""

import tracemalloc

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.errors import SingularLineError

RNG = np.random.default_rng(8)
FREQ = np.array([10.0, 20.0, 30.0])


def random_lines(n_freq, n):
    return RNG.standard_normal((n_freq, n, n)) + 1j * RNG.standard_normal((n_freq, n, n)) + 3 * np.eye(n)


GAMMA, ALPHA, K0 = random_lines(3, 4), random_lines(3, 4), RNG.standard_normal((2, 2)) + 0j


def identified(method, gamma):
    """K* or C of many realisations, shape (r, n_freq, n, n)."""
    lines = gamma.reshape(-1, 4, 4)
    if method == "ismm":
        k = jf.ismm(np.tile(ALPHA, (len(gamma), 1, 1)), lines, K0)
    elif method == "compliance":
        k = jf.joint_compliance(lines)
    else:
        k = jf.inverse_substructuring(lines)
    return k.reshape(len(gamma), -1, 2, 2)


def of_ismm(method):
    return dict(alpha=ALPHA, k_initial=K0) if method == "ismm" else {}


@pytest.mark.parametrize("method", ["ismm", "inverse-substructuring", "compliance"])
@pytest.mark.parametrize(
    "noise",
    [
        dict(kind="complex"),
        dict(kind="real-uniform", relative_to="line"),
        dict(kind="real-normal", relative_to="spectrum", reciprocal=True),
        dict(kind="complex-per-part", block=2),
    ],
)
def test_statistics_are_those_of_the_realisations(method, noise):
    study = jf.monte_carlo(GAMMA, 0.02, seed=9, first=5, count=333, method=method, **noise, **of_ismm(method))
    k = identified(method, jf.realisations(GAMMA, 0.02, seed=9, first=5, count=333, **noise))
    mean = k.mean(axis=0)
    np.testing.assert_allclose(study.mean, mean, rtol=0, atol=1e-11 * abs(mean).max())
    off = k - mean
    parts = [(off.real**2).sum(axis=0), (off.imag**2).sum(axis=0), (off.real * off.imag).sum(axis=0)]
    expected = np.stack(parts, axis=-1) / 332
    np.testing.assert_allclose(study.covariance, expected, rtol=0, atol=1e-10 * expected.max())
    np.testing.assert_allclose(study.variance, (abs(off) ** 2).sum(axis=0) / 332, rtol=1e-9)
    np.testing.assert_allclose(study.std_error, np.sqrt(study.variance / 333), rtol=1e-12)
    assert study.good.tolist() == [333] * 3


def test_first_order_variance():
    """To first order Var(K*) of ISMM is that of -(gamma^-1 e gamma^-1)_jk."""
    level = 1e-4
    study = jf.monte_carlo(GAMMA, level, seed=2, count=20000)
    g = np.linalg.inv(GAMMA)
    sensitivity = abs(g[:, :2, :, None, None] * g[:, None, None, :, 2:]) ** 2  # (f, i, p, q, j)
    expected = np.einsum("fipqj,fpq->fij", sensitivity, (level * abs(GAMMA)) ** 2)
    np.testing.assert_allclose(study.variance, expected, rtol=0.06)
    bias = abs(study.mean + g[:, :2, 2:]) / study.std_error
    assert bias.max() < 5


def test_band_statistics_are_those_of_single_realisations():
    study = jf.monte_carlo(GAMMA, 0.02, seed=4, count=4000)
    k = identified("inverse-substructuring", jf.realisations(GAMMA, 0.02, seed=4, count=4000))[:, 1:]
    stiffness = k.real.mean(axis=1)
    damping = (k.imag / (2 * np.pi * FREQ[1:, None, None])).mean(axis=1)
    band = study.band(FREQ, [(15, 35)])
    np.testing.assert_allclose(band.stiffness, stiffness.mean(axis=0), rtol=1e-9)
    np.testing.assert_allclose(band.damping, damping.mean(axis=0), rtol=1e-9)
    np.testing.assert_allclose(band.stiffness_std, stiffness.std(axis=0), rtol=0.07)
    np.testing.assert_allclose(band.damping_std, damping.std(axis=0), rtol=0.07)
    with pytest.raises(ValueError, match="none at 0 Hz"):
        study.band([0.0, 1.0, 2.0], [(0, 2)])


def test_memory_does_not_grow_with_the_realisations():
    peaks = []
    for count in (100, 100000):
        tracemalloc.start()
        jf.monte_carlo(GAMMA, 0.02, seed=4, count=count)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 10000


def test_bad_lines_are_named():
    gamma = GAMMA.copy()
    gamma[1] = 0
    with pytest.raises(SingularLineError, match=r"line 1 \(20 Hz\)"):
        jf.monte_carlo(gamma, 0.02, count=10, freq_hz=FREQ)
    study = jf.monte_carlo(gamma, 0.02, count=10, on_singular="nan")
    assert study.good.tolist() == [10, 0, 10]
    assert np.isnan(study.mean[1]).all()
    assert np.isnan(study.covariance[1]).all()
    gamma[1, 0, 0] = np.nan
    with pytest.raises(ValueError, match="gamma: NaN or Inf in line 1"):
        jf.monte_carlo(gamma, 0.02, count=10)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(count=0), "count must be positive"),
        (dict(first=-1), "realisations are counted from 0"),
        (dict(seed=-1), "seed must lie between"),
        (dict(method="guess"), "method must be one of"),
        (dict(method="ismm"), "needs alpha and k_initial"),
        (dict(alpha=ALPHA), "needs alpha and k_initial"),
        (dict(method="ismm", alpha=ALPHA[:, :2, :2], k_initial=K0), "alpha must have the shape of gamma"),
        (dict(block=3), "block 3 does not divide"),
        (dict(on_singular="hide"), "on_singular must be one of"),
    ],
)
def test_bad_arguments_get_one_sentence(change, message):
    with pytest.raises(ValueError, match=message):
        jf.monte_carlo(**(dict(gamma=GAMMA, level=0.05, count=5) | change))


def test_no_lines():
    study = jf.monte_carlo(np.empty((0, 4, 4), complex), 0.05)
    assert study.mean.shape == (0, 2, 2)
