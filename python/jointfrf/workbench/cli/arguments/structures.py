"""Arguments of commands on two substructures: frequency lines, and a joint between them."""

from pathlib import Path

from jointfrf.workbench.cli.arguments.declaration import Arguments, option, positional
from jointfrf.workbench.cli.arguments.measured_file import ReadingArguments
from jointfrf.workbench.cli.arguments.words import Band, NodeList, Point

__all__ = ["CouplingArguments", "LineArguments", "PairArguments"]


class LineArguments(Arguments):
    """Frequency lines of models."""

    band: Band | None = option("first and last frequency, Hz")
    step: float | None = option("spacing of the frequency lines of models, Hz; needs --band", "HZ")


class PairArguments(ReadingArguments):
    """Two substructures."""

    a: Path = positional("substructure A: file of FRFs, or model (.toml)", "A")
    b: Path = positional("substructure B", "B")


class CouplingArguments(LineArguments, PairArguments):
    """Two substructures, the joint, and its place in both."""

    joint: Path = option("the joint: .json or .toml")
    j: NodeList = option("node of A at the joint, with all joint DOFs; with --at, nodes around the joint")
    k: NodeList = option("node of B at the joint; with --at, nodes around it")
    at: Point | None = option("reference point of virtual points, m")
    renumber_b: int = option("number added to the nodes of B, if A and B have equal numbers", "N", 0)
    shift_b: Point = option("vector added to the coordinates of B, m", default=(0.0, 0.0, 0.0))
