"""Arguments of `jointfrf convert`."""

from __future__ import annotations

from pathlib import Path

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.measured_file import add_reading_arguments, nodes, parse_band
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        f"Read measured FRFs, {format_names()}, whose format is detected from their content, and write them, in SI "
        f"units, as {format_names(written=True)}. Several files of one test are merged. Put options before or after "
        "all files."
    )
    parser.examples.append("jointfrf convert cases/hammer-test/two_bars.uff bars.npz --band 20:500")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="files to read, then the file to write")
    add_reading_arguments(parser)
    parser.option("--nodes NODES", "keep only FRFs between these nodes: 102,104", nodes)
    parser.option("--band LOW:HIGH", "keep only the lines in this band in Hz", parse_band)
    parser.option("--averages N", "number of averages, if the files do not state it", float)
