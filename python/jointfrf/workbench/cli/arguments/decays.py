"""Arguments of free decays in `jointfrf levels`."""

from __future__ import annotations

import argparse

from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_decay_arguments", "numbers", "sensors"]


def add_decay_arguments(parser: CommandParser) -> None:
    """Describe the options of free decays."""
    parser.heading("a free decay, instead of files")
    parser.option(
        "--decay FILE",
        "CSV table or MATLAB file of a ring-down: time and one column for each sensor, named like a channel or DOF of "
        "assembly.toml, with its unit: time [s],A/1:y [m/s^2]",
    )
    parser.option("--modes HZ,...", "frequency of each mode that is analysed, to 10 %%", numbers)
    parser.option(
        "--sensors NAME=DOF,...",
        "DOF of the models for columns with other names, with a minus sign if the sensor points the other way: "
        "acc1=A/1:y,acc2=-B/25:y",
        sensors,
    )
    parser.option(
        "--start SECONDS", "time after which nothing drives the structure", float,
        otherwise="the last time at which the mode has 90 %% of its largest amplitude",
    )  # fmt: skip
    parser.option(
        "--bandwidth HZ", "distance from the mode at which the filter suppresses everything by 80 dB", float,
        otherwise="0.9 of the distance to the next resonance or to 0",
    )  # fmt: skip
    parser.option("--ratio NUMBER", "ratio of the amplitudes at both ends of a level", float, 1.5)
    parser.option("--sensor-unit UNIT", "unit of the sensors whose columns state none: m/s^2, g, mm/s")
    parser.option("--rate HZ", "sampling rate, if the file has no times or rounds them", float)


def numbers(word: str) -> list[float]:
    """Read numbers between commas."""
    try:
        return [float(one) for one in word.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{word!r} is no list of numbers; separate them by commas") from None


def sensors(word: str) -> dict[str, str]:
    """Read names and DOFs."""
    found = {}
    for one in word.split(","):
        name, equals, dof = one.partition("=")
        if not (name and equals and dof) or name in found:
            raise argparse.ArgumentTypeError(f"{one!r} is no new NAME=DOF; write NAME=DOF,NAME=DOF")
        found[name.strip()] = dof.strip()
    return found
