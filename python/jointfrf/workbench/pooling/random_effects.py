"""Random-effects model: mean and variances between groups from few values with known errors.

y = X beta + sum over f of b_f[group] + e,   b_f ~ N(0, s_f^2),   e ~ N(0, s_0^2 + V),   V known.

The variances come from pivots. Let X_f be the columns of X and of all factors coarser than f. When the groups of f join
X_f, the residual sum of squares in the metric of the covariance drops by a chi-squared number, for any beta. Solved for
s_f^2, one factor after the other, finest first, quantiles of chi-squared become a confidence distribution of the
variances. Given the variances, means are normal. With equal errors this is the t distribution, with different errors
the distribution of Cochran's Q.

Sources: H. Iyer, C. Wang, T. Mathew, Models and confidence intervals for true values in interlaboratory trials, JASA 99
(2004) 1060; for the variance alone W. Viechtbauer, Statistics in Medicine 26 (2007) 37; for its upper limit A. L. Read,
Presentation of search results: the CLs technique, J. Phys. G 28 (2002) 2693.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize
from scipy.stats import chi2, norm

from jointfrf.kernel.arguments import FloatArray

__all__ = ["Mixture", "RandomEffects"]

#: Points of the confidence distribution of the variances, for quantiles (2.5 % within 0.1 %) and for probabilities.
_POINTS, _FEW_POINTS = 512, 128
#: Bisections of the interval of a variance, to less than 1e-12 of it.
_HALVINGS = 48
#: Eigenvalues below this share of the largest are zero: rounding of n = 100 values.
_RANK = 1e-9
#: Difference of -2 ln of restricted likelihoods below which they are equal: far above rounding, far below significance.
_EQUAL = 1e-6
#: Least share of the variance of errors that is independent, so that the covariance has an inverse.
_LEAST_OWN = 1e-6
#: Search range of quantiles of a mixture, in standard deviations: it contains the smallest probability used, 1e-9.
_REACH = 8.0


@dataclass(frozen=True)
class Mixture:
    """Equal parts of normal distributions.

    Attributes
    ----------
    mean, variance : ndarray, shape (n,)
        Means and variances of the normal distributions.
    """

    mean: FloatArray
    variance: FloatArray

    def below(self, value: float) -> float:
        """Return the probability of smaller values."""
        return float(norm.cdf((value - self.mean) / np.sqrt(self.variance)).mean())

    def quantile(self, probability: float) -> float:
        """Return the quantile of a probability."""
        reach = _REACH * np.sqrt(self.variance)
        low, high = float((self.mean - reach).min()), float((self.mean + reach).max())
        return float(brentq(lambda value: self.below(value) - probability, low, high, xtol=1e-12 * (high - low)))

    def interval(self, probability: float) -> tuple[float, float]:
        """Return the central interval of this probability."""
        return self.quantile((1 - probability) / 2), self.quantile((1 + probability) / 2)


@dataclass(frozen=True, eq=False)
class RandomEffects:
    """Values with known errors, and the factors over which their true values scatter.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Estimates.
    covariance : ndarray, shape (n, n)
        Covariance of the errors, positive definite.
    design : ndarray, shape (n, p)
        Columns of full rank, the first of ones.
    factors : sequence of ndarray of int, shape (n,)
        Number of the group of each value, finest factor first, without the scatter of the values themselves.
    points : int
        Number of points of the confidence distribution.
    """

    values: FloatArray
    covariance: FloatArray
    design: FloatArray
    factors: Sequence[NDArray[np.intp]] = ()
    points: int = _POINTS

    @cached_property
    def _effects(self) -> list[FloatArray]:
        """Columns of each component: the values themselves, then groups of each factor."""
        own = [(codes[:, None] == np.unique(codes)).astype(float) for codes in self.factors]
        return [np.eye(self.values.size), *own]

    @cached_property
    def degrees_of_freedom(self) -> tuple[int, ...]:
        """Degrees of freedom of each component, values first: columns that it adds to coarser components."""
        ranks = [self.design.shape[1]]
        columns = self.design
        for own in reversed(self._effects[1:]):
            columns = np.hstack([columns, own])
            ranks.append(int(np.linalg.matrix_rank(columns)))
        ranks.append(self.values.size)
        return tuple(int(one) for one in np.diff(ranks)[::-1])

    def _spectrum(self, component: int, known: FloatArray, fixed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return eigenvalues l and squares u^2 of the pivot sum of u^2 / (l (1 + t l)) of a component's variance t.

        `known` (N, n, n) is the covariance without the component, `fixed` the columns that are eliminated.
        """
        z = self._effects[component]
        p = _residual_weights(known, fixed)
        value, vector = np.linalg.eigh(z.T @ p @ z)
        u = np.swapaxes(vector, 1, 2) @ (z.T @ p @ self.values)[..., None]
        is_seen = value > _RANK * value[:, -1:]
        return np.where(is_seen, value, 0.0), np.where(is_seen, u[..., 0] ** 2, 0.0)

    def _coarser(self, component: int) -> FloatArray:
        """Columns of the design and of all components coarser than this one, as an orthonormal basis."""
        return _basis(np.hstack([self.design, *self._effects[component + 1 :]]))

    @cached_property
    def variances(self) -> FloatArray:
        """Confidence distribution of the variances, shape (N, 1 + factors): points of equal probability."""
        count = 1 + len(self.factors)
        chances = _points(self.points, count)
        known, found = self.covariance[None], np.zeros((self.points, count))
        for one in range(count):
            quantile = chi2.ppf(chances[:, one], self.degrees_of_freedom[one])
            found[:, one] = _solved(*self._spectrum(one, known, self._coarser(one)), quantile)
            z = self._effects[one]
            known = known + found[:, one, None, None] * (z @ z.T)
        return found

    @cached_property
    def _total(self) -> FloatArray:
        """Covariance of the values at each point of the distribution, shape (N, n, n)."""
        return self._total_of(self.variances)

    def _total_of(self, variances: FloatArray) -> FloatArray:
        total = np.broadcast_to(self.covariance, (len(variances), *self.covariance.shape)).copy()
        for one, z in enumerate(self._effects):
            total += variances[:, one, None, None] * (z @ z.T)
        return total

    def combination(self, weights: FloatArray, more: FloatArray | float = 0.0) -> Mixture:
        """Return the distribution of weights . beta plus an independent variable of variance `more`, shape (N,)."""
        inverse = np.linalg.inv(self._total)
        normal = np.linalg.inv(self.design.T @ inverse @ self.design)
        beta = (normal @ (inverse @ self.values @ self.design)[..., None])[..., 0]
        return Mixture(beta @ weights, weights @ normal @ weights + more)

    def upper_limit(self, component: int, chance: float) -> float:
        """Return the value that the variance of a component exceeds with a probability, given that it is not negative.

        If values agree by chance better than their errors, the limit would otherwise be zero. With Q(t) the pivot at
        the variance t, the limit solves P(chi^2 <= Q(t)) = chance P(chi^2 <= Q(0)). The limit is never below the
        quantile of `variances`.
        """
        known = self.covariance[None]
        for one in range(component):
            z = self._effects[one]
            known = known + self.variances[:, one, None, None] * (z @ z.T)
        size, square = self._spectrum(component, known, self._coarser(component))
        share = np.divide(square, size, out=np.zeros_like(square), where=size > 0)
        degrees = self.degrees_of_freedom[component]

        def below(variance: float) -> float:
            return float(chi2.cdf((share / (1 + variance * size)).sum(axis=1), degrees).mean())

        aim = chance * below(0.0)
        high = 1 / float(size.max())
        while below(high) > aim:
            high *= 2
        return float(brentq(lambda variance: below(variance) - aim, 0.0, high, rtol=1e-10)) if aim > 0 else 0.0

    @cached_property
    def reml(self) -> FloatArray:
        """Variances by restricted maximum likelihood, shape (1 + factors,).

        The restricted likelihood can have several maxima: the search starts from the median of `variances`, from zero,
        and from each component alone. Among maxima within `_EQUAL` of the highest, the estimate is the maximum with the
        least total variance.
        """
        median = np.median(self.variances, axis=0)
        projected = _residual_weights(np.eye(self.values.size)[None], self.design)[0]
        free = self.values.size - self.design.shape[1]
        scale = max(float(median.max()), float(self.values @ projected @ self.values) / free)
        if not scale > 0:
            return np.zeros(median.size)
        starts = [median / scale, np.zeros(median.size), *np.eye(median.size)]
        found = [
            minimize(self._restricted, start, (scale,), "L-BFGS-B", jac=True, bounds=[(0, None)] * start.size,
                     options={"ftol": 0.0, "gtol": 1e-9}) for start in starts
        ]  # fmt: skip
        lowest = min(one.fun for one in found)
        best = min((one.x for one in found if one.fun < lowest + _EQUAL), key=lambda x: float(x.sum()))
        return np.asarray(scale * best)

    def _restricted(self, relative: FloatArray, scale: float) -> tuple[float, FloatArray]:
        """Return -2 ln of the restricted likelihood, and its derivatives by the variances in units of `scale`."""
        total = self._total_of(scale * relative[None])
        weight = np.linalg.inv(total)[0]
        p = _residual_weights(total, self.design)[0]
        logs = np.linalg.slogdet(total[0])[1] + np.linalg.slogdet(self.design.T @ weight @ self.design)[1]
        residual = p @ self.values
        slopes = [np.sum(z * (p @ z)) - np.sum((z.T @ residual) ** 2) for z in self._effects]
        return float(logs + self.values @ residual), scale * np.array(slopes)

    @cached_property
    def excess_of_errors(self) -> tuple[float, float]:
        """Return the p-value of the agreement of the values, and the share of V that exceeds their scatter.

        The share is 1 - Q/d, where Cochran's Q has d degrees of freedom and all factors are eliminated.
        """
        size, square = self._spectrum(0, self.covariance[None], self._around(0)[1])
        seen = size > 0
        q, degrees = float((square[seen] / size[seen]).sum()), int(seen.sum())
        return float(chi2.cdf(q, degrees)), min(1 - q / degrees, 1 - _LEAST_OWN)

    def with_shared_errors(self, share: float) -> RandomEffects:
        """Return the model in which all values share an error with this share of the variance."""
        common = share * float(np.diagonal(self.covariance).mean())
        return replace(self, covariance=(1 - share) * self.covariance + common)

    def chance_of_no_spread(self, component: int) -> float:
        """Return the p-value of the differences between groups under zero variance of a component.

        Components whose groups lie inside its groups have their confidence distribution. All other components are
        eliminated. With one component it is the p-value of Cochran's Q.
        """
        finer, fixed = self._around(component)
        own = _basis(np.hstack([fixed, self._effects[component]])).shape[1] - fixed.shape[1]
        known = self.covariance[None]
        for one in finer:
            z = self._effects[one]
            known = known + self.variances[:, one, None, None] * (z @ z.T)
        size, square = self._spectrum(component, known, fixed)
        seen = np.divide(square, size, out=np.zeros_like(square), where=size > 0).sum(axis=1)
        return float(chi2.sf(seen, own).mean())

    def _around(self, component: int) -> tuple[list[int], FloatArray]:
        """Return the components whose groups lie inside this component's groups, and a basis of all other columns."""
        inside = list[int]()
        columns = self.design
        for one, z in enumerate(self._effects):
            if one != component:
                both = _basis(np.hstack([self.design, z])).shape[1]
                is_inside = _basis(np.hstack([self.design, z, self._effects[component]])).shape[1] == both
                inside += [one] if is_inside else []
                columns = columns if is_inside else np.hstack([columns, z])
        return inside, _basis(columns)

    def chance_of(self, members: NDArray[np.intp]) -> float:
        """Return the two-sided p-value of the mean of some values, given all other values; 1 if it is undetermined."""
        rest = np.setdiff1d(np.arange(self.values.size), members)
        design, factors = self.design[rest], [f[rest] for f in self.factors]
        others = RandomEffects(self.values[rest], self.covariance[np.ix_(rest, rest)], design, factors, _FEW_POINTS)
        if np.linalg.matrix_rank(design) < design.shape[1] or min(others.degrees_of_freedom) < 1:
            return 1.0
        p = _residual_weights(self._total_of(others.variances), self.design)
        own = np.linalg.inv(p[np.ix_(np.arange(len(p)), members, members)])
        deleted = (own @ (p[:, members] @ self.values)[..., None])[..., 0]
        below = Mixture(deleted.mean(axis=1), own.mean(axis=(1, 2))).below(0.0)
        return 2 * min(below, 1 - below)


def _basis(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of columns that may depend on each other."""
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, size > _RANK * size[0]])


def _residual_weights(covariance: FloatArray, columns: FloatArray) -> FloatArray:
    """Return P = W - W X (X^T W X)^-1 X^T W, W the inverse of each covariance; y^T P y is the weighted residual."""
    weight = np.linalg.inv(covariance)
    wx = weight @ columns
    return np.asarray(weight - wx @ np.linalg.solve(columns.T @ wx, np.swapaxes(wx, 1, 2)))


def _solved(size: FloatArray, square: FloatArray, quantile: FloatArray) -> FloatArray:
    """Return t >= 0 with sum of u^2 / (l (1 + t l)) = quantile, or zero if the sum is below it at t = 0."""
    share = np.divide(square, size, out=np.zeros_like(square), where=size > 0)
    largest = share.sum(axis=1)
    least = np.where(size > 0, size, np.inf).min(axis=1)
    low = np.zeros(quantile.size)
    high = np.maximum(largest / quantile, 1.0) / least  # the sum is below the quantile
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        is_above = (share / (1 + middle[:, None] * size)).sum(axis=1) > quantile
        low, high = np.where(is_above, middle, low), np.where(is_above, high, middle)
    return np.where(largest > quantile, (low + high) / 2, 0.0)


def _points(count: int, dimensions: int) -> FloatArray:
    """Return points that fill a unit cube evenly, shape (count, dimensions); the first column has equal steps.

    Other columns are multiples of the powers of 1/x, x^d = x + 1: an additive sequence of low discrepancy.
    """
    steps = np.arange(count)
    first = (steps + 0.5) / count
    if dimensions == 1:
        return first[:, None]
    root = brentq(lambda x: x**dimensions - x - 1, 1.0, 2.0)
    more = [np.mod(0.5 + (steps + 1) * root ** -(one + 1.0), 1.0) for one in range(dimensions - 1)]
    return np.column_stack([first, *more])
