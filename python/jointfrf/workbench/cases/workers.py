"""Worker processes for several cases at the same time."""

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
#: Environment variables that limit the threads of numerical libraries.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
#: Number of submitted tasks for each process, so that no process waits for its next task.
_HANDED_OUT = 2


def silent(done: int, total: int) -> None:
    """Show no progress."""


class RankedProcesses:
    """Processes that run tasks in the order of their rank, lowest first; tasks of equal rank in order of submission.

    Parameters
    ----------
    jobs : int
        Number of processes. Each process uses one thread, because thread pools on the same cores slow each other down.

    See Also
    --------
    started_workers : Processes in a context.
    """

    def __init__(self, jobs: int) -> None:
        self._processes = started_processes(jobs, dict.fromkeys(_THREADS, "1"))
        self._free = _HANDED_OUT * jobs
        self._waiting: list[tuple[int, int, Future[Any], Callable[..., Any], tuple[Any, ...]]] = []
        self._numbers, self._lock = count(), Lock()

    def submit(self, rank: int, function: Callable[..., _T], *arguments: Any) -> Future[_T]:
        """Return the future of a function call in one of the processes; tasks of lower rank run first."""
        future: Future[_T] = Future()
        with self._lock:
            heapq.heappush(self._waiting, (rank, next(self._numbers), future, function, arguments))
        self._hand_out()
        return future

    def shutdown(self) -> None:
        """End the processes after their current tasks; cancel waiting tasks."""
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
    """Processes for the parts of a computation, and a function that reports progress.

    Attributes
    ----------
    pool : RankedProcesses or None
        Worker processes; None (default) runs all parts in this process.
    progress : callable
        Function called with the number of completed parts and the number of all parts.
    rank : int
        Rank of the computation among all computations with the same processes, default 0; the lowest runs first.
    turn : Lock or None
        Lock of the threads of this process, if several computations use the same processes. A thread owns the lock
        while it computes, and releases it while it waits for a process. Global state of the process, such as filters of
        warnings, is therefore changed by one thread at a time.

    See Also
    --------
    started_workers : Workers in a context.
    """

    pool: RankedProcesses | None = None
    progress: Callable[[int, int], None] = silent
    rank: int = 0
    turn: Lock | None = field(default=None, compare=False)

    def map(self, function: Callable[..., _T], *arguments: Iterable[Any]) -> Iterator[_T]:
        """Return the results of a function for each set of arguments, in order."""
        if self.pool is None:
            return map(function, *arguments)
        pool, rank = self.pool, self.rank
        return self._results(deque(pool.submit(rank, function, *each) for each in zip(*arguments, strict=False)))

    def begin(self, function: Callable[..., _T], *arguments: Any) -> Callable[[], _T]:
        """Start a function call and return a function that waits for its result (without processes: computes it)."""
        results = self.map(function, *([one] for one in arguments))
        return lambda: next(results)

    def counted(self, parts: Iterable[_T], total: int) -> Iterator[_T]:
        """Yield parts and report the progress."""
        for done, part in enumerate(parts, 1):
            yield part
            self.progress(done, total)

    def _results(self, futures: deque[Future[_T]]) -> Iterator[_T]:
        """Yield results in order, and drop each result after it is yielded."""
        try:
            while futures:
                self._wait(futures[0])
                yield futures.popleft().result()
        finally:
            for future in futures:
                future.cancel()

    def _wait(self, future: Future[Any]) -> None:
        """Wait for a result; other threads compute meanwhile."""
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
    """Yield workers with a number of processes; one job runs in this process."""
    if jobs <= 1:
        yield Workers()
        return
    pool = RankedProcesses(jobs)
    try:
        yield Workers(pool)
    finally:
        pool.shutdown()
