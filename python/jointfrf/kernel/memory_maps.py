"""Arrays in files (`numpy.memmap`): processed in chunks of lines, so that they never lie in memory as a whole."""

from __future__ import annotations

import mmap
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.lib.array_utils import byte_bounds
from numpy.typing import NDArray

__all__ = ["CHUNK_BYTES", "chunks", "in_one_piece", "is_mapped", "release"]

#: Arrays in files are processed in chunks of lines; inputs and result of one chunk take about this many bytes.
CHUNK_BYTES = 64 * 2**20
#: Lines that the kernel takes as one share, of large matrices and of small ones; chunks are multiples of it, so that
#: they change no bit of a result.
_SHARE, _LONG_SHARE = 64, 512


def is_mapped(array: NDArray[Any]) -> bool:
    """Whether an array lies in a file."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    return isinstance(base, mmap.mmap)


def in_one_piece(result: NDArray[np.complex128], sweeps: Mapping[str, NDArray[Any]]) -> bool:
    """Whether a sweep is so small that it is never processed in chunks."""
    size = result.nbytes
    for sweep in sweeps.values():
        size += 16 * sweep.size
    return size <= CHUNK_BYTES


def chunks(result: NDArray[np.complex128], sweeps: Mapping[str, NDArray[Any]]) -> Iterator[slice]:
    """Return ranges of lines: one, unless an array lies in a file or one matrix stands for all lines."""
    step = n_freq = result.shape[0]
    size = result.nbytes + sum(16 * sweep.size for sweep in sweeps.values())
    if size > CHUNK_BYTES and any(a.strides[0] == 0 or is_mapped(a) for a in (result, *sweeps.values())):
        step = CHUNK_BYTES * n_freq // size
        step = max(_SHARE, step - step % (_LONG_SHARE if step >= _LONG_SHARE else _SHARE))
    # fewer lines than a share are left to the chunk before
    firsts = range(0, max(1, n_freq - _SHARE + 1), step)
    for first in firsts:
        yield slice(first, n_freq if first == firsts[-1] else first + step)


def release(lines: NDArray[Any]) -> None:
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
