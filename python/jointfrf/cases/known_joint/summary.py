"""What came out of a case of a known joint, in short tables."""

from __future__ import annotations

from jointfrf.cases.comparison import agreement
from jointfrf.cases.fitting import FITTED
from jointfrf.cases.known_joint.compute import KnownJointResult
from jointfrf.cases.known_joint.tables import Row, identified_rows
from jointfrf.report.table import Cell, Table

__all__ = ["known_joint_summary"]


def known_joint_summary(result: KnownJointResult, tables: list[Table]) -> list[Table]:
    """Return short tables: how much fits, and how far the methods are from the actual joint."""
    return [agreement(tables), *_methods(identified_rows(result))]


def _methods(rows: list[Row]) -> list[Table]:
    """Root-mean-square errors of all methods at noise levels where there are several."""
    tables = []
    for count, noise in enumerate(dict.fromkeys(row.noise for row in rows), 1):
        errors: dict[str, dict[Cell, float]] = {}
        for row in rows:
            if row.noise == noise:
                name = row.method if row.method in FITTED else f"{row.method} ({row.bands})"
                errors.setdefault(name, {})[row.parameter] = row.rmse_percent
        if len(errors) > 1:
            parameters = next(iter(errors.values()))
            cells = tuple((parameter, *(own[parameter] for own in errors.values())) for parameter in parameters)
            title = f"Root-mean-square errors by method, noise {noise}"
            columns = ("parameter", *(f"{name}, %" for name in errors))
            tables.append(Table(f"methods-{count}", title, columns, cells, percentages=columns))
    return tables
