"""Errors of channels that are smooth over frequency: found from h_pq and h_qp, and carried into intervals."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import jointfrf as jf
from jointfrf.frf.calibration import calibration_errors, shows_calibration
from jointfrf.identification.manifold.fit import fit_springs
from jointfrf.identification.manifold.prepare import FitOptions, prepare_compliance
from jointfrf.identification.minimise import minimise
from jointfrf.identification.mixed import Effect, added_by, smooth_effects, student_factor
from jointfrf.identification.model.fit import fit_assembly
from jointfrf.identification.model.prepare import Channels, prepare_model_fit
from jointfrf.identification.model.uncertainty import ModelLinearised
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import as_measured
from jointfrf.identification.residual_test import check_residual
from jointfrf.workbench.report.fit_page import ReportOptions, fit_document

FREQ = np.arange(15.0, 801.0)
SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
TRUE = jf.Joint([6e5, 5e3], [20.0, 1.5], ["y", "theta"])
CHANNELS = ("A/7:y", "A/13:y", "B/1:y", "B/10:y")
NOISE = 0.002


def assembly(joint=TRUE, **more):
    a = jf.Substructure(jf.beam(0.3, 12, ends=("clamped", "free"), **SECTION), ("13:y", "13:theta"), **more)
    b = jf.Substructure(jf.beam(0.225, 9, **SECTION), ("1:y", "1:theta"), **more)
    return jf.Assembly(a, b, joint)


@pytest.fixture(scope="module")
def h():
    ends = ("A/13:y", "A/13:theta", "B/1:y", "B/1:theta")
    return assembly().receptance(FREQ, ends, ends)


@pytest.fixture(scope="module")
def between_points():
    return assembly().receptance(FREQ, CHANNELS, CHANNELS)


def circular(shape, seed):
    rng = np.random.default_rng(seed)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def noisy(h, level=NOISE, seed=0):
    return h * (1 + level * circular(h.shape, seed))


def gains(seed, size=0.005):
    return 1 + size * np.random.default_rng(seed).standard_normal(4)


def test_gains_of_hits_are_found_with_their_variance(h):
    found = [calibration_errors(FREQ, noisy(h * gains(seed), seed=seed)) for seed in range(40)]
    gain = [one.channel[0, 0] for one in found]
    # A mean of 40 variances of three degrees of freedom is known to 13 %.
    assert np.mean(gain) == pytest.approx(0.005**2, rel=0.4)
    assert all(0 < one.channel_degrees[0, 0] <= 3 for one in found)
    assert np.mean([one.channel[1].sum() + one.own.sum() for one in found]) < 0.01 * 0.005**2


def test_delays_are_told_from_gains(h):
    late = np.array([0.0, 2e-6, -1e-6, 3e-6])
    found = calibration_errors(FREQ, noisy(h * np.exp(-2j * np.pi * FREQ[:, None, None] * late)))
    assert found.channel[0].sum() == 0
    assert found.channel[1, 0] == pytest.approx(np.var(late, ddof=1) * (4 * np.pi**2 * (FREQ**2).mean()), rel=0.05)


def test_a_drift_is_smooth_and_taken_off(h):
    drift = 0.01 * np.cos(2 * np.pi * FREQ[:, None] / 800 + np.arange(4))[:, None, :]
    measured = noisy(h * (1 + drift))
    found = calibration_errors(FREQ, measured)
    assert found.level("channel")[0] == pytest.approx(0.01 * np.sqrt(0.5), rel=0.5)
    left = found.without(FREQ, measured)
    relative = (left - left.swapaxes(1, 2))[:, 0, 1:] / h[:, 0, 1:]
    # What is left of the differences is their noise.
    assert np.sqrt((abs(relative) ** 2).mean()) == pytest.approx(np.sqrt(2) * NOISE, rel=0.05)
    np.testing.assert_allclose(left + left.swapaxes(1, 2), measured + measured.swapaxes(1, 2), rtol=1e-12)
    noise = jf.estimate_noise(FREQ, measured)
    assert noise.calibration is not None
    assert noise.inflation < 1.3
    assert noise.level == pytest.approx(NOISE, rel=0.1)


def test_own_factors_are_not_those_of_channels(h):
    own = 1 + 0.01 * np.random.default_rng(3).standard_normal((4, 4))
    found = calibration_errors(FREQ, noisy(h * own))
    p, q = np.triu_indices(4, 1)
    incidence = np.eye(4)[p] - np.eye(4)[q]
    apart = (own - own.T)[p, q]
    apart = apart - incidence @ np.linalg.pinv(incidence) @ apart
    assert found.own[0, 0] == pytest.approx((apart**2).sum() / 6, rel=0.05)
    assert found.own_degrees[0, 0] == pytest.approx(3, rel=0.01)
    assert found.channel[0, 0] == 0


def of_noise(kind, h, seed):
    if kind == "complex":
        return noisy(h, 0.01, seed)
    if kind == "common to a hit":
        return noisy(h * (1 + 0.03 * circular((len(h), 1, 4), seed)), 0.001, seed + 1)
    if kind == "common to a line":
        return noisy(h * (1 + 0.03 * circular((len(h), 1, 1), seed)), 0.001, seed + 1)
    sums = np.cumsum(circular((len(h) + 25, 4, 4), seed), axis=0)
    return h * (1 + 0.02 * (sums[25:] - sums[:-25]) / 5)


@pytest.mark.parametrize("kind", ["complex", "common to a hit", "common to a line", "correlated over 25 lines"])
def test_noise_is_rarely_taken_for_calibration(h, kind):
    """Sixteen tests at 0.1 %: in 1.6 % of the draws at least one; slow functions have more of correlated noise."""
    found = sum(calibration_errors(FREQ, of_noise(kind, h, 10 * seed)) is not None for seed in range(60))
    assert found <= stats.binom.ppf(0.999, 60, 0.1 if "25" in kind else 0.016)


def resonant(which, resonance=8e3):
    """Factor of FRFs, by sensors that resonate, damping 1/60."""
    x = FREQ[:, None, None] / resonance
    return np.where(np.array(which, bool)[:, None], 1 / (1 - x**2 + 1j * x / 30), 1)


def test_resonances_of_sensors_are_one_function_of_frequency(h):
    """Differences by the square of frequency, from two of four sensors; mean squares over the band by hand."""
    found = calibration_errors(FREQ, noisy(h * resonant([1, 0, 1, 0])))
    assert found.resonant
    assert found.resonance() == pytest.approx(8e3, rel=0.05)
    gain = found.functions(FREQ)[0]
    np.testing.assert_allclose(gain[0], FREQ**2 / np.sqrt((801**5 - 15**5) / 5 / 786), rtol=0.01)
    np.testing.assert_allclose(gain @ gain.T / FREQ.size, np.eye(8), atol=0.06)
    # Two and two: a variance of 4 / 12 of the square of the relative error.
    assert found.channel[0, 0] == pytest.approx(np.mean((FREQ / 8e3) ** 4) / 3, rel=0.1)
    assert not found.channel[0, 1:].any()
    shared = {kind: variance for kind, variance, _ in found.kinds()}["common"]
    np.testing.assert_array_equal(shared, found.channel * (np.arange(8) == 0))


def test_gains_drifts_and_noise_are_no_resonances(h):
    half_a_wave = np.cos(np.pi * FREQ / 800)[:, None, None]
    for seed in range(20):
        for factor in (gains(seed), 1 + (gains(seed, 0.01) - 1) * half_a_wave):
            assert not calibration_errors(FREQ, noisy(h * factor, seed=seed)).resonant


@pytest.mark.parametrize("which", [[1, 0, 0, 0], [1, 1, 0, 1]])
def test_intervals_allow_for_resonances_of_some_sensors(h, which):
    fit = jf.identify(FREQ, noisy(h * resonant(which), 0.01), TRUE.dofs, damping="viscous")
    (said,) = (one for one in fit.findings if one.code == "calibration-errors")
    assert said.variant == "resonant"
    interval = fit.confidence_interval()
    for name, true in {"k_y": 6e5, "k_theta": 5e3, "c_y": 20.0, "c_theta": 1.5}.items():
        low, high = interval[name]
        assert low <= true <= high


def test_what_cannot_show_calibration(h):
    polluted = noisy(h * gains(1))
    assert calibration_errors(FREQ, (polluted + polluted.swapaxes(1, 2)) / 2) is None
    assert calibration_errors(FREQ[:30], polluted[:30]) is None
    assert shows_calibration(polluted)
    assert not shows_calibration(polluted[:30])
    assert not shows_calibration((polluted + polluted.swapaxes(1, 2)) / 2)
    unsorted = np.random.default_rng(0).permutation(FREQ.size)
    one, other = calibration_errors(FREQ, polluted), calibration_errors(FREQ[unsorted], polluted[unsorted])
    np.testing.assert_allclose(one.channel, other.channel)


def fit_at_joint(measured):
    options = FitOptions("viscous", "zero", True)
    measured = as_measured(FREQ, measured, square=False)
    return fit_springs(prepare_compliance(measured, TRUE.dofs, None, None, NoiseOptions(), options))


def errors_of_each(found, freq, size):
    """Every function of every channel, and of every FRF: its variance, and the factor of the FRFs."""
    functions = found.functions(freq)
    for part, number in np.ndindex(*functions.shape[:2]):
        change = size * (1j if part else 1.0) * functions[part, number][:, None, None]
        for unit in np.eye(4) if found.channel[part, number] else ():
            yield found.channel[part, number] / 2, 1 + change * unit[:, None]
            yield found.channel[part, number] / 2, 1 + change * unit
        for p, q in np.ndindex(4, 4) if found.own[part, number] else ():
            yield found.own[part, number], 1 + change * np.outer(np.eye(4)[p], np.eye(4)[q])


@pytest.mark.long  # of gains with models below
def test_covariance_at_the_joint_is_that_of_refits(h):
    """J Var J^T against a refit for each error, so small that no line enters or leaves the fit."""
    own = 1 + 0.001 * np.random.default_rng(3).standard_normal((4, 4))
    measured = noisy(h * gains(2, 0.02) * own)
    fit = fit_at_joint(measured)
    (known,) = fit.known.groups
    added = known.at.group.joint.theta_slope(known.at.group.x) @ known.smooth_added.covariance
    added = added @ known.at.group.joint.theta_slope(known.at.group.x).T
    errors = fit.problem.noise.calibration
    size, total = 1e-4, np.zeros((4, 4))
    assert errors.channel.any()
    assert errors.own.any()
    for variance, factor in errors_of_each(errors, FREQ, size):
        other = fit_springs(replace(fit.problem, frfs=fit.problem.frfs._replace(measured=measured * factor)))
        step = (other.estimate.theta - fit.estimate.theta) / size
        total += variance * np.outer(step, step)
    np.testing.assert_allclose(np.sqrt(np.diag(added)), np.sqrt(np.diag(total)), rtol=0.05)


def test_covariance_with_models_is_that_of_refits(between_points):
    freq, measured = FREQ[::8], noisy(between_points * gains(4))[::8]
    problem = prepare_model_fit(freq, measured, assembly(exact=True), Channels(CHANNELS, CHANNELS), NoiseOptions(), ())
    # Such gains are errors of a fit, too, which takes them off: here they stay.
    found = fit_assembly(problem).problem
    start = found.vector.to_coordinates(found.vector.values)
    minimum = minimise(found.likelihood, start)
    errors = found.noise.calibration
    at = ModelLinearised.of(found.likelihood, minimum, found.noise.inflation)
    slope = found.vector.slope(minimum.x)
    covariance = added_by(smooth_effects(at, errors, freq, (4, 4), np.ones((1, freq.size))), at).covariance
    covariance = covariance * np.outer(slope, slope)
    size, total = 1e-3, np.zeros((4, 4))
    for variance, factor in errors_of_each(errors, freq, size):
        other = minimise(replace(found, measured=measured * factor).likelihood, minimum.x)
        step = (found.vector.to_values(other.x) - found.vector.to_values(minimum.x)) / size
        total += variance * np.outer(step, step)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), np.sqrt(np.diag(total)), rtol=0.1)


def test_the_residual_of_a_fit_with_models_allows_for_gains(between_points):
    """A residual of gains of 0.5 % is more than twice the noise, and no reason to doubt the models."""
    freq, measured = FREQ[::4], noisy(between_points * gains(1), seed=1)[::4]
    fit = jf.identify_model(freq, measured, assembly(exact=True), CHANNELS, CHANNELS)
    assert any(one.code == "calibration-errors" for one in fit.findings)
    assert fit.residual_is_noise


def test_intervals_allow_for_gains_and_say_so(h):
    fits = {}
    for name, factor in (("exact", 1.0), ("off", gains(5))):
        fits[name] = jf.identify(FREQ, noisy(h * factor), TRUE.dofs, damping="viscous")
    assert not any(one.code == "calibration-errors" for one in fits["exact"].findings)
    (said,) = (one for one in fits["off"].findings if one.code == "calibration-errors")
    assert said.severity == "note"
    assert "h_pq and h_qp differ smoothly over frequency, of channels by 0." in said.text
    low, high = fits["off"].confidence_interval()["k_y"]
    assert low < 6e5 < high
    assert (high - low) / 6e5 > 0.005
    assert fits["off"].std_error["k_y"] > 20 * fits["exact"].std_error["k_y"]
    assert fits["off"].test.is_noise


def test_noise_that_was_given_does_not_hide_gains(h):
    measured = noisy(h * gains(5))
    fit = jf.identify(FREQ, measured, TRUE.dofs, damping="viscous", noise=NOISE)
    assert any(one.code == "calibration-errors" for one in fit.findings)
    low, high = fit.confidence_interval()["k_y"]
    assert low < 6e5 < high


def test_student_for_few_channels():
    one = np.ones(1)
    squares = lambda degrees: (stats.t.ppf(0.975, degrees) / stats.norm.ppf(0.975)) ** 2  # noqa: E731
    np.testing.assert_allclose(student_factor(1e-9 * one, one, 3 * one), squares(3), rtol=1e-6)
    np.testing.assert_allclose(student_factor(4 * one, one, 3 * one), squares(75), rtol=1e-6)
    # As wide as the interval of what is added alone, at least: it has a half of the variance.
    np.testing.assert_allclose(student_factor(one, one, 3 * one), squares(3) / 2, rtol=1e-6)
    np.testing.assert_allclose(student_factor(one, 0 * one, np.inf * one), 1)


def test_variances_of_effects_add_up():
    """By the definition, in coordinates whose covariance is known; parameters share their errors."""
    rng = np.random.default_rng(0)
    half = rng.standard_normal((3, 3))
    at = SimpleNamespace(covariance=half @ half.T, slope=np.diag([2.0, 1.0, 0.5]))
    effects = [
        Effect(rng.standard_normal((5, 4, 3)), 0.3, 3.0, 2.0),
        Effect(rng.standard_normal((2, 4, 3)), 0.1),
    ]
    added = added_by(effects, at)
    steps = [one.gradient.sum(axis=1) @ at.covariance for one in effects]
    own = [variance * step.T @ step for variance, step in zip((0.3, 0.1), steps, strict=True)]
    np.testing.assert_allclose(added.covariance, sum(own))
    np.testing.assert_allclose(added.degrees, 3)
    np.testing.assert_allclose(added.estimated, np.diag(own[0]) / np.diag(sum(own)))
    assert added.squares == pytest.approx(0.6)
    assert added.squares_error == pytest.approx(0.6 * np.sqrt(2 / 3))


def test_parts_of_the_band_differ_by_effects_that_move_them_apart():
    """A unit error that moves both halves alike leaves no difference; one that moves them apart, twice its own."""
    at = np.array([[1.0]])
    for gradient, apart in ((np.ones((1, 2, 1)) / 2, 0.0), (np.array([[[0.5], [-0.5]]]), 1.0)):
        found = Effect(gradient, 4.0).between(2 * np.ones((2, 1, 1)), np.array([True, True]), at)
        np.testing.assert_allclose(found[:, 0, 0], 4 * apart, atol=1e-12)


# In one draw of ten some part of the band exceeds its noise by chance.
@pytest.mark.filterwarnings("ignore:.*residual-large:jointfrf.errors.IdentificationWarning")
@pytest.mark.filterwarnings("ignore:.*model-error:jointfrf.errors.IdentificationWarning")
def test_scatter_between_lines_sees_noise_that_frfs_share(between_points):
    """Noise of a line common to all FRFs: 16 FRFs say as much of it as one."""
    shared = between_points * (1 + 0.03 * circular((FREQ.size, 1, 1), 7))
    # Noise hides errors of models and gains, too, which are then in both intervals: here there are none.
    models = assembly(exact=True)
    fit = jf.identify_model(FREQ, noisy(shared), models, CHANNELS, CHANNELS)
    apart = jf.identify_model(FREQ, noisy(between_points, 0.03), models, CHANNELS, CHANNELS)
    for name in ("k_y", "c_y", "k_theta", "c_theta"):
        assert 1.3 < fit.std_error[name] / apart.std_error[name] < 4.5


@pytest.mark.parametrize("seed", range(5))
def test_a_residual_of_noise_that_frfs_share_is_noise(seed):
    shared = circular((FREQ.size, 1, 1), seed) + 0.3 * circular((FREQ.size, 4, 4), seed + 50)
    shared /= np.sqrt(1.09)
    assert check_residual(shared, FREQ, np.zeros(4), parameters=4, inflation=1.0, is_given=False).is_noise
    sums = np.cumsum(circular((FREQ.size + 50, 4, 1), seed), axis=0)
    slow = (sums[50:] - sums[:-50]) / np.sqrt(50)
    assert check_residual(slow, FREQ, np.zeros(4), parameters=4, inflation=50.0, is_given=False).is_noise
    assert not check_residual(1.5 * shared, FREQ, np.zeros(4), parameters=4, inflation=1.0, is_given=False).is_noise


def windowed(decay):
    """Receptance at i w + decay of two chains with a joint, by the definition."""
    freq = np.linspace(0.5, 10, 300)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    n, s = 4, 2j * np.pi * freq + decay
    stiffness, damping, mass = np.zeros((3, n, n))
    for model, at in ((a, slice(0, 2)), (b, slice(2, 4))):
        for whole, name in ((stiffness, "stiffness"), (damping, "damping"), (mass, "mass")):
            part = getattr(model, name)
            whole[at, at] = part.toarray() if hasattr(part, "toarray") else part
    pair = np.array([0.0, 1.0, -1.0, 0.0])
    stiffness += 2000.0 * np.outer(pair, pair)
    damping += 30.0 * np.outer(pair, pair)
    z = stiffness + s[:, None, None] * damping + (s**2)[:, None, None] * mass
    return freq, np.linalg.inv(z)[:, 1:3, 1:3]


def test_an_exponential_window_is_taken_off():
    freq, h = windowed(3.0)
    measured = jf.pollute(h, 0.01, seed=1)
    seen = jf.identify(freq, measured, ["x"], damping="viscous")
    fit = jf.identify(freq, measured, ["x"], damping="viscous", window_decay=3.0)
    assert seen.value["k_x"] == pytest.approx(2000 + 3 * 30, rel=0.005)
    assert fit.value["k_x"] == pytest.approx(seen.value["k_x"] - 3 * seen.value["c_x"], rel=1e-12)
    assert fit.value["c_x"] == seen.value["c_x"]
    low, high = fit.confidence_interval()["k_x"]
    assert low < 2000 < high < 2060
    assert fit.std_error["k_x"] == pytest.approx((high - low) / 2 / 1.96, rel=0.05)
    assert fit.derived("k_x + 3 * c_x").value == pytest.approx(seen.value["k_x"])
    assert any("[window-removed]" in text for text in fit.notes)


def test_windows_that_cannot_be_taken_off(h):
    with pytest.raises(ValueError, match="window_decay must not be negative, not -1"):
        jf.identify(FREQ, h, TRUE.dofs, window_decay=-1.0)
    laws = jf.LawJoint({"y": jf.SpringLaw(1e5), "theta": jf.SpringLaw(1e3)})
    with pytest.raises(ValueError, match="springs and dampers, not laws; leave out joint"):
        jf.identify(FREQ, h, joint=laws, window_decay=1.0)


def said_of_blind_spots(fit):
    (section,) = (one for one in fit_document(fit, ReportOptions()).sections if one.key == "blind")
    assert section.heading == "Errors that this test cannot show"
    return section.parts[0].sentences


def test_the_page_says_what_the_test_cannot_know(h, between_points):
    """By what h_pq and h_qp say: they differ, they agree, they were not both measured."""
    off, agree = (jf.identify(FREQ, noisy(h * one), TRUE.dofs, damping="viscous") for one in (gains(5), 1.0))
    apart = jf.identify_model(FREQ, noisy(between_points)[:, :, :2], assembly(exact=True), CHANNELS, CHANNELS[:2])
    first = [said_of_blind_spots(fit)[0] for fit in (off, agree, apart)]
    assert first[0].startswith("Sensors and hammers of the same DOFs differ by what the note on calibration says.")
    assert first[1].startswith("h_pq and h_qp differ by no more than noise: sensors and hammers agree.")
    assert first[2].startswith("No h_pq and h_qp were both measured on lines enough")
    (delay,) = (text for text in said_of_blind_spots(agree) if "1 µs" in text)
    assert re.search(r"In this test 1 µs changes k_y by [-+]0\.\d+ %", delay)
    for fit in (off, apart):
        rest = " ".join(said_of_blind_spots(fit)[1:])
        for word in ("A delay of all impacts", "resonate", "H1 estimates", "exp(-σt)", "Hann", "1 mm"):
            assert word in rest


def decaying_noise(shape, seed, decay=5.0, length=2.0):
    """Unit noise of lines whose records were multiplied by a decaying window: neighbouring lines share it."""
    rng, n = np.random.default_rng(seed), 4 * shape[0]
    window = np.exp(-decay * length * np.arange(n) / n)
    spectrum = np.fft.fft(rng.standard_normal((n, *shape[1:])) * window[:, None, None], axis=0)
    return spectrum[1 : shape[0] + 1] / np.sqrt(np.square(window).sum())


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_zero_frfs_is_no_calibration(h, seed):
    """Extension x and bending y, theta of straight beams are not coupled: FRFs between them are noise."""
    bar = jf.chain([1, 1, 1], [4e7, 4e7, 4e7], [200, 200, 200], ground="start").receptance(FREQ)[:, -1:, -1:]
    both = jf.couple(bar, bar, jf.Joint([2e7], [100.0], ["x"]).dynamic_stiffness(FREQ), [0], [0])
    own = np.zeros((FREQ.size, 6, 6), np.complex128)
    own[np.ix_(range(FREQ.size), [0, 3], [0, 3])] = both
    own[np.ix_(range(FREQ.size), [1, 2, 4, 5], [1, 2, 4, 5])] = h
    size = np.median(abs(np.einsum("lpp->lp", own)), axis=0)
    noise = 0.01 * np.sqrt(np.outer(size, size)) * decaying_noise(own.shape, seed)
    found = calibration_errors(FREQ, own + noise)
    assert found is None or not found.own.any()
    alone = jf.identify(FREQ, h + noise[:, [1, 2, 4, 5]][:, :, [1, 2, 4, 5]], ["y", "theta"], damping="viscous")
    together = jf.identify(FREQ, own + noise, ["x", "y", "theta"], damping="viscous")
    for name in ("k_y", "k_theta"):
        widths = [np.ptp(fit.confidence_interval()[name]) for fit in (alone, together)]
        assert 0.7 < widths[1] / widths[0] < 1.5
