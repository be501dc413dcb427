"""Bands, means, sensitivities and error measures."""

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.arange(1.0, 11.0)


def test_band_mean_takes_each_dof_in_its_own_bands():
    k = np.zeros((10, 2, 2), complex)
    k[:, 0, 0] = 100 + FREQ + 2j * np.pi * FREQ * 3
    k[:, 1, 1] = np.where(FREQ > 5, 7.0, 1e9)
    mean = jf.band_mean(FREQ, k, {"y": [(1, 2), (9, 10)], "theta": (6, 10)}, ["y", "theta"])
    np.testing.assert_allclose(mean.stiffness, [105.5, 7])
    np.testing.assert_allclose(mean.damping, [3, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("bands", "message"),
    [
        ((20, 30), "the band 20 to 30 Hz contains no frequency line; they run from 1 to 10 Hz"),
        ((3, 2), r"a band must be \(low, high\)"),
        ((1, 2, 3), r"a band must be \(low, high\)"),
        ({"y": (1, 2)}, "has no band for DOF 'theta'"),
        ({"y": (1, 2), "theta": (1, 2), "z": (1, 2)}, "names 'z', which is no DOF"),
    ],
)
def test_bad_bands_get_one_sentence(bands, message):
    with pytest.raises(ValueError, match=message):
        jf.band_mean(FREQ, np.zeros((10, 2, 2)), bands, ["y", "theta"])


def test_no_damping_from_a_line_at_rest():
    with pytest.raises(ValueError, match="the band of 0 contains 0 Hz"):
        jf.band_mean([0.0, 1.0], np.zeros((2, 1, 1)))


def test_sensitivity_is_the_change_that_one_percent_makes(beams):
    s = beams
    output = input_ = 2 * s.n + s.n  # tip, displacement
    found = jf.sensitivity(s.freq, s.coupled(s.joint), s.joint, [0, 1], [4, 5], output, input_)
    assert found.parameters == ("k_y", "k_theta", "c_y", "c_theta")
    exact = s.coupled(s.joint)[:, output, input_]
    step = 1e-4
    for i, (dk, dc) in enumerate([([1, 0], [0, 0]), ([0, 1], [0, 0]), ([0, 0], [1, 0]), ([0, 0], [0, 1])]):
        k = np.diag(s.joint.stiffness) * (1 + step * np.array(dk))
        c = np.diag(s.joint.damping) * (1 + step * np.array(dc))
        changed = s.coupled(jf.Joint(k, c))[:, output, input_]
        by_difference = (changed / exact - 1) / step / 100
        np.testing.assert_allclose(found.change[i], by_difference, rtol=0, atol=2e-3 * abs(found.change[i]).max())
    np.testing.assert_allclose(found.in_db, 20 * np.log10(abs(found.change)))


def test_first_mode_of_the_chain_does_not_see_the_joint(chains):
    s = chains
    found = jf.sensitivity(s.freq, s.coupled(s.joint), s.joint, [0], [2], 1, 1)
    level = abs(found.change[0])
    assert level[s.freq < 3].max() < 0.1 * level.max()
    low, high = jf.propose_bands(s.freq, found.change[0])[0]
    assert low >= 3
    assert high <= 9


def test_proposed_bands_bridge_short_gaps_and_drop_short_bands():
    f = np.arange(0.0, 1001.0)
    level = np.full(f.size, 1e-4)
    level[100:300] = 1
    level[200:205] = 1e-4
    level[600] = 1e-2
    assert jf.propose_bands(f, level, smooth=0.0) == [(100.0, 299.0)]
    assert jf.propose_bands(f, np.zeros(f.size)) == []


def resonance(freq, f0, eta=0.02, size=1.0):
    return size / (f0**2 * (1 + 1j * eta) - freq**2)


def test_amplitude_and_frequency_error():
    freq = np.arange(50.0, 150.0, 0.5)
    exact, found = resonance(freq, 100.0), resonance(freq, 102.0, size=0.9)
    peak_exact, peak_found = abs(exact).max(), abs(found).max()
    assert jf.amplitude_error(exact, found, freq) == pytest.approx(100 * (1 - peak_found / peak_exact))
    assert jf.frequency_error(exact, found, freq) == pytest.approx(2.0)
    assert jf.frequency_error(exact, found, freq, (50, 101.5)) == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("band", "expected"), [((20.0, 40.0), True), ((10.0, 30.0), False), ((30.0, 50.0), False), ((31.0, 50.0), False)]
)
def test_a_peak_lies_inside_its_band(band, expected):
    """One mode at 30 Hz: where it lies at the edge of the band or outside, the largest value is no peak."""
    freq = np.arange(10.0, 51.0)
    h = 1 / (30.0**2 - freq**2 + 0.1j * 30.0**2)
    assert jf.has_peak(h, freq, band) == expected


def test_refined_peak_lies_between_the_lines():
    freq = np.arange(50.0, 150.0, 1.0)
    h = resonance(freq, 100.37, eta=0.05)
    amplitude, at = jf.peak(h, freq, refine=True)
    assert at == pytest.approx(100.37, abs=0.02)
    assert amplitude == pytest.approx(abs(resonance(np.array([100.37]), 100.37, eta=0.05))[0], rel=3e-3)
    assert jf.peak(h[:51], freq[:51], refine=True) == jf.peak(h[:51], freq[:51])  # at the end of the band


def test_bad_frfs_get_one_sentence():
    with pytest.raises(ValueError, match="one value for each of the 10 lines"):
        jf.peak(np.ones(9), FREQ)
    with pytest.raises(ValueError, match="NaN or Inf in line 3"):
        jf.peak(np.where(FREQ == 4, np.nan, 1.0), FREQ)


def test_joint_matrices():
    joint = jf.Joint([[10.0, 1.0], [1.0, 20.0]], [2.0, 3.0], ["y", "theta"], loss_factor=[0.1, 0.2])
    k = joint.dynamic_stiffness([0.0, 1.0])
    np.testing.assert_allclose(k[0], [[10 + 1j, 1 + 1j * np.sqrt(0.02)], [1 + 1j * np.sqrt(0.02), 20 + 4j]])
    np.testing.assert_allclose(k[1] - k[0], 2j * np.pi * np.diag([2.0, 3.0]))
    for wrong in (
        lambda: jf.Joint([1.0, 2.0], [1.0]),
        lambda: jf.Joint([1.0, 2.0], dofs=["y", "y"]),
        lambda: jf.Joint([np.nan]),
        lambda: jf.Joint(np.ones((2, 3))),
    ):
        with pytest.raises(ValueError, match=r"must|contains"):
            wrong()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: jf.chain([1.0, 2.0], [1.0]), r"stiffness must have shape \(2\)"),
        (lambda: jf.chain([1.0, 0.0], [1.0, 1.0]), "all positive"),
        (lambda: jf.chain([1.0], [1.0], ground="left"), "ground must be one of"),
        (lambda: jf.beam(0.0, 3, youngs_modulus=1, density=1, width=1, height=1), "length must be positive"),
        (lambda: jf.beam(1.0, 0, youngs_modulus=1, density=1, width=1, height=1), "n_elements must be"),
        (
            lambda: jf.beam(1, 2, youngs_modulus=1, density=1, width=1, height=1, element="B21"),
            "element must be one of",
        ),
        (
            lambda: jf.beam(1, 2, youngs_modulus=1, density=1, width=1, height=1, ends=("free", "pinned")),
            "ends must be",
        ),
        (lambda: jf.chain([1.0], [1.0]).index("2:x"), "the model has no DOF '2:x'"),
    ],
)
def test_bad_models_get_one_sentence(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_errors_relative_to_nothing_get_one_sentence():
    with pytest.raises(ValueError, match="h_exact is zero on all lines"):
        jf.amplitude_error(np.zeros(10), np.ones(10), FREQ)
    with pytest.raises(ValueError, match="h_exact is largest at 0 Hz"):
        jf.frequency_error(np.arange(10, 0, -1), np.ones(10), FREQ - 1)


def test_a_parabola_needs_three_frequencies():
    with pytest.raises(ValueError, match="lines 3 to 5 are not at three frequencies, as refine needs them"):
        jf.peak(np.exp(-((FREQ - 5) ** 2)), np.full(10, 3.0), refine=True)


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_a_peak_between_lines_of_any_spacing(scale):
    """Squares of steps left the range of doubles: LAPACK searched for singular values of NaN for ever."""
    amplitude, frequency = jf.peak([1.0, 4.0, 2.0], np.array([1.0, 2.0, 3.0]) * scale, refine=True)
    expected = jf.peak([1.0, 4.0, 2.0], [1.0, 2.0, 3.0], refine=True)
    assert (amplitude, frequency / scale) == pytest.approx(expected, rel=1e-12)
