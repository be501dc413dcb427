"""How well realisations of the noise explain a printed value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.report.axes import percentiles


class Score(NamedTuple):
    """A printed value beside realisations.

    Attributes
    ----------
    median, low, high : float
        50, 2.5 and 97.5 percentile; NaN where not even half of the realisations have a value.
    percentile : float
        Share of realisations below the printed value, percent.
    inside : bool
        Whether the printed value lies between `low` and `high`.
    log_density : float
        Natural logarithm of the density at the printed value, see `score`.
    """

    median: float
    low: float
    high: float
    percentile: float
    inside: bool
    log_density: float


def score(values: FloatArray, printed: float, unit: float, resolution: float) -> Score:
    """Compare a printed value with realisations.

    Parameters
    ----------
    values : ndarray, shape (r,)
        Realisations; NaN where one has no value.
    printed : float
    unit : float
        Size of the value: that of the actual parameter, or 1 % for errors in percent.
    resolution : float
        Standard deviation of what the value is rounded to, in its unit.

    Returns
    -------
    Score

    Notes
    -----
    The density is that of z = asinh(value/unit): linear up to the unit, logarithmic beyond, so that a few absurd
    realisations do not widen it. A Gaussian kernel of Silverman's width (from the smaller of the standard deviation and
    the interquartile range over 1.34), not narrower than the resolution. To the r realisations one more is added that
    may lie anywhere: density 1/(pi (1 + z^2)). So a value far from all realisations costs about ln(5 r), not infinity:
    r realisations cannot say more. Units cancel between readings of the same value.
    """
    good = values[np.isfinite(values)]
    z, at = np.arcsinh(good / unit), np.arcsinh(printed / unit)
    density = _background(float(at))
    if good.size:
        quarter, three_quarters = np.percentile(z, [25, 75])
        spread = min(float(z.std()), float(three_quarters - quarter) / 1.34) or float(z.std())
        width = np.hypot(0.9 * spread * good.size**-0.2, resolution / unit / np.hypot(1, printed / unit))
        if width > 0:
            density += float(np.exp(-0.5 * ((at - z) / width) ** 2).sum() / (width * np.sqrt(2 * np.pi)))
    log_density = float(np.log(density / (values.size + 1)))
    if good.size < values.size / 2 or not good.size:
        return Score(np.nan, np.nan, np.nan, np.nan, False, log_density)
    low, median, high = percentiles(good)
    share = float((good < printed).mean() * 100)
    return Score(median, low, high, share, bool(low <= printed <= high), log_density)


def _background(z: float) -> float:
    """Density of a realisation that may lie anywhere."""
    return float(1 / (np.pi * (1 + z**2)))
