"""Keys of the files of a case of a bolted lap joint, and the case itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from jointfrf.joint import Joint
from jointfrf.toml.declared import Keys, NotNegative, Positive, key
from jointfrf.workbench.cases.bolted_lap.lap import PROOF_STRENGTH, STRESS_AREA, Bolt, lap_bricks, preload_force
from jointfrf.workbench.cases.keys import (
    BandKeys,
    BandSet,
    Case,
    CaseKeys,
    ExpectedFrequencies,
    ExpectedKeys,
    JointDofKeys,
    Noise,
    WithActualJoint,
    check_noises,
    joints_of,
)
from jointfrf.workbench.solids.brick_beam import Preset
from jointfrf.workbench.structures.keys import MaterialKeys
from jointfrf.workbench.structures.substructures import BRICK, PRESET

__all__ = ["DOFS", "BoltedLapCase", "BoltedLapExpected", "BoltedLapKeys", "LapBeams", "read_bolted_lap"]

#: Order of the joint DOFs in (4.5) and (4.8).
DOFS = ("x", "theta_y", "y", "theta_x", "z", "theta_z")
#: Band means, and the fit.
_METHODS = ("ismm", "compliance")
#: For templates: the known joint of table 4-1, and bands of all parameters.
_STIFFNESS = {"x": 1e6, "theta_y": 1e4, "y": 1e6, "theta_x": 1e3, "z": 1e7, "theta_z": 1e3}
#: Bands of a template: where the thesis identifies every parameter.
_EXAMPLE_BANDS = {f"{kind}_{dof}": [[20.0, 600.0]] for kind in "kc" for dof in DOFS}


class LapBeams(MaterialKeys):
    """Two beams of bricks of the same section that overlap."""

    length_a: Annotated[Positive, key("Length of A.", "m", example=0.3)]
    length_b: Annotated[Positive, key("Length of B.", "m", example=0.3)]
    transfer_length_b: Annotated[
        Positive, key("Length of another B, to which the identified joint is transferred.", "m", example=0.2)
    ]
    width: Annotated[Positive, key("Width.", "m", example=0.025)]
    height: Annotated[Positive, key("Thickness of each beam.", "m", example=0.006)]
    overlap: Annotated[Positive, key("Length of the overlap.", "m", example=0.025)]
    hole_radius: Annotated[Positive, key("Radius of the hole, in the middle of the overlap.", "m", example=0.0045)]
    preset: Annotated[Preset, PRESET]

    @property
    def lengths(self) -> tuple[float, float, float]:
        """Lengths of A, of B, and of the other B, m."""
        return self.length_a, self.length_b, self.transfer_length_b


class BoltKeys(MaterialKeys):
    """A bolt of solid elements, and its preload (4.3), (4.4)."""

    size: Annotated[str, key("Thread, for the stress area.", choice=STRESS_AREA, example="M8")]
    strength_class: Annotated[
        str, key("Property class; sets the proof strength.", choice=PROOF_STRENGTH, example="10.9")
    ]
    preload_share: Annotated[Positive, key("Preload as a share of the proof load.", le=1, example=0.75)]
    shank_radius: Annotated[Positive, key("Radius of the shank.", "m", example=0.004)]
    head_radius: Annotated[Positive, key("Radius of the head.", "m", example=0.0065)]
    head_height: Annotated[Positive, key("Height of the head.", "m", example=0.0053)]
    nut_radius: Annotated[Positive, key("Radius of the nut.", "m", example=0.0065)]
    nut_height: Annotated[Positive, key("Height of the nut.", "m", example=0.0068)]


class ContactKeys(Keys):
    """Contact between the beams."""

    friction: Annotated[NotNegative, key("Coefficient of friction.", example=0.3)]


class MeasurementKeys(Keys):
    """Points around the reference point, for rotations by central differences."""

    spacing_x: Annotated[Positive, key("Distance of the neighbours of the reference point along x.", "m", example=0.01)]
    spacing_z: Annotated[Positive, key("Distance of the neighbours of the reference point along z.", "m", example=0.01)]


class BoltedLapKeys(CaseKeys, tag="bolted-lap"):
    """A lap joint with a preloaded bolt of solid elements, and its simulated measurement."""

    examples = {"frequency": {"last": 600.0, "step": 2.0}, "study": {"realisations": 4}}  # noqa: RUF012
    beams: Annotated[LapBeams, key("The beams.")]
    bolt: Annotated[BoltKeys, key("The bolt.", example={"youngs_modulus": 210e9, "poisson": 0.3, "density": 7850.0})]
    contact: Annotated[ContactKeys, key("Contact between the beams.")]
    measurement: Annotated[MeasurementKeys, key("Measured points.")]
    joint: Annotated[
        tuple[JointDofKeys, ...],
        key(f"Known joint of the error analysis, in the order {', '.join(DOFS)}.",
            example=[{"dof": dof, "stiffness": k, "damping": 10.0} for dof, k in _STIFFNESS.items()]),
    ]  # fmt: skip
    bands: Annotated[BandKeys, key("Sensitive bands.", example=_EXAMPLE_BANDS)]
    noise: Annotated[tuple[Noise, ...], key("Noise and methods.")]


class BoltedLapExpected(ExpectedKeys):
    """Expected results of a case; the file may be missing."""

    frequencies: Annotated[ExpectedFrequencies | None, key("Natural frequencies.")] = None


@dataclass(frozen=True, kw_only=True)
class BoltedLapCase(Case, WithActualJoint):
    """Case of a lap joint with a preloaded bolt of solid elements.

    Attributes
    ----------
    beams : LapBeams
        Dimensions and material of the beams.
    bolt : Bolt
        Dimensions and material of the bolt.
    preload : float
        Preload force, N.
    friction : float
        Coefficient of friction.
    spacing : tuple of float
        Distances s_x and s_z of the measured points, m.
    joint : Joint
        Known joint of the error analysis, in the order of (4.5).
    bands : BandSet
        Sensitive bands.
    noises : tuple of Noise
        Noises, each with its methods.
    expected : ExpectedFrequencies or None
        Expected natural frequencies.
    """

    beams: LapBeams
    bolt: Bolt
    preload: float
    friction: float
    spacing: tuple[float, float]
    joint: Joint
    bands: BandSet
    noises: tuple[Noise, ...]
    expected: ExpectedFrequencies | None


def read_bolted_lap(common: Case, keys: BoltedLapKeys, expected: BoltedLapExpected) -> BoltedLapCase:
    """Return the case of its files; raise FileContentError if they are invalid."""
    joint, _ = joints_of(keys.joint)
    if len(keys.joint) != len(DOFS):
        raise keys.joint[0].error("dof", f"the first of six: {', '.join(DOFS)}")
    for one, dof in zip(keys.joint, DOFS, strict=True):
        if one.dof != dof:
            raise one.error("dof", f"{dof!r}, in the order {', '.join(DOFS)}")
    check_noises(keys, keys.noise, len(DOFS))
    for noise in keys.noise:
        if not set(noise.methods) <= set(_METHODS):
            raise noise.error("methods", f"a list of {', '.join(_METHODS)}")
    beams = keys.beams
    beams.table.check_stated("height", BRICK * lap_bricks((*beams.lengths, beams.overlap), beams.height))
    own = keys.bolt
    sizes = (own.shank_radius, own.head_radius, own.head_height, own.nut_radius, own.nut_height)
    strength = STRESS_AREA[own.size], PROOF_STRENGTH[own.strength_class]
    _, material = keys.beams.material, own.material
    return BoltedLapCase(
        **vars(common),
        beams=keys.beams,
        bolt=own.build(lambda: Bolt(*sizes, material)),
        preload=own.build(lambda: preload_force(*strength, own.preload_share)),
        friction=keys.contact.friction,
        spacing=(keys.measurement.spacing_x, keys.measurement.spacing_z),
        joint=joint,
        bands=keys.bands.band_set(joint.dofs, common.freq_hz),
        noises=keys.noise,
        expected=expected.frequencies,
    )
