"""Where datasets begin and end: the same in windows of any size as by a search through the whole file."""

import random
import re
import tracemalloc

import numpy as np
import pytest

from jointfrf.io import read_uff, uff_file
from jointfrf.io.uff_file import index_datasets
from uff_writer import VALUES, dataset, function, units

DELIMITER = b"    -1"


def whole(content: bytes) -> tuple[list[tuple[int, int]], bool]:
    """Places of the datasets of a file without binary numbers."""
    places = [match.start() for match in re.finditer(rb"(?:(?<=\n)|(?<=\r)|\A) {0,5}-1 *(?=[\r\n]|\Z)", content)]
    return list(zip(places[::2], places[1::2], strict=False)), len(places) % 2 == 1


@pytest.mark.parametrize("chunk", [300, 301, 307, 1000, 1 << 20])
def test_windows_of_any_size_find_the_same(tmp_path, monkeypatch, chunk):
    monkeypatch.setattr(uff_file, "_CHUNK", chunk)
    monkeypatch.setattr(uff_file, "HEAD", 200)
    chance = random.Random(chunk)
    for _ in range(60):
        lines = [
            chance.choice([DELIMITER, DELIMITER, b"    58", b"x" * chance.randrange(120), b"    -1   ", b"a    -1",
                           DELIMITER + 74 * b" ", b"       -1"])
            for _ in range(chance.randrange(60))
        ]  # fmt: skip
        content = chance.choice([b"\n", b"\r\n"]).join(lines) + chance.choice([b"", b"\n"])
        path = tmp_path / "test.uff"
        path.write_bytes(content)
        found, is_cut = index_datasets(path)
        assert ([(each.start, each.end) for each in found], is_cut) == whole(content)


def test_a_delimiter_among_binary_numbers_is_none(tmp_path):
    disguised = np.frombuffer(6 * b"\n    -1\n", dtype="<c16")
    path = tmp_path / "test.uff"
    path.write_bytes(function(disguised, binary=True) + function(response=(2, 2)))
    assert [each.kind for each in index_datasets(path)[0]] == [58, 58]
    np.testing.assert_array_equal(read_uff(path).h[:, 0, 0], disguised)


@pytest.mark.parametrize("stated", [b"           0", b"          47", b"  999999999 ", b"          -1"])
def test_a_wrong_number_of_bytes_is_no_harm(tmp_path, stated):
    path = tmp_path / "test.uff"
    path.write_bytes(function(binary=True).replace(b"          48\n", stated + b"\n") + function(response=(2, 2)))
    assert [each.kind for each in index_datasets(path)[0]] == [58, 58]
    np.testing.assert_array_equal(read_uff(path).h[:, 0, 0], VALUES)


def test_only_what_is_wanted_is_held_in_memory(tmp_path):
    """A file of 40 MB, 16 of 1600 FRFs wanted: less than a quarter of it is ever held."""
    freq_hz, path = np.arange(1.0, 1601.0), tmp_path / "large.uff"
    block = function(np.ones(1600, complex), freq_hz, response=(777777, 1), reference=(888888, 1), binary=True)
    with path.open("wb") as file:
        file.write(units(1.0, 1.0).encode())
        for response in range(1, 41):
            for reference in range(1, 41):
                numbered = block.replace(b"    777777", b"%10d" % response).replace(b"    888888", b"%10d" % reference)
                file.write(numbered)
    assert path.stat().st_size > 40e6
    tracemalloc.start()
    frfs = read_uff(path, nodes={3, 5, 7, 11})
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert frfs.h.shape == (1600, 4, 4)
    assert frfs.measured.all()
    assert peak < 10e6


def test_a_dataset_without_a_type_is_found_as_such(tmp_path):
    path = tmp_path / "test.uff"
    path.write_text(dataset(58).replace("    58", "  text"))
    assert index_datasets(path)[0][0].kind == 0
