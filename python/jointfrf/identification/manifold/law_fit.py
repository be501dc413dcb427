"""The fit of a joint of laws: every group of DOFs on the manifold of FRFs that fit a joint, and put together."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import IllConditionedWarning
from jointfrf.identification.line_starts import from_lines, interface_compliance
from jointfrf.identification.manifold.coordinates import LawCoordinates
from jointfrf.identification.manifold.estimate import FittedGroup, JointEstimate, grouped, unknown_entries
from jointfrf.identification.manifold.fit import at_level_of_residual
from jointfrf.identification.manifold.group_fit import GroupProblem, fit_dofs
from jointfrf.identification.manifold.line_forms import FormSquares
from jointfrf.identification.manifold.on_manifold import FrfEntries
from jointfrf.identification.manifold.prepare import FitProblem, check_estimate
from jointfrf.identification.manifold.scatter import Spread, spread_of
from jointfrf.identification.minimise import Minimum, inverse_information
from jointfrf.identification.profile import ProfileIntervals
from jointfrf.identification.residual_test import Misfit, diagnose
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["FoundLaws", "LawIntervals", "fit_laws"]


class FoundLaws(NamedTuple):
    """Result of `fit_laws`.

    Attributes
    ----------
    problem : FitProblem
        With the noise used in the end.
    joint : LawJoint
        The joint found.
    estimate : JointEstimate
        Its parameters are those of the joint, in its order.
    covariance : ndarray, shape (p, p)
        Of its parameters, scatter between lines and parts of the band included.
    spread : Spread
    misfit : Misfit
    intervals : LawIntervals
    """

    problem: FitProblem
    joint: LawJoint
    estimate: JointEstimate
    covariance: FloatArray
    spread: Spread
    misfit: Misfit
    intervals: LawIntervals


class LawIntervals:
    """Intervals of all parameters by profile likelihood, by their probability.

    Parameters
    ----------
    found : JointEstimate
    factor : ndarray, shape (p,)
        By how much the variance of each parameter exceeds that from independent noise.
    """

    def __init__(self, found: JointEstimate, factor: FloatArray) -> None:
        self._profiles: dict[str, tuple[ProfileIntervals, int]] = {}
        for group in found.groups:
            joint, minimum = group.joint, group.fit.minimum
            assert isinstance(joint, LawCoordinates)
            at_bound = (minimum.x <= joint.lower) | (minimum.x >= joint.upper)
            information = 2 * minimum.information
            best = Minimum(minimum.x, 2 * minimum.cost, information, group.fit.converged, at_bound)
            covariance = inverse_information(information)
            for i, (name, place) in enumerate(zip(joint.names, group.which, strict=True)):
                own = float(factor[place])
                profile = ProfileIntervals(FormSquares(joint, group.fit.forms), best, covariance, own)
                self._profiles[name] = profile, i
        self._names = [one.name for one in found.parameters]

    def of(self, name: str, probability: float) -> tuple[float, float]:
        """Return the interval of one parameter."""
        profile, i = self._profiles[name]
        return profile.of(i, probability)

    def __call__(self, probability: float) -> dict[str, tuple[float, float]]:
        """Return the interval of every parameter that contains the true one with the given probability."""
        return {name: self.of(name, probability) for name in self._names}


def fit_laws(problem: FitProblem, joint: LawJoint) -> FoundLaws:
    """Fit the parameters of all laws by maximum likelihood, linearised on the manifold of FRFs that fit a joint.

    Parameters
    ----------
    problem : FitProblem
    joint : LawJoint
        Its DOFs in the order of the problem, without masses.
    """
    freq = problem.freq_hz
    span = f"{freq.size} lines, {freq.min():g} to {freq.max():g} Hz"
    with warnings.catch_warnings(), np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        # Lines on which noise hides the joint are ill-conditioned; they weigh little.
        warnings.simplefilter("ignore", IllConditionedWarning)
        try:
            problem, result = at_level_of_residual(problem, lambda own: _estimated(own, joint), lambda one: one.excess)
        except np.linalg.LinAlgError as error:
            raise ValueError(f"no joint was found that fits gamma ({span}): {error}") from error
        known = not problem.noise.is_assumed
        check_estimate(result, problem.noise.level, span, is_level_known=known)
        spread = spread_of(result, problem.noise.inflation, is_level_known=known)
        misfit = diagnose(result, freq, problem.noise.inflation, spread)
    root = np.sqrt(spread.factor)
    covariance = result.covariance * np.outer(root, root)
    found = joint.with_values(result.theta)
    return FoundLaws(problem, found, result, covariance, spread, misfit, LawIntervals(result, spread.factor))


def _estimated(problem: FitProblem, joint: LawJoint) -> JointEstimate:
    """Fit every group of DOFs between which FRFs are not zero."""
    groups, names = [], list(joint.names)
    left = set(joint.laws)
    for dofs, data in grouped(problem.frfs):
        own = _between(joint, [problem.dofs[d] for d in dofs])
        if not own.laws:
            continue
        left -= set(own.laws)
        coordinates = LawCoordinates(own, 2 * np.pi * problem.freq_hz, _size(problem, dofs))
        unknown = unknown_entries(dofs, "zero", problem.used, len(data.measured))
        rigid = len(own.rigid)
        hidden = rigid * (rigid + 1) // 2 if problem.frfs.reciprocal else rigid**2
        group = GroupProblem(data, coordinates, unknown, hidden)
        fit = fit_dofs(group, _starts(problem, dofs, coordinates))
        which = np.array([names.index(name) for name in own.names], np.intp)
        groups.append(FittedGroup(dofs, which, coordinates, group, fit))
    if left:
        a, b = next(iter(left))
        raise ValueError(f"the FRFs between {a} and {b} are zero: they say nothing of the cross term {a},{b}")
    return _together(joint, groups)


def _between(joint: LawJoint, dofs: list[str]) -> LawJoint:
    """Return the part of a joint between some of its DOFs."""
    laws = {pair: law for pair, law in joint.laws.items() if set(pair) <= set(dofs)}
    return LawJoint(laws, [dof for dof in joint.rigid if dof in dofs], None, dofs)


def _gamma(problem: FitProblem, dofs: NDArray[np.intp]) -> tuple[ComplexArray, FloatArray]:
    """Return smooth FRFs between some joint DOFs j, then k, and E|e|^2 of the measured ones."""
    frfs = problem.frfs
    at = np.concatenate([dofs, dofs + frfs.n])
    variance = np.where(np.isfinite(frfs.variance), frfs.variance, 0)
    of_joint = frfs.responses[at] ** 2 @ variance @ (frfs.forces[at] ** 2).T
    return FrfEntries.of(dofs.size, reciprocal=frfs.reciprocal).matrix(frfs.smooth_of(dofs)), of_joint


def _size(problem: FitProblem, dofs: NDArray[np.intp]) -> FloatArray:
    """Return the median over the lines of 1/(|gamma_jj| + |gamma_kk|), a size of stiffness that FRFs can show."""
    driving = abs(np.einsum("lpp->lp", _gamma(problem, dofs)[0]))
    n = dofs.size
    found: FloatArray = np.median(1 / np.maximum(driving[:, :n] + driving[:, n:], 1e-300), axis=0)
    return found


def _starts(problem: FitProblem, dofs: NDArray[np.intp], joint: LawCoordinates) -> list[FloatArray]:
    """Return coordinates from which to start: by the compliance of each line, and the values given."""
    n = dofs.size
    both = list(range(2 * n))
    lines = interface_compliance(*_gamma(problem, dofs), (both, both))
    values = from_lines(joint.joint, joint.omega, lines)
    given = [joint.joint.values] if values is None else [values, joint.joint.values]
    return [joint.coordinates(one) for one in given]


def _together(joint: LawJoint, groups: list[FittedGroup]) -> JointEstimate:
    """Put the fits of all groups together."""
    p = len(joint.names)
    theta, covariance = np.full(p, np.nan), np.zeros((p, p))
    for group in groups:
        minimum = group.fit.minimum
        slope = group.joint.theta_slope(minimum.x)
        theta[group.which] = group.joint.theta(minimum.x)
        covariance[group.which[:, None], group.which] = slope @ inverse_information(2 * minimum.information) @ slope.T
    equations = sum(group.fit.equations for group in groups)
    degrees = max(equations - p / 2, 1)
    squares = sum(group.fit.noise_squares for group in groups) / degrees
    return JointEstimate(joint.quantities, theta, covariance, tuple(groups), squares, squares, equations)
