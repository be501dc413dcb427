"""`jointfrf levels`: one joint at several levels, and what its stiffness and damping do over amplitude."""

from __future__ import annotations

import argparse
import re
import warnings
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np

from jointfrf.amplitude.amplitude_laws import AMPLITUDE_LAWS
from jointfrf.amplitude.backbone import Backbone, backbone_levels
from jointfrf.amplitude.levels import JointLevel, JointLevels, levels
from jointfrf.amplitude.lines import Drive, MotionQuantity
from jointfrf.assembly_file.measured import measured_assembly
from jointfrf.assembly_file.read import read_assembly_file
from jointfrf.cli.measured_file import READING, add_joint_arguments, read_receptances, words
from jointfrf.cli.measured_joint import measured_joint
from jointfrf.cli.parser import CommandParser, one_of
from jointfrf.cli.usage import Output, UsageError, check_folder, check_out, waiting, warn_of_ignored
from jointfrf.errors import ConvergenceWarning, FileContentError, FrfCheckWarning, IdentificationWarning
from jointfrf.extras import check_extras
from jointfrf.files import write_file
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.identify import identify
from jointfrf.identification.joint_file import write_joint
from jointfrf.identification.result import Fit
from jointfrf.io.csv_file import read_text_table
from jointfrf.messages.of_data import FATAL_CODES
from jointfrf.report.levels_page import levels_csv, write_levels
from jointfrf.spelling import did_you_mean

__all__ = ["add_arguments", "run"]

#: Options that say where FRFs at the joint are.
_OF_THE_JOINT = ("--j", "--k", "--dofs", "--at", "--at-k", "--channels", "--spacing", "--axis")
#: Columns of a table of tests.
_FILE, _LABEL, _LEVEL = "file", "label", "level"


class _Test(NamedTuple):
    """A file, its name, its level as it was written."""

    path: Path
    label: str
    level: float


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Stiffness and loss factor of a joint over the amplitude of its motion: one file a level, each fitted with "
        "the models of assembly.toml or, as by identify, to FRFs at the joint; or the backbone of a mode. Laws over "
        "amplitude are fitted to all."
    )
    parser.add_argument("files", type=Path, nargs="*", metavar="FILE", help="measured FRFs, one file for each level")
    parser.option("--model FILE", "assembly.toml, as for identify; without it FRFs at the joint (--j, --k)", Path)
    parser.option(
        "--table FILE",
        "instead of files: a table (CSV) with columns file and level, perhaps label; files beside it",
        Path,
    )
    parser.heading("what was held in each test")
    parser.option(
        "--held WHAT",
        "what had its level on all lines: force (default), a response as the models name it (B/25:y; without models as "
        "the file does, 101:+y), or joint:DOF for the relative motion of a joint DOF (joint:theta_z)",
        default="force",
    )
    parser.option(
        "--level LEVEL,...", "level of each file, peak value: N; of a response by --motion; m or rad", _numbers
    )
    parser.option(
        "--motion", "what the level of a response is: m, m/s or m/s^2", get_args(MotionQuantity), "displacement"
    )
    parser.heading("the backbone of a mode, instead of files")
    parser.option(
        "--backbone FILE",
        "a table (CSV) with columns frequency (Hz), amplitude (peak, by --motion) and damping (ratio) or, of tests at "
        "phase resonance, force (peak, N); perhaps label",
        Path,
    )
    parser.option("--channel DOF", "where the amplitude was measured, and the force acts, as the models name it: A/1:y")
    parser.option("--dof DOF", "DOF of the joint that is found, where more than one has a law")
    parser.option("--errors FREQUENCY,DAMPING", "relative standard errors (0.001,0.05); damping: or of force", _numbers)
    parser.heading("the fits")
    parser.option("--noise LEVEL", "relative noise of the FRFs, 0.01 for 1 %% (default: from them)", float)
    parser.option("--laws NAME,...", f"laws over amplitude that are fitted: {', '.join(AMPLITUDE_LAWS)} (all)", _laws)
    add_joint_arguments(parser)
    parser.set_defaults(points=None)  # one joint point
    parser.heading("results")
    parser.option("--report FILE", "write a page (HTML) with figures of stiffness and loss factor over amplitude", Path)
    parser.option("--output FILE", "write the result as a table (CSV)", Path)
    parser.option(
        "--joints DIR",
        "write the joint of each level, springs of its secant stiffness and damping, as DIR/LABEL.toml: export writes "
        "cards of it, couple takes it",
        Path,
    )


def _numbers(word: str) -> list[float]:
    try:
        return [float(one) for one in word.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be numbers between commas, not {word!r}") from None


def _laws(word: str) -> list[str]:
    return [one_of(AMPLITUDE_LAWS)(one) for one in words(word)]


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    if args.model is not None:
        warn_of_ignored(args, _OF_THE_JOINT, "it is for FRFs at the joint, without --model")
    elif args.backbone is not None or args.j is None:
        why = "a backbone needs it" if args.backbone is not None else "name the joint in the files by --j, --k, --dofs"
        raise UsageError(f"--model is missing: assembly.toml says what both parts and the joint are; {why}")
    for option, path in (("--report", args.report), ("--output", args.output)):
        check_folder(option, path)
    if args.report is not None:
        check_extras("jinja2")
        check_extras("matplotlib")
    if args.joints is not None:
        check_out("--joints", args.joints)
    out = Output(args)
    found, about = _of_fits(args) if args.backbone is None else _of_backbone(args)
    written = []
    if args.report is not None:
        written.append(write_levels(found, args.report, command=args.typed))
    if args.output is not None:
        write_file(args.output, levels_csv(found))
        written.append(args.output)
    if args.joints is not None:
        written += _write_joints(found, args.joints)
    out.say(found, *([""] if written else []), *(f"wrote {path}" for path in written))
    out.warn(*found.warnings)
    by_dof = {dof: [_by_name(one) for one in own] for dof, own in found.levels.items()}
    out.give(
        about
        | asdict(replace(found, joints={}))
        | found.content()
        | {"levels": by_dof, "written": [str(path) for path in written]}
    )
    return 1 if found.refused else 0


def _write_joints(found: JointLevels, folder: Path) -> list[Path]:
    """Write the joint of each level by its label."""
    names = {label: re.sub(r"^\.|[^\w.+-]", "_", label) for label in found.joints}
    if len(set(names.values())) < len(names):
        raise UsageError("--joints: two labels give the same name of a file")
    folder.mkdir(parents=True, exist_ok=True)
    return [write_joint(folder / f"{names[label]}.toml", joint) for label, joint in found.joints.items()]


def _by_name(one: JointLevel) -> dict[str, Any]:
    return asdict(one) | {"stiffness": one.stiffness._asdict(), "loss_factor": one.loss_factor._asdict()}


def _of_fits(args: argparse.Namespace) -> tuple[JointLevels, dict[str, Any]]:
    """Return the levels of files, and what they were."""
    warn_of_ignored(args, ("--channel", "--dof", "--errors"), "there is no --backbone")
    tests = _tests(args)
    drives = [_drive(args, one) for one in tests]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)  # they are among the findings
        warnings.simplefilter("ignore", ConvergenceWarning)
        warnings.simplefilter("ignore", FrfCheckWarning)
        fits = [_fit(args, *each) for each in zip(tests, drives, strict=True)]
        with waiting("motion of the joint"):
            found = levels(*zip(*fits, strict=True), labels=[one.label for one in tests], laws=_chosen(args))
    return found, {"sources": [str(one.path) for one in tests], "drives": [asdict(one) for one in drives]}


def _chosen(args: argparse.Namespace) -> Sequence[str]:
    return AMPLITUDE_LAWS if args.laws is None else args.laws


def _of_backbone(args: argparse.Namespace) -> tuple[JointLevels, dict[str, Any]]:
    """Return the levels of the backbone of a mode, and where it stands."""
    if args.files or args.table is not None or args.level is not None:
        raise UsageError("--backbone has the levels: leave out files, --table and --level")
    if args.channel is None:
        raise UsageError("--channel is missing: where the amplitude of the backbone was measured, such as A/1:y")
    warn_of_ignored(args, ("--held", "--noise", "--band", *READING), "no file of FRFs is read")
    backbone = _backbone(args)
    file, lines = read_assembly_file(args.model), np.unique(backbone.freq_hz)
    parts = file.parts(lines)
    file, _ = file.located(parts)
    whole = file.assembly(lines, parts, [backbone.channel])
    found = backbone_levels(whole, backbone, dof=args.dof, laws=_chosen(args))
    return found, {"sources": [str(args.backbone)]}


def _backbone(args: argparse.Namespace) -> Backbone:
    path, columns = args.backbone, dict[str, list[str]]()
    table = read_text_table(path)
    second = "force" if "force" in table.heading else "damping"
    names = ("frequency", "amplitude", second)
    for name in names:
        if name not in table.heading:
            raise FileContentError(f"{path}: has no column {name}{did_you_mean(name, table.heading)}")
    if {"force", "damping"} <= set(table.heading):
        raise FileContentError(f"{path}: has damping and force: of a test at phase resonance leave out damping")
    if len(set(table.heading)) < len(table.heading):
        raise FileContentError(f"{path}: two columns have the same name")
    for where, cells in table.rows:
        for name, cell in zip(table.heading, cells, strict=True):
            if name in names:
                try:
                    table.number(cell)
                except ValueError:
                    raise FileContentError(f"{where}: the {name} {cell!r} is no number") from None
            columns.setdefault(name, []).append(cell)
    if not columns:
        raise FileContentError(f"{path}: has no rows")
    errors = args.errors or [0.001, 0.05]
    if len(errors) != 2:
        raise UsageError("--errors takes two numbers, of frequency and of damping")
    freq, amplitude, other = (np.array([table.number(cell) for cell in columns[name]]) for name in names)
    with np.errstate(all="ignore"):  # a frequency of zero is an error below
        amplitude = amplitude / (2 * np.pi * freq) ** get_args(MotionQuantity).index(args.motion)
    try:
        return Backbone(
            args.channel, freq, amplitude, **{second: other}, freq_error=errors[0],
            damping_error=errors[1], labels=tuple(columns.get(_LABEL, ())),
        )  # fmt: skip
    except ValueError as error:
        raise FileContentError(f"{path}: {error}") from error


def _tests(args: argparse.Namespace) -> list[_Test]:
    """Return files, names and levels, from the table or from the command line."""
    if args.table is not None and (args.files or args.level is not None):
        raise UsageError("--table names files and levels: leave out those of the command line")
    if args.table is not None:
        return _of_table(args.table)
    if not args.files:
        raise UsageError("name the files of all levels, or a table of them by --table")
    given = [] if args.level is None else args.level
    if len(given) != len(args.files):
        raise UsageError(f"--level must name {len(args.files)} levels, one for each file, not {len(given)}")
    labels = [path.stem for path in args.files]
    if len(set(labels)) < len(labels):
        labels = [str(path) for path in args.files]
    return [_Test(*one) for one in zip(args.files, labels, given, strict=True)]


def _of_table(path: Path) -> list[_Test]:
    table = read_text_table(path)
    for name in (_FILE, _LEVEL):
        if name not in table.heading:
            raise FileContentError(f"{path}: has no column {name}{did_you_mean(name, table.heading)}")
    if len(set(table.heading)) < len(table.heading):
        raise FileContentError(f"{path}: two columns have the same name")
    found = []
    for where, cells in table.rows:
        row = dict(zip(table.heading, cells, strict=True))
        try:
            level = table.number(row[_LEVEL])
        except ValueError:
            raise FileContentError(f"{where}: the level {row[_LEVEL]!r} is no number") from None
        found.append(_Test(path.parent / row[_FILE], row.get(_LABEL, Path(row[_FILE]).stem), level))
    if not found:
        raise FileContentError(f"{path}: has no rows")
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


def _fit(args: argparse.Namespace, test: _Test, drive: Drive) -> tuple[Fit, Drive]:
    """Return the fit of a test, and what was held by the names of the fit."""
    own = argparse.Namespace(**vars(args) | {"files": [test.path]})
    frfs = read_receptances(own)
    if args.model is not None:
        measured = measured_assembly(args.model, frfs, bands=args.band)
        with waiting(f"fit of {test.path.name}"):
            return measured.fit(noise=args.noise, accept=FATAL_CODES), drive
    joint = measured_joint(own, frfs)
    channels = [str(one) for one in joint.responses.channels]
    if drive.held == "response" and drive.channel not in channels:
        hint = did_you_mean(drive.channel, channels)
        raise UsageError(f"--held {drive.channel}: {test.path.name} has {', '.join(channels)} at the joint{hint}")
    with waiting(f"fit of {test.path.name}"):
        known = joint.known(frfs)
        fit = identify(frfs.freq_hz, joint.h, joint.dofs, args.band, noise=args.noise, accept=FATAL_CODES, **known)
    if drive.held == "response" and isinstance(fit.data, FitData):
        drive = replace(drive, channel=fit.data.response_names[channels.index(drive.channel)])
    return fit, drive
