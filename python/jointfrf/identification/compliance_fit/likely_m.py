"""M of a stiff joint, which FRFs hardly show: its expected value instead of the one nearest to the smooth FRFs.

FRFs depend on M by the product M C alone. Errors of the smooth FRFs give an M that grows as C shrinks, and the larger
M, the better C seems to be known: a joint found too stiff confirms itself. M is known to be no larger than what it is
part of: H^-1 = Z_A + M for a stiff joint, with the dynamic stiffness Z_A of side j.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.identification.compliance_fit.manifold import LineData, OnManifold
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert

__all__ = ["PriorOfM", "expected_m", "prior_of_m"]

#: Smooth FRFs have at least this share of the noise.
_LEAST_SHARE = 0.2
#: Keeps the equations of H regular where no entry shows it.
_ROUNDING = 1e-12


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
    inverse = invert(data.entries.matrix(data.smooth)[:, :n, :n], on_singular="nan")
    size: FloatArray = np.abs(inverse)
    size = np.where(np.isfinite(size), size, 0)
    size = np.hypot(size, np.median(size, axis=0))
    size[size == 0] = np.finfo(float).tiny
    # Of FRFs that were not smoothed, nothing is left: their error is the noise.
    left = (abs((data.measured - data.smooth) * data.inverse_std) ** 2).sum() / max(np.count_nonzero(data.used), 1)
    return PriorOfM(np.asarray(size, np.float64), float(np.sqrt(np.clip(1 - left, _LEAST_SHARE**2, 1))))


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
    a, b = data.entries.free
    u, size = a.size, prior.size[:, a, b]
    of_h, of_m = _slopes(data, c, on)
    unit = np.linalg.norm(of_h, axis=1)
    unit = np.where(unit > 0, unit, 1.0)
    slope = np.concatenate([of_h / unit[:, None], of_m * size[:, None]], axis=2)
    normal = slope.conj().swapaxes(1, 2) @ slope
    normal[:, range(2 * u), range(2 * u)] += np.r_[np.full(u, _ROUNDING), np.full(u, prior.share**2)]
    right = np.zeros((len(c), 2 * u), np.complex128)
    right[:, u:] = -(prior.share**2) * on.m[:, a, b] / size
    step = np.linalg.solve(normal, right[..., None])[..., 0]
    units = data.entries.units
    h = on.h + np.tensordot(step[:, :u] / unit, units, 1)
    m = on.m + np.tensordot(step[:, u:] * size, units, 1)
    good = np.isfinite(h).all(axis=(1, 2), keepdims=True) & np.isfinite(m).all(axis=(1, 2), keepdims=True)
    return on._replace(h=np.where(good, h, on.h), m=np.where(good, m, on.m))


def _slopes(data: LineData, c: ComplexArray, on: OnManifold) -> tuple[ComplexArray, ComplexArray]:
    """Return the derivatives of the weighted entries by the free ones of H and of M, shape (n_freq, q, u) each."""
    n, units = data.entries.n, data.entries.units
    one, zero = np.eye(n), np.zeros((n, n))
    h, m, c = on.h[:, None], on.m[:, None], c[:, None]
    right, left = one - m @ c, one - c @ m
    uc, cu = units @ c, c @ units
    of_h = (units, units @ right, left @ units, left @ units @ right)
    of_m = (zero, -h @ uc, -cu @ h, -cu @ h @ right - left @ h @ uc - c @ uc)
    return _entries(data, of_h), _entries(data, of_m)


def _entries(data: LineData, blocks: tuple[ComplexArray | FloatArray, ...]) -> ComplexArray:
    """Return the weighted entries of the blocks jj, jk, kj, kk, shape (n_freq, q, u)."""
    entries = data.entries
    n = entries.n
    gamma = np.empty((len(data.smooth), len(entries.units), 2 * n, 2 * n), np.complex128)
    gamma[..., :n, :n], gamma[..., :n, n:], gamma[..., n:, :n], gamma[..., n:, n:] = blocks
    weighted = (entries.take(gamma) * data.inverse_std[:, None]).swapaxes(1, 2)
    return weighted if data.correlation is None else data.correlation @ weighted
