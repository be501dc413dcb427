"""Uncertainty of the parameters from the scatter between lines and between parts of the band."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from jointfrf.frf.bands import in_pieces, line_slices
from jointfrf.frf.quantiles import medians
from jointfrf.identification.manifold.estimate import FittedGroup, JointEstimate
from jointfrf.identification.manifold.line_forms import (
    LineParts,
)
from jointfrf.kernel.arguments import FloatArray

__all__ = ["BLOCKS", "Spread", "block_scatter", "chi_squared", "line_scatter", "spread_of"]

#: Parts of the band that the jackknife leaves out in turn.
BLOCKS = 10
#: Directions of less information than this share of the largest are not seen.
_SEEN = 1e-12
#: Probability at which a scatter that exceeds the noise is taken for chance.
_CHANCE = 0.95
_TINY = float(np.finfo(float).tiny)


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
    factor : ndarray
        The one used.
    chance : ndarray
        Probability that parts of the band scatter so much by noise alone; 1 where there are too few lines.
    """

    information: FloatArray
    lines: FloatArray
    blocks: FloatArray
    factor: FloatArray
    chance: FloatArray


def line_scatter(group: FittedGroup) -> tuple[FloatArray, FloatArray]:
    """Variance of the coordinates of a group from the scatter between single lines, and its degrees of freedom.

    Returns
    -------
    variance, degrees : ndarray, shape (p,)

    Notes
    -----
    It takes noise as independent between lines, but neither its size nor its direction in the complex plane from the
    weights. The gradient g_l of a line, of information A_l out of A, moves the coordinates by A^-1 g_l. Where noise is
    as the weights say, g_l g_l^T is in the mean half of A_l - A_l A^-1 A_l, the second term being what the fit has
    taken up: the sum of the squares is scaled by that.
    """
    minimum = group.fit.minimum
    pieces = line_slices(len(minimum.forms.squares))
    return _scatter(minimum.information, (minimum.of_lines(own) for own in pieces))


def block_scatter(group: FittedGroup, blocks: int = BLOCKS) -> tuple[FloatArray, FloatArray]:
    """Variance of the coordinates of a group from the scatter between parts of the band, and its degrees of freedom.

    Returns
    -------
    variance, degrees : ndarray, shape (p,)
        NaN and 0 where there are fewer than two lines a block.

    Notes
    -----
    It needs no noise model, and includes what the model of the joint cannot follow over frequency. As `line_scatter`
    with parts of the band for lines; with equal parts that is the block jackknife to first order. A part that holds
    most of the information on a parameter leaves few degrees of freedom.
    """
    minimum = group.fit.minimum
    p, n_freq = minimum.x.size, len(minimum.forms.squares)
    (diagonal,) = in_pieces(n_freq, lambda own: [np.einsum("lpp->lp", minimum.of_lines(own).information)])
    lines = np.flatnonzero(group.fit.trusted & diagonal.any(axis=1))
    if lines.size < 2 * blocks:
        return np.full(p, np.nan), np.zeros(p)
    # Blocks of equal information, so that each says about as much as the others.
    size = np.maximum(np.diagonal(minimum.information), _TINY)
    share = (diagonal[lines] / size).sum(axis=1)
    share = share / share.sum() + 1 / lines.size
    member = np.zeros((blocks, len(diagonal)))
    member[((np.cumsum(share) - share / 2) / share.sum() * blocks).astype(int), lines] = 1
    found = minimum.of_groups(member)
    return _scatter(found.information.sum(axis=0), [found])


def _scatter(whole: FloatArray, pieces: Iterable[LineParts]) -> tuple[FloatArray, FloatArray]:
    """Return the variance that the gradients of parts show, and its degrees of freedom, shape (p,) each.

    Parameters
    ----------
    whole : ndarray, shape (p, p)
        Sum of the information of all parts.
    pieces : iterable of LineParts
    """
    size = np.sqrt(np.maximum(np.diagonal(whole), _TINY))
    value, vector = np.linalg.eigh(whole / np.outer(size, size))
    # Coordinates in which the whole information is 1; directions that the data do not see are left out.
    seen = value > _SEEN * value[-1]
    root = vector[:, seen] / np.sqrt(value[seen]) / size[:, None]
    variance, (p, k) = (root**2).sum(axis=1), root.shape
    to_root = (root[:, None, :, None] * root[None, :, None, :]).reshape(p * p, k * k)
    to_steps, to_variance = root @ root.T, (root[:, :, None] * root[:, None, :]).reshape(p, k * k).T
    taken, of_expected, of_steps = np.zeros((3, p))
    for piece in pieces:
        # Information in those coordinates; with the root on one side, and on both.
        within = piece.information.reshape(-1, p * p) @ to_root
        squared = within.reshape(-1, k).T @ within.reshape(-1, k)
        taken += np.einsum("ar,rs,as->a", root, squared, root)
        of_expected += ((within @ to_variance) ** 2).sum(axis=0)
        of_steps += ((piece.gradient @ to_steps) ** 2).sum(axis=0)
    left = np.maximum(variance - taken, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        scatter = of_steps * variance / left
        degrees = variance**2 / of_expected * left / variance
    return scatter, np.nan_to_num(degrees)


def spread_of(found: JointEstimate, inflation: float, *, is_level_known: bool = True) -> Spread:
    """Return by how much the variance of each parameter exceeds that from independent noise of the level known.

    Parameters
    ----------
    found : JointEstimate
    inflation : float
        By how much correlation between lines makes the variance of a mean larger, at least 1.
    is_level_known : bool
        Whether the noise is known; otherwise its level is that of the residual.

    Notes
    -----
    The largest of information, scatter between lines and scatter between blocks; the latter two only where they exceed
    the former by more than chance, for one parameter or for all together.
    """
    scale = max(found.scale, 1.0) if is_level_known else found.scale
    by_noise = np.full(len(found.parameters), inflation * scale)
    by_lines, by_blocks, of_lines, of_blocks = (np.full_like(by_noise, np.nan) for _ in range(4))
    for group in found.groups:
        own = np.diagonal(group.fit.minimum.covariance)
        scatter, of_lines[group.which] = line_scatter(group)
        blocks, of_blocks[group.which] = block_scatter(group)
        with np.errstate(divide="ignore", invalid="ignore"):
            by_lines[group.which] = np.where(own > 0, inflation * scatter / own, np.nan)
            by_blocks[group.which] = np.where(own > 0, blocks / own, np.nan)
    factor = _larger_than_chance(by_noise, by_lines, of_lines / inflation)
    with np.errstate(divide="ignore", invalid="ignore"):
        chance = np.nan_to_num(special.chdtrc(of_blocks, of_blocks * by_blocks / factor), nan=1.0)
    factor = _larger_than_chance(factor, by_blocks, of_blocks)
    return Spread(by_noise, by_lines, by_blocks, factor, chance)


def _larger_than_chance(factor: FloatArray, other: FloatArray, degrees: FloatArray) -> FloatArray:
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
    if (mean := float(ratio[known].mean())) > chi_squared(_CHANCE, few * count) / (few * count):
        raised *= mean
    single = chi_squared(1 - (1 - _CHANCE) / count, degrees[known]) / degrees[known]
    student = (special.stdtrit(degrees[known], 0.975) / special.ndtri(0.975)) ** 2
    larger = np.where(ratio[known] > single, student * other[known], 0)
    raised[known] = np.maximum(raised[known], larger)
    return raised


def chi_squared(probability: float, degrees: float | FloatArray) -> Any:
    """Quantile of chi-squared, without the time that scipy.stats takes to import."""
    return 2 * special.gammaincinv(np.asarray(degrees) / 2, probability)
