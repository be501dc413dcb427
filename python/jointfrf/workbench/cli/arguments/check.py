"""Arguments of `jointfrf check`."""

from jointfrf.workbench.cli.arguments.measured_file import FileArguments, MassArguments

__all__ = ["CheckArguments"]


class CheckArguments(FileArguments, MassArguments):
    """Arguments of the command."""

    description = (
        "Check measured FRFs: content of the file; quantity, time convention, sign, gain, delay and units of each "
        "channel; dead, doubled and exchanged channels; reciprocity, passivity, bad lines, missing FRFs. --j, --k and "
        "--dofs select the channels of the joint; --at adds a comparison of each channel with the rigid motion of its "
        "side. Exit status 0: no errors or warnings; 1: some."
    )
    examples = (
        "jointfrf check cases/hammer-test/two_bars.uff",
        "jointfrf check cases/bending-sides/test.uff --at 0,0,0 --j 101:104 --k 201:204 --dofs y,rz",
    )
