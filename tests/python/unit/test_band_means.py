"""The mean of K*(w) over bands: its problem and its note."""

import numpy as np

import jointfrf as jf
from jointfrf.identification.band_means import fit_band_mean, prepare_band_mean
from jointfrf.identification.prepare import as_measured
from jointfrf.substructuring.methods import JointFrfs


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


def test_the_note_of_a_band_mean(beams):
    gamma = as_measured(beams.freq, beams.gamma(beams.joint))
    problem = prepare_band_mean("inverse-substructuring", gamma, JointFrfs(), ["y", "theta"], (200, 800), None)
    fit = fit_band_mean(problem)
    assert "its bias by noise is not included" in fit.notes[0]
    assert not fit.warnings
    assert list(fit.parameters) == ["k_y", "k_theta", "c_y", "c_theta"]
