"""FrfSet and Channel: names, signs, missing entries, conversion."""

import numpy as np
import pytest

from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io import Channel, FrfSet


def channels(*names):
    return tuple(Channel.parse(name) for name in names)


def frf_set(freq_hz=(1.0, 2.0, 3.0), responses=("1:+x", "2:-y"), excitations=("1:+x", "3:+z"), **more):
    freq_hz = np.array(freq_hz)
    rng = np.random.default_rng(1)
    shape = (freq_hz.size, len(responses), len(excitations))
    h = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    return FrfSet(freq_hz, channels(*responses), channels(*excitations), h, **more)


@pytest.mark.parametrize("text", ["102:+y", "102:y", "102+y", "102y", " 102:Y ", "102: y"])
def test_channel_is_parsed_from_every_spelling(text):
    assert str(Channel.parse(text)) == "102:+y"
    assert Channel.parse(Channel.parse(text)) == Channel(102, "+y")


@pytest.mark.parametrize(
    "text", ["", "y", "102", "102:", "102:q", "102:++y", "-3:x", "0:x", "1.5:x", "102:xy", "x:102"]
)
def test_what_is_no_channel_is_refused_by_name(text):
    with pytest.raises(ValueError, match=r"channel|node"):
        Channel.parse(text)


def test_channel_knows_its_sign_axis_and_opposite():
    channel = Channel.parse("7:-rx")
    assert (channel.sign, channel.axis, channel.is_rotation) == (-1, "rx", True)
    assert channel.opposite() == Channel(7, "+rx")
    with pytest.raises(ValueError, match="direction 'up'"):
        Channel(7, "up")


def test_matrix_picks_by_name_and_turns_the_sign_of_opposite_directions():
    frfs = frf_set()
    h = frfs.matrix(["2:+y", "1:-x"], ["3:-z", "1:x"])
    expected = np.stack(
        [
            np.stack([frfs.h[:, 1, 1], -frfs.h[:, 1, 0]], axis=-1),
            np.stack([frfs.h[:, 0, 1], -frfs.h[:, 0, 0]], axis=-1),
        ],
        axis=1,
    )
    np.testing.assert_array_equal(h, expected)
    assert h.flags.c_contiguous
    assert h.dtype == np.complex128


def test_matrix_prefers_the_channel_as_measured_to_its_opposite():
    frfs = frf_set(responses=("1:-x", "1:+x"))
    np.testing.assert_array_equal(frfs.matrix(["1:+x"], ["1:+x"])[:, 0, 0], frfs.h[:, 1, 0])
    frfs.h[:, 1, 0] = np.nan
    np.testing.assert_array_equal(frfs.matrix(["1:+x"], ["1:+x"])[:, 0, 0], -frfs.h[:, 0, 0])


def test_missing_entries_are_named():
    frfs = frf_set(source="test.uff")
    frfs.h[:, 1, 1] = np.nan
    assert frfs.missing(["1:x", "2:y"], ["1:x", "3:z"]) == [channels("2:y", "3:z")]
    assert frfs.has("1:x", "3:z")
    assert not frfs.has("2:y", "3:z")
    with pytest.raises(FileContentError, match=r"test.uff: missing FRFs .*: 2:\+y / 3:\+z, 9:\+x / 3:\+z$"):
        frfs.matrix(["1:x", "2:y", "9:x"], ["3:z"])


def test_many_missing_entries_are_counted():
    with pytest.raises(FileContentError, match=r"29:\+x / 1:\+x and 5 more$"):
        frf_set().matrix([f"{node}:x" for node in range(20, 35)], ["1:x"])


@pytest.mark.parametrize(("quantity", "power"), [("mobility", 1), ("accelerance", 2)])
def test_receptance_divides_by_i_omega(quantity, power):
    frfs = frf_set(quantity=quantity)
    receptance = frfs.receptance()
    omega = 2.0 * np.pi * frfs.freq_hz[:, None, None]
    np.testing.assert_allclose(receptance.h * (1j * omega) ** power, frfs.h, rtol=1e-14)
    assert receptance.quantity == "receptance"
    assert receptance.receptance() is receptance


def test_the_line_at_0_hz_is_dropped_with_one_warning():
    frfs = frf_set(freq_hz=(0.0, 1.0, 2.0), quantity="accelerance")
    with pytest.warns(FileContentWarning, match="0 Hz is dropped") as caught:
        receptance = frfs.receptance()
    assert len(caught) == 1
    assert receptance.freq_hz.tolist() == [1.0, 2.0]
    assert np.isfinite(receptance.h).all()
    assert frf_set(freq_hz=(0.0, 1.0)).receptance().freq_hz[0] == 0.0


def test_select_keeps_both_ends_of_the_band():
    frfs = frf_set()
    assert frfs.select((2.0, 3.0)).freq_hz.tolist() == [2.0, 3.0]
    np.testing.assert_array_equal(frfs.select((2.0, 3.0)).h, frfs.h[1:])
    with pytest.raises(FileContentError, match="no frequency line in 5 to 6 Hz: the 3 lines are 1 to 3 Hz"):
        frfs.select((5.0, 6.0))
    with pytest.raises(ValueError, match="does not increase"):
        frfs.select((6.0, 5.0))


def test_summary_tells_what_is_there():
    frfs = frf_set(quantity="mobility", coordinates={1: np.zeros(3)}, source="test.uff")
    frfs.h[:, 1, 1] = np.nan
    text = frfs.summary()
    assert "3 mobilities (m/s)/N: 2 responses x 2 excitations, 1 missing" in text
    assert "3 lines, 1 to 3 Hz, spacing 1 Hz" in text
    assert "coordinates of 1 of 3 nodes" in text
    assert "uneven spacing 1 to 7 Hz" in frf_set(freq_hz=(1.0, 2.0, 9.0)).summary()
    assert "one line" in frf_set(freq_hz=(1.0,)).summary()
    assert "no lines" in str(frf_set(freq_hz=()))
    assert repr(frfs) == "<FrfSet (3, 2, 2) mobility>"


def test_an_inconsistent_set_is_refused():
    with pytest.raises(ValueError, match=r"h has shape \(3, 1, 1\)"):
        FrfSet(np.arange(2.0), channels("1:x"), channels("1:x"), np.ones((3, 1, 1)))
    with pytest.raises(ValueError, match="quantity 'stiffness'"):
        frf_set(quantity="stiffness")
    with pytest.raises(ValueError, match="responses names a channel twice"):
        frf_set(responses=("1:x", "1:+x"))
