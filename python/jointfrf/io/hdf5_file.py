"""HDF5 files, including MATLAB files of version 7.3."""

from __future__ import annotations

import io
import os
import zlib
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from jointfrf.choices import FRF_FORMATS
from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import ReadLimit, damage_named, write_file
from jointfrf.frf.frf_set import FrfSet
from jointfrf.io.file_format import FileFormat, FrfArrays, Reading
from jointfrf.io.named_arrays import arrays_of_fields, fields_of

__all__ = ["HDF5", "hdf5_fields", "hdf5_texts", "write_hdf5"]

#: Largest ratio of inflated to deflated bytes: 1032 by the definition of deflate, and a margin.
_MOST_COMPRESSED = 1100
#: Largest depth of groups and of links: more than a sound file has, few enough for the stack.
_DEEPEST, _MOST_LINKS = 20, 20
#: Filters that are undone here, by their numbers in the format.
_DEFLATE, _SHUFFLE = 1, 2
#: Largest number of bytes of memory of a letter of MATLAB, including intermediate results.
_LETTER = 50
#: A text in a dataset: its length, the place of its heap, and its number in the heap.
_PLACE = np.dtype([("length", "<u4"), ("heap", "<u8"), ("index", "<u4")])
#: The signature of a heap; bytes before its objects and before each of them.
_HEAP, _HEAP_HEAD, _OBJECT_HEAD = b"GCOL", 16, 16
#: The place of the heap of an empty text.
_NOWHERE = 2**64 - 1


def hdf5_fields(path: Path, limit: ReadLimit) -> dict[str, Any]:
    """Return all datasets; groups are mappings inside, structure arrays of MATLAB lists of them.

    Parameters
    ----------
    path : Path
        Name of the HDF5 file. Content written by MATLAB (by its attributes) is returned as in MATLAB: axes in its
        order, texts as texts, cells as lists.
    limit : ReadLimit
        Limit of memory.

    Returns
    -------
    dict of str
        Datasets by name; None for data that are not numbers or texts.

    Raises
    ------
    FileContentError
        The file is damaged, exceeds the limit, or refers to another file, which is not read.
    MissingPackageError
        The package h5py is not installed.
    """
    h5py = import_extra("h5py")
    with damage_named(path, "an HDF5 file", zlib.error), h5py.File(path, "r") as file:
        found: dict[str, Any] = _Hdf5(h5py, path, limit).group(file, 0)
        return found


class _Hdf5:
    """Reads one file; position and size of each dataset are checked before it is read."""

    def __init__(self, h5py: Any, path: Path, limit: ReadLimit) -> None:
        self.h5py, self.path, self.limit = h5py, path, limit
        self.size = path.stat().st_size

    def elsewhere(self, name: str) -> FileContentError:
        return FileContentError(
            f"{self.path} takes {name!r} from another file, which is not read; copy it into this one"
        )

    def group(self, group: Any, depth: int) -> Any:
        """Return the members of a group; for a structure array of MATLAB a list of structures."""
        if depth > _DEEPEST:
            raise FileContentError(f"{self.path} has groups inside groups without end; write it again")
        items = {name: self.opened(group, name) for name in group if not name.startswith("#")}
        found = {name: self.value(item, depth) for name, item in items.items()}
        lengths = {len(value) if isinstance(value, list) else -1 for value in found.values()}
        if self.matlab(group, "MATLAB_class") != "struct" or len(lengths) != 1 or min(lengths) < 1:
            return found
        if any(self.matlab(item, "MATLAB_class") for item in items.values()):  # cells
            return found
        return [dict(zip(found, values, strict=True)) for values in zip(*found.values(), strict=True)]

    def opened(self, group: Any, name: str, links: int = 0) -> Any:
        """Return the target of a link inside the file."""
        link = group.get(name, getlink=True)
        if isinstance(link, self.h5py.ExternalLink):
            raise self.elsewhere(f"{group.name.rstrip('/')}/{name}")
        if not isinstance(link, self.h5py.SoftLink):
            return group[name]
        if links > _MOST_LINKS:
            raise FileContentError(f"{self.path} has links to links without end; write it again")
        found = group.file if link.path.startswith("/") else group
        for part in link.path.split("/"):
            if part in ("", "."):
                continue
            if not isinstance(found, self.h5py.Group) or part not in found:
                return None
            found = self.opened(found, part, links + 1)
        return found

    def value(self, item: Any, depth: int) -> Any:
        self.limit.take(0)
        if isinstance(item, self.h5py.Group):
            return self.group(item, depth + 1)
        if not isinstance(item, self.h5py.Dataset):
            return None
        settings = item.id.get_create_plist()
        if settings.get_layout() == self.h5py.h5d.VIRTUAL or settings.get_external_count():
            raise self.elsewhere(item.name)
        if item.shape is None:
            return np.zeros(0)
        self.check_size(item, settings)
        kind = self.matlab(item, "MATLAB_class")
        if self.h5py.check_string_dtype(item.dtype) is not None and item.dtype.kind == "O":
            texts = hdf5_texts(self.h5py, item, self.path, self.limit)
            return np.array(texts) if item.shape else texts[0]
        if self.h5py.check_ref_dtype(item.dtype) is self.h5py.Reference:
            references = item[()].ravel(order="F" if not kind else "C") if item.shape else np.array([item[()]])
            return [self.value(item.file[reference], depth + 1) for reference in references if reference]
        if item.dtype.hasobject:
            return None
        value = item[()]
        if item.dtype.names == ("real", "imag"):
            value = value["real"] + 1j * value["imag"]
        if kind:
            if self.matlab(item, "MATLAB_empty"):
                return "" if kind == "char" else np.zeros(0)
            if kind == "char":
                self.limit.take(_LETTER * item.size)
                return _matlab_text(value)
            return np.asarray(value).T.squeeze()  # MATLAB has at least two axes
        return _text(value)

    def check_size(self, item: Any, settings: Any) -> None:
        """Check the size that a dataset states against the size of the file and the limit."""
        if item.nbytes > _MOST_COMPRESSED * self.size or (item.compression is None and item.nbytes > self.size):
            size = " x ".join(map(str, item.shape))
            raise FileContentError(
                f"{self.path} is damaged: {item.name} does not contain the {size} values that it states; write it again"
            )
        self.limit.take(max(item.nbytes, item.size))
        filters = [settings.get_filter(number)[0] for number in range(settings.get_nfilters())]
        if filters and item.chunks:
            self.check_chunks(item, filters)

    def check_chunks(self, item: Any, filters: list[int]) -> None:
        """Check chunks that decompress to more than their size, for which the library would allocate memory."""
        chunk = item.dtype.itemsize * int(np.prod(item.chunks, dtype=object))
        self.limit.take(chunk)
        large = (self.limit.bytes - chunk) / _MOST_COMPRESSED
        if item.id.get_storage_size() <= large:
            return
        for number in range(item.id.get_num_chunks()):
            about = item.id.get_chunk_info(number)
            if about.size > large:
                mask, packed = item.id.read_direct_chunk(about.chunk_offset)
                first = filters.index(_DEFLATE) if _DEFLATE in filters else -1
                if first < 0 or mask >> first & 1:
                    continue
                if len(zlib.decompressobj().decompress(packed, chunk + 5)) > chunk + 4:
                    raise FileContentError(
                        f"{self.path} is damaged: {item.name} decompresses to more than it states; write it again"
                    )

    def matlab(self, item: Any, name: str) -> str:
        """Return a short attribute as a text; a longer one, or of variable length, is not MATLAB's."""
        h5a = self.h5py.h5a
        if not h5a.exists(item.id, name.encode()):
            return ""
        attribute = h5a.open(item.id, name.encode())
        is_short = attribute.shape in ((), (1,)) and attribute.dtype.itemsize <= _LETTER
        if attribute.dtype.kind not in "Siu" or not is_short:
            return ""
        found = np.zeros(attribute.shape, attribute.dtype)
        attribute.read(found)
        value = found.ravel()[0]
        return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value or "")


def _matlab_text(codes: Any) -> Any:
    rows = ["".join(map(chr, row)).rstrip() for row in np.atleast_2d(np.asarray(codes).T)]
    return rows[0] if len(rows) == 1 else rows


def _text(value: Any) -> Any:
    """Return texts as texts, however they were stored."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray) and value.dtype.kind in "SO":
        return np.array(
            [each.decode("utf-8", "replace") if isinstance(each, bytes) else str(each) for each in value.ravel()]
        )
    return value


def hdf5_texts(h5py: Any, item: Any, path: Path, limit: ReadLimit) -> list[str]:
    """Return the texts of variable length of a dataset without the HDF5 library, which damaged ones crash or hang.

    Parameters
    ----------
    h5py : module
        The package.
    item : h5py.Dataset
        Dataset of texts of variable length.
    path : Path
        Name of its file.
    limit : ReadLimit
        Limit of memory.

    Returns
    -------
    list of str
        Texts in C order.

    Raises
    ------
    ValueError
        They are damaged, or stored in a way that is not read.
    FileContentError
        They exceed the limit.
    """
    if item.file.id.get_create_plist().get_sizes() != (8, 8):
        raise ValueError("its texts are stored in an unusual way, not with a fixed length")
    limit.take(100 * item.size)
    found, taken = [], 0
    with path.open("rb") as file:
        heaps = _Heaps(file, item.file.userblock_size, limit)
        for length, heap, index in _places(h5py, item, file).ravel().tolist():
            text = heaps.text(heap, index)[:length] if length and heap != _NOWHERE else b""
            found.append(text.decode("utf-8", "replace"))
            taken += len(text)
            if taken > limit.bytes:
                limit.take(taken)
    return found


def _places(h5py: Any, item: Any, file: BinaryIO) -> NDArray[Any]:
    """Return the places of the texts."""
    settings = item.id.get_create_plist()
    layout, places = settings.get_layout(), np.zeros(item.shape, _PLACE)
    if not item.id.get_storage_size():
        return places
    if layout == h5py.h5d.CONTIGUOUS:
        file.seek(item.id.get_offset())
        held = file.read(places.nbytes)
        if len(held) < places.nbytes:
            raise ValueError("its texts lie beyond its end")
        return np.frombuffer(held, _PLACE).reshape(places.shape)
    if layout != h5py.h5d.CHUNKED:
        raise ValueError("its texts are stored in an unusual way, not with a fixed length")
    filters = [settings.get_filter(number)[0] for number in range(settings.get_nfilters())]
    for number in range(item.id.get_num_chunks()):
        corner = item.id.get_chunk_info(number).chunk_offset
        mask, packed = item.id.read_direct_chunk(corner)
        size = _PLACE.itemsize * int(np.prod(item.chunks, dtype=object))
        block = np.frombuffer(_unfiltered(packed, mask, filters, size), _PLACE).reshape(item.chunks)
        inside = tuple(slice(0, n - at) for at, n in zip(corner, item.shape, strict=True))
        here = tuple(slice(at, at + n) for at, n in zip(corner, item.chunks, strict=True))
        places[here] = block[inside]
    return places


def _unfiltered(packed: bytes, mask: int, filters: list[int], size: int) -> bytes:
    """Undo the filters of a chunk of a known size, the last first."""
    for number in reversed(range(len(filters))):
        if mask >> number & 1:
            continue
        if filters[number] == _DEFLATE:
            packed = zlib.decompressobj().decompress(packed, size + 1)
        elif filters[number] == _SHUFFLE:
            packed = np.frombuffer(packed, "u1").reshape(_PLACE.itemsize, -1).T.tobytes()
        else:
            raise ValueError("its texts are compressed in an unusual way, not with a fixed length")
    if len(packed) != size:
        raise ValueError("its texts are damaged")
    return packed


class _Heaps:
    """Heaps of a file, each read once."""

    def __init__(self, file: BinaryIO, base: int, limit: ReadLimit) -> None:
        self.file, self.base, self.limit = file, base, limit
        self._read: dict[int, dict[int, bytes]] = {}

    def text(self, heap: int, index: int) -> bytes:
        if heap not in self._read:
            self._read[heap] = self._objects(self.base + heap)
        if index not in self._read[heap]:
            raise ValueError("its texts are damaged: one is not at the place that is stated")
        return self._read[heap][index]

    def _objects(self, start: int) -> dict[int, bytes]:
        whole = os.fstat(self.file.fileno()).st_size
        self.file.seek(min(start, whole))
        head = self.file.read(_HEAP_HEAD)
        size = int.from_bytes(head[8:], "little")
        if len(head) < _HEAP_HEAD or not head.startswith(_HEAP) or not _HEAP_HEAD <= size <= whole - start:
            raise ValueError("its texts are damaged: there is no heap at the place that is stated")
        self.limit.take(size)
        held, place, found = head + self.file.read(size - _HEAP_HEAD), _HEAP_HEAD, dict[int, bytes]()
        while place + _OBJECT_HEAD <= size:
            index = int.from_bytes(held[place : place + 2], "little")
            length = int.from_bytes(held[place + 8 : place + 16], "little")
            place += _OBJECT_HEAD
            if index == 0:  # free space, up to the end
                break
            if place + length > size:
                raise ValueError("its texts are damaged: one reaches beyond its heap")
            found[index] = held[place : place + length]
            place += length + -length % 8
        return found


def write_hdf5(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs as an HDF5 file: the datasets have the names and shapes of the arrays of `write_npz`.

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
    MissingPackageError
        The package h5py is not installed.
    OSError
        The file cannot be written; nothing is left behind.

    See Also
    --------
    write_frfs : write in the format of the suffix, with an example.

    Notes
    -----
    Complex numbers are compounds of ``r`` and ``i``, as h5py writes them; texts have a fixed length.
    """
    h5py = import_extra("h5py")
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        for name, value in fields_of(frfs).items():
            fixed = np.char.encode(value, "utf-8") if value.dtype.kind == "U" else value
            file.create_dataset(name, data=fixed, compression="gzip" if value.dtype.kind in "fc" else None)
    write_file(Path(path), content.getvalue())


def _read(path: Path, limit: ReadLimit, reading: Reading) -> FrfArrays:
    return arrays_of_fields(hdf5_fields(path, limit), reading.mapping, str(path), limit)


#: Signature of the format, and its possible positions: at the beginning, or after a block of the user.
_SIGN, _PLACES = b"\x89HDF\r\n\x1a\n", (0, 512, 1024, 2048, 4096)
HDF5 = FileFormat(
    name=FRF_FORMATS["hdf5_file"].name,
    suffixes=FRF_FORMATS["hdf5_file"].suffixes,
    content="own layout; arrays of scripts",
    has_mark=lambda head: any(head[place:].startswith(_SIGN) for place in _PLACES),
    read=_read,
    write=write_hdf5,
    keeps_setups=True,
    needs="`jointfrf[hdf5]`",
    package="h5py",
)
