"""What is wrong in a file of matrices or of FRFs is one sentence that names the key and the file."""

import re

import numpy as np
import pytest
import scipy.io
from scipy import sparse

from jointfrf.errors import FileContentError
from jointfrf.io import Channel, FrfSet, read_uff, write_uff
from jointfrf.workbench.cases.catalogue import read_case
from jointfrf.workbench.cli.main import main
from own_case import BEAMS, replace_tables, write_by_matrices, write_by_receptances

K = sparse.csr_array(BEAMS.a.model.stiffness).toarray()
HEAD = "%%MatrixMarket matrix "


@pytest.fixture
def by_matrices(tmp_path):
    return write_by_matrices(tmp_path / "matrices")


@pytest.fixture
def by_receptances(tmp_path):
    return write_by_receptances(tmp_path / "receptances")


def check(folder, message):
    with pytest.raises(FileContentError, match=message) as error:
        read_case(folder)
    sentence = str(error.value)
    assert re.match(r"\S+\.toml: ", sentence)
    assert "\n" not in sentence


def changed(row, column, value):
    matrix = K.copy()
    matrix[row, column] = value
    return matrix


MARKETS = [
    ("", r"\[substructure_a\]: stiffness: \S+a_k\.mtx is empty$"),
    ("1 2 3\n", r"mass: \S+a_m\.npz holds 4 DOFs, \S+a_k\.mtx holds 2$"),
    ("\0\1\2\xff\n", r"a_k\.mtx cannot be read as a Matrix Market file: "),
    (HEAD + "coordinate real general\n4 4 3\n1 1 1.0\n", r"a_k\.mtx cannot be read as a Matrix Market file: "),
    (HEAD + "coordinate real general\n4 4 1\n5 1 1.0\n", r"a_k\.mtx is damaged: it names row or column 5 of 4$"),
    (HEAD + "coordinate real general\n4 4 1\n1 1 x\n", r"a_k\.mtx cannot be read as a Matrix Market file: "),
    (
        HEAD + "coordinate complex general\n4 4 1\n1 1 1.0 2.0\n",
        r"a_k\.mtx must contain real numbers, not complex ones$",
    ),
    (HEAD + "coordinate pattern general\n4 4 1\n1 1\n", r"a_k\.mtx must contain real numbers, not pattern ones$"),
    (HEAD + "coordinate real general\n4 5 1\n1 1 1.0\n", r"must contain a square matrix, not one of shape \(4, 5\)$"),
    (HEAD + "coordinate real general\n0 0 0\n", r"must contain a square matrix, not one of shape \(0, 0\)$"),
    (
        HEAD + "coordinate real general\n4 4 1\n2 3 nan\n",
        r"contains NaN or Inf in row 2, column 3, counted from 1$",
    ),
    (HEAD + "coordinate real general\n4 4 1\n1 1 1e999\n", r"a_k\.mtx (contains NaN or Inf in row 1|cannot be read)"),
    (HEAD + "coordinate real symmetric\n3 3 1\n1 1 1\n", r"mass: \S+a_m\.npz holds 4 DOFs, \S+a_k\.mtx holds 3$"),
    (HEAD + "array real general\n900000000 900000000\n1\n", r"a_k\.mtx cannot be read as a Matrix Market file: "),
    (HEAD + "coordinate real general\n4 4 99999999999999\n1 1 1\n", r"a_k\.mtx cannot be read as a Matrix Market file"),
]


@pytest.mark.parametrize(("text", "message"), MARKETS)
def test_a_bad_matrix_market_file(by_matrices, text, message):
    (by_matrices / "a_k.mtx").write_bytes(text.encode("latin-1"))
    check(by_matrices, message)


def test_a_matrix_of_very_many_dofs_needs_as_many_names(by_matrices):
    text = HEAD + "coordinate real general\n200000 200000 1\n1 1 1.0\n"
    (by_matrices / "a_k.mtx").write_text(text)
    check(by_matrices, r"mass: \S+a_m\.npz holds 4 DOFs, \S+a_k\.mtx holds 200000$")
    sparse.save_npz(by_matrices / "a_m.npz", sparse.eye_array(200000, format="csr"))
    check(by_matrices, r"dofs: \S+a_dofs\.txt names 4 DOFs, the matrices hold 200000$")


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (
            changed(0, 2, 5.0),
            r"a_k\.mtx must contain a symmetric matrix: entry \(.*\) is .*, \(.*\) is [^;]*$",
        ),
        (np.triu(K), r"must contain a symmetric matrix: .*; it contains one triangle only$"),
    ],
)
def test_an_unsymmetric_stiffness(by_matrices, matrix, message):
    scipy.io.mmwrite(by_matrices / "a_k.mtx", matrix, symmetry="general")
    check(by_matrices, message)


def out_of_range():
    matrix = sparse.eye_array(4, format="csr")
    matrix.indices[0] = 77
    return matrix


NPZ = [
    (lambda path: path.write_bytes(b""), r"mass: \S+a_m\.npz (is empty|cannot be read as an NPZ file: )"),
    (lambda path: path.write_bytes(b"PK\3\4" + b"x" * 50), r"a_m\.npz cannot be read as an NPZ file: "),
    (lambda path: path.write_bytes(path.read_bytes()[:300]), r"a_m\.npz cannot be read as an NPZ file: "),
    (lambda path: np.savez(path, np.array([{}], object)), r"a_m\.npz contains Python objects \(arr_0\.npy\), which"),
    (
        lambda path: np.savez(path, a=K, b=K),
        r"a_m\.npz must contain one array, or one called 'mass'; it contains a, b$",
    ),
    (lambda path: np.savez(path), r"must contain one array, or one called 'mass'; it contains nothing$"),
    (lambda path: np.savez(path, K[0]), r"a_m\.npz must contain a square matrix, not one of shape \(4,\)$"),
    (lambda path: np.savez(path, K + 1j), r"a_m\.npz must contain real numbers, not complex ones$"),
    (lambda path: np.savez(path, np.full((4, 4), "x")), r"a_m\.npz must contain real numbers, not <U1 ones$"),
    (lambda path: np.savez(path, K * np.inf), r"a_m\.npz contains NaN or Inf in row 1, column 1, counted from 1$"),
    (lambda path: sparse.save_npz(path, out_of_range()), r"a_m\.npz (is damaged|cannot be read as an NPZ file)"),
    (lambda path: np.savez(path, -K), r"mass: \S+a_m\.npz must have a diagonal that is not negative, and not zero"),
    (lambda path: np.savez(path, 0 * K), r"mass: \S+a_m\.npz must have a diagonal that is not negative, and not zero"),
]


@pytest.mark.parametrize(("write", "message"), NPZ)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_bad_npz_file(by_matrices, write, message):
    write(by_matrices / "a_m.npz")
    check(by_matrices, message)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"a_k.mtx"', '"none.mtx"', r"\[substructure_a\]: stiffness: \S+none\.mtx does not exist; name a file$"),
        ('"a_k.mtx"', '"."', r"stiffness: \S+ is a folder; name a file$"),
        ('"a_k.mtx"', '""', r"stiffness: \S+ is a folder; name a file$"),
        ('"a_k.mtx"', '"a\\u0000b"', r"stiffness must be the name of a file"),
        ('"a_k.mtx"', '["a_k.mtx"]', r"stiffness must be the name of a file, not \['a_k\.mtx'\]$"),
        ('"a_dofs.txt"', '"none.txt"', r"dofs: \S+none\.txt does not exist; name a file$"),
        ('"a_dofs.txt"', "4", r"dofs must be a list of texts, or name of a text file, not 4$"),
        ('["1:y", "1:theta",', '["1:y", "1:y",', r"\[substructure_b\]: dofs: names '1:y' twice$"),
        ('["1:y", "1:theta",', '["1:y", " ",', r"dofs: has an empty name$"),
        ('["1:y", "1:theta",', '["1:y",', r"dofs: names 3 DOFs, the matrices hold 4$"),
        (
            '"b_h.mtx"',
            '"a_dofs.txt"',
            r"structural_damping: \S+a_dofs\.txt is of an unknown format of matrices; known are NPZ",
        ),
        ("loss_factor = 0.01", "loss_factor = -1", r"loss_factor must be a number, at least 0, not -1$"),
        ("stiffness = ", "stifness = ", r"unknown key 'stifness'; use one of model, .*; did you mean 'stiffness'\?$"),
        ('j = ["3:y", "3:theta"]', 'j = ["3:y", "3:y"]', r"joint DOF '3:y' is named twice; name each DOF once$"),
        ('j = ["3:y", "3:theta"]', 'j = ["3:y", "4:y"]', r"\[points\]: the model has no DOF '4:y'"),
    ],
)
def test_a_wrong_key_of_matrices(by_matrices, old, new, message):
    path = by_matrices / "case.toml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    check(by_matrices, message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"dofs: \S+a_dofs\.txt (is empty|contains no names of DOFs)$"),
        ("1 2\n1 7\n", r"a_dofs\.txt: line 2: a DOF has a number from 1 to 6, not 7$"),
        ("1 2\n1 0\n", r"a_dofs\.txt: line 2: a DOF has a number from 1 to 6, not 0$"),
        ("1 2 3\n", r"a_dofs\.txt: line 1 must be like '12:y' or '12 2', not '1 2 3'$"),
        ("1 2\n1 2\n1 3\n1 4\n", r"a_dofs\.txt names '1:y' twice$"),
        ("\xff\xfe\x00", r"a_dofs\.txt is not a text file"),
    ],
)
def test_a_bad_file_of_dofs(by_matrices, text, message):
    (by_matrices / "a_dofs.txt").write_bytes(text.encode("latin-1"))
    check(by_matrices, message)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"b.uff"', '"none.uff"', r"\[substructure_b\]: file: \S+none\.uff does not exist; name a file$"),
        ('"b.uff"', '"case.toml"', r"\[substructure_b\]: file: \S+case\.toml"),
        (
            'file = "b.uff"',
            'file = "b.uff"\nquantity = "x"',
            r"quantity must be one of receptance, mobility, ",
        ),
        ('k = ["1:y", "1:rz"]', 'k = ["1:y", "1:theta"]', r"\[points\]: '1:theta' is no channel; write a node"),
        (
            'k = ["1:y", "1:rz"]',
            'k = ["1:y", "1:-y"]',
            r"\[points\]: the joint DOF '1:y' is named twice; name each",
        ),
        ('k = ["1:y", "1:rz"]', 'k = ["1:y", "9:rz"]', r"\[points\]: \S+b\.uff: missing FRFs .*9:\+rz / 1:\+y"),
        ("step = 5.0", "step = 2.5", r"\[substructure_a\]: file: \S+a\.uff has no line at 17\.5 Hz, the nearest is "),
        ("last = 900.0", "last = 905.0", r"a\.uff has no line at 905 Hz, the nearest is 900 Hz \(1 of 179 lines are"),
        (
            "step = 5.0",
            'step = 5.0\nfrom_file = "b.uff"',
            r"\[frequency\]: step: the lines are those of the file that from_file names",
        ),
        ("step = 5.0", 'from_file = "none.uff"', r"\[frequency\]: from_file: "),
        (
            "first = 15.0\nlast = 900.0\nstep = 5.0",
            'first = 1e4\nfrom_file = "b.uff"',
            r"from_file: no line of ",
        ),
    ],
)
def test_a_wrong_key_of_receptances(by_receptances, old, new, message):
    path = by_receptances / "case.toml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    check(by_receptances, message)


def test_a_file_that_begins_at_rest(by_receptances):
    """Receptances have a line at 0 Hz, where Im K*/w is not defined."""
    points = (Channel(1, "y"), Channel(1, "rz"), Channel(2, "y"), Channel(2, "rz"))
    freq = np.arange(0.0, 901.0, 5.0)
    write_uff(by_receptances / "b.uff", FrfSet(freq, points, points, np.ones((freq.size, 4, 4))))
    path = by_receptances / "case.toml"
    path.write_text(replace_tables(path.read_text(), '[frequency]\nfrom_file = "b.uff"\n'))
    check(by_receptances, r"\[frequency\]: from_file: the file has a line at 0 Hz, .*: name the first line$")


def test_frfs_that_are_missing_or_no_numbers(by_receptances):
    frfs = read_uff(by_receptances / "b.uff")
    h = frfs.h.copy()
    h[:, 3, 0] = np.nan
    missing = FrfSet(frfs.freq_hz, frfs.responses, frfs.excitations, h)
    write_uff(by_receptances / "b.uff", missing)
    check(by_receptances, r"\[points\]: \S+b\.uff: missing FRFs \(response / excitation\): 2:\+rz / 1:\+y$")


def test_a_sensor_that_shows_nothing(by_receptances):
    frfs = read_uff(by_receptances / "b.uff")
    h = frfs.h.copy()
    h[:, 1] = 0
    write_uff(by_receptances / "b.uff", FrfSet(frfs.freq_hz, frfs.responses, frfs.excitations, h))
    check(by_receptances, r"\[points\]: \S+b\.uff: the FRF 1:\+rz / 1:\+rz is zero on all lines; check it$")


def test_what_needs_a_model_is_told(by_receptances):
    expected = by_receptances / "expected.toml"
    expected.write_text("[printed]\nstep = 0.1\namplitude_within_percent = 5\nlines_within = 1\n")
    check(by_receptances, r"expected\.toml: printed needs models, not receptances, of both substructures$")
    expected.write_text('[[frequencies]]\njoint = "actual"\nsource = "x"\nvalues = [1.0]\nwithin_percent = 1\n')
    check(by_receptances, r"expected\.toml: frequencies needs models, not receptances, of both substructures$")


def test_the_command_says_it_in_one_line(by_matrices, capsys):
    (by_matrices / "a_k.mtx").write_text("")
    assert main(["run", str(by_matrices), "--jobs", "1"]) == 1
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("jointfrf: error: ")
    assert len(printed.err.splitlines()) == 1
