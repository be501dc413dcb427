"""The table of a study."""

from __future__ import annotations

from collections.abc import Sequence

from jointfrf.report.table import Cell, Table
from jointfrf.studies.design import FactorValue, factor_label
from jointfrf.studies.store import StudyRecord
from jointfrf.studies.summary import ParameterSummary

__all__ = ["study_table"]

_PERCENT = ("bias, %", "RMSE, %", "bound, %", "coverage, %")
_NUMBERS = ("actual", "median", "2.5 %", "97.5 %", *_PERCENT)
#: What columns mean that need a word.
_MEANING = {
    "RMSE, %": "RMSE: root-mean-square error, of the actual value.",
    "bound, %": "Bound: least standard deviation of an unbiased estimate (Cramér-Rao) when nothing is known around the "
    "joint; with models, for fits with models.",
    "coverage, %": "Coverage: share of the 95 % intervals that hold the actual value.",
}


def study_table(record: StudyRecord, summary: Sequence[ParameterSummary], missing: int) -> Table:
    """Return the summary as a table, columns that hold nothing left out."""
    factors = list(dict.fromkeys(name for row in summary for name in row.point))
    told = [_numbers(row) for row in summary]
    kept = [c for c, name in enumerate(_NUMBERS) if any(row[c] is not None for row in told)]
    has_failed = any(row.failed for row in summary)
    rows: list[tuple[Cell, ...]] = [
        (
            *(_cell(row.point.get(name)) for name in factors), row.noise, row.estimator, row.parameter, row.unit,
            *(numbers[c] for c in kept), *([str(row.failed)] if has_failed else []),
        )
        for row, numbers in zip(summary, told, strict=True)
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
