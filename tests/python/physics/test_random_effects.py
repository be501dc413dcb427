"""Means and spreads of few values with errors of their own, against closed forms and draws with a known truth."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import linalg, stats
from statsmodels.regression.mixed_linear_model import MixedLM

from jointfrf.workbench.pooling.random_effects import Mixture, RandomEffects

ONE = np.ones(1)


def exact_values(count: int, seed: int = 0) -> tuple[np.ndarray, RandomEffects]:
    """Values whose own errors are negligible."""
    values = np.random.default_rng(seed).normal(3, 0.1, count)
    return values, RandomEffects(values, 1e-14 * np.eye(count), np.ones((count, 1)))


@pytest.mark.parametrize("count", [2, 3, 8, 30])
def test_without_errors_the_mean_has_students_interval(count):
    values, effects = exact_values(count)
    reach = stats.t.ppf(0.975, count - 1) * values.std(ddof=1)
    assert_allclose(effects.combination(ONE).interval(0.95), values.mean() + reach / np.sqrt(count) * np.array([-1, 1]),
                    rtol=2e-3 * reach)  # fmt: skip


@pytest.mark.parametrize("count", [3, 8, 30])
def test_without_errors_the_next_value_has_students_interval(count):
    values, effects = exact_values(count)
    reach = stats.t.ppf(0.975, count - 1) * values.std(ddof=1) * np.sqrt(1 + 1 / count)
    found = effects.combination(ONE, effects.variances.sum(axis=1)).interval(0.95)
    assert_allclose(np.array(found) - values.mean(), reach * np.array([-1, 1]), rtol=0.02)


@pytest.mark.parametrize("count", [3, 8, 30])
def test_without_errors_the_spread_has_the_interval_of_chi_squared(count):
    values, effects = exact_values(count)
    exact = np.sqrt((count - 1) * values.var(ddof=1) / stats.chi2.ppf([0.975, 0.025], count - 1))
    assert_allclose(np.sqrt(np.quantile(effects.variances[:, 0], [0.025, 0.975])), exact, rtol=0.02)
    assert_allclose(np.sqrt(effects.reml), values.std(ddof=1), rtol=1e-3)


def test_with_errors_alone_the_mean_is_weighted_by_their_variances():
    errors = np.array([0.1, 0.2, 0.4])
    values = np.array([1.0, 1.0001, 0.9999])  # they agree far better than their errors: no spread
    effects = RandomEffects(values, np.diag(errors**2), np.ones((3, 1)))
    weight = 1 / errors**2
    found = effects.combination(ONE)
    assert (effects.variances == 0).mean() > 0.99
    assert_allclose(found.quantile(0.5), np.sum(weight * values) / weight.sum(), rtol=1e-5)
    low, high = found.interval(0.95)
    assert_allclose(high - low, 2 * 1.96 / np.sqrt(weight.sum()), rtol=0.02)


def test_a_common_error_stays_in_the_mean():
    values = np.random.default_rng(1).normal(0, 0.01, 20)
    own = np.diag(np.full(20, 1e-8))
    alone = RandomEffects(values, own, np.ones((20, 1))).combination(ONE).interval(0.95)
    common = RandomEffects(values, own + 0.05**2, np.ones((20, 1))).combination(ONE).interval(0.95)
    assert alone[1] - alone[0] < 0.02
    assert_allclose(common[1] - common[0], 2 * 1.96 * 0.05, rtol=0.02)


def balanced(groups: int, repeats: int, between: float, within: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    codes = np.repeat(np.arange(groups), repeats)
    return codes, rng.normal(0, between, groups)[codes] + rng.normal(0, within, codes.size)


@pytest.mark.parametrize("seed", range(4))
def test_balanced_groups_agree_with_the_analysis_of_variance(seed):
    codes, values = balanced(5, 3, 0.1, 0.05, seed)
    effects = RandomEffects(values, 1e-14 * np.eye(15), np.ones((15, 1)), [codes])
    means = values.reshape(5, 3).mean(axis=1)
    ms_within = ((values.reshape(5, 3) - means[:, None]) ** 2).sum() / 10
    ms_between = 3 * means.var(ddof=1)
    assert_allclose(effects.chance_of_no_spread(1), stats.f.sf(ms_between / ms_within, 4, 10), rtol=0.02, atol=1e-4)
    assert effects.degrees_of_freedom == (10, 4)
    if ms_between > ms_within:
        assert_allclose(effects.reml, [ms_within, (ms_between - ms_within) / 3], rtol=2e-3)
    reach = stats.t.ppf(0.975, 4) * np.sqrt(ms_between / 15)  # exact for balanced groups, whatever the variances
    low, high = effects.combination(ONE).interval(0.95)
    if ms_between > 3 * ms_within:
        assert_allclose([low, high], means.mean() + reach * np.array([-1, 1]), atol=0.06 * reach)


@pytest.mark.parametrize("seed", range(3))
def test_reml_of_unbalanced_groups_agrees_with_statsmodels(seed):
    rng = np.random.default_rng(seed)
    codes = np.repeat(np.arange(8), rng.integers(1, 6, 8))
    values = 300 + rng.normal(0, 10, 8)[codes] + rng.normal(0, 5, codes.size)
    effects = RandomEffects(values, 1e-10 * np.eye(codes.size), np.ones((codes.size, 1)), [codes])
    other = MixedLM(values, np.ones(codes.size), groups=codes).fit(reml=True)
    assert_allclose(effects.reml, [other.scale, other.cov_re[0, 0]], rtol=2e-3)


def test_a_factor_around_another_agrees_with_the_nested_analysis_of_variance():
    rng = np.random.default_rng(9)
    torque, assembly = np.repeat(np.arange(3), 8), np.repeat(np.arange(12), 2)
    values = rng.normal(0, 0.2, 3)[torque] + rng.normal(0, 0.1, 12)[assembly] + rng.normal(0, 0.03, 24)
    effects = RandomEffects(values, 1e-14 * np.eye(24), np.ones((24, 1)), [assembly, torque])
    assert effects.degrees_of_freedom == (12, 9, 2)
    of_assembly = values.reshape(12, 2).mean(axis=1)
    of_torque = of_assembly.reshape(3, 4).mean(axis=1)
    ms_assembly = 2 * ((of_assembly - np.repeat(of_torque, 4)) ** 2).sum() / 9
    ms_torque = 8 * of_torque.var(ddof=1)
    assert_allclose(effects.chance_of_no_spread(2), stats.f.sf(ms_torque / ms_assembly, 2, 9), rtol=0.05, atol=1e-3)


def test_the_chance_of_no_spread_is_that_of_cochrans_q():
    rng = np.random.default_rng(3)
    errors = np.array([0.1, 0.05, 0.2, 0.15])
    values = rng.normal(0, 0.2, 4)
    weight = errors**-2.0
    q = np.sum(weight * (values - np.sum(weight * values) / weight.sum()) ** 2)
    effects = RandomEffects(values, np.diag(errors**2), np.ones((4, 1)))
    assert_allclose(effects.chance_of_no_spread(0), stats.chi2.sf(q, 3), rtol=1e-9)


def test_reml_agrees_with_the_likelihood_integrated_over_the_mean():
    rng = np.random.default_rng(5)
    errors = rng.uniform(0.02, 0.2, 7)
    values = rng.normal(0, 0.1, 7) + rng.normal(0, errors)
    effects = RandomEffects(values, np.diag(errors**2), np.ones((7, 1)))
    mu = np.linspace(-1.5, 1.5, 3001)
    trial = np.linspace(0, 0.5, 2001)
    total = errors**2 + trial[:, None] ** 2
    logs = [np.logaddexp.reduce(-0.5 * ((values[:, None] - mu) ** 2 / row[:, None]).sum(axis=0)
                                - 0.5 * np.log(row).sum()) for row in total]  # fmt: skip
    assert_allclose(np.sqrt(effects.reml[0]), trial[int(np.argmax(logs))], atol=3e-4)


def crossed(seed: int) -> RandomEffects:
    """Values over two crossed factors, of which one or none makes a difference, with errors of their own."""
    rng = np.random.default_rng(seed)
    codes, other = np.repeat(np.arange(5), 3), rng.permutation(15) % 2
    errors = rng.uniform(0.02, 0.06, 15)
    values = rng.normal(0, 0.02, 2)[other] + rng.normal(0, errors)
    design = np.column_stack([np.ones(15), rng.normal(size=15)])
    return RandomEffects(values, np.diag(errors**2), design, [codes, other], points=32)


@pytest.mark.parametrize("seed", range(4))
def test_reml_is_the_highest_point_of_the_likelihood_of_contrasts(seed):
    effects = crossed(seed)
    contrasts = linalg.null_space(effects.design.T)
    groups = [np.eye(15), *((codes[:, None] == np.unique(codes)).astype(float) for codes in effects.factors)]

    def likelihood(variances: np.ndarray) -> float:
        total = effects.covariance + sum(v * z @ z.T for v, z in zip(variances, groups, strict=True))
        return stats.multivariate_normal(cov=contrasts.T @ total @ contrasts).logpdf(contrasts.T @ effects.values)

    trial = np.linspace(0, 0.06, 13) ** 2
    highest = max(likelihood(np.array(one)) for one in itertools.product(trial, repeat=3))
    assert likelihood(effects.reml) > highest - 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_reml_does_not_hang_on_the_last_bits_of_the_values(seed):
    effects, rng = crossed(seed), np.random.default_rng(seed)
    size = np.diagonal(effects.covariance).mean()
    for _ in range(3):
        moved = replace(effects, values=effects.values * (1 + 1e-14 * rng.normal(size=15)))
        assert_allclose(moved.reml, effects.reml, rtol=1e-6, atol=1e-8 * size)


@pytest.mark.parametrize("count", [2, 5, 20])
@pytest.mark.parametrize("ratio", [1e-6, 0.3, 2.0])
def test_the_upper_limit_of_a_spread_agrees_with_its_closed_form(count, ratio):
    """Of equal errors e, Q(t) = S / (e^2 + t); values that agree by chance leave the limit that the errors allow."""
    error, degrees = 0.03, count - 1
    values = np.random.default_rng(count).normal(size=count)
    values *= error * np.sqrt(ratio) / values.std(ddof=1)
    effects = RandomEffects(values, error**2 * np.eye(count), np.ones((count, 1)))
    squares = degrees * ratio * error**2
    quantile = stats.chi2.ppf(0.025 * stats.chi2.cdf(squares / error**2, degrees), degrees)
    limit = effects.upper_limit(0, 0.025)
    assert_allclose(limit, squares / quantile - error**2, rtol=1e-6)
    assert limit > np.quantile(effects.variances[:, 0], 0.975)
    assert limit > error**2 * (0.025 ** (-2 / degrees) - 1) * 0.999


def test_errors_that_exceed_the_scatter_stay_in_the_mean():
    rng = np.random.default_rng(11)
    own, common = 0.003, 0.03
    values = common * 1.1 + rng.normal(0, own, 12)
    effects = RandomEffects(values, (own**2 + common**2) * np.eye(12), np.ones((12, 1)))
    chance, share = effects.excess_of_errors
    assert chance < 1e-6
    assert_allclose(share, common**2 / (own**2 + common**2), atol=0.02)
    narrow, wide = (one.combination(ONE).interval(0.95) for one in (effects, effects.with_shared_errors(share)))
    assert narrow[0] > 0
    assert wide[0] < 0 < wide[1]


@pytest.mark.parametrize(
    ("count", "spread", "error"),
    [(3, 0.1, 0.02), (6, 0.3, 0.1), pytest.param(12, 0.05, 0.05, marks=pytest.mark.long)],
)
def test_intervals_hold(count, spread, error):
    rng = np.random.default_rng(count)
    draws, inside = 150, np.zeros(3)
    for _ in range(draws):
        own = error * np.exp(rng.normal(0, 0.5, count))
        values = rng.normal(0, spread, count) + rng.normal(0, own)
        effects = RandomEffects(values, np.diag(own**2), np.ones((count, 1)), points=128)
        low, high = effects.combination(ONE).interval(0.95)
        ahead = effects.combination(ONE, effects.variances[:, 0]).interval(0.95)
        limits = np.sqrt([np.quantile(effects.variances[:, 0], 0.025), effects.upper_limit(0, 0.025)])
        next_one = rng.normal(0, spread)
        inside += [low <= 0 <= high, ahead[0] <= next_one <= ahead[1], limits[0] <= spread <= limits[1]]
    assert (inside >= stats.binom.ppf(0.001, draws, 0.95)).all(), inside / draws


def test_a_value_that_does_not_belong_to_the_others_is_improbable():
    values = np.random.default_rng(2).normal(0, 0.05, 9)
    values[4] = 0.8
    effects = RandomEffects(values, 1e-4 * np.eye(9), np.ones((9, 1)))
    chances = [effects.chance_of(np.array([i])) for i in range(9)]
    assert chances[4] < 1e-3
    assert min(chances[:4] + chances[5:]) > 0.3  # the outlier widens what the others are judged by


def test_quantiles_of_a_mixture_return_their_probability():
    mixture = Mixture(np.array([0.0, 1.0]), np.array([1.0, 0.25]))
    for probability in (1e-6, 0.025, 0.5, 0.9):
        assert_allclose(mixture.below(mixture.quantile(probability)), probability, rtol=1e-6)
