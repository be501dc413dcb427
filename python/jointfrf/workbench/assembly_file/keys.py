"""Keys of `assembly.toml`."""

from __future__ import annotations

import re
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import field

from jointfrf.dofs import DIRECTIONS
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.points import rigid_body
from jointfrf.toml.declared import Keys, NotNegative, Positive, key
from jointfrf.workbench.assembly_file.modes import ModesKeys
from jointfrf.workbench.structures.structure import ModelStructure, Structure, SubstructureKeys
from jointfrf.workbench.structures.substructures import (
    BeamKeys,
    BrickBeamKeys,
    ChainKeys,
    MatricesKeys,
    PlateKeys,
    ReceptancesKeys,
)

__all__ = [
    "AlikeKeys",
    "AssemblyKeys",
    "ChannelDofs",
    "GroundKeys",
    "MassKeys",
    "PartKeys",
    "PartsKeys",
    "PlacedJointKeys",
    "Prior",
    "PriorKeys",
    "Unknowns",
    "without_sign",
]

#: A DOF whose direction has a sign.
_SIGNED = re.compile(r"(.*:)([+-])([^:]+)")


def without_sign(dof: str) -> tuple[str, int]:
    """Return a DOF and its sign: ``A/30:-z`` is ``A/30:z`` and -1."""
    match = _SIGNED.fullmatch(dof)
    return (dof, 1) if match is None else (match[1] + match[3], -1 if match[2] == "-" else 1)


class PriorKeys(Keys):
    """Prior of an unknown number; without `std` only the FRFs determine it."""

    mean: Annotated[float | None, key("Mean of the prior.", absent="the number given for it")] = None
    std: Annotated[Positive | None, key("Standard deviation of the prior.", absent="no prior")] = None
    lower: Annotated[float | None, key("Smallest value.", absent="0; none of a Poisson's ratio")] = None
    upper: Annotated[float | None, key("Largest value.", absent="none")] = None


#: Prior of an unknown number.
Prior = Positive | PriorKeys
_TAKES = "relative standard deviation, or a table { mean, std, lower, upper }"
_Prior = Annotated[Prior, key("An unknown number.", takes=_TAKES)]
_JointDofs = Annotated[
    tuple[str, ...],
    key("Its DOFs at the joint, in the order of those of the joint.", min_length=1, example=["7:y", "7:theta"]),
]
_SCALED = "youngs_modulus and density are factors of the matrices here, about 1."
_WORDS = (
    '`["E", "density"]` takes usual ones: E 3 %, density 1 %, loss_factor 50 %, thickness, height, width 1 %, length, '
    "length_scale 0.3 %"
)


def _unknown(which: str, words: str = _WORDS) -> Any:
    return key(
        f"Numbers that are fitted with the joint: {which} Each is a relative standard deviation, 0.02 for 2 %, or a "
        f"table `{{ mean, std, lower, upper }}`; {words}.",
        takes="list of words, or table of positive relative standard deviations, or of tables",
    )  # fmt: skip


#: Unknown numbers with their priors, or words for usual priors.
Unknowns = dict[str, Prior] | tuple[str, ...]
_OfFactors = Annotated[
    dict[str, _Prior] | tuple[str, ...], _unknown(f"`youngs_modulus`, `density`, `loss_factor`; {_SCALED}")
]
_OfMatrices = Annotated[
    dict[str, _Prior] | tuple[str, ...],
    _unknown("`youngs_modulus`, `density`, `loss_factor`, `length_scale`, a factor of all lengths; "
             "youngs_modulus and density are factors of the matrices here, about 1."),
]  # fmt: skip
_OfNumbers = Annotated[dict[str, _Prior] | tuple[str, ...], _unknown("any of the numbers of this table.")]
_Exact = Annotated[
    bool,
    key("Whether the model is exact but for what is `unknown`. No model is: otherwise E (3 %) and density (1 %) are "
        "unknown, too, as factors of K and M where they are not among `unknown`."),
]  # fmt: skip
_ModelError = Annotated[
    Annotated[float, msgspec.Meta(ge=0, le=0.1)] | None,
    key("Relative standard deviation of each modal stiffness and mass beside what is `unknown`: mesh, clamps, small "
        "masses.", absent="0.005, 0 of a part that is `exact`; 3 % of each eigenvalue of a side that bends"),
]  # fmt: skip


class ChainPart(ChainKeys, tag="chain"):
    """Lumped masses in a line; DOFs `"1:x"`, `"2:x"`, ..."""

    joint: _JointDofs
    unknown: _OfFactors = field(default_factory=dict)
    exact: _Exact = False
    model_error: _ModelError = None


class BeamPart(BeamKeys, tag="beam"):
    """Beam elements in a line, bending in one plane; DOFs `"1:y"`, `"1:theta"`, ..., without the supported ones."""

    joint: _JointDofs
    unknown: _OfNumbers = field(default_factory=dict)
    exact: _Exact = False
    model_error: _ModelError = None


class PlatePart(PlateKeys, tag="plate"):
    """A rectangular plate in the plane of x and y, bending in z with shear; DOFs `"1:z"`, `"1:theta_x"`, `"1:theta_y"`.

    Nodes count along x, then y; elements of the fourth degree have 5 x 5 of them.
    """

    joint: _JointDofs
    unknown: _OfNumbers = field(default_factory=dict)
    exact: _Exact = False
    model_error: _ModelError = None


class BrickBeamPart(BrickBeamKeys, tag="brick-beam"):
    """A beam of brick elements along z; DOFs `"hole:x"`, and six of each section that is observed."""

    joint: _JointDofs
    unknown: _OfNumbers = field(default_factory=dict)
    exact: _Exact = False
    model_error: _ModelError = None


class MatricesPart(MatricesKeys, tag="matrices"):
    """Matrices from your files: Matrix Market (`.mtx`), or NPZ of `scipy.sparse.save_npz` or `numpy.savez`.

    An NPZ file contains one array, or arrays named like the keys here. Files are relative to the file that names them.
    """

    joint: _JointDofs
    unknown: _OfMatrices = field(default_factory=dict)
    exact: _Exact = False
    model_error: _ModelError = None


class ReceptancesPart(ReceptancesKeys, tag="receptances"):
    """FRFs of the part, measured or computed elsewhere, in any format that `jointfrf.io.read_frfs` reads.

    The file must contain them on the lines of the measurement, between all DOFs that are used. Weights and intervals
    of a fit include their noise.
    """

    joint: _JointDofs
    noise: Annotated[
        NotNegative | None,
        key("Relative noise of these FRFs; 0 where they are exact.", absent="found from them", example=0.01),
    ] = None


class ModesPart(ModesKeys, tag="modes"):
    """Modes of the part, measured or computed: datasets 55 and 2414 of Universal Files, or arrays in NPZ files.

    They are taken as exact. Give all modes near the band, and `residuals` for modes beyond it: FRFs at a joint depend
    on them.
    """

    joint: _JointDofs


_Vector = tuple[float, float, float]


class RigidBodyPart(SubstructureKeys, tag="rigid-body"):
    """A rigid body with named points; DOFs `"foot:x"` to `"foot:theta_z"` of each, and of its `centre`."""

    mass: Annotated[Positive, key("Mass.", "kg", example=60.0)]
    inertia: Annotated[_Vector, key("Moments of inertia about its centre, x, y, z.", "kg m^2", example=[2.2, 3.0, 3.6])]
    points: Annotated[
        dict[str, _Vector],
        key("Where its points are, by their names: `{ foot = [0.3, 0.2, -0.25] }`.", "m",
            takes="table of lists of 3 numbers", example={"foot": [0.3, 0.2, -0.25]}),
    ]  # fmt: skip
    joint: _JointDofs
    centre: Annotated[_Vector, key("Its centre of mass.", "m")] = (0.0, 0.0, 0.0)
    moves: Annotated[tuple[str, ...], key("Directions in which it is free.", choice=DIRECTIONS)] = DIRECTIONS
    unknown: Annotated[
        dict[str, _Prior] | tuple[str, ...], _unknown("`mass`, or `density`, a factor of mass and inertia, about 1.")
    ] = field(default_factory=dict)
    exact: Annotated[bool, key("Whether mass and inertia are exact but for what is `unknown`.")] = True
    model_error: _ModelError = None

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        points = {name: np.array(at) for name, at in self.points.items()}
        model = self.build(lambda: rigid_body(self.mass, self.inertia, points, centre=self.centre, moves=self.moves))
        return ModelStructure(model)


PartKeys = ChainPart | BeamPart | PlatePart | BrickBeamPart | RigidBodyPart | MatricesPart | ReceptancesPart | ModesPart


class MassKeys(Keys):
    """A mass that is not in the models: a sensor, the head of a shaker."""

    header = "[[mass]]"
    dofs: Annotated[
        tuple[str, ...],
        key("All directions in which it moves.", min_length=1, example=["A/7:y"]),
    ]
    mass: Annotated[NotNegative, key("Mass.", "kg", example=0.01)]
    unknown: Annotated[_Prior | None, key("How far it is known.", takes=_TAKES, absent="known")] = None


class GroundKeys(Keys):
    """A spring to the ground: a suspension, a flexible clamp, the stinger of a shaker."""

    header = "[[ground]]"
    dof: Annotated[str, key("Where it holds: `A/1:theta`.", example="A/1:theta")]
    stiffness: Annotated[NotNegative, key("Stiffness.", "N/m, N m/rad", example=1e5)]
    damping: Annotated[NotNegative, key("Viscous damping.", "N s/m, N m s/rad")] = 0.0
    unknown: Annotated[
        dict[str, _Prior] | tuple[str, ...],
        _unknown("`stiffness`, `damping`.", '`["stiffness"]` takes 50 %, of damping 100 %'),
    ] = field(default_factory=dict)


_Fixed = Annotated[tuple[str, ...], key("Parameters of joints that keep their value: `c_y`, of several `bolt.c_y`.")]
_Masses = Annotated[tuple[MassKeys, ...], key("Masses of sensors and shakers.")]
_Grounds = Annotated[tuple[GroundKeys, ...], key("Springs to the ground.")]


class ChannelDofs(Keys):
    """DOFs of a channel of a measurement whose sensor and impact differ; without its key, one is not used."""

    header = "a channel of [channels]"
    response: Annotated[str | None, key("DOF of the sensor: `A/30:-z`.", absent="not used")] = None
    force: Annotated[str | None, key("DOF of the force: `A/30:z`.", absent="not used")] = None

    @property
    def dofs(self) -> tuple[str | None, str | None]:
        """DOFs of the response and of the force."""
        return self.response, self.force


_Dofs = Annotated[
    str | ChannelDofs, key("DOF of a channel.", takes="text such as A/151:y, or a table { response, force }")
]
_Channels = Annotated[
    dict[str, _Dofs],
    key('Which channel of the file is which DOF: `"3:+y" = "A/151:y"`, or `"A/151:-y"` where it points the other way. '
        'Sensor and force of one name may differ: `"30:+z" = { response = "A/30:-z", force = "A/30:z" }`. '
        '`"A/@0.3,0.006,0:y"`, here and wherever DOFs are named, is the node nearest to a position, m. Channels '
        "that are not named are not used.",
        takes="table of DOFs, or of tables { response, force }",
        absent="channels that are named like one DOF of one part, `151:y`"),
]  # fmt: skip
_ResponseGains = Annotated[
    dict[str, _Prior],
    key('Responses whose calibration is not exactly known: `"A/151:y" = 0.02`; measured = gain times true.',
        takes="table of relative standard deviations, or of tables"),
]  # fmt: skip
_ForceGains = Annotated[
    dict[str, _Prior],
    key("The same of forces.", takes="table of relative standard deviations, or of tables"),
]


class AssemblyKeys(Keys):
    """Two parts A and B, the joint between them, the unknowns, and the DOFs of the channels of a measurement.

    DOFs are named by their part: `A/7:y`, `B/1:theta`.
    """

    header = "assembly.toml"
    A: Annotated[PartKeys, key("Side j of the joint.")]
    B: Annotated[PartKeys, key("Side k of the joint.")]
    joint: Annotated[
        dict[str, Any] | str,
        key("The joint: `[[joint.law]]` tables with `dof`, `law` and, if wanted, `values` where the fit starts; or "
            "`dofs`, `stiffness`, ... as in `joint.toml`; or the name of such a file, or of a saved joint.",
            takes="table, or name of a file"),
    ]  # fmt: skip
    fixed: _Fixed = ()
    mass: _Masses = ()
    ground: _Grounds = ()
    channels: _Channels = field(default_factory=dict)
    response_gains: _ResponseGains = field(default_factory=dict)
    force_gains: _ForceGains = field(default_factory=dict)


class PlacedJointKeys(Keys):
    """One of several joints, between DOFs of two parts, or of one part and the ground.

    If an end is a region of its part, `plate/clamp:z`, its values are per length or area: N/m per m.
    """

    header = "[joints.NAME]"
    j: Annotated[
        tuple[str, ...],
        key("Its DOFs on one side, in the order of its laws.", min_length=1, example=["machine/foot:z"]),
    ]
    k: Annotated[tuple[str, ...], key("Its DOFs on the other side.", absent="the ground")] = ()
    law: Annotated[
        tuple[dict[str, Any], ...] | None,
        key("Its laws, `[[joints.NAME.law]]`, as in joint.toml; `values`, where the fit starts, may be left out.",
            takes="tables", absent="those of `file`"),
    ] = None  # fmt: skip
    file: Annotated[str | None, key("A joint.toml or a saved joint in place of `law`.", absent="`law`")] = None
    weight: Annotated[
        Positive,
        key(
            "Factor of its stiffness, damping and mass, such as the length of an edge that belongs to a node; "
            "of joints that are the `same` the weights may differ."
        ),
    ] = 1.0


class AlikeKeys(Keys):
    """Joints whose parameters scatter about common means, named by NAME."""

    header = "[alike.NAME]"
    joints: Annotated[tuple[str, ...], key("Their names.", min_length=2, example=["left", "right"])]
    spread: Annotated[
        Positive | None,
        key("Standard deviation relative to the mean.", absent="found from the FRFs, of three joints or more"),
    ] = None


class PartsKeys(Keys):
    """Any number of parts and joints by names; all other keys are the keys for two parts.

    DOFs are named by their part, `frame/7:y`, parameters by their joint, `bolt.k_y`.
    """

    header = "assembly.toml of several parts"
    parts: Annotated[
        dict[str, Annotated[Any, key("A part.", takes="table")]],
        key("Parts by their names, `[parts.NAME]`, each with the keys of `[A]`; without `joint`, which `joints` name.",
            takes="table of tables"),
    ]  # fmt: skip
    joints: Annotated[
        dict[str, Annotated[Any, key("A joint.", takes="table")]],
        key("Joints by their names, `[joints.NAME]`.", takes="table of tables"),
    ]
    same: Annotated[
        tuple[str | tuple[str, ...], ...],
        key('Joints that are equal, or parts whose unknowns are: `["left", "right"]`, or a list of such lists.',
            takes="list of names, or of lists of names"),
    ] = ()  # fmt: skip
    alike: Annotated[
        dict[str, Annotated[Any, key("A group.", takes="table")]],
        key("Joints that scatter about a common mean, `[alike.NAME]`.", takes="table of tables"),
    ] = field(default_factory=dict)
    fixed: _Fixed = ()
    mass: _Masses = ()
    ground: _Grounds = ()
    channels: _Channels = field(default_factory=dict)
    response_gains: _ResponseGains = field(default_factory=dict)
    force_gains: _ForceGains = field(default_factory=dict)
