"""FRFs in HDF5 files: the own layout, arrays of scripts, and MATLAB files of version 7.3."""

from __future__ import annotations

import io
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.errors import FileContentError, first_line
from jointfrf.extras import import_extra
from jointfrf.files import write_file
from jointfrf.frf.frf_set import FrfSet
from jointfrf.io.arrays import FrfArrays
from jointfrf.io.layout import fields_of, is_own, own_arrays
from jointfrf.io.mapping import FrfMapping, mapped_arrays
from jointfrf.io.trial import survives

__all__ = ["hdf5_arrays", "hdf5_fields", "write_hdf5"]

_UNREADABLE = (OSError, ValueError, KeyError, TypeError, RuntimeError, MemoryError, OverflowError)
#: More than this, deflate cannot make of a byte.
_MOST_COMPRESSED = 1100
_DEEPEST = 20
_TRIAL = "import h5py, sys\nwith h5py.File(sys.argv[1]) as file: [file[name][()] for name in sys.argv[2:]]"


def hdf5_arrays(path: Path, mapping: FrfMapping) -> FrfArrays:
    """Read an HDF5 file in the own layout, or with arrays under the names of a mapping.

    Raises
    ------
    FileContentError
        The file is damaged or lacks something.
    MissingPackageError
        The package h5py is not installed.
    """
    fields = hdf5_fields(path)
    return own_arrays(fields, str(path)) if is_own(fields) else mapped_arrays(fields, mapping, str(path))


def hdf5_fields(path: Path) -> dict[str, Any]:
    """Read all datasets; groups are mappings inside.

    Parameters
    ----------
    path : Path
        An HDF5 file. What MATLAB wrote (by its attributes) comes back as MATLAB has it: axes in its order, texts as
        texts, cells as lists.

    Returns
    -------
    dict of str
    """
    h5py = import_extra("h5py")
    try:
        with h5py.File(path, "r") as file:
            _check_texts(h5py, file, path)
            return _group(h5py, file, path, 0)
    except FileContentError:
        raise
    except _UNREADABLE as error:
        raise FileContentError(f"{path} cannot be read as an HDF5 file: {first_line(error)}") from error


def _check_texts(h5py: Any, file: Any, path: Path) -> None:
    """Read texts of variable length in another process first: of damaged ones the HDF5 library crashes or hangs."""
    found: list[str] = []

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind == "O" and h5py.check_string_dtype(item.dtype):
            found.append(name)

    file.visititems(note)
    if found and not survives(_TRIAL, str(path), *found):
        raise FileContentError(f"{path} is damaged: its texts cannot be read")


def _group(h5py: Any, group: Any, path: Path, depth: int) -> dict[str, Any]:
    if depth > _DEEPEST:
        raise FileContentError(f"{path} has groups inside groups without end")
    return {name: _value(h5py, item, path, depth) for name, item in group.items() if not name.startswith("#")}


def _value(h5py: Any, item: Any, path: Path, depth: int) -> Any:
    if isinstance(item, h5py.Group):
        return _group(h5py, item, path, depth + 1)
    if not isinstance(item, h5py.Dataset):
        return None
    if item.shape is None:
        return np.zeros(0)
    if item.nbytes > _MOST_COMPRESSED * path.stat().st_size or (
        item.compression is None and item.nbytes > path.stat().st_size
    ):
        size = " x ".join(map(str, item.shape))
        raise FileContentError(f"{path} is damaged: {item.name} does not hold the {size} values that it states")
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
    if h5py.check_ref_dtype(item.dtype) is not None:
        references = item[()].ravel(order="F" if not kind else "C")
        return [_value(h5py, item.file[reference], path, depth + 1) for reference in references if reference]
    value = item[()]
    if item.dtype.names == ("real", "imag"):
        value = value["real"] + 1j * value["imag"]
    if kind:
        if item.attrs.get("MATLAB_empty", 0):
            return "" if kind == "char" else np.zeros(0)
        if kind == "char":
            return _matlab_text(value)
        return np.asarray(value).T.squeeze()  # MATLAB knows no fewer than two axes
    return _text(value)


def _matlab_text(codes: Any) -> Any:
    rows = ["".join(map(chr, row)).rstrip() for row in np.atleast_2d(np.asarray(codes).T)]
    return rows[0] if len(rows) == 1 else rows


def _text(value: Any) -> Any:
    """Texts as texts, however they were stored."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray) and value.dtype.kind in "SO":
        return np.array(
            [each.decode("utf-8", "replace") if isinstance(each, bytes) else str(each) for each in value.ravel()]
        )
    return value


def write_hdf5(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs as an HDF5 file: the datasets have the names and shapes of the arrays of `write_npz`.

    Parameters
    ----------
    path : path-like
        In a folder that exists; an older file is replaced as a whole or not at all.
    frfs : FrfSet
        The FRFs, with coherence, number of averages and coordinates where they are known.

    Raises
    ------
    ValueError
        There is no FRF, or one is NaN or infinite on some lines only.
    MissingPackageError
        The package h5py is not installed.
    OSError
        The file cannot be written; nothing is left behind.

    Notes
    -----
    Complex numbers are compounds of ``r`` and ``i``, as h5py writes them; texts have a fixed length.
    """
    h5py = import_extra("h5py")
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        for name, value in fields_of(frfs).items():
            fixed = np.char.encode(value, "ascii") if value.dtype.kind == "U" else value
            file.create_dataset(name, data=fixed, compression="gzip" if value.dtype.kind in "fc" else None)
    write_file(Path(path), content.getvalue())
