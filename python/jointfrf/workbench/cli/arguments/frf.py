"""Arguments of `jointfrf frf`."""

from pathlib import Path

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.declaration import Arguments, option, positional
from jointfrf.workbench.cli.arguments.measured_file import ReadingArguments
from jointfrf.workbench.cli.arguments.structures import LineArguments
from jointfrf.workbench.cli.arguments.words import NewFrfs, Words

__all__ = ["MOST_DOFS", "FrfArguments", "MatrixArguments"]

#: FRFs between more DOFs are hardly meant.
MOST_DOFS = 240


class MatrixArguments(Arguments):
    """A model by its matrices; keywords are the keys of a model of kind matrices."""

    heading = "a model by its matrices (Matrix Market or NPZ)"

    stiffness: str | None = option("file of the stiffness K, N/m", "FILE")
    mass: str | None = option("file of the mass M, kg", "FILE")
    damping: str | None = option("file of the viscous damping C, N s/m", "FILE")
    structural_damping: str | None = option("file of the structural damping H, N/m", "FILE")
    loss_factor: float = option("loss factor of the stiffness", "ETA", 0.0)
    dof_names: str | None = option("text file, one DOF a line: 12:y, or 12 2", "FILE", keyword="dofs")


class _LineFileArguments(ReadingArguments):
    heading = "the file of --lines-of"


class FrfArguments(LineArguments, MatrixArguments, _LineFileArguments):
    """Arguments of the command."""

    description = (
        f"Compute receptances of a model and write them as {format_names(written=True)}. The model is a TOML file with "
        "the keys of a substructure of a case (chain, beam, plate, brick-beam, matrices, modes) or of a part of an "
        "assembly, or matrices named by options."
    )
    ways = (
        ("MODEL", "--output", "--band", "--step"),
        ("MODEL", "--output", "--lines-of"),
        ("--stiffness", "--mass", "--dof-names", "--output", "--band", "--step"),
    )
    examples = ("jointfrf frf cases/two-beams/a.toml --band 20:800 --step 1 --output a.uff",)

    model: Path | None = positional("TOML file of a model; or --stiffness, --mass, --dof-names", "MODEL", optional=True)
    output: NewFrfs | None = option(f"file to write: {format_names(written=True)}")
    lines_of: Path | None = option("file of FRFs whose frequency lines are used, instead of --band and --step")
    points: Words | None = option("DOFs of the model: 3:y,3:theta", "DOFS", otherwise=f"all, up to {MOST_DOFS}")
