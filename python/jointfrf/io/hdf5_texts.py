"""Texts of variable length of an HDF5 file, read by hand: of damaged ones the HDF5 library crashes or hangs."""

from __future__ import annotations

import os
import zlib
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from jointfrf.files import ReadLimit

__all__ = ["hdf5_texts"]

#: A text as a dataset holds it: its length, and where it stands: in which heap, as which of its objects.
_PLACE = np.dtype([("length", "<u4"), ("heap", "<u8"), ("index", "<u4")])
_HEAP, _HEAP_HEAD, _OBJECT_HEAD = b"GCOL", 16, 16
_NOWHERE = 2**64 - 1
#: Filters that are undone here.
_DEFLATE, _SHUFFLE = 1, 2


def hdf5_texts(h5py: Any, item: Any, path: Path, limit: ReadLimit) -> list[str]:
    """Read the texts of a dataset.

    Parameters
    ----------
    h5py : module
    item : h5py.Dataset
        Of texts of variable length.
    path : Path
        Its file.
    limit : ReadLimit

    Returns
    -------
    list of str
        In C order.

    Raises
    ------
    ValueError
        They are damaged, or stored in a way that is not read.
    FileContentError
        They take more than the limit.
    """
    if item.file.id.get_create_plist().get_sizes() != (8, 8):
        raise ValueError("its texts are stored in an unusual way: save texts of a fixed length")
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
    """Return where the texts stand."""
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
        raise ValueError("its texts are stored in an unusual way: save texts of a fixed length")
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
            raise ValueError("its texts are compressed in an unusual way: save texts of a fixed length")
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
            raise ValueError("its texts are damaged: one is not where it is said to be")
        return self._read[heap][index]

    def _objects(self, start: int) -> dict[int, bytes]:
        whole = os.fstat(self.file.fileno()).st_size
        self.file.seek(min(start, whole))
        head = self.file.read(_HEAP_HEAD)
        size = int.from_bytes(head[8:], "little")
        if len(head) < _HEAP_HEAD or not head.startswith(_HEAP) or not _HEAP_HEAD <= size <= whole - start:
            raise ValueError("its texts are damaged: there is no heap where one is said to be")
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
