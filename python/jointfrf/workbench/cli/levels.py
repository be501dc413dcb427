"""`jointfrf levels`: one joint at several levels, and what its stiffness and damping do over amplitude."""

from __future__ import annotations

import argparse
import re
import warnings
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from jointfrf.choices import MotionQuantity
from jointfrf.errors import ConvergenceWarning, FileContentError, FrfCheckWarning, IdentificationWarning
from jointfrf.extras import check_extras
from jointfrf.files import write_file
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.identify import identify
from jointfrf.identification.joint_file import write_joint
from jointfrf.identification.result import Fit
from jointfrf.io.csv_file import read_text_table
from jointfrf.messages.of_data import FATAL_CODES
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.amplitude.backbone import Backbone, backbone_levels
from jointfrf.workbench.amplitude.decay import ModalDecay
from jointfrf.workbench.amplitude.levels import JointLevel, JointLevels, levels
from jointfrf.workbench.amplitude.lines import Drive
from jointfrf.workbench.assembly_file.measured import MeasuredAssembly, measured_assembly
from jointfrf.workbench.assembly_file.read import named_dof, read_assembly_file
from jointfrf.workbench.cli.decays import (
    check_decay_arguments,
    levels_of_decays,
    modes_content,
    modes_csv,
    modes_of_decay,
)
from jointfrf.workbench.cli.measured_file import READING, read_receptances
from jointfrf.workbench.cli.measured_joint import measured_joint
from jointfrf.workbench.cli.noise import stated_noise
from jointfrf.workbench.cli.usage import (
    Failures,
    Interrupt,
    Output,
    UsageError,
    check_folder,
    check_out,
    waiting,
    warn_of_ignored,
)
from jointfrf.workbench.report.levels_page import levels_csv, write_levels

__all__ = ["run"]

#: Options that say where FRFs at the joint are.
_OF_THE_JOINT = ("--j", "--k", "--dofs", "--at", "--at-k", "--channels", "--spacing", "--axis")
#: Columns of a table of tests.
_FILE, _LABEL, _LEVEL = "file", "label", "level"


class _Test(NamedTuple):
    """A file, its name, its level as it was written."""

    path: Path
    label: str
    level: float


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    if args.decay is not None:
        check_decay_arguments(args)
    if args.model is not None:
        warn_of_ignored(args, _OF_THE_JOINT, "--model defines the joint")
    elif args.decay is None and (args.backbone is not None or args.j is None):
        why = (
            "add it for a backbone" if args.backbone is not None else "add it, or locate the joint by --j, --k, --dofs"
        )
        raise UsageError(f"--model is missing; {why}")
    for option, path in (("--report", args.report), ("--output", args.output)):
        check_folder(option, path)
    if args.report is not None:
        check_extras("jinja2")
        check_extras("matplotlib")
    if args.joints is not None:
        check_out("--joints", args.joints)
    out, failures, interrupt = Output(args), Failures(args), Interrupt()
    modes = modes_of_decay(args) if args.decay is not None else []
    if modes and args.model is None:
        return _give_modes(args, out, modes)
    if modes:
        found, about = levels_of_decays(args, modes)
    elif args.backbone is None:
        found, about = _of_fits(args, failures, interrupt)
    else:
        found, about = _of_backbone(args)
    found = replace(found, left_out=dict(failures.found))
    written = []
    if args.report is not None:
        written.append(write_levels(found, args.report, command=args.typed, modes=modes))
    if args.output is not None:
        write_file(args.output, levels_csv(found))
        written.append(args.output)
    if args.joints is not None:
        written += _write_joints(found, args.joints)
    shown = [each for one in modes for each in (replace(one, findings=()), "")]
    out.say(*shown, found, *([""] if written else []), *(f"wrote {path}" for path in written))
    out.warn(*found.warnings)
    by_dof = {dof: [_by_name(one) for one in own] for dof, own in found.levels.items()}
    content = {"levels": by_dof, "failed": failures.found, "written": [str(path) for path in written]}
    out.give(about | asdict(replace(found, joints={})) | found.content() | content)
    failures.complain()
    interrupt.resume()
    return 1 if failures.found else 0


def _give_modes(args: argparse.Namespace, out: Output, modes: list[ModalDecay]) -> int:
    """Print modes without a joint."""
    written = [args.output] if args.output is not None else []
    if written:
        write_file(args.output, modes_csv(modes))
    out.say(*(each for one in modes for each in (*([""] if one is not modes[0] else []), one)))
    out.say(*(f"wrote {path}" for path in written))
    out.warn(*(each for one in modes for each in one.warnings))
    content = {"sources": [str(args.decay)], "written": [str(path) for path in written]}
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


def _of_fits(args: argparse.Namespace, failures: Failures, interrupt: Interrupt) -> tuple[JointLevels, dict[str, Any]]:
    """Return the levels of files, and the tests they are from."""
    warn_of_ignored(args, ("--channel", "--dof", "--errors"), "neither --backbone nor --decay is given")
    tests, fits = _tests(args), dict[_Test, tuple[Fit, Drive]]()
    drives = {one: _drive(args, one) for one in tests}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)  # they are among the findings
        warnings.simplefilter("ignore", ConvergenceWarning)
        warnings.simplefilter("ignore", FrfCheckWarning)
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


def _of_backbone(args: argparse.Namespace) -> tuple[JointLevels, dict[str, Any]]:
    """Return the levels of the backbone of a mode, and where it stands."""
    if args.files or args.table is not None or args.level is not None:
        raise UsageError("--backbone contains the levels; leave out files, --table and --level")
    if args.channel is None:
        raise UsageError("--channel is missing; name the DOF of the measured amplitude, such as A/1:y")
    warn_of_ignored(args, ("--held", "--noise", "--floor", "--band", *READING), "no file of FRFs is read")
    backbone = _backbone(args)
    file, lines = read_assembly_file(args.model), np.unique(backbone.freq_hz)
    parts = file.parts(lines)
    file, _ = file.located(parts)
    whole = file.assembly(lines, parts, [backbone.channel])
    found = backbone_levels(whole, backbone, dof=args.dof, laws=args.laws)
    return found, {"sources": [str(args.backbone)]}


def _backbone(args: argparse.Namespace) -> Backbone:
    path, columns = args.backbone, dict[str, list[str]]()
    table = read_text_table(path)
    second = "force" if "force" in table.heading else "damping"
    names = ("frequency", "amplitude", second)
    for name in names:
        if name not in table.heading:
            raise FileContentError(f"{path}: column {name} is missing; add it{did_you_mean(name, table.heading)}")
    if {"force", "damping"} <= set(table.heading):
        raise FileContentError(f"{path}: has damping and force; leave out damping for tests at phase resonance")
    if len(set(table.heading)) < len(table.heading):
        raise FileContentError(f"{path}: two columns have the same name; rename one")
    for where, cells in table.rows:
        for name, cell in zip(table.heading, cells, strict=True):
            if name in names:
                try:
                    table.number(cell)
                except ValueError:
                    raise FileContentError(f"{where}: {name} {cell!r} is no number; correct it") from None
            columns.setdefault(name, []).append(cell)
    if not columns:
        raise FileContentError(f"{path}: has no rows; add one for each test")
    if len(args.errors) != 2:
        raise UsageError(f"--errors has {len(args.errors)} numbers; give two, of frequency and of damping")
    freq, amplitude, other = (np.array([table.number(cell) for cell in columns[name]]) for name in names)
    with np.errstate(all="ignore"):  # a frequency of zero is an error below
        amplitude = amplitude / (2 * np.pi * freq) ** get_args(MotionQuantity).index(args.motion)
    try:
        return Backbone(
            args.channel, freq, amplitude, other if second == "damping" else None, other if second == "force" else None,
            freq_error=args.errors[0], damping_error=args.errors[1], labels=tuple(columns.get(_LABEL, ())),
        )  # fmt: skip
    except ValueError as error:
        raise FileContentError(f"{path}: {error}") from error


def _tests(args: argparse.Namespace) -> list[_Test]:
    """Return files, names and levels, from the table or from the command line."""
    if args.table is not None and (args.files or args.level is not None):
        raise UsageError("--table names files and levels; leave out FILE and --level")
    if args.table is not None:
        return _of_table(args.table)
    if not args.files:
        raise UsageError("no files are given; name one for each level, or a table by --table")
    given = [] if args.level is None else args.level
    if len(given) != len(args.files):
        raise UsageError(f"--level has {len(given)} levels; give {len(args.files)}, one for each file")
    labels = [path.stem for path in args.files]
    if len(set(labels)) < len(labels):
        labels = [str(path) for path in args.files]
    return [_Test(*one) for one in zip(args.files, labels, given, strict=True)]


def _of_table(path: Path) -> list[_Test]:
    table = read_text_table(path)
    for name in (_FILE, _LEVEL):
        if name not in table.heading:
            raise FileContentError(f"{path}: column {name} is missing; add it{did_you_mean(name, table.heading)}")
    if len(set(table.heading)) < len(table.heading):
        raise FileContentError(f"{path}: two columns have the same name; rename one")
    found = []
    for where, cells in table.rows:
        row = dict(zip(table.heading, cells, strict=True))
        try:
            level = table.number(row[_LEVEL])
        except ValueError:
            raise FileContentError(f"{where}: level {row[_LEVEL]!r} is no number; correct it") from None
        found.append(_Test(path.parent / row[_FILE], row.get(_LABEL, Path(row[_FILE]).stem), level))
    if not found:
        raise FileContentError(f"{path}: has no rows; add one for each test")
    return found


def _drive(args: argparse.Namespace, test: _Test) -> Drive:
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


def _fit(args: argparse.Namespace, test: _Test, drive: Drive) -> tuple[Fit, Drive]:
    """Return the fit of a test, and what was held by the names of the fit."""
    own = argparse.Namespace(**vars(args) | {"files": [test.path]})
    with waiting(f"reading {test.path.name}"):
        frfs = read_receptances(own)
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
            f"--held {drive.channel}: {test.path.name} has no such channel; use one of {', '.join(channels)}{hint}"
        )
    with waiting(f"fit of {test.path.name}"):
        noise = stated_noise(args)
        known = joint.known(frfs, is_noise_stated=noise is not None)
        fit = identify(frfs.freq_hz, joint.h, joint.dofs, args.band, noise=noise, accept=FATAL_CODES, **known)
    if drive.held == "response" and isinstance(fit.data, FitData):
        drive = replace(drive, channel=fit.data.response_names[channels.index(drive.channel)])
    return fit, drive
