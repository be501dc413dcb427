"""The likelihood of FRFs of an assembly, linearised at its minimum."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.identification.linearised import Linearised, LineParts
from jointfrf.identification.minimise import Minimum, inverse_information
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["BandHomogeneity", "ModelLinearised", "band_homogeneity"]

#: Standard deviation of a logarithm, or of a value relative to its nominal value, above which it is not determined.
_DETERMINED = 100.0


#: Number of parts of a band without gaps, least gap in mean distances of lines, and lines of a part for each parameter.
_PARTS, _GAP, _LINES = 4, 10, 2
#: Probability above which differences between parts are noise.
_CHANCE = 1e-3


class BandHomogeneity(NamedTuple):
    """Test of homogeneity: whether parts of the band show the same parameters.

    Attributes
    ----------
    spans : tuple of (float, float)
        Parts of the band, Hz.
    steps : ndarray, shape (n_parts, p)
        Coordinates by each part minus coordinates by all lines, by one Gauss-Newton step; NaN if undetermined.
    factor : ndarray, shape (p,)
        Factor of the variances so that the interval covers the parts; 1 if chance explains the differences.
    apart : ndarray of int, shape (p, 2)
        The two parts that differ most, relative to their standard errors, the one further from all lines first.
    """

    spans: tuple[tuple[float, float], ...]
    steps: FloatArray
    factor: FloatArray
    apart: NDArray[np.intp]


@dataclass(frozen=True)
class ModelLinearised(Linearised):
    """The likelihood of FRFs of an assembly about its minimum, in coordinates of the printed parameters.

    Attributes
    ----------
    n_freq, information, slope, priors, determined
        Attributes of `Linearised`.
    inflation : float
        Number of lines that carry the noise of one independent line; its inverse is the mean square of a real residual.
    slopes : ndarray, shape (p, n_freq, n_o, n_i)
        Derivatives of the weighted FRFs by the coordinates.
    residual : ndarray, shape (n_freq, n_o, n_i)
        Weighted residual.
    of_errors : ndarray, shape (p, n_freq, n_o, n_i)
        Change of the gradient (its real part) by a relative error of 1 of each FRF.
    squares : ndarray, shape (n_freq, n_o, n_i)
        Squares of the weighted residual that such an error leaves.
    """

    n_freq: int
    information: FloatArray
    slope: FloatArray
    priors: LineParts
    determined: NDArray[np.bool_]
    inflation: float
    slopes: ComplexArray
    residual: ComplexArray
    of_errors: ComplexArray
    squares: FloatArray

    @classmethod
    def of(cls, likelihood: Likelihood, minimum: Minimum, inflation: float) -> ModelLinearised:
        """Return the parts at a minimum of a likelihood; parameters that are not printed are eliminated."""
        vector, x, n = likelihood.vector, minimum.x, likelihood.vector.n_shown
        y, slopes = likelihood.prediction.linearised(vector, vector.to_values(x))
        whole = minimum.information
        kept = np.eye(n, x.size)
        if n < x.size:
            kept[:, n:] = -whole[:n, n:] @ inverse_information(whole[n:, n:])
        # A prediction may share its derivatives without a copy.
        slopes = np.tensordot(kept * vector.slope(x), slopes, 1)
        slopes = likelihood.weighted(slopes)
        pulled = kept @ vector.pull_slopes(x).T
        priors = LineParts(-(pulled * vector.pulls(x)).T, pulled.T[:, :, None] * pulled.T[:, None])
        residual = likelihood.weighted(likelihood.difference(y))
        of_errors = likelihood.carried_back(slopes).conj() * y
        squares = np.asarray(abs(y) ** 2 * likelihood.precision, np.float64)
        information = kept @ whole @ kept.T
        size = np.where(vector.is_log, 1, np.maximum(abs(x), 1))[:n]
        determined = np.diagonal(information) * size**2 > _DETERMINED**-2
        slope = np.diag(vector.slope(x)[:n])
        return cls(
            len(residual), information, slope, priors, determined, inflation, slopes, residual, of_errors, squares
        )

    def lines(self, which: slice) -> LineParts:
        """Return the parts of some lines."""
        return self._parts(1, which)

    def channels(self) -> Iterator[LineParts]:
        """Yield the parts of all responses, then the parts of all forces, if there are several."""
        for axis in (2, 3):
            if self.slopes.shape[axis] > 1:
                yield self._parts(axis)

    def _parts(self, axis: int, which: slice = slice(None)) -> LineParts:
        """Return the parts along an axis of the slopes: lines (1), responses (2) or forces (3)."""
        slopes = np.ascontiguousarray(np.moveaxis(self.slopes, axis, 0)[which])
        flat = slopes.reshape(*slopes.shape[:2], -1).view(np.float64)
        residual = np.ascontiguousarray(np.moveaxis(self.residual, axis - 1, 0)[which]).reshape(len(flat), -1)
        gradient = (flat @ residual.view(np.float64)[:, :, None])[..., 0]
        return LineParts(gradient, flat @ flat.swapaxes(1, 2))

    def errors(self, masks: NDArray[np.bool_], lines: slice) -> Iterator[tuple[ComplexArray, FloatArray]]:
        """Yield the effect of a relative error of 1 of the FRFs in each mask."""
        for mask in masks:
            gradient = self.of_errors[:, lines, mask].sum(axis=2).T
            yield gradient, self.squares[lines, mask].sum(axis=1) * (self.inflation / 2)


def band_homogeneity(at: ModelLinearised, freq_hz: FloatArray, factor: FloatArray) -> BandHomogeneity:
    """Compare parts of the band, each fitted separately.

    Parameters
    ----------
    at : ModelLinearised
        Likelihood about its minimum.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    factor : ndarray, shape (p,)
        Variance factors by the scatter between lines and blocks of lines.

    Notes
    -----
    The parts are separated by gaps of the lines, or are quarters of the band. Squares of the differences from all
    lines, over their variance, follow chi-squared if the parts agree. If they do not, the difference is an error of the
    models or of the joint, which no number of parts averages out. The variance of the mean is then at least the
    variance of a part.
    """
    order, p = np.argsort(freq_hz), len(at.slope)
    distance = np.diff(freq_hz[order])
    ends = np.flatnonzero(distance > _GAP * np.median(distance)) + 1 if distance.size else np.zeros(0, np.intp)
    least = _LINES * (p + 1)
    own = [one for one in np.split(order, ends) if one.size >= least]
    if len(own) < 2:
        own = [one for one in np.array_split(order, _PARTS) if one.size >= least]
    spans = tuple((float(freq_hz[one[0]]), float(freq_hz[one[-1]])) for one in own)
    steps, grown, apart = np.full((len(own), p), np.nan), np.ones(p), np.zeros((p, 2), np.intp)
    if len(own) < 2:
        return BandHomogeneity(spans, steps, grown, apart)
    member = np.zeros((len(own), freq_hz.size))
    for row, lines in zip(member, own, strict=True):
        row[lines] = 1
    parts = at.grouped(member)
    n, variance = len(own), np.full((len(own), p), np.nan)
    of_priors = parts.gradient[n:].sum(axis=0), parts.information[n:].sum(axis=0)
    for i in range(n):
        covariance = inverse_information(parts.information[i] + of_priors[1], open_ends=True)
        steps[i] = covariance @ (parts.gradient[i] + of_priors[0])
        variance[i] = np.maximum(np.diagonal(covariance - at.covariance), 0) * factor
    shown = (variance > 0) & at.determined
    steps[~shown] = np.nan
    for i in np.flatnonzero(shown.sum(axis=0) > 1).tolist():
        which = np.flatnonzero(shown[:, i])
        step, weight = steps[which, i], 1 / variance[which, i]
        squares = float(step**2 @ weight)
        if special.chdtrc(which.size - 1, squares) < _CHANCE / p:
            of_part = squares / weight.sum() / (at.covariance[i, i] * factor[i])
            grown[i] = max(squares / (which.size - 1), of_part)
            difference = (step[:, None] - step) ** 2 / (1 / weight[:, None] + 1 / weight)
            pair = which[list(np.unravel_index(int(difference.argmax()), difference.shape))]
            apart[i] = pair[np.argsort(-abs(steps[pair, i]))]
    return BandHomogeneity(spans, steps, grown, apart)
