"""Processes of which each is on its own: one that dies costs its task only, which another one does again."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from multiprocessing import connection, context, parent_process, spawn
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Lock, RLock, Thread
from typing import Any, ParamSpec, TypeVar

from jointfrf.kernel.arguments import as_integer

__all__ = [
    "SeparateProcesses",
    "as_workers",
    "can_start_processes",
    "check_processes",
    "safe_environment",
    "started_processes",
]

_P = ParamSpec("_P")
_T = TypeVar("_T")
#: A task that ends so many processes ends every one.
_ATTEMPTS = 3
#: With it Python does not look for modules in the working directory.
_SAFE = "PYTHONSAFEPATH"
#: One at a time changes the environment.
_CHANGING = RLock()


def as_workers(name: str, value: object) -> int:
    """Return a number of workers."""
    count = as_integer(name, value)
    if count < 1:
        raise ValueError(f"{name} must be at least 1, not {count}")
    return count


def can_start_processes() -> bool:
    """Whether another Python can be started: not from a program that Python is part of, whose name says nothing of it.

    Who calls `multiprocessing.set_executable` has said which Python to start.
    """
    named = os.fsdecode(spawn.get_executable() or "")
    if not named or (sys.flags.ignore_environment and not sys.flags.safe_path):
        return False
    if named != sys.executable:
        return True
    try:
        return os.path.samefile("/proc/self/exe", named)
    except OSError:  # a system that does not tell
        return Path(named).name.lower().startswith(("python", "pypy"))


def check_processes() -> None:
    """Raise a ValueError where no other Python can be started."""
    if not can_start_processes():
        raise ValueError(
            f"no other process can be started: {sys.executable!r} is not the Python that runs here, or does not take "
            f"{_SAFE}; say jobs=1, give an executor of threads, or name a Python by multiprocessing.set_executable"
        )


@contextmanager
def safe_environment(more: Mapping[str, str] | None = None) -> Iterator[None]:
    """Set the environment with which every Python is started: no module of the working directory is run.

    Parameters
    ----------
    more : mapping, optional
        Other variables. What was there is put back at the end.
    """
    changes = {_SAFE: "1", **(more or {})}
    with _CHANGING:
        before = {name: os.environ.get(name) for name in changes}
        os.environ.update(changes)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


class _SafeProcess(context.SpawnProcess):
    """A process that is started with the environment above, and other variables."""

    def __init__(self, more: Mapping[str, str], **options: Any) -> None:
        super().__init__(**options)
        self.more = more

    @staticmethod
    def _Popen(process_obj: Any) -> Any:  # noqa: N802
        with safe_environment(process_obj.more):
            return context.SpawnProcess._Popen(process_obj)


def started_processes(workers: int, more: Mapping[str, str] | None = None) -> ProcessPoolExecutor:
    """Start processes.

    Parameters
    ----------
    workers : int
        How many.
    more : mapping, optional
        Variables of their environment.

    Raises
    ------
    ValueError
        No other Python can be started from this program.
    """
    check_processes()

    own = context.SpawnContext()
    setattr(own, "Process", partial(_SafeProcess, dict(more or {})))  # noqa: B010
    with safe_environment(more):  # locks are kept by a process of their own
        return ProcessPoolExecutor(workers, own, initializer=_begin_process)


def _begin_process() -> None:
    """Begin a process of a pool: an interrupt goes to the one that waits for it, and it ends when that one does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    """Wait for the end of another process, and end this one: whoever is killed cannot tell its processes."""
    connection.wait([sentinel])
    os._exit(1)


class SeparateProcesses(Executor):
    """Processes as an executor.

    Parameters
    ----------
    workers : int
        How many.

    Attributes
    ----------
    workers : int

    Raises
    ------
    TypeError, ValueError
        `workers` is no whole number from 1, or no other Python can be started.

    Notes
    -----
    `concurrent.futures.ProcessPoolExecutor` ends all of its processes when one of them dies. Here another process is
    started in its place and given its task; a task whose process dies three times raises `BrokenProcessPool`.
    """

    def __init__(self, workers: int) -> None:
        self.workers = as_workers("workers", workers)
        check_processes()
        self._tasks: SimpleQueue[tuple[Future[Any], Callable[[ProcessPoolExecutor], Any]] | None] = SimpleQueue()
        self._lock, self._is_open = Lock(), True
        self._threads = [Thread(target=self._serve, daemon=True) for _ in range(self.workers)]
        for thread in self._threads:
            thread.start()

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Call a function in one of the processes."""
        future: Future[_T] = Future()
        with self._lock:
            if not self._is_open:
                raise RuntimeError("the processes have been shut down")
            self._tasks.put((future, lambda pool: pool.submit(fn, *args, **kwargs).result()))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes when what has been submitted is done, or at once when the tasks at work are done."""
        with self._lock:
            if self._is_open:
                self._is_open = False
                if cancel_futures:
                    self._cancel()
                for _ in self._threads:
                    self._tasks.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def _cancel(self) -> None:
        while True:
            try:
                task = self._tasks.get_nowait()
            except Empty:
                return
            if task is not None:
                task[0].cancel()

    def _serve(self) -> None:
        """Hand tasks to one process, and start another where it has died."""
        pool = started_processes(1)
        try:
            while (task := self._tasks.get()) is not None:
                future, call = task
                if future.set_running_or_notify_cancel():
                    pool = _done(future, call, pool)
                del future, call, task
        finally:
            pool.shutdown()


def _done(future: Future[Any], call: Callable[..., Any], pool: ProcessPoolExecutor) -> ProcessPoolExecutor:
    """Do a task and return the pool that is alive afterwards."""
    for attempt in range(1, _ATTEMPTS + 1):
        try:
            future.set_result(call(pool))
            return pool
        except BrokenProcessPool as error:
            pool.shutdown()
            pool = started_processes(1)
            if attempt == _ATTEMPTS:
                future.set_exception(error)
        except BaseException as error:
            future.set_exception(error)
            return pool
    return pool
