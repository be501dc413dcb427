"""A TOML table read key by key: what is missing, wrong or unknown is one sentence that names file and key."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from jointfrf.errors import FileContentError

__all__ = ["TomlTable", "read_toml"]

_T = TypeVar("_T")


def read_toml(path: Path) -> TomlTable:
    """Read a TOML file.

    Raises
    ------
    FileContentError
        The file is missing, cannot be read, or is not TOML.
    """
    try:
        return TomlTable(tomllib.loads(path.read_text(encoding="utf-8")), str(path))
    except OSError as error:
        raise FileContentError(f"{path}: cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FileContentError(f"{path}: not a TOML file: {error}") from error


class TomlTable:
    """One table of a TOML file.

    Parameters
    ----------
    content : dict
        Keys and values.
    where : str
        File and table, for messages.
    """

    def __init__(self, content: dict[str, Any], where: str) -> None:
        self._content = content
        self._asked: list[str] = []
        self.where = where

    def __contains__(self, key: str) -> bool:
        return key in self._content

    def keys(self) -> list[str]:
        """Return all keys."""
        return list(self._content)

    def error(self, key: str, must: str) -> FileContentError:
        """Return the exception that says what the value of a key must be."""
        return FileContentError(f"{self.where}: {key} must be {must}, not {self._content.get(key)!r}")

    def build(self, builder: Callable[[], _T], key: str = "") -> _T:
        """Call a builder; if it complains, the message names the table and, if given, the key.

        Raises
        ------
        FileContentError
            The builder raised a ValueError or a TypeError.
        """
        try:
            return builder()
        except (ValueError, TypeError) as error:
            where = f"{self.where}: {key}" if key else self.where
            raise FileContentError(f"{where}: {error}") from error

    def check_different(self, key: str, names: Sequence[str], what: str = "have the same name") -> None:
        """Raise an error where two tables of an array say the same."""
        if len(set(names)) < len(names):
            raise FileContentError(f"{self.where}: two tables [[{key}]] {what}")

    def close(self) -> None:
        """Raise an error if there is a key that nobody asked for."""
        unknown = [key for key in self._content if key not in self._asked]
        if unknown:
            raise FileContentError(f"{self.where}: unknown key {unknown[0]!r}; it takes {', '.join(self._asked)}")

    def _value(self, key: str) -> Any:
        self._asked.append(key)
        if key not in self._content:
            raise FileContentError(f"{self.where}: the key {key!r} is missing")
        return self._content[key]

    def text(self, key: str, choice: Sequence[str] = ()) -> str:
        """Return a string, one of `choice` if given."""
        value = self._value(key)
        if not isinstance(value, str) or (choice and value not in choice):
            raise self.error(key, f"one of {', '.join(choice)}" if choice else "a text")
        return value

    def texts(self, key: str, choice: Sequence[str] = ()) -> tuple[str, ...]:
        """Return a list of at least one string, each one of `choice` if given."""
        value = self._value(key)
        is_list = isinstance(value, list) and bool(value) and all(isinstance(v, str) for v in value)
        if not is_list or (choice and any(v not in choice for v in value)):
            raise self.error(key, f"a list of {', '.join(choice) if choice else 'texts'}")
        return tuple(value)

    def number(self, key: str, lowest: float = -np.inf) -> float:
        """Return a finite number, not below `lowest`."""
        value = self._value(key)
        if not _is_number(value) or value < lowest:
            raise self.error(key, "a number" + (f", at least {lowest:g}" if np.isfinite(lowest) else ""))
        return float(value)

    def numbers(self, key: str) -> list[float]:
        """Return a list of finite numbers."""
        value = self._value(key)
        if not isinstance(value, list) or not all(_is_number(v) for v in value):
            raise self.error(key, "a list of numbers")
        return [float(v) for v in value]

    def whole(self, key: str, lowest: int = 0) -> int:
        """Return a whole number, not below `lowest`."""
        value = self._value(key)
        if not isinstance(value, int) or isinstance(value, bool) or value < lowest:
            raise self.error(key, f"a whole number, at least {lowest}")
        return value

    def truth(self, key: str) -> bool:
        """Return true or false."""
        value = self._value(key)
        if not isinstance(value, bool):
            raise self.error(key, "true or false")
        return value

    def bands(self, key: str) -> list[tuple[float, float]]:
        """Return bands [[low, high], ...] in Hz."""
        value = self._value(key)
        pairs = isinstance(value, list) and value and all(isinstance(v, list) and len(v) == 2 for v in value)
        if not pairs or not all(_is_number(a) and _is_number(b) and 0 <= a <= b for a, b in value):
            raise self.error(key, "a list of bands [low, high] in Hz")
        return [(float(low), float(high)) for low, high in value]

    def words(self) -> dict[str, str]:
        """Return all keys with their texts."""
        return {key: self.text(key) for key in self._content}

    def table(self, key: str) -> TomlTable:
        """Return a table inside this one."""
        value = self._value(key)
        if not isinstance(value, dict):
            raise self.error(key, "a table")
        return TomlTable(value, f"{self.where}: [{key}]")

    def tables(self, key: str) -> list[TomlTable]:
        """Return an array of at least one table."""
        value = self._value(key)
        if not isinstance(value, list) or not value or not all(isinstance(v, dict) for v in value):
            raise self.error(key, f"at least one table [[{key}]]")
        return [TomlTable(v, f"{self.where}: [[{key}]] number {i + 1}") for i, v in enumerate(value)]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
