"""What a study says of each parameter, and as a table: moments, percentiles, coverage, beside the bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.table import Cell, Table
from jointfrf.studies.design import FactorValue, StudyPoint, factor_label
from jointfrf.studies.store import StudyRecord, StudyStore

__all__ = ["ParameterSummary", "study_table", "summarise"]

#: Numbers of a group that are in memory at once for percentiles.
_SAMPLE = 4_000_000
#: Columns of the table: in percent of the actual value, and all numbers.
_PERCENT = ("bias, %", "RMSE, %", "bound, %", "coverage, %")
_NUMBERS = ("actual", "median", "2.5 %", "97.5 %", *_PERCENT)
#: Explanations of columns, for the note of the table.
_MEANING = {
    "RMSE, %": "RMSE: root-mean-square error, of the actual value.",
    "bound, %": "Bound: least standard deviation of an unbiased estimate (Cramér-Rao) when nothing is known around the "
    "joint; with models, for fits with models.",
    "coverage, %": "Coverage: share of the 95 % intervals that hold the actual value.",
}


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
        self.good, self.inside, self.intervals = (np.zeros(actual.size, np.int64) for _ in range(3))
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
        self.intervals += has_interval.sum(axis=0)
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
            good, intervals = int(sums.good[c]), int(sums.intervals[c])
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
                bound=column.bound, coverage=int(sums.inside[c]) / intervals if intervals and is_known else np.nan,
            ))  # fmt: skip
    return found


def study_table(record: StudyRecord, summary: Sequence[ParameterSummary], missing: int) -> Table:
    """Return the summary as a table, columns that hold nothing left out."""
    factors = list(dict.fromkeys(name for row in summary for name in row.point))
    values = [_numbers(row) for row in summary]
    kept = [c for c, name in enumerate(_NUMBERS) if any(row[c] is not None for row in values)]
    has_failed = any(row.failed for row in summary)
    rows: list[tuple[Cell, ...]] = [
        (
            *(_cell(row.point.get(name)) for name in factors), row.noise, row.estimator, row.parameter, row.unit,
            *(numbers[c] for c in kept), *([str(row.failed)] if has_failed else []),
        )
        for row, numbers in zip(summary, values, strict=True)
    ]  # fmt: skip
    columns = (*map(factor_label, factors), "noise", "estimator", "parameter", "unit", *(_NUMBERS[c] for c in kept))
    left = f" {missing} realisations of {record.realisations * len(record.groups)} are missing." if missing else ""
    return Table(
        "study",
        f"Estimates over {record.realisations} realisations, seed {record.seed}",
        (*columns, "failed") if has_failed else columns,
        tuple(rows),
        note=" ".join(meaning for name, meaning in _MEANING.items() if name in columns) + left,
        percentages=_PERCENT,
    )


def _cell(value: FactorValue | None) -> Cell:
    return value if value is None or isinstance(value, str) else str(value) if isinstance(value, bool) else float(value)


def _numbers(row: ParameterSummary) -> list[float | None]:
    """Return the numbers of a row, None where there are none."""
    size = abs(row.actual) or float("nan")
    numbers = (
        row.actual, row.median, row.low, row.high, 100 * row.bias / size, 100 * row.rmse / size,
        100 * row.bound / size, 100 * row.coverage,
    )  # fmt: skip
    return [None if value != value else value for value in numbers]
