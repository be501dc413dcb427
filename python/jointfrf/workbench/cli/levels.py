"""`jointfrf levels`: one joint at several levels, and what its stiffness and damping do over amplitude."""

from __future__ import annotations

import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from jointfrf.choices import MotionQuantity
from jointfrf.errors import FileContentError
from jointfrf.files import write_file
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.identify import identify
from jointfrf.identification.joint_file import write_joint
from jointfrf.identification.result import Fit
from jointfrf.io import read_frfs
from jointfrf.messages.of_data import FATAL_CODES
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.amplitude.backbone import Backbone, backbone_levels
from jointfrf.workbench.amplitude.decay import ModalDecay
from jointfrf.workbench.amplitude.levels import JointLevel, JointLevels, levels
from jointfrf.workbench.amplitude.lines import Drive
from jointfrf.workbench.assembly_file.measured import MeasuredAssembly, measured_assembly
from jointfrf.workbench.assembly_file.read import named_dof, read_assembly_file
from jointfrf.workbench.cli.arguments.levels import LevelsArguments
from jointfrf.workbench.cli.arguments.measured_file import (
    BandArguments,
    NoiseArguments,
    PlaceArguments,
    ReadingArguments,
)
from jointfrf.workbench.cli.decays import (
    check_decay_arguments,
    levels_of_decays,
    modes_content,
    modes_csv,
    modes_of_decay,
)
from jointfrf.workbench.cli.measured_file import stated_noise, without_warnings_of_fits
from jointfrf.workbench.cli.measured_joint import measured_joint
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.table_of_tests import labels_of, read_rows
from jointfrf.workbench.cli.usage import Failures, Interrupt, Output, UsageError, warn_of_ignored
from jointfrf.workbench.report.levels_page import levels_csv, write_levels

__all__ = ["run"]

#: Column of tables that names a test.
_LABEL = "label"


class _Test(NamedTuple):
    """A file, its name, its level as it was written."""

    path: Path
    label: str
    level: float


def run(args: LevelsArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    if args.decay is not None:
        check_decay_arguments(args, args.decay)
    if args.model is not None:
        warn_of_ignored(args, PlaceArguments.names(), "--model defines the joint")
    elif args.backbone is not None:
        raise UsageError("--model is missing; add it for a backbone")
    elif args.decay is None and args.j is None:
        raise UsageError("--model is missing; add it, or locate the joint by --j, --k, --dofs")
    out, failures, interrupt = Output(args), Failures(args), Interrupt()
    modes = modes_of_decay(args, args.decay) if args.decay is not None else []
    if modes and args.model is None:
        return _give_modes(args, out, modes)
    if modes and args.model is not None:
        found, about = levels_of_decays(args, args.model, modes)
    elif args.backbone is not None and args.model is not None:
        found, about = _of_backbone(args, args.backbone, args.model)
    else:
        found, about = _of_fits(args, failures, interrupt)
    found = replace(found, left_out=dict(failures.found))
    if args.report is not None:
        out.written.append(write_levels(found, args.report, command=args.typed, modes=modes))
    if args.output is not None:
        write_file(args.output, levels_csv(found))
        out.written.append(args.output)
    if args.joints is not None:
        out.written += _write_joints(found, args.joints)
    out.say(*(each for one in modes for each in (replace(one, findings=()), "")), found)
    out.warn(*found.warnings)
    by_dof = {dof: [_by_name(one) for one in own] for dof, own in found.levels.items()}
    content = {"levels": by_dof, "failed": failures.found, "written": out.written}
    out.give(about | asdict(replace(found, joints={})) | found.content() | content)
    failures.complain()
    interrupt.resume()
    return 1 if failures.found else 0


def _give_modes(args: LevelsArguments, out: Output, modes: list[ModalDecay]) -> int:
    """Print modes without a joint."""
    out.say(*(each for one in modes for each in (*([""] if one is not modes[0] else []), one)))
    if args.output is not None:
        write_file(args.output, modes_csv(modes))
        out.say(f"wrote {args.output}")
    out.warn(*(each for one in modes for each in one.warnings))
    content = {"sources": [args.decay], "written": [] if args.output is None else [args.output]}
    out.give(modes_content(modes) | content | {"findings": [asdict(each) for one in modes for each in one.findings]})
    return 0


def _write_joints(found: JointLevels, folder: Path) -> list[Path]:
    """Write the joint of each level by its label."""
    names = {label: re.sub(r"^\.|[^\w.+-]", "_", label) for label in found.joints}
    if len(set(names.values())) < len(names):
        raise UsageError("--joints: two labels give the same file name; change a label")
    folder.mkdir(parents=True, exist_ok=True)
    return [write_joint(folder / f"{names[label]}.toml", joint) for label, joint in found.joints.items()]


def _by_name(one: JointLevel) -> dict[str, Any]:
    return asdict(one) | {"stiffness": one.stiffness._asdict(), "loss_factor": one.loss_factor._asdict()}


def _of_fits(args: LevelsArguments, failures: Failures, interrupt: Interrupt) -> tuple[JointLevels, dict[str, Any]]:
    """Return the levels of files, and the tests they are from."""
    warn_of_ignored(args, ("--channel", "--dof", "--errors"), "neither --backbone nor --decay is given")
    tests, fits = _tests(args), dict[_Test, tuple[Fit, Drive]]()
    drives = {one: _drive(args, one) for one in tests}
    with without_warnings_of_fits():
        with waiting("tests") as count, interrupt.kept_back(fits):
            for done, test in enumerate(tests):
                count(done, len(tests))
                with failures.noted(str(test.path)):
                    fits[test] = _fit(args, test, drives[test])
        if not fits:
            raise FileContentError("; ".join(failures.found.values()))
        with waiting("motion of the joint"):
            found = levels(*zip(*fits.values(), strict=True), labels=[one.label for one in fits], laws=args.laws)
    return found, {"sources": [str(one.path) for one in fits], "drives": [asdict(drives[one]) for one in fits]}


def _of_backbone(args: LevelsArguments, path: Path, model: Path) -> tuple[JointLevels, dict[str, Any]]:
    """Return the levels of the backbone of a mode, and its file."""
    if args.files or args.table is not None or args.level is not None:
        raise UsageError("--backbone contains the levels; leave out files, --table and --level")
    if args.channel is None:
        raise UsageError("--channel is missing; name the DOF of the measured amplitude, such as A/1:y")
    unused = ("--held", *NoiseArguments.names(), *BandArguments.names(), *ReadingArguments.names())
    warn_of_ignored(args, unused, "no file of FRFs is read")
    backbone = _backbone(args, path, args.channel)
    file, lines = read_assembly_file(model), np.unique(backbone.freq_hz)
    parts = file.parts(lines)
    file, _ = file.located(parts)
    whole = file.assembly(lines, parts, [backbone.channel])
    return backbone_levels(whole, backbone, dof=args.dof, laws=args.laws), {"sources": [str(path)]}


def _backbone(args: LevelsArguments, path: Path, channel: str) -> Backbone:
    rows = read_rows(path, ("frequency", "amplitude"), numbers=("frequency", "amplitude", "force", "damping"))
    given = [name for name in ("force", "damping") if name in rows[0]]
    if not given:
        hint = did_you_mean("damping", rows[0])
        raise FileContentError(f"{path}: column damping is missing; add it{hint}")
    if len(given) > 1:
        raise FileContentError(f"{path}: has damping and force; leave out damping for tests at phase resonance")
    freq, amplitude, other = (np.array([row[name] for row in rows]) for name in ("frequency", "amplitude", *given))
    with np.errstate(all="ignore"):  # a frequency of zero is an error below
        amplitude = amplitude / (2 * np.pi * freq) ** get_args(MotionQuantity).index(args.motion)
    damping, force = (other, None) if given == ["damping"] else (None, other)
    labels = tuple(row[_LABEL] for row in rows) if _LABEL in rows[0] else ()
    try:
        return Backbone(channel, freq, amplitude, damping, force, freq_error=args.errors[0],
                        damping_error=args.errors[1], labels=labels)  # fmt: skip
    except ValueError as error:
        raise FileContentError(f"{path}: {error}") from error


def _tests(args: LevelsArguments) -> list[_Test]:
    """Return files, names and levels, from the table or from the command line."""
    if args.table is not None and (args.files or args.level is not None):
        raise UsageError("--table names files and levels; leave out FILE and --level")
    if args.table is not None:
        rows, folder = read_rows(args.table, ("file", "level"), numbers=("level",)), args.table.parent
        return [_Test(folder / row["file"], row.get(_LABEL, Path(row["file"]).stem), row["level"]) for row in rows]
    if not args.files:
        raise UsageError("no files are given; name one for each level, or a table by --table")
    given = args.level or []
    if len(given) != len(args.files):
        raise UsageError(f"--level has {len(given)} levels; give {len(args.files)}, one for each file")
    return [_Test(*one) for one in zip(args.files, labels_of(args.files), given, strict=True)]


def _drive(args: LevelsArguments, test: _Test) -> Drive:
    what, _, dof = args.held.partition(":")
    try:
        if args.held == "force":
            return Drive("force", test.level)
        if what == "joint" and dof:
            return Drive("joint", test.level, dof)
        return Drive("response", test.level, args.held, args.motion)
    except ValueError as error:
        raise ValueError(f"{test.label}: {error}") from error


def _of_models(drive: Drive, measured: MeasuredAssembly) -> Drive:
    """Return what was held by the names of the models, checked before the fit; ``B/@0.28,0,0:y`` is a node there."""
    if drive.held == "force":
        return drive
    name, _, own = drive.channel.partition("/")
    found = drive
    if drive.held == "response" and own.startswith("@") and name in measured.parts:
        found = replace(drive, channel=f"{name}/{named_dof(measured.parts[name], own).dof}")
    names = measured.responses if drive.held == "response" else measured.assembly.joint.dofs
    if found.channel not in names:
        what = "the controlled response" if drive.held == "response" else "the joint DOF"
        at = f" ({drive.channel})" if found != drive else ""
        hint = did_you_mean(found.channel, names)
        raise UsageError(f"{what} {found.channel}{at} was not measured; use one of {', '.join(names)}{hint}")
    return found


def _fit(args: LevelsArguments, test: _Test, drive: Drive) -> tuple[Fit, Drive]:
    """Return the fit of a test, and what was held by the names of the fit."""
    own = replace(args, files=[test.path])
    with waiting(f"reading {test.path.name}"):
        frfs = read_frfs(test.path, **args.reading()).receptance()
    if args.model is not None:
        measured = measured_assembly(args.model, frfs, bands=args.band)
        drive = _of_models(drive, measured)
        with waiting(f"fit of {test.path.name}"):
            return measured.fit(noise=stated_noise(args), accept=FATAL_CODES), drive
    joint = measured_joint(own, frfs)
    channels = [str(one) for one in joint.responses.channels]
    if drive.held == "response" and drive.channel not in channels:
        hint = did_you_mean(drive.channel, channels)
        raise UsageError(
            f"{test.path.name} has no channel {drive.channel} to control; use one of {', '.join(channels)}{hint}"
        )
    with waiting(f"fit of {test.path.name}"):
        noise = stated_noise(args)
        known = joint.known(frfs, is_noise_stated=noise is not None)
        fit = identify(frfs.freq_hz, joint.h, joint.dofs, args.band, noise=noise, accept=FATAL_CODES, **known)
    if drive.held == "response" and isinstance(fit.data, FitData):
        drive = replace(drive, channel=fit.data.response_names[channels.index(drive.channel)])
    return fit, drive
