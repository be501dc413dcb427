"""Processes of which each is on its own: one that dies costs its task only, which another one does again."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection, get_context, parent_process
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import Any, ParamSpec, TypeVar

from jointfrf.kernel.arguments import as_integer

__all__ = ["SeparateProcesses", "as_workers", "begin_process"]

_P = ParamSpec("_P")
_T = TypeVar("_T")
#: A task that ends so many processes ends every one.
_ATTEMPTS = 3


def as_workers(name: str, value: object) -> int:
    """Return a number of workers."""
    count = as_integer(name, value)
    if count < 1:
        raise ValueError(f"{name} must be at least 1, not {count}")
    return count


def begin_process() -> None:
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
        `workers` is no whole number from 1.

    Notes
    -----
    `concurrent.futures.ProcessPoolExecutor` ends all of its processes when one of them dies. Here another process is
    started in its place and given its task; a task whose process dies three times raises `BrokenProcessPool`.
    """

    def __init__(self, workers: int) -> None:
        self.workers = as_workers("workers", workers)
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
        pool = _one_process()
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
            pool = _one_process()
            if attempt == _ATTEMPTS:
                future.set_exception(error)
        except BaseException as error:
            future.set_exception(error)
            return pool
    return pool


def _one_process() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, get_context("spawn"), initializer=begin_process)
