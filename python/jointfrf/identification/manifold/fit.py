"""From a prepared problem to numbers: the fit on the manifold with its choice of damping."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import in_pieces
from jointfrf.identification.manifold.beyond_noise import (
    BandParts,
    ChannelSpread,
    channel_spread,
    fit_band_parts,
    left_out_share,
)
from jointfrf.identification.manifold.coordinates import (
    CrossTerms,
    DampingTerms,
    DiagonalJoint,
    JointTerms,
    joint_terms,
    terms_of,
)
from jointfrf.identification.manifold.estimate import (
    FittedGroup,
    GroupData,
    GroupStart,
    JointEstimate,
    coordinates_of,
    estimate_joint,
)
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.line_forms import FormMinimum, minimise_forms
from jointfrf.identification.manifold.prepare import FitProblem, check_estimate
from jointfrf.identification.manifold.scatter import Spread, spread_of
from jointfrf.identification.manifold.spring_intervals import LikelihoodIntervals
from jointfrf.identification.residual_test import Misfit, diagnose
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.modification import inverse_substructuring

__all__ = [
    "ComplianceFit",
    "DofDamping",
    "FittedJoint",
    "at_level_of_residual",
    "choose_damping",
    "estimated_joint",
    "fit_compliance",
    "fitted_joint",
    "stiffness_of_lines",
    "with_terms",
]

FoundT = TypeVar("FoundT")

#: An assumed noise level is replaced by that of the residual until both agree to this factor.
_AGREE = 1.3
_MOST_LEVELS = 6
#: The residual of exact FRFs is rounding: models are not compared below this share of the noise.
_LEAST_EXCESS = 1e-12
#: Share of lines left out from which on parts of the band are compared.
_LEFT_OUT = 0.02
#: Of fewer lines parts are not compared, and a fit may have several minima: each searches its own starts.
_FEW = 40
#: Residual of FRFs without noise, in units of the level assumed.
_NO_NOISE = 1e-3


class ComplianceFit(NamedTuple):
    """Result of `fit_compliance`.

    Attributes
    ----------
    problem : FitProblem
        With the noise that was used.
    estimate : JointEstimate
    covariance : ndarray, shape (p, p)
    intervals : LikelihoodIntervals
    spread : Spread
        By how much variances exceed those from independent noise.
    channels : ChannelSpread or None
        What sides that are not rigid add to that; None where the channels do not tell.
    parts : BandParts, optional
        Where lines that do not fit the joint were left out: whether parts of the band give it.
    misfit : Misfit
        The residual against the noise.
    cross_fits : bool
        Whether cross terms would remove a misfit.
    choices : tuple of DofDamping
        Empty where the damping terms were given.
    """

    problem: FitProblem
    estimate: JointEstimate
    covariance: FloatArray
    intervals: LikelihoodIntervals
    spread: Spread
    channels: ChannelSpread | None
    parts: BandParts | None
    misfit: Misfit
    cross_fits: bool
    choices: tuple[DofDamping, ...]


class FittedJoint(NamedTuple):
    """A joint with its uncertainty, before its residual is looked at.

    Attributes
    ----------
    problem : FitProblem
        With the noise level that was used.
    estimate, spread, channels, parts, choices
        As in `ComplianceFit`.
    """

    problem: FitProblem
    estimate: JointEstimate
    spread: Spread
    channels: ChannelSpread | None
    parts: BandParts | None
    choices: tuple[DofDamping, ...]

    def intervals(self) -> LikelihoodIntervals:
        """Return the intervals of the parameters."""
        added = [one.std_error for one in (self.channels, self.parts) if one is not None]
        reach = np.sqrt(np.square(added).sum(axis=0)) if added else None
        return LikelihoodIntervals(self.estimate, self.spread.factor, reach)

    def covariance(self) -> FloatArray:
        """Return the covariance of the parameters, shape (p, p)."""
        factor = self.spread.factor if self.channels is None else self.spread.factor + self.channels.factor
        root = np.sqrt(factor)
        with np.errstate(invalid="ignore"):
            covariance: FloatArray = self.estimate.covariance * np.outer(root, root)
            covariance += np.diag(_of_parameters(self.estimate, self.parts))
        return covariance


def estimated_joint(problem: FitProblem) -> tuple[FitProblem, JointEstimate, tuple[DofDamping, ...]]:
    """Fit the joint by maximum likelihood, linearised on the manifold of FRFs that fit it.

    Returns
    -------
    problem : FitProblem
        With the noise level that was used.
    estimate : JointEstimate
    choices : tuple of DofDamping
        Empty where the damping terms were given.
    """
    span = _span(problem.freq_hz)
    try:
        problem, result, choices = _fitted(problem)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"no joint was found that fits gamma ({span}): {error}") from error
    check_estimate(result, problem.noise.level, span, is_level_known=not problem.noise.is_assumed)
    return problem, result, choices


def fitted_joint(problem: FitProblem) -> FittedJoint:
    """Fit the joint as `estimated_joint` does, and find its uncertainty."""
    problem, result, choices = estimated_joint(problem)
    noise = problem.noise
    spread = spread_of(result, noise.inflation, is_level_known=not noise.is_assumed)
    channels = channel_spread(result, problem.frfs, problem.added_compliance)
    return FittedJoint(problem, result, spread, channels, _band_parts(problem, result, spread, choices), choices)


def fit_compliance(problem: FitProblem) -> ComplianceFit:
    """Fit the joint as `fitted_joint` does, and compare its residual with the noise."""
    found = fitted_joint(problem)
    problem, result, noise = found.problem, found.estimate, found.problem.noise
    misfit = diagnose(result, problem.freq_hz, noise.inflation, found.spread)
    cross_fits = _cross_fits(problem, result, misfit, found.choices)
    return ComplianceFit(
        problem, result, found.covariance(), found.intervals(), found.spread, found.channels, found.parts, misfit,
        cross_fits, found.choices,
    )  # fmt: skip


def _span(freq: FloatArray) -> str:
    """Return the lines in words."""
    return f"{freq.size} lines, {freq.min():g} to {freq.max():g} Hz" if freq.size > 1 else f"one line, {freq[0]:g} Hz"


def stiffness_of_lines(frfs: InterfaceFrfs) -> ComplexArray:
    """Return K*(w) of each line by itself, NaN where it cannot be inverted; a piece of the lines at a time."""
    h = frfs.measured
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        (found,) = in_pieces(len(h), lambda own: [inverse_substructuring(frfs.gamma(h[own]), on_singular="nan")])
    return found


def _band_parts(
    problem: FitProblem, result: JointEstimate, spread: Spread, choices: tuple[DofDamping, ...]
) -> BandParts | None:
    """Fit parts of the band where lines were left out of the fit of all of it."""
    if left_out_share(result) < _LEFT_OUT or problem.freq_hz.size < _FEW:
        return None
    words = _chosen(problem, choices)

    def fit(lines: NDArray[np.intp]) -> JointEstimate:
        frfs = problem.frfs.on_lines(lines)
        part = replace(problem, freq_hz=problem.freq_hz[lines], frfs=frfs, used=problem.used[lines], near=())
        return _estimate(part, words)

    return fit_band_parts(result, problem.freq_hz, spread.information, fit)


def _of_parameters(result: JointEstimate, parts: BandParts | None) -> FloatArray:
    """Return the variance that disagreeing parts of the band add to each parameter."""
    if parts is None:
        return np.zeros(result.theta.size)
    slope = np.ones(result.theta.size)
    for group in result.groups:
        if isinstance(group.joint, DiagonalJoint):
            slope[group.which] = np.where(terms_of(group.joint).kinds == 0, result.theta[group.which] ** 2, 1.0)
    variance: FloatArray = np.square(slope * parts.std_error)
    return variance


def _chosen(problem: FitProblem, choices: tuple[DofDamping, ...]) -> DampingTerms | Sequence[DampingTerms]:
    """Return the damping terms that were fitted."""
    damping = problem.options.damping
    return tuple(one.best for one in choices) if damping == "auto" else damping


def _cross_fits(
    problem: FitProblem,
    result: JointEstimate,
    misfit: Misfit,
    choices: tuple[DofDamping, ...],
) -> bool:
    """Whether a fit with cross terms leaves a residual that is noise, where that without does not."""
    coupled = any(len(group.dofs) > 1 for group in result.groups)
    if problem.noise.is_assumed or problem.options.cross != "zero" or not (misfit.is_large and coupled):
        return False
    other = _estimate(problem, _chosen(problem, choices), "fit", result.data)
    return bool(np.sqrt(other.excess) - 1 < (misfit.ratio - 1) / 4)


def _fitted(problem: FitProblem) -> tuple[FitProblem, JointEstimate, tuple[DofDamping, ...]]:
    """Fit with the damping terms asked for; where no noise level is known, at that of the residual."""
    problem, (result, choices) = at_level_of_residual(problem, _with_damping, lambda found: found[0].excess)
    return problem, result, choices


def at_level_of_residual(
    problem: FitProblem, fit: Callable[[FitProblem], FoundT], excess: Callable[[FoundT], float]
) -> tuple[FitProblem, FoundT]:
    """Fit; where the noise level is assumed, again with that of the residual until both agree.

    Parameters
    ----------
    problem : FitProblem
    fit : callable
    excess : callable
        Returns, of what `fit` does, the mean square of the residual in units of the noise.
    """
    found = fit(problem)
    for _ in range(_MOST_LEVELS if problem.noise.is_assumed else 0):
        scale = float(np.sqrt(excess(found)))
        if scale < _NO_NOISE or 1 / _AGREE < scale < _AGREE:
            break
        problem = problem.with_noise(scale)
        found = fit(problem)
    return problem, found


def _with_damping(problem: FitProblem) -> tuple[JointEstimate, tuple[DofDamping, ...]]:
    damping = problem.options.damping
    if damping != "auto":
        return _estimate(problem, damping), ()
    if problem.options.cross == "fit":
        return _with_common_damping(problem)
    both = _estimate(problem, "both")
    factor = problem.noise.inflation * max(both.scale, _LEAST_EXCESS if problem.noise.is_assumed else 1.0)
    of_dof = {}
    for group in both.groups:
        for one in choose_damping(group, tuple(problem.dofs[d] for d in group.dofs), factor):
            of_dof[one.dof] = one
    choices = tuple(of_dof[dof] for dof in problem.dofs)
    chosen = tuple(one.best for one in choices)
    if all(kind == "both" for kind in chosen):
        return both, choices
    if problem.freq_hz.size >= _FEW and left_out_share(both) == 0:
        problem = replace(problem, near=_starts(problem, both, chosen))
    data = both.data
    # Its quadratic forms, of which a long sweep has many, are not needed any more.
    del both, group
    return _estimate(problem, chosen, data=data), choices


def _with_common_damping(problem: FitProblem) -> tuple[JointEstimate, tuple[DofDamping, ...]]:
    """Choose the damping terms of a joint with cross terms: the same for all DOFs."""
    results: dict[DampingTerms, JointEstimate] = {"viscous": _estimate(problem, "viscous")}
    before = results["viscous"]
    for kind in ("both", "hysteretic"):
        # Where both terms together fit, one of them needs no other start to show that it does not.
        is_last = kind == "hysteretic" and all(group.fit.is_noise for group in before.groups)
        near = tuple(start._replace(is_last=is_last) for start in _starts(problem, before, kind))
        before = results[kind] = _estimate(replace(problem, near=(*near, *problem.near)), kind, data=before.data)
    factor = problem.noise.inflation * max(results["both"].excess, _LEAST_EXCESS)
    scores = {}
    for kind, result in results.items():
        squares = sum(group.fit.squares for group in result.groups)
        scores[kind] = 2 * squares / factor + len(result.parameters) * np.log(max(2 * result.equations / factor, 2.0))
    best, second = sorted(scores, key=lambda kind: scores[kind])[:2]
    margin = scores[second] - scores[best]
    return results[best], tuple(DofDamping(dof, best, second, margin) for dof in problem.dofs)


def _starts(
    problem: FitProblem, found: JointEstimate, damping: DampingTerms | Sequence[DampingTerms]
) -> tuple[GroupStart, ...]:
    """Return where fits with these terms begin: at what others have found; not where these did not converge."""
    terms = _terms(problem, damping, problem.options.cross)
    return tuple(
        with_terms(group, terms.of_dofs(group.dofs)[0])
        for group in found.groups
        if group.fit.converged or group.fit.is_noise
    )


def _terms(problem: FitProblem, damping: DampingTerms | Sequence[DampingTerms], cross: CrossTerms) -> JointTerms:
    return joint_terms(2 * np.pi * problem.freq_hz, problem.dofs, damping, cross)


def _estimate(
    problem: FitProblem,
    damping: DampingTerms | Sequence[DampingTerms],
    cross: CrossTerms | None = None,
    data: Iterable[GroupData] | None = None,
) -> JointEstimate:
    """Fit with these terms; `data` as in `estimate_joint`."""
    cross = problem.options.cross if cross is None else cross
    terms = _terms(problem, damping, cross)
    with warnings.catch_warnings(), np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        # Lines on which noise hides the joint are ill-conditioned; they weigh little. A start may lead to infinity.
        warnings.simplefilter("ignore", IllConditionedWarning)
        return estimate_joint(problem.frfs, terms, cross, problem.used, problem.near, data)


_KINDS: tuple[DampingTerms, ...] = ("none", "viscous", "hysteretic", "both")


class DofDamping(NamedTuple):
    """Damping terms of one DOF, chosen by the Bayesian information criterion (BIC).

    Attributes
    ----------
    dof : str
    best, second : str
    margin : float
        Difference of their BIC: above 10 the choice is clear, below 2 the data hardly prefer one.
    """

    dof: str
    best: DampingTerms
    second: DampingTerms
    margin: float


def choose_damping(group: FittedGroup, dofs: tuple[str, ...], factor: float) -> list[DofDamping]:
    """Choose the damping terms of each DOF of a group that was fitted with both.

    Parameters
    ----------
    group : FittedGroup
        A joint without cross terms; its quadratic forms are minimised again with fewer terms of one DOF at a time.
    dofs : tuple of str
        Names of the DOFs of the group.
    factor : float
        By how much the variance of parameters exceeds that from independent noise: squares count so much less.

    Notes
    -----
    BIC = 2 squares / factor + p ln(2 equations / factor). A joint supplies no energy: terms of opposite sign that
    nearly cancel each other are noise, so "both" needs two terms that are positive.
    """
    fit, own = group.fit, terms_of(group.joint)
    price = np.log(max(2 * fit.equations / factor, 2.0))
    choices = []
    for d, dof in enumerate(dofs):
        scores: dict[DampingTerms, float] = {}
        for kind in _KINDS:
            kinds: list[DampingTerms] = ["both"] * len(dofs)
            kinds[d] = kind
            terms = joint_terms(own.omega, dofs, kinds, "zero")
            found = _minimum(group, terms)
            damping = found.x[(terms.pairs[:, 0] == d) & (terms.kinds > 0)]
            scores[kind] = 2 * found.cost / factor + len(terms.parameters) * price
            if kind == "both" and (damping <= 0).any():
                scores[kind] = np.inf
        best, second = sorted(scores, key=lambda kind: scores[kind])[:2]
        choices.append(DofDamping(dof, best, second, scores[second] - scores[best]))
    return choices


def with_terms(group: FittedGroup, terms: JointTerms) -> GroupStart:
    """Return where a fit with other terms may begin: at the minimum of the quadratic forms with these."""
    return GroupStart.of(group, _minimum(group, terms))


def _minimum(group: FittedGroup, terms: JointTerms) -> FormMinimum:
    """Minimise the forms of a group with other terms, from the joint found; terms that it has not begin at zero."""
    joint = coordinates_of(terms)
    found = dict(zip(terms_of(group.joint).parameters, group.joint.theta(group.fit.minimum.x).tolist(), strict=True))
    theta = np.array([found.get(one, 0.0) for one in terms.parameters])
    return minimise_forms(group.fit.forms, joint, joint.coordinates(theta))
