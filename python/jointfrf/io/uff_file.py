"""A Universal File as numbered datasets, with what there is to say about it."""

from __future__ import annotations

import struct
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from jointfrf.errors import FileContentError
from jointfrf.extras import import_extra
from jointfrf.files import HEAD
from jointfrf.io.uff_index import Dataset, index_datasets
from jointfrf.io.units import UnitSystem

__all__ = ["UniversalFile", "name_some"]

_NUMBERS_SHOWN = 5
#: What pyuff runs into where a file is damaged; it raises a bare `Exception` instead, for these and for any other.
_DAMAGE = (ValueError, LookupError, ArithmeticError, struct.error)
_Answer = TypeVar("_Answer")


class UniversalFile:
    """A file divided into datasets, which are counted from 1 as their users count them.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is no Universal File; every method raises it where the file is damaged.
    """

    def __init__(self, path: Path) -> None:
        pyuff = import_extra("pyuff")
        self.path = path
        self._notes: dict[str, list[int]] = {}
        self._systems: dict[int, UnitSystem] | None = None
        index, is_cut = index_datasets(path)
        if not index:
            raise self.error(
                "ends inside its first dataset" if is_cut else "is not a Universal File: no dataset delimiters (-1)"
            )
        self.types = [dataset.kind for dataset in index]
        for number, kind in enumerate(self.types, start=1):
            if kind <= 0:
                raise self.error(f"is damaged: dataset {number} has no type, a delimiter (-1) is missing before it")
        self._reader = _reader(pyuff, path, index)
        self._headers = _reader(pyuff, path, [each._replace(end=min(each.end, each.start + HEAD)) for each in index])
        if is_cut:
            self.note("ends inside a dataset, which is left out", len(self.types) + 1)

    def error(self, sentence: str) -> FileContentError:
        """Exception whose message is the file's name and a sentence about it."""
        return FileContentError(f"{self.path} {sentence}")

    def note(self, sentence: str, *datasets: int) -> None:
        """Keep something for the user to know about some datasets."""
        self._notes.setdefault(sentence, []).extend(datasets)

    def notes(self) -> list[str]:
        """Every note once, with the datasets it is about."""
        return [f"{self.path}: {text} ({name_some('dataset', datasets)})" for text, datasets in self._notes.items()]

    def datasets(self, *kinds: int) -> list[int]:
        """Numbers of the datasets of some types."""
        return [number for number, kind in enumerate(self.types, start=1) if kind in kinds]

    def read(self, dataset: int, header_only: bool = False) -> dict[str, Any]:
        """Content of a dataset."""
        sentence = f"is damaged: dataset {dataset} (type {self.types[dataset - 1]}) cannot be read"
        reader = self._headers if header_only else self._reader
        content: dict[str, Any] = self._ask(sentence, lambda: reader.read_sets(dataset - 1, header_only=header_only))
        return content

    def unit_system(self, dataset: int) -> UnitSystem | None:
        """Units of a dataset: the last dataset 164 before it, else the first of the file, else None."""
        if self._systems is None:
            self._systems = {number: self._read_unit_system(number) for number in self.datasets(164)}
        before = [system for number, system in self._systems.items() if number < dataset]
        return before[-1] if before else next(iter(self._systems.values()), None)

    def _read_unit_system(self, dataset: int) -> UnitSystem:
        content = self.read(dataset)
        for name in ("length", "force"):
            if not 1e-30 < content[name] < 1e30:
                raise self.error(f"has the {name} factor {content[name]:g} in its units (dataset {dataset})")
        return UnitSystem(content["length"], content["force"])

    def _ask(self, sentence: str, question: Callable[[], _Answer]) -> _Answer:
        """Ask pyuff; where the file is why it has no answer, the error is a sentence about the file."""
        outside = sys.exc_info()[1]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return question()
        except Exception as error:
            if not _is_damage(error, outside):
                raise
            raise self.error(sentence) from error


def _reader(pyuff: Any, path: Path, index: Sequence[Dataset]) -> Any:
    """Reader of pyuff that takes datasets from where the index says and does not read the whole file to find them."""

    class Indexed(pyuff.UFF):
        def refresh(self) -> bool:
            self._block_ind = np.array([(each.start, each.end - 1) for each in index])
            self._n_sets = len(index)
            self._set_types = np.array([each.kind for each in index])
            self._set_formats = np.zeros(len(index))
            self._refreshed = True
            return True

    return Indexed(str(path))


def _is_damage(error: BaseException, outside: BaseException | None) -> bool:
    """Whether pyuff stopped because of the file. `outside` is what its caller was handling already."""
    if type(error) is not Exception:
        return False
    while error.__context__ is not None and error.__context__ is not outside:
        error = error.__context__
    return type(error) is Exception or isinstance(error, _DAMAGE)


def name_some(what: str, numbers: Sequence[int]) -> str:
    """Name the first few of some things, as in ``datasets 3, 4 and 12 more``."""
    more = f" and {len(numbers) - _NUMBERS_SHOWN} more" if len(numbers) > _NUMBERS_SHOWN else ""
    return f"{what}{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers[:_NUMBERS_SHOWN]))}{more}"
