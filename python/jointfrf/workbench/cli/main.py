"""The command `jointfrf`, and what a terminal may do to it: interrupt it, or close what it prints to."""

from __future__ import annotations

import io
import os
import shlex
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext, redirect_stderr, redirect_stdout
from importlib import import_module
from types import FrameType
from typing import Any, TextIO, cast

from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.configuration import with_configuration
from jointfrf.workbench.cli.parser import COMMANDS, command_parser, top_parser
from jointfrf.workbench.cli.progress import shown_progress
from jointfrf.workbench.cli.usage import EXPECTED, UsageError, complain, sentence, shown_warnings

__all__ = ["main"]

#: Exit statuses: as argparse has it, any other error, and as shells have it after Ctrl-C.
_USAGE_ERROR, _FAILURE, _INTERRUPTED = 2, 1, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after `jointfrf`; the words of the process by default.

    Returns
    -------
    int
        0 good, 1 something in the data or the files is wrong, 2 wrong usage, 130 interrupted.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    with _read_or_not():
        return _answer(words)


def _answer(words: list[str]) -> int:
    """Run a command; what goes wrong is one sentence."""
    try:
        if not words:
            top_parser()[0].print_help(sys.stderr)
            return _USAGE_ERROR
        if words[0].startswith("-"):
            top_parser()[0].parse_words(words)  # prints help, version or what is wrong, and ends
        with _interrupts() as stop_if_interrupted:
            status = _run(words, stop_if_interrupted)
        sys.stdout.flush()
        return status
    except EXPECTED as error:
        complain("error", sentence(error))
        return _USAGE_ERROR if isinstance(error, UsageError) else _FAILURE
    except KeyboardInterrupt:
        complain("error", "interrupted")
        return _INTERRUPTED


def _run(words: list[str], stop_if_interrupted: Callable[[], None]) -> int:
    """Run one command."""
    name = words[0]
    if name not in COMMANDS:
        hint = did_you_mean(name, COMMANDS) or "; see jointfrf --help"
        raise UsageError(f"unknown command {name!r}{hint}")
    parser = command_parser(name)
    found = parser.parse_words(words[1:])
    typed, warned = shlex.join(["jointfrf", *words]), list[str]()
    with shown_warnings(warned), _limited(found.limit_gb):
        args = parser.arguments_of(
            with_configuration(found, parser, name), typed=typed, warned=warned, stop_if_interrupted=stop_if_interrupted
        )
        args.check_files()
        command = import_module(f"jointfrf.workbench.cli.{name}")
        stop_if_interrupted()
        with nullcontext() if args.quiet else shown_progress(name):
            status: int = command.run(args)
        return status


@contextmanager
def _limited(limit_gb: float | None) -> Iterator[None]:
    """Set the limit of what is read, for this process and those that it starts."""
    if limit_gb is None:
        yield
        return
    from jointfrf.files import LIMIT_VARIABLE

    before = os.environ.get(LIMIT_VARIABLE)
    os.environ[LIMIT_VARIABLE] = repr(limit_gb)
    try:
        yield
    finally:
        del os.environ[LIMIT_VARIABLE]
        if before is not None:
            os.environ[LIMIT_VARIABLE] = before


if __name__ == "__main__":
    sys.exit(main())


@contextmanager
def _interrupts() -> Iterator[Callable[[], None]]:
    """Raise KeyboardInterrupt after Ctrl-C, also where what it cuts short, such as an import, calls it otherwise.

    Where an import goes on, since only a callback was cut short, the function that is yielded raises it.
    """
    have_come = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal have_come
        have_come = True
        raise KeyboardInterrupt

    def stop_if_interrupted() -> None:
        if have_come:
            raise KeyboardInterrupt

    def note_unraisable(found: sys.UnraisableHookArgs) -> None:
        if not isinstance(found.exc_value, KeyboardInterrupt):
            before(found)

    # Another handler, or none (a shell starts what runs in its background so), is left as it is.
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    own, before = is_usual and threading.current_thread() is threading.main_thread(), sys.unraisablehook
    if own:
        signal.signal(signal.SIGINT, note)
        sys.unraisablehook = note_unraisable
    try:
        yield stop_if_interrupted
    except Exception as error:
        if have_come:
            raise KeyboardInterrupt from error
        raise
    finally:
        if own:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sys.unraisablehook = before


@contextmanager
def _read_or_not() -> Iterator[None]:
    """Let a command go on where nobody reads any more what it prints, so that its files are written all the same."""
    with ExitStack() as stack:
        for name, redirect in (("stdout", redirect_stdout), ("stderr", redirect_stderr)):
            stream = getattr(sys, name)
            if stream is None:  # closed before the start: print() would raise an error, or use the other stream
                stream = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
            elif isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
                # Names of files have characters that the encoding of a pipe, as on Windows, may lack.
                stream.reconfigure(errors="backslashreplace")
            stack.enter_context(redirect(cast(TextIO, _Stream(stream))))
        yield


class _Stream:
    """A stream of text that drops what its reader, gone away (`jointfrf cases | head`), no longer takes."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._drop()
            return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._drop()

    def _drop(self) -> None:
        """Send what follows, and what is left in the buffer, to nowhere."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)
