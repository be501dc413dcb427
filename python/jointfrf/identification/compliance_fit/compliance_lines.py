"""The diagonal of C on every line, where nothing is known of its cross terms: with smooth FRFs no iteration is needed.

On a line the FRFs of a reciprocal structure hold n (2 n + 1) numbers; H, M and the cross terms of C take n (n + 1) and
n (n - 1)/2 of them. What is left are n equations for the diagonal of C, and n (n - 1)/2 that say that C is symmetric.
Both follow from C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj, linearised at the smooth FRFs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from jointfrf.frf.bands import in_pieces
from jointfrf.identification.compliance_fit.manifold import FrfEntries, LineData
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


def compliance_lines(data: LineData) -> tuple[ComplianceLines, ComplianceLines]:
    """Return the diagonal of C and its covariance, linearised at the smooth FRFs.

    Parameters
    ----------
    data : LineData

    Returns
    -------
    symmetric, plain : ComplianceLines
        If C is that of a joint: symmetric where the structure is reciprocal, else the same from gamma_jk and from
        gamma_kj; and if each cross term is unknown for itself. NaN on a line where gamma_jk of the smooth FRFs is
        singular.

    Notes
    -----
    Noise of C = C(S) + L (gamma - S) R with L = (gamma_kk gamma_jk^-1, -1), R = (1, -gamma_jk^-1 gamma_jj) of the
    smooth FRFs S; by the best linear estimate where conditions are correlated with the diagonal.
    """

    def of_lines(own: slice) -> tuple[NDArray[Any], ...]:
        symmetric, plain = _piece(data.on_slice(own))
        return *symmetric, *plain

    with np.errstate(all="ignore"):
        both = in_pieces(len(data.measured), of_lines, _PIECE)
    each = len(ComplianceLines._fields)
    return ComplianceLines(*both[:each]), ComplianceLines(*both[each:])


def _piece(data: LineData) -> tuple[ComplianceLines, ComplianceLines]:
    """Return both for some lines."""
    n, reciprocal = data.entries.n, data.entries.reciprocal
    value, slope = _linear(data)
    # The second C is the transpose of the first where the structure is reciprocal.
    a, b = np.triu_indices(n, 1) if reciprocal else np.nonzero(~np.eye(n, dtype=bool))
    d = np.arange(n)
    diagonal, first = d * (n + 1), a * n + b
    second = b * n + a if reciprocal else n * n + first
    if reciprocal:
        rows = [(diagonal, None), (first, second)]
    else:
        rows = [(diagonal, None), (diagonal, n * n + diagonal), (first, second)]
    values = [value[:, i] - (0 if j is None else value[:, j]) for i, j in rows]
    slopes = [slope[:, i] - (0 if j is None else slope[:, j]) for i, j in rows]
    noise = _coloured(np.concatenate(slopes, axis=1), data)
    apart, always = np.concatenate(values[1:], axis=1), 0 if reciprocal else n
    return (
        _conditioned(values[0], noise[:, :n], apart, noise[:, n:]),
        _conditioned(values[0], noise[:, :n], apart[:, :always], noise[:, n : n + always]),
    )


def _conditioned(
    value: ComplexArray, noise: ComplexArray, apart: ComplexArray, noise_apart: ComplexArray
) -> ComplianceLines:
    """Return the best linear estimate of values, given others that are zero but for their noise."""
    covariance = noise @ noise.conj().swapaxes(1, 2)
    size = np.linalg.norm(noise_apart, axis=2)
    if apart.shape[1] == 0:
        return ComplianceLines(value, covariance, np.zeros(len(value)), apart, size**2)
    scaled, noise_apart = apart / size, noise_apart / size[:, :, None]
    adjoint = noise_apart.conj().swapaxes(1, 2)
    across = noise @ adjoint
    inner = noise_apart @ adjoint + _OWN_NOISE * np.eye(apart.shape[1])
    right = np.concatenate([scaled[:, :, None], across.conj().swapaxes(1, 2)], axis=2)
    solved = solve(inner, right, on_singular="nan")
    correction = across @ solved
    squares = (scaled.conj() * solved[:, :, 0]).real.sum(axis=1)
    return ComplianceLines(value - correction[:, :, 0], covariance - correction[:, :, 1:], squares, apart, size**2)


def _linear(data: LineData) -> tuple[ComplexArray, ComplexArray]:
    """Return C of the measured FRFs to first order, and its derivatives by their entries: all its entries.

    Shapes (n_freq, n^2) and (n_freq, n^2, q); without reciprocity those of C from gamma_kj follow.
    """
    n = data.entries.n
    gamma = data.entries.matrix(data.smooth)
    change = data.entries.matrix(data.measured) - gamma
    value, slope = _compliance(gamma, change, data.entries)
    if data.entries.reciprocal:
        return value, slope
    # With sides exchanged gamma_jk and gamma_kj are, and C is the same.
    turned = np.r_[n : 2 * n, 0:n]
    entries = data.entries._replace(rows=turned[data.entries.rows], columns=turned[data.entries.columns])
    other = _compliance(gamma[:, turned[:, None], turned], change[:, turned[:, None], turned], entries)
    return np.concatenate([value, other[0]], axis=1), np.concatenate([slope, other[1]], axis=1)


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
    for line, triangle in enumerate(data.correlation):
        slope[line] = solve_triangular(triangle, slope[line].T, trans="T", lower=True, check_finite=False).T
    return slope
