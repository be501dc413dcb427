"""What a study says of each parameter: moments over all realisations, percentiles, coverage, beside the bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.kernel.arguments import FloatArray
from jointfrf.studies.design import StudyPoint
from jointfrf.studies.store import StudyStore

__all__ = ["ParameterSummary", "sample_of", "summarise"]

#: Numbers of a group that are in memory at once for percentiles.
_SAMPLE = 4_000_000


@dataclass(frozen=True)
class ParameterSummary:
    """One parameter by one estimator at one point of a design.

    Attributes
    ----------
    point : mapping
        Factor to value.
    noise, estimator, parameter, unit : str
    actual : float
        NaN where it is not known; so are `bias`, `rmse` and `coverage` then.
    count, failed : int
        Realisations, and how many of them gave nothing; these are excluded.
    mean, std, median, low, high : float
        Mean, standard deviation, median, 2.5 and 97.5 percentile of the estimates.
    bias, rmse : float
        Mean error, and root-mean-square error.
    bound : float
        Least standard deviation (Cramer-Rao), NaN where it is not known.
    coverage : float
        Share of the 95 % intervals that hold the actual value, NaN without intervals.
    """

    point: StudyPoint
    noise: str
    estimator: str
    parameter: str
    unit: str
    actual: float
    count: int
    failed: int
    mean: float
    std: float
    median: float
    low: float
    high: float
    bias: float
    rmse: float
    bound: float
    coverage: float


class _Sums:
    """Moments of columns, added up chunk by chunk."""

    def __init__(self, actual: FloatArray) -> None:
        self.actual = actual
        self.count = 0
        self.good, self.inside, self.told = (np.zeros(actual.size, np.int64) for _ in range(3))
        self.mean, self.squares, self.errors = (np.zeros(actual.size) for _ in range(3))

    def add(self, values: FloatArray, low: FloatArray, high: FloatArray) -> None:
        """Add a chunk, by the update of Chan, Golub and LeVeque."""
        self.count += len(values)
        is_good = np.isfinite(values)
        number = is_good.sum(axis=0)
        kept = np.where(is_good, values, 0.0)
        mean = kept.sum(axis=0) / np.maximum(number, 1)
        squares = np.where(is_good, (values - mean) ** 2, 0.0).sum(axis=0)
        whole = np.maximum(self.good + number, 1)
        away = mean - self.mean
        self.squares += np.where(number > 0, squares + away**2 * self.good * number / whole, 0.0)
        self.mean += np.where(number > 0, away * number / whole, 0.0)
        self.good += number
        self.errors += np.where(is_good, (values - self.actual) ** 2, 0.0).sum(axis=0)
        has_interval = is_good & ~np.isnan(low) & ~np.isnan(high)
        self.told += has_interval.sum(axis=0)
        self.inside += (has_interval & (low <= self.actual) & (self.actual <= high)).sum(axis=0)


def sample_of(store: StudyStore, group: int, columns: int) -> FloatArray:
    """Return values of a group, shape (r, n_columns): all of them, or the first ones of very many."""
    most, rows = max(1, _SAMPLE // max(columns, 1)), [np.empty((0, columns))]
    for _, estimates in store.chunks(group):
        rows.append(estimates.values[:most])
        most -= len(rows[-1])
        if most <= 0:
            break
    return np.concatenate(rows)


def summarise(store: StudyStore) -> list[ParameterSummary]:
    """Condense a study, a group at a time.

    Parameters
    ----------
    store : StudyStore

    Returns
    -------
    list of ParameterSummary
        In the order of the design. Percentiles are those of the first 4e6 numbers of a group, all else of all.
    """
    found = []
    for number, group in enumerate(store.read().groups):
        sums = _Sums(np.array([column.actual for column in group.columns]))
        for _, estimates in store.chunks(number):
            sums.add(*estimates)
        sample = sample_of(store, number, len(group.columns))
        for c, column in enumerate(group.columns):
            good, told = int(sums.good[c]), int(sums.told[c])
            values = sample[np.isfinite(sample[:, c]), c]
            low, median, high = np.percentile(values, (2.5, 50, 97.5)) if values.size else [np.nan] * 3
            is_known = not np.isnan(column.actual)
            found.append(ParameterSummary(
                point=group.point, noise=group.noise, estimator=column.estimator, parameter=column.parameter,
                unit=column.unit, actual=column.actual, count=sums.count, failed=sums.count - good,
                mean=float(sums.mean[c]) if good else np.nan,
                std=float(np.sqrt(sums.squares[c] / (good - 1))) if good > 1 else np.nan,
                median=float(median), low=float(low), high=float(high),
                bias=float(sums.mean[c]) - column.actual if good else np.nan,
                rmse=float(np.sqrt(sums.errors[c] / good)) if good else np.nan,
                bound=column.bound, coverage=int(sums.inside[c]) / told if told and is_known else np.nan,
            ))  # fmt: skip
    return found
