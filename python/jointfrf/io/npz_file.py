"""NPZ files."""

from __future__ import annotations

import io
import tokenize
import zipfile
import zlib
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from jointfrf.choices import FRF_FORMATS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, damage_named, write_file
from jointfrf.frf.frf_set import FrfSet
from jointfrf.io.file_format import FileFormat, FrfArrays, Reading
from jointfrf.io.named_arrays import arrays_of_fields, fields_of

__all__ = ["NPZ", "npy_array", "npz_fields", "write_npz"]


def npz_fields(path: Path, limit: ReadLimit, file: BinaryIO | None = None) -> dict[str, NDArray[Any]]:
    """Return all arrays of an NPZ file; `file` is the same file if it is open.

    Raises
    ------
    FileContentError
        The file is damaged, contains Python objects, or exceeds the limit.
    """
    with (
        damage_named(path, "an NPZ file", zipfile.BadZipFile, zlib.error, tokenize.TokenError),
        zipfile.ZipFile(file or path) as archive,
    ):
        return {
            info.filename.removesuffix(".npy"): _member(archive, info, path, limit)
            for info in archive.infolist()
            if info.filename.endswith(".npy")
        }


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, path: Path, limit: ReadLimit) -> NDArray[Any]:
    with archive.open(info) as member:
        return npy_array(cast(BinaryIO, member), info.file_size, str(path), info.filename, limit)


def npy_array(file: BinaryIO, size: int, where: str, name: str, limit: ReadLimit) -> NDArray[Any]:
    """Return one array after a check of its stated size against the bytes in the file, and the limit.

    Parameters
    ----------
    file : file
        File, open at the beginning of the array.
    size : int
        Number of bytes to the end of the array.
    where, name : str
        Names of the file and of the array, for messages.
    limit : ReadLimit
        Limit of memory.
    """
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file)
    if dtype.hasobject:
        raise FileContentError(
            f"{where} contains Python objects ({name}), which could run any program; save plain arrays"
        )
    count = int(np.prod(shape, dtype=object))
    if size != file.tell() + dtype.itemsize * count:
        stated = " x ".join(map(str, shape))
        raise FileContentError(f"{where} is damaged: {name} has not the {stated} values that it states; write it again")
    limit.take(max(dtype.itemsize, 1) * count)
    file.seek(0)
    return np.asarray(np.lib.format.read_array(file, allow_pickle=False))


def write_npz(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs as an NPZ file in the own layout.

    Parameters
    ----------
    path : path-like
        Name of the file, in a folder that exists; an older file is replaced as a whole or not at all.
    frfs : FrfSet
        FRFs to write, with coherence, number of averages and coordinates if they are known.

    Raises
    ------
    ValueError
        There is no FRF, or one is NaN or infinite on some lines only.
    OSError
        The file cannot be written; nothing is left behind.

    See Also
    --------
    read_frfs : read the FRFs again.
    write_frfs : write in the format of the suffix.

    Notes
    -----
    The arrays are in SI units:

    - ``jointfrf_frfs``: 2, the number of the layout
    - ``freq_hz`` (n_freq)
    - ``h`` complex (n_freq, n_responses, n_excitations), NaN if there is no FRF
    - ``responses`` and ``excitations``: texts such as ``102:+y``
    - ``quantity`` (text: receptance, mobility, accelerance) and ``unit`` (text)
    - ``coherence`` (shape of h) and ``averages`` (n_responses, n_excitations), if known
    - ``nodes`` (n) and ``coordinates`` (n, 3) in m, if known
    - ``sha256``: a checksum of all arrays, by which a reader detects a damaged file

    Merged sets have these arrays of `SetUps` in addition:

    - ``setups``: names
    - ``setup_of`` (n_responses, n_excitations)
    - ``setup_gains`` (2): of one set-up, NaN if not stated, and common
    - ``setup_repeats`` (n, 3) and ``setup_repeated`` (n_freq, n)

    Layout 1 is the same without ``sha256``, for files that you write or edit with a separate program.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from jointfrf.io import Channel, FrfSet, read_frfs, write_npz
    >>> point = (Channel(1, "+y"),)
    >>> frfs = FrfSet(np.array([10.0, 20.0]), point, point, np.array([[[1.0 + 2.0j]], [[3.0]]]), "mobility")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "point.npz"
    ...     write_npz(path, frfs)
    ...     read_frfs(path).h[:, 0, 0].tolist()
    [(1+2j), (3+0j)]
    """
    content = io.BytesIO()
    np.savez_compressed(content, **fields_of(frfs))  # type: ignore[arg-type]
    write_file(Path(path), content.getvalue())


def _read(path: Path, limit: ReadLimit, reading: Reading) -> FrfArrays:
    fields = {name: value.item() if value.ndim == 0 else value for name, value in npz_fields(path, limit).items()}
    return arrays_of_fields(fields, reading.mapping, str(path), limit)


NPZ = FileFormat(
    name=FRF_FORMATS["npz_file"].name,
    suffixes=FRF_FORMATS["npz_file"].suffixes,
    content="own layout; arrays of scripts; `NDDataArray.save` of sdynpy",
    has_mark=lambda head: head.startswith(b"PK"),
    read=_read,
    write=write_npz,
    keeps_setups=True,
)
