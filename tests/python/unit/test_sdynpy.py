"""Arrays of SDynPy and datasets of ESCDF, both ways; through SDynPy itself where it is installed."""

import sys
import types

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.errors import FileContentError
from jointfrf.io import Channel, FrfSet

FREQ = np.arange(10.0, 60.0, 10.0)
RESPONSES = (Channel(101, "+x"), Channel(101, "-ry"), Channel(7, "-z"))
EXCITATIONS = (Channel(101, "+x"), Channel(7, "+z"))


@pytest.fixture
def frfs():
    rng = np.random.default_rng(0)
    h = rng.standard_normal((FREQ.size, 3, 2)) + 1j * rng.standard_normal((FREQ.size, 3, 2))
    return FrfSet(FREQ, RESPONSES, EXCITATIONS, h, "accelerance")


@pytest.fixture
def sdynpy(monkeypatch):
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "escdf", escdf())
        return pytest.importorskip("sdynpy")


class Property:
    """A property as ESCDF has it: read when it is indexed, a TypeError where it has no value."""

    def __init__(self, value):
        self.value = value

    @property
    def shape(self):
        return np.shape(self.value)

    def __getitem__(self, key):
        if self.value is None:
            raise TypeError("no value")
        return np.asarray(self.value)[key]


class Data:
    """A dataset of type data."""

    def __init__(self, name="", descriptive_name=""):
        object.__setattr__(self, "held", {})

    def istype(self, name):
        return name == "data"

    def __setattr__(self, name, value):
        self.held[name] = Property(value)

    def __getattr__(self, name):
        return self.held.get(name, Property(None))


def escdf():
    found = types.ModuleType("escdf")
    found.classes = types.SimpleNamespace(data=Data)
    found.Dataset = Data
    return found


def same(found, frfs):
    np.testing.assert_array_equal(found.matrix(RESPONSES, EXCITATIONS), frfs.h)
    assert found.quantity == "accelerance"


def test_records_of_sdynpy_both_ways(frfs):
    array = jf.io.to_sdynpy(frfs)
    assert array.shape == (3, 2)
    assert array["coordinate"][1, 1].tolist() == [(101, -5), (7, 3)]
    np.testing.assert_array_equal(array["ordinate"], np.moveaxis(frfs.h, 0, -1))
    for one in (array, array.ravel()[::-1], array.T):
        same(jf.io.from_sdynpy(one, unit="m/s^2/N"), frfs)
    single = jf.io.from_sdynpy(array[:1, :1], unit="g/N")
    np.testing.assert_allclose(single.h[:, 0, 0], 9.80665 * frfs.h[:, 0, 0])


def test_missing_frfs_stay_missing(frfs):
    h = frfs.h.copy()
    h[:, 1, 0] = np.nan
    held = FrfSet(FREQ, RESPONSES, EXCITATIONS, h, "accelerance")
    assert jf.io.to_sdynpy(held).shape == (5,)
    for found in (
        jf.io.from_sdynpy(jf.io.to_sdynpy(held), unit="m/s^2/N"),
        jf.io.from_escdf(jf.io.to_escdf(held)),
    ):
        np.testing.assert_array_equal(found.matrix(RESPONSES, EXCITATIONS, allow_missing=True), h)


@pytest.mark.parametrize("start", [False, True])
def test_datasets_of_escdf_both_ways(frfs, start):
    dataset = Data()
    for name, value in jf.io.to_escdf(frfs).items():
        setattr(dataset, name, value)
    if start:
        dataset.abscissa, dataset.abscissa_start, dataset.abscissa_step = None, 10.0, 10.0
    same(jf.io.from_escdf(dataset), frfs)
    same(jf.io.from_escdf(jf.io.to_escdf(frfs)), frfs)
    dataset.ordinate_unit = ["g/N"] * 6
    with pytest.raises(FileContentError, match="the unit of the FRFs is 'g/N', not the one of unit="):
        jf.io.from_escdf(dataset, unit="m/s^2/N")
    np.testing.assert_allclose(jf.io.from_escdf(jf.io.to_escdf(frfs) | {"abscissa_unit": "kHz"}).freq_hz, 1e3 * FREQ)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"data_type": "time response"}, "type 'time response', not FRFs; .* for example with pyFRF"),
        ({"data_type": "power spectrum"}, "type 'power spectrum', not FRFs; name a dataset of FRFs"),
        ({"data_type": None}, "ESCDF has no data_type; name a dataset of type data"),
        ({"channel": [["1X+", "1X+"]]}, r"ordinates \(6, 5\) and channels \(1, 2\)"),
        ({"channel": [["1", "1X+"]] * 6}, "has no direction of node 1 in its channels"),
        ({"abscissa": np.arange(3.0)}, "the abscissa does not fit 6 functions of 5 lines"),
        ({"ordinate_unit": ""}, "the FRFs have no unit; give unit="),
        ({"ordinate_unit": ["m/N", *["g/N"] * 5]}, r"is \[m/N\], .* is \[g/N\]; export them alike"),
    ],
)
def test_a_wrong_dataset_is_one_sentence(frfs, change, message):
    with pytest.raises(FileContentError, match=message):
        jf.io.from_escdf(jf.io.to_escdf(frfs) | change)


def test_other_arrays_are_named(frfs):
    with pytest.raises(TypeError, match="array must be an array of FRFs of SDynPy, not ndarray"):
        jf.io.from_sdynpy(frfs.h, unit="m/N")


def test_files_with_first_line_and_spacing(frfs, tmp_path):
    """As `save(compress_abscissa=True)` writes them."""
    array = jf.io.to_sdynpy(frfs)
    short = array[[name for name in array.dtype.names if name != "abscissa"]].copy()
    path = tmp_path / "a.npz"
    np.savez(path, data=short, function_type=4, abscissa_start=10.0, abscissa_step=10.0)
    same(jf.io.read_frfs(path, unit="m/s^2/N"), frfs)
    np.savez(path, data=array, function_type=1)
    with pytest.raises(FileContentError, match=r"functions of type 1 of sdynpy; .* for example with pyFRF"):
        jf.io.read_frfs(path, unit="m/s^2/N")


def test_through_sdynpy(frfs, tmp_path, sdynpy):
    array = jf.io.to_sdynpy(frfs).view(sdynpy.data.TransferFunctionArray)
    assert [str(one) for one in array.response_coordinate[:, 0].string_array()] == ["101X+", "101RY-", "7Z-"]
    for one in (array, array.reshape_to_matrix(), array.flatten()):
        same(jf.io.from_sdynpy(one, unit="m/s^2/N"), frfs)
    for short in (False, True):
        array.save(str(tmp_path / "a.npz"), compress_abscissa=short)
        same(jf.io.read_frfs(tmp_path / "a.npz", unit="m/s^2/N"), frfs)
    np.savez(tmp_path / "b.npz", data=jf.io.to_sdynpy(frfs), function_type=4)
    again = sdynpy.data.load(str(tmp_path / "b.npz"))
    np.testing.assert_array_equal(again.ordinate, np.moveaxis(frfs.h, 0, -1))
    to_data, from_data = (getattr(sdynpy.fileio.sdynpy_escdf, name) for name in ("to_data", "from_data"))
    same(jf.io.from_escdf(from_data("a", array), unit="m/s^2/N"), frfs)
    dataset = Data()
    for name, value in jf.io.to_escdf(frfs).items():
        setattr(dataset, name, value)
    same(jf.io.from_sdynpy(to_data(dataset), unit="m/s^2/N"), frfs)
