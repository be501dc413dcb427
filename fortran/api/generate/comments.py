"""The comments of api.F90: what is said of a routine and of its arguments."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from generate.source import ConventionError, Source

ARGUMENT_TEXT = re.compile(r"([a-z]\w*(?:, [a-z]\w*)*) {2,}(\S.*)")
#: Texts of arguments with the lines where they stand.
Texts = dict[str, tuple[int, str]]


def split_comment(block: list[tuple[int, str]]) -> tuple[list[str], Texts]:
    """Split one comment into paragraphs of prose and the texts of arguments."""
    paragraphs = [""]
    texts: Texts = {}
    current: list[str] = []
    for line, content in block:
        match = ARGUMENT_TEXT.fullmatch(content)
        if match:
            current = match[1].split(", ")
            texts.update(dict.fromkeys(current, (line, match[2])))
        elif current and content.startswith("  "):
            texts.update({name: (texts[name][0], f"{texts[name][1]} {content.strip()}") for name in current})
        elif content:
            if current:
                paragraphs.append("")
            current = []
            paragraphs[-1] = f"{paragraphs[-1]} {content}".strip()
        else:
            paragraphs.append("")
    return [paragraph for paragraph in paragraphs if paragraph], texts


@dataclass
class Comments:
    """Texts of arguments: those common to all, of the module's head, and those of each routine."""

    source: Source
    common: dict[str, str]
    routines: dict[str, Texts] = field(default_factory=dict)

    def line(self, routine: str, argument: str, otherwise: int) -> int:
        """Return the line where a routine explains an argument itself, or `otherwise`."""
        return self.routines[routine].get(argument, (otherwise, ""))[0]

    def text(self, routine: str, argument: str, line: int) -> str:
        """Return the text of an argument of a routine that begins in a line; `as in jf_NAME` is followed one step."""
        text = self.routines[routine].get(argument, (line, "as above"))[1]
        other = re.match(r"as in (jf_\w+)", text)
        if not other:
            return self._with_common(routine, argument, text, line)
        line = self.line(routine, argument, line)
        place, there = self.routines.get(other[1], {}).get(argument, (line, "as in nothing"))
        if there.startswith("as in "):
            raise self._unexplained(routine, argument, place)
        return self._with_common(other[1], argument, there, place) + text[other.end() :]

    def _with_common(self, routine: str, argument: str, text: str, line: int) -> str:
        """Replace `as above` by the text common to all."""
        if not text.startswith("as above"):
            return text
        if argument not in self.common:
            raise self._unexplained(routine, argument, self.line(routine, argument, line))
        rest = text.removeprefix("as above")
        return self.common[argument].rstrip("." if rest else "") + rest

    def _unexplained(self, routine: str, argument: str, line: int) -> ConventionError:
        """Return the error for an argument without words."""
        words = f"no comment explains argument {argument}: write '!> {argument}   what it is, shape (...), unit'"
        return self.source.error(line, f"{routine}: {words}")
