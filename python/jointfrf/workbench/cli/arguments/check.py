"""Arguments of `jointfrf check`."""

from __future__ import annotations

from jointfrf.workbench.cli.arguments.masses import add_mass_arguments
from jointfrf.workbench.cli.arguments.measured_file import add_file_arguments
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_arguments"]


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Check measured FRFs: content of the file; quantity, time convention, sign, gain, delay and units of each "
        "channel; dead, doubled and exchanged channels; reciprocity, passivity, bad lines, missing FRFs. --j, --k and "
        "--dofs select the channels of the joint; --at adds a comparison of each channel with the rigid motion of its "
        "side. Exit status 0: no errors or warnings; 1: some."
    )
    parser.examples += [
        "jointfrf check cases/hammer-test/two_bars.uff",
        "jointfrf check cases/bending-sides/test.uff --at 0,0,0 --j 101:104 --k 201:204 --dofs y,rz",
    ]
    add_file_arguments(parser)
    add_mass_arguments(parser)
