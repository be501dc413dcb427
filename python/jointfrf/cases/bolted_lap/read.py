"""The case of a bolted lap joint as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast, get_args

from jointfrf.cases.bolted_lap.measurement import DOFS
from jointfrf.cases.comparison import ExpectedFrequencies, read_expected_frequencies
from jointfrf.cases.definitions import (
    BandSet,
    Noise,
    actual_values,
    read_bands,
    read_case_joint,
    read_material,
    read_noises,
)
from jointfrf.cases.kind import Case
from jointfrf.dofs import Parameter, joint_parameters
from jointfrf.frf.bands import Band
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.solids.bolted_lap import PROOF_STRENGTH, STRESS_AREA, Bolt, preload_force
from jointfrf.solids.brick import Material
from jointfrf.solids.brick_beam import Preset
from jointfrf.toml.table import TomlTable

__all__ = ["BoltedLapCase", "LapGeometry", "read_bolted_lap"]

#: Band means, and the fit.
_METHODS = ("ismm", "compliance")


@dataclass(frozen=True)
class LapGeometry:
    """Two beams of the same section that overlap, and the hole of the bolt.

    Attributes
    ----------
    lengths : tuple of float
        Of A, of B, and of the other B that the joint is transferred to, m.
    width, height, overlap, hole_radius : float
        m.
    material : Material
    preset : {"seed", "accurate"}
        Mesh.
    """

    lengths: tuple[float, float, float]
    width: float
    height: float
    overlap: float
    hole_radius: float
    material: Material
    preset: Preset


@dataclass(frozen=True, kw_only=True)
class BoltedLapCase(Case):
    """A lap joint with a preloaded bolt of solid elements, and what is measured on it.

    Attributes
    ----------
    beams : LapGeometry
    bolt : Bolt
    preload : float
        N.
    friction : float
    spacing : tuple of float
        s_x and s_z of the measured points, m.
    joint, initial : Joint
        Known joint of the error analysis, and first estimate of the identification; in the order of (4.5).
    bands : BandSet
    noises : tuple of Noise
    expected : ExpectedFrequencies or None
    """

    beams: LapGeometry
    bolt: Bolt
    preload: float
    friction: float
    spacing: tuple[float, float]
    joint: Joint
    initial: Joint
    bands: BandSet
    noises: tuple[Noise, ...]
    expected: ExpectedFrequencies | None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Stiffness of the six DOFs, then damping."""
        return joint_parameters(self.joint.dofs)

    @property
    def actual(self) -> FloatArray:
        """Values of the parameters of the known joint."""
        return actual_values(self.joint)

    def bands_of(self, dof: str) -> list[Band]:
        """Bands of the stiffness and damping of a DOF, Hz."""
        return self.bands.bands[Parameter.of_dof("k", dof)]


def read_bolted_lap(common: Case, table: TomlTable, expected: TomlTable) -> BoltedLapCase:
    """Read the keys of this kind, see `jointfrf.cases.kind.CaseKind`.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    beams = _beams(table.table("beams"))
    bolt, preload = _bolt(table.table("bolt"))
    contact = table.table("contact")
    friction = contact.number("friction", 0)
    contact.close()
    spacing = _spacing(table.table("measurement"))
    joint, initial = _joint(table.tables("joint"))
    return BoltedLapCase(
        **vars(common),
        beams=beams,
        bolt=bolt,
        preload=preload,
        friction=friction,
        spacing=spacing,
        joint=joint,
        initial=initial,
        bands=read_bands(table.table("bands"), joint.dofs, common.freq_hz),
        noises=read_noises(table, len(joint.dofs), _METHODS),
        expected=read_expected_frequencies(expected.table("frequencies")) if "frequencies" in expected else None,
    )


def _beams(table: TomlTable) -> LapGeometry:
    lengths = tuple(_length(table, key) for key in ("length_a", "length_b", "transfer_length_b"))
    width, height, overlap, hole_radius = (_length(table, key) for key in ("width", "height", "overlap", "hole_radius"))
    preset = cast(Preset, table.text("preset", get_args(Preset)))
    material = read_material(table)
    table.close()
    return LapGeometry(cast(tuple[float, float, float], lengths), width, height, overlap, hole_radius, material, preset)


def _length(table: TomlTable, key: str) -> float:
    value = table.number(key, 0)
    if value == 0:
        raise table.error(key, "positive, in m")
    return value


def _spacing(table: TomlTable) -> tuple[float, float]:
    found = _length(table, "spacing_x"), _length(table, "spacing_z")
    table.close()
    return found


def _joint(tables: list[TomlTable]) -> tuple[Joint, Joint]:
    """Read the joint and its first estimate: six DOFs in the order of (4.5)."""
    joint, initial = read_case_joint(tables)
    if len(tables) != len(DOFS):
        raise tables[0].error("dof", f"the first of six: {', '.join(DOFS)}")
    for table, dof, name in zip(tables, DOFS, joint.dofs, strict=True):
        if name != dof:
            raise table.error("dof", f"{dof!r}, in the order {', '.join(DOFS)}")
    return joint, initial


def _bolt(table: TomlTable) -> tuple[Bolt, float]:
    size = table.text("size", tuple(STRESS_AREA))
    strength = table.text("strength_class", tuple(PROOF_STRENGTH))
    share = table.number("preload_share", 0)
    shank_radius, head_radius, head_height, nut_radius, nut_height = (
        table.number(key, 0) for key in ("shank_radius", "head_radius", "head_height", "nut_radius", "nut_height")
    )
    material = read_material(table)
    table.close()
    bolt = table.build(lambda: Bolt(shank_radius, head_radius, head_height, nut_radius, nut_height, material))
    return bolt, table.build(lambda: preload_force(STRESS_AREA[size], PROOF_STRENGTH[strength], share))
