"""A TOML table read key by key: what is missing, wrong or unknown is one sentence that names file and key."""

from __future__ import annotations

import re
import reprlib
import sys
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from jointfrf.errors import FileContentError
from jointfrf.files import check_file
from jointfrf.spelling import look_alike

__all__ = ["Key", "KeyTable", "TomlTable", "read_toml"]

_T = TypeVar("_T")
_HERE = Path()
#: A longer name is not repeated in a message.
_LONG = 1000


@dataclass(frozen=True)
class Key:
    """A key of a table.

    Attributes
    ----------
    name : str
        ``DOF`` in it stands for the name of a joint DOF: ``k_DOF``.
    takes : str
        Type of the value, and what it must be: "number", "list of texts", "one of a, b".
    meaning : str
        What it is, in a few words.
    unit : str
        Empty for pure numbers and texts.
    default : str or None
        What holds where the key is absent; None if it must be there.
    inner : KeyTable or None
        Keys of the table that the key names; None for a value, and for a table with free names.
    """

    name: str
    takes: str
    meaning: str
    unit: str = ""
    default: str | None = None
    inner: KeyTable | None = None

    def matches(self, word: str) -> bool:
        """Whether a word in a file may be this key."""
        return re.fullmatch(re.escape(self.name).replace("DOF", ".+"), word) is not None


@dataclass(frozen=True)
class KeyTable:
    """The keys of a table.

    Attributes
    ----------
    header : str
        Its heading in a file: ``[frequency]``.
    about : str
        What the table is for; a sentence.
    keys : tuple of Key
    """

    header: str
    about: str
    keys: tuple[Key, ...]

    def __contains__(self, word: str) -> bool:
        return any(key.matches(word) for key in self.keys)

    def inner(self, word: str) -> KeyTable | None:
        """Return the keys of the table that a key names."""
        return next((key.inner for key in self.keys if key.matches(word)), None)


def read_toml(path: Path) -> TomlTable:
    """Read a TOML file; files that it names are relative to its folder.

    Raises
    ------
    FileContentError
        The file is missing, cannot be read, or is not TOML.
    """
    if path.exists():
        check_file(path)
    try:
        return TomlTable(tomllib.loads(path.read_text(encoding="utf-8")), str(path), path.parent)
    except OSError as error:
        raise FileContentError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise FileContentError(f"{path}: not a TOML file: {error}") from error


class TomlTable:
    """One table of a TOML file.

    Parameters
    ----------
    content : dict
        Keys and values.
    where : str
        File and table, for messages.
    folder : Path
        Folder to which file names of the table are relative.
    known : KeyTable, optional
        The keys that the table takes.

    Raises
    ------
    FileContentError
        There is a key that is not known.
    """

    def __init__(
        self, content: dict[str, Any], where: str, folder: Path = _HERE, known: KeyTable | None = None
    ) -> None:
        self._content = content
        self._asked: list[str] = []
        self.where = where
        self.folder = folder
        self.known: KeyTable | None = None
        if known is not None:
            self.expect(known)

    def expect(self, known: KeyTable) -> None:
        """Say which keys the table takes.

        Raises
        ------
        FileContentError
            There is another key.
        """
        self.known = known
        if self.known is not None:
            names = [key.name for key in self.known.keys]
            for key in self._content:
                if key not in self.known:
                    raise self.unknown(key, names)

    def __contains__(self, key: str) -> bool:
        self._ask(key)
        return key in self._content

    def _ask(self, key: str) -> None:
        if self.known is not None and key not in self.known:
            raise KeyError(f"{key!r} is not among the keys of {self.known.header}")  # a mistake of the reader
        if key not in self._asked:
            self._asked.append(key)

    def unknown(self, key: str, names: Sequence[str]) -> FileContentError:
        """Return the exception that says which keys there are instead of an unknown one."""
        similar = look_alike(key, names)
        hint = f"; did you mean {similar!r}?" if similar else ""
        return FileContentError(f"{self.where}: unknown key {key!r}; it takes {', '.join(names)}{hint}")

    @property
    def content(self) -> dict[str, Any]:
        """The keys and values of the file."""
        return self._content

    def keys(self) -> list[str]:
        """Return all keys."""
        return list(self._content)

    def error(self, key: str, must: str) -> FileContentError:
        """Return the exception that says what the value of a key must be."""
        return FileContentError(f"{self.where}: {key} must be {must}, not {reprlib.repr(self._content.get(key))}")

    def wrong(self, key: str, why: str) -> FileContentError:
        """Return the exception that says what is wrong with what a key names."""
        return FileContentError(f"{self.where}: {key}: {why}")

    def build(self, builder: Callable[[], _T], key: str = "") -> _T:
        """Call a builder; if it complains, the message names the table and, if given, the key.

        Raises
        ------
        FileContentError
            The builder raised a ValueError, a TypeError, an OSError or an ArithmeticError.
        """
        try:
            return builder()
        except (ValueError, TypeError, OSError, ArithmeticError) as error:
            where = f"{self.where}: {key}" if key else self.where
            why = "a number is too large or too small" if isinstance(error, ArithmeticError) else error
            raise FileContentError(f"{where}: {why}") from error

    def close(self) -> None:
        """Raise an error if there is a key that was not read."""
        unknown = [key for key in self._content if key not in self._asked]
        if unknown:
            raise self.unknown(unknown[0], self._asked)

    def value(self, key: str) -> Any:
        """Return the value of a key as the file has it."""
        self._ask(key)
        if key not in self._content:
            similar = look_alike(key, [other for other in self._content if other not in self._asked])
            hint = f"; is {similar!r} meant to be it?" if similar and self.known is None else ""
            raise FileContentError(f"{self.where}: the key {key!r} is missing{hint}")
        return self._content[key]

    def _inner(self, key: str) -> KeyTable | None:
        return None if self.known is None else self.known.inner(key)

    def text(self, key: str, choice: Sequence[str] = ()) -> str:
        """Return a string, one of `choice` if given."""
        value = self.value(key)
        if not isinstance(value, str) or (choice and value not in choice):
            raise self.error(key, f"one of {', '.join(choice)}" if choice else "a text")
        return value

    def texts(self, key: str, choice: Sequence[str] = ()) -> tuple[str, ...]:
        """Return a list of at least one string, each one of `choice` if given."""
        value = self.value(key)
        is_list = isinstance(value, list) and bool(value) and all(isinstance(v, str) for v in value)
        if not is_list or (choice and any(v not in choice for v in value)):
            raise self.error(key, f"a list of {', '.join(choice) if choice else 'texts'}")
        return tuple(value)

    def file(self, key: str) -> Path:
        """Return the path of a file, which is named relative to the case file."""
        name = self.text(key)
        if not name.isprintable() or len(name) > _LONG:
            raise self.error(key, "the name of a file")
        path = self.folder / name
        try:
            if path.is_file():
                return path
            why = "is a folder" if path.is_dir() else "does not exist"
        except OSError as error:
            why = f"cannot be found: {error.strerror}"
        raise FileContentError(f"{self.where}: {key} must name a file: {path} {why}")

    def number(self, key: str, lowest: float = -np.inf) -> float:
        """Return a finite number, not below `lowest`."""
        value = self.value(key)
        if not _is_number(value) or value < lowest:
            raise self.error(key, "a number" + (f", at least {lowest:g}" if np.isfinite(lowest) else ""))
        return float(value)

    def numbers(self, key: str) -> list[float]:
        """Return a list of finite numbers."""
        value = self.value(key)
        if not isinstance(value, list) or not all(_is_number(v) for v in value):
            raise self.error(key, "a list of numbers")
        return [float(v) for v in value]

    def whole(self, key: str, lowest: int = 0, highest: int = 2**31 - 1) -> int:
        """Return a whole number from `lowest` to `highest`."""
        value = self.value(key)
        if not isinstance(value, int) or isinstance(value, bool) or value < lowest:
            raise self.error(key, f"a whole number, at least {lowest}")
        if value > highest:
            raise self.error(key, f"a whole number, at most {highest}")
        return value

    def table(self, key: str) -> TomlTable:
        """Return a table inside this one."""
        value = self.value(key)
        if not isinstance(value, dict):
            raise self.error(key, "a table")
        return TomlTable(value, f"{self.where}: [{key}]", self.folder, self._inner(key))

    def tables(self, key: str) -> list[TomlTable]:
        """Return an array of at least one table."""
        value = self.value(key)
        if not isinstance(value, list) or not value or not all(isinstance(v, dict) for v in value):
            raise self.error(key, f"at least one table [[{key}]]")
        return [
            TomlTable(v, f"{self.where}: [[{key}]] number {i + 1}", self.folder, self._inner(key))
            for i, v in enumerate(value)
        ]


def _is_number(value: Any) -> bool:
    # A whole number in TOML may have any number of digits.
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
