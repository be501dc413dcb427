"""From measured FRFs between all joint DOFs to the parameters of a joint of laws: checks, and the steps in order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointfrf.identification.law_fit.describe import DescribedLaws, describe_laws
from jointfrf.identification.manifold.fit import fit_laws
from jointfrf.identification.manifold.prepare import FitProblem
from jointfrf.kernel.arguments import as_names, check_type
from jointfrf.laws.law_joint import LawJoint

__all__ = ["check_law_joint", "identify_laws"]


def check_law_joint(joint: LawJoint, dofs: Sequence[str] | None) -> LawJoint:
    """Check a joint that is to be fitted without models; return it with its DOFs in the order of the FRFs.

    Raises
    ------
    TypeError
        It is no `LawJoint`.
    ValueError
        Other DOFs than those of the FRFs; a mass; nothing to fit.
    """
    check_type("joint", joint, LawJoint)
    names = joint.dofs if dofs is None else as_names("dofs", dofs)
    if sorted(names) != sorted(joint.dofs):
        raise ValueError(f"dofs must name those of joint, {', '.join(joint.dofs)}, not {', '.join(names)}")
    if joint.mass:
        raise ValueError(
            f"joint has a mass in {', '.join(joint.mass)}: FRFs at the joint cannot part it from the structures that "
            "it moves with; leave it out, or give models of these to identify_model"
        )
    if not joint.laws:
        raise ValueError("joint has no law to fit: all DOFs are rigid")
    return LawJoint(joint.laws, joint.rigid, None, names)


def identify_laws(problem: FitProblem, joint: LawJoint) -> DescribedLaws:
    """Fit the laws of a joint and describe what was found.

    Parameters
    ----------
    problem : FitProblem
        Of `prepare_compliance`, without choices of damping and cross terms, which the joint has.
    joint : LawJoint
        As `check_law_joint` returns it.

    Raises
    ------
    ValueError
        More parameters than the FRFs have numbers; FRFs that no joint fits.
    """
    count = 2 * np.count_nonzero(np.isfinite(problem.frfs.variance))
    if count < len(joint.names):
        raise ValueError(f"{count} numbers measured cannot give {len(joint.names)} parameters of laws")
    return describe_laws(fit_laws(problem, joint), joint)
