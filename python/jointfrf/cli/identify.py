"""`jointfrf identify`: from a Universal File to the parameters of a joint."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from jointfrf.channels.check.check import check_frfs, warn_of_frfs
from jointfrf.channels.finite_differences import difference_error
from jointfrf.channels.point_lines import Interface
from jointfrf.cli.measured_file import add_file_arguments, in_some_band, interface_of, nodes, read_receptances, words
from jointfrf.cli.usage import UsageError
from jointfrf.dofs import is_rotation
from jointfrf.errors import ConvergenceWarning, FrfCheckWarning, IdentificationWarning
from jointfrf.extras import check_extras
from jointfrf.frf.noise_model import estimate_noise
from jointfrf.identification.compliance_fit.joint_terms import CrossTerms, DampingTerms
from jointfrf.identification.identify import identify
from jointfrf.identification.joint_fit import JointFit
from jointfrf.io import FrfSet
from jointfrf.io.cards import CardFormat

__all__ = ["add_arguments", "run"]

_METHODS = ("compliance", "inverse-substructuring")


def _methods(text: str) -> list[str]:
    for word in words(text):
        if word not in _METHODS:
            raise argparse.ArgumentTypeError(f"{word!r} is not one of {', '.join(_METHODS)}")
    return words(text)


def _export(text: str) -> tuple[CardFormat, list[int]]:
    program, _, numbers = text.partition(":")
    ends = nodes(numbers)
    wanted = 4 if program == "calculix" else 2
    if program not in get_args(CardFormat) or len(ends) not in (2, wanted):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a program ({', '.join(get_args(CardFormat))}) and nodes j and k like abaqus:9001,9002; "
            "calculix takes two ROT NODEs after them"
        )
    return cast(CardFormat, program), ends


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Identify a joint from the FRFs of an assembly in a Universal File (dataset 58). Accelerances and mobilities "
        "become receptances; rotations come from points along a line by central differences."
    )
    add_file_arguments(parser)
    parser.add_argument(
        "--method",
        type=_methods,
        default=["compliance"],
        metavar="METHODS",
        help=f"one or several of {','.join(_METHODS)} (default: compliance)",
    )
    parser.add_argument(
        "--damping",
        choices=(*get_args(DampingTerms), "auto"),
        default="auto",
        help="damping terms of K* = k (1 + i eta) + i w c (default: auto, what the data support)",
    )
    parser.add_argument(
        "--cross",
        choices=get_args(CrossTerms),
        default="zero",
        help="terms between the joint DOFs: none (default), not looked at, fitted",
    )
    parser.add_argument(
        "--noise",
        type=float,
        metavar="LEVEL",
        help="relative noise of the FRFs, 0.01 for 1 %% (default: from their reciprocity)",
    )
    parser.add_argument(
        "--bending-stiffness",
        type=float,
        metavar="EI",
        help="E I of the thinner part in N m^2: tells how much compliance the differences add",
    )
    parser.add_argument(
        "--export",
        type=_export,
        metavar="PROGRAM:J,K",
        help="also print the joint (by the first method) as input of abaqus, calculix (stiffness only), nastran or "
        "ansys, between its nodes J and K: abaqus:9001,9002; rotations of calculix need two ROT NODEs after them",
    )
    parser.add_argument(
        "--report",
        type=Path,
        metavar="FILE",
        help="also write the identification by method compliance as one HTML page, like report.html",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for identification.json and figures")


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    if args.out is not None:
        check_extras("matplotlib")
    if args.report is not None:
        check_extras("jinja2")
        if "compliance" not in args.method:
            raise UsageError("--report is of method compliance: name it among the methods")
    frfs = read_receptances(args)
    if not (args.j and args.k and args.dofs):
        print(frfs.summary())
        print("\nname the points and DOFs of the joint to identify it: --j NODES --k NODES --dofs DOFS")
        return 0
    sides = interface_of(args, frfs, args.bending_stiffness)
    measured = frfs.matrix(sides.channels, sides.channels)
    warn_of_frfs(check_frfs(*in_some_band(frfs.freq_hz, measured, args.band), sides.channels))
    fits = [_fit(args, method, frfs, measured, sides) for method in args.method]
    points = " and ".join(", ".join(map(str, side)) for side in (args.j, args.k))
    print(
        f"{args.file.name}: {frfs.h.shape[1]} responses x {frfs.h.shape[2]} excitations; joint between points {points}"
    )
    apart = sides.references[1] - sides.references[0]
    if np.linalg.norm(apart) > 0:
        print(
            f"reference points {1e3 * np.linalg.norm(apart):.3g} mm apart: x, y, z = "
            + ", ".join(f"{1e3 * value:.3g}" for value in apart)
            + " mm"
        )
    _tell_differences(args, sides)
    for fit in fits:
        print(f"\n{fit}")
    if args.export is not None:
        program, ends = args.export
        damping = program != "calculix"  # it has none between DOFs, and says so in the text
        print()
        print(fits[0].export(program, ends[:2], rotation_nodes=ends[2:] or None, damping=damping), end="")
    if args.report is not None:
        fit = fits[args.method.index("compliance")]
        ends = (1, 2) if args.export is None else args.export[1]
        args.report.parent.mkdir(parents=True, exist_ok=True)
        print(f"\nwrote {fit.report(args.report, source=args.file.name, command=args.typed, nodes=ends)}")
    if args.out is not None:
        from jointfrf.report.fit import write_fit
        from jointfrf.report.noise import noise_figure

        figures = []
        if "compliance" in args.method and args.noise is None:
            freq_hz, h = in_some_band(frfs.freq_hz, measured, args.band)
            names = [str(channel) for channel in sides.channels]
            figures.append(noise_figure(freq_hz, h, estimate_noise(freq_hz, h), names, names))
        print()
        for path in write_fit(fits, args.out, args.file.name, figures):
            print(f"wrote {path}")
    return 0


def _tell_differences(args: argparse.Namespace, sides: Interface) -> None:
    """Say what the central differences do to a rotational joint stiffness, before the result is read."""
    rotations = [i for i, dof in enumerate(args.dofs) if is_rotation(dof)]
    if not rotations:
        return
    reach = 1 / abs(sides.transform[rotations[0]]).max() / 2
    print(f"rotations by central differences over +-{1e3 * reach:.3g} mm")
    if args.bending_stiffness is not None:
        error = difference_error(reach, args.bending_stiffness, 1.0)
        print(
            f"they add about dx/(3 E I) = {error.compliance:.3g} rad/(N m) to the compliance of a rotational DOF: "
            f"a joint much stiffer than {1 / error.compliance:.3g} N m/rad cannot be distinguished from a rigid one"
        )


def _fit(args: argparse.Namespace, method: str, frfs: FrfSet, measured: np.ndarray, sides: Interface) -> JointFit:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)  # they stand in the table
        warnings.simplefilter("ignore", ConvergenceWarning)
        warnings.simplefilter("ignore", FrfCheckWarning)  # told with the names of the channels
        return identify(
            frfs.freq_hz,
            measured,
            args.dofs,
            method,  # type: ignore[arg-type]
            args.band,
            transform=sides,
            damping=args.damping,
            cross=args.cross,
            noise=args.noise,
            **(_coherence(frfs, sides) if method == "compliance" else {}),
        )


def _coherence(frfs: FrfSet, sides: Interface) -> dict[str, Any]:
    """Coherence and number of averages, where the file has them."""
    coherence = frfs.coherence_matrix(sides.channels, sides.channels)
    if coherence is None:
        return {}
    return {"coherence": coherence, "averages": frfs.least_averages(sides.channels, sides.channels)}
