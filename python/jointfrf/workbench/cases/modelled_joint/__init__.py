"""A joint with any laws, identified from FRFs at any points with models of the substructures.

keys      keys of the files, and the case as data
compute   fits of realisations of the measurement, for cases and for studies
results   parameters and their bounds, residual test, stiffness over frequency, and measured and fitted FRFs
"""

from jointfrf.kernel.arguments import ComplexArray
from jointfrf.workbench.cases.kind import CaseKind
from jointfrf.workbench.cases.modelled_joint.compute import (
    ESTIMATOR,
    ModelledJointResult,
    estimate_groups,
    exact_frfs,
    modelled_joint_result,
)
from jointfrf.workbench.cases.modelled_joint.keys import ModelledJointCase, ModelledJointKeys, read_modelled_joint
from jointfrf.workbench.cases.modelled_joint.results import build_figures, build_numbers, build_summary, build_tables

__all__ = ["KIND"]

KIND: CaseKind[ModelledJointCase, ComplexArray, ModelledJointResult] = CaseKind(
    keys=ModelledJointKeys,
    read=read_modelled_joint,
    frfs=exact_frfs,
    methods=(ESTIMATOR,),
    groups=estimate_groups,
    result=modelled_joint_result,
    tables=build_tables,
    figures=build_figures,
    summary=build_summary,
    numbers=build_numbers,
    headline=("stiffness",),
)
