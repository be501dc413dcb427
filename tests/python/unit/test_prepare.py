"""The arguments of `identify`, checked and put into a typed problem."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.manifold.prepare import FitOptions, prepare_compliance
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import as_measured

OPTIONS = FitOptions("viscous", "zero", True)
#: From points 20 mm apart on each side of a joint of two DOFs to y and theta, and back.
POINTS = np.kron(np.eye(2), [[1.0, 0.01], [1.0, -0.01]])
TO_JOINT = np.linalg.inv(POINTS)


def measured(s, level=0.01):
    return as_measured(s.freq, jf.pollute(s.gamma(s.joint), level, seed=3), square=False)


def prepared(s, **change):
    arguments = dict(measured=measured(s), dofs=["y", "theta"], bands=None, transform=None, noise=NoiseOptions())
    return prepare_compliance(**(arguments | dict(options=OPTIONS) | change))


def test_lines_outside_all_bands_are_left_out_and_each_dof_keeps_its_own(beams):
    problem = prepared(beams, bands={"y": (200, 400), "theta": [(300, 500), (700, 800)]})
    freq = problem.freq_hz
    assert freq.min() == 200
    assert not ((freq > 500) & (freq < 700)).any()
    np.testing.assert_array_equal(problem.used[:, 0], (freq >= 200) & (freq <= 400))
    np.testing.assert_array_equal(problem.used[:, 1], ((freq >= 300) & (freq <= 500)) | (freq >= 700))
    assert problem.used.any(axis=1).all()
    assert problem.bands == (((200.0, 400.0),), ((300.0, 500.0), (700.0, 800.0)))
    whole = measured(beams)
    np.testing.assert_array_equal(problem.frfs.measured, whole.h[np.isin(whole.freq_hz, freq)])
    assert problem.frfs.smooth_gamma.shape == problem.frfs.variance.shape == problem.frfs.measured.shape


@pytest.mark.parametrize("noise", [NoiseOptions(), NoiseOptions(0.05)])
def test_smooth_frfs_are_nearer_to_the_exact_ones_than_the_measured(beams, noise):
    exact = beams.gamma(beams.joint)
    frfs = prepared(beams, measured=measured(beams, 0.05), noise=noise).frfs
    off = [np.sqrt(np.mean(abs(h / exact - 1) ** 2)) for h in (frfs.smooth_gamma, frfs.measured)]
    assert off[0] < 0.5 * off[1]


def test_smooth_frfs_that_miss_a_line_give_way_to_the_measured(beams):
    h = measured(beams).h.copy()
    h[40] *= 3
    given = prepared(beams, measured=as_measured(beams.freq, h, square=False), noise=NoiseOptions(0.01))
    np.testing.assert_array_equal(given.frfs.smooth_gamma[40], (h[40] + h[40].T) / 2)
    assert (given.frfs.smooth_gamma[:35] != h[:35]).all()


def test_noise_is_estimated_from_the_lines_kept_where_nothing_is_said(beams):
    h = measured(beams).h.copy()
    low = beams.freq < 400
    h[low] = jf.pollute(beams.gamma(beams.joint)[low], 0.2, seed=4)
    noisy = as_measured(beams.freq, h, square=False)
    kept = prepared(beams, measured=noisy, bands=(400, 800))
    assert kept.noise.level == pytest.approx(0.01, rel=0.2)
    assert not kept.noise.is_assumed
    size = np.median(np.sqrt(kept.frfs.variance) / abs(kept.frfs.smooth_gamma))
    assert size == pytest.approx(kept.noise.level, rel=0.05)


def test_noise_given_as_a_level_is_relative_to_the_smooth_frfs(beams):
    problem = prepared(beams, noise=NoiseOptions(0.03))
    assert problem.noise.level == 0.03
    assert problem.noise.inflation == 1
    assert not problem.noise.is_assumed
    assert problem.noise.outlying.size == 0
    np.testing.assert_allclose(problem.frfs.variance, (0.03 * abs(problem.frfs.smooth_gamma)) ** 2, rtol=1e-9)


def test_noise_given_as_variances_keeps_the_lines_of_the_bands(beams):
    given = (0.02 * abs(beams.gamma(beams.joint))) ** 2
    problem = prepared(beams, noise=NoiseOptions(given), bands=(200, 400))
    np.testing.assert_array_equal(problem.frfs.variance, given[(beams.freq >= 200) & (beams.freq <= 400)])
    assert problem.noise.level == pytest.approx(0.02, rel=0.02)


def test_coherence_brings_the_noise_of_each_line_and_averages_scale_it(beams):
    """A band with twenty times the noise power, seen in the coherence alone."""
    exact, n_averages = beams.gamma(beams.joint), 16
    level = np.where((beams.freq > 300) & (beams.freq < 450), 0.09, 0.02)[:, None, None]
    rng = np.random.default_rng(5)
    e = (rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape)) / np.sqrt(2)
    noisy = as_measured(beams.freq, exact * (1 + level * e), square=False)
    coherence = np.broadcast_to(1 / (1 + n_averages * level**2), exact.shape)
    kept = (beams.freq >= 200) & (beams.freq <= 700)
    problem = prepared(
        beams, measured=noisy, noise=NoiseOptions(coherence=coherence, averages=n_averages), bands=(200, 700)
    )
    found = np.sqrt(problem.frfs.variance) / abs(problem.frfs.smooth_gamma)
    np.testing.assert_allclose(np.median(found / level[kept], axis=0), 1, rtol=0.2)
    loud = (problem.freq_hz > 300) & (problem.freq_hz < 450)
    assert np.median(found[loud]) > 3.5 * np.median(found[~loud])


@pytest.mark.parametrize("lines", [slice(None), slice(50, 53)])
def test_frfs_that_show_no_noise_take_a_level_for_the_residual_to_replace(chains, lines):
    """Exact FRFs that a rational function follows to rounding; and three lines, too few to tell noise."""
    h = chains.gamma(chains.joint)[lines]
    symmetric = as_measured(chains.freq[lines], (h + h.swapaxes(1, 2)) / 2, square=False)
    problem = prepared(chains, measured=symmetric, dofs=["x"])
    assert problem.noise.is_assumed
    assert problem.noise.level == 0.01
    np.testing.assert_allclose(problem.frfs.variance, (0.01 * abs(h)) ** 2, rtol=1e-6)


def test_frfs_made_reciprocal_are_told_from_measured_ones(beams):
    whole = measured(beams)
    assert not prepared(beams).frfs.symmetrised
    mean = as_measured(beams.freq, (whole.h + whole.h.swapaxes(1, 2)) / 2, square=False)
    assert prepared(beams, measured=mean).frfs.symmetrised


@pytest.mark.parametrize(
    ("noise", "reported"),
    [
        (NoiseOptions(-0.1), "noise must be positive, not -0.1"),
        (NoiseOptions(0.0), "noise must be positive, not 0"),
        (NoiseOptions(np.zeros((158, 4, 4))), "noise must contain positive variances"),
        (NoiseOptions(np.ones((158, 4))), "noise must have shape"),
        (NoiseOptions(0.01, averages=4), "coherence and averages are used where noise is not given"),
        (
            NoiseOptions(0.01, coherence=np.ones((158, 4, 4))),
            "coherence and averages are used where noise is not given",
        ),
        (NoiseOptions(averages=4), "averages need coherence"),
        (NoiseOptions(coherence=np.full((158, 4, 4), 1.1)), "coherence must be above 0 and at most 1"),
        (NoiseOptions(coherence=np.ones((10, 4, 4))), "coherence must have shape"),
    ],
)
def test_noise_that_cannot_be(beams, noise, reported):
    with pytest.raises(ValueError, match=reported):
        prepared(beams, noise=noise)


def test_names_and_transform_have_defaults(chains):
    problem = prepared(chains, dofs=None)
    assert problem.dofs == ("0",)
    np.testing.assert_array_equal(problem.frfs.responses, np.eye(2))
    np.testing.assert_array_equal(problem.frfs.forces, np.eye(2))


def test_one_transform_serves_responses_and_forces(beams):
    at_points = as_measured(beams.freq, POINTS @ measured(beams).h @ POINTS.T, square=False)
    frfs = prepared(beams, measured=at_points, transform=TO_JOINT, noise=NoiseOptions(0.01)).frfs
    assert frfs.responses is frfs.forces
    np.testing.assert_allclose(frfs.gamma(frfs.measured), measured(beams).h, rtol=1e-6, atol=1e-14)


def test_a_pair_of_transforms_takes_rectangular_frfs_to_the_joint(beams):
    """Three responses a side, the middle one the mean of the outer two, and forces at the joint DOFs themselves."""
    three = np.kron(np.eye(2), [[1.0, 0.01], [1.0, 0.0], [1.0, -0.01]])
    rectangular = as_measured(beams.freq, three @ measured(beams).h, square=False)
    assert rectangular.h.shape == (beams.freq.size, 6, 4)
    pair = (np.linalg.pinv(three), np.eye(4))
    frfs = prepared(beams, measured=rectangular, transform=pair, noise=NoiseOptions(0.01)).frfs
    np.testing.assert_allclose(frfs.gamma(frfs.measured), measured(beams).h, rtol=1e-6, atol=1e-14)
    assert not frfs.symmetrised


@pytest.mark.parametrize(
    ("transform", "reported"),
    [
        (np.eye(3), "transform must have shape"),
        (np.eye(4)[:3], "transform must have an even number of rows"),
        (np.diag([1.0, 1, 0, 1]), "transform: row 2 is zero"),
        ((np.eye(4),), "transform must be one matrix or a pair for responses and forces, not 1"),
        ((np.eye(4), np.eye(4)[:2]), "transform must lead to the same DOFs from responses and forces, not to 4 and 2"),
    ],
)
def test_transforms_that_cannot_be(beams, transform, reported):
    with pytest.raises(ValueError, match=reported):
        prepared(beams, transform=transform)


def test_rectangular_frfs_need_a_pair_of_transforms(beams):
    with pytest.raises(ValueError, match="gamma has 3 responses and 4 forces: transform must be a pair"):
        prepared(beams, measured=as_measured(beams.freq, measured(beams).h[:, :3], square=False))


def test_frfs_that_do_not_see_the_joint_are_refused(beams):
    h = measured(beams).h.copy()
    h[:, :2, 2:] = h[:, 2:, :2] = 0
    with pytest.raises(ValueError, match="gamma is zero between sides j and k of the joint"):
        prepared(beams, measured=as_measured(beams.freq, h, square=False), noise=NoiseOptions(0.01))


def test_noise_alone_is_refused(beams):
    rng = np.random.default_rng(1)
    h = rng.standard_normal((beams.freq.size, 4, 4)) + 1j * rng.standard_normal((beams.freq.size, 4, 4))
    with pytest.raises(ValueError, match="gamma consists of noise"):
        prepared(beams, measured=as_measured(beams.freq, 1e-6 * h, square=False))


def test_words_are_checked_when_they_are_chosen():
    with pytest.raises(ValueError, match="damping must be one of none, viscous, hysteretic, both, auto, not 'dry'"):
        FitOptions("dry", "zero", True)
    with pytest.raises(ValueError, match="damping must be one of none, viscous, hysteretic, both, not 'auto'"):
        FitOptions(("viscous", "auto"), "zero", True)
    with pytest.raises(ValueError, match="cross must be one of zero, ignore, points, fit, not 'some'"):
        FitOptions("auto", "some", True)


def test_damping_by_dof_needs_a_word_for_each(beams):
    with pytest.raises(ValueError, match="damping must have one word for each of 2 DOFs, not 1"):
        prepared(beams, options=FitOptions(("viscous",), "zero", True))
