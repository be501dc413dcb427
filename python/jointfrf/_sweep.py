"""Between numpy and the kernel: checks, order of axes, and status turned into exceptions.

The only module that imports the compiled kernel. A C-order array (n_freq, out, in) enters as its transposed view, so
nothing is copied; results come back in C order. Arrays in files (`numpy.memmap`) go through piece by piece.
"""

from __future__ import annotations

import mmap
import os
import reprlib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.lib.array_utils import byte_bounds
from numpy.typing import ArrayLike, NDArray

import jointfrf._kernel as _kernel
from jointfrf.errors import CopyWarning, IllConditionedWarning, SingularLineError

__all__ = [
    "LARGE_COPY",
    "N_FREQ",
    "PIECE",
    "RCOND_LIMIT",
    "VERSION",
    "ComplexArray",
    "FloatArray",
    "LineStatus",
    "OnSingular",
    "as_dofs",
    "as_frequency",
    "as_interface",
    "as_joint_lines",
    "as_lines",
    "as_number",
    "as_real",
    "as_square",
    "as_values",
    "call",
    "check_choice",
    "check_lines",
    "kernel_engine",
    "optional_frequency",
    "run",
    "set_kernel_engine",
    "weights",
]

#: Version of the kernel, and so of the package.
VERSION = ".".join(str(int(number)) for number in _kernel.jf_version())

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
OnSingular = Literal["raise", "nan"]

#: Below this reciprocal condition number (1-norm) a result is called ill-conditioned: fewer than four digits may be
#: left.
RCOND_LIMIT = 1e-12
#: A conversion that copies more than this many bytes is announced by a `CopyWarning`.
LARGE_COPY = 16 * 2**20
#: Arrays in files are worked on in pieces of lines; inputs and result of one piece take about this many bytes.
PIECE = 64 * 2**20
#: Lines that the kernel takes as one share, of large matrices and of small ones; pieces are multiples of it, so that
#: they change no bit of a result.
_SHARE, _LONG_SHARE = 64, 512

_LINE_NOT_FINITE = -1
_LINE_OVERFLOW = -2
_NO_ENGINE = -1001

#: Stands for the number of lines among the arguments of a kernel routine.
N_FREQ = object()


def set_kernel_engine(code: int) -> bool:
    """Choose an engine by its number in the kernel; return whether this machine has it."""
    return bool(_kernel.jf_set_engine(code) == 0)


def kernel_engine() -> int:
    """Return the number of the engine in use."""
    code, info = _kernel.jf_get_engine()
    _check_info("engine", info)
    return int(code)


def _check_info(routine: str, info: int) -> None:
    """Raise what a negative `info` means."""
    if info == _NO_ENGINE:
        word = reprlib.repr(os.environ.get("JOINTFRF_ENGINE"))
        raise ValueError(
            f"the environment variable JOINTFRF_ENGINE is {word}: it must be one of auto, lapack, plain, x86-64-v2, "
            "x86-64-v3, x86-64-v4 that this machine has"
        )
    if info < 0:
        raise RuntimeError(f"{routine}: {_kernel.jf_info_text(info).decode().strip()}")


class LineStatus(NamedTuple):
    """How each line of a sweep went.

    Attributes
    ----------
    line_info : ndarray of int32, shape (n_freq,)
        0 good; > 0 singular (LAPACK's INFO); -1 NaN or Inf in the line; -2 its result overflows.
    rcond : ndarray, shape (n_freq,)
        Reciprocal condition number of the worst matrix inverted; 0 in a bad line. In the 1-norm of the stored matrix
        with |re| + |im| for the modulus, within a factor 2; an estimate where the fast engines solve.
    """

    line_info: NDArray[np.int32]
    rcond: FloatArray


def _mapped(array: NDArray[Any]) -> bool:
    """Whether an array lies in a file."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return isinstance(base, mmap.mmap)


def _converted(name: str, value: ArrayLike, dtype: type, *, later: bool = False) -> NDArray[Any]:
    """Return contiguous numbers of the type; with `later`, an array in a file is left for `run` to convert."""
    if type(value) is np.ndarray and value.dtype == dtype and value.flags.c_contiguous:
        return value
    array = np.asarray(value)
    if array.dtype.kind not in ("biufc" if dtype is np.complex128 else "biuf"):
        wanted = "numbers" if dtype is np.complex128 else "real numbers"
        raise TypeError(f"{name} must hold {wanted}, not {array.dtype}")
    if later and _mapped(array):
        return array
    result: NDArray[Any] = np.ascontiguousarray(array, dtype=dtype).reshape(array.shape)
    if result is not array and not np.shares_memory(result, array) and result.nbytes > LARGE_COPY:
        why = f"of type {array.dtype}" if array.dtype != dtype else "not contiguous in C order"
        warnings.warn(f"{name} is {why}: a copy of {result.nbytes / 2**20:.0f} MiB was made", CopyWarning, stacklevel=4)
    return result


def as_lines(
    name: str,
    value: ArrayLike,
    rows: int | None = None,
    columns: int | None = None,
    n_freq: int | None = None,
    *,
    later: bool = False,
) -> ComplexArray:
    """Return a sweep (n_freq, rows, columns) as contiguous complex128; sizes that are None are free.

    With `later`, an array in a file is returned as it is: `run` converts it piece by piece.
    """
    array = _converted(name, value, np.complex128, later=later)
    if array.ndim != 3 or any(w not in (None, s) for w, s in zip((n_freq, rows, columns), array.shape, strict=True)):
        labels = ["n_freq" if n_freq is None else str(n_freq)]
        labels += ["n" if w is None else str(w) for w in (rows, columns)]
        raise ValueError(f"{name} must have shape ({', '.join(labels)}), not {array.shape}")
    return array


def as_square(name: str, value: ArrayLike, n_freq: int | None = None, *, later: bool = False) -> ComplexArray:
    """Return a sweep of square matrices, as `as_lines` does."""
    array = as_lines(name, value, n_freq=n_freq, later=later)
    if array.shape[1] != array.shape[2]:
        raise ValueError(f"{name} must hold square matrices, not {array.shape[1]} x {array.shape[2]}")
    return array


def as_joint_lines(name: str, value: ArrayLike, n: int | None, n_freq: int) -> ComplexArray:
    """Return joint matrices (n_freq, n, n) for `run`; one matrix (n, n) serves all lines."""
    array = np.asarray(value)
    if array.ndim == 2:
        one = as_square(name, array[None])
        lines: ComplexArray = np.broadcast_to(one, (n_freq, *array.shape))
    else:
        lines = as_square(name, array, n_freq, later=True)
    if n is not None and lines.shape[1] != n:
        raise ValueError(f"{name} must have shape ({n_freq}, {n}, {n}), not {lines.shape}")
    return lines


def as_interface(name: str, value: ArrayLike, n_freq: int | None = None) -> tuple[ComplexArray, int]:
    """Return a sweep at joint DOFs j, then k, for `run`, and the number of joint DOFs."""
    lines = as_square(name, value, n_freq, later=True)
    if lines.shape[1] % 2 or lines.shape[1] == 0:
        raise ValueError(f"{name} must hold DOFs j and k, an even number of rows, not {lines.shape[1]}")
    return lines, lines.shape[1] // 2


def as_real(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> FloatArray:
    """Return a finite real array of the given shape; sizes that are None are free."""
    array = _converted(name, value, np.float64)
    if array.ndim != len(shape) or any(w is not None and w != s for w, s in zip(shape, array.shape, strict=True)):
        wanted = ", ".join("n" if w is None else str(w) for w in shape)
        raise ValueError(f"{name} must have shape ({wanted}), not {array.shape}")
    if not np.isfinite(array).all():
        where = np.unravel_index(int(np.argmin(np.isfinite(array))), array.shape)
        raise ValueError(f"{name} holds NaN or Inf at index {tuple(int(i) for i in where)}")
    return array


def as_frequency(freq_hz: ArrayLike, n_freq: int | None = None) -> FloatArray:
    """Return the frequency lines in Hz, finite and not negative."""
    freq = as_real("freq_hz", freq_hz, (n_freq,))
    if (freq < 0).any():
        raise ValueError(f"freq_hz must not be negative: line {int(np.argmax(freq < 0))} is {freq.min():g} Hz")
    return freq


def optional_frequency(freq_hz: ArrayLike | None, n_freq: int) -> FloatArray | None:
    """Return the frequency lines where the caller gave them to name a bad line."""
    return None if freq_hz is None else as_frequency(freq_hz, n_freq)


def check_choice(name: str, value: object, known: Sequence[str]) -> None:
    """Raise unless the value is one of the words that are known."""
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name} must be one of {', '.join(known)}, not {reprlib.repr(value)}")


def as_number(name: str, value: object) -> float:
    """Return one finite real number."""
    if isinstance(value, str | bytes) or np.ndim(value) or np.asarray(value).dtype.kind not in "biuf":  # type: ignore[arg-type]
        raise TypeError(f"{name} must be one real number, not {reprlib.repr(value)}")
    number = float(value)  # type: ignore[arg-type]
    if not np.isfinite(number):
        raise ValueError(f"{name} must be finite, not {number}")
    return number


def as_values(name: str, value: ArrayLike, n: int) -> ComplexArray:
    """Return n complex numbers."""
    array: ComplexArray = _converted(name, value, np.complex128)
    if array.shape != (n,):
        raise ValueError(f"{name} must have one value for each of the {n} lines, not shape {array.shape}")
    return array


def as_dofs(name: str, dofs: ArrayLike, n: int, *, unique: bool = True) -> NDArray[np.int32]:
    """Return DOF indices, counted from 0 by the caller, as the kernel counts them (from 1)."""
    array = np.asarray(dofs)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise TypeError(f"{name} must be a list of DOF numbers")
    array = array.astype(np.int64)
    if ((array < 0) | (array >= n)).any():
        bad = int(array[(array < 0) | (array >= n)][0])
        raise ValueError(f"{name} names DOF {bad}; there are DOFs 0 to {n - 1}")
    if unique and np.unique(array).size != array.size:
        raise ValueError(f"{name} names a DOF twice: {array.tolist()}")
    return (array + 1).astype(np.int32)


def _line_names(lines: NDArray[np.intp], freq_hz: FloatArray | None) -> str:
    """Return the first few lines in words."""
    some = [f"line {i}" + (f" ({freq_hz[i]:g} Hz)" if freq_hz is not None else "") for i in lines[:3]]
    more = f" and {lines.size - 3} more" if lines.size > 3 else ""
    return ", ".join(some) + more


def _check_status(
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
    if not n_bad and status.rcond.min() >= rcond_limit:
        return
    poor = np.flatnonzero((status.rcond < rcond_limit) & (info == 0))
    if poor.size:
        worst = poor[np.argmin(status.rcond[poor])]
        warnings.warn(
            f"{routine}: {poor.size} of {info.size} lines are ill-conditioned, worst "
            f"{_line_names(np.array([worst]), freq_hz)} with rcond {status.rcond[worst]:.1e}",
            IllConditionedWarning,
            stacklevel=4,
        )


def run(
    routine: str,
    args: Sequence[Any],
    shape: tuple[int, ...],
    sweeps: Mapping[str, NDArray[Any]],
    freq_hz: FloatArray | None,
    on_singular: OnSingular,
    rcond_limit: float = RCOND_LIMIT,
    out: ComplexArray | None = None,
) -> tuple[ComplexArray, LineStatus]:
    """Call a kernel routine.

    Parameters
    ----------
    routine : str
        Name without ``jf_``, used in messages too.
    args : sequence
        Arguments of the routine in the order of `api.F90` but for TRANS, up to the result; arrays in C order, `N_FREQ`
        for the number of lines.
    shape : tuple of int
        Shape of the result in C order, (n_freq, out, in).
    sweeps : mapping of str to ndarray
        Arguments that have a line axis, by the name the caller knows, to name a bad one. They may lie in a file or be
        one matrix broadcast to all lines; they are then converted piece by piece.
    freq_hz : ndarray or None
        Frequencies in Hz for messages.
    on_singular : {"raise", "nan"}
        What becomes of bad lines (singular, NaN or Inf inside, overflow).
    rcond_limit : float
        Below this reciprocal condition number a line is announced by an `IllConditionedWarning`.
    out : ndarray or None
        Where the result goes. All lines are done before a bad one raises: `out` then holds the good lines, and NaN in
        the bad ones.

    Returns
    -------
    result : ndarray, shape `shape`
    status : LineStatus
    """
    check_choice("on_singular", on_singular, get_args(OnSingular))
    n_freq = shape[0]
    result = np.empty(shape, np.complex128) if out is None else checked_out(out, shape, args, sweeps)
    status = LineStatus(np.empty(n_freq, np.int32), np.empty(n_freq))
    if not result.size:
        status.line_info[:], status.rcond[:] = 0, 1
    else:
        kernel = getattr(_kernel, "jf_" + routine)
        n_bad = 0
        for lines in _pieces(result, sweeps):
            piece = [_argument(a, lines, sweeps) for a in args]
            info = kernel(*piece, result[lines].T, status.line_info[lines], status.rcond[lines])
            _check_info(routine, info)
            n_bad += info
            if lines.stop < n_freq:
                for array in (result, *sweeps.values()):
                    _let_go(array[lines])
        _check_status(routine, status, n_bad, sweeps, freq_hz, on_singular, rcond_limit)
    return result, status


def checked_out(
    out: ComplexArray, shape: tuple[int, ...], args: Sequence[Any], sweeps: Mapping[str, NDArray[Any]]
) -> ComplexArray:
    """Return `out` if results can be written into it; no array of `args` may share its memory."""
    if not isinstance(out, np.ndarray):
        raise TypeError(f"out must be a numpy array, not {type(out).__name__}")
    if out.shape != shape:
        raise ValueError(f"out must have shape {shape}, not {out.shape}")
    if out.dtype != np.complex128:
        raise ValueError(f"out must hold complex128, not {out.dtype}")
    if not (out.flags.c_contiguous and out.flags.aligned):
        raise ValueError("out must be contiguous in C order and aligned")
    if not out.flags.writeable:
        raise ValueError("out must be writeable")
    for array in args:
        if isinstance(array, np.ndarray) and np.may_share_memory(out, array):
            names = [name for name, sweep in sweeps.items() if sweep is array]
            raise ValueError(f"out must not share memory with {names[0] if names else 'an argument'}")
    return out


def _pieces(result: ComplexArray, sweeps: Mapping[str, NDArray[Any]]) -> Iterator[slice]:
    """Return ranges of lines: one, unless an array lies in a file or one matrix stands for all lines."""
    step = n_freq = result.shape[0]
    size = result.nbytes + sum(16 * sweep.size for sweep in sweeps.values())
    if size > PIECE and any(a.strides[0] == 0 or _mapped(a) for a in (result, *sweeps.values())):
        step = PIECE * n_freq // size
        step = max(_SHARE, step - step % (_LONG_SHARE if step >= _LONG_SHARE else _SHARE))
    # fewer lines than a share are left to the piece before
    firsts = range(0, max(1, n_freq - _SHARE + 1), step)
    for first in firsts:
        yield slice(first, n_freq if first == firsts[-1] else first + step)


def _argument(value: Any, lines: slice, sweeps: Mapping[str, NDArray[Any]]) -> Any:
    """Return an argument as the kernel takes it for these lines."""
    if value is N_FREQ:
        return lines.stop - lines.start
    if not isinstance(value, np.ndarray):
        return value
    # f2py copies what has another type or order: the piece, not the whole.
    return (value[lines] if any(value is sweep for sweep in sweeps.values()) else value).T


def _let_go(lines: NDArray[Any]) -> None:
    """Tell the system that pages of a file are not needed in memory any more; what was written stays in the file."""
    base: Any = lines
    while isinstance(base.base, np.ndarray):
        base = base.base
    # In mode "c" what was written would be lost; otherwise mapped memory is no more than a view of the file.
    pages = base.base
    if not (isinstance(base, np.memmap) and base.mode != "c" and isinstance(pages, mmap.mmap)):
        return
    if hasattr(mmap, "MADV_DONTNEED"):
        first = base.ctypes.data - base.offset % mmap.ALLOCATIONGRANULARITY
        start, stop = ((end - first) // mmap.PAGESIZE * mmap.PAGESIZE for end in byte_bounds(lines))
        if stop > start:
            pages.madvise(mmap.MADV_DONTNEED, start, stop - start)


def call(routine: str, args: Sequence[Any]) -> None:
    """Call a kernel routine whose results are among its arguments; arrays in C order, none of size zero."""
    views = [a.T if isinstance(a, np.ndarray) else a for a in args]
    _check_info(routine, getattr(_kernel, "jf_" + routine)(*views))


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
        _check_status(routine, status, n_bad, sweeps, freq_hz, on_singular, rcond_limit)


def weights(offset: FloatArray) -> FloatArray:
    """Return finite-difference weights, shape (2, m): displacement and slope (2.59)."""
    result = np.empty((offset.size, 2))
    info = _kernel.jf_difference_weights(offset.size, offset, result.T)
    if info < 0:
        raise ValueError(f"offsets must be finite and no two equal: {offset.tolist()}")
    return result.T
