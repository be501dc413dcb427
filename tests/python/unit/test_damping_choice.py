"""Which damping terms the data support: those that were put in, DOF by DOF, and how clearly."""

import numpy as np
import pytest

from compliance_lines import fitted_group, white
from jointfrf.identification.manifold.coordinates import DiagonalJoint, joint_terms
from jointfrf.identification.manifold.fit import MARGIN, DofDamping, choose_damping

DOFS = ("x", "y")
FREQ = np.linspace(20.0, 500.0, 150)
OMEGA = 2 * np.pi * FREQ
BOTH = joint_terms(OMEGA, DOFS, "both", "zero")
K = (6e5, 2e5)
#: Loss factor, and c over k in s, of each kind.
DAMPING = {"none": (0.0, 0.0), "viscous": (0.0, 2e-4), "hysteretic": (0.2, 0.0), "both": (0.2, 2e-4)}


def fitted(x, y, noise=0.03, seed=0):
    """Fit with both terms to a joint of these kinds of damping."""
    k = np.array(K)
    eta, tau = np.array([DAMPING[x], DAMPING[y]]).T
    exact = 1 / (k * (1 + 1j * eta + 1j * OMEGA[:, None] * tau))
    std = noise * abs(exact)
    start = np.concatenate([k, eta * k, tau * k])
    return fitted_group(BOTH, exact + std * white(exact.shape, seed), std, start)


def chosen(*args, factor=1.0, **options):
    return choose_damping(fitted(*args, **options), DOFS, factor)


@pytest.mark.parametrize("x", DAMPING)
@pytest.mark.parametrize("y", DAMPING)
def test_every_dof_gets_what_it_has(x, y):
    choices = chosen(x, y)
    assert [(one.dof, one.best) for one in choices] == [("x", x), ("y", y)]
    assert all(one.margin > 0 and one.second != one.best for one in choices)


def test_terms_that_are_not_there_are_seldom_chosen():
    """One term too many lowers 2 squares by chi^2 with one degree of freedom: beyond ln(600) = 6.4 in 1.1 % of fits."""
    right = {"x": "viscous", "y": "none"}
    wrong = [one for seed in range(40) for one in chosen("viscous", "none", seed=seed) if one.best != right[one.dof]]
    assert len(wrong) <= 4


def test_the_margin_is_a_difference_of_the_criterion():
    """Of the whole problem, minimised for each kind of x with both terms of y: BIC = 2 squares + p ln(2 N)."""
    seed = next(s for s in range(20) if fitted("viscous", "hysteretic", seed=s).x[2] > 0)
    group = fitted("viscous", "hysteretic", seed=seed)  # both terms of x positive
    scores = {}
    for kind in DAMPING:
        joint = DiagonalJoint(joint_terms(OMEGA, DOFS, [kind, "both"], "zero"))
        size = {"k_x": 6e5, "k_y": 2e5, "c_x": 120.0, "h_y": 4e4}
        start = joint.coordinates(np.array([size.get(one.name, 0.0) for one in joint.terms.parameters]))
        p = start.size
        scores[kind] = 2 * joint.minimise(group.forms, start).cost + p * np.log(2 * 2 * FREQ.size)
    x = choose_damping(group, DOFS, 1.0)[0]
    best, second = sorted(scores, key=scores.__getitem__)[:2]
    assert (x.best, x.second) == (best, second)
    assert x.margin == pytest.approx(scores[second] - scores[best], abs=1e-3)


def test_correlated_noise_says_less():
    """Squares count less: what was clear is no more, and with few enough independent lines nothing but k is left."""
    margins = [chosen("both", "both", factor=factor)[0].margin for factor in (1.0, 4.0)]
    assert margins[1] < margins[0] / 3
    assert [one.best for one in chosen("both", "both", factor=1e7)] == ["none", "none"]


def test_terms_of_opposite_sign_are_not_both():
    """Noise apart, c = 1.5e-4 k and eta = -0.05: fits best with both, but no joint is so."""
    k = np.array(K)
    exact = 1 / (k * (1 - 0.05j + 1j * OMEGA[:, None] * 1.5e-4))
    std = 0.003 * abs(exact)
    theta = np.concatenate([k, -0.05 * k, 1.5e-4 * k])
    group = fitted_group(BOTH, exact + std * white(exact.shape, 0), std, theta)
    np.testing.assert_allclose(group.joint.theta(group.x), theta, rtol=0.05)
    assert all(one.best != "both" for one in choose_damping(group, DOFS, 1.0))


def scores(**others):
    return {"none": 500.0, "viscous": 0.0, "hysteretic": 200.0, "both": 8.0} | others


def test_two_terms_need_a_margin():
    """BIC alone would take two from 0 on."""
    assert DofDamping.by_scores("x", scores(both=-5.0)).best == "viscous"
    assert DofDamping.by_scores("x", scores(both=-7.0)).best == "both"
    assert DofDamping.by_scores("x", scores(both=-7.0)).others == ()


@pytest.mark.parametrize(
    ("others", "kinds"),
    [({}, []), ({"both": 1.0}, ["both"]), ({"both": -5.0}, ["both"]), ({"hysteretic": 3.0}, ["hysteretic"])],
)
def test_kinds_that_are_not_excluded_share_the_odds(others, kinds):
    one = DofDamping.by_scores("x", scores(**others))
    assert [kind for kind, _ in one.others] == kinds
    assert one.terms == ("both" if kinds else "viscous")
    for kind, share in one.others:
        # Odds exp(-BIC/2) with the margin of a second term.
        odds = np.exp(-(scores(**others)[kind] + (MARGIN if kind == "both" else 0)) / 2)
        assert share == pytest.approx(odds / (1 + odds))
