"""Parts of the band fitted by themselves: they agree by noise, and where the joint differs they say so."""

import numpy as np
import pytest

from compliance_lines import exact_compliance, fitted, white
from jointfrf.identification.manifold.band_parts import fit_band_parts, left_out_share
from jointfrf.identification.manifold.coordinates import joint_terms

FREQ = np.linspace(20.0, 500.0, 200)
TERMS = joint_terms(2 * np.pi * FREQ, ["x", "y"], "viscous", "zero")
THETA = np.array([6e5, 2e5, 150.0, 40.0])


def parts_of(stiffness, seed=0):
    """Compare the parts of a measured compliance of 5 % noise, its stiffness of x given line by line."""
    exact = exact_compliance(TERMS, THETA)
    exact[:, 0] = 1 / (stiffness + 2j * np.pi * FREQ * THETA[2])
    std = 0.05 * abs(exact)
    measured = exact + std * white(exact.shape, seed)

    def fit(lines):
        return fitted(TERMS.on_lines(lines), measured[lines], std[lines], THETA)

    return fit_band_parts(fit(np.arange(FREQ.size)), FREQ, np.ones(4), fit)


def test_parts_of_one_joint_agree():
    reported = [parts_of(np.full(FREQ.size, THETA[0]), seed) for seed in range(40)]
    assert sum(one.disagree.any() for one in reported) <= 1
    assert not reported[0].std_error[~reported[0].disagree].any()
    np.testing.assert_allclose(reported[0].values, np.broadcast_to(THETA, (4, 4)), rtol=0.1)
    assert reported[0].spans[0][0] == 20
    assert reported[0].spans[-1][1] == 500


def test_parts_of_different_stiffness_disagree_by_their_scatter():
    stiffness = np.repeat([5e5, 8e5, 5e5, 8e5], FREQ.size // 4)
    found = parts_of(stiffness)
    assert found.disagree.tolist() == [True, False, False, False]
    assert found.std_error[0] == pytest.approx(np.std([1 / 5e5, 1 / 8e5] * 2, ddof=1), rel=0.15)
    assert not found.std_error[1:].any()


def test_a_part_that_gives_no_joint_says_nothing():
    whole = fitted(TERMS, exact_compliance(TERMS, THETA), 1e-8, THETA)

    def fit(lines):
        raise np.linalg.LinAlgError("singular")

    found = fit_band_parts(whole, FREQ, np.ones(4), fit)
    assert np.isnan(found.values).all()
    assert not found.disagree.any()


def test_lines_left_out_are_counted_by_group():
    whole = fitted(TERMS, exact_compliance(TERMS, THETA), 1e-8, THETA)
    (group,) = whole.groups
    assert left_out_share(whole) == 0
    group.used[:10] = False
    assert left_out_share(whole) == pytest.approx(0.05)
