"""Tasks on any executor of `concurrent.futures`, a few of them at a time, results as they come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

from jointfrf.parallel.cores import available_cores
from jointfrf.parallel.processes import SeparateProcesses, as_workers, can_start_processes

__all__ = ["AnyExecutor", "BrokenPoolError", "Pool", "check_progress", "opened_pool"]

_T = TypeVar("_T")
_R = TypeVar("_R")
#: An executor, or what makes one: that is called again where the executor breaks.
AnyExecutor = Executor | Callable[[], Executor]
#: Tasks submitted and not done, for each worker: none of them waits for the next.
_WAITING = 2
#: Executors made in the place of broken ones, one after the other, without a task done in between.
_MADE_AGAIN = 3
#: What Dask raises where workers die again and again, or its cluster ends, beside cancelling tasks.
_DASK_ERRORS = {"KilledWorker", "ClosedClientError"}


class BrokenPoolError(RuntimeError):
    """An executor has lost its workers."""


def _has_lost_workers(error: BaseException) -> bool:
    """Whether an error says that there was nobody to do a task, rather than what the task itself raised."""
    kind = type(error)
    is_of_dask = kind.__module__.startswith("distributed.") and kind.__name__ in _DASK_ERRORS
    return is_of_dask or isinstance(error, (BrokenExecutor, CancelledError))


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
        """Do tasks, and give each with its result as soon as it is there.

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
            except Exception as error:
                if not _has_lost_workers(error):
                    raise
                self._replace(self.executor, error)
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
                except Exception as error:
                    if not _has_lost_workers(error):
                        raise
                    # The others break with it, or are given up: they are done again on the new one.
                    again += [task, *at_work.values()]
                    for other in at_work:
                        other.cancel()
                    at_work.clear()
                    self._replace(self.executor, error)
                    continue
                self._lost = 0
                yield task, result
        finally:
            for future in at_work:
                future.cancel()

    def _replace(self, broken: Executor, error: BaseException | None = None) -> None:
        self._lost += 1
        if self.make is None or self._lost > _MADE_AGAIN:
            raise BrokenPoolError(
                "the workers of the executor have ended unexpectedly; what they had finished is kept: the same call "
                "continues with it"
            ) from error
        broken.shutdown(wait=False)
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
    jobs = None if jobs is None else as_workers("jobs", jobs)
    if isinstance(executor, Executor):
        yield Pool(executor, jobs or _workers_of(executor))
        return
    if executor is not None and not callable(executor):
        raise TypeError(f"executor must be one of concurrent.futures, or make one, not {type(executor).__name__}")
    make = executor if executor is not None else _own(jobs or (available_cores() if can_start_processes() else 1))
    own = make()
    if not callable(getattr(own, "submit", None)):
        raise TypeError(f"executor must make one of concurrent.futures, not {type(own).__name__}")
    pool: Pool[Any] = Pool(own, jobs or _workers_of(own), None if isinstance(own, _InThisThread) else make)
    try:
        yield pool
    finally:
        pool.executor.shutdown(wait=True)


def check_progress(progress: object) -> None:
    """Raise unless what is told of the progress can be called."""
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function, not {type(progress).__name__}")


def _own(jobs: int) -> Callable[[], Executor]:
    """Return what makes processes; one job is done in this thread."""
    return _InThisThread if jobs <= 1 else lambda: SeparateProcesses(jobs)


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
