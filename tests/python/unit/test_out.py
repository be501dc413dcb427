"""Results into an array of the caller, and arrays in files: checked, not copied, piece by piece."""

import subprocess
import sys

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.kernel import arguments, call


def calls(g):
    """Every function with `out`, on receptances g, shape (n_freq, 4, 4)."""
    k = np.array([[2.0, 0.5j], [1.0, 3.0]])
    freq, matrix = np.linspace(0.1, 2, len(g)), np.diag([3.0, 4.0, 5.0])
    x = np.linspace(-1, 1, 4)
    return {
        "invert": lambda **o: jf.invert(g, **o),
        "solve": lambda **o: jf.solve(g, g[:, :, :3] + 1, **o),
        "couple": lambda **o: jf.couple(g, g[:, :3, :3], k, [0, 3], [2, 1], **o),
        "modify": lambda **o: jf.modify(g, k, [1, 2], **o),
        "find_modification": lambda **o: jf.find_modification(g, g + np.eye(4), **o),
        "ismm": lambda **o: jf.ismm(g, g + np.eye(4), k, **o),
        "inverse_substructuring": lambda **o: jf.inverse_substructuring(g, **o),
        "joint_compliance": lambda **o: jf.joint_compliance(g, **o),
        "decouple": lambda **o: jf.decouple("rs", g, g, g[:, :1, :1], [0], [1], [2], [3], **o),
        "central_difference": lambda **o: jf.central_difference(g, x, sign=-1, **o),
        "transform": lambda **o: jf.transform(g, np.ones((3, 4)), np.ones((2, 4)), **o),
        "dense": lambda **o: jf.receptance(freq, matrix, matrix, loss_factor=0.1, method="dense", **o),
        "banded": lambda **o: jf.receptance(freq, matrix, matrix, loss_factor=0.1, method="banded", **o),
        "modal": lambda **o: jf.receptance(freq, matrix, matrix, loss_factor=0.1, method="modal", **o),
    }


FUNCTIONS = sorted(calls(np.zeros((1, 4, 4))))


@pytest.fixture
def in_file(tmp_path):
    """Make a copy of an array in a file."""
    count = 0

    def make(a: np.ndarray, dtype=np.complex128, **options) -> np.memmap:
        nonlocal count
        count += 1
        mapped = np.memmap(tmp_path / f"{count}", dtype, "w+", shape=a.shape, **options)
        mapped[:] = a
        return mapped

    return make


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(arguments, "CHUNK_BYTES", 2**15)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_out_is_filled_and_returned(name, random_lines):
    call = calls(random_lines(70, 4))[name]
    expected = call()
    out = np.full_like(expected, 4711)
    assert call(out=out) is out
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_arrays_in_files_give_the_same_bits_piece_by_piece(name, random_lines, in_file, small_pieces, monkeypatch):
    g = random_lines(1000, 4)
    expected = calls(g)[name]()
    pieces = []
    kernel = call.chunks
    monkeypatch.setattr(call, "chunks", lambda *a: pieces.extend(kernel(*a)) or kernel(*a))
    out = in_file(np.zeros_like(expected))
    assert calls(in_file(g))[name](out=out) is out
    if name in ("dense", "banded"):  # scaled by the highest frequency of a piece
        np.testing.assert_allclose(out, expected, rtol=1e-13)
    else:
        assert out.tobytes() == expected.tobytes()
    assert len(pieces) > 1
    assert [p.start for p in pieces] == [0, *(p.stop for p in pieces[:-1])]
    assert pieces[-1].stop == len(g)
    assert {p.start % 64 for p in pieces} == {0}


@pytest.mark.parametrize("n", [1, 2, 4, 5])
@pytest.mark.parametrize("n_freq", [1, 63, 64, 65, 127, 128, 129, 130, 640, 641, 1537])
def test_pieces_of_any_number_of_lines(n, n_freq, random_lines, in_file, monkeypatch):
    a = random_lines(n_freq, n)
    for piece in (1, 32 * n * n * 600):
        monkeypatch.setattr(arguments, "CHUNK_BYTES", piece)
        assert jf.invert(in_file(a)).tobytes() == jf.invert(a).tobytes()


@pytest.mark.parametrize("dtype", ["c8", "f4", "f8", "i4", "?", ">c16"])
@pytest.mark.parametrize("options", [{}, {"offset": 40}, {"offset": 3}, {"order": "F"}], ids=str)
def test_other_types_and_orders_in_files_are_converted_piece_by_piece(
    dtype, options, random_lines, in_file, small_pieces
):
    a = random_lines(700, 3)
    a = (a if "c" in dtype else np.broadcast_to(2 * np.eye(3), a.shape)).astype(dtype)
    mapped = in_file(a, dtype, **options)
    expected = jf.invert(a.astype(complex))
    assert jf.invert(mapped).tobytes() == expected.tobytes()
    assert jf.invert(mapped[::2]).tobytes() == jf.invert(a[::2].astype(complex)).tobytes()


def test_one_joint_matrix_is_not_copied_for_every_line(random_lines, monkeypatch):
    """Its lines are made piece by piece, and nothing is announced as a large copy."""
    monkeypatch.setattr(arguments, "LARGE_COPY", 1000)
    monkeypatch.setattr(arguments, "CHUNK_BYTES", 2**15)
    g, k = random_lines(900, 4), np.array([[2.0, 0.5j], [1.0, 3.0]])
    many = np.ascontiguousarray(np.broadcast_to(k, (900, 2, 2)))
    assert jf.modify(g, k, [0, 2]).tobytes() == jf.modify(g, many, [0, 2]).tobytes()


def read_only(a):
    a.flags.writeable = False
    return a


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: [[0.0]], TypeError, "out must be a numpy array, not list"),
        (lambda: np.zeros((5, 3, 3)), ValueError, "out must contain complex128, not float64"),
        (lambda: np.zeros((5, 3, 3), "c8"), ValueError, "out must contain complex128, not complex64"),
        (lambda: np.zeros((5, 3, 3), ">c16"), ValueError, "out must contain complex128, not >c16"),
        (lambda: np.zeros((4, 3, 3), complex), ValueError, r"out must have shape \(5, 3, 3\), not \(4, 3, 3\)"),
        (lambda: np.zeros((5, 9), complex), ValueError, r"out must have shape \(5, 3, 3\), not \(5, 9\)"),
        (lambda: np.zeros((5, 3, 3), complex, "F"), ValueError, "out must be contiguous in C order and aligned"),
        (lambda: np.zeros((5, 3, 6), complex)[:, :, ::2], ValueError, "out must be contiguous in C order"),
        (lambda: np.zeros(721, "b")[1:].view(complex).reshape(5, 3, 3), ValueError, "and aligned"),
        (lambda: read_only(np.zeros((5, 3, 3), complex)), ValueError, "out must be writeable"),
    ],
)
def test_an_out_that_does_not_fit_gets_one_sentence(make, error, message, random_lines):
    with pytest.raises(error, match=message):
        jf.invert(random_lines(5, 3), out=make())


def test_out_must_not_overlap_an_input(random_lines):
    memory = random_lines(10, 4)
    for out in (memory[:6], memory[3:9]):
        kept = memory.copy()
        with pytest.raises(ValueError, match=r"out must not share memory with a$"):
            jf.invert(memory[:6], out=out)
        with pytest.raises(ValueError, match=r"out must not share memory with gamma$"):
            jf.find_modification(random_lines(6, 4), memory[:6], out=out)
        assert (memory == kept).all()
    jf.invert(memory[:5], out=memory[5:])
    memory = np.zeros((3, 3, 3), complex)
    stiffness = memory.view(float).reshape(-1)[9:18].reshape(3, 3)
    with pytest.raises(ValueError, match="out must not share memory with an argument"):
        jf.receptance([1.0, 2.0, 3.0], stiffness, np.eye(3), out=memory)


@pytest.mark.parametrize("mapped", [False, True])
def test_what_out_holds_after_an_error(mapped, random_lines, in_file, small_pieces):
    """Every good line, and NaN in the bad ones; lines are counted over the whole array."""
    a = random_lines(1000, 4)
    a[[300, 877]] = 1
    a[500] = 0
    freq = np.arange(1000.0)
    expected = jf.invert(a, on_singular="nan")
    out = np.zeros_like(a)
    if mapped:
        a, out = in_file(a), in_file(out)
    message = r"invert: singular matrix in line 300 \(300 Hz\), line 500 \(500 Hz\), line 877 \(877 Hz\)"
    with pytest.raises(jf.SingularLineError, match=message) as caught:
        jf.invert(a, freq_hz=freq, out=out)
    assert caught.value.lines.tolist() == [300, 500, 877]
    np.testing.assert_array_equal(out, expected)
    assert np.flatnonzero(np.isnan(out).any(axis=(1, 2))).tolist() == [300, 500, 877]
    a[930, 1, 2] = np.nan
    with pytest.raises(ValueError, match=r"a: NaN or Inf in line 930$"):
        jf.invert(a, out=out)
    assert np.flatnonzero(np.isnan(out).any(axis=(1, 2))).tolist() == [300, 500, 877, 930]


def test_poor_lines_of_all_pieces_are_counted(random_lines, in_file, small_pieces):
    a = random_lines(1000, 2)
    a[[10, 990]] = [[1, 1], [1, 1 + 1e-13]]
    a[990, 1, 1] = 1 + 1e-14
    with pytest.warns(jf.IllConditionedWarning, match="2 of 1000 lines are ill-conditioned, worst line 990"):
        jf.invert(in_file(a))


def test_a_private_map_keeps_what_was_written(random_lines, tmp_path, small_pieces):
    """Pages of mode "c" exist in memory only: they are never given back."""
    a = random_lines(1000, 4)
    a.tofile(tmp_path / "a")
    private = np.memmap(tmp_path / "a", complex, "c", shape=a.shape)
    private *= 2
    out = np.memmap(tmp_path / "a", complex, "c", shape=a.shape)
    jf.invert(private, out=out)
    np.testing.assert_array_equal(private, 2 * a)
    np.testing.assert_array_equal(out, jf.invert(2 * a))
    np.testing.assert_array_equal(np.fromfile(tmp_path / "a", complex).reshape(a.shape), a)


MEMORY = """
import resource, sys
import numpy as np
import jointfrf as jf
from jointfrf.kernel import arguments
arguments.CHUNK_BYTES = 4 * 2**20
n_freq = 200_000
a = np.memmap(sys.argv[1], complex, "r", shape=(n_freq, 4, 4))
out = np.memmap(sys.argv[2], complex, "w+", shape=a.shape)
jf.invert(a[:1000])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
jf.couple(a[:, :2, :2], a[:, 2:, 2:], np.eye(1), [0], [0], out=out)
jf.invert(a, out=out)
print(a.nbytes, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="ru_maxrss is in KiB on Linux")
def test_memory_stays_bounded(random_lines, tmp_path):
    one = random_lines(2000, 4)
    with open(tmp_path / "in", "wb") as file:
        for _ in range(100):
            one.tofile(file)
    command = [sys.executable, "-c", MEMORY, tmp_path / "in", tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert not done.stderr
    size, grown = (int(word) for word in done.stdout.split())
    assert size == 200_000 * 256
    assert grown < 24 * 2**20
    result = np.fromfile(tmp_path / "out", complex).reshape(100, *one.shape)
    np.testing.assert_array_equal(result[57], result[56])
    np.testing.assert_allclose(result[99], np.linalg.inv(one), rtol=1e-9)
