"""Whether the residual of a fit is noise, and where it is not: which frequencies, channels, parameters, priors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ResidualTest", "Trend", "check_residual", "local_excess"]

#: Parts of the band, and lines that each holds at least.
_PARTS, _LEAST_LINES = 24, 4
#: Probability at which a residual of noise is called a misfit: of all lines, of parts and channels together, of
#: neighbouring lines.
_CHANCE = 1e-3
#: Noise whose lines are more correlated than this says nothing of a residual that is.
_INDEPENDENT = 1.05
#: The noise found from the FRFs themselves is known to this share.
_NOISE_KNOWN = 0.01
#: A prior that is off by more than so many standard deviations is denied.
_PULLED = 3.0
#: A misfit is large from this many standard deviations of the ratio on.
_LARGE = 3.0
#: Part of the excess that few lines must hold to be called local, and which part of the lines are few.
_LOCAL_SHARE, _FEW = 0.5, 0.1
#: A line is among them with so many times the squares expected; runs of lines have gaps of no more than so many lines,
#: or one in so many of all; so many runs are named.
_EXCESSIVE, _GAP, _GAP_SHARE, _RUNS = 3, 3, 50, 5
#: Fewer products of neighbouring lines show no correlation.
_LEAST_PRODUCTS = 16


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
    local : tuple of (low, high, share)
        Parts of the band in Hz that hold most of the excess, and their share of it; empty where it may be chance.
    trends : tuple of Trend
        Parameters that parts of the band do not agree on.
    """

    ratio: float
    sigma: float
    neighbours: float = float("nan")
    bands: tuple[tuple[float, float, float], ...] = ()
    responses: tuple[tuple[int, float], ...] = ()
    forces: tuple[tuple[int, float], ...] = ()
    pulls: tuple[tuple[int, float], ...] = ()
    local: tuple[tuple[float, float, float], ...] = ()
    trends: tuple[Trend, ...] = ()

    @property
    def is_large(self) -> bool:
        """Whether the residual exceeds the noise by more than chance."""
        return self.ratio > 1 + _LARGE * self.sigma

    @property
    def is_small(self) -> bool:
        """Whether the residual is below the noise by more than chance: the noise is taken too large."""
        return self.ratio < 1 - _LARGE * self.sigma

    @property
    def is_noise(self) -> bool:
        """Whether the residual is noise, no prior is denied, and no parameter changes over the band."""
        quantile = float(special.ndtri(1 - _CHANCE))
        return not (
            self.ratio > 1 + quantile * self.sigma
            or self.bands
            or self.responses
            or self.forces
            or self.pulls
            or self.neighbours > quantile + 1
            or self.trends
        )


def check_residual(
    residual: ComplexArray,
    freq_hz: FloatArray,
    pulls: FloatArray,
    *,
    parameters: float,
    inflation: float,
    is_given: bool,
) -> ResidualTest:
    """Compare a residual with its noise.

    Parameters
    ----------
    residual : ndarray, shape (n_freq, n_o, n_i)
        Measured minus fitted over the root of E|e|^2; NaN where nothing is measured.
    freq_hz : ndarray, shape (n_freq,)
    pulls : ndarray, shape (p,)
        Free parameters less their prior, in its standard deviations.
    parameters : float
        Free parameters; fewer where priors hold them.
    inflation : float
        Lines that carry the noise of one independent line.
    is_given : bool
        Whether the noise was given, not found from the FRFs.

    Notes
    -----
    The mean square of N residuals of noise has the standard deviation sqrt(inflation / N); its root half of that. Noise
    that was found from as many FRFs has the same once more. The residual of a model that is wrong goes smoothly over
    frequency, which shows far below the noise: Re r_l conj(r_l+1) of noise has the mean zero.
    """
    squares, known = abs(residual) ** 2, np.isfinite(residual)
    squares = np.where(known, squares, 0)
    count = float(known.sum())
    of_noise = 0.0 if is_given else 1.0

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
        over = []
        totals, numbers = squares.sum(axis=(0, other)), known.sum(axis=(0, other))
        for i in range(residual.shape[axis]):
            ratio, excess = judged(totals[i], numbers[i])
            if excess > quantile and residual.shape[axis] > 1:
                over.append((i, ratio))
        channels.append(tuple(sorted(over, key=lambda one: -one[1])))
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
    if known.sum() < _LEAST_PRODUCTS:
        return float("nan")
    power = np.where(known, abs(residual[1:] * residual[:-1]) ** 2, 0).sum()
    return float(np.where(known, products, 0).real.sum() / np.sqrt(power / 2)) if power > 0 else 0.0


def local_excess(
    squares: FloatArray, expected: FloatArray, freq_hz: FloatArray
) -> tuple[tuple[float, float, float], ...]:
    """Return runs of neighbouring lines, few in all, that hold most of the excess: (low, high, share).

    Parameters
    ----------
    squares, expected : ndarray, shape (n_freq,)
        Squares of the residual of each line, and of noise.
    freq_hz : ndarray, shape (n_freq,)
    """
    excess, total = np.maximum(squares - expected, 0), (squares - expected).sum()
    if total <= 0:
        return ()
    few = np.sort(np.argsort(excess)[::-1][: max(1, int(_FEW * freq_hz.size))])
    few = few[excess[few] > _EXCESSIVE * expected.mean()]
    if few.size == 0 or excess[few].sum() < _LOCAL_SHARE * total:
        return ()
    runs = np.split(few, np.flatnonzero(np.diff(few) > max(_GAP, freq_hz.size // _GAP_SHARE)) + 1)
    found = [(float(freq_hz[r[0]]), float(freq_hz[r[-1]]), float(excess[r].sum() / excess.sum())) for r in runs]
    return tuple(sorted(found, key=lambda run: -run[2])[:_RUNS])
