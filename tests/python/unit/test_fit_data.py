"""What a fit keeps of the data behind it: regenerated FRFs, lines and their information, by other routes."""

import tracemalloc
import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.manifold.fit import fit_springs


@pytest.fixture(scope="module")
def exact(beams):
    return jf.identify(beams.freq, beams.gamma(beams.joint), ["y", "theta"])


@pytest.fixture(scope="module")
def noisy(beams):
    return jf.identify(beams.freq, jf.pollute(beams.gamma(beams.joint), 0.01, seed=5), ["y", "theta"])


def compliance_of(gamma, n):
    """C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj, which any FRFs with the joint between them give."""
    jj, jk, kj, kk = gamma[:, :n, :n], gamma[:, :n, n:], gamma[:, n:, :n], gamma[:, n:, n:]
    return kk @ np.linalg.solve(jk, jj) - kj


def test_frfs_of_the_joint_are_regenerated_as_they_are(exact, beams):
    gamma = beams.gamma(beams.joint)
    found = exact.data.regenerated(slice(0, None))
    np.testing.assert_allclose(found, gamma, rtol=1e-5, atol=1e-7 * abs(gamma).max())
    lines = np.einsum("ldd->ld", np.linalg.inv(beams.joint.dynamic_stiffness(beams.freq)))
    np.testing.assert_allclose(exact.data.line_compliance(), lines, rtol=1e-4)


def test_regenerated_frfs_have_the_joint_found_between_them(noisy, beams):
    found = noisy.data.regenerated(slice(10, 90))
    expected = np.linalg.inv(noisy.k_joint(beams.freq[10:90]))
    size = np.sqrt(np.einsum("ldd,lee->lde", abs(expected), abs(expected)))
    np.testing.assert_array_less(abs(compliance_of(found, 2) - expected) / size, 1e-6)
    np.testing.assert_allclose(found, found.swapaxes(1, 2), rtol=1e-12)
    # Nearer to the exact FRFs than the measured ones are.
    gamma = beams.gamma(beams.joint)[10:90]
    left, noise = (abs(h - gamma) / abs(gamma) for h in (found, noisy.data.measured[10:90]))
    assert np.sqrt((left**2).mean()) < 0.85 * np.sqrt((noise**2).mean())


def test_a_wrong_joint_does_not_regenerate_the_frfs(beams):
    coupled = jf.Joint([[6e5, 1e4], [1e4, 5e3]], [20, 1.5], ["y", "theta"])
    gamma = jf.pollute(beams.gamma(coupled), 0.005, seed=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        fits = [jf.identify(beams.freq, gamma, ["y", "theta"], cross=cross) for cross in ("zero", "fit")]
    left = [np.median(abs(fit.data.regenerated(slice(0, None)) - gamma) / abs(gamma)) for fit in fits]
    assert left[0] > 2 * left[1]
    # With cross terms, every entry of C is there.
    found = compliance_of(fits[1].data.regenerated(slice(0, None)), 2)
    expected = np.linalg.inv(fits[1].k_joint(beams.freq))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * abs(expected).max())
    assert fits[1].data.fitted.mean() > 0.95


def test_lines_between_compliances_scatter_about_the_joint(noisy, beams):
    lines = noisy.data.line_compliance()
    expected = np.einsum("ldd->ld", np.linalg.inv(beams.joint.dynamic_stiffness(beams.freq)))
    middle = np.median((lines / expected).real, axis=0)
    np.testing.assert_allclose(middle, 1, atol=0.05)


def test_information_is_what_the_variance_loses_without_a_line(beams, monkeypatch):
    """Against the covariance, computed anew with more weight on one line after the other."""
    kept = {}

    def remembered(problem):
        kept["fit"] = fit_springs(problem)
        return kept["fit"]

    monkeypatch.setattr("jointfrf.identification.identify.fit_springs", remembered)
    fit = jf.identify(beams.freq, jf.pollute(beams.gamma(beams.joint), 0.01, seed=5), ["y", "theta"])
    shares = fit.data.information()
    assert shares.shape == (beams.freq.size, len(fit.parameters))
    np.testing.assert_allclose(shares.sum(axis=0), 1)
    (group,) = kept["fit"].estimate.groups
    slope = group.joint.theta_slope(group.x)
    size = 1 / np.sqrt(np.diagonal(group.information))

    def variance(information):
        return np.diagonal(slope @ (size * np.linalg.inv(size[:, None] * information * size) * size[:, None]) @ slope.T)

    whole = variance(group.information)
    of_lines = group.of_lines().information
    for line in (3, 40, 77, 120):
        more = variance(group.information + 1e-4 * of_lines[line])
        lost = (whole - more) / whole / 1e-4
        np.testing.assert_allclose(lost, shares[line][group.which], rtol=5e-3, atol=1e-6)


def test_lines_outside_the_bands_are_not_fitted(beams):
    gamma = jf.pollute(beams.gamma(beams.joint), 0.01, seed=5)
    bands = {"y": (200.0, 800.0), "theta": [(15.0, 100.0), (300.0, 400.0)]}
    data = jf.identify(beams.freq, gamma, ["y", "theta"], bands=bands).data
    freq = beams.freq[(beams.freq <= 100) | (beams.freq >= 200)]
    assert not data.fitted[freq < 200, 0].any()
    assert not data.fitted[freq > 400, 1].any()
    assert data.fitted[(freq >= 300) & (freq <= 400)].mean() > 0.9


def test_measured_frfs_are_not_copied(beams):
    gamma = np.ascontiguousarray(jf.pollute(beams.gamma(beams.joint), 0.01, seed=5))
    fit = jf.identify(beams.freq, gamma, ["y", "theta"])
    assert fit.data.measured is gamma
    tracemalloc.start()
    fit.data.noise_variance(slice(0, 4))
    assert tracemalloc.get_traced_memory()[1] < gamma.nbytes / 4
    tracemalloc.stop()


def test_the_noise_is_that_of_the_frfs(noisy, beams):
    share = np.sqrt(noisy.data.noise_variance(slice(0, None))) / abs(beams.gamma(beams.joint))
    assert np.median(share) == pytest.approx(0.01, rel=0.1)


@pytest.mark.filterwarnings("ignore::jointfrf.IdentificationWarning")
def test_channels_are_named(beams):
    places = {i + 1: (0.01 * (i % 3), 0.0, 0.0) for i in range(6)}
    sides = jf.interface([1, 2, 3], [4, 5, 6], ["y", "theta_z"], places)
    h = jf.pollute(sides.modes @ beams.gamma(beams.joint) @ sides.modes.T, 1e-3, seed=4)
    fit = jf.identify(beams.freq, h, transform=sides)
    assert fit.data.force_names == ("1:+y", "2:+y", "3:+y", "4:+y", "5:+y", "6:+y")
    assert fit.data.interface is sides
    fit = jf.identify(beams.freq, h, ["y", "theta"], transform=sides.transform)
    assert fit.data.response_names == tuple(f"response {i}" for i in range(6))
    assert fit.data.interface is None
    four = np.linalg.inv(sides.modes[[0, 2, 3, 5]])
    fit = jf.identify(beams.freq, h[:, :, [0, 2, 3, 5]], transform=(sides, four))
    assert fit.data.response_names[0] == "1:+y"
    assert fit.data.force_names == tuple(f"force {i}" for i in range(4))
    sides = [jf.virtual_point([places[n] for n in own], [[0, 1, 0]] * 3, [0.01, 0, 0], ["y", "theta_z"])
             for own in ((1, 2, 3), (4, 5, 6))]  # fmt: skip
    fit = jf.identify(beams.freq, h, transform=jf.virtual_interface(*sides))
    assert fit.data.force_names == tuple(f"force {i}" for i in range(6))


def test_effects_of_hidden_errors_are_those_of_refits(beams):
    """A tenth of each: delay of 1 us, resonances at ten times the highest line, 1 % of noise in the force."""
    freq, omega = beams.freq, 2 * np.pi * beams.freq
    h = jf.pollute(beams.gamma(beams.joint), 0.002, seed=1)
    fit = jf.identify(freq, h, beams.joint.dofs, damping="viscous", noise=0.002)
    errors = {"delay": -1e-6j * omega, "resonance": (freq / (10 * freq.max())) ** 2, "force-noise": -0.01 + 0 * freq}
    for name, own in fit.data.hidden_errors().items():
        moved = h * (1 + errors[name] / 10)[:, None, None]
        other = jf.identify(freq, moved, beams.joint.dofs, damping="viscous", noise=0.002)
        for parameter, change in own.items():
            expected = 10 * (other.value[parameter] - fit.value[parameter])
            assert change == pytest.approx(expected, rel=0.03, abs=0.1 * fit.std_error[parameter])
