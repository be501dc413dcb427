"""What a reader must know of an identification, in words: notes on how the numbers came about, and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointfrf.dofs import compliance_unit, is_rotation
from jointfrf.errors import ConvergenceWarning, IdentificationWarning
from jointfrf.identification.describe import Described, group_notes, listed, significance_notes
from jointfrf.identification.elastic_centre import elastic_centre
from jointfrf.identification.joint_fit import JointFit
from jointfrf.identification.manifold_fit.damping_choice import DofDamping
from jointfrf.identification.manifold_fit.estimator import JointEstimate
from jointfrf.identification.manifold_fit.fit import ManifoldFit
from jointfrf.identification.manifold_fit.intervals import Spread
from jointfrf.identification.manifold_fit.misfit import Misfit
from jointfrf.identification.manifold_fit.prepare import ManifoldProblem, Transforms

__all__ = ["describe_manifold"]

#: A parameter is called poorly determined when its interval is wider than this share of it.
_UNCERTAIN = 0.5
#: Variances that exceed those from noise by this factor are told; less is widened without a word.
_WIDENED = 5.0
#: Relative noise below this is rounding.
_ROUNDING = 1e-7
#: Share of the motion of a DOF from which on another one that enters it is named.
_ENTERS = 0.05
#: Relative standard errors above this are told where they are due to sides that are not rigid.
_FLEXIBLE = 0.02
#: A reference point is proposed where it lowers the largest coupling to this share.
_LESS = 0.5
#: Share of lines that cannot fit the joint from which on a warning says so.
_UNTRUSTED = 0.02
_COUPLED = (
    "; with cross terms it does: the DOFs of the joint are coupled, so ignore or fit the cross terms (cross), or move "
    "the reference point"
)


def describe_manifold(found: ManifoldFit, problem: ManifoldProblem) -> Described:
    """Add the notes and warnings of a fit on the manifold."""
    fit, result = found.joint, found.estimate
    intervals = fit.confidence_interval(0.95)
    notes = [
        *_choice_notes(found.choices),
        *_noise_notes(problem),
        *_channel_notes(found, problem),
        *group_notes([group.dofs for group in result.groups], fit.dofs, problem.options.cross),
        *significance_notes(fit),
        *_reference_notes(fit),
    ]
    doubts = [
        *([] if found.cross_fits else _untrusted_warnings(result, fit.dofs)),
        *_left_out_warnings(problem),
        *_parameter_warnings(fit, intervals),
        *_rigidity_warnings(found),
        *_misfit_warnings(found, problem),
        *_scatter_warnings(fit, found.spread),
        *_sign_warnings(fit, intervals),
    ]
    told: list[Warning] = [IdentificationWarning(text) for text in doubts]
    if not result.converged:
        most = max(group.fit.iterations for group in result.groups)
        told.append(ConvergenceWarning(f"the fit did not converge in {most} iterations"))
    described = replace(fit, notes=tuple(notes), warnings=tuple(str(warning) for warning in told))
    return Described(described, tuple(told))


def _choice_notes(choices: Sequence[DofDamping]) -> list[str]:
    """Say which damping terms were chosen for each DOF, and how clearly."""
    told = []
    for one in choices:
        strength = "clearly" if one.margin > 10 else "weakly" if one.margin > 2 else "hardly"
        told.append(
            f"damping of {one.dof}: {one.best}, {strength} preferred to {one.second} "
            f"(difference of BIC {one.margin:.1f})"
        )
    return told


def _noise_notes(problem: ManifoldProblem) -> list[str]:
    noise = problem.noise
    told = []
    if noise.is_assumed:
        told.append("the noise level is taken from the residual: the FRFs do not show it otherwise")
    if noise.inflation > 1.2:
        told.append(
            f"the noise of neighbouring lines is correlated: {problem.freq_hz.size} lines say as much as "
            f"{problem.freq_hz.size / noise.inflation:.0f} independent ones"
        )
    if noise.outlying.size:
        shown = listed([f"{problem.freq_hz[i]:g}" for i in noise.outlying[:8]])
        rest = f" and {noise.outlying.size - 8} more" if noise.outlying.size > 8 else ""
        told.append(f"lines with far more noise than their neighbours weigh less: {shown}{rest} Hz")
    return told


def _channel_notes(found: ManifoldFit, problem: ManifoldProblem) -> list[str]:
    """Say what is known of the flexibility between channels."""
    frfs = problem.frfs
    if Transforms(frfs.responses, frfs.forces).are_units:
        return []
    if found.channels is None:
        return [
            "the channels cannot check that the sides of the joint are rigid between them: what their flexibility does "
            "is not in the intervals"
        ]
    told = []
    if problem.added_compliance is not None:
        values = listed(
            [
                f"{value:.2g} {compliance_unit(dof, dof)} for {dof}"
                for dof, value in zip(problem.dofs, problem.added_compliance, strict=True)
                if value > 0
            ]
        )
        told.append(f"the sides have about this compliance between the channels, and intervals allow for it: {values}")
    return told


def _reference_notes(fit: JointFit) -> list[str]:
    """Propose the reference point at which the stiffness is most nearly diagonal."""
    try:
        centre = elastic_centre(fit) if any(one.is_cross for one in fit.terms) else None
    except ValueError:
        # Names that tell no direction, or a stiffness that is not positive: there is nothing to propose.
        centre = None
    if centre is None or centre.coupling > _LESS * centre.coupling_before:
        return []
    where = listed(
        [
            f"{axis} {1e3 * r:+.3g} +- {1e3 * error:.2g} mm"
            for axis, r, error in zip("xyz", centre.offset, centre.std_error, strict=True)
            if np.isfinite(error)
        ]
    )
    return [
        f"the stiffness is most nearly diagonal with the reference points moved by {where} (standard error): the "
        f"largest coupling falls from {centre.coupling_before:.2g} to {centre.coupling:.2g} (elastic_centre)"
    ]


def _left_out_warnings(problem: ManifoldProblem) -> list[str]:
    """Name DOFs that are not sought, but enter those that are."""
    told = []
    for one in problem.left_out:
        if one.share < _ENTERS:
            continue
        unit = " m" if is_rotation(one.dof) > is_rotation(one.into) else ""
        how = f"{one.weight:.3g}{unit} of {one.dof}, which is left out, enters {one.into} of side {one.side}"
        size = (
            f"{100 * one.share:.0f} % of its motion"
            if np.isfinite(one.share)
            else "how much cannot be seen from these channels"
        )
        told.append(f"{how} ({size}): fit {one.dof}, too, or move the reference point or the channels")
    return told


def _rigidity_warnings(found: ManifoldFit) -> list[str]:
    """Name stiffnesses whose uncertainty is mostly that of sides that are not rigid."""
    if found.channels is None:
        return []
    fit = found.joint
    wide = [
        one.name
        for one, added, noise in zip(fit.terms, found.channels.factor, found.spread.factor, strict=True)
        if one.kind == "k" and not one.is_cross and added > _WIDENED * noise
        if fit.std_error[one.name] > _FLEXIBLE * abs(fit.parameters[one.name])
    ]
    if not wide:
        return []
    return [
        f"{listed(wide)}: between the channels the sides deform so much that the intervals are mostly due to that, "
        "not to noise: channels nearer to the joint, or more of them, would narrow them"
    ]


def _untrusted_warnings(result: JointEstimate, dofs: tuple[str, ...]) -> list[str]:
    """Count the lines that no joint near the one found fits."""
    several = len(result.groups) > 1
    told = []
    for group in result.groups:
        out, total = int(np.count_nonzero(~group.fit.trusted)), group.fit.trusted.size
        if out > _UNTRUSTED * total:
            whose = f" of {listed([dofs[d] for d in group.dofs])}" if several else ""
            told.append(f"{out} of {total} lines{whose} do not fit the joint found within their noise and are left out")
    return told


def _parameter_warnings(fit: JointFit, intervals: dict[str, tuple[float, float]]) -> list[str]:
    """Name stiffnesses that the data determine poorly or not at all."""
    told = []
    for one in fit.terms:
        low, high = intervals[one.name]
        if one.kind != "k" or one.is_cross:
            continue
        value = fit.parameters[one.name]
        if not np.isfinite(high):
            bound = f"at least {low:.3g} {one.unit} (95 %)" if low > 0 else "the data give no bound"
            told.append(f"{one}: this DOF cannot be distinguished from a rigid one; {bound}")
        elif not low > 0:
            told.append(f"{one}: cannot be distinguished from no joint; at most {high:.3g} {one.unit} (95 %)")
        elif high - low > 2 * _UNCERTAIN * abs(value):
            told.append(f"{one}: poorly determined by the data, 95 % interval {low:.3g} .. {high:.3g} {one.unit}")
    return told


def _sign_warnings(fit: JointFit, intervals: dict[str, tuple[float, float]]) -> list[str]:
    """Name damping that is significantly negative: a joint supplies no energy."""
    return [
        f"{one}: significantly negative, {fit.parameters[one.name]:.3g} {one.unit}; a joint supplies no energy: check "
        "the sign of phases (time convention), delays between channels, and the damping terms asked for"
        for one in fit.terms
        if one.kind != "k" and not one.is_cross and intervals[one.name][1] < 0
    ]


def _misfit_warnings(found: ManifoldFit, problem: ManifoldProblem) -> list[str]:
    """Say whether the residual differs from the noise, and how."""
    misfit, told = found.misfit, []
    apart = f"{abs(misfit.ratio - 1) / misfit.sigma:.0f} sigma"
    if not problem.noise.is_assumed and misfit.is_large:
        text = f"the residual is {misfit.ratio:.2f} times the noise, {apart} above it: the joint does not fit the data"
        told.append(text + (_COUPLED if found.cross_fits else _where(misfit)))
    # What is not rigid in the channels weighs as noise, and averages out of a residual of joint DOFs.
    if not problem.noise.is_assumed and found.channels is None and misfit.is_small:
        told.append(
            f"the residual is {misfit.ratio:.2f} times the noise, {apart} below it: the noise is smaller than said, "
            "or the FRFs were smoothed"
        )
    if found.cross_fits:
        return told
    for trend in misfit.trends:
        low, high = trend.values.min(), trend.values.max()
        told.append(
            f"{trend.name} is not one constant over frequency: parts of the band give {low:.3g} .. {high:.3g} "
            f"(near {trend.centres[trend.values.argmin()]:.4g} and {trend.centres[trend.values.argmax()]:.4g} Hz)"
        )
    return told


def _where(misfit: Misfit) -> str:
    if not misfit.local:
        return ""
    places = listed([f"{low:g}-{high:g} Hz ({100 * share:.0f} %)" for low, high, share in misfit.local])
    return f"; the excess is local: {places}: bad lines, or local modes that the joint DOFs do not describe"


def _scatter_warnings(fit: JointFit, spread: Spread) -> list[str]:
    """Name parameters whose interval comes from the scatter between parts of the band."""
    if fit.noise_level < _ROUNDING:
        return []
    wide = [
        one.name for one, used, by_noise in zip(fit.terms, spread.factor, spread.information, strict=True)
        if used > _WIDENED * by_noise
    ]  # fmt: skip
    if not wide:
        return []
    return [
        f"{listed(wide)}: parts of the band scatter more than the noise explains; the intervals are widened by that"
    ]
