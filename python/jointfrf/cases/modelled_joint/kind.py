"""The kind of case `modelled-joint`."""

from __future__ import annotations

from jointfrf.cases.kind import CaseKind
from jointfrf.cases.modelled_joint.compute import ModelledJointResult, compute_modelled
from jointfrf.cases.modelled_joint.figures import modelled_figures
from jointfrf.cases.modelled_joint.keys import MODELLED_EXPECTED_KEYS, MODELLED_JOINT_KEYS
from jointfrf.cases.modelled_joint.read import ModelledJointCase, read_modelled_joint
from jointfrf.cases.modelled_joint.studied import modelled_joint_studied
from jointfrf.cases.modelled_joint.tables import modelled_numbers, modelled_summary, modelled_tables

__all__ = ["MODELLED_JOINT"]

MODELLED_JOINT: CaseKind[ModelledJointCase, ModelledJointResult] = CaseKind(
    name="modelled-joint",
    read=read_modelled_joint,
    compute=compute_modelled,
    tables=modelled_tables,
    figures=modelled_figures,
    summary=modelled_summary,
    numbers=modelled_numbers,
    studied=modelled_joint_studied,
    keys=MODELLED_JOINT_KEYS,
    expected_keys=MODELLED_EXPECTED_KEYS,
)
