"""Arguments of `jointfrf levels`."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

from jointfrf.choices import AMPLITUDE_LAWS, MotionQuantity
from jointfrf.workbench.cli.arguments.decays import add_decay_arguments, numbers
from jointfrf.workbench.cli.arguments.measured_file import add_joint_arguments, words
from jointfrf.workbench.cli.arguments.noise import add_noise_arguments
from jointfrf.workbench.cli.parser import CommandParser, one_of

__all__ = ["add_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Find stiffness and loss factor of a joint over the amplitude of its relative motion. The data are one file of "
        "FRFs for each level, fitted with the models of assembly.toml or (as by identify) at the joint, or the "
        "backbone of a mode, or a free decay. Laws over amplitude are fitted to all levels."
    )
    parser.requires("FILE", "--level", "--model")
    parser.requires("FILE", "--level", "--j", "--k", "--dofs")
    parser.requires("--table", "--model")
    parser.requires("--backbone", "--channel", "--model")
    parser.requires("--decay", "--modes")
    parser.examples += [
        "jointfrf levels --table cases/iwan-beam/tests.csv --model cases/iwan-beam/assembly.toml --held B/25:y",
        "jointfrf levels --backbone cases/iwan-beam/backbone.csv --model cases/iwan-beam/assembly.toml --channel A/1:y",
        "jointfrf levels --decay cases/iwan-beam/decay.csv --modes 235 --model cases/iwan-beam/assembly.toml",
    ]
    parser.add_argument("files", type=Path, nargs="*", metavar="FILE", help="measured FRFs, one file for each level")
    parser.option(
        "--model FILE", "assembly.toml, as for identify; without it the FRFs are at the joint (--j, --k)", Path
    )
    parser.option(
        "--table FILE",
        "CSV table of the tests instead of FILE: columns file (relative to the table), level, optionally label",
        Path,
    )
    parser.heading("the controlled quantity of each test")
    parser.option(
        "--held WHAT",
        "quantity that had its level on all lines: force, a response as the models name it (B/25:y or B/@0.28,0,0:y; "
        "without models as the file does, 101:+y), or joint:DOF for the relative motion of a joint DOF (joint:theta_z)",
        default="force",
    )
    parser.option(
        "--level LEVEL,...", "peak level of each file: N for a force, by --motion for a response, m or rad for a joint",
        numbers,
    )  # fmt: skip
    parser.option(
        "--motion",
        "quantity of the level of a response: m, m/s or m/s^2",
        get_args(MotionQuantity),
        "displacement",
    )
    parser.heading("the backbone of a mode, instead of files")
    parser.option(
        "--backbone FILE",
        "CSV table with columns frequency (Hz), amplitude (peak, by --motion) and damping (ratio) or, for tests at "
        "phase resonance, force (peak, N); optionally label",
        Path,
    )
    parser.option("--channel DOF", "DOF of the measured amplitude and of the force, as the models name it: A/1:y")
    parser.option("--dof DOF", "joint DOF to be found, if several have a law")
    parser.option(
        "--errors FREQUENCY,DAMPING", "relative standard errors of frequency and of damping or force", numbers,
        [0.001, 0.05],
    )  # fmt: skip
    add_decay_arguments(parser)
    parser.heading("the fits")
    add_noise_arguments(parser)
    parser.option("--laws NAME,...", "laws over amplitude to be fitted", _laws, list(AMPLITUDE_LAWS))
    add_joint_arguments(parser)
    parser.set_defaults(points=None)  # one joint point
    parser.heading("results")
    parser.option("--report FILE", "HTML page with figures of stiffness and loss factor over amplitude", Path)
    parser.option("--output FILE", "CSV table of the result", Path)
    parser.option(
        "--joints DIR",
        "folder for the joint of each level, springs of its secant stiffness and damping, as LABEL.toml for export and "
        "couple",
        Path,
    )


def _laws(word: str) -> list[str]:
    return [one_of(AMPLITUDE_LAWS)(one) for one in words(word)]
