"""Tasks on any executor of `concurrent.futures`, a few of them at a time, results as they come."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

from jointfrf.kernel.arguments import as_integer
from jointfrf.parallel.processes import available_cores, can_start_processes, started_processes

__all__ = ["AnyExecutor", "BrokenPoolError", "Pool", "check_progress", "opened_pool"]

_T = TypeVar("_T")
_R = TypeVar("_R")
#: An executor, or what makes one: that is called again where the executor breaks.
AnyExecutor = Executor | Callable[[], Executor]
#: Tasks submitted and not done, for each worker: one at work, and one so that it need not wait for the next.
_WAITING = 2
#: Times in a row, without a task done in between, that a broken executor is replaced.
_MADE_AGAIN = 3


class BrokenPoolError(RuntimeError):
    """An executor has lost its workers."""


def _lost() -> tuple[type[BaseException], ...]:
    """Return the errors that mean lost workers, not an error of the task."""
    dask = sys.modules.get("distributed")  # whose errors are not those of concurrent.futures
    own = () if dask is None else (dask.scheduler.KilledWorker, dask.client.ClosedClientError)
    return (BrokenExecutor, CancelledError, *own)


class _InThisThread(Executor):
    """Does each task when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@dataclass
class Pool(Generic[_T]):
    """An executor, and how many tasks are submitted at the same time.

    Attributes
    ----------
    executor : Executor
        Only its `submit` is used.
    workers : int
    make : callable, optional
        Makes another one where it breaks.
    """

    executor: Executor
    workers: int
    make: Callable[[], Executor] | None = None
    _lost: int = field(default=0, init=False)

    @property
    def at_once(self) -> int:
        """Tasks submitted and not done."""
        return 1 if isinstance(self.executor, _InThisThread) else _WAITING * self.workers

    def completed(self, function: Callable[[_T], _R], tasks: Iterator[_T]) -> Iterator[tuple[_T, _R]]:
        """Do tasks, and yield each with its result as soon as that is available.

        Parameters
        ----------
        function : callable
            Of a module, so that it can be sent to another process.
        tasks : iterator
            Asked for the next one when a worker needs it.

        Raises
        ------
        BrokenPoolError
            The executor has broken, and there is nothing that makes another one, or that broke, too.
        """
        done: SimpleQueue[Future[_R]] = SimpleQueue()
        at_work: dict[Future[_R], _T] = {}
        again: list[_T] = []

        def submit(task: _T) -> None:
            try:
                future = self.executor.submit(function, task)
            except _lost() as error:
                self._replace(error)
                future = self.executor.submit(function, task)
            at_work[future] = task
            future.add_done_callback(done.put)

        try:
            while True:
                while len(at_work) < self.at_once:
                    task = again.pop() if again else next(tasks, None)
                    if task is None:
                        break
                    submit(task)
                if not at_work:
                    return
                future = done.get()
                if future not in at_work:
                    continue
                task = at_work.pop(future)
                try:
                    result = future.result()
                except _lost() as error:
                    # The others are lost with it, or are given up: they are done again on the new one.
                    again += [task, *at_work.values()]
                    for other in at_work:
                        other.cancel()
                    at_work.clear()
                    self._replace(error)
                    continue
                self._lost = 0
                yield task, result
        finally:
            for future in at_work:
                future.cancel()

    def _replace(self, error: BaseException) -> None:
        self._lost += 1
        if self.make is None or self._lost > _MADE_AGAIN:
            raise BrokenPoolError(
                "the workers of the executor have ended unexpectedly; what they had finished is kept: the same call "
                "continues with it"
            ) from error
        self.executor.shutdown(wait=False)
        self.executor = self.make()


@contextmanager
def opened_pool(executor: AnyExecutor | None = None, jobs: int | None = None) -> Iterator[Pool[Any]]:
    """Prepare an executor for tasks.

    Parameters
    ----------
    executor : Executor or callable, optional
        What the caller has made and will end; or what makes one, which is ended here. Processes of this machine by
        default.
    jobs : int, optional
        Workers: processes where there is no executor, one of them this one; otherwise what bounds the number of tasks
        submitted at the same time, by default what the executor says of itself.

    Raises
    ------
    TypeError, ValueError
        An executor that is none, a number of workers that is not a whole number from 1.
    """
    if jobs is not None and as_integer("jobs", jobs) < 1:
        raise ValueError(f"jobs must be at least 1, not {jobs}")
    if isinstance(executor, Executor):
        yield Pool(executor, jobs or _workers_of(executor))
        return
    if executor is not None and not callable(executor):
        raise TypeError(f"executor must be one of concurrent.futures, or make one, not {type(executor).__name__}")
    make: Callable[[], Executor]
    if executor is not None:
        make = executor
    elif (count := jobs or (available_cores() if can_start_processes() else 1)) > 1:
        make = partial(started_processes, count)
    else:
        make = _InThisThread
    own = make()
    if not callable(getattr(own, "submit", None)):
        raise TypeError(f"executor must make one of concurrent.futures, not {type(own).__name__}")
    pool: Pool[Any] = Pool(own, jobs or _workers_of(own), None if isinstance(own, _InThisThread) else make)
    try:
        yield pool
    finally:
        pool.executor.shutdown(wait=True)


def check_progress(progress: object) -> None:
    """Raise a TypeError unless progress is None or callable."""
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function, not {type(progress).__name__}")


def _workers_of(executor: Executor) -> int:
    """Return the number of workers as executors of several packages call it; the cores of this machine otherwise."""
    for name in ("workers", "_max_workers", "num_workers"):
        found = getattr(executor, name, None)
        if isinstance(found, int) and found > 0:
            return found
    client: Any = getattr(executor, "_client", None)  # of Dask
    if client is not None and hasattr(client, "ncores"):
        return max(1, int(sum(client.ncores().values())))
    return available_cores()
