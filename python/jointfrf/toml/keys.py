"""What the keys of a TOML file mean: the reference, and what a misspelt key is compared with."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

__all__ = ["Key", "KeyTable"]


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
        As it stands in a file: ``[frequency]``.
    about : str
        What the table is for; a sentence.
    keys : tuple of Key
    variants : mapping of str to KeyTable
        Other keys for each value of the key `variant_key`.
    variant_key : str
    """

    header: str
    about: str
    keys: tuple[Key, ...]
    variants: Mapping[str, KeyTable] = field(default_factory=dict)
    variant_key: str = ""

    def __contains__(self, word: str) -> bool:
        return any(key.matches(word) for key in self.keys)

    def inner(self, word: str) -> KeyTable | None:
        """Return the keys of the table that a key names."""
        return next((key.inner for key in self.keys if key.matches(word)), None)

    def variant(self, content: Mapping[str, object]) -> KeyTable | None:
        """Return the keys that hold for a table with this content; None where it does not say which."""
        if not self.variants:
            return self
        word = content.get(self.variant_key)
        return self.variants.get(word) if isinstance(word, str) else None

    def all_tables(self) -> Iterator[KeyTable]:
        """Go through this table and all inside it, each once."""
        seen: list[KeyTable] = []
        waiting = [self]
        while waiting:
            table = waiting.pop(0)
            if any(table is other for other in seen):
                continue
            seen.append(table)
            if not table.variants:
                yield table
            inner = [key.inner for key in table.keys if key.inner is not None]
            waiting = [*table.variants.values(), *inner, *waiting]
