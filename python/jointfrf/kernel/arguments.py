"""Arguments of the kernel: arrays, DOFs, frequencies and words of a caller, checked once and converted to its form.

Arrays in files (`numpy.memmap`) are processed in chunks of lines, so that they are never in memory as a whole.
"""

from __future__ import annotations

import mmap
import operator
import reprlib
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
from numpy.lib.array_utils import byte_bounds
from numpy.typing import ArrayLike, NDArray

from jointfrf.errors import CopyWarning

__all__ = [
    "CHUNK_BYTES",
    "TINY",
    "ComplexArray",
    "FloatArray",
    "as_array",
    "as_count",
    "as_dof_pairs",
    "as_dofs",
    "as_frequency",
    "as_integer",
    "as_interface",
    "as_joint_lines",
    "as_limits",
    "as_lines",
    "as_names",
    "as_nodes",
    "as_number",
    "as_positive",
    "as_real",
    "as_square",
    "as_values",
    "check_apart",
    "check_choice",
    "check_finite_lines",
    "check_out",
    "check_type",
    "checked_out",
    "chunks",
    "in_one_piece",
    "one_line",
    "optional_frequency",
    "release",
]

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

#: Smallest divisor, the smallest normal number.
TINY = float(np.finfo(np.float64).tiny)
#: Number of characters of a value in a message.
_SHOWN = 80
#: Types of arrays in the kernel.
_COMPLEX, _REAL = np.dtype(np.complex128), np.dtype(np.float64)

#: Number of bytes above which a conversion that copies causes a `CopyWarning`.
LARGE_COPY = 16 * 2**20
#: Approximate number of bytes of inputs and result of one chunk of lines; arrays in files are processed in chunks.
CHUNK_BYTES = 64 * 2**20
#: Number of lines in one share of the kernel, for large matrices and for small ones; chunks are multiples of it, so
#: that they change no bit of a result.
_SHARE, _LONG_SHARE = 64, 512
#: Number of lines up to which a sweep is one chunk, for any size.
ONE_CHUNK = 2 * _SHARE - 1


def as_array(name: str, value: ArrayLike) -> NDArray[Any]:
    """Return an array of any type; masked entries raise an error, as `numpy.asarray` would ignore the mask."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        mask = np.ma.getmaskarray(value)
        first = tuple(int(i) for i in np.unravel_index(int(np.argmax(mask)), mask.shape))
        raise ValueError(f"{name} has masked entries, the first at index {first}: leave their lines out, or fill them")
    try:
        return np.asarray(value)
    except ValueError as error:  # lists of lists that make no rectangle
        raise ValueError(f"{name} must be an array of numbers: its rows differ in length or kind") from error
    except (RuntimeError, TypeError) as error:  # such as tensors with a gradient, or in another memory
        raise TypeError(f"{name} does not become a numpy array: {' '.join(str(error).split())}") from error


def _converted(name: str, value: ArrayLike, dtype: np.dtype[Any], *, later: bool = False) -> NDArray[Any]:
    """Return contiguous numbers of the type; with `later`, an array in a file is left for `run` to convert."""
    if type(value) is np.ndarray and value.dtype == dtype and value.flags.c_contiguous:
        return value
    array = as_array(name, value)
    if array.dtype.kind not in ("biufc" if dtype is _COMPLEX else "biuf"):
        wanted = "numbers" if dtype is _COMPLEX else "real numbers"
        raise TypeError(f"{name} must contain {wanted}, not {array.dtype}")
    if later and is_mapped(array):
        return array
    result: NDArray[Any] = np.ascontiguousarray(array, dtype=dtype).reshape(array.shape)
    if result is not array and not np.shares_memory(result, array) and result.nbytes > LARGE_COPY:
        why = f"of type {array.dtype}" if array.dtype != dtype else "not contiguous in C order"
        warnings.warn(f"{name} is {why}: a copy of {result.nbytes / 2**20:.0f} MiB was made", CopyWarning, stacklevel=4)
    return result


def _fits(value: object, rows: int | None, columns: int | None, n_freq: int | None) -> bool:
    """Return whether a value already has the form of `as_lines`, without any cost."""
    if type(value) is np.ndarray and value.dtype is _COMPLEX and value.ndim == 3 and value.flags.c_contiguous:
        lines, n, m = value.shape
        return (n_freq is None or lines == n_freq) and (rows is None or n == rows) and (columns is None or m == columns)
    return False


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

    With `later`, an array in a file is returned as it is: `run` converts it in chunks.
    """
    if _fits(value, rows, columns, n_freq):
        return value  # type: ignore[return-value]
    array = _converted(name, value, _COMPLEX, later=later)
    if array.ndim != 3 or any(w not in (None, s) for w, s in zip((n_freq, rows, columns), array.shape, strict=True)):
        labels = ["n_freq" if n_freq is None else str(n_freq)]
        labels += ["n" if w is None else str(w) for w in (rows, columns)]
        raise ValueError(f"{name} must have shape ({', '.join(labels)}), not {array.shape}")
    return array


def as_square(name: str, value: ArrayLike, n_freq: int | None = None, *, later: bool = False) -> ComplexArray:
    """Return a sweep of square matrices, as `as_lines` does."""
    if type(value) is np.ndarray and value.dtype is _COMPLEX and value.ndim == 3 and value.flags.c_contiguous:
        lines, n, m = value.shape
        if n == m and (n_freq is None or lines == n_freq):
            return value  # the case that must be fast
    array = as_lines(name, value, n_freq=n_freq, later=later)
    if array.shape[1] != array.shape[2]:
        raise ValueError(f"{name} must contain square matrices, not {array.shape[1]} x {array.shape[2]}")
    return array


def as_joint_lines(name: str, value: ArrayLike, n: int | None, n_freq: int) -> ComplexArray:
    """Return joint matrices (n_freq, n, n) for `run`; one matrix (n, n) is valid for all lines."""
    array = as_array(name, value)
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
        raise ValueError(f"{name} must contain DOFs j and k, an even number of rows, not {lines.shape[1]}")
    return lines, lines.shape[1] // 2


def as_real(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> FloatArray:
    """Return a finite real array of the given shape; sizes that are None are free."""
    array = _converted(name, value, _REAL)
    fits = array.shape == shape or (
        array.ndim == len(shape) and all(w in (None, s) for w, s in zip(shape, array.shape, strict=True))
    )
    if not fits:
        wanted = ", ".join("n" if w is None else str(w) for w in shape)
        raise ValueError(f"{name} must have shape ({wanted}), not {array.shape}")
    if np.count_nonzero(np.isfinite(array)) != array.size:  # for a few entries, counting is faster than reducing
        where = np.unravel_index(int(np.argmin(np.isfinite(array))), array.shape)
        raise ValueError(f"{name} contains NaN or Inf at index {tuple(int(i) for i in where)}")
    return array


def as_frequency(freq_hz: ArrayLike, n_freq: int | None = None) -> FloatArray:
    """Return the frequency lines in Hz, finite and not negative."""
    freq = as_real("freq_hz", freq_hz, (n_freq,))
    if freq.size and freq.item(freq.argmin()) < 0:
        raise ValueError(f"freq_hz must not be negative: line {int(np.argmax(freq < 0))} is {freq.min():g} Hz")
    return freq


def optional_frequency(freq_hz: ArrayLike | None, n_freq: int) -> FloatArray | None:
    """Return the frequency lines if the caller gave them for messages about a singular line."""
    return None if freq_hz is None else as_frequency(freq_hz, n_freq)


def one_line(value: object) -> str:
    """Return a value as a few words of one line."""
    words = " ".join(reprlib.repr(value).split())
    return words if len(words) <= _SHOWN else words[: _SHOWN - 3] + "..."


def check_choice(name: str, value: object, known: Sequence[str]) -> None:
    """Raise an error unless the value is one of the known words."""
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name} must be one of {', '.join(known)}, not {one_line(value)}")


def check_type(name: str, value: object, kind: type) -> None:
    """Raise an error unless an argument is an object of the given class."""
    if not isinstance(value, kind):
        raise TypeError(f"{name} must be a {kind.__name__}, not {type(value).__name__}")


def as_names(name: str, value: object) -> tuple[str, ...]:
    """Return a sequence of names, each in one line; a single text is not one."""
    if isinstance(value, Iterable) and not isinstance(value, str):
        listed = list(value)
        if all(isinstance(each, str) for each in listed):
            # Models have tens of thousands of names: all are checked at once, and one by one if one is wrong.
            together = " ".join(listed)
            if together and together.splitlines() != [together]:
                split = next(each for each in listed if each and each.splitlines() != [each])
                raise ValueError(f"{name} must contain names without line breaks, not {one_line(split)}")
            return tuple(map(str, listed))
    raise TypeError(f"{name} must be a sequence of names, not {one_line(value)}")


def as_nodes(name: str, value: object) -> tuple[int, ...]:
    """Return a collection of whole numbers that name nodes."""
    listed = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(listed, Iterable) or isinstance(listed, str | bytes):
        raise TypeError(f"{name} must be a list of node numbers, not {one_line(value)}")
    found = list(listed)
    if not all(isinstance(each, int | np.integer) for each in found):
        raise TypeError(f"{name} must be a list of node numbers, not {one_line(value)}")
    return tuple(int(each) for each in found)


def as_integer(name: str, value: object) -> int:
    """Return one whole number."""
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} must be a whole number, not {one_line(value)}") from None


def as_limits(name: str, lower: object, upper: object) -> None:
    """Raise an error unless two bounds are real numbers, possibly infinite."""
    for value in (lower, upper):
        if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating) or value != value:
            raise TypeError(f"{name} must be real numbers, not {one_line(value)}")


def check_finite_lines(name: str, lines: ComplexArray, freq_hz: FloatArray | None = None) -> None:
    """Raise an error if a line contains NaN or Inf, and name the first one and its frequency."""
    broken = np.flatnonzero(~np.isfinite(lines).all(axis=(1, 2)))
    if broken.size:
        where = "" if freq_hz is None else f" ({freq_hz[broken[0]]:g} Hz)"
        raise ValueError(f"{name}: NaN or Inf in line {broken[0]}{where}")


def as_number(name: str, value: object) -> float:
    """Return one finite real number."""
    if type(value) is float and isfinite(value):
        return value
    if isinstance(value, str | bytes) or np.ndim(value) or as_array(name, value).dtype.kind not in "biuf":  # type: ignore[arg-type]
        raise TypeError(f"{name} must be one real number, not {one_line(value)}")
    number = float(value)  # type: ignore[arg-type]
    if not np.isfinite(number):
        raise ValueError(f"{name} must be finite, not {number}")
    return number


def as_positive(name: str, value: object, unit: str = "") -> float:
    """Return one number above zero."""
    number = as_number(name, value)
    if number <= 0:
        raise ValueError(f"{name} must be positive, not {number:g}{unit and ' '}{unit}")
    return number


def as_not_negative(name: str, value: object, unit: str = "") -> float:
    """Return one number, zero or more."""
    number = as_number(name, value)
    if number < 0:
        raise ValueError(f"{name} must not be negative, not {number:g}{unit and ' '}{unit}")
    return number


def as_probability(name: str, value: object) -> float:
    """Return one number above 0 and below 1."""
    number = as_number(name, value)
    if not 0 < number < 1:
        raise ValueError(f"{name} must lie between 0 and 1, not {number:g}")
    return number


def as_count(name: str, value: object, least: int = 1) -> int:
    """Return a whole number that is not too small; floats without a fraction are accepted, too."""
    number = as_number(name, value)
    if number < least or number != int(number):
        raise ValueError(f"{name} must be a whole number, at least {least}, not {value}")
    return int(number)


def as_values(name: str, value: ArrayLike, n: int) -> ComplexArray:
    """Return n complex numbers."""
    array: ComplexArray = _converted(name, value, _COMPLEX)
    if array.shape != (n,):
        raise ValueError(f"{name} must have one value for each of the {n} lines, not shape {array.shape}")
    return array


def as_dofs(name: str, dofs: ArrayLike, n: int, *, unique: bool = True) -> NDArray[np.int32]:
    """Return DOF indices counted from 1 for the kernel, from DOFs that the caller counts from 0."""
    array = as_array(name, dofs)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise TypeError(f"{name} must be a list of DOF numbers")
    numbers: list[int] = array.tolist()
    bad = [number for number in numbers if not 0 <= number < n]
    if bad:
        raise ValueError(f"{name} names DOF {bad[0]}; there are DOFs 0 to {n - 1}")
    if unique and len(set(numbers)) != len(numbers):
        raise ValueError(f"{name} names a DOF twice: {numbers}")
    return np.array([number + 1 for number in numbers], np.int32)


def as_dof_pairs(
    of_a: tuple[str, ArrayLike, int], of_b: tuple[str, ArrayLike, int]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the joint DOFs of two structures in the form of `as_dofs`, each by name, DOFs and number of DOFs."""
    a, b = as_dofs(*of_a), as_dofs(*of_b)
    if a.size != b.size or a.size == 0:
        raise ValueError(
            f"{of_a[0]} and {of_b[0]} must name the same number of DOFs, at least one: {a.size} and {b.size}"
        )
    return a, b


def checked_out(
    out: ComplexArray, shape: tuple[int, ...], args: Sequence[Any], sweeps: Mapping[str, NDArray[Any]]
) -> ComplexArray:
    """Return `out` if results can be written into it; no array of `args` may share its memory."""
    check_out(out, shape)
    for array in args:
        if isinstance(array, np.ndarray):
            check_apart(out, array, sweeps)
    return out


def check_apart(out: ComplexArray, array: NDArray[Any], sweeps: Mapping[str, NDArray[Any]]) -> None:
    """Raise an error if `out` shares memory with an argument. Arrays without a `base` own their memory."""
    if np.may_share_memory(out, array):
        names = [name for name, sweep in sweeps.items() if sweep is array]
        raise ValueError(f"out must not share memory with {names[0] if names else 'an argument'}")


def check_out(out: ComplexArray, shape: tuple[int, ...]) -> None:
    """Raise an error unless `out` is a complex array of this shape, in C order, aligned and writeable."""
    if type(out) is np.ndarray and out.shape == shape and out.dtype is _COMPLEX and out.flags.carray:
        return
    if not isinstance(out, np.ndarray):
        raise TypeError(f"out must be a numpy array, not {type(out).__name__}")
    if isinstance(out, np.ma.MaskedArray):
        raise TypeError("out must be a plain numpy array, not a masked one")
    if out.shape != shape:
        raise ValueError(f"out must have shape {shape}, not {out.shape}")
    if out.dtype != np.complex128:
        raise ValueError(f"out must contain complex128, not {out.dtype}")
    if not (out.flags.c_contiguous and out.flags.aligned):
        raise ValueError("out must be contiguous in C order and aligned")
    if not out.flags.writeable:
        raise ValueError("out must be writeable")


def is_mapped(array: NDArray[Any]) -> bool:
    """Return whether an array is in a file."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return isinstance(base, mmap.mmap)


def in_one_piece(result: NDArray[np.complex128], sweeps: Mapping[str, NDArray[Any]]) -> bool:
    """Return whether a sweep is so small that it is never processed in chunks."""
    size = result.nbytes
    for sweep in sweeps.values():
        size += 16 * sweep.size
    return size <= CHUNK_BYTES


def chunks(result: NDArray[np.complex128], sweeps: Mapping[str, NDArray[Any]]) -> Iterator[slice]:
    """Return ranges of lines: one, unless an array is in a file or one matrix is valid for all lines."""
    step = n_freq = result.shape[0]
    size = result.nbytes + sum(16 * sweep.size for sweep in sweeps.values())
    if size > CHUNK_BYTES and any(a.strides[0] == 0 or is_mapped(a) for a in (result, *sweeps.values())):
        step = CHUNK_BYTES * n_freq // size
        step = max(_SHARE, step - step % (_LONG_SHARE if step >= _LONG_SHARE else _SHARE))
    # fewer lines than a share belong to the previous chunk
    firsts = range(0, max(1, n_freq - _SHARE + 1), step)
    for first in firsts:
        yield slice(first, n_freq if first == firsts[-1] else first + step)


def release(lines: NDArray[Any]) -> None:
    """Release the pages of a file in memory; written data stay in the file."""
    base: Any = lines
    while isinstance(base.base, np.ndarray):
        base = base.base
    # In mode "c" written data would be lost; otherwise mapped memory is no more than a view of the file.
    pages = base.base
    if not (isinstance(base, np.memmap) and base.mode != "c" and isinstance(pages, mmap.mmap)):
        return
    if hasattr(mmap, "MADV_DONTNEED"):
        first = base.ctypes.data - base.offset % mmap.ALLOCATIONGRANULARITY
        start, stop = ((end - first) // mmap.PAGESIZE * mmap.PAGESIZE for end in byte_bounds(lines))
        if stop > start:
            pages.madvise(mmap.MADV_DONTNEED, start, stop - start)
