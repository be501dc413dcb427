"""MATLAB files. Versions 5 to 7 are read here, after checking every stated size against the file; 7.3 is HDF5."""

from __future__ import annotations

import io
import math
import zlib
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.choices import FRF_FORMATS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, damage_named, write_file
from jointfrf.frf.frf_set import FrfSet
from jointfrf.io.file_format import FileFormat, FrfArrays, Reading
from jointfrf.io.hdf5_file import hdf5_fields
from jointfrf.io.named_arrays import arrays_of_fields, fields_of

__all__ = ["MATLAB", "mat_fields", "write_mat"]

#: Bytes of the header; its beginning, and the beginning of the header of version 7.3.
_HEAD, _MARK, _MARK_HDF5 = 128, b"MATLAB ", b"MATLAB 7.3"
#: Types of variables.
_MATRIX, _COMPRESSED = 14, 15
#: Types of elements as types of numpy.
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
#: Types of texts: their encoding, and bytes of a character.
_TEXTS = {1: ("latin-1", 1), 2: ("latin-1", 1), 3: ("utf-16", 2), 4: ("utf-16", 2), 16: ("utf-8", 1),
          17: ("utf-16", 2), 18: ("utf-32", 4)}  # fmt: skip
#: Classes of arrays.
_CELL, _STRUCT, _OBJECT, _CHAR, _OPAQUE = 1, 2, 3, 4, 17
#: Classes of arrays of numbers as types of numpy.
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
#: The flag of complex numbers.
_COMPLEX = 0x800
#: Largest depth of cells: more than a sound file has, few enough for the stack.
_DEEPEST = 20


def mat_fields(path: Path, limit: ReadLimit) -> dict[str, Any]:
    """Return all variables by name.

    Parameters
    ----------
    path : Path
        Name of a MATLAB file that is not HDF5.
    limit : ReadLimit
        Limit of memory.

    Returns
    -------
    dict of str
        Arrays without axes of length 1, single values as such, texts; structures are mappings, several of them lists,
        cells arrays of objects. None for types that have no meaning here: sparse matrices, functions, tables.

    Raises
    ------
    FileContentError
        The file is damaged, or exceeds the limit.
    """
    with damage_named(path, "a MATLAB file", zlib.error):
        content = path.read_bytes()
        if content[126:_HEAD] in (b"IM", b"MI") and 0 not in content[:4]:
            return _variables(content, limit)
        if content.startswith(_MARK):
            raise ValueError("it ends inside its header, or the header is damaged")
    raise FileContentError(f"{path} is no MATLAB file of version 5 or later; save it with the option -v7")


def _variables(content: bytes, limit: ReadLimit) -> dict[str, Any]:
    """Return the variables of version 5 to 7."""
    order: Literal["little", "big"] = "little" if content[126:_HEAD] == b"IM" else "big"
    place, found = _HEAD, dict[str, Any]()
    while place < len(content):
        kind, size = (int.from_bytes(content[at : at + 4], order) for at in (place, place + 4))
        start, place = place + 8, place + 8 + size
        if place > len(content) or kind not in (_MATRIX, _COMPRESSED):
            raise ValueError("it ends inside a variable, or one is damaged")
        whole = memoryview(content)[start:place]
        if kind == _COMPRESSED:
            whole = _unpacked(whole, order, limit)
        name, value = _Arrays(order, limit).array(whole, 0)
        if name:
            found[name] = value
    return found


def _unpacked(packed: memoryview, order: Literal["little", "big"], limit: ReadLimit) -> memoryview:
    """Unpack a variable, at most to its stated size; its checksum is compared at the end."""
    unpacker = zlib.decompressobj()
    tag = unpacker.decompress(packed, 8)
    kind, size = (int.from_bytes(tag[at : at + 4], order) for at in (0, 4))
    if len(tag) < 8 or kind != _MATRIX:
        raise ValueError("a compressed variable is damaged")
    limit.take(size)
    content = unpacker.decompress(unpacker.unconsumed_tail, size) if size else b""
    rest = b"" if unpacker.eof else unpacker.decompress(unpacker.unconsumed_tail, 8)
    if len(content) != size or len(rest) == 8 or not unpacker.eof:
        raise ValueError("it ends inside a compressed variable")
    return memoryview(content)


class _Element(NamedTuple):
    """A part of a variable: its type, its bytes."""

    kind: int
    data: memoryview


class _Arrays:
    """Arrays of one variable."""

    def __init__(self, order: Literal["little", "big"], limit: ReadLimit) -> None:
        self.order, self.limit = order, limit
        self.sign = "<" if order == "little" else ">"

    def elements(self, whole: memoryview) -> list[_Element]:
        """Return the elements of an array, none beyond its end."""
        found, place = [], 0
        while place + 8 <= len(whole):
            kind = int.from_bytes(whole[place : place + 4], self.order)
            size = int.from_bytes(whole[place + 4 : place + 8], self.order)
            start, end = place + 8, place + 8 + size
            place = end + -size % 8
            if kind >> 16:  # a short one: its size in the upper half, its bytes in the place of the size
                kind, size = kind & 0xFFFF, kind >> 16
                start, end, place = start - 4, start - 4 + size, start
            if end > len(whole) or (place == start and size > 4):
                raise ValueError("a variable is damaged: a part of it reaches beyond its end")
            found.append(_Element(kind, whole[start:end]))
        return found

    def array(self, whole: memoryview, depth: int) -> tuple[str, Any]:
        """Return the name and the value of an array."""
        if depth > _DEEPEST:
            raise ValueError("it has cells inside cells without end")
        self.limit.take(0)
        if not len(whole):
            return "", np.zeros(0)
        parts = self.elements(whole)
        if len(parts) < 2 or parts[0].kind != 6 or len(parts[0].data) != 8:
            raise ValueError("a variable is damaged: its type is missing")
        flags = int.from_bytes(parts[0].data[:4], self.order)
        kind = flags & 0xFF
        if kind == _OPAQUE or len(parts) < 3:
            return _name(parts[1]), None
        shape, name, rest = self.shape(parts[1]), _name(parts[2]), parts[3:]
        if kind == _CELL:
            return name, self.cells(rest, shape, depth)
        if kind in (_STRUCT, _OBJECT):
            return name, self.structures(rest[kind == _OBJECT :], shape, depth)
        if kind == _CHAR:
            return name, self.text(rest, shape)
        return name, self.numbers(rest, shape, _CLASSES[kind], bool(flags & _COMPLEX)) if kind in _CLASSES else None

    def shape(self, part: _Element) -> tuple[int, ...]:
        found = self.values(part).tolist() if part.kind == 5 else []
        if len(found) < 2 or len(found) > 32 or min(found) < 0:
            raise ValueError("a variable is damaged: it has no sizes")
        return tuple(found)

    def values(self, part: _Element) -> NDArray[Any]:
        """Return the numbers of an element in their own type."""
        if part.kind not in _NUMBERS:
            raise ValueError(f"a variable is damaged: there is no type {part.kind} of numbers")
        kind = np.dtype(self.sign + _NUMBERS[part.kind])
        if len(part.data) % kind.itemsize:
            raise ValueError("a variable is damaged: it ends inside a number")
        return np.frombuffer(part.data, kind)

    def numbers(self, parts: list[_Element], shape: tuple[int, ...], kind: str, is_complex: bool) -> Any:
        count = math.prod(shape)
        found = [self.values(part) for part in parts[: 1 + is_complex]]
        if len(found) < 1 + is_complex or any(each.size != count for each in found):
            raise ValueError(f"a variable is damaged: it does not contain the {_by(shape)} values that it states")
        self.limit.take(count * np.dtype(kind).itemsize * (1 + is_complex))
        real = found[0].astype(kind)
        return _squeezed(_complex(real, found[1].astype(kind)) if is_complex else real, shape)

    def text(self, parts: list[_Element], shape: tuple[int, ...]) -> Any:
        """Return a text, or rows of texts, which are stored column by column."""
        count = math.prod(shape)
        if not parts or parts[0].kind not in _TEXTS:
            raise ValueError("a variable is damaged: a text of no known type")
        codec, unit = _TEXTS[parts[0].kind]
        ending = "" if unit == 1 else "-le" if self.order == "little" else "-be"
        self.limit.take(4 * len(parts[0].data))
        letters = bytes(parts[0].data).decode(codec + ending, "replace")
        if shape[0] == 1 and len(shape) == 2 and unit * count == len(parts[0].data):
            return letters if count else np.array([], "U1")
        if len(letters) != count:
            raise ValueError(f"a variable is damaged: it does not contain the {_by(shape)} letters that it states")
        if not count:
            return np.array([], "U1")
        rows = ["".join(letters[row :: shape[0]]) for row in range(shape[0])]
        return rows[0] if len(rows) == 1 else np.array(rows)

    def cells(self, parts: list[_Element], shape: tuple[int, ...], depth: int) -> Any:
        values = self.inner(parts, math.prod(shape), depth)
        found = np.empty(len(values), object)
        for place, value in enumerate(values):
            found[place] = value
        cells = _squeezed(found, shape)
        return list(values) if isinstance(cells, np.ndarray) and cells.ndim == 1 and _is_mapping(values) else cells

    def structures(self, parts: list[_Element], shape: tuple[int, ...], depth: int) -> Any:
        if len(parts) < 2 or parts[0].kind != 5 or len(parts[0].data) != 4:
            raise ValueError("a variable is damaged: a structure without names")
        length, held = int(self.values(parts[0])[0]), bytes(parts[1].data)
        if length < 1 or len(held) % length:
            raise ValueError("a variable is damaged: the names of a structure do not fit their length")
        names = [_word(held[at : at + length]) for at in range(0, len(held), length)]
        count = math.prod(shape)
        values = self.inner(parts[2:], count * len(names), depth)
        found = [dict(zip(names, values[i * len(names) :], strict=False)) for i in range(count if names else 0)]
        return found[0] if count == 1 and found else found

    def inner(self, parts: list[_Element], count: int, depth: int) -> list[Any]:
        """Return arrays inside an array."""
        if len(parts) != count or any(part.kind != _MATRIX for part in parts):
            raise ValueError(f"a variable is damaged: it does not contain the {count} parts that it states")
        return [self.array(part.data, depth + 1)[1] for part in parts]


def _name(part: _Element) -> str:
    return _word(bytes(part.data))


def _word(held: bytes) -> str:
    return held.partition(b"\0")[0].decode("latin-1")


def _complex(real: NDArray[Any], imaginary: NDArray[Any]) -> NDArray[Any]:
    found = np.empty(real.size, np.result_type(real.dtype, np.complex64))
    found.real, found.imag = real, imaginary
    return found


def _squeezed(values: NDArray[Any], shape: tuple[int, ...]) -> Any:
    """Return an array, stored column by column, without axes of length 1; a single value as such."""
    if values.size != math.prod(shape):
        raise ValueError(f"a variable is damaged: it does not contain the {_by(shape)} values that it states")
    if not values.size:
        return values
    found = values.reshape(shape, order="F").squeeze()
    return found if found.ndim else found.item()


def _is_mapping(values: list[Any]) -> bool:
    return bool(values) and isinstance(values[0], dict)


def _by(shape: tuple[int, ...]) -> str:
    return " x ".join(map(str, shape))


def _read(path: Path, limit: ReadLimit, reading: Reading) -> FrfArrays:
    with path.open("rb") as file:
        is_hdf5 = file.read(len(_MARK_HDF5)) == _MARK_HDF5
    fields = hdf5_fields(path, limit) if is_hdf5 else mat_fields(path, limit)
    is_own = {"jointfrf_frfs", "h"} <= set(fields) and not reading.mapping.names_frfs
    mapping = replace(reading.mapping, axes=reading.mapping.axes or "freq,out,in") if is_own else reading.mapping
    found = arrays_of_fields(fields, mapping, str(path), limit, keeps_shapes=False)
    if is_own and {"nodes", "coordinates"} <= set(fields):
        nodes, places = (np.asarray(fields[name]) for name in ("nodes", "coordinates"))
        if nodes.dtype.kind not in "iuf" or places.dtype.kind not in "iuf" or places.size != 3 * nodes.size:
            raise FileContentError(f"{path}: coordinates do not contain three numbers for each of {nodes.size} nodes")
        found.coordinates = {int(node): place for node, place in zip(nodes.ravel(), places.reshape(-1, 3), strict=True)}
    return found


def write_mat(path: str | PathLike[str], frfs: FrfSet) -> None:
    """Write measured FRFs as a MATLAB file of version 5.

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
    write_frfs : write in the format of the suffix, with an example.

    Notes
    -----
    The variables are in SI units:

    - ``freq_hz`` (lines x 1)
    - ``h`` (lines x responses x excitations), NaN if there is no FRF
    - ``responses`` and ``excitations``, columns of cells with names such as ``102:+y``
    - ``quantity`` and ``unit``
    - ``coherence``, ``averages``, ``nodes``, ``coordinates`` if they are known
    """
    import scipy.io

    fields = {name: value for name, value in fields_of(frfs).items() if not name.startswith(("setup", "sha256"))}
    for name in ("responses", "excitations"):
        fields[name] = fields[name].astype(object)[:, None]
    content = io.BytesIO()
    scipy.io.savemat(content, fields | {"freq_hz": frfs.freq_hz[:, None]}, oned_as="column", do_compression=True)
    write_file(Path(path), content.getvalue())


MATLAB = FileFormat(
    name=FRF_FORMATS["mat_file"].name,
    suffixes=FRF_FORMATS["mat_file"].suffixes,
    content="versions 5 to 7.3: `write_mat`; structures of Simcenter Testlab; arrays of scripts",
    has_mark=lambda head: head.startswith(_MARK),
    looks_alike=lambda path, _: path.suffix.lower() == ".mat",
    read=_read,
    write=write_mat,
    needs="`jointfrf[hdf5]` for version 7.3",
)
