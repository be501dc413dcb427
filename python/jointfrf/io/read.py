"""Measured FRFs of any file: what it is, is told by its content."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, head_of
from jointfrf.frf.frf_set import FrfSet
from jointfrf.frf.merge import merge_frfs
from jointfrf.io.arrays import FrfArrays, as_frf_set
from jointfrf.io.csv_file import csv_arrays
from jointfrf.io.hdf5_file import hdf5_arrays
from jointfrf.io.mapping import FrfMapping, as_mapping
from jointfrf.io.mat_file import mat_arrays
from jointfrf.io.npz_file import npz_arrays
from jointfrf.io.quantity import check_quantity
from jointfrf.io.uff import read_uff_part
from jointfrf.kernel.arguments import as_nodes

__all__ = ["FORMATS", "read_frfs"]

#: What can be read, and the usual suffixes.
FORMATS = {
    "Universal File": (".uff", ".unv"),
    "MATLAB": (".mat",),
    "NPZ": (".npz",),
    "HDF5": (".h5", ".hdf5"),
    "CSV": (".csv", ".txt"),
}
_HDF5 = b"\x89HDF\r\n\x1a\n"
#: Beginnings of files that are something else, and what is said of them.
_OTHERS = (
    (b"\x93NUMPY", "is an NPY file, one array without frequencies: save an NPZ file, or use frfs_of_arrays"),
    (b"\x80\x02", "is a pickle, which is not read because that can run any program: save an NPZ file"),
    (b"\x80\x03", "is a pickle, which is not read because that can run any program: save an NPZ file"),
    (b"\x80\x04", "is a pickle, which is not read because that can run any program: save an NPZ file"),
    (b"\x80\x05", "is a pickle, which is not read because that can run any program: save an NPZ file"),
    (b"\x1f\x8b", "is compressed by gzip: unpack it"),
    (b"TDSm", "is a TDMS file: export a Universal File"),
)


class _Wanted(NamedTuple):
    """What the user says of the files."""

    quantity: str | None
    forced: bool
    nodes: frozenset[int] | None
    mapping: FrfMapping
    is_part: bool
    limit_gb: float | None


def read_frfs(
    *paths: str | PathLike[str],
    quantity: str | None = None,
    force_quantity: bool = False,
    nodes: Collection[int] | None = None,
    mapping: Mapping[str, Any] | FrfMapping | None = None,
    averages: ArrayLike | None = None,
    limit_gb: float | None = None,
) -> FrfSet:
    """Read measured FRFs from one file or several of one test.

    Parameters
    ----------
    *paths : path-like
        Universal Files, MATLAB files (version 4 to 7; 7.3 needs h5py), NPZ files (own layout, scripts, sdynpy), HDF5
        files (own layout, scripts), text tables. What a file is, is told by its content, not by its name.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        What the FRFs are, where the files do not say it.
    force_quantity : bool
        Take `quantity` also where a file says something else.
    nodes : collection of int, optional
        Only FRFs between these nodes.
    mapping : mapping, optional
        Which field of a MATLAB, NPZ or HDF5 file is what, where it has other names than the usual ones: keys
        ``freq_hz``, ``h``, ``responses``, ``excitations``, ``quantity``, ``unit``, ``coherence``, ``averages`` (names
        of fields, ``test.frf`` inside a structure; channels also as their names), ``axes`` (``out,in,freq``).
    averages : number or array_like, shape (n_responses, n_excitations), optional
        Number of averages, where the files do not say it.
    limit_gb : float, optional
        What one file may be large, and its content take in memory, GB. Default: the environment variable
        JOINTFRF_FILE_LIMIT_GB, or else 16 GB of file, and 1 GB, or 10 times the size of the file, of content.

    Returns
    -------
    FrfSet
        In SI units, with coherence, number of averages and coordinates where a file holds them; of several files,
        `merge_frfs`.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        A file is of an unknown format, damaged, lacks something, or contradicts `quantity` or another file.
    MissingPackageError
        A package for the format is not installed.
    ValueError
        An argument is wrong.

    Warns
    -----
    FileContentWarning
        Something had to be assumed or left out.

    Examples
    --------
    >>> import jointfrf.io
    >>> frfs = jointfrf.io.read_frfs("hammer.mat", mapping={"h": "FRF", "axes": "out,in,freq"})  # doctest: +SKIP
    >>> print(frfs)  # doctest: +SKIP
    """
    check_quantity(quantity)
    if not paths:
        raise ValueError("no file is named")
    kept = None if nodes is None else frozenset(as_nodes("nodes", nodes))
    wanted = _Wanted(quantity, force_quantity, kept, as_mapping(mapping), len(paths) > 1, limit_gb)
    sets = [_read(Path(path), wanted) for path in paths]
    merged = merge_frfs(sets)
    if not merged.measured.any():
        raise FileContentError(f"{merged.source}: there is no FRF")
    return merged if averages is None else replace(merged, averages=np.asarray(averages))


def _read(path: Path, wanted: _Wanted) -> FrfSet:
    """Read one file."""
    reader = _reader(path, head_of(path, wanted.limit_gb))
    if reader is None:
        return read_uff_part(
            path,
            wanted.quantity,
            force_quantity=wanted.forced,
            nodes=wanted.nodes,
            limit_gb=wanted.limit_gb,
            coherence_will_do=wanted.is_part,
            stacklevel=5,
        )
    content = reader(path, wanted.mapping, ReadLimit(path, wanted.limit_gb))
    found = as_frf_set(content, str(path), wanted.quantity, forced=wanted.forced, stacklevel=5)
    return found if wanted.nodes is None else found.at_nodes(wanted.nodes)


def _reader(path: Path, head: bytes) -> Callable[[Path, FrfMapping, ReadLimit], FrfArrays] | None:
    """Reader of a file by how it begins; None for a Universal File."""
    suffix = path.suffix.lower()
    if head.startswith(b"MATLAB "):
        return mat_arrays
    if any(head[place:].startswith(_HDF5) for place in (0, 512, 1024, 2048, 4096)):
        return hdf5_arrays
    if head.startswith(b"PK"):
        return npz_arrays
    for beginning, sentence in _OTHERS:
        if head.startswith(beginning):
            raise FileContentError(f"{path} {sentence}")
    first = next((line for line in head.splitlines() if line.strip()), b"")
    if first.strip() == b"-1" or suffix in FORMATS["Universal File"]:
        return None
    if suffix in FORMATS["MATLAB"]:  # version 4 has no mark
        return mat_arrays
    is_text = head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" not in head
    if is_text and any(mark in first for mark in (b",", b";", b"\t", b"#")):
        return _csv
    raise FileContentError(f"{path} is of an unknown format; known are {_known()}")


def _csv(path: Path, _: FrfMapping, limit: ReadLimit) -> FrfArrays:
    return csv_arrays(path, limit)


def _known() -> str:
    names: Sequence[str] = [f"{name} ({' '.join(suffixes)})" for name, suffixes in FORMATS.items()]
    return f"{', '.join(names[:-1])} and {names[-1]}"
