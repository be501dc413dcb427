"""Arguments of `jointfrf validate`."""

from pathlib import Path

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.declaration import option, positional
from jointfrf.workbench.cli.arguments.structures import CouplingArguments
from jointfrf.workbench.cli.arguments.words import NewFrfs

__all__ = ["ValidateArguments"]


class ValidateArguments(CouplingArguments):
    """Arguments of the command."""

    description = (
        "Compute an assembly with an identified joint and compare it with the measured assembly, by channel: amplitude "
        "(4.11) and frequency (4.12) of the largest peak in the band, and the difference over the band. Use channels "
        "that were not used in the identification, or transfer the joint to other parts and use a test of their "
        "assembly."
    )
    ways = (("--joint", "--j", "--k"),)
    examples = (
        "jointfrf validate cases/two-beams/a.toml cases/two-beams/b.toml assembly.uff --joint "
        "cases/two-beams/joint.toml --j 11 --k 1 --renumber-b 100 --band 20:800",
    )

    measured: list[Path] = positional("measured FRFs of the assembly", "FILE")
    output: NewFrfs | None = option(f"file for the regenerated FRFs: {format_names(written=True)}")
