"""What is wrong with the words on the command line, and types of them."""

from __future__ import annotations

import argparse

__all__ = ["UsageError", "positive"]


class UsageError(Exception):
    """A wrong word on the command line."""


def positive(word: str) -> int:
    """Return a whole number of at least 1."""
    if not word.isdecimal() or int(word) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number, at least 1, not {word!r}")
    return int(word)
