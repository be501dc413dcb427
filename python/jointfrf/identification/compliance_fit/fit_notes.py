"""What a reader must know before using the numbers of a compliance fit, in words."""

from __future__ import annotations

import numpy as np

from jointfrf.identification.compliance_fit.estimator import ComplianceEstimate, Cross
from jointfrf.identification.joint_fit import JointFit

__all__ = ["MISFIT", "doubts", "group_notes", "left_out_notes", "lost_warnings"]

#: The residual may exceed the noise by this factor before the model of the joint is doubted.
MISFIT = 1.3
#: A parameter is called uncertain when its standard error exceeds this share of it.
_UNCERTAIN = 0.5


def _words(names: list[str]) -> str:
    return ", ".join(names)


def group_notes(result: ComplianceEstimate, dofs: tuple[str, ...], cross: Cross) -> list[str]:
    """Tell of groups of DOFs between which the FRFs are zero."""
    if len(result.groups) < 2:
        return []
    names = " and ".join(f"({_words([dofs[d] for d in group])})" for group in result.groups)
    told = f"the FRFs between {names} are zero: each is fitted by itself"
    return [told + (", and cross terms between them are not seen" if cross == "fit" else "")]


def _by_group(result: ComplianceEstimate, dofs: tuple[str, ...]) -> list[tuple[str, int, int]]:
    """Return " of DOFs" where there are several groups, the number of lines left out and of lines lost, of each."""
    several = len(result.groups) > 1
    return [
        (
            f" of {_words([dofs[d] for d in group])}" if several else "",
            int(np.count_nonzero(result.left_out[0, :, group[0]])),
            int(np.count_nonzero(result.lost[:, group[0]])),
        )
        for group in result.groups
    ]


def left_out_notes(result: ComplianceEstimate, dofs: tuple[str, ...]) -> list[str]:
    """Tell of some lines left out."""
    total = len(result.lost)
    return [
        f"{out} of {total} lines{whose} are left out: their noise hides the joint"
        for whose, out, lost in _by_group(result, dofs)
        if out and max(out, lost) <= total / 2
    ]


def lost_warnings(result: ComplianceEstimate, dofs: tuple[str, ...]) -> list[str]:
    """Tell of many lines on which the noise hides the joint."""
    total = len(result.lost)
    return [
        f"on {max(out, lost)} of {total} lines{whose} the noise is as large as the difference between the motions of "
        "the joint DOFs (gamma_jk is nearly singular): "
        + (f"only the other {total - out} are used" if out else "expect bias beyond the intervals")
        + "; other bands or points may see the joint better"
        for whose, out, lost in _by_group(result, dofs)
        if max(out, lost) > total / 2
    ]


def doubts(found: JointFit, result: ComplianceEstimate, cross: Cross) -> list[str]:
    """Return what a reader must know before using the numbers."""
    told = []
    intervals = found.confidence_interval(0.95)
    for name, value in found.parameters.items():
        low, high = intervals[name]
        if name.startswith("k_") and "," not in name and (not np.isfinite(high) or not np.isfinite(low)):
            bound = f"at least {low:.3g} {found.unit(name)}" if np.isfinite(low) else "nothing"
            told.append(f"{name}: the data cannot tell this DOF from a rigid one; they say {bound} (95 %)")
        elif name.startswith("k_") and "," not in name and found.std_error[name] > _UNCERTAIN * abs(value):
            told.append(f"{name}: the data barely see it, 95 % interval {low:.3g} .. {high:.3g} {found.unit(name)}")
    ratio = found.residual_level / found.noise_level if found.noise_level > 0 else 1.0
    if ratio > MISFIT:
        told.append(
            f"the residual is {ratio:.1f} times the noise: the joint is not what is fitted (cross terms, other DOFs, "
            "rotations by coarse differences); standard errors come from the scatter between parts of the band"
        )
        if cross == "zero" and result.off_diagonal[0] > MISFIT * found.noise_level:
            told.append("the DOFs of the joint are coupled: consider to ignore or to fit the cross terms (cross)")
    return told
