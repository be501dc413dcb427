"""FRFs in NPZ files: the own layout, arrays of scripts, and functions of sdynpy."""

from __future__ import annotations

import io
import tokenize
import zipfile
import zlib
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError, first_line
from jointfrf.files import ReadLimit, write_file
from jointfrf.frf.frf_set import FrfSet
from jointfrf.io.arrays import FrfArrays
from jointfrf.io.labels import channels_of
from jointfrf.io.layout import fields_of, is_own, own_arrays
from jointfrf.io.loose import LooseFunction, arrays_of_functions
from jointfrf.io.mapping import FrfMapping, mapped_arrays

__all__ = ["npz_arrays", "npz_fields", "write_npz"]

_UNREADABLE = (OSError, ValueError, KeyError, EOFError, MemoryError, NotImplementedError, RuntimeError,
               zipfile.BadZipFile, zlib.error, tokenize.TokenError)  # fmt: skip
_FRF = 4


def npz_arrays(path: Path, mapping: FrfMapping, limit: ReadLimit) -> FrfArrays:
    """Read an NPZ file.

    Parameters
    ----------
    path : Path
        In the own layout; of sdynpy (`NDDataArray.save`: structured array ``data``, ``function_type`` 4); or with
        arrays under the names of `mapping`. Python objects are not read.
    mapping : FrfMapping
        For files that are not in the own layout.
    limit : ReadLimit

    Returns
    -------
    FrfArrays

    Raises
    ------
    FileContentError
        The file is damaged, holds Python objects, or lacks something.
    """
    fields = {name: value.item() if value.ndim == 0 else value for name, value in npz_fields(path, limit).items()}
    where = str(path)
    if is_own(fields):
        return own_arrays(fields, where)
    data = fields.get("data")
    if isinstance(data, np.ndarray) and set(data.dtype.names or ()) >= {"abscissa", "ordinate", "coordinate"}:
        return _of_sdynpy(data, fields.get("function_type"), where, limit)
    return mapped_arrays(fields, mapping, where)


def npz_fields(path: Path, limit: ReadLimit) -> dict[str, NDArray[Any]]:
    """Read all arrays of an NPZ file.

    Raises
    ------
    FileContentError
        The file is damaged, holds Python objects, or more than the limit.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return {
                info.filename.removesuffix(".npy"): _array(archive, info, path, limit)
                for info in archive.infolist()
                if info.filename.endswith(".npy")
            }
    except FileContentError:
        raise
    except _UNREADABLE as error:
        raise FileContentError(f"{path} cannot be read as an NPZ file: {first_line(error)}") from error


def _array(archive: zipfile.ZipFile, info: zipfile.ZipInfo, path: Path, limit: ReadLimit) -> NDArray[Any]:
    """Read one array after a look at whether the file holds as much as it says, and at how much that is."""
    with archive.open(info) as member:
        version = np.lib.format.read_magic(member)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = read(member)
        if dtype.hasobject:
            raise FileContentError(
                f"{path} holds Python objects ({info.filename}), which are not read because that can run any program: "
                "save plain arrays"
            )
        count = int(np.prod(shape, dtype=object))
        if info.file_size != member.tell() + dtype.itemsize * count:
            size = " x ".join(map(str, shape))
            raise FileContentError(f"{path} is damaged: {info.filename} does not hold the {size} values that it states")
        limit.take(max(dtype.itemsize, 1) * count)
    with archive.open(info) as member:
        return np.asarray(np.lib.format.read_array(member, allow_pickle=False))


def _of_sdynpy(data: NDArray[Any], function_type: Any, where: str, limit: ReadLimit) -> FrfArrays:
    """Functions with response, then reference as their coordinates."""
    if function_type != _FRF:
        raise FileContentError(f"{where} holds functions of type {function_type} of sdynpy, not FRFs (type {_FRF})")
    functions = []
    for row in data.ravel():
        try:
            channels = [channels_of("coordinates", [place])[0] for place in _places(row["coordinate"])]
        except (ValueError, TypeError) as error:
            raise FileContentError(f"{where} {error}") from error
        if len(channels) != 2:
            raise FileContentError(f"{where} has functions without one response and one reference each")
        functions.append(LooseFunction(channels[0], channels[1], np.ravel(row["abscissa"]), np.ravel(row["ordinate"])))
    return arrays_of_functions(functions, where, limit)


def _places(coordinate: Any) -> list[tuple[Any, Any]]:
    return [(each["node"], each["direction"]) for each in np.ravel(coordinate)]


def write_npz(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs as an NPZ file in the own layout.

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
    OSError
        The file cannot be written; nothing is left behind.

    Notes
    -----
    The arrays, SI units: ``jointfrf_frfs`` (2, the number of the layout), ``freq_hz`` (n_freq), ``h`` complex
    (n_freq, n_responses, n_excitations), NaN where there is no FRF, ``responses`` and ``excitations`` (texts such as
    ``102:+y``), ``quantity`` (text: receptance, mobility, accelerance), ``unit`` (text); where known ``coherence``
    (shape of h), ``averages`` (n_responses, n_excitations), ``nodes`` (n) and ``coordinates`` (n, 3) in m;
    ``sha256``, a checksum of all of these, by which a reader sees a damaged file. Layout 1 is the same without it:
    what a program of one's own writes or edits.

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
