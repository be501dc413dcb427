"""What commands share: errors of usage, what they print, types of words, progress."""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from jointfrf.spelling import visible

__all__ = [
    "OptionWarning",
    "Output",
    "UsageError",
    "check_folder",
    "check_out",
    "complain",
    "in_options",
    "plain",
    "positive",
    "progress",
    "time_left",
    "waiting",
    "warn_of_ignored",
]

#: Seconds after which the speed so far predicts the time left; a line that changes twice a second is easily read.
_SETTLED = 0.5


class UsageError(Exception):
    """A wrong word on the command line."""


class OptionWarning(UserWarning):
    """A word on the command line without effect."""


#: What messages of the library call its arguments, and what stands for it on the command line.
_WORDS = tuple(
    (re.compile(python), option)
    for python, option in (
        (r"\bsay (\w+)= by mapping", r"say --map \1=..."),
        (r"\bor (\w+)= by mapping", r"or --map \1=..."),
        (r"\b(by|of) mapping\b", r"\1 --map"),
        (r"\bmapping names\b", "--map names"),
        (r"\bgive axes=", "give --map axes="),
        (r"\bgive quantity=", "give --quantity"),
        (r"\bleave the quantity out, or force it", "leave --quantity out, or say --force-quantity"),
        (r"\blimit_gb=, --limit-gb", "--limit-gb"),
        (r"\bwindow_decay\b", "--window-decay"),
        (r"^gamma ", "gamma, the FRFs between all joint DOFs, "),
        (r"\bgive models of these to identify_model\b", "name models of these by --model"),
        (r"\bset accept=\['([\w-]+)'\]", r"say --accept \1"),
        (r"\bset accept=\['([\w-]+)', '([\w-]+)'\]", r"say --accept \1 --accept \2"),
        (r"\(check_frfs\), at transform,", "(jointfrf check), at --at and --channels,"),
    )
)


def complain(kind: str, message: object) -> None:
    """Print a warning or an error as one line that does nothing to a terminal: the name of a file may hold anything."""
    print(f"jointfrf: {kind}: {visible(in_options(str(message)))}", file=sys.stderr)


def in_options(text: str) -> str:
    """Return a message of the library with options of the command line for arguments of functions."""
    for python, option in _WORDS:
        text = python.sub(option, text)
    return text


def warn_of_ignored(args: argparse.Namespace, names: Iterable[str], why: str) -> None:
    """Warn of options that were given and have no effect."""
    found = [name for name in names if name.removeprefix("--").replace("-", "_") in args.given]
    if found:
        verb = "have" if found[1:] else "has"
        warnings.warn(f"{' and '.join(found)} {verb} no effect: {why}", OptionWarning, stacklevel=2)


class Output:
    """Where the text and the numbers of a command go, by its options `--json` and `--quiet`."""

    def __init__(self, args: argparse.Namespace) -> None:
        self._is_json: bool = args.json
        self._is_quiet: bool = args.quiet
        self._warned: list[str] = args.warned

    def say(self, *lines: object) -> None:
        """Print lines of text, unless JSON or nothing is wanted."""
        if lines and not (self._is_json or self._is_quiet):
            print(*(visible(str(line), "\n\t") for line in lines), sep="\n", flush=True)

    def warn(self, *texts: object) -> None:
        """Note warnings that are part of the text: for the JSON, or to be printed where nothing else is."""
        self._warned += map(str, texts)
        for text in texts if self._is_quiet and not self._is_json else ():
            complain("warning", text)

    def give(self, content: Mapping[str, Any]) -> None:
        """Print the result as JSON where that is wanted, with all warnings at its top level."""
        if self._is_json:
            warned = [in_options(str(text)) for text in (*content.get("warnings", ()), *self._warned)]
            whole = {**content, "warnings": list(dict.fromkeys(warned))}
            print(json.dumps(plain(whole), indent=2, allow_nan=False))


def plain(value: Any) -> Any:
    """Return a value as JSON holds it: what is not finite becomes null, a complex number a pair."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):  # arrays and numbers of numpy
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, str | int | None) else str(value)


def check_folder(option: str, path: Path | None) -> None:
    """Check, before anything is computed, that a file can be written there.

    Raises
    ------
    UsageError
        There is no such folder, or the path is a folder.
    """
    if path is not None and not path.parent.is_dir():
        raise UsageError(f"{option}: there is no folder {path.parent}")
    if path is not None and path.is_dir():
        raise UsageError(f"{option}: {path} is a folder, not a file")


def check_out(option: str, path: Path | None) -> None:
    """Check, before anything is computed, that a folder can be made there.

    Raises
    ------
    UsageError
        It, or a folder above it, is a file.
    """
    above = [] if path is None else [path, *path.parents]
    there = next((one for one in above if one.exists() or one.is_symlink()), None)
    if there is not None and not there.is_dir():
        raise UsageError(f"{option}: {there} is a file, not a folder")


def positive(word: str, least: int = 1) -> int:
    """Return a whole number of at least 1, or another least one."""
    if not word.isdecimal() or int(word) < least:
        raise argparse.ArgumentTypeError(f"must be a whole number, at least {least}, not {word!r}")
    return int(word)


def _on_its_line(text: str) -> None:
    """Write over the last line of the terminal."""
    print(f"\r\x1b[K{visible(text)}", end="", file=sys.stderr, flush=True)


def progress(name: str) -> Callable[[int, int], None]:
    """Return a counter in one line of a terminal, with the time that is left; silent elsewhere.

    Calls may come from several threads, in another order than their counts: what was shown is never taken back.
    """
    if not sys.stderr.isatty():
        return lambda done, total: None
    start, lock = time.monotonic(), threading.Lock()
    furthest = 0.0

    def show(done: int, total: int) -> None:
        nonlocal furthest
        with lock:
            if done == total:
                _on_its_line("")
                furthest = 0.0
            elif done / total >= furthest:
                furthest = done / total
                _on_its_line(f"{name}: {100 * done // total} %{time_left(time.monotonic() - start, done, total)}")

    return show


def time_left(spent: float, done: int, total: int) -> str:
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
            _on_its_line(f"{what}: {time.monotonic() - start:.0f} s")

    clock = threading.Thread(target=show, daemon=True)
    clock.start()
    try:
        yield
    finally:
        done.set()
        clock.join()
        _on_its_line("")
