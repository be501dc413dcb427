"""The compliance fit against the Cramer-Rao bound, computed by another route, and against its own promises."""

import dataclasses
import warnings

import numpy as np
import pytest

import jointfrf as jf
from cramer_rao import cramer_rao, term_matrices
from jointfrf.identification.manifold.coordinates import joint_terms
from jointfrf.identification.manifold.estimate import estimate_joint
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.uncertainty import GroupLinearised
from jointfrf.identification.scatter import block_scatter

TRUTH = np.array([6e5, 5e3, 20, 1.5])


def with_noise(gamma, level, *, smooth=None):
    """Interface FRFs of known relative noise; smooth FRFs are the exact ones unless others are given."""
    smooth = gamma if smooth is None else smooth
    one = np.eye(gamma.shape[-1])
    return InterfaceFrfs.of(gamma, smooth, (level * abs(smooth)) ** 2, one, one, reciprocal=True)


def identified(freq, gamma, dofs, **options):
    with warnings.catch_warnings():
        for category in (jf.IdentificationWarning, jf.FrfCheckWarning):
            warnings.simplefilter("ignore", category)
        return jf.identify(freq, gamma, dofs, **options)


def terms_of(s, damping="viscous", cross="zero"):
    return joint_terms(2 * np.pi * s.freq, s.joint.dofs, damping, cross)


@pytest.mark.parametrize("name", ["chains", "beams"])
def test_covariance_is_the_cramer_rao_bound(name, request):
    s = request.getfixturevalue(name)
    gamma = s.gamma(s.joint)
    found = estimate_joint(with_noise(gamma, 0.01), terms_of(s))
    bound = 0.01 * np.sqrt(np.diag(cramer_rao(gamma, s.joint.dynamic_stiffness(s.freq), terms_of(s))))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), bound, rtol=1e-3)


@pytest.mark.parametrize("damping", ["viscous", "hysteretic", "both", "none"])
@pytest.mark.parametrize("cross", ["zero", "ignore", "fit"])
def test_exact_without_noise(beams, damping, cross):
    joint = jf.Joint(
        [6e5, 5e3],
        [20, 1.5] if damping in ("viscous", "both") else None,
        ["y", "theta"],
        loss_factor=[0.03, 0.05] if damping in ("hysteretic", "both") else 0.0,
    )
    if cross == "fit":
        joint = jf.Joint([[6e5, 4e3], [4e3, 5e3]], joint.damping, joint.dofs, joint.loss_factor)
    terms = joint_terms(2 * np.pi * beams.freq, joint.dofs, damping, cross)
    found = estimate_joint(with_noise(beams.gamma(joint), 1e-3), terms, cross)
    fitted = np.einsum("p,pfab->fab", found.theta, term_matrices(terms))
    np.testing.assert_allclose(fitted, joint.dynamic_stiffness(beams.freq), rtol=1e-6, atol=1e-3)
    assert found.converged
    assert found.excess < 1e-10


def test_reaches_the_bound_and_covers_the_truth(beams):
    """80 realisations at 2 %, noise unknown: RMSE near the bound and the standard errors, intervals that hold."""
    gamma = beams.gamma(beams.joint)
    fits = [
        identified(beams.freq, h, beams.joint.dofs, damping="viscous")
        for h in jf.realisations(gamma, 0.02, seed=5, count=80)
    ]
    bound = np.sqrt(np.diag(cramer_rao(gamma, beams.joint.dynamic_stiffness(beams.freq), terms_of(beams)))) * 0.02
    theta = np.array([list(fit.value.values()) for fit in fits])
    intervals = np.array([list(fit.confidence_interval(0.95).values()) for fit in fits])
    rmse = np.sqrt(((theta - TRUTH) ** 2).mean(axis=0))
    assert (rmse / bound < 1.3).all()
    inside = ((intervals[..., 0] < TRUTH) & (intervals[..., 1] > TRUTH)).mean()
    assert 0.91 < inside < 0.985
    np.testing.assert_allclose([fit.noise_level for fit in fits], 0.02, rtol=0.2)
    np.testing.assert_allclose([fit.residual_level for fit in fits], 0.02, rtol=0.2)


def test_the_band_mean_is_far_from_it(beams):
    """Why the fit exists: on the same data the mean of K* is several times worse."""
    h = jf.realisations(beams.gamma(beams.joint), 0.05, seed=5, count=20)
    fits = [identified(beams.freq, one, beams.joint.dofs, damping="viscous") for one in h]
    fitted = np.array([list(fit.value.values()) for fit in fits]) / TRUTH - 1
    lines = jf.inverse_substructuring(h.reshape(-1, 4, 4)).reshape(len(h), -1, 2, 2)
    means = [jf.band_mean(beams.freq, k, {"y": (200, 800), "theta": (650, 800)}, ["y", "theta"]) for k in lines]
    averaged = np.array([[*m.stiffness, *m.damping] for m in means]) / TRUTH - 1
    assert (np.sqrt((averaged**2).mean(axis=0)) > 1.5 * np.sqrt((fitted**2).mean(axis=0))).all()


def test_ignoring_cross_terms_costs_accuracy_but_no_bias(beams):
    gamma = beams.gamma(beams.joint)
    known = estimate_joint(with_noise(gamma, 0.02), terms_of(beams))
    unknown = estimate_joint(with_noise(gamma, 0.02), terms_of(beams), "ignore")
    own, least = (np.sqrt(np.diag(found.covariance)) for found in (unknown, known))
    assert (own >= least * 0.999).all()
    drawn = jf.realisations(gamma, 0.02, seed=6, count=60)
    found = [estimate_joint(with_noise(h, 0.02, smooth=gamma), terms_of(beams), "ignore").theta for h in drawn]
    assert (abs(np.mean(found, axis=0) - TRUTH) < 0.5 * own).all()


def test_ignoring_cross_terms_finds_the_diagonal_of_c(beams):
    """A coupled joint: the fit that ignores cross terms gives the diagonal of its compliance."""
    joint = jf.Joint([[6e5, 8e3], [8e3, 5e3]], None, beams.joint.dofs)
    found = estimate_joint(with_noise(beams.gamma(joint), 1e-3), terms_of(beams, "none"), "ignore")
    np.testing.assert_allclose(1 / found.theta, np.diag(np.linalg.inv(joint.stiffness)), rtol=1e-3)


def test_channels_instead_of_dofs(beams):
    """Measured through a transformation, noise on the channels: errors from the channels' noise and its covariance."""
    mix = np.array([[1.0, 0.02], [1.0, -0.02]])  # displacement and rotation to two points
    points = np.kron(np.eye(2), mix)
    h = points @ beams.gamma(beams.joint) @ points.T
    back = np.linalg.inv(points)
    variance = (0.002 * abs(h)) ** 2

    def fit(noisy):
        frfs = InterfaceFrfs.of(noisy, back @ h @ back.T, variance, back, back, reciprocal=True)
        return estimate_joint(frfs, terms_of(beams))

    error = np.sqrt(np.diag(fit(h).covariance))
    found = np.array([fit(noisy).theta for noisy in jf.realisations(h, 0.002, seed=9, count=60)])
    pull = (found - TRUTH) / error
    assert (abs(pull.mean(axis=0)) < 0.5).all()
    np.testing.assert_allclose(pull.std(axis=0), 1, rtol=0.3)


def test_more_channels_than_dofs_and_other_forces_than_responses(beams):
    """Three responses and two forces a side; the transform is a pair, h is rectangular."""
    responses = np.kron(np.eye(2), [[1.0, 0.03], [1.0, 0.0], [1.0, -0.03]])
    forces = np.kron(np.eye(2), [[1.0, 0.02], [1.0, -0.02]])
    h = responses @ beams.gamma(beams.joint) @ forces.T
    transform = (np.linalg.pinv(responses), np.linalg.pinv(forces))
    exact = identified(beams.freq, h, beams.joint.dofs, transform=transform)
    np.testing.assert_allclose(exact.stiffness, [6e5, 5e3], rtol=1e-4)
    noisy = identified(beams.freq, jf.pollute(h, 0.002, seed=3), beams.joint.dofs, transform=transform)
    intervals = noisy.confidence_interval(0.999)
    assert intervals["k_y"][0] < 6e5 < intervals["k_y"][1]
    assert intervals["k_theta"][0] < 5e3 < intervals["k_theta"][1]


def test_scatter_of_blocks_agrees_where_the_model_is_right(beams):
    gamma = beams.gamma(beams.joint)
    ratios = []
    for h in jf.realisations(gamma, 0.02, seed=11, count=60):
        found = estimate_joint(with_noise(h, 0.02, smooth=gamma), terms_of(beams))
        ratios.append(block_scatter(GroupLinearised(found.groups[0])).factor)
    np.testing.assert_allclose(np.sqrt(np.mean(ratios, axis=0)), 1, atol=0.4)


@pytest.mark.parametrize(("factor", "level"), [(100, 0.05), (1000, 0.01), (1e5, 0.02)])
def test_stiff_joints_end_in_an_interval_or_a_bound_that_holds(beams, factor, level):
    joint = jf.Joint(np.array([6e5, 5e3]) * factor, np.array([20, 1.5]) * factor, beams.joint.dofs)
    for seed in range(3):
        fit = identified(beams.freq, jf.pollute(beams.gamma(joint), level, seed=seed), joint.dofs, damping="viscous")
        intervals = fit.confidence_interval(0.999)
        for name, truth in (("k_y", joint.stiffness[0, 0]), ("k_theta", joint.stiffness[1, 1])):
            assert intervals[name][0] < truth < intervals[name][1]


def test_a_joint_found_too_stiff_does_not_confirm_itself(beams):
    """A draw at which M of the smooth FRFs is mostly their own error: 300 times stiffer, 5 %, 1 Hz lines."""
    joint = jf.Joint(np.array([6e5, 5e3]) * 300, np.array([20, 1.5]) * 300, beams.joint.dofs)
    fine = dataclasses.replace(beams, freq=np.arange(15.0, 801.0))
    gamma = fine.gamma(joint)
    rng = np.random.default_rng([0, 29])
    noise = (rng.standard_normal(gamma.shape) + 1j * rng.standard_normal(gamma.shape)) / np.sqrt(2)
    fit = identified(fine.freq, gamma * (1 + 0.05 * noise), joint.dofs, damping="viscous")
    intervals = fit.confidence_interval(0.95)
    for name, truth in (("k_y", joint.stiffness[0, 0]), ("k_theta", joint.stiffness[1, 1])):
        assert intervals[name][0] < truth < intervals[name][1]


def test_damping_is_chosen_for_each_dof(beams):
    """Viscous at one DOF, hysteretic at the other."""
    joint = jf.Joint([6e5, 5e3], [20, 0], beams.joint.dofs, loss_factor=[0, 0.2])
    fit = identified(beams.freq, jf.pollute(beams.gamma(joint), 0.01, seed=4), joint.dofs, damping="auto")
    assert list(fit.value) == ["k_y", "k_theta", "h_theta", "c_y"]
    for name, truth in (("c_y", 20), ("h_theta", 1e3)):
        low, high = fit.confidence_interval(0.999)[name]
        assert low < truth < high


def test_negative_damping_is_told(beams):
    """Conjugated FRFs: the fit is as good, and its damping has the wrong sign."""
    gamma = jf.pollute(beams.gamma(beams.joint), 0.01, seed=4).conj()
    fit = identified(beams.freq, gamma, beams.joint.dofs, damping="viscous", accept=["time-convention"])
    assert any("[damping-negative]" in text for text in fit.warnings)


def test_a_stiffness_that_varies_is_told(beams):
    k = beams.joint.dynamic_stiffness(beams.freq) * (beams.freq / 200)[:, None, None] ** 0.1
    gamma = jf.couple(beams.h_a, beams.h_b, k, beams.at, beams.at)
    dofs = beams.at + [4 + i for i in beams.at]
    gamma = jf.pollute(gamma[:, dofs][:, :, dofs], 0.01, seed=4)
    fit = identified(beams.freq, gamma, beams.joint.dofs, damping="viscous")
    assert any("[frequency-dependent]" in text for text in fit.warnings)
    right = jf.pollute(beams.gamma(beams.joint), 0.01, seed=4)
    assert not identified(beams.freq, right, beams.joint.dofs, damping="viscous").warnings


def test_no_joint_and_noise_alone_are_refused(beams):
    zero = np.zeros((beams.freq.size, 2, 2))
    at = np.array(beams.at)
    h_a, h_b = (h[:, at[:, None], at] for h in (beams.h_a, beams.h_b))
    apart = np.block([[h_a, zero], [zero, h_b]])
    with pytest.raises(ValueError, match="zero between sides j and k"):
        jf.identify(beams.freq, apart, beams.joint.dofs)
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(apart.shape) + 1j * rng.standard_normal(apart.shape)
    with pytest.raises(ValueError, match="consists of noise"):
        jf.identify(beams.freq, noise, beams.joint.dofs)


@pytest.mark.parametrize(("seed", "cross"), [(4, "ignore"), (15, "ignore"), (2, "zero"), (21, "zero")])
def test_damping_of_a_dof_found_rigid_is_open_and_the_others_are_known(beams, seed, cross):
    """Nothing shows the rate of a compliance that ends at zero, not even a step of the fit."""
    joint = jf.Joint([6e5, 5e9], [20.0, 0.0], beams.joint.dofs)
    gamma = jf.pollute(beams.gamma(joint), 0.05, seed=seed)
    fit = identified(beams.freq, gamma, joint.dofs, damping="viscous", cross=cross, noise=0.05)
    assert any("k_theta cannot be distinguished from rigid" in text for text in fit.warnings)
    limits = fit.confidence_interval(0.99)
    assert limits["c_theta"] == (-np.inf, np.inf)
    assert limits["k_theta"][1] == np.inf
    assert limits["k_y"][0] < 6e5 < limits["k_y"][1]
    assert all(np.isfinite(error) and error > 0 for error in fit.std_error.values())
