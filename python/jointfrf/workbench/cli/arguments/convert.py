"""Arguments of `jointfrf convert`."""

from pathlib import Path

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.declaration import option, positional
from jointfrf.workbench.cli.arguments.measured_file import ReadingArguments
from jointfrf.workbench.cli.arguments.words import Band, NodeList

__all__ = ["ConvertArguments"]


class ConvertArguments(ReadingArguments):
    """Arguments of the command."""

    description = (
        f"Read measured FRFs, {format_names()}, whose format is detected from their content, and write them, in SI "
        f"units, as {format_names(written=True)}. Several files of one test are merged. Put options before or after "
        "all files."
    )
    examples = ("jointfrf convert cases/hammer-test/two_bars.uff bars.npz --band 20:500",)

    files: list[Path] = positional("files to read, then the file to write", "FILE")
    nodes: NodeList | None = option("keep only FRFs between these nodes: 102,104")
    band: Band | None = option("keep only the lines in this band in Hz")
    averages: float | None = option("number of averages, if the files do not state it", "N")
