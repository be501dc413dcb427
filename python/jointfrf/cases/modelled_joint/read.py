"""From `case.toml` to a case of a modelled joint."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import cast

import numpy as np

from jointfrf.cases.kind import Case
from jointfrf.cases.known_joint.structure import ModelStructure
from jointfrf.cases.known_joint.substructures import read_substructure
from jointfrf.identification.model.assembly import AddedMass, Assembly
from jointfrf.identification.model.substructure import Substructure, Unknown
from jointfrf.laws.joint_toml import LAW_WORDS, read_law
from jointfrf.laws.law import JointLaw
from jointfrf.laws.law_joint import LawJoint
from jointfrf.models.model import Model
from jointfrf.toml.table import TomlTable

__all__ = ["ModelledJointCase", "read_modelled_joint"]


@dataclass(frozen=True, kw_only=True)
class ModelledJointCase(Case):
    """A case of a modelled joint.

    Attributes
    ----------
    truth : Assembly
        With the actual values, nothing unknown.
    believed : Assembly
        What is fitted: the start of the joint, unknowns with their priors.
    actual : mapping of str to float
        Actual values of all parameters that are fitted.
    responses, forces : tuple of str
    noise : float
    show_hz : ndarray
        Hz.
    """

    truth: Assembly
    believed: Assembly
    actual: dict[str, float]
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    noise: float
    show_hz: np.ndarray


def read_modelled_joint(common: Case, table: TomlTable, expected: TomlTable) -> ModelledJointCase:
    """Read the keys of the kind; raises FileContentError."""
    models = [_model(table.table(f"substructure_{side}"), common) for side in "ab"]
    actual, start = _read_laws(table)
    points = table.table("points")
    joint_dofs = [points.texts(key) for key in "jk"]
    points.close()
    measured = table.table("measured")
    responses, forces = measured.texts("responses"), measured.texts("forces")
    noise = measured.number("noise", 0)
    if noise == 0:
        raise measured.error("noise", "above 0")
    measured.close()
    unknowns, factors = _read_unknowns(table)
    masses = _read_masses(table)
    show_hz = np.array(table.numbers("show_hz"))
    sides = [
        (Substructure(_changed(model, factors[name]), dofs), Substructure(model.model, dofs, unknowns[name]))
        for name, model, dofs in zip("AB", models, joint_dofs, strict=True)
    ]
    truth, believed = (
        table.build(lambda at=at, joint=joint: Assembly(sides[0][at], sides[1][at], joint, masses[at]))  # type: ignore[misc]
        for at, joint in ((0, actual), (1, start))
    )
    for names, key in ((responses, "responses"), (forces, "forces")):
        measured.build(lambda names=names, key=key: believed.check(names, key), key)  # type: ignore[misc]
    values = dict(zip(actual.names, actual.values.tolist(), strict=True))
    for name in "AB":
        for key, unknown in unknowns[name].items():
            values[f"{name}/{key}"] = unknown.value * factors[name].get(key, 1.0)
    for one in masses[0]:
        values[one.names[0]] = float(cast(float, one.mass))
    return ModelledJointCase(
        **{one.name: getattr(common, one.name) for one in fields(Case)},
        truth=truth, believed=believed, actual=values, responses=responses, forces=forces, noise=noise, show_hz=show_hz,
    )  # fmt: skip


def _model(table: TomlTable, common: Case) -> ModelStructure:
    found = read_substructure(table, common.freq_hz)
    if not isinstance(found, ModelStructure):
        raise table.error("model", "a model, not receptances")
    return found


def _changed(structure: ModelStructure, factors: dict[str, float]) -> Model:
    """Return the model with actual values: by a substructure whose unknowns are scaled."""
    units = {key: Unknown(1.0) for key in factors if key != "loss_factor"}
    if "loss_factor" in factors:
        units["loss_factor"] = Unknown(structure.model.loss_factor)
    values = {k: f * (structure.model.loss_factor if k == "loss_factor" else 1.0) for k, f in factors.items()}
    return Substructure(structure.model, (), units).model(values)


def _read_laws(table: TomlTable) -> tuple[LawJoint, LawJoint]:
    """Return the actual joint and the start of the fit."""
    actual: dict[str, JointLaw] = {}
    start: dict[str, JointLaw] = {}
    rigid, mass, dofs = [], {}, []
    tables = table.tables("law")
    for own in tables:
        dof, word = own.text("dof"), own.text("law", LAW_WORDS)
        dofs.append(dof)
        if word == "rigid":
            rigid.append(dof)
        else:
            actual[dof], start[dof] = (read_law(own.table(key), word) for key in ("actual", "start"))
        if "mass" in own:
            mass[dof] = own.number("mass", 0)
        own.close()
    return table.build(lambda: (LawJoint(actual, rigid, mass, dofs), LawJoint(start, rigid, mass, dofs)), "law")


def _read_unknowns(table: TomlTable) -> tuple[dict[str, dict[str, Unknown]], dict[str, dict[str, float]]]:
    """Return the unknowns of both sides, and the factors of their actual values."""
    unknowns: dict[str, dict[str, Unknown]] = {"A": {}, "B": {}}
    factors: dict[str, dict[str, float]] = {"A": {}, "B": {}}
    for own in table.tables("unknown") if "unknown" in table else []:
        side, name = (
            own.text("substructure", ("A", "B")),
            own.text("name", ("youngs_modulus", "density", "loss_factor")),
        )
        value, std = own.number("value", 0), own.number("std_percent", 0)
        unknowns[side][name] = own.build(lambda value=value, std=std: Unknown(value, std / 100 * value, lower=0))  # type: ignore[misc]
        factors[side][name] = 1 + own.number("error_percent") / 100
        own.close()
    return unknowns, factors


def _read_masses(table: TomlTable) -> tuple[tuple[AddedMass, ...], tuple[AddedMass, ...]]:
    """Return the masses of sensors and shakers: actual ones, and as believed."""
    actual, believed = [], []
    for own in table.tables("added_mass") if "added_mass" in table else []:
        dof = own.text("dof")
        actual.append(AddedMass(dof, own.number("mass", 0)))
        value, std = own.number("believed", 0), own.number("std", 0)
        believed.append(own.build(lambda dof=dof, value=value, std=std: AddedMass(dof, Unknown(value, std))))  # type: ignore[misc]
        own.close()
    return tuple(actual), tuple(believed)
