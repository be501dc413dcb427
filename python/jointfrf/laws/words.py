"""The laws that files can hold, by their words; none is imported to know its word."""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointfrf.extras import plugins

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["LAWS", "LAW_WORDS", "law_of_plugin"]

#: Module of this package and class by word: a new law is a file with its class, and its line here.
LAWS = {
    "spring": ("springs", "SpringLaw"),
    "standard-linear-solid": ("viscoelastic", "StandardLinearSolid"),
    "fractional-zener": ("viscoelastic", "FractionalZener"),
    "power": ("viscoelastic", "PowerLaw"),
}


def law_of_plugin(word: object) -> EntryPoint | None:
    """Return the entry point of this name by which another package adds a law."""
    return next((entry for entry in plugins("jointfrf.laws") if entry.name == word), None)


class _LawWords(tuple[str, ...]):
    """Words of our own laws; those of plugins are found in it, too."""

    __slots__ = ()

    def __contains__(self, word: object) -> bool:
        return super().__contains__(word) or law_of_plugin(word) is not None


#: Words of laws; a rigid DOF has none.
LAW_WORDS = _LawWords((*LAWS, "rigid"))
