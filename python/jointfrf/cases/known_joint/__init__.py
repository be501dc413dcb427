"""Two simulated substructures and a joint of known parameters, identified from noisy FRFs, many times over.

keys        the keys of its files, and the case as data
exact       FRFs without noise, K*(w) line by line by each method, and how exact the equations are
decoupling  the fit to all FRFs between internal points, and its bound
study       many realisations of the noise: identified parameters, for cases and for studies
regenerate  FRFs of the assembly from identified and from printed parameters, and their errors
modes       mode shapes of the assembly, and drawings of them
compute     all of these, one after the other; where the observed FRFs depend on the joint
tables      numbers beside those of the source, and what follows exactly from what it prints
figures     the figures
"""

from jointfrf.cases.kind import CaseKind
from jointfrf.cases.known_joint.compute import KnownJointResult, compute
from jointfrf.cases.known_joint.figures import known_joint_figures
from jointfrf.cases.known_joint.keys import KnownJointCase, KnownJointExpected, KnownJointKeys, read_known_joint
from jointfrf.cases.known_joint.study import known_joint_studied
from jointfrf.cases.known_joint.tables import known_joint_numbers, known_joint_summary, known_joint_tables

__all__ = ["KIND"]

KIND: CaseKind[KnownJointCase, KnownJointResult] = CaseKind(
    keys=KnownJointKeys,
    expected_keys=KnownJointExpected,
    read=read_known_joint,
    compute=compute,
    tables=known_joint_tables,
    figures=known_joint_figures,
    summary=known_joint_summary,
    numbers=known_joint_numbers,
    studied=known_joint_studied,
    not_printed=("bands", "blocks", "regenerated"),
)
