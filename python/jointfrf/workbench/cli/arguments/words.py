"""Words of the command line as values: nodes, DOFs, bands, numbers, names, files to be written."""

import argparse
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, NamedTuple

from jointfrf.directions import direction_names
from jointfrf.workbench.cli.arguments.declaration import Form, number
from jointfrf.workbench.cli.usage import check_folder, check_frf_file, check_out

__all__ = [
    "AboveZero",
    "Band",
    "Count",
    "Dofs",
    "NewFile",
    "NewFolder",
    "NewFrfs",
    "NewPage",
    "NodeList",
    "Nodes",
    "NumberList",
    "Point",
    "Words",
    "above_zero",
    "nodes",
    "numbers",
    "shown_nodes",
    "whole",
    "words",
]

#: Longer ranges of nodes are slips.
_MOST_NODES = 100_000
#: Nodes that a message lists.
_NODES_SHOWN = 40


class Nodes(NamedTuple):
    """Nodes as they were named: one by one, and ranges of which not all need exist.

    Attributes
    ----------
    numbers : tuple of int
        All.
    single : frozenset of int
        Those that were named by themselves.
    """

    numbers: tuple[int, ...]
    single: frozenset[int]

    def among(self, known: Iterable[int], source: object) -> list[int]:
        """Return the nodes that there are.

        Raises
        ------
        FileContentError
            One that was named by itself is not there, or none of all.
        """
        from jointfrf.errors import FileContentError  # imports numpy, which a parser does not need

        there = set(known)
        missing = [node for node in self.numbers if node in self.single and node not in there]
        found = [node for node in self.numbers if node in there]
        if missing or not found:
            which = f"node {missing[0]}" if missing else f"nodes {self.numbers[0]} to {self.numbers[-1]}"
            raise FileContentError(f"{source} has no FRF at {which}; use nodes of {shown_nodes(there)}")
        return found

    def shifted(self, add: int) -> "Nodes":
        """Return nodes with other numbers."""
        return Nodes(tuple(node + add for node in self.numbers), frozenset(node + add for node in self.single))


def shown_nodes(found: Iterable[int]) -> str:
    """Write nodes in their order, neighbours as ranges: 101 to 104, 201."""
    ranges: list[list[int]] = []
    for node in sorted(found):
        if ranges and node == ranges[-1][1] + 1:
            ranges[-1][1] = node
        else:
            ranges.append([node, node])
    texts = [str(a) if a == b else f"{a}, {b}" if b == a + 1 else f"{a} to {b}" for a, b in ranges]
    return ", ".join(texts[:_NODES_SHOWN]) + (", ..." if len(texts) > _NODES_SHOWN else "")


def words(text: str) -> list[str]:
    """Return the words between commas."""
    return [word.strip() for word in text.split(",") if word.strip()]


def nodes(text: str) -> Nodes:
    """Return nodes: numbers between commas, and ranges like 101:116, ends included."""
    found: list[int] = []
    single: set[int] = set()
    for word in words(text):
        first, colon, last = word.partition(":")
        try:
            low, high = int(first), int(last if colon else first)
        except ValueError:
            low, high = 0, 0
        if not 0 < low <= high:
            raise argparse.ArgumentTypeError(f"{word!r} is no node number or range; use the form 102,104 or 101:116")
        if high - low >= _MOST_NODES:
            raise argparse.ArgumentTypeError(f"{word} are too many nodes; name at most {_MOST_NODES}")
        found += range(low, high + 1)
        single |= set() if colon else {low}
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r} names no nodes; use the form 102,104 or 101:116")
    return Nodes(tuple(dict.fromkeys(found)), frozenset(single))


def _joint_dofs(text: str) -> list[str]:
    """Return the names of joint DOFs, theta_x for rx."""
    try:
        found = direction_names(words(text))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r} names no DOFs; use the form y,theta_x")
    return list(found)


def numbers(text: str, count: int, like: tuple[str, str]) -> tuple[float, ...]:
    """Return some finite numbers between commas; `like` is their name and an example, for the message."""
    try:
        found = tuple(float(word) for word in words(text))
    except ValueError:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise argparse.ArgumentTypeError(f"{text!r} is no {like[0]}; use the form {like[1]}")
    return found


def _number_list(text: str) -> list[float]:
    try:
        return [float(one) for one in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no list of numbers; separate them by commas") from None


def _band(text: str) -> tuple[float, float]:
    """Return the ends of a band in Hz."""
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no band; use the form 200:550 (Hz)") from None
    return low, high


def whole(word: str, least: int = 1) -> int:
    """Return a whole number of at least 1, or another least one."""
    if not word.isdecimal() or int(word) < least:
        raise argparse.ArgumentTypeError(f"{word!r} is no whole number of at least {least}; give one")
    return int(word)


NodeList = Annotated[Nodes, Form("NODES", nodes)]
Words = Annotated[list[str], Form("NAMES", words)]
Dofs = Annotated[list[str], Form("DOFS", _joint_dofs)]
Point = Annotated[tuple[float, ...], Form("X,Y,Z", lambda text: numbers(text, 3, ("point", "x,y,z in m: 0.0625,0,0")))]
Band = Annotated[tuple[float, float], Form("LOW:HIGH", _band)]
NumberList = Annotated[list[float], Form("NUMBER,...", _number_list)]
above_zero = number(lambda found: found > 0, "is no number above zero; give one")
AboveZero = Annotated[float, Form("NUMBER", above_zero)]
Count = Annotated[int, Form("N", whole)]
NewFile = Annotated[Path, Form("FILE", Path, check_folder)]
NewPage = Annotated[Path, Form("FILE", Path, check_folder, packages=("jinja2",))]
NewFrfs = Annotated[Path, Form("FILE", Path, check_frf_file)]
NewFolder = Annotated[Path, Form("DIR", Path, check_out)]
