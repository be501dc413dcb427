"""Laws of files by their names; they are imported only on use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from jointfrf.extras import plugins

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["LAWS", "LAW_WORDS", "law_of_plugin"]

#: Module of this package and class by name: a new law is a file with its class, and its line here.
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
    """Words of our own laws; plugins add further ones."""

    __slots__ = ()

    def __contains__(self, word: object) -> bool:
        return super().__contains__(word) or law_of_plugin(word) is not None


#: Words of laws; a rigid DOF has none.
LAW_WORDS = _LawWords((*LAWS, "rigid"))
