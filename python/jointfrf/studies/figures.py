"""Figures of a study: distributions; over each factor, errors beside the bound, and coverage."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.axes import bulk_limits, parameter_label
from jointfrf.report.figure import Curve, Figure, Interval, Level, Panel, Ribbon
from jointfrf.studies.design import factor_label
from jointfrf.studies.store import StudyRecord
from jointfrf.studies.summary import ParameterSummary

__all__ = ["study_figures"]

#: Intervals that a panel holds, and panels that a figure holds.
_MOST_INTERVALS, _MOST_PANELS = 24, 24
#: Styles of estimators in their order, distinguishable in grey print; the last one is that of the bound.
_STYLES = ("ismm-points", "compliance-points", "third-points", "fourth-points", "fifth-points")
#: Values of a factor that span more than this ratio are drawn over a logarithmic axis.
_WIDE = 5.0
#: Half of the central 95 % of a normal distribution, in standard deviations.
_REACH = 1.96


def study_figures(record: StudyRecord, summary: Sequence[ParameterSummary]) -> list[Figure]:
    """Return the figures, those of factors with at least two numbers as values."""
    figures = [_distributions(summary)]
    for name in record.identity["factors"]:
        over = [row for row in summary if isinstance(row.point.get(name), int | float)]
        if len({row.point[name] for row in over}) > 1:
            has_bound = any(np.isfinite(row.bound) for row in over)
            figures += _over(name, over, _rmse_panel, "rmse", _RMSE + (_BOUND if has_bound else ""))
            figures += _over(name, over, _coverage_panel, "coverage", _COVERAGE)
    return [figure for figure in figures if not all(panel.is_blank for panel in figure.panels)]


#: Captions, of the factor named.
_RMSE = "Root-mean-square error over {}"
_BOUND = ", and least standard deviation of an unbiased estimate (Cramér-Rao bound)"
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
    """Median and central 95 % of every parameter."""
    panels = []
    for parameter in _parameters(summary):
        rows = [row for row in summary if row.parameter == parameter and np.isfinite(row.median)][:_MOST_INTERVALS]
        actual = [row.actual for row in rows if np.isfinite(row.actual)]
        # Where the actual value itself is varied, estimates are shown as shares of it.
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
    """Give a figure over a factor for every set of values of the others, and every noise."""
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
    """Return in words what a row belongs to beside one factor: its noise, and the values of the others."""
    return (f"noise {row.noise}", *(f"{other} {value}" for other, value in row.point.items() if other != name))


def _lines(rows: Sequence[ParameterSummary], name: str) -> Iterator[tuple[str, FloatArray, list[ParameterSummary]]]:
    """Give the estimators with their rows in the order of the factor."""
    for estimator in dict.fromkeys(row.estimator for row in rows):
        own = sorted((row for row in rows if row.estimator == estimator), key=lambda row: float(row.point[name]))
        yield estimator, np.array([float(row.point[name]) for row in own]), own


def _is_wide(rows: Sequence[ParameterSummary], name: str) -> bool:
    values = [float(row.point[name]) for row in rows]
    return min(values) > 0 and max(values) > _WIDE * min(values)


def _rmse_panel(rows: list[ParameterSummary], name: str) -> Panel:
    curves: list[Curve] = []
    bounds: list[Curve] = []
    for i, (estimator, x, own) in enumerate(_lines(rows, name)):
        y = np.array([100 * row.rmse / abs(row.actual) if row.actual else np.nan for row in own])
        bound = np.array([100 * row.bound / abs(row.actual) if row.actual else np.nan for row in own])
        if np.isfinite(y).any():
            curves.append(Curve(estimator, x, y, _STYLES[i % len(_STYLES)]))
        if np.isfinite(bound).any() and not any(np.array_equal(bound, one.y, equal_nan=True) for one in bounds):
            bounds.append(Curve("Cramér-Rao bound", x, bound, "actual"))
    label = f"RMSE of {_axis(rows[0]).partition(',')[0]}, %"
    return Panel("", factor_label(name), label, (*bounds, *curves), log_y=True, log_x=_is_wide(rows, name),
                 x_limits=_limits(rows, name))  # fmt: skip


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
    """Return limits of the axis of a factor, so that the outer points lie inside."""
    values = [float(row.point[name]) for row in rows]
    low, high = min(values), max(values)
    if _is_wide(rows, name):
        room = (high / low) ** 0.05
        return low / room, high * room
    return low - 0.05 * (high - low), high + 0.05 * (high - low)
