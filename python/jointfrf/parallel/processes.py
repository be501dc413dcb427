"""What tasks run on: processors, processes of this machine, and one thread each for the libraries that they call."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import connection, context, parent_process, spawn
from pathlib import Path
from threading import Lock, RLock, Thread
from typing import Any

__all__ = [
    "available_cores",
    "can_start_processes",
    "check_processes",
    "one_thread",
    "safe_environment",
    "started_processes",
]

#: With it Python does not look for modules in the working directory.
_SAFE = "PYTHONSAFEPATH"
#: Held by the thread that changes the environment.
_CHANGING = RLock()
#: Held by the thread that changes the numbers of threads; tasks of this process at work, and the numbers before them.
_lock = Lock()
_at_work = 0
_before: list[tuple[Any, int]] = []


def available_cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
    except OSError:  # a system without /proc
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
    """A process that is started with the environment above, and other variables, whenever the pool needs it."""

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
    """Wait for the end of another process, and end this one: a process that is killed cannot end those it started."""
    connection.wait([sentinel])
    os._exit(1)


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit BLAS and OpenMP to one thread inside a `with` block; then return to what was there.

    Notes
    -----
    A BLAS has one number of threads for the whole process: the first of several tasks at the same time sets it, and the
    last one sets it back. OpenMP has one for each thread that calls it.
    """
    from threadpoolctl import ThreadpoolController

    import jointfrf.kernel.call  # noqa: F401  # its libraries are loaded before they are looked for

    libraries = ThreadpoolController().lib_controllers
    own = [(one, int(one.get_num_threads())) for one in libraries if one.user_api == "openmp"]
    for library, _ in own:
        library.set_num_threads(1)
    _enter([one for one in libraries if one.user_api != "openmp"])
    try:
        yield
    finally:
        _leave()
        for library, threads in own:
            library.set_num_threads(threads)


def _enter(libraries: list[Any]) -> None:
    global _at_work
    with _lock:
        if _at_work == 0:
            _before[:] = [(one, int(one.get_num_threads())) for one in libraries]
        _at_work += 1
        for library in libraries:
            _set(library, 1)


def _leave() -> None:
    global _at_work
    with _lock:
        _at_work -= 1
        if _at_work == 0:
            for library, threads in _before:
                _set(library, threads)
            _before.clear()


def _set(library: Any, threads: int) -> None:
    """Set the number of threads of a BLAS: threadpoolctl takes it from the thread that did so first, and no other."""
    release = getattr(library, "clear_controlling_thread", lambda force: None)
    release(force=True)
    library.set_num_threads(threads)
    release(force=True)
