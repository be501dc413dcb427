"""Rational functions with common poles through several FRFs: one weighted least-squares fit, and better poles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import call_for_number

__all__ = ["Entries", "RationalFit", "rational_fit", "relocated"]


@dataclass(frozen=True)
class Entries:
    """FRFs that have their poles in common, one a row, and what one needs to weight them.

    Attributes
    ----------
    s : ndarray, shape (n_freq,)
        i f / max f.
    h : ndarray, shape (n_entries, n_freq)
        In C order.
    weight : ndarray, shape (n_entries, n_freq)
        1 / sqrt(E|e|^2) up to one factor, in C order.
    """

    s: ComplexArray
    h: ComplexArray
    weight: FloatArray

    @property
    def n_data(self) -> int:
        """Number of complex data."""
        return self.h.size

    def n_parameters(self, n_poles: int) -> int:
        """Return the number of complex parameters of a fit with this number of poles."""
        return len(self.h) * (n_poles + 1) + n_poles


@dataclass(frozen=True)
class RationalFit:
    """Rational functions with the same poles.

    Attributes
    ----------
    poles : ndarray, shape (n_poles,)
    smooth : ndarray, shape (n_entries, n_freq)
    squares : float
        Weighted sum of squares of h - smooth.
    loss : ndarray, shape (n_poles,)
        By how much `squares` would grow without the pole, the others staying where they are.
    """

    poles: ComplexArray
    smooth: ComplexArray
    squares: float
    loss: FloatArray


def relocated(entries: Entries, poles: ComplexArray, iterations: int, still: float) -> tuple[float, ComplexArray]:
    """Relocate poles until the sum of squares of the fit stays.

    Parameters
    ----------
    entries : Entries
    poles : ndarray, shape (n_poles,)
    iterations : int
        Most relocations.
    still : float
        Relative change of the sum of squares at which they end.

    Returns
    -------
    squares : float
        The least sum of squares.
    better : ndarray, shape (n_poles,)
        Its poles, all stable.

    Notes
    -----
    Relaxed vector fitting: sigma and numerators q_e of the form c_0 + sum c_k/(s - p_k) minimise
    sum_e |w_e (q_e - sigma h_e)|^2 with the mean of sigma held; the zeros of sigma are the new poles. The numerators
    are eliminated entry by entry. The poles are those of positive frequencies; their mirror images, far from the
    lines, are left to poles of their own: so structural damping, which has no mirror image, is met exactly, too.
    As noise adds its Gram matrix to the quadratic form of sigma, holding the weighted mean of sigma leaves the poles
    where they are once they are right.

    References
    ----------
    B. Gustavsen, A. Semlyen, Rational approximation of frequency domain responses by vector fitting. IEEE Trans.
    Power Delivery 14 (1999); B. Gustavsen, Improving the pole relocating properties of vector fitting. 21 (2006).
    """
    better = np.array(poles, np.complex128)
    sizes = (len(poles), *entries.h.shape)
    fitted = (entries.s, entries.h, entries.weight)
    squares, _ = call_for_number("relocate_poles", (*sizes, iterations, still, *fitted, better))
    return squares, better


def rational_fit(entries: Entries, poles: ComplexArray) -> RationalFit:
    """Least-squares fit with these poles.

    Parameters
    ----------
    entries : Entries
    poles : ndarray, shape (n_poles,)

    Returns
    -------
    RationalFit

    Notes
    -----
    Normal equations in a basis that is orthonormal under the mean weight, corrected once by their residual.
    """
    smooth, loss = np.empty_like(entries.h), np.empty(len(poles))
    sizes = (len(poles), *entries.h.shape)
    fitted = (entries.s, entries.h, entries.weight)
    squares, _ = call_for_number("rational_fit", (*sizes, *fitted, poles, smooth, loss))
    return RationalFit(poles, smooth, squares, loss)
