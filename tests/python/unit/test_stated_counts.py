"""Every number that a small file states is compared with the limit of reading before memory is taken for it."""

import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

import jointfrf as jf
from jointfrf.errors import FileContentError
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.run import run_case
from jointfrf.workbench.fe.matrix_formats import read_matrix
from jointfrf.workbench.fe.nodes import read_nodes
from own_case import write_case

#: Bytes that a reader may take for a file of some kB which it rejects.
MOST = 60e6
BEAM = (
    'model = "beam"\nlength = 1.0\nyoungs_modulus = 2e11\ndensity = 7.8e3\nwidth = 0.02\nheight = 0.01\njoint = ["1:y"]'
)
BRICKS = (
    'model = "brick-beam"\nlength = 1.0\nwidth = 0.02\nheight = 0.01\nyoungs_modulus = 2e11\npoisson = 0.3\n'
    'density = 7.8e3\npreset = "seed"\njoint = ["1:y"]\n'
)
HB = "t\n 3 1 1 1 0\nRSA {0} {0} {0} 0\n(1I8) (1I8) (1D25.15)\n"


def part(path):
    return jf.read_part(path)


def matrix(path):
    return read_matrix(path, "stiffness")


def case(path):
    return read_case(path.parent)


#: Name of the file, its text, what reads it, part of the message.
TEXTS = {
    "set by a range": ("a.inp", "*NODE\n1,0\n*NSET,NSET=A,GENERATE\n1,999999999\n", read_nodes, "states content of"),
    "set of large sets": (
        "a.inp", "*NODE\n1,0\n*NSET,NSET=A,GENERATE\n1,99999\n*NSET,NSET=B\n" + "A,A,A,A\n" * 999, read_nodes,
        "states content of",
    ),
    "format of NBLOCK": ("a.cdb", "NBLOCK,6,SOLID\n(3i9,999e999)\n" + "1" * 99, read_nodes, "is no format of NBLOCK"),
    "beam elements": ("part.toml", f"{BEAM}\nelements = 1000000\n", part, "elements = 1000000 needs 2 GB"),
    "bricks": ("part.toml", BRICKS + "divisions = [1000, 1000, 1000]", part, "divisions = .* needs 2.5e"),
    "thin bricks": ("part.toml", BRICKS.replace("height = 0.01", "height = 1e-9"), part, "length = 1.0 needs"),
    "rows of CalculiX": ("k.sti", "999999999999 1 1.0\n", matrix, "states content of"),
    "rows of Abaqus": ("k.mtx", "99999999999 1 1.0\n", matrix, "states content of"),
    "Harwell-Boeing": ("k.rsa", HB.format(99999999999), matrix, "it does not contain the 99999999999 entries"),
    "Matrix Market": (
        "k.mtx", "%%MatrixMarket matrix coordinate real general\n99999999999 99999999999 1\n1 1 1.0\n", matrix,
        "states content of",
    ),
    "Matrix Market array": (
        "k.mtx", "%%MatrixMarket matrix array real general\n99999 99999\n1.0\n", matrix, "does not contain the"
    ),
}  # fmt: skip


def rejected(read, path, message):
    tracemalloc.start()
    try:
        with pytest.raises(FileContentError, match=message):
            read(path)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("name", TEXTS)
def test_a_number_of_a_file_of_text(tmp_path, name):
    file, text, read, message = TEXTS[name]
    (tmp_path / file).write_text(text)
    assert (tmp_path / file).stat().st_size < 10_000
    assert rejected(read, tmp_path / file, message) < MOST


@pytest.mark.parametrize(
    ("case_name", "old", "new", "message"),
    [
        ("3.2", "elements = ", "elements = 1000000", "elements = 1000000 needs"),
        ("3.2", "step = ", "step = 1e-9", "larger: there would be more than"),
        ("4.3.3", "height = ", "height = 1e-9", "height = 1e-09 needs"),
    ],
)
def test_a_number_of_a_case(tmp_path, case_name, old, new, message):
    text = (find_case(case_name) / "case.toml").read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if line.startswith(old))
    (tmp_path / "case.toml").write_text(text.replace(line, new, 1))
    assert rejected(case, tmp_path / "case.toml", message) < MOST


def test_realisations_of_a_case_and_those_of_the_command(tmp_path):
    folder = write_case(tmp_path / "own", "[study]\nrealisations = 2000000000\nseed = 1\n")
    folder = folder if folder.is_dir() else folder.parent
    assert rejected(lambda path: run_case(path, tmp_path / "out"), folder, "realisations = 2000000000 needs") < MOST
    assert not (tmp_path / "out").exists()


def test_lines_of_a_saved_joint(tmp_path, beams):
    fit = jf.identify(beams.freq, jf.pollute(beams.gamma(beams.joint), 0.01, seed=1), ["y", "theta"])
    content = json.loads(jf.save(fit, tmp_path / "joint.json").read_text())
    for number in (400_000_000, 2_000_000_000):
        content["lines_hz"] = {"first": 1.0, "last": 2.0, "number": number}
        (tmp_path / "joint.json").write_text(json.dumps(content))
        assert rejected(jf.load, tmp_path / "joint.json", f'"lines_hz" of {number} lines needs') < MOST


def test_the_shape_of_a_sparse_matrix_in_npz(tmp_path):
    shape = np.array([10**11, 10**11])
    np.savez(tmp_path / "k.npz", format=b"csr", shape=shape, data=np.ones(1), indices=np.zeros(1, int), indptr=[0, 1])
    assert rejected(matrix, tmp_path / "k.npz", "states content of") < MOST
    sparse.save_npz(tmp_path / "k.npz", sparse.csr_array(np.eye(3)))
    assert matrix(tmp_path / "k.npz").matrix.shape == (3, 3)


def test_sets_of_sets_hold_each_node_once(tmp_path):
    lines = [
        "*NODE",
        "1, 0",
        "2, 1",
        "*NSET, NSET=S0",
        "1, 2",
        *(f"*NSET, NSET=S{i + 1}\nS{i}, S{i}" for i in range(60)),
    ]
    (tmp_path / "a.inp").write_text("\n".join([*lines, ""]))
    assert read_nodes(tmp_path / "a.inp").sets["S60"] == ("1", "2")


def test_the_limit_can_be_raised(tmp_path, monkeypatch):
    text = TEXTS["beam elements"][1].replace("1000000", "1000")
    (tmp_path / "part.toml").write_text(text)
    monkeypatch.setenv("JOINTFRF_FILE_LIMIT_GB", "0.001")
    with pytest.raises(FileContentError, match=r"elements = 1000 needs 0.002 GB, beyond the 0.001 GB"):
        part(Path(tmp_path / "part.toml"))
    monkeypatch.setenv("JOINTFRF_FILE_LIMIT_GB", "0.01")
    part(tmp_path / "part.toml")
