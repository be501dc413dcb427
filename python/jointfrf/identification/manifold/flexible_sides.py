"""Flexible sides between channels and joint, from the FRFs alone: their contribution to the compliance of the joint.

Between virtual points a joint of compliance C appears as C_seen = Q (C + D_A + D_B) P (docs/sides.md). At low frequency
it is softer by the flexibility of the sides between channels and joint, D0 = D_A(0) + D_B(0), and it changes over
frequency by their inertia. The FRFs determine C + D0, and the deformation of the sides among the channels; they
determine D0 only within a factor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.quantiles import medians
from jointfrf.identification.manifold.transforms import ChannelModes
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import solve

__all__ = ["JointAlone", "SideBending", "joint_alone", "side_bending"]

#: Least relative noise of a channel, so that a channel with far less noise does not determine a mean over lines alone.
_LEAST_VARIANCE = 1e-3
#: One-sided 95 % of a normal distribution: deformation that noise does not exclude.
_NOT_EXCLUDED = 1.65
#: Least number of spare channels in the simulated pairs; with fewer, the squares of the deformation have few degrees of
#: freedom.
_LEAST_SPARE = 3
#: Standard deviations of a two-sided interval of 95 %.
_TWO_SIDED = 1.96
#: Number of rounds of the robust regression, and residual in standard deviations above which a line gets less weight.
_ROUNDS, _HUBER = 12, 1.5
#: Median of the square of a standard normal number.
_MEDIAN_SQUARE = 0.455
#: Ratio of the error of the intercept to the change by the term of w^4, including four times the variance of noise: its
#: 95 % quantile over simulated pairs of bodies (docs/sides.md).
_INERTIA = 2.0
#: Ratio of D0 to the observed deformation, for translations and for rotations: median and 97.5 % quantile over the same
#: pairs, and the 2.5 % quantile, which may be negative if impacts are not at the sensors.
_MIDDLE, _LARGE, _NEGATIVE = (1.1, 3.6), (6.0, 16.0), (0.2, 0.0)
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
    """

    low: FloatArray
    high: FloatArray


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
    """
    channels = _Channels(measured, variance, responses.transform @ smooth @ forces.transform.T, responses, forces)
    found = []
    for side in (0, 1):
        one, two = (_of_side(own, side) for own in (channels, channels.turned))
        among = _among_channels(channels, side)
        if one is None or two is None or among is None:
            return None
        found.append(
            (np.sqrt(one.low * two.low), np.sqrt(one.high * two.high), _AMONG * among.low, _AMONG * among.high)
        )
    low, high, own, more = np.sum(found, axis=0)
    return SideBending(np.hypot(low, own), np.hypot(high, more))


class _Channels(NamedTuple):
    """FRFs of channels, E|e|^2 of their noise, smooth FRFs between the joint DOFs, and rigid motion of the channels."""

    measured: ComplexArray
    variance: FloatArray
    gamma: ComplexArray
    responses: ChannelModes
    forces: ChannelModes

    @property
    def turned(self) -> _Channels:
        """Return the same with forces and responses exchanged."""
        return _Channels(
            self.measured.swapaxes(1, 2), self.variance.swapaxes(1, 2), self.gamma.swapaxes(1, 2),
            self.forces, self.responses,
        )  # fmt: skip


def _of_side(channels: _Channels, side: int) -> SideBending | None:
    """Return the deformation from the responses of one side."""
    measured, variance, gamma, responses, forces = channels
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
    square, by_noise = (bent**2).sum(axis=0), noise.sum(axis=0)
    error = np.sqrt(2 * (noise**2).sum(axis=0) + 4 * (noise * bent**2).sum(axis=0))
    lever = np.linalg.norm(transform, axis=1) * np.sqrt(rows.size / 3 / spare)
    low, high = (np.sqrt(np.maximum(square - by_noise + more, 0)) for more in (0.0, _NOT_EXCLUDED * error))
    return SideBending(lever * low, _of_few(spare) * lever * high)


def _of_few(spare: int) -> float:
    """Return the factor of an upper limit from a few spare channels, by Student's t."""
    few, least = (float(special.stdtrit(min(count, _LEAST_SPARE), 0.975)) for count in (spare, _LEAST_SPARE))
    return few / least


def _among_channels(channels: _Channels, side: int) -> SideBending | None:
    """Return the compliance among the channels of a side, for forces and motion of each joint DOF."""
    measured, variance, _, responses, forces = channels
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
    return SideBending(found, _of_few(count) * found)


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


def joint_alone(
    omega: FloatArray,
    compliance: ComplexArray,
    variance: FloatArray,
    fitted: tuple[FloatArray, FloatArray, FloatArray],
    size: FloatArray,
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
    fitted : three of ndarray, shape (n,)
        Fitted C_dd, one number for all lines, its standard error by noise, and its standard error by position errors.
    size : ndarray, shape (n,)
        Median size of the receptances of each joint DOF, m/N or rad/(N m).
    bending : SideBending
        Deformation of the sides among the channels.
    is_rotation : ndarray of bool, shape (n,)
        Whether each joint DOF is a rotation.

    Notes
    -----
    The limits are quantiles, over simulated pairs of bodies, of D0 over the deformation, and of the error of the
    intercept. If possible flexibility of the sides changes the estimate by less than its noise, the fit to all lines
    replaces the intercept: inertia changes C_seen by a share of about D/|gamma|.
    """
    static = _static_compliance(omega, compliance, variance)
    middle, large, negative = (np.where(is_rotation, r, t) for t, r in (_MIDDLE, _LARGE, _NEGATIVE))
    value, error, smooth = fitted
    is_rigid = large * bending.high / np.maximum(size, TINY) * abs(value) <= error
    is_rigid |= ~np.isfinite(static.value)
    seen = np.where(is_rigid, value, static.value)
    # Errors of channels that are smooth over frequency do not appear in the scatter of lines.
    noise = np.hypot(np.where(is_rigid, _TWO_SIDED * error, 2 * _INERTIA * static.std_error), _TWO_SIDED * smooth)
    inertia = np.where(is_rigid, 0.0, _INERTIA * abs(static.value - static.before))
    # At most as soft as noise and inertia allow, if these alone leave the sign undetermined.
    size_seen = np.maximum(seen, np.hypot(noise, inertia) / 2)
    best = size_seen / (1 + middle * bending.low / np.maximum(size_seen, TINY))
    return JointAlone(seen, noise, inertia, best, negative * bending.high, large * bending.high)
