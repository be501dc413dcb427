"""What the phases of driving-point FRFs say: time convention, quantity, sign, power that comes out of a structure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.measurement import modulus
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Circles", "Sectors", "circles", "mean_exponent", "one_sidedness", "sectors"]

#: Im (or Re) of a driving-point FRF has one sign to this share, (sum of values) / (sum of their sizes).
_ONE_SIDED = 0.3
#: FRFs whose phase agrees better than this from line to line show circles.
_CIRCLES_SEEN = 0.5


@dataclass(frozen=True)
class Circles:
    """The direction in which FRFs run through the complex plane.

    Attributes
    ----------
    value : float
        Median over FRFs of Im sum conj(h_k) h_k+1 / sum |h_k|^2: below zero for exp(+i w t); it is the time at which
        the impulse response has its energy, in radians of the longest time that the lines resolve.
    share : float
        Share of FRFs that run backwards.
    seen : int
        Number of FRFs that are smooth enough.
    """

    value: float
    share: float
    seen: int


@dataclass(frozen=True, eq=False)
class Sectors:
    """The half plane in which each driving-point FRF lies.

    Attributes
    ----------
    quarter : ndarray of int, shape (n,)
        0: Im < 0, a receptance; 1: Re > 0, a mobility; 2: Im > 0, an accelerance or a receptance of the wrong sign;
        3: Re < 0, a mobility of the wrong sign; -1: not told.
    negative : ndarray, shape (n,)
        Share of the lines with Im < 0.
    balance : ndarray, shape (n,)
        Sum of Im h / |h| over the sum of sizes: -1 where all are negative.
    """

    quarter: NDArray[np.intp]
    negative: FloatArray
    balance: FloatArray


def circles(omega: FloatArray, h: ComplexArray, smooth: FloatArray) -> Circles:
    """Tell the direction of all FRFs, shape (n_freq, rows, columns), as the mean arrival time of their energy."""
    use = smooth > max(_CIRCLES_SEEN, 6 / np.sqrt(h.shape[0]))
    if not use.any():
        return Circles(0.0, 0.0, 0)
    # Flattened, so that a rigid-body line at the lowest frequencies does not outweigh the resonances.
    own = h[:, use]
    own = own * omega[:, None] ** -mean_exponent(omega, own)
    size = (own.real**2 + own.imag**2).sum(axis=0)
    turned = (own.real[:-1] * own.imag[1:] - own.imag[:-1] * own.real[1:]).sum(axis=0) / size
    return Circles(float(np.median(turned)), float((turned > 0).mean()), int(use.sum()))


def mean_exponent(omega: FloatArray, h: ComplexArray) -> float:
    """Median over FRFs, shape (n_freq, m), of the exponent of w in |h|, by least squares."""
    x = np.log(omega)
    x = x - x.mean()
    y = np.log(np.maximum(modulus(h), np.finfo(float).tiny))
    spread = (x**2).sum()
    return float(np.median(x @ y) / spread) if spread > 0 else 0.0


def sectors(driving: ComplexArray) -> Sectors:
    """Tell the half plane of driving-point FRFs, shape (n_freq, n)."""
    u, real, imaginary = _balances(driving)
    quarter = np.where(
        _on_real_axis(u),
        np.where(imaginary < -_ONE_SIDED, 0, np.where(imaginary > _ONE_SIDED, 2, -1)),
        np.where(real > _ONE_SIDED, 1, np.where(real < -_ONE_SIDED, 3, -1)),
    )
    # Much damped: not near either axis, and on one side of the real one.
    damped = (abs((u**2).real.mean(axis=0)) < 0.2) & (abs(imaginary) > 0.9)
    quarter = np.where(damped, np.where(imaginary < 0, 0, 2), quarter)
    return Sectors(quarter.astype(np.intp), (driving.imag < 0).mean(axis=0), imaginary)


def one_sidedness(driving: ComplexArray) -> FloatArray:
    """Tell how far each driving-point FRF, shape (n_freq, n), lies in one half plane: 1 on all lines, 0 on half."""
    u, real, imaginary = _balances(driving)
    share: FloatArray = np.where(_on_real_axis(u), abs(imaginary), abs(real))
    return share


def _balances(driving: ComplexArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return h / |h|, and sums of its real and imaginary parts over the sums of their sizes."""
    size = modulus(driving)
    u: ComplexArray = np.where(size > 0, driving / np.where(size > 0, size, 1), 0)
    imaginary = u.imag.sum(axis=0) / np.maximum(abs(u.imag).sum(axis=0), np.finfo(float).tiny)
    real = u.real.sum(axis=0) / np.maximum(abs(u.real).sum(axis=0), np.finfo(float).tiny)
    return u, real, imaginary


def _on_real_axis(u: ComplexArray) -> NDArray[np.bool_]:
    """Between resonances a receptance is nearly real and a mobility nearly imaginary."""
    on: NDArray[np.bool_] = (u**2).real.mean(axis=0) > 0
    return on
