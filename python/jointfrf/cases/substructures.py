"""The two structures that a joint connects: chains, beams, bricks, matrices and FRFs, as files declare them."""

from __future__ import annotations

from typing import Annotated, Any

from msgspec import field

from jointfrf.cases.known_joint.structure import Structure
from jointfrf.cases.known_joint.substructures import read_substructure
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.beam import BeamElement, End
from jointfrf.models.model import Ground
from jointfrf.solids.brick_beam import Face, Preset
from jointfrf.toml.declared import Keys, NotNegative, Positive, key, keys_of
from jointfrf.toml.table import TomlTable

__all__ = ["BeamKeys", "BrickBeamKeys", "ChainKeys", "MatricesKeys", "ReceptancesKeys", "SubstructureKeys"]

_LOSS_FACTOR = key("Loss factor eta of the stiffness, K (1 + i eta).")


class SubstructureKeys(Keys, tag_field="model"):
    """One of the two structures that the joint connects."""

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure; FRFs must be available on all lines, Hz. Raises FileContentError."""
        declared = keys_of(type(self))
        values: dict[str, Any] = {declared.tag_name: declared.tag}
        for one in declared.keys:
            value = getattr(self, one.attribute)
            if value is not None and not isinstance(value, Keys) and (value != {} or one.is_required):
                values[one.name] = list(value) if isinstance(value, tuple) else value
        table = self.table
        values |= {name: value for name, value in table.content.items() if isinstance(value, dict)}
        own = {name: values[name] for name in values if name in _MODEL_KEYS[declared.tag]}
        return read_substructure(TomlTable(own, table.where, table.folder), freq_hz)


class ChainKeys(SubstructureKeys, tag="chain"):
    """Lumped masses in a line; DOFs `"1:x"`, `"2:x"`, ..."""

    masses: Annotated[tuple[float, ...], key("Masses, from one end to the other.", "kg", example=[5.0, 3.0])]
    stiffness: Annotated[
        tuple[float, ...],
        key("Springs in their order, that to the ground included.", "N/m", example=[2500.0, 3500.0]),
    ]
    damping: Annotated[tuple[float, ...], key("Dashpots beside the springs.", "N s/m", example=[3.0, 4.0])]
    ground: Annotated[Ground, key("Which ends are held by a spring.")] = "start"
    loss_factor: Annotated[NotNegative, _LOSS_FACTOR] = 0.0


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


class HoleKeys(Keys):
    """A bolt hole whose ring follows a reference point with six DOFs, `hole:x` to `hole:theta_z`."""

    position: Annotated[NotNegative, key("Distance from the first end.", "m")]
    radius: Annotated[NotNegative, key("Radius of the hole.", "m")]
    patch_radius: Annotated[NotNegative, key("Outer radius of the ring.", "m")]
    face: Annotated[Face, key("Side of the beam where the ring lies.")]


class BrickBeamKeys(SubstructureKeys, tag="brick-beam"):
    """A beam of brick elements along z; DOFs `"hole:x"`, and six of each section that is observed."""

    youngs_modulus: Annotated[Positive, key("Young's modulus.", "N/m^2", example=70e9)]
    poisson: Annotated[float, key("Poisson's ratio.", example=0.33)]
    density: Annotated[Positive, key("Density.", "kg/m^3", example=2700.0)]
    loss_factor: Annotated[NotNegative, _LOSS_FACTOR] = 0.0
    length: Annotated[Positive, key("Length along z.", "m")]
    width: Annotated[Positive, key("Width along x.", "m")]
    height: Annotated[Positive, key("Height along y.", "m")]
    ends: Annotated[tuple[End, End], key("How the ends are held.")] = ("free", "free")
    preset: Annotated[
        Preset, key("Elements: `seed` as in the thesis (C3D8R), `accurate` with incompatible modes (C3D8I).")
    ]
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


class MatricesKeys(SubstructureKeys, tag="matrices"):
    """Matrices of your own: Matrix Market (`.mtx`), or NPZ of `scipy.sparse.save_npz` or `numpy.savez`.

    An NPZ file holds one array, or arrays named like the keys here. Files are relative to the file that names them.
    """

    stiffness: Annotated[str, key("K, symmetric, real.", "N/m", takes="name of a file")]
    mass: Annotated[str, key("M, symmetric, real.", "kg", takes="name of a file")]
    damping: Annotated[str | None, key("Viscous damping C.", "N s/m", takes="name of a file")] = None
    structural_damping: Annotated[
        str | None, key("Structural damping H, i H added to K.", "N/m", takes="name of a file")
    ] = None
    loss_factor: Annotated[NotNegative, _LOSS_FACTOR] = 0.0
    dofs: Annotated[
        tuple[str, ...] | str,
        key('Names of the DOFs in the order of the rows: `"12:y"`. In a file, one a line: `12:y`, or node and number '
            "of the DOF (1 to 6): `12 2`; `#` begins a comment.", takes="list of texts, or name of a text file",
            holds=lambda found: found != ()),
    ]  # fmt: skip


class ReceptancesKeys(SubstructureKeys, tag="receptances"):
    """FRFs of the substructure, measured or computed elsewhere, in any format that `jointfrf.io.read_frfs` reads.

    All FRFs between the DOFs that are used of it must be available on the lines of the measurement.
    """

    file: Annotated[str, key("Mobilities and accelerances become receptances.", takes="name of a file of FRFs")]
    quantity: Annotated[
        str | None,
        key("What the FRFs are, where the file does not say.", choice=POWER_OF_I_OMEGA, absent="by the file"),
    ] = None
    force_quantity: Annotated[bool, key("`true`: `quantity` holds also where the file says something else.")] = False


#: Keys by which the models themselves are read; a table may hold others beside them.
_MODEL_KEYS = {
    keys_of(kind).tag: set(keys_of(kind).names)
    for kind in (ChainKeys, BeamKeys, BrickBeamKeys, MatricesKeys, ReceptancesKeys)
}
