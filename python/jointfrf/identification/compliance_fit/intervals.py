"""Uncertainty of the parameters: from the noise, and from the scatter between parts of the band."""

from __future__ import annotations

import numpy as np

from jointfrf.identification.compliance_fit.estimator import ComplianceEstimate
from jointfrf.identification.compliance_fit.least_squares import inverse_information
from jointfrf.kernel.arguments import FloatArray

__all__ = ["MISFIT", "jackknife_covariance", "parameter_covariance"]

#: The residual may exceed the noise by this factor before the model of the joint is doubted.
MISFIT = 1.3


def parameter_covariance(result: ComplianceEstimate, level: float, residual: float) -> FloatArray:
    """Covariance of the parameters of the first realisation, shape (p, p).

    Parameters
    ----------
    result : ComplianceEstimate
    level, residual : float
        Noise level of the FRFs, and the one that the residual shows.

    Returns
    -------
    ndarray, shape (p, p)
        From the larger of both levels; where the residual exceeds the noise by `MISFIT`, not below the jackknife.
    """
    covariance: FloatArray = result.covariance[0] * max(level, residual) ** 2
    if residual > MISFIT * level:
        by_blocks = jackknife_covariance(result)[0]
        grown = np.sqrt(np.maximum(np.diagonal(by_blocks) / np.diagonal(covariance), 1))
        covariance = covariance * np.outer(grown, grown)
    return covariance


def jackknife_covariance(found: ComplianceEstimate, blocks: int = 10) -> FloatArray:
    """Covariance of the parameters from leaving out one block of neighbouring lines after the other.

    Parameters
    ----------
    found : ComplianceEstimate
    blocks : int
        Number of blocks.

    Returns
    -------
    ndarray, shape (r, p, p)

    Notes
    -----
    It needs no noise level, and includes what the model of the joint cannot follow over frequency. To first order, by
    one Gauss-Newton step without the block.
    """
    r, _, p = found.line_gradient.shape
    used = np.flatnonzero(found.line_information.any(axis=(0, 2, 3)))
    blocks = min(blocks, used.size)
    information = found.line_information.sum(axis=1)
    gradient = found.line_gradient.sum(axis=1)
    change = np.empty((blocks, r, p))
    for b, lines in enumerate(np.array_split(used, blocks)):
        other_information = information - found.line_information[:, lines].sum(axis=1)
        other_gradient = gradient - found.line_gradient[:, lines].sum(axis=1)
        change[b] = (inverse_information(other_information) @ other_gradient[..., None])[..., 0]
    change -= change.mean(axis=0)
    covariance: FloatArray = (blocks - 1) / blocks * np.einsum("bra,brc->rac", change, change)
    return covariance
