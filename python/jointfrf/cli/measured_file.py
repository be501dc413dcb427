"""A file of FRFs on the command line: which one, the points and DOFs of the joint in it."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.channels.point_lines import Interface, interface
from jointfrf.dofs import is_rotation
from jointfrf.errors import FileContentError
from jointfrf.frf.bands import in_bands
from jointfrf.io import FrfSet, read_frfs
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "add_file_arguments",
    "add_quantity_arguments",
    "in_some_band",
    "interface_of",
    "nodes",
    "parse_band",
    "read_receptances",
    "read_with_warnings",
    "words",
]


def words(text: str) -> list[str]:
    """Return the words between commas."""
    return [word.strip() for word in text.split(",") if word.strip()]


def nodes(text: str) -> list[int]:
    """Return node numbers between commas."""
    try:
        return [int(word) for word in words(text)]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of node numbers like 102,104") from None


def parse_band(text: str) -> tuple[float, float]:
    """Return the ends of a band in Hz."""
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a band like 200:550 (Hz)") from None
    return low, high


def add_file_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the file, the points on both sides, the DOFs, the bands."""
    parser.add_argument(
        "file",
        type=Path,
        help="FRFs of the points around the joint: Universal File, MATLAB, NPZ, HDF5 or CSV file",
    )
    parser.add_argument("--j", type=nodes, metavar="NODES", help="nodes on side j, along a line: 102,104")
    parser.add_argument("--k", type=nodes, metavar="NODES", help="nodes on side k, in the same order: 202,204")
    parser.add_argument(
        "--dofs", type=words, metavar="DOFS", help="joint DOFs out of x,y,z,theta_x,theta_y,theta_z, like y,theta_x"
    )
    parser.add_argument(
        "--band", type=parse_band, action="append", metavar="LOW:HIGH", help="frequency band in Hz; may be repeated"
    )
    parser.add_argument(
        "--spacing",
        type=float,
        metavar="METRES",
        help="distance between neighbouring nodes, where the file has no coordinates; needs --axis",
    )
    parser.add_argument("--axis", choices=("x", "y", "z"), help="direction of the line of nodes, with --spacing")
    add_quantity_arguments(parser)


def add_quantity_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe what a user says of the FRFs of a file."""
    parser.add_argument(
        "--quantity",
        choices=("receptance", "mobility", "accelerance"),
        help="what the FRFs are, where the file does not say",
    )
    parser.add_argument(
        "--force-quantity", action="store_true", help="take --quantity also where the file says something else"
    )


def read_receptances(args: argparse.Namespace) -> FrfSet:
    """Read the file as receptances; what had to be assumed is told as a warning."""
    return read_with_warnings(args.file, quantity=args.quantity, force_quantity=args.force_quantity, receptance=True)


def read_with_warnings(*paths: Path, receptance: bool = False, **options: Any) -> FrfSet:
    """Read files; what had to be assumed is told as a warning."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        frfs = read_frfs(*paths, **options)
        frfs = frfs.receptance() if receptance else frfs
    for message in caught:
        print(f"jointfrf: warning: {message.message}", file=sys.stderr)
    return frfs


def in_some_band(
    freq_hz: FloatArray, h: ComplexArray, bands: list[tuple[float, float]] | None
) -> tuple[FloatArray, ComplexArray]:
    """Return the lines in the bands; all where there are none."""
    kept = in_bands(freq_hz, bands) if bands else np.ones(freq_hz.size, bool)
    return freq_hz[kept], np.ascontiguousarray(h[kept])


def interface_of(args: argparse.Namespace, frfs: FrfSet, bending_stiffness: float | None = None) -> Interface:
    """Return the joint DOFs of both sides; E I of the sides in N m^2 widens intervals of rotations."""
    places = dict(frfs.coordinates)
    if (args.spacing is None) != (args.axis is None):
        raise ValueError("--spacing and --axis go together")
    if args.spacing is not None:
        if not args.spacing > 0:
            raise ValueError(f"--spacing must be positive, not {args.spacing:g}")
        for nodes in (args.j, args.k):
            for i, node in enumerate(nodes):
                places[node] = np.zeros(3)
                places[node]["xyz".index(args.axis)] = args.spacing * i
    if len(args.j) != len(args.k):
        raise ValueError(f"--j and --k must name the same number of nodes, not {len(args.j)} and {len(args.k)}")
    known = {channel.node for channel in (*frfs.responses, *frfs.excitations)}
    for node in (*args.j, *args.k):
        if node not in known:
            raise FileContentError(
                f"{args.file} has no FRF at node {node}; it has nodes {', '.join(map(str, sorted(known)))}"
            )
        if node not in places and (len(args.j) > 1 or any(is_rotation(dof) for dof in args.dofs)):
            raise FileContentError(f"{args.file} has no coordinates of node {node}: say --spacing and --axis")
    at = {node: places.get(node, np.zeros(3)) for node in (*args.j, *args.k)}
    return interface(args.j, args.k, args.dofs, at, bending_stiffness=bending_stiffness)
