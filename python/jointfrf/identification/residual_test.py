"""Whether the residual of a fit is noise, and where it is not: which frequencies, channels, parameters, priors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from jointfrf.identification.manifold.estimate import FittedGroup, JointEstimate
from jointfrf.identification.manifold.scatter import BLOCKS, Spread
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Misfit", "ResidualTest", "Trend", "check_residual", "diagnose"]

#: Parts of the band, and lines that each holds at least.
_PARTS, _LEAST_LINES = 24, 4
#: Probability at which a residual of noise is called a misfit: of all lines, of parts and channels together, of
#: neighbouring lines.
_CHANCE = 1e-3
#: Noise whose lines are more correlated than this says nothing of a residual that is.
_INDEPENDENT = 1.05
#: The noise found from the FRFs themselves is known to this share.
_NOISE_KNOWN = 0.01
#: A prior that is off by more than so many standard deviations is told.
_PULLED = 3.0


class ResidualTest(NamedTuple):
    """How the residual of a fit differs from noise.

    Attributes
    ----------
    ratio : float
        Residual over noise.
    sigma : float
        Standard deviation of this ratio where the model is right.
    neighbours : float
        Correlation of the residual between neighbouring lines, in standard deviations of that of noise; NaN where the
        noise itself is correlated.
    bands : tuple of (low, high, ratio)
        Parts of the band, Hz, where the residual exceeds the noise by more than chance, worst first.
    responses, forces : tuple of (number, ratio)
        Channels whose residual exceeds the noise by more than chance, worst first.
    pulls : tuple of (number, pull)
        Free parameters that differ from their prior by more than three standard deviations.
    """

    ratio: float
    sigma: float
    neighbours: float
    bands: tuple[tuple[float, float, float], ...]
    responses: tuple[tuple[int, float], ...]
    forces: tuple[tuple[int, float], ...]
    pulls: tuple[tuple[int, float], ...]

    @property
    def is_noise(self) -> bool:
        """Whether the residual is noise, and no prior is denied."""
        quantile = float(special.ndtri(1 - _CHANCE))
        return not (
            self.ratio > 1 + quantile * self.sigma
            or self.bands
            or self.responses
            or self.forces
            or self.pulls
            or self.neighbours > quantile + 1
        )


def check_residual(
    residual: ComplexArray, freq_hz: FloatArray, pulls: FloatArray, *, parameters: int, inflation: float, is_told: bool
) -> ResidualTest:
    """Compare a residual with its noise.

    Parameters
    ----------
    residual : ndarray, shape (n_freq, n_o, n_i)
        Measured minus fitted over the root of E|e|^2; NaN where nothing is measured.
    freq_hz : ndarray, shape (n_freq,)
    pulls : ndarray, shape (p,)
        Free parameters less their prior, in its standard deviations.
    parameters : int
        Free parameters.
    inflation : float
        Lines that carry the noise of one independent line.
    is_told : bool
        Whether the noise was told, not found from the FRFs.

    Notes
    -----
    The mean square of N residuals of noise has the standard deviation sqrt(inflation / N); its root half of that. Noise
    that was found from as many FRFs has the same once more. The residual of a model that is wrong goes smoothly over
    frequency, which shows far below the noise: Re r_l conj(r_l+1) of noise has the mean zero.
    """
    squares, known = abs(residual) ** 2, np.isfinite(residual)
    squares = np.where(known, squares, 0)
    count = float(known.sum())
    of_noise = 0.0 if is_told else 1.0

    def judged(total: float, number: float) -> tuple[float, float]:
        """Return the ratio, and by how many standard deviations it exceeds 1."""
        ratio = float(np.sqrt(total / max(number, 1)))
        sigma = np.sqrt((1 + of_noise) * inflation / max(number, 1)) / 2
        return ratio, (ratio - 1) / float(np.hypot(sigma, of_noise * _NOISE_KNOWN))

    n_parts = max(1, min(_PARTS, freq_hz.size // _LEAST_LINES))
    parts = np.array_split(np.argsort(freq_hz), n_parts)
    quantile = float(special.ndtri(1 - _CHANCE / (n_parts + sum(residual.shape[1:]))))
    bands = []
    for own in parts:
        ratio, excess = judged(squares[own].sum(), known[own].sum())
        if excess > quantile:
            bands.append((float(freq_hz[own].min()), float(freq_hz[own].max()), ratio))
    channels: list[tuple[tuple[int, float], ...]] = []
    for axis, other in ((1, 2), (2, 1)):
        told = []
        totals, numbers = squares.sum(axis=(0, other)), known.sum(axis=(0, other))
        for i in range(residual.shape[axis]):
            ratio, excess = judged(totals[i], numbers[i])
            if excess > quantile and residual.shape[axis] > 1:
                told.append((i, ratio))
        channels.append(tuple(sorted(told, key=lambda one: -one[1])))
    mean = max(count - parameters / 2, 1.0)
    sigma = float(np.hypot(np.sqrt((1 + of_noise) * inflation / mean) / 2, of_noise * _NOISE_KNOWN))
    return ResidualTest(
        float(np.sqrt(squares.sum() / mean)),
        sigma,
        _neighbours(residual) if inflation < _INDEPENDENT else float("nan"),
        tuple(sorted(bands, key=lambda one: -one[2])),
        channels[0],
        channels[1],
        tuple((int(i), float(pulls[i])) for i in np.argsort(-abs(pulls)) if abs(pulls[i]) > _PULLED),
    )


def _neighbours(residual: ComplexArray) -> float:
    """Return the sum of Re r_l conj(r_l+1) over its standard deviation for noise."""
    products = residual[1:] * residual[:-1].conj()
    known = np.isfinite(products)
    if known.sum() < 16:
        return float("nan")
    power = np.where(known, abs(residual[1:] * residual[:-1]) ** 2, 0).sum()
    return float(np.where(known, products, 0).real.sum() / np.sqrt(power / 2)) if power > 0 else 0.0


#: A misfit is told from this many standard deviations of the residual on.
_LARGE = 3.0
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
        return self.ratio > 1 + _LARGE * self.sigma

    @property
    def is_noise(self) -> bool:
        """Whether the residual is no more than noise, and no parameter changes over the band."""
        return not (self.is_large or self.trends)

    @property
    def is_small(self) -> bool:
        """Whether the residual is below the noise by more than chance: the noise is taken too large."""
        return self.ratio < 1 - _LARGE * self.sigma


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
