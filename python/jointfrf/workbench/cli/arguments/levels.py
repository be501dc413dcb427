"""Arguments of `jointfrf levels`."""

import argparse
from pathlib import Path
from typing import Annotated

from jointfrf.choices import AMPLITUDE_LAWS, MotionQuantity
from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, one_of, option, positional
from jointfrf.workbench.cli.arguments.measured_file import JointArguments, NoiseArguments
from jointfrf.workbench.cli.arguments.words import NewFile, NewFolder, NumberList, numbers, words
from jointfrf.workbench.cli.usage import check_folder

__all__ = ["BackboneArguments", "DriveArguments", "FilterArguments", "LevelsArguments"]


def _sensors(word: str) -> dict[str, str]:
    found = {}
    for one in word.split(","):
        name, equals, dof = one.partition("=")
        if not (name and equals and dof) or name in found:
            raise argparse.ArgumentTypeError(f"{one!r} is no new NAME=DOF; write NAME=DOF,NAME=DOF")
        found[name.strip()] = dof.strip()
    return found


def _errors(word: str) -> tuple[float, ...]:
    return numbers(word, 2, ("pair of errors, of frequency and of damping", "0.001,0.05"))


def _laws(word: str) -> list[str]:
    return [one_of(AMPLITUDE_LAWS)(one) for one in words(word)]


_Page = Annotated[Path, Form("FILE", Path, check_folder, packages=("jinja2", "matplotlib"))]


class DriveArguments(Arguments):
    """The quantity that has the level of a test."""

    heading = "the controlled quantity of each test"

    held: str = option(
        "quantity that had its level on all lines: force, a response as the models name it (B/25:y or B/@0.28,0,0:y; "
        "without models as the file does, 101:+y), or joint:DOF for the relative motion of a joint DOF (joint:theta_z)",
        "WHAT",
        "force",
    )
    level: NumberList | None = option(
        "peak level of each file: N for a force, by --motion for a response, m or rad for a joint", "LEVEL,..."
    )
    motion: MotionQuantity = option("quantity of the level of a response: m, m/s or m/s^2", default="displacement")


class BackboneArguments(Arguments):
    """The backbone of a mode."""

    heading = "the backbone of a mode, instead of files"

    backbone: Path | None = option(
        "CSV table with columns frequency (Hz), amplitude (peak, by --motion) and damping (ratio) or, for tests at "
        "phase resonance, force (peak, N); optionally label"
    )
    channel: str | None = option("DOF of the measured amplitude and of the force, as the models name it: A/1:y", "DOF")
    dof: str | None = option("joint DOF to be found, if several have a law", "DOF")
    errors: Annotated[tuple[float, ...], Form("FREQUENCY,DAMPING", _errors)] = option(
        "relative standard errors of frequency and of damping or force", default=(0.001, 0.05)
    )


class FilterArguments(Arguments):
    """Options of the extraction of a mode from a record; keywords of `decay_of_mode`."""

    start: float | None = option(
        "time after which nothing drives the structure",
        "SECONDS",
        otherwise="the last time at which the mode has 90 % of its largest amplitude",
    )
    bandwidth: float | None = option(
        "distance from the mode at which the filter suppresses everything by 80 dB",
        "HZ",
        otherwise="0.9 of the distance to the next resonance or to 0",
    )
    ratio: float = option("ratio of the amplitudes at both ends of a level", "NUMBER", 1.5)


class DecayArguments(FilterArguments):
    """A free decay."""

    heading = "a free decay, instead of files"

    decay: Path | None = option(
        "CSV table or MATLAB file of a ring-down: time and one column for each sensor, named like a channel or DOF of "
        "assembly.toml, with its unit: time [s],A/1:y [m/s^2]"
    )
    modes: NumberList | None = option("frequency of each mode that is analysed, to 10 %", "HZ,...")
    sensors: Annotated[dict[str, str], Form("NAME=DOF,...", _sensors)] | None = option(
        "DOF of the models for columns with other names, with a minus sign if the sensor points the other way: "
        "acc1=A/1:y,acc2=-B/25:y"
    )
    sensor_unit: str | None = option("unit of the sensors whose columns state none: m/s^2, g, mm/s", "UNIT")
    rate: float | None = option("sampling rate, if the file has no times or rounds them", "HZ")


class LevelFitArguments(NoiseArguments):
    """The fits of levels."""

    heading = "the fits"

    laws: Annotated[list[str], Form("NAME,...", _laws)] = option(
        "laws over amplitude to be fitted", default=list(AMPLITUDE_LAWS)
    )


class LevelResultArguments(Arguments):
    """Files of the levels."""

    heading = "results"

    report: _Page | None = option("HTML page with figures of stiffness and loss factor over amplitude")
    output: NewFile | None = option("CSV table of the result")
    joints: NewFolder | None = option(
        "folder for the joint of each level, springs of its secant stiffness and damping, as LABEL.toml for export and "
        "couple"
    )


class LevelsArguments(
    DriveArguments, BackboneArguments, DecayArguments, LevelFitArguments, JointArguments, LevelResultArguments
):
    """Arguments of the command."""

    description = (
        "Find stiffness and loss factor of a joint over the amplitude of its relative motion. The data are one file of "
        "FRFs for each level, fitted with the models of assembly.toml or (as by identify) at the joint, or the "
        "backbone of a mode, or a free decay. Laws over amplitude are fitted to all levels."
    )
    ways = (
        ("FILE", "--level", "--model"),
        ("FILE", "--level", "--j", "--k", "--dofs"),
        ("--table", "--model"),
        ("--backbone", "--channel", "--model"),
        ("--decay", "--modes"),
    )
    examples = (
        "jointfrf levels --table cases/iwan-beam/tests.csv --model cases/iwan-beam/assembly.toml --held B/25:y",
        "jointfrf levels --backbone cases/iwan-beam/backbone.csv --model cases/iwan-beam/assembly.toml --channel A/1:y",
        "jointfrf levels --decay cases/iwan-beam/decay.csv --modes 235 --model cases/iwan-beam/assembly.toml",
    )

    files: list[Path] = positional("measured FRFs, one file for each level", "FILE", optional=True)
    model: Path | None = option("assembly.toml, as for identify; without it the FRFs are at the joint (--j, --k)")
    table: Path | None = option(
        "CSV table of the tests instead of FILE: columns file (relative to the table), level, optionally label"
    )
