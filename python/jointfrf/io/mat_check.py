"""Whether a MATLAB file of version 5 is whole, before it is given to a reader that a damaged one may crash."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import BinaryIO, Literal

__all__ = ["check_variables"]

#: Where the first variable begins, and the types of a variable and of a compressed one.
_FIRST, _PLAIN, _COMPRESSED = 128, 14, 15
_CHUNK = 1 << 20


def check_variables(path: Path) -> bool:
    """Look at the variables of a file.

    Parameters
    ----------
    path : Path
        A MATLAB file that is not HDF5.

    Returns
    -------
    bool
        Whether checksums of all variables have been found right; not where one is not compressed, and in files of
        version 4, which have none.

    Raises
    ------
    ValueError
        A variable is cut short, or is none.
    zlib.error
        A compressed variable is damaged.
    """
    size, place, is_checked = path.stat().st_size, _FIRST, True
    with path.open("rb") as file:
        head = file.read(_FIRST)
        if not head.startswith(b"MATLAB"):
            return False
        order: Literal["little", "big"] = "little" if head.endswith(b"IM") else "big"
        if size < _FIRST or not head.endswith((b"IM", b"MI")):
            raise ValueError("it ends inside its header, or the header is damaged")
        while place < size:
            file.seek(place)
            tag = file.read(8)
            kind, length = (int.from_bytes(part, order) for part in (tag[:4], tag[4:]))
            if place + 8 + length > size or kind not in (_PLAIN, _COMPRESSED):
                raise ValueError("it ends inside a variable, or one is damaged")
            if kind == _COMPRESSED:
                _check_compressed(file, length)
            is_checked &= kind == _COMPRESSED
            place += 8 + length
    return is_checked


def _check_compressed(file: BinaryIO, length: int) -> None:
    """Unpack a variable piece by piece, which compares its checksum."""
    unpacker = zlib.decompressobj()
    while length > 0 and not unpacker.eof:
        piece = file.read(min(length, _CHUNK))
        length -= len(piece)
        while piece and not unpacker.eof:
            unpacker.decompress(piece, _CHUNK)
            piece = unpacker.unconsumed_tail
    if not unpacker.eof:
        raise ValueError("it ends inside a compressed variable")
