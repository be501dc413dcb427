"""_kernel.pyf, the signatures for f2py, which cannot resolve kind expressions.

TRANS is always 'T': an array (freq, out, in) in C order enters as its transposed view and is not copied. Every routine
runs without the interpreter lock. Shapes are checked once more, because f2py silently accepts a wrong one. Arrays of
results are intent(inout), the only intent for which f2py makes no copy and refuses an array that does not fit. f2py
cannot pass an array of size zero: the callers answer such calls themselves, and an absent matrix is one column wide.
The length of a text is the one that its comment calls enough. Forms in memory of the caller are left out.
"""

from __future__ import annotations

import re

from generate.routines import Api, Argument, Routine
from generate.source import wrap_list

TYPES = {"integer": "integer", "real": "real*8", "complex": "complex*16", "character": "character*1"}


def _dimension(text: str, routine: Routine) -> str:
    """Return one dimension, at least one where the matrix may be absent."""
    for a in routine.arguments:
        if a.may_be_zero:
            text = re.sub(rf"\b{a.name}\b", f"max({a.name}, 1)", text)
    return text


def _text_length(argument: Argument, routine: Routine) -> str:
    """Return the number of characters of a text."""
    (dimension,) = argument.shape
    rooms = {a.name: str(a.room) for a in routine.arguments if a.room}
    return rooms.get(dimension, dimension)


def _declaration(a: Argument, routine: Routine) -> list[str]:
    """Write the declaration of one argument."""
    if a.name == "trans":
        return ["  character*1, intent(hide) :: trans = 'T'"]
    if a.room:
        return [f"  integer, intent(hide) :: {a.name} = {a.room}"]
    if not a.shape:
        return [f"  {TYPES[a.type]}, intent({a.intent}) :: {a.name}"]
    if a.type == "character":
        return [f"  character*{_text_length(a, routine)}, intent({a.intent}) :: {a.name}"]
    dimensions = [_dimension(text, routine) for text in a.transposed]
    checks = [f"shape({a.name}, {i}) == {text}" for i, text in enumerate(dimensions)]
    intent = "in" if a.intent == "in" else "inout"
    lines = [f"  {TYPES[a.type]}, dimension({', '.join(dimensions)}), intent({intent}), &"]
    return lines + wrap_list("    check(", checks, f") :: {a.name}", separator=" && ")


def _signature(routine: Routine) -> list[str]:
    """Write the signature of one routine."""
    lines = wrap_list(f"subroutine {routine.name}(", [a.name for a in routine.arguments], ")", indent=4)
    lines.append("  threadsafe")
    for argument in routine.arguments:
        lines += _declaration(argument, routine)
    return [*lines, f"end subroutine {routine.name}", ""]


def write(api: Api) -> str:
    """Write the signatures of all routines but those in memory of the caller."""
    lines = ["! Generated from api.F90.", "python module _kernel", "interface", ""]
    for routine in api.routines:
        if routine.plain is None:
            lines += _signature(routine)
    return "\n".join([*lines, "end interface", "end python module _kernel"]) + "\n"
