"""FRFs come back from every format: as written here, and as other programs write them."""

import re
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from frf_files import (
    FIELDS,
    FREQ_HZ,
    frf_set,
    full_set,
    names,
    structure_of_testlab,
    write_mat,
    write_mat73,
    write_sdynpy,
)
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io import FrfMapping, frfs_of_arrays, read_frfs, write_csv, write_hdf5, write_npz, write_uff
from jointfrf.io import write_mat as write_matlab

pytest.importorskip("h5py")

WRITERS = {"a.uff": write_uff, "a.npz": write_npz, "a.h5": write_hdf5, "a.csv": write_csv, "a.mat": write_matlab}
GRAVITY = 9.80665


def same(found, given, *, rtol=1e-14):
    assert found.quantity == given.quantity
    assert (found.responses, found.excitations) == (given.responses, given.excitations)
    np.testing.assert_allclose(found.freq_hz, given.freq_hz, rtol=1e-9)
    np.testing.assert_allclose(found.h, given.h, rtol=rtol)


@pytest.mark.parametrize("name", WRITERS)
def test_what_is_written_comes_back(tmp_path, name):
    given = full_set()
    WRITERS[name](tmp_path / name, given)
    assert [path.name for path in tmp_path.iterdir()] == [name]
    found = read_frfs(tmp_path / name)
    same(found, given)
    np.testing.assert_array_equal(found.coherence, given.coherence)
    if name != "a.uff":
        np.testing.assert_array_equal(found.averages, given.averages)
    if name != "a.csv":
        assert found.coordinates.keys() == given.coordinates.keys()
        np.testing.assert_allclose(found.coordinates[102], given.coordinates[102], rtol=1e-14)


@pytest.mark.parametrize("name", WRITERS)
def test_the_content_tells_the_format(tmp_path, name):
    path = tmp_path / "measured.dat"
    WRITERS[name](path, frf_set())
    same(read_frfs(path), frf_set())


@pytest.mark.parametrize("name", WRITERS)
def test_writers_refuse_what_cannot_be_read(tmp_path, name):
    h = frf_set().h.copy()
    with pytest.raises(ValueError, match="contains no FRF"):
        WRITERS[name](tmp_path / name, frf_set(h=np.full(h.shape, np.nan)))
    h[2, 1, 1] = np.nan
    with pytest.raises(ValueError, match=r"FRF 102:-y / 201:\+y contains NaN or Inf, first at 30 Hz"):
        WRITERS[name](tmp_path / name, frf_set(h=h))
    assert not list(tmp_path.iterdir())


def test_own_arrays_are_those_of_the_documentation(tmp_path):
    write_npz(tmp_path / "a.npz", full_set())
    with np.load(tmp_path / "a.npz", allow_pickle=False) as found:
        assert found["jointfrf_frfs"] == 2
        assert found["h"].shape == (5, 3, 2)
        assert found["responses"].tolist() == ["101:+x", "102:-y", "103:+z"]
        assert (str(found["quantity"]), str(found["unit"])) == ("accelerance", "m/s^2/N")
        assert found["coordinates"].shape == (2, 3)


@pytest.mark.parametrize("write", [write_mat, write_mat73])
@pytest.mark.parametrize(
    ("axes", "order"),
    [("freq,out,in", (0, 1, 2)), ("out,in,freq", (1, 2, 0)), ("out,freq,in", (1, 0, 2)), ("in,out,freq", (2, 1, 0))],
)
def test_arrays_of_scripts_in_matlab_files(tmp_path, write, axes, order):
    given = frf_set()
    path = write(
        tmp_path / "test.mat",
        Freq=FREQ_HZ[:, None],
        FRF=given.h.transpose(order),
        coh=np.full(given.h.shape, 0.9).transpose(order),
        responses=np.array(names(given.responses), dtype=object),
        references=np.array(names(given.excitations), dtype=object),
        unit="(m/s^2)/N",
        navg=10.0,
    )
    found = read_frfs(path, mapping={"axes": axes} if axes.startswith("in") else None)
    same(found, given)
    assert found.coherence[0, 0, 0] == 0.9
    assert found.least_averages(["101:x"], ["101:x"]) == 10
    assert found.stated == "FRFs of an unnamed quantity [(m/s^2)/N]"


@pytest.mark.parametrize("write", [write_mat, write_mat73])
def test_a_mapping_says_which_field_is_what(tmp_path, write):
    given = frf_set("mobility")
    path = write(tmp_path / "a.mat", test={"w": 2 * np.pi * FREQ_HZ, "A": given.h, "B": given.h * 2}, note="März")
    mapping = {
        "h": "test.A",
        "responses": names(given.responses),
        "excitations": "101:+x,201:+y",
        "axes": "freq,out,in",
    }
    with pytest.raises(FileContentError, match="the FRFs have no unit; give unit="):
        read_frfs(path, quantity="mobility", mapping=mapping)
    same(read_frfs(path, mapping=mapping, unit="m/s/N"), given, rtol=1e-12)
    with pytest.raises(FileContentError, match=r"no field for the FRFs; give mapping h=... out of .*test\.A"):
        read_frfs(path)
    with pytest.raises(FileContentError, match=r"no field 'test\.C'; use one of .*test\.B"):
        read_frfs(path, mapping={"h": "test.C"})
    with pytest.raises(ValueError, match=r"unknown field 'axis' in mapping; use one of .*; did you mean axes"):
        read_frfs(path, mapping={"axis": "freq,out,in"})
    found = read_frfs(path, unit="m/s/N", mapping=FrfMapping(**(mapping | {"h": "test.B"})))
    assert found.h[0, 0, 0] == 2 * given.h[0, 0, 0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"H": np.ones((4, 3, 2))}, "the sizes 4 x 3 x 2, which do not fit 5 lines, 3 responses, 2 excitations"),
        ({"f": np.array([1.0, 2, 3, 3, 4])}, "frequencies do not increase"),
        ({"f": np.ones((2, 2))}, r"frequencies have shape \(2, 2\)"),
        ({"f": "text"}, "frequencies are not numbers"),
        ({"H": "text"}, "FRFs are not numbers"),
        (
            {"responses": ["101:x", "left", "103:z"]},
            "has 'left' in its responses; name a node and a direction, such as",
        ),
        ({"responses": ["101:x", "101:x", "103:z"]}, r"names 101:\+x twice in its responses"),
        ({"responses": np.array([[101, 1], [102, -2], [103, 9]])}, "node 103 with direction code 9"),
        ({"unit": "furlong"}, "the unit 'furlong' is not understood; give unit="),
        ({"quantity": "impedance"}, "unknown quantity 'impedance'; use one of"),
        ({"quantity": "mobility"}, r"the unit 'm/s\^2/N' does not fit mobility"),
        ({"coherence": np.full((5, 3, 2), 2.0)}, "coherence must be from 0 to 1"),
        ({"averages": 0.5}, "averages must be 1 or more"),
        ({"FRF": np.ones((5, 3, 2))}, r"several fields for h; give mapping h=... out of H, FRF"),
        (
            {"H": np.where(np.arange(30).reshape(5, 3, 2) < 6, np.inf, 1)},
            "left out: NaN or Inf on 1 of 5 lines, first at 10",
        ),
    ],
)
def test_what_does_not_fit_is_one_sentence(tmp_path, change, message):
    given = frf_set()
    sound = {
        "f": FREQ_HZ,
        "H": given.h,
        "responses": names(given.responses),
        "excitations": np.array([[101, 1], [201, 2]]),
        "unit": "m/s^2/N",
    }
    same(read_frfs(write_mat(tmp_path / "a.mat", **sound)), given)
    with pytest.raises(FileContentError, match=message) as caught:
        read_frfs(write_mat(tmp_path / "a.mat", **(sound | change)))
    assert "\n" not in str(caught.value)
    assert str(tmp_path / "a.mat") in str(caught.value)


def test_an_unclear_order_of_axes_must_be_said():
    channels = ["1:x", "2:x", "3:x"]
    h = np.arange(27.0).reshape(3, 3, 3)
    arguments = {"responses": channels, "excitations": channels, "quantity": "receptance", "unit": "m/N"}
    with pytest.raises(FileContentError, match="is frequency is not clear from the sizes; give axes="):
        frfs_of_arrays([1, 2, 3], h, axes="", **arguments)
    with pytest.raises(ValueError, match="axes 'freq,out' do not name freq, out and in; give them in their order"):
        frfs_of_arrays([1, 2, 3], h, axes="freq,out", **arguments)
    np.testing.assert_array_equal(frfs_of_arrays([1, 2, 3], h, axes="out,in,freq", **arguments).h[0], h[:, :, 0])


@pytest.mark.parametrize("write", [write_mat, write_mat73])
def test_structures_of_testlab(tmp_path, write):
    given = frf_set()
    coherence = np.full(given.h.shape, 0.75)
    path = write(
        tmp_path / "a.mat",
        FRF=structure_of_testlab(given),
        Coherence=structure_of_testlab(given, label="", type_="Coherence", values=coherence),
        Signal=structure_of_testlab(given, label="g", type_="Signal", values=coherence),
    )
    with pytest.warns(FileContentWarning, match=r"not read, no FRF: functions \(1 of type Signal\)"):
        found = read_frfs(path)
    same(found, given)
    np.testing.assert_array_equal(found.coherence, coherence)
    assert found.stated == "FRFs of an unnamed quantity [m N^-1 s^-2]"


@pytest.mark.parametrize(
    ("label", "factor", "info"),
    [
        ("g/N", 1 / GRAVITY, "Data saved by Testlab in MKS"),
        ("g/N", 1 / GRAVITY, ""),
        ("g/N", None, "Data saved by Testlab in MKS"),
        ("m/s^2/N", 1.0, ""),
        ("(m/s²)/N", None, ""),
        ("mm/s^2/N", 1e3, "Data saved by Testlab in MKS"),
    ],
)
def test_values_of_testlab_are_in_si(tmp_path, label, factor, info):
    """The factor goes from SI to the label, as in files that Testlab saves in MKS."""
    given = frf_set()
    path = write_mat(tmp_path / "a.mat", FRF=structure_of_testlab(given, label=label, factor=factor, info=info))
    same(read_frfs(path), given)


@pytest.mark.parametrize(
    ("label", "factor", "message"),
    [
        ("g/N", GRAVITY, "the unit 'g/N, factor 9.80665' is not understood; give unit="),
        ("g/N", 1.0, "the unit 'g/N, factor 1' is not understood"),
        ("g/N", None, "the unit 'g/N, no factor' is not understood"),
        ("V/N", 1.0, "the unit 'V/N' is not understood"),
    ],
)
def test_the_unit_of_testlab_must_be_clear_or_stated(tmp_path, label, factor, message):
    given = frf_set()
    path = write_mat(tmp_path / "a.mat", FRF=structure_of_testlab(given, label=label, factor=factor))
    with pytest.raises(FileContentError, match=re.escape(message)):
        read_frfs(path)
    same(read_frfs(path, unit="mm/s^2/N"), frf_set(h=1e-3 * given.h))
    with pytest.raises(ValueError, match=r"mapping unit= has no effect on .*a\.mat; leave it out"):
        read_frfs(path, unit="mm/s^2/N", mapping={"unit": "mm/s^2/N"})


@pytest.mark.parametrize(
    ("part", "key", "value", "message"),
    [
        ("x_values", "number_of_values", 7.0, "is damaged: 30 values at 7 frequency lines"),
        ("x_values", "number_of_values", 1e300, r"30 values at 1e\+300 frequency lines"),
        ("x_values", "increment", "x", "frequencies of a function cannot be read"),
        ("y_values", "values", None, "a function has no values"),
        ("function_record", "primary_channel", None, "does not name the responses of its functions"),
    ],
)
def test_a_damaged_structure_of_structure_of_testlab(tmp_path, part, key, value, message):
    record = structure_of_testlab(frf_set())
    if value is None:
        del record[part][key]
    else:
        record[part][key] = value
    with pytest.raises(FileContentError, match=message):
        read_frfs(write_mat(tmp_path / "a.mat", FRF=record))


def one_by_one(given, **changes):
    """Structures of Testlab, one for each FRF of a set: what `changes` maps to None is left out of a channel."""
    found = {}
    for i, response in enumerate(given.responses):
        for j, excitation in enumerate(given.excitations):
            single = replace(
                given, responses=(response,), excitations=(excitation,), h=given.h[:, i : i + 1, j : j + 1]
            )
            record = structure_of_testlab(single, label="m/s^2/N", type_=changes.get("type", "FRF"))
            for key in ("primary_channel", "reference_channel"):
                for name in [name for name, value in changes.items() if value is None]:
                    del record["function_record"][key][name]
            found[f"F{i}{j}"] = record
    return found


@pytest.mark.parametrize("write", [write_mat, write_mat73])
def test_only_functions_of_the_right_type_are_read(tmp_path, write):
    """A complex spectrum and an auto-power are no FRFs, wherever they stand among these."""
    given = frf_set()
    spectrum = structure_of_testlab(given, label="m/s^2", type_="FrequencySpectrum")
    power = structure_of_testlab(given, label="(m/s^2)^2", type_="AutoPower Spectrum", values=abs(given.h))
    multiple = structure_of_testlab(given, label="", type_="Multiple Coherence", values=np.full(given.h.shape, 0.5))
    path = write(tmp_path / "a.mat", A=spectrum, **one_by_one(given), Z=power, M=multiple)
    left_out = "1 of type FrequencySpectrum, 1 of type Multiple Coherence, 1 of type AutoPower Spectrum"
    with pytest.warns(FileContentWarning, match=r"not read, no FRF: functions") as warned:
        found = read_frfs(path)
    same(found, given)
    assert found.coherence is None
    assert {each.strip("()") for each in str(warned[0].message).partition("functions ")[2].split(", ")} == {
        each.strip("()") for each in left_out.split(", ")
    }
    with pytest.raises(
        FileContentError, match=r"contains no FRF, but functions \(1 of type FrequencySpectrum\); export FRFs"
    ):
        read_frfs(write(tmp_path / "b.mat", A=spectrum))


@pytest.mark.parametrize("write", [write_mat, write_mat73])
def test_functions_without_directions_or_names(tmp_path, write):
    given = frf_set()
    path = write(tmp_path / "a.mat", **one_by_one(given, direction=None))
    with pytest.raises(
        FileContentError, match=r"has no direction of node 101 in its responses; give mapping direction=z"
    ):
        read_frfs(path)
    found = read_frfs(path, mapping={"direction": "z"})
    assert names(found.responses) == ["101:+z", "102:+z", "103:+z"]
    np.testing.assert_array_equal(found.h, given.h)
    pairs = [(str(one), str(other)) for one in given.responses for other in given.excitations]
    in_order = {"responses": [pair[0] for pair in pairs], "excitations": ",".join(pair[1] for pair in pairs)}
    same(read_frfs(path, mapping=in_order), given)
    nameless = write(tmp_path / "b.mat", **one_by_one(given, direction=None, label=None))
    same(read_frfs(nameless, mapping=in_order), given)
    with pytest.raises(
        FileContentError, match=r"give mapping responses=\.\.\., one name for each of 6, or one for all"
    ):
        read_frfs(nameless)
    with pytest.raises(FileContentError, match=r"contains 6 functions of a kind, and mapping responses= has 2 names"):
        read_frfs(nameless, mapping={"responses": "1:x,2:x", "excitations": "1:x"})


def test_components_of_labels_are_told_apart(tmp_path):
    given = frf_set()
    labels = {"responses": ["frame:1:x", "arm:1:x", "arm:2:x"], "excitations": ["frame:1:x", "arm:2:x"]}
    path = write_mat(tmp_path / "a.mat", **(FIELDS | labels))
    with pytest.raises(
        FileContentError, match="node 1 in the components 'frame' and 'arm'; number them apart by mapping"
    ):
        read_frfs(path)
    found = read_frfs(path, mapping={"components": "frame:0,arm:100"})
    assert names((*found.responses, *found.excitations)) == ["1:+x", "101:+x", "102:+x", "1:+x", "102:+x"]
    np.testing.assert_array_equal(found.h, given.h)


def test_components_of_headings_are_told_apart(tmp_path):
    """Also where one FRF joins them, which would look like that of a driving point."""
    path = tmp_path / "a.csv"
    path.write_text("f [Hz],frame:1:x/arm:1:x real [m/N],frame:1:x/arm:1:x imag [m/N]\n1,2,0\n2,3,-1\n")
    with pytest.raises(
        FileContentError, match="node 1 in the components 'frame' and 'arm'; number them apart by mapping"
    ):
        read_frfs(path)
    found = read_frfs(path, mapping={"components": "frame:0,arm:100"})
    assert names((*found.responses, *found.excitations)) == ["1:+x", "101:+x"]


def test_a_second_function_between_the_same_channels_is_compared(tmp_path):
    given = frf_set()
    path = write_mat(tmp_path / "a.mat", A=structure_of_testlab(given, label="m/s^2/N"),
                     B=structure_of_testlab(replace(given, h=1.2 * given.h), label="m/s^2/N"))  # fmt: skip
    with pytest.warns(
        FileContentWarning, match=r"6 further FRFs .* left out, the first is used; they differ by up to 20 %"
    ):
        same(read_frfs(path), given)


@pytest.mark.parametrize("write", [write_mat, write_mat73])
def test_structure_arrays_by_path_and_index(tmp_path, write):
    """As a controller of shakers exports them: magnitude and phase of each response, first line and spacing."""
    given = frf_set()
    column = given.h[:, :, 0]
    held = [
        {"force": column[:, i], "size": abs(column[:, i]), "angle": np.angle(column[:, i]), "f0": 10.0, "df": 10.0}
        for i in range(3)
    ]
    path = tmp_path / "a.mat"
    if write is write_mat:
        array = np.array([tuple(one.values()) for one in held], dtype=[(name, object) for name in held[0]])
        write_mat(path, FRdata={"ResponseControl": array})
    else:
        write_mat73(path, FRdata={"ResponseControl": held})
    one, every = "FRdata.ResponseControl(3)", "FRdata.ResponseControl(:)"
    common = {"excitations": "101:x", "unit": "m/s^2/N"}
    single = common | {"responses": "103:z", "freq_hz": f"{one}.f0:{one}.df", "h": f"{one}.force"}
    parts = {"h": None, "magnitude": f"{one}.size", "phase_rad": f"{one}.angle"}
    for mapping in (single, single | parts, single | {"freq_hz": "10,20,30,40,50"}, single | {"freq_hz": "10:10:50"}):
        found = read_frfs(path, mapping=mapping)
        np.testing.assert_allclose(found.h[:, 0, 0], column[:, 2], rtol=1e-12)
        assert names(found.responses) == ["103:+z"]
        np.testing.assert_allclose(found.freq_hz, FREQ_HZ)
    lines = {"freq_hz": "10:10", "responses": names(given.responses)}
    found = read_frfs(path, mapping=common | lines | {"h": f"{every}.force"})
    np.testing.assert_array_equal(found.h[:, :, 0], column)
    pairs = {"responses": "1:x,1:x,2:x", "excitations": "1:x,2:x,1:x", "h": f"{every}.force"}
    found = read_frfs(path, mapping=common | lines | pairs)
    assert found.measured.tolist() == [[True, True], [True, False]]
    np.testing.assert_array_equal(found.h[:, 0, 1], column[:, 1])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"h": "FRdata.R(4).force"}, r"it has no field 'FRdata\.R\(4\)\.force'; use one of FRdata\.R\(1\)\.force, "),
        ({"h": "FRdata.R"}, r"FRdata\.R is a group; use one of FRdata\.R\(1\)\.force"),
        ({"h": "FRdata.R(:).name"}, "the FRFs are not numbers"),
        ({"h": "FRdata.R(:).none"}, r"FRdata\.R\(:\)\.none names no arrays of one size \(none\)"),
        ({"freq_hz": "10:df"}, "'df' in mapping freq_hz= is not a number or a field with one number"),
        ({"freq_hz": "10:0"}, "freq_hz=10:0 is not like 5:0.5, first frequency and spacing in Hz"),
        ({"freq_hz": "10:-1"}, "freq_hz=10:-1 is not like 5:0.5"),
        ({"freq_hz": "10:1e-9:1000"}, "are no whole number of lines of the named channels"),
        ({"freq_hz": "10:10", "responses": "1:x,2:x"}, "5 values are no whole number of lines of the named channels"),
        ({"h": None, "magnitude": "FRdata.R(1).size"}, "mapping names magnitude of the FRFs; give real= and imag="),
        (
            {"h": None, "magnitude": "FRdata.R(1).db", "phase_deg": "FRdata.R(1).size"},
            "magnitudes are negative, -20; give linear values, not dB",
        ),
        (
            {"h": None, "real": "FRdata.R(1).force", "imag": "FRdata.R(1).size"},
            r"R\(1\)\.force contains no real numbers, which mapping real= takes",
        ),
    ],
)
def test_a_wrong_path_or_frequency_is_one_sentence(tmp_path, change, message):
    values = np.arange(1, 6) * (1 + 1j)
    rows = [(values, np.ones(5), np.full(5, -20.0), "a")] * 2
    array = np.array(rows, dtype=[(name, object) for name in ("force", "size", "db", "name")])
    path = write_mat(tmp_path / "a.mat", FRdata={"R": array})
    mapping = {"h": "FRdata.R(1).force", "freq_hz": "10:10", "responses": "1:x", "excitations": "1:x", "unit": "m/N"}
    assert read_frfs(path, mapping=mapping).h.size == 5
    with pytest.raises(FileContentError, match=message):
        read_frfs(path, mapping=mapping | change)


@pytest.mark.parametrize("phase", ["phase_deg", "phase_rad"])
def test_real_and_imaginary_parts_or_magnitude_and_phase(tmp_path, phase):
    given = frf_set()
    angle = np.angle(given.h, deg=phase == "phase_deg")
    fields = {name: value for name, value in FIELDS.items() if name != "H"}
    path = tmp_path / "a.npz"
    np.savez(path, **fields, re=given.h.real, im=given.h.imag, m=abs(given.h), p=angle)
    same(read_frfs(path, mapping={"real": "re", "imag": "im"}), given)
    same(read_frfs(path, mapping={"magnitude": "m", phase: "p"}), given, rtol=1e-12)


def test_arrays_without_names_ask_for_them(tmp_path):
    path = write_mat(tmp_path / "a.mat", f=FREQ_HZ, FRF=frf_set().h)
    ways = r"give mapping responses=\.\.\. and mapping excitations=\.\.\., such as 1:x,2:x"
    with pytest.raises(FileContentError, match=rf"\(5 x 3 x 2\) have no names of responses and excitations; {ways}"):
        read_frfs(path)


def test_an_archive_without_arrays_is_one_sentence(tmp_path):
    """A workbook is an archive as well."""
    with zipfile.ZipFile(tmp_path / "a.xlsx", "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
    with pytest.raises(FileContentError, match=r"a\.xlsx contains no arrays; give a file of FRFs$"):
        read_frfs(tmp_path / "a.xlsx")


def test_one_frf_that_is_not_finite_leaves_the_others(tmp_path):
    given = frf_set()
    h = given.h.copy()
    h[2, 1, 1] = np.nan
    path = write_mat(tmp_path / "a.mat", **(FIELDS | {"H": h}))
    with pytest.warns(
        FileContentWarning, match=r"FRF 102:-y / 201:\+y is left out: NaN or Inf on 1 of 5 lines, first at 30"
    ):
        found = read_frfs(path)
    assert (~found.measured).sum() == 1
    np.testing.assert_array_equal(found.h[:, 0], given.h[:, 0])
    h = given.h.copy()
    h[0] = np.nan
    path = write_mat(tmp_path / "a.mat", **(FIELDS | {"H": h, "f": FREQ_HZ - 10}))
    with pytest.warns(FileContentWarning, match=r"at 0 Hz contains NaN or Inf in 101:\+x / 101:\+x, .* is left out"):
        np.testing.assert_array_equal(read_frfs(path).h, given.h[1:])


def test_functions_of_sdynpy(tmp_path):
    given = frf_set()
    path = write_sdynpy(tmp_path / "a.npz", given)
    same(read_frfs(path, unit="m/s^2/N"), given)
    for quantity in (None, "accelerance"):
        with pytest.raises(FileContentError, match="the FRFs have no unit; give unit="):
            read_frfs(path, quantity=quantity)
    with pytest.raises(FileContentError, match=r"functions of type 6 of sdynpy; save FRFs \(type 4\)"):
        read_frfs(write_sdynpy(tmp_path / "a.npz", given, function_type=6))


def test_arrays_of_pyfbs():
    places = np.array([[0.0, 0, 0], [0.0, 0, 0], [0.1, 0, 0]])
    ways = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, 2.0]])
    table = {f"Position_{k + 1}": places[:, k] for k in range(3)} | {f"Direction_{k + 1}": ways[:, k] for k in range(3)}
    h = frf_set().h[:, :, [0, 1, 0]]
    found = frfs_of_arrays(FREQ_HZ, h, table, table, quantity="accelerance", unit="m/s^2/N")
    assert names(found.responses) == ["1:+x", "1:-y", "2:+z"]
    np.testing.assert_array_equal(found.coordinates[2], [0.1, 0, 0])
    np.testing.assert_array_equal(found.h, h)
    with pytest.raises(
        ValueError, match=r"row 2 of the responses does not point along an axis; use jointfrf\.io\.from_pyfbs"
    ):
        frfs_of_arrays(FREQ_HZ, h, table | {"Direction_1": [1, 1, 0], "Direction_2": [0, 1, 0]}, table)
    with pytest.raises(ValueError, match="table of the excitations has no column Position_1"):
        frfs_of_arrays(FREQ_HZ, h, table, {"Direction_1": [], "Direction_2": [], "Direction_3": []})


def test_units_are_shown_as_the_file_has_them_and_as_used(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("f [kHz];1:x/1:x real [g/N];1:x/1:x imag [g/N]\n0,01;1,5;0\n0,02;2;-1\n")
    found = read_frfs(path)
    assert found.freq_hz.tolist() == [10, 20]
    np.testing.assert_allclose(found.h[:, 0, 0], [1.5 * GRAVITY, (2 - 1j) * GRAVITY])
    shown = str(found).splitlines()
    assert shown[1] == "in the file: FRFs of an unnamed quantity [g/N]"
    assert shown[2] == "used as: 1 accelerances (m/s^2)/N: 1 responses x 1 excitations, none missing"
    with pytest.raises(FileContentError, match=r"the file states accelerance \(g/N\), not mobility"):
        read_frfs(path, quantity="mobility")
    with pytest.raises(FileContentError, match="the unit 'g/N' does not fit mobility; give unit="):
        read_frfs(path, quantity="mobility", force_quantity=True)
    assert read_frfs(path, unit="mm/s/N", force_quantity=True).h[0, 0, 0] == 1.5e-3


PLAIN = "freq [Hz],1:x / 1:x mag [m/N],1:x / 1:x phase [deg],1:x / 1:x coherence\n1,2,90,0.5\n2,3,-180,1\n"


@pytest.mark.parametrize(
    "content",
    [
        PLAIN.encode(),
        PLAIN.replace(",", "\t").encode(),
        b"\xef\xbb\xbf" + PLAIN.encode(),
        PLAIN.encode("utf-16"),
        PLAIN.replace("\n", "\r\n").encode() + b"\x1a",
        PLAIN.replace("[deg]", "[rad]").replace("90", repr(np.pi / 2)).replace("-180", repr(-np.pi)).encode(),
        PLAIN.replace("[deg]", "[°]").encode("latin-1"),
        ("# Prüfstand: Halle 3\n# averages: 4\n" + PLAIN).encode(),
        PLAIN.replace("1:x / 1:x", '"Balken:1:+X/Balken:1:+X"').encode(),
    ],
)
def test_forms_of_text_tables(tmp_path, content):
    path = tmp_path / "größe.csv"
    path.write_bytes(content)
    found = read_frfs(path)
    assert names(found.responses) == ["1:+x"]
    np.testing.assert_allclose(found.h[:, 0, 0], [2j, -3], atol=1e-15)
    assert found.coherence[:, 0, 0].tolist() == [0.5, 1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1,2,90,0.5", "1,2,90", "line 2 has 3 columns, the heading has 4"),
        ("1,2,90,0.5", "1,2,ninety,0.5", "line 2, column 3: 'ninety' is not a number"),
        ("freq [Hz]", "time [s]", "has times in its first column .'time .s.'., no frequencies; estimate FRFs"),
        ("freq [Hz]", "freq [m]", "unit 'm' of the frequencies is not understood; give unit= with frequency=Hz"),
        ("freq [Hz]", "freq", "no unit in the heading 'freq'; write 'frequency .Hz.' or give unit="),
        ("1:x / 1:x mag", "channel 1 mag", "unknown column 'channel 1 mag .m/N.'; name response / excitation"),
        ("1:x / 1:x phase [deg]", "1:x / 1:x mag [m/N]", r"has two columns magnitude of 1:\+x / 1:\+x"),
        (
            "1:x / 1:x phase [deg]",
            "1:x / 1:x imag",
            r"holds? .*takes real and imag, or magnitude and phase|has .* it takes",
        ),
        ("mag [m/N]", "mag [dB]", r"unit 'dB' of the magnitude of 1:\+x / 1:\+x has no reference; give unit='dB re"),
        ("mag [m/N]", "mag", "the FRFs have no unit; give unit="),
        ("mag [m/N]", "mag [V/N]", "the unit 'V/N' is not understood; give unit="),
        ("phase [deg]", "phase", r"there is no unit of the phase of 1:\+x / 1:\+x; give unit= with phase=deg"),
        ("1,2,90,0.5\n2,3,-180,1\n", "", "no table of numbers below its heading"),
        ("freq [Hz]", "# averages: many\nfreq [Hz]", "averages 'many' is not a number"),
        (",0.5", ",-0.5", "coherence must be from 0 to 1"),
        ("2,3,-180,1", "2,nan,-180,1", "left out: NaN or Inf on 1 of 2 lines, first at 2 Hz"),
    ],
)
def test_a_wrong_text_table_is_one_sentence(tmp_path, old, new, message):
    path = tmp_path / "a.csv"
    path.write_text(PLAIN.replace(old, new))
    with pytest.raises(FileContentError, match=message):
        read_frfs(path)


def test_several_files_of_one_test(tmp_path):
    given = frf_set()
    half = frf_set(coherence=np.full(given.h.shape, 0.5))
    write_npz(tmp_path / "a.npz", given)
    write_uff(tmp_path / "b.uff", half)
    found = read_frfs(tmp_path / "a.npz", tmp_path / "b.uff", averages=4)
    same(found, given)
    assert found.coherence[0, 0, 0] == 0.5
    assert found.averages[0, 0] == 4
    write_csv(tmp_path / "c.csv", frf_set(h=given.h + 1))
    with pytest.raises(FileContentError, match=r"FRF 101:\+x / 101:\+x in .*a\.npz and in .*c\.csv contradict"):
        read_frfs(tmp_path / "a.npz", tmp_path / "c.csv")
    with pytest.raises(ValueError, match="no file is named"):
        read_frfs()


def test_coherence_in_a_file_of_its_own(tmp_path):
    given = frf_set(coherence=np.full((5, 3, 2), 0.5))
    write_uff(tmp_path / "both.uff", given, binary=False)
    datasets = (tmp_path / "both.uff").read_text().split("    -1\n")
    functions = [text for text in datasets if text.startswith("    58")]
    for name, kind in (("frf", "    4"), ("coherence", "    6")):
        chosen = [text for text in functions if text.split("\n")[6][:5] == kind]
        assert len(chosen) == 6
        (tmp_path / f"{name}.uff").write_text("".join(f"    -1\n{text}    -1\n" for text in chosen))
    found = read_frfs(tmp_path / "frf.uff", tmp_path / "coherence.uff")
    same(found, given, rtol=1e-11)
    np.testing.assert_array_equal(found.coherence, given.coherence)
    with pytest.raises(FileContentError, match=r"contains 6 coherences .* and no FRF"):
        read_frfs(tmp_path / "coherence.uff")
    with pytest.raises(FileContentError, match="there is no FRF"):
        read_frfs(tmp_path / "coherence.uff", tmp_path / "coherence.uff")


@pytest.mark.parametrize("name", WRITERS)
def test_nodes_that_are_wanted(tmp_path, name):
    WRITERS[name](tmp_path / name, full_set())
    found = read_frfs(tmp_path / name, nodes={101, 102})
    assert names(found.responses) == ["101:+x", "102:-y"]
    assert names(found.excitations) == ["101:+x"]
    np.testing.assert_array_equal(found.coherence, full_set().coherence[:, :2, :1])
    with pytest.raises(FileContentError, match="no FRF between nodes 7, 8"):
        read_frfs(tmp_path / name, nodes={7, 8})


def test_text_tables_without_channels(tmp_path):
    """As an analyser exports them: several functions, magnitude and phase; the names are those of the user."""
    given = frf_set()
    size, angle = abs(given.h), np.angle(given.h, deg=True)
    names_of, columns = ["f [Hz]"], [FREQ_HZ]
    for i, j in np.ndindex(3, 2):
        names_of += [f"Magnitude (m/s^2/N) FRF {i}", "Phase [deg]"]
        columns += [size[:, i, j], angle[:, i, j]]
    path = tmp_path / "a.csv"
    path.write_text(
        "\n".join([";".join(names_of), *(";".join(map(repr, row)) for row in np.stack(columns, 1).tolist())])
    )
    pairs = [(str(one), str(other)) for one in given.responses for other in given.excitations]
    mapping = {"responses": [pair[0] for pair in pairs], "excitations": [pair[1] for pair in pairs]}
    same(read_frfs(path, mapping=mapping), given, rtol=1e-12)
    for change, message in (
        ({"responses": None, "excitations": None}, "or give mapping responses= and excitations="),
        ({"excitations": None}, r"mapping names responses only; give mapping excitations=\.\.\. too"),
        ({"responses": "1:x,2:x"}, "contains 6 functions of a kind, and mapping responses= has 2 names"),
        ({"responses": "1:x", "excitations": "1:x"}, r"mapping names 1:\+x / 1:\+x twice; name each FRF once"),
    ):
        with pytest.raises(FileContentError, match=message):
            read_frfs(path, mapping=mapping | change)
    write_csv(path, given)
    with pytest.raises(FileContentError, match="names its channels; leave out mapping responses= and excitations="):
        read_frfs(path, mapping=mapping)


def test_ranges_of_nodes(tmp_path):
    path = write_mat(tmp_path / "a.mat", A=frf_set().h[:, :, 0])
    mapping = {"h": "A", "freq_hz": "10:10", "response_nodes": "7,11:12", "response_directions": "z",
               "excitations": "7:z"}  # fmt: skip
    assert names(read_frfs(path, mapping=mapping, unit="m/N").responses) == ["7:+z", "11:+z", "12:+z"]
    with pytest.raises(FileContentError, match=r"7:5 is no list of nodes such as 1,2 or 1:81"):
        read_frfs(path, mapping=mapping | {"response_nodes": "7:5"}, unit="m/N")
