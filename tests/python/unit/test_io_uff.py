"""Universal Files: what is read, in which units, and what is said of files that hold no FRFs."""

import os
import random
import re
import struct
import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io import read_frfs, read_uff
from uff_writer import FREQ_HZ, VALUES, dataset, function, nodes_15, nodes_2411, system_2420, units

DATA = Path(os.environ.get("JOINTFRF_TEST_DATA", Path(__file__).resolve().parents[4] / "shared" / "data"))
LAP_JOINT = DATA / "lap_joint" / "lap_joint.uff"


@pytest.fixture
def write(tmp_path):
    def write(*datasets):
        path = tmp_path / "test.uff"
        path.write_bytes(b"".join(each if isinstance(each, bytes) else each.encode() for each in datasets))
        return path

    return write


@pytest.mark.parametrize("form", [{}, {"even": False}, {"number_type": 5}, {"binary": True}])
def test_an_frf_is_read_in_every_form(write, form):
    frfs = read_uff(write(function(**form)))
    np.testing.assert_allclose(frfs.freq_hz, FREQ_HZ)
    np.testing.assert_allclose(frfs.h[:, 0, 0], VALUES)
    assert (frfs.quantity, str(frfs.responses[0]), str(frfs.excitations[0])) == ("accelerance", "1:+y", "1:+y")


def test_uneven_frequencies_are_kept(write):
    frfs = read_uff(write(function(freq_hz=[1.0, 2.0, 5.0], even=False)))
    assert frfs.freq_hz.tolist() == [1.0, 2.0, 5.0]


def test_channels_stand_in_the_order_of_the_file_and_gaps_are_nan(write):
    frfs = read_uff(
        write(
            function(response=(3, -1)),
            function(2 * VALUES, reference=(2, 6), denominator=(13, "N m")),
            function(3 * VALUES, response=(3, -1), reference=(2, 6), denominator=(13, "N m")),
        )
    )
    assert [str(channel) for channel in frfs.responses] == ["3:-x", "1:+y"]
    assert [str(channel) for channel in frfs.excitations] == ["1:+y", "2:+rz"]
    assert np.isnan(frfs.h[:, 1, 0]).all()
    np.testing.assert_array_equal(frfs.matrix(["3:+x"], ["2:+rz"])[:, 0, 0], -3 * VALUES)


@pytest.mark.parametrize(
    ("numerator", "denominator", "quantity", "factor"),
    [
        ((12, "m/s^2"), (13, "N"), "accelerance", 1.0),
        ((12, "g"), (13, "N"), "accelerance", 9.80665),
        ((12, "mm/s2"), (13, "kN"), "accelerance", 1e-6),
        ((12, "g/N"), (13, "NONE"), "accelerance", 9.80665),
        ((12, "in/s^2"), (13, "lbf"), "accelerance", 0.0254 / 4.4482216152605),
        ((11, "mm/s"), (13, "N"), "mobility", 1e-3),
        ((8, "mm"), (9, "N"), "receptance", 1e-3),
        ((1, "(1/N)*(m/s²)"), (0, "NONE"), "accelerance", 1.0),
        ((0, "m/s"), (0, "N"), "mobility", 1.0),
    ],
)
def test_units_come_from_the_labels(write, numerator, denominator, quantity, factor):
    frfs = read_uff(write(function(numerator=numerator, denominator=denominator)))
    assert frfs.quantity == quantity
    np.testing.assert_allclose(frfs.h[:, 0, 0], factor * VALUES, rtol=1e-10)


@pytest.mark.parametrize(
    ("response", "reference", "factor"),
    [(2, 2, 1e-3 / 1e-3), (5, 2, 1.0 / 1e-3), (2, 5, 1e-3 / 1e-6), (5, 5, 1.0 / 1e-6)],
)
def test_dataset_164_divides_where_there_is_no_label(write, response, reference, factor):
    plain = {"numerator": (12, "NONE"), "denominator": (13, "NONE")}
    frfs = read_uff(write(units(1e3, 1e3), function(response=(1, response), reference=(1, reference), **plain)))
    np.testing.assert_allclose(frfs.h[:, 0, 0], factor * VALUES, rtol=1e-10)


def test_each_frf_has_the_units_that_stand_before_it(write):
    plain = {"numerator": (12, "NONE"), "denominator": (13, "NONE")}
    frfs = read_uff(write(units(1e3, 1.0), function(**plain), units(1.0, 1.0), function(response=(2, 2), **plain)))
    np.testing.assert_allclose(frfs.h[:, 1, 0] / frfs.h[:, 0, 0], 1e3)


@pytest.mark.parametrize(
    ("numerator", "denominator", "message"),
    [
        ((12, "NONE"), (13, "N"), r"the response has no unit \(dataset 1\); give unit="),
        ((12, "m/s^2"), (13, "NONE"), r"the excitation has no unit \(dataset 1\); give unit="),
        ((12, "V"), (13, "N"), r"the unit 'V' of the response is not understood \(dataset 1\); give unit="),
        ((12, "m/s^2"), (13, "mV"), r"the unit 'mV' of the excitation is not understood \(dataset 1\); give unit="),
    ],
)
def test_a_unit_that_is_missing_or_not_understood_must_be_stated(write, numerator, denominator, message):
    path = write(function(numerator=numerator, denominator=denominator))
    with pytest.raises(FileContentError, match=message):
        read_uff(path)
    found = read_uff(path, unit="g/N")
    np.testing.assert_allclose(found.h[:, 0, 0], 9.80665 * VALUES, rtol=1e-12)
    assert found.stated.endswith("unit stated: g/N")


def test_dataset_164_stands_for_missing_labels_only(write):
    with pytest.raises(FileContentError, match="unit 'V' of the response is not understood"):
        read_uff(write(units(1e3, 1.0), function(numerator=(12, "V"))))
    with pytest.warns(FileContentWarning, match="'m/s\\^2' contradicts dataset 164: the unit is used"):
        assert read_uff(write(units(1e3, 1.0), function())).h[0, 0, 0] == VALUES[0]


def test_a_stated_unit_must_not_contradict_the_file_unless_forced(write):
    path = write(function(numerator=(12, "m/s^2")))
    with pytest.raises(FileContentError, match=r"unit of the FRFs is 'm/s\^2' / 'N', not the one of unit=; leave unit"):
        read_uff(path, unit="g/N")
    with pytest.raises(FileContentError, match=r"states accelerance .*, not receptance"):
        read_uff(path, unit="mm/N")
    with pytest.raises(ValueError, match="unit mm/N is one of receptance, not mobility"):
        read_uff(path, quantity="mobility", unit="mm/N")
    np.testing.assert_allclose(read_uff(path, unit="g/N", force_quantity=True).h[:, 0, 0], 9.80665 * VALUES)
    assert read_uff(path, unit="(m/s²)/N").h[0, 0, 0] == VALUES[0]
    for unit in ("phase=rad", "dB re 1 m/s^2/N"):
        with pytest.raises(ValueError, match=r"has no effect on .*; leave it out"):
            read_uff(path, unit=unit)


def test_a_stated_unit_is_none_of_rotations(write):
    turned = {"response": (1, 6), "numerator": (12, "NONE")}
    with pytest.raises(FileContentError, match=r"has a rotation in dataset 1 .*give SI units"):
        read_uff(write(function(**turned)), unit="g/N")
    assert read_uff(write(function(**turned)), unit="m/s^2/N").h[0, 0, 0] == VALUES[0]
    known = write(function(numerator=(12, "NONE")), function(response=(1, 6), numerator=(12, "rad/s^2")))
    np.testing.assert_allclose(read_uff(known, unit="g/N").h[0, :, 0], [9.80665 * VALUES[0], VALUES[0]])


def test_a_label_of_another_quantity_is_refused_unless_the_caller_names_it(write):
    path = write(function(numerator=(12, "mm")))
    with pytest.raises(
        FileContentError, match=r"dataset 1: the unit 'mm' does not fit the response of accelerance 1:\+y"
    ):
        read_uff(path)
    assert read_uff(path, quantity="receptance").h[0, 0, 0] == pytest.approx(1e-3 * VALUES[0])
    with pytest.raises(FileContentError, match=r"'mm' does not fit the response of accelerance .*; give unit="):
        read_uff(path, quantity="accelerance")
    assert read_uff(path, unit="m/s^2/N").h[0, 0, 0] == VALUES[0]


def test_an_unknown_data_type_needs_the_word_of_the_caller(write):
    path = write(function(numerator=(0, "NONE"), denominator=(0, "NONE")))
    with pytest.raises(FileContentError, match=r"data types 0 \(unknown.*give quantity= \(dataset 1\)"):
        read_uff(path)
    with pytest.raises(FileContentError, match="the response has no unit"):
        read_uff(path, quantity="mobility")
    assert read_uff(path, unit="m/s/N").quantity == "mobility"
    with pytest.raises(ValueError, match="unknown quantity 'inertance'; use one of"):
        read_uff(path, quantity="inertance")


def test_mixed_quantities_become_the_one_differentiated_most(write):
    frfs = read_uff(write(function(numerator=(8, "m")), function(response=(2, 2))))
    assert frfs.quantity == "accelerance"
    np.testing.assert_allclose(frfs.receptance().h[:, 0, 0], VALUES, rtol=1e-12)
    np.testing.assert_allclose(frfs.h[:, 1, 0], VALUES)


def test_frequencies_in_rad_per_second_are_converted(write):
    frfs = read_uff(write(function(abscissa=(18, "rad/s"))))
    np.testing.assert_allclose(frfs.freq_hz, FREQ_HZ / (2 * np.pi))
    np.testing.assert_allclose(read_uff(write(function(abscissa=(18, "RPM")))).freq_hz, FREQ_HZ / 60)
    np.testing.assert_array_equal(read_uff(write(function(abscissa=(18, "NONE")))).freq_hz, FREQ_HZ)
    for label, message in (("furlong", "unit 'furlong' of the frequencies is not"), ("1/s", "unit '1/s' of the freq")):
        path = write(function(abscissa=(18, label)))
        with pytest.raises(FileContentError, match=f"{message}.*; give unit= with frequency=Hz"):
            read_uff(path)
        np.testing.assert_allclose(read_uff(path, unit="frequency=kHz").freq_hz, 1e3 * FREQ_HZ)
    with pytest.raises(FileContentError, match="the frequencies have no unit"):
        read_uff(write(function(abscissa=(0, "NONE"))))
    with pytest.raises(FileContentError, match="unit of the frequencies is 'Hz', not the one of unit="):
        read_uff(write(function()), unit="frequency=rad/s")
    with pytest.raises(FileContentError, match="over rpm, not frequency"):
        read_uff(write(function(abscissa=(19, "rpm"))))


@pytest.mark.parametrize("nodes", [nodes_2411, nodes_15])
def test_coordinates_are_in_metres(write, nodes):
    frfs = read_uff(
        write(units(1e3, 1.0), nodes({1: (10.0, -20.0, 30.0), 7: (0.0, 0.0, 0.0)}), function(numerator=(12, "mm/s^2")))
    )
    assert list(frfs.coordinates) == [1]
    np.testing.assert_allclose(frfs.coordinates[1], [0.01, -0.02, 0.03])


def test_coordinates_that_cannot_be_trusted_are_said(write):
    turned = [[0, 1, 0], [-1, 0, 0], [0, 0, 1], [0, 0, 0]]
    with pytest.warns(FileContentWarning, match="have no unit .*are left out; give unit= with coordinates=m"):
        assert not read_uff(write(nodes_2411({1: (1, 2, 3)}), function())).coordinates
    found = read_uff(write(nodes_2411({1: (1, 2, 3)}), function()), unit="coordinates=mm").coordinates[1]
    np.testing.assert_allclose(found, [1e-3, 2e-3, 3e-3])
    with pytest.raises(FileContentError, match=r"unit of the coordinates is '0\.001 m', not the one of unit="):
        read_uff(write(units(1e3, 1), nodes_2411({1: (1, 2, 3)}), function()), unit="coordinates=m")
    local = nodes_15({1: (1, 2, 3)}, definition=5)
    with pytest.warns(FileContentWarning, match="coordinates of node 1 are local and are left out"):
        assert not read_uff(write(units(1, 1), system_2420(5, turned), local, function())).coordinates
    with pytest.warns(FileContentWarning, match="local directions at node 1 are turned to global ones"):
        frfs = read_uff(write(units(1, 1), system_2420(5, turned), nodes_2411({1: (1, 2, 3)}, 5), function()))
    assert str(frfs.responses[0]) == "1:-x"
    with pytest.warns(FileContentWarning, match="cannot be read and are left out"):
        assert not read_uff(write(units(1, 1), dataset(2411, "one two"), function())).coordinates
    aligned = dataset(
        18,
        f"{5:10d}{0:10d}{0:10d}{1:10d}{1:10d}",
        "CS",
        "".join(f"{x:13.5e}" for x in (0, 0, 0, 1, 0, 0)),
        "".join(f"{x:13.5e}" for x in (0, 0, 1)),
    )
    assert 1 in read_uff(write(units(1, 1), aligned, local, function())).coordinates


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"response": (0, 2)},
            r"names no response node \(node 0\); give mapping responses= and excitations= \(dataset 1\)",
        ),
        ({"reference": (1, 0)}, r"names no reference direction \(code 0\); give mapping direction=z \(dataset 1\)"),
        ({"numerator": (15, "Pa")}, r"pressure per excitation force, not motion per force \(dataset 1\)"),
        ({"values": VALUES.real, "number_type": 4}, "real numbers, without phase"),
        (
            {"function_type": 1},
            r"contains 1 time history \(dataset 58, function type 1\) and no FRF; estimate FRFs .*pyFRF",
        ),
        ({"function_type": 99}, "contains 1 function of another kind"),
    ],
)
def test_a_function_that_is_no_usable_frf_is_left_out(write, wrong, message):
    with pytest.raises(FileContentError, match=message):
        read_uff(write(function(**wrong)))
    if "function_type" not in wrong:
        with pytest.warns(FileContentWarning, match="FRF left out: it"):
            assert read_uff(write(function(**wrong), function())).h.shape == (3, 1, 1)
    else:
        with pytest.warns(FileContentWarning, match=r"not read, no FRF: .* \(dataset 1\)"):
            assert read_uff(write(function(**wrong), function())).h.shape == (3, 1, 1)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"n_values": 7}, r"dataset 1 \(1:\+y / 1:\+y\) has 3 of 7 values"),
        ({"n_values": 1}, "has 3 of 1 values"),
        ({"number_type": 8}, "is damaged: ordinate data type 8 in dataset 1"),
        ({"freq_hz": [5.0, 5.0, 5.0], "even": False}, "do not increase"),
        ({"freq_hz": [-1.0, 0.0, 1.0]}, "do not increase from 0 Hz"),
        (
            {"values": np.array([1.0, np.nan, 1.0 + 0j])},
            r"no FRF that can be used: FRF 1:\+y / 1:\+y is left out: NaN or Inf on 1 of 3 lines, first at 12 Hz",
        ),
    ],
)
def test_damage_is_named(write, wrong, message):
    with pytest.raises(FileContentError, match=message):
        read_uff(write(function(**wrong)))


def test_numbers_in_a_foreign_binary_form_are_refused(write):
    with pytest.raises(FileContentError, match="not IEEE 754"):
        read_uff(write(function(binary=True).replace(b"58b     1     2", b"58b     1     3")))


def test_nan_at_0_hz_costs_that_line_only(write):
    bad = np.array([np.nan, 1.0 + 0j, 2.0])
    path = write(function(freq_hz=[0.0, 1.0, 2.0]), function(bad, freq_hz=[0.0, 1.0, 2.0], response=(2, 2)))
    with pytest.warns(FileContentWarning, match=r"0 Hz contains NaN or Inf in 2:\+y / 1:\+y and is left out"):
        frfs = read_uff(path)
    assert frfs.freq_hz.tolist() == [1.0, 2.0]
    assert np.isfinite(frfs.h).all()


def test_different_frequencies_are_refused(write):
    path = write(function(), function(freq_hz=[10.0, 11.0, 12.0], response=(2, 2)))
    with pytest.raises(FileContentError, match=r"3 lines 10 to 14 Hz in dataset 1 .*3 lines 10 to 12 Hz in dataset 2"):
        read_uff(path)


def test_the_first_of_two_equal_frfs_is_kept(write):
    """Where they differ: by how much, which one is used, and which ones are not."""
    differ = r"first is used.*differ by up to 50 % \(1:\+y / 1:\+y, dataset 1 is used\) \(datasets 2, 3\)"
    with pytest.warns(FileContentWarning, match=differ):
        assert read_uff(write(function(), function(0.9 * VALUES), function(1.5 * VALUES))).h[0, 0, 0] == VALUES[0]
    with pytest.warns(FileContentWarning, match=r"first is used.*their values are the same \(dataset 2\)"):
        read_uff(write(function(), function()))
    longer = function(freq_hz=[10.0, 12.0, 14.0, 16.0], values=np.append(VALUES, 1.0))
    with pytest.warns(FileContentWarning, match=r"left out: it has other frequency lines \(dataset 2\)"):
        read_uff(write(function(), longer))


def test_components_that_number_nodes_alike_are_told_apart(write):
    """Also where only one FRF joins them, which would look like that of a driving point."""
    pairs = [("frame", "frame"), ("frame", "arm"), ("arm", "frame"), ("arm", "arm")]
    several = write(
        *(function(factor * VALUES, entities=pair) for factor, pair in zip((1, 2, 3, 4), pairs, strict=True))
    )
    message = (
        r"has node 1 in the components 'frame' and 'arm'; number them apart by mapping components=frame:0,arm:1000"
    )
    with pytest.raises(FileContentError, match=message):
        read_uff(several)
    apart = {"components": "frame:0,arm:1000"}
    found = read_frfs(several, mapping=apart)
    assert [str(each) for each in found.responses] == ["1:+y", "1001:+y"]
    np.testing.assert_array_equal(found.h[0] / VALUES[0], [[1, 2], [3, 4]])
    assert read_frfs(several, mapping={"components": {"frame": 0, "arm": 5}}, nodes=[6]).h[0, 0, 0] == 4 * VALUES[0]
    with pytest.raises(FileContentError, match="node 1 in the components 'arm' and 'frame'"):
        read_uff(write(function(entities=("arm", "frame"))))
    assert read_frfs(write(function(entities=("arm", "hammer"))), mapping={"components": "arm:0,hammer:0"}).h.size == 3
    with pytest.raises(FileContentError, match=r"has a component 'arm'; add it to mapping components=frame:0"):
        read_frfs(several, mapping={"components": "frame:0"})
    with pytest.raises(ValueError, match=r"components='frame' is not like components=frame:0,arm:1000"):
        read_frfs(several, mapping={"components": "frame"})


def test_coordinates_of_nodes_that_several_components_have_are_left_out(write):
    pairs = [("frame", "frame"), ("frame", "arm")]
    nodes = nodes_2411({1: (1.0, 2.0, 3.0), 2: (4.0, 5.0, 6.0)})
    more = function(response=(2, 2), entities=("arm", "frame"))
    path = write(units(1, 1), nodes, *(function(entities=pair) for pair in pairs), more)
    with pytest.warns(FileContentWarning, match="coordinates of node 1 are left out: several components"):
        found = read_frfs(path, mapping={"components": "frame:0,arm:1000"})
    assert {node: place.tolist() for node, place in found.coordinates.items()} == {1002: [4.0, 5.0, 6.0]}


def test_directions_and_names_that_the_file_lacks_are_stated_by_the_user(write):
    path = write(*(function(i * VALUES, response=(i, 0), reference=(9, 0)) for i in (1, 2, 3)))
    with pytest.raises(FileContentError, match=r"no response direction \(code 0\); give mapping direction=z"):
        read_frfs(path)
    found = read_frfs(path, mapping={"direction": "-z"})
    assert [str(each) for each in (*found.responses, *found.excitations)] == ["1:-z", "2:-z", "3:-z", "9:-z"]
    nameless = write(*(function(i * VALUES, response=(0, 0), reference=(0, 0)) for i in (1, 2, 3)))
    found = read_frfs(nameless, mapping={"responses": "11:x,12:x,13:-y", "excitations": "11:x"})
    assert [str(each) for each in (*found.responses, *found.excitations)] == ["11:+x", "12:+x", "13:-y", "11:+x"]
    np.testing.assert_array_equal(found.h[0, :, 0], VALUES[0] * np.arange(1, 4))
    with pytest.raises(FileContentError, match=r"contains 3 functions of a kind, and mapping responses= has 2 names"):
        read_frfs(nameless, mapping={"responses": "11:x,12:x", "excitations": "11:x"})
    with pytest.raises(ValueError, match=r"direction 'q' is none of .*; correct mapping direction="):
        read_frfs(path, mapping={"direction": "q"})


def head_and_numbers(content):
    """Return the records before the numbers of a function, and the words of its numbers."""
    lines = content.splitlines(keepends=True)
    return b"".join(lines[:13]), b"".join(lines[13:-1]).split()


@pytest.mark.parametrize("form", [{}, {"number_type": 5}, {"even": False}])
@pytest.mark.parametrize("a_line", [1, 2, 3, 5, 7])
def test_numbers_are_read_wherever_lines_are_cut(write, form, a_line):
    """Four or six a line by the definition; programs put any number in a line, and an abscissa in 20 columns."""
    head, words = head_and_numbers(function(**form))
    rows = [b" ".join(word.rjust(20) for word in words[i : i + a_line]) for i in range(0, len(words), a_line)]
    found = read_uff(write(head + b"\n".join(rows) + b"\n    -1\n"))
    np.testing.assert_array_equal(found.h, read_uff(write(function(**form))).h)
    np.testing.assert_array_equal(found.freq_hz, FREQ_HZ)


def test_zeros_that_fill_the_last_line_are_no_values(write):
    """Seven values, three a line in single precision."""
    values = np.arange(1, 8) * (1.0 + 1j)
    content = function(values, freq_hz=np.arange(1.0, 8.0), number_type=5)
    zeros = b"".join([b"%13.5e" % 0.0] * 2)
    filled = content.removesuffix(b"\n    -1\n") + 2 * zeros + b"\n    -1\n"
    np.testing.assert_array_equal(read_uff(write(filled)).h[:, 0, 0], values)
    one_more = filled.replace(2 * zeros + b"\n", zeros + zeros[:13] + b"%13.5e\n" % 1.0)
    with pytest.raises(FileContentError, match="has 9 of 7 values"):
        read_uff(write(one_more))
    with pytest.raises(FileContentError, match="has 10 of 7 values"):
        read_uff(write(content.removesuffix(b"    -1\n") + 3 * zeros + b"\n    -1\n"))


@pytest.mark.parametrize(("first", "even"), [(0, True), (13, False), (20, False)])
def test_numbers_that_touch_each_other_are_read_by_their_columns(write, first, even):
    values = np.array([-1.5 - 1j, -2.0 - 4j, -3.25 - 6j]) * 1e-200
    head, _ = head_and_numbers(function(values, even=even))
    rows = [
        ("" if even else f"{f:{first}.{first - 8}e}") + f"{v.real:20.12e}{v.imag:20.12e}"
        for f, v in zip(FREQ_HZ, values, strict=True)
    ]
    assert all("-200-" in row for row in rows)
    found = read_uff(write(head + "\n".join(rows).encode() + b"\n    -1\n"))
    np.testing.assert_allclose(found.h[:, 0, 0], values, rtol=1e-12)
    np.testing.assert_array_equal(found.freq_hz, FREQ_HZ)


@pytest.mark.parametrize("word", [b"nan", b"1.#QNAN0e+000", b"-1.#IND00e+000", b"*************", b"Infinity"])
def test_an_frf_that_is_not_finite_is_named_and_the_others_are_read(write, word):
    bad = function(response=(2, 2)).replace(b"3.00000000000e+00", word.rjust(17))
    with pytest.warns(
        FileContentWarning, match=r"FRF 2:\+y / 1:\+y is left out: NaN or Inf on 1 of 3 lines, first at 12"
    ):
        found = read_uff(write(function(), bad))
    assert found.measured.tolist() == [[True], [False]]


@pytest.mark.parametrize("before", [b"", b"\xef\xbb\xbf", b"\n\n"])
@pytest.mark.parametrize("delimiter", [b"    -1   ", b"-1", b"  -1\t", b"    -1" + 100 * b" "])
@pytest.mark.parametrize("ending", [b"\n", b"\r\n", b"\r"])
def test_delimiters_are_known_by_their_content(write, before, delimiter, ending):
    content = function() + function(response=(2, 2))
    path = write(before + content.replace(b"    -1\n", delimiter + b"\n").replace(b"\n", ending))
    np.testing.assert_array_equal(read_frfs(path).h[:, 1, 0], VALUES)


def test_records_in_free_columns(write):
    """Numbers and names between blanks, wherever they stand."""
    lines = function().decode().splitlines()
    free = [" ".join(line.split()) if 6 < i < len(lines) - 1 else line for i, line in enumerate(lines)]
    np.testing.assert_array_equal(read_uff(write("\n".join([*free, ""]))).h[:, 0, 0], VALUES)


def test_a_file_cut_short_loses_its_last_dataset(write):
    path = write(function(), function(response=(2, 2))[:-60])
    with pytest.warns(FileContentWarning, match=r"ends inside a dataset, which is left out \(dataset 2\)"):
        assert len(read_uff(path).responses) == 1
    with pytest.raises(FileContentError, match="ends inside its first dataset"):
        read_uff(write(function()[:-60]))


def test_a_lost_delimiter_is_noticed(write):
    datasets = [function(response=(node, 2)).decode() for node in (1, 2, 3)]
    datasets[1] = datasets[1].removeprefix("    -1\n")
    with pytest.raises(FileContentError, match="is damaged: dataset 2 has no type"):
        read_uff(write(*datasets))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b" \n", "is empty"),
        (b"(1.0+2.0j)\n", r"is not a Universal File: no dataset delimiters \(-1\)"),
        (bytes(range(256)), "is not a Universal File"),
        (b"    -1\n    -1\n", "has no type"),
        (dataset(15).encode(), r"contains dataset 15 \(nodes\) and no FRF"),
        (dataset(58).encode(), r"dataset 1 \(type 58\): it cannot be read"),
        (dataset(164, "x").encode() + function(), r"dataset 1 \(type 164\): it cannot be read"),
        (function() + units(0.0, 1.0).encode(), r"test.uff has the length factor 0 in its units \(dataset 2\)"),
        (units(0.0, 1.0).encode() + function(), r"test.uff has the length factor 0 in its units \(dataset 1\)"),
    ],
)
def test_what_is_no_sound_file_is_refused_in_one_sentence(write, content, message):
    with pytest.raises(FileContentError, match=message):
        read_uff(write(content))


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no file .*none\.uff"):
        read_uff(tmp_path / "none.uff")
    with pytest.raises(FileContentError, match="is a folder"):
        read_uff(tmp_path)


def test_a_number_that_is_none_is_damage(write):
    path = write(function().replace(b"1.00000000000e+00", b"1.00000x00000e+00"))
    with pytest.raises(FileContentError, match=r"dataset 1 \(type 58\): line 14 of it is not numbers: '1.00000x00000e"):
        read_uff(path)


@pytest.mark.parametrize("letter", [b"D", b"d"])
@pytest.mark.parametrize("form", [{}, {"number_type": 5}, {"even": False}])
def test_exponents_of_fortran(write, letter, form):
    content = re.sub(rb"e([+-]\d\d)", letter + rb"\1", function(**form))
    assert letter + b"+0" in content
    np.testing.assert_array_equal(read_uff(write(content)).h, read_uff(write(function(**form))).h)


@pytest.mark.parametrize("abscissa", ["<f4", "<f8"])
def test_uneven_lines_of_a_58b_in_double_precision(write, abscissa):
    """Four bytes for a frequency by the definition, eight as pyuff writes it."""
    freq_hz = np.array([10.0, 12.5, 20.0])
    rows = np.zeros(3, [("x", abscissa), ("y", "<c16")])
    rows["x"], rows["y"] = freq_hz, VALUES
    content = function(freq_hz=freq_hz, even=False, binary=True)
    path = write(content.replace(VALUES.astype("<c16").tobytes(), rows.tobytes()))
    np.testing.assert_array_equal(read_uff(path).freq_hz, freq_hz)
    np.testing.assert_array_equal(read_uff(path).h[:, 0, 0], VALUES)


def test_a_damaged_file_is_read_or_refused_but_nothing_else(write):
    sound = b"".join(
        [
            units(1.0, 1.0).encode(),
            nodes_2411({1: (1, 2, 3)}).encode(),
            function(),
            function(response=(2, 2), binary=True),
            function(reference=(2, -3), even=False),
        ]
    )
    chance = random.Random(7)
    for _ in range(150):
        content = bytearray(sound[: chance.randrange(len(sound))] if chance.random() < 0.3 else sound)
        for _ in range(chance.randrange(6)):
            start = chance.randrange(len(content) + 1)
            content[start : start + chance.randrange(4)] = chance.randbytes(chance.randrange(4))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FileContentWarning)
            with suppress(FileContentError):
                read_uff(write(bytes(content)))


needs_lap_joint = pytest.mark.skipif(not LAP_JOINT.exists(), reason=f"no {LAP_JOINT} (set JOINTFRF_TEST_DATA)")
vendor_files = sorted((DATA / "uff").glob("*")) or [
    pytest.param(None, marks=pytest.mark.skip(reason=f"no files in {DATA / 'uff'} (set JOINTFRF_TEST_DATA)"))
]


@needs_lap_joint
def test_lap_joint():
    frfs = read_uff(LAP_JOINT)
    assert frfs.h.shape == (600, 48, 26)
    assert frfs.measured.all()
    np.testing.assert_array_equal(frfs.freq_hz, np.arange(1.0, 601.0))
    np.testing.assert_allclose(frfs.coordinates[101], [0.0, 0.0113, 0.2875], atol=1e-12)
    assert len(frfs.coordinates) == 24
    raw = LAP_JOINT.read_bytes()
    start = raw.index(b"\n", raw.index(b"FRF 101+X / 101+Y")) + 1
    for _ in range(10):
        start = raw.index(b"\n", start) + 1
    first = complex(*struct.unpack("<2d", raw[start : start + 16]))
    assert frfs.matrix(["101:x"], ["101:y"])[0, 0, 0] == first


@needs_lap_joint
def test_lap_joint_is_reciprocal_within_its_noise():
    names = ["101:y", "102:y", "104:y", "202:y", "204:y", "301:y", "302:y"]
    receptance = read_uff(LAP_JOINT).receptance()
    h = receptance.matrix(names, names)
    off_diagonal = ~np.eye(len(names), dtype=bool)
    scatter = (np.abs(h - h.transpose(0, 2, 1)) / np.abs(h))[:, off_diagonal]
    assert np.sqrt((scatter**2).mean()) == pytest.approx(0.01 * np.sqrt(2.0), rel=0.02)
    accelerance = read_uff(LAP_JOINT).matrix(names, names)
    omega = 2.0 * np.pi * receptance.freq_hz[:, None, None]
    np.testing.assert_allclose(h, -accelerance / omega**2, rtol=1e-12)


@needs_lap_joint
def test_lap_joint_names_what_was_not_excited():
    with pytest.raises(FileContentError, match=r"101:\+y / 101:\+x, 101:\+y / 301:\+rx"):
        read_uff(LAP_JOINT).matrix(["101:y"], ["101:x", "301:rx", "301:y"])


@needs_lap_joint
def test_lap_joint_cut_anywhere_is_read_as_far_as_it_goes(tmp_path):
    content = LAP_JOINT.read_bytes()[:60_000]
    path = tmp_path / "cut.uff"
    for end in range(50_000, 60_000, 997):
        path.write_bytes(content[:end])
        with pytest.warns(FileContentWarning, match="ends inside a dataset"):
            assert np.isfinite(read_uff(path).h).all()


@pytest.mark.parametrize("path", vendor_files, ids=lambda path: getattr(path, "name", "none"))
def test_vendor_files_without_frfs_are_refused_in_one_sentence(path):
    with pytest.raises(FileContentError, match=r"no FRF|not a Universal File") as caught:
        read_uff(path)
    assert "\n" not in str(caught.value)
