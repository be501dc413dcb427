"""A joint of any laws, from FRFs at any points, given models of the substructures.

keys      the keys of its files, and the case as data
compute   realisations of the measurement, each fitted, for cases and for studies
results   parameters beside their bound, residual test; stiffness over frequency, FRFs measured and fitted
"""

from jointfrf.cases.kind import CaseKind
from jointfrf.cases.modelled_joint.compute import ModelledJointResult, compute_modelled, modelled_joint_studied
from jointfrf.cases.modelled_joint.keys import ModelledJointCase, ModelledJointKeys, read_modelled_joint
from jointfrf.cases.modelled_joint.results import modelled_figures, modelled_numbers, modelled_summary, modelled_tables

__all__ = ["KIND"]

KIND: CaseKind[ModelledJointCase, ModelledJointResult] = CaseKind(
    keys=ModelledJointKeys,
    read=read_modelled_joint,
    compute=compute_modelled,
    tables=modelled_tables,
    figures=modelled_figures,
    summary=modelled_summary,
    numbers=modelled_numbers,
    studied=modelled_joint_studied,
)
