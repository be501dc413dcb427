"""Arguments of `jointfrf frf`, and of frequency lines."""

from __future__ import annotations

from pathlib import Path

from jointfrf.choices import format_names
from jointfrf.workbench.cli.arguments.measured_file import add_reading_arguments, parse_band, words
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["MATRICES", "MOST_DOFS", "add_arguments", "add_line_arguments"]

#: Options that name files of matrices.
MATRICES = ("stiffness", "mass", "damping", "structural_damping")
#: FRFs between more DOFs are hardly meant.
MOST_DOFS = 240


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        f"Compute receptances of a model and write them as {format_names(written=True)}. The model is a TOML file with "
        "the keys of a substructure of a case (chain, beam, plate, brick-beam, matrices, modes) or of a part of an "
        "assembly, or matrices named by options."
    )
    parser.requires("MODEL", "--output", "--band", "--step")
    parser.requires("MODEL", "--output", "--lines-of")
    parser.requires("--stiffness", "--mass", "--dof-names", "--output", "--band", "--step")
    parser.examples.append("jointfrf frf cases/two-beams/a.toml --band 20:800 --step 1 --output a.uff")
    parser.add_argument(
        "model", nargs="?", type=Path, metavar="MODEL", help="TOML file of a model; or --stiffness, --mass, --dof-names"
    )
    parser.option("--output FILE", f"file to write: {format_names(written=True)}", Path)
    add_line_arguments(parser)
    parser.option("--lines-of FILE", "file of FRFs whose frequency lines are used, instead of --band and --step", Path)
    parser.option("--points DOFS", "DOFs of the model: 3:y,3:theta", words, otherwise=f"all, up to {MOST_DOFS}")
    parser.heading("a model by its matrices (Matrix Market or NPZ)")
    names = ("stiffness K, N/m", "mass M, kg", "viscous damping C, N s/m", "structural damping H, N/m")
    for name, what in zip(MATRICES, names, strict=True):
        parser.option(f"--{name.replace('_', '-')} FILE", f"file of the {what}")
    parser.option("--loss-factor ETA", "loss factor of the stiffness", float, 0.0)
    parser.option("--dof-names FILE", "text file, one DOF a line: 12:y, or 12 2")
    parser.heading("the file of --lines-of")
    add_reading_arguments(parser)


def add_line_arguments(parser: CommandParser) -> None:
    """Describe the frequency lines of models."""
    parser.option("--band LOW:HIGH", "first and last frequency, Hz", parse_band)
    parser.option("--step HZ", "spacing of the frequency lines of models, Hz; needs --band", float)
