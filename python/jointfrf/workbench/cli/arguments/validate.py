"""Arguments of `jointfrf validate`."""

from __future__ import annotations

from pathlib import Path

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.couple import add_joint_arguments
from jointfrf.workbench.cli.arguments.frf import add_line_arguments
from jointfrf.workbench.cli.arguments.measured_file import add_reading_arguments
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Compute an assembly with an identified joint and compare it with the measured assembly, by channel: amplitude "
        "(4.11) and frequency (4.12) of the largest peak in the band, and the difference over the band. Use channels "
        "that were not used in the identification, or transfer the joint to other parts and use a test of their "
        "assembly."
    )
    parser.requires("--joint", "--j", "--k")
    parser.examples.append(
        "jointfrf validate cases/two-beams/a.toml cases/two-beams/b.toml assembly.uff --joint "
        "cases/two-beams/joint.toml --j 11 --k 1 --renumber-b 100 --band 20:800"
    )
    parser.add_argument("a", type=Path, metavar="A", help="substructure A: file of FRFs, or model (.toml)")
    parser.add_argument("b", type=Path, metavar="B", help="substructure B")
    parser.add_argument("measured", nargs="+", type=Path, metavar="FILE", help="measured FRFs of the assembly")
    add_joint_arguments(parser)
    parser.option("--output FILE", f"file for the regenerated FRFs: {format_names(written=True)}", Path)
    add_line_arguments(parser)
    add_reading_arguments(parser)
