"""Uncertainty of the parameters: from noise, from the scatter between parts of the band, by profile likelihood."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from jointfrf.frf.bands import in_pieces, line_slices
from jointfrf.frf.quantiles import medians
from jointfrf.identification.compliance_fit.diagonal_minimum import lowest_minimum
from jointfrf.identification.compliance_fit.estimator import FittedGroup, JointEstimate
from jointfrf.identification.compliance_fit.joint_terms import DiagonalJoint, terms_of
from jointfrf.identification.compliance_fit.line_forms import (
    LineForms,
    LineParts,
    minimise_forms,
)
from jointfrf.kernel.arguments import FloatArray

__all__ = ["BLOCKS", "LikelihoodIntervals", "Spread", "block_scatter", "line_scatter", "profile_interval", "spread_of"]

#: Squares of profiles are minimised to this.
_PRECISE = 1e-3
#: Relative standard error of a compliance from which on intervals come from the profile of the likelihood.
_CURVED = 0.1
#: Parts of the band that the jackknife leaves out in turn.
BLOCKS = 10
#: Directions of less information than this share of the largest are not seen.
_SEEN = 1e-12
#: Probability at which a scatter that exceeds the noise is taken for chance.
_CHANCE = 0.95
_TINY = float(np.finfo(float).tiny)


class Spread(NamedTuple):
    """Factors by which the variance of parameters exceeds that from independent noise, shape (p,) each.

    Attributes
    ----------
    information : ndarray
        From the correlation between lines, and from a residual larger than the noise.
    lines : ndarray
        From the scatter between lines, which noise that is not circular makes larger; NaN where there are too few.
    blocks : ndarray
        From the scatter between parts of the band; NaN where there are too few lines.
    factor : ndarray
        The one used.
    chance : ndarray
        Probability that parts of the band scatter so much by noise alone; 1 where there are too few lines.
    """

    information: FloatArray
    lines: FloatArray
    blocks: FloatArray
    factor: FloatArray
    chance: FloatArray


def line_scatter(group: FittedGroup) -> tuple[FloatArray, FloatArray]:
    """Variance of the coordinates of a group from the scatter between single lines, and its degrees of freedom.

    Returns
    -------
    variance, degrees : ndarray, shape (p,)

    Notes
    -----
    It takes noise as independent between lines, but neither its size nor its direction in the complex plane from the
    weights. The gradient g_l of a line, of information A_l out of A, moves the coordinates by A^-1 g_l. Where noise is
    as the weights say, g_l g_l^T is in the mean half of A_l - A_l A^-1 A_l, the second term being what the fit has
    taken up: the sum of the squares is scaled by that.
    """
    minimum = group.fit.minimum
    pieces = line_slices(len(minimum.forms.squares))
    return _scatter(minimum.information, (minimum.of_lines(own) for own in pieces))


def block_scatter(group: FittedGroup, blocks: int = BLOCKS) -> tuple[FloatArray, FloatArray]:
    """Variance of the coordinates of a group from the scatter between parts of the band, and its degrees of freedom.

    Returns
    -------
    variance, degrees : ndarray, shape (p,)
        NaN and 0 where there are fewer than two lines a block.

    Notes
    -----
    It needs no noise model, and includes what the model of the joint cannot follow over frequency. As `line_scatter`
    with parts of the band for lines; with equal parts that is the block jackknife to first order. A part that holds
    most of the information on a parameter leaves few degrees of freedom.
    """
    minimum = group.fit.minimum
    p, n_freq = minimum.x.size, len(minimum.forms.squares)
    (diagonal,) = in_pieces(n_freq, lambda own: [np.einsum("lpp->lp", minimum.of_lines(own).information)])
    lines = np.flatnonzero(group.fit.trusted & diagonal.any(axis=1))
    if lines.size < 2 * blocks:
        return np.full(p, np.nan), np.zeros(p)
    # Blocks of equal information, so that each says about as much as the others.
    size = np.maximum(np.diagonal(minimum.information), _TINY)
    share = (diagonal[lines] / size).sum(axis=1)
    share = share / share.sum() + 1 / lines.size
    member = np.zeros((blocks, len(diagonal)))
    member[((np.cumsum(share) - share / 2) / share.sum() * blocks).astype(int), lines] = 1
    found = minimum.of_groups(member)
    return _scatter(found.information.sum(axis=0), [found])


def _scatter(whole: FloatArray, pieces: Iterable[LineParts]) -> tuple[FloatArray, FloatArray]:
    """Return the variance that the gradients of parts show, and its degrees of freedom, shape (p,) each.

    Parameters
    ----------
    whole : ndarray, shape (p, p)
        Sum of the information of all parts.
    pieces : iterable of LineParts
    """
    size = np.sqrt(np.maximum(np.diagonal(whole), _TINY))
    value, vector = np.linalg.eigh(whole / np.outer(size, size))
    # Coordinates in which the whole information is 1; directions that the data do not see are left out.
    seen = value > _SEEN * value[-1]
    root = vector[:, seen] / np.sqrt(value[seen]) / size[:, None]
    variance, (p, k) = (root**2).sum(axis=1), root.shape
    to_root = (root[:, None, :, None] * root[None, :, None, :]).reshape(p * p, k * k)
    to_steps, to_variance = root @ root.T, (root[:, :, None] * root[:, None, :]).reshape(p, k * k).T
    taken, of_expected, of_steps = np.zeros((3, p))
    for piece in pieces:
        # Information in those coordinates; with the root on one side, and on both.
        within = piece.information.reshape(-1, p * p) @ to_root
        squared = within.reshape(-1, k).T @ within.reshape(-1, k)
        taken += np.einsum("ar,rs,as->a", root, squared, root)
        of_expected += ((within @ to_variance) ** 2).sum(axis=0)
        of_steps += ((piece.gradient @ to_steps) ** 2).sum(axis=0)
    left = np.maximum(variance - taken, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        scatter = of_steps * variance / left
        degrees = variance**2 / of_expected * left / variance
    return scatter, np.nan_to_num(degrees)


def spread_of(found: JointEstimate, inflation: float, *, is_level_known: bool = True) -> Spread:
    """Return by how much the variance of each parameter exceeds that from independent noise of the level known.

    Parameters
    ----------
    found : JointEstimate
    inflation : float
        By how much correlation between lines makes the variance of a mean larger, at least 1.
    is_level_known : bool
        Whether the noise is known; otherwise its level is that of the residual.

    Notes
    -----
    The largest of information, scatter between lines and scatter between blocks; the latter two only where they exceed
    the former by more than chance, for one parameter or for all together.
    """
    scale = max(found.scale, 1.0) if is_level_known else found.scale
    by_noise = np.full(len(found.parameters), inflation * scale)
    by_lines, by_blocks, of_lines, of_blocks = (np.full_like(by_noise, np.nan) for _ in range(4))
    for group in found.groups:
        own = np.diagonal(group.fit.minimum.covariance)
        scatter, of_lines[group.which] = line_scatter(group)
        blocks, of_blocks[group.which] = block_scatter(group)
        with np.errstate(divide="ignore", invalid="ignore"):
            by_lines[group.which] = np.where(own > 0, inflation * scatter / own, np.nan)
            by_blocks[group.which] = np.where(own > 0, blocks / own, np.nan)
    factor = _larger_than_chance(by_noise, by_lines, of_lines / inflation)
    with np.errstate(divide="ignore", invalid="ignore"):
        chance = np.nan_to_num(special.chdtrc(of_blocks, of_blocks * by_blocks / factor), nan=1.0)
    factor = _larger_than_chance(factor, by_blocks, of_blocks)
    return Spread(by_noise, by_lines, by_blocks, factor, chance)


def _larger_than_chance(factor: FloatArray, other: FloatArray, degrees: FloatArray) -> FloatArray:
    """Return variance factors, raised to others of few degrees of freedom where these are larger by more than chance.

    By the mean over the parameters where this is; each by Student's t for its few degrees.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = other / factor
    known = np.isfinite(ratio) & (degrees >= 2)
    if not known.any():
        return factor
    raised = factor.copy()
    count, few = int(known.sum()), float(medians(degrees[known]))
    if (mean := float(ratio[known].mean())) > _chi_squared(_CHANCE, few * count) / (few * count):
        raised *= mean
    single = _chi_squared(1 - (1 - _CHANCE) / count, degrees[known]) / degrees[known]
    student = (special.stdtrit(degrees[known], 0.975) / special.ndtri(0.975)) ** 2
    larger = np.where(ratio[known] > single, student * other[known], 0)
    raised[known] = np.maximum(raised[known], larger)
    return raised


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
    limit = float(_chi_squared(probability, 1) * factor / 2)
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
    return bool(rigid.cost - minimum.cost < _chi_squared(probability, parameters) * factor / 2)


def _chi_squared(probability: float, degrees: float | FloatArray) -> Any:
    """Quantile of chi-squared, without the time that scipy.stats takes to import."""
    return 2 * special.gammaincinv(np.asarray(degrees) / 2, probability)


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
