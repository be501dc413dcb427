"""Arguments of `jointfrf couple`, and of a joint between its parts."""

from __future__ import annotations

from pathlib import Path

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.frf import add_line_arguments
from jointfrf.workbench.cli.arguments.measured_file import add_reading_arguments, nodes, point
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_arguments", "add_joint_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Couple two substructures by a joint (2.26) and write the FRFs of the assembly. A substructure is a file of "
        "FRFs or a TOML file of a model. The joint is a JSON file of identify --save, or a TOML file with dofs, "
        "stiffness, damping, loss_factor, or with laws of its DOFs."
    )
    parser.requires("--joint", "--j", "--k", "--output")
    parser.examples.append(
        "jointfrf couple cases/two-beams/a.toml cases/two-beams/b.toml --joint cases/two-beams/joint.toml --j 11 --k 1 "
        "--renumber-b 100 --band 20:800 --step 1 --output assembly.uff"
    )
    parser.add_argument("a", type=Path, metavar="A", help="substructure A: file of FRFs, or model (.toml)")
    parser.add_argument("b", type=Path, metavar="B", help="substructure B")
    add_joint_arguments(parser)
    parser.option("--output FILE", f"file to write: {format_names(written=True)}", Path)
    add_line_arguments(parser)
    add_reading_arguments(parser)


def add_joint_arguments(parser: CommandParser) -> None:
    """Describe the joint, and where it is in its parts."""
    parser.option("--joint FILE", "the joint: .json or .toml", Path)
    parser.option("--j NODES", "node of A at the joint, with all joint DOFs; with --at, nodes around the joint", nodes)
    parser.option("--k NODES", "node of B at the joint; with --at, nodes around it", nodes)
    parser.option("--at X,Y,Z", "reference point of virtual points, m", point)
    parser.option("--renumber-b N", "number added to the nodes of B, if A and B have equal numbers", int, 0)
    parser.option("--shift-b X,Y,Z", "vector added to the coordinates of B, m", point, (0.0, 0.0, 0.0))
