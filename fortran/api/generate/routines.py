"""What api.F90 declares and explains: routines with their arguments, and constants."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from generate.source import Source, Statement


@dataclass
class Argument:
    """One dummy argument.

    `type` is integer, real, complex or character, `intent` in, out or inout, `line` that of its comment, or of its
    declaration. `declared` is the shape as declared, without what only keeps its arithmetic from overflowing; `shape`
    and `transposed` are those of trans 'N' and 'T'. All three are empty for a single number or letter.
    """

    name: str
    type: str
    intent: str
    line: int
    declared: tuple[str, ...] = ()
    shape: tuple[str, ...] = ()
    transposed: tuple[str, ...] = ()
    text: str = ""

    @property
    def may_be_zero(self) -> bool:
        """Whether 0 says that the matrices of this size are absent: `n, or 0 for no ...`."""
        return re.match(r"\w+, or 0 for no ", self.text) is not None

    @property
    def room(self) -> int | None:
        """How long a text must be: `80 suffice`."""
        found = re.search(r"\b(\d+) suffice\b", self.text)
        return int(found[1]) if found else None


@dataclass
class Routine:
    """One public routine: what it does, its arguments in order, and its statements from SUBROUTINE to END SUBROUTINE.

    `plain` is the routine from which this one in memory of the caller follows.
    """

    name: str
    prose: str
    arguments: list[Argument]
    statements: list[Statement] = field(default_factory=list)
    plain: Routine | None = None

    @property
    def summary(self) -> str:
        """The first sentence, without its full stop."""
        return re.split(r"\.(?:\s|$)", self.prose, maxsplit=1)[0]

    @property
    def line(self) -> int:
        """Where SUBROUTINE stands."""
        return self.statements[0].line


@dataclass
class ConstantGroup:
    """Constants that belong together: what is said of them, their names and values."""

    text: str
    values: dict[str, int]


@dataclass
class Api:
    """The whole API.

    Paragraphs of the module's head, the arguments common to all, constants, public routines, and what the module uses:
    names by module.
    """

    source: Source
    prose: list[str]
    common: dict[str, str]
    constants: list[ConstantGroup]
    routines: list[Routine]
    uses: dict[str, list[str]]
