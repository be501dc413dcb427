"""Universal Files as programs export them: read to the last digit that they hold, or refused in one sentence."""

import gc
import warnings

import numpy as np
import pytest

from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io import read_frfs, read_uff
from uff_exporters import COHERENCE, EXPORTERS, FREQ_HZ, REFUSED, VALUES, in_single

pyuff = pytest.importorskip("pyuff")


def read(path, content):
    path.write_bytes(content)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        return read_uff(path), [str(each.message) for each in warned if each.category is FileContentWarning]


@pytest.mark.parametrize("name", EXPORTERS)
def test_every_form_is_read_rightly(tmp_path, name):
    frfs, _ = read(tmp_path / "export.uff", EXPORTERS[name]())
    assert frfs.quantity == "accelerance"
    assert [str(channel) for channel in frfs.responses] == ["101:+z", "102:+z"]
    assert [str(channel) for channel in frfs.excitations] == ["101:+z"]
    np.testing.assert_allclose(frfs.freq_hz, FREQ_HZ, rtol=1e-12)
    if "58b" in name:
        is_double = "double" in name or "80 columns" in name or "counts" in name
        np.testing.assert_array_equal(frfs.h[:, :, 0].T, VALUES if is_double else in_single(VALUES))
    else:
        np.testing.assert_allclose(frfs.h[:, :, 0].T, VALUES, rtol=5e-12 if "double" in name else 5e-6)


def test_what_is_told_of_each_form(tmp_path):
    """Nothing where nothing was assumed."""
    expected = {
        "several functions of a pair": "between the same channels left out, the first is used",
        "LMS Test.Lab": "",
        "dataset 164 in mm": "",
    }
    for name, content in EXPORTERS.items():
        _, warned = read(tmp_path / "export.uff", content())
        words = expected.get(name, "")
        assert bool(warned) == bool(words), (name, warned)
        assert words in " ".join(warned), (name, warned)


def test_coherence_of_averaged_frfs(tmp_path):
    frfs, _ = read(tmp_path / "averaged.uff", EXPORTERS["H1 and coherence"]())
    np.testing.assert_allclose(frfs.coherence[:, :, 0], np.stack([COHERENCE, COHERENCE], axis=1), rtol=1e-12)


def test_coordinates_of_a_testlab_file(tmp_path):
    frfs, _ = read(tmp_path / "testlab.uff", EXPORTERS["LMS Test.Lab"]())
    np.testing.assert_allclose(frfs.coordinates[102], [1.5, 0.0, 0.0])


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_refused_in_one_sentence(tmp_path, name):
    make, words = REFUSED[name]
    path = tmp_path / "export.uff"
    path.write_bytes(make())
    with pytest.raises(FileContentError, match=words) as raised:
        read_frfs(path)
    assert "\n" not in str(raised.value)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # it leaves its file open
@pytest.mark.parametrize("binary", [0, 1])
def test_files_that_pyuff_writes(tmp_path, binary):
    """An independent writer, in double precision; the length that it states of complex numbers is half of theirs."""
    path = tmp_path / "pyuff.uff"
    for node, values in zip((101, 102), VALUES, strict=True):
        record = pyuff.prepare_58(
            binary=binary, func_type=4, rsp_node=node, rsp_dir=3, ref_node=101, ref_dir=3, data=values, x=FREQ_HZ,
            num_pts=FREQ_HZ.size, abscissa_spacing=1, abscissa_min=FREQ_HZ[0], abscissa_inc=10.0, ord_data_type=6,
            abscissa_spec_data_type=18, abscissa_axis_units_lab="Hz", ordinate_spec_data_type=12,
            ordinate_axis_units_lab="m/s^2", orddenom_spec_data_type=13, orddenom_axis_units_lab="N",
            id1="FRF", id2="NONE", id3="NONE", id4="NONE", id5="NONE", rsp_ent_name="NONE", ref_ent_name="NONE",
        )  # fmt: skip
        pyuff.UFF(str(path)).write_sets([record], "add")
    gc.collect()
    frfs = read_uff(path)
    np.testing.assert_allclose(frfs.h[:, :, 0].T, VALUES, rtol=1e-11)
