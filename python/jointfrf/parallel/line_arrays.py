"""Arrays over frequency lines that tasks on other processes and machines read and write a piece at a time."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.extras import import_extra
from jointfrf.kernel.arguments import as_array

__all__ = ["Lines", "lines_of"]


@dataclass(frozen=True, kw_only=True)
class Lines(ABC):
    """An array over lines, in the form that is sent to a task.

    Attributes
    ----------
    shape : tuple of int
        Shape, lines first.
    place : Path or None
        File that contains the array; None in memory.
    """

    shape: tuple[int, ...]
    place: Path | None = None
    #: Whether tasks write their results themselves; otherwise they send them back.
    is_written_by_tasks: ClassVar[bool] = False

    def of(self, lines: slice) -> Lines:
        """Return the object to send to a task that needs these lines."""
        return self

    @abstractmethod
    def read(self, lines: slice) -> NDArray[Any]:
        """Return these lines, in the task."""

    def write(self, lines: slice, values: NDArray[Any]) -> None:
        """Write these lines."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class MemoryLines(Lines):
    """An array in memory: the lines of a task are sent to it, and its results back."""

    array: Any
    first: int = 0

    def of(self, lines: slice) -> Lines:
        """Return the lines themselves."""
        return MemoryLines(shape=self.shape, array=np.asarray(self.array[lines]), first=lines.start)

    def read(self, lines: slice) -> NDArray[Any]:
        """Return lines that were sent to the task."""
        found: NDArray[Any] = self.array[lines.start - self.first : lines.stop - self.first]
        return found

    def write(self, lines: slice, values: NDArray[Any]) -> None:
        """Write lines into the array."""
        self.array[lines] = values


@dataclass(frozen=True, kw_only=True)
class MappedLines(Lines):
    """An array in a file, `numpy.memmap`: each task maps the lines it needs."""

    place: Path
    dtype: str
    offset: int
    is_written_by_tasks: ClassVar[bool] = True

    def _start(self, lines: slice) -> int:
        """Return the position of the lines in the file, bytes."""
        return self.offset + int(lines.start) * np.dtype(self.dtype).itemsize * math.prod(self.shape[1:])

    def read(self, lines: slice) -> NDArray[Any]:
        """Map lines."""
        shape = (lines.stop - lines.start, *self.shape[1:])
        return np.memmap(self.place, self.dtype, "r", self._start(lines), shape)

    def write(self, lines: slice, values: NDArray[Any]) -> None:
        """Write lines into the file and close it: other machines can then read them, unlike data written into a map."""
        with self.place.open("r+b") as file:
            file.seek(self._start(lines))
            np.ascontiguousarray(values, self.dtype).tofile(file)


@dataclass(frozen=True, kw_only=True)
class Hdf5Lines(Lines):
    """A dataset of an HDF5 file that is only read: each task opens the file."""

    place: Path
    dataset: str

    def read(self, lines: slice) -> NDArray[Any]:
        """Read lines."""
        with import_extra("h5py").File(self.place, "r") as file:
            return np.asarray(file[self.dataset][lines])


def lines_of(name: str, array: ArrayLike, *, is_result: bool = False) -> Lines:
    """Return an array in the form in which tasks read its lines.

    Parameters
    ----------
    name : str
        Name of the argument, for messages.
    array : array_like, numpy.memmap or h5py.Dataset
        Array over lines.
    is_result : bool
        Whether results are written into it, default False.

    Raises
    ------
    TypeError
        Results cannot be written into it.
    ValueError
        It has no axis of lines, masked entries, or cannot be written.
    """
    package = type(array).__module__.partition(".")[0]
    if is_result and package != "h5py" and not isinstance(array, np.ndarray):
        raise TypeError(f"{name} is a {type(array).__name__}; give an array that results can be written into")
    found = _hdf5(array, is_result) if package == "h5py" else _numpy(name, array)
    if isinstance(array, np.ndarray) and is_result and not array.flags.writeable:
        raise ValueError(f"{name} is open for reading only; open it for writing")
    if not found.shape:
        raise ValueError(f"{name} has no axis of lines, its shape is (); give an array of lines")
    return found


def _numpy(name: str, array: ArrayLike) -> Lines:
    if isinstance(array, np.memmap) and array.filename is not None and array.flags.c_contiguous and array.mode != "c":
        # A view of the mapped array has a later position in the file.
        root: Any = array
        while isinstance(root.base, np.ndarray):
            root = root.base
        offset = int(root.offset) + array.ctypes.data - root.ctypes.data
        return MappedLines(
            shape=array.shape, place=Path(array.filename).resolve(), dtype=array.dtype.str, offset=offset
        )
    values = as_array(name, array)
    return MemoryLines(shape=values.shape, array=values)


def _hdf5(array: Any, is_result: bool) -> Lines:
    if is_result or array.file.mode != "r":
        return MemoryLines(shape=array.shape, array=array)  # an HDF5 file with a writer cannot have readers
    place = Path(array.file.filename).resolve()
    return Hdf5Lines(shape=tuple(array.shape), place=place, dataset=str(array.name))
