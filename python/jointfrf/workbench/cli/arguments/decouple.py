"""Arguments of `jointfrf decouple`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from jointfrf.choices import StiffnessMethod
from jointfrf.workbench.cli.arguments.measured_file import add_reading_arguments, joint_dofs, nodes, parse_band, words
from jointfrf.workbench.cli.parser import CommandParser

if TYPE_CHECKING:
    from jointfrf.io import Channel

__all__ = ["METHODS", "add_arguments"]

#: Methods by what the command line calls them.
METHODS: dict[str, StiffnessMethod] = {
    "rr": "decoupling-rr",
    "rs": "decoupling-rs",
    "sr": "decoupling-sr",
    "ss": "decoupling-ss",
}


def _channels(text: str) -> list[Channel]:
    from jointfrf.io import Channel  # only if a channel is named

    try:
        return [Channel.parse(word) for word in words(text)]
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Identify a joint by FRF decoupling, (2.53) to (2.56), from FRFs of the assembly at internal points r of A and "
        "s of B and from both substructures (files of FRFs, or TOML files of models). The result is exact without "
        "noise and very sensitive to noise; jointfrf identify, with FRFs at the joint, is far less sensitive."
    )
    parser.requires("--j", "--k", "--dofs", "--s")
    parser.requires("--j", "--k", "--dofs", "--r", "--equation")
    parser.examples.append(
        "jointfrf decouple cases/two-beams/a.toml cases/two-beams/b.toml assembly.uff --j 11 --k 1 --dofs y,rz "
        "--s 11:y,11:rz --renumber-b 100 --band 100:300"
    )
    parser.add_argument("a", type=Path, metavar="A", help="substructure A: file of FRFs, or model (.toml)")
    parser.add_argument("b", type=Path, metavar="B", help="substructure B")
    parser.add_argument("assembly", type=Path, metavar="ASSEMBLY", help="file of FRFs of the assembly")
    parser.option(
        "--equation",
        "responding and excited point: (2.53) rr, (2.54) rs, (2.55) sr, (2.56) ss",
        tuple(METHODS),
        "ss",
    )
    parser.option("--j NODE", "node of A at the joint", nodes)
    parser.option("--k NODE", "node of B at the joint", nodes)
    parser.option("--dofs DOFS", "joint DOFs, at both nodes: y,rz", joint_dofs)
    parser.option("--r CHANNELS", "internal channels of A, one for each joint DOF: 7:y,7:rz", _channels)
    parser.option("--s CHANNELS", "internal channels of B, one for each joint DOF", _channels)
    parser.option("--renumber-b N", "number added to the nodes of B, --k and --s, as by jointfrf couple", int, 0)
    parser.option("--band LOW:HIGH", "sensitive band in Hz; may be repeated", parse_band, repeated=True)
    parser.option("--save FILE", "JSON file for the joint", Path)
    parser.option("--output FILE", "CSV file for K* of each line", Path)
    add_reading_arguments(parser)
