"""Laws by their word and the parameters that each takes, as tables of TOML files have them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from jointfrf.laws.law import JointLaw
from jointfrf.laws.springs import SpringLaw
from jointfrf.laws.viscoelastic import FractionalZener, PowerLaw, StandardLinearSolid
from jointfrf.toml.table import Key, TomlTable

__all__ = ["LAW_VALUES", "LAW_WORDS", "law_line", "read_law", "takes_in_words"]

#: Word of a file to its law.
_LAWS: Mapping[str, type[SpringLaw | StandardLinearSolid | FractionalZener | PowerLaw]] = {
    "spring": SpringLaw,
    "standard-linear-solid": StandardLinearSolid,
    "fractional-zener": FractionalZener,
    "power": PowerLaw,
}
#: Word to the parameters that the law takes: the numbers that make it.
_TAKES: Mapping[str, tuple[str, ...]] = {
    word: tuple(field.name for field in fields(law) if field.type == "float") for word, law in _LAWS.items()
} | {"rigid": ()}
#: Words of laws; a rigid DOF has none.
LAW_WORDS = tuple(_TAKES)
#: Keys of their parameters.
LAW_VALUES = (
    Key("k", "number, at least 0 (of a cross term any)", "Stiffness, at rest.", "N/m, N m/rad", "0"),
    Key("c", "number", "Viscous damping.", "N s/m, N m s/rad", "0"),
    Key("h", "number", "Hysteretic damping.", "N/m, N m/rad", "0"),
    Key("k_m", "number, at least 0", "What is added at high frequencies.", "N/m, N m/rad", "0"),
    Key("k_a", "number, at least 0", "Modulus of the spring-pot at the reference frequency.", "N/m, N m/rad", "0"),
    Key("tau", "number, above 0", "Relaxation time.", "s", "0"),
    Key("alpha", "number, 0 to 1", "Order of the derivative.", "", "0"),
    Key("reference_hz", "number, above 0", "Reference frequency of the power law.", "Hz", "0"),
)


def takes_in_words() -> str:
    """Return which parameters each law takes, for the reference of keys."""
    named = ((word, ", ".join(f"`{name}`" for name in names)) for word, names in _TAKES.items() if names)
    return "; ".join(f"`{word}` {names}" for word, names in named)


def read_law(table: TomlTable, word: str, *, is_cross: bool = False) -> JointLaw:
    """Read the parameters of a law from a table that holds them alone.

    Parameters
    ----------
    table : TomlTable
    word : str
        Out of `LAW_WORDS`, not "rigid".
    is_cross : bool
        Whether it couples two DOFs, so that a stiffness may be negative.

    Raises
    ------
    FileContentError
        A parameter that the law does not take, one that is missing, or a value outside its bounds.
    """
    takes = _TAKES[word]
    values: dict[str, Any] = {}
    for key in LAW_VALUES:
        given = key.name in table
        if given and key.name not in takes:
            raise table.wrong(key.name, f"the law {word!r} takes {', '.join(takes)}")
        if given or (key.name in takes and (word != "spring" or key.name == "k")):
            values[key.name] = table.number(key.name)
    table.close()
    if word == "spring":
        return table.build(lambda: SpringLaw(**values, is_cross=is_cross))
    return table.build(lambda: _LAWS[word](**values))


def law_line(law: JointLaw) -> str:
    """Return word and values of a law as lines of TOML.

    Raises
    ------
    ValueError
        A user-defined law: a file cannot hold a function.
    """
    word = next((word for word, kind in _LAWS.items() if type(law) is kind), None)
    if word is None:
        raise ValueError(f"a {type(law).__name__} cannot be written to a file: it is a function")
    named = {name: float(getattr(law, name)) for name in _TAKES[word]}
    if isinstance(law, SpringLaw):
        shown = {"k", *(field.name for field in law.fields)}
        named = {name: value for name, value in named.items() if name in shown}
    values = ", ".join(f"{name} = {value!r}" for name, value in named.items())
    return f"law = {json.dumps(word)}\nvalues = {{ {values} }}\n"
