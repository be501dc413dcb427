"""`jointfrf identify`: from measured FRFs to the parameters of a joint."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from jointfrf.channels.check.check import stop_at_errors
from jointfrf.channels.check.result import FrfCheck
from jointfrf.channels.point_lines import difference_error
from jointfrf.dofs import is_rotation
from jointfrf.errors import FrfCheckWarning
from jointfrf.frf.noise_model import estimate_noise
from jointfrf.identification.band_means import identify_band_mean
from jointfrf.identification.identify import identify
from jointfrf.identification.record import fit_to_dict
from jointfrf.identification.result import Fit
from jointfrf.identification.side_models import SideModel
from jointfrf.io import FrfSet, read_frfs
from jointfrf.laws.law_joint import LawJoint
from jointfrf.workbench.assembly_file.side_part import SidePart, read_side
from jointfrf.workbench.cli.arguments.identify import GainArguments, IdentifyArguments
from jointfrf.workbench.cli.arguments.measured_file import NoiseArguments
from jointfrf.workbench.cli.arguments.words import shown_nodes
from jointfrf.workbench.cli.check import check_joint
from jointfrf.workbench.cli.export import card_request
from jointfrf.workbench.cli.fit_results import write_results
from jointfrf.workbench.cli.identify_model import run_model
from jointfrf.workbench.cli.joint_laws import joint_of_laws
from jointfrf.workbench.cli.masses import check_masses, check_stated, scale_of_fit
from jointfrf.workbench.cli.measured_file import (
    in_some_band,
    setups_with_gains,
    stated_noise,
    without_warnings_of_fits,
)
from jointfrf.workbench.cli.measured_joint import MeasuredJoint, measured_joint
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Interrupt, Output, UsageError, plain, warn_of_ignored

__all__ = ["run"]


def run(args: IdentifyArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    if args.report is not None and "compliance" not in args.method:
        raise UsageError("--report needs method compliance; add it to --method")
    if args.model is not None:
        _refuse(args, ("points", "same"), "is for FRFs at the joint; leave it out with --model")
        return run_model(args, args.model)
    _refuse(args, ("each", "find_wrong_channels"), "needs --model; name the assembly.toml")
    out = Output(args)
    _check_options(args)
    with waiting(f"reading {args.source}"):
        measured = read_frfs(*args.files, **args.reading())
        frfs = measured.receptance(args.window_decay or 0.0)
    joint = measured_joint(args, frfs, args.bending_stiffness)
    laws = joint_of_laws(args, joint.dofs)
    sides = _sides(args, frfs, joint)
    request = card_request(args, joint.dofs, damping=args.damping if laws is None else "none", cross=args.cross,
                           points=np.array(joint.responses.references))  # fmt: skip
    with waiting("data checks"):
        check = check_joint(joint, measured)
    stop_at_errors(check.findings, args.accept)
    _warn(args, joint, check)
    _warn_of_far_points(frfs, joint)
    out.say(*_heading(args, frfs, joint), *(line for side in sides for line in side.text))
    fits, interrupt = list[Fit](), Interrupt()
    with interrupt.kept_back(fits):
        for method in args.method:
            with waiting(f"fit by {method}"):
                fit = _fit(args, method, frfs, joint, laws, tuple(side.model for side in sides))
                fits.append(fit.with_findings_of_data(check.findings))
            scale = scale_of_fit(fits[-1])
            unknown = check_masses(args, scale, sides)
            out.say("", fits[-1], *scale.text(), *(f"warning: {text}" for text in unknown))
            out.warn(*fits[-1].warnings, *unknown)
    references = joint.responses.references
    record = {} if joint.is_of_points else {"reference_points_m": plain(dict(zip("jk", references, strict=True)))}
    with waiting("results"):
        figures = _noise_figures(args, frfs, joint) if args.out is not None else []
        text = write_results(args, fits, out, request, _places(joint), record=record, figures=figures)
    out.give(
        {
            "sources": args.files,
            "joint": joint.to_dict(),
            "checks": check.to_dict(),
            "warnings": [*joint.warnings(check), *(text for fit in fits for text in fit.warnings)],
            "fits": [fit_to_dict(fit, lines=False) for fit in fits],
            "scales": [asdict(scale_of_fit(fit)) for fit in fits],
            "cards": text,
            "written": out.written,
        }
    )
    interrupt.resume()
    return 0


def _refuse(args: IdentifyArguments, names: tuple[str, ...], why: str) -> None:
    """Raise an error for the first of these options that is given."""
    for name in names:
        if getattr(args, name):
            raise UsageError(f"--{name.replace('_', '-')} {why}")


def _check_options(args: IdentifyArguments) -> None:
    """Raise an error for options that do not go together, before a file is read."""
    if args.save is None:
        warn_of_ignored(args, ("--save-lines",), "nothing is saved without --save")
    if args.points is None:
        _refuse(args, ("same",), "needs several joint points; name them by --points")
        if args.cross == "points":
            raise UsageError("--cross points needs several joint points; name them by --points")
    else:
        unknown = [name for own in args.same or () for name in own if name not in args.points]
        if unknown:
            raise UsageError(f"unknown joint point {unknown[0]} in --same; use names of --points")
        _refuse(args, ("side_j", "side_k"), "is for one joint point; leave out --points")
    if args.window_decay is not None and not args.window_decay >= 0:
        raise UsageError(f"--window-decay must not be negative, not {args.window_decay:g}")
    if args.window_decay:
        why = "does not go with --window-decay, which corrects springs and dampers by method compliance; leave one out"
        _refuse(args, ("law", "joint", "side_j", "side_k"), why)
        if args.method != ["compliance"]:
            raise UsageError(f"--method {','.join(args.method)} {why}")
    check_stated(args)
    stated_noise(args)


def _warn(args: IdentifyArguments, joint: MeasuredJoint, check: FrfCheck) -> None:
    """Warn of DOFs that the joint leaves out, and of options that are not used."""
    for text in joint.warnings(check):
        warnings.warn(text, FrfCheckWarning, stacklevel=3)
    if "compliance" not in args.method:
        unused = ("--damping", "--cross", *NoiseArguments.names(), *GainArguments.names(), "--sensor-mass",
                  "--window-decay", "--position-error")  # fmt: skip
        warn_of_ignored(args, unused, f"method {args.method[0]} uses no such option")
    if joint.channels is not None or len(joint.nodes[0]) == 1:
        warn_of_ignored(args, ("--bending-stiffness",), "no rotation is found by differences along a line")


def _warn_of_far_points(frfs: FrfSet, joint: MeasuredJoint) -> None:
    """Warn of points along lines if the nearest two of each side have reference points less than half as far apart."""
    places = [[frfs.coordinates.get(node) for node in own] for own in joint.nodes]
    if joint.channels is not None or joint.is_of_points or any(at is None for own in places for at in own):
        return
    lines = [np.array(own) for own in places]
    apart = float(np.linalg.norm(np.subtract(*joint.responses.references)))
    if min(map(len, lines)) <= 2:
        return
    # The two points of each side that are nearest to the other side.
    near = [np.sort(np.argsort(np.linalg.norm(own[:, None] - other, axis=2).min(axis=1), kind="stable")[:2])
            for own, other in (lines, lines[::-1])]  # fmt: skip
    nearer = float(np.linalg.norm(lines[0][near[0]].mean(axis=0) - lines[1][near[1]].mean(axis=0)))
    if nearer < apart / 2:
        j, k = (",".join(str(nodes[i]) for i in at) for nodes, at in zip(joint.nodes, near, strict=True))
        text = (
            f"reference points {1e3 * apart:.3g} mm apart make the parts between them belong to the joint; use "
            f"--j {j} --k {k} ({1e3 * nearer:.3g} mm)"
        )
        warnings.warn(text, FrfCheckWarning, stacklevel=3)


def _heading(args: IdentifyArguments, frfs: FrfSet, joint: MeasuredJoint) -> Iterator[str]:
    """Yield lines on the joint to be identified, and its data."""
    points = " and ".join(
        shown_nodes(side) if joint.channels is not None else ", ".join(map(str, side)) for side in joint.nodes
    )
    size = f"{frfs.h.shape[1]} responses x {frfs.h.shape[2]} excitations"
    yield f"{args.source}: {size}; joint between points {points}"
    yield from joint.text()
    if joint.channels is None and len(joint.nodes[0]) > 1 and not joint.is_of_points:
        yield from _differences(args, joint)


def _differences(args: IdentifyArguments, joint: MeasuredJoint) -> Iterator[str]:
    """Yield lines on the effect of the central differences on a rotational joint stiffness."""
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


def _sides(args: IdentifyArguments, frfs: FrfSet, joint: MeasuredJoint) -> list[SidePart]:
    """Return the models of both sides, if they are named."""
    paths = [path for path in (args.side_j, args.side_k) if path is not None]
    if not paths:
        return []
    if len(paths) == 1:
        raise UsageError("only one side has a model; give both --side-j and --side-k")
    if "compliance" not in args.method:
        raise UsageError("--side-j and --side-k need method compliance; add it to --method")
    lines, _ = in_some_band(frfs.freq_hz, joint.h, args.band)
    found = []
    for side, path in enumerate(paths):
        responses, forces = joint.placed(side, frfs.coordinates)
        found.append(read_side(path, lines, responses, forces, len(joint.dofs)))
    return found


def _fit(
    args: IdentifyArguments,
    method: str,
    frfs: FrfSet,
    joint: MeasuredJoint,
    laws: LawJoint | None,
    sides: tuple[SideModel, ...],
) -> Fit:
    with without_warnings_of_fits():
        if method != "compliance":
            # Means over bands take one transform only.
            h, transform = joint.h, joint.responses if joint.is_square else None
            if transform is None:
                h = np.ascontiguousarray(joint.responses.transform @ joint.h @ joint.forces.transform.T)
            return identify_band_mean(
                frfs.freq_hz, h, "inverse-substructuring", joint.dofs, args.band, transform=transform
            )
        noise = stated_noise(args)
        options = joint.known(frfs, is_noise_stated=noise is not None)
        options["setups"] = setups_with_gains(args, args.source, options["setups"], joint.h.shape)
        options |= {"damping": args.damping, "cross": args.cross} if laws is None else {"joint": laws}
        optional = {"same": args.same, "window_decay": args.window_decay, "position_error": args.position_error,
                    "sides": sides or None}  # fmt: skip
        options |= {name: value for name, value in optional.items() if value is not None}
        return identify(
            frfs.freq_hz, joint.h, joint.dofs, args.band, noise=noise, accept=args.accept,
            sensor_mass=args.sensor_mass, **options,
        )  # fmt: skip


def _places(joint: MeasuredJoint) -> list[str]:
    """Return lines with the places of the reference points."""
    one, other = joint.responses.references
    if np.array_equal(one, other):
        return [f"reference point x, y, z = {', '.join(f'{value:.6g}' for value in one + 0.0)} m"]
    both = [", ".join(f"{value:.6g}" for value in place + 0.0) for place in (one, other)]
    return [f"reference points x, y, z = {both[0]} m (j) and {both[1]} m (k)"]


def _noise_figures(args: IdentifyArguments, frfs: FrfSet, joint: MeasuredJoint) -> list[Any]:
    """Return the figure of the noise that a fit has estimated."""
    if "compliance" not in args.method or args.noise is not None:
        return []
    from jointfrf.workbench.report.receptance import noise_figure

    freq_hz, h = in_some_band(frfs.freq_hz, joint.h, args.band)
    names = [[str(channel) for channel in side.channels] for side in (joint.responses, joint.forces)]
    return [noise_figure(freq_hz, h, estimate_noise(freq_hz, h), *names)]
