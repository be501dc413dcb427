"""`write_uff`: what is written comes back, by our reader and by pyuff."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, read_uff, write_uff

pyuff = pytest.importorskip("pyuff")

HAMMER_TEST = Path(__file__).resolve().parents[3] / "cases" / "hammer-test"


def frfs(quantity="accelerance"):
    """Translations and rotations, signs, a gap, and coordinates of one node of two."""
    rng = np.random.default_rng(3)
    freq_hz = np.arange(5.0, 15.0, 0.1)
    responses = (Channel(12, "+y"), Channel(3, "-rz"), Channel(3, "+x"))
    excitations = (Channel(12, "+y"), Channel(3, "-rz"))
    shape = (freq_hz.size, 3, 2)
    h = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) * 10.0 ** rng.uniform(-9, 6, shape)
    h[:, 2, 0] = np.nan
    return FrfSet(freq_hz, responses, excitations, h, quantity, {12: np.array([0.1, -2.5, 1e-3])})


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("single", [True, False])
@pytest.mark.parametrize("spacing", ["even", "uneven"])
def test_what_is_written_comes_back(tmp_path, quantity, binary, single, spacing):
    given = frfs(quantity)
    if spacing == "uneven":
        given = replace(given, freq_hz=given.freq_hz**1.7)
    write_uff(tmp_path / "test.uff", given, title="a title", binary=binary, single=single)
    found = read_uff(tmp_path / "test.uff")
    assert (found.quantity, found.responses, found.excitations) == (quantity, given.responses, given.excitations)
    assert found.source == str(tmp_path / "test.uff")
    # 13 columns hold 11 digits of a frequency of 1 Hz or more.
    np.testing.assert_allclose(found.freq_hz, given.freq_hz, rtol=1e-9)
    np.testing.assert_array_equal(found.measured, given.measured)
    if binary and spacing == "even":
        np.testing.assert_array_equal(found.h, given.h.astype(np.complex64) if single else given.h)
    else:  # half a unit of the last digit of either part
        for part in (np.real, np.imag):
            np.testing.assert_allclose(part(found.h), part(given.h), rtol=0.5e-5 if single else 0.5e-11)
    assert set(found.coordinates) == {12}
    np.testing.assert_allclose(found.coordinates[12], given.coordinates[12], rtol=1e-15)


def test_pyuff_reads_every_dataset(tmp_path):
    path = tmp_path / "test.uff"
    write_uff(path, frfs(), title="a title")
    sets = pyuff.UFF(str(path)).read_sets()
    assert [each["type"] for each in sets] == [151, 164, 2411, *[58] * 5]
    header, units, nodes, first = sets[:4]
    assert (header["description"].strip(), header["program"].strip()) == ("a title", "jointfrf")
    assert [units[name] for name in ("units_code", "length", "force", "temp", "temp_offset")] == [1, 1, 1, 1, 273.15]
    assert [nodes[name].tolist() for name in ("node_nums", "x", "y", "z")] == [[12], [0.1], [-2.5], [1e-3]]
    assert (first["func_type"], first["rsp_node"], first["rsp_dir"], first["ref_node"]) == (4, 12, 2, 12)
    assert (first["binary"], first["byte_ordering"], first["n_bytes"]) == (1, 1, 16 * 100)
    assert (first["ordinate_spec_data_type"], first["ordinate_axis_units_lab"].strip()) == (12, "m/s^2")
    assert (first["orddenom_spec_data_type"], first["orddenom_axis_units_lab"].strip()) == (13, "N")
    assert {each["rsp_dir"] for each in sets[3:]} == {2, -6, 1}
    turned = [each for each in sets[3:] if each["rsp_dir"] == each["ref_dir"] == -6]
    assert [each["ordinate_axis_units_lab"].strip() for each in turned] == ["rad/s^2"]
    assert [each["orddenom_axis_units_lab"].strip() for each in turned] == ["N m"]


@pytest.mark.parametrize("binary", [True, False])
def test_no_line_is_longer_than_the_format_has_columns_and_bytes_repeat(tmp_path, binary):
    for name in ("a", "b"):
        write_uff(tmp_path / name, frfs(), binary=binary)
    content = (tmp_path / "a").read_bytes()
    assert content == (tmp_path / "b").read_bytes()
    if not binary:
        assert max(map(len, content.decode("ascii").splitlines())) <= 80


def test_one_line(tmp_path):
    point = (Channel(1, "+z"),)
    write_uff(tmp_path / "one.uff", FrfSet(np.array([7.25]), point, point, np.array([[[1 - 2j]]])))
    found = read_uff(tmp_path / "one.uff")
    assert (found.freq_hz.tolist(), found.h[:, 0, 0].tolist(), found.coordinates) == ([7.25], [1 - 2j], {})


@pytest.mark.parametrize("title", ["two\nlines", "Prüfstand", "x" * 81])
def test_titles_that_cannot_be_written(tmp_path, title):
    with pytest.raises(ValueError, match=r"title .* is not one line of at most 80 ASCII characters"):
        write_uff(tmp_path / "test.uff", frfs(), title=title)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("value", [np.nan, np.inf, complex(0, np.nan)])
def test_an_frf_with_a_bad_line_is_refused_and_the_older_file_stays(tmp_path, value):
    (tmp_path / "test.uff").write_text("older")
    bad = frfs()
    bad.h[3, 1, 1] = value
    with pytest.raises(ValueError, match=r"FRF 3:-rz / 3:-rz contains NaN or Inf, first at 5\.3 Hz"):
        write_uff(tmp_path / "test.uff", bad)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["older"]
    bad.h[:] = np.nan
    with pytest.raises(ValueError, match="no FRF"):
        write_uff(tmp_path / "test.uff", bad)


def rounding(make, length):
    """Rounding times the condition of the dynamic stiffness of a bar at the lowest frequency, rows of one size."""
    bar = jf.beam(length, round(length / make.ELEMENT), **make.SECTION)
    stiffness, mass = (x.toarray() if hasattr(x, "toarray") else np.asarray(x) for x in (bar.stiffness, bar.mass))
    size = 1 / np.sqrt(np.diag(stiffness))
    dynamic = (1 + 1j * bar.loss_factor) * stiffness - (2 * np.pi * make.FREQ_HZ[0]) ** 2 * mass
    return np.finfo(float).eps * np.linalg.cond(dynamic * size[:, None] * size, 1)


def test_hammer_test_is_what_its_script_writes(tmp_path):
    spec = importlib.util.spec_from_file_location("hammer_test", HAMMER_TEST / "make.py")
    make = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = make
    spec.loader.exec_module(make)
    # Half a unit of the last place, 2^-24, of either part, twice that where rounding before it went the other way; and
    # what engines may differ by: a rounding times the condition of either bar on the first line, where a free one is
    # worst.
    allowed = 2.0**-23 + sum(rounding(make, length) for length in (0.5, 0.4))
    assert allowed < 1e-5
    for name, setup in {"two_bars": (), **make.SETUPS}.items():
        path = HAMMER_TEST / f"{name}.uff"
        given, kept = make.measured(*setup), read_uff(path)
        assert (kept.responses, kept.excitations, kept.quantity) == (given.responses, given.excitations, given.quantity)
        np.testing.assert_array_equal(kept.freq_hz, given.freq_hz)
        for node, place in given.coordinates.items():
            np.testing.assert_allclose(kept.coordinates[node], place, rtol=1e-15)
        assert (abs(kept.h - given.h) <= allowed * abs(given.h)).all()
        assert path.stat().st_size < 300 * 1024
