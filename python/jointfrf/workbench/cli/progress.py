"""Progress of a command on standard error: the stage under way, the finished share, the time left."""

from __future__ import annotations

import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from jointfrf.spelling import visible

__all__ = ["clear_line", "shown_progress", "waiting"]

#: Seconds after which the speed so far predicts the time left; a line that changes twice a second is easily read.
_SETTLED = 0.5
#: Seconds to the first line of progress on a stream that is no terminal, and between lines; characters of a bar.
FIRST_LINE, _NEXT_LINE, _BAR = 3.0, 10.0, 20


class _Stage:
    """A part of a command that takes time, and how much of it is done."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.start = self._counted_from = self._counted_at = time.monotonic()
        self._done, self._total = 0, 0

    def count(self, done: int, total: int) -> None:
        """Note how much is done; a part is finished when all is, and the next one may begin.

        Calls may come from several threads, in another order than their counts: progress is never taken back.
        """
        with _LOCK:
            self._counted_at = time.monotonic()
            if done == total:
                self._counted_from, self._done, self._total = self._counted_at, 0, 0
            elif done * self._total >= self._done * total:
                self._done, self._total = done, total

    @property
    def share(self) -> float | None:
        """Finished share of the stage; None if nothing counts."""
        return self._done / self._total if self._total else None

    def left(self, now: float) -> str:
        """Return the finished share, and the time left at the speed until the last count, after some counts."""
        if self.share is None:
            return ""
        spent = self._counted_at - self._counted_from
        text = f", {100 * self.share:.0f} %"
        if self._done == 0 or spent < _SETTLED:
            return text
        left = max(0.0, spent * (self._total - self._done) / self._done - (now - self._counted_at))
        return f"{text}, about {left:.0f} s left" if left < 90 else f"{text}, about {left / 60:.0f} min left"


#: The stages under way, each within the one before it.
_STAGES: list[_Stage] = []
_LOCK = threading.RLock()


class _Line:
    """The line of a terminal that shows the progress: other text takes its place."""

    is_there = False

    def write(self, text: str) -> None:
        with _LOCK:
            line = f"\r\x1b[K{visible(text)}"[: 3 + shutil.get_terminal_size().columns]
            print(line, end="", file=sys.stderr, flush=True)
            self.is_there = bool(text)

    def clear(self) -> None:
        if self.is_there:
            self.write("")


_LINE = _Line()
clear_line = _LINE.clear


def _progress_text(now: float, *, bar: bool) -> str:
    """Return the innermost stage with its time, and the share of the innermost stage that counts."""
    with _LOCK:
        stages = _STAGES[:]
    counted = next((one for one in reversed(stages) if one.share is not None), None)
    text = f"{stages[-1].name}: {now - stages[-1].start:.0f} s"
    if counted is None:
        return text
    filled = "#" * int(_BAR * (counted.share or 0.0))
    return f"{f'[{filled:-<{_BAR}}] ' if bar else ''}{text}{counted.left(now)}"


def _show_progress(ended: threading.Event) -> None:
    """Show the current stage: always on a terminal, otherwise by a line at intervals."""
    shown = time.monotonic() + FIRST_LINE - _NEXT_LINE
    is_terminal = sys.stderr.isatty()
    while not ended.wait(_SETTLED):
        now = time.monotonic()
        if is_terminal:
            _LINE.write(_progress_text(now, bar=True))
        elif now - shown >= _NEXT_LINE:
            shown = now
            print(f"jointfrf: {visible(_progress_text(now, bar=False))}", file=sys.stderr, flush=True)


@contextmanager
def shown_progress(command: str) -> Iterator[None]:
    """Show what takes time inside, on standard error, until the end."""
    ended = threading.Event()
    clock = threading.Thread(target=_show_progress, args=(ended,), daemon=True)
    with waiting(command):
        clock.start()
        try:
            yield
        finally:
            ended.set()
            clock.join()
            clear_line()


@contextmanager
def waiting(stage: str) -> Iterator[Callable[[int, int], None]]:
    """Name the stage of a command that is under way; yields what takes the number done and their total."""
    found = _Stage(stage)
    with _LOCK:
        _STAGES.append(found)
    try:
        yield found.count
    finally:
        with _LOCK:
            _STAGES.remove(found)
