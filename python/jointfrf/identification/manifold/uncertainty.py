"""Uncertainty of the parameters: scatter between lines and parts of the band, and intervals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.bands import in_pieces, line_slices
from jointfrf.identification.manifold.beyond_noise import JointCalibration
from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.identification.manifold.group_fit import FAR, GroupFit
from jointfrf.identification.manifold.line_forms import FormMinimum, FormSquares
from jointfrf.identification.minimise import inverse_information
from jointfrf.identification.profile import Intervals, ProfileIntervals
from jointfrf.identification.residual_test import ResidualTest, Trend, local_excess
from jointfrf.identification.scatter import (
    BLOCKS,
    Scatter,
    Spread,
    block_members,
    chi_squared,
    scatter_of,
    spread_of_scatters,
)
from jointfrf.kernel.arguments import TINY, FloatArray

__all__ = [
    "block_scatter",
    "joint_intervals",
    "line_scatter",
    "profile_interval",
    "residual_test_of",
    "spread_of",
]

#: Probability at which parts of the band disagree on a parameter, and how many must show it.
_DISAGREE, _LEAST_PARTS = 1e-3, 3
#: A part whose information has a larger condition does not show all parameters.
_SINGULAR = 1e8
#: Squares of profiles are minimised to this.
_PRECISE = 1e-3


def line_scatter(group: GroupFit) -> tuple[FloatArray, FloatArray]:
    """Variance of the coordinates of a group from the scatter between single lines, and its degrees of freedom.

    Returns
    -------
    variance, degrees : ndarray, shape (p,)

    Notes
    -----
    As `scatter_of`, each line being a part.
    """
    pieces = line_slices(len(group.forms.squares))
    return scatter_of(group.information, (group.of_lines(own) for own in pieces))


def block_scatter(
    group: GroupFit, blocks: int = BLOCKS, motion: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Variance of the coordinates of a group from the scatter between parts of the band, and its degrees of freedom.

    With `motion`, shape (n_freq,), the parts are lines of similar motion instead.

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
    p, n_freq = group.x.size, len(group.forms.squares)
    (diagonal,) = in_pieces(n_freq, lambda own: [np.einsum("lpp->lp", group.of_lines(own).information)])
    lines = np.flatnonzero(group.used & diagonal.any(axis=1))
    if lines.size < 2 * blocks:
        return np.full(p, np.nan), np.zeros(p)
    if motion is not None:
        lines = lines[np.argsort(motion[lines], kind="stable")]
    size = np.maximum(np.diagonal(group.information), TINY)
    member = block_members(diagonal / size, lines, blocks)
    found = group.of_groups(member)
    return scatter_of(found.information.sum(axis=0), [found])


def spread_of(
    found: JointEstimate,
    inflation: float,
    calibration: JointCalibration | None = None,
    *,
    is_level_known: bool = True,
    motion: FloatArray | None = None,
) -> Spread:
    """Return by how much the variance of each parameter exceeds that from independent noise, as `spread_of_scatters`.

    Parameters
    ----------
    found : JointEstimate
    inflation : float
        By how much correlation between lines makes the variance of a mean larger, at least 1.
    calibration : JointCalibration, optional
        What smooth errors add: the residual and the scatter between blocks are compared with noise and these together.
    is_level_known : bool
        Whether the noise is known; otherwise its level is that of the residual.
    motion : ndarray, shape (n_freq,), optional
        Size of the motion on each line, if the FRFs depend on amplitude.
    """
    excess, beside = (0.0, 0.0) if calibration is None else (calibration.excess, calibration.factor)
    scale = max(found.scale / (1 + excess), 1.0) if is_level_known else found.scale
    by_noise = np.full(len(found.parameters), inflation * scale)
    lines, blocks = Scatter.none(by_noise.size), Scatter.none(by_noise.size)
    for group in found.groups:
        own = np.diagonal(group.covariance)
        for both, (variance, degrees), more in (
            (lines, line_scatter(group), inflation), (blocks, block_scatter(group), 1.0),
        ):  # fmt: skip
            with np.errstate(divide="ignore", invalid="ignore"):
                both.factor[group.which] = np.where(own > 0, more * variance / own, np.nan)
            both.degrees[group.which] = degrees / more
    spread = spread_of_scatters(by_noise, lines, blocks, beside=beside)
    if motion is None:
        return spread
    between = Scatter.none(by_noise.size)
    for group in found.groups:
        variance, degrees = block_scatter(group, motion=motion)
        own = np.diagonal(group.covariance)
        with np.errstate(divide="ignore", invalid="ignore"):
            between.factor[group.which] = np.where(own > 0, variance / own, np.nan)
        between.degrees[group.which] = degrees
    return spread.between_amplitudes(between)


def joint_intervals(found: JointEstimate, factor: FloatArray, added: FloatArray | None = None) -> Intervals:
    """Return the intervals of all parameters.

    Symmetric in the coordinate of a parameter in which noise is nearly normal; by profile likelihood where it is not.

    Parameters
    ----------
    found : JointEstimate
    factor : ndarray, shape (p,)
        By how much the variance of each parameter exceeds that from independent noise.
    added : ndarray, shape (p,), optional
        Standard error of each parameter that is not in this; of the compliance where that is its coordinate.
    """
    more = np.zeros_like(factor) if added is None else added
    place = {which: (group, i) for group in found.groups for i, which in enumerate(group.which.tolist())}
    kinds = {
        which: own for group, own in zip(found.groups, found.kinds, strict=False) for which in group.which.tolist()
    }

    def limits(which: int, probability: float) -> tuple[float, float]:
        group, i = place[which]
        own = _limits(group, i, float(factor[which]), probability)
        for kind in kinds.get(which, ()):
            own = _with_kind(own, kind, group.joint.names[i], float(factor[which]), probability)
        if not more[group.which].any():
            return own
        reach = float(special.ndtri((1 + probability) / 2)) * float(more[which])
        if group.joint.may_be_rigid(i) and not group.joint.is_stiffness[i]:
            stiffness = int(group.which[group.joint.dofs[i]])
            if not np.isfinite(limits(stiffness, probability)[1]):
                # A rigid DOF shows no damping.
                return -np.inf, np.inf
        return _widened(group, i, own, reach)

    def of_function(
        function: Callable[[FloatArray], float], used: NDArray[np.intp], probability: float
    ) -> tuple[float, float] | None:
        group = place[int(used[0])][0]
        if not np.isin(used, group.which).all() or more[used].any():
            return None
        if not np.isfinite([limits(which, probability) for which in used.tolist()]).all():
            return -np.inf, np.inf

        def of_coordinates(x: FloatArray) -> float:
            values = found.theta.copy()
            values[group.which] = group.joint.theta(x)
            return function(values)

        squares = FormSquares(group.forms, group.joint)
        own = float(factor[used].max())
        profile = ProfileIntervals(squares, group.joint, group.x, group.cost, group.covariance, own)
        return profile.of_function(of_coordinates, probability)

    return Intervals([one.name for one in found.parameters], limits, of_function)


def _with_kind(
    limits: tuple[float, float], kind: FormMinimum, name: str, factor: float, probability: float
) -> tuple[float, float]:
    """Return limits of a parameter that hold those of a kind of damping, too; zero where this has no such term."""
    names = kind.joint.names
    low, high = _limits(kind, names.index(name), factor, probability) if name in names else (0.0, 0.0)
    return min(limits[0], low), max(limits[1], high)


def _limits(group: FormMinimum, i: int, factor: float, probability: float) -> tuple[float, float]:
    """Return the limits of one parameter of a group."""
    joint, x, covariance = group.joint, group.x, group.covariance * factor
    if joint.has_profile(i, x, covariance):
        return profile_interval(group, i, factor, probability)
    reach = float(special.ndtri((1 + probability) / 2))
    if joint.is_compliance[i]:
        own = reach * float(np.sqrt(max(covariance[i, i], 0)))
        return float(1 / (x[i] + own)), float(1 / (x[i] - own))
    slope = joint.theta_slope(x)[i]
    value, own = float(joint.theta(x)[i]), reach * float(np.sqrt(max(slope @ covariance @ slope, 0)))
    return value - own, value + own


def _widened(group: GroupFit, i: int, limits: tuple[float, float], reach: float) -> tuple[float, float]:
    """Return the limits of a parameter with another, independent error of this reach.

    Of a stiffness it is one of the compliance, as it comes from compliance between the channels.
    """
    (low, high), joint = limits, group.joint
    theta = float(joint.theta(group.x)[i])
    if joint.is_compliance[i]:
        compliance = float(group.x[i])
    elif joint.is_stiffness[i] and theta > 0 and low > 0:
        compliance, reach = 1 / theta, reach / theta**2
    else:
        return float(theta - np.hypot(theta - low, reach)), float(theta + np.hypot(high - theta, reach))
    softest = compliance + np.hypot((1 / low if low > 0 else np.inf) - compliance, reach)
    stiffest = compliance - np.hypot(compliance - 1 / high, reach)
    return float(1 / softest), float(1 / stiffest) if stiffest > 0 else np.inf


def profile_interval(group: FormMinimum, i: int, factor: float, probability: float = 0.95) -> tuple[float, float]:
    """Interval of one parameter of a group by profile likelihood.

    Parameters
    ----------
    group : FormMinimum
        Of a group of DOFs.
    i : int
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
    The squares are the quadratic forms of the last linearisation. Of springs without cross terms they are those of
    values of the compliance a = 1/k >= 0, or of the damping.
    """
    joint = group.joint.of_profile(i)
    best = group if joint is group.joint else joint.lowest(group.forms, joint.coordinates(group.joint.theta(group.x)))
    profile = ProfileIntervals(
        FormSquares(group.forms, joint), joint, best.x, best.cost, best.covariance, factor,
        (lambda x, held: joint.lowest(group.forms, x, held, _PRECISE).cost) if joint.is_compliance.any() else None,
    )  # fmt: skip
    if not (joint.may_be_rigid(i) and _may_be_rigid(group, int(joint.dofs[i]), factor, probability)):
        return profile.of(i, probability)
    # A rigid DOF shows no damping.
    return (profile.limit(i, 1, probability), np.inf) if joint.is_stiffness[i] else (-np.inf, np.inf)


def _may_be_rigid(group: FormMinimum, dof: int, factor: float, probability: float) -> bool:
    """Whether the squares of a rigid DOF, which has none of its parameters, exceed their minimum by chance."""
    start = group.x.copy()
    start[dof] = 0.0
    rigid = group.joint.lowest(group.forms, start, dof, _PRECISE)
    parameters = int(np.count_nonzero(group.joint.dofs == dof))
    return bool(rigid.cost - group.cost < chi_squared(probability, parameters) * factor / 2)


def residual_test_of(
    found: JointEstimate,
    freq_hz: FloatArray,
    inflation: float,
    spread: Spread,
    calibration: JointCalibration | None = None,
) -> ResidualTest:
    """Compare the residual with the noise.

    Parameters
    ----------
    found : JointEstimate
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    inflation : float
        By how much correlation between lines makes the variance of a mean larger.
    spread : Spread
        Variance factors of the parameters.
    calibration : JointCalibration, optional
        What smooth errors add: the residual is compared with noise and these together.

    Notes
    -----
    A mean square of N complex residuals has the standard deviation 1/sqrt(N), its root half of that; the noise level,
    found from as many data, has the same. Parts of the band agree on a parameter where the squares of their differences
    from the whole, over their variance, are those of chi^2.
    """
    sigma = float(np.sqrt(2 * inflation / max(found.equations, 1.0)) / 2)
    added = 1.0
    if calibration is not None:
        added += calibration.excess
        sigma = float(np.hypot(sigma, calibration.excess_error / added / 2))
    factor = np.fmax(np.maximum(spread.information, inflation), spread.lines)
    trends = tuple(t for group in found.groups for t in _trends(group, freq_hz, factor[group.which], calibration))
    ratio, of_all = float(np.sqrt(found.excess / added)), _ratio_of_all(found) / np.sqrt(added)
    test = ResidualTest(ratio, sigma, trends=trends, of_all=of_all)
    if not test.is_large:
        return test
    squares, expected = np.zeros((2, freq_hz.size))
    for group in found.groups:
        squares += group.forms.at(group.joint.compliance(group.x))[0]
        expected += group.used * (group.equations / max(float(np.count_nonzero(group.used)), 1.0))
    return test._replace(local=local_excess(squares, expected, freq_hz))


def _ratio_of_all(found: JointEstimate) -> float:
    """Return the residual over the noise with the lines left out, by their distance from what fits the joint."""
    if all(group.used.all() for group in found.groups):
        return float("nan")
    squares = equations = 0.0
    for group in found.groups:
        out = ~group.used
        own = group.problem.equations()[out]
        apart = np.full(own.size, FAR * group.joint.n**2) if group.on is None else group.on.squares[out]
        # The distance is that of the smooth FRFs, without their noise.
        known = np.isfinite(apart)
        squares += group.noise_squares + float(apart[known].sum() + own[known].sum())
        equations += group.equations + float(own[known].sum())
    return float(np.sqrt(squares / max(equations - len(found.parameters) / 2, 1)))


def _trends(
    group: GroupFit, freq_hz: FloatArray, factor: FloatArray, calibration: JointCalibration | None
) -> list[Trend]:
    """Return the parameters that parts of the band disagree on."""
    lines = np.flatnonzero(group.used)
    p = group.x.size
    if lines.size < BLOCKS * (p + 2):
        return []
    whole = group.covariance
    # In parameters, not in coordinates: where only k drifts, c/k does, and c does not.
    theta, slope = group.joint.theta(group.x), group.joint.theta_slope(group.x)
    member = group.band_parts
    gradient, information = group.of_groups(member)
    size = np.sqrt(np.maximum(np.einsum("bpp->bp", information), TINY))
    value = abs(np.linalg.eigvalsh(information / (size[:, :, None] * size[:, None, :])))
    seen = value.max(axis=1) <= _SINGULAR * value.min(axis=1)
    if not seen.any():
        return []
    values, changes, errors = (np.full((BLOCKS, p), np.nan) for _ in range(3))
    covariance = inverse_information(2 * information[seen])
    step = 2 * (covariance @ gradient[seen, :, None])[..., 0]
    values[seen] = [group.joint.theta(group.x + one) for one in step]
    with np.errstate(invalid="ignore"):
        changes[seen] = step @ slope.T
        variance = np.einsum("ij,bjk,ik->bi", slope, covariance - whole, slope)
        variance = np.maximum(variance, 0) * factor
        if calibration is not None:
            more = calibration.between(group, seen, 2 * covariance)
            variance += np.einsum("ij,bjk,ik->bi", slope, more, slope)
        errors[seen] = np.sqrt(variance)
    found = []
    for i, name in enumerate(group.joint.names):
        known = np.isfinite(changes[:, i]) & (errors[:, i] > 0)
        # A part that does not see the parameter says nothing about it.
        known &= errors[:, i] < abs(theta[i])
        if np.count_nonzero(known) < _LEAST_PARTS:
            continue
        squares = ((changes[known, i] / errors[known, i]) ** 2).sum()
        probability = float(special.chdtrc(np.count_nonzero(known) - 1, squares))
        if probability < _DISAGREE / p:
            centres = member @ freq_hz / member.sum(axis=1)
            found.append(Trend(name, centres[known], values[known, i], probability))
    return found
