"""No regular expression of the package takes long with any text that a file may hold."""

import re

import pytest

from regular_expressions import Expression, expressions, seconds, slowest

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
    """As many as the sources have, in all the rooms that have some."""
    rooms = {one.where.split(",")[0].split(".")[1] for one in EXPRESSIONS}
    assert {"io", "frf", "cli", "report", "files"} <= rooms
    assert len(EXPRESSIONS) > 40
