"""No reader takes long with a small file, no regular expression of the package with any text that a file may hold."""

import re
import time

import numpy as np
import pytest

from jointfrf.errors import FileContentError
from jointfrf.io import read_channel_table, read_frfs
from packages import package_of
from regular_expressions import Expression, expressions, seconds, slowest
from uff_writer import function, nodes_2411, units

EXPRESSIONS = expressions()
#: Characters of a text, and the processor time that an expression may take with it, s.
LENGTH, MOST_SECONDS = 100_000, 0.5
#: Lengths at which powers of two show, without taking hours.
SHORT = (9, 14, 20)


def longest(one):
    """Return the longest processor time over growing texts, s, with the text; it ends where that is too long."""
    texts, timed = slowest(one, SHORT[0]), []
    for count, kept in (
        (SHORT[1], 400),
        (SHORT[2], 80),
        (50, 40),
        (400, 24),
        (1500, 8),
        (6000, 4),
        (25_000, 3),
        (LENGTH, 2),
    ):
        timed = []
        for text in reversed(texts[-kept:]):
            timed.append((seconds(one, text, count), text))
            if timed[-1][0] > (MOST_SECONDS if count > 1500 else MOST_SECONDS / 10):
                return MOST_SECONDS + timed[-1][0], text
        texts = [text for _, text in sorted(timed)]
    return max(timed)


@pytest.mark.parametrize("one", EXPRESSIONS, ids=lambda one: one.where)
def test_an_expression_takes_time_in_proportion_to_its_text(one):
    taken, text = longest(one)
    assert taken < MOST_SECONDS, f"{one.where}: {one.pattern.pattern!r} takes {taken:.2g} s with {text}"


@pytest.mark.parametrize("pattern", [r"\s*(\w+)\s*(?:\[a\])?\s*", r"(?:a+)+b", r"[^\s/]*?\d+x", r"\[([^\]]*)\]"])
def test_slow_expressions_are_found(pattern):
    """Squares, cubes and powers of the length."""
    one = Expression("here", re.compile(pattern), ("search", "fullmatch"))
    assert longest(one)[0] > MOST_SECONDS


def test_all_expressions_are_found():
    """As many as the sources have, in all packages that have some."""
    found = {package_of(one.where.split(",")[0]) for one in EXPRESSIONS}
    assert {"io", "frf", "files", "workbench.cli", "workbench.report"} <= found
    assert len(EXPRESSIONS) > 40


def processor_time(call, *arguments, **keywords):
    """Return the shortest processor time of two calls, s, and what the call returns."""
    times = []
    for _ in range(2):
        start = time.process_time()
        found = call(*arguments, **keywords)
        times.append(time.process_time() - start)
    return min(times), found


@pytest.mark.filterwarnings("ignore::jointfrf.errors.FileContentWarning")
@pytest.mark.parametrize("of", ["nodes", "units and functions", "functions", "channels"])
def test_files_of_many_parts_take_time_in_proportion(tmp_path, of):
    """Four times as many datasets or names take at most seven times as long: sixteen times if each looks at all."""
    path = tmp_path / "a"

    def write(count):
        if of == "channels":
            names = [f"{number}:x" for number in range(1, 10 * count + 1)]
            np.savez(path.with_suffix(".npz"), f=[1.0], h=np.ones((1, 10 * count, 1)), responses=names,
                     excitations=["1:x"], unit="m/N")  # fmt: skip
            return path.with_suffix(".npz")
        parts = {
            "nodes": [units(1, 1).encode(), count * nodes_2411({1: (1.0, 2.0, 3.0)}).encode(), function()],
            "units and functions": [count * (units(1, 1).encode() + function())],
            "functions": [function(response=(number, 2)) for number in range(1, count + 1)],
        }
        path.write_bytes(b"".join(parts[of]))
        return path

    few, _ = processor_time(read_frfs, write(1500))
    many, found = processor_time(read_frfs, write(6000))
    assert found.measured.any()
    assert many < 7 * few + 0.2


def test_headings_of_many_letters_are_answered_at_once(tmp_path):
    path = tmp_path / "a.csv"
    for heading in (
        50_000 * "1",
        50_000 * "1 ",
        "1:x" + 50_000 * " ",
        50_000 * "[",
        50_000 * "m",
        "channel" + 50_000 * " ",
    ):
        path.write_text(f"frequency [Hz],{heading}!\n1,2\n2,3\n")
        for read in (read_frfs, read_channel_table):
            start = time.process_time()
            with pytest.raises(FileContentError) as caught:
                read(path)
            assert time.process_time() - start < MOST_SECONDS
            assert len(str(caught.value)) <= 2000
