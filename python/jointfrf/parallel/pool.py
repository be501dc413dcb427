"""Tasks on any executor of `concurrent.futures`, a few at a time, with results on arrival; processes and threads."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import connection, context, parent_process, spawn
from pathlib import Path
from queue import SimpleQueue
from threading import Lock, RLock, Thread, current_thread, main_thread
from typing import Any, Generic, TypeVar

from jointfrf.kernel.arguments import as_integer

__all__ = [
    "AnyExecutor",
    "BrokenPoolError",
    "Pool",
    "available_cores",
    "can_start_processes",
    "check_processes",
    "check_progress",
    "one_thread",
    "opened_pool",
    "safe_environment",
    "started_processes",
]

#: Variable with which Python does not search modules in the working directory.
_SAFE = "PYTHONSAFEPATH"
#: Lock of the thread that changes the environment.
_CHANGING = RLock()
#: Lock of the thread that changes the numbers of threads; running tasks of this process; the earlier numbers.
_lock = Lock()
_at_work = 0
_before: list[tuple[Any, int]] = []


def available_cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def can_start_processes() -> bool:
    """Return whether another Python can be started: not from a host program, whose name is not a Python.

    A caller of `multiprocessing.set_executable` has specified the Python to start.
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
    """Raise a ValueError if no other Python can be started."""
    if not can_start_processes():
        raise ValueError(
            f"no process can be started: {sys.executable!r} is not this Python, or ignores {_SAFE}; set jobs=1, give "
            "an executor of threads, or call multiprocessing.set_executable"
        )


@contextmanager
def safe_environment(more: Mapping[str, str] | None = None) -> Iterator[None]:
    """Set the environment in which every Python is started, so that it runs no module of the working directory.

    Parameters
    ----------
    more : mapping, optional
        Further variables; earlier values are restored at the end.
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
    """A process that starts in the environment above, with further variables, whenever the pool needs it."""

    def __init__(self, more: Mapping[str, str], **options: Any) -> None:
        super().__init__(**options)
        self._more = more

    def start(self) -> None:
        with safe_environment(self._more):
            super().start()


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Submit a task, and start a process that no Ctrl-C reaches, even during its imports; ours follows afterwards.

    A signal blocked in this thread reaches another one, for instance of a BLAS, and is then handled here: it is only
    recorded meanwhile. Otherwise the process would exist before its task is written to it. Or the executor would not
    register the process, and wait for another one whose end was signalled to this one.
    """
    handler = signal.getsignal(signal.SIGINT)
    if not hasattr(signal, "pthread_sigmask") or not callable(handler) or current_thread() is not main_thread():
        with _blocked():
            yield
        return
    noted: list[int] = []
    try:
        signal.signal(signal.SIGINT, lambda number, frame: noted.append(number))
        with _blocked():
            yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if noted:
            signal.raise_signal(signal.SIGINT)


@contextmanager
def _blocked() -> Iterator[None]:
    """Block Ctrl-C in this thread, and in processes that it starts."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def started_processes(workers: int, more: Mapping[str, str] | None = None) -> ProcessPoolExecutor:
    """Return an executor of new processes.

    Parameters
    ----------
    workers : int
        Number of processes.
    more : mapping, optional
        Further variables of their environment.

    Raises
    ------
    ValueError
        No other Python can be started from this program.
    """
    check_processes()
    own, started = context.SpawnContext(), list[_SafeProcess]()

    def prepared(**options: Any) -> _SafeProcess:
        started.append(_SafeProcess(dict(more or {}), **options))
        return started[-1]

    setattr(own, "Process", prepared)  # noqa: B010
    with safe_environment(more):  # a separate process keeps the locks
        return _StartedProcesses(workers, own, initializer=_begin_process, started=started)


class _StartedProcesses(ProcessPoolExecutor):
    """Processes that all end, because one that an interrupt kept from joining would wait without end."""

    def __init__(self, *arguments: Any, started: list[Any], **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._started = started

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with _uninterrupted():
            return super().submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        try:
            super().shutdown(wait, cancel_futures=cancel_futures)
        finally:
            for process in self._started if wait else ():
                if process.is_alive():
                    process.terminate()
                    process.join()


def _begin_process() -> None:
    """Initialise a process of a pool: its parent handles interrupts, and it ends with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    """End this process after another one, which cannot end its children if it is killed."""
    connection.wait([sentinel])
    os._exit(1)


@contextmanager
def one_thread(*, of_blas_only: bool = False) -> Iterator[None]:
    """Limit BLAS and OpenMP, or BLAS only, to one thread inside a `with` block; restore the earlier numbers.

    Notes
    -----
    A BLAS has one number of threads for the whole process: the first of several concurrent tasks sets it, and the last
    one restores it. OpenMP has one for each calling thread.
    """
    from threadpoolctl import ThreadpoolController

    import jointfrf.kernel.call  # noqa: F401  # loads the libraries before the search for them

    libraries = ThreadpoolController().lib_controllers
    own = [(one, int(one.get_num_threads())) for one in libraries if one.user_api == "openmp" and not of_blas_only]
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
    """Set the number of threads of a BLAS: threadpoolctl accepts it only from the thread that set it first."""
    release = getattr(library, "clear_controlling_thread", lambda force: None)
    release(force=True)
    library.set_num_threads(threads)
    release(force=True)


_T = TypeVar("_T")
_R = TypeVar("_R")
#: An executor, or a function that makes one and is called again if the executor breaks.
AnyExecutor = Executor | Callable[[], Executor]
#: Tasks submitted and not done, for each worker: one running, and one so that it need not wait for the next.
_WAITING = 2
#: Number of times in a row, without a completed task, that a broken executor is replaced.
_MADE_AGAIN = 3


class BrokenPoolError(RuntimeError):
    """An executor has lost its workers."""


#: Errors that mean lost workers, not an error of the task.
_LOST = (BrokenExecutor, CancelledError)


class _InThisThread(Executor):
    """Runs each task on submission."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@dataclass
class Pool(Generic[_T]):
    """An executor, and the number of tasks submitted at the same time.

    Attributes
    ----------
    executor : Executor
        Executor, of which only `submit` is used.
    workers : int
        Number of workers.
    make : callable, optional
        Function that makes another executor if it breaks.
    """

    executor: Executor
    workers: int
    make: Callable[[], Executor] | None = None
    _lost: int = field(default=0, init=False)

    @property
    def at_once(self) -> int:
        """Number of tasks submitted and not done."""
        return 1 if isinstance(self.executor, _InThisThread) else _WAITING * self.workers

    def completed(self, function: Callable[[_T], _R], tasks: Iterator[_T]) -> Iterator[tuple[_T, _R]]:
        """Run tasks, and yield each with its result as soon as it is available.

        Parameters
        ----------
        function : callable
            Function of a module, so that it can be sent to another process.
        tasks : iterator
            Tasks; the next one is requested when a worker needs it.

        Raises
        ------
        BrokenPoolError
            The executor has broken, and no function makes another one, or that one broke, too.
        """
        done: SimpleQueue[Future[_R]] = SimpleQueue()
        at_work: dict[Future[_R], _T] = {}
        again: list[_T] = []

        def submit(task: _T) -> None:
            try:
                future = self.executor.submit(function, task)
            except _LOST as error:
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
                except _LOST as error:
                    # All other tasks are lost or abandoned, too, and run again on the new executor.
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
                "the workers of the executor have ended unexpectedly; finished tasks are kept: make the same call again"
            ) from error
        self.executor.shutdown(wait=False)
        self.executor = self.make()


@contextmanager
def opened_pool(executor: AnyExecutor | None = None, jobs: int | None = None) -> Iterator[Pool[Any]]:
    """Prepare an executor for tasks.

    Parameters
    ----------
    executor : Executor or callable, optional
        Executor that the caller has made and will end; or a function that makes one, which is ended here. By default
        processes of this machine.
    jobs : int, optional
        Number of workers. Without an executor these are processes, including this one. Otherwise it limits the number
        of tasks submitted at the same time, by default the number that the executor states.

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
        raise TypeError(f"executor is a {type(executor).__name__}; give one of concurrent.futures, or what makes one")
    make: Callable[[], Executor]
    if executor is not None:
        make = executor
    elif (count := jobs or (available_cores() if can_start_processes() else 1)) > 1:
        make = partial(started_processes, count)
    else:
        make = _InThisThread
    own = make()
    if not callable(getattr(own, "submit", None)):
        raise TypeError(f"executor returned a {type(own).__name__}; let it return an executor of concurrent.futures")
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
    """Return the number of workers by its names in several packages; otherwise the number of cores of this machine."""
    for name in ("workers", "_max_workers", "num_workers"):
        found = getattr(executor, name, None)
        if isinstance(found, int) and found > 0:
            return found
    return available_cores()
