"""Sets of FRFs put together, their coherence and averages, and what contradicts each other."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.frf.merge import merge_frfs
from jointfrf.io import Channel, FrfSet, read_uff, write_uff
from uff_writer import FREQ_HZ, VALUES, function


def frfs(responses, excitations=("1:x",), quantity="accelerance", seed=0, source="", **more):
    random = np.random.default_rng(seed)
    shape = (5, len(responses), len(excitations))
    h = random.normal(size=shape) + 1j * random.normal(size=shape)
    channels = [tuple(Channel.parse(name) for name in names) for names in (responses, excitations)]
    return FrfSet(np.arange(1.0, 6.0), *channels, more.pop("h", h), quantity, source=source, **more)


def test_parts_become_one_matrix():
    one = frfs(["1:x", "2:x"], coherence=np.full((5, 2, 1), 0.9), averages=5, source="one", stated="g/N")
    two = frfs(["3:x"], ["1:x", "2:x"], seed=1, source="two", stated="m/s^2/N")
    merged = merge_frfs([one, two])
    assert [str(channel) for channel in merged.responses] == ["1:+x", "2:+x", "3:+x"]
    np.testing.assert_array_equal(merged.matrix(["1:x", "2:x"], ["1:x"]), one.h)
    np.testing.assert_array_equal(merged.matrix(["3:x"], ["1:x", "2:x"]), two.h)
    assert merged.missing(["1:x"], ["2:x"])
    np.testing.assert_array_equal(merged.coherence_matrix(["1:x"], ["1:x"]), np.full((5, 1, 1), 0.9))
    assert merged.coherence_matrix(["1:x", "3:x"], ["1:x"]) is None
    assert merged.least_averages(["1:x"], ["1:x"]) == 5
    assert merged.least_averages(["3:x"], ["1:x"]) is None
    assert (merged.source, merged.stated) == ("one, two", "g/N; m/s^2/N")
    assert "coherence of 2 of 4 FRFs, 5 averages" in str(merged)
    assert merge_frfs([one]) is one


def test_quantities_are_made_one():
    one, two = frfs(["1:x"], quantity="mobility"), frfs(["2:x"], quantity="accelerance")
    merged = merge_frfs([one, two])
    assert merged.quantity == "accelerance"
    omega = 2 * np.pi * one.freq_hz
    np.testing.assert_allclose(merged.h[:, 0, 0], 1j * omega * one.h[:, 0, 0], rtol=1e-14)
    np.testing.assert_allclose(merged.receptance().h[:, 0, 0], one.h[:, 0, 0] / (1j * omega), rtol=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"h": np.ones((5, 1, 1))}, r"FRF 1:\+x / 1:\+x in one and in two contradict each other: leave one out"),
        ({"coherence": np.full((5, 1, 1), 0.5)}, r"coherence of 1:\+x / 1:\+x in one and in two contradict"),
        ({"averages": 4}, r"averages of 1:\+x / 1:\+x in one and in two contradict"),
        ({"coordinates": {1: np.array([0, 0, 1e-3])}}, "coordinates of node 1 in one and in two contradict"),
    ],
)
def test_contradictions_are_refused(change, message):
    same = {"coherence": np.full((5, 1, 1), 0.9), "averages": 5, "coordinates": {1: np.zeros(3)}}
    one, copy = (frfs(["1:x"], source=name, **same) for name in ("one", "two"))
    np.testing.assert_array_equal(merge_frfs([one, copy]).h, one.h)
    with pytest.raises(FileContentError, match=message):
        merge_frfs([one, frfs(["1:x"], source="two", **(same | change))])


def test_different_lines_are_refused():
    one, two = frfs(["1:x"]), frfs(["2:x"]).select((1, 4))
    with pytest.raises(FileContentError, match=r"same frequency lines: 5 lines 1 to 5 Hz in set 1, 4 lines"):
        merge_frfs([one, two])
    with pytest.raises(ValueError, match="no set of FRFs"):
        merge_frfs([])


def test_coherence_goes_where_the_lines_go():
    coherence = np.linspace(0.1, 0.5, 5).reshape(5, 1, 1)
    frf = frfs(["1:x"], coherence=coherence, averages=3)
    np.testing.assert_array_equal(frf.select((2, 4)).coherence, coherence[1:4])
    at_zero = FrfSet(np.arange(5.0), frf.responses, frf.excitations, frf.h, "mobility", coherence=coherence)
    with pytest.warns(FileContentWarning, match="0 Hz is dropped"):
        np.testing.assert_array_equal(at_zero.receptance().coherence, coherence[1:])
    np.testing.assert_array_equal(frf.coherence_matrix(["1:-x"], ["1:x"]), coherence)
    assert frfs(["1:x"]).coherence_matrix(["1:x"], ["1:x"]) is None
    assert frfs(["1:x"]).least_averages(["1:x"], ["1:x"]) is None
    with pytest.raises(FileContentError, match=r"missing FRFs .*9:\+x"):
        frf.coherence_matrix(["9:x"], ["1:x"])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"coherence": np.ones((5, 1))}, r"coherence has shape \(5, 1\)"),
        ({"coherence": np.full((5, 1, 1), 1.5)}, "coherence must be from 0 to 1, not 1.5 to 1.5"),
        ({"averages": 0}, "averages must be 1 or more, not 0"),
        ({"averages": np.inf}, "averages must be 1 or more, not inf"),
        ({"averages": [1, 2]}, r"averages has shape \(2,\)"),
    ],
)
def test_coherence_and_averages_are_checked(wrong, message):
    with pytest.raises(ValueError, match=message):
        frfs(["1:x"], **wrong)


def test_estimate_noise_takes_coherence_and_averages_of_a_set():
    """Coherence of n averages of known noise: the factor on what it says of the variance comes out near 1."""
    freq, n = np.linspace(1, 10, 300), 8
    h = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    random = np.random.default_rng(3)
    noise = 0.05 * abs(h) * (random.normal(size=h.shape) + 1j * random.normal(size=h.shape)) / np.sqrt(2)
    coherence = 1 / (1 + n * 0.05**2 * np.ones(h.shape))
    points = (Channel(1, "x"), Channel(2, "x"))
    frf = FrfSet(freq, points, points, h + noise, coherence=coherence, averages=n)
    found = jf.estimate_noise(
        freq,
        frf.matrix(points, points),
        coherence=frf.coherence_matrix(points, points),
        averages=frf.least_averages(points, points),
    )
    assert found.level == pytest.approx(0.05, rel=0.1)


@pytest.mark.parametrize("form", [{}, {"binary": False}, {"single": True}, {"binary": False, "single": True}])
@pytest.mark.parametrize("freq_hz", [[10.0, 12.0, 14.0, 16.0, 18.0], [1.0, 2.0, 4.0, 8.0, 16.0]])
def test_coherence_comes_back_from_a_universal_file(tmp_path, form, freq_hz):
    points = (Channel(1, "x"), Channel(2, "-y"))
    coherence = np.random.default_rng(1).uniform(size=(5, 2, 2))
    coherence[:, 1, 1] = np.nan
    frf = FrfSet(np.array(freq_hz), points, points, np.ones((5, 2, 2)), "mobility", coherence=coherence)
    write_uff(tmp_path / "a.uff", frf, **form)
    found = read_uff(tmp_path / "a.uff")
    np.testing.assert_allclose(found.coherence, coherence, rtol=1e-5 if form.get("single") else 1e-10)
    assert found.stated == "velocity [m/s] per excitation force [N]"


@pytest.fixture
def write(tmp_path):

    def write(*datasets):
        path = tmp_path / "test.uff"
        path.write_bytes(b"".join(datasets))
        return path

    return write


COHERENCE = {"values": np.array([0.5, 0.75, 1.0]), "number_type": 4, "function_type": 6}


def test_coherence_of_a_file_is_read(write):
    frf = read_uff(write(function(), function(**COHERENCE)))
    assert frf.coherence[:, 0, 0].tolist() == [0.5, 0.75, 1.0]
    against = function(**(COHERENCE | {"response": (1, -2)}))
    assert read_uff(write(function(), against)).coherence[:, 0, 0].tolist() == [0.5, 0.75, 1.0]
    assert read_uff(write(function())).coherence is None
    assert read_uff(write(function(), function(**(COHERENCE | {"response": (7, 2)})))).coherence is None


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"values": np.array([0.5, 0.75, 1.5])}, "coherence left out: it is not from 0 to 1"),
        ({"freq_hz": FREQ_HZ + 1}, "coherence left out: its frequency lines differ from the lines of the FRFs"),
        ({"response": (0, 2)}, "coherence left out: it names no response node"),
    ],
)
def test_coherence_that_cannot_be_used_is_left_out(write, wrong, message):
    path = write(function(), function(**(COHERENCE | wrong)))
    with pytest.warns(FileContentWarning, match=message):
        assert read_uff(path).coherence is None
    with pytest.warns(FileContentWarning, match="second coherence"):
        read_uff(write(function(), function(**COHERENCE), function(**COHERENCE)))


def test_what_the_user_says_must_not_contradict_the_file(write):
    path = write(function())
    message = r"states accelerance \(acceleration \[m/s\^2\] per excitation force \[N\] in dataset 1\), not"
    with pytest.raises(FileContentError, match=message):
        read_uff(path, quantity="mobility")
    with pytest.raises(FileContentError, match=r"does not fit the response of mobility .*; give unit="):
        read_uff(path, quantity="mobility", force_quantity=True)
    forced = read_uff(path, unit="m/s/N", force_quantity=True)
    assert (forced.quantity, forced.h[0, 0, 0]) == ("mobility", VALUES[0])
    assert read_uff(path, quantity="accelerance").h[0, 0, 0] == VALUES[0]


def test_nodes_that_are_wanted(write):
    path = write(*(function(response=(i, 2), reference=(j, 2)) for i in (1, 2, 3) for j in (1, 2, 3)))
    frf = read_uff(path, nodes=[1, 3])
    assert [channel.node for channel in frf.responses] == [1, 3]
    with pytest.raises(FileContentError, match=r"contains no FRF between nodes 8, 9"):
        read_uff(path, nodes=[8, 9])
