"""What commands share: what is wrong with words, their types, processes and progress."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable

__all__ = ["UsageError", "available_cores", "positive", "progress"]


class UsageError(Exception):
    """A wrong word on the command line."""


def positive(word: str) -> int:
    """Return a whole number of at least 1."""
    if not word.isdecimal() or int(word) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number, at least 1, not {word!r}")
    return int(word)


def available_cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def progress(name: str) -> Callable[[int, int], None]:
    """Return a counter in one line of a terminal; silent elsewhere."""
    if not sys.stderr.isatty():
        return lambda done, total: None

    def show(done: int, total: int) -> None:
        end = "\r\x1b[K" if done == total else ""
        print(f"\r{name}: {100 * done // total} %{end}", end="", file=sys.stderr, flush=True)

    return show
