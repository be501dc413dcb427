"""Flexible sides between channels and joint, from the FRFs alone: their contribution to the compliance of the joint.

Between virtual points a joint of compliance C appears as C_seen = Q (C + D_A + D_B) P (docs/sides.md). At low frequency
it is softer by the flexibility of the sides between channels and joint, D0 = D_A(0) + D_B(0), and it changes over
frequency by their inertia. The FRFs determine C + D0, and the deformation of the sides among the channels; they
determine D0 only within a factor.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.bands import line_slices
from jointfrf.frf.quantiles import medians
from jointfrf.identification.manifold.transforms import ChannelModes
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import solve

__all__ = ["FittedCompliance", "JointAlone", "SideBending", "joint_alone", "side_bending"]

#: Least relative noise of a channel, so that a channel with far less noise does not determine a mean over lines alone.
_LEAST_VARIANCE = 1e-3
#: One-sided 95 % of a normal distribution: deformation that noise does not exclude.
_NOT_EXCLUDED = 1.65
#: Standard deviations beyond which an excess over noise is significant, 99.9 %.
_SIGNIFICANT = 3.1
#: Least number of spare channels in the simulated pairs; with fewer, the squares of the deformation have few degrees of
#: freedom.
_LEAST_SPARE = 3
#: Standard deviations of a two-sided interval of 95 %.
_TWO_SIDED = 1.96
#: Number of rounds of the robust regression, and residual in standard deviations above which a line gets less weight.
_ROUNDS, _HUBER = 12, 1.5
#: Median of the square of a standard normal number.
_MEDIAN_SQUARE = 0.455
#: The same for the squared modulus of a complex number of mean square 1, and number of regressions on relative motion.
_MEDIAN_OF_TWO, _REGRESSIONS = 0.693, 3
#: Ratio of the error of the intercept to the change by the term of w^4, including four times the variance of noise: its
#: 95 % quantile over simulated pairs of bodies (docs/sides.md).
_INERTIA = 2.0
#: Ratio of D0 to the observed deformation, for translations and for rotations: median and 97.5 % quantile over the same
#: pairs, and the 2.5 % quantile, which may be negative if impacts are not at the sensors.
_MIDDLE, _LARGE, _NEGATIVE = (1.1, 3.6), (6.0, 16.0), (0.2, 0.0)
#: Ratio of D0 to C + D0 times the deformation per relative motion: median, and a quantile that keeps the coverage of
#: the smaller of both limits at 97.5 %.
_OF_SHARE, _LARGE_SHARE = (2.1, 4.4), (30.0, 50.0)
#: Weight of the compliance among the channels in the observed deformation, which makes these quantiles narrowest.
_AMONG = 0.5


class SideBending(NamedTuple):
    """Deformation of both sides among their channels, per joint DOF, m/N or rad/(N m), shape (n,) each.

    Attributes
    ----------
    low : ndarray
        Estimate with the noise subtracted; may be 0.
    high : ndarray
        Upper bound that noise does not exclude.
    share_low, share_high : ndarray
        The same per relative motion of both virtual points, dimensionless.
    excess : ndarray
        Excess of its squares over their noise, in standard deviations.
    """

    low: FloatArray
    high: FloatArray
    share_low: FloatArray
    share_high: FloatArray
    excess: FloatArray

    @property
    def is_noise(self) -> bool:
        """Whether the FRFs show no deformation beyond noise, in all DOFs together."""
        return bool(self.excess.sum() <= _SIGNIFICANT * np.sqrt(self.excess.size))

    def on(self, dofs: NDArray[np.intp]) -> SideBending:
        """Return the deformation for some of the joint DOFs."""
        return SideBending(*(one[dofs] for one in self))

    def of_joint(self, compliance: FloatArray, is_rotation: NDArray[np.bool_]) -> tuple[FloatArray, ...]:
        """Return D0 of a joint seen with this compliance: median, 97.5 % quantile, and minus its 2.5 % quantile.

        If the FRFs show deformation beyond noise, its quantiles count; else the smaller limit of both numbers.
        """
        middle, large, negative = (np.where(is_rotation, r, t) for t, r in (_MIDDLE, _LARGE, _NEGATIVE))
        best, most = middle * self.low, large * self.high
        if self.is_noise:
            of_share, largest = (np.where(is_rotation, r, t) * abs(compliance) for t, r in (_OF_SHARE, _LARGE_SHARE))
            best = np.sqrt(best * of_share * self.share_low)
            most = np.minimum(most, largest * self.share_high)
        return best, most, negative / large * most


def side_bending(
    measured: ComplexArray, smooth: ComplexArray, variance: FloatArray, responses: ChannelModes, forces: ChannelModes
) -> SideBending | None:
    """Return the deformation of the sides among their channels; None if a side has no spare channels.

    Parameters
    ----------
    measured, smooth : ndarray, shape (n_freq, m_r, m_f)
        Measured and smooth FRFs of the channels, m/N.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Noise variance E|e|^2 of the measured FRFs, inf if one is not used.
    responses, forces : ChannelModes
        Rigid motion of the channels.

    Notes
    -----
    V = h_AB T_f^T gamma_jk^-1 gamma_jj - h_AA T_f^T compares the motion of the channels of A under load at the joint
    and under load on the channels, with the virtual point at rest. It is the same for any joint. At the joint the same
    field is D_A P. The mean of V over the lines is weighted by the noise of each entry, without rigid motion. For a DOF
    with weights t_d of m channels it gives |t_d| sqrt(m/3) (sum V_id^2 / (m - n))^(1/2). The result is the geometric
    mean of this number for responses and for forces, summed over both sides.

    Channels on a ring around the joint may not show deformation. Half of the compliance among the channels is therefore
    added in squares, |t_d,r| |t_d,f| delta::

        delta = mean singular value of (1 - R T) h (1 - R T)^T

    Quantiles of D0 over both together are half as wide as quantiles over V alone.

    V compares two motions, and resonances do not amplify it. The deformation per relative motion across the joint is
    a second number: (1 - R T) h of impacts on the other side, which act through the joint alone. Its noise is as small
    as the noise of a fit of C. Its quantiles are wider, because the inertia of the side is in it.
    """
    channels = _Channels(
        measured, variance, responses.transform @ smooth @ forces.transform.T, responses, forces, smooth
    )
    found = []
    for side in (0, 1):
        one, two = (_of_side(own, side) for own in (channels, channels.turned))
        among = _among_channels(channels, side)
        if one is None or two is None or among is None:
            return None
        shares = [_of_relative_motion(own, side) for own in (channels, channels.turned)]
        found.append([*one.mean(two), *among, *shares[0].mean(shares[1])])
    low, high, _, own, more, _, share_low, share_high, excess = np.sum(found, axis=0)
    both = np.hypot(low, _AMONG * own), np.hypot(high, _AMONG * more)
    # Responses and forces of two sides.
    return SideBending(*both, share_low, share_high, excess / 2)


class _Limits(NamedTuple):
    """Estimate with the noise subtracted, upper bound that noise does not exclude, excess in standard deviations."""

    low: FloatArray
    high: FloatArray
    excess: FloatArray

    def mean(self, other: _Limits) -> _Limits:
        """Return the geometric mean of responses and forces, and the sum of their excesses."""
        return _Limits(np.sqrt(self.low * other.low), np.sqrt(self.high * other.high), self.excess + other.excess)

    @classmethod
    def of(cls, field: FloatArray, noise: FloatArray, lever: FloatArray, spare: int) -> _Limits:
        """Return the size of a field with noise variances, both of shape (m, n), times a factor of each column."""
        # A residual of rigid motion has as many independent channels as spare ones.
        count = len(field) / spare
        more = (field**2).sum(axis=0) - noise.sum(axis=0)
        by_noise = 2 * count * (noise**2).sum(axis=0)
        error, square = np.sqrt(by_noise + 4 * (noise * field**2).sum(axis=0)), np.maximum(more, 0)
        lever = lever * np.sqrt(count / 3)
        high = _of_few(spare) * lever * np.sqrt(square + _NOT_EXCLUDED * error)
        return cls(lever * np.sqrt(square), high, more / np.sqrt(by_noise + TINY))


class _Channels(NamedTuple):
    """FRFs of channels, E|e|^2 of their noise, FRFs of joint DOFs, rigid motion and smooth FRFs of the channels."""

    measured: ComplexArray
    variance: FloatArray
    gamma: ComplexArray
    responses: ChannelModes
    forces: ChannelModes
    smooth: ComplexArray

    @property
    def turned(self) -> _Channels:
        """Return the same with forces and responses exchanged."""
        return _Channels(
            self.measured.swapaxes(1, 2), self.variance.swapaxes(1, 2), self.gamma.swapaxes(1, 2),
            self.forces, self.responses, self.smooth.swapaxes(1, 2),
        )  # fmt: skip


def _of_side(channels: _Channels, side: int) -> _Limits | None:
    """Return the deformation from the responses of one side."""
    measured, variance, gamma, responses, forces, _ = channels
    n = gamma.shape[1] // 2
    here, there = slice(side * n, (side + 1) * n), slice((1 - side) * n, (2 - side) * n)
    rows, columns, across = responses.of_side(side), forces.of_side(side), forces.of_side(1 - side)
    spare = rows.size - n
    if spare < 1:
        return None
    t_own, t_across = forces.transform[here][:, columns], forces.transform[there][:, across]
    # A moment or force of the other virtual point that moves this one like a load on this one.
    ratio = solve(np.ascontiguousarray(gamma[:, here, there]), np.ascontiguousarray(gamma[:, here, here]))
    through = t_across.T @ ratio
    field = measured[:, rows[:, None], across] @ through - measured[:, rows[:, None], columns] @ t_own.T
    known = np.where(np.isfinite(variance), variance, 0)
    spread = known[:, rows[:, None], across] @ abs(through) ** 2 + known[:, rows[:, None], columns] @ (t_own.T**2)
    modes, transform = responses.modes[rows][:, here], responses.transform[here][:, rows]
    residual = np.eye(rows.size) - modes @ transform
    spread = residual**2 @ spread
    spread = np.maximum(spread, _LEAST_VARIANCE * medians(spread.swapaxes(0, 2).reshape(n, -1))[None, None] + TINY)
    weight = 1 / spread
    total = weight.sum(axis=0)
    bent = residual @ ((weight * field.real).sum(axis=0) / total)
    # Real parts have half of the variance.
    noise = 1 / (2 * total)
    noise = np.broadcast_to(noise, bent.shape)
    return _Limits.of(bent, noise, np.linalg.norm(transform, axis=1), spare)


def _of_relative_motion(channels: _Channels, side: int) -> _Limits:
    """Return the deformation of the responses of one side per relative motion across the joint, dimensionless."""
    measured, variance, gamma, responses, forces, smooth = channels
    n = gamma.shape[1] // 2
    here, there = slice(side * n, (side + 1) * n), slice((1 - side) * n, (2 - side) * n)
    rows, across = responses.of_side(side), forces.of_side(1 - side)
    transform = responses.transform[here][:, rows]
    residual = np.eye(rows.size) - responses.modes[rows][:, here] @ transform
    known = np.where(np.isfinite(variance), variance, 0)[:, rows[:, None], across]
    bent, noise = _regressed(
        residual @ measured[:, rows[:, None], across],
        residual**2 @ known,
        (responses.transform[here] - responses.transform[there]) @ smooth[:, :, across],
    )
    return _Limits.of(bent, noise, np.linalg.norm(transform, axis=1), rows.size - n)


def _regressed(field: ComplexArray, variance: FloatArray, motion: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return real factors from a motion to a field, and the variance of their noise, shape (m, n) each.

    Parameters
    ----------
    field : ndarray, shape (n_freq, m, k)
        Motion of m channels by k impacts.
    variance : ndarray, shape (n_freq, m, k)
        Its noise variance E|e|^2.
    motion : ndarray, shape (n_freq, n, k)
        Motion of n DOFs by these impacts.
    """
    m, n = field.shape[1], motion.shape[1]
    usual = medians(variance.swapaxes(0, 1).reshape(m, -1))
    beside, factors, noise = np.zeros(m), np.zeros((m, n)), np.zeros((m, n))
    size = np.sqrt((motion.real**2 + motion.imag**2).mean(axis=(0, 2))) + TINY
    motion = motion / size[:, None]
    for _ in range(_REGRESSIONS):
        total = np.maximum(variance, _LEAST_VARIANCE * usual[:, None]) + beside[:, None] + TINY
        weight = (usual[:, None] + TINY) / total
        normal, right = np.zeros((m, n, n)), np.zeros((m, n))
        for some in line_slices(len(field)):
            conjugate = motion[some].conj()
            products = np.einsum("ldk,lek->lkde", conjugate, motion[some]).real
            normal += np.tensordot(weight[some], products, ((0, 2), (0, 1)))
            right += np.einsum("lik,ldk->id", weight[some] * field[some], conjugate).real
        inverse = np.linalg.pinv(normal, hermitian=True)
        factors = (inverse @ right[..., None])[..., 0]
        left = field - factors @ motion
        own = (left.real**2 + left.imag**2).swapaxes(0, 1).reshape(m, -1)
        level, squares = (medians(one) / _MEDIAN_OF_TWO for one in (own * weight.swapaxes(0, 1).reshape(m, -1), own))
        # The residual gives the level; real parts have half of the variance.
        noise = np.einsum("idd->id", inverse) / 2 * level[:, None]
        # Quiet lines keep their weight unless the excess is significant.
        clear = squares > (1 + _SIGNIFICANT / np.sqrt(left[:, 0].size)) * usual
        beside = np.where(clear, squares - usual, 0)
    return factors / size, noise / size**2


def _of_few(spare: int) -> float:
    """Return the factor of an upper limit from a few spare channels, by Student's t."""
    few, least = (float(special.stdtrit(min(count, _LEAST_SPARE), 0.975)) for count in (spare, _LEAST_SPARE))
    return few / least


def _among_channels(channels: _Channels, side: int) -> _Limits | None:
    """Return the compliance among the channels of a side, for forces and motion of each joint DOF."""
    measured, variance, _, responses, forces, _ = channels
    n = len(responses.transform) // 2
    rows, columns, here = responses.of_side(side), forces.of_side(side), slice(side * n, (side + 1) * n)
    count = min(rows.size, columns.size) - n
    if count < 1:
        return None
    left = (responses.residual[rows] @ measured @ forces.residual[columns].T).real
    spread = variance[:, rows[:, None], columns]
    weight = 1 / np.maximum(np.where(np.isfinite(spread), spread, 0).mean(axis=(1, 2)), TINY)
    mean = np.tensordot(weight, left, 1) / weight.sum()
    gains = [np.linalg.norm(own.transform[here], axis=1) for own in (responses, forces)]
    found = gains[0] * gains[1] * np.linalg.svd(mean, compute_uv=False).sum() / count
    return _Limits(found, _of_few(count) * found, np.zeros(n))


class _StaticCompliance(NamedTuple):
    """Compliance between virtual points at zero frequency, C + D0, m/N or rad/(N m), shape (n,) each.

    Attributes
    ----------
    value : ndarray
        Intercept over w^2 and w^4.
    std_error : ndarray
        Standard error from noise, and from scatter about the trend.
    before : ndarray
        Intercept over w^2 alone.
    """

    value: FloatArray
    std_error: FloatArray
    before: FloatArray


def _static_compliance(omega: FloatArray, compliance: ComplexArray, variance: FloatArray) -> _StaticCompliance:
    """Return the intercept of Re C_dd over w^2 and w^4: the inertia of the sides changes it with even powers.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    compliance : ndarray, shape (n_freq, n)
        Diagonal of C of each line, m/N; NaN if a line does not determine it.
    variance : ndarray, shape (n_freq, n)
        Noise variance E|e|^2 of the compliance.
    """
    x = (omega / omega.max()) ** 2
    found = [[_intercept(x, c, v, order) for c, v in zip(compliance.T, variance.T, strict=True)] for order in (1, 2)]
    (before, _), (value, error) = (np.array(one).T for one in found)
    return _StaticCompliance(value, error, before)


def _intercept(x: FloatArray, compliance: ComplexArray, variance: FloatArray, order: int) -> tuple[float, float]:
    """Return the intercept of a polynomial by robust regression, because resonances of the sides disturb the trend."""
    known = np.isfinite(compliance.real) & np.isfinite(variance) & (variance > 0)
    y, noise = compliance.real[known], variance[known] / 2
    order = min(order, max(int(known.sum()) - 2, 0))
    if known.sum() <= order:
        return np.nan, np.inf
    terms = x[known, None] ** np.arange(order + 1)
    weight = 1 / (noise + float(medians(noise)))
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)
        coefficients = np.linalg.lstsq(terms * root[:, None], y * root, rcond=None)[0]
        squares = (y - terms @ coefficients) ** 2
        beside = max(float(medians(np.maximum(squares / _MEDIAN_SQUARE - noise, 0))), 0.0)
        base = noise + beside
        weight = 1 / base / np.maximum(1, np.sqrt(squares / base) / _HUBER)
    covariance = np.linalg.pinv((terms * weight[:, None]).T @ terms, hermitian=True)
    return float(coefficients[0]), float(np.sqrt(max(covariance[0, 0], 0.0)))


class JointAlone(NamedTuple):
    """Compliance of a joint without its sides, and between virtual points, m/N or rad/(N m), shape (n,) each.

    Attributes
    ----------
    seen : ndarray
        Static compliance C + D0 between virtual points.
    noise, inertia : ndarray
        Half widths of its 95 % interval from noise, and from the change over frequency by the inertia of the sides.
    best : ndarray
        Estimate of C of the joint alone.
    softer, stiffer : ndarray
        Contributions of the sides to its 95 % interval above and below `seen`.
    """

    seen: FloatArray
    noise: FloatArray
    inertia: FloatArray
    best: FloatArray
    softer: FloatArray
    stiffer: FloatArray

    @property
    def reach(self) -> FloatArray:
        """Half width of the 95 % interval of `seen`."""
        return np.asarray(np.hypot(self.noise, self.inertia))

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """95 % interval of the joint alone; 0 if it may be rigid."""
        low = self.seen - np.hypot(self.stiffer, self.reach)
        return np.maximum(low, 0.0), self.seen + np.hypot(self.softer, self.reach)


class FittedCompliance(NamedTuple):
    """C_dd of the fit of all lines at w = 0, one number for all lines, m/N or rad/(N m), shape (n,) each.

    Attributes
    ----------
    value : ndarray
        Estimate.
    error, smooth, by_sides : ndarray
        Standard errors by noise, by smooth errors of the channels, and by flexible sides.
    is_rigid : ndarray of bool
        Whether the sides change it by less than its noise: it is then of the fit between rigid sides.
    """

    value: FloatArray
    error: FloatArray
    smooth: FloatArray
    by_sides: FloatArray
    is_rigid: NDArray[np.bool_]

    @classmethod
    def unknown(cls, n: int) -> FittedCompliance:
        """Return the compliance of n DOFs before their fit."""
        value, error, smooth, by_sides = np.full((4, n), np.nan)
        return cls(value, error, smooth, by_sides, np.zeros(n, np.bool_))

    def with_group(self, dofs: NDArray[np.intp], own: FittedCompliance) -> FittedCompliance:
        """Return the same with the results of some DOFs."""
        found: list[NDArray[Any]] = [np.array(one) for one in self]
        for one, result in zip(found, own, strict=True):
            one[dofs] = result
        return FittedCompliance(*found)


def joint_alone(
    omega: FloatArray,
    compliance: ComplexArray,
    variance: FloatArray,
    fitted: FittedCompliance,
    bending: SideBending,
    is_rotation: NDArray[np.bool_],
) -> JointAlone:
    """Return the compliance of the joint alone, from the deformation among the channels.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    compliance, variance : ndarray, shape (n_freq, n)
        Diagonal of C of each line between virtual points, and its noise variance; NaN if a line does not determine it.
    fitted : FittedCompliance
        C_dd by the fit of all lines.
    bending : SideBending
        Deformation of the sides among the channels.
    is_rotation : ndarray of bool, shape (n,)
        Whether each joint DOF is a rotation.

    Notes
    -----
    There are two estimates of C + D0: the intercept over w^2, and the fit of all lines with flexible sides as random
    effects. If the sides change the fit by less than its noise, the fit counts; if the FRFs show no deformation beyond
    noise, the one with the narrower interval. Otherwise the intercept counts. Inertia of the sides changes both in
    different ways, so that their difference is in its interval.
    """
    static = _static_compliance(omega, compliance, variance)
    # Errors of channels that are smooth over frequency do not appear in the scatter of lines.
    noise = np.hypot(2 * _INERTIA * static.std_error, _TWO_SIDED * fitted.smooth)
    inertia = np.hypot(_INERTIA * abs(static.value - static.before), np.nan_to_num(static.value - fitted.value))
    noise_of_fit, inertia_of_fit = _TWO_SIDED * np.hypot(fitted.error, fitted.smooth), _TWO_SIDED * fitted.by_sides
    of_all = np.hypot(noise_of_fit, inertia_of_fit) < np.hypot(noise, inertia)
    of_all = (of_all & bending.is_noise) | fitted.is_rigid | ~np.isfinite(static.value)
    seen, noise, inertia = (
        np.where(of_all, fit, line)
        for fit, line in ((fitted.value, static.value), (noise_of_fit, noise), (inertia_of_fit, inertia))
    )
    # At most as soft as noise and inertia allow, if these alone leave the sign undetermined.
    size_seen = np.maximum(seen, np.hypot(noise, inertia) / 2)
    middle, large, negative = bending.of_joint(size_seen, is_rotation)
    best = size_seen / (1 + middle / np.maximum(size_seen, TINY))
    return JointAlone(seen, noise, inertia, best, negative, large)
