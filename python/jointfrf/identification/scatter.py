"""Scatter of the gradient between lines, parts of the band and hits: a covariance without a model of the noise."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.quantiles import medians
from jointfrf.kernel.arguments import FloatArray

__all__ = [
    "BLOCKS",
    "LineParts",
    "Scatter",
    "Spread",
    "block_members",
    "chi_squared",
    "scatter_of",
    "spread_of_scatters",
]

#: Parts of the band that the jackknife leaves out in turn.
BLOCKS = 10
#: Directions of less information than this share of the largest are not seen.
_SEEN = 1e-12
#: Probability at which a scatter that exceeds the noise is taken for chance.
_CHANCE = 0.95
#: The same between channels: they are few, so that chance would widen intervals fourfold in one test of twenty.
_OF_CHANNELS = 0.999
_TINY = float(np.finfo(float).tiny)


class LineParts(NamedTuple):
    """What each line, or part of the data, adds to the normal equations.

    Attributes
    ----------
    gradient : ndarray, shape (n_parts, p)
    information : ndarray, shape (n_parts, p, p)
    """

    gradient: FloatArray
    information: FloatArray


class Scatter(NamedTuple):
    """Variance of each parameter that a scatter shows, shape (p,) each.

    Attributes
    ----------
    factor : ndarray
        Over that from independent noise; NaN where it is not known.
    degrees : ndarray
        Degrees of freedom.
    """

    factor: FloatArray
    degrees: FloatArray

    @classmethod
    def none(cls, p: int) -> Scatter:
        """Return a scatter that is not known."""
        return cls(np.full(p, np.nan), np.zeros(p))


class Spread(NamedTuple):
    """Factors by which the variance of parameters exceeds that from independent noise, shape (p,) each.

    Attributes
    ----------
    information : ndarray
        From the correlation between lines, and from a residual larger than the noise.
    lines : ndarray
        From the scatter between lines, which noise that is not circular makes larger; NaN where there are too few.
    blocks : ndarray
        From the scatter between parts of the band; NaN where there are too few lines.
    hits : ndarray
        From the scatter between responses, or forces, where that is the larger; NaN where it is not looked at.
    factor : ndarray
        The one used.
    chance : ndarray
        Probability that parts of the band scatter so much by noise alone; 1 where there are too few lines.
    """

    information: FloatArray
    lines: FloatArray
    blocks: FloatArray
    hits: FloatArray
    factor: FloatArray
    chance: FloatArray

    def between_amplitudes(self, parts: Scatter) -> Spread:
        """Return factors that add the variance between lines of different motion, each amplitude being as good.

        The scatter is of the mean of the parts: the variance of one of them is larger by their number, degrees of
        freedom + 1, and noise alone makes it as large as that of the noise.
        """
        between = (parts.degrees + 1) * np.maximum(parts.factor - self.information, 0)
        return self._replace(factor=self.factor + np.nan_to_num(between))


def scatter_of(whole: FloatArray, pieces: Iterable[LineParts]) -> tuple[FloatArray, FloatArray]:
    """Return the variance that the gradients of parts show, and its degrees of freedom, shape (p,) each.

    Parameters
    ----------
    whole : ndarray, shape (p, p)
        Sum of the information of all parts.
    pieces : iterable of LineParts

    Notes
    -----
    It takes noise as independent between parts, but neither its size nor its direction in the complex plane from the
    weights. The gradient g_l of a part, of information A_l out of A, moves the coordinates by A^-1 g_l. Where noise is
    as the weights say, g_l g_l^T is in the mean u (A_l - A_l A^-1 A_l), u being the mean square of a real number in
    the units of the squares and the second term what the fit has taken up: the sum of the squares is scaled by that.
    """
    size = np.sqrt(np.maximum(np.diagonal(whole), _TINY))
    value, vector = np.linalg.eigh(whole / np.outer(size, size))
    # Coordinates in which the whole information is 1; directions that the data do not see are left out.
    seen = value > _SEEN * value[-1]
    root = vector[:, seen] / np.sqrt(value[seen])
    to_those = root / size[:, None]
    variance, (p, k) = (root**2).sum(axis=1), root.shape
    # Steps and variances in units of 1/size: of what the FRFs hardly see they are too large to be squared.
    to_steps, to_variance = to_those @ root.T, (root[:, :, None] * root[:, None, :]).reshape(p, k * k).T
    taken, of_expected, of_steps = np.zeros((3, p))
    for piece in pieces:
        # Information in those coordinates: with the root on one side, and on both.
        half = (piece.information.reshape(-1, p) @ to_those).reshape(-1, p, k)
        within = half.swapaxes(1, 2).reshape(-1, p) @ to_those
        taken += np.einsum("ar,rs,as->a", root, within.T @ within, root)
        of_expected += ((within.reshape(-1, k * k) @ to_variance) ** 2).sum(axis=0)
        of_steps += ((piece.gradient @ to_steps) ** 2).sum(axis=0)
    left = np.maximum(variance - taken, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        scatter = of_steps * variance / left / size**2
        degrees = variance**2 / of_expected * left / variance
    return scatter, np.nan_to_num(degrees)


def block_members(share: FloatArray, lines: NDArray[np.intp], blocks: int = BLOCKS) -> FloatArray:
    """Return which lines are in which part of the band, shape (blocks, n_freq): parts of about equal information.

    Parameters
    ----------
    share : ndarray, shape (n_freq, p)
        Of each line in the information on each coordinate.
    lines : ndarray of int
        Those used, at least two a part.
    blocks : int
    """
    own = share[lines].sum(axis=1)
    own = own / own.sum() + 1 / lines.size
    member = np.zeros((blocks, len(share)))
    member[((np.cumsum(own) - own / 2) / own.sum() * blocks).astype(int), lines] = 1
    return member


def spread_of_scatters(
    by_noise: FloatArray,
    lines: Scatter,
    blocks: Scatter,
    hits: Iterable[Scatter] = (),
    beside: FloatArray | float = 0.0,
) -> Spread:
    """Return by how much the variance of each parameter exceeds that from independent noise of the level known.

    Parameters
    ----------
    by_noise : ndarray, shape (p,)
        By the correlation between lines and the residual.
    lines, blocks : Scatter
        Between single lines, and between parts of the band.
    hits : iterable of Scatter
        Between responses, between forces.
    beside : ndarray, shape (p,)
        What else makes parts of the band and channels differ, and is allowed for elsewhere.

    Notes
    -----
    The largest of these; scatters only where they exceed the former by more than chance, for one parameter or for all
    together.
    """
    factor = _larger_than_chance(by_noise, *lines)
    with np.errstate(divide="ignore", invalid="ignore"):
        chance = special.chdtrc(blocks.degrees, blocks.degrees * blocks.factor / (factor + beside))
    of_hits = np.full_like(factor, np.nan)
    for one in (blocks, *hits):
        probability = _CHANCE if one is blocks else _OF_CHANNELS
        factor = np.maximum(_larger_than_chance(factor + beside, *one, probability) - beside, factor)
        if one is not blocks:
            of_hits = np.fmax(of_hits, one.factor)
    return Spread(by_noise, lines.factor, blocks.factor, of_hits, factor, np.nan_to_num(chance, nan=1.0))


def _larger_than_chance(
    factor: FloatArray, other: FloatArray, degrees: FloatArray, probability: float = _CHANCE
) -> FloatArray:
    """Return variance factors, raised to others of few degrees of freedom where these are larger by more than chance.

    By the mean over the parameters where this is; each by Student's t for its few degrees.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = other / factor
    known = np.isfinite(ratio) & (degrees >= 2)
    if not known.any():
        return factor
    raised = factor.copy()
    count, few = int(known.sum()), float(medians(degrees[known]))
    if (mean := float(ratio[known].mean())) > chi_squared(probability, few * count) / (few * count):
        raised *= mean
    single = chi_squared(1 - (1 - probability) / count, degrees[known]) / degrees[known]
    larger = np.flatnonzero(known)[ratio[known] > single]
    if larger.size:
        student = (special.stdtrit(degrees[larger], 0.975) / special.ndtri(0.975)) ** 2
        raised[larger] = np.maximum(raised[larger], student * other[larger])
    return raised


def chi_squared(probability: float, degrees: float | FloatArray) -> Any:
    """Quantile of chi-squared, without the time that scipy.stats takes to import."""
    return 2 * special.gammaincinv(np.asarray(degrees) / 2, probability)
