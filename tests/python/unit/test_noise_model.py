"""Noise of measured FRFs from the FRFs themselves."""

import calibration
import numpy as np
import pytest

import jointfrf as jf
from jointfrf.frf.noise_parts import line_correlation, line_levels, noise_parts

FREQ = np.arange(15.0, 601.0)


@pytest.fixture(scope="module")
def h():
    """Assembly of two beams at the joint, structural damping and dashpots."""
    a, b = (
        jf.beam(length, 20, youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, ends=ends, loss_factor=0.01)
        for length, ends in ((0.3, ("clamped", "free")), (0.225, ("free", "free")))
    )
    h_a = a.receptance(FREQ, a.index("21:y", "21:theta"))
    h_b = b.receptance(FREQ, b.index("1:y", "1:theta"))
    joint = jf.Joint([6e5, 5e3], [20.0, 1.5], ["y", "theta"])
    return jf.couple(h_a, h_b, joint.dynamic_stiffness(FREQ), [0, 1], [0, 1])


def circular(shape, seed):
    rng = np.random.default_rng(seed)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def correlated(shape, n, seed):
    """Moving average over n lines."""
    e = circular((shape[0] + n - 1, *shape[1:]), seed)
    total = np.cumsum(np.concatenate([np.zeros((1, *shape[1:])), e]), axis=0)
    return (total[n:] - total[:-n]) / np.sqrt(n)


def size(h):
    return np.median(abs(h), axis=0)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
@pytest.mark.parametrize(
    ("kind", "level", "root"),
    [
        ("complex", 0.001, 0.001),
        ("complex", 0.05, 0.05),
        ("complex", 0.2, 0.2),
        ("real-normal", 0.05, 0.05),
        ("real-uniform", 0.05, 0.05 / np.sqrt(3)),
    ],
)
def test_relative_noise(h, kind, level, root, seed):
    noise = jf.estimate_noise(FREQ, jf.pollute(h, level, kind, seed=seed))
    np.testing.assert_allclose(noise.relative, root, rtol=0.15)
    assert noise.level == pytest.approx(root, rel=0.05)
    assert (noise.floor < 0.35 * root * size(h)).all()
    assert noise.inflation < 1.3
    assert noise.inflation_source == "reciprocity"
    assert noise.source == "residual"
    assert noise.outlying.size <= 1
    assert np.median(abs(noise.smooth.h - h) / (root * abs(h))) < 0.15


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_floor(h, seed):
    x = h + 0.05 * size(h) * circular(h.shape, seed)
    noise = jf.estimate_noise(FREQ, x)
    np.testing.assert_allclose(noise.floor, 0.05 * size(h), rtol=0.15)
    assert (noise.relative < 0.005).all()


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
def test_mixed_noise_different_by_entry(h, seed):
    relative = np.geomspace(0.005, 0.1, 16).reshape(4, 4)
    floor = np.geomspace(0.1, 0.005, 16).reshape(4, 4) * size(h)
    e1, e2 = circular(h.shape, seed), circular(h.shape, seed + 10)
    noise = jf.estimate_noise(FREQ, h + relative * abs(h) * e1 + floor * e2)
    variance = (relative * abs(h)) ** 2 + floor**2
    ratio = np.sqrt(noise.variance / variance)
    assert np.median(ratio) == pytest.approx(1, abs=0.03)
    assert np.quantile(ratio, 0.02) > 0.75
    assert np.quantile(ratio, 0.98) < 1.35


@pytest.mark.parametrize(("n", "lowest", "highest"), [(5, 4, 6), (25, 17, 30)])
def test_correlation_between_lines(h, n, lowest, highest):
    x = h + 0.02 * abs(h) * correlated(h.shape, n, 3)
    noise = jf.estimate_noise(FREQ, x)
    assert lowest < noise.inflation < highest
    assert noise.inflation_source == "reciprocity"
    np.testing.assert_allclose(np.median(noise.relative), 0.02, rtol=0.1)
    reciprocal = jf.estimate_noise(FREQ, (x + x.swapaxes(1, 2)) / 2)
    assert 0.8 * lowest < reciprocal.inflation < 1.2 * highest
    assert reciprocal.inflation_source == "residual"
    rectangular = jf.estimate_noise(FREQ, x[:, :, :3])
    assert 0.8 * lowest < rectangular.inflation < 1.2 * highest
    assert rectangular.inflation_source == "residual"


@pytest.mark.parametrize("reciprocal", [False, True])
def test_hum_is_found_and_does_not_bend_the_smooth_frfs(h, reciprocal):
    x = jf.pollute(h, 0.01, seed=4, reciprocal=reciprocal)
    hum = np.flatnonzero(FREQ % 50 == 0)
    e = size(h) * circular(h.shape, 5)
    x[hum] += ((e + e.swapaxes(1, 2)) / 2 if reciprocal else e)[hum]
    noise = jf.estimate_noise(FREQ, x)
    assert set(hum) <= set(noise.outlying)
    assert noise.outlying.size <= hum.size + 2
    np.testing.assert_allclose(np.median(noise.relative), 0.01, rtol=0.1)
    assert np.median(abs(noise.smooth.h - h)[hum] / (0.01 * abs(h[hum]))) < 0.3
    assert (noise.variance[hum] > 10 * (0.01 * abs(h[hum])) ** 2).mean() > 0.9


def garbage(h, lines, seed, *, entries=None):
    """Noise on some lines, 50 times the usual size of the FRFs, in all entries or in one."""
    x = jf.pollute(h, 0.02, seed=seed)
    e = 50 * size(h) * circular((len(lines), *h.shape[1:]), seed + 20)
    at = np.ix_(lines, *([i] for i in entries)) if entries else lines
    x[at] = e[:, entries[0], entries[1]][:, None, None] if entries else e
    return x


def test_correlation_does_not_remove_poles_that_the_frfs_need():
    """Noise correlated over 50 lines makes a pole so expensive that one was dropped, and what it left became noise."""
    trial = calibration.CalibrationTrial("joint", "3 % correlated over 50 lines")
    freq, exact = calibration.exact(trial)
    h = calibration.measured(trial, 12, 20)
    model = jf.estimate_noise(freq, h, reciprocal=True)
    assert np.median(abs(model.smooth.h - exact) / abs(exact)) < 0.03
    assert model.level < 0.1


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", ["both directions", "reciprocal", "rectangular"])
@pytest.mark.parametrize("run", [1, 4, 20])
def test_lines_that_are_noise_only_do_not_change_the_others(h, kind, run, seed):
    starts = np.random.default_rng(seed).permutation(len(FREQ) // 20)[: 20 if run == 1 else 2] * 20
    bad = (starts[:, None] + np.arange(run)).ravel()
    x = garbage(h, bad, seed)
    if kind == "reciprocal":
        x = (x + x.swapaxes(1, 2)) / 2
    x = x[:, :, :3] if kind == "rectangular" else x
    noise = jf.estimate_noise(FREQ, x)
    assert set(bad) <= set(noise.outlying)
    assert noise.outlying.size <= bad.size + 2
    good = np.setdiff1d(np.arange(len(FREQ)), bad)
    expected = 0.02 * abs(h[:, :, : x.shape[2]]) * (np.where(np.eye(4), 1, 0.5**0.5) if kind == "reciprocal" else 1)
    ratio = np.sqrt(noise.variance[good]) / expected[good]
    assert np.quantile(abs(ratio - 1), 0.95) < (0.12 if kind == "both directions" else 0.3)
    assert np.median(abs(noise.smooth.h - h[:, :, : x.shape[2]])[good] / expected[good]) < 0.3


@pytest.mark.parametrize("entries", [(0, 0), (0, 1)])
def test_noise_of_one_frf_on_some_lines(h, entries):
    """Of a driving point as well, which no difference shows."""
    bad = np.random.default_rng(3).permutation(len(FREQ))[:20]
    noise = jf.estimate_noise(FREQ, garbage(h, bad, 1, entries=entries))
    assert set(bad) <= set(noise.outlying)
    assert noise.level == pytest.approx(0.02, rel=0.05)


def test_outlying_lines_of_nearly_exact_frfs(h):
    x = jf.pollute(h, 5e-5, seed=1)
    bad = np.array([50, 51, 52, 53, 54, 300])
    x[bad] = 20 * size(h) * circular((6, 4, 4), 2)
    noise = jf.estimate_noise(FREQ, x)
    assert noise.source == "reciprocity"
    assert set(bad) <= set(noise.outlying)
    assert noise.level == pytest.approx(5e-5, rel=0.05)


def test_a_mode_that_is_missed_is_not_outlying():
    """A long run of large residuals counts where it jumps from line to line, not where it goes smoothly."""
    noise = circular((4, 600), 1)
    noise[:, 200:212] = 30 * circular((4, 12), 2)
    noise[:, 400:412] = 30 * circular((4, 1), 3) * np.exp(0.2j * np.arange(12))
    found = np.flatnonzero(line_levels(noise).factor > 1)
    assert set(range(200, 212)) <= set(found)
    assert not set(range(400, 412)) & set(found)
    both = np.flatnonzero(line_levels(noise, is_residual=False).factor > 1)
    assert set(range(400, 412)) <= set(both)


def test_missing_lines(h):
    keep = np.random.default_rng(3).random(len(FREQ)) > 0.4
    noise = jf.estimate_noise(FREQ[keep], jf.pollute(h, 0.02, seed=6)[keep])
    np.testing.assert_allclose(noise.relative, 0.02, rtol=0.15)


def swell():
    """Relative noise by line that rises and falls over frequency, which neither part describes."""
    return 0.01 + 0.2 * np.exp(-(((FREQ - 300) / 60) ** 2))


def test_noise_that_varies_over_frequency(h):
    relative = swell()[:, None, None]
    for x in (
        h + relative * abs(h) * circular(h.shape, 7),
        h[:, :, :2] + relative * abs(h[:, :, :2]) * circular(h[:, :, :2].shape, 8),
    ):
        noise = jf.estimate_noise(FREQ, x)
        ratio = np.sqrt(noise.variance) / (relative * abs(h[:, :, : x.shape[2]]))
        assert np.quantile(abs(np.log(ratio)), 0.9) < 0.35
        assert noise.line_level.max() > 30 * noise.line_level.min()
        assert noise.outlying.size < 5


def test_noise_that_rises_100_fold(h):
    relative = 0.1 * 100.0 ** ((FREQ - FREQ[-1]) / np.ptp(FREQ))[:, None, None]
    ratios = []
    for seed in range(4):
        noise = jf.estimate_noise(FREQ, h + relative * abs(h) * circular(h.shape, seed))
        ratios.append(np.median(np.sqrt(noise.variance) / (relative * abs(h)), axis=(1, 2)))
        # Smooth FRFs miss the lowest lines by more than their noise of 0.1 %.
        assert (noise.outlying > 40).sum() < 3
    # Windows of 41 lines of 10 differences: 5 %.
    assert np.quantile(abs(np.log(ratios)), 0.9) < 0.2


def test_coarse_lines_take_the_noise_of_differences(h):
    """Rational functions through one line in twenty, of fewer lines than modes need, are not what was measured."""
    levels = []
    for seed in range(8):
        noise = jf.estimate_noise(FREQ[::20], jf.pollute(h, 0.02, seed=seed)[::20])
        levels.append(noise.level)
        assert noise.source == "reciprocity"
        assert not noise.smooth.is_smooth
    # 30 lines of six differences.
    np.testing.assert_allclose(levels, 0.02, rtol=0.35)
    assert np.mean(levels) == pytest.approx(0.02, rel=0.1)


def test_coarse_lines_with_noise_of_another_size_by_entry_are_smoothed(h):
    """One level does not describe it."""
    sizes = 4.0 ** ((np.arange(16).reshape(4, 4) * 3 % 7) / 3 - 1)
    noise = jf.estimate_noise(FREQ[::20], (h + 0.02 * sizes * abs(h) * circular(h.shape, 3))[::20])
    assert noise.source == "residual"
    assert noise.relative.max() > 4 * noise.relative.min()


def test_coherence_tells_where_the_noise_is(h):
    """As `swell`, but between lines as well: what coherence sees and nothing else."""
    averages = 20
    relative = swell() * np.where(np.arange(len(FREQ)) % 3, 1, 3)
    squared = 1 / (1 + averages * relative**2)  # (1 - g^2)/(n g^2) = relative^2
    coherence = np.broadcast_to(squared[:, None, None], h.shape)
    x = h + relative[:, None, None] * abs(h) * circular(h.shape, 7)
    noise = jf.estimate_noise(FREQ, x, coherence=coherence, averages=averages)
    np.testing.assert_allclose(noise.coherence_factor, 1, atol=0.15)
    ratio = np.sqrt(noise.variance) / (relative[:, None, None] * abs(h))
    assert np.quantile(abs(ratio - 1), 0.9) < 0.2
    blind = jf.estimate_noise(FREQ, x)
    assert not blind.coherence_factor.any()
    missed = np.sqrt(blind.variance) / (relative[:, None, None] * abs(h))
    assert np.quantile(abs(missed - 1), 0.9) > 0.4


def test_few_lines_and_exact_frfs(h):
    few = jf.estimate_noise(FREQ[::60], jf.pollute(h, 0.05, seed=1)[::60])
    assert few.source == "reciprocity"
    np.testing.assert_allclose(few.relative, 0.05, rtol=0.35)
    assert few.inflation == 1
    assert few.inflation_source == "none"
    lone = jf.estimate_noise(FREQ[:3], h[:3, :1, :1])
    assert lone.source == "none"
    assert not lone.variance.any()
    exact = jf.estimate_noise(FREQ, h)
    np.testing.assert_array_equal(exact.smooth.h, h)
    assert exact.level < 1e-4


def test_parts_by_maximum_likelihood_against_a_search():
    """The optimum of the likelihood over a grid of both parts is no better."""
    rng = np.random.default_rng(1)
    a = rng.lognormal(0, 2, (1, 20))
    y = (0.3 * a + 0.5) * rng.exponential(size=(1, 20))
    parts = noise_parts(y, np.stack([a, np.ones_like(a)]))

    def loss(one, two):
        v = one * a + two
        return (np.log(v) + y / v).sum()

    grid = np.geomspace(1e-3, 10, 200)
    assert loss(*parts) < min(loss(one, two) for one in grid for two in grid) + 1e-3


@pytest.mark.parametrize("ratio", [1.0, 16.0])
def test_floors_that_hardly_differ_are_one(ratio):
    """Few lines of each entry show its floor: one floor is nearer to the truth than one of each, unless they differ."""
    rng = np.random.default_rng(2)
    size = np.geomspace(1e-2, 1e3, 400) * np.ones((6, 1))
    floor = np.geomspace(1, ratio, 6)
    terms = np.stack([size, np.ones_like(size)])
    away = []
    for _ in range(20):
        squares = (size + floor[:, None]) * rng.exponential(size=size.shape)
        found = noise_parts(squares, terms, common=True)
        away.append([np.log(found[1] / floor), np.log(noise_parts(squares, terms)[1] / floor)])
        np.testing.assert_allclose(found[0], 1, rtol=0.4)
        assert (np.ptp(found[1]) < 1e-12) == (ratio == 1)
    chosen, own = np.sqrt(np.square(away).mean(axis=(0, 2)))
    assert chosen < (0.6 if ratio == 1 else 1.01) * own
    none = noise_parts(size * rng.exponential(size=size.shape), terms, common=True)
    assert (none[1] == 0).all()


def test_parts_of_which_one_is_far_smaller():
    """|h|^2 over 14 decades: the constant part is 1e-11 of the mean of the other, and counts on most lines."""
    rng = np.random.default_rng(2)
    a = 10 ** np.linspace(-14, 0, 2000)[None]
    y = (0.3 * a + 1e-12) * rng.exponential(size=a.shape)
    relative, floor = noise_parts(y, np.stack([a, np.ones_like(a)]))
    assert relative[0] == pytest.approx(0.3, rel=0.15)
    assert floor[0] == pytest.approx(1e-12, rel=0.15)


def test_independent_lines_are_not_outlying_and_not_correlated():
    found = [np.count_nonzero(line_levels(one).factor > 1) for one in circular((50, 3, 1000), 1)]
    assert np.mean(found) < 0.3
    assert np.median([line_correlation(circular((3, 1000), seed)) for seed in range(50)]) < 1.05


def test_bad_arguments(h):
    with pytest.raises(ValueError, match="averages need coherence"):
        jf.estimate_noise(FREQ, h, averages=3)
    with pytest.raises(ValueError, match="coherence must be above 0 and at most 1"):
        jf.estimate_noise(FREQ, h, coherence=np.full(h.shape, 1.1))
    with pytest.raises(ValueError, match="averages must be 1 or more"):
        jf.estimate_noise(FREQ, h, coherence=np.full(h.shape, 0.9), averages=0)
    with pytest.raises(ValueError, match="NaN or Inf in line 0"):
        jf.estimate_noise(FREQ, np.full(h.shape, np.nan))


@pytest.mark.parametrize("is_acceleration", [False, True])
def test_a_floor_is_constant_in_the_quantity_that_shows_it(beams, is_acceleration):
    """Variance by entry and line against the variance that made the noise."""
    freq, h = beams.freq, beams.gamma(beams.joint)
    shape = (np.median(freq) / freq[:, None, None]) ** 2 if is_acceleration else 1.0
    floor = 0.02 * np.median(abs(h), axis=0) * shape
    rng = np.random.default_rng(3)
    e = (rng.standard_normal((2, *h.shape, 2)) @ [1, 1j]) / np.sqrt(2)
    found = jf.estimate_noise(freq, h * (1 + 0.02 * e[0]) + floor * e[1])
    assert found.floor_of_acceleration == is_acceleration
    ratio = found.variance / ((0.02 * abs(h)) ** 2 + np.square(np.broadcast_to(floor, h.shape)))
    assert np.median(ratio) == pytest.approx(1, abs=0.1)
    low, high = np.quantile(ratio, [0.05, 0.95])
    assert 0.6 < low < high < 1.5


#: Sensors and hits at nodes of a beam: neighbours, one apart, exchanged, far away.
OTHER_POINTS = [([3, 6, 9], [4, 7, 10]), ([3, 6, 9], [3, 6, 10]), ([3, 11], [11, 3]), ([2, 5], [8, 11])]


@pytest.mark.parametrize("level", [0.02, 0.002])
@pytest.mark.parametrize(("sensors", "hits"), OTHER_POINTS)
def test_a_matrix_of_other_points_is_not_taken_for_reciprocal(sensors, hits, level):
    beam = jf.beam(
        0.3, 12, youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, ends=("clamped", "free"),
        loss_factor=0.01,
    )  # fmt: skip
    rows, columns = (beam.index(*(f"{node}:y" for node in nodes)) for nodes in (sensors, hits))
    h = jf.pollute(beam.receptance(FREQ)[:, rows][:, :, columns], level, seed=1)
    found = jf.estimate_noise(FREQ, h)
    assert found.level == pytest.approx(level, rel=0.2)
    assert found.calibration is None
    order = np.random.default_rng(1).permutation(FREQ.size)
    assert jf.estimate_noise(FREQ[order], h[order]).level == pytest.approx(level, rel=0.2)


def test_differences_that_are_noise_or_gains_are_those_of_reciprocal_frfs(h):
    """Whether they are smooth or not; few lines of other points, whose noise nothing shows, are rejected."""
    gains = np.array([1, 1.05, 0.97, 1])[:, None]
    for x in (jf.pollute(h, 0.02, seed=1), h * (1 + 0.02 * correlated(h.shape, 25, 3)), jf.pollute(h, 0.01) * gains):
        own, known = jf.estimate_noise(FREQ, x), jf.estimate_noise(FREQ, x, reciprocal=True)
        np.testing.assert_array_equal(own.variance, known.variance)
    few = h[::60, [0, 1]][:, :, [3, 2]]
    with pytest.raises(ValueError, match=r"h is not reciprocal\. Give reciprocal=False if responses and forces are"):
        jf.estimate_noise(FREQ[::60], few)
