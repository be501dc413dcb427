"""The mean of K*(w) over bands: what it averages, and its note."""

import numpy as np
import pytest

import jointfrf as jf


def test_a_band_mean_transforms_what_is_measured_at_points(beams):
    mix = np.kron(np.eye(2), [[1.0, 0.01], [1.0, -0.01]])
    h = beams.gamma(beams.joint)
    method, back = "inverse-substructuring", np.linalg.inv(mix)
    fit = jf.identify_band_mean(beams.freq, mix @ h @ mix.T, method, ["y", "theta"], (200, 800), transform=back)
    assert fit.method == method
    assert fit.bands == (((200.0, 800.0),),) * 2
    inside = (beams.freq >= 200) & (beams.freq <= 800)
    np.testing.assert_array_equal(fit.freq_hz, beams.freq[inside])
    np.testing.assert_allclose(fit.k_lines, jf.inverse_substructuring(h)[inside], rtol=1e-6, atol=1e-3)


def test_a_decoupling_takes_what_is_measured_between_internal_points(beams):
    s = beams
    h_c = s.coupled(s.joint)[:, s.inner][:, :, s.inner]
    known = {"h_a": s.h_a, "h_b": s.h_b, "dofs_j": s.at, "dofs_k": s.at, "dofs_r": s.inner}
    fit = jf.identify_band_mean(s.freq, h_c, "decoupling-rr", **known)
    assert fit.dofs == ("0", "1")
    np.testing.assert_array_equal(
        fit.k_lines, jf.decouple("rr", s.h_a, s.h_b, h_c, s.at, s.at, s.inner, freq_hz=s.freq)
    )


def test_the_note_of_a_band_mean(beams):
    gamma = beams.gamma(beams.joint)
    fit = jf.identify_band_mean(beams.freq, gamma, "inverse-substructuring", ["y", "theta"], (200, 800))
    assert "[band-mean-error]" in fit.notes[0]
    assert not fit.warnings
    assert list(fit.value) == ["k_y", "k_theta", "c_y", "c_theta"]


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("compliance", "method must be one of .* not 'compliance'"),
        ("inverse_substructuring", "method must be one of .* inverse-substructuring, .* not 'inverse_sub"),
        ("ismm", "'ismm' needs alpha and k_initial"),
        ("decoupling-ss", "needs h_a, h_b, dofs_j, dofs_k and dofs_s"),
    ],
)
def test_bad_methods_get_one_sentence(beams, method, message):
    with pytest.raises(ValueError, match=message):
        jf.identify_band_mean(beams.freq, beams.gamma(beams.joint), method, ["y", "theta"])
