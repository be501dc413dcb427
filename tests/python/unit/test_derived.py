"""Functions of the parameters of a fit: what is read, and what their uncertainty is."""

import numpy as np
import pytest

import jointfrf as jf

VALUES = {"k_y": 2e5, "k_theta": 5e3, "h_y": 1e4, "k_y,theta": 300.0}
ROOT = np.array([[2e3, 0, 0, 0], [10.0, 40, 0, 0], [50.0, 0, 300, 0], [0, 1.0, 0, 20]])


@pytest.fixture
def fit():
    """Springs with a known covariance."""
    return jf.Fit.of_springs("compliance", ("y", "theta"), VALUES, ROOT @ ROOT.T, 0.01, 0.01, np.array([1.0, 2.0]))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("h_y / k_y", 0.05),
        ("-k_theta + 2 * k_y", 395e3),
        ("sqrt(k_y / 2.5) / (2 * pi)", np.sqrt(2e5 / 2.5) / (2 * np.pi)),
        ("{k_y,theta} / k_y", 300 / 2e5),
        ("exp(log(k_y)) ** 2 - abs(-1)", 4e10 - 1),
        ("1e3", 1e3),
    ],
)
def test_arithmetic_of_names_is_read(fit, text, value):
    assert fit.derived(text).value == pytest.approx(value)


def test_the_error_is_that_of_many_draws(fit):
    draws = fit.estimate + np.random.default_rng(1).standard_normal((200_000, 4)) @ ROOT.T
    for function in ("h_y / k_y", lambda v: v["k_y"] * v["k_theta"] / v["k_y,theta"]):
        of = fit.derived(function)
        columns = dict(zip(VALUES, draws.T, strict=True))
        scatter = columns["h_y"] / columns["k_y"] if isinstance(function, str) else function(columns)
        assert of.std_error == pytest.approx(scatter.std(), rel=0.02)
        assert of.high - of.low == pytest.approx(2 * 1.959964 * of.std_error)


def test_of_one_parameter_the_interval_is_carried_over():
    limits = {"k_y": (1e5, np.inf)}
    fit = jf.Fit.of_springs("compliance", ("y",), {"k_y": 2e5}, np.array([[1e8]]), 0.01, 0.01, np.ones(1),
                            intervals=lambda probability: limits)  # fmt: skip
    compliance = fit.derived("1 / k_y")
    assert (compliance.low, compliance.high) == (0.0, 1e-5)
    assert fit.derived(lambda value: 7.0) == (7.0, 0.0, 7.0, 7.0)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        ("k_z / k_y", "unknown parameter 'k_z' in .*; use one of k_y, k_theta"),
        ("{k_z,y}", "unknown parameter 'k_z,y'"),
        ("k_y +", "is no arithmetic of parameters"),
        ("__import__('os').getcwd()", "is no arithmetic|unknown parameter"),
        ("k_y.real", "is no arithmetic"),
        ("(lambda: 1)()", "is no arithmetic"),
        ("k_y if 1 else 2", "is no arithmetic"),
        ("'a'", "is no arithmetic"),
        ("True", "is no arithmetic|unknown parameter"),
        ("sqrt(k_y, 2)", "is no arithmetic"),
        ("", "is no arithmetic"),
        (3.0, "function must be an arithmetic expression or a callable"),
    ],
)
def test_what_is_no_arithmetic_is_one_sentence(fit, function, message):
    with pytest.raises(ValueError, match=message):
        fit.derived(function)


def test_probabilities_are_checked(fit):
    assert fit.derived("h_y / k_y", 0.5).low > fit.derived("h_y / k_y", 0.99).low
    with pytest.raises(ValueError, match="probability must lie between"):
        fit.derived("h_y / k_y", 1.0)


def test_the_interval_of_a_function_is_a_profile_of_the_likelihood():
    """Brute force: the other parameter minimised on a grid, at both ends of k c of a chain with 20 % noise."""
    freq = np.linspace(0.5, 10, 60)
    a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"], exact=True)
    b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"], exact=True)
    whole = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    h = jf.pollute(whole.receptance(freq, ["A/1:x"], ["B/2:x"]), 0.2, seed=8)
    fit = jf.identify_model(freq, h, whole, ["A/1:x"], ["B/2:x"], noise=0.2)
    variance = (0.2 * abs(fit.data.predicted)) ** 2

    def cost(k, c):
        other = jf.Assembly(a, b, jf.Joint([k], [c], dofs=["x"]))
        return 2 * (abs(other.receptance(freq, ["A/1:x"], ["B/2:x"]) - h) ** 2 / variance).sum()

    k, error = fit.value["k_x"], fit.std_error["k_x"]
    least = cost(k, fit.value["c_x"])
    product = fit.derived(lambda v: v["k_x"] * v["c_x"])
    profiles = [
        min(cost(one, limit / one) for one in k + error * np.linspace(-3, 3, 121)) - least
        for limit in (product.low, product.high)
    ]
    # Its variance is widened as much as that of the parameter whose variance is widened most.
    c, error_c = fit.value["c_x"], fit.std_error["c_x"]
    limits = fit.confidence_interval()
    of_k = [min(cost(one, c_) for c_ in c + error_c * np.linspace(-3, 3, 121)) - least for one in limits["k_x"]]
    of_c = [min(cost(k_, one) for k_ in k + error * np.linspace(-3, 3, 121)) - least for one in limits["c_x"]]
    np.testing.assert_allclose(profiles, max(np.mean(of_k), np.mean(of_c)), rtol=0.15)
    assert min(profiles) > 0.9 * 1.959964**2


def test_loss_factors_hold_the_truth_with_their_intervals(beams):
    joint = jf.Joint([6e5, 5e3], dofs=["y", "theta"], loss_factor=[0.05, 0.1])
    inside, errors = 0, []
    for seed in range(20):
        fit = jf.identify(beams.freq, jf.pollute(beams.gamma(joint), 0.01, seed=seed), ["y", "theta"],
                          damping="hysteretic", noise=0.01)  # fmt: skip
        assert list(fit.loss_factors) == ["eta_y", "eta_theta"]
        for eta, true in zip(fit.loss_factors.values(), (0.05, 0.1), strict=True):
            inside += eta.low < true < eta.high
            errors.append((eta.value - true) / eta.std_error)
        np.testing.assert_allclose(fit.loss_factor, [one.value for one in fit.loss_factors.values()])
    assert inside >= 34  # 38 of 40 expected, fewer than 34 by chance in 2 of 100
    assert 0.7 < np.std(errors) < 1.35
    wide = jf.identify(beams.freq, jf.pollute(beams.gamma(joint), 0.3, seed=1), ["y", "theta"], damping="hysteretic")
    eta = wide.loss_factors["eta_y"]
    assert eta.low < 0.05 < eta.high
    assert "eta_theta" in str(fit)
