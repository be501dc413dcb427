"""Page of a planned test: places of sensors and impacts, their contributions, and information over frequency."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.planning.joint_frfs import JointFrfPlan
from jointfrf.workbench.planning.plan import MeasurementPlan
from jointfrf.workbench.report.document import (
    Document,
    HeatMap,
    Part,
    Section,
    Words,
    section_of_command,
    words_of_findings,
    write_document,
)
from jointfrf.workbench.report.figure import Curve, Figure, Level, Panel
from jointfrf.workbench.report.sketch import SketchedPart, assembly_sketch
from jointfrf.workbench.report.table import Cell, Table

__all__ = ["cost_figure", "line_figure", "write_plan"]

#: Largest number of candidates in a map of shares.
_MOST_CELLS = 40


def cost_figure(plan: MeasurementPlan) -> Figure:
    """Return a figure of the error over the cost."""
    cost, error = np.array([(one.cost, 100 * one.error) for one in plan.steps]).T
    panel = Panel(
        "", "cost of sensors and hits", "relative error, %", (Curve("plan", cost, error, "ismm-points"),),
        levels=(Level("all candidates", 100 * plan.everything.error, "actual"),), log_y=True,
    )  # fmt: skip
    return Figure("plan-cost", "Relative error of the targets over what sensors and hits cost", (panel,))


def line_figure(plan: MeasurementPlan | JointFrfPlan) -> Figure:
    """Return a figure of the information of each line on each target."""
    width = np.gradient(plan.freq_hz) if plan.freq_hz.size > 1 else np.ones(1)
    panels = list[Panel]()
    for name, share in zip(plan.bands, plan.line_share, strict=True):
        low, high = plan.bands[name]
        panels.append(Panel(
            name, "frequency, Hz" if len(panels) == len(plan.bands) - 1 else "", "share of a hertz, %",
            (Curve("share of what is known", plan.freq_hz, 100 * share / width, "fitted"),),
            shades=((f"90 % between {low:.4g} and {high:.4g} Hz", (plan.bands[name],)),),
        ))  # fmt: skip
    return Figure("plan-lines", "Where in frequency the knowledge of each target comes from", tuple(panels))


def write_plan(
    plan: MeasurementPlan | JointFrfPlan, path: Path | str, *, parts: Sequence[SketchedPart] = (), command: str = ""
) -> Path:
    """Write the page of a planned test as one self-contained HTML file, and return its path.

    Parameters
    ----------
    plan : MeasurementPlan or JointFrfPlan
        Result of `plan` or `plan_joint_frfs`.
    path : Path or str
        Path of the file, in a folder that exists.
    parts : sequence of SketchedPart
        Parts with the places of their nodes, for a drawing of joints, sensors and impacts; default none.
    command : str
        Command that made the plan, default empty.

    Returns
    -------
    Path
        Path of the written file.

    Raises
    ------
    MissingPackageError
        jinja2 or matplotlib is missing.
    OSError
        The file cannot be written.

    See Also
    --------
    plan : choice of sensors and impacts.
    plan_joint_frfs : expected errors from FRFs between all joint DOFs.
    """
    if not isinstance(plan, MeasurementPlan | JointFrfPlan):
        raise TypeError(f"plan must be a MeasurementPlan or a JointFrfPlan, not {type(plan).__name__}")
    document = _of_joint_frfs(plan, command) if isinstance(plan, JointFrfPlan) else _document(plan, parts, command)
    return write_document(document, path)


def _of_joint_frfs(plan: JointFrfPlan, command: str) -> Document:
    columns = ("parameter", "expected", "standard error", "error, %", "band from, Hz", "to, Hz")
    moved = plan.moved()
    shift = tuple(heading.replace("shift", "FRFs that are wrong move it by") for heading in moved)
    rows = tuple(
        (name, value, plan.std_error[name], 100 * plan.std_error[name] / abs(value) if value else None,
         *plan.bands[name], *(by[name] for by in moved.values()))
        for name, value in plan.value.items()
    )  # fmt: skip
    terms = map(Parameter.parse, plan.value)
    dofs = [one.row for one in terms if one.kind == "k"]
    names = [f"{side}:{dof}" for side in "jk" for dof in dofs]
    maps = list(_shares(tuple(plan.value), names, names, plan.frf_share, "what all know"))
    sections = [
        Section("summary", "What the test will know", [Table("targets", "", (*columns, *shift), rows)]),
        Section("lines", "Where the knowledge lies", [line_figure(plan), *maps]),
        section_of_command(command),
    ]
    first, last = plan.freq_hz[[0, -1]].tolist()
    about = f"FRFs between all joint DOFs, {plan.freq_hz.size} lines from {first:.4g} to {last:.4g} Hz."
    return Document("A planned test", about, sections)


def _document(plan: MeasurementPlan, parts: Sequence[SketchedPart], command: str) -> Document:
    best = plan.proposed
    sketch = assembly_sketch(parts, best.sensors, best.hits) if parts else None
    maps = _shares(plan.targets, plan.responses, plan.forces, plan.frf_share, "what all candidates would know")
    sections = [
        Section("summary", "The test", [*_said(plan), sketch, _targets(plan)]),
        Section("cost", "What more would bring", [cost_figure(plan), _steps(plan), _additions(plan)]),
        Section("lines", "Where the knowledge lies", [line_figure(plan), *maps]),
        section_of_command(command),
    ]
    about = (
        f"A test of {len(best.sensors)} sensors and {len(best.hits)} hits, chosen from {len(plan.responses)} and "
        f"{len(plan.forces)} places; {plan.freq_hz.size} lines from {plan.freq_hz[0]:.4g} to {plan.freq_hz[-1]:.4g} Hz."
    )
    return Document("A planned test", about, sections)


def _said(plan: MeasurementPlan) -> Iterator[Part]:
    best = plan.proposed
    errors = ", ".join(f"{name} to {100 * plan.relative_error(best, name):.2g} %" for name in plan.targets)
    yield Words(
        [f"Sensors at {', '.join(best.sensors)}; hits at {', '.join(best.hits)}: {errors} (one standard error)."]
    )
    yield from words_of_findings(plan.findings)


def _targets(plan: MeasurementPlan) -> Table:
    columns = ("parameter", "unit", "expected", "error, %", "all candidates, %", "band from, Hz", "to, Hz")
    rows: list[tuple[Cell, ...]] = []
    for name in plan.targets:
        row: list[Cell] = [name, plan.unit[name], plan.value[name]]
        row += [100 * plan.relative_error(step, name) for step in (plan.proposed, plan.everything)]
        row += [*plan.bands[name], *([100 * plan.shift[name] / abs(plan.value[name])] if plan.shift else [])]
        rows.append(tuple(row))
    more = ("masses of the sensors move it by, %",) if plan.shift else ()
    return Table("targets", "What this test will know", (*columns, *more), tuple(rows))


def _steps(plan: MeasurementPlan) -> Table:
    rows = tuple((one.cost, ", ".join(one.sensors), ", ".join(one.hits), 100 * one.error) for one in plan.steps)
    return Table("steps", "Tests from small to large", ("cost", "sensors", "hits", "error, %"), rows)


def _additions(plan: MeasurementPlan) -> Table:
    rows = tuple((one.kind, one.dof, one.cost, 100 * one.error) for one in plan.additions[:10])
    return Table("additions", "What would come next", ("kind", "DOF", "cost", "error with it, %"), rows)


def _shares(
    targets: Sequence[str], rows: Sequence[str], columns: Sequence[str], shares: FloatArray, of_what: str
) -> Iterator[Part]:
    """Yield maps of the share of each FRF in the information of all."""
    if max(len(rows), len(columns)) > _MOST_CELLS:
        return
    for name, share in zip(targets, shares, strict=True):
        title = f"{name}: share of each FRF in {of_what}, %"
        yield HeatMap(f"share-{name}", title, "sensor / hit", rows, columns, 100 * share, 0.0, 100 * float(share.max()))
