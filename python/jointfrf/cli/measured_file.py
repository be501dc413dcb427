"""A file of FRFs on the command line: which one, and the points and DOFs of the joint in it."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jointfrf.cli.parser import CommandParser
from jointfrf.cli.usage import UsageError, positive
from jointfrf.dofs import direction_names
from jointfrf.errors import FileContentError
from jointfrf.frf.bands import in_bands
from jointfrf.frf.setups import SetUps
from jointfrf.io import FrfSet, read_frfs
from jointfrf.io.file_format import FrfMapping
from jointfrf.io.formats import format_names
from jointfrf.io.units import StatedUnits
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.spelling import did_you_mean

__all__ = [
    "READING",
    "Nodes",
    "add_file_arguments",
    "add_joint_arguments",
    "add_reading_arguments",
    "file_names",
    "in_some_band",
    "joint_dofs",
    "nodes",
    "numbers",
    "parse_band",
    "point",
    "read_measured",
    "read_receptances",
    "reading_options",
    "setups_with_gains",
    "shown_nodes",
    "words",
]

#: Longer ranges of nodes are slips.
_MOST_NODES = 100_000
#: Options that say what the FRFs of files are, and where they stand in them.
READING = ("--quantity", "--force-quantity", "--unit", "--skip-lines", "--map")
#: What --map may name.
_FIELDS = tuple(field.name for field in fields(FrfMapping))
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
    if len(found) != count or not np.isfinite(found).all():
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
        f"name of a field in a MATLAB, NPZ or HDF5 file: {', '.join(_FIELDS)}; responses and excitations also as names "
        "(responses=1:x,2:x), axes as freq,out,in in their order; may be repeated",
        _field,
        repeated=True,
    )


def _unit(text: str) -> str:
    try:
        StatedUnits.parsed(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def _field(text: str) -> tuple[str, str]:
    field, equals, name = text.partition("=")
    if not equals or field not in _FIELDS or not name:
        hint = did_you_mean(field, _FIELDS) if equals else ""
        raise argparse.ArgumentTypeError(f"{text!r} is not FIELD=NAME; use a field of {', '.join(_FIELDS)}{hint}")
    return field, name


def reading_options(args: argparse.Namespace) -> dict[str, Any]:
    """Return what the command line says of the files, as `jointfrf.io.read_frfs` takes it."""
    if args.force_quantity and args.quantity is None and args.unit is None:
        raise UsageError("--force-quantity has no effect without --quantity or --unit; leave it out")
    mapping = dict(args.map or ())
    if len(mapping) < len(args.map or ()):
        raise UsageError("--map names a field twice; name each field once")
    stated = {"unit": args.unit or "", "skip_lines": args.skip_lines or 0}
    return {"quantity": args.quantity, "force_quantity": args.force_quantity, "mapping": mapping, **stated}


def read_measured(args: argparse.Namespace) -> FrfSet:
    """Read the files as what they say, or the command line says, that they hold."""
    return read_frfs(*args.files, **reading_options(args))


def read_receptances(args: argparse.Namespace) -> FrfSet:
    """Read the files as receptances."""
    return read_measured(args).receptance()


def setups_with_gains(args: argparse.Namespace, setups: SetUps | None, shape: tuple[int, ...]) -> SetUps | None:
    """Return the set-ups of FRFs of this shape, with the gains that the command line says."""
    if args.setup_gain is None and args.common_gain is None:
        return setups
    found = SetUps([file_names(args)], np.zeros(shape[1:], int)) if setups is None else setups
    given = {"gain": args.setup_gain, "common_gain": args.common_gain}
    return replace(found, **{name: value for name, value in given.items() if value is not None})


def file_names(args: argparse.Namespace) -> str:
    """Return the names of the files without their folders."""
    return ", ".join(path.name for path in args.files)


def in_some_band(
    freq_hz: FloatArray, h: ComplexArray, bands: list[tuple[float, float]] | None
) -> tuple[FloatArray, ComplexArray]:
    """Return the lines in the bands; all where there are none."""
    kept = in_bands(freq_hz, bands) if bands else np.ones(freq_hz.size, bool)
    return freq_hz[kept], np.ascontiguousarray(h[kept])
