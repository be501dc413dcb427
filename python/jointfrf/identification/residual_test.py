"""Test whether the residual of a fit is noise, and which frequencies, channels, parameters, priors contradict this."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ResidualTest", "Trend", "check_residual", "local_excess"]

#: Number of parts of the band, and least number of lines in each.
_PARTS, _LEAST_LINES = 24, 4
#: Probability below which a residual of noise is called a misfit: for all lines, for parts and channels together, for
#: neighbouring lines.
_CHANCE = 1e-3
#: Correlation of the noise between lines above which the correlation of the residual is not tested.
_INDEPENDENT = 1.05
#: Relative standard error of noise that was estimated from the FRFs.
_NOISE_KNOWN = 0.01
#: Distance from a prior, in standard deviations, above which the FRFs contradict it.
_PULLED = 3.0
#: Excess of the ratio, in standard deviations, above which a misfit is large.
_LARGE = 3.0
#: Share of the excess on few lines above which it is local, and the share of all lines that is few.
_LOCAL_SHARE, _FEW = 0.5, 0.1
#: Ratio to the expected squares above which a line belongs to a run; largest gap of a run in lines, and as a share of
#: all lines; number of runs that are reported.
_EXCESSIVE, _GAP, _GAP_SHARE, _RUNS = 3, 3, 50, 5
#: Least number of products of neighbouring lines for a correlation.
_LEAST_PRODUCTS = 16


class Trend(NamedTuple):
    """A parameter that changes over the band.

    Attributes
    ----------
    name : str
        Name of the parameter.
    centres : ndarray, shape (b,)
        Middle of each part of the band, Hz.
    values : ndarray, shape (b,)
        Parameter by part, one Gauss-Newton step from the estimate of all lines; NaN if a part does not determine it.
    probability : float
        Probability that parts differ so much by noise alone.
    """

    name: str
    centres: FloatArray
    values: FloatArray
    probability: float


class ResidualTest(NamedTuple):
    """Difference of the residual of a fit from noise.

    Attributes
    ----------
    ratio : float
        Residual over noise.
    sigma : float
        Standard deviation of this ratio if the model is right.
    neighbours : float
        Correlation of the residual between neighbouring lines, over the standard deviation of this correlation for
        noise; NaN if the noise itself is correlated.
    bands : tuple of (low, high, ratio)
        Parts of the band, Hz, in which the residual exceeds the noise by more than chance, worst first.
    responses, forces : tuple of (number, ratio)
        Channels whose residual exceeds the noise by more than chance, worst first.
    pulls : tuple of (number, pull)
        Free parameters that differ from their prior by more than three standard deviations.
    local : tuple of (low, high, share)
        Parts of the band in Hz with most of the excess, and their share of it; empty if it may be chance.
    trends : tuple of Trend
        Parameters on which parts of the band disagree.
    of_all : float
        Residual over noise, including the lines that the fit omitted; NaN if it omitted none.
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
    of_all: float = float("nan")

    @property
    def leaves_out(self) -> bool:
        """Whether the fit omitted lines that would make the residual noticeably larger."""
        return self.of_all > max(self.ratio, 1 + _LARGE * self.sigma)

    @property
    def whole(self) -> float:
        """Residual over noise of all lines in the band, fitted or not."""
        return max(self.ratio, self.of_all) if np.isfinite(self.of_all) else self.ratio

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
        """Whether the residual is noise, no prior is contradicted, and no parameter changes over the band."""
        quantile = float(special.ndtri(1 - _CHANCE))
        return not (
            self.whole > 1 + quantile * self.sigma
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
    smooth: FloatArray | None = None,
) -> ResidualTest:
    """Compare a residual with its noise and return the result.

    Parameters
    ----------
    residual : ndarray, shape (n_freq, n_o, n_i)
        Measured minus fitted over the root of E|e|^2; NaN if nothing was measured.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    pulls : ndarray, shape (p,)
        Free parameters minus their prior, over its standard deviation.
    parameters : float
        Number of free parameters; smaller if priors determine them.
    inflation : float
        Number of lines that carry the noise of one independent line.
    is_given : bool
        Whether the noise was given, not estimated from the FRFs.
    smooth : ndarray, shape (n_freq, n_o, n_i), optional
        Share of smooth errors of channels in the variance that the residual is divided by: one number each over the
        band.

    Notes
    -----
    The mean square of N residuals of noise follows chi^2 with 2 N degrees of freedom, divided by the inflation and by
    the number of FRFs of a line that share their noise. Noise that was estimated from as many FRFs doubles the variance
    of the ratio. The residual of a wrong model is smooth over frequency, which is visible far below the noise, because
    Re r_l conj(r_l+1) of noise has mean zero.
    """
    squares, known = abs(residual) ** 2, np.isfinite(residual)
    squares = np.where(known, squares, 0)
    count = float(known.sum())
    of_noise = 0.0 if is_given else 1.0
    alike = (1 + of_noise) * inflation * _shared(residual)
    of_channels = np.zeros(residual.shape) if smooth is None else np.where(known, smooth, 0)

    def judged(which: tuple[NDArray[np.intp] | slice | int, ...], chance: float) -> tuple[float, bool]:
        """Return the ratio, and whether it exceeds the quantile of noise at this probability."""
        number = max(float(known[which].sum()), 1.0)
        ratio = float(np.sqrt(squares[which].sum() / number))
        share = float(of_channels[which].sum()) / number
        degrees = max(2 * number / alike, 1.0)
        mean_square = (1 - share) * _mean_square(chance, degrees) + share * _mean_square(chance, 1.0)
        reach = np.hypot(np.sqrt(mean_square) - 1, of_noise * _NOISE_KNOWN * special.ndtri(1 - chance))
        return ratio, ratio > 1 + reach

    n_parts = max(1, min(_PARTS, freq_hz.size // _LEAST_LINES))
    parts = np.array_split(np.argsort(freq_hz), n_parts)
    chance = _CHANCE / (n_parts + sum(residual.shape[1:]))
    bands = []
    for own in parts:
        ratio, exceeds = judged((own,), chance)
        if exceeds:
            bands.append((float(freq_hz[own].min()), float(freq_hz[own].max()), ratio))
    channels: list[tuple[tuple[int, float], ...]] = []
    for axis in (1, 2):
        over = []
        for i in range(residual.shape[axis]):
            ratio, exceeds = judged((*[slice(None)] * axis, i), chance)
            if exceeds and residual.shape[axis] > 1:
                over.append((i, ratio))
        channels.append(tuple(sorted(over, key=lambda one: -one[1])))
    mean = max(count - parameters / 2, 1.0)
    share = float(of_channels.sum()) / max(count, 1.0)
    beyond = float(special.ndtr(-_LARGE))
    far = (1 - share) * _mean_square(beyond, max(2 * mean / alike, 1.0)) + share * _mean_square(beyond, 1.0)
    sigma = float(np.hypot((np.sqrt(far) - 1) / _LARGE, of_noise * _NOISE_KNOWN))
    return ResidualTest(
        float(np.sqrt(squares.sum() / mean)),
        sigma,
        _neighbours(residual) if inflation < _INDEPENDENT and smooth is None else float("nan"),
        tuple(sorted(bands, key=lambda one: -one[2])),
        channels[0],
        channels[1],
        tuple((int(i), float(pulls[i])) for i in np.argsort(-abs(pulls)) if abs(pulls[i]) > _PULLED),
    )


def _mean_square(chance: float, degrees: float) -> float:
    """Return the mean square that noise exceeds with this probability."""
    return float(special.chdtri(degrees, chance)) / degrees


def _shared(residual: ComplexArray) -> float:
    """Return the number of FRFs of a line, shape (n_freq, n_o, n_i), with the noise of one: 1 if none share noise."""
    flat = residual.reshape(len(residual), -1)
    whole = flat[:, np.isfinite(flat).all(axis=0)]
    n_freq, number = whole.shape
    if number < 2 or n_freq <= number:
        return 1.0
    product = abs(whole.conj().T @ whole) ** 2
    size = np.sqrt(np.maximum(np.diagonal(product), np.finfo(float).tiny))
    # By chance, squared correlations of independent noise are 1 / n_freq.
    correlation = (product / np.outer(size, size) - 1 / n_freq) / (1 - 1 / n_freq)
    return float(max(correlation.sum() / number, 1.0))


def _neighbours(residual: ComplexArray) -> float:
    """Return the sum of Re r_l conj(r_l+1) over its standard deviation for noise."""
    products = residual[1:] * residual[:-1].conj()
    known = np.isfinite(products)
    if known.sum() < _LEAST_PRODUCTS:
        return float("nan")
    # FRFs of a line may share their noise; lines do not.
    of_lines = np.where(known, products, 0).real.sum(axis=(1, 2))
    power = float((of_lines**2).sum())
    return float(of_lines.sum() / np.sqrt(power)) if power > 0 else 0.0


def local_excess(
    squares: FloatArray, expected: FloatArray, freq_hz: FloatArray
) -> tuple[tuple[float, float, float], ...]:
    """Return a few runs of neighbouring lines with most of the excess: (low, high, share).

    Parameters
    ----------
    squares, expected : ndarray, shape (n_freq,)
        Squares of the residual of each line, and expected squares of noise.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
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
