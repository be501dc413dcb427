"""Separate fits of parts of the band, if lines that contradict the joint were omitted from its fit."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.kernel.arguments import FloatArray

__all__ = ["BandParts", "fit_band_parts", "left_out_share"]

#: Number of parts of the band that are fitted separately.
_PARTS = 4
#: Probability at which parts disagree.
_DISAGREE = 1e-3


class BandParts(NamedTuple):
    """Separate fits of parts of the band, compared with the fit of all of it.

    Attributes
    ----------
    spans : tuple of (low, high)
        Parts of the band, Hz.
    values : ndarray, shape (n_parts, p)
        Parameters of each part; NaN if the part does not determine one.
    disagree : ndarray of bool, shape (p,)
        Parameters on which the parts disagree.
    std_error : ndarray, shape (p,)
        Standard deviation between the parts if they disagree, else 0; for a stiffness of a joint without cross terms,
        the standard deviation of its compliance.
    """

    spans: tuple[tuple[float, float], ...]
    values: FloatArray
    disagree: NDArray[np.bool_]
    std_error: FloatArray


def left_out_share(found: JointEstimate) -> float:
    """Return the largest share of lines that do not fit the joint, over the groups fitted on the manifold."""
    shares = [float(np.mean(~group.used)) for group in found.groups if group.unknown_cross is None]
    return max(shares, default=0.0)


def fit_band_parts(
    found: JointEstimate, freq_hz: FloatArray, factor: FloatArray, fit: Callable[[NDArray[np.intp]], JointEstimate]
) -> BandParts:
    """Fit parts of the band, and compare.

    Parameters
    ----------
    found : JointEstimate
        Estimate from all lines.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    factor : ndarray, shape (p,)
        Ratio of the variances to the variances by independent noise, without scatter between lines and parts.
    fit : callable
        Function from numbers of lines to their estimate.

    Notes
    -----
    A fit omits lines that do not fit the joint, and with them the contradiction: the residual equals the noise, and
    there is no scatter. Each part of the band has a separate estimate. The parts disagree if the squares of their
    differences from the weighted mean, over their variances, are improbable for noise.
    """
    in_compliance = np.zeros(factor.size, bool)
    for group in found.groups:
        in_compliance[group.which] = group.joint.is_compliance
    parts = [np.sort(own) for own in np.array_split(np.argsort(freq_hz), _PARTS)]
    theta, variance = (np.full((_PARTS, factor.size), np.nan) for _ in range(2))
    for b, own in enumerate(parts):
        try:
            one = fit(own)
        except (np.linalg.LinAlgError, ValueError):
            continue
        if one.parameters == found.parameters:
            theta[b], variance[b] = one.theta, np.diagonal(one.covariance) * factor
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = variance < theta**2
        value = np.where(seen, np.where(in_compliance, 1 / theta, theta), np.nan)
        weight = np.where(seen, 1 / np.where(in_compliance, variance / theta**4, variance), 0)
        mean = np.nansum(weight * value, axis=0) / weight.sum(axis=0)
        squares = np.nansum(weight * (value - mean) ** 2, axis=0)
        degrees = seen.sum(axis=0) - 1
        disagree = (degrees > 0) & (special.chdtrc(np.maximum(degrees, 1), squares) < _DISAGREE)
        scatter = np.sqrt(np.nansum((value - mean) ** 2, axis=0) / np.maximum(degrees, 1))
    spans = tuple((float(freq_hz[own].min()), float(freq_hz[own].max())) for own in parts)
    return BandParts(spans, np.where(seen, theta, np.nan), disagree, np.where(disagree, scatter, 0.0))
