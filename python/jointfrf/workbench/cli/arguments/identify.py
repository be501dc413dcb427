"""Arguments of `jointfrf identify`."""

import argparse
from pathlib import Path
from typing import Annotated, Literal

from jointfrf.choices import CrossTerms, DampingTerms
from jointfrf.laws.words import LAW_WORDS
from jointfrf.messages.of_data import FATAL_CODES
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.arguments.cards import CardArguments, CardProgram
from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, flag, one_of, option
from jointfrf.workbench.cli.arguments.measured_file import FileArguments, MassArguments, NoiseArguments
from jointfrf.workbench.cli.arguments.words import NewFile, Words, words
from jointfrf.workbench.cli.usage import check_file_in_folder, check_out

__all__ = ["GainArguments", "IdentifyArguments", "SideArguments", "TermsOfJointArguments"]

#: Methods that need no model.
_METHODS = ("compliance", "inverse-substructuring")


def _methods(text: str) -> list[str]:
    found = words(text)
    for word in found or [text]:
        if word not in _METHODS:
            hint = did_you_mean(word, _METHODS)
            raise argparse.ArgumentTypeError(f"unknown method {word!r}; use one of {', '.join(_METHODS)}{hint}")
    return found


def _law(text: str) -> tuple[str, str]:
    dof, equals, word = text.partition("=")
    if not (dof.strip() and equals):
        raise argparse.ArgumentTypeError(f"{text!r} is no DOF with a law; use the form y=standard-linear-solid")
    word = word.strip()
    if word not in LAW_WORDS:
        hint = did_you_mean(word, LAW_WORDS)
        raise argparse.ArgumentTypeError(f"unknown law {word!r}; use one of {', '.join(LAW_WORDS)}{hint}")
    return dof.strip(), word


class ModelArguments(Arguments):
    """The assembly, and several tests."""

    heading = "an assembly of parts with models"

    model: Path | None = option(
        "assembly.toml: both parts as models or FRFs, the joint, other unknowns, the DOF of each channel; any FRFs of "
        "the assembly suffice then"
    )
    each: bool = flag(
        "with --model: fit every file as a test of its own (levels, assemblies) and print one table; the name of each "
        "file is added to the files of --save, --report, --output and to the folder of --out"
    )
    find_wrong_channels: bool = flag(
        "with --model: search for a channel of opposite sign or two exchanged channels that the models contradict"
    )


class TermsOfJointArguments(Arguments):
    """Terms of K* of springs and dampers."""

    heading = "the fit"

    method: Annotated[list[str], Form("METHODS", _methods)] = option(
        f"one or several methods of {','.join(_METHODS)}", default=["compliance"]
    )
    damping: Literal[DampingTerms, "auto"] = option(
        "damping terms of K* = k (1 + i eta) + i w c; auto: the terms that the data support", default="auto"
    )
    cross: CrossTerms = option(
        "terms between the joint DOFs; zero: none, ignore: not evaluated, points: fitted within each of --points, fit: "
        "fitted",
        default="zero",
    )
    same: list[Words] | None = option("equal joint points, which share their parameters: bolt1,bolt2")


class SideArguments(MassArguments):
    """Options for FRFs at the joint only: laws, sides, masses."""

    law: list[Annotated[tuple[str, str], Form("DOF=LAW", _law)]] | None = option(
        f"law of a joint DOF, once for each DOF: y=standard-linear-solid, theta=rigid; one of {', '.join(LAW_WORDS)}; "
        "a spring takes the damping of --damping (auto: viscous)"
    )
    joint: Path | None = option("TOML file of a joint of laws, with initial values")
    position_error: float | None = option(
        "standard deviation of the positions of sensors and impacts, m; intervals of rotations then cover it",
        "M",
        otherwise="0",
    )
    bending_stiffness: float | None = option(
        "E I of the thinner part in N m^2: prints the compliance that differences along a line add", "EI"
    )
    side_j: Path | None = option(
        "part.toml, model of side j alone, free of the other side (keys of [A] of assembly.toml): corrects the FRFs "
        "for the flexibility of the side between channels and joint; needs --side-k",
        "PART",
    )
    side_k: Path | None = option("part.toml, model of side k alone; needs --side-j", "PART")
    window_decay: float | None = option(
        "decay rate of the exponential window exp(-SIGMA t) of the test, 1/s: accelerances are divided by s^2, "
        "mobilities by s = i w + SIGMA, and SIGMA c is subtracted from stiffnesses",
        "SIGMA",
    )


class GainArguments(Arguments):
    """Gains of set-ups; keywords of `jointfrf.frf.setups.SetUps`."""

    setup_gain: float | None = option(
        "relative standard deviation of the gain of one set-up (each file is one); 0.01 means 1 %",
        "LEVEL",
        otherwise="estimated from the differences between the set-ups",
        keyword="gain",
    )
    common_gain: float | None = option(
        "relative standard deviation of a gain that all FRFs share, such as the calibration of the hammer", "LEVEL"
    )


class FitArguments(NoiseArguments, GainArguments):
    """Data of a fit."""

    sensor_mass: float | None = option(
        "mass of the accelerometer that moves from point to point, kg, to be removed; 0 if none moves",
        "KG",
        otherwise="found from h_pq - h_qp, if points are measured both ways",
    )
    accept: list[Annotated[str, Form("CODE", one_of(FATAL_CODES))]] = option(
        "code of an error of the data at which the fit does not stop, such as quantity; may be repeated", default=[]
    )


_FigureFolder = Annotated[Path, Form("DIR", Path, check_out, packages=("matplotlib",))]
_Page = Annotated[Path, Form("FILE", Path, check_file_in_folder, packages=("jinja2",))]


class ResultArguments(Arguments):
    """Files of results."""

    heading = "results"

    out: _FigureFolder | None = option("folder for identification.json and figures")
    report: _Page | None = option("HTML page of the identification by method compliance")
    save: NewFile | None = option("JSON file for the joint found by the first method")
    save_lines: bool = flag("add K* of each line to --save; the file becomes many times as long")
    export: CardProgram | None = option(
        "write the joint found by the first method as input of abaqus, calculix, nastran, ansys, code_aster, lsdyna or "
        "subdyn, between its nodes J and K: abaqus:9001,9002; rotations of calculix need two ROT NODEs after them; "
        "several joints: abaqus:fl=9001,9002:fr=9003,9004"
    )


class IdentifyArguments(
    FileArguments, ModelArguments, TermsOfJointArguments, SideArguments, FitArguments, ResultArguments, CardArguments
):
    """Arguments of the command."""

    description = (
        "Identify a joint from the FRFs of an assembly. Accelerances and mobilities are converted to receptances. The "
        "joint DOFs are found in one of three ways: virtual points of all channels around the joint (--at), points "
        "along a line (rotations by central differences), or two nodes whose rotations are in the file. With models of "
        "both parts (--model), any FRFs of the assembly suffice."
    )
    ways = (("--j", "--k", "--dofs"), ("--at", "--channels", "--dofs"), ("--model",))
    examples = (
        "jointfrf identify cases/hammer-test/two_bars.uff --j 101,102 --k 201,202 --dofs y,rz --save joint.json",
        "jointfrf identify cases/bending-sides/test.uff --at 0,0,0 --j 101:104 --k 201:204 --dofs y,rz "
        "--side-j cases/bending-sides/side_j.toml --side-k cases/bending-sides/side_k.toml",
        "jointfrf identify cases/lap-beam/level_1.uff --model cases/lap-beam/assembly.toml",
    )
