"""What a reader must know of an identification, in words: notes on how the numbers came about, and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import ConvergenceWarning, IdentificationWarning
from jointfrf.identification.compliance_fit.estimator import ComplianceEstimate
from jointfrf.identification.compliance_fit.intervals import MISFIT
from jointfrf.identification.compliance_fit.joint_terms import CrossTerms
from jointfrf.identification.fit import ComplianceFit, DampingChoice
from jointfrf.identification.joint_fit import JointFit

__all__ = ["Described", "describe_band_mean", "describe_compliance", "group_notes", "listed", "significance_notes"]

#: A parameter is called poorly determined when its standard error exceeds this share of it.
_UNCERTAIN = 0.5


class Described(NamedTuple):
    """A fit with its notes and warnings, and the warnings to be issued."""

    fit: JointFit
    warnings: tuple[Warning, ...] = ()


def describe_band_mean(fit: JointFit) -> Described:
    """Say what the standard errors of a band mean leave out."""
    note = "the standard error of a band mean is the scatter of its lines; its bias by noise is not included"
    return Described(replace(fit, notes=(note,)))


def describe_compliance(found: ComplianceFit, cross: CrossTerms) -> Described:
    """Add the notes and warnings of a compliance fit."""
    fit, result = found.joint, found.estimate
    notes = [
        *_choice_notes(found.choice),
        *_level_notes(found.level_from_residual),
        *_left_out_notes(result, fit.dofs),
        *significance_notes(fit),
        *group_notes(result.groups, fit.dofs, cross),
    ]
    doubts = [
        *_lost_warnings(result, fit.dofs),
        *_parameter_warnings(fit),
        *_misfit_warnings(fit, result, cross),
    ]
    told: list[Warning] = [IdentificationWarning(text) for text in doubts]
    if not result.converged[0]:
        told.append(ConvergenceWarning(f"the fit did not converge in {result.iterations[0]} iterations"))
    described = replace(fit, notes=tuple(notes), warnings=tuple(str(warning) for warning in told))
    return Described(described, tuple(told))


def listed(names: Sequence[str]) -> str:
    """Return names in a row."""
    return ", ".join(names)


def _choice_notes(choice: DampingChoice | None) -> list[str]:
    if choice is None:
        return []
    strength = "clearly" if choice.margin > 10 else "weakly" if choice.margin > 2 else "hardly"
    notes = ["viscous and hysteretic damping cannot be distinguished: only one of them is fitted"]
    preferred = f"damping {choice.best}: {strength} preferred to {choice.second}"
    return notes * choice.indistinguishable + [f"{preferred} (difference of BIC {choice.margin:.1f})"]


def _level_notes(from_residual: bool) -> list[str]:
    told = "the noise level is taken from the residual: the symmetry of the FRFs does not show it"
    return [told] * from_residual


def significance_notes(fit: JointFit) -> list[str]:
    """Name damping and cross terms whose sign is not known."""
    intervals = fit.confidence_interval(0.95)
    open_ = [one.name for one in fit.terms if one.kind != "k" and intervals[one.name][0] < 0 < intervals[one.name][1]]
    return [f"{listed(open_)}: not significantly different from zero (95 % interval)"] if open_ else []


def group_notes(groups: Sequence[NDArray[np.intp]], dofs: tuple[str, ...], cross: CrossTerms) -> list[str]:
    """Name groups of DOFs between which the FRFs are zero."""
    if len(groups) < 2:
        return []
    names = " and ".join(f"({listed([dofs[d] for d in group])})" for group in groups)
    told = f"the FRFs between {names} are zero: each group is fitted separately"
    return [told + (", and cross terms between them cannot be identified" if cross == "fit" else "")]


def _by_group(result: ComplianceEstimate, dofs: tuple[str, ...]) -> list[tuple[str, int, int]]:
    """Return " of DOFs" where there are several groups, the number of lines left out and of lines lost, of each."""
    several = len(result.groups) > 1
    return [
        (
            f" of {listed([dofs[d] for d in group])}" if several else "",
            int(np.count_nonzero(result.left_out[0, :, group[0]])),
            int(np.count_nonzero(result.lost[:, group[0]])),
        )
        for group in result.groups
    ]


def _left_out_notes(result: ComplianceEstimate, dofs: tuple[str, ...]) -> list[str]:
    """Count the lines left out where these are few."""
    total = len(result.lost)
    return [
        f"{out} of {total} lines{whose} are left out: their noise hides the joint"
        for whose, out, lost in _by_group(result, dofs)
        if out and max(out, lost) <= total / 2
    ]


def _lost_warnings(result: ComplianceEstimate, dofs: tuple[str, ...]) -> list[str]:
    """Count the lines on which noise hides the joint where these are many."""
    total = len(result.lost)
    return [
        f"on {max(out, lost)} of {total} lines{whose} the noise is as large as the difference between the motions of "
        "the joint DOFs (gamma_jk is nearly singular): "
        + (f"only the other {total - out} are used" if out else "expect bias beyond the intervals")
        + "; other bands or points may be more sensitive to the joint"
        for whose, out, lost in _by_group(result, dofs)
        if max(out, lost) > total / 2
    ]


def _parameter_warnings(fit: JointFit) -> list[str]:
    """Name stiffnesses that the data determine poorly or not at all."""
    told = []
    intervals, errors = fit.confidence_interval(0.95), fit.std_error
    for one in fit.terms:
        low, high = intervals[one.name]
        if one.kind != "k" or one.is_cross:
            continue
        if not (np.isfinite(low) and np.isfinite(high)):
            bound = f"at least {low:.3g} {one.unit} (95 %)" if np.isfinite(low) else "the data give no bound"
            told.append(f"{one}: this DOF cannot be distinguished from a rigid one; {bound}")
        elif errors[one.name] > _UNCERTAIN * abs(fit.parameters[one.name]):
            told.append(f"{one}: poorly determined by the data, 95 % interval {low:.3g} .. {high:.3g} {one.unit}")
    return told


def _misfit_warnings(fit: JointFit, result: ComplianceEstimate, cross: CrossTerms) -> list[str]:
    """Say where the residual exceeds the noise."""
    ratio = fit.residual_level / fit.noise_level if fit.noise_level > 0 else 1.0
    if ratio <= MISFIT:
        return []
    told = [
        f"the residual is {ratio:.1f} times the noise: the model of the joint does not fit the data (cross terms, "
        "other DOFs, rotations by coarse differences); standard errors come from the scatter between parts of the band"
    ]
    if cross == "zero" and result.off_diagonal[0] > MISFIT * fit.noise_level:
        told.append("the DOFs of the joint are coupled: consider ignoring or fitting the cross terms (cross)")
    return told
