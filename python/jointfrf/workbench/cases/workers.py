"""Processes that share the work of cases, of which several are under way at the same time."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from threading import Lock
from typing import Any, TypeVar

from jointfrf.parallel.pool import started_processes

__all__ = ["RankedProcesses", "Workers", "silent", "started_workers"]

_T = TypeVar("_T")
#: What limits the threads of the libraries that a process calls.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
#: Tasks that are handed out, for each process: none of them waits for the next.
_HANDED_OUT = 2


def silent(done: int, total: int) -> None:
    """Show no progress."""


class RankedProcesses:
    """Processes that do the tasks of the lowest rank first, those of one rank in the order they come in.

    Parameters
    ----------
    jobs : int
        How many; each computes on one thread, since two pools of threads on the same cores slow each other down.
    """

    def __init__(self, jobs: int) -> None:
        self._processes = started_processes(jobs, dict.fromkeys(_THREADS, "1"))
        self._free = _HANDED_OUT * jobs
        self._waiting: list[tuple[int, int, Future[Any], Callable[..., Any], tuple[Any, ...]]] = []
        self._numbers, self._lock = count(), Lock()

    def submit(self, rank: int, function: Callable[..., _T], *arguments: Any) -> Future[_T]:
        """Call a function in one of the processes, as soon as no task of a lower rank waits."""
        future: Future[_T] = Future()
        with self._lock:
            heapq.heappush(self._waiting, (rank, next(self._numbers), future, function, arguments))
        self._hand_out()
        return future

    def shutdown(self) -> None:
        """End the processes when the tasks at work are done; those that wait are cancelled."""
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for _, _, future, _, _ in waiting:
            if future.cancel():
                future.set_running_or_notify_cancel()  # wakes those that wait for it
        self._processes.shutdown(cancel_futures=True)

    def _hand_out(self) -> None:
        while True:
            with self._lock:
                if not (self._free and self._waiting):
                    return
                _, _, future, function, arguments = heapq.heappop(self._waiting)
                if not future.set_running_or_notify_cancel():
                    continue
                self._free -= 1
            try:
                inner = self._processes.submit(function, *arguments)
            except RuntimeError as error:  # processes that died, or have been shut down
                self._pass_on(future, error=error)
            else:
                inner.add_done_callback(lambda done, future=future: self._finish(future, done))  # type: ignore[misc]

    def _finish(self, future: Future[Any], inner: Future[Any]) -> None:
        if inner.cancelled():
            self._pass_on(future, error=CancelledError())
        elif (error := inner.exception()) is not None:
            self._pass_on(future, error=error)
        else:
            self._pass_on(future, inner.result())
        self._hand_out()

    def _pass_on(self, future: Future[Any], result: Any = None, error: BaseException | None = None) -> None:
        with self._lock:
            self._free += 1
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)


@dataclass(frozen=True)
class Workers:
    """Where the parts of a computation run, and what reports how many are done.

    Attributes
    ----------
    pool : RankedProcesses or None
        Processes; None for this one.
    progress : callable
        Called with the numbers of parts done and in all.
    rank : int
        Of the computation among others that share the processes: the lowest is done first.
    turn : Lock
        Threads of this process that compute, one for each of the computations that share the processes, take turns:
        a thread holds it while it computes and lets go of it while it waits for processes. What holds for the whole
        process, such as filters of warnings, is then never changed by two.
    """

    pool: RankedProcesses | None = None
    progress: Callable[[int, int], None] = silent
    rank: int = 0
    turn: Lock | None = field(default=None, compare=False)

    def map(self, function: Callable[..., _T], *arguments: Iterable[Any]) -> Iterator[_T]:
        """Call a function for each set of arguments; results come in order, without processes one at a time."""
        if self.pool is None:
            return map(function, *arguments)
        pool, rank = self.pool, self.rank
        return self._results(deque(pool.submit(rank, function, *each) for each in zip(*arguments, strict=False)))

    def begin(self, function: Callable[..., _T], *arguments: Any) -> Callable[[], _T]:
        """Call a function and go on; return what waits for its result, and without processes computes it then."""
        results = self.map(function, *([one] for one in arguments))
        return lambda: next(results)

    def counted(self, parts: Iterable[_T], total: int) -> Iterator[_T]:
        """Pass parts on and report the progress."""
        for done, part in enumerate(parts, 1):
            yield part
            self.progress(done, total)

    def _results(self, futures: deque[Future[_T]]) -> Iterator[_T]:
        """Give results in order; each is forgotten here when it is given."""
        try:
            while futures:
                self._wait(futures[0])
                yield futures.popleft().result()
        finally:
            for future in futures:
                future.cancel()

    def _wait(self, future: Future[Any]) -> None:
        """Let others compute while a result is not there."""
        if self.turn is None or future.done():
            wait([future])
            return
        self.turn.release()
        try:
            wait([future])
        finally:
            self.turn.acquire()


@contextmanager
def started_workers(jobs: int) -> Iterator[Workers]:
    """Start processes; with one job all is computed in this process."""
    if jobs <= 1:
        yield Workers()
        return
    pool = RankedProcesses(jobs)
    try:
        yield Workers(pool)
    finally:
        pool.shutdown()
