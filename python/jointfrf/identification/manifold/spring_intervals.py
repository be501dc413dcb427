"""Intervals of the parameters of springs: symmetric in the compliance, or by profile likelihood."""

from __future__ import annotations

import numpy as np
from scipy import special

from jointfrf.identification.manifold.coordinates import DiagonalJoint, terms_of
from jointfrf.identification.manifold.estimate import FittedGroup, JointEstimate
from jointfrf.identification.manifold.line_forms import (
    LineForms,
    lowest_minimum,
    minimise_forms,
)
from jointfrf.identification.manifold.scatter import chi_squared
from jointfrf.kernel.arguments import FloatArray

__all__ = ["LikelihoodIntervals", "profile_interval"]

#: Squares of profiles are minimised to this.
_PRECISE = 1e-3


#: Relative standard error of a compliance from which on intervals come from the profile of the likelihood.
_CURVED = 0.1


class LikelihoodIntervals:
    """Intervals of the parameters of a fit, by their probability.

    Parameters
    ----------
    found : JointEstimate
    factor : ndarray, shape (p,)
        By how much the variance of each parameter exceeds that from independent noise.
    added : ndarray, shape (p,), optional
        Standard error of each parameter that is not in this; of the compliance where a joint without cross terms has a
        stiffness.
    """

    def __init__(self, found: JointEstimate, factor: FloatArray, added: FloatArray | None = None) -> None:
        self.found, self.factor = found, factor
        self.added = np.zeros_like(factor) if added is None else added
        self._known: dict[float, dict[str, tuple[float, float]]] = {}

    def __call__(self, probability: float) -> dict[str, tuple[float, float]]:
        """Return the interval of every parameter that contains the true one with the given probability.

        Symmetric in the compliance of a DOF that is well determined, in which noise is nearly normal; by profile
        likelihood where it is not.
        """
        if probability not in self._known:
            by_name: dict[str, tuple[float, float]] = {}
            for group in self.found.groups:
                own = [_limits(group, i, float(self.factor[which]), probability) for i, which in enumerate(group.which)]
                reach = float(special.ndtri((1 + probability) / 2)) * self.added[group.which]
                names = group.joint.names
                by_name |= dict(zip(names, _widened(group, own, reach) if reach.any() else own, strict=True))
            self._known[probability] = {one.name: by_name[one.name] for one in self.found.parameters}
        return self._known[probability]


def _limits(group: FittedGroup, i: int, factor: float, probability: float) -> tuple[float, float]:
    """Return the limits of one parameter of a group."""
    terms, x = terms_of(group.joint), group.fit.minimum.x
    covariance = group.fit.minimum.covariance * factor
    reach = float(special.ndtri((1 + probability) / 2))
    a = int(terms.pairs[i, 0])
    is_diagonal = isinstance(group.joint, DiagonalJoint)
    if is_diagonal and np.sqrt(max(covariance[a, a], 0)) > _CURVED * x[a]:
        return profile_interval(group, i, factor, probability)
    if is_diagonal and terms.kinds[i] == 0:
        own = reach * float(np.sqrt(max(covariance[i, i], 0)))
        return float(1 / (x[i] + own)), float(1 / (x[i] - own))
    slope = group.joint.theta_slope(x)[i]
    value, own = float(group.joint.theta(x)[i]), reach * float(np.sqrt(max(slope @ covariance @ slope, 0)))
    return value - own, value + own


def _widened(group: FittedGroup, limits: list[tuple[float, float]], reach: FloatArray) -> list[tuple[float, float]]:
    """Return the limits of all parameters of a group with another, independent error of this reach.

    Of a stiffness it is one of the compliance, as it comes from compliance between the channels.
    """
    theta, x, terms = group.joint.theta(group.fit.minimum.x), group.fit.minimum.x, terms_of(group.joint)
    is_diagonal = isinstance(group.joint, DiagonalJoint)
    found: list[tuple[float, float]] = []
    for i, ((low, high), own) in enumerate(zip(limits, reach, strict=True)):
        is_stiffness = terms.kinds[i] == 0 and terms.pairs[i, 0] == terms.pairs[i, 1]
        if is_diagonal and is_stiffness:
            found.append(_softened(x[i], low, high, own))
        elif is_stiffness and theta[i] > 0 and low > 0:
            found.append(_softened(1 / theta[i], low, high, own / theta[i] ** 2))
        elif is_diagonal and not np.isfinite(found[terms.pairs[i, 0]][1]):
            # A rigid DOF shows no damping.
            found.append((-np.inf, np.inf))
        else:
            found.append((theta[i] - np.hypot(theta[i] - low, own), theta[i] + np.hypot(high - theta[i], own)))
    return [(float(low), float(high)) for low, high in found]


def _softened(compliance: float, low: float, high: float, own: float) -> tuple[float, float]:
    """Return the limits of a stiffness whose compliance has another error of this reach."""
    softest = compliance + np.hypot((1 / low if low > 0 else np.inf) - compliance, own)
    stiffest = compliance - np.hypot(compliance - 1 / high, own)
    return 1 / softest, 1 / stiffest if stiffest > 0 else np.inf


def profile_interval(group: FittedGroup, index: int, factor: float, probability: float = 0.95) -> tuple[float, float]:
    """Interval of one parameter of a joint without cross terms, by profile likelihood.

    Parameters
    ----------
    group : FittedGroup
        Its joint is a `DiagonalJoint`.
    index : int
        Parameter among those of the group.
    factor : float
        By how much the variance exceeds that from independent noise.
    probability : float

    Returns
    -------
    low, high : float
        In units of the parameter; inf where the data give no limit.

    Notes
    -----
    The squares of the quadratic forms are minimised over all other coordinates, for values of the compliance a = 1/k
    >= 0 or of the damping; the interval is where they exceed their minimum by the quantile of chi^2, times the variance
    factor.
    """
    terms = terms_of(group.joint)
    of_stiffness = terms.kinds[index] == 0
    joint = DiagonalJoint(terms, by_rate=bool(of_stiffness))
    forms = group.fit.forms
    start = joint.coordinates(group.joint.theta(group.fit.minimum.x))
    if of_stiffness:
        start = group.fit.minimum.x
    best = lowest_minimum(forms, joint, start)
    limit = float(chi_squared(probability, 1) * factor / 2)
    error = np.sqrt(np.maximum(np.diagonal(best.covariance), 0) * factor)[index]
    may_be_rigid = _may_be_rigid(group, int(joint.dofs[index]), factor, probability)
    if may_be_rigid and not of_stiffness:
        # A rigid DOF shows no damping.
        return -np.inf, np.inf
    profile = _Profile(forms, joint, index, best.x, best.cost, limit)
    reach = special.ndtri((1 + probability) / 2) * error
    low = 0.0 if may_be_rigid else profile.crossing(-1, reach, 0.0 if of_stiffness else -np.inf)
    high = profile.crossing(1, reach, np.inf)
    if of_stiffness:
        with np.errstate(divide="ignore"):
            return (float(np.divide(1, high)) if high > 0 else np.inf, 1 / low if low > 0 else np.inf)
    return low, high


def _may_be_rigid(group: FittedGroup, dof: int, factor: float, probability: float) -> bool:
    """Whether the squares of a rigid DOF, which has none of its parameters, exceed their minimum by chance."""
    minimum = group.fit.minimum
    start = minimum.x.copy()
    start[dof] = 0.0
    rigid = lowest_minimum(group.fit.forms, group.joint, start, dof, _PRECISE)
    parameters = int(np.count_nonzero(terms_of(group.joint).pairs[:, 0] == dof))
    return bool(rigid.cost - minimum.cost < chi_squared(probability, parameters) * factor / 2)


class _Profile:
    """Squares beyond their minimum, less the limit, as a function of one coordinate."""

    def __init__(
        self, forms: LineForms, joint: DiagonalJoint, index: int, best: FloatArray, cost: float, limit: float
    ) -> None:
        self.forms, self.joint, self.index = forms, joint, index
        self.best, self.cost, self.limit = best, cost, limit

    def excess(self, value: float) -> float:
        """Return the squares at a value of the coordinate, minimised over the others, beyond the limit."""
        start = self.best.copy()
        start[self.index] = value
        most = self.cost + self.limit
        near = minimise_forms(self.forms, self.joint, start, self.index, _PRECISE).cost - most
        # A value is excluded only if no other damping brings it back.
        return near if near <= 0 else lowest_minimum(self.forms, self.joint, start, self.index, _PRECISE).cost - most

    def crossing(self, sign: int, reach: float, bound: float) -> float:
        """Return where the excess crosses zero on one side, or the bound where it does not."""
        at = float(self.best[self.index])
        if not np.isfinite(reach) or reach <= 0:
            return bound
        near, step = at, reach
        for _ in range(30):
            there = at + sign * step
            if sign < 0 and there <= bound:
                there = bound
            if self.excess(there) > 0:
                from scipy import optimize

                root: float = optimize.brentq(self.excess, near, there, xtol=1e-3 * reach, rtol=1e-6)
                return root
            if there == bound:
                return bound
            near, step = there, 1.7 * step
        return sign * np.inf if bound == sign * np.inf or sign > 0 else bound
