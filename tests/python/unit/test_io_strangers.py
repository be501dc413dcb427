"""Files of strangers: what they unfold to is limited, what stands in other files is not read, no process is started."""

import io
import random
import subprocess
import zipfile
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy import sparse

from frf_files import FIELDS, FREQ_HZ, GIVEN, full_set, structure_of_testlab, write_mat
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.io import read_frfs, write_hdf5, write_npz
from jointfrf.io.mat_file import mat_fields
from jointfrf.workbench.fe.matrix_formats import read_matrix
from uff_writer import function


@pytest.fixture
def h5py():
    return pytest.importorskip("h5py")


@pytest.fixture
def alone(monkeypatch):
    """No process may be started."""

    def no(*_, **__):
        raise AssertionError("a process is started")

    monkeypatch.setattr(subprocess.Popen, "__init__", no)


# ---------------------------------------------------------------- MATLAB files, as scipy reads them


def same(found, expected):
    if isinstance(expected, dict):
        assert set(found) == set(expected)
        for key, value in expected.items():
            same(found[key], value)
    elif isinstance(expected, list) or (isinstance(expected, np.ndarray) and expected.dtype == object):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            same(one, other)
    elif isinstance(expected, np.ndarray):
        assert np.asarray(found).shape == expected.shape
        assert np.asarray(found).dtype.kind == expected.dtype.kind
        np.testing.assert_array_equal(found, expected)
    else:
        assert found == expected
        assert type(found) is type(expected)


def cells(*values):
    found = np.empty(len(values), object)
    found[:] = values
    return found


CONTENTS = {
    "one": 1.5,
    "whole": np.int32(7),
    "small": np.arange(300),
    "bytes": np.arange(6, dtype=np.uint8).reshape(2, 3),
    "single": np.linspace(0, 1, 5, dtype=np.float32),
    "row": np.arange(4.0)[None],
    "column": np.arange(4.0)[:, None],
    "cube": np.arange(24.0).reshape(2, 3, 4),
    "complex": np.array([[1 + 2j, 3], [4j, 5]]),
    "true": np.array([True, False]),
    "none": np.zeros((0, 3)),
    "word": "März",
    "nothing": "",
    "words": np.array(["ab", "cde"]),
    "cell": cells("a", np.arange(3), cells(1.0, "b")),
    "structure": {"a": 1.0, "inner": {"text": "x", "list": cells("p", "q")}},
}


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("long", [False, True])
def test_matlab_files_are_read_as_scipy_reads_them(tmp_path, compressed, long, alone):
    path = tmp_path / "a.mat"
    several = np.array([(1.0, "x"), (2.0, "y")], dtype=[("number", object), ("name", object)])
    scipy.io.savemat(path, CONTENTS | {"several": several}, do_compression=compressed, long_field_names=long)
    expected = scipy.io.loadmat(path, simplify_cells=True)
    same(mat_fields(path, ReadLimit(path)), {key: value for key, value in expected.items() if not key.startswith("__")})


def test_matlab_files_of_version_4_are_named(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"a": np.arange(6.0)}, format="4")
    with pytest.raises(FileContentError, match=r"a\.mat is no MATLAB file of version 5 or later; save it with .* -v7"):
        mat_fields(path, ReadLimit(path))


def test_what_has_no_meaning_here_is_left_out(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"s": sparse.eye_array(3, format="csc"), "x": 1.0})
    assert mat_fields(path, ReadLimit(path)) == {"s": None, "x": 1.0}


@pytest.mark.parametrize("compressed", [False, True])
def test_damaged_matlab_files_end_in_a_sentence(tmp_path, compressed, alone):
    """Also where the checksum fits what was damaged before it was made."""
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, CONTENTS, do_compression=False)
    sound, chance = path.read_bytes(), random.Random(5)
    for _ in range(400):
        content = bytearray(sound)
        for _ in range(chance.randrange(1, 4)):
            start = chance.randrange(128, len(content))
            content[start] = chance.randrange(256)
        if compressed:
            packed = zlib.compress(bytes(content[128:]))
            content = content[:128] + b"\x0f\0\0\0" + len(packed).to_bytes(4, "little") + packed
        path.write_bytes(content)
        with suppress(FileContentError):
            mat_fields(path, ReadLimit(path))


# ---------------------------------------------------------------- what a file unfolds to


def bomb_npz(path):
    """Less than a MB, 200 MB of zeros between two members."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, lines in (("freq_hz.npy", 10), ("h.npy", 3 << 22)):
            head = io.BytesIO()
            np.lib.format.write_array_header_1_0(head, {"descr": "<c16", "fortran_order": False, "shape": (lines,)})
            with archive.open(name, "w", force_zip64=True) as member:
                member.write(head.getvalue())
                for _ in range(max(16 * lines >> 24, 1)):
                    member.write(bytes(min(1 << 24, 16 * lines)))


def bomb_mat(path):
    """A variable of 1.6 GB of zeros."""
    size = 3 << 29
    dims = b"\x05\0\0\0\x08\0\0\0" + np.array([1, size // 8], "<i4").tobytes()
    head = b"\x06\0\0\0\x08\0\0\0\x06\0\0\0\0\0\0\0" + dims + b"\x01\0\x01\0H\0\0\0"
    head += b"\x09\0\0\0" + size.to_bytes(4, "little")
    packer = zlib.compressobj(1)
    parts = [packer.compress(b"\x0e\0\0\0" + (len(head) + size).to_bytes(4, "little") + head)]
    parts += [packer.compress(bytes(1 << 24)) for _ in range(size >> 24)]
    packed = b"".join([*parts, packer.flush()])
    start = b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\x01IM"
    path.write_bytes(start + b"\x0f\0\0\0" + len(packed).to_bytes(4, "little") + packed)


def bomb_hdf5(path):
    """Datasets of which each is as large as a file may state, and hundreds of them; nothing of them is stored."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for number in range(100):
            file.create_dataset(f"d{number}", shape=(3_000_000,), dtype="f8", chunks=(1000,), compression="gzip")


def bomb_links(path):
    """Groups that lead to the next one under many names."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        group = file.create_group("g")
        for _ in range(15):
            inner = group.create_group("0")
            for number in range(1, 10):
                group[str(number)] = inner
            group = inner


def bomb_csv(path):
    pairs = [f"{n}:+y / {n}:+y" for n in range(1, 6001)]
    columns = ["frequency [Hz]", *(f"{pair} {part}" for pair in pairs for part in ("real", "imag"))]
    rows = [",".join([str(10.0 * line), *["1"] * (2 * len(pairs))]) for line in (1, 2)]
    path.write_text("\n".join([",".join(columns), *rows]) + "\n")


@pytest.mark.parametrize(
    ("name", "make", "limit"),
    [
        ("a.npz", bomb_npz, 0.1),
        ("a.csv", bomb_csv, None),
        # To make them takes seconds; files that state too much are above.
        *(
            pytest.param(*each, None, marks=pytest.mark.long)
            for each in (("a.mat", bomb_mat), ("a.h5", bomb_hdf5), ("b.h5", bomb_links))
        ),
    ],
)
def test_what_unfolds_to_more_than_the_limit_is_not_read(tmp_path, name, make, limit):
    """The limit is 1 GB unless another one is given."""
    path = tmp_path / name
    make(path)
    assert path.stat().st_size < 10e6
    beyond = rf"states content of .* GB or more, beyond the {limit or 1:g} GB that a"
    with pytest.raises(FileContentError, match=beyond) as error:
        read_frfs(path, limit_gb=limit)
    assert "; raise this limit by limit_gb=, --limit-gb or the environment variable JOINTFRF_FILE_LIMIT_GB" in str(
        error.value
    )


@pytest.mark.filterwarnings("ignore::jointfrf.FileContentWarning")
def test_a_universal_file_of_many_channels(tmp_path):
    path = tmp_path / "a.uff"
    path.write_bytes(b"".join(function(response=(n, 2), reference=(n, 2)) for n in range(1, 91)))
    assert read_frfs(path).h.shape == (3, 90, 90)
    with pytest.raises(FileContentError, match="states content of"):
        read_frfs(path, limit_gb=path.stat().st_size / 1e9)


def test_the_limit_is_raised_by_the_keyword_and_by_the_environment(tmp_path, monkeypatch):
    path = tmp_path / "a.npz"
    zeros = np.zeros((5, 400, 400), complex)
    channels = [f"{n}:x" for n in range(1, 401)]
    np.savez_compressed(path, f=FREQ_HZ, H=zeros, responses=channels, excitations=channels, unit="m/N")
    with pytest.raises(FileContentError, match=r"beyond the 0\.001 GB"):
        read_frfs(path, limit_gb=0.001)
    assert read_frfs(path, limit_gb=0.1).h.shape == zeros.shape
    monkeypatch.setenv("JOINTFRF_FILE_LIMIT_GB", "0.001")
    with pytest.raises(FileContentError, match=r"beyond the 0\.001 GB"):
        read_frfs(path)
    assert read_frfs(path, limit_gb=0.1).h.shape == zeros.shape
    with pytest.raises(ValueError, match="limit_gb must be a number of GB above 0, not -1"):
        read_frfs(path, limit_gb=-1)


def test_a_chunk_that_unfolds_to_more_than_it_states(tmp_path, h5py):
    """The library makes room for all that a chunk unfolds to before it looks at the size."""
    path = tmp_path / "a.h5"
    packed = zlib.compress(bytes(120_000_000), 1)
    with h5py.File(path, "w") as file:
        data = file.create_dataset("h", shape=(300_000,), dtype="f8", chunks=(300_000,), compression="gzip")
        data.id.write_direct_chunk((0,), packed)
    with pytest.raises(FileContentError, match="/h decompresses to more than it states"):
        read_frfs(path, limit_gb=0.1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("coordinate real general\n100000000000 100000000000 1\n1 1 1.0\n", "states content of"),
        (
            "coordinate real general\n9 9 10000000000\n1 1 1.0\n",
            "does not contain the 10000000000 entries that it states",
        ),
        ("array real general\n100000 100000\n1.0\n", "does not contain the 10000000000 entries that it states"),
    ],
)
def test_a_matrix_that_states_too_much(tmp_path, text, message):
    path = tmp_path / "k.mtx"
    path.write_text("%%MatrixMarket matrix " + text)
    with pytest.raises(FileContentError, match=message):
        read_matrix(path, "stiffness")


def test_matrices_in_npz_files_that_state_too_much(tmp_path):
    path = tmp_path / "k.npz"
    matrix = sparse.coo_array(([1.0], ([0], [0])), shape=(10**9, 10**9))
    sparse.save_npz(path, matrix)
    with pytest.raises(FileContentError, match="states content of"):
        read_matrix(path, "stiffness")
    bomb_npz(path)
    with pytest.raises(FileContentError, match="states content of"):
        read_matrix(path, "h", limit_gb=0.1)


def test_a_compressed_matrix_is_unpacked_by_its_owner(tmp_path):
    path = tmp_path / "k.mtx.gz"
    path.write_bytes(b"\x1f\x8b")
    with pytest.raises(FileContentError, match="is compressed; unpack it"):
        read_matrix(path, "stiffness")


# ---------------------------------------------------------------- HDF5 files that name others


def elsewhere(path, h5py, tmp_path):
    other = tmp_path / "secret.h5"
    with h5py.File(other, "w") as file:
        file["averages"] = np.full((3, 2), 42)
    write_hdf5(path, full_set())
    file = h5py.File(path, "r+")
    for name in ("averages", "sha256", "jointfrf_frfs"):
        del file[name]
    file["jointfrf_frfs"] = 1
    return other, file


def external(h5py, other, file):
    file["averages"] = h5py.ExternalLink(other.name, "/averages")


def soft(h5py, other, file):
    file["#refs#/x"] = h5py.ExternalLink(other.name, "/")
    file["averages"] = h5py.SoftLink("/#refs#/x/averages")


def storage(h5py, other, file):
    file.create_dataset("averages", shape=(3, 2), dtype="i8", external=[(other.name, 0, 48)])


def virtual(h5py, other, file):
    layout = h5py.VirtualLayout((3, 2), dtype="i8")
    layout[:] = h5py.VirtualSource(other, "averages", (3, 2))
    file.create_virtual_dataset("averages", layout)


@pytest.mark.parametrize("link", [external, soft, storage, virtual])
def test_nothing_of_another_hdf5_file_is_read(tmp_path, h5py, monkeypatch, link):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a.h5"
    other, file = elsewhere(path, h5py, tmp_path)
    with file:
        link(h5py, other, file)
    with pytest.raises(FileContentError, match=r"from another file, which is not read"):
        read_frfs(path)


def test_links_inside_an_hdf5_file_are_followed(tmp_path, h5py):
    path = tmp_path / "a.h5"
    _, file = elsewhere(path, h5py, tmp_path)
    with file:
        file["inner/values"] = np.full((3, 2), 8)
        file["inner/again"] = h5py.SoftLink("values")
        file["averages"] = h5py.SoftLink("/inner/again")
        del file["h"]
        file["held"] = GIVEN.h
        file["h"] = h5py.SoftLink("held")
        file["nowhere"] = h5py.SoftLink("/inner/nothing")
        file["round"] = h5py.SoftLink("/round")
    with pytest.raises(FileContentError, match="links to links without end"):
        read_frfs(path)
    with h5py.File(path, "r+") as file:
        del file["round"]
    found = read_frfs(path)
    np.testing.assert_array_equal(found.h, GIVEN.h)
    assert (found.averages == 8).all()


# ---------------------------------------------------------------- texts of HDF5 files


TEXTS = ["102:+y", "", "Träger", "x" * 5000, "y"]


@pytest.mark.parametrize("block", [0, 512])
@pytest.mark.parametrize(
    "options",
    [{}, {"chunks": (2,)}, {"chunks": (2,), "compression": "gzip", "shuffle": True}],
)
def test_texts_of_variable_length(tmp_path, h5py, alone, options, block):
    from jointfrf.io.hdf5_file import hdf5_texts

    path = tmp_path / "a.h5"
    with h5py.File(path, "w", userblock_size=block) as file:
        file.create_dataset("texts", data=TEXTS, dtype=h5py.string_dtype(), **options)
        file["one"] = "März"
        file.create_dataset("square", data=np.array(TEXTS[:4], object).reshape(2, 2), dtype=h5py.string_dtype())
        file.create_dataset("unwritten", shape=(3,), dtype=h5py.string_dtype())
    with h5py.File(path) as file:
        found = {name: hdf5_texts(h5py, item, path, ReadLimit(path)) for name, item in file.items()}
    assert found == {"texts": TEXTS, "one": ["März"], "square": TEXTS[:4], "unwritten": [""] * 3}


def test_damaged_heaps_of_texts(tmp_path, h5py):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        for key, value in FIELDS.items():
            file[key] = value
    sound, chance = path.read_bytes(), random.Random(3)
    heap = sound.index(b"GCOL")
    for _ in range(300):
        content = bytearray(sound)
        for _ in range(3):
            content[heap + chance.randrange(200)] = chance.randrange(256)
        path.write_bytes(content)
        with suppress(FileContentError):
            assert read_frfs(path).h.shape == GIVEN.h.shape


# ---------------------------------------------------------------- the working directory


@pytest.mark.parametrize("name", ["m.mat", "m.h5"])
def test_a_module_beside_a_file_is_not_run(tmp_path, monkeypatch, name):
    """`jointfrf check m.mat` ran the `scipy.py` that stood beside it."""
    pytest.importorskip("h5py")
    import os
    import sys

    path = tmp_path / name
    if name == "m.mat":
        write_mat(path, compressed=False, FRF=structure_of_testlab(GIVEN))
    else:
        import h5py

        with h5py.File(path, "w") as file:
            for key, value in FIELDS.items():
                file[key] = value
    for module in ("scipy", "h5py", "numpy", "pickle", "signal"):
        (tmp_path / f"{module}.py").write_text("from pathlib import Path\nPath('ran').write_text(__name__)\n")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONSAFEPATH"}
    command = Path(sys.executable).with_name("jointfrf")
    done = subprocess.run([command, "check", name], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    assert "error" not in done.stderr
    assert not (tmp_path / "ran").exists()


def test_own_files_are_well_below_the_limit(tmp_path):
    for name, write in (("a.npz", write_npz), ("a.h5", write_hdf5)):
        write(tmp_path / name, full_set())
        assert read_frfs(tmp_path / name, limit_gb=0.001).h.shape == (5, 3, 2)
