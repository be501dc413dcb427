"""Many sets of FRFs of one structure: each is fitted as by itself, and sooner."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.frf import smoothing
from jointfrf.identification.realisations import viscous_estimate


@pytest.fixture(scope="module")
def drawn(beams):
    return list(jf.realisations(beams.gamma(beams.joint), 0.02, seed=5, count=4))


@pytest.fixture(params=["found", "level", "variances"])
def noise(request, beams):
    """What is said of the noise."""
    known = {"found": None, "level": 0.02, "variances": (0.02 * abs(beams.gamma(beams.joint))) ** 2}
    return known[request.param]


def test_each_fit_is_that_of_identify(beams, drawn, noise):
    fits = list(jf.identify_realisations(beams.freq, drawn, ["y", "theta"], damping="viscous", noise=noise))
    for fit, gamma in zip(fits, drawn, strict=True):
        alone = jf.identify(beams.freq, gamma, ["y", "theta"], damping="viscous", noise=noise)
        for name, value in alone.value.items():
            # The smooth FRFs of both differ by a small part of the noise.
            assert abs(fit.value[name] - value) < 0.1 * alone.std_error[name]
            assert fit.std_error[name] == pytest.approx(alone.std_error[name], rel=0.5)
        assert fit.noise_level == pytest.approx(alone.noise_level, rel=0.05)


@pytest.mark.parametrize("factor", [1, 0.25])
def test_poles_of_smooth_frfs_are_those_of_the_first_set_relocated(beams, drawn, noise, factor, monkeypatch):
    """Whatever is said of the size of the noise."""
    searches = []
    fitted = smoothing._fitted
    monkeypatch.setattr(
        smoothing, "_fitted", lambda *args: (None if len(args[-1]) else searches.append(1)) or fitted(*args)
    )
    known = None if noise is None else noise * factor
    fits = jf.identify_realisations(beams.freq, drawn, ["y", "theta"], damping="viscous", noise=known)
    next(fits)
    assert len(searches) == 1
    assert len(list(fits)) == 3
    assert len(searches) == 1


def test_a_set_of_another_structure_is_searched_anew(beams, drawn, noise):
    other = beams.gamma(jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"]))
    known = (0.02 * abs(other)) ** 2 if np.ndim(noise) else noise
    sets = [drawn[0], jf.pollute(other, 0.02, seed=1)]
    _, fit = jf.identify_realisations(beams.freq, sets, ["y", "theta"], damping="viscous", noise=known)
    alone = jf.identify(beams.freq, sets[1], ["y", "theta"], damping="viscous", noise=known)
    assert fit.noise_level == pytest.approx(alone.noise_level, rel=0.05)
    for name, value in alone.value.items():
        assert abs(fit.value[name] - value) < 0.1 * alone.std_error[name]


def test_sets_are_taken_one_at_a_time_and_checked(beams, drawn):
    def sets():
        yield drawn[0]
        yield drawn[1][:, :3, :3]

    fits = jf.identify_realisations(beams.freq, sets(), ["y", "theta"])
    assert next(fits).stiffness[0] == pytest.approx(6e5, rel=0.05)
    with pytest.raises(ValueError, match="even number of rows"):
        next(fits)


def test_noise_of_other_frfs_is_a_first_value_only(beams, drawn):
    exact = beams.gamma(beams.joint)
    first = jf.estimate_noise(beams.freq, drawn[0])
    like = jf.estimate_noise(beams.freq, drawn[1], like=first)
    alone = jf.estimate_noise(beams.freq, drawn[1])
    assert like.level == pytest.approx(alone.level, rel=0.05)
    error = [np.sqrt((abs((m.smooth.h - exact) / exact) ** 2).mean()) for m in (like, alone)]
    assert error[0] == pytest.approx(error[1], rel=0.2)
    far = jf.estimate_noise(beams.freq, jf.pollute(exact, 0.1, seed=9), like=first)
    assert far.level == pytest.approx(0.1, rel=0.1)
    # Of other lines, and of other sizes: not used.
    assert jf.estimate_noise(beams.freq[:80], drawn[1][:80], like=first).level == pytest.approx(0.02, rel=0.2)


def test_estimates_of_a_study_are_those_of_the_fits(beams, drawn):
    dofs = ["y", "theta"]
    start = jf.FitStart.of(beams.freq, drawn[0], dofs, damping="viscous")
    fits = jf.identify_realisations(beams.freq, drawn[1:], dofs, damping="viscous", start=start)
    for fit, gamma in zip(fits, drawn[1:], strict=True):
        values, (low, high) = viscous_estimate(beams.freq, gamma, dofs, start)
        np.testing.assert_array_equal(values, [*fit.stiffness, *fit.damping])
        np.testing.assert_array_equal(np.array([low, high]).T, list(fit.confidence_interval(0.95).values()))


def test_a_start_at_other_lines_is_where_the_joint_begins_only(beams, drawn):
    """FRFs near those sought are those of the same lines."""
    dofs, half = ["y", "theta"], beams.freq.size // 2
    start = jf.FitStart.of(beams.freq, drawn[0], dofs, damping="viscous")
    for own in (slice(half), slice(None, None, 2)):
        (fit,) = jf.identify_realisations(beams.freq[own], [drawn[1][own]], dofs, damping="viscous", start=start)
        alone = jf.identify(beams.freq[own], drawn[1][own], dofs, damping="viscous")
        for name, value in alone.value.items():
            assert abs(fit.value[name] - value) < 0.1 * alone.std_error[name]
