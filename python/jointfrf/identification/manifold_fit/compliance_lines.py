"""The diagonal of C on every line, where nothing is known of its cross terms: with smooth FRFs no iteration is needed.

On a line the FRFs of a reciprocal structure hold n (2 n + 1) numbers; H, M and the cross terms of C take n (n + 1) and
n (n - 1)/2 of them. What is left are n equations for the diagonal of C, and n (n - 1)/2 that say that C is symmetric.
Both follow from C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj, linearised at the smooth FRFs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.manifold_fit.manifold import FrfEntries, LineData
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert, solve

__all__ = ["ComplianceLines", "compliance_lines"]

#: Lines that are done at once.
_PIECE = 256
#: Relative standard deviation that stands for an entry that is not used.
_UNUSED = 1e4
#: Part of its variance that a condition keeps when all others are known.
_OWN_NOISE = 1e-10


class ComplianceLines(NamedTuple):
    """The diagonal of C on every line.

    Attributes
    ----------
    value : ndarray, shape (n_freq, n)
        m/N.
    covariance : ndarray, shape (n_freq, n, n)
        E[e e^H] of its noise.
    squares : ndarray, shape (n_freq,)
        Squares of the conditions that were used, in units of their noise.
    apart : ndarray, shape (n_freq, m)
        The conditions: differences of elements of C that are the same where it is symmetric, m/N.
    variance : ndarray, shape (n_freq, m)
        Of their noise.
    """

    value: ComplexArray
    covariance: ComplexArray
    squares: FloatArray
    apart: ComplexArray
    variance: FloatArray


def compliance_lines(data: LineData, *, symmetric: bool) -> ComplianceLines:
    """Return the diagonal of C and its covariance, linearised at the smooth FRFs.

    Parameters
    ----------
    data : LineData
    symmetric : bool
        Whether C is that of a joint: symmetric where the structure is reciprocal, else the same from gamma_jk and from
        gamma_kj. Otherwise each cross term is unknown for itself.

    Returns
    -------
    ComplianceLines
        NaN on a line where gamma_jk of the smooth FRFs is singular.

    Notes
    -----
    Noise of C = C(S) + L (gamma - S) R with L = (gamma_kk gamma_jk^-1, -1), R = (1, -gamma_jk^-1 gamma_jj) of the
    smooth FRFs S; by the best linear estimate where conditions are correlated with the diagonal.
    """
    pieces = []
    with np.errstate(all="ignore"):
        for first in range(0, len(data.measured), _PIECE):
            lines = np.arange(first, min(first + _PIECE, len(data.measured)))
            pieces.append(_piece(data.on_lines(lines), symmetric=symmetric))
    return ComplianceLines(*(np.concatenate(parts) for parts in zip(*pieces, strict=True)))


def _conditions(entries: FrfEntries, *, symmetric: bool) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs of elements of C, first from gamma_jk and then from gamma_kj, that are the same."""
    n = entries.n
    a, b = (x.ravel() for x in np.indices((n, n)))
    if entries.reciprocal:
        # The second C is the transpose of the first.
        kept = (a < b) & symmetric
        return (a * n + b)[kept], (b * n + a)[kept]
    kept = (a == b) | symmetric
    return (a * n + b)[kept], (n * n + a * n + b)[kept]


def _piece(data: LineData, *, symmetric: bool) -> ComplianceLines:
    n = data.entries.n
    value, slope = _linear(data)
    first, second = _conditions(data.entries, symmetric=symmetric)
    diagonal = np.arange(n) * (n + 1)
    own, noise = value[:, diagonal], slope[:, diagonal]
    covariance = noise @ noise.conj().swapaxes(1, 2)
    if first.size == 0:
        return ComplianceLines(own, covariance, np.zeros(len(own)), value[:, first], np.zeros((len(own), 0)))
    apart, noise_apart = value[:, first] - value[:, second], slope[:, first] - slope[:, second]
    size = np.linalg.norm(noise_apart, axis=2)
    noise_apart = noise_apart / size[:, :, None]
    adjoint = noise_apart.conj().swapaxes(1, 2)
    across = noise @ adjoint
    inner = noise_apart @ adjoint + _OWN_NOISE * np.eye(first.size)
    right = np.concatenate([(apart / size)[:, :, None], across.conj().swapaxes(1, 2)], axis=2)
    solved = solve(inner, right, on_singular="nan")
    correction = across @ solved
    squares = ((apart / size).conj() * solved[:, :, 0]).real.sum(axis=1)
    return ComplianceLines(
        own - correction[:, :, 0], covariance - correction[:, :, 1:], squares, apart, size**2
    )


def _linear(data: LineData) -> tuple[ComplexArray, ComplexArray]:
    """Return C of the measured FRFs and its derivatives by independent noise of unit variance: all its entries.

    Shapes (n_freq, n^2) and (n_freq, n^2, q); without reciprocity those of C from gamma_kj follow.
    """
    n = data.entries.n
    gamma = data.entries.matrix(data.smooth)
    change = data.entries.matrix(data.measured) - gamma
    value, slope = _compliance(gamma, change, data.entries)
    if not data.entries.reciprocal:
        # With sides exchanged gamma_jk and gamma_kj are, and C is the same.
        turned = np.r_[n : 2 * n, 0:n]
        rows, columns = turned[data.entries.rows], turned[data.entries.columns]
        entries = data.entries._replace(rows=rows, columns=columns)
        both = (x[:, turned[:, None], turned] for x in (gamma, change))
        other_value, other_slope = _compliance(*both, entries)
        value, slope = np.concatenate([value, other_value], 1), np.concatenate([slope, other_slope], 1)
    return value, _coloured(slope, data)


def _compliance(gamma: ComplexArray, change: ComplexArray, entries: FrfEntries) -> tuple[ComplexArray, ComplexArray]:
    """Return C to first order in a change of the FRFs, and its derivatives by their entries."""
    n, n_freq = entries.n, len(gamma)
    jj, jk, kj, kk = gamma[:, :n, :n], gamma[:, :n, n:], gamma[:, n:, :n], gamma[:, n:, n:]
    inverse = invert(jk, on_singular="nan")
    one = np.broadcast_to(np.eye(n), jk.shape)
    left = np.concatenate([kk @ inverse, -one], axis=2)
    right = np.concatenate([one, -inverse @ jj], axis=1)
    value = left[:, :, :n] @ jj - kj + left @ change @ right
    p, q = entries.rows, entries.columns
    by_entry = left[:, :, None, p] * right[:, q].swapaxes(1, 2)[:, None]
    if entries.reciprocal:
        by_entry += np.where(p != q, left[:, :, None, q] * right[:, p].swapaxes(1, 2)[:, None], 0)
    return value.reshape(n_freq, n * n), by_entry.reshape(n_freq, n * n, -1)


def _coloured(slope: ComplexArray, data: LineData) -> ComplexArray:
    """Return derivatives by independent noise of unit variance from those by entries."""
    std = np.where(data.used, 1 / np.where(data.used, data.inverse_std, 1), _UNUSED * abs(data.smooth))
    slope = slope * std[:, None, :]
    if data.correlation is None:
        return slope
    # Entries over their deviation are L^-1 times independent noise.
    adjoint = data.correlation.swapaxes(1, 2)
    rows = slope.shape[1]
    both = np.concatenate([slope.real, slope.imag], axis=1).swapaxes(1, 2)
    solved = np.linalg.solve(adjoint, both).swapaxes(1, 2)
    coloured: ComplexArray = solved[:, :rows] + 1j * solved[:, rows:]
    return coloured
