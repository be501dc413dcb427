"""The fit where cross terms of C are unknown: of the joint to the diagonal of C on every line."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.compliance_lines import ComplianceLines, compliance_lines
from jointfrf.identification.compliance_fit.group_fit import GroupFit, GroupProblem, Misfitting
from jointfrf.identification.compliance_fit.joint_terms import JointCoordinates, terms_of
from jointfrf.identification.compliance_fit.line_forms import (
    FormMinimum,
    LineForms,
    minimise_forms,
)
from jointfrf.identification.compliance_fit.starts import hidden_share
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert

__all__ = ["fit_unknown_cross"]

#: Lines count less from this relative noise of gamma_jk on.
_HIDDEN = 0.3
#: A residual larger than this is not noise: C varies between lines, or is not symmetric.
_MISFIT = 1.15
#: A mean square is told from 1 at this many standard deviations.
_SIGMA = 4.0
#: Squares of the mean over lines, in units of its noise, above which it is not zero.
_CERTAIN = 16.0
#: Steps for the scatter between lines at most; they end when the coordinates move by less than this many standard
#: errors.
_STEPS, _SETTLED = 30, 0.02
#: Halvings of the range of a variance.
_HALVINGS = 50


class _Lines(NamedTuple):
    """What lines say of the diagonal of C.

    Attributes
    ----------
    of : ComplianceLines
    known : ndarray of bool, shape (n_freq, n)
        DOFs inside their bands.
    weight : ndarray, shape (n_freq,)
        Near 1; near 0 where noise hides gamma_jk.
    """

    of: ComplianceLines
    known: NDArray[np.bool_]
    weight: FloatArray

    def forms(self, variance: FloatArray) -> LineForms:
        """Return the quadratic forms where C varies between lines with this variance, shape (n,), beside its noise."""
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
    """The minimum, with the forms and the standard deviation between lines, m/N, that belong to it."""

    minimum: FormMinimum
    forms: LineForms
    scatter: FloatArray | None
    steps: int
    converged: bool


def fit_unknown_cross(problem: GroupProblem, starts: Iterable[FloatArray]) -> GroupFit:
    """Fit the diagonal of C by weighted least squares; lines that vary by more than their noise count more alike.

    Parameters
    ----------
    problem : GroupProblem
        Its joint has no cross terms, and all cross terms of C are unknown.
    starts : iterable of ndarray, shape (p,)
        Coordinates of the joint.

    Notes
    -----
    The symmetry of C is used unless the FRFs contradict it. Where the residual exceeds the noise, C is taken to vary
    from line to line beside its noise, by as much as the median of the residuals shows: otherwise the lines of least
    noise, often those of an antiresonance, would decide alone what the constant is. It is a mean of C_dd: where no
    joint fits, it need not regenerate the FRFs.
    """
    joint = problem.joint
    lines, is_symmetric = _lines(problem)
    by_noise = lines.forms(np.zeros(terms_of(joint).n))
    best = _best_of([minimise_forms(by_noise, joint, start) for start in [*starts, _middle(lines, joint)]])
    equations = float((lines.weight[:, None] * lines.known).sum())
    possible = float(lines.known.sum())
    found = _Weighted(best, by_noise, None, 1, True)
    degrees = max(equations - best.x.size / 2, 1.0)
    if best.cost / degrees > max(_MISFIT**2, 1 + _SIGMA / np.sqrt(degrees)):
        found = _with_scatter(lines, joint, best.x)
    told = Misfitting(best.cost, is_symmetric, found.scatter, int(np.count_nonzero(lines.weight < 0.5)))
    return GroupFit(
        found.minimum, found.forms, lines.weight > 0, equations, possible, found.steps, found.converged, told
    )


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
    """Whether the conditions are zero but for noise, on lines and in their means over all lines."""
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
    """Return weights of lines that fall off where noise hides gamma_jk; half the lines count where it does on most."""
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
    """Return the lines with numbers in those that are not finite: they weigh nothing."""
    value, covariance, squares, apart = (np.where(np.isfinite(x), x, 0) for x in found[:4])
    return ComplianceLines(value, covariance, squares, apart, np.where(np.isfinite(found.variance), found.variance, 1))


def _middle(lines: _Lines, joint: JointCoordinates) -> FloatArray:
    """Return the stiffness of the median of C, no damping."""
    n = terms_of(joint).n
    start = np.zeros(joint.lower.size)
    for d in range(n):
        seen = lines.known[:, d] & (lines.weight > 0.5)
        start[d] = np.median(lines.of.value[seen if seen.any() else slice(None), d].real)
    return start


def _best_of(minima: list[FormMinimum]) -> FormMinimum:
    return min(minima, key=lambda one: one.cost)


def _with_scatter(lines: _Lines, joint: JointCoordinates, start: FloatArray) -> _Weighted:
    """Fit with the scatter between lines in their weights, and find it anew, until nothing moves."""
    x = start
    variance = _variance_between_lines(lines, joint, x)
    for step in range(1, _STEPS + 1):
        forms = lines.forms(variance)
        best = _best_of([minimise_forms(forms, joint, one) for one in (x, _middle(lines, joint))])
        change, x = best.x - x, best.x
        converged = bool(np.sqrt(abs(2 * (change @ best.information @ change))) < _SETTLED * np.sqrt(x.size))
        if converged and step > 1:
            break
        # The mean of both: by itself a scatter that is too large is followed by one that is too small.
        variance = (variance + _variance_between_lines(lines, joint, x)) / 2
    return _Weighted(best, forms, np.sqrt(variance), step, converged)


def _variance_between_lines(lines: _Lines, joint: JointCoordinates, x: FloatArray) -> FloatArray:
    """Return the variance of the diagonal of C between lines, beside its noise, shape (n,).

    With it the squares of the residual are those of noise in the median over lines, each by its weight: it takes no
    account of lines that say little, nor of the size of the largest residuals.
    """
    squares = abs(_residual(lines, joint, x)) ** 2
    noise = np.einsum("laa->la", lines.of.covariance).real
    return np.array(
        [
            _beside_noise(squares[own, d], noise[own, d], lines.weight[own])
            for d, own in enumerate((lines.known & (lines.weight > 0)[:, None]).T)
        ]
    )


def _beside_noise(squares: FloatArray, noise: FloatArray, weight: FloatArray) -> float:
    """Return the variance beside that of the noise that explains the weighted median of squares."""
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
    """Return the value below which half of the weight lies."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, share[-1] / 2)])


def _residual(lines: _Lines, joint: JointCoordinates, x: FloatArray) -> ComplexArray:
    residual: ComplexArray = np.where(lines.known, lines.of.value - joint.compliance(x), 0)
    return residual
