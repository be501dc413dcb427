"""Keys that structures, cases and assembly files share: a material, a file of FRFs with its map and unit."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Annotated, Any

from jointfrf.errors import FileContentWarning
from jointfrf.frf.frf_set import FrfSet
from jointfrf.io.formats import read_frfs
from jointfrf.toml.declared import Keys, NotNegative, Positive, key
from jointfrf.workbench.solids.brick import Material

__all__ = ["MAP", "UNIT", "MaterialKeys", "read_frf_file"]

#: Which field of a file of FRFs is what, as `--map` says on the command line.
MAP = key(
    'Which field of a MATLAB, NPZ or HDF5 file of FRFs is what: `{ h = "test.A", axes = "out,in,freq" }`.',
    takes="table of names",
    absent="by the usual names",
)


#: Units that a file of FRFs does not state, as `--unit` says on the command line.
UNIT = key(
    'Unit of the FRFs, if their file does not state one that is understood: `"g/N"`, `"mm/kN, frequency=kHz"`.',
    takes="text",
    absent="by the file",
)


class MaterialKeys(Keys):
    """A material."""

    youngs_modulus: Annotated[Positive, key("Young's modulus.", "N/m^2", example=70e9)]
    poisson: Annotated[float, key("Poisson's ratio.", example=0.33)]
    density: Annotated[Positive, key("Density.", "kg/m^3", example=2700.0)]
    loss_factor: Annotated[NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta).", example=0.01)] = 0.0

    @property
    def material(self) -> Material:
        """The material; raises FileContentError."""
        return self.build(lambda: Material(self.youngs_modulus, self.poisson, self.density, self.loss_factor))


def read_frf_file(
    keys: Keys,
    name: str,
    quantity: str | None = None,
    *,
    force_quantity: bool = False,
    mapping: Mapping[str, str] | None = None,
    unit: str = "",
) -> FrfSet:
    """Read the receptances of a file that a key names; a line at 0 Hz that they do not have is left out."""
    path = keys.file_of(name)
    options: dict[str, Any] = {"force_quantity": force_quantity, "mapping": mapping, "unit": unit}
    frfs = keys.build(lambda: read_frfs(path, quantity=quantity, **options), name)
    with warnings.catch_warnings():
        # No case has a line at 0 Hz.
        warnings.simplefilter("ignore", FileContentWarning)
        return frfs.receptance()
