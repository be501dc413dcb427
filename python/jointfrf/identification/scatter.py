"""Cluster-robust covariance: scatter of the gradient between lines, blocks of lines, responses and forces."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from jointfrf.frf.bands import line_slices
from jointfrf.frf.quantiles import medians
from jointfrf.identification.linearised import Linearised, LineParts
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import TINY, FloatArray

__all__ = [
    "BLOCKS",
    "Scatter",
    "Spread",
    "block_members",
    "block_scatter",
    "chi_squared",
    "excess_probability",
    "line_scatter",
    "scatter_of",
    "spread_of",
    "student_squared",
    "with_excess",
]

#: Number of blocks of lines.
BLOCKS = 10
#: Relative tolerance of the rank of the information.
_RANK = 1e-12
#: Degrees of freedom of the scatter between blocks with equal information. A scatter with fewer has prior odds against
#: it, because an interval from few degrees of freedom is wide.
_FULL = BLOCKS - 1.0


class Scatter(NamedTuple):
    """Variance of each coordinate by the scatter between clusters, shape (p,) each.

    Attributes
    ----------
    factor : ndarray
        Ratio to the variance for independent noise; NaN if it is unknown.
    degrees : ndarray
        Degrees of freedom.
    """

    factor: FloatArray
    degrees: FloatArray

    @classmethod
    def unknown(cls, p: int) -> Scatter:
        """Return a scatter that is unknown."""
        return cls(np.full(p, np.nan), np.zeros(p))


class Spread(NamedTuple):
    """Factors of the variance of each coordinate over the variance for independent noise, shape (p,) each.

    Attributes
    ----------
    information : ndarray
        Factor by the correlation between lines and the size of the residual.
    lines : ndarray
        Factor by the scatter between lines, which noise that is not circular increases; NaN if it is unknown.
    factor : ndarray
        Factor in use.
    chance : ndarray
        Probability that blocks of lines scatter by as much for noise alone; 1 if there are too few lines.
    """

    information: FloatArray
    lines: FloatArray
    factor: FloatArray
    chance: FloatArray


def scatter_of(whole: FloatArray, pieces: Iterable[LineParts]) -> tuple[FloatArray, FloatArray]:
    """Return the variance of each coordinate by the gradients of clusters, and its degrees of freedom, shape (p,) each.

    Parameters
    ----------
    whole : ndarray, shape (p, p)
        Sum of the information of all clusters.
    pieces : iterable of LineParts
        Gradients and information of the clusters.

    Notes
    -----
    A cluster with gradient g_l and information A_l out of A moves the coordinates by A^-1 g_l. If the weights describe
    the noise, the mean of g_l g_l^T is u (A_l - A_l A^-1 A_l), where u is the variance of a real residual. The sum of
    the squares is scaled by this expectation [1]_, and has Satterthwaite degrees of freedom.

    References
    ----------
    .. [1] R. M. Bell, D. F. McCaffrey, Bias reduction in standard errors for linear regression with multi-stage
       samples, Survey Methodology 28 (2002) 169-181.
    """
    size = np.sqrt(np.maximum(np.diagonal(whole), TINY))
    value, vector = np.linalg.eigh(whole / np.outer(size, size))
    kept = value > _RANK * value[-1]
    # Coordinates with unit information; in units of 1/size no square overflows.
    root = vector[:, kept] / np.sqrt(value[kept])
    to_unit = root / size[:, None]
    variance, (p, k) = (root**2).sum(axis=1), root.shape
    to_steps, to_variance = to_unit @ root.T, (root[:, :, None] * root[:, None, :]).reshape(p, k * k).T
    taken, of_expected, of_steps = np.zeros((3, p))
    for piece in pieces:
        half = (piece.information.reshape(-1, p) @ to_unit).reshape(-1, p, k)
        within = half.swapaxes(1, 2).reshape(-1, p) @ to_unit
        taken += np.einsum("ar,rs,as->a", root, within.T @ within, root)
        of_expected += ((within.reshape(-1, k * k) @ to_variance) ** 2).sum(axis=0)
        of_steps += ((piece.gradient @ to_steps) ** 2).sum(axis=0)
    left = np.maximum(variance - taken, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        scatter = of_steps * variance / left / size**2
        degrees = variance**2 / of_expected * left / variance
    return scatter, np.nan_to_num(degrees)


def block_members(share: FloatArray, lines: NDArray[np.intp], blocks: int = BLOCKS) -> FloatArray:
    """Return the lines of each block, 1 and 0, shape (blocks, n_freq); blocks have about equal information.

    Parameters
    ----------
    share : ndarray, shape (n_freq, p)
        Share of each line in the information on each coordinate.
    lines : ndarray of int
        Lines in the order in which blocks are formed, at least two a block.
    blocks : int
        Number of blocks.
    """
    own = share[lines].sum(axis=1)
    own = own / own.sum() + 1 / lines.size
    member = np.zeros((blocks, len(share)))
    member[((np.cumsum(own) - own / 2) / own.sum() * blocks).astype(int), lines] = 1
    return member


def spread_of(
    at: Linearised,
    by_noise: float,
    inflation: float = 1.0,
    beside: FloatArray | float = 0.0,
    motion: FloatArray | None = None,
) -> Spread:
    """Return variance factors by the residual and by the scatter between clusters.

    Parameters
    ----------
    at : Linearised
    by_noise : float
        Variance factor by the correlation between lines and the residual.
    inflation : float
        Number of lines that carry the noise of one independent line.
    beside : ndarray, shape (p,)
        Variance factor of effects with separate columns: clusters may differ by these, too.
    motion : ndarray, shape (n_freq,), optional
        Size of the motion on each line, if the FRFs depend on amplitude.

    Notes
    -----
    The largest factor counts, weighted by the probability that the scatter is no chance (`excess_probability`).
    """
    lines, blocks = line_scatter(at, inflation), block_scatter(at)
    information = np.full(at.determined.size, by_noise)
    factor = with_excess(information, lines)
    with np.errstate(divide="ignore", invalid="ignore"):
        chance = special.chdtrc(blocks.degrees, blocks.degrees * blocks.factor / (factor + beside))
    for one in (blocks, *(_scatter(at, [parts]) for parts in at.channels())):
        factor = np.maximum(with_excess(factor + beside, one) - beside, factor)
    if motion is not None:
        # Amplitudes count equally: the variance of one is the variance of the mean of the blocks times their number.
        between = block_scatter(at, motion)
        factor = factor + np.nan_to_num((between.degrees + 1) * np.maximum(between.factor - by_noise, 0))
    return Spread(information, lines.factor, factor, np.nan_to_num(chance, nan=1.0))


def line_scatter(at: Linearised, inflation: float = 1.0) -> Scatter:
    """Return the scatter between single lines, of which `inflation` carry the noise of one independent line."""
    return _scatter(at, (at.lines(which) for which in line_slices(at.n_freq)), inflation)


def block_scatter(at: Linearised, order: FloatArray | None = None) -> Scatter:
    """Return the scatter between blocks of lines: of the band, or in the order of `order`, shape (n_freq,).

    It includes the misfit of the model of the joint over frequency. A block with most of the information on a
    parameter leaves few degrees of freedom, and fewer than two lines a block leave none.
    """
    share = at.share[:, at.determined]
    used = np.flatnonzero(share.any(axis=1))
    if used.size < 2 * BLOCKS:
        return Scatter.unknown(at.determined.size)
    if order is not None:
        used = used[np.argsort(order[used], kind="stable")]
    return _scatter(at, [at.grouped(block_members(share, used))], with_priors=False)


def _scatter(
    at: Linearised, pieces: Iterable[LineParts], inflation: float = 1.0, *, with_priors: bool = True
) -> Scatter:
    """Return the scatter between clusters in the coordinates that the FRFs determine; each prior is one cluster."""
    own, found = at.determined, Scatter.unknown(at.determined.size)
    if not own.any():
        return found
    both = np.ix_(own, own)
    every = [*pieces, at.priors] if with_priors and len(at.priors.gradient) else pieces
    kept = (LineParts(one.gradient[:, own], one.information[:, own][:, :, own]) for one in every)
    variance, degrees = scatter_of(at.information[both], kept)
    known = np.diagonal(at.covariance if own.all() else inverse_information(at.information[both], open_ends=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        found.factor[own] = np.where(known > 0, inflation * variance / known, np.nan)
    found.degrees[own] = degrees / inflation
    return found


def excess_probability(ratio: ArrayLike, degrees: ArrayLike, count: int = 1) -> FloatArray:
    """Return the probability that a mean square exceeds its expectation, by the Bayesian information criterion.

    Parameters
    ----------
    ratio : array_like
        Mean square over its expectation.
    degrees : array_like
        Its degrees of freedom.
    count : int
        Number of mean squares of which this is one: any of them may exceed by chance.

    Notes
    -----
    The likelihood of a mean square with the variance found, over that with the variance expected, is
    exp((ratio - 1 - ln ratio) degrees / 2); an excess has one parameter more, which costs sqrt(degrees). Prior odds are
    1, and 9 / degrees against it for few degrees of freedom.
    """
    above, own = np.maximum(ratio, 1.0), np.asarray(degrees, np.float64)
    odds = count * np.maximum(1.0, _FULL / np.maximum(own, 1.0))
    against = odds * np.sqrt(own) * np.exp(-own / 2 * (above - 1 - np.log(above)))
    return np.asarray(np.where(above > 1, 1 / (1 + against), 0.0))


def with_excess(factor: FloatArray, other: Scatter) -> FloatArray:
    """Return variance factors, raised to the factors of a scatter as far as these are more than chance.

    The test uses the mean over the coordinates, and each coordinate with Student's t for its few degrees of freedom.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = other.factor / factor
    known = np.flatnonzero(np.isfinite(ratio) & (other.degrees >= 2))
    if known.size == 0:
        return factor
    raised, own, degrees = factor.copy(), ratio[known], other.degrees[known]
    mean, few = own.mean(), float(medians(degrees)) * known.size
    raised *= 1 + excess_probability(mean, few) * (max(mean, 1.0) - 1)
    alone = excess_probability(own, degrees, known.size)
    wider = factor[known] * (1 + alone * np.maximum(student_squared(degrees) * own - 1, 0))
    raised[known] = np.maximum(raised[known], wider)
    return raised


def student_squared(degrees: FloatArray) -> FloatArray:
    """Return the squared ratio of the 97.5 % quantiles of Student's t and of the normal distribution."""
    return np.asarray((special.stdtrit(degrees, 0.975) / special.ndtri(0.975)) ** 2)


def chi_squared(probability: float, degrees: float | FloatArray) -> Any:
    """Return a quantile of chi-squared, without the time that scipy.stats takes to import."""
    return 2 * special.gammaincinv(np.asarray(degrees) / 2, probability)
