"""Formats of files of FRFs; `read_frfs` and `write_frfs`, which detect the format of a file."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.choices import FRF_FORMATS, format_names
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.extras import MissingPackageError, load_plugin, plugin_call, plugins
from jointfrf.files import ReadLimit, head_of
from jointfrf.frf.frf_set import FrfSet
from jointfrf.frf.merge import merge_frfs
from jointfrf.io.arrays import as_frf_set
from jointfrf.io.file_format import TIME_DATA, FileFormat, FrfArrays, FrfMapping, Reading
from jointfrf.io.pyfbs import with_named_files

__all__ = ["FORMATS", "check_suffix", "read_frf_sets", "read_frfs", "write_frfs"]


def _format_of(module: str) -> FileFormat:
    """Return the format that a module defines."""
    values = vars(import_module(f"jointfrf.io.{module}")).values()
    return next(value for value in values if isinstance(value, FileFormat))


#: All formats, in the order in which their marks are checked.
FORMATS = tuple(map(_format_of, FRF_FORMATS))
#: Entry points by which other packages add formats; they are checked if a file has none of the above formats.
_PLUGINS = "jointfrf.formats"
#: Why a pickle is an error.
_PICKLE = "is a pickle, which could run any program; save an NPZ file"
#: Remedy for files of LabVIEW.
_FRFS_WANTED = f", which is not read; export its FRFs as a Universal File or CSV; {TIME_DATA}"
#: First bytes of files that are not read, and the remedy.
_OTHERS = (
    *((b"\x80" + bytes([protocol]), _PICKLE) for protocol in (2, 3, 4, 5)),
    (b"\x1f\x8b", "is compressed by gzip; unpack it"),
    (b"TDSm", f"is a TDMS file of LabVIEW{_FRFS_WANTED}"),
    (b"RIFF", f"is a WAV file or another of time data; {TIME_DATA}"),
    (b"LabVIEW Measurement", f"is an LVM file of LabVIEW{_FRFS_WANTED}"),
)


def check_suffix(path: str | PathLike[str]) -> FileFormat:
    """Return the format in which a file of this name is written.

    Raises
    ------
    ValueError
        No format that is written has this suffix.
    """
    written = {suffix: each for each in FORMATS if each.write is not None for suffix in each.suffixes}
    suffix = Path(path).suffix.lower()
    if suffix in written:
        return written[suffix]
    found, broken = _of_plugin(lambda each: each.write is not None and suffix in each.suffixes)
    if found is None:
        raise ValueError(f"{path} has no suffix of a format that is written; use one of {', '.join(written)}{broken}")
    return found


def _of_plugin(is_wanted: Callable[[FileFormat], bool]) -> tuple[FileFormat | None, str]:
    """Return the wanted format of another package, or the errors of those that fail, to end a sentence."""
    broken = ""
    for entry in plugins(_PLUGINS):
        try:
            found = load_plugin(entry, lambda each: isinstance(each, FileFormat), "a jointfrf.io.FileFormat")
            if plugin_call(entry, lambda found=found: is_wanted(found)):
                write = found.write and partial(plugin_call, entry, found.write)
                return replace(found, read=partial(plugin_call, entry, found.read), write=write), ""
        except (FileContentError, MissingPackageError) as error:
            broken += f"; {error}"
    return None, broken


def write_frfs(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs in the format of the suffix: ``.uff``, ``.npz``, ``.h5``, ``.csv``, ...

    Parameters
    ----------
    path : path-like
        Name of the file, in a folder that exists; an older file is replaced as a whole or not at all.
    frfs : FrfSet
        FRFs to write, with all further data that the format can contain.

    Raises
    ------
    ValueError
        No format that is written has this suffix; there is no FRF, or one is NaN or infinite on some lines only.
    MissingPackageError
        A package for the format is not installed.
    OSError
        The file cannot be written; nothing is left behind.

    Warns
    -----
    FileContentWarning
        The format cannot contain the set-ups of a set that was merged.

    See Also
    --------
    read_frfs : read the FRFs again.
    frfs_of_arrays : FRFs of arrays.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np, jointfrf as jf
    >>> frfs = jf.io.frfs_of_arrays([10.0, 20.0], np.ones((2, 1, 1)), ["1:y"], ["1:y"], unit="m/N")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder) / "point.csv"
    ...     jf.io.write_frfs(path, frfs)
    ...     jf.io.read_frfs(path).h[:, 0, 0].real.tolist()
    [1.0, 1.0]
    """
    kind = check_suffix(path)
    assert kind.write is not None
    kind.write(Path(path), frfs)
    if isinstance(frfs, FrfSet) and frfs.setups is not None and not kind.keeps_setups:
        keeping = ", ".join(each.suffixes[0] for each in FORMATS if each.keeps_setups)
        message = f"{path} does not contain the set-up of each FRF and repeated FRFs; {keeping} do"
        warnings.warn(message, FileContentWarning, stacklevel=2)


def read_frfs(
    *paths: str | PathLike[str],
    quantity: str | None = None,
    force_quantity: bool = False,
    nodes: Collection[int] | None = None,
    mapping: Mapping[str, Any] | FrfMapping | None = None,
    averages: ArrayLike | None = None,
    limit_gb: float | None = None,
    unit: str = "",
    skip_lines: int = 0,
) -> FrfSet:
    """Return measured FRFs from one file or several files of one test.

    Parameters
    ----------
    *paths : path-like
        Names of Universal Files, MATLAB files (version 5 to 7; 7.3 needs h5py), NPZ files (own layout, scripts,
        sdynpy), HDF5 files (own layout, scripts), text tables. The content, not the name, determines the format.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity of the FRFs, if the files do not state it.
    force_quantity : bool
        Whether `quantity` and `unit` replace contradicting statements of a file, default False.
    nodes : collection of int, optional
        Nodes between which FRFs are read; all by default.
    mapping : mapping, optional
        Fields of a MATLAB, NPZ or HDF5 file with other names than the usual ones, and data that a file of any format
        lacks, see `FrfMapping`: ``{"h": "test.frf", "axes": "out,in,freq"}``, ``{"direction": "z"}``,
        ``{"components": "frame:0,arm:1000"}``, ``{"responses": "101:z,201:z", "excitations": "101:z"}``.
    averages : number or array_like, shape (n_responses, n_excitations), optional
        Number of averages, if the files do not state it.
    limit_gb : float, optional
        Largest size of one file, and of its content in memory, GB. Default: the environment variable
        JOINTFRF_FILE_LIMIT_GB, or else 16 GB of file, and 1 GB, or 10 times the size of the file, of content.
    unit : str
        Unit of the FRFs, if the files do not state it or state it in a way that is not understood: ``g/N``,
        ``mm/kN``, ``dB re 1 m/N`` (magnitudes of text tables). Other units with their names, between commas:
        ``g/N, frequency=kHz, phase=rad, coordinates=mm``.
    skip_lines : int
        Number of lines before the heading of a text table, default 0.

    Returns
    -------
    FrfSet
        FRFs in SI units, with coherence, number of averages and coordinates if a file contains them; for several files,
        the result of `merge_frfs`.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        A file is of an unknown format, damaged, lacks something such as a unit, or contradicts `quantity`, `unit` or
        another file.
    MissingPackageError
        A package for the format is not installed.
    ValueError
        An argument is wrong, or has no effect on any of the files.

    Warns
    -----
    FileContentWarning
        Lines, FRFs or other data were omitted.

    See Also
    --------
    write_frfs : write FRFs, with an example that runs.
    read_channel_table : places of the channels.

    Examples
    --------
    >>> import jointfrf.io
    >>> frfs = jointfrf.io.read_frfs("hammer.mat", mapping={"h": "FRF", "axes": "out,in,freq"})  # doctest: +SKIP
    >>> print(frfs)  # doctest: +SKIP
    """
    reading = Reading.checked(
        quantity, force_quantity, nodes, mapping, len(paths) > 1, unit=unit, skip_lines=skip_lines
    )
    sets = _read_all(paths, reading, limit_gb)
    reading.warn()
    merged = merge_frfs(sets)
    if not merged.measured.any():
        raise FileContentError(f"{merged.source}: there is no FRF")
    return merged if averages is None else replace(merged, averages=np.asarray(averages))


def read_frf_sets(
    *paths: str | PathLike[str],
    quantity: str | None = None,
    force_quantity: bool = False,
    mapping: Mapping[str, Any] | FrfMapping | None = None,
    unit: str = "",
    skip_lines: int = 0,
) -> list[FrfSet]:
    """Return FRFs of several structures, one set for each file; arguments and errors as in `read_frfs`."""
    reading = Reading.checked(quantity, force_quantity, None, mapping, unit=unit, skip_lines=skip_lines)
    sets = _read_all(paths, reading, None)
    reading.warn()
    for one in sets:
        if not one.measured.any():
            raise FileContentError(f"{one.source}: there is no FRF")
    return sets


def _read_all(paths: Sequence[str | PathLike[str]], reading: Reading, limit_gb: float | None) -> list[FrfSet]:
    """Read files; raise an error for statements of the user without effect on any of them."""
    if not paths:
        raise ValueError("no file is named")
    sets, taken = [], set[str]()
    for path in map(Path, paths):
        found, takes = _read(path, reading, limit_gb)
        sets.append(found)
        taken |= set(reading.options if takes is None else takes)
    reading.check_options(taken, ", ".join(map(str, paths)))
    return sets


def _read(path: Path, reading: Reading, limit_gb: float | None) -> tuple[FrfSet, Collection[str] | None]:
    """Read one file; return also the options with effect."""
    kind = _detected(path, head_of(path, limit_gb))
    reading, tables = with_named_files(path, reading, limit_gb)
    found, takes = kind.read(path, ReadLimit(path, limit_gb), reading), kind.takes
    if isinstance(found, FrfArrays):
        takes = kind.takes if found.takes is None else found.takes
        if tables is not None and takes is not None and "responses" in takes:
            takes = {*takes, "coordinates"}
            found.coordinates = {} if tables.oblique else tables.coordinates
        found = as_frf_set(found, str(path), reading)
        found = found if reading.nodes is None else found.at_nodes(reading.nodes)
    if not isinstance(found, FrfSet):  # from a plugin
        raise FileContentError(f"{path}: its reader returned a {type(found).__name__}, no FrfArrays and no FrfSet")
    return found, takes


def _detected(path: Path, head: bytes) -> FileFormat:
    """Return the format of a file: by a mark in its first bytes; by its appearance; else the format of a plugin."""
    found, broken = next((each for each in FORMATS if each.has_mark(head)), None), ""
    refusal = next((sentence for beginning, sentence in _OTHERS if head.startswith(beginning)), "")
    if found is None and not refusal:
        found = next((each for each in FORMATS if each.looks_alike(path, head)), None)
    if found is None:
        found, broken = _of_plugin(lambda each: each.has_mark(head) or each.looks_alike(path, head))
    if found is None:
        refusal = refusal or f"is of an unknown format; use one of {format_names()}"
        raise FileContentError(f"{path} {refusal}{broken}")
    return found
