"""Arguments of `jointfrf identify`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import get_args

from jointfrf.choices import CrossTerms, DampingTerms
from jointfrf.messages.of_data import FATAL_CODES
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.arguments.export import add_card_arguments, parse_export
from jointfrf.workbench.cli.arguments.identify_model import add_model_arguments
from jointfrf.workbench.cli.arguments.joint_laws import add_law_arguments
from jointfrf.workbench.cli.arguments.masses import add_mass_arguments
from jointfrf.workbench.cli.arguments.measured_file import add_file_arguments, words
from jointfrf.workbench.cli.arguments.noise import add_noise_arguments
from jointfrf.workbench.cli.parser import CommandParser, one_of

__all__ = ["add_arguments"]

#: Methods that need no model.
_METHODS = ("compliance", "inverse-substructuring")


def _methods(text: str) -> list[str]:
    found = words(text)
    for word in found or [text]:
        if word not in _METHODS:
            hint = did_you_mean(word, _METHODS)
            raise argparse.ArgumentTypeError(f"unknown method {word!r}; use one of {', '.join(_METHODS)}{hint}")
    return found


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Identify a joint from the FRFs of an assembly. Accelerances and mobilities are converted to receptances. The "
        "joint DOFs are found in one of three ways: virtual points of all channels around the joint (--at), points "
        "along a line (rotations by central differences), or two nodes whose rotations are in the file. With models of "
        "both parts (--model), any FRFs of the assembly suffice."
    )
    parser.requires("--j", "--k", "--dofs")
    parser.requires("--at", "--channels", "--dofs")
    parser.requires("--model")
    parser.examples += [
        "jointfrf identify cases/hammer-test/two_bars.uff --j 101,102 --k 201,202 --dofs y,rz --save joint.json",
        "jointfrf identify cases/bending-sides/test.uff --at 0,0,0 --j 101:104 --k 201:204 --dofs y,rz "
        "--side-j cases/bending-sides/side_j.toml --side-k cases/bending-sides/side_k.toml",
        "jointfrf identify cases/lap-beam/level_1.uff --model cases/lap-beam/assembly.toml",
    ]
    add_file_arguments(parser)
    add_model_arguments(parser)
    parser.heading("the fit")
    parser.option("--method METHODS", f"one or several methods of {','.join(_METHODS)}", _methods, ["compliance"])
    parser.option(
        "--damping",
        "damping terms of K* = k (1 + i eta) + i w c; auto: the terms that the data support",
        (*get_args(DampingTerms), "auto"),
        "auto",
    )
    parser.option(
        "--cross",
        "terms between the joint DOFs; zero: none, ignore: not evaluated, points: fitted within each of --points, fit: "
        "fitted",
        get_args(CrossTerms),
        "zero",
    )
    parser.option("--same NAMES", "equal joint points, which share their parameters: bolt1,bolt2", words, repeated=True)
    parser.option(
        "--side-j PART",
        "part.toml, model of side j alone, free of the other side (keys of [A] of assembly.toml): corrects the FRFs "
        "for the flexibility of the side between channels and joint; needs --side-k",
        Path,
    )
    parser.option("--side-k PART", "part.toml, model of side k alone; needs --side-j", Path)
    add_law_arguments(parser)
    add_mass_arguments(parser)
    add_noise_arguments(parser)
    parser.option(
        "--setup-gain LEVEL",
        "relative standard deviation of the gain of one set-up (each file is one); 0.01 means 1 %%",
        float,
        otherwise="estimated from the differences between the set-ups",
    )
    parser.option(
        "--common-gain LEVEL",
        "relative standard deviation of a gain that all FRFs share, such as the calibration of the hammer",
        float,
    )
    parser.option(
        "--sensor-mass KG",
        "mass of the accelerometer that moves from point to point, kg, to be removed; 0 if none moves",
        float,
        otherwise="found from h_pq - h_qp, if points are measured both ways",
    )
    parser.option(
        "--accept CODE",
        "code of an error of the data at which the fit does not stop, such as quantity; may be repeated",
        one_of(FATAL_CODES),
        repeated=True,
    )
    parser.option(
        "--window-decay SIGMA",
        "decay rate of the exponential window exp(-SIGMA t) of the test, 1/s: accelerances are divided by s^2, "
        "mobilities by s = i w + SIGMA, and SIGMA c is subtracted from stiffnesses",
        float,
    )
    parser.option(
        "--position-error M",
        "standard deviation of the positions of sensors and impacts, m; intervals of rotations then cover it",
        float,
        otherwise="0",
    )
    parser.option(
        "--bending-stiffness EI",
        "E I of the thinner part in N m^2: prints the compliance that differences along a line add",
        float,
    )
    parser.heading("results")
    parser.option("--out DIR", "folder for identification.json and figures", Path)
    parser.option("--report FILE", "HTML page of the identification by method compliance", Path)
    parser.option("--save FILE", "JSON file for the joint found by the first method", Path)
    parser.option("--save-lines", "add K* of each line to --save; the file becomes many times as long")
    parser.option(
        "--export PROGRAM:J,K",
        "write the joint found by the first method as input of abaqus, calculix, nastran, ansys, code_aster, lsdyna or "
        "subdyn, between its nodes J and K: abaqus:9001,9002; rotations of calculix need two ROT NODEs after them; "
        "several joints: abaqus:fl=9001,9002:fr=9003,9004",
        parse_export,
    )
    add_card_arguments(parser)
