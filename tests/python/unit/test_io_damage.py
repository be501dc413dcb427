"""Damaged, foreign and misleading files: each is read as far as it goes or refused in one sentence that names it."""

import io
import os
import pickle
import random
import warnings
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from frf_files import (
    FIELDS,
    FREQ_HZ,
    GIVEN,
    full_set,
    structure_of_testlab,
    write_mat,
    write_mat73,
    write_sdynpy,
)
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io import read_frfs, read_uff, write_csv, write_hdf5, write_npz, write_uff
from uff_writer import VALUES, dataset, function

h5py = pytest.importorskip("h5py")

MAKERS = {
    "text.uff": lambda path: write_uff(path, full_set(), binary=False),
    "binary.uff": lambda path: write_uff(path, full_set()),
    "own.npz": lambda path: write_npz(path, full_set()),
    "array.npy": lambda path: np.save(path, GIVEN.h),
    "sdynpy.npz": lambda path: write_sdynpy(path, GIVEN),
    "own.h5": lambda path: write_hdf5(path, full_set()),
    "script.mat": lambda path: write_mat(path, **FIELDS),
    "testlab.mat": lambda path: write_mat(path, FRF=structure_of_testlab(GIVEN)),
    "script73.mat": lambda path: write_mat73(path, **FIELDS),
    "table.csv": lambda path: write_csv(path, full_set()),
}


#: What an array without names lacks.
NAMELESS = {"axes": "freq,out,in", "freq_hz": GIVEN.freq_hz, "responses": GIVEN.responses,
            "excitations": GIVEN.excitations}  # fmt: skip


def refused(path, **options):
    """One sentence about a file that is not read."""
    with pytest.raises(FileContentError) as caught:
        read_frfs(path, **options)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert path.name in sentence
    assert len(sentence) < 400
    return sentence


def read_or_refused(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileContentWarning)
        with suppress(FileContentError):
            assert np.isfinite(read_frfs(path, quantity="accelerance").h[:, 0, 0]).all()


@pytest.mark.parametrize("name", MAKERS)
def test_a_file_cut_anywhere(tmp_path, name):
    path = tmp_path / name
    MAKERS[name](path)
    content = path.read_bytes()
    for end in np.linspace(1, len(content) - 1, 41).astype(int):
        path.write_bytes(content[:end])
        read_or_refused(path)
    path.write_bytes(content[: len(content) // 3])
    if not name.endswith((".uff", ".csv")):  # which hold one FRF, one line after the other
        assert any(word in refused(path) for word in ("cannot be read as", "is damaged"))


@pytest.mark.parametrize("name", MAKERS)
def test_a_file_with_bytes_changed(tmp_path, name):
    path = tmp_path / name
    MAKERS[name](path)
    sound, chance = path.read_bytes(), random.Random(11)
    for _ in range(60):
        content = bytearray(sound)
        for _ in range(chance.randrange(1, 6)):
            start = chance.randrange(len(content))
            content[start : start + chance.randrange(1, 5)] = chance.randbytes(chance.randrange(5))
        path.write_bytes(content)
        read_or_refused(path)


@pytest.mark.parametrize("suffix", [".uff", ".npz", ".h5", ".mat", ".csv", ""])
@pytest.mark.parametrize(("content", "message"), [(b"", "is empty"), (b" \n\r\n", "is empty")])
def test_an_empty_file(tmp_path, suffix, content, message):
    path = tmp_path / f"none{suffix}"
    path.write_bytes(content)
    assert message in refused(path)


def pickled():
    return pickle.dumps({"freq": FREQ_HZ})


def array_file():
    content = io.BytesIO()
    np.save(content, GIVEN.h)
    return content.getvalue()


KNOWN = (
    "is of an unknown format; use one of Universal File (.uff .unv), MATLAB (.mat), NPZ (.npz), NPY (.npy), HDF5 (.h5 "
    ".hdf5) and CSV (.csv .txt)"
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"%PDF-1.7\n\0\1\2", KNOWN),
        (b"some words\nand more\n", KNOWN),
        (bytes(range(1, 256)) + b"\0", KNOWN),
        (pickled(), "is a pickle, which could run any program; save an NPZ file"),
        (array_file(), "contains 5 x 3 x 2 numbers; give mapping axes=freq,out,in or their other order"),
        (b"RIFF....WAVE", "is a WAV file or another of time data; estimate FRFs from the time data first, for example"),
        (b"\x1f\x8b\x08", "is compressed by gzip; unpack it"),
        (b"TDSm\0\0", "is a TDMS file of LabVIEW, which is not read; export its FRFs as a Universal File or CSV"),
        (b"LabVIEW Measurement\t\r\n", "is an LVM file of LabVIEW, which is not read; export its FRFs as"),
        (b"PK\x03\x04 and nothing", "cannot be read as an NPZ file"),
        (b"\x89HDF\r\n\x1a\n and nothing", "cannot be read as an HDF5 file"),
        (b"MATLAB 5.0 MAT-file and nothing", "cannot be read as a MATLAB file"),
        (b"MATLAB 7.3 MAT-file and nothing", "cannot be read as an HDF5 file"),
    ],
)
def test_what_is_no_file_of_frfs(tmp_path, content, message):
    path = tmp_path / "unknown.dat"
    path.write_bytes(content)
    assert message in refused(path)


@pytest.mark.parametrize(
    ("suffix", "message"),
    [
        (".uff", "is not a Universal File: no dataset delimiters"),
        (".mat", "is no MATLAB file of version 5 or later"),
        (".npz", KNOWN),
        (".h5", KNOWN),
        (".csv", KNOWN),
    ],
)
def test_a_suffix_that_promises_too_much(tmp_path, suffix, message):
    path = tmp_path / f"words{suffix}"
    path.write_bytes(b"only a few words, then noise\n\0" if suffix == ".csv" else b"only words\n")
    assert message in refused(path)


def test_folders_and_missing_files(tmp_path):
    assert "is a folder" in refused(tmp_path)
    with pytest.raises(FileNotFoundError, match=r"there is no file .*none\.npz"):
        read_frfs(tmp_path / "none.npz")


def npz_with_header(path, shape, dtype="<c16"):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": dtype, "fortran_order": False, "shape": shape})
    write_npz(path, GIVEN)
    with zipfile.ZipFile(path) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, header.getvalue() + bytes(64) if name == "h.npy" else content)


def test_stated_sizes_that_exceed_the_file(tmp_path):
    path = tmp_path / "huge.npz"
    for shape in ((10**12, 1, 1), (10**6, 10**6, 10**9)):
        npz_with_header(path, shape)
        assert "is damaged: h.npy has not the" in refused(path)
    path = tmp_path / "huge.h5"
    write_hdf5(path, GIVEN)
    with h5py.File(path, "r+") as file:
        del file["h"]
        file.create_dataset("h", shape=(10**12, 3, 2), dtype="c16", chunks=(1000, 3, 2))
    assert "is damaged: /h does not contain the 1000000000000 x 3 x 2 values that it states" in refused(path)
    path = tmp_path / "huge.uff"
    path.write_bytes(function(n_values=999_999_999))
    assert "has 3 of 999999999 values" in refused(path)
    path.write_bytes(function(binary=True, n_values=999_999_999))
    assert "of 999999999 values" in refused(path)
    path = tmp_path / "huge.mat"
    record = structure_of_testlab(GIVEN)
    record["x_values"]["number_of_values"] = 1e8
    assert "is damaged: 30 values at 1e+08 frequency lines" in refused(write_mat(path, FRF=record))
    content = write_mat(path, compressed=False, **FIELDS).read_bytes()
    sizes = np.array([5, 3, 2], "<i4").tobytes()
    assert content.count(sizes) == 1
    path.write_bytes(content.replace(sizes, np.array([2**30, 2**30, 2], "<i4").tobytes()))
    assert "cannot be read as a MATLAB file" in refused(path)


def test_a_coherence_of_no_known_type(tmp_path):
    path = tmp_path / "frfs.uff"
    write_uff(path, full_set())
    content = path.read_bytes()
    real = b"\n         4         5         1"
    assert real in content
    path.write_bytes(content.replace(real, real.replace(b"4", b"0"), 1))
    with pytest.raises(jf.FileContentError, match=r"is damaged: ordinate data type 0 in dataset \d+ \(coherence "):
        read_frfs(path)


def test_a_matlab_file_without_checksums(tmp_path):
    """Nothing but its own sizes says that it is damaged."""
    path = write_mat(tmp_path / "plain.mat", compressed=False, **FIELDS)
    np.testing.assert_array_equal(read_frfs(path).h, GIVEN.h)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert "cannot be read as a MATLAB file: it ends inside a variable, or one is damaged" in refused(path)


def test_damaged_texts_of_an_hdf5_file(tmp_path):
    """Texts of variable length stand in a heap of their own, where the library follows every number."""
    path = tmp_path / "texts.h5"
    with h5py.File(path, "w") as file:
        for key, value in FIELDS.items():
            file[key] = value
    np.testing.assert_array_equal(read_frfs(path).h, GIVEN.h)
    content = path.read_bytes()
    heap = content.index(b"GCOL")
    for numbers in (b"\xff" * 16, b"\0" * 16):
        path.write_bytes(content[: heap + 16] + numbers + content[heap + 32 :])
        refused(path)


def test_python_objects_are_not_read(tmp_path):
    path = tmp_path / "objects.npz"
    np.savez(path, freq=FREQ_HZ, h=np.array([{"a": 1}], dtype=object))
    assert "contains Python objects (h.npy), which could run any program; save plain arrays" in refused(path)


def test_numbers_of_the_other_byte_order(tmp_path):
    """Where the file states it, nothing is lost; where it states the wrong one, that is noticed."""
    path = tmp_path / "big.npz"
    np.savez(path, **(FIELDS | {"f": FREQ_HZ.astype(">f8"), "H": GIVEN.h.astype(">c16")}))
    np.testing.assert_array_equal(read_frfs(path).h, GIVEN.h)
    path = tmp_path / "big.h5"
    write_hdf5(path, GIVEN)
    with h5py.File(path, "r+") as file:
        del file["h"]
        file["h"] = GIVEN.h.astype(">c16")
    np.testing.assert_array_equal(read_frfs(path).h, GIVEN.h)
    path = tmp_path / "big.uff"
    values = np.linspace(1, 2, 50) + 3j
    freq_hz = np.arange(10.0, 60.0)
    little = function(values, freq_hz, binary=True)
    swapped = little.replace(values.astype("<c16").tobytes(), values.astype("<c16").byteswap().tobytes())
    big = swapped.replace(b"58b     1     2", b"58b     2     2")
    path.write_bytes(big)
    np.testing.assert_array_equal(read_frfs(path).h[:, 0, 0], values)
    path.write_bytes(swapped)
    assert "the byte order is not the one that is stated" in refused(path)


def test_names_that_are_not_ascii(tmp_path):
    folder = tmp_path / "Prüfling 测试"
    folder.mkdir()
    for name, make in MAKERS.items():
        path = folder / f"größe {name}"
        make(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FileContentWarning)
            mapping = NAMELESS if path.suffix == ".npy" else None
            assert read_frfs(path, unit="m/s^2/N", mapping=mapping).responses == GIVEN.responses
    path = folder / "kopf.uff"
    path.write_bytes(function().replace(b"NONE\n", "Prüfstand m/s²\n".encode("latin-1"), 2))
    np.testing.assert_allclose(read_frfs(path).h[:, 0, 0], VALUES)
    path = folder / "namen.mat"
    write_mat(path, **(FIELDS | {"responses": ["Träger:101:+X", "Träger:102:-Y", "Träger:103:+Z"]}))
    assert read_frfs(path).responses == GIVEN.responses


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"jointfrf_frfs": 3}, "has layout 3, this version of jointfrf reads layouts 1 and 2"),
        ({"jointfrf_frfs": 2}, "lacks sha256"),
        ({"jointfrf_frfs": 2, "sha256": "0"}, "does not fit its field sha256"),
        ({"jointfrf_frfs": "one"}, "has layout one"),
        ({"h": None, "quantity": None}, "lacks h, quantity"),
        ({"responses": ["101:+x"]}, "sizes 5 x 3 x 2, which do not fit 5 lines, 1 responses"),
        (
            {"nodes": [1, 2], "coordinates": np.zeros((1, 3))},
            "have shape (1, 3), expected three for each of 2 nodes",
        ),
        ({"quantity": "impedance"}, "unknown quantity 'impedance'; use one of"),
    ],
)
@pytest.mark.parametrize("name", ["a.npz", "a.h5"])
def test_an_own_file_that_was_tampered_with(tmp_path, name, change, message):
    path = tmp_path / name
    fields = {
        "jointfrf_frfs": 1, "freq_hz": FREQ_HZ, "h": GIVEN.h, "responses": FIELDS["responses"],
        "excitations": FIELDS["excitations"], "quantity": "accelerance", "unit": "m/s^2/N",
    } | change  # fmt: skip
    fields = {key: value for key, value in fields.items() if value is not None}
    if name == "a.npz":
        np.savez(path, **fields)
    else:
        with h5py.File(path, "w") as file:
            for key, value in fields.items():
                file[key] = value
    assert message in refused(path)


def test_mixed_files(tmp_path):
    """Time histories, spectra and other datasets beside FRFs do no harm; alone they are named."""
    path = tmp_path / "mixed.uff"
    others = [dataset(151, *["x"] * 7).encode(), function(np.ones(3), function_type=1, number_type=4)]
    path.write_bytes(b"".join([*others, function(), *others]))
    with pytest.warns(FileContentWarning, match=r"not read, no FRF: time history .* \(datasets 2, 5\)"):
        np.testing.assert_allclose(read_frfs(path).h[:, 0, 0], VALUES)
    path.write_bytes(b"".join(others))
    assert "contains 1 time history" in refused(path)
    path = tmp_path / "mixed.mat"
    signal = structure_of_testlab(GIVEN, type_="Signal", values=GIVEN.h.real)
    write_mat(path, Signal=signal, FRF=structure_of_testlab(GIVEN, label="m/s^2/N"), text="März", n=3)
    with pytest.warns(FileContentWarning, match=r"not read, no FRF: functions \(1 of type Signal\)"):
        np.testing.assert_array_equal(read_frfs(path).h, GIVEN.h)
    assert "contains no FRF" in refused(write_mat(path, Signal=signal))
    assert "has no field for the frequencies" in refused(write_mat(path, text="März", n=3))


@pytest.mark.parametrize("write", [write_uff, write_npz, write_hdf5, write_csv])
def test_nothing_is_left_of_a_file_that_could_not_be_written(tmp_path, monkeypatch, write):
    path = tmp_path / "out.file"
    path.write_bytes(b"old")

    def no_room(*_):
        raise OSError("No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", no_room)
    with pytest.raises(OSError, match="No space left"):
        write(path, GIVEN)
    assert [each.name for each in tmp_path.iterdir()] == ["out.file"]
    assert path.read_bytes() == b"old"


@pytest.mark.parametrize("suffix", [".uff", ".mat", ".csv"])
def test_pipes_and_devices_are_not_waited_for(tmp_path, suffix):
    """Opening a pipe waits for a writer, for ever if there is none; a device has no end."""
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    assert "is a pipe or a device, not a file" in refused(pipe)
    assert "is a pipe or a device, not a file" in refused(Path("/dev/zero"))
    with pytest.raises(FileContentError, match="is a pipe or a device, not a file"):
        read_uff(pipe)


def test_a_study_or_a_joint_in_a_pipe_is_not_waited_for(tmp_path):
    """`read_study` hung, and took all memory of /dev/zero."""
    os.mkfifo(tmp_path / "study.json")
    os.mkfifo(tmp_path / "joint.toml")
    for read in (lambda: jf.read_study(tmp_path), lambda: jf.merge_studies([tmp_path], tmp_path / "all"),
                 lambda: jf.read_joint(tmp_path / "joint.toml")):  # fmt: skip
        with pytest.raises(FileContentError, match="is a pipe or a device, not a file"):
            read()


@pytest.mark.parametrize(
    "read", [jf.read_joint, jf.io.read_frfs, jf.io.read_uff, lambda name: jf.study(name, "none", 2), jf.read_study]
)
def test_a_name_of_two_lines_leaves_the_message_one(read):
    with pytest.raises((FileNotFoundError, ValueError)) as raised:
        read("two\nlines")
    assert len(str(raised.value).splitlines()) == 1
    assert "two" in str(raised.value)


def test_files_beyond_a_limit_are_not_read(tmp_path, monkeypatch):
    path = tmp_path / "own.npz"
    write_npz(path, GIVEN)
    monkeypatch.setenv("JOINTFRF_FILE_LIMIT_GB", "1e-6")
    assert (
        "more than the 1e-06 GB that are read; raise this limit by limit_gb=, --limit-gb or the environment variable"
        in refused(path)
    )
    monkeypatch.setenv("JOINTFRF_FILE_LIMIT_GB", "2")
    np.testing.assert_array_equal(read_frfs(path).h, GIVEN.h)
    monkeypatch.setenv("JOINTFRF_FILE_LIMIT_GB", "much")
    with pytest.raises(FileContentError, match="JOINTFRF_FILE_LIMIT_GB is 'much'; set it to a number of GB"):
        read_frfs(path)


@pytest.mark.parametrize("name", ["own.npz", "own.h5"])
@pytest.mark.parametrize("lost", ["coherence", "averages", "coordinates", "nodes", "unit", "sha256"])
def test_a_field_that_was_lost_is_noticed(tmp_path, name, lost):
    """All but the checksum itself may be absent; a file that had one and lost it is damaged."""
    path = tmp_path / name
    MAKERS[name](path)
    if name == "own.npz":
        with np.load(path) as archive:
            fields = {key: archive[key] for key in archive.files if key != lost}
        np.savez(path, **fields)
    else:
        with h5py.File(path, "r+") as file:
            del file[lost]
    assert "is damaged or was edited" in refused(path) if lost != "sha256" else "lacks sha256" in refused(path)


def test_a_name_with_a_line_end_does_not_split_the_message(tmp_path):
    path = tmp_path / "a\nb.npz"
    path.write_bytes(b"PK\x03\x04 and nothing")
    with pytest.raises(FileContentError) as caught:
        read_frfs(path)
    assert "\n" not in str(caught.value)


def test_no_file_of_any_kind_is_waited_for(tmp_path):
    """Tables of channels, matrices, DOF names, joints and TOML files, too."""
    from jointfrf.io import read_channel_table
    from jointfrf.toml.table import read_toml
    from jointfrf.workbench.fe.matrix_formats import read_matrix
    from jointfrf.workbench.fe.nodes import read_dof_names

    for suffix, read in ((".csv", read_channel_table), (".toml", read_channel_table), (".toml", read_toml),
                         (".mtx", read_matrix), (".txt", read_dof_names), (".json", jf.load)):  # fmt: skip
        pipe = tmp_path / f"{read.__name__}{suffix}"
        os.mkfifo(pipe)
        with pytest.raises(FileContentError, match="is a pipe or a device, not a file"):
            read(pipe, "") if read is read_matrix else read(pipe)


@pytest.mark.parametrize(
    "name", ["freq_hz", "h", "responses", "quantity", "unit", "coherence", "nodes", "jointfrf_frfs"]
)
@pytest.mark.parametrize("layout", [1, 2])
def test_a_group_in_place_of_a_dataset_is_one_sentence(tmp_path, name, layout):
    """In the own layout, and in arrays of scripts."""
    path = tmp_path / "a.h5"
    write_hdf5(path, full_set())
    with h5py.File(path, "r+") as file:
        if layout == 1:
            del file["sha256"]
            file["jointfrf_frfs"][()] = 1
        del file[name]
        file.create_group(name)["inside"] = [1.0, 2.0]
    assert f"{name} is a group, not an array; write the file again" in refused(path)


def test_a_group_that_someone_added_is_damage_or_no_harm(tmp_path):
    path = tmp_path / "a.h5"
    write_hdf5(path, full_set())
    with h5py.File(path, "r+") as file:
        file.create_group("notes")["inside"] = [1.0, 2.0]
    assert "was edited: its content does not fit its field sha256" in refused(path)
    with h5py.File(path, "r+") as file:
        del file["sha256"]
        file["jointfrf_frfs"][()] = 1
    np.testing.assert_array_equal(read_frfs(path).h, full_set().h)


def test_a_group_named_by_a_mapping_is_one_sentence(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        for name, value in FIELDS.items():
            file[name] = np.char.encode(value, "utf-8") if isinstance(value, list | str) else value
        file["test/a"], file["test/b"] = GIVEN.h, GIVEN.h
    np.testing.assert_array_equal(read_frfs(path, mapping={"h": "test.a"}).h, GIVEN.h)
    with pytest.raises(FileContentError, match=r"test is a group; use one of test\.a, test\.b"):
        read_frfs(path, mapping={"h": "test"})
