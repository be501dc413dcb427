"""Keys of the files of a case of a modelled joint, and the case itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from msgspec import field

from jointfrf.identification.model.assembly import AddedMass, Assembly
from jointfrf.identification.model.substructure import Substructure, Unknown
from jointfrf.laws.joint_toml import parameters_in_words, read_law, takes_in_words
from jointfrf.laws.law import JointLaw
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.words import LAW_WORDS
from jointfrf.models.model import Model
from jointfrf.toml.declared import Keys, NotNegative, Positive, key
from jointfrf.workbench.cases.keys import LIKE_DOFS, Case, CaseKeys, ExpectedKeys
from jointfrf.workbench.structures.substructures import (
    BeamKeys,
    BrickBeamKeys,
    ChainKeys,
    MatricesKeys,
    ModelStructure,
    PlateKeys,
)

__all__ = ["ModelledJointCase", "ModelledJointKeys", "read_modelled_joint"]


class SidePointKeys(Keys):
    """DOFs of the joint on both substructures, in the order of the tables `[[law]]`."""

    header = "[points], of a modelled joint"
    j: Annotated[tuple[str, ...], key("Joint DOFs of A.", takes=LIKE_DOFS, min_length=1, example=["7:y", "7:theta"])]
    k: Annotated[tuple[str, ...], key("Joint DOFs of B.", takes=LIKE_DOFS, min_length=1, example=["1:y", "1:theta"])]


class LawKeys(Keys):
    """One table for each joint DOF: its law, the actual parameters, and those from which the fit starts."""

    dof: Annotated[str, key("Name of the DOF: `y`, `theta_z`, ...", example="y")]
    law: Annotated[str, key("The law; `rigid`: both sides move alike.", choice=LAW_WORDS, example="spring")]
    actual: Annotated[
        dict[str, float],
        key(f"Actual parameters, those that the law takes: {takes_in_words()}; {parameters_in_words()}.",
            absent="required but for `rigid`", example={"k": 6e4, "c": 5.0}),
    ] = field(default_factory=dict)  # fmt: skip
    start: Annotated[
        dict[str, float],
        key("Initial values of these parameters.", absent="required but for `rigid`", example={"k": 2e4, "c": 1.0}),
    ] = field(default_factory=dict)
    mass: Annotated[
        NotNegative | None,
        key("Mass of the joint in this direction, half of it on either side; fitted.", "kg, kg m^2"),
    ] = None


class MeasuredKeys(Keys):
    """Measured receptances between these DOFs, named `A/...` and `B/...`, with complex noise of each entry."""

    responses: Annotated[
        tuple[str, ...],
        key("Where the motion is measured.", min_length=1, example=["A/3:y", "A/5:y", "B/3:y", "B/5:y"]),
    ]
    forces: Annotated[tuple[str, ...], key("Where forces act.", min_length=1, example=["A/5:y"])]
    noise: Annotated[Positive, key("Level of the noise: 0.02 for 2 %.", example=0.02)]


class UnknownKeys(Keys):
    """A number of a model that is not exactly known; it is fitted with the joint under a normal prior."""

    substructure: Annotated[Literal["A", "B"], key("Substructure of the number.")]
    name: Annotated[Literal["youngs_modulus", "density", "loss_factor"], key("Name of the number.")]
    value: Annotated[NotNegative, key("Prior mean.", "N/m^2, kg/m^3")]
    std_percent: Annotated[NotNegative, key("Standard deviation of the prior.", "%")]
    error_percent: Annotated[float, key("Difference between the actual value and `value`.", "%")]


class AddedMassKeys(Keys):
    """A mass of a sensor or shaker that the models do not contain."""

    dof: Annotated[str, key("DOF of the mass, `A/...` or `B/...`.")]
    mass: Annotated[NotNegative, key("Actual mass.", "kg")]
    believed: Annotated[NotNegative, key("Prior mean.", "kg")]
    std: Annotated[NotNegative, key("Standard deviation of the prior.", "kg")]


class ModelledJointKeys(CaseKeys, tag="modelled-joint"):
    """A joint of any laws, identified from simulated FRFs at any points, given the substructures as models."""

    examples = {"frequency": {"first": 5.0, "last": 400.0, "step": 2.0}, "study": {"realisations": 10}}  # noqa: RUF012
    substructure_a: Annotated[
        ChainKeys | BeamKeys | PlateKeys | BrickBeamKeys | MatricesKeys,
        key("Side j of the joint.", example={"model": "beam"}),
    ]
    substructure_b: Annotated[
        ChainKeys | BeamKeys | PlateKeys | BrickBeamKeys | MatricesKeys,
        key("Side k of the joint.", example={"model": "beam", "length": 0.225, "ends": ["free", "free"]}),
    ]
    points: Annotated[SidePointKeys, key("DOFs of the joint.")]
    law: Annotated[
        tuple[LawKeys, ...],
        key("The joint.", example=[{"dof": "y"}, {"dof": "theta", "actual": {"k": 60.0, "c": 0.005},
                                                 "start": {"k": 20.0, "c": 0.001}}]),
    ]  # fmt: skip
    measured: Annotated[MeasuredKeys, key("Measured receptances.")]
    unknown: Annotated[tuple[UnknownKeys, ...], key("Uncertain numbers of the models.", absent="nothing")] = ()
    added_mass: Annotated[tuple[AddedMassKeys, ...], key("Masses of sensors and shakers.")] = ()
    show_hz: Annotated[
        tuple[float, ...],
        key("Frequencies at which stiffness and loss factor are tabulated.", "Hz", min_length=1, example=[50.0, 100.0]),
    ]


@dataclass(frozen=True, kw_only=True)
class ModelledJointCase(Case):
    """Case of a modelled joint.

    Attributes
    ----------
    truth : Assembly
        Assembly with the actual values and no unknown numbers.
    believed : Assembly
        Assembly of the fit, with the initial values of the joint and the priors of unknown numbers.
    actual : mapping of str to float
        Actual values of all fitted parameters.
    responses, forces : tuple of str
        Measured DOFs, and DOFs of the forces.
    noise : float
        Level of the noise, 0.02 for 2 %.
    show_hz : ndarray
        Frequencies of the table of stiffness and loss factor, Hz.
    """

    truth: Assembly
    believed: Assembly
    actual: dict[str, float]
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    noise: float
    show_hz: np.ndarray


def read_modelled_joint(common: Case, keys: ModelledJointKeys, expected: ExpectedKeys) -> ModelledJointCase:
    """Return the case of its files; raise FileContentError if they are invalid."""
    models = [one.structure(common.freq_hz) for one in (keys.substructure_a, keys.substructure_b)]
    actual, start = _joints(keys)
    unknowns: dict[str, dict[str, Unknown]] = {"A": {}, "B": {}}
    factors: dict[str, dict[str, float]] = {"A": {}, "B": {}}
    for own in keys.unknown:
        std = own.std_percent / 100 * own.value
        unknowns[own.substructure][own.name] = own.build(lambda own=own, std=std: Unknown(own.value, std, lower=0))  # type: ignore[misc]
        factors[own.substructure][own.name] = 1 + own.error_percent / 100
    actual_masses = tuple(AddedMass(one.dof, one.mass) for one in keys.added_mass)
    masses = tuple(
        one.build(lambda one=one: AddedMass(one.dof, Unknown(one.believed, one.std)))  # type: ignore[misc]
        for one in keys.added_mass
    )
    sides = []
    for name, structure, dofs in zip("AB", models, (keys.points.j, keys.points.k), strict=True):
        assert isinstance(structure, ModelStructure)
        # The models have no errors except the unknown numbers in the file.
        sides.append((Substructure(_changed(structure, factors[name]), dofs, exact=True),
                      Substructure(structure.model, dofs, unknowns[name], exact=True)))  # fmt: skip
    truth = keys.build(lambda: Assembly(sides[0][0], sides[1][0], actual, actual_masses))
    believed = keys.build(lambda: Assembly(sides[0][1], sides[1][1], start, masses))
    measured = keys.measured
    for name in ("responses", "forces"):
        measured.build(lambda name=name: believed.check(getattr(measured, name), name), name)  # type: ignore[misc]
    values = dict(zip(actual.names, actual.values.tolist(), strict=True))
    for name in "AB":
        for word, unknown in unknowns[name].items():
            values[f"{name}/{word}"] = unknown.value * factors[name].get(word, 1.0)
    values |= {mass.names[0]: one.mass for mass, one in zip(masses, keys.added_mass, strict=True)}
    return ModelledJointCase(
        **vars(common), truth=truth, believed=believed, actual=values, responses=measured.responses,
        forces=measured.forces, noise=measured.noise, show_hz=np.array(keys.show_hz),
    )  # fmt: skip


def _changed(structure: ModelStructure, factors: dict[str, float]) -> Model:
    """Return the model with actual values, from a substructure with scaled unknowns."""
    units = {word: Unknown(1.0) for word in factors if word != "loss_factor"}
    if "loss_factor" in factors:
        units["loss_factor"] = Unknown(structure.model.loss_factor)
    values = {k: f * (structure.model.loss_factor if k == "loss_factor" else 1.0) for k, f in factors.items()}
    return Substructure(structure.model, (), units, exact=True).model(values)


def _joints(keys: ModelledJointKeys) -> tuple[LawJoint, LawJoint]:
    """Return the actual joint and the joint with the initial values of the fit."""
    laws: dict[str, dict[str, JointLaw]] = {"actual": {}, "start": {}}
    for own in keys.law:
        if own.law == "rigid":
            continue
        if lacking := [name for name in laws if name not in own.table.content]:
            raise own.missing(lacking, f"the law {own.law!r} takes parameters")
        for name, by_dof in laws.items():
            by_dof[own.dof] = read_law(own.table.table(name), own.law)
    rigid = [own.dof for own in keys.law if own.law == "rigid"]
    mass = {own.dof: own.mass for own in keys.law if own.mass is not None}
    dofs = [own.dof for own in keys.law]
    actual, start = (keys.build(lambda one=one: LawJoint(one, rigid, mass, dofs), "law") for one in laws.values())  # type: ignore[misc]
    return actual, start
