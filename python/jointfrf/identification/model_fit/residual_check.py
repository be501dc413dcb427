"""Whether the residual is noise, and where it is not: at which frequencies, in which channels, against which priors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ResidualTest", "check_residual"]

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
