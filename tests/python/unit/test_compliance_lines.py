"""The diagonal of C on every line: against differences, against plain formulas, and against the Cramer-Rao bound."""

import numpy as np
import pytest

import jointfrf as jf
from cramer_rao import cramer_rao
from jointfrf.identification.manifold.coordinates import joint_terms
from jointfrf.identification.manifold.estimate import estimate_joint
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.on_manifold import FrfEntries, LineData
from jointfrf.identification.manifold.unknown_cross import compliance_lines

LEVEL = 1e-6


def line_data(gamma, measured=None, *, reciprocal=True, factor=None):
    """FRFs of small relative noise; `factor`: entries over their deviation are it times independent noise."""
    entries = FrfEntries.of(gamma.shape[1] // 2, reciprocal=reciprocal)
    smooth = entries.take(gamma)
    measured = smooth if measured is None else entries.take(measured)
    whitening = None if factor is None else np.linalg.inv(np.broadcast_to(factor, (len(gamma), *factor.shape)))
    return LineData(entries, measured, smooth, 1 / (LEVEL * abs(smooth)), whitening)


def both_compliances(gamma):
    """C from gamma_jk and from gamma_kj."""
    n = gamma.shape[1] // 2
    jj, jk, kj, kk = gamma[:, :n, :n], gamma[:, :n, n:], gamma[:, n:, :n], gamma[:, n:, n:]
    return kk @ np.linalg.inv(jk) @ jj - kj, jj @ np.linalg.inv(kj) @ kk - jk


@pytest.fixture(params=[True, False], ids=["reciprocal", "any"])
def gamma(request, random_lines):
    g = random_lines(300, 4)
    return (g + g.swapaxes(1, 2) if request.param else g), request.param


def test_values_are_those_of_the_measured_frfs_to_first_order(gamma):
    smooth, reciprocal = gamma
    rng = np.random.default_rng(1)
    change = 1e-6 * rng.standard_normal(smooth.shape) * smooth
    measured = smooth + (change + change.swapaxes(1, 2) if reciprocal else change)
    _, plain = compliance_lines(line_data(smooth, measured, reciprocal=reciprocal))
    first, second = (np.einsum("laa->la", c) for c in both_compliances(measured))
    if reciprocal:
        np.testing.assert_allclose(plain.value, first, rtol=1e-8)
    else:
        np.testing.assert_allclose(plain.apart, first - second, rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize("correlated", [False, True])
def test_covariance_is_that_of_noise(gamma, correlated):
    """The best linear estimate, written out with derivatives by differences and a general least squares."""
    smooth, reciprocal = gamma[0][:4], gamma[1]
    entries = FrfEntries.of(2, reciprocal=reciprocal)
    q = entries.rows.size
    rng = np.random.default_rng(2)
    factor = np.eye(q) + (np.tril(0.5 * rng.standard_normal((q, q))) if correlated else 0)
    data = line_data(smooth, reciprocal=reciprocal, factor=factor if correlated else None)
    found = compliance_lines(data)

    def all_entries(values):
        c = both_compliances(entries.matrix(values))
        return np.concatenate([x.reshape(len(values), -1) for x in (c if not reciprocal else c[:1])], axis=1)

    columns = []
    for e in range(q):
        step = 1e-6 * abs(data.smooth) * (np.arange(q) == e)
        columns.append((all_entries(data.smooth + step) - all_entries(data.smooth - step)) / 2e-6 * LEVEL)
    slope = np.stack(columns, axis=2) @ factor
    for lines, symmetric in zip(found, (True, False), strict=True):
        # Unknown: the diagonal of C, and its cross terms: of one symmetric C, of one C, or each for itself.
        if reciprocal:
            design = np.array([[1, 0, 0, 0], [0, 0, 0, 1], [0, 1, 1, 0]] if symmetric else np.eye(4)[[0, 3, 1, 2]]).T
        else:
            one, apart = np.eye(4)[[0, 3, 1, 2]], np.eye(8)
            design = (
                np.hstack([one, one]).T if symmetric else np.vstack([np.hstack([one, one])[:2], apart[[1, 2, 5, 6]]]).T
            )
        for s, covariance in zip(slope, lines.covariance, strict=True):
            weight = np.linalg.inv(s @ s.conj().T)
            expected = np.linalg.inv(design.T @ weight @ design)[:2, :2]
            size = np.sqrt(np.outer(expected.diagonal().real, expected.diagonal().real))
            np.testing.assert_allclose(covariance / size, expected / size, atol=1e-5)


def test_a_singular_line_is_nan_and_the_others_are_not(gamma):
    smooth, reciprocal = gamma[0].copy(), gamma[1]
    smooth[7, :2, 2:] = smooth[7, 2:, :2] = 1.0
    for lines in compliance_lines(line_data(smooth, reciprocal=reciprocal)):
        assert np.isnan(lines.value[7]).all()
        assert np.isfinite(np.delete(lines.covariance, 7, axis=0)).all()


def test_covariance_is_the_cramer_rao_bound_with_unknown_cross_terms(beams):
    gamma = beams.gamma(beams.joint)
    terms = joint_terms(2 * np.pi * beams.freq, beams.joint.dofs, "viscous", "zero")
    one = np.eye(4)
    frfs = InterfaceFrfs.of(gamma, gamma, (1e-4 * abs(gamma)) ** 2, one, one, reciprocal=True)
    found = estimate_joint(frfs, terms, "ignore")
    k = beams.joint.dynamic_stiffness(beams.freq)
    bound = 1e-4 * np.sqrt(np.diag(cramer_rao(gamma, k, terms, unknown_cross=True)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), bound, rtol=1e-3)
    known = 1e-4 * np.sqrt(np.diag(cramer_rao(gamma, k, terms)))
    assert (bound > 1.02 * known).all()


def identified(freq, gamma, dofs, **options):
    with pytest.warns(jf.IdentificationWarning):
        return jf.identify(freq, gamma, dofs, damping="none", **options)


def test_points_that_are_not_one_are_told(beams):
    """Side k is described at a point 30 mm aside: C is not symmetric; its diagonal is fitted all the same."""
    joint = jf.Joint([6e5, 5e3], None, beams.joint.dofs)
    aside = np.eye(4)
    aside[2, 3] = 0.03
    gamma = aside @ beams.gamma(joint) @ aside.T
    diagonal = np.median(np.einsum("laa->la", jf.joint_compliance(gamma)).real, axis=0)
    fit = identified(beams.freq, jf.pollute(gamma, 0.01, seed=3), joint.dofs, cross="ignore")
    np.testing.assert_allclose(fit.stiffness, 1 / diagonal, rtol=0.03)
    assert any("[compliance-unsymmetric]" in text for text in fit.warnings)


def test_a_compliance_that_varies_is_averaged_and_told(beams):
    """By up to 30 % from line to line, far more than the noise: precise lines do not decide alone."""
    rng = np.random.default_rng(5)
    c = np.array([1 / 6e5, 1 / 5e3]) * (1 + 0.3 * rng.uniform(-1, 1, (beams.freq.size, 2)))
    k = np.einsum("la,ab->lab", 1 / c, np.eye(2)).astype(complex)
    at = beams.at + [4 + i for i in beams.at]
    gamma = jf.couple(beams.h_a, beams.h_b, k, beams.at, beams.at)[:, at][:, :, at]
    fit = identified(beams.freq, jf.pollute(gamma, 1e-4, seed=3), beams.joint.dofs, cross="ignore", noise=1e-4)
    np.testing.assert_allclose(1 / fit.stiffness, c.mean(axis=0), rtol=0.05)
    for name, truth in (("k_y", 6e5), ("k_theta", 5e3)):
        low, high = fit.confidence_interval(0.99)[name]
        assert low < truth < high
        assert high - low > 0.02 * truth
    assert any("[compliance-scatter]" in text for text in fit.warnings)
    assert any("[residual-large]" in text for text in fit.warnings)


def test_a_joint_of_the_wrong_form_converges_and_says_so(beams):
    """Strong cross terms that are taken for zero: the constants of the diagonal of C, and a misfit."""
    joint = jf.Joint([[6e5, 5e4], [5e4, 5e3]], None, beams.joint.dofs)
    gamma = jf.pollute(beams.gamma(joint), 0.01, seed=2)
    fit = identified(beams.freq, gamma, joint.dofs, cross="zero")
    assert not any("[not-converged]" in text for text in fit.warnings)
    assert fit.test.is_large
    # One message for both the misfit and what was done about it.
    (text,) = fit.warnings
    assert text.startswith("no joint without cross terms fits y, theta, so cross terms were ignored. Fit them")
    assert text.endswith("[cross-terms-ignored]")
    np.testing.assert_allclose(1 / fit.stiffness, np.diag(np.linalg.inv(joint.stiffness)), rtol=0.02)


def test_the_most_precise_lines_do_not_decide_alone(beams):
    """Eight lines of a sixth of the noise, on which a local mode doubles the compliance."""
    n = beams.freq.size
    precise = np.arange(n) % 20 == 7
    c = np.tile([1 / 6e5, 1 / 5e3], (n, 1))
    c[precise, 1] *= 2
    k = np.einsum("la,ab->lab", 1 / c, np.eye(2)).astype(complex)
    at = beams.at + [4 + i for i in beams.at]
    gamma = jf.couple(beams.h_a, beams.h_b, k, beams.at, beams.at)[:, at][:, :, at]
    level = np.where(precise, 0.005, 0.03)[:, None, None]
    noisy = gamma + level / 0.03 * (jf.pollute(gamma, 0.03, seed=3) - gamma)
    fit = identified(beams.freq, noisy, beams.joint.dofs, cross="ignore", noise=(level * abs(gamma)) ** 2)
    low, high = fit.confidence_interval(0.95)["k_theta"]
    assert low < 1 / c[:, 1].mean() < high
    assert any("theta by" in text and "[compliance-scatter]" in text for text in fit.warnings)
