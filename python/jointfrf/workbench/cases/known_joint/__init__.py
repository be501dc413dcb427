"""Two simulated substructures and a joint of known parameters, identified from noisy FRFs, many times over.

keys          the keys of its files, and the case as data
exact         FRFs without noise, K*(w) line by line by each method, and how exact the equations are
decoupling    the fit to all FRFs between internal points, and its bound
realisations  many realisations of the noise: identified parameters, for cases and for studies
regenerate    FRFs of the assembly from identified and from printed parameters, and their errors
modes         mode shapes of the assembly, and drawings of them
compute       the result; sensitivity of the observed FRFs to the joint
expected      the comparison with `expected.toml`: published numbers, and errors that follow from printed parameters
tables        the tables
figures       the figures
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
