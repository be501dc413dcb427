"""Masked arrays: numpy drops the mask where it converts, and would compute with what is hidden."""

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.linspace(1.0, 10.0, 5)
CHANNELS = (jf.io.Channel(1, "+x"), jf.io.Channel(2, "+x"))


def masked(array):
    mask = np.zeros(array.shape, bool)
    mask.ravel()[-1] = True
    return np.ma.array(array, mask=mask)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("a", lambda h, f: jf.invert(masked(h))),
        ("h_b", lambda h, f: jf.couple(h, masked(h), h, [0, 1], [0, 1])),
        ("k_joint", lambda h, f: jf.couple(h, h, masked(h[0]), [0, 1], [0, 1])),
        ("gamma", lambda h, f: jf.inverse_substructuring(masked(h))),
        ("gamma", lambda h, f: jf.identify(f, masked(h), ["y"])),
        ("freq_hz", lambda h, f: jf.identify(masked(f), h, ["y"])),
        ("freq_hz", lambda h, f: jf.receptance(masked(f), [[2.0]], [[1.0]])),
        ("h", lambda h, f: jf.pollute(masked(h), 0.01, seed=1)),
        ("h", lambda h, f: jf.peak(masked(h[:, 0, 0]), f)),
        ("h", lambda h, f: jf.io.FrfSet(f, CHANNELS, CHANNELS, masked(h))),
    ],
)
def test_masked_entries_are_refused(random_lines, name, call):
    with pytest.raises(ValueError, match=rf"^{name} has masked entries, the first at index \(.*leave their lines out"):
        call(random_lines(5, 2), FREQ)


def test_a_masked_array_without_masked_entries_is_an_array(random_lines):
    a = random_lines(5, 2)
    np.testing.assert_array_equal(jf.invert(np.ma.array(a)), jf.invert(a))


def test_results_do_not_go_into_a_masked_array(random_lines):
    a = random_lines(5, 2)
    with pytest.raises(TypeError, match="out must be a plain numpy array, not a masked one"):
        jf.invert(a, out=np.ma.array(np.empty_like(a)))
