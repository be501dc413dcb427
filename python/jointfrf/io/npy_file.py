"""NPY files: one array without names, whose axes the user states."""

from __future__ import annotations

import tokenize
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from jointfrf.choices import FRF_FORMATS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, damage_named
from jointfrf.io.file_format import TIME_DATA, FileFormat, FrfArrays, Reading
from jointfrf.io.named_arrays import arrays_of_fields
from jointfrf.io.npz_file import npy_array

__all__ = ["NPY", "npy_values"]


def npy_values(path: Path, limit: ReadLimit) -> NDArray[Any]:
    """Return the array of an NPY file.

    Raises
    ------
    FileContentError
        The file is damaged, contains Python objects, or more than the limit.
    """
    with damage_named(path, "an NPY file", tokenize.TokenError), path.open("rb") as file:
        return npy_array(file, path.stat().st_size, str(path), "its array", limit)


def _read(path: Path, limit: ReadLimit, reading: Reading) -> FrfArrays:
    """Return FRFs; a matrix of them needs its axes, which the array does not name."""
    values, mapping = npy_values(path, limit), reading.mapping
    held = " x ".join(map(str, values.shape))
    if values.dtype.kind != "c":
        raise FileContentError(
            f"{path} contains {held} real numbers, FRFs are complex; if these are time data, {TIME_DATA}; put "
            "parts of FRFs into an NPZ file"
        )
    if sum(n != 1 for n in values.shape) > 2 and mapping.axes is None:
        raise FileContentError(f"{path} contains {held} numbers; give mapping axes=freq,out,in or their other order")
    if mapping.h is not None:
        raise FileContentError(f"{path} contains one array without a name; leave out mapping h=")
    return arrays_of_fields({"h": values}, mapping, str(path), limit)


NPY = FileFormat(
    name=FRF_FORMATS["npy_file"].name,
    suffixes=FRF_FORMATS["npy_file"].suffixes,
    content="one array with stated axes, as users of pyFBS save it",
    has_mark=lambda head: head.startswith(b"\x93NUMPY"),
    read=_read,
)
