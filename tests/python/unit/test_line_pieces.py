"""Long sweeps, piece by piece: what is found does not depend on where they are cut."""

import tracemalloc

import numpy as np
import pytest

import jointfrf as jf
import six_dof_beams
from jointfrf.frf import bands
from jointfrf.frf.bands import in_pieces, line_slices
from jointfrf.identification.describe import describe_springs
from jointfrf.identification.manifold.fit import fit_springs
from jointfrf.identification.manifold.prepare import FitOptions, prepare_compliance
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import as_measured


@pytest.mark.parametrize("n", [1, 8192, 8193, 100_000])
def test_pieces_hold_every_line_once(n):
    pieces = line_slices(n)
    assert np.concatenate([np.arange(n)[own] for own in pieces]).tolist() == list(range(n))
    sizes = [own.stop - own.start for own in pieces]
    assert max(sizes) <= 8192
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize("most", [3, 10, None])
def test_arrays_in_pieces_are_those_of_all_lines(most):
    h, seen = np.arange(20.0).reshape(10, 2), []

    def of_lines(own):
        seen.append(own)
        return [h[own] ** 2, h[own, 0] > 4]

    squares, large = in_pieces(10, of_lines, most)
    np.testing.assert_array_equal(squares, h**2)
    np.testing.assert_array_equal(large, h[:, 0] > 4)
    assert large.dtype == np.bool_
    assert seen == line_slices(10, most)
    assert max(own.stop - own.start for own in seen) <= (most or 10)


@pytest.fixture
def cut(monkeypatch):
    """Pieces of 64 lines at most, for sweeps that a test can afford; fewer than 50 are coarse."""
    return lambda: monkeypatch.setattr(bands, "PIECE", 64)


def test_noise_and_smooth_frfs_of_pieces(chains, cut):
    h = chains.gamma(chains.joint)
    order = np.random.default_rng(1).permutation(chains.freq.size)
    x = jf.pollute(h, 0.02, seed=1)
    whole = jf.estimate_noise(chains.freq, x)
    cut()
    noise = jf.estimate_noise(chains.freq[order], x[order])
    assert noise.level == pytest.approx(0.02, rel=0.15)
    np.testing.assert_allclose(noise.relative, whole.relative, rtol=0.35)
    ratio = np.sqrt(noise.variance) / (0.02 * abs(h[order]))
    assert np.quantile(abs(np.log(ratio)), 0.9) < 0.35
    np.testing.assert_array_equal(noise.smooth.freq_hz, chains.freq[order])
    assert np.median(abs(noise.smooth.h / h[order] - 1)) < 0.01
    smooth = jf.smooth_frfs(chains.freq[order], x[order])
    assert np.median(abs(smooth.h / h[order] - 1)) < 0.01
    assert len(smooth.poles) == 3
    assert smooth.share.max() > whole.smooth.share.max()


@pytest.mark.parametrize("cross", ["zero", "ignore", "fit"])
def test_a_fit_of_pieces_is_that_of_all_lines(beams, cut, cross):
    """Everything after smoothing is by line."""
    x = as_measured(beams.freq, jf.pollute(beams.gamma(beams.joint), 0.01, seed=1), square=False)
    own = {"y": (100, 400), "theta": (300, 800)} if cross == "ignore" else None
    options = FitOptions("viscous", cross, True)
    problem = prepare_compliance(x, ["y", "theta"], own, None, NoiseOptions(), options)
    whole = describe_springs(fit_springs(problem), problem)
    cut()
    fit = describe_springs(fit_springs(problem), problem)
    np.testing.assert_allclose(fit.k_lines, whole.k_lines, rtol=1e-9)
    for name, value in whole.value.items():
        # Starts see some lines only: both end where steps are far below a standard error.
        assert abs(fit.value[name] - value) < 0.01 * whole.std_error[name]
    np.testing.assert_allclose(fit.covariance, whole.covariance, rtol=1e-3)


def test_a_fit_of_noisy_pieces(beams, cut):
    x = jf.pollute(beams.gamma(beams.joint), 0.01, seed=1)
    whole = jf.identify(beams.freq, x, beams.joint.dofs)
    cut()
    fit = jf.identify(beams.freq, x, beams.joint.dofs)
    for name, value in whole.value.items():
        assert abs(fit.value[name] - value) < 0.7 * whole.std_error[name]


@pytest.mark.parametrize("noise", [None, pytest.param(0.03, marks=pytest.mark.long)])
def test_memory_of_a_fit_is_a_few_times_that_of_its_frfs(monkeypatch, noise):
    """Beside the FRFs: smooth ones and variances, once each, and less; pieces are as small as of a long sweep."""
    freq = np.linspace(1, 600, 5000)
    h = jf.pollute(six_dof_beams.assembly(freq=freq), 0.03, seed=1)
    jf.identify(freq[::100], h[::100], six_dof_beams.DOFS, noise=0.03)  # all that is imported and kept
    monkeypatch.setattr(bands, "PIECE", 250)
    tracemalloc.start()
    try:
        jf.identify(freq, h, six_dof_beams.DOFS, noise=noise).confidence_interval()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # 2.4; the FRFs as matrices once more are 1.0, as entries of both groups 0.3.
    assert peak < 2.6 * h.nbytes
