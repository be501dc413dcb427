"""Medians and quantiles of finite numbers are those of numpy."""

import numpy as np
import pytest

from jointfrf.frf.quantiles import medians, quantiles


@pytest.mark.parametrize("n", [1, 2, 3, 10, 41, 100, 101])
def test_medians_are_those_of_numpy(n):
    values = np.random.default_rng(n).standard_normal((3, 5, n))
    np.testing.assert_array_equal(medians(values), np.median(values, axis=-1))
    # Of an axis that lies apart in memory, too.
    np.testing.assert_array_equal(medians(values.T), np.median(values, axis=0).T)


@pytest.mark.parametrize("n", [1, 2, 7, 786])
def test_quantiles_are_those_of_numpy(n):
    values, shares = np.random.default_rng(n).exponential(size=n), (0.0, 0.1, 0.25, 0.9, 1.0)
    np.testing.assert_allclose(quantiles(values, shares), np.quantile(values, shares), rtol=4e-16)
