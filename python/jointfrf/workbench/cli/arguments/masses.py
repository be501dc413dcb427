"""Arguments of stated masses."""

from __future__ import annotations

from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_mass_arguments"]


def add_mass_arguments(parser: CommandParser) -> None:
    """Describe the masses that the user knows."""
    parser.option(
        "--mass-j KG", "mass of side j, kg: an error if the FRFs show another one (their unit is wrong)", float
    )
    parser.option("--mass-k KG", "mass of side k, kg", float)
    parser.option("--mass KG", "mass of both sides together, kg", float)
