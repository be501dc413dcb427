"""The reference: man pages and one Markdown text."""

from __future__ import annotations

from generate.c_header import prototype
from generate.routines import Api, Argument, Routine

#: What FORTRAN 77 calls the types.
TYPES = {"integer": "INTEGER", "real": "DOUBLE PRECISION", "complex": "COMPLEX*16", "character": "CHARACTER"}


def _call(routine: Routine) -> str:
    """Return the call in Fortran."""
    return f"call {routine.name}({', '.join(argument.name for argument in routine.arguments)})"


def _declared(argument: Argument) -> str:
    """Return the shape as declared, empty for a single number or letter."""
    return f"({', '.join(argument.declared)})" if argument.declared else ""


def _roff(text: str) -> str:
    """Return text as it may stand on a line of its own in a man page."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def _title(name: str, version: str) -> list[str]:
    """Write the first line of a man page."""
    return [f'.TH {name.upper()} 3 "" "jointfrf {version}" "jointfrf"']


def _routine_page(routine: Routine, version: str) -> str:
    """Write the man page of one routine."""
    page = [*_title(routine.name, version), ".SH NAME", f"{routine.name} \\- {_roff(routine.summary)}", ".SH SYNOPSIS"]
    page += [".B use jointfrf", ".PP", f".B {_roff(_call(routine))}", ".PP", ".B #include <jointfrf.h>"]
    page += [".PP", f".B {_roff(prototype(routine, ''))}", ".SH DESCRIPTION", _roff(routine.prose), ".SH ARGUMENTS"]
    for a in routine.arguments:
        shape = _declared(a)
        page += [".TP", f'.BR {a.name} " ({a.intent}, {TYPES[a.type]}{shape and " " + shape})"', _roff(a.text)]
    page += [".SH SEE ALSO", ".BR jointfrf (3)"]
    return "\n".join(page) + "\n"


def _overview_page(api: Api, version: str) -> str:
    """Write the man page of the library."""
    page = [*_title("jointfrf", version), ".SH NAME", "jointfrf \\- joints from frequency response functions"]
    page += [".SH DESCRIPTION"]
    for paragraph in _prose(api):
        page += [_roff(paragraph), ".PP"]
    page += ["Constants for engines, info and line_info: jointfrf.h for C, jointfrf.inc for Fortran of either form."]
    page += [".SH COMMON ARGUMENTS"]
    for name, text in api.common.items():
        page += [".TP", f".B {name}", _roff(text)]
    page += [".SH ROUTINES"]
    for routine in api.routines:
        page += [".TP", f".BR {routine.name} (3)", _roff(routine.summary)]
    return "\n".join(page) + "\n"


def _prose(api: Api) -> list[str]:
    """Return the paragraphs of the head but titles of lists."""
    return [text for text in api.prose if not text.endswith(":")]


def _markdown(api: Api, version: str) -> str:
    """Write the whole reference as one Markdown text."""
    text = [f"# jointfrf {version}: reference", *_prose(api)]
    text += ["Common arguments:", "\n".join(f"- `{name}`: {words}" for name, words in api.common.items())]
    for routine in api.routines:
        text += [f"## {routine.name}", routine.prose]
        text += [f"```fortran\n{_call(routine)}\n```", f"```c\n{prototype(routine, '')}\n```"]
        items = []
        for a in routine.arguments:
            shape = f" `{_declared(a)}`" if a.declared else ""
            items.append(f"- `{a.name}` ({a.intent}, {TYPES[a.type]}{shape}): {a.text}")
        text.append("\n".join(items))
    return "\n\n".join(text) + "\n"


def write(api: Api, version: str) -> dict[str, str]:
    """Write every page, by the name of its file."""
    pages = {f"{routine.name}.3": _routine_page(routine, version) for routine in api.routines}
    return {**pages, "jointfrf.3": _overview_page(api, version), "jointfrf.md": _markdown(api, version)}
