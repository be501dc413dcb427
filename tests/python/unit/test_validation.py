"""A joint found, put between its parts or others, beside the measured assembly."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.validation import compare_frfs

FREQ = np.linspace(0.5, 10, 200)
A = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
B = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
JOINT = jf.Joint([2000.0], [3.0], ["x"])


def parts(b=B):
    return A.receptance(FREQ), b.receptance(FREQ), jf.assemble(A, b, JOINT, [1], [0]).receptance(FREQ)


def test_the_exact_joint_regenerates_the_assembly():
    h_a, h_b, whole = parts()
    found = jf.validate(FREQ, whole, h_a, h_b, JOINT, [1], [0])
    assert found.regenerated.shape == whole.shape
    assert max(found.amplitude_error.max(), found.frequency_error.max(), found.difference.max()) < 1e-9
    assert (found.responses, found.forces) == (("0", "1", "2", "3"),) * 2


def test_errors_are_those_of_the_peaks():
    """The assembly of other matrices, by the same algebra that the joint plays no part in."""
    h_a, h_b, whole = parts()
    soft = jf.Joint([1500.0], [3.0])
    other = jf.assemble(A, B, soft, [1], [0]).receptance(FREQ)
    found = jf.validate(FREQ, whole[:, :1, 2:], h_a, h_b, soft, [1], [0], outputs=[0], inputs=[2, 3], band=(3, 9))
    inside = (FREQ >= 3) & (FREQ <= 9)
    for column, force in enumerate((2, 3)):
        pair = whole[inside, 0, force], other[inside, 0, force]
        size, at = zip(*(jf.peak(h, FREQ[inside], refine=True) for h in pair), strict=True)
        assert found.amplitude_error[0, column] == pytest.approx(100 * abs(1 - size[1] / size[0]), rel=1e-6)
        assert found.frequency_error[0, column] == pytest.approx(100 * abs(1 - at[1] / at[0]), rel=1e-6)
        off = np.linalg.norm(pair[1] - pair[0]) / np.linalg.norm(pair[0])
        assert found.difference[0, column] == pytest.approx(100 * off, rel=1e-6)


def test_a_fit_is_transferred_to_another_part():
    """Identified between A and B; tested between A and a part of other masses, by noisy FRFs away from the joint."""
    whole = parts()[2]
    fit = jf.identify(FREQ, jf.pollute(whole[:, 1:3, 1:3], 0.01, seed=3), dofs=["x"])
    h_a, h_b, new = parts(jf.chain([6, 1], [3000, 1500], [2, 2], ground="end"))
    measured = jf.pollute(new, 0.01, seed=4)
    found = jf.validate(FREQ, measured[:, [0, 3]], h_a, h_b, fit, [1], [0], outputs=[0, 3])
    assert 0.7 < np.median(found.difference) < 1.5  # the noise of the test
    wrong = jf.validate(FREQ, measured[:, [0, 3]], h_a, h_b, jf.Joint([1e3], [3.0]), [1], [0], outputs=[0, 3])
    assert np.median(wrong.difference) > 20 * np.median(found.difference)


def test_what_is_missing_is_left_out():
    h_a, h_b, whole = parts()
    whole[:, 0, 3] = np.nan
    found = jf.validate(FREQ, whole, h_a, h_b, JOINT, [1], [0])
    assert found.is_measured.sum() == 15
    assert np.isnan(found.amplitude_error[0, 3])
    assert "15 FRFs, 0.5 to 10 Hz" in str(found)
    assert max(found.to_dict()["largest"].values()) < 1e-9


def test_a_band_without_peak_has_no_frequency_error():
    h_a, h_b, whole = parts()
    found = jf.validate(FREQ, whole, h_a, h_b, JOINT, [1], [0], band=(9.5, 10))
    assert np.isnan(found.frequency_error).all()
    assert "-: no peak" in str(found)
    assert np.isnan(found.to_dict()["median"]["frequency_error"])


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (dict(joint=3.0), TypeError, "joint must be a Fit, Joint or LawJoint, not float"),
        (dict(outputs=[0, 1]), ValueError, r"measured has shape \(200, 4, 4\), the regenerated FRFs \(200, 2, 4\)"),
        (dict(outputs=[4]), ValueError, "outputs"),
        (dict(responses=["a"]), ValueError, "must name 4 rows and 4 columns of measured"),
        (dict(band=(20, 30)), ValueError, "20"),
        (dict(measured=np.full((200, 4, 4), np.nan)), ValueError, "measured contains no FRF in the band"),
        (dict(dofs_b=[7]), ValueError, "dofs_b"),
        (dict(forces=3), TypeError, "forces must"),
    ],
)
def test_wrong_arguments(change, error, message):
    h_a, h_b, whole = parts()
    sound = dict(freq_hz=FREQ, measured=whole, h_a=h_a, h_b=h_b, joint=JOINT, dofs_a=[1], dofs_b=[0])
    with pytest.raises(error, match=message):
        jf.validate(**sound | change)


def test_lines_that_are_not_finite():
    h_a, h_b, whole = parts()
    whole[7, 0, 0] = np.inf
    with pytest.raises(ValueError, match=r"NaN or Inf"):
        jf.validate(FREQ, whole, h_a, h_b, JOINT, [1], [0])


def test_a_largest_peak_of_another_mode_is_named():
    """Two modes of nearly equal peaks: with less damping of the second one, it becomes the largest."""
    freq = np.arange(50.0, 300.0, 0.5)

    def frf(second: float) -> np.ndarray:
        modes = ((100.0, 0.01), (172.0, second))
        return sum(f**2 / (f**2 * (1 + 1j * eta) - freq**2) for f, eta in modes)[:, None, None]

    one = compare_frfs(freq, frf(0.0105), frf(0.0095), ["1:y"], ["2:y"])
    assert one.frequency_error[0, 0] == pytest.approx(72, abs=1)
    assert one.other_mode.all()
    assert "in 1 FRFs the largest peak is another mode than measured, first 1:y / 2:y" in str(one)
    same = compare_frfs(freq, frf(0.0105), 1.02 * frf(0.0104), ["1:y"], ["2:y"])
    assert not same.other_mode.any()
    assert "another mode" not in str(same)
    # a shift of the one mode by two lines, with noise, is none
    moved = compare_frfs(freq, frf(0.02), jf.pollute(np.roll(frf(0.02), 2, axis=0), 0.05, seed=1), ["1:y"], ["2:y"])
    assert not moved.other_mode.any()
