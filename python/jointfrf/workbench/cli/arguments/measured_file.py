"""Arguments of a file of FRFs, and the points and DOFs of the joint in it."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from jointfrf.choices import MAPPING_FIELDS, format_names
from jointfrf.directions import direction_names
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.parser import CommandParser
from jointfrf.workbench.cli.usage import positive

__all__ = [
    "Nodes",
    "add_file_arguments",
    "add_joint_arguments",
    "add_reading_arguments",
    "joint_dofs",
    "nodes",
    "numbers",
    "parse_band",
    "point",
    "shown_nodes",
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


def joint_dofs(text: str) -> list[str]:
    """Return the names of joint DOFs, theta_x for rx."""
    try:
        found = direction_names(words(text))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r} names no DOFs; use the form y,theta_x")
    return list(found)


def numbers(text: str, count: int, like: tuple[str, str]) -> tuple[float, ...]:
    """Return some finite numbers between commas; `like` is what they are and an example, for the message."""
    try:
        found = tuple(float(word) for word in words(text))
    except ValueError:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise argparse.ArgumentTypeError(f"{text!r} is no {like[0]}; use the form {like[1]}")
    return found


def point(text: str) -> tuple[float, ...]:
    """Return the coordinates of a point, m."""
    return numbers(text, 3, ("point", "x,y,z in m: 0.0625,0,0"))


def parse_band(text: str) -> tuple[float, float]:
    """Return the ends of a band in Hz."""
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no band; use the form 200:550 (Hz)") from None
    return low, high


def add_file_arguments(parser: CommandParser) -> None:
    """Describe the file, the points on both sides, the DOFs, the bands."""
    parser.add_argument(
        "files",
        nargs="+",
        type=Path,
        metavar="FILE",
        help=f"FRFs of the points around the joint: {format_names()}; several files of one test are merged",
    )
    add_joint_arguments(parser)
    parser.option(
        "--points NAMES",
        "names of several joint points, bolt1,bolt2: one node of --j and of --k for each, with all of --dofs in the "
        "file; the DOFs are named bolt1.x, ...",
        words,
    )


def add_joint_arguments(parser: CommandParser) -> None:
    """Describe the points on both sides, the DOFs, the bands, the quantity: what belongs to a project."""
    parser.heading("the joint in the file")
    parser.option("--j NODES", "nodes on side j: 102,104 or 101:116", nodes)
    parser.option("--k NODES", "nodes on side k; without --at in the order of --j", nodes)
    parser.option(
        "--dofs DOFS", "joint DOFs out of x,y,z,theta_x,theta_y,theta_z (or rx,ry,rz), such as y,theta_x", joint_dofs
    )
    parser.option(
        "--at X,Y,Z",
        "reference point of the joint in m: its DOFs are the DOFs of virtual points there, from all channels of the "
        "nodes; without it, the nodes of each side lie along a line",
        point,
    )
    parser.option("--at-k X,Y,Z", "reference point of side k in m", point, otherwise="the point of --at")
    parser.option(
        "--channels TABLE",
        "TOML or CSV table of sensors and impacts (side, position, direction), if the file of FRFs lacks them; needs "
        "--at",
        Path,
    )
    parser.option(
        "--spacing METRES",
        "distance between neighbouring nodes along a line, if the file has no coordinates; needs --axis",
        float,
    )
    parser.option("--axis", "direction of the line of nodes; needs --spacing", ("x", "y", "z"))
    parser.option("--band LOW:HIGH", "frequency band in Hz; may be repeated", parse_band, repeated=True)
    add_reading_arguments(parser)


def add_reading_arguments(parser: CommandParser) -> None:
    """Describe the options that state the quantity of the FRFs and their place in files."""
    parser.option(
        "--quantity", "quantity of the FRFs, if the file does not state it", ("receptance", "mobility", "accelerance")
    )
    parser.option("--force-quantity", "use --quantity and --unit even if the file states another quantity or unit")
    parser.option(
        "--unit UNIT",
        "unit of the FRFs, if the file does not state one that is understood: g/N, mm/kN, 'dB re 1 m/N'; other units "
        "by name: frequency=kHz, phase=rad, coordinates=mm; several between commas",
        _unit,
    )
    parser.option("--skip-lines N", "lines before the heading of a text table", partial(positive, least=0))
    parser.option(
        "--map FIELD=NAME",
        f"name of a field in a MATLAB, NPZ or HDF5 file: {', '.join(MAPPING_FIELDS)}; responses and excitations also "
        "as names (responses=1:x,2:x), axes as freq,out,in in their order; may be repeated",
        _field,
        repeated=True,
    )


def _unit(text: str) -> str:
    from jointfrf.io.units import StatedUnits  # only if a unit is stated

    try:
        StatedUnits.parsed(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def _field(text: str) -> tuple[str, str]:
    field, equals, name = text.partition("=")
    if not equals or field not in MAPPING_FIELDS or not name:
        hint = did_you_mean(field, MAPPING_FIELDS) if equals else ""
        raise argparse.ArgumentTypeError(
            f"{text!r} is not FIELD=NAME; use a field of {', '.join(MAPPING_FIELDS)}{hint}"
        )
    return field, name
