"""Two simulated substructures and a joint of known parameters, identified from many realisations of noisy FRFs.

keys          keys of the files, and the case as data
exact         FRFs without noise, K*(w) line by line by each method, and errors without noise
decoupling    fit to all FRFs between internal points, and its bound
realisations  identified parameters of many realisations of the noise, for cases and for studies
regenerate    FRFs of the assembly from identified and from published parameters, and their errors
modes         mode shapes of the assembly, and their panels
compute       result, and sensitivity of the observed FRFs to the joint
expected      comparison with `expected.toml`: published numbers, and errors from published parameters
tables        tables
figures       figures
"""

from jointfrf.workbench.cases.keys import METHODS
from jointfrf.workbench.cases.kind import CaseKind
from jointfrf.workbench.cases.known_joint.compute import KnownJointResult, known_joint_result
from jointfrf.workbench.cases.known_joint.exact import Exact, exact_frfs
from jointfrf.workbench.cases.known_joint.figures import build_figures
from jointfrf.workbench.cases.known_joint.keys import (
    KnownJointCase,
    KnownJointExpected,
    KnownJointKeys,
    read_known_joint,
)
from jointfrf.workbench.cases.known_joint.realisations import estimate_groups
from jointfrf.workbench.cases.known_joint.tables import build_numbers, build_summary, build_tables

__all__ = ["KIND"]

KIND: CaseKind[KnownJointCase, Exact, KnownJointResult] = CaseKind(
    keys=KnownJointKeys,
    expected_keys=KnownJointExpected,
    read=read_known_joint,
    frfs=exact_frfs,
    methods=METHODS,
    takes_functions=True,
    groups=estimate_groups,
    result=known_joint_result,
    tables=build_tables,
    figures=build_figures,
    summary=build_summary,
    numbers=build_numbers,
    not_printed=("bands", "blocks", "regenerated"),
    headline=("noise", "noise-k"),
)
