"""Calls of kernel routines, status of each line, and the engine that computes.

A C-order array (n_freq, out, in) enters as its transposed view, so nothing is copied; results come back in C order.
"""

from __future__ import annotations

import os
import reprlib
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

if sys.platform == "win32":
    # Loads the LAPACK: Windows searches DLLs next to the program, not next to the library that links to them.
    import scipy_openblas32  # noqa: F401

import jointfrf._kernel as _kernel
from jointfrf.errors import IllConditionedWarning, SingularLineError
from jointfrf.kernel.arguments import (
    ONE_CHUNK,
    ComplexArray,
    FloatArray,
    check_apart,
    check_choice,
    check_out,
    chunks,
    in_one_piece,
    release,
)

__all__ = [
    "N_FREQ",
    "RCOND_LIMIT",
    "VERSION",
    "Engine",
    "LineStatus",
    "OnSingular",
    "call",
    "call_for_number",
    "check_lines",
    "get_engine",
    "info_of",
    "run",
    "set_engine",
    "use_engine",
]

OnSingular = Literal["raise", "nan"]

#: Reciprocal condition number (1-norm) below which a result is ill-conditioned: fewer than four digits may be left.
RCOND_LIMIT = 1e-12

#: Values of `LineStatus.line_info`, and of `info`, see `status.f90`.
_LINE_NOT_FINITE = -1
_LINE_OVERFLOW = -2
_LINE_SINGULAR = 1  # or any other number above 0, LAPACK's INFO
#: Version of the kernel, and so of the package.
VERSION = ".".join(str(int(number)) for number in _kernel.jf_version())
#: Value of `info` if this processor cannot run the engine, see `status.f90`.
_NO_ENGINE = -1001
#: Names of engines for callers.
_ON_SINGULAR = get_args(OnSingular)
#: Types of arrays in the kernel.
_COMPLEX, _INTEGER = np.dtype(np.complex128), np.dtype(np.int32)
#: Looked up once, because a call of one line takes two microseconds.
_empty, _ndarray = np.empty, np.ndarray
#: Placeholder of the number of lines among the arguments of a kernel routine.
N_FREQ = object()
Engine = Literal["auto", "lapack", "plain", "x86-64-v2", "x86-64-v3", "x86-64-v4"]


class LineStatus(NamedTuple):
    """Status of each line of a sweep.

    Attributes
    ----------
    line_info : ndarray of int32, shape (n_freq,)
        Status: 0 is good, above 0 is singular (INFO of LAPACK), -1 is NaN or Inf in the line, -2 is overflow of its
        result.
    rcond : ndarray, shape (n_freq,)
        Reciprocal condition number of the worst inverted matrix; 0 in a bad line. In the 1-norm of the stored matrix
        with |re| + |im| for the modulus, within a factor 2; an estimate if a fast engine solves.
    """

    line_info: NDArray[np.int32]
    rcond: FloatArray

    @property
    def lowest_rcond(self) -> float:
        """Lowest reciprocal condition number; 1 if there are no lines."""
        return self.rcond.item(self.rcond.argmin()) if self.rcond.size else 1.0


def _line_names(lines: NDArray[np.intp], freq_hz: FloatArray | None) -> str:
    """Return a text with the first few lines."""
    some = [f"line {i}" + (f" ({freq_hz[i]:g} Hz)" if freq_hz is not None else "") for i in lines[:3]]
    more = f" and {lines.size - 3} more" if lines.size > 3 else ""
    return ", ".join(some) + more


def check_status(
    routine: str,
    status: LineStatus,
    n_bad: int,
    sweeps: Mapping[str, NDArray[Any]],
    freq_hz: FloatArray | None,
    on_singular: OnSingular,
    rcond_limit: float,
) -> None:
    """Turn bad lines into exceptions and poor conditions into a warning."""
    info = status.line_info
    if n_bad and on_singular == "raise":
        broken = np.flatnonzero(info == _LINE_NOT_FINITE)
        if broken.size:
            line = broken[0]
            names = [name for name, sweep in sweeps.items() if not np.isfinite(sweep[line]).all()]
            raise ValueError(f"{' and '.join(names) or routine}: NaN or Inf in {_line_names(broken, freq_hz)}")
        overflow = np.flatnonzero(info == _LINE_OVERFLOW)
        if overflow.size:
            raise OverflowError(f"{routine}: the result overflows in {_line_names(overflow, freq_hz)}")
        singular = np.flatnonzero(info > 0)
        raise SingularLineError(
            f"{routine}: singular matrix in {_line_names(singular, freq_hz)}",
            singular,
            None if freq_hz is None else freq_hz[singular],
        )
    poor = np.flatnonzero((status.rcond < rcond_limit) & (info == 0))
    if poor.size:
        worst = poor[np.argmin(status.rcond[poor])]
        warnings.warn(
            f"{routine}: {poor.size} of {info.size} lines are ill-conditioned, worst "
            f"{_line_names(np.array([worst]), freq_hz)} with rcond {status.rcond[worst]:.1e}",
            IllConditionedWarning,
            stacklevel=4,
        )


def check_lines(
    routine: str,
    status: LineStatus,
    sweeps: Mapping[str, NDArray[Any]],
    freq_hz: FloatArray | None,
    on_singular: OnSingular,
    rcond_limit: float = 0.0,
) -> None:
    """Turn bad lines into exceptions and, below a limit, poor conditions into a warning."""
    check_choice("on_singular", on_singular, get_args(OnSingular))
    if status.line_info.size:
        n_bad = int((status.line_info != 0).sum())
        if n_bad or status.lowest_rcond < rcond_limit:
            check_status(routine, status, n_bad, sweeps, freq_hz, on_singular, rcond_limit)


def _check_info(routine: str, info: int) -> None:
    """Raise an error for a negative `info`."""
    if info == _NO_ENGINE:
        word = reprlib.repr(os.environ.get("JOINTFRF_ENGINE"))
        raise ValueError(
            f"the environment variable JOINTFRF_ENGINE is {word}: it must be one of auto, lapack, plain, x86-64-v2, "
            "x86-64-v3, x86-64-v4 that this machine has"
        )
    if info < 0:
        raise RuntimeError(f"{routine}: {_kernel.jf_info_text(info).decode().strip()}")


def run(
    routine: str,
    args: Sequence[Any],
    shape: tuple[int, ...],
    sweeps: Mapping[str, NDArray[Any]],
    freq_hz: FloatArray | None,
    on_singular: OnSingular,
    rcond_limit: float = RCOND_LIMIT,
    out: ComplexArray | None = None,
    singular_rcond: float = 0.0,
) -> tuple[ComplexArray, NDArray[np.int32], FloatArray]:
    """Call a kernel routine; for few lines it takes less time than one call of numpy.linalg.

    Parameters
    ----------
    routine : str
        Name without ``jf_``, also for messages.
    args : sequence
        Arguments of the routine in the order of `fortran/api/api.F90`, up to the result; arrays in C order, `N_FREQ`
        for the number of lines.
    shape : tuple of int
        Shape of the result in C order, (n_freq, out, in).
    sweeps : mapping of str to ndarray
        Arguments that have a line axis, by their name for the caller, for messages. They may be in a file or one matrix
        broadcast to all lines; they are then converted in chunks.
    freq_hz : ndarray or None
        Frequencies in Hz for messages.
    on_singular : {"raise", "nan"}
        Whether bad lines (singular, NaN or Inf inside, overflow) raise an error or become NaN.
    rcond_limit : float
        Reciprocal condition number below which a line causes an `IllConditionedWarning`.
    out : ndarray or None
        Array for the result. All lines are computed before a bad one raises an error: `out` then contains the good
        lines, and NaN in the bad ones.
    singular_rcond : float
        Reciprocal condition number below which a line is singular to working precision, as in LAPACK's expert drivers.

    Returns
    -------
    result : ndarray, shape `shape`
        Result of the routine.
    line_info, rcond : ndarray, shape (n_freq,)
        Status of the lines, see `LineStatus`.
    """
    if type(on_singular) is not str or on_singular not in _ON_SINGULAR:
        check_choice("on_singular", on_singular, _ON_SINGULAR)
    n_freq = shape[0]
    if out is None:
        result = _empty(shape, _COMPLEX)
    else:
        result = out
        check_out(out, shape)
    whole: list[Any] = []
    for a in args:
        if isinstance(a, _ndarray):
            if out is not None and (a.base is not None or out.base is not None or a is out):
                check_apart(out, a, sweeps)
            whole.append(a.T)
        else:
            whole.append(n_freq if a is N_FREQ else a)
    line_info, rcond = _empty(n_freq, _INTEGER), _empty(n_freq)
    if not result.size:
        line_info[:], rcond[:] = 0, 1
        return result, line_info, rcond
    kernel = getattr(_kernel, "jf_" + routine)
    if n_freq <= ONE_CHUNK or in_one_piece(result, sweeps):
        n_bad = kernel(*whole, result.T, line_info, rcond)
        if n_bad < 0:
            _check_info(routine, n_bad)
    else:
        n_bad = _run_in_chunks(routine, kernel, args, result, LineStatus(line_info, rcond), sweeps)
    lowest = rcond.item(rcond.argmin())
    if lowest < singular_rcond:
        lost = (line_info == 0) & (rcond < singular_rcond)
        n_bad += int(lost.sum())
        result[lost], line_info[lost], rcond[lost] = np.nan, _LINE_SINGULAR, 0
    if n_bad or lowest < rcond_limit:
        check_status(routine, LineStatus(line_info, rcond), n_bad, sweeps, freq_hz, on_singular, rcond_limit)
    return result, line_info, rcond


def _run_in_chunks(
    routine: str,
    kernel: Callable[..., int],
    args: Sequence[Any],
    result: ComplexArray,
    status: LineStatus,
    sweeps: Mapping[str, NDArray[Any]],
) -> int:
    """Call a kernel routine in chunks of lines and return the number of bad ones."""
    n_bad = 0
    for lines in chunks(result, sweeps):
        chunk = [_argument(a, lines, sweeps) for a in args]
        info = kernel(*chunk, result[lines].T, status.line_info[lines], status.rcond[lines])
        _check_info(routine, info)
        n_bad += info
        if lines.stop < result.shape[0]:
            for array in (result, *sweeps.values()):
                release(array[lines])
    return n_bad


def _argument(value: Any, lines: slice, sweeps: Mapping[str, NDArray[Any]]) -> Any:
    """Return an argument in the form of the kernel for these lines."""
    if value is N_FREQ:
        return lines.stop - lines.start
    if not isinstance(value, np.ndarray):
        return value
    # f2py copies arrays of another type or order: the chunk, not the whole.
    return (value[lines] if any(value is sweep for sweep in sweeps.values()) else value).T


def call(routine: str, args: Sequence[Any]) -> None:
    """Call a kernel routine whose results are among its arguments; arrays in C order, none of size zero."""
    _check_info(routine, info_of(routine, args))


def call_for_number(routine: str, args: Sequence[Any]) -> tuple[float, ...]:
    """Call a routine that returns numbers before its `info`, like `call`; return all, an `info` > 0 included."""
    views = [a.T if isinstance(a, np.ndarray) else a for a in args]
    numbers = tuple(map(float, getattr(_kernel, "jf_" + routine)(*views)))
    _check_info(routine, int(numbers[-1]))
    return numbers


def info_of(routine: str, args: Sequence[Any]) -> int:
    """Call a kernel routine like `call` and return its `info` for the caller to check."""
    views = [a.T if isinstance(a, np.ndarray) else a for a in args]
    return int(getattr(_kernel, "jf_" + routine)(*views))


def set_engine(engine: Engine) -> None:
    """Choose the engine of all later calls, in every thread of this process.

    Parameters
    ----------
    engine : {"auto", "lapack", "plain", "x86-64-v2", "x86-64-v3", "x86-64-v4"}
        Name of the engine:

        - "auto": the widest vector registers of this machine
        - "lapack": line by line, the reference
        - "plain": eight lines side by side, with the instructions of any processor
        - "x86-64-v2", "x86-64-v3", "x86-64-v4": the same with the instructions of a level of x86-64 (v3 has AVX2, v4
          AVX-512)

    Raises
    ------
    ValueError
        The word is unknown, or this machine does not have the engine; the choice is unchanged.

    See Also
    --------
    use_engine : an engine inside a `with` block.
    get_engine : the engine in use.

    Notes
    -----
    Without a call the environment variable `JOINTFRF_ENGINE` chooses, by the same words; it is read when a sweep is
    first computed. Results of two engines agree within the rounding that the condition of a line allows. Results of one
    line among different neighbours agree to the same degree; the number of threads changes nothing.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.set_engine("lapack")
    >>> jf.get_engine()
    'lapack'
    >>> jf.set_engine("auto")
    """
    check_choice("engine", engine, get_args(Engine))
    if _kernel.jf_set_engine(get_args(Engine).index(engine)) != 0:
        raise ValueError(f"engine {engine!r} is not available on this machine")


def get_engine() -> Engine:
    """Return the engine in use; if the choice is automatic, the chosen one.

    Returns
    -------
    str
        Name of the engine, one of the words of `set_engine`, never "auto".

    Raises
    ------
    ValueError
        The environment variable `JOINTFRF_ENGINE` contains an unknown word, or names an engine that this machine does
        not have.

    See Also
    --------
    set_engine : choose an engine.

    Examples
    --------
    >>> import jointfrf as jf
    >>> with jf.use_engine("plain"):
    ...     jf.get_engine()
    'plain'
    """
    code, info = _kernel.jf_get_engine()
    _check_info("engine", info)
    engine: Engine = get_args(Engine)[int(code)]
    return engine


@contextmanager
def use_engine(engine: Engine) -> Iterator[None]:
    """Choose an engine inside a `with` block, in every thread of this process; then restore the earlier one.

    Parameters
    ----------
    engine : str
        Name of the engine; see `set_engine`.

    Raises
    ------
    ValueError
        An error of `set_engine` or `get_engine`.

    See Also
    --------
    set_engine : choose an engine for all later calls.

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
