"""Free decays in `jointfrf levels`: from a file of time records to modes over amplitude, and to levels of the joint."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.choices import MotionQuantity
from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import Channel
from jointfrf.io.time_file import read_time_record
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.amplitude.decay import DecayRecord, ModalDecay, decay_of_mode
from jointfrf.workbench.amplitude.decay_levels import decay_levels
from jointfrf.workbench.amplitude.levels import JointLevels
from jointfrf.workbench.assembly_file.read import AssemblyFile, read_assembly_file
from jointfrf.workbench.cli.arguments.levels import DriveArguments, FilterArguments, LevelsArguments
from jointfrf.workbench.cli.arguments.measured_file import BandArguments
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import UsageError, warn_of_ignored

__all__ = ["check_decay_arguments", "levels_of_decays", "modes_csv", "modes_of_decay"]

#: Relative errors of frequency and damping that the models share with all levels, unless `--errors` states them.
_ERRORS = (0.001, 0.0)


def check_decay_arguments(args: LevelsArguments, path: Path) -> None:
    """Raise a UsageError for missing options, and warn of options without effect."""
    if args.files or args.backbone is not None:
        raise UsageError("--decay contains the levels; leave out FILE and --backbone")
    if args.modes is None:
        shown = ", ".join(f"{one:.4g}" for one in _record(args, path).peaks()[:6]) or "none"
        raise UsageError(f"--modes is missing; name the mode in Hz (resonances, the strongest first: {shown})")
    others = (*DriveArguments.names(), "--table", "--noise", *BandArguments.names(), "--quantity", "--force-quantity",
              "--unit", "--map", "--channel")  # fmt: skip
    warn_of_ignored(args, others, "--decay names a time record")
    if args.model is None:
        if args.report is not None or args.joints is not None:
            raise UsageError("--model is missing; add it for --report and --joints")
        warn_of_ignored(args, ("--dof", "--errors", "--laws", "--sensors"), "--model is not given")


def _record(args: LevelsArguments, path: Path) -> DecayRecord:
    own = read_time_record(path, skip_lines=args.skip_lines, rate=args.rate, unit=args.sensor_unit or "")
    motions = list[MotionQuantity]()
    for name, motion in zip(own.sensors, own.motion, strict=True):
        if not motion:
            raise UsageError(
                f"{path} states no unit of {name}; write {name} [m/s^2] in its heading, or state --sensor-unit"
            )
        motions.append(motion)
    try:
        return DecayRecord(own.time, own.signals, own.sensors, tuple(motions))
    except ValueError as error:
        raise FileContentError(f"{path}: {error}") from error


def modes_of_decay(args: LevelsArguments, path: Path) -> list[ModalDecay]:
    """Return the modes of the record."""
    with waiting(f"reading {path}"):
        record = _record(args, path)
    with waiting("modes"):
        return [decay_of_mode(record, one, **args.keywords(FilterArguments)) for one in args.modes or ()]


def levels_of_decays(
    args: LevelsArguments, model: Path, modes: Sequence[ModalDecay]
) -> tuple[JointLevels, dict[str, Any]]:
    """Return the levels of the joint, and their source."""
    lines = np.unique(np.concatenate([one.freq_hz for one in modes]))
    file = read_assembly_file(model)
    parts = file.parts(lines)
    file, _ = file.located(parts)
    names = _channels(args, file, modes[0].sensors)
    whole = file.assembly(lines, parts, [dof.removeprefix("-") for dof in names.values()])
    errors = (args.errors[0], args.errors[1]) if "errors" in args.given else _ERRORS
    found = decay_levels(whole, modes, channels=names, dof=args.dof, errors=errors, laws=args.laws)
    return found, {"sources": [str(args.decay)]} | modes_content(modes)


def _channels(args: LevelsArguments, file: AssemblyFile, names: Sequence[str]) -> dict[str, str]:
    """Return the DOF of each sensor that has one: by --sensors, by [channels], by its name."""
    given: dict[str, Any] = dict(args.sensors or {})
    for name in given:
        if name not in names:
            known = f"{', '.join(names)}{did_you_mean(name, names)}"
            raise UsageError(f"--sensors: {args.decay} has no column {name}; use one of {known}")
    for channel, dof in file.keys.channels.items():
        given.setdefault(channel, dof)
        given.setdefault(str(Channel.parse(channel).opposite()), f"-{dof}")
    found = {name: given.get(name, name) for name in names if name in given or "/" in name}
    if not found:
        raise UsageError(
            f"no column of {args.decay} ({', '.join(names[:6])}) is a DOF or channel of {args.model}; name them by "
            "--sensors"
        )
    return found


def modes_content(modes: Sequence[ModalDecay]) -> dict[str, Any]:
    """Return the modes for --json."""
    found = []
    for one in modes:
        numbers = np.where(np.isfinite(one.amplitude), one.amplitude, 0.0).tolist()
        found.append({
            "mode": one.name, "sensors": list(one.sensors), "time": one.time.tolist(), "amplitude": numbers,
            "frequency": one.freq_hz.tolist(), "frequency_error": (one.errors[0] * one.freq_hz).tolist(),
            "damping": one.damping.tolist(), "damping_error": (one.errors[1] * one.damping).tolist(),
            "bandwidth": one.bandwidth,
        })  # fmt: skip
    return {"modes": found}


def modes_csv(modes: Sequence[ModalDecay]) -> str:
    """Write a line for each level of each mode: frequency and damping over the amplitude of each sensor."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("mode", "time", "frequency", "frequency_error", "damping", "damping_error", *modes[0].sensors))
    for one in modes:
        for i in range(one.time.size):
            amplitudes = ("" if np.isnan(a) else repr(float(a)) for a in one.amplitude[i])
            row = (one.time[i], one.freq_hz[i], one.errors[0][i] * one.freq_hz[i], one.damping[i],
                   one.errors[1][i] * one.damping[i])  # fmt: skip
            writer.writerow((one.name, *(repr(float(each)) for each in row), *amplitudes))
    return text.getvalue()
