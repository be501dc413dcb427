"""Uncertainty of the parameters of a joint: the likelihood on the manifold linearised, intervals, residual test."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.calibration import CalibrationErrors
from jointfrf.frf.cross_axis import CrossAxis
from jointfrf.frf.moving_mass import MovingMass
from jointfrf.identification.linearised import Linearised, LineParts
from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.identification.manifold.group_fit import FAR, GroupFit, effects_of
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.line_forms import FormMinimum, FormSquares
from jointfrf.identification.minimise import inverse_information
from jointfrf.identification.mixed import (
    Added,
    Effect,
    added_by,
    mass_effects,
    parameter_ratio,
    smooth_effects,
    student_factor,
)
from jointfrf.identification.profile import Intervals, ProfileIntervals
from jointfrf.identification.residual_test import ResidualTest, Trend, local_excess
from jointfrf.identification.scatter import BLOCKS, Spread, chi_squared, spread_of
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = [
    "GroupLinearised",
    "GroupUncertainty",
    "JointUncertainty",
    "joint_intervals",
    "profile_interval",
    "residual_test_of",
    "uncertainty_of_joint",
]

#: Probability below which parts of the band disagree on a parameter, and number of parts that must determine it.
_DISAGREE, _LEAST_PARTS = 1e-3, 3
#: Condition number of the information of a part above which it does not determine all parameters.
_SINGULAR = 1e8
#: Tolerance of the squares of profiles.
_PRECISE = 1e-3


@dataclass(frozen=True)
class GroupLinearised(Linearised):
    """The likelihood of a group of joint DOFs at its minimum, measured by the channels of `frfs`."""

    group: GroupFit
    frfs: InterfaceFrfs | None = None

    def __post_init__(self) -> None:
        """Copy attributes of the group."""
        group, p = self.group, self.group.x.size
        slope = group.joint.theta_slope(group.x)
        # Noise is nearly normal in a compliance, and a rigid DOF has no finite slope.
        in_coordinate = group.joint.is_compliance | ~np.isfinite(slope).all(axis=1)
        known = {
            "n_freq": len(group.forms.squares),
            "information": 2 * group.information,
            "covariance": group.covariance,
            "determined": np.ones(p, np.bool_),
            "slope": np.where(in_coordinate[:, None], np.eye(p), slope),
            "priors": LineParts(np.zeros((0, p)), np.zeros((0, p, p))),
        }
        vars(self).update(known)

    @property
    def measured_shape(self) -> tuple[int, int]:
        """Numbers of responses and forces."""
        shape = (0, 0) if self.frfs is None else self.frfs.measured.shape[1:]
        return shape[0], shape[1]

    def lines(self, which: slice) -> LineParts:
        """Return the parts of some lines."""
        gradient, information = self.group.of_lines(which)
        return LineParts(2 * gradient, 2 * information)

    def errors(self, masks: NDArray[np.bool_], lines: slice) -> Iterator[tuple[ComplexArray, FloatArray]]:
        """Yield the effect of a relative error of 1 of the FRFs in each mask."""
        assert self.frfs is not None
        frfs = self.frfs.on_lines(lines)
        yield from self.changes((self._entries(frfs, mask) for mask in masks), lines)

    def _entries(self, frfs: InterfaceFrfs, mask: NDArray[np.bool_]) -> ComplexArray:
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        own = np.where(mask[np.ix_(rows, columns)], frfs.measured[:, rows[:, None], columns], 0)
        change = frfs.responses[:, rows] @ own @ frfs.forces[:, columns].T
        return frfs.entries_of(self.group.dofs, np.asarray(change, np.complex128))

    def changes(self, of_entries: Iterator[ComplexArray], lines: slice) -> Iterator[tuple[ComplexArray, FloatArray]]:
        """Yield the effect of changes of the entries of gamma, shape (n_lines, q), m/N."""
        for gradient, squares in effects_of(self.group, of_entries, lines):
            yield 2 * gradient, squares

    def cross_axis_effects(self, found: CrossAxis | None) -> list[Effect]:
        """Return shares of other joint DOFs in the channels: the sum of impact and sensor varies as their difference.

        The mean of h_pq and h_qp contains the sum only.
        """
        if found is None or self.frfs is None:
            return []
        gamma, transform = self.frfs.smooth_gamma, found.transform

        def changes(which: NDArray[np.intp]) -> Iterator[ComplexArray]:
            for q, d, variance in zip(found.channels[which], found.dofs[which], found.variance[which], strict=True):
                yield gamma[:, :, d, None] * (np.sqrt(variance) * transform[:, q])

        return [self._effect(changes(which), float(which.size)) for which in found.alike]

    def position_effects(self, errors: tuple[FloatArray, FloatArray] | None) -> list[Effect]:
        """Return errors of the positions of channels, of one standard deviation."""
        if errors is None or self.frfs is None:
            return []
        gamma = self.frfs.smooth_gamma
        return [self._effect(rows @ gamma + gamma @ columns.T for rows, columns in zip(*errors, strict=True))]

    def _effect(self, changes: Iterable[ComplexArray], degrees: float = np.inf) -> Effect:
        """Return errors of variance 1 that change FRFs between the joint DOFs, each of shape (n_freq, 2 n, 2 n)."""
        frfs, group = self.frfs, self.group
        assert frfs is not None
        entries = (frfs.entries_of(group.dofs, change) for change in changes)
        own = [
            (group.band_parts @ line.real, rest.sum()) for line, rest in self.changes(entries, slice(0, self.n_freq))
        ]
        columns, squares = (np.array(one) for one in zip(*own, strict=True))
        return Effect(columns, 1.0, degrees, float(squares.sum()))

    def side_effects(self, compliance: FloatArray | None) -> list[Effect]:
        """Return errors of the models that corrected the FRFs, and of a compliance that the sides add, m/N.

        The first are off by one standard deviation. The second has itself as standard deviation.
        """
        group, found, every = self.group, list[Effect](), slice(0, self.n_freq)
        errors = None if self.frfs is None else self.frfs.errors_of(group.dofs)
        if errors is not None and errors.shape[1]:
            own = [group.band_parts @ line.real for line, _ in self.changes(iter(errors.swapaxes(0, 1)), every)]
            # Lines outside all parts of the band have no weight.
            found.append(Effect(np.array(own), 1.0))
        if compliance is not None:
            steps = 2 * _softer(group, compliance[group.dofs]) @ self.covariance
            of_compliance = group.joint.is_compliance
            if of_compliance.any():
                # Without the part that the damping absorbs.
                own_step = np.diag(compliance[group.dofs])[:, of_compliance[: len(group.dofs)]]
                steps[:, of_compliance] = own_step / group.joint.compliance_slope(group.x)[of_compliance]
            found.append(Effect((steps @ self.information)[:, None], 1.0))
        return found


def _softer(group: GroupFit, compliance: FloatArray) -> FloatArray:
    """Return the change of the gradient for a larger compliance of each DOF, shape (n, p)."""
    joint, forms = group.joint, group.forms
    entries = joint.compliance(group.x)
    adjoint = joint.slope(group.x, entries).conj()
    # dR = (1 - R Z) dC (1 - Z R)
    kept = np.eye(joint.n) - joint.matrix(entries) * joint.springs
    change = np.einsum("lad,d,lbd->ldab", kept, compliance, kept)[:, :, joint.rows, joint.columns]
    weighted = np.einsum("lqr,ldr->ldq", forms.weight, change)
    found: FloatArray = np.einsum("lqp,ldq->dp", adjoint, weighted).real
    return found


class GroupUncertainty(NamedTuple):
    """Uncertainty of one group of DOFs: smooth errors include channels and set-ups, but not sides.

    `factor` is the variance factor of the intervals by `spread` and smooth errors, as in `JointUncertainty`.
    """

    at: GroupLinearised
    smooth: list[Effect]
    smooth_added: Added
    spread: Spread
    factor: FloatArray


class JointUncertainty(NamedTuple):
    """Uncertainty of all parameters of a joint.

    Attributes
    ----------
    groups : tuple
        Uncertainty of each group of DOFs.
    spread : Spread
        Variance factors by scatter, of all parameters.
    smooth, factor : ndarray, shape (p,)
        Variance factors of intervals: by smooth errors of channels, and by these and `spread` together.
    added : ndarray, shape (p,)
        Standard error by the sides, to be added in `joint_intervals`.
    covariance : ndarray, shape (p, p)
        Covariance of the parameters.
    excess, excess_error : float
        Mean square of the residual that smooth errors leave, in units of the noise, and its standard deviation.
    """

    groups: tuple[GroupUncertainty, ...]
    spread: Spread
    smooth: FloatArray
    factor: FloatArray
    added: FloatArray
    covariance: FloatArray
    excess: float = 0.0
    excess_error: float = 0.0


def uncertainty_of_joint(
    found: JointEstimate,
    freq_hz: FloatArray,
    inflation: float,
    frfs: InterfaceFrfs | None = None,
    errors: CalibrationErrors | None = None,
    compliance: FloatArray | None = None,
    mass: MovingMass | None = None,
    cross_axis: CrossAxis | None = None,
    position_errors: tuple[FloatArray, FloatArray] | None = None,
    *,
    is_level_known: bool = True,
    motion: FloatArray | None = None,
) -> JointUncertainty:
    """Return the uncertainty of the parameters by noise, scatter, channels and sides.

    Parameters
    ----------
    found : JointEstimate
        Estimate of the joint.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    inflation : float
        Factor by which correlation between lines increases the variance of a mean, at least 1.
    frfs : InterfaceFrfs, optional
        FRFs of the channels; needed for errors of these.
    errors : CalibrationErrors, optional
        Smooth errors of channels and set-ups.
    compliance : ndarray, shape (n,), optional
        Compliance that the sides add to each joint DOF, m/N or rad/(N m).
    mass : MovingMass, optional
        Mass of a sensor that was removed from the FRFs.
    cross_axis : CrossAxis, optional
        Shares of other joint DOFs in the channels.
    position_errors : tuple of ndarray, shapes (n_errors, 2 n, 2 n), optional
        Joint DOFs that errors of the positions of channels mix.
    is_level_known : bool
        Whether the noise is known; if not, the residual gives its level.
    motion : ndarray, shape (n_freq,), optional
        Size of the motion on each line, if the FRFs depend on amplitude.
    """
    p = len(found.parameters)
    columns, equations = list[tuple[GroupLinearised, list[Effect], Added]](), max(found.equations - p / 2, 1.0)
    for group in found.groups:
        at = GroupLinearised(group, frfs)
        smooth = smooth_effects(at, errors, freq_hz, at.measured_shape, group.band_parts)
        if frfs is not None:
            smooth += mass_effects(at, mass, freq_hz, frfs.measured, group.band_parts)
        smooth += at.cross_axis_effects(cross_axis) + at.position_effects(position_errors)
        columns.append((at, smooth, added_by(smooth, at)))
    excess = sum(added.squares for *_, added in columns) / equations
    error = float(np.linalg.norm([added.squares_error for *_, added in columns])) / equations
    scale = max(found.scale / (1 + excess), 1.0) if is_level_known else found.scale
    groups, covariance = list[GroupUncertainty](), found.covariance.copy()
    factor, of_smooth, of_sides = np.zeros((3, p))
    spreads = np.ones((4, p))
    for at, smooth, added in columns:
        spread = spread_of(at, inflation * scale, inflation, parameter_ratio(added.covariance, at), motion)
        sides, which, joint = added_by(at.side_effects(compliance), at), at.group.which, at.group.joint
        spreads[:, which] = spread
        factor[which] = _interval_factor(spread, added, at)
        of_smooth[which] = factor[which] - spread.factor
        own = np.einsum("ij,jk,ik->i", at.slope, sides.covariance, at.slope)
        of_sides[which] = np.sqrt(np.maximum(own, 0)) * joint.compliance_slope(at.group.x)
        root, slope = np.sqrt(spread.factor), joint.theta_slope(at.group.x)
        with np.errstate(invalid="ignore"):
            own = slope @ (added.covariance + sides.covariance) @ slope.T
            whole = covariance[which[:, None], which] * np.outer(root, root)
        covariance[which[:, None], which] = whole + np.nan_to_num(own, posinf=0.0, neginf=0.0)
        groups.append(GroupUncertainty(at, smooth, added, spread, factor[which]))
    return JointUncertainty(
        tuple(groups), Spread(*spreads), of_smooth, factor, of_sides, covariance, float(excess), error
    )


def _interval_factor(spread: Spread, added: Added, at: Linearised) -> FloatArray:
    """Return the variance factor of an interval, with Student's t for the part that was estimated."""
    more = parameter_ratio(added.covariance, at)
    estimated = more * added.estimated
    whole = spread.factor + more
    return np.asarray(whole * student_factor(whole - estimated, estimated, added.degrees))


def joint_intervals(found: JointEstimate, factor: FloatArray, added: FloatArray | None = None) -> Intervals:
    """Return the intervals of all parameters.

    Symmetric in the coordinate of a parameter if noise is nearly normal in it; else by profile likelihood.

    Parameters
    ----------
    found : JointEstimate
        Estimate of the joint.
    factor : ndarray, shape (p,)
        Variance of each parameter over its variance for independent noise.
    added : ndarray, shape (p,), optional
        Additional standard error of each parameter; of the compliance if a compliance is its coordinate.
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
        if group.joint.may_be_rigid(i) and not group.joint.is_stiffness[i]:
            stiffness = int(group.which[group.joint.dofs[i]])
            if not np.isfinite(limits(stiffness, probability)[1]):
                # A rigid DOF does not determine damping.
                return -np.inf, np.inf
        return _widened(group, i, own, float(special.ndtri((1 + probability) / 2)) * float(more[which]))

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
    """Return limits of a parameter that contain the limits of another kind of damping; zero without such a term."""
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
        spring = float(joint.springs[joint.dofs[i]])
        return float(1 / (x[i] + own)) - spring, float(1 / (x[i] - own)) - spring
    slope = joint.theta_slope(x)[i]
    value, own = float(joint.theta(x)[i]), reach * float(np.sqrt(max(slope @ covariance @ slope, 0)))
    return value - own, value + own


def _widened(group: GroupFit, i: int, limits: tuple[float, float], reach: float) -> tuple[float, float]:
    """Return the limits of a parameter with an independent error of this reach, of the compliance for a stiffness."""
    (low, high), joint = limits, group.joint
    theta = float(joint.theta(group.x)[i])
    if joint.is_compliance[i] and theta > 0:
        compliance = 1 / theta
    elif joint.is_compliance[i]:
        return limits
    elif joint.is_stiffness[i] and theta > 0 and low > 0:
        compliance, reach = 1 / theta, reach / theta**2
    else:
        return float(theta - np.hypot(theta - low, reach)), float(theta + np.hypot(high - theta, reach))
    softest = compliance + np.hypot((1 / low if low > 0 else np.inf) - compliance, reach)
    stiffest = compliance - np.hypot(compliance - 1 / high, reach)
    return float(1 / softest), float(1 / stiffest) if stiffest > 0 else np.inf


def profile_interval(group: FormMinimum, i: int, factor: float, probability: float = 0.95) -> tuple[float, float]:
    """Return the interval of one parameter of a group by profile likelihood.

    Parameters
    ----------
    group : FormMinimum
        Fit of a group of DOFs.
    i : int
        Number of the parameter in the group.
    factor : float
        Ratio of the variance to the variance by independent noise.
    probability : float
        Coverage probability, default 0.95.

    Returns
    -------
    low, high : float
        Limits in units of the parameter; inf if the data give no limit.

    Notes
    -----
    The squares are the quadratic forms of the last linearisation. For springs without cross terms, the fixed coordinate
    is the compliance a = 1/k >= 0, or the damping.
    """
    joint = group.joint.of_profile(i)
    best = group if joint is group.joint else joint.lowest(group.forms, joint.coordinates(group.joint.theta(group.x)))
    profile = ProfileIntervals(
        FormSquares(group.forms, joint), joint, best.x, best.cost, best.covariance, factor,
        (lambda x, held: joint.lowest(group.forms, x, held, _PRECISE).cost) if joint.is_compliance.any() else None,
    )  # fmt: skip
    if not (joint.may_be_rigid(i) and _may_be_rigid(group, int(joint.dofs[i]), factor, probability)):
        return profile.of(i, probability)
    # A rigid DOF does not determine damping.
    return (profile.limit(i, 1, probability), np.inf) if joint.is_stiffness[i] else (-np.inf, np.inf)


def _may_be_rigid(group: FormMinimum, dof: int, factor: float, probability: float) -> bool:
    """Return whether the squares of a rigid DOF, without its parameters, exceed their minimum only by chance."""
    start = group.x.copy()
    start[dof] = 0.0
    rigid = group.joint.lowest(group.forms, start, dof, _PRECISE)
    parameters = int(np.count_nonzero(group.joint.dofs == dof))
    return bool(rigid.cost - group.cost < chi_squared(probability, parameters) * factor / 2)


def residual_test_of(
    found: JointEstimate, freq_hz: FloatArray, inflation: float, known: JointUncertainty
) -> ResidualTest:
    """Compare the residual with the noise and the smooth errors of channels.

    Parameters
    ----------
    found : JointEstimate
        Estimate of the joint.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    inflation : float
        Factor by which correlation between lines increases the variance of a mean.
    known : JointUncertainty
        Uncertainty of the parameters.

    Notes
    -----
    A mean square of N complex residuals has the standard deviation 1/sqrt(N), and its root half of this; a noise level
    estimated from as many data has the same. Parts of the band agree on a parameter if the squares of their
    differences from the whole, over their variance, follow chi^2.
    """
    added = 1 + known.excess
    sigma = float(np.sqrt(2 * inflation / max(found.equations, 1.0)) / 2)
    sigma = float(np.hypot(sigma, known.excess_error / added / 2))
    trends = tuple(t for one in known.groups for t in _trends(one, freq_hz, inflation))
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
    """Return the residual over the noise, including omitted lines by their distance from FRFs that fit the joint."""
    if all(group.used.all() for group in found.groups):
        return float("nan")
    squares = equations = 0.0
    for group in found.groups:
        out = ~group.used
        own = group.problem.equations()[out]
        apart = np.full(own.size, FAR * group.joint.n**2) if group.on is None else group.on.squares[out]
        # The distance of the smooth FRFs, without their noise.
        known = np.isfinite(apart)
        squares += group.noise_squares + float(apart[known].sum() + own[known].sum())
        equations += group.equations + float(own[known].sum())
    return float(np.sqrt(squares / max(equations - len(found.parameters) / 2, 1)))


def _trends(known: GroupUncertainty, freq_hz: FloatArray, inflation: float) -> list[Trend]:
    """Return the parameters that parts of the band disagree on."""
    group, spread = known.at.group, known.spread
    factor = np.fmax(np.maximum(spread.information, inflation), spread.lines)
    lines = np.flatnonzero(group.used)
    p = group.x.size
    if lines.size < BLOCKS * (p + 2):
        return []
    whole = group.covariance
    # In parameters, not in coordinates: if only k drifts, c/k does, and c does not.
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
        for effect in known.smooth:
            more = effect.between(covariance, seen, whole)
            variance += np.einsum("ij,bjk,ik->bi", slope, more, slope)
        errors[seen] = np.sqrt(variance)
    found = []
    for i, name in enumerate(group.joint.names):
        shown = np.isfinite(changes[:, i]) & (errors[:, i] > 0)
        # A part that does not determine the parameter is ignored.
        shown &= errors[:, i] < abs(theta[i])
        if np.count_nonzero(shown) < _LEAST_PARTS:
            continue
        squares = ((changes[shown, i] / errors[shown, i]) ** 2).sum()
        probability = float(special.chdtrc(np.count_nonzero(shown) - 1, squares))
        if probability < _DISAGREE / p:
            centres = member @ freq_hz / member.sum(axis=1)
            found.append(Trend(name, centres[shown], values[shown, i], probability))
    return found
