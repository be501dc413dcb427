"""What a reader must know of an identification, in words: notes on how the numbers came about, and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import compliance_unit
from jointfrf.errors import ConvergenceWarning, IdentificationWarning
from jointfrf.identification.elastic_centre import elastic_centre
from jointfrf.identification.joint_fit import JointFit
from jointfrf.identification.manifold.coordinates import CrossTerms
from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.identification.manifold.fit import DofDamping, ManifoldFit
from jointfrf.identification.manifold.prepare import FitProblem
from jointfrf.identification.manifold.transforms import Transforms
from jointfrf.identification.manifold.uncertainty import Spread
from jointfrf.identification.residual_test import ResidualTest

__all__ = [
    "Described",
    "describe_compliance",
    "joint_fit",
    "left_out_warnings",
    "noise_notes",
    "places_of_excess",
    "untrusted_warnings",
]

#: A parameter is called poorly determined when its interval is wider than this share of it.
_UNCERTAIN = 0.5
#: Parts of the band that scatter so much are told; what may be chance widens the intervals without a word.
_BY_CHANCE = 1e-3
#: Relative noise below this is rounding.
_ROUNDING = 1e-7
#: Variances that exceed those from noise by this factor are mostly due to something else.
_MOSTLY = 5.0
#: Relative standard errors above this are told where they are due to sides that are not rigid.
_FLEXIBLE = 0.02
#: A reference point is proposed where it lowers the largest coupling to this share.
_LESS = 0.5
#: Share of lines that cannot fit the joint from which on a warning says so.
_UNTRUSTED = 0.02
#: Share of a compliance by which it varies between lines from which on a warning says so.
_VARIES = 0.05
#: A residual so near to sqrt(2) times the noise said is that of noise said by part.
_BY_PART = 0.03
_PER_PART = (
    ", or the noise was said for real and imaginary parts each: its level is sqrt(E|e|^2) of both together, 1.41 times "
    "that"
)
_MEAN_OF_TWO = ", or h_pq and h_qp were replaced by their mean, whose noise is smaller"
_COUPLED = (
    "; with cross terms it does: the DOFs of the joint are coupled, so ignore or fit the cross terms (cross), or move "
    "the reference point"
)


class Described(NamedTuple):
    """A fit with its notes and warnings, and the warnings to be issued."""

    fit: JointFit
    warnings: tuple[Warning, ...] = ()


def describe_compliance(found: ManifoldFit, problem: FitProblem) -> Described:
    """Add the notes and warnings of a fit on the manifold."""
    fit, result = joint_fit(found), found.estimate
    intervals = fit.confidence_interval(0.95)
    notes = [
        *_choice_notes(found.choices),
        *noise_notes(problem),
        *_small_residual_notes(found, problem),
        *_channel_notes(found, problem),
        *_group_notes([group.dofs for group in result.groups], fit.dofs, problem.options.cross),
        *_hidden_notes(result, fit.dofs),
        *_significance_notes(fit),
        *_reference_notes(fit),
    ]
    doubts = [
        *([] if found.cross_fits else untrusted_warnings(result, fit.dofs)),
        *left_out_warnings(problem),
        *_band_part_warnings(found),
        *_parameter_warnings(fit, intervals),
        *_rigidity_warnings(found, fit),
        *_misfit_warnings(found, problem),
        *_diagonal_warnings(result, fit.dofs, problem.options.cross),
        *_scatter_warnings(fit, found.spread),
        *_sign_warnings(fit, intervals),
    ]
    told: list[Warning] = [IdentificationWarning(text) for text in doubts]
    if not result.converged:
        most = max(group.iterations for group in result.groups)
        told.append(ConvergenceWarning(f"the fit did not converge in {most} iterations"))
    described = replace(fit, notes=tuple(notes), warnings=tuple(str(warning) for warning in told))
    return Described(described, tuple(told))


def joint_fit(found: ManifoldFit) -> JointFit:
    """Make the result, without notes and warnings."""
    problem, result = found.problem, found.estimate
    return JointFit(
        method="compliance",
        dofs=problem.dofs,
        parameters={one.name: float(value) for one, value in zip(result.parameters, result.theta, strict=True)},
        covariance=found.covariance,
        noise_level=found.noise_level,
        residual_level=found.residual_level,
        freq_hz=problem.freq_hz,
        k_lines=problem.frfs.line_stiffness(),
        bands=problem.bands,
        intervals=found.intervals,
    )


def _listed(names: Sequence[str]) -> str:
    """Return names in a row."""
    return ", ".join(names)


def _significance_notes(fit: JointFit) -> list[str]:
    """Name damping and cross terms whose sign is not known."""
    intervals = fit.confidence_interval(0.95)
    open_ = [one.name for one in fit.terms if one.kind != "k" and intervals[one.name][0] < 0 < intervals[one.name][1]]
    return [f"{_listed(open_)}: not significantly different from zero (95 % interval)"] if open_ else []


def _group_notes(groups: Sequence[NDArray[np.intp]], dofs: tuple[str, ...], cross: CrossTerms) -> list[str]:
    """Name groups of DOFs between which the FRFs are zero."""
    if len(groups) < 2:
        return []
    names = " and ".join(f"({_listed([dofs[d] for d in group])})" for group in groups)
    told = f"the FRFs between {names} are zero: each group is fitted separately"
    return [told + (", and cross terms between them cannot be identified" if cross == "fit" else "")]


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


def noise_notes(problem: FitProblem) -> list[str]:
    """Say how the noise was found, and what is special about it."""
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
        shown = _listed([f"{problem.freq_hz[i]:g}" for i in noise.outlying[:8]])
        rest = f" and {noise.outlying.size - 8} more" if noise.outlying.size > 8 else ""
        told.append(f"lines with far more noise than their neighbours weigh less: {shown}{rest} Hz")
    return told


def _small_residual_notes(found: ManifoldFit, problem: FitProblem) -> list[str]:
    """Say that the residual is below the noise: intervals are then wider than they need be."""
    misfit, noise = found.test, problem.noise
    # What is not rigid in the channels weighs as noise, and averages out of a residual of joint DOFs.
    if noise.is_assumed or found.channels is not None or not misfit.is_small:
        return []
    why = "said" if noise.is_given else "their reciprocity shows"
    mean = _MEAN_OF_TWO if problem.frfs.symmetrised and noise.is_given else ""
    return [
        f"the residual is {misfit.ratio:.2g} times the noise: the FRFs have less noise than {why}, or were smoothed"
        f"{mean}; the intervals are wider than they need be"
    ]


def _channel_notes(found: ManifoldFit, problem: FitProblem) -> list[str]:
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
    if problem.added_compliance is not None and problem.added_compliance.any():
        values = _listed(
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
    where = _listed(
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


def left_out_warnings(problem: FitProblem) -> list[str]:
    """Name DOFs that are not sought, but enter those that are."""
    return [str(one) for one in problem.left_out if one.matters]


def _rigidity_warnings(found: ManifoldFit, fit: JointFit) -> list[str]:
    """Name stiffnesses whose uncertainty is mostly that of sides that are not rigid."""
    if found.channels is None:
        return []
    wide = [
        one.name
        for one, added, noise in zip(fit.terms, found.channels.factor, found.spread.factor, strict=True)
        if one.kind == "k" and not one.is_cross and added > _MOSTLY * noise
        if fit.std_error[one.name] > _FLEXIBLE * abs(fit.parameters[one.name])
    ]
    if not wide:
        return []
    return [
        f"{_listed(wide)}: between the channels the sides deform so much that the intervals are mostly due to that, "
        "not to noise: channels nearer to the joint, or more of them, would narrow them"
    ]


def untrusted_warnings(result: JointEstimate, dofs: tuple[str, ...]) -> list[str]:
    """Count the lines that no joint near the one found fits."""
    several = len(result.groups) > 1
    told = []
    for group in result.groups:
        if group.unknown_cross is not None:
            continue
        out, total = int(np.count_nonzero(~group.used)), group.used.size
        if out > _UNTRUSTED * total:
            whose = f" of {_listed([dofs[d] for d in group.dofs])}" if several else ""
            told.append(f"{out} of {total} lines{whose} do not fit the joint found within their noise and are left out")
    return told


def _hidden_notes(result: JointEstimate, dofs: tuple[str, ...]) -> list[str]:
    """Count the lines on which noise hides the transmission of the joint, where its cross terms are unknown."""
    told = []
    for group in result.groups:
        beside, total = group.unknown_cross, group.used.size
        if beside is not None and beside.hidden > _UNTRUSTED * total:
            told.append(
                f"on {beside.hidden} of {total} lines noise hides gamma_jk of {_listed([dofs[d] for d in group.dofs])} "
                "(nearly singular): they count less"
            )
    return told


def _diagonal_warnings(result: JointEstimate, dofs: tuple[str, ...], cross: CrossTerms) -> list[str]:
    """Say what denies a joint where only the diagonal of its compliance was fitted."""
    told = []
    for group in result.groups:
        beside = group.unknown_cross
        if beside is None:
            continue
        whose = _listed([dofs[d] for d in group.dofs])
        if cross != "ignore":
            told.append(f"no joint without cross terms is near the data of {whose}: its cross terms were ignored")
        if not beside.is_symmetric:
            told.append(
                f"the compliance between {whose} is not symmetric: the DOFs of both sides are not those of one point, "
                "or more than a joint connects them; its symmetry was not used"
            )
        if beside.scatter is not None:
            share = beside.scatter / np.maximum(group.x[: len(group.dofs)], np.finfo(float).tiny)
            varying = [f"{dofs[d]} by {100 * s:.0f} %" for d, s in zip(group.dofs, share, strict=True) if s > _VARIES]
            if varying:
                told.append(
                    f"the compliance varies from line to line beyond its noise: {_listed(varying)}; "
                    "its mean was fitted, weighted by what the lines show"
                )
    return told


def _band_part_warnings(found: ManifoldFit) -> list[str]:
    """Name parameters on which parts of the band do not agree, each fitted by itself."""
    parts = found.parts
    if parts is None or found.cross_fits:
        return []
    told = []
    for one, values, disagree in zip(found.estimate.parameters, parts.values.T, parts.disagree, strict=True):
        if disagree:
            seen = [
                f"{value:.3g} at {low:g}-{high:g} Hz"
                for value, (low, high) in zip(values, parts.spans, strict=True)
                if np.isfinite(value)
            ]
            told.append(
                f"{one.name}: parts of the band, fitted by themselves, do not agree: {_listed(seen)}; the interval "
                "allows for that, but the joint as described does not fit the data"
            )
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


def _misfit_warnings(found: ManifoldFit, problem: FitProblem) -> list[str]:
    """Say whether the residual differs from the noise, and how."""
    misfit, told = found.test, []
    apart = f"{abs(misfit.ratio - 1) / misfit.sigma:.0f} sigma"
    if not problem.noise.is_assumed and misfit.is_large:
        text = f"the residual is {misfit.ratio:.2f} times the noise, {apart} above it: the joint does not fit the data"
        by_part = problem.noise.is_given and abs(misfit.ratio / np.sqrt(2) - 1) < _BY_PART
        told.append(text + (_COUPLED if found.cross_fits else _PER_PART if by_part else places_of_excess(misfit)))
    if found.cross_fits:
        return told
    for trend in misfit.trends:
        low, high = trend.values.min(), trend.values.max()
        told.append(
            f"{trend.name} is not one constant over frequency: parts of the band give {low:.3g} .. {high:.3g} "
            f"(near {trend.centres[trend.values.argmin()]:.4g} and {trend.centres[trend.values.argmax()]:.4g} Hz)"
        )
    return told


def places_of_excess(misfit: ResidualTest) -> str:
    """Say where a residual that is too large is; nothing where it is everywhere."""
    if not misfit.local:
        return ""
    places = _listed([f"{low:g}-{high:g} Hz ({100 * share:.0f} %)" for low, high, share in misfit.local])
    return f"; the excess is local: {places}: bad lines, or local modes that the joint DOFs do not describe"


def _scatter_warnings(fit: JointFit, spread: Spread) -> list[str]:
    """Name parameters whose interval comes from the scatter between parts of the band."""
    if fit.noise_level < _ROUNDING:
        return []
    clear = _BY_CHANCE / len(fit.terms)
    wide = [one.name for one, chance in zip(fit.terms, spread.chance, strict=True) if chance < clear]
    if not wide:
        return []
    return [
        f"{_listed(wide)}: parts of the band scatter more than the noise explains; the intervals are widened by that"
    ]
