"""What a terminal or a shell may do to a command: interrupt it, or close what it prints to."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from types import FrameType
from typing import Any, TextIO, cast

__all__ = ["interrupts", "read_or_not"]


@contextmanager
def interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt after Ctrl-C, also where what it cuts short, such as an import, calls it otherwise."""
    have_come = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal have_come
        have_come = True
        raise KeyboardInterrupt

    # Another handler, or none (a shell starts what runs in its background so), is left as it is.
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    own = is_usual and threading.current_thread() is threading.main_thread()
    if own:
        signal.signal(signal.SIGINT, note)
    try:
        yield
    except Exception as error:
        if have_come:
            raise KeyboardInterrupt from error
        raise
    finally:
        if own:
            signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def read_or_not() -> Iterator[None]:
    """Let a command go on where nobody reads any more what it prints, so that its files are written all the same."""
    with ExitStack() as stack:
        for name, redirect in (("stdout", redirect_stdout), ("stderr", redirect_stderr)):
            stream = getattr(sys, name)
            if stream is None:  # closed before the start: print() would raise an error, or use the other stream
                stream = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
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
