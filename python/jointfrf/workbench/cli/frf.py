"""`jointfrf frf`: receptances of a model; and structures of other commands: FRFs of a file, or a model."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.dofs import DIRECTIONS, direction_places
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.frf.merge import same_lines
from jointfrf.io import Channel, FrfSet, read_frfs, write_frfs
from jointfrf.io.formats import read_frf_sets
from jointfrf.kernel.arguments import FloatArray
from jointfrf.toml.table import TomlTable, read_toml
from jointfrf.workbench.assembly_file.modes import ModalStructure
from jointfrf.workbench.assembly_file.read import read_structure
from jointfrf.workbench.cases.keys import MOST_LINES
from jointfrf.workbench.cli.arguments.frf import MOST_DOFS, FrfArguments, MatrixArguments
from jointfrf.workbench.cli.arguments.measured_file import ReadingArguments
from jointfrf.workbench.cli.arguments.structures import LineArguments
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import OptionWarning, Output, UsageError, listed, warn_of_ignored
from jointfrf.workbench.structures.substructures import ModelStructure

__all__ = [
    "CHANNEL_DIRECTIONS",
    "frfs_of_model",
    "is_model",
    "lines_of",
    "measured_sets",
    "own_matrix",
    "read_structures",
    "run",
]


def run(args: FrfArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    if args.output is None:
        raise UsageError("--output is missing; name the file to write, such as --output model.uff")
    structure = read_structure(_table(args))
    freq_hz = lines_of(args)
    if args.lines_of is not None:
        if freq_hz is not None:
            raise UsageError("--lines-of and --step both give lines; leave out one")
        held = read_frfs(args.lines_of, **args.reading())
        freq_hz = (held if args.band is None else held.select(args.band)).freq_hz
    else:
        warn_of_ignored(args, ReadingArguments.names(), "no file of FRFs is read without --lines-of")
    if freq_hz is None:
        raise UsageError("frequency lines are missing; add --band LOW:HIGH --step HZ, or --lines-of FILE")
    source = str(args.model or args.stiffness)
    with waiting("receptances"):
        frfs, named = frfs_of_model(structure, freq_hz, args.points, source)
    write_frfs(args.output, frfs)
    nodes = (f"node {number}: {name}" for name, number in named.items())
    out.say(*_about(structure), frfs.summary(), *nodes, f"wrote {args.output}")
    out.give(
        {
            "written": str(args.output),
            "source": source,
            "channels": [str(channel) for channel in frfs.responses],
            "nodes": named,
            "lines": frfs.freq_hz.size,
            "band_hz": [frfs.freq_hz[0], frfs.freq_hz[-1]],
        }
    )
    return 0


def _table(args: FrfArguments) -> TomlTable:
    """Return the table of the model: that of the file, or one of the options."""
    given = {key: value for key, value in args.keywords(MatrixArguments).items() if value is not None}
    if "loss_factor" not in args.given:
        del given["loss_factor"]
    if args.model is not None:
        if given:
            raise UsageError("MODEL and options for matrices are both given; leave out one")
        if not is_model(args.model):
            raise UsageError(f"{args.model} is no TOML file of a model; convert FRFs by jointfrf convert")
        return read_toml(args.model)
    needed = {"--stiffness": args.stiffness, "--mass": args.mass, "--dof-names": args.dof_names}
    missing = [name for name, value in needed.items() if value is None]
    if missing:
        raise UsageError(f"no model is given; name its TOML file, or add {listed(missing)}")
    return TomlTable({"model": "matrices", **given}, "options")


#: Directions of channels, and how names of other DOFs that are rotations begin.
CHANNEL_DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
_TURNS = re.compile(r"m?theta|phi|rot")


def lines_of(args: LineArguments) -> FloatArray | None:
    """Return evenly spaced lines of the options, Hz, or None without a step."""
    if args.step is None:
        return None
    if args.band is None:
        raise UsageError("--step without a band; add --band LOW:HIGH")
    low, high = args.band
    if not (0 < args.step < np.inf and 0 < low <= high < np.inf):
        raise UsageError(
            f"--band {low:g}:{high:g} --step {args.step:g} gives no lines; use positive numbers with LOW below HIGH"
        )
    count = int(np.floor((high - low) / args.step * (1 + 1e-12))) + 1
    if count > MOST_LINES:
        raise UsageError(f"--band and --step give {count} lines; use at most {MOST_LINES}")
    return np.asarray(low + args.step * np.arange(count), np.float64)


def is_model(path: Path) -> bool:
    """Whether a file describes a model."""
    return path.suffix.lower() == ".toml"


def _about(structure: ModelStructure | ModalStructure) -> list[str]:
    """Return the lines that state what files of a model or of modes contain; doubts become warnings."""
    about = structure.about if isinstance(structure, ModalStructure) else [structure.about] * bool(structure.about)
    for line in about:
        if line.startswith("warning: "):
            warnings.warn(line.removeprefix("warning: "), FileContentWarning, stacklevel=3)
    return [line for line in about if not line.startswith("warning: ")]


def frfs_of_model(
    structure: ModelStructure | ModalStructure, freq_hz: FloatArray, points: Sequence[str] | None, source: str
) -> tuple[FrfSet, dict[str, int]]:
    """Compute receptances of a model, or of modes, between some of its DOFs, or all.

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
    known = structure.modes.dofs if isinstance(structure, ModalStructure) else structure.model.dofs
    dofs = list(known) if points is None else list(points)
    if points is None and len(dofs) > MOST_DOFS:
        raise UsageError(f"{source} has {len(dofs)} DOFs; select some by --points, such as {dofs[0]},{dofs[-1]}")
    channels, named = _channels(dofs)
    h = structure.receptance(freq_hz, dofs)
    places: Mapping[int, FloatArray] = {}
    if isinstance(structure, ModalStructure):
        places = {int(node): at for node, at in structure.places.items() if node.isdecimal()}
        places = {node: at for node, at in places.items() if node in {c.node for c in channels}}
    elif structure.x is not None:
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
                f"DOF {dof!r} is not of the form node:direction; use a direction of {', '.join(DIRECTIONS)}"
            ) from None
        if not node.isdecimal() and node not in named:
            named[node] = max([*numbers, *named.values(), 0]) + 1
        channels.append(Channel(int(node) if node.isdecimal() else named[node], CHANNEL_DIRECTIONS[place]))
    if len(set(channels)) < len(channels):
        raise ValueError("a DOF is named twice; name each DOF once")
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
    files = [path for path in paths if not is_model(path)]
    sets = read_frf_sets(*files, **options) if files else []
    measured = {path: found.receptance() for path, found in zip(files, sets, strict=True)}
    if measured:
        first = next(iter(measured.values()))
        for each in measured.values():
            if not same_lines(first.freq_hz, each.freq_hz):
                raise FileContentError(
                    f"{first.source} and {each.source} have different frequency lines; use files with equal lines"
                )
        if freq_hz is not None:
            why = f"{first.source} has frequency lines of its own"
            warnings.warn(f"--step has no effect: {why}", OptionWarning, stacklevel=2)
        freq_hz = first.freq_hz
    if freq_hz is None:
        raise UsageError("models need frequency lines; add --band LOW:HIGH --step HZ")
    found = []
    for path in paths:
        if path in measured:
            found.append(measured[path])
            continue
        structure = read_structure(read_toml(path))
        _about(structure)
        frfs, _ = frfs_of_model(structure, freq_hz, None, str(path))
        is_global = isinstance(structure, ModalStructure)  # places in a model count from one of its ends
        found.append(frfs if is_global else replace(frfs, coordinates={}))
    return found


def measured_sets(path_a: Path, a: FrfSet, path_b: Path, b: FrfSet) -> list[FrfSet]:
    """Return the FRFs of files, without FRFs of models."""
    return [frfs for path, frfs in ((path_a, a), (path_b, b)) if not is_model(path)]


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
        raise FileContentError(
            f"{frfs.source} has no channel that is both response and excitation; use a file with driving-point FRFs"
        )
    return both, frfs.matrix(both, both)
