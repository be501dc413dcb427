"""jointfrf.h, the API for C and C++."""

from __future__ import annotations

from generate.routines import Api, Argument, Routine

TYPES = {"integer": "jf_int", "real": "double", "complex": "jf_complex", "character": "char"}
WIDTH = 116


def parameter(argument: Argument) -> str:
    """Return an argument as C declares it."""
    return f"{'const ' * (argument.intent == 'in')}{TYPES[argument.type]} *{argument.name}"


def prototype(routine: Routine, suffix: str = "_") -> str:
    """Return the prototype in one line, with the symbol's own name."""
    return f"void {routine.name}{suffix}({', '.join(map(parameter, routine.arguments))});"


def _wrapped(routine: Routine) -> str:
    """Return the prototype in lines of limited width, broken between arguments."""
    lines = [""]
    for word in prototype(routine).split(", "):
        if len(lines[-1]) + len(word) + 3 > WIDTH:
            lines.append("   ")
        lines[-1] += f" {word}," if lines[-1] else f"{word},"
    return "\n".join(lines).removesuffix(",")


def _define(name: str, value: int) -> str:
    """Return the definition of a constant."""
    return f"#define {name} {value if value >= 0 else f'({value})'}"


def values(api: Api) -> dict[str, str]:
    """Return what fills the template of the header."""
    constants = []
    for group in api.constants:
        constants += [f"/* {group.text} */", *(_define(name, value) for name, value in group.values.items())]
    return {
        "constants": "\n".join(constants),
        "prototypes": "\n".join(_wrapped(routine) for routine in api.routines),
        "names": "\n".join(f"#define {routine.name} {routine.name}_" for routine in api.routines),
    }
