"""The two structures that a joint connects: chains, beams, bricks, matrices and FRFs, as files declare them."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from msgspec import field

from jointfrf.cases.keys import MaterialKeys, read_frf_file
from jointfrf.cases.matrices import MatricesKeys
from jointfrf.cases.structure import MeasuredStructure, ModelStructure, Structure, SubstructureKeys
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.beam import BeamElement, End, beam
from jointfrf.models.model import Ground, chain
from jointfrf.solids.brick_beam import Face, Hole, Preset, brick_beam
from jointfrf.toml.declared import Keys, NotNegative, Positive, key, read_keys
from jointfrf.toml.table import TomlTable

__all__ = [
    "PRESET",
    "SUBSTRUCTURES",
    "MatricesKeys",
    "MeasuredStructure",
    "ModelStructure",
    "Structure",
    "SubstructureKeys",
    "read_model",
]

#: A key of all models of bricks.
PRESET = key("Elements: `seed` as in the thesis (C3D8R), `accurate` with incompatible modes (C3D8I).", example="seed")


class ChainKeys(SubstructureKeys, tag="chain"):
    """Lumped masses in a line; DOFs `"1:x"`, `"2:x"`, ..."""

    masses: Annotated[tuple[float, ...], key("Masses, from one end to the other.", "kg", example=[5.0, 3.0])]
    stiffness: Annotated[
        tuple[float, ...],
        key("Springs in their order, that to the ground included.", "N/m", example=[2500.0, 3500.0]),
    ]
    damping: Annotated[tuple[float, ...], key("Dashpots beside the springs.", "N s/m", example=[3.0, 4.0])]
    ground: Annotated[Ground, key("Which ends are held by a spring.")] = "start"
    loss_factor: Annotated[NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta).")] = 0.0

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        own = [list(numbers) for numbers in (self.masses, self.stiffness, self.damping)]
        return ModelStructure(self.build(lambda: chain(*own, ground=self.ground, loss_factor=self.loss_factor)))


class BeamKeys(SubstructureKeys, tag="beam"):
    """Beam elements in a line, bending in one plane; DOFs `"1:y"`, `"1:theta"`, ... without those that are held."""

    length: Annotated[Positive, key("Length.", "m", example=0.3)]
    elements: Annotated[int, key("Number of elements.", ge=1, example=6)]
    element: Annotated[BeamElement, key("Theory of the elements.")] = "euler-bernoulli"
    axial: Annotated[bool, key("Whether nodes move along the beam, too (`x`).")] = False
    ends: Annotated[tuple[End, End], key("How the ends are held.", example=["clamped", "free"])] = ("free", "free")
    youngs_modulus: Annotated[Positive, key("Young's modulus.", "N/m^2", example=67e9)]
    density: Annotated[Positive, key("Density.", "kg/m^3", example=2700.0)]
    width: Annotated[Positive, key("Width of the section.", "m", example=0.025)]
    height: Annotated[Positive, key("Height of the section, in the plane of bending.", "m", example=0.006)]
    poisson: Annotated[
        float | None, key("Poisson's ratio, of `shear-flexible` elements.", absent="required by these")
    ] = None
    loss_factor: Annotated[NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta).", example=0.01)] = 0.0

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        is_flexible = self.element == "shear-flexible"
        if is_flexible and self.poisson is None:
            raise self.missing(["poisson"], "shear-flexible elements have one")
        model = self.build(lambda: beam(
            self.length, self.elements, youngs_modulus=self.youngs_modulus, density=self.density, width=self.width,
            height=self.height, ends=self.ends, element=self.element, axial=self.axial,
            poisson=(self.poisson or 0.0) if is_flexible else 0.0, loss_factor=self.loss_factor,
        ))  # fmt: skip
        return ModelStructure(model, np.linspace(0, self.length, self.elements + 1))


class HoleKeys(Keys):
    """A bolt hole whose ring follows a reference point with six DOFs, `hole:x` to `hole:theta_z`."""

    position: Annotated[NotNegative, key("Distance from the first end.", "m")]
    radius: Annotated[NotNegative, key("Radius of the hole.", "m")]
    patch_radius: Annotated[NotNegative, key("Outer radius of the ring.", "m")]
    face: Annotated[Face, key("Side of the beam where the ring lies.")]


class BrickBeamKeys(SubstructureKeys, MaterialKeys, tag="brick-beam"):
    """A beam of brick elements along z; DOFs `"hole:x"`, and six of each section that is observed."""

    length: Annotated[Positive, key("Length along z.", "m")]
    width: Annotated[Positive, key("Width along x.", "m")]
    height: Annotated[Positive, key("Height along y.", "m")]
    ends: Annotated[tuple[End, End], key("How the ends are held.")] = ("free", "free")
    preset: Annotated[Preset, PRESET]
    origin: Annotated[
        tuple[float, float, float],
        key("Middle of the lower edge of the first end; the beam lies above it.", "m"),
    ] = (0.0, 0.0, 0.0)
    hole: Annotated[HoleKeys | None, key("A bolt hole.")] = None
    observed: Annotated[
        dict[str, NotNegative],
        key('Sections whose mean motion is observed: name, and distance from the first end; `r` gives `"r:x"` to '
            '`"r:theta_z"`.', "m"),
    ] = field(default_factory=dict)  # fmt: skip

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        one = self.hole
        hole = None if one is None else Hole(one.position, one.radius, one.patch_radius, one.face)
        material = self.material
        return ModelStructure(self.build(lambda: brick_beam(
            self.length, self.width, self.height, material, ends=self.ends, hole=hole, observed=self.observed,
            preset=self.preset, origin=self.origin,
        )))  # fmt: skip


class ReceptancesKeys(SubstructureKeys, tag="receptances"):
    """FRFs of the substructure, measured or computed elsewhere, in any format that `jointfrf.io.read_frfs` reads.

    All FRFs between the DOFs of `[points]` on this side must be available on the lines of `[frequency]`. The report
    then has no natural frequencies and mode shapes.
    """

    file: Annotated[str, key("Mobilities and accelerances become receptances.", takes="name of a file of FRFs")]
    quantity: Annotated[
        str | None,
        key("What the FRFs are, where the file does not say.", choice=POWER_OF_I_OMEGA, absent="by the file"),
    ] = None
    force_quantity: Annotated[bool, key("`true`: `quantity` holds also where the file says something else.")] = False

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        if self.force_quantity and self.quantity is None:
            raise self.wrong("force_quantity", "there is no quantity to force")
        found = MeasuredStructure(read_frf_file(self, "file", self.quantity, force_quantity=self.force_quantity))
        self.build(lambda: found.lines_at(freq_hz), "file")
        return found


#: The kinds of substructures, which `model` distinguishes.
SUBSTRUCTURES = (ChainKeys, BeamKeys, BrickBeamKeys, MatricesKeys, ReceptancesKeys)


def read_model(table: TomlTable) -> ModelStructure:
    """Read a model from a table that is not part of a case.

    Raises
    ------
    FileContentError
        A key is missing or wrong; FRFs are named instead of a model.
    """
    models: tuple[Any, ...] = SUBSTRUCTURES
    if table.content.get("model") == "receptances":
        raise table.wrong("model", "a file of FRFs is named by itself, not by a TOML file")
    found = read_keys(table, *models).structure(np.ones(1))
    assert isinstance(found, ModelStructure)
    return found
