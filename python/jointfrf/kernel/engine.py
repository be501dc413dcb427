"""Which engine computes: LAPACK line by line, or several lines side by side in the processor's vector registers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal, get_args

from jointfrf.kernel.arguments import check_choice
from jointfrf.kernel.call import kernel_engine, set_kernel_engine

__all__ = ["Engine", "get_engine", "set_engine", "use_engine"]

Engine = Literal["auto", "lapack", "plain", "x86-64-v2", "x86-64-v3", "x86-64-v4"]


def set_engine(engine: Engine) -> None:
    """Choose the engine of all calls that follow, in every thread of this process.

    Parameters
    ----------
    engine : {"auto", "lapack", "plain", "x86-64-v2", "x86-64-v3", "x86-64-v4"}
        "auto": the widest vector registers this machine has. "lapack": line by line, the reference. The others:
        eight lines side by side, with the instructions of any processor or of a level of x86-64 (v3 has AVX2, v4
        AVX-512).

    Raises
    ------
    ValueError
        The word is not known, or this machine does not have the engine; the choice stays as it was.

    Notes
    -----
    Without a call the environment variable `JOINTFRF_ENGINE` chooses, by the same words; it is read when a sweep is
    first computed. Results of two engines agree within the rounding that the condition of a line allows, and so do
    those of one line among different neighbours; the number of threads changes nothing.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.set_engine("lapack")
    >>> jf.get_engine()
    'lapack'
    >>> jf.set_engine("auto")
    """
    check_choice("engine", engine, get_args(Engine))
    if not set_kernel_engine(get_args(Engine).index(engine)):
        raise ValueError(f"engine {engine!r} is not there on this machine")


def get_engine() -> Engine:
    """Return the engine in use; where the choice is automatic, the one that it comes to.

    Returns
    -------
    str
        One of the words of `set_engine`, never "auto".

    Raises
    ------
    ValueError
        The environment variable `JOINTFRF_ENGINE` holds a word that is not known, or names an engine that this machine
        does not have.

    Examples
    --------
    >>> import jointfrf as jf
    >>> with jf.use_engine("plain"):
    ...     jf.get_engine()
    'plain'
    """
    engine: Engine = get_args(Engine)[kernel_engine()]
    return engine


@contextmanager
def use_engine(engine: Engine) -> Iterator[None]:
    """Choose an engine inside a `with` block, in every thread of this process; then return to the one before.

    Parameters
    ----------
    engine : str
        As in `set_engine`.

    Raises
    ------
    ValueError
        As in `set_engine` and `get_engine`.

    Examples
    --------
    >>> import jointfrf as jf
    >>> with jf.use_engine("lapack"):
    ...     jf.invert([[[2.0]]]).tolist()
    [[[(0.5-0j)]]]
    """
    before = get_engine()
    set_engine(engine)
    try:
        yield
    finally:
        set_engine(before)
