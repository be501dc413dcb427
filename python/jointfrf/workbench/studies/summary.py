"""Summary of a study as a table and figures: moments, percentiles, coverage and bound of each parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from jointfrf.dofs import Parameter
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.report.axes import bulk_limits, parameter_label
from jointfrf.workbench.report.figure import Curve, Figure, Interval, Level, Panel, Ribbon
from jointfrf.workbench.report.table import Cell, Table
from jointfrf.workbench.studies.design import FactorValue, StudyPoint, factor_label
from jointfrf.workbench.studies.store import StudyRecord, StudyStore

__all__ = ["ParameterSummary", "study_figures", "study_table", "summarise"]

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
        Value by factor.
    noise, estimator, parameter, unit : str
        Names of noise, estimator and parameter, and the unit of the parameter.
    actual : float
        Actual value. If it is unknown, `actual`, `bias`, `rmse` and `coverage` are NaN.
    count, failed : int
        Number of realisations, and of realisations without an estimate, which are excluded.
    mean, std, median, low, high : float
        Mean, standard deviation, median, 2.5 and 97.5 percentile of the estimates.
    bias, rmse : float
        Mean error, and root-mean-square error.
    bound : float
        Least standard deviation (Cramer-Rao), NaN if it is unknown.
    coverage : float
        Share of the 95 % intervals that contain the actual value, NaN without intervals.
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
    """Moments of columns, updated chunk by chunk."""

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


def sample_of(store: StudyStore, record: StudyRecord, group: int) -> FloatArray:
    """Return values of a group, shape (r, n_columns), at most the first 4e6 numbers."""
    columns = len(record.groups[group].columns)
    most, rows = max(1, _SAMPLE // columns), [np.empty((0, columns))]
    for _, estimates in store.chunks(record, group):
        rows.append(estimates.values[:most])
        most -= len(rows[-1])
        if most <= 0:
            break
    return np.concatenate(rows)


def summarise(store: StudyStore, record: StudyRecord) -> list[ParameterSummary]:
    """Return the summary of a study, computed group by group.

    Parameters
    ----------
    store : StudyStore
        Folder of the study.
    record : StudyRecord
        Record of the study in the store.

    Returns
    -------
    list of ParameterSummary
        Summaries in the order of the design. Percentiles use at most the first 4e6 numbers of a group, other statistics
        all numbers.
    """
    found = []
    for number, group in enumerate(record.groups):
        sums = _Sums(np.array([column.actual for column in group.columns]))
        for _, estimates in store.chunks(record, number):
            sums.add(*estimates)
        sample = sample_of(store, record, number)
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
    """Return the summary as a table without empty columns."""
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
    """Return the numbers of a row, with None for missing ones."""
    size = abs(row.actual) or float("nan")
    numbers = (
        row.actual, row.median, row.low, row.high, 100 * row.bias / size, 100 * row.rmse / size,
        100 * row.bound / size, 100 * row.coverage,
    )  # fmt: skip
    return [None if value != value else value for value in numbers]


#: Largest number of intervals in a panel, and of panels in a figure.
_MOST_INTERVALS, _MOST_PANELS = 24, 24
#: Styles of estimators in their order, distinguishable in grey print; the last style is for the bound.
_STYLES = ("ismm-points", "compliance-points", "third-points", "fourth-points", "fifth-points")
#: Ratio of largest to smallest value of a factor above which its axis is logarithmic.
_WIDE = 5.0
#: Half of the central 95 % of a normal distribution, in standard deviations.
_REACH = 1.96


def study_figures(record: StudyRecord, summary: Sequence[ParameterSummary]) -> list[Figure]:
    """Return the figures of distributions, and of factors with at least two numbers as values."""
    figures = [_distributions(summary)]
    for name in record.identity["factors"]:
        over = [row for row in summary if isinstance(row.point.get(name), int | float)]
        if len({row.point[name] for row in over}) > 1:
            has_bound = any(np.isfinite(row.bound) for row in over)
            figures += _over(name, over, _rmse_panel, "rmse", _RMSE + (_BOUND if has_bound else ""))
            figures += _over(name, over, _coverage_panel, "coverage", _COVERAGE)
    return [figure for figure in figures if not all(panel.is_blank for panel in figure.panels)]


#: Captions by factor.
_RMSE = "Root-mean-square error over {}"
_BOUND = (
    ", and least standard deviation of an unbiased estimate (Cramér-Rao bound); shaded: where the error of an estimate "
    "at the bound lies in 95 % of studies of so many realisations"
)
_COVERAGE = (
    "Share of the 95 % intervals that hold the actual value, over {}; shaded: where it lies for intervals that hold, "
    "in 95 % of studies of so many realisations"
)


def _parameters(rows: Sequence[ParameterSummary]) -> list[str]:
    return list(dict.fromkeys(row.parameter for row in rows))[:_MOST_PANELS]


def _axis(row: ParameterSummary) -> str:
    """Return the label of an axis: the parameter and its unit."""
    kind, _, dof = row.parameter.partition("_")
    if kind in ("k", "c", "h") and dof and "_" not in dof.replace("theta_", ""):
        try:
            return parameter_label(Parameter.of_dof(kind, dof))  # type: ignore[arg-type]
        except ValueError:
            pass
    return f"{row.parameter}, {row.unit}" if row.unit else row.parameter


def _distributions(summary: Sequence[ParameterSummary]) -> Figure:
    """Return a figure of median and central 95 % of every parameter."""
    panels = []
    for parameter in _parameters(summary):
        rows = [row for row in summary if row.parameter == parameter and np.isfinite(row.median)][:_MOST_INTERVALS]
        actual = [row.actual for row in rows if np.isfinite(row.actual)]
        # If the actual value is varied, estimates are shown as shares of it.
        scale = [abs(row.actual) if len(set(actual)) > 1 and row.actual else 1.0 for row in rows]
        is_share = len(set(actual)) > 1
        intervals = tuple(
            Interval(_name(row), row.low / s, row.median / s, row.high / s) for row, s in zip(rows, scale, strict=True)
        )
        values = [np.array([one.low, one.median, one.high]) for one in intervals]
        around = 1.0 if is_share else actual[0] if actual else None
        panels.append(Panel(
            "", f"{_axis(rows[0]).partition(',')[0]} over actual value" if is_share else _axis(rows[0]), "",
            intervals=intervals,
            levels=(Level("actual", around, "actual"),) if around is not None else (),
            x_limits=bulk_limits(values, around=around) if values else None,
        ) if rows else Panel("", "", ""))  # fmt: skip
    caption = "Estimates: median, and 2.5 to 97.5 percentile"
    if any(one.low < panel.x_limits[0] or one.high > panel.x_limits[1]
           for panel in panels if panel.x_limits for one in panel.intervals):  # fmt: skip
        caption += "; an arrowhead: it reaches beyond the axis"
    if len(summary) > _MOST_INTERVALS * len(panels):
        caption += f"; the first {_MOST_INTERVALS} of each parameter, the table has all"
    return Figure("distributions", caption, tuple(panels), columns=1 if len(panels) < 2 else 2)


def _name(row: ParameterSummary) -> str:
    point = ", ".join(f"{name} {value:g}" if isinstance(value, int | float) else f"{name} {value}"
                      for name, value in row.point.items())  # fmt: skip
    return "\n".join(filter(None, (row.estimator, point or row.noise)))


def _over(
    name: str,
    rows: Sequence[ParameterSummary],
    panel: Callable[[list[ParameterSummary], str], Panel],
    key: str,
    caption: str,
) -> Iterator[Figure]:
    """Yield a figure over a factor for every noise and set of values of other factors."""
    others = list(dict.fromkeys(_others(row, name) for row in rows))
    for number, other in enumerate(others, 1):
        own = [row for row in rows if _others(row, name) == other]
        panels = tuple(
            panel([row for row in own if row.parameter == parameter], name) for parameter in _parameters(own)
        )
        heading = ", ".join(other) if len(others) > 1 else ""
        suffix = f"-{number}" if len(others) > 1 else ""
        clean = "".join(c if c.isalnum() else "-" for c in name).strip("-")
        what = factor_label(name).partition(",")[0]
        text = caption.format(f"the {what}")
        yield Figure(f"{key}-{clean}{suffix}", text + (f": {heading}" if heading else ""),
                     panels, columns=1 if len(panels) < 2 else 2, heading=heading)  # fmt: skip


def _others(row: ParameterSummary, name: str) -> tuple[str, ...]:
    """Return noise and values of the factors of a row as texts, except one factor."""
    return (f"noise {row.noise}", *(f"{other} {value}" for other, value in row.point.items() if other != name))


def _lines(rows: Sequence[ParameterSummary], name: str) -> Iterator[tuple[str, FloatArray, list[ParameterSummary]]]:
    """Yield the estimators with their rows in the order of the factor."""
    for estimator in dict.fromkeys(row.estimator for row in rows):
        own = sorted((row for row in rows if row.estimator == estimator), key=lambda row: float(row.point[name]))
        yield estimator, np.array([float(row.point[name]) for row in own]), own


def _is_wide(rows: Sequence[ParameterSummary], name: str) -> bool:
    values = [float(row.point[name]) for row in rows]
    return min(values) > 0 and max(values) > _WIDE * min(values)


def _rmse_panel(rows: list[ParameterSummary], name: str) -> Panel:
    """Return a panel of errors and bound; n squared normal errors at the bound sum to chi-squared of n."""
    curves: list[Curve] = []
    bounds: list[Curve] = []
    bands: list[Ribbon] = []
    for i, (estimator, x, own) in enumerate(_lines(rows, name)):
        y = np.array([100 * row.rmse / abs(row.actual) if row.actual else np.nan for row in own])
        bound = np.array([100 * row.bound / abs(row.actual) if row.actual else np.nan for row in own])
        if np.isfinite(y).any():
            curves.append(Curve(estimator, x, y, _STYLES[i % len(_STYLES)]))
        if np.isfinite(bound).any() and not any(np.array_equal(bound, one.y, equal_nan=True) for one in bounds):
            bounds.append(Curve("Cramér-Rao bound", x, bound, "actual"))
            count = np.maximum([row.count - row.failed for row in own], 1)
            low, high = (bound * np.sqrt(chi2.ppf(p, count) / count) for p in (0.025, 0.975))
            bands.append(Ribbon("95 % within chance", x, low, high, "actual"))
    label = f"RMSE of {_axis(rows[0]).partition(',')[0]}, %"
    return Panel(
        "", factor_label(name), label, (*bounds, *curves), tuple(bands), log_y=True, log_x=_is_wide(rows, name),
        x_limits=_limits(rows, name),
    )  # fmt: skip


def _coverage_panel(rows: list[ParameterSummary], name: str) -> Panel:
    curves = []
    for i, (estimator, x, own) in enumerate(_lines(rows, name)):
        y = np.array([100 * row.coverage for row in own])
        if np.isfinite(y).any():
            curves.append(Curve(estimator, x, y, _STYLES[i % len(_STYLES)]))
    if not curves:
        return Panel("", "", "")
    x, count = curves[0].x, max(1, min(row.count - row.failed for row in rows))
    reach = 100 * _REACH * np.sqrt(0.95 * 0.05 / count)
    low, high = np.full(x.size, 95 - reach), np.full(x.size, min(95 + reach, 100.0))
    ribbon = Ribbon("95 % within chance", x, low, high, "actual")
    least = min(float(np.nanmin(curve.y)) for curve in curves)
    return Panel(
        "", factor_label(name), f"coverage of {_axis(rows[0]).partition(',')[0]}, %", tuple(curves), ribbons=(ribbon,),
        levels=(Level("95 %", 95.0, "actual"),), log_x=_is_wide(rows, name), x_limits=_limits(rows, name),
        y_limits=(min(88.0, least - 2), 100.5),
    )  # fmt: skip


def _limits(rows: Sequence[ParameterSummary], name: str) -> tuple[float, float]:
    """Return limits of the axis of a factor with a margin around the outer points."""
    values = [float(row.point[name]) for row in rows]
    low, high = min(values), max(values)
    if _is_wide(rows, name):
        room = (high / low) ** 0.05
        return low / room, high * room
    return low - 0.05 * (high - low), high + 0.05 * (high - low)
