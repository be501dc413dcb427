"""Processes that share the work of a case."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, TypeVar

from jointfrf.parallel.processes import begin_process

__all__ = ["Workers", "started_workers"]

_T = TypeVar("_T")
#: What limits the threads of the libraries that a process calls.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def _silent(done: int, total: int) -> None:
    pass


@dataclass(frozen=True)
class Workers:
    """Where the parts of a computation run, and who is told how many are done.

    Attributes
    ----------
    pool : Executor or None
        Processes; None for this one.
    progress : callable
        Called with the numbers of parts done and in all.
    """

    pool: Executor | None = None
    progress: Callable[[int, int], None] = _silent

    def map(self, function: Callable[..., _T], *arguments: Iterable[Any]) -> Iterator[_T]:
        """Call a function for each set of arguments; results come in order, without processes one at a time."""
        return (map if self.pool is None else self.pool.map)(function, *arguments)

    def counted(self, parts: Iterable[_T], total: int) -> Iterator[_T]:
        """Pass parts on and report the progress."""
        for done, part in enumerate(parts, 1):
            yield part
            self.progress(done, total)


@contextmanager
def started_workers(jobs: int) -> Iterator[Workers]:
    """Start processes; with one job all is computed in this process.

    Each process computes on one thread: two pools of threads on the same cores slow each other down.
    """
    if jobs <= 1:
        yield Workers()
        return
    with _environment(dict.fromkeys(_THREADS, "1")):
        pool = ProcessPoolExecutor(jobs, get_context("spawn"), initializer=begin_process)
        try:
            yield Workers(pool)
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
    """Set variables of the environment, and put back what was there."""
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
