"""Factors and covariance of the joint compliance against differences, and against all terms of the sum."""

import numpy as np
import pytest

import jointfrf as jf

ENGINES = ["lapack", "auto", "plain"]


def drawn(n, m, n_freq=11, seed=0):
    """Receptances about which is linearised, a transform with zeros, variances."""
    rng = np.random.default_rng([seed, n, m])
    gamma = rng.standard_normal((n_freq, 2 * n, 2 * n)) + 1j * rng.standard_normal((n_freq, 2 * n, 2 * n))
    transform = np.where(rng.random((2 * n, m)) < 0.6, rng.standard_normal((2 * n, m)), 0)
    return gamma, transform, rng.uniform(0, 1, (n_freq, m, m)) ** 2


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("n", "m"), [(1, 2), (2, 4), (2, 3), (3, 7), (6, 12), (9, 5)])
def test_factors_are_the_derivative_of_the_compliance(n, m, engine):
    gamma, t, _ = drawn(n, m)
    rng = np.random.default_rng(1)
    change = 1e-6 * (rng.standard_normal((len(gamma), m, m)) + 1j * rng.standard_normal((len(gamma), m, m)))
    with jf.use_engine(engine):
        u, v = jf.compliance_factors(gamma, t)
        ends = [jf.joint_compliance(gamma + sign * t @ change @ t.T) for sign in (1, -1)]
    found, expected = u @ change @ v, (ends[0] - ends[1]) / 2
    size = abs(expected).max(axis=(1, 2), keepdims=True)
    # Differences of third order are left, and the rounding of C.
    np.testing.assert_allclose(found / size, expected / size, atol=1e-4)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("reciprocal", [True, False])
@pytest.mark.parametrize(("n", "m"), [(1, 2), (2, 4), (3, 5), (4, 3), (6, 12)])
def test_covariance_is_the_sum_over_all_noise(n, m, reciprocal, engine):
    gamma, t, variance = drawn(n, m)
    with jf.use_engine("lapack"):
        u, v = jf.compliance_factors(gamma, t)
    by_entry = np.einsum("lap,lqb->labpq", u, v)
    if reciprocal:
        by_entry = (by_entry + by_entry.swapaxes(3, 4)) / 2
    rows = by_entry.reshape(len(gamma), n * n, m * m)
    expected = (rows * variance.reshape(len(gamma), 1, -1)) @ rows.conj().swapaxes(1, 2)
    with jf.use_engine(engine):
        found = jf.compliance_covariance(gamma, variance, t, reciprocal=reciprocal)
    size = abs(expected).max(axis=(1, 2), keepdims=True)
    with jf.use_engine("lapack"):
        condition = 1 / jf.reciprocal_condition(gamma[:, :n, n:]).min()
    np.testing.assert_allclose(found / size, expected / size, atol=1e3 * condition * np.finfo(float).eps)
    np.testing.assert_allclose(found / size, found.conj().swapaxes(1, 2) / size, atol=1e3 * np.finfo(float).eps)
