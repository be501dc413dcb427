"""Figures of one identification: the joint and the information on it over frequency; their files."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from jointfrf.dofs import Parameter, ParameterKind, compliance_unit, parameter_name
from jointfrf.errors import IllConditionedWarning
from jointfrf.files import OwnFolder, clean_name
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.record import fit_to_dict
from jointfrf.identification.result import Fit, FittedParameter
from jointfrf.kernel.arguments import ComplexArray, FloatArray, check_type
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law_joint import LawJoint
from jointfrf.workbench.report.axes import FREQUENCY, bulk_limits
from jointfrf.workbench.report.draw import draw, laid_out
from jointfrf.workbench.report.figure import Curve, Figure, Panel, Ribbon
from jointfrf.workbench.report.fit_frfs import compare_fit, frf_figures
from jointfrf.workbench.report.table import Cell, Table

__all__ = ["fit_figures", "fit_information", "plot", "shown_name", "write_fit"]


def fit_figures(fit: Fit) -> list[Figure]:
    """Return figures of the identified joint: K* and compliance of each DOF, line by line and as fitted.

    Parameters
    ----------
    fit : Fit
        Result of `identify`.

    Returns
    -------
    list of Figure
        ``"joint_<dof>"`` for each DOF that is not rigid.
    """
    up = np.argsort(fit.freq_hz, kind="stable")
    freq, n = fit.freq_hz[up], len(fit.dofs)
    lines = np.full((freq.size, n, n), np.nan + 0j) if fit.k_lines is None else fit.k_lines[up]
    fitted = _stiffness_found(fit, freq)
    with warnings.catch_warnings():
        # Displacements and rotations differ by orders of magnitude.
        warnings.simplefilter("ignore", IllConditionedWarning)
        compliance = (
            invert(fitted, on_singular="nan") if fit.laws is None else fit.laws.compliance(freq, on_singular="nan")
        )
        each_compliance = fit.data.line_compliance()[up] if isinstance(fit.data, FitData) else _inverted(lines)
    used = fit.data.fitted[up] if isinstance(fit.data, FitData) else np.ones(lines.shape[:2], np.bool_)
    figures = []
    for d, dof in enumerate(fit.dofs):
        if fit.laws is not None and dof in fit.laws.rigid:
            continue
        stiffness, own = Parameter.of_dof("k", dof), used[:, d]
        # A stiffness that cannot be distinguished from a rigid one is drawn by its lower bound.
        low, high = (0.0, 0.0) if fit.laws is not None else fit.confidence_interval(0.95)[stiffness.name]
        bound = Curve("lower bound of k, 95 %", freq[[0, -1]], np.full(2, low), "high") if low > 0 else None
        panels = []
        for name, unit, each, found, ribbons in (
            ("K*", stiffness.unit, lines[:, d, d], fitted[:, d, d], _intervals(fit, stiffness, freq)),
            ("C", compliance_unit(dof, dof), each_compliance[:, d], compliance[:, d, d], ((), ())),
        ):
            curves: list[Curve | None] = [Curve(f"fit ({fit.method})", freq, part, "actual")
                                          for part in (found.real, found.imag)]  # fmt: skip
            each = np.where(np.isfinite(each), each, complex(np.nan, np.nan))
            if name == "K*" and not np.isfinite(high):
                curves = [bound, None]
            panels += [
                _panel(f"Re {name}, {unit}", freq, each.real, own, curves[0], ribbons[0]),
                _panel(f"Im {name}, {unit}", freq, each.imag, own, curves[1], ribbons[1]),
            ]
        words = f"Joint DOF {dof}: complex stiffness K* and compliance C"
        figures.append(Figure(f"joint_{dof}", words, tuple(panels), 2, heading=words))
    return figures


def _inverted(k_lines: ComplexArray) -> ComplexArray:
    """Return the diagonal of the compliance of each line, shape (n_freq, n)."""
    if not np.isfinite(k_lines).any():
        return np.asarray(np.einsum("ldd->ld", k_lines))
    inverse = invert(np.where(np.isfinite(k_lines), k_lines, 0), on_singular="nan")
    return np.asarray(np.einsum("ldd->ld", inverse))


def _stiffness_found(fit: Fit, freq_hz: FloatArray) -> ComplexArray:
    """Return K*(w) of the fitted joint, shape (n_freq, n, n); NaN at rigid DOFs."""
    if fit.laws is None or not fit.laws.rigid:
        return fit.k_joint(freq_hz)
    k = np.full((freq_hz.size, len(fit.dofs), len(fit.dofs)), np.nan + 0j)
    at = [d for d, dof in enumerate(fit.dofs) if dof not in fit.laws.rigid]
    if at:
        moving = LawJoint(fit.laws.laws, (), None, [fit.dofs[d] for d in at])
        k[:, np.array(at)[:, None], at] = moving.dynamic_stiffness(freq_hz)
    return k


def _of_law(fit: Fit, dof: str, freq_hz: FloatArray) -> tuple[tuple[Ribbon, ...], tuple[Ribbon, ...]]:
    """Return confidence intervals of Re K* and Im K* of a law at each frequency, by the covariance of parameters."""
    assert fit.laws is not None
    law, names = fit.laws.laws[dof, dof], [one.name for one in fit.parameters]
    fields = enumerate(parameter_name(field.name, dof, dof) for field in law.fields)
    own = [(i, names.index(name)) for i, name in fields if name in names]
    if not own:
        return (), ()
    omega, at, ribbons = 2 * np.pi * freq_hz, [place for _, place in own], []
    slopes, middle = law.slopes(omega)[[i for i, _ in own]], law.stiffness(omega)
    for part, own_slopes, own_middle in (("Re", slopes.real, middle.real), ("Im", slopes.imag, middle.imag)):
        variance = np.einsum("pf,pq,qf->f", own_slopes, fit.covariance[np.ix_(at, at)], own_slopes)
        reach = float(ndtri(0.975)) * np.sqrt(np.maximum(variance, 0))
        ribbons.append(Ribbon(f"95 % interval of {part} K*", freq_hz, own_middle - reach, own_middle + reach, "low"))
    return (ribbons[0],), (ribbons[1],)


def _intervals(fit: Fit, stiffness: Parameter, freq_hz: FloatArray) -> tuple[tuple[Ribbon, ...], tuple[Ribbon, ...]]:
    """Return bounded intervals of a stiffness, and of the damping of its DOF if the damping is one term."""
    dof = stiffness.row
    if fit.laws is not None:
        return _of_law(fit, dof, freq_hz)
    found, ends = fit.confidence_interval(0.95), np.array([freq_hz.min(), freq_hz.max()])

    def ribbon(name: str, label: str, factor: FloatArray) -> tuple[Ribbon, ...]:
        low, high = found[name]
        if not (np.isfinite(low) and np.isfinite(high)):
            return ()
        return (Ribbon(f"95 % interval of {label}", ends, low * factor, high * factor, "low"),)

    damping = [
        (name, factor)
        for name, factor in (
            (parameter_name("h", dof, dof), np.ones(2)),
            (parameter_name("c", dof, dof), 2 * np.pi * ends),
        )
        if name in found and fit.value[name] != 0
    ]
    of_damping = ribbon(damping[0][0], "damping", damping[0][1]) if len(damping) == 1 else ()
    return ribbon(stiffness.name, "k", np.ones(2)), of_damping


def _panel(
    label: str, freq: FloatArray, each: FloatArray, used: NDArray[np.bool_], found: Curve | None,
    ribbons: tuple[Ribbon, ...],
) -> Panel:  # fmt: skip
    """Return a panel of one part of K* or C: each line alone, the fit of all lines, and its intervals."""
    is_known = np.isfinite(each[used]).any()
    curves = [Curve("each line", freq[used], each[used], "dots")] if is_known else []
    shown: list[float] = []
    if found is not None:
        curves.append(found)
        shown = [float(found.y.min()), float(found.y.max())] if np.isfinite(found.y).all() else []
    if not used.all():
        curves.append(Curve("lines left out", freq[~used], each[~used], "outlying"))
    if ribbons and not is_known:
        # Without single lines the axis fits the interval.
        shown += [float(end) for one in ribbons for end in (one.low.min(), one.high.max())]
        limits = bulk_limits([], shown, least_room=0.0)
    else:
        limits = bulk_limits([each], shown)
    return Panel("", FREQUENCY, label, tuple(curves), ribbons, y_limits=limits)


def write_fit(fits: Sequence[Fit], folder: Path, source: str, figures: Sequence[Figure] = ()) -> list[Path]:
    """Write ``identification.json``, and a PNG and an SVG file for each DOF of each fit, and return their paths.

    Parameters
    ----------
    fits : sequence of Fit
        Results on the same data. The names of figures of the second and later fits contain the method.
    folder : Path
        Folder of the files, made if it is missing.
    source : str
        Name of the measured file, for the JSON.
    figures : sequence of Figure
        Further figures, default none.

    Returns
    -------
    list of Path
        Written files, each whole or not at all.

    Raises
    ------
    MissingPackageError
        matplotlib is missing.
    OSError
        The files cannot be written.
    """
    text = json.dumps({"source": source, "fits": [fit_to_dict(fit, lines=False) for fit in fits]}, indent=2)
    contents: dict[str, str | bytes] = {"identification.json": text + "\n"}
    drawn = [
        (f"{one.key}_{fit.method}" if i else one.key, one) for i, fit in enumerate(fits) for one in fit_figures(fit)
    ]
    for stem, figure in [*drawn, *((one.key, one) for one in figures)]:
        contents[f"{stem}.png"], contents[f"{stem}.svg"] = draw(figure)
    own = OwnFolder(folder).make()
    return [own.write(clean_name(name), content) for name, content in contents.items()]


#: Number of parts of the band over which shares are summed, and least number of lines of a part.
_PARTS, _LEAST = 48, 4
#: Shares of the information below the frequencies in the table.
_QUANTILES = (0.1, 0.5, 0.9)
#: Styles and names of parameters of springs, by their kinds.
_STYLES = {"k": "ismm", "h": "stiffness", "c": "high"}
_LABELS = {"k": "stiffness k", "h": "hysteretic damping h", "c": "viscous damping c"}
#: Styles of other parameters of laws, in their order.
_OTHERS = ("stiffness", "high", "actual")


def shown_name(one: FittedParameter) -> Cell:
    """Return a parameter as a cell of a table."""
    is_spring = one.origin == "joint" and one.kind in get_args(ParameterKind)
    return Parameter(cast(ParameterKind, one.kind), one.row, one.column) if is_spring else one.name


def fit_information(fit: Fit) -> tuple[Figure | None, Table | None]:
    """Return the information on each parameter over frequency, for a fit of FRFs between all joint DOFs.

    Returns
    -------
    figure : Figure or None
        Share of each part of the band; None for few lines.
    table : Table or None
        Frequencies below which a tenth, half and nine tenths lie.
    """
    if not isinstance(fit.data, FitData):
        return None, None
    up = np.argsort(fit.freq_hz, kind="stable")
    freq_hz, shares = fit.freq_hz[up], fit.data.information()[up]
    total = np.cumsum(shares, axis=0)
    rows: list[tuple[Cell, ...]] = []
    for i, term in enumerate(fit.parameters):
        at = [min(int(np.searchsorted(total[:, i], q * total[-1, i])), freq_hz.size - 1) for q in _QUANTILES]
        rows.append((shown_name(term), *(float(freq_hz[a]) for a in at)))
    columns = ("parameter", *(f"{100 * q:.0f} % below, Hz" for q in _QUANTILES))
    note = "Eight tenths of what the data say of a parameter lie between the first and the last frequency."
    table = Table("information-table", "Where the information lies", columns, tuple(rows), note=note)
    return _information_figure(fit, freq_hz, shares), table


def _information_figure(fit: Fit, freq_hz: FloatArray, shares: FloatArray) -> Figure | None:
    """Return a figure of the information of each part of the band on each parameter, or None for few lines."""
    parts = min(_PARTS, freq_hz.size // _LEAST)
    if parts < 3 or freq_hz[-1] == freq_hz[0]:
        return None
    edges = np.linspace(freq_hz[0], freq_hz[-1], parts + 1)
    steps = np.repeat(edges, 2)[1:-1]
    at = np.clip(np.searchsorted(edges, freq_hz, side="right") - 1, 0, parts - 1)
    panels = []
    for dof in fit.dofs:
        terms = [(i, term) for i, term in enumerate(fit.parameters) if term.row == term.column == dof]
        if not terms:
            continue
        styles, curves = iter(_OTHERS * len(terms)), list[Curve]()
        for i, term in terms:
            share = 100 * np.bincount(at, shares[:, i], parts)
            style = _STYLES.get(term.kind) or next(styles)
            curves.append(Curve(_LABELS.get(term.kind, term.kind), steps, np.repeat(share, 2), style))
        panels.append(Panel(f"DOF {dof}", FREQUENCY, f"share of the band in {parts} parts, %", tuple(curves)))
    caption = "Information density: how much each part of the band says about each parameter"
    return Figure("information", caption, tuple(panels), 2 if len(panels) > 1 else 1)


#: Largest number of FRFs that are drawn, two in a row.
_FRFS = 4


def plot(fit: Fit) -> Any:
    """Draw the joint over frequency, K* and compliance of each DOF, and measured against regenerated FRFs.

    Parameters
    ----------
    fit : Fit
        Result of `identify` or `identify_model`. FRFs are drawn unless the fit was loaded from a file.

    Returns
    -------
    matplotlib.figure.Figure
        Figure, which ``jf.plot(fit).savefig("joint.png")`` writes.

    Raises
    ------
    MissingPackageError
        matplotlib is missing.

    See Also
    --------
    write_report : page of a fit.
    """
    check_type("fit", fit, Fit)
    panels: list[Panel] = []
    for figure in fit_figures(fit):
        dof = figure.key.removeprefix("joint_")
        titles = (f"DOF {dof}: joint stiffness", "", f"DOF {dof}: joint compliance", "")
        panels += [replace(panel, title=title) for panel, title in zip(figure.panels, titles, strict=True)]
    if fit.data is not None:
        frfs = frf_figures(compare_fit(fit), fit.freq_hz)[:_FRFS]
        for first in range(0, len(frfs), 2):
            beside = frfs[first : first + 2]
            for part in zip(*(figure.panels for figure in beside), strict=True):
                own = [
                    replace(panel, title=figure.caption if panel.log_y else "")
                    for panel, figure in zip(part, beside, strict=True)
                ]
                panels += [*own, *([Panel("", "", "")] * (2 - len(own)))]
    return laid_out(Figure("joint", "Joint found", tuple(panels), 2))
