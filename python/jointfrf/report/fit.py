"""Files of one identification: parameters as JSON, figures of the joint over frequency."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from jointfrf.dofs import Parameter, compliance_unit
from jointfrf.errors import IllConditionedWarning
from jointfrf.files import below, write_file
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.record import fit_to_dict
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law_joint import LawJoint
from jointfrf.report.axes import FREQUENCY, bulk_limits
from jointfrf.report.draw import draw
from jointfrf.report.figure import Curve, Figure, Panel, Ribbon

__all__ = ["fit_figures", "write_fit"]


def fit_figures(fit: Fit) -> list[Figure]:
    """Figures of the identified joint: K* and compliance of each DOF, line by line and as fitted.

    Parameters
    ----------
    fit : Fit
        What `identify` found.

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
        stiffness = Parameter.of_dof("k", dof)
        panels = []
        for label, each, curve, ribbons in (
            (f"K*, {stiffness.unit}", lines[:, d, d], fitted, _interval(fit, stiffness, freq)),
            (f"C, {compliance_unit(dof, dof)}", each_compliance[:, d], compliance, ()),
        ):
            own = _EntryLines(fit.method, label, freq, each, curve[:, d, d], used[:, d], ribbons)
            panels += _panels(own if label.startswith("C") else _as_open(own, fit, stiffness))
        words = f"Joint DOF {dof}: complex stiffness K* and compliance C"
        figures.append(Figure(f"joint_{dof}", words, tuple(panels), 2, heading=words))
    return figures


def _inverted(k_lines: ComplexArray) -> ComplexArray:
    """Return the diagonal of the compliance of each line, shape (n_freq, n)."""
    if not np.isfinite(k_lines).any():
        return np.asarray(np.einsum("ldd->ld", k_lines))
    inverse = invert(np.where(np.isfinite(k_lines), k_lines, 0), on_singular="nan")
    return np.asarray(np.einsum("ldd->ld", inverse))


class _EntryLines(NamedTuple):
    """One entry of K* or C: values of each line by itself, as fitted, which lines were used, interval or bound."""

    method: str
    label: str
    freq_hz: FloatArray
    each: ComplexArray
    fitted: ComplexArray
    used: NDArray[np.bool_]
    interval: tuple[Ribbon, ...] = ()
    bound: float | None = None


def _stiffness_found(fit: Fit, freq_hz: FloatArray) -> ComplexArray:
    """Return K*(w) of the joint found, shape (n_freq, n, n); NaN at rigid DOFs."""
    if fit.laws is None or not fit.laws.rigid:
        return fit.k_joint(freq_hz)
    k = np.full((freq_hz.size, len(fit.dofs), len(fit.dofs)), np.nan + 0j)
    at = [d for d, dof in enumerate(fit.dofs) if dof not in fit.laws.rigid]
    if at:
        moving = LawJoint(fit.laws.laws, (), None, [fit.dofs[d] for d in at])
        k[:, np.array(at)[:, None], at] = moving.dynamic_stiffness(freq_hz)
    return k


def _of_law(fit: Fit, dof: str, freq_hz: FloatArray) -> tuple[Ribbon, ...]:
    """Confidence interval of Re K* of a law at each frequency, from the covariance of its parameters."""
    assert fit.laws is not None
    law, names = fit.laws.laws[dof, dof], [one.name for one in fit.parameters]
    own = [(i, names.index(f"{one.name}_{dof}")) for i, one in enumerate(law.fields) if f"{one.name}_{dof}" in names]
    if not own:
        return ()
    slopes = law.slopes(2 * np.pi * freq_hz)[[i for i, _ in own]].real
    at = [place for _, place in own]
    error = np.sqrt(np.maximum(np.einsum("pf,pq,qf->f", slopes, fit.covariance[np.ix_(at, at)], slopes), 0))
    middle, reach = law.stiffness(2 * np.pi * freq_hz).real, float(ndtri(0.975))
    return (Ribbon("95 % interval of Re K*", freq_hz, middle - reach * error, middle + reach * error, "low"),)


def _interval(fit: Fit, stiffness: Parameter, freq_hz: FloatArray) -> tuple[Ribbon, ...]:
    """Confidence interval of a stiffness, where it is not open."""
    if fit.laws is not None:
        return _of_law(fit, stiffness.row, freq_hz)
    low, high = fit.confidence_interval(0.95)[stiffness.name]
    if not (np.isfinite(low) and np.isfinite(high)):
        return ()
    ends = np.array([fit.freq_hz.min(), fit.freq_hz.max()])
    return (Ribbon("95 % interval of k", ends, np.full(2, low), np.full(2, high), "low"),)


def _as_open(lines: _EntryLines, fit: Fit, stiffness: Parameter) -> _EntryLines:
    """Put the lower bound in place of a stiffness that cannot be distinguished from a rigid one."""
    if fit.laws is not None:
        return lines
    low, high = fit.confidence_interval(0.95)[stiffness.name]
    return lines if np.isfinite(high) else lines._replace(bound=max(low, 0.0))


def _panels(lines: _EntryLines) -> list[Panel]:
    """Real and imaginary part of one entry; interval and bound belong to the real part."""
    panels = []
    used, out = lines.used, ~lines.used
    for part, values, curve in (
        ("Re", lines.each.real, lines.fitted.real),
        ("Im", lines.each.imag, lines.fitted.imag),
    ):
        is_known = np.isfinite(lines.each[used]).any()
        curves = [Curve("each line", lines.freq_hz[used], values[used], "dots")] if is_known else []
        shown: list[float] = []
        if lines.bound is None:
            curves.append(Curve(f"fit ({lines.method})", lines.freq_hz, curve, "actual"))
            shown = [float(curve.min()), float(curve.max())] if np.isfinite(curve).all() else []
        elif part == "Re" and lines.bound > 0:
            ends = lines.freq_hz[[0, -1]]
            curves.append(Curve("lower bound of k, 95 %", ends, np.full(2, lines.bound), "high"))
            shown = [lines.bound]
        if out.any():
            curves.append(Curve("lines left out", lines.freq_hz[out], values[out], "outlying"))
        ribbons = lines.interval if part == "Re" else ()
        limits = bulk_limits([values], shown)
        panels.append(Panel("", FREQUENCY, f"{part} {lines.label}", tuple(curves), ribbons, y_limits=limits))
    return panels


def write_fit(fits: Sequence[Fit], folder: Path, source: str, figures: Sequence[Figure] = ()) -> list[Path]:
    """Write ``identification.json`` and a PNG and an SVG file a DOF for each fit; nothing is left half-written.

    Parameters
    ----------
    fits : sequence of Fit
        Results on the same data; the figures of the second and later ones carry their method in the name.
    folder : Path
        Made if it is missing.
    source : str
        Name of the file that was measured, written into the JSON.
    figures : sequence of Figure
        Drawn beside those of the fits.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    MissingPackageError
        matplotlib is missing.
    OSError
        The files cannot be written.
    """
    text = json.dumps({"source": source, "fits": [fit_to_dict(fit, lines=False) for fit in fits]}, indent=2)
    contents: dict[str, str | bytes] = {"identification.json": text + "\n"}
    for i, fit in enumerate(fits):
        for figure in fit_figures(fit):
            stem = figure.key if i == 0 else f"{figure.key}_{fit.method}"
            contents[f"{stem}.png"], contents[f"{stem}.svg"] = draw(figure)
    for figure in figures:
        contents[f"{figure.key}.png"], contents[f"{figure.key}.svg"] = draw(figure)
    folder.mkdir(parents=True, exist_ok=True)
    written = {below(folder, file): content for file, content in contents.items()}
    for path, content in written.items():
        write_file(path, content)
    return list(written)
