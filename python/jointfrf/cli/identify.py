"""`jointfrf identify`: from measured FRFs to the parameters of a joint."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np

from jointfrf.assembly_file.side_part import SidePart, read_side
from jointfrf.channels.check.check import stop_at_errors
from jointfrf.channels.check.result import FrfCheck
from jointfrf.channels.point_lines import difference_error
from jointfrf.cli.check import check_joint
from jointfrf.cli.export import CardRequest, add_card_arguments, card_request, page_nodes, parse_export, written_cards
from jointfrf.cli.identify_model import add_model_arguments, run_model
from jointfrf.cli.joint_laws import add_law_arguments, joint_of_laws
from jointfrf.cli.measured_file import (
    add_file_arguments,
    file_names,
    in_some_band,
    read_measured,
    setups_with_gains,
    shown_nodes,
    words,
)
from jointfrf.cli.measured_joint import MeasuredJoint, measured_joint
from jointfrf.cli.parser import CommandParser, one_of
from jointfrf.cli.usage import Output, UsageError, check_folder, check_out, plain, waiting, warn_of_ignored
from jointfrf.dofs import is_rotation
from jointfrf.errors import ConvergenceWarning, FrfCheckWarning, IdentificationWarning
from jointfrf.extras import check_extras
from jointfrf.frf.noise_model import estimate_noise
from jointfrf.identification.band_means import identify_band_mean
from jointfrf.identification.identify import identify
from jointfrf.identification.manifold.coordinates import CrossTerms, DampingTerms
from jointfrf.identification.record import fit_to_dict, write_record
from jointfrf.identification.result import Fit
from jointfrf.identification.side_models import SideModel
from jointfrf.io import FrfSet
from jointfrf.laws.law_joint import LawJoint
from jointfrf.messages.of_data import FATAL_CODES
from jointfrf.report.fit_page import write_report
from jointfrf.spelling import did_you_mean

__all__ = ["add_arguments", "run"]

#: Methods that need no model.
_METHODS = ("compliance", "inverse-substructuring")


def _methods(text: str) -> list[str]:
    found = words(text)
    for word in found or [text]:
        if word not in _METHODS:
            hint = did_you_mean(word, _METHODS)
            raise argparse.ArgumentTypeError(f"{word!r} is not one of {', '.join(_METHODS)}{hint}")
    return found


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Identify a joint from the FRFs of an assembly. Accelerances and mobilities become receptances. The DOFs of "
        "the joint are those of virtual points of all channels around it (--at), of points along a line (rotations by "
        "central differences), or of two nodes whose rotations are in the file. With models of both parts (--model) "
        "any FRFs will do."
    )
    add_file_arguments(parser)
    add_model_arguments(parser)
    parser.heading("the fit")
    parser.option(
        "--method METHODS", f"one or several of {','.join(_METHODS)} (default: compliance)", _methods, ["compliance"]
    )
    parser.option(
        "--damping",
        "damping terms of K* = k (1 + i eta) + i w c (default: auto, what the data support)",
        (*get_args(DampingTerms), "auto"),
        "auto",
    )
    parser.option(
        "--cross",
        "terms between the joint DOFs: none (default), not looked at, fitted within each of --points, fitted",
        get_args(CrossTerms),
        "zero",
    )
    parser.option(
        "--same NAMES", "joint points that are equal and share their parameters: bolt1,bolt2", words, repeated=True
    )
    parser.option(
        "--side-j PART",
        "with --side-k: part.toml, the model of side j alone, free of the other side, as [A] of assembly.toml: "
        "corrects the FRFs for what the side bends between channels and joint",
        Path,
    )
    parser.option("--side-k PART", "the same of side k", Path)
    add_law_arguments(parser)
    parser.option("--noise LEVEL", "relative noise of the FRFs, 0.01 for 1 %% (default: from their reciprocity)", float)
    parser.option(
        "--setup-gain LEVEL",
        "relative standard deviation of the gain of one set-up, 0.01 for 1 %%: each file is one (default: from what "
        "they differ by)",
        float,
    )
    parser.option(
        "--common-gain LEVEL", "that of a gain which all FRFs share, as by one calibration of the hammer", float
    )
    parser.option(
        "--accept CODE",
        "go on in spite of an error of the data by its code, such as quantity; may be repeated",
        one_of(FATAL_CODES),
        repeated=True,
    )
    parser.option(
        "--window-decay SIGMA", "exponential window exp(-SIGMA t) of the test, 1/s: taken off stiffnesses", float
    )
    parser.option(
        "--bending-stiffness EI",
        "E I of the thinner part in N m^2: says how much compliance the differences along a line add",
        float,
    )
    parser.heading("results")
    parser.option("--out DIR", "folder for identification.json and figures", Path)
    parser.option("--report FILE", "the identification by method compliance as one HTML page", Path)
    parser.option("--space", "with --report: a view in space with moving deformation; needs plotly, 5 MB more")
    parser.option("--save FILE", "keep the joint (by the first method) in a JSON file", Path)
    parser.option("--save-lines", "with --save: K* of each line, too, which makes the file many times as long")
    parser.option(
        "--export PROGRAM:J,K",
        "the joint (by the first method) as input of abaqus, calculix (stiffness only), nastran or ansys, between "
        "its nodes J and K: abaqus:9001,9002; rotations of calculix need two ROT NODEs after them; of several joints "
        "abaqus:fl=9001,9002:fr=9003,9004",
        parse_export,
    )
    add_card_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    _check_results(args)
    if args.model is not None:
        _refuse(args, ("points", "same"), "is of FRFs at the joint points themselves: it does not go with --model")
        return run_model(args)
    _refuse(args, ("each", "find_wrong_channels"), "is for tests with --model: name the file of the assembly")
    out = Output(args)
    _check_points(args)
    measured = read_measured(args)
    frfs = measured.receptance()
    joint = measured_joint(args, frfs, args.bending_stiffness)
    laws = joint_of_laws(args, joint.dofs)
    sides = _sides(args, frfs, joint)
    points = np.array(joint.responses.references)
    damping = args.damping if laws is None else "none"
    request = card_request(args, joint.dofs, damping=damping, cross=args.cross, points=points)
    check = check_joint(joint, measured)
    stop_at_errors(check.findings, args.accept or ())
    _warn(args, joint, check)
    out.say(*_heading(args, frfs, joint), *(line for side in sides for line in side.text))
    fits = []
    for method in args.method:
        with waiting(f"fit by {method}"):
            fit = _fit(args, method, frfs, joint, laws, tuple(side.model for side in sides))
            fits.append(fit.with_findings_of_data(check.findings))
        out.say("", fits[-1])
        out.warn(*fits[-1].warnings)
    text, written = _write_results(args, frfs, joint, fits, request)
    if text and args.output is None:
        out.say("", text.rstrip("\n"))
    out.say(*([""] if written else []), *(f"wrote {path}" for path in written))
    out.give(_content(args, joint, check, fits, text, written))
    return 0


def _check_results(args: argparse.Namespace) -> None:
    """Raise an error for results that cannot be written, before anything is read."""
    if args.out is not None:
        check_extras("matplotlib")
        check_out("--out", args.out)
    if args.report is not None:
        check_extras("jinja2", *(["plotly"] if args.space else []))
        if "compliance" not in args.method:
            raise UsageError("--report is of method compliance: name it among the methods")
        check_out("--report", args.report.parent)
        if args.report.is_dir():
            raise UsageError(f"--report: {args.report} is a folder, not a file")
    elif args.space:
        raise UsageError("--space is of --report: name a file for the page")
    check_folder("--save", args.save)


def _refuse(args: argparse.Namespace, names: tuple[str, ...], why: str) -> None:
    """Raise an error for the first of these options that is given."""
    for name in names:
        if getattr(args, name):
            raise UsageError(f"--{name.replace('_', '-')} {why}")


def _check_points(args: argparse.Namespace) -> None:
    """Raise an error for options that do not go with the number of joint points."""
    if args.save is None:
        warn_of_ignored(args, ("--save-lines",), "it is for --save")
    if args.points is None:
        _refuse(args, ("same",), "is of several joint points: name them by --points")
    else:
        _refuse(args, ("side_j", "side_k"), "corrects the FRFs of one joint point: it does not go with --points")


def _warn(args: argparse.Namespace, joint: MeasuredJoint, check: FrfCheck) -> None:
    """Warn of DOFs that the joint leaves out, and of options that are not used."""
    for text in joint.warnings(check):
        warnings.warn(text, FrfCheckWarning, stacklevel=3)
    if "compliance" not in args.method:
        warn_of_ignored(
            args,
            ("--damping", "--cross", "--noise", "--setup-gain", "--common-gain", "--window-decay"),
            f"method {args.method[0]} does not use it",
        )
    if joint.channels is not None or len(joint.nodes[0]) == 1:
        warn_of_ignored(args, ("--bending-stiffness",), "no rotation is found by differences along a line")


def _write_results(
    args: argparse.Namespace, frfs: FrfSet, joint: MeasuredJoint, fits: list[Fit], request: CardRequest | None
) -> tuple[str, list[Path]]:
    """Write what the options ask for; return the cards and the files written."""
    text, written = "", []
    if args.save is not None:
        _save(args.save, fits[0], file_names(args), joint, lines=args.save_lines)
        written.append(args.save)
    if request is not None:
        text = written_cards(fits[0], request, [f"from {file_names(args)}", *_places(joint)])
        written += [] if args.output is None else [args.output]
    if args.report is not None:
        fit = fits[args.method.index("compliance")]
        args.report.parent.mkdir(parents=True, exist_ok=True)
        written.append(write_report(fit, args.report, source=file_names(args), command=args.typed,
                                    nodes=page_nodes(args), space=args.space))  # fmt: skip
    if args.out is not None:
        written += _write_figures(args, frfs, joint, fits)
    return text, written


def _content(
    args: argparse.Namespace,
    joint: MeasuredJoint,
    check: FrfCheck,
    fits: list[Fit],
    text: str,
    written: list[Path],
) -> dict[str, Any]:
    return {
        "sources": [str(path) for path in args.files],
        "joint": joint.to_dict(),
        "checks": check.to_dict(),
        "warnings": [*joint.warnings(check), *(text for fit in fits for text in fit.warnings)],
        "fits": [fit_to_dict(fit, lines=False) for fit in fits],
        "cards": text or None,
        "written": [str(path) for path in written],
    }


def _heading(args: argparse.Namespace, frfs: FrfSet, joint: MeasuredJoint) -> Iterator[str]:
    """Say what is identified from what."""
    points = " and ".join(
        shown_nodes(side) if joint.channels is not None else ", ".join(map(str, side)) for side in joint.nodes
    )
    size = f"{frfs.h.shape[1]} responses x {frfs.h.shape[2]} excitations"
    yield f"{file_names(args)}: {size}; joint between points {points}"
    yield from joint.text()
    if joint.channels is None and len(joint.nodes[0]) > 1 and not joint.is_of_points:
        yield from _differences(args, joint)


def _differences(args: argparse.Namespace, joint: MeasuredJoint) -> Iterator[str]:
    """Say what the central differences do to a rotational joint stiffness, before the result is read."""
    rotations = [i for i, dof in enumerate(joint.dofs) if is_rotation(dof)]
    if not rotations:
        return
    reach = 1 / abs(joint.responses.transform[rotations[0]]).max() / 2
    yield f"rotations by central differences over +-{1e3 * reach:.3g} mm"
    if args.bending_stiffness is not None:
        error = difference_error(reach, args.bending_stiffness, 1.0)
        yield (
            f"they add about dx/(3 E I) = {error.compliance:.3g} rad/(N m) to the compliance of a rotational DOF: "
            f"a joint much stiffer than {1 / error.compliance:.3g} N m/rad cannot be distinguished from a rigid one"
        )


def _sides(args: argparse.Namespace, frfs: FrfSet, joint: MeasuredJoint) -> list[SidePart]:
    """Read the models of both sides; none where none are named."""
    paths = [path for path in (args.side_j, args.side_k) if path is not None]
    if not paths:
        return []
    if len(paths) == 1:
        raise UsageError("--side-j and --side-k go together: both sides of the joint bend")
    if "compliance" not in args.method:
        raise UsageError("--side-j and --side-k are of method compliance: name it among the methods")
    lines, _ = in_some_band(frfs.freq_hz, joint.h, args.band)
    found = []
    for side, path in enumerate(paths):
        responses, forces = joint.placed(side, frfs.coordinates)
        found.append(read_side(path, lines, responses, forces, len(joint.dofs)))
    return found


def _fit(
    args: argparse.Namespace,
    method: str,
    frfs: FrfSet,
    joint: MeasuredJoint,
    laws: LawJoint | None,
    sides: tuple[SideModel, ...],
) -> Fit:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)  # they are in the table
        warnings.simplefilter("ignore", ConvergenceWarning)
        warnings.simplefilter("ignore", FrfCheckWarning)  # printed with the names of the channels
        if method == "compliance":
            options = _of_compliance(args, frfs, joint, laws)
            if sides:
                options["sides"] = sides
            return identify(frfs.freq_hz, joint.h, joint.dofs, args.band, **options)
        transform = joint.responses if joint.is_square else None
        return identify_band_mean(
            frfs.freq_hz, _square(joint), "inverse-substructuring", joint.dofs, args.band, transform=transform
        )


def _square(joint: MeasuredJoint) -> np.ndarray:
    """FRFs as means over bands take them, which know one transform only."""
    if joint.is_square:
        return joint.h
    return np.ascontiguousarray(joint.responses.transform @ joint.h @ joint.forces.transform.T)


def _of_compliance(
    args: argparse.Namespace, frfs: FrfSet, joint: MeasuredJoint, laws: LawJoint | None
) -> dict[str, Any]:
    """Return the options of the compliance fit: what is known of the channels, damping, cross terms, noise."""
    known = joint.known(frfs)
    terms = {"damping": args.damping, "cross": args.cross} if laws is None else {"joint": laws}
    if args.same is not None:
        terms["same"] = args.same
    return {
        **known,
        "noise": args.noise,
        "setups": setups_with_gains(args, known["setups"], joint.h.shape),
        "accept": args.accept or (),
        **({"window_decay": args.window_decay} if args.window_decay is not None else {}),
        **terms,
    }


def _places(joint: MeasuredJoint) -> list[str]:
    """Say where the reference points are."""
    one, other = joint.responses.references
    if np.array_equal(one, other):
        return [f"reference point x, y, z = {', '.join(f'{value:.6g}' for value in one + 0.0)} m"]
    both = [", ".join(f"{value:.6g}" for value in place + 0.0) for place in (one, other)]
    return [f"reference points x, y, z = {both[0]} m (j) and {both[1]} m (k)"]


def _save(path: Path, fit: Fit, source: str, joint: MeasuredJoint, *, lines: bool) -> None:
    about: dict[str, Any] = {"source": source}
    if not joint.is_of_points:
        about["reference_points_m"] = plain(dict(zip("jk", joint.responses.references, strict=True)))
    write_record(path, fit_to_dict(fit, lines=lines) | about)


def _write_figures(args: argparse.Namespace, frfs: FrfSet, joint: MeasuredJoint, fits: list[Fit]) -> list[Path]:
    from jointfrf.report.fit import write_fit
    from jointfrf.report.receptance import noise_figure

    figures = []
    if "compliance" in args.method and args.noise is None:
        freq_hz, h = in_some_band(frfs.freq_hz, joint.h, args.band)
        names = [[str(channel) for channel in side.channels] for side in (joint.responses, joint.forces)]
        figures.append(noise_figure(freq_hz, h, estimate_noise(freq_hz, h), *names))
    return write_fit(fits, args.out, file_names(args), figures)
