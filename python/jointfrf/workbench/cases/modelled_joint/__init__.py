"""A joint of any laws, from FRFs at any points, given models of the substructures.

keys      the keys of its files, and the case as data
compute   realisations of the measurement, each fitted, for cases and for studies
results   parameters beside their bound, residual test; stiffness over frequency, FRFs measured and fitted
"""

from jointfrf.workbench.cases.kind import CaseKind
from jointfrf.workbench.cases.modelled_joint.compute import ModelledJointResult, compute_modelled, estimate_groups
from jointfrf.workbench.cases.modelled_joint.keys import ModelledJointCase, ModelledJointKeys, read_modelled_joint
from jointfrf.workbench.cases.modelled_joint.results import build_figures, build_numbers, build_summary, build_tables

__all__ = ["KIND"]

KIND: CaseKind[ModelledJointCase, ModelledJointResult] = CaseKind(
    keys=ModelledJointKeys,
    read=read_modelled_joint,
    compute=compute_modelled,
    tables=build_tables,
    figures=build_figures,
    summary=build_summary,
    numbers=build_numbers,
    groups=estimate_groups,
    headline=("stiffness",),
)
