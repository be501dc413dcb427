"""What commands share: what is wrong with words, their types, processes and progress."""

from __future__ import annotations

import argparse
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from jointfrf.spelling import visible

__all__ = ["UsageError", "check_folder", "positive", "progress", "waiting"]

#: Seconds after which the speed so far says something.
_SETTLED = 0.5


class UsageError(Exception):
    """A wrong word on the command line."""


def check_folder(option: str, path: Path | None) -> None:
    """Check, before anything is computed, that a file can be written there.

    Raises
    ------
    UsageError
        There is no such folder, or the path is a folder.
    """
    if path is None:
        return
    if not path.parent.is_dir():
        raise UsageError(f"{option}: there is no folder {path.parent}")
    if path.is_dir():
        raise UsageError(f"{option}: {path} is a folder, not a file")


def positive(word: str) -> int:
    """Return a whole number of at least 1."""
    if not word.isdecimal() or int(word) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number, at least 1, not {word!r}")
    return int(word)


def progress(name: str) -> Callable[[int, int], None]:
    """Return a counter in one line of a terminal, with the time that is left; silent elsewhere."""
    if not sys.stderr.isatty():
        return lambda done, total: None
    start = time.monotonic()

    def show(done: int, total: int) -> None:
        if done == total:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
            return
        left = _time_left(time.monotonic() - start, done, total)
        print(f"\r\x1b[K{visible(name)}: {100 * done // total} %{left}", end="", file=sys.stderr, flush=True)

    return show


def _time_left(spent: float, done: int, total: int) -> str:
    """Say how long it will take at the speed so far, where that is known."""
    if done == 0 or spent < _SETTLED:
        return ""
    left = spent * (total - done) / done
    return f", about {left:.0f} s left" if left < 90 else f", about {left / 60:.0f} min left"


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """Show in one line of a terminal how long something has taken so far; silent elsewhere."""
    if not sys.stderr.isatty():
        yield
        return
    start, done = time.monotonic(), threading.Event()

    def show() -> None:
        while not done.wait(_SETTLED):
            print(f"\r\x1b[K{visible(what)}: {time.monotonic() - start:.0f} s", end="", file=sys.stderr, flush=True)

    clock = threading.Thread(target=show, daemon=True)
    clock.start()
    try:
        yield
    finally:
        done.set()
        clock.join()
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)
