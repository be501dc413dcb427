"""One thread for the libraries that a task calls: two pools of threads on the same cores slow each other down."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

__all__ = ["one_thread"]

_lock = Lock()
#: Tasks of this process that are at work, and what the libraries had before the first of them.
_at_work = 0
_before: list[tuple[Any, int]] = []


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
