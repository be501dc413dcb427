"""The fit with unknown cross terms of C: of the joint to the diagonal of C on every line.

On a line a reciprocal structure has n (2 n + 1) FRFs; H, M and the cross terms of C take n (n + 1) and n (n - 1)/2 of
them. Then n equations remain for the diagonal of C, and n (n - 1)/2 conditions for the symmetry of C.
Both follow from C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj, linearised at the smooth FRFs.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from jointfrf.frf.bands import in_pieces
from jointfrf.identification.manifold.group_fit import GroupFit, GroupProblem, UnknownCrossTerms
from jointfrf.identification.manifold.line_forms import FormMinimum, JointCoordinates, LineForms
from jointfrf.identification.manifold.on_manifold import FrfEntries, LineData
from jointfrf.identification.manifold.starts import hidden_share
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert, solve

__all__ = ["ComplianceLines", "compliance_lines", "fit_unknown_cross"]

#: Number of lines in one chunk.
_PIECE = 256
#: Relative standard deviation of an entry that is not used.
_UNUSED = 1e4
#: Least part of the variance of a condition that remains if all further conditions are known.
_OWN_NOISE = 1e-10


class ComplianceLines(NamedTuple):
    """The diagonal of C on every line.

    Attributes
    ----------
    value : ndarray, shape (n_freq, n)
        Diagonal of C, m/N.
    covariance : ndarray, shape (n_freq, n, n)
        Covariance E[e e^H] of its noise, (m/N)^2.
    squares : ndarray, shape (n_freq,)
        Squares of the conditions that were used, in units of their noise.
    apart : ndarray, shape (n_freq, m)
        Conditions: differences of elements of C that are zero if it is symmetric, m/N.
    variance : ndarray, shape (n_freq, m)
        Noise variance of the conditions, (m/N)^2.
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
        FRFs with their weights.

    Returns
    -------
    symmetric, plain : ComplianceLines
        Diagonal of C for a joint, and for independent cross terms. For a joint C is symmetric if the structure is
        reciprocal; otherwise it is the same from gamma_jk and from gamma_kj. NaN on a line with a singular gamma_jk of
        the smooth FRFs.

    Notes
    -----
    The noise of C is C(S) + L (gamma - S) R of the smooth FRFs S, with L = (gamma_kk gamma_jk^-1, -1) and
    R = (1, -gamma_jk^-1 gamma_jj). If conditions are correlated with the diagonal, the result is the best linear
    estimate.
    """

    def of_lines(own: slice) -> tuple[NDArray[Any], ...]:
        symmetric, plain = _of_piece(data.on_lines(own))
        return *symmetric, *plain

    with np.errstate(all="ignore"):
        both = in_pieces(len(data.measured), of_lines, _PIECE)
    each = len(ComplianceLines._fields)
    return ComplianceLines(*both[:each]), ComplianceLines(*both[each:])


def _of_piece(data: LineData) -> tuple[ComplianceLines, ComplianceLines]:
    """Return both for some lines."""
    n, reciprocal = data.entries.n, data.entries.reciprocal
    value, slope = _linear(data)
    # The second C is the transpose of the first if the structure is reciprocal.
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
    """Return the best linear estimate of values, given conditions that are zero except for their noise."""
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

    Shapes (n_freq, n^2) and (n_freq, n^2, q); without reciprocity the entries of C from gamma_kj follow.
    """
    n = data.entries.n
    gamma = data.entries.matrix(data.smooth)
    change = data.entries.matrix(data.measured) - gamma
    value, slope = _compliance(gamma, change, data.entries)
    if data.entries.reciprocal:
        return value, slope
    # Exchanging the sides exchanges gamma_jk and gamma_kj, and C is the same.
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
    # Entries over their deviation are L^-1 multiplied by independent noise.
    for line, triangle in enumerate(data.correlation):
        slope[line] = solve_triangular(triangle, slope[line].T, trans="T", lower=True, check_finite=False).T
    return slope


#: Relative noise of gamma_jk above which lines get less weight.
_HIDDEN = 0.3
#: Residual above which C varies between lines, or is not symmetric.
_MISFIT = 1.15
#: Number of standard deviations beyond which a mean square differs from 1.
_SIGMA = 4.0
#: Squares of the mean over lines, in units of its noise, above which it is not zero.
_CERTAIN = 16.0
#: Maximum number of steps for the scatter between lines, and the change of the coordinates, in standard errors, at
#: which they end.
_STEPS, _SETTLED = 30, 0.02
#: Number of halvings of the range of a variance.
_HALVINGS = 50


class _Lines(NamedTuple):
    """The diagonal of C on all lines, with weights.

    Attributes
    ----------
    of : ComplianceLines
        Diagonal of C with its noise.
    known : ndarray of bool, shape (n_freq, n)
        DOFs inside their bands.
    weight : ndarray, shape (n_freq,)
        Weight near 1, or near 0 if noise exceeds gamma_jk.
    """

    of: ComplianceLines
    known: NDArray[np.bool_]
    weight: FloatArray

    def forms(self, variance: FloatArray) -> LineForms:
        """Return the quadratic forms if C varies between lines by this variance, shape (n,), beyond its noise."""
        n = self.known.shape[1]
        diagonal = np.arange(n)
        both = self.known[:, :, None] & self.known[:, None, :]
        covariance: ComplexArray = np.where(both, self.of.covariance, 0)
        covariance[:, diagonal, diagonal] += np.where(self.known, variance, 1)
        size = np.sqrt(np.einsum("laa->la", covariance).real)
        outer = size[:, :, None] * size[:, None, :]
        inverse = invert(covariance / outer, on_singular="nan") / outer
        information = np.where(both, self.weight[:, None, None] * inverse, 0).astype(np.complex128)
        value = self.of.value
        return LineForms(value, information, np.zeros_like(value), np.zeros(len(value)))


class _Weighted(NamedTuple):
    """The minimum, with the corresponding standard deviation between lines, m/N."""

    minimum: FormMinimum
    scatter: FloatArray | None
    steps: int
    converged: bool


def fit_unknown_cross(problem: GroupProblem, starts: Iterable[FloatArray]) -> GroupFit:
    """Fit the diagonal of C by weighted least squares; weights are more equal if lines vary by more than their noise.

    Parameters
    ----------
    problem : GroupProblem
        Problem of a joint without cross terms, and with all cross terms of C unknown.
    starts : iterable of ndarray, shape (p,)
        Initial coordinates of the joint.

    Notes
    -----
    The symmetry of C is used unless the FRFs contradict it. If the residual exceeds the noise, C varies from line to
    line by the excess in the median of the residuals. Otherwise the lines of least noise, often lines of an
    antiresonance, would determine the result alone. The result is a mean of C_dd: if no joint fits, it need not
    regenerate the FRFs.
    """
    joint = problem.joint
    lines, is_symmetric = _lines(problem)
    by_noise = lines.forms(np.zeros(joint.n))
    best = _best_of([joint.minimise(by_noise, start) for start in [*starts, _middle(lines, joint)]])
    equations = float((lines.weight[:, None] * lines.known).sum())
    possible = float(lines.known.sum())
    found = _Weighted(best, None, 1, True)
    degrees = max(equations - best.x.size / 2, 1.0)
    if best.cost / degrees > max(_MISFIT**2, 1 + _SIGMA / np.sqrt(degrees)):
        found = _with_scatter(lines, joint, best.x)
    hidden = int(np.count_nonzero(lines.weight < 0.5))
    return GroupFit.of(
        found.minimum, problem=problem, used=lines.weight > 0, equations=equations, possible=possible,
        iterations=found.steps, converged=found.converged,
        unknown_cross=UnknownCrossTerms(best.cost, is_symmetric, found.scatter, hidden),
    )  # fmt: skip


def _lines(problem: GroupProblem) -> tuple[_Lines, bool]:
    """Return the lines, and whether C is symmetric."""
    data = problem.data
    n = data.entries.n
    known = ~problem.unknown.reshape(-1, n, n)[:, range(n), range(n)]
    found, plain = compliance_lines(data)
    weight = _weight(hidden_share(data), found, 2 * problem.joint.lower.size)
    found = _finite(found)
    if _are_zero(found, weight):
        return _Lines(found, known, weight), True
    return _Lines(_finite(plain), known, weight), False


def _are_zero(found: ComplianceLines, weight: FloatArray) -> bool:
    """Return whether the conditions are zero except for noise, on lines and in their means over all lines."""
    count = float(weight.sum()) * found.apart.shape[1]
    if count == 0:
        return True
    mean_square = float((weight * found.squares).sum()) / count
    by_line = mean_square > max(_MISFIT**2, 1 + _SIGMA / np.sqrt(count))
    return not by_line and bool(_mean_squares(found, weight).max() < _CERTAIN)


def _mean_squares(found: ComplianceLines, weight: FloatArray) -> FloatArray:
    """Return squares of the mean of each condition over all lines, in units of its noise."""
    w = weight[:, None] / np.maximum(found.variance, np.finfo(float).tiny)
    squares: FloatArray = abs((w * found.apart).sum(axis=0)) ** 2 / np.maximum(w.sum(axis=0), np.finfo(float).tiny)
    return squares


def _weight(hidden: FloatArray, found: ComplianceLines, least: int) -> FloatArray:
    """Return weights that are small if noise exceeds gamma_jk; half the lines count if it does on most lines."""
    good = np.isfinite(found.value).all(axis=1) & np.isfinite(found.covariance).all(axis=(1, 2))
    good &= np.isfinite(found.squares) & np.isfinite(hidden) & np.isfinite(found.variance).all(axis=1)
    if not good.any():
        raise np.linalg.LinAlgError("gamma_jk is singular on all lines")
    few = np.count_nonzero(hidden[good] < _HIDDEN) < least
    threshold = float(np.median(hidden[good])) if few else _HIDDEN
    with np.errstate(over="ignore"):
        weight: FloatArray = np.where(good, 1 / (1 + (np.where(good, hidden, 0) / threshold) ** 8), 0)
    return weight


def _finite(found: ComplianceLines) -> ComplianceLines:
    """Return the lines with finite numbers in place of others, which have no weight."""
    value, covariance, squares, apart = (np.where(np.isfinite(x), x, 0) for x in found[:4])
    return ComplianceLines(value, covariance, squares, apart, np.where(np.isfinite(found.variance), found.variance, 1))


def _middle(lines: _Lines, joint: JointCoordinates) -> FloatArray:
    """Return the stiffness of the median of C, without damping."""
    n = joint.n
    start = np.zeros(joint.lower.size)
    for d in range(n):
        seen = lines.known[:, d] & (lines.weight > 0.5)
        start[d] = np.median(lines.of.value[seen if seen.any() else slice(None), d].real)
    return start


def _best_of(minima: list[FormMinimum]) -> FormMinimum:
    return min(minima, key=lambda one: one.cost)


def _with_scatter(lines: _Lines, joint: JointCoordinates, start: FloatArray) -> _Weighted:
    """Fit with the scatter between lines in their weights, and repeat with the new scatter until convergence."""
    x = start
    variance = _variance_between_lines(lines, joint, x)
    for step in range(1, _STEPS + 1):
        forms = lines.forms(variance)
        best = _best_of([joint.minimise(forms, one) for one in (x, _middle(lines, joint))])
        change, x = best.x - x, best.x
        converged = bool(np.sqrt(abs(2 * (change @ best.information @ change))) < _SETTLED * np.sqrt(x.size))
        if converged and step > 1:
            break
        # The mean of both, because the scatter alone would oscillate.
        variance = (variance + _variance_between_lines(lines, joint, x)) / 2
    return _Weighted(best, np.sqrt(variance), step, converged)


def _variance_between_lines(lines: _Lines, joint: JointCoordinates, x: FloatArray) -> FloatArray:
    """Return the variance of the diagonal of C between lines in excess of its noise, shape (n,).

    With it the weighted median over lines of the squared residuals equals the median for noise. The median ignores the
    size of the largest residuals, and lines with little information hardly count.
    """
    squares = abs(_residual(lines, joint, x)) ** 2
    noise = np.einsum("laa->la", lines.of.covariance).real
    return np.array(
        [
            _in_excess(squares[own, d], noise[own, d], lines.weight[own])
            for d, own in enumerate((lines.known & (lines.weight > 0)[:, None]).T)
        ]
    )


def _in_excess(squares: FloatArray, noise: FloatArray, weight: FloatArray) -> float:
    """Return the variance in excess of the noise that explains the weighted median of squares."""
    if squares.size == 0:
        return 0.0
    # Squares of circular noise are exponential: their median is ln 2 of their mean.
    low, high = 0.0, float(squares.max()) / np.log(2)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        variance = noise + middle
        if _weighted_median(squares / variance, weight / variance) > np.log(2):
            low = middle
        else:
            high = middle
    return 0.0 if low == 0 else high


def _weighted_median(values: FloatArray, weight: FloatArray) -> float:
    """Return the value below which half of the weight is."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, share[-1] / 2)])


def _residual(lines: _Lines, joint: JointCoordinates, x: FloatArray) -> ComplexArray:
    residual: ComplexArray = np.where(lines.known, lines.of.value - joint.compliance(x), 0)
    return residual
