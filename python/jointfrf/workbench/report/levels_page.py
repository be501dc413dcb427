"""Page of a joint at several levels: stiffness and loss factor over amplitude, and tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from jointfrf.dofs import is_rotation
from jointfrf.kernel.arguments import FloatArray, check_type
from jointfrf.workbench.amplitude.decay import ModalDecay
from jointfrf.workbench.amplitude.levels import JointLevel, JointLevels
from jointfrf.workbench.report.document import (
    Document,
    Section,
    Words,
    section_of_command,
    words_of_findings,
    write_document,
)
from jointfrf.workbench.report.figure import Curve, Figure, Panel, Ribbon
from jointfrf.workbench.report.table import Table, csv_text

__all__ = ["levels_csv", "levels_figure", "modal_decay_figure", "write_levels"]


def _units(dof: str) -> tuple[str, str]:
    return ("rad", "N m") if is_rotation(dof) else ("m", "N")


def levels_figure(found: JointLevels, dof: str) -> Figure:
    """Return stiffness and loss factor of a DOF over motion and force, with intervals and the best law."""
    own, (motion, load) = found.levels[dof], _units(dof)
    law = found.laws[dof].fits[0] if dof in found.laws else None
    fitted = {one.amplitude for one in own if one.stiffness.std_error > 0 and one.loss_factor.std_error > 0}
    at = np.array(sorted(fitted))
    axes = [(f"amplitude, {motion}", np.array([one.amplitude for one in own]), at)]
    of_law = at if law is None else at * law.stiffness * np.hypot(1.0, law.loss_factor)
    name_of_law = "" if law is None else f"law: {law.law}" if law.widened == 1 else f"nearest law: {law.law}"
    axes.append((f"force, {load}", np.array([one.force for one in own]), of_law))
    panels = []
    for name, unit in (("stiffness", f"{load}/{motion}"), ("loss factor", "1")):
        attribute = name.replace(" ", "_")
        values = [getattr(one, attribute) for one in own]
        limits = [np.array([getattr(one, part) for one in values]) for part in ("low", "value", "high")]
        for label, x, x_law in axes:
            curves = [] if law is None else [Curve(name_of_law, x_law, getattr(law, attribute), "actual")]
            below = label if attribute == "loss_factor" else ""
            panels.append(_panel(below, f"{name}, {unit}", x, limits, f"{100 * found.probability:g} %", *curves))
    caption = f"{dof}: stiffness and loss factor over the relative motion in the joint and over its force, peak values"
    return Figure(f"levels-{dof}", caption, tuple(panels), columns=2)


def _panel(
    x_label: str, y_label: str, x: FloatArray, limits: Sequence[FloatArray], interval: str, *law: Curve
) -> Panel:
    """Return a panel of low, value and high over an amplitude, in any order of the values."""
    order = np.argsort(x)
    low, value, high = (own[order] for own in limits)
    curves, ribbon = (
        (Curve("found", x[order], value, "ismm-points"), *law),
        Ribbon(interval, x[order], low, high, "ismm"),
    )
    return Panel("", x_label, y_label, curves, (ribbon,), log_x=True)


#: Standard errors of a 95 % interval.
_QUANTILE = 1.96


def modal_decay_figure(mode: ModalDecay) -> Figure:
    """Return frequency and damping over the amplitude of the sensor that moves most, with 95 % intervals."""
    strongest = int(np.nanargmax(np.nanmean(mode.amplitude, axis=0)))
    known, name = np.isfinite(mode.amplitude[:, strongest]), mode.sensors[strongest]
    panels = []
    for label, value, error in zip(
        ("frequency, Hz", "damping ratio, 1"), (mode.freq_hz, mode.damping), mode.errors, strict=True
    ):
        limits = [(value * (1 + reach * error))[known] for reach in (-_QUANTILE, 0.0, _QUANTILE)]
        panels.append(_panel(f"amplitude of {name}, m", label, mode.amplitude[known, strongest], limits, "95 %"))
    caption = f"Mode at {mode.name}: frequency and damping over the peak displacement of {name}"
    return Figure(f"decay-{mode.name.replace(' ', '-')}", caption, tuple(panels), columns=2)


def write_levels(found: JointLevels, path: Path | str, *, command: str = "", modes: Sequence[ModalDecay] = ()) -> Path:
    """Write the page of a joint at several levels as one self-contained HTML file, and return its path.

    Parameters
    ----------
    found : JointLevels
        Result of `levels`, `backbone_levels` or `decay_levels`.
    path : Path or str
        Path of the file, in a folder that exists.
    command : str
        Command that made the levels, default empty.
    modes : sequence of ModalDecay
        Free decays from which the levels come; default none.

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
    levels : stiffness and loss factor from fits at several levels.
    decay_levels : stiffness and loss factor from free decays.
    """
    check_type("found", found, JointLevels)
    figures = [*map(modal_decay_figure, modes), *(levels_figure(found, dof) for dof in found.levels)]
    left_out = [f"Left out: {test}. {why}" for test, why in found.left_out.items()]
    sections = [
        Section("summary", "Summary", [
            Words(left_out, "warnings"), Words(list(_sentences(found))), *words_of_findings(found.findings),
        ]),
        Section("levels", "Over amplitude", figures),
        Section("tables", "Tables", [table for dof in found.levels for table in _tables(found, dof)]),
        section_of_command(command),
    ]  # fmt: skip
    count = max(map(len, found.levels.values()))
    about = f"Stiffness and loss factor of {', '.join(found.levels)} over the amplitude of the motion in the joint."
    return write_document(Document(f"A joint at {count} levels", about, sections), path)


def _sentences(found: JointLevels) -> Iterator[str]:
    for dof, own in found.levels.items():
        motion, load = _units(dof)
        ends = own[0], own[-1]
        k, eta, a = (
            " to ".join(f"{value:.4g}" for value in values)
            for values in ([one.stiffness.value for one in ends], [one.loss_factor.value for one in ends],
                           [one.amplitude for one in ends])
        )  # fmt: skip
        yield (
            f"{dof}: k goes from {k} {load}/{motion}, the loss factor from {eta}, as the amplitude goes from {a} "
            f"{motion}."
        )
        if dof in found.laws:
            best, *others = found.laws[dof].fits
            apart = f", {others[0].aicc - best.aicc:.3g} below {others[0].law}" if others else ""
            fit = f"chi^2 {best.chi_square:.3g} at {best.degrees} degrees of freedom"
            if best.widened > 1:
                yield f"{dof}: no law explains the levels within their errors (the nearest, {best.law}, has {fit})."
            else:
                yield f"{dof}: the law with the lowest AICc is {best.law}{apart}; {fit}."


def _tables(found: JointLevels, dof: str) -> Iterator[Table]:
    motion, load = _units(dof)
    columns = ("test", f"amplitude, {motion}", "lines from", "to", f"force, {load}", f"k, {load}/{motion}", "k from",
               "k to", "loss factor", "loss from", "loss to", "order in ln a")  # fmt: skip
    yield Table(f"levels-{dof}", f"{dof} over amplitude", columns, tuple(map(_row, found.levels[dof])))
    if dof in found.laws:
        fits = found.laws[dof].fits
        rows = tuple((one.law, one.aicc, one.bic, one.chi_square, float(one.degrees)) for one in fits)
        yield Table(f"laws-{dof}", f"Laws of {dof}", ("law", "AICc", "BIC", "chi^2", "degrees of freedom"), rows)
        best = tuple((name, value, *fits[0].intervals[name]) for name, value in fits[0].values.items())
        title = f"Parameters of {fits[0].law}" + (", which does not fit the levels" if fits[0].widened > 1 else "")
        yield Table(f"law-{dof}", title, ("parameter", "value", "from", "to"), best)


def _row(one: JointLevel) -> tuple[str | float, ...]:
    k, eta = one.stiffness, one.loss_factor
    return (one.label, one.amplitude, one.lowest, one.highest, one.force, k.value, k.low, k.high, eta.value, eta.low,
            eta.high, float(one.order))  # fmt: skip


def levels_csv(found: JointLevels) -> str:
    """Return a CSV table of secant stiffness and loss factor, with a line for each level of each DOF."""
    columns = ("dof", "test", "amplitude", "lowest", "highest", "force", "k", "k_low", "k_high", "loss_factor",
               "loss_factor_low", "loss_factor_high", "order")  # fmt: skip
    return csv_text([columns, *((dof, *_row(one)) for dof, own in found.levels.items() for one in own)])
