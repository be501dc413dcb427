"""Man pages and one Markdown file from the comments of api.F90 and api_work.f90, whose form the pages depend on.

`reference.py API WORK VERSION FOLDER` writes FOLDER/jointfrf.3 (overview), one FOLDER/jf_NAME.3 for every public
routine and FOLDER/jointfrf.md. An argument that no comment explains is an error.
"""

from __future__ import annotations

import pathlib
import re
import sys
from dataclasses import dataclass

TYPES = {  # as declared: what FORTRAN 77 calls it, and C
    "integer(ip)": ("INTEGER", "jf_int"),
    "real(c_double)": ("DOUBLE PRECISION", "double"),
    "complex(c_double_complex)": ("COMPLEX*16", "jf_complex"),
    "character(kind=c_char)": ("CHARACTER", "char"),
}
#: What only keeps a shape's arithmetic from overflowing.
WIDE = re.compile(r"0_long \+ |1_long\*|\b(\d)_long|min\((\w+), \w+\)|max\(0_ip, (\w+)\)")
ARGUMENT_TEXT = re.compile(r"([a-z]\w*(?:, [a-z]\w*)*) {2,}(\S.*)")


@dataclass
class Argument:
    """One dummy argument: `fortran` and `c` types, `intent` (in, out, inout), `shape` as declared, or empty."""

    name: str
    fortran: str
    c: str
    intent: str
    shape: str
    text: str = ""


@dataclass
class Routine:
    """One public routine: what it does, and its arguments in order."""

    name: str
    prose: str
    arguments: list[Argument]

    @property
    def summary(self) -> str:
        """The first sentence, without its full stop."""
        return re.split(r"\.(?:\s|$)", self.prose, maxsplit=1)[0]

    @property
    def call(self) -> str:
        """The call in Fortran."""
        return f"call {self.name}({', '.join(argument.name for argument in self.arguments)})"

    @property
    def prototype(self) -> str:
        """The prototype in C, with the symbol's own name."""
        arguments = (f"{'const ' * (a.intent == 'in')}{a.c} *{a.name}" for a in self.arguments)
        return f"void {self.name}_({', '.join(arguments)});"


@dataclass
class Api:
    """The whole API: the prose of the module's head, the arguments common to all, the public routines."""

    prose: list[str]
    common: dict[str, str]
    routines: list[Routine]


def split_comment(lines: list[str], names: list[str] | None = None) -> tuple[list[str], dict[str, str]]:
    """Split one comment into paragraphs of prose and the text of each argument, from its `!>` lines.

    Only `names` are taken for arguments; without it, any word that is followed by two blanks.
    """
    paragraphs, texts, current = [""], {}, []
    for line in lines:
        content = re.sub(r"^\s*!> ?", "", line).rstrip()
        match = ARGUMENT_TEXT.fullmatch(content)
        words = match[1].split(", ") if match else []
        if words and (names is None or set(words) <= set(names)):
            current = words
            texts |= dict.fromkeys(words, match[2])
        elif current and content.startswith("  "):
            texts |= {word: f"{texts[word]} {content.strip()}" for word in current}
        elif content:
            if current:
                paragraphs.append("")
            current = []
            paragraphs[-1] = f"{paragraphs[-1]} {content}".strip()
        else:
            paragraphs.append("")
    return [paragraph for paragraph in paragraphs if paragraph], texts


def read_declarations(lines: list[str]) -> dict[str, Argument]:
    """Read the dummy arguments that the declarations name, by their names."""
    found = {}
    for line in lines:
        match = re.fullmatch(r"\s*([a-z]+\([\w=]+\)).*?intent\((\w+)\) :: (.*)", line)
        if match:
            for name, shape in re.findall(r"(\w+)(\([^()]*(?:\([^()]*\)[^()]*)*\))?(?:, |$)", match[3].strip()):
                found[name] = Argument(name, *TYPES[match[1]], match[2], WIDE.sub(r"\1\2\3", shape))
    return found


def resolve(routine: Routine, name: str, texts: dict[str, dict[str, str]], common: dict[str, str]) -> str:
    """Find the text of one argument, with `as above` and `as in jf_NAME` replaced by what they refer to.

    What jf_NAME_work does not explain, jf_NAME does.
    """
    text = texts[routine.name].get(name) or texts[routine.name.removesuffix("_work")].get(name, "as above")
    other = re.match(r"as in (jf_\w+)", text)
    if text.startswith("as above") and name in common:
        rest = text.removeprefix("as above")
        text = common[name].rstrip("." if rest else "") + rest
    elif other and name in texts.get(other[1], {}):
        text = texts[other[1]][name] + text[other.end() :]
    elif text.startswith("as above") or other:
        raise SystemExit(f"api.F90: no comment explains argument {name} of {routine.name}")
    return text


def read_api(source: str) -> Api:
    """Read the API as api.F90 declares and explains it."""
    lines = source.splitlines()
    head = lines[: next(i for i, line in enumerate(lines) if line.startswith("module"))]
    prose, common = split_comment(head)
    public = re.findall(r"jf_\w+", " ".join(re.findall(r"^  public :: (.*)$", source, re.MULTILINE)))
    routines, texts = {}, {}
    for i, line in enumerate(lines):
        if not (start := re.match(r"  subroutine (jf_\w+)\(", line)):
            continue
        first = i
        while lines[first - 1].lstrip().startswith("!>"):
            first -= 1
        last = i
        while lines[last].rstrip().endswith("&"):
            last += 1
        statement = " ".join(part.strip().rstrip("&") for part in lines[i : last + 1])
        names = re.findall(r"\w+", re.search(r"\((.*?)\)", statement)[1])
        end = next(j for j in range(last, len(lines)) if not lines[j].strip())
        declared = read_declarations(lines[last + 1 : end])
        paragraphs, texts[start[1]] = split_comment(lines[first:i], names)
        routines[start[1]] = Routine(start[1], " ".join(paragraphs), [declared[name] for name in names])
    for routine in routines.values():
        for argument in routine.arguments:
            argument.text = resolve(routine, argument.name, texts, common)
    prose = [text for text in prose if not text.endswith(":")]
    return Api(prose, common, [routines[name] for name in dict.fromkeys(public)])


def roff(text: str) -> str:
    """Text as it may stand on a line of its own in a man page."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def title(name: str, version: str) -> list[str]:
    """Write the first line of a man page."""
    return [f'.TH {name.upper()} 3 "" "jointfrf {version}" "jointfrf"']


def routine_page(routine: Routine, version: str) -> str:
    """Write the man page of one routine."""
    prototype = routine.prototype.replace(f"{routine.name}_(", f"{routine.name}(")
    page = [*title(routine.name, version), ".SH NAME", f"{routine.name} \\- {roff(routine.summary)}", ".SH SYNOPSIS"]
    page += [".B use jointfrf", ".PP", f".B {roff(routine.call)}", ".PP", ".B #include <jointfrf.h>"]
    page += [".PP", f".B {roff(prototype)}", ".SH DESCRIPTION", roff(routine.prose), ".SH ARGUMENTS"]
    for a in routine.arguments:
        page += [".TP", f'.BR {a.name} " ({a.intent}, {a.fortran}{a.shape and " " + a.shape})"', roff(a.text)]
    page += [".SH SEE ALSO", ".BR jointfrf (3)"]
    return "\n".join(page) + "\n"


def overview_page(api: Api, version: str) -> str:
    """Write the man page of the library."""
    page = [*title("jointfrf", version), ".SH NAME", "jointfrf \\- joints from frequency response functions"]
    page += [".SH DESCRIPTION"]
    for paragraph in api.prose:
        page += [roff(paragraph), ".PP"]
    page += ["Constants for engines, info and line_info: jointfrf.h for C, jointfrf.inc for Fortran of either form."]
    page += [".SH COMMON ARGUMENTS"]
    for name, text in api.common.items():
        page += [".TP", f".B {name}", roff(text)]
    page += [".SH ROUTINES"]
    for routine in api.routines:
        page += [".TP", f".BR {routine.name} (3)", roff(routine.summary)]
    return "\n".join(page) + "\n"


def markdown(api: Api, version: str) -> str:
    """Write the whole reference as one Markdown text."""
    text = [f"# jointfrf {version}: reference", *api.prose]
    text += ["Common arguments:", "\n".join(f"- `{name}`: {words}" for name, words in api.common.items())]
    for routine in api.routines:
        text += [f"## {routine.name}", routine.prose]
        text += [f"```fortran\n{routine.call}\n```", f"```c\n{routine.prototype.replace('_(', '(', 1)}\n```"]
        text += [
            "\n".join(f"- `{a.name}` ({a.intent}, {a.fortran}{a.shape and f' `{a.shape}`'}): {a.text}"
                      for a in routine.arguments)
        ]  # fmt: skip
    return "\n\n".join(text) + "\n"


def main(*arguments: str) -> None:
    """Write every page."""
    *sources, version, folder = arguments
    api = read_api("".join(pathlib.Path(source).read_text(encoding="utf-8") for source in sources))
    target = pathlib.Path(folder)
    pages = {f"{routine.name}.3": routine_page(routine, version) for routine in api.routines}
    pages |= {"jointfrf.3": overview_page(api, version), "jointfrf.md": markdown(api, version)}
    for name, text in pages.items():
        (target / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
