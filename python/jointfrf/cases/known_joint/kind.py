"""The kind of case `known-joint`."""

from __future__ import annotations

from jointfrf.cases.kind import CaseKind
from jointfrf.cases.known_joint.compute import KnownJointResult, compute
from jointfrf.cases.known_joint.figures import known_joint_figures
from jointfrf.cases.known_joint.keys import EXPECTED_KEYS, KNOWN_JOINT_KEYS
from jointfrf.cases.known_joint.read import KnownJointCase, read_known_joint
from jointfrf.cases.known_joint.studied import known_joint_studied
from jointfrf.cases.known_joint.summary import known_joint_summary
from jointfrf.cases.known_joint.tables import known_joint_numbers, known_joint_tables

__all__ = ["KNOWN_JOINT"]

KNOWN_JOINT: CaseKind[KnownJointCase, KnownJointResult] = CaseKind(
    name="known-joint",
    read=read_known_joint,
    compute=compute,
    tables=known_joint_tables,
    figures=known_joint_figures,
    summary=known_joint_summary,
    numbers=known_joint_numbers,
    studied=known_joint_studied,
    not_printed=("bands", "blocks", "regenerated"),
    keys=KNOWN_JOINT_KEYS,
    expected_keys=EXPECTED_KEYS,
)
