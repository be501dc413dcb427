"""Tables, figures and numbers of a case of a modelled joint."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointfrf.dofs import is_rotation
from jointfrf.identification.fit_data import ModelData
from jointfrf.identification.record import fit_to_dict
from jointfrf.identification.residual_test import ResidualTest
from jointfrf.identification.result import Fit
from jointfrf.workbench.cases.comparison import Compared, compared_table
from jointfrf.workbench.cases.modelled_joint.compute import ModelledJointResult, moving_stiffness
from jointfrf.workbench.report.figure import Curve, Figure, Panel, Ribbon
from jointfrf.workbench.report.table import Cell, Table, number

__all__ = ["build_figures", "build_numbers", "build_summary", "build_tables"]

#: Least probability of the coverage of a row that fits.
_CHANCE = 0.005


def build_tables(result: ModelledJointResult) -> list[Table]:
    """Return the tables in the order in which they are shown."""
    return [_parameters(result), _stiffness(result), _residuals(result)]


def _parameters(result: ModelledJointResult) -> Table:
    """Return the table of parameters, their bounds, and the coverage of their intervals."""
    from scipy.stats import binom

    rows = []
    for c, column in enumerate(result.found.group.columns):
        actual, size = column.actual, abs(column.actual)
        values, low, high = (array[:, c] for array in result.found.estimates)
        inside = int(np.count_nonzero((low <= actual) & (actual <= high)))
        fits = bool(binom.cdf(inside, len(values), 0.95) > _CHANCE)
        rmse = float(np.sqrt(np.mean((values - actual) ** 2)))
        limits = [float(np.percentile(values, share)) for share in (50, 2.5, 97.5)]
        cells: tuple[Cell, ...] = (
            column.parameter, column.unit, actual, *limits, 100 * rmse / size, 100 * column.bound / size,
            100 * inside / len(values),
        )  # fmt: skip
        rows.append(Compared(cells, fits))
    columns = ("parameter", "unit", "actual", "median", "2.5 %", "97.5 %", "RMSE, %", "bound, %", "coverage, %")
    return compared_table(
        "parameters", "Parameters of the joint and of the models", columns, rows,
        "Bound: Cramér-Rao, with the models and the priors. Coverage: how often the 95 % interval holds the actual "
        "value; it does not fit where so few are likely by less than 0.5 %.",
        columns[6:],
    )  # fmt: skip


def _stiffness(result: ModelledJointResult) -> Table:
    """Return the table of stiffness and loss factor of each law at some frequencies."""
    case = result.case
    exact = moving_stiffness(case.truth.joint, case.show_hz)
    constant = moving_stiffness(result.constant.joint, case.show_hz)
    at = [int(np.argmin(abs(case.freq_hz - f))) for f in case.show_hz]
    found = np.array([draw.stiffness[at] for draw in result.found.details])
    rows: list[tuple[Cell, ...]] = []
    dofs = [a for a, b in case.truth.joint.laws if a == b]
    for d, dof in enumerate(dofs):
        unit = "N m/rad" if is_rotation(dof) else "N/m"
        for f, freq in enumerate(case.show_hz.tolist()):
            k = found[:, f, d]
            rows.append((
                dof, unit, freq, exact[f, d].real, float(np.median(k.real)), constant[f, d].real,
                exact[f, d].imag / exact[f, d].real, float(np.median(k.imag / k.real)),
                constant[f, d].imag / constant[f, d].real,
            ))  # fmt: skip
    columns = ("DOF", "unit", "Hz", "Re K*", "found", "by k + iωc", "loss factor", "found ", "by k + iωc ")
    return Table(
        "stiffness", "Stiffness and loss factor over frequency", columns, tuple(rows),
        note="Found: median of the realisations. By k + iωc: springs and dashpots fitted to the first realisation.",
    )  # fmt: skip


def _residuals(result: ModelledJointResult) -> Table:
    """Return the table of residual tests with the laws of the case, and with springs and dashpots."""
    first, constant = result.first.test, result.constant.test
    assert isinstance(first, ResidualTest)
    assert isinstance(constant, ResidualTest)
    count = len(result.found.details)
    alarms = sum(not draw.is_noise for draw in result.found.details)
    rows: list[tuple[Cell, ...]] = [
        ("laws of the case", f"{count - alarms} of {count}", first.ratio, _where(first.bands)),
        (
            "springs and dashpots",
            "yes" if constant.is_noise else "no",
            constant.ratio,
            _where(constant.bands),
        ),
    ]
    columns = ("joint", "residual is noise", "residual over noise", "most at")
    return Table("residual", "Is the residual noise?", columns, tuple(rows), note="Ratio and bands: first realisation.")


def _ratio(fit: Fit) -> float:
    return fit.residual_level / fit.noise_level


def _where(bands: tuple[tuple[float, float, float], ...]) -> str:
    return ", ".join(f"{low:g}-{high:g} Hz ({ratio:.2g})" for low, high, ratio in bands[:4])


def build_summary(result: ModelledJointResult, tables: list[Table]) -> list[Table]:
    """Return short tables of the outcome."""
    worst = max(
        (float(row[6]) / float(row[7]), str(row[0]))  # type: ignore[arg-type]
        for row in tables[0].rows
    )
    held = [float(row[8]) for row in tables[0].rows]  # type: ignore[arg-type]
    cells: tuple[tuple[Cell, ...], ...] = (
        ("RMSE over bound, worst", f"{worst[0]:.2f} ({worst[1]})"),
        ("coverage of 95 % intervals", f"{min(held):.0f} to {max(held):.0f} %"),
        ("residual over noise, laws of the case", number(_ratio(result.first), 3)),
        ("residual over noise, springs and dashpots", number(_ratio(result.constant), 3)),
    )
    return [Table("outcome", "What came out", ("quantity", "value"), cells)]


def build_numbers(result: ModelledJointResult) -> dict[str, Any]:
    """Return the numbers of a case for JSON: the first realisation, and all estimates."""
    values = result.found.estimates.values.T.tolist()
    return {
        "first": fit_to_dict(result.first, lines=False),
        "values": {one.parameter: own for one, own in zip(result.found.group.columns, values, strict=True)},
    }


def build_figures(result: ModelledJointResult) -> list[Figure]:
    """Return figures of stiffness and loss factor over frequency, and of the FRFs of the first realisation."""
    return [_stiffness_figure(result), _frf_figure(result)]


def _stiffness_figure(result: ModelledJointResult) -> Figure:
    case = result.case
    exact, constant = (moving_stiffness(j, case.freq_hz) for j in (case.truth.joint, result.constant.joint))
    found = np.array([draw.stiffness for draw in result.found.details])
    panels = []
    for d, dof in enumerate(a for a, b in case.truth.joint.laws if a == b):
        unit = "N m/rad" if is_rotation(dof) else "N/m"
        for part, label in ((lambda k: k.real, f"Re K*, {unit}"), (lambda k: k.imag / k.real, "loss factor")):
            low, high = np.percentile(part(found[:, :, d]), [2.5, 97.5], axis=0)
            panels.append(
                Panel(
                    dof,
                    "frequency, Hz",
                    label,
                    curves=(
                        Curve("actual", case.freq_hz, part(exact[:, d]), "actual"),
                        Curve("springs and dashpots", case.freq_hz, part(constant[:, d]), "mean"),
                    ),
                    ribbons=(Ribbon("95 % of the realisations", case.freq_hz, low, high, "ismm"),),
                )
            )
    return Figure(
        "stiffness", "Stiffness and loss factor of the joint: actual, found, and by springs and dashpots.",
        tuple(panels), columns=2,
    )  # fmt: skip


def _frf_figure(result: ModelledJointResult) -> Figure:
    case, panels = result.case, []
    first, constant = result.first.data, result.constant.data
    assert isinstance(first, ModelData)
    assert isinstance(constant, ModelData)
    for row, response in enumerate(case.responses):
        for column, force in enumerate(case.forces):
            title, freq = f"{response} by {force}", case.freq_hz
            curves = (
                Curve("fitted", freq, np.abs(first.predicted[:, row, column]), "actual"),
                Curve("measured", freq, np.abs(result.measured[:, row, column]), "measured"),
            )
            panels.append(Panel(title, "frequency, Hz", "|H|, m/N", curves=curves, log_y=True))
            residuals = (
                Curve("springs and dashpots", freq, np.abs(constant.residual[:, row, column]), "low"),
                Curve("laws of the case", freq, np.abs(first.residual[:, row, column]), "measured"),
            )
            panels.append(Panel(title, "frequency, Hz", "|residual| over noise", curves=residuals, log_y=True))
    return Figure(
        "frfs",
        "FRFs of the first realisation, measured and fitted; and their residual beside that of springs and dashpots.",
        tuple(panels),
        columns=2,
    )
