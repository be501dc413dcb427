"""The arguments of `identify`, checked and put into a typed problem."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.prepare import (
    ComplianceOptions,
    as_measured,
    prepare_band_mean,
    prepare_compliance,
)
from jointfrf.substructuring.methods import JointFrfs

OPTIONS = ComplianceOptions("viscous", "zero", True)


def measured(s, level=0.01):
    return as_measured(s.freq, jf.pollute(s.gamma(s.joint), level, seed=3))


def prepared(s, **change):
    arguments = dict(measured=measured(s), dofs=["y", "theta"], bands=None, transform=None, noise=None)
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
    np.testing.assert_array_equal(problem.measured, whole.h[np.isin(whole.freq_hz, freq)])


def test_the_first_line_of_a_band_knows_its_neighbours_outside(beams):
    problem, whole = prepared(beams, bands=(200, 400)), measured(beams)
    first = int(np.flatnonzero(whole.freq_hz == 200)[0])
    around = whole.h[[first - 2, first - 1, first + 1, first + 2]]
    np.testing.assert_allclose(problem.initial[0], around.mean(axis=0), rtol=1e-13)


def test_the_noise_is_that_of_the_lines_kept(beams):
    given = (0.02 * abs(beams.gamma(beams.joint))) ** 2
    assert prepared(beams).noise.level == pytest.approx(0.01, rel=0.15)
    assert prepared(beams, noise=0.03).noise.level == 0.03
    noise = prepared(beams, noise=given, bands=(200, 400)).noise
    assert noise.level == 1
    np.testing.assert_array_equal(noise.variance, given[(beams.freq >= 200) & (beams.freq <= 400)])
    h = beams.gamma(beams.joint)
    symmetric = as_measured(beams.freq, (h + h.swapaxes(1, 2)) / 2)
    assert prepared(beams, measured=symmetric).noise.level == 0


def test_names_and_transform_have_defaults(chains):
    problem = prepared(chains, dofs=None)
    assert problem.dofs == ("0",)
    np.testing.assert_array_equal(problem.transform, np.eye(2))


def test_words_are_checked_when_they_are_chosen():
    with pytest.raises(ValueError, match="damping must be one of none, viscous, hysteretic, both, auto, not 'dry'"):
        ComplianceOptions("dry", "zero", True)
    with pytest.raises(ValueError, match="cross must be one of zero, ignore, fit, not 'some'"):
        ComplianceOptions("auto", "some", True)


def test_a_band_mean_transforms_what_is_measured_at_points(beams):
    mix = np.kron(np.eye(2), [[1.0, 0.01], [1.0, -0.01]])
    h = beams.gamma(beams.joint)
    at_points = as_measured(beams.freq, mix @ h @ mix.T)
    method, back = "inverse-substructuring", np.linalg.inv(mix)
    problem = prepare_band_mean(method, at_points, JointFrfs(), ["y", "theta"], (200, 800), back)
    assert problem.method == method
    assert problem.bands == (((200.0, 800.0),),) * 2
    np.testing.assert_array_equal(problem.freq_hz, beams.freq)
    np.testing.assert_allclose(problem.k_lines, jf.inverse_substructuring(h), rtol=1e-6, atol=1e-3)


def test_a_decoupling_takes_what_is_measured_between_internal_points(beams):
    s = beams
    known = JointFrfs(h_a=s.h_a, h_b=s.h_b, dofs_j=s.at, dofs_k=s.at, dofs_r=s.inner)
    h_c = s.coupled(s.joint)[:, s.inner][:, :, s.inner]
    problem = prepare_band_mean("decoupling-rr", as_measured(s.freq, h_c), known, None, None, None)
    assert problem.dofs == ("0", "1")
    np.testing.assert_array_equal(
        problem.k_lines, jf.decouple("rr", s.h_a, s.h_b, h_c, s.at, s.at, s.inner, freq_hz=s.freq)
    )
