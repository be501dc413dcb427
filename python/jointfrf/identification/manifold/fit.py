"""From a prepared problem to numbers: the fit on the manifold, of springs with a choice of damping, or of laws."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import is_rotation, point_and_direction
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.noise_parts import line_correlation
from jointfrf.identification.manifold.band_parts import BandParts, fit_band_parts, left_out_share
from jointfrf.identification.manifold.coordinates import (
    CrossTerms,
    DampingTerms,
    JointTerms,
    coordinates_of,
    joint_terms,
)
from jointfrf.identification.manifold.estimate import (
    GroupData,
    GroupStart,
    JointEstimate,
    estimate_joint,
    estimate_laws,
)
from jointfrf.identification.manifold.flexible_sides import FittedCompliance, JointAlone, SideBending, joint_alone
from jointfrf.identification.manifold.group_fit import GroupFit
from jointfrf.identification.manifold.line_forms import LEAST_GAIN, FormMinimum
from jointfrf.identification.manifold.prepare import FitProblem, check_estimate
from jointfrf.identification.manifold.side_columns import fit_with_flexible_sides
from jointfrf.identification.manifold.uncertainty import (
    GroupUncertainty,
    JointUncertainty,
    joint_intervals,
    residual_test_of,
    uncertainty_of_joint,
)
from jointfrf.identification.manifold.unknown_cross import compliance_lines
from jointfrf.identification.profile import Intervals
from jointfrf.identification.residual_test import ResidualTest
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = [
    "MARGIN",
    "DofDamping",
    "ManifoldFit",
    "choose_damping",
    "estimated_joint",
    "fit_laws",
    "fit_springs",
    "uncertainty_of",
]

#: An assumed noise level is replaced by the level of the residual until both agree to this factor.
_AGREE = 1.3
_MOST_LEVELS = 6
#: Least residual, as a share of the noise, at which models are compared: below it is rounding.
_LEAST_EXCESS = 1e-12
#: Share of omitted lines above which parts of the band are compared.
_LEFT_OUT = 0.02
#: Number of lines below which parts are not compared, and each fit searches all initial values for several minima.
_FEW = 40
#: Standard deviations between the middle and the 97.5 % quantile of the flexibility of the sides.
_REACH = 1.96
#: Residual of FRFs without noise, in units of the assumed level.
_NO_NOISE = 1e-3


#: Damping terms that are compared.
_KINDS: tuple[DampingTerms, ...] = ("none", "viscous", "hysteretic", "both")


#: Decrease of BIC above which a second damping term is certain, odds of 20 to 1; of two kinds with one term, the worse
#: is excluded beyond it.
MARGIN = 6.0
#: Difference of BIC below which two terms are not excluded by one.
_HARDLY = 2.0
#: Excess of BIC, ten times a clear one, on about this many lines alone, above which terms need no separate fit: the
#: error of the quadratic forms, minimised until steps gain less than this, is smaller.
_EXCLUDED, _SOME_LINES, _COARSE = 100.0, 150, 0.1


class DofDamping(NamedTuple):
    """Damping terms of one DOF, chosen by the Bayesian information criterion (BIC).

    Attributes
    ----------
    dof : str
        Name of the DOF.
    best, second : str
        Best and second-best terms.
    margin : float
        BIC of the second minus BIC of the best: above 10 the choice is clear, below 2 the data hardly prefer one. It is
        negative if the second has one more term that the data do not support clearly.
    others : tuple of (str, float)
        Kinds of damping that the data do not exclude, and their probability: values are means over these and the best.
    """

    dof: str
    best: DampingTerms
    second: DampingTerms
    margin: float
    others: tuple[tuple[DampingTerms, float], ...] = ()

    @property
    def terms(self) -> DampingTerms:
        """Terms that are fitted, which are the terms of all kinds that are not excluded."""
        return "both" if self.others else self.best

    @classmethod
    def by_scores(cls, dof: str, scores: Mapping[DampingTerms, float]) -> DofDamping:
        """Choose by BIC: two terms must be more likely than one by `MARGIN`."""
        fair = {kind: score + MARGIN * (kind == "both") for kind, score in scores.items()}
        best, *rest = sorted(fair, key=lambda kind: fair[kind])
        second = min(rest, key=lambda kind: scores[kind])
        near = [
            kind
            for kind in rest
            if "none" not in (kind, best) and scores[kind] < scores[best] + (_HARDLY if kind == "both" else MARGIN)
        ]
        odds = np.exp([(fair[best] - fair[kind]) / 2 for kind in near])
        others = tuple(zip(near, (odds / (1 + odds.sum())).tolist(), strict=True))
        return cls(dof, best, second, scores[second] - scores[best], others)


class ManifoldFit(NamedTuple):
    """Result of a fit on the manifold.

    Attributes
    ----------
    problem : FitProblem
        Problem with the noise level that was used.
    estimate : JointEstimate
        Values of the parameters.
    known : JointUncertainty
        Uncertainty of the parameters.
    parts : BandParts or None
        Fits of parts of the band, if lines that do not fit the joint were omitted.
    intervals : Intervals
        Intervals of the parameters.
    test : ResidualTest
        Test of the residual against the noise.
    alone : JointAlone or None
        Compliance of the joint alone, if the channels show the flexibility of the sides.
    cross_fits : bool
        Whether cross terms would remove a misfit.
    choices : tuple of DofDamping
        Choice of damping of each DOF; empty if the damping terms were given.
    """

    problem: FitProblem
    estimate: JointEstimate
    known: JointUncertainty
    parts: BandParts | None
    intervals: Intervals
    test: ResidualTest
    alone: JointAlone | None = None
    cross_fits: bool = False
    choices: tuple[DofDamping, ...] = ()

    @property
    def residual_level(self) -> float:
        """Residual relative to the FRFs."""
        return float(np.sqrt(self.estimate.excess)) * self.problem.noise.level

    @property
    def noise_level(self) -> float:
        """Noise relative to the FRFs, or the level of the residual if no other is known."""
        return self.residual_level if self.problem.noise.is_assumed else self.problem.noise.level


def fit_springs(problem: FitProblem) -> ManifoldFit:
    """Fit a joint of springs and dampers, compute its uncertainty, and compare its residual with the noise."""
    problem, found, choices = estimated_joint(problem)
    known, parts = uncertainty_of(problem, found, choices)
    test = residual_test_of(found, problem.freq_hz, problem.noise.inflation, known)
    alone = None if problem.bending is None else _alone(problem, found, known, problem.bending)
    cross_fits = _cross_fits(problem, found, test, choices)
    intervals = joint_intervals(found, known.factor, known.added)
    return ManifoldFit(problem, found, known, parts, intervals, test, alone, cross_fits, choices)


def _alone(problem: FitProblem, found: JointEstimate, known: JointUncertainty, bending: SideBending) -> JointAlone:
    """Return the compliance of the joint alone, from C of each line without the variance added for the channels."""
    n, freq = len(problem.dofs), problem.freq_hz
    frfs = problem.frfs if problem.deformation is None else problem.frfs.without(problem.deformation)
    value, spread = np.full((freq.size, n), np.nan, complex), np.full((freq.size, n), np.nan)
    fitted = FittedCompliance.unknown(n)
    rotations = np.array([is_rotation(dof) for dof in problem.dofs])
    for one in known.groups:
        group = one.at.group
        _, lines = compliance_lines(frfs.of_dofs(group.dofs))
        used = problem.used[:, group.dofs]
        value[:, group.dofs] = np.where(used, lines.value, np.nan)
        spread[:, group.dofs] = np.einsum("ldd->ld", lines.covariance).real
        fitted = fitted.with_group(group.dofs, _through_sides(one, rotations[group.dofs], bending.on(group.dofs)))
    return joint_alone(2 * np.pi * freq, value, spread, fitted, bending, rotations)


def _through_sides(known: GroupUncertainty, rotations: NDArray[np.bool_], bending: SideBending) -> FittedCompliance:
    """Return C_dd of a group by the fit of all lines, with random flexibility of the sides unless it is negligible."""
    group = known.at.group
    value, slope = _compliance_at_rest(group)
    _, largest, _ = bending.of_joint(value, rotations)
    smooth = known.factor - known.spread.factor
    error, of_channels = _errors(group, slope, known.spread.factor, smooth)
    # Inertia changes C as seen by a share of about D/|gamma|.
    by_sides = largest / _REACH / np.maximum(group.problem.data.own_size, TINY) * abs(value)
    is_rigid = _REACH * by_sides <= error
    between_rigid = FittedCompliance(value, error, of_channels, by_sides, is_rigid)
    found = fit_with_flexible_sides(group, largest / _REACH)
    if found is None:
        return between_rigid
    through = value + slope @ found.step, *_errors(group, slope, known.spread.factor * found.noise, smooth, found.sides)
    kept = (np.where(is_rigid, one, other) for one, other in zip(between_rigid, (*through, is_rigid), strict=True))
    return FittedCompliance(*kept)


def _errors(group: GroupFit, slope: FloatArray, *factors: FloatArray) -> list[FloatArray]:
    """Return standard errors of C_dd for variance factors of the coordinates, correlated as between rigid sides."""
    roots = [slope * np.sqrt(np.maximum(own, 0)) for own in factors]
    return [np.sqrt(np.maximum(np.einsum("dp,pq,dq->d", r, group.covariance, r), 0)) for r in roots]


def _compliance_at_rest(group: GroupFit) -> tuple[FloatArray, FloatArray]:
    """Return C_dd at w = 0 of the fitted joint, shape (n,), and its derivatives by the coordinates, shape (n, p)."""
    joint, n = group.joint, len(group.dofs)
    if joint.in_compliance:
        stiff = joint.is_compliance
        return 1 / joint.theta(group.x)[stiff], np.diag(joint.compliance_slope(group.x))[stiff]
    diagonal = np.flatnonzero(joint.rows == joint.columns)
    entries = joint.compliance(group.x)
    slope = joint.slope(group.x, entries)[:, diagonal].real.mean(axis=0)[:n]
    # The real part of K* is the same on all lines, the real part of C is not: damping changes it.
    springs = np.diag(joint.springs)
    stiffness = (np.linalg.inv(joint.matrix(entries)) - springs).real.mean(axis=0)
    compliance = np.linalg.inv(stiffness)
    # dC = (1 + C Z) dR (1 + Z C)
    more = np.diagonal(np.eye(n) + compliance @ springs) ** 2
    return np.diagonal(compliance)[:n], slope * more[:, None]


def fit_laws(problem: FitProblem, joint: LawJoint) -> ManifoldFit:
    """Fit the parameters of all laws of a joint, and return the result with its uncertainty.

    Parameters
    ----------
    problem : FitProblem
        FRFs and options.
    joint : LawJoint
        Joint with its DOFs in the order of the problem, without masses.
    """

    def fit(own: FitProblem) -> tuple[JointEstimate, tuple[DofDamping, ...]]:
        return estimate_laws(own.frfs, joint, 2 * np.pi * own.freq_hz, own.used, own.options.same), ()

    problem, found, _ = _estimated(problem, fit)
    known = _uncertainty(problem, found)
    test = residual_test_of(found, problem.freq_hz, problem.noise.inflation, known)
    return ManifoldFit(problem, found, known, None, joint_intervals(found, known.factor, known.added), test)


def estimated_joint(problem: FitProblem) -> tuple[FitProblem, JointEstimate, tuple[DofDamping, ...]]:
    """Fit a joint of springs by maximum likelihood, linearised on the manifold of FRFs that fit it.

    Returns
    -------
    problem : FitProblem
        Problem with the noise level that was used.
    estimate : JointEstimate
        Values of the parameters.
    choices : tuple of DofDamping
        Choice of damping of each DOF; empty if the damping terms were given.
    """
    return _estimated(problem, _with_damping)


def uncertainty_of(
    problem: FitProblem, found: JointEstimate, choices: tuple[DofDamping, ...] = ()
) -> tuple[JointUncertainty, BandParts | None]:
    """Return the uncertainty of the parameters of a joint of springs, and the comparison of parts of the band."""
    known = _uncertainty(problem, found, problem.added_compliance)
    parts = _band_parts(problem, found, known, choices)
    if parts is None:
        return known, None
    slope = np.ones(found.theta.size)
    for group in found.groups:
        slope[group.which] = np.where(group.joint.is_compliance, found.theta[group.which] ** 2, 1.0)
    with np.errstate(invalid="ignore"):
        covariance = known.covariance + np.diag(np.square(slope * parts.std_error))
    return known._replace(added=np.hypot(known.added, parts.std_error), covariance=covariance), parts


def _uncertainty(problem: FitProblem, found: JointEstimate, compliance: FloatArray | None = None) -> JointUncertainty:
    noise = problem.noise
    with _quiet():
        return uncertainty_of_joint(
            found, problem.freq_hz, noise.inflation, problem.frfs, noise.calibration, compliance, noise.mass,
            noise.cross_axis, problem.position_errors, is_level_known=not noise.is_assumed, motion=problem.motion,
        )  # fmt: skip


def _estimated(
    problem: FitProblem, fit: Callable[[FitProblem], tuple[JointEstimate, tuple[DofDamping, ...]]]
) -> tuple[FitProblem, JointEstimate, tuple[DofDamping, ...]]:
    """Fit; repeat with the level of the residual until both agree if the noise level is assumed."""
    freq = problem.freq_hz
    span = f"one line, {freq[0]:g} Hz" if freq.size == 1 else f"{freq.size} lines, {freq.min():g} to {freq.max():g} Hz"
    try:
        found, more = fit(problem)
        for _ in range(_MOST_LEVELS if problem.noise.is_assumed else 0):
            scale = float(np.sqrt(found.excess))
            if scale < _NO_NOISE or 1 / _AGREE < scale < _AGREE:
                break
            problem = problem.with_noise(scale)
            found, more = fit(problem)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"no joint was found that fits gamma ({span}): {error}") from error
    check_estimate(found, problem.noise.level, span, is_level_known=not problem.noise.is_assumed)
    return replace(problem, noise=replace(problem.noise, inflation=_inflation(problem, found))), found, more


def _inflation(problem: FitProblem, found: JointEstimate) -> float:
    """Return the number of neighbouring lines with the noise of one, at most as many as the residual of the fit shows.

    A rational function that misses the FRFs leaves a residual that is smooth over frequency. If the correlation was
    estimated from it, and not from differences of reciprocal FRFs, the residual at the joint limits it.
    """
    noise = problem.noise
    if noise.model is None or noise.model.inflation_source != "residual":
        return noise.inflation
    rows, used, usual = list[ComplexArray](), 0, noise.model.line_factor == 1
    for group in found.groups:
        _, gradient = group.forms.at(group.joint.compliance(group.x))
        size = np.sqrt(np.maximum(np.einsum("lqq->lq", group.forms.weight).real, 0))
        size = np.where(usual[:, None], size, 0)
        rows += list(np.where(size > 0, gradient / np.where(size > 0, size, 1), np.nan).T)
        used += int(np.count_nonzero(size))
    taken = len(found.parameters) / max(2 * used, 1)
    return min(noise.inflation, line_correlation(np.array(rows), taken))


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress warnings: noisy lines are ill-conditioned, and initial values may lead to infinity."""
    with warnings.catch_warnings(), np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        warnings.simplefilter("ignore", IllConditionedWarning)
        yield


def _band_parts(
    problem: FitProblem, result: JointEstimate, known: JointUncertainty, choices: tuple[DofDamping, ...]
) -> BandParts | None:
    """Fit parts of the band if lines were omitted from the fit of the whole band."""
    if problem.sides_bend or left_out_share(result) < _LEFT_OUT or problem.freq_hz.size < _FEW:
        return None

    def fit(lines: NDArray[np.intp]) -> JointEstimate:
        frfs = problem.frfs.on_lines(lines)
        part = replace(problem, freq_hz=problem.freq_hz[lines], frfs=frfs, used=problem.used[lines], near=())
        return _estimate(part, _chosen(problem, choices))

    return fit_band_parts(result, problem.freq_hz, known.spread.information, fit)


def _chosen(problem: FitProblem, choices: tuple[DofDamping, ...]) -> DampingTerms | Sequence[DampingTerms]:
    """Return the damping terms that were fitted."""
    damping = problem.options.damping
    return tuple(one.terms for one in choices) if damping == "auto" else damping


def _cross_fits(
    problem: FitProblem,
    result: JointEstimate,
    test: ResidualTest,
    choices: tuple[DofDamping, ...],
) -> bool:
    """Return whether a fit with cross terms has a residual of noise, and the fit without does not."""
    coupled = any(len(group.dofs) > 1 for group in result.groups)
    is_asked = problem.options.cross == "zero" and not (problem.noise.is_assumed or problem.sides_bend)
    if not (is_asked and test.is_large and coupled):
        return False
    of_points = any(point for point, _ in map(point_and_direction, problem.dofs))
    other = _estimate(problem, _chosen(problem, choices), "points" if of_points else "fit", result.data)
    return bool(np.sqrt(other.excess) - 1 < (test.ratio - 1) / 4)


def _with_damping(problem: FitProblem) -> tuple[JointEstimate, tuple[DofDamping, ...]]:
    damping = problem.options.damping
    if damping != "auto":
        return _estimate(problem, damping), ()
    if problem.options.cross in ("points", "fit") or problem.options.same:
        return _with_common_damping(problem)
    both = _estimate(problem, "both")
    factor = _inflation(problem, both) * max(both.scale, _LEAST_EXCESS if problem.noise.is_assumed else 1.0)
    of_dof = {}
    for group in both.groups:
        for one in choose_damping(group, tuple(problem.dofs[d] for d in group.dofs), factor):
            of_dof[one.dof] = one
    choices = tuple(of_dof[dof] for dof in problem.dofs)
    chosen = tuple(one.terms for one in choices)
    if all(kind == "both" for kind in chosen):
        return _averaged(both, problem.dofs, choices), choices
    if problem.freq_hz.size >= _FEW and left_out_share(both) == 0:
        problem = replace(problem, near=_starts(problem, both, chosen))
    data = both.data
    # Its quadratic forms, many for a long sweep, are no longer needed.
    del both, group
    return _averaged(_estimate(problem, chosen, data=data), problem.dofs, choices), choices


def _averaged(found: JointEstimate, dofs: tuple[str, ...], choices: tuple[DofDamping, ...]) -> JointEstimate:
    """Return the means over kinds of damping that the data do not exclude, of an estimate with the terms of all.

    The joint distribution of the parameters is the mixture of the normal distributions of the kinds, weighted by odds
    (Bayesian model averaging); a kind has zero for terms that it lacks. DOFs are averaged one by one.
    """
    if not any(one.others for one in choices):
        return found
    theta, covariance = found.theta.copy(), found.covariance.copy()
    kinds_of_groups: list[list[FormMinimum]] = []
    for group in found.groups:
        names = tuple(dofs[d] for d in group.dofs)
        kept: list[DampingTerms] = [choices[d].terms for d in group.dofs]
        base = _values_of(group, group)
        kinds_of_groups.append([])
        for i, d in enumerate(group.dofs):
            others = choices[d].others
            odds = {choices[d].best: 1 - sum(share for _, share in others), **dict(others)} if others else {}
            minima = [
                _minimum(group, joint_terms(group.joint.omega, names, [*kept[:i], kind, *kept[i + 1 :]], "zero"))
                for kind in odds
            ]
            parts = [_values_of(group, one) for one in minima]
            if not odds or not all(np.isfinite(part).all() for pair in (base, *parts) for part in pair):
                continue
            share = np.array(list(odds.values()))
            mean = share @ [values for values, _ in parts]
            spread = sum(w * (own + np.outer(at - mean, at - mean)) for w, (at, own) in zip(share, parts, strict=True))
            theta[group.which] += mean - base[0]
            own_part = np.ix_(group.which, group.which)
            whole = covariance[own_part] + spread - base[1]
            # If two lines hardly determine a parameter, derivatives far from the minimum do not agree.
            covariance[own_part] = whole if (np.diagonal(whole) > 0).all() else spread
            kinds_of_groups[-1] += minima
    return found._replace(theta=theta, covariance=covariance, kinds=tuple(map(tuple, kinds_of_groups)))


def _values_of(group: GroupFit, minimum: FormMinimum) -> tuple[FloatArray, FloatArray]:
    """Return parameters of a group, zero if a minimum lacks them, shape (p,), and their covariance."""
    at = [group.joint.names.index(name) for name in minimum.joint.names]
    values, covariance = np.zeros(group.x.size), np.zeros((group.x.size, group.x.size))
    slope = minimum.joint.theta_slope(minimum.x)
    values[at] = minimum.joint.theta(minimum.x)
    covariance[np.ix_(at, at)] = slope @ minimum.covariance @ slope.T
    return values, covariance


def _with_common_damping(problem: FitProblem) -> tuple[JointEstimate, tuple[DofDamping, ...]]:
    """Choose the damping terms of a joint with cross terms: the same for all DOFs."""
    results: dict[DampingTerms, JointEstimate] = {"viscous": _estimate(problem, "viscous")}
    near = (*_starts(problem, results["viscous"], "both"), *problem.near)
    both = results["both"] = _estimate(replace(problem, near=near), "both", data=results["viscous"].data)
    factor = _inflation(problem, both) * max(both.excess, _LEAST_EXCESS)

    def score(squares: float, p: int) -> float:
        return 2 * squares / factor + p * float(np.log(max(2 * both.equations / factor, 2.0)))

    def score_of(result: JointEstimate) -> float:
        return score(sum(group.squares for group in result.groups), len(result.parameters))

    scores = {kind: score_of(result) for kind, result in results.items()}
    # If both terms together fit, other initial values are not needed to show that one of them does not fit.
    is_explained = all(group.is_noise for group in both.groups)
    bound = score(_least_squares(problem, both, "hysteretic"), len(results["viscous"].parameters))
    if is_explained and bound > max(scores.values()) + _EXCLUDED:
        scores["hysteretic"] = bound
    else:
        near = (*_starts(problem, both, "hysteretic"), *problem.near)
        is_explained = is_explained and not problem.near
        own = replace(problem, near=near)
        results["hysteretic"] = _estimate(own, "hysteretic", data=both.data, is_explained=is_explained)
        scores["hysteretic"] = score_of(results["hysteretic"])
    choices = tuple(DofDamping.by_scores(dof, scores)._replace(others=()) for dof in problem.dofs)
    return results[choices[0].best], choices


def _least_squares(problem: FitProblem, found: JointEstimate, damping: DampingTerms) -> float:
    """Return a lower bound of the squares with fewer terms, from the final weights of some lines and earlier ones."""
    terms, squares = _terms(problem, damping, problem.options.cross), 0.0
    for group in found.groups:
        some = slice(None, None, max(1, len(group.used) // _SOME_LINES))
        own = _minimum(group, terms.of_dofs(group.dofs)[0], some, _COARSE)
        before, _ = own.forms.at(group.joint.on_lines(some).compliance(group.x))
        squares += group.squares + own.cost - float(before.sum())
    return squares


def _starts(
    problem: FitProblem, found: JointEstimate, damping: DampingTerms | Sequence[DampingTerms]
) -> tuple[GroupStart, ...]:
    """Return initial values of fits with these terms from other fits that converged."""
    terms = _terms(problem, damping, problem.options.cross)
    return tuple(
        GroupStart.of(group, _minimum(group, terms.of_dofs(group.dofs)[0]))
        for group in found.groups
        if (group.converged or group.is_noise)
    )


def _terms(problem: FitProblem, damping: DampingTerms | Sequence[DampingTerms], cross: CrossTerms) -> JointTerms:
    return joint_terms(2 * np.pi * problem.freq_hz, problem.dofs, damping, cross, problem.options.same)


def _estimate(
    problem: FitProblem,
    damping: DampingTerms | Sequence[DampingTerms],
    cross: CrossTerms | None = None,
    data: Iterable[GroupData] | None = None,
    *,
    is_explained: bool = False,
) -> JointEstimate:
    """Fit with these terms; `data` and `is_explained` as in `estimate_joint`."""
    cross = problem.options.cross if cross is None else cross
    terms = _terms(problem, damping, cross)
    with _quiet():
        return estimate_joint(
            problem.frfs, terms, cross, problem.used, problem.near, data, is_explained=is_explained,
            sides_bend=problem.sides_bend,
        )  # fmt: skip


def choose_damping(group: GroupFit, dofs: tuple[str, ...], factor: float) -> list[DofDamping]:
    """Choose the damping terms of each DOF of a group that was fitted with both.

    Parameters
    ----------
    group : GroupFit
        Fit of a joint without cross terms; its quadratic forms are minimised again with fewer terms of one DOF at a
        time.
    dofs : tuple of str
        Names of the DOFs of the group.
    factor : float
        Ratio of the variance of parameters to the variance by independent noise, by which squares are divided.

    Notes
    -----
    BIC = 2 squares / factor + p ln(2 equations / factor). A joint supplies no energy: terms of opposite sign that
    nearly cancel each other are noise, so "both" needs two terms that are positive.
    """
    price = np.log(max(2 * group.equations / factor, 2.0))
    choices = []
    for d, dof in enumerate(dofs):
        scores: dict[DampingTerms, float] = {}
        for kind in _KINDS:
            kinds: list[DampingTerms] = ["both"] * len(dofs)
            kinds[d] = kind
            terms = joint_terms(group.joint.omega, dofs, kinds, "zero")
            found = _minimum(group, terms)
            damping = found.x[(terms.pairs[:, 0] == d) & (terms.kinds > 0)]
            scores[kind] = 2 * found.cost / factor + len(terms.parameters) * price
            if kind == "both" and (damping <= 0).any():
                scores[kind] = np.inf
        one = DofDamping.by_scores(dof, scores)
        # Few lines cannot give the terms of all kinds.
        choices.append(one if 2 * group.equations > group.x.size else one._replace(others=()))
    return choices


def _minimum(
    group: GroupFit, terms: JointTerms, lines: slice = slice(None), least_gain: float = LEAST_GAIN
) -> FormMinimum:
    """Minimise the forms of a group with other terms, from the present joint; additional terms start at zero."""
    terms = terms.on_lines(lines)
    joint = coordinates_of(terms, group.problem.data.reference)
    found = dict(zip(group.joint.names, group.joint.theta(group.x).tolist(), strict=True))
    theta = np.array([found.get(one.name, 0.0) for one in terms.parameters])
    return joint.minimise(group.forms.on_slice(lines), joint.coordinates(theta), least_gain=least_gain)
