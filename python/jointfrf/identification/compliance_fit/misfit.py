"""Whether the residual of a fit is noise, and if it is not, what it looks like."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from jointfrf.identification.compliance_fit.estimator import FittedGroup, JointEstimate
from jointfrf.identification.compliance_fit.intervals import BLOCKS, Spread
from jointfrf.identification.compliance_fit.line_forms import inverse_information
from jointfrf.kernel.arguments import FloatArray

__all__ = ["Misfit", "Trend", "diagnose"]

#: A misfit is told from this many standard deviations of the residual on.
_SIGMA = 3.0
#: Part of the excess that few lines must hold to be called local, and which part of the lines are few.
_LOCAL_SHARE, _FEW = 0.5, 0.1
#: Probability at which parts of the band are said to disagree.
_DISAGREE = 1e-3
#: A part whose information has a larger condition does not show all parameters.
_SINGULAR = 1e8


class Trend(NamedTuple):
    """A parameter that changes over the band.

    Attributes
    ----------
    name : str
    centres : ndarray, shape (b,)
        Middle of each part of the band, Hz.
    values : ndarray, shape (b,)
        Parameter by part, one Gauss-Newton step from that of all lines; NaN where a part does not show it.
    probability : float
        That parts differ so much by noise alone.
    """

    name: str
    centres: FloatArray
    values: FloatArray
    probability: float


class Misfit(NamedTuple):
    """How the residual differs from noise.

    Attributes
    ----------
    ratio : float
        Residual over noise.
    sigma : float
        Standard deviation of this ratio where the model is right.
    local : tuple of (low, high, share)
        Parts of the band in Hz that hold most of the excess, and their share of it; empty where it may be chance.
    trends : tuple of Trend
        Parameters that parts of the band do not agree on.
    """

    ratio: float
    sigma: float
    local: tuple[tuple[float, float, float], ...]
    trends: tuple[Trend, ...]

    @property
    def is_large(self) -> bool:
        """Whether the residual exceeds the noise by more than chance."""
        return self.ratio > 1 + _SIGMA * self.sigma

    @property
    def is_noise(self) -> bool:
        """Whether the residual is no more than noise, and no parameter changes over the band."""
        return not (self.is_large or self.trends)

    @property
    def is_small(self) -> bool:
        """Whether the residual is below the noise by more than chance: the noise is taken too large."""
        return self.ratio < 1 - _SIGMA * self.sigma


def diagnose(found: JointEstimate, freq_hz: FloatArray, inflation: float, spread: Spread) -> Misfit:
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

    Notes
    -----
    A mean square of N complex residuals has the standard deviation 1/sqrt(N), its root half of that; the noise level,
    found from as many data, has the same. Parts of the band agree on a parameter where the squares of their differences
    from the whole, over their variance, are those of chi^2.
    """
    sigma = float(np.sqrt(2 * inflation / max(found.equations, 1.0)) / 2)
    ratio = float(np.sqrt(found.excess))
    factor = np.fmax(np.maximum(spread.information, inflation), spread.lines)
    trends = tuple(t for group in found.groups for t in _trends(group, freq_hz, factor[group.which]))
    misfit = Misfit(ratio, sigma, (), trends)
    return misfit._replace(local=_local(found, freq_hz)) if misfit.is_large else misfit


def _local(found: JointEstimate, freq_hz: FloatArray) -> tuple[tuple[float, float, float], ...]:
    """Return runs of neighbouring lines, few in all, that hold most of the excess."""
    squares, expected = np.zeros(freq_hz.size), np.zeros(freq_hz.size)
    for group in found.groups:
        fit = group.fit
        squares += fit.forms.at(group.joint.compliance(fit.minimum.x))[0]
        expected += fit.trusted * (fit.equations / max(float(np.count_nonzero(fit.trusted)), 1.0))
    excess = np.maximum(squares - expected, 0)
    total = (squares - expected).sum()
    if total <= 0:
        return ()
    few = np.sort(np.argsort(excess)[::-1][: max(1, int(_FEW * freq_hz.size))])
    few = few[excess[few] > 3 * expected.mean()]
    if few.size == 0 or excess[few].sum() < _LOCAL_SHARE * total:
        return ()
    runs = np.split(few, np.flatnonzero(np.diff(few) > max(3, freq_hz.size // 50)) + 1)
    told = [(float(freq_hz[r[0]]), float(freq_hz[r[-1]]), float(excess[r].sum() / excess.sum())) for r in runs]
    return tuple(sorted(told, key=lambda run: -run[2])[:5])


def _trends(group: FittedGroup, freq_hz: FloatArray, factor: FloatArray) -> list[Trend]:
    """Return the parameters that parts of the band disagree on."""
    minimum = group.fit.minimum
    lines = np.flatnonzero(group.fit.trusted)
    p = minimum.x.size
    if lines.size < BLOCKS * (p + 2):
        return []
    whole = minimum.covariance
    # In parameters, not in coordinates: where only k drifts, c/k does, and c does not.
    theta, slope = group.joint.theta(minimum.x), group.joint.theta_slope(minimum.x)
    parts = np.array_split(lines, BLOCKS)
    member = np.zeros((BLOCKS, freq_hz.size))
    for of_part, own in zip(member, parts, strict=True):
        of_part[own] = 1
    gradient, information = minimum.of_groups(member)
    size = np.sqrt(np.maximum(np.einsum("bpp->bp", information), np.finfo(float).tiny))
    seen = np.linalg.cond(information / (size[:, :, None] * size[:, None, :])) <= _SINGULAR
    if not seen.any():
        return []
    values, changes, errors = (np.full((BLOCKS, p), np.nan) for _ in range(3))
    covariance = inverse_information(2 * information[seen])
    step = 2 * (covariance @ gradient[seen, :, None])[..., 0]
    values[seen] = [group.joint.theta(minimum.x + one) for one in step]
    with np.errstate(invalid="ignore"):
        changes[seen] = step @ slope.T
        variance = np.einsum("ij,bjk,ik->bi", slope, covariance - whole, slope)
        errors[seen] = np.sqrt(np.maximum(variance, 0) * factor)
    told = []
    for i, name in enumerate(group.joint.names):
        known = np.isfinite(changes[:, i]) & (errors[:, i] > 0)
        # A part that does not see the parameter says nothing about it.
        known &= errors[:, i] < abs(theta[i])
        if np.count_nonzero(known) < 3:
            continue
        squares = ((changes[known, i] / errors[known, i]) ** 2).sum()
        probability = float(special.chdtrc(np.count_nonzero(known) - 1, squares))
        if probability < _DISAGREE / p:
            centres = np.array([freq_hz[own].mean() for own in parts])
            told.append(Trend(name, centres[known], values[known, i], probability))
    return told
