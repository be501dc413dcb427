"""Rational functions with common poles through several FRFs: one weighted least-squares fit, and better poles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Entries", "RationalFit", "rational_fit", "relocated"]

#: Line-wise products are formed for so many lines at a time: they stay in the cache.
_LINES = 4096
#: Poles closer to the frequency axis than this share of the distance of lines are moved away from it.
_NEAREST = 1e-3
#: Added to the diagonal of normal equations, relative to their trace.
_ROUNDING = 1e-15


@dataclass(frozen=True)
class Entries:
    """FRFs that have their poles in common, one a row, and what one needs to weight them.

    Attributes
    ----------
    s : ndarray, shape (n_freq,)
        i f / max f.
    h : ndarray, shape (n_entries, n_freq)
    weight : ndarray, shape (n_entries, n_freq)
        1 / sqrt(E|e|^2) up to one factor.
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


@dataclass(frozen=True)
class _Basis:
    """1 and 1/(s - p) of each pole, made orthonormal under the mean weight of the entries.

    Attributes
    ----------
    functions : ndarray, shape (n_freq, n_poles + 1)
        psi of [1, 1/(s - p)] = psi `triangle`.
    triangle : ndarray, shape (n_poles + 1, n_poles + 1)
    """

    functions: ComplexArray
    triangle: ComplexArray


def _basis(entries: Entries, poles: ComplexArray) -> _Basis:
    fractions = np.empty((len(entries.s), len(poles) + 1), np.complex128)
    fractions[:, 0] = 1
    np.divide(1, entries.s[:, None] - poles, out=fractions[:, 1:])
    common = np.sqrt((entries.weight**2).mean(axis=0))[:, None]
    orthonormal, triangle = np.linalg.qr(common * fractions)
    return _Basis(orthonormal / common, triangle)


def _gram(functions: ComplexArray, weights: ComplexArray) -> ComplexArray:
    """Return sum over the lines of w_e conj(psi_i) psi_j, shape (n_weights, n, n)."""
    n = functions.shape[1]
    i, j = np.triu_indices(n)
    upper = np.zeros((len(weights), 2, i.size), np.complex128)
    for first in range(0, len(functions), _LINES):
        some = functions[first : first + _LINES]
        product = some[:, i].conj() * some[:, j]
        w = weights[:, first : first + _LINES]
        upper[:, 0] += w @ product
        upper[:, 1] += w @ product.conj()
    gram = np.empty((len(weights), n, n), np.complex128)
    gram[:, i, j] = upper[:, 0]
    gram[:, j, i] = upper[:, 1]
    return gram


def relocated(entries: Entries, poles: ComplexArray) -> tuple[float, ComplexArray]:
    """Sum of squares of the fit with these poles, and better poles.

    Parameters
    ----------
    entries : Entries
    poles : ndarray, shape (n_poles,)

    Returns
    -------
    squares : float
    better : ndarray, shape (n_poles,)

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
    basis = _basis(entries, poles)
    form = _form_of_sigma(entries, basis.functions)
    n = len(form)
    one = basis.triangle[:, 0]  # psi one = 1
    squares = max(float((one.conj() @ form @ one).real), 0.0)
    form[np.diag_indices(n)] += _ROUNDING * np.trace(form).real / n
    sigma = np.linalg.solve(basis.triangle, np.linalg.solve(form, basis.functions.conj().sum(axis=0)))
    lead = sigma[0] if sigma[0] != 0 else np.finfo(float).tiny
    zeros: ComplexArray = np.linalg.eigvals(np.diag(poles) - sigma[1:] / lead).astype(np.complex128)
    return squares, _stable(zeros, entries.s)


def _form_of_sigma(entries: Entries, functions: ComplexArray) -> ComplexArray:
    """Sum of squares as a quadratic form of the coefficients of sigma, the numerators eliminated."""
    n = functions.shape[1]
    squared = entries.weight**2
    weights = np.concatenate([squared, squared * entries.h, squared * abs(entries.h) ** 2])
    own, mixed, right = _gram(functions, weights).reshape(3, -1, n, n)
    own[:, np.arange(n), np.arange(n)] *= 1 + _ROUNDING
    form: ComplexArray = (right - mixed.conj().swapaxes(1, 2) @ np.linalg.solve(own, mixed)).sum(axis=0)
    return (form + form.conj().T) / 2


def _stable(poles: ComplexArray, s: ComplexArray) -> ComplexArray:
    """Poles turned to the stable side, none nearer to the axis than a small part of the distance of lines."""
    nearest = _NEAREST * (s.imag.max() - s.imag.min()) / len(s)
    stable: ComplexArray = -np.maximum(abs(poles.real), nearest) + 1j * poles.imag
    return stable


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
    basis = _basis(entries, poles)
    psi, squared = basis.functions, entries.weight**2
    gram = _gram(psi, squared.astype(np.complex128))
    smooth = np.zeros_like(entries.h)
    coefficients = np.zeros((len(entries.h), psi.shape[1], 1), np.complex128)
    for _ in range(2):
        pull = (squared * (entries.h - smooth)) @ psi.conj()
        coefficients += np.linalg.solve(gram, pull[:, :, None])
        smooth = coefficients[:, :, 0] @ psi.T
    squares = float((squared * abs(entries.h - smooth) ** 2).sum())
    back = np.linalg.solve(basis.triangle, np.eye(psi.shape[1]))
    residues = coefficients[:, :, 0] @ back.T
    spread = np.einsum("kj,eji,ki->ek", back, np.linalg.inv(gram), back.conj(), optimize=True).real
    loss = (abs(residues) ** 2 / spread).sum(axis=0)[1:]
    return RationalFit(poles, smooth, squares, loss)
