"""Arguments of `jointfrf identify --model`."""

from __future__ import annotations

from pathlib import Path

from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_model_arguments"]


def add_model_arguments(parser: CommandParser) -> None:
    """Describe the assembly, and several tests."""
    parser.heading("an assembly of parts with models")
    parser.option(
        "--model FILE",
        "assembly.toml: both parts as models or FRFs, the joint, other unknowns, the DOF of each channel; any FRFs of "
        "the assembly suffice then",
        Path,
    )
    parser.option(
        "--each",
        "with --model: fit every file as a test of its own (levels, assemblies) and print one table; the name of each "
        "file is added to the files of --save, --report, --output and to the folder of --out",
    )
    parser.option(
        "--find-wrong-channels",
        "with --model: search for a channel of opposite sign or two exchanged channels that the models contradict",
    )
