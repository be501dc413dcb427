"""A file of FRFs on the command line: which one, and the points and DOFs of the joint in it."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import numpy as np

from jointfrf.frf.bands import in_bands
from jointfrf.frf.setups import SetUps
from jointfrf.io import FrfSet, read_frfs
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.cli.usage import UsageError

__all__ = [
    "READING",
    "file_names",
    "in_some_band",
    "read_measured",
    "read_receptances",
    "reading_options",
    "setups_with_gains",
]

#: Options that say what the FRFs of files are, and where they stand in them.
READING = ("--quantity", "--force-quantity", "--unit", "--skip-lines", "--map")


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
