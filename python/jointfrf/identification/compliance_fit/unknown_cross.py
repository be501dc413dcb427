"""The fit where cross terms of C are unknown: of the joint to the diagonal of C on every line."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.compliance_lines import ComplianceLines, compliance_lines
from jointfrf.identification.compliance_fit.group_fit import GroupFit, GroupProblem, Misfitting
from jointfrf.identification.compliance_fit.joint_terms import JointCoordinates
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

    def forms(self) -> LineForms:
        """Return the quadratic forms."""
        n = self.known.shape[1]
        diagonal = np.arange(n)
        both = self.known[:, :, None] & self.known[:, None, :]
        covariance: ComplexArray = np.where(both, self.of.covariance, 0)
        covariance[:, diagonal, diagonal] += np.where(self.known, 0, 1)
        size = np.sqrt(np.einsum("laa->la", covariance).real)
        outer = size[:, :, None] * size[:, None, :]
        inverse = invert(covariance / outer, on_singular="nan") / outer
        information = np.where(both, self.weight[:, None, None] * inverse, 0).astype(np.complex128)
        value = self.of.value
        return LineForms(value, information, np.zeros_like(value), np.zeros(len(value)))


def fit_unknown_cross(problem: GroupProblem, starts: Iterable[FloatArray]) -> GroupFit:
    """Fit the diagonal of C by weighted least squares.

    Parameters
    ----------
    problem : GroupProblem
        Its joint has no cross terms, and all cross terms of C are unknown.
    starts : iterable of ndarray, shape (p,)
        Coordinates of the joint.

    Notes
    -----
    The symmetry of C is used unless the FRFs contradict it. Where the residual exceeds the noise, C varies from line to
    line; lines still count by their noise, and the scatter between them is in the intervals. The constant is a mean of
    C_dd: where no joint fits, it need not regenerate the FRFs.
    """
    joint = problem.joint
    lines, is_symmetric = _lines(problem)
    by_noise = lines.forms()
    best = _best_of([minimise_forms(by_noise, joint, start) for start in [*starts, _middle(lines, joint)]])
    equations = float((lines.weight[:, None] * lines.known).sum())
    possible = float(lines.known.sum())
    scatter = None
    degrees = max(equations - best.x.size / 2, 1.0)
    if best.cost / degrees > max(_MISFIT**2, 1 + _SIGMA / np.sqrt(degrees)):
        scatter = _scatter_between_lines(lines, joint, best.x)
    told = Misfitting(best.cost, is_symmetric, scatter, int(np.count_nonzero(lines.weight < 0.5)))
    return GroupFit(best, by_noise, lines.weight > 0, equations, possible, 1, True, told)


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
    n = joint.terms.n
    start = np.zeros(joint.lower.size)
    for d in range(n):
        seen = lines.known[:, d] & (lines.weight > 0.5)
        start[d] = np.median(lines.of.value[seen if seen.any() else slice(None), d].real)
    return start


def _best_of(minima: list[FormMinimum]) -> FormMinimum:
    return min(minima, key=lambda one: one.cost)


def _scatter_between_lines(lines: _Lines, joint: JointCoordinates, x: FloatArray) -> FloatArray:
    """Return the standard deviation of the diagonal of C between lines, beside its noise, by the median over lines."""
    residual = abs(_residual(lines, joint, x)) ** 2
    noise = np.einsum("laa->la", lines.of.covariance).real
    # Squares of circular noise are exponential: their median is ln 2 of their mean.
    variance = [
        np.median(residual[own, d]) / np.log(2) - np.median(noise[own, d])
        for d, own in enumerate((lines.known & (lines.weight > 0.5)[:, None]).T)
    ]
    found: FloatArray = np.sqrt(np.maximum(np.nan_to_num(variance), 0))
    return found


def _residual(lines: _Lines, joint: JointCoordinates, x: FloatArray) -> ComplexArray:
    residual: ComplexArray = np.where(lines.known, lines.of.value - joint.compliance(x), 0)
    return residual
