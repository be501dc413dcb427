"""A structure on the command line: FRFs of a file, or a model in a TOML file as cases have them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.cases.substructures import ModelStructure, read_model
from jointfrf.cli.measured_file import parse_band, read_with_warnings
from jointfrf.cli.usage import UsageError
from jointfrf.dofs import DIRECTIONS, direction_places
from jointfrf.errors import FileContentError
from jointfrf.frf.merge import same_lines
from jointfrf.io import Channel, FrfSet, write_csv, write_hdf5, write_npz, write_uff
from jointfrf.kernel.arguments import FloatArray
from jointfrf.toml.table import read_toml

__all__ = [
    "WRITERS",
    "add_line_arguments",
    "check_target",
    "frfs_of_model",
    "is_model",
    "lines_of",
    "own_matrix",
    "read_structures",
    "write_frfs",
]

#: By the suffix of the file that is written.
WRITERS = {
    ".uff": write_uff,
    ".unv": write_uff,
    ".npz": write_npz,
    ".h5": write_hdf5,
    ".hdf5": write_hdf5,
    ".csv": write_csv,
}
#: FRFs between more DOFs are hardly meant.
_MOST_DOFS = 240
_MOST_LINES = 1_000_000
_CHANNELS = ("x", "y", "z", "rx", "ry", "rz")
_TURNS = re.compile(r"m?theta|phi|rot")


def check_target(target: Path) -> None:
    """Check that FRFs can be written to a path.

    Raises
    ------
    UsageError
        Its suffix is that of no format, or there is no such folder.
    """
    if target.suffix.lower() not in WRITERS:
        raise UsageError(f"{target} has no suffix of a format that is written: {', '.join(WRITERS)}")
    if not target.parent.is_dir():
        raise UsageError(f"there is no folder {target.parent}")


def write_frfs(target: Path, frfs: FrfSet) -> None:
    """Write FRFs in the format of the suffix."""
    WRITERS[target.suffix.lower()](target, frfs)


def add_line_arguments(parser: argparse._ActionsContainer) -> None:
    """Describe the frequency lines of models."""
    parser.add_argument("--band", type=parse_band, metavar="LOW:HIGH", help="first and last frequency in Hz")
    parser.add_argument("--step", type=float, metavar="HZ", help="spacing of the lines, for models, with --band")


def lines_of(args: argparse.Namespace) -> FloatArray | None:
    """Return evenly spaced lines of the options, Hz; None where there is no step."""
    if args.step is None:
        return None
    if args.band is None:
        raise UsageError("--step needs --band LOW:HIGH")
    low, high = args.band
    if not (0 < args.step < np.inf and 0 < low <= high < np.inf):
        raise UsageError(f"--band and --step must be positive and increase, not {low:g}:{high:g} and {args.step:g}")
    count = int(np.floor((high - low) / args.step * (1 + 1e-12))) + 1
    if count > _MOST_LINES:
        raise UsageError(f"--band and --step give {count} lines, more than {_MOST_LINES}")
    lines: FloatArray = low + args.step * np.arange(count)
    return lines


def is_model(path: Path) -> bool:
    """Whether a file is that of a model."""
    return path.suffix.lower() == ".toml"


def frfs_of_model(
    structure: ModelStructure, freq_hz: FloatArray, points: Sequence[str] | None, source: str
) -> tuple[FrfSet, dict[str, int]]:
    """Compute receptances of a model between some of its DOFs, or all.

    Returns
    -------
    FrfSet
    dict of str to int
        Numbers given to nodes that have a name instead.

    Raises
    ------
    UsageError
        There are too many DOFs, and none is named.
    ValueError
        The model has no such DOF.
    """
    dofs = list(structure.model.dofs) if points is None else list(points)
    if points is None and len(dofs) > _MOST_DOFS:
        raise UsageError(f"{source} has {len(dofs)} DOFs: name those wanted by --points, such as {dofs[0]},{dofs[-1]}")
    channels, named = _channels(dofs)
    h = structure.receptance(freq_hz, dofs)
    places: Mapping[int, FloatArray] = {}
    if structure.x is not None:
        places = {c.node: np.array([structure.x[c.node - 1], 0.0, 0.0]) for c in channels}
    return FrfSet(freq_hz, channels, channels, h, coordinates=places, source=source), named


def _channels(dofs: Sequence[str]) -> tuple[tuple[Channel, ...], dict[str, int]]:
    """Return DOFs like ``3:y``, ``3:theta``, ``hole:theta_x`` as channels; a rotation without an axis is about z."""
    split = [dof.rpartition(":")[::2] for dof in dofs]
    numbers = {int(node) for node, _ in split if node.isdecimal()}
    named: dict[str, int] = {}
    channels = []
    for dof, (node, direction) in zip(dofs, split, strict=True):
        try:
            place = 5 if _TURNS.fullmatch(direction.lower()) else int(direction_places([direction])[0])
        except ValueError:
            raise ValueError(
                f"DOF {dof!r} is not like node:direction with a direction {', '.join(DIRECTIONS)}"
            ) from None
        if not node.isdecimal() and node not in named:
            named[node] = max([*numbers, *named.values(), 0]) + 1
        channels.append(Channel(int(node) if node.isdecimal() else named[node], _CHANNELS[place]))
    if len(set(channels)) < len(channels):
        raise ValueError("a DOF is named twice")
    return tuple(channels), named


def read_structures(paths: Sequence[Path], freq_hz: FloatArray | None, **options: Any) -> list[FrfSet]:
    """Read receptances of structures at the same lines: FRFs of files as they are, models at these lines.

    Parameters
    ----------
    paths : sequence of Path
        Files of FRFs, or TOML files of models.
    freq_hz : ndarray or None
        Lines of models, where no file of FRFs gives them.
    **options
        Of `jointfrf.io.read_frfs`.

    Raises
    ------
    UsageError
        There are only models, and no lines.
    FileContentError
        Files do not have the same lines, or something in one is wrong.
    """
    measured = {path: read_with_warnings(path, receptance=True, **options) for path in paths if not is_model(path)}
    if measured:
        first = next(iter(measured.values()))
        for each in measured.values():
            if not same_lines(first.freq_hz, each.freq_hz):
                raise FileContentError(f"{first.source} and {each.source} have different frequency lines")
        freq_hz = first.freq_hz
    if freq_hz is None:
        raise UsageError("models need frequency lines: --band LOW:HIGH --step HZ")
    found = []
    for path in paths:
        if path in measured:
            found.append(measured[path])
            continue
        frfs, _ = frfs_of_model(read_model(read_toml(path)), freq_hz, None, str(path))
        found.append(replace(frfs, coordinates={}))  # which count from an end of the model
    return found


def own_matrix(frfs: FrfSet) -> tuple[tuple[Channel, ...], np.ndarray]:
    """Return the channels that are both responses and excitations, each along its axis, and the FRFs between them.

    Raises
    ------
    FileContentError
        There is no such channel, or an FRF is missing.
    """
    driven = {(c.node, c.axis) for c in frfs.excitations}
    both = tuple(dict.fromkeys(Channel(c.node, c.axis) for c in frfs.responses if (c.node, c.axis) in driven))
    if not both:
        raise FileContentError(f"{frfs.source} has no channel that is both a response and an excitation")
    return both, frfs.matrix(both, both)
