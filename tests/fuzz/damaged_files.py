"""Files of FRFs of every format, damaged: read as far as they go, or refused in one sentence that names the file.

What carries a checksum of its content (NPZ and HDF5 of our own, and whatever zip and deflate check) must never give
other numbers without a word. Of text and plain binary numbers nobody can know: there a changed digit is counted, no
more.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import jointfrf as jf
from frf_files import FREQ_HZ, frf_set, full_set, names, structure_of_testlab, write_mat, write_mat73, write_sdynpy
from jointfrf.io import FrfSet, read_frfs, write_csv, write_hdf5, write_npz, write_uff
from uff_exporters import EXPORTERS

from .part import BrokenError

__all__ = ["DamagedFiles"]

#: Formats in which no changed byte may go unseen.
_CHECKED = {"own.npz", "own.h5"}
#: One in so many cases: a file that is tried in a process of its own first takes half a second.
_SLOW = {"plain.mat": 400, "script73.mat": 3, "own.h5": 2}
_LONGEST_MESSAGE = 500


def _makers() -> dict[str, Callable[[Path], Any]]:
    given = frf_set()
    fields = {"f": FREQ_HZ, "H": given.h, "responses": names(given.responses), "excitations": names(given.excitations),
              "unit": "m/s^2/N"}  # fmt: skip
    uneven = FrfSet(FREQ_HZ**1.1, given.responses, given.excitations, given.h, given.quantity)
    makers: dict[str, Callable[[Path], Any]] = {
        "text.uff": lambda path: write_uff(path, full_set(), binary=False),
        "binary.uff": lambda path: write_uff(path, full_set()),
        "single.uff": lambda path: write_uff(path, full_set(), single=True),
        "uneven.uff": lambda path: write_uff(path, uneven),
        "own.npz": lambda path: write_npz(path, full_set()),
        "sdynpy.npz": lambda path: write_sdynpy(path, given),
        "own.h5": lambda path: write_hdf5(path, full_set()),
        "script.mat": lambda path: write_mat(path, **fields),
        "plain.mat": lambda path: write_mat(path, compressed=False, **fields),
        "testlab.mat": lambda path: write_mat(path, FRF=structure_of_testlab(given)),
        "script73.mat": lambda path: write_mat73(path, **fields),
        "table.csv": lambda path: write_csv(path, full_set()),
    }
    for name, content in EXPORTERS.items():
        makers[f"{name}.uff"] = lambda path, content=content: path.write_bytes(content())
    return makers


class DamagedFiles:
    """Random damage."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.sound: dict[str, bytes] = {}
        self.read: dict[str, Any] = {}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for name, make in _makers().items():
                path = folder / name
                make(path)
                self.sound[name] = path.read_bytes()
                self.read[name] = _content(read_frfs(path, unit="m/s^2/N", force_quantity=True))
        self.names = sorted(self.sound)
        weights = np.array([1.0 / _SLOW.get(name, 1) for name in self.names])
        self.edges = np.cumsum(weights / weights.sum())

    def run(self, random: np.random.Generator) -> str:
        """Damage one file and read it."""
        name = self.names[min(int(np.searchsorted(self.edges, random.random())), len(self.names) - 1)]
        content = _damaged(self.sound[name], name, random)
        path = self.folder / f"damaged {name}"
        path.write_bytes(content)
        with warnings.catch_warnings(record=True) as reported:
            warnings.simplefilter("always")
            try:
                found = read_frfs(path, unit="m/s^2/N", force_quantity=True)
            except (jf.FileContentError, FileNotFoundError) as error:
                message = str(error)
                if "\n" in message or len(message) > _LONGEST_MESSAGE or path.name not in message:
                    raise BrokenError(f"{name}: {message!r}") from None
                return "refused"
            except Exception as error:
                raise BrokenError(f"{name}: {type(error).__name__}: {str(error)[:300]}") from None
        foreign = [each for each in reported if not issubclass(each.category, jf.FileContentWarning)]
        if foreign:
            raise BrokenError(f"{name}: {foreign[0].category.__name__}: {foreign[0].message}")
        if _same(_content(found), self.read[name]):
            return "read, the same content"
        if name in _CHECKED:
            raise BrokenError(f"{name}: other content without a word")
        return "read with a warning" if reported else "read, other content that no checksum guards"


def _content(found: FrfSet) -> tuple[Any, ...]:
    places = sorted((node, tuple(place)) for node, place in found.coordinates.items())
    return (found.freq_hz, found.h, found.responses, found.excitations, found.quantity, found.coherence, found.averages,
            places)  # fmt: skip


def _same(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    for a, b in zip(one, other, strict=True):
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
            if a.shape != b.shape or not np.array_equal(a, b, equal_nan=True):
                return False
        elif (not isinstance(a, np.ndarray) and isinstance(b, np.ndarray)) or isinstance(a, np.ndarray) or a != b:
            return False
    return True


def _damaged(sound: bytes, name: str, random: np.random.Generator) -> bytes:
    content = bytearray(sound)
    if name.endswith((".uff", ".csv")) and random.random() < 0.4:
        return _damaged_lines(sound, random)
    for _ in range(int(random.integers(1, 4))):
        place = int(random.integers(len(content)))
        length = int(random.integers(1, 17))
        kind = random.integers(6)
        if kind == 0:
            content[place] ^= 1 << int(random.integers(8))
        elif kind == 1:
            content[place : place + length] = random.bytes(length)
        elif kind == 2:
            del content[place : place + length]
        elif kind == 3:
            content[place:place] = random.bytes(length)
        elif kind == 4:
            other = int(random.integers(len(content)))
            content[place : place + length] = content[other : other + length]
        else:
            del content[place:]
        if not content:
            return b""
    return bytes(content)


def _damaged_lines(sound: bytes, random: np.random.Generator) -> bytes:
    """Damage a text as people and programs do: lines lost, doubled, exchanged, fields of another kind."""
    lines = sound.split(b"\n")
    place, other = (int(each) for each in random.integers(len(lines), size=2))
    kind = random.integers(8)
    if kind == 0:
        del lines[place]
    elif kind == 1:
        lines.insert(place, lines[other])
    elif kind == 2:
        lines[place], lines[other] = lines[other], lines[place]
    elif kind == 3:
        lines[place] = lines[place][: int(random.integers(80))]
    elif kind in (4, 5):
        words = lines[place].split(b" ")
        words[int(random.integers(len(words)))] = [b"nan", b"-1", b"1e999", b"99999999999", b"x", b"", b"1,5", b"0"][
            random.integers(8)
        ]
        lines[place] = b" ".join(words)
    elif kind == 6:
        return sound.replace(b"\n", b"\r\n")
    else:
        lines = lines[: place + 1]
    return b"\n".join(lines)
