"""The residual against noise: nothing where the model is right, else what is wrong with it."""

import numpy as np
import pytest

from compliance_lines import exact_compliance, fitted, white
from jointfrf.identification.manifold.coordinates import joint_terms
from jointfrf.identification.manifold.uncertainty import residual_test_of, uncertainty_of_joint
from jointfrf.identification.residual_test import ResidualTest

FREQ = np.linspace(20.0, 500.0, 200)
OMEGA = 2 * np.pi * FREQ
TERMS = joint_terms(OMEGA, ["x", "y"], "viscous", "zero")
THETA = np.array([6e5, 2e5, 150.0, 40.0])
NOISE = 0.05


def found(stiffness=None, offset=0.0, noise=NOISE, seed=0):
    """Fit of constants to a joint whose K*(w), shape (n_freq, 2), may be anything."""
    exact = exact_compliance(TERMS, THETA) if stiffness is None else 1 / stiffness
    std = NOISE * abs(exact)
    return fitted(TERMS, exact + noise * abs(exact) * white(exact.shape, seed) + offset * std, std, THETA)


def diagnosed(estimate, inflation, freq=FREQ):
    return residual_test_of(estimate, freq, inflation, uncertainty_of_joint(estimate, freq, inflation))


def of_joint(k_x=THETA[0], c_x=THETA[2]):
    x = k_x + 1j * OMEGA * c_x
    return np.stack([x, THETA[1] + 1j * OMEGA * THETA[3]], axis=1)


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_found_where_the_model_is_right(seed):
    misfit = diagnosed(found(seed=seed), 1.0)
    assert not misfit.is_large
    assert not misfit.is_small
    assert not misfit.local
    assert not misfit.trends


def test_findings_by_chance_are_as_rare_as_said():
    """Of a hundred right models, trends at 0.1 % each and misfits beyond three sigma."""
    reported = [diagnosed(found(seed=seed), 1.0) for seed in range(100)]
    assert sum(bool(one.trends) for one in reported) <= 1
    assert sum(one.is_large or one.is_small for one in reported) <= 1


def test_sigma_is_the_scatter_of_a_ratio_to_a_level_from_as_many_data():
    ratios = [np.sqrt(found(seed=s).excess / np.mean(abs(white(2 * FREQ.size, 1000 + s)) ** 2)) for s in range(300)]
    sigma = diagnosed(found(), 1.0).sigma
    assert sigma == pytest.approx(np.std(ratios), rel=0.15)
    assert diagnosed(found(), 4.0).sigma == pytest.approx(2 * sigma)


@pytest.mark.parametrize(("noise", "large"), [(1.5 * NOISE, True), (0.5 * NOISE, False)])
def test_noise_that_is_not_what_it_was_said_to_be(noise, large):
    misfit = diagnosed(found(noise=noise), 1.0)
    assert misfit.ratio == pytest.approx(noise / NOISE, rel=0.1)
    assert (misfit.is_large, misfit.is_small) == (large, not large)
    assert not misfit.local
    assert not misfit.trends


def test_large_and_small_begin_at_three_sigma():
    assert [ResidualTest(r, 0.1).is_large for r in (1.29, 1.31)] == [False, True]
    assert [ResidualTest(r, 0.1).is_small for r in (0.71, 0.69)] == [False, True]


def test_bad_lines_are_found_where_they_are():
    """Two places: lines 60 to 65, and a single line with less."""
    offset = np.zeros((FREQ.size, 2))
    offset[60:66] = 8.0 * np.array([1, -1])
    offset[150] = 6.0
    misfit = diagnosed(found(offset=offset), 1.0)
    assert misfit.is_large
    (first, second) = misfit.local[:2]
    assert first[:2] == (FREQ[60], FREQ[65])
    assert FREQ[148] <= second[0] <= FREQ[150] <= second[1] <= FREQ[152]
    assert first[2] > 0.7 > 0.3 > second[2]


def test_an_excess_on_all_lines_is_not_local():
    assert not diagnosed(found(stiffness=of_joint(k_x=np.linspace(4e5, 8e5, FREQ.size))), 1.0).local


def test_a_stiffness_that_drifts_is_named_with_its_values():
    k_x = np.linspace(4.5e5, 7.5e5, FREQ.size)
    (trend,) = diagnosed(found(stiffness=of_joint(k_x=k_x)), 1.0).trends
    assert trend.name == "k_x"
    assert trend.probability < 1e-4
    np.testing.assert_allclose(trend.values, np.interp(trend.centres, FREQ, k_x), rtol=0.12)
    assert (np.diff(trend.centres) > 0).all()


def test_damping_that_drifts_is_named():
    (trend,) = diagnosed(found(stiffness=of_joint(c_x=np.linspace(80, 220, FREQ.size))), 1.0).trends
    assert trend.name == "c_x"
    assert trend.values[-1] > 1.3 * trend.values[0]


def test_a_drift_within_the_inflated_noise_is_chance():
    """Correlation between lines: as few independent ones say less."""
    estimate = found(stiffness=of_joint(k_x=np.linspace(5.8e5, 6.2e5, FREQ.size)))
    assert [one.name for one in diagnosed(estimate, 1.0).trends] == ["k_x"]
    assert not diagnosed(estimate, 20.0).trends


def test_too_few_lines_show_no_trend():
    few = slice(0, 200, 5)
    terms = TERMS.on_lines(few)
    exact = 1 / of_joint(k_x=np.linspace(4.5e5, 7.5e5, FREQ.size))[few]
    std = NOISE * abs(exact)
    estimate = fitted(terms, exact + std * white(exact.shape, 0), std, THETA)
    assert not diagnosed(estimate, 1.0, FREQ[few]).trends
