"""Findings of a fit for every likelihood, and the result that contains them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from jointfrf.dofs import Parameter, compliance_unit, parameters_shared
from jointfrf.frf.calibration import CalibrationErrors, SetUpErrors
from jointfrf.frf.moving_mass import MovingMass
from jointfrf.identification.elastic_centre import elastic_centre
from jointfrf.identification.fit_data import ModelData
from jointfrf.identification.joint_alone import with_joint_alone
from jointfrf.identification.manifold.coordinates import CrossTerms
from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.identification.manifold.fit import DofDamping, ManifoldFit
from jointfrf.identification.manifold.prepare import FitProblem, shown_percent
from jointfrf.identification.manifold.transforms import Transforms
from jointfrf.identification.model.fit import GAIN, FoundModel, OpenDirection, common_gain
from jointfrf.identification.model.joint_motion import FoundMotion
from jointfrf.identification.model.next_channels import NextChannels
from jointfrf.identification.model.prepare import Channels
from jointfrf.identification.parameters import joint_vector
from jointfrf.identification.residual_test import ResidualTest
from jointfrf.identification.result import Fit, FittedParameter, law_parameters
from jointfrf.kernel.arguments import FloatArray
from jointfrf.laws.law_joint import LawJoint
from jointfrf.messages.finding import Finding
from jointfrf.messages.message import Severity

__all__ = ["describe_laws", "describe_model", "describe_springs", "poor_laws"]

#: Width of an interval, as a share of the value on either side, above which a parameter is poorly determined.
_UNCERTAIN = 0.5
#: Relative standard error below which a parameter is not poorly determined, so that its interval need not be computed.
_WELL = 0.1
#: Correlation above which findings name a pair: an error of one is then mostly an error of the other.
_CORRELATED = 0.95
#: Number of pairs, bands and channels that findings name.
_SHOWN = 4
#: Probability below which findings name a scatter of parts of the band; above, it only widens intervals.
_BY_CHANCE = 1e-3
#: Relative noise below this is rounding.
_ROUNDING = 1e-7
#: Width of an interval, as a share of the value on either side, above which findings say how to narrow it.
_FLEXIBLE = 0.05
#: Number of standard errors below which a compliance may be zero.
_NEARLY_OPEN = 4.0
#: Causes of a wide interval, and the remedy of each.
_CURES = (
    ("sides", "give models of the sides (--side-j, --side-k; sides=), or measure nearer to the joint"),
    ("inertia", "give models of the sides (--side-j, --side-k; sides=), or measure at lower frequencies"),
    ("noise", "take more averages, impacts or lines"),
)
#: Ratio of the largest coupling, after to before, below which a reference point is proposed.
_LESS = 0.5
#: Relative deviation from the mean above which FRFs of a set-up are in doubt: calibration errors are smaller, and
#: coverage falls if resonances have moved so far (docs/accuracy.md).
_USUAL_GAIN = 0.05
#: Degrees of freedom of a scatter of set-ups below which Student's t widens intervals by more than a half.
_FEW_SETUPS = 3
#: Share of lines that cannot fit the joint above which a warning is issued.
_UNTRUSTED = 0.02
#: Relative variation of a compliance between lines above which a warning is issued.
_VARIES = 0.05
#: Relative distance of the residual from sqrt(2) times the given noise within which the noise was given for each part.
_BY_PART = 0.03
#: Correlation of neighbouring lines above which they have noticeably less information than independent ones.
_INFLATED = 1.2
#: Ratio of posterior to prior standard deviation above which findings name a prior: the FRFs hardly narrow it.
_UNCHANGED = 0.9
#: Gain of -2 log evidence above which model errors are significant: 1 of 80 fits of right models exceeds it by chance,
#: as half of chi-squared of one degree does, because a level cannot be negative.
_CLEAR_GAIN = 5.0
#: Difference of -2 log likelihood below which findings name another minimum: odds of 1 to 150.
_OTHER = 10.0


# ---------------------------------------------------------------- springs and dampers, FRFs between all joint DOFs


def describe_springs(found: ManifoldFit, problem: FitProblem) -> Fit:
    """Return the result of a fit of springs and dampers."""
    result, same = found.estimate, problem.options.same
    names, shared = _at_all_points([one.name for one in result.parameters], same, problem.dofs)
    fit = Fit.of_springs(
        "compliance",
        problem.dofs,
        dict(zip(names, result.theta[shared].tolist(), strict=True)),
        found.known.covariance[shared[:, None], shared],
        found.noise_level,
        found.residual_level,
        problem.freq_hz,
        k_lines=problem.frfs.line_stiffness(),
        bands=problem.bands,
        residual_is_noise=found.test.is_noise,
        test=found.test,
        is_converged=result.converged,
        intervals=found.intervals.shared(names, shared) if same else found.intervals,
    )
    fit = _with_best_estimates(fit, result) if found.alone is None else with_joint_alone(fit, found.alone)
    intervals = fit.confidence_interval(0.95)
    findings = [
        *([] if found.cross_fits else _left_out_lines(result, fit.dofs, found.test)),
        *_left_out_dofs(problem),
        *_band_parts(found),
        *_poor_springs(fit, intervals),
        *_misfit(found, problem),
        *_unknown_cross(result, fit.dofs, problem.options.cross),
        *([] if found.alone is not None else _scattering(fit, found.known.spread.chance[shared])),
        *_negative_damping(fit, intervals),
        *_choices(found.choices),
        *_noise(problem.noise.is_assumed, problem.noise.inflation, problem.freq_hz),
        *_calibration(problem.noise.calibration),
        *_moving_mass(problem.noise.mass),
        *_outlying_lines(problem),
        *_small_residual(found, problem),
        *_sides(problem),
        *_between_points(fit, intervals),
        *_groups([group.dofs for group in result.groups], fit.dofs, problem.options.cross),
        *_equal_points(same),
        *_hidden_lines(result, fit.dofs),
        *_insignificant(fit, intervals),
        *_reference_point(fit),
    ]
    if not result.converged:
        most = max(group.iterations for group in result.groups)
        findings.append(Finding("not-converged", {"iterations": most}, variant="iterations"))
    return fit.with_findings(findings)


def _at_all_points(
    names: Sequence[str], same: Sequence[Sequence[str]], dofs: Sequence[str]
) -> tuple[list[str], NDArray[np.intp]]:
    """Return the names of springs at all points, and which of those fitted each is."""
    points = {own[0]: own for own in same}
    found: dict[str, int] = {}
    for i, name in enumerate(names):
        point, _, rest = name.rpartition(".")
        found |= {f"{own}.{rest}": i for own in points[point]} if point in points else {name: i}

    def place(name: str) -> tuple[int, bool, int, int]:
        one = Parameter.parse(name)
        return "khc".index(one.kind), one.is_cross, dofs.index(one.row), dofs.index(one.column)

    ordered = sorted(found, key=place) if same else list(found)
    return ordered, np.array([found[name] for name in ordered], np.intp)


def _equal_points(same: Sequence[Sequence[str]]) -> list[Finding]:
    """Name the points that share their parameters."""
    return [Finding("equal-points", about=tuple(own)) for own in same]


def _poor_springs(fit: Fit, intervals: dict[str, tuple[float, float]]) -> list[Finding]:
    """Name stiffnesses that the data determine poorly or not at all."""
    found = []
    for one in fit.parameters:
        low, high = intervals[one.name]
        if one.kind != "k" or one.is_cross:
            continue
        if not np.isfinite(high):
            found.append(_unbounded(one, low, fit.value[one.name]))
        elif not low > 0:
            found.append(_maybe_zero(one, high))
        elif high - low > 2 * _UNCERTAIN * abs(fit.value[one.name]):
            found.append(_poor(one, low, high))
    return found


def _unbounded(one: FittedParameter, low: float, value: float) -> Finding:
    numbers = {"parameter": str(one), "low": low, "unit": one.unit, "value": value}
    return Finding("stiffness-unbounded", numbers, (one.name,), variant="" if low > 0 else "no-bound")


def _maybe_zero(one: FittedParameter, high: float) -> Finding:
    return Finding("stiffness-zero", {"parameter": str(one), "high": high, "unit": one.unit}, (one.name,))


def _poor(one: FittedParameter, low: float, high: float) -> Finding:
    numbers = {"parameter": str(one), "low": low, "high": high, "unit": one.unit}
    return Finding("poorly-determined", numbers, (one.name,))


def _negative_damping(fit: Fit, intervals: dict[str, tuple[float, float]]) -> list[Finding]:
    """Name damping that is significantly negative: a joint supplies no energy."""
    return [
        Finding(
            "damping-negative", {"parameter": str(one), "value": fit.value[one.name], "unit": one.unit}, (one.name,)
        )
        for one in fit.parameters
        if one.kind != "k" and not one.is_cross and intervals[one.name][1] < 0
    ]


def _insignificant(fit: Fit, intervals: dict[str, tuple[float, float]]) -> list[Finding]:
    """Name damping and cross terms whose sign is not known."""
    names = tuple(
        one.name for one in fit.parameters if one.kind != "k" and intervals[one.name][0] < 0 < intervals[one.name][1]
    )
    return [Finding("damping-insignificant", about=names)] if names else []


def _groups(groups: Sequence[NDArray[np.intp]], dofs: tuple[str, ...], cross: CrossTerms) -> list[Finding]:
    """Name groups of DOFs between which the FRFs are zero."""
    if len(groups) < 2:
        return []
    names = " and ".join(f"({_named(group, dofs)})" for group in groups)
    return [Finding("separate-groups", {"groups": names}, dofs, variant="cross" if cross == "fit" else "")]


def _named(group: NDArray[np.intp], dofs: tuple[str, ...]) -> str:
    return ", ".join(dofs[d] for d in group)


def _choices(choices: Sequence[DofDamping]) -> list[Finding]:
    """Name the damping terms that were chosen for each DOF, and how clear the choice is."""
    found = []
    for one in choices:
        if one.others:
            kinds = [one.best, *(kind for kind, _ in one.others)]
            shares = [1 - sum(share for _, share in one.others), *(share for _, share in one.others)]
            odds = ", ".join(f"{kind} {100 * share:.2g} %" for kind, share in zip(kinds, shares, strict=True))
            found.append(Finding("damping-averaged", {"dof": one.dof, "odds": odds}, (one.dof,)))
            continue
        strength = "clearly" if one.margin > 10 else "weakly" if one.margin > 2 else "hardly"
        numbers = {"dof": one.dof, "best": one.best, "strength": strength, "second": one.second, "margin": one.margin}
        found.append(Finding("damping-chosen", numbers, (one.dof,)))
    return found


def _reference_point(fit: Fit) -> list[Finding]:
    """Propose the reference point at which the stiffness is most nearly diagonal."""
    try:
        centre = elastic_centre(fit) if any(one.is_cross for one in fit.parameters) else None
    except ValueError:
        # DOF names without a direction, or a stiffness that is not positive: there is no proposal.
        centre = None
    if centre is None or centre.coupling > _LESS * centre.coupling_before:
        return []
    where = ", ".join(
        f"{axis} {1e3 * r:+.3g} +- {1e3 * error:.2g} mm"
        for axis, r, error in zip("xyz", centre.offset, centre.std_error, strict=True)
        if np.isfinite(error)
    )
    numbers = {"offset": where, "before": centre.coupling_before, "after": centre.coupling}
    return [Finding("reference-point-offset", numbers)]


def _sides(problem: FitProblem) -> list[Finding]:
    """State the information on flexible sides between channels and joint."""
    frfs, added = problem.frfs, problem.added_compliance
    if problem.model_errors is not None:
        return [Finding("sides-corrected", {"errors": len(problem.model_errors)})]
    if Transforms(frfs.responses, frfs.forces).are_units or problem.bending is not None:
        return []
    if added is None or not added.any():
        return [Finding("sides-unchecked")]
    known = [(dof, value) for dof, value in zip(problem.dofs, added, strict=True) if value > 0]
    values = ", ".join(f"{value:.2g} {compliance_unit(dof, dof)} for {dof}" for dof, value in known)
    return [Finding("sides-flexible", {"values": values}, tuple(dof for dof, _ in known))]


def _between_points(fit: Fit, intervals: dict[str, tuple[float, float]]) -> list[Finding]:
    """Explain numbers between virtual points on sides that may be flexible, and how to narrow the intervals."""
    if not fit.seen:
        return []
    found = [Finding("sides-removed")]
    for part, cure in _CURES:
        names = tuple(
            name
            for name, one in fit.seen.items()
            if getattr(one, part) == max(one.sides, one.inertia, one.noise) and _is_wide(*intervals[name])
        )
        if names:
            found.append(Finding("interval-cause", {"cure": cure}, names))
    return found


def _is_wide(low: float, high: float) -> bool:
    """Return whether an interval should be narrowed."""
    return not high < (1 + _FLEXIBLE) / (1 - _FLEXIBLE) * low


def _with_best_estimates(fit: Fit, result: JointEstimate) -> Fit:
    """Return the fit with a best estimate of each stiffness that may be infinite: by the median of 1/k >= 0.

    Its error follows from the lower limit, by profile if noise is not normal in 1/k: the median is above the limit.
    """
    estimate, intervals = fit.estimate.copy(), None
    for group in result.groups:
        if not group.joint.in_compliance:
            continue
        error = np.sqrt(np.maximum(np.diagonal(group.covariance), 0))
        for i in np.flatnonzero(group.joint.is_compliance & (group.x < _NEARLY_OPEN * error)):
            which = int(group.which[i])
            intervals = fit.confidence_interval(0.95) if intervals is None else intervals
            low, high = intervals[fit.parameters[which].name]
            spring = float(group.joint.springs[group.joint.dofs[i]])
            own = (1 / (low + spring) - group.x[i]) / float(ndtri(0.975)) if low > 0 else error[i]
            if np.isfinite(high) or not own > 0:
                continue
            z = float(group.x[i] / own)
            estimate[which] = 1 / (own * (z + float(ndtri(1 - 0.5 * ndtr(z))))) - spring
    return replace(fit, estimate=estimate)


def _hidden_lines(result: JointEstimate, dofs: tuple[str, ...]) -> list[Finding]:
    """Count the lines on which noise hides the transmission of the joint, where its cross terms are unknown."""
    found = []
    for group in result.groups:
        beside, total = group.unknown_cross, group.used.size
        if beside is not None and beside.hidden > _UNTRUSTED * total:
            about = tuple(dofs[d] for d in group.dofs)
            found.append(Finding("lines-hidden", {"hidden": int(beside.hidden), "total": total}, about))
    return found


def _unknown_cross(result: JointEstimate, dofs: tuple[str, ...], cross: CrossTerms) -> list[Finding]:
    """Name contradictions to a joint of which only the diagonal of the compliance was fitted."""
    found = []
    for group in result.groups:
        beside = group.unknown_cross
        if beside is None:
            continue
        about = tuple(dofs[d] for d in group.dofs)
        if cross != "ignore":
            found.append(Finding("cross-terms-ignored", about=about))
        if not beside.is_symmetric:
            found.append(Finding("compliance-unsymmetric", about=about))
        if beside.scatter is not None:
            share = beside.scatter / np.maximum(group.x[: len(group.dofs)], 0.05 * beside.scatter)
            varying = [
                f"{dofs[d]} by {shown_percent(s)}" for d, s in zip(group.dofs, share, strict=True) if s > _VARIES
            ]
            found += [Finding("compliance-scatter", {"varying": tuple(varying)}, about)] if varying else []
    return found


def _band_parts(found: ManifoldFit) -> list[Finding]:
    """Name parameters on which separate fits of parts of the band disagree."""
    parts, findings = found.parts, list[Finding]()
    if parts is None or found.cross_fits:
        return []
    names = [one.name for one in found.estimate.parameters]
    for name, values, disagree in zip(names, parts.values.T, parts.disagree, strict=True):
        if disagree:
            seen = ", ".join(
                f"{value:.3g} at {low:g}-{high:g} Hz"
                for value, (low, high) in zip(values, parts.spans, strict=True)
                if np.isfinite(value)
            )
            numbers = {"parameter": name, "values": seen}
            findings.append(Finding("band-parts-differ", numbers, (name,), tuple(parts.spans)))
    return findings


def _scattering(fit: Fit, chances: FloatArray) -> list[Finding]:
    """Name parameters whose interval comes from the scatter between parts of the band."""
    if fit.noise_level < _ROUNDING:
        return []
    clear = _BY_CHANCE / len(fit.parameters)
    wide = tuple(one.name for one, chance in zip(fit.parameters, chances, strict=True) if chance < clear)
    return [Finding("band-scatter", about=wide)] if wide else []


def _misfit(found: ManifoldFit, problem: FitProblem) -> list[Finding]:
    """State whether the residual differs from the noise, and how."""
    misfit, noise = found.test, problem.noise
    by_part = noise.is_given and abs(misfit.ratio / np.sqrt(2) - 1) < _BY_PART
    why = "coupled" if found.cross_fits else "per-part" if by_part else ""
    # A fit that ignored cross terms has a separate finding.
    is_told = found.cross_fits and any(group.unknown_cross is not None for group in found.estimate.groups)
    findings = [] if noise.is_assumed or is_told else _too_large(misfit, why)
    # Intervals of the joint alone cover the change over frequency by the inertia of sides.
    for trend in () if found.cross_fits or found.alone is not None else misfit.trends:
        low, high = trend.values.argmin(), trend.values.argmax()
        numbers = {
            "parameter": trend.name, "first": float(trend.values[low]), "first_hz": float(trend.centres[low]),
            "last": float(trend.values[high]), "last_hz": float(trend.centres[high]),
        }  # fmt: skip
        findings.append(Finding("frequency-dependent", numbers, (trend.name,)))
    return findings


def _small_residual(found: ManifoldFit, problem: FitProblem) -> list[Finding]:
    """Report a residual below the noise: intervals are then wider than necessary."""
    misfit, noise = found.test, problem.noise
    # Non-rigid motion of the channels counts as noise, but averages out of a residual of joint DOFs. Common errors of
    # set-ups do not always leave a residual: equal gains of all forces of a side change the joint.
    of_setups = noise.calibration is not None and noise.calibration.setups is not None
    if noise.is_assumed or problem.sides_bend or of_setups or not misfit.is_small:
        return []
    variant = "" if not noise.is_given else "mean" if problem.frfs.symmetrised else "given"
    return [Finding("residual-small", {"ratio": misfit.ratio}, variant=variant)]


# ---------------------------------------------------------------- laws, FRFs between all joint DOFs


def describe_laws(found: ManifoldFit, joint: LawJoint) -> Fit:
    """Return the result of a fit of laws to FRFs between all joint DOFs."""
    problem, result, same = found.problem, found.estimate, found.problem.options.same
    shared = parameters_shared(joint.names, same)
    intervals = found.intervals.shared(joint.names, shared) if same else found.intervals
    fit = Fit(
        method="compliance",
        dofs=problem.dofs,
        parameters=law_parameters(joint),
        estimate=result.theta[shared],
        covariance=found.known.covariance[shared[:, None], shared],
        noise_level=found.noise_level,
        residual_level=found.residual_level,
        freq_hz=problem.freq_hz,
        laws=joint.with_values(result.theta[shared]),
        k_lines=problem.frfs.line_stiffness(),
        bands=problem.bands,
        residual_is_noise=found.test.is_noise,
        test=found.test,
        is_converged=result.converged,
        intervals=intervals,
    )
    is_log = {one.name: one.is_log for one in joint_vector(joint, (), np.ones(len(joint.dofs))).all}
    findings = [
        *_left_out_lines(result, problem.dofs, found.test),
        *_left_out_dofs(problem),
        *poor_laws(fit, is_log, lambda name: intervals.of(name, 0.95)),
        *([] if problem.noise.is_assumed else _too_large(found.test, "laws")),
        *_law_trends(found.test),
        *_noise(problem.noise.is_assumed, problem.noise.inflation, problem.freq_hz),
        *_calibration(problem.noise.calibration),
        *_moving_mass(problem.noise.mass),
        *_outlying_lines(problem),
        *_correlated(fit),
        *_equal_points(same),
    ]
    if problem.added_compliance is not None or problem.bending is not None:
        findings.append(Finding("sides-not-covered"))
    if not result.converged:
        findings.append(Finding("not-converged"))
    return fit.with_findings(findings)


def _law_trends(misfit: ResidualTest) -> list[Finding]:
    """Name parameters of laws that are not constant over frequency."""
    found = []
    for trend in misfit.trends:
        numbers = {"parameter": trend.name, "first": float(trend.values.min()), "last": float(trend.values.max())}
        found.append(Finding("frequency-dependent", numbers, (trend.name,), variant="laws"))
    return found


# ---------------------------------------------------------------- an assembly, any FRFs


def describe_model(found: FoundModel, channels: Channels) -> Fit:
    """Return the result of a fit of an assembly."""
    problem, vector, test = found.problem, found.problem.vector, found.test
    whole = problem.prediction.whole
    shown = np.isfinite(problem.variance)
    size = abs(np.where(shown, found.predicted, 1))
    level = float(np.median((np.sqrt(np.where(shown, problem.variance, 0)) / np.maximum(size, 1e-300))[shown]))
    joint = whole.joint.with_values(found.values[vector.places_of("joint")])
    of_joint = dict(zip(joint.names, law_parameters(joint), strict=True))
    parameters = tuple(
        of_joint[one.name]
        if one.origin == "joint"
        else FittedParameter(
            one.name, one.unit, origin=str(one.place[0]) if one.origin == "part" else one.origin,
            prior=None if one.std is None else (one.value, one.std),
        )
        for one in vector.fitted
    )  # fmt: skip
    fit = Fit(
        method="model",
        dofs=joint.dofs,
        parameters=parameters,
        estimate=found.values[vector.free],
        covariance=found.covariance,
        noise_level=level,
        residual_level=level * test.ratio,
        freq_hz=problem.freq_hz,
        laws=joint,
        same=tuple(one for one in whole.same if one[0] in whole.joints),
        responses=channels.responses,
        forces=channels.forces,
        residual_is_noise=test.is_noise,
        test=test,
        is_converged=found.minimum.converged,
        intervals=found.intervals,
        data=ModelData(
            whole, problem.measured, problem.variance, found.predicted, found.residual, found.directions,
            NextChannels(found), FoundMotion(found, partial(describe_model, channels=channels)),
        ),
    )  # fmt: skip
    is_log = {one.name: one.is_log for one in vector.fitted}
    said = [name for one in found.unseparated for name in one.names]
    findings = _model_residual(fit, found, channels)
    if not found.has_failed:
        findings += [
            *_model_error(found),
            *_model_gains(found, channels),
            *_model_parts(found),
            *poor_laws(fit, is_log, lambda name: found.intervals.of(name, 0.95)),
            *_directions(found.directions, said),
            *_separation(found),
            *_groups_of_joints(found),
            *_other_minimum(found.other),
            *_priors(fit, found.directions, said),
            *_correlated(fit),
            *([] if found.minimum.converged else [Finding("not-converged")]),
        ]
    findings += [
        *_noise(problem.noise.is_assumed, problem.noise.inflation, problem.freq_hz),
        *_calibration(problem.noise.calibration),
        *_moving_mass(problem.noise.mass),
    ]
    return fit.with_findings(findings)


def _model_residual(fit: Fit, found: FoundModel, channels: Channels) -> list[Finding]:
    """Report that the model does not fit, with frequencies and channels."""
    test, findings = found.test, []
    if test.is_noise:
        return []
    bands = tuple((low, high) for low, high, _ in test.bands)
    parts, about = list[str](), list[str]()
    if test.bands:
        where = (f"{low:g}-{high:g} Hz ({ratio:.3g})" for low, high, ratio in test.bands[:_SHOWN])
        parts.append("most at " + ", ".join(where))
    for names, own, what in (
        (channels.responses, test.responses, "responses"), (channels.forces, test.forces, "forces"),
    ):  # fmt: skip
        if own:
            parts.append(f"in the {what} " + ", ".join(f"{names[i]} ({ratio:.3g})" for i, ratio in own[:_SHOWN]))
            about += [names[i] for i, _ in own]
    if np.isfinite(test.neighbours) and test.neighbours > 5:
        parts.append("smooth over frequency, as no noise is")
    if test.is_large or test.bands or test.responses or test.forces or test.neighbours > 4:
        is_uncovered = found.error is None or found.test_with_error.is_large
        numbers = {"ratio": test.ratio, "where": ", ".join(parts) or "everywhere"}
        variant = "model-failed" if found.has_failed else "model-uncovered" if is_uncovered else "model"
        findings.append(Finding("residual-large", numbers, tuple(about), bands, variant=variant))
    if test.pulls and not found.has_failed:
        denied = [(fit.parameters[i].name, pull) for i, pull in test.pulls]
        pulls = tuple(f"{name} {pull:+.1f}" for name, pull in denied)
        findings.append(Finding("prior-contradicted", {"pulls": pulls}, tuple(name for name, _ in denied)))
    return findings


def _model_error(found: FoundModel) -> list[Finding]:
    """Name the errors of models, and of a gain of all FRFs, that the intervals cover."""
    if found.error is None:
        return []
    own, left = found.error.model, found.test_with_error
    if found.error.noise > 1 or found.error.shapes.level > 0:
        numbers = {"level": own.level, "shapes": found.error.shapes.level, "noise": found.error.noise}
        return [Finding("model-error", numbers, severity="warning", variant="far")]
    level, common = own.level, found.error.gains.get("common-error")
    if level == 0:
        believed = [side.part.error_level for side in found.problem.prediction.sides]
        largest = float(own.of(believed).max()) if own.largest > 0 else 0.0
        gain = 0.0 if common is None else float(common.of(common_gain(found.problem)))
        variant = "given" if not gain else "gain" if not largest else "both"
        return [Finding("model-error", {"level": largest, "gain": gain}, variant=variant)] if largest or gain else []
    is_clear = own.gain > _CLEAR_GAIN or not found.test.is_noise
    severity: Severity = "warning" if is_clear and found.error_matters else "note"
    if left.is_large:
        return [Finding("model-error", {"level": level, "ratio": left.ratio}, severity=severity, variant="large")]
    return [Finding("model-error", {"level": level}, severity=severity)]


def _model_gains(found: FoundModel, channels: Channels) -> list[Finding]:
    """Name the gains that the FRFs contradict, the largest deviation first."""
    named = {"response-error": ("response", channels.responses), "force-error": ("force", channels.forces)}
    gains, about = list[str](), list[str]()
    for one in sorted(found.gains, key=lambda gain: -abs(gain.value - 1))[:_SHOWN]:
        what, names = named.get(one.origin, ("", ()))
        if names:
            about.append(names[one.channel])
        who = f"{what} {names[one.channel]}" if names else "all FRFs"
        gains.append(f"{who} {one.value:.4g} +- {one.std:.1g}")
    if not gains or found.test_with_error.is_large:  # if the models do not fit, their gains mean nothing
        return []
    # Usual errors of sensors and hammers are no reason to doubt the fit.
    is_unusual = max(abs(one.value - 1) for one in found.gains) > float(ndtri(0.975)) * GAIN
    severity: Severity = "warning" if found.error_matters and is_unusual else "note"
    return [Finding("model-gain", {"gains": tuple(gains)}, tuple(about), severity=severity)]


def _model_parts(found: FoundModel) -> list[Finding]:
    """Name parameters of the joint on which parts of the band do not agree."""
    parts, findings, vector = found.parts, list[Finding](), found.problem.vector
    for i in np.flatnonzero(parts.factor > 1):
        if vector.fitted[i].origin != "joint":
            continue
        name, x, values = vector.fitted[i].name, found.minimum.x[: vector.free.size], list[str]()
        for step, (low, high) in zip(parts.steps, parts.spans, strict=True):
            if np.isfinite(step[i]):
                there = vector.value(int(i), x + np.nan_to_num(step))
                values.append(f"{there:.3g} at {low:.4g}-{high:.4g} Hz")
        one, other = (f"{parts.spans[k][0]:.4g}-{parts.spans[k][1]:.4g} Hz" for k in parts.apart[i])
        numbers = {"parameter": name, "values": ", ".join(values), "one": one, "other": other}
        findings.append(Finding("band-parts-differ", numbers, (name,), parts.spans, variant="pair"))
    return findings


def _separation(found: FoundModel) -> list[Finding]:
    """Name joints that the FRFs do not separate, and which combinations of their parameters are known."""
    value = dict(zip([one.name for one in found.problem.vector.all], found.values, strict=False))
    findings = []
    for one in found.unseparated:
        joints = list(dict.fromkeys(name.rpartition(".")[0] for name in one.names))
        sums = []
        for weights, std in one.known[:_SHOWN]:
            terms = [
                f"{'-' if weight < 0 else '+'} {_coefficient(abs(weight))}{name}"
                for weight, name in zip(weights, one.names, strict=True)
                if abs(weight * value[name])
                > 0.1 * max(abs(w * value[n]) for w, n in zip(weights, one.names, strict=True))
            ]
            total = sum(weight * value[name] for weight, name in zip(weights, one.names, strict=True))
            sums.append(f"{' '.join(terms).removeprefix('+ ')} = {total:.4g} +- {std:.2g}")
        numbers = {"joints": tuple(joints), "sums": "; ".join(sums)}
        variant = "-".join(word for word, is_so in (("prior", one.is_held_by_prior), ("known", sums)) if is_so)
        severity: Severity = "note" if one.is_held_by_prior else "warning"
        findings.append(Finding("joints-not-separated", numbers, one.names, severity=severity, variant=variant))
    return findings


def _coefficient(weight: float) -> str:
    return "" if abs(weight - 1) < 5e-3 else f"{weight:.3g} "


def _groups_of_joints(found: FoundModel) -> list[Finding]:
    """Name joints that are equal, and the scatter of similar joints."""
    vector, whole = found.problem.vector, found.problem.prediction.whole
    said = [Finding("equal-points", about=tuple(own)) for own in whole.same]
    for one in vector.means:
        mean = vector.all[one.mean]
        std = one.std if mean.is_log else one.std / max(abs(found.values[one.mean]), np.finfo(float).tiny)
        numbers = {"parameter": mean.name, "spread": std, "joints": len(one.members)}
        about = (mean.name, *(vector.all[i].name for i in one.members))
        said.append(Finding("joint-spread", numbers, about, variant="" if one.relative is None else "given"))
    return said


def _directions(directions: Sequence[OpenDirection], said: Collection[str] = ()) -> list[Finding]:
    """Name directions that the FRFs do not determine, unless a prior does or another finding names them."""
    return [
        Finding("direction-undetermined", {"direction": _direction(one)}, tuple(name for name, _ in one.parts))
        for one in directions
        if not one.is_held_by_prior and not {name for name, _ in one.parts} <= set(said)
    ]  # fmt: skip


def _direction(one: OpenDirection) -> str:
    parts = ", ".join(f"{name} {100 * change:+.2g} %" for name, change in one.parts[:_SHOWN])
    return one.parts[0][0] if len(one.parts) == 1 else parts


def _other_minimum(other: float) -> list[Finding]:
    return [Finding("second-minimum", {"difference": float(other)})] if other < _OTHER else []


def _priors(fit: Fit, directions: Sequence[OpenDirection], said: Collection[str]) -> list[Finding]:
    """Name unknowns and directions that only their priors determine."""
    errors = fit.std_error
    same = tuple(
        one.name for one in fit.parameters if one.prior is not None and errors[one.name] > _UNCHANGED * one.prior[1]
    )
    found = [Finding("prior-unchanged", about=same)] if same else []
    held = [
        one for one in directions
        if one.is_held_by_prior and len(one.parts) > 1 and not {name for name, _ in one.parts} <= set(said)
    ]  # fmt: skip
    return found + [
        Finding("prior-decides", {"direction": _direction(one)}, tuple(name for name, _ in one.parts))
        for one in held[:_SHOWN]
    ]


# ---------------------------------------------------------------- of several likelihoods


def poor_laws(fit: Fit, is_log: dict[str, bool], limits: Callable[[str], tuple[float, float]]) -> list[Finding]:
    """Name positive parameters of laws that the data determine poorly or not at all; `limits` gives 95 % intervals."""
    found, errors = [], fit.std_error
    for one in fit.parameters:
        value = fit.value[one.name]
        if one.origin != "joint" or not is_log[one.name] or one.unit == "s" or errors[one.name] < _WELL * value:
            continue
        low, high = limits(one.name)
        if not high < float("inf"):
            found.append(_unbounded(one, low, value))
        elif not low > 0:
            found.append(_maybe_zero(one, high))
        elif high - low > 2 * _UNCERTAIN * abs(value):
            found.append(_poor(one, low, high))
    return found


def _correlated(fit: Fit) -> list[Finding]:
    """Name pairs of parameters whose errors are nearly one."""
    rho, parameters = fit.correlation, fit.parameters
    pairs = sorted(
        ((abs(rho[i, j]), i, j) for j in range(len(parameters)) for i in range(j) if abs(rho[i, j]) > _CORRELATED),
        reverse=True,
    )[:_SHOWN]
    texts = tuple(f"{parameters[i]} and {parameters[j]} ({rho[i, j]:+.3f})" for _, i, j in pairs)
    about = tuple(dict.fromkeys(parameters[k].name for _, i, j in pairs for k in (i, j)))
    return [Finding("correlated-parameters", {"pairs": texts}, about)] if pairs else []


def _noise(is_assumed: bool, inflation: float, freq_hz: FloatArray) -> list[Finding]:
    """State the origin of the noise, and whether lines share it."""
    found = []
    if is_assumed:
        found.append(Finding("noise-from-residual"))
    if inflation > _INFLATED:
        numbers = {"lines": freq_hz.size, "independent": freq_hz.size / inflation}
        found.append(Finding("correlated-lines", numbers))
    return found


def _moving_mass(mass: MovingMass | None) -> list[Finding]:
    """Return the mass of a sensor that was removed: given, or estimated."""
    if mass is None:
        return []
    where = "excitation" if mass.with_force else "response"
    if mass.shown is not None:
        numbers = {"mass": mass.mass, "where": where, "shown": mass.shown}
        return [Finding("moving-mass", numbers, variant="contradicted")]
    if mass.std_error == 0:
        return [Finding("moving-mass", {"mass": mass.mass, "where": where}, severity="note", variant="given")]
    return [Finding("moving-mass", {"mass": abs(mass.mass), "error": mass.std_error, "where": where})]


def _calibration(errors: CalibrationErrors | None) -> list[Finding]:
    """State how far h_pq and h_qp differ smoothly, and the errors that intervals cover."""
    if errors is None:
        return []
    found, parts = [] if errors.setups is None else _setups(errors.setups), []
    for level, what in ((errors.level("channel"), "of channels"), (errors.level("own"), "of single FRFs")):
        sizes = (f"{100 * level[0]:.2g} % in gain", f"{level[1]:.2g} rad in phase")
        shown = [size for size, value in zip(sizes, level, strict=True) if value > 0]
        parts += [f"{what} by {' and '.join(shown)}"] if shown else []
    if not parts:
        return found
    numbers = {"sizes": ", ".join(parts)} | ({"resonance": errors.resonance()} if errors.resonant else {})
    return [*found, Finding("calibration-errors", numbers, variant="resonant" if errors.resonant else "")]


def _setups(errors: SetUpErrors) -> list[Finding]:
    """Name set-ups that disagree, and the errors that intervals cover."""
    found = []
    for one in errors.deviations:
        size, error, variant = one.size, one.error, one.part
        if one.part not in ("resonances", "gain"):
            is_late = np.isfinite(one.delay)
            variant = "delay" if is_late else "phase"
            size, error = (1e6 * one.delay, 1e6 * abs(error / size * one.delay)) if is_late else (size, error)
        severity: Severity = "warning" if one.change > _USUAL_GAIN or errors.exceeds else "note"
        numbers = {"size": float(size), "error": float(error)}
        found.append(Finding("set-up-deviation", numbers, (one.name,), (one.band,), severity, variant))
    gain, phase = np.sqrt(errors.variance.sum(axis=1)).tolist()
    numbers = {"gain": gain, "phase": phase}
    if errors.exceeds:
        found.append(Finding("set-up-scatter", numbers, severity="warning", variant="exceeds"))
    elif gain or phase:
        is_few = errors.setups.gain is None and 0 < errors.degrees[0, 0] <= _FEW_SETUPS
        variant = "given" if errors.setups.gain is not None else "few" if is_few else ""
        found.append(Finding("set-up-scatter", numbers, variant=variant))
    if errors.common:
        found.append(Finding("set-up-scatter", {"common": float(np.sqrt(errors.common))}, variant="common"))
    return found


def _outlying_lines(problem: FitProblem) -> list[Finding]:
    """Name lines with far more noise than others."""
    lines = problem.noise.outlying
    if not lines.size:
        return []
    return [Finding("noisy-lines", {"lines": tuple(f"{problem.freq_hz[i]:g}" for i in lines)})]


def _left_out_dofs(problem: FitProblem) -> list[Finding]:
    """Name DOFs that were omitted but enter the result."""
    return [Finding("dof-left-out", {"reason": str(one)}, (one.dof,)) for one in problem.left_out if one.matters]


def _left_out_lines(result: JointEstimate, dofs: tuple[str, ...], test: ResidualTest) -> list[Finding]:
    """Count the lines that no joint near the estimate fits."""
    found = []
    for group in result.groups:
        if group.unknown_cross is not None:
            continue
        out, total = int(np.count_nonzero(~group.used)), group.used.size
        if out > _UNTRUSTED * total:
            numbers = {"rejected": out, "total": total, "whole": test.whole}
            about = tuple(dofs[d] for d in group.dofs)
            found.append(Finding("lines-rejected", numbers, about, variant="whole" if test.leaves_out else ""))
    return found


def _too_large(misfit: ResidualTest, why: str = "") -> list[Finding]:
    """Report that the residual exceeds the noise, by default with frequencies and channels."""
    if not misfit.is_large:
        return []
    bands = tuple((low, high) for low, high, _ in misfit.local)
    numbers: dict[str, object] = {"ratio": misfit.ratio, "sigma": abs(misfit.ratio - 1) / misfit.sigma}
    if why in ("", "laws") and misfit.local:
        numbers["places"] = ", ".join(f"{low:g}-{high:g} Hz ({100 * share:.0f} %)" for low, high, share in misfit.local)
        why = "local"
    return [Finding("residual-large", numbers, bands=bands, variant=why)]
