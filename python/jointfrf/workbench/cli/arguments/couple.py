"""Arguments of `jointfrf couple`."""

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.declaration import option
from jointfrf.workbench.cli.arguments.structures import CouplingArguments
from jointfrf.workbench.cli.arguments.words import NewFrfs

__all__ = ["CoupleArguments"]


class CoupleArguments(CouplingArguments):
    """Arguments of the command."""

    description = (
        "Couple two substructures by a joint (2.26) and write the FRFs of the assembly. A substructure is a file of "
        "FRFs or a TOML file of a model. The joint is a JSON file of identify --save, or a TOML file with dofs, "
        "stiffness, damping, loss_factor, or with laws of its DOFs."
    )
    ways = (("--joint", "--j", "--k", "--output"),)
    examples = (
        "jointfrf couple cases/two-beams/a.toml cases/two-beams/b.toml --joint cases/two-beams/joint.toml --j 11 --k 1 "
        "--renumber-b 100 --band 20:800 --step 1 --output assembly.uff",
    )

    output: NewFrfs = option(f"file to write: {format_names(written=True)}")
