"""Processes that share the work of a case."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from jointfrf.parallel.processes import started_processes

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
    pool = started_processes(jobs, dict.fromkeys(_THREADS, "1"))
    try:
        yield Workers(pool)
    finally:
        pool.shutdown(cancel_futures=True)
