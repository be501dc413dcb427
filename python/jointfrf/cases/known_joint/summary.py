"""What came out of a case of a known joint, in a few sentences."""

from __future__ import annotations

from jointfrf.cases.comparison import agreement
from jointfrf.cases.known_joint.compute import KnownJointResult
from jointfrf.cases.known_joint.tables import Row, identified_rows
from jointfrf.report.table import Table, number

__all__ = ["known_joint_summary"]


def known_joint_summary(result: KnownJointResult, tables: list[Table]) -> list[str]:
    """Say in a few sentences what came out."""
    rows = identified_rows(result)
    by_key = {table.key: table for table in tables}
    sentences = _published(rows) + agreement(by_key["natural-frequencies"])
    if "limits" in by_key:
        limits = by_key["limits"]
        kept = len(limits.rows) - len(limits.failing)
        sentences.append(f"{kept} of {len(limits.rows)} root-mean-square errors are below their limits.")
    exact = by_key["noise-free"]
    good = len(exact.rows) - len(exact.failing)
    sentences.append(f"Without noise {good} of {len(exact.rows)} checks of the equations are exact.")
    return sentences + _methods(rows)


def _published(rows: list[Row]) -> list[str]:
    """How many values of the thesis lie inside the distributions."""
    sentences = []
    beside = [row for row in rows if row.source is not None]
    for source, noise, bands in dict.fromkeys((str(r.source), r.noise, r.bands) for r in beside):
        own = [r for r in beside if (r.source, r.noise, r.bands) == (source, noise, bands)]
        outside = [
            f"{r.parameter} (thesis {number(r.published)}, ours {number(r.low)} to {number(r.high)})"
            for r in own if not r.fits
        ]  # fmt: skip
        text = (
            f"{source[:1].upper()}{source[1:]}, noise {noise}, bands {bands}: {len(own) - len(outside)} of {len(own)} "
            "values of the thesis lie between the 2.5 and 97.5 percentile of ours"
        )
        sentences.append(text + (f"; {_joined(outside)} do not fit." if outside else "."))
    return sentences


def _methods(rows: list[Row]) -> list[str]:
    """Root-mean-square errors of all methods at noise levels where there are several."""
    sentences = []
    for noise in dict.fromkeys(row.noise for row in rows):
        errors: dict[str, dict[str, str]] = {}
        for row in rows:
            if row.noise == noise:
                name = row.method if row.method == "compliance" else f"{row.method} ({row.bands})"
                errors.setdefault(name, {})[row.parameter.name] = number(row.rmse_percent, 2)
        if len(errors) > 1:
            parameters = " / ".join(next(iter(errors.values())))
            each = "; ".join(f"{name} {' / '.join(values.values())}" for name, values in errors.items())
            sentences.append(f"RMSE in percent of {parameters}, noise {noise}: {each}.")
    return sentences


def _joined(words: list[str]) -> str:
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else "".join(words)
