"""Intervals of parameters: against formulas where the problem is linear, and against the scatter of many fits."""

import numpy as np
import pytest
from scipy import stats

from compliance_lines import exact_compliance, fitted, fitted_group, white
from jointfrf.identification.manifold.coordinates import joint_terms
from jointfrf.identification.manifold.uncertainty import (
    GroupLinearised,
    joint_intervals,
    profile_interval,
    uncertainty_of_joint,
)
from jointfrf.identification.minimise import NormalEquations, minimise
from jointfrf.identification.profile import ProfileIntervals
from jointfrf.identification.scatter import (
    BLOCKS,
    Scatter,
    block_scatter,
    excess_probability,
    line_scatter,
    with_excess,
)

FREQ = np.linspace(20.0, 500.0, 100)
OMEGA = 2 * np.pi * FREQ
VISCOUS = joint_terms(OMEGA, ["x", "y"], "viscous", "zero")
THETA = np.array([6e5, 2e5, 150.0, 40.0])
#: Only the stiffness: its compliance a is the mean of the lines, and the squares are quadratic in it.
SPRING = joint_terms(OMEGA, ["x"], "none", "zero")
REACH = stats.norm.ppf(0.975)


def noisy(noise, seed=0, terms=VISCOUS, theta=THETA):
    """Compliances with relative noise, and its standard deviation."""
    exact = exact_compliance(terms, theta)
    std = noise * abs(exact)
    return exact + std * white(exact.shape, seed), std


def group_of(noise, seed=0, terms=VISCOUS, theta=THETA):
    return fitted_group(terms, *noisy(noise, seed, terms, theta), theta)


def spread_of(found, inflation, **more):
    return uncertainty_of_joint(found, FREQ, inflation, **more).spread


def variance_of(scatter, group):
    """Variance of the coordinates by a scatter, and its degrees of freedom."""
    at = GroupLinearised(group)
    found = scatter(at)
    return found.factor * np.diagonal(at.covariance), found.degrees


def spring(mean, std=1e-7, seed=0):
    """A spring whose compliances have exactly this mean; returned with the standard error of the mean."""
    e = white((FREQ.size, 1), seed)
    measured = mean + std * (e - e.mean())
    return fitted_group(SPRING, measured, std, np.array([1e6])), std / np.sqrt(2 * FREQ.size)


@pytest.mark.parametrize("factor", [1.0, 4.0])
@pytest.mark.parametrize("index", range(4))
def test_the_profile_of_a_nearly_linear_problem_is_normal(index, factor):
    group = group_of(0.01)
    low, high = profile_interval(group, index, factor)
    x = group.x
    slope = group.joint.theta_slope(x)
    error = np.sqrt(factor * (slope @ np.linalg.inv(2 * group.information) @ slope.T)[index, index])
    value = group.joint.theta(x)[index]
    np.testing.assert_allclose([value - low, high - value], REACH * error, rtol=0.02)


@pytest.mark.parametrize("probability", [0.68, 0.95, 0.99])
def test_the_profile_of_a_spring_is_that_of_its_mean_compliance(probability):
    group, error = spring(5e-8)
    reach = stats.norm.ppf((1 + probability) / 2) * error
    found = profile_interval(group, 0, 1.0, probability)
    np.testing.assert_allclose(found, [1 / (5e-8 + reach), 1 / (5e-8 - reach)], rtol=2e-3)


def test_a_spring_too_stiff_to_be_seen_is_open_above():
    group, error = spring(1.5 * 1e-7 / np.sqrt(200))
    low, high = profile_interval(group, 0, 1.0)
    assert high == np.inf
    assert low == pytest.approx(1 / ((1.5 + REACH) * error), rel=2e-3)


def test_a_compliance_measured_below_zero_is_that_of_a_rigid_joint():
    """The best is a = 0; the squares there are e^2/2 above those of the mean -e, and grow on."""
    group, error = spring(-1e-7 / np.sqrt(200))
    assert group.x[0] == 0
    low, high = profile_interval(group, 0, 1.0)
    assert high == np.inf
    # (a + e)^2 - e^2 = REACH^2 e^2.
    assert low == pytest.approx(1 / ((np.sqrt(1 + REACH**2) - 1) * error), rel=2e-3)


def test_a_dof_that_may_be_rigid_shows_no_damping():
    theta = np.array([6e9, 2e5, 150.0, 40.0])
    exact = exact_compliance(VISCOUS, theta)
    std = np.broadcast_to(0.05 * abs(exact[:, 1:]), exact.shape)
    group = fitted_group(VISCOUS, exact + std * white(exact.shape, 2), std, theta)
    assert profile_interval(group, 2, 1.0) == (-np.inf, np.inf)
    assert profile_interval(group, 0, 1.0)[1] == np.inf
    low, high = profile_interval(group, 3, 1.0)
    assert low < 40 < high < 60


@pytest.mark.parametrize("index", [0, 1])
def test_the_profile_contains_the_true_parameter_as_often_as_said(index):
    """Compliance known to a third: k and c of one DOF."""
    terms, theta = joint_terms(OMEGA, ["x"], "viscous", "zero"), np.array([6e5, 400.0])
    std = 3.5 / 6e5
    exact = exact_compliance(terms, theta)
    inside = 0
    for seed in range(60):
        group = fitted_group(terms, exact + std * white(exact.shape, seed), std, theta)
        low, high = profile_interval(group, index, 1.0)
        inside += low <= theta[index] <= high
    # 95 % of 60 is 57, with a standard deviation of 1.7.
    assert inside >= 52


def test_intervals_of_a_well_determined_joint_are_symmetric_in_the_compliance():
    found = fitted(VISCOUS, *noisy(0.05), THETA)
    intervals = joint_intervals(found, np.array([1.0, 4.0, 1.0, 4.0]))
    limits = intervals(0.95)
    assert list(limits) == ["k_x", "k_y", "c_x", "c_y"]
    a = found.groups[0].x
    error = np.sqrt(np.diagonal(np.linalg.inv(2 * found.groups[0].information)))
    for i, (name, widened) in enumerate((("k_x", 1), ("k_y", 2))):
        reach = REACH * widened * error[i]
        np.testing.assert_allclose(limits[name], [1 / (a[i] + reach), 1 / (a[i] - reach)], rtol=1e-6)
    np.testing.assert_allclose(
        [(high - low) / 2 for low, high in (limits["c_x"], limits["c_y"])],
        REACH * np.sqrt(np.diagonal(found.covariance)[2:]) * [1, 2],
        rtol=1e-6,
    )
    assert intervals.of("k_x", 0.95) is limits["k_x"]
    assert intervals(0.5)["k_x"][0] > limits["k_x"][0]


def test_intervals_of_a_poorly_determined_joint_are_those_of_the_profile():
    found = fitted(VISCOUS, *noisy(3.0), THETA)
    limits = joint_intervals(found, np.ones(4))(0.95)
    for i, name in enumerate(limits):
        assert limits[name] == profile_interval(found.groups[0], i, 1.0)


def test_both_kinds_of_interval_meet_where_one_follows_the_other():
    """Relative errors of 9 %, still symmetric in the compliance, against the profile."""
    found = fitted(VISCOUS, *noisy(0.9), THETA)
    limits = joint_intervals(found, np.ones(4))(0.95)
    for i, name in enumerate(limits):
        np.testing.assert_allclose(limits[name], profile_interval(found.groups[0], i, 1.0), rtol=0.04)


def test_the_scatter_of_equal_blocks_is_the_jackknife_of_their_means():
    """Lines of equal weight and one parameter: delete-one-block is the textbook formula."""
    rng = np.random.default_rng(4)
    of_block = 1e-6 * (1 + 0.1 * rng.standard_normal(BLOCKS))
    measured = np.repeat(of_block, FREQ.size // BLOCKS)[:, None].astype(complex)
    variance, degrees = variance_of(block_scatter, fitted_group(SPRING, measured, 1e-8, np.array([1e6])))
    np.testing.assert_allclose(variance, [of_block.var(ddof=1) / BLOCKS], rtol=1e-6)
    np.testing.assert_allclose(degrees, BLOCKS - 1)


def test_a_block_with_all_the_information_leaves_no_degrees_of_freedom():
    std = np.full((FREQ.size, 1), 1e-5)
    std[40] = 1e-8
    group = fitted_group(SPRING, 1e-6 + std * white(std.shape, 1), std, np.array([1e6]))
    assert block_scatter(GroupLinearised(group)).degrees < 0.1
    assert line_scatter(GroupLinearised(group)).degrees < 0.1
    assert np.isfinite(spread_of(fitted(SPRING, group.forms.gradient * std**2, std, np.array([1e6])), 1.0).factor).all()


@pytest.mark.parametrize(("scatter", "known_to"), [(block_scatter, 0.2), (line_scatter, 0.08)])
def test_the_scatter_of_white_noise_is_on_average_that_of_the_noise(scatter, known_to):
    ratios = []
    for seed in range(150):
        group = group_of(0.05, seed)
        by_noise = np.diagonal(np.linalg.inv(2 * group.information))
        ratios.append(variance_of(scatter, group)[0] / by_noise)
    # Of a variance of nine degrees of freedom one is known to 47 %, the mean of 150 to 4 %.
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1, atol=known_to)


def test_noise_of_one_direction_is_seen_between_lines():
    """Real noise of a real compliance is all in the spring, none in its damping: twice and none of the variance."""
    ratios, factors = [], []
    terms = joint_terms(OMEGA, ["x"], "hysteretic", "zero")
    for seed in range(60):
        noise = np.random.default_rng(seed).standard_normal((FREQ.size, 1))
        found = fitted(terms, 1e-6 + 1e-7 * noise, 1e-7, np.array([1e6, 0.0]))
        by_noise = np.diagonal(np.linalg.inv(2 * found.groups[0].information))
        ratios.append(variance_of(line_scatter, found.groups[0])[0] / by_noise)
        factors.append(spread_of(found, 1.0).factor)
    np.testing.assert_allclose(np.mean(factors, axis=0), [2, 1], atol=0.25)
    np.testing.assert_allclose(np.mean(ratios, axis=0), [2, 0], atol=0.1)


def test_too_few_lines_have_no_scatter_of_blocks():
    few = slice(0, 2 * BLOCKS - 1)
    terms = VISCOUS.on_lines(few)
    found = fitted(terms, *noisy(0.05, terms=terms), THETA)
    variance, degrees = variance_of(block_scatter, found.groups[0])
    assert np.isnan(variance).all()
    assert not degrees.any()
    spread = spread_of(found, 3.0)
    assert (spread.chance == 1).all()
    np.testing.assert_allclose(spread.information, 3.0 * max(found.excess, 1.0))


def test_variances_take_the_correlation_and_a_residual_above_the_noise():
    measured, std = noisy(0.05)
    found = fitted(VISCOUS, measured, std / 2, THETA)
    assert found.excess == pytest.approx(4, rel=0.2)
    np.testing.assert_allclose(spread_of(found, 2.0).information, 2 * found.excess)
    small = fitted(VISCOUS, measured, 2 * std, THETA)
    np.testing.assert_allclose(spread_of(small, 2.0).information, 2.0)
    np.testing.assert_allclose(spread_of(small, 2.0, is_level_known=False).information, 2 * small.excess)


def test_white_noise_is_hardly_widened_by_scatter():
    factors = np.array([spread_of(fitted(VISCOUS, *noisy(0.05, seed), THETA), 1.0).factor for seed in range(100)])
    assert np.sqrt(factors).mean() < 1.08
    assert np.quantile(factors, 0.9) < 1.5
    assert factors.max() < 6


def test_probability_of_an_excess_is_smooth_and_settles():
    """No step at any ratio; by the definition of BIC for a variance that is found or given."""
    ratio = np.linspace(0.5, 6, 2000)
    for degrees in (3.0, 9.0, 200.0):
        found = excess_probability(ratio, degrees)
        assert (np.diff(found[ratio > 1.01]) >= 0).all()
        assert abs(np.diff((ratio - 1) * found)).max() < 0.02
        assert not found[ratio < 1].any()
        assert found[-1] > 0.9
    # Residuals r of n degrees with mean square m: -2 log likelihood n m, or n (1 + log m) and log n for a parameter.
    m, n = 1.7, 12
    bic = n * m, n * (1 + np.log(m)) + np.log(n)
    assert excess_probability(m, n) == pytest.approx(1 / (1 + np.exp((bic[1] - bic[0]) / 2)))
    # One of four, and of fewer degrees of freedom: prior odds against it.
    against = np.exp((3 * (1 + np.log(4)) + np.log(3) - 3 * 4) / 2)
    assert excess_probability(4.0, 3, count=4) == pytest.approx(1 / (1 + 4 * 3 * against))


def test_parts_of_the_band_that_disagree_widen_the_variance_of_what_they_disagree_on():
    k_x = np.where(FREQ < 250, 5e5, 7e5)
    exact = 1 / np.stack([k_x + 1j * OMEGA * 150, 2e5 + 1j * OMEGA * 40], axis=1)
    std = 0.05 * abs(exact)
    found = fitted(VISCOUS, exact + std * white(exact.shape, 2), std, THETA)
    spread, blocks = spread_of(found, 1.0), block_scatter(GroupLinearised(found.groups[0]))
    assert spread.factor[0] > 3 * spread.information[0]
    assert spread.chance[0] < 1e-6
    assert spread.chance[1] > 1e-3
    assert spread.factor[0] >= 0.99 * blocks.factor[0]
    assert blocks.factor[1] < 3


@pytest.mark.parametrize("degrees", [2.2, 3.0, 9.0])
@pytest.mark.parametrize("true", [1.0, 2.0, 4.0, 10.0])
def test_coverage_with_a_scatter_of_few_degrees_of_freedom(degrees, true):
    """Four parameters whose variance is that of independent noise or larger: 95 % intervals of 1000 draws."""
    rng = np.random.default_rng(int(true))
    inside = []
    for _ in range(1000):
        scatter = Scatter(true * rng.chisquare(degrees, 4) / degrees, np.full(4, degrees))
        reach = REACH * np.sqrt(with_excess(np.ones(4), scatter))
        inside.append(abs(np.sqrt(true) * rng.standard_normal(4)) < reach)
    assert 0.90 < np.mean(inside) < 0.985


class _Flattening:
    """Squares a^2 / sqrt(1 + 16 a^2) + (b - a)^2 + 0 c: rise like |a| far from a = 0, and c is in none of them."""

    unit, bounds = 1.0, (np.full(3, -np.inf), np.full(3, np.inf))

    def __init__(self):
        self.linearisations = 0

    def residual(self, x):
        return np.array([x[0] / (1 + 16 * x[0] ** 2) ** 0.25, x[1] - x[0]])

    def cost(self, x):
        return float((self.residual(x) ** 2).sum())

    def linearised(self, x):
        self.linearisations += 1
        of_a = (1 + 8 * x[0] ** 2) / (1 + 16 * x[0] ** 2) ** 1.25
        slope = np.array([[of_a, 0, 0], [-1, 1, 0]])
        return NormalEquations(self.cost(x), slope.T @ slope, -slope.T @ self.residual(x))

    def value(self, i, x):
        return float(x[i])

    def end(self, i, sign):
        return sign * np.inf

    def longest_reach(self, i):
        return np.inf

    def longest(self, x):
        return np.full(3, np.inf)


@pytest.mark.parametrize("beside", [0.0, 1e4])
def test_a_limit_far_off_is_found_and_one_that_is_not_there_needs_no_minimisation(beside):
    """`beside` links c to a, as rounding does where nothing holds c: then the way of the covariance is steep."""
    squares = _Flattening()
    covariance = np.array([[1.0, 1.0, beside], [1.0, 2.0, beside], [beside, beside, 1e6]])
    profile = ProfileIntervals(squares, squares, np.zeros(3), 0.0, covariance, 1.0)
    assert profile.of(2, 0.95) == (-np.inf, np.inf)
    assert squares.linearisations == 0
    for limit in profile.of(0, 0.95):
        # b follows a at no cost.
        assert limit**2 / np.sqrt(1 + 16 * limit**2) == pytest.approx(REACH**2, rel=0.03)


class _Stiff(_Flattening):
    """Squares a^2 + b^2 + (1000 (b - a^2 + exp(-c)))^2: b follows a and c, and a large c has no effect."""

    unit, bounds = 1.0, (np.array([-np.inf, -np.inf, -20.0]), np.array([np.inf, np.inf, 60.0]))

    def residual(self, x):
        return np.array([x[0], x[1], 1e3 * (x[1] - x[0] ** 2 + np.exp(-x[2]))])

    def linearised(self, x):
        self.linearisations += 1
        slope = np.array([[1, 0, 0], [0, 1, 0], [-2e3 * x[0], 1e3, -1e3 * np.exp(-x[2])]])
        return NormalEquations(self.cost(x), slope.T @ slope, -slope.T @ self.residual(x))

    def longest_reach(self, i):
        return 1.5 if i == 2 else np.inf


def test_the_limit_of_a_stiffness_without_effect_is_found_behind_a_plateau():
    """As of a joint that may be rigid: squares are flat over many decades, then rise steeply."""
    squares = _Stiff()
    covariance = np.array([[1.0, 0.0, -50.0], [0.0, 1e-6, 0.0], [-50.0, 0.0, 1e6]])
    profile = ProfileIntervals(squares, squares, np.array([0.0, 0.0, 30.0]), 0.0, covariance, 1.0)
    low, high = profile.of(2, 0.95)
    taken = squares.linearisations
    # b = -exp(-c) costs b^2; with a^2 = exp(-c) + b it costs less.
    limits = [minimise(squares, np.array([a, -np.exp(-low), low]), 2, 200).cost for a in (0.0, 0.5, 2.0)]
    assert min(limits) == pytest.approx(REACH**2, rel=0.05)
    assert high == np.inf
    assert taken < 200
