"""The compliance fit against the Cramer-Rao bound, computed by another route, and against its own promises."""

import numpy as np
import pytest

import jointfrf as jf
from cramer_rao import cramer_rao, term_matrices
from jointfrf.frf.noise_estimate import reciprocity_noise
from jointfrf.identification.compliance_fit.estimator import estimate, joint_basis
from jointfrf.identification.compliance_fit.intervals import jackknife_covariance


def bound_of(s, damping="viscous"):
    basis = joint_basis(2 * np.pi * s.freq, s.joint.dofs, damping, "zero")
    return cramer_rao(s.gamma(s.joint), s.joint.dynamic_stiffness(s.freq), basis)


@pytest.mark.parametrize("name", ["chains", "beams"])
def test_covariance_is_the_cramer_rao_bound(name, request):
    s = request.getfixturevalue(name)
    basis = joint_basis(2 * np.pi * s.freq, s.joint.dofs, "viscous", "zero")
    found = estimate(s.gamma(s.joint)[None], np.eye(2 * s.n), basis)
    bound = np.sqrt(np.diag(bound_of(s)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance[0])), bound, rtol=1e-3)


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
    basis = joint_basis(2 * np.pi * beams.freq, joint.dofs, damping, cross)
    found = estimate(beams.gamma(joint)[None], np.eye(4), basis, cross=cross)
    fitted = np.einsum("p,pfab->fab", found.theta[0], term_matrices(basis))
    np.testing.assert_allclose(fitted, joint.dynamic_stiffness(beams.freq), rtol=1e-6, atol=1e-3)
    assert found.converged[0]
    assert found.residual_level[0] < 1e-7


def spread(found, truth):
    return np.sqrt(((found.theta / truth - 1) ** 2).mean(axis=0))


def test_reaches_the_bound_and_covers_the_truth(beams):
    """200 realisations at 5 %: RMSE within 15 % of the bound and of the standard errors, intervals that hold."""
    truth = np.array([6e5, 5e3, 20, 1.5])
    basis = joint_basis(2 * np.pi * beams.freq, beams.joint.dofs, "viscous", "zero")
    h = jf.realisations(beams.gamma(beams.joint), 0.02, seed=5, count=200)
    level = reciprocity_noise(h)
    found = estimate(h, np.eye(4), basis, level=level, tolerance=0.3)
    bound = 0.02 * np.sqrt(np.diag(bound_of(beams))) / truth
    assert (spread(found, truth) / bound < 1.15).all()
    error = np.sqrt(np.einsum("raa->ra", found.covariance)) * np.maximum(level, found.residual_level)[:, None]
    inside = (abs(found.theta - truth) < 1.96 * error).mean(axis=0)
    assert (inside > 0.90).all()
    assert (inside < 0.99).all()
    np.testing.assert_allclose(level, 0.02, rtol=0.15)
    np.testing.assert_allclose(found.residual_level, 0.02, rtol=0.15)


def test_the_band_mean_is_far_from_it(beams):
    """Why the fit exists: on the same data the mean of K* is several times worse."""
    h = jf.realisations(beams.gamma(beams.joint), 0.05, seed=5, count=100)
    truth = np.array([6e5, 5e3, 20, 1.5])
    basis = joint_basis(2 * np.pi * beams.freq, beams.joint.dofs, "viscous", "zero")
    fitted = spread(estimate(h, np.eye(4), basis, tolerance=0.3), truth)
    lines = jf.inverse_substructuring(h.reshape(-1, 4, 4)).reshape(100, -1, 2, 2)
    means = [jf.band_mean(beams.freq, k, {"y": (200, 800), "theta": (650, 800)}, ["y", "theta"]) for k in lines]
    averaged = np.array([[*m.stiffness, *m.damping] for m in means]) / truth - 1
    assert (np.sqrt((averaged**2).mean(axis=0)) > 1.5 * fitted).all()


def test_ignoring_cross_terms_costs_accuracy_but_no_bias(beams):
    truth = np.array([6e5, 5e3, 20, 1.5])
    basis = joint_basis(2 * np.pi * beams.freq, beams.joint.dofs, "viscous", "ignore")
    h = jf.realisations(beams.gamma(beams.joint), 0.02, seed=6, count=100)
    found = estimate(h, np.eye(4), basis, cross="ignore", tolerance=0.3)
    own = 0.02 * np.sqrt(np.einsum("raa->ra", found.covariance)).mean(axis=0)
    assert (own / truth >= 0.02 * np.sqrt(np.diag(bound_of(beams))) / truth * 0.99).all()
    assert (abs(found.theta.mean(axis=0) - truth) < 0.5 * own).all()
    assert np.isnan(found.off_diagonal).all()


def test_points_instead_of_dofs(beams):
    """Measured through a transformation, noise on the points: the same answer, error bars from the points' noise."""
    mix = np.array([[1.0, 0.02], [1.0, -0.02]])  # displacement and rotation to two points
    points = np.kron(np.eye(2), mix)
    h = points @ beams.gamma(beams.joint) @ points.T
    back = np.linalg.inv(points)
    basis = joint_basis(2 * np.pi * beams.freq, beams.joint.dofs, "viscous", "zero")
    noisy = jf.realisations(h, 0.002, seed=9, count=60)
    found = estimate(noisy, back, basis, tolerance=0.3)
    truth = np.array([6e5, 5e3, 20, 1.5])
    error = np.sqrt(np.einsum("raa->ra", found.covariance)) * 0.002
    pull = (found.theta - truth) / error
    assert (abs(pull.mean(axis=0)) < 0.5).all()
    np.testing.assert_allclose(pull.std(axis=0), 1, rtol=0.35)


def test_jackknife_agrees_where_the_model_is_right(beams):
    basis = joint_basis(2 * np.pi * beams.freq, beams.joint.dofs, "viscous", "zero")
    h = jf.realisations(beams.gamma(beams.joint), 0.02, seed=11, count=60)
    found = estimate(h, np.eye(4), basis, tolerance=0.1)
    by_noise = np.einsum("raa->ra", found.covariance) * 0.02**2
    by_blocks = np.einsum("raa->ra", jackknife_covariance(found))
    np.testing.assert_allclose(np.sqrt(by_blocks.mean(axis=0) / by_noise.mean(axis=0)), 1, atol=0.6)
