"""M of a stiff joint, which FRFs hardly show: its expected value instead of the one nearest to the smooth FRFs.

FRFs depend on M by the product M C alone. Errors of the smooth FRFs give an M that grows as C shrinks, and the larger
M, the better C seems to be known: a joint found too stiff confirms itself. M is known to be no larger than what it is
part of: H^-1 = Z_A + M for a stiff joint, with the dynamic stiffness Z_A of side j.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.frf.bands import in_pieces
from jointfrf.frf.quantiles import medians
from jointfrf.identification.compliance_fit.manifold import LineData, OnManifold, correlated, weighing
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import call
from jointfrf.kernel.linear_algebra import invert

__all__ = ["PriorOfM", "expected_m", "prior_of_m"]

#: Smooth FRFs have at least this share of the noise.
_LEAST_SHARE = 0.2


class PriorOfM(NamedTuple):
    """What is known of M before the FRFs are looked at, and how well they show it.

    Attributes
    ----------
    size : ndarray, shape (n_freq, n, n)
        Standard deviation of the entries of M about 0, N/m.
    share : float
        Error of the smooth FRFs relative to the noise.
    """

    size: FloatArray
    share: float

    def on_lines(self, lines: slice) -> PriorOfM:
        """Return some of the lines."""
        return self._replace(size=self.size[lines])


def prior_of_m(data: LineData) -> PriorOfM:
    """Return the prior: entries of M are as large as those of gamma_jj^-1, there and elsewhere in the band."""
    n = data.entries.n

    def of_lines(own: slice) -> tuple[FloatArray, FloatArray]:
        part = data.on_slice(own)
        size = np.abs(invert(part.entries.matrix(part.smooth)[:, :n, :n], on_singular="nan"))
        squares = abs((part.measured - part.smooth) * part.inverse_std) ** 2
        return np.where(np.isfinite(size), size, 0), squares.sum(axis=1)

    size, squares = in_pieces(len(data.smooth), of_lines)
    np.hypot(size, medians(size.T).T, out=size)
    size[size == 0] = np.finfo(float).tiny
    # Of FRFs that were not smoothed, nothing is left: their error is the noise.
    left = squares.sum() / max(np.count_nonzero(data.inverse_std), 1)
    return PriorOfM(size, float(np.sqrt(np.clip(1 - left, _LEAST_SHARE**2, 1))))


def expected_m(data: LineData, c: ComplexArray, on: OnManifold, prior: PriorOfM) -> OnManifold:
    """Move from the FRFs nearest to the smooth ones to those of the expected M, and of the H that belongs to it.

    Parameters
    ----------
    data : LineData
    c : ndarray, shape (n_freq, n, n)
        Compliance of the joint, m/N.
    on : OnManifold
        The nearest FRFs; their squares are kept.
    prior : PriorOfM

    Notes
    -----
    The mean of M where it is normal about 0 and the error of the smooth FRFs is normal: the least squares of both
    together, by one Gauss-Newton step for H and M. Where FRFs show M well, it stays as it is.
    """
    h, m = (np.array(x, np.complex128, order="C") for x in (on.h, on.m))
    line_info = np.empty(len(c), np.int32)
    sizes = (int(data.entries.reciprocal), data.entries.n, correlated(data), len(c))
    spread = np.ascontiguousarray(prior.size)
    call("expect_on_joint", [*sizes, prior.share, spread, *weighing(data), np.ascontiguousarray(c), h, m, line_info])
    bad = line_info != 0
    h[bad], m[bad] = on.h[bad], on.m[bad]
    return on._replace(h=h, m=m)
