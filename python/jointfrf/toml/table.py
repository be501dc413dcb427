"""A TOML table and its place: a missing, wrong or unknown key in it is one sentence that names file and key."""

from __future__ import annotations

import reprlib
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from jointfrf.errors import FileContentError
from jointfrf.files import check_file, check_stated
from jointfrf.spelling import look_alike

__all__ = ["TomlTable", "missing_in_words", "read_toml"]

_T = TypeVar("_T")
#: Length above which a name is not repeated in a message.
_LONG = 1000


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
        raise FileContentError(f"{path} cannot be read: {error.strerror}; check the file") from error
    except (ValueError, RecursionError) as error:
        raise FileContentError(f"{path} is not a TOML file ({error}); correct it") from error


def missing_in_words(names: Sequence[str]) -> str:
    """Return a text on missing keys, with their names in the file."""
    one = len(names) == 1
    return f"the key{'' if one else 's'} {', '.join(names)} {'is' if one else 'are'} missing"


@dataclass(frozen=True)
class TomlTable:
    """One table of a TOML file.

    Attributes
    ----------
    content : dict
        Keys and values.
    where : str
        File and table, for messages.
    folder : Path
        Folder to which file names of the table are relative.
    """

    content: dict[str, Any]
    where: str
    folder: Path = Path()

    def unknown(self, key: str, names: Sequence[str]) -> FileContentError:
        """Return the exception for an unknown key, with the existing keys."""
        similar = look_alike(key, names)
        hint = f"; did you mean {similar!r}?" if similar else ""
        return FileContentError(f"{self.where}: unknown key {key!r}; use one of {', '.join(names)}{hint}")

    def missing(self, names: Sequence[str], why: str = "") -> FileContentError:
        """Return the exception for missing keys, with the reason why they are needed."""
        needed = missing_in_words(list(map(repr, names)))
        return FileContentError(f"{self.where}: {needed}" + (f": {why}" if why else ""))

    def error(self, key: str, must: str, similar: str = "") -> FileContentError:
        """Return the exception for a value of the wrong form, with a proposal."""
        given = reprlib.repr(self.content.get(key))
        return FileContentError(f"{self.where}: {key} must be {must}, not {given}{similar}")

    def wrong(self, key: str, why: str) -> FileContentError:
        """Return the exception for a wrong object that a key names."""
        return FileContentError(f"{self.where}: {key}: {why}")

    def check_stated(self, key: str, size: float) -> None:
        """Check the memory that a number requires, in bytes, against the limit of reading; raise FileContentError."""
        check_stated(f"{self.where}: {key} = {reprlib.repr(self.content.get(key))}", size)

    def build(self, builder: Callable[[], _T], key: str = "") -> _T:
        """Call a builder; if it raises an error, the message names the table and, if given, the key.

        Raises
        ------
        FileContentError
            The builder raised a ValueError, a TypeError, an OSError or an ArithmeticError.
        """
        try:
            return builder()
        except (ValueError, TypeError, OSError, ArithmeticError) as error:
            where = f"{self.where}: {key}" if key else self.where
            why = "a number is too large or too small; correct it" if isinstance(error, ArithmeticError) else error
            raise FileContentError(f"{where}: {why}") from error

    def file(self, key: str) -> Path:
        """Return the path of a file, which is named relative to the case file."""
        name = self.content.get(key)
        if not isinstance(name, str) or not name.isprintable() or len(name) > _LONG:
            raise self.error(key, "the name of a file")
        path = self.folder / name
        try:
            if path.is_file():
                return path
            why = "is a folder" if path.is_dir() else "does not exist"
        except OSError as error:
            why = f"cannot be found: {error.strerror}"
        raise FileContentError(f"{self.where}: {key}: {path} {why}; name a file")

    def table(self, key: str) -> TomlTable:
        """Return a table inside this one."""
        if key not in self.content:
            raise self.missing([key])
        if not isinstance(self.content[key], dict):
            raise self.error(key, "a table")
        return TomlTable(self.content[key], f"{self.where}: [{key}]", self.folder)

    def tables(self, key: str) -> list[TomlTable]:
        """Return an array of at least one table."""
        value = self.content.get(key)
        if not isinstance(value, list) or not value or not all(isinstance(v, dict) for v in value):
            raise self.error(key, f"at least one table [[{key}]]")
        return [TomlTable(v, f"{self.where}: [[{key}]] number {i + 1}", self.folder) for i, v in enumerate(value)]
