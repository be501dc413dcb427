"""Results of a fit and recommended measurements, as sentences and tables."""

from __future__ import annotations

from typing import get_args

import numpy as np

from jointfrf.dofs import ParameterKind, is_rotation, parameter_name, point_and_direction
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.model.next_channels import NextChannel
from jointfrf.identification.result import UNDETERMINED, Fit, FittedParameter, is_undetermined
from jointfrf.workbench.report.axes import prefixed_unit
from jointfrf.workbench.report.document import Part, Words
from jointfrf.workbench.report.fit import shown_name
from jointfrf.workbench.report.table import Cell, Table

__all__ = ["finding_sentences", "is_wide", "next_parts", "next_sentences", "parameter_table", "quality_sentences",
           "seen_table", "unknowns_table"]  # fmt: skip

#: Half width of an interval over the value above which it is wide: designers need a stiffness to 10 %.
_WIDE = 0.1
#: Change of an unknown in standard deviations of the prior above which it has moved, and ratio of its standard
#: deviation to the prior above which the FRFs contain little information on it.
_MOVED, _UNCHANGED = 1.0, 0.9
#: Largest number of named channels, and difference below which shares are equal.
_NAMED, _SAME = 3, 0.01
#: Residual over the noise up to which it counts as noise.
_NOISE = 1.1
#: Significant digits of an uncertainty.
_DIGITS = 2
#: Coverage probability of all intervals of the page.
_PROBABILITY = 0.95


def with_unit(value: float, unit: str, uncertainty: float | None = None) -> str:
    """Return a value with its unit and prefix, to two digits of its uncertainty, or to four digits without one.

    Examples
    --------
    >>> from jointfrf.workbench.report.fit_words import with_unit
    >>> with_unit(9.9955e6, "N/m", 6.5e3), with_unit(4999.93, "N m/rad", 103.0), with_unit(0.9756, "N m s/rad", 0.04)
    ('9.9955 MN/m', '5000 N m/rad', '0.976 N m s/rad')
    """
    shown, size = prefixed_unit(unit, abs(value))
    return f"{_rounded(value / size, None if uncertainty is None else uncertainty / size)} {shown}".rstrip()


def _rounded(value: float, uncertainty: float | None) -> str:
    if uncertainty is None or not np.isfinite(uncertainty) or uncertainty <= 0:
        return f"{value:.4g}"
    places = _DIGITS - 1 - int(np.floor(np.log10(uncertainty)))
    return f"{round(value, places):.{max(places, 0)}f}"


def _named(term: FittedParameter) -> str:
    """Return the name of a parameter of one DOF in words."""
    kind = {"k": "stiffness", "h": "hysteretic stiffness", "c": "viscous damping"}.get(term.kind)
    if kind is None:
        return f"parameter {term.kind} of {term.row}"
    point, direction = point_and_direction(term.row)
    axis, where = direction.rpartition("_")[2].lstrip("r"), f" at {point}" if point else ""
    if is_rotation(term.row) and axis in ("x", "y", "z"):
        return f"{'rotational ' if term.kind != 'c' else ''}{kind} about {axis}{where}"
    return f"{kind} {'of' if is_rotation(term.row) else 'along'} {direction}{where}"


def finding_sentences(fit: Fit) -> list[str]:
    """Return a sentence for each parameter with its value and 95 % interval, and one sentence for all cross terms."""
    intervals = fit.confidence_interval(_PROBABILITY)
    sentences = [] if fit.laws is None or not fit.laws.rigid else [f"Rigid: {', '.join(fit.laws.rigid)}."]
    for term, value in zip(fit.parameters, fit.value.values(), strict=True):
        if term.origin != "joint":
            continue
        low, high = intervals[term.name]
        name = _named(term)
        if not term.is_cross:
            sentences.append(f"{name[0].upper()}{name[1:]} ({term.name}): {_value_sentence(term, value, low, high)}")
    dof_of = {parameter_name("eta", dof, dof): dof for dof in fit.dofs}
    for name, eta in fit.loss_factors.items():
        of = FittedParameter(name, "", "eta", dof_of[name], dof_of[name])
        sentences.append(f"Loss factor of {of.row} ({name}): {_value_sentence(of, eta.value, eta.low, eta.high)}")
    rest = [term.name for term in fit.parameters if term.origin != "joint"]
    if rest:
        sentences.append(f"Fitted with it, values in the table: {', '.join(rest)}.")
    cross = [term.name for term in fit.parameters if term.is_cross and term.origin == "joint"]
    if cross:
        clear = [name for name in cross if not intervals[name][0] <= 0 <= intervals[name][1]]
        which = f"{len(clear)} of {len(cross)}: {', '.join(clear)}" if clear else f"none of {len(cross)}"
        sentences.append(f"Cross terms significantly different from zero (values in the table): {which}.")
    return sentences


def _value_sentence(term: FittedParameter, value: float, low: float, high: float) -> str:
    if term.kind == "k":
        if not np.isfinite(high):
            if not low > 0:
                return "cannot be distinguished from rigid; the data give no bound."
            bound, best = with_unit(low, term.unit), with_unit(float(f"{value:.2g}"), term.unit)
            return f"cannot be distinguished from rigid; at least {bound} (95 %), best estimate {best}."
        if not low > 0:
            return f"not significantly different from zero, a free DOF; at most {with_unit(high, term.unit)} (95 %)."
    if not (np.isfinite(low) and np.isfinite(high)):
        return "not determined by the data."
    reach = (high - low) / 2
    shown, size = prefixed_unit(term.unit, abs(value))
    ends = " and ".join(_rounded(limit / size, reach / size) for limit in (low, high))
    share = f" (±{100 * reach / abs(value):.2g} %)" if abs(value) > reach else ""
    zero = "; not significantly different from zero" if low < 0 < high else ""
    unit = f" {shown}" if shown else ""
    return f"{_rounded(value / size, reach / size)}{unit}, with 95 % probability between {ends}{unit}{share}{zero}."


def quality_sentences(fit: Fit, of_channels: float = np.nan) -> list[str]:
    """Return sentences on noise, residual and excluded lines.

    Parameters
    ----------
    fit : Fit
        Result of `identify` or `identify_model`.
    of_channels : float
        Residual between the channels over the noise, root mean square over all lines of the band and all FRFs.
    """
    sentences = []
    if np.isfinite(fit.noise_level) and fit.noise_level > 0:
        of_fitted = fit.residual_level / fit.noise_level
        whole = of_fitted if fit.test is None else max(of_fitted, fit.test.whole)
        ratio = float(np.nanmax([whole, of_channels]))
        explains, explain = ("joint explains", "joint as described does")
        if isinstance(fit.data, ModelData):
            explains, explain = ("models and the joint explain", "models and the joint as described do")
        verdict = (
            f"the {explains} the FRFs to within their noise."
            if ratio < _NOISE
            else f"the {explain} not explain all that the FRFs show."
        )
        sentences.append(
            f"The noise of the FRFs is {100 * fit.noise_level:.2g} % (median); what the fit leaves unexplained is "
            f"{100 * fit.residual_level:.2g} %, {of_fitted:.3g} times the noise"
            f"{_elsewhere(of_fitted, whole, of_channels)}: {verdict}"
        )
    if isinstance(fit.data, FitData):
        out = np.count_nonzero(~fit.data.fitted, axis=0)
        total = len(fit.data.fitted)
        names = [f"{n} of {total} for {dof}" for dof, n in zip(fit.dofs, out, strict=True) if n]
        if names:
            sentences.append(
                f"Lines left out, outside the bands or because they do not fit the joint found: {', '.join(names)}."
            )
    if fit.warnings:
        sentences.append("Read the warnings below before quoting these numbers.")
    return sentences


def _elsewhere(of_fitted: float, whole: float, of_channels: float) -> str:
    """Return a sentence on larger residuals of all lines or of the channels."""
    found = ""
    if whole > _NOISE * of_fitted:
        found += f"; with the lines left out it is {whole:.3g} times the noise"
    if of_channels > _NOISE * max(whole, 1):
        found += f"; between single channels, whose sides are taken as rigid, {of_channels:.3g} times (map below)"
    return found


def parameter_table(fit: Fit) -> Table:
    """Return the parameters with standard errors and intervals."""
    intervals, errors = fit.confidence_interval(_PROBABILITY), fit.std_error
    has_prior = any(one.prior for one in fit.parameters)
    rows: list[tuple[Cell, ...]] = []
    for term, value in zip(fit.parameters, fit.value.values(), strict=True):
        low, high = intervals[term.name]
        is_open = not (np.isfinite(low) and np.isfinite(high))
        ends: tuple[Cell, ...] = tuple(limit if np.isfinite(limit) else "open" for limit in (low, high))
        error: Cell = "" if is_open else errors[term.name]
        shown: Cell = f"about {value:.2g}" if is_open else value
        if is_undetermined(low, high):
            shown, ends = UNDETERMINED, ("", "")
        prior = "" if term.prior is None else f"{term.prior[0]:.4g} ± {term.prior[1]:.2g}"
        believed = (prior,) if has_prior else ()
        rows.append((shown_name(term), shown, error, *ends, *believed, term.unit))
    for name, eta in fit.loss_factors.items():
        known: tuple[Cell, ...] = (eta.value, eta.std_error, eta.low, eta.high)
        shown_eta = (UNDETERMINED, "", "", "") if is_undetermined(eta.low, eta.high) else known
        rows.append((name, *shown_eta, *([""] if has_prior else []), "1"))
    note = "K*(ω) = k + i h + i ω c, time convention exp(+iωt)"
    note += "; η = h/k" if fit.loss_factors else ""
    if any(term.origin == "joint" and term.kind not in get_args(ParameterKind) for term in fit.parameters):
        note = "Laws: docs/model-fit.md; time convention exp(+iωt)"
    prior_column = ("prior",) if has_prior else ()
    columns = ("parameter", "value", "standard error", "95 % from", "95 % to", *prior_column, "unit")
    if fit.seen:
        note += "; of the joint alone, without what its sides give way"
    return Table("parameters", "Parameters of the joint", columns, tuple(rows), note=note + ".")


def seen_table(fit: Fit) -> Table:
    """Return the stiffness between virtual points, and the contributions to the interval of the joint alone."""
    rows: list[tuple[Cell, ...]] = []
    for term in fit.parameters:
        one = fit.seen.get(term.name)
        if one is not None:
            ends = (limit if np.isfinite(limit) else "open" for limit in (one.value, one.low, one.high))
            shares = (f"{100 * share:.0f} %" for share in (one.sides, one.inertia, one.noise))
            rows.append((shown_name(term), *ends, term.unit, *shares))
    columns = ("parameter", "as seen", "95 % from", "95 % to", "unit", "width by sides", "by inertia", "by noise")
    note = (
        "Static stiffness of the joint and its sides together, and shares of sides, inertia and noise in the squared "
        "width of the interval of the joint alone."
    )
    return Table("seen", "Stiffness as seen between the virtual points", columns, tuple(rows), note=note)


def unknowns_table(fit: Fit) -> Table | None:
    """Return a table of unknowns with a prior outside the joint, before and after the fit, or None without any."""
    errors, rows = fit.std_error, list[tuple[Cell, ...]]()
    for one in fit.parameters:
        if one.origin == "joint" or one.prior is None:
            continue
        moved, left = (fit.value[one.name] - one.prior[0]) / one.prior[1], errors[one.name] / one.prior[1]
        says = "known from the prior only" if left > _UNCHANGED else "moved" if abs(moved) > _MOVED else "confirmed"
        prior = f"{one.prior[0]:.4g} ± {one.prior[1]:.2g}"
        found = f"{fit.value[one.name]:.5g} ± {errors[one.name]:.2g}"
        rows.append((one.name, one.unit, prior, found, f"{moved:+.2f}", f"{100 * left:.3g} %", says))
    if not rows:
        return None
    note = "Standard deviations; moved: in those of the prior; left: what the FRFs leave of the prior's."
    columns = ("unknown", "unit", "prior", "found", "moved", "left", "the FRFs")
    return Table("unknowns", "Unknowns of the models, before and after", columns, tuple(rows), note=note)


def is_wide(fit: Fit) -> bool:
    """Whether a parameter of the joint has a wide interval."""
    intervals = fit.confidence_interval(0.95)
    return any(
        not intervals[one.name][1] - intervals[one.name][0] < 2 * _WIDE * abs(fit.value[one.name])
        for one in fit.parameters
        if one.origin == "joint"
    )


def next_sentences(fit: Fit) -> list[str]:
    """Return recommended measurements for wide intervals of the joint; empty if no interval is wide."""
    data = fit.data
    if not isinstance(data, ModelData) or not is_wide(fit):
        return []
    found = data.next_channels()
    if not found:
        return ["No other translation of the models would narrow the widest interval by a tenth; less noise would."]
    sentences = []
    of_dof: dict[str, list[NextChannel]] = {}
    for one in found:
        of_dof.setdefault(one.dof, []).append(one)
    for dof, (one, *others) in list(of_dof.items())[:_NAMED]:
        # FRFs of one drive point are reciprocal: a sensor or a force there gives the same information.
        is_either = bool(others) and all(
            abs(others[0].shares[key] - share) < _SAME for key, share in one.shares.items()
        )
        what = "a response or a force" if is_either else f"a {one.kind}"
        others_of = {name: share for name, share in one.shares.items() if name != one.widest}
        text = f"{100 * one.shares[one.widest]:.2g} % of that of {one.widest}"
        if others_of:
            best = min(others_of, key=others_of.__getitem__)
            text += f" and {100 * others_of[best]:.2g} % of that of {best}"
        sentences.append(f"Measure {what} at {dof}: of the standard errors, it would leave {text}.")
    return sentences


def next_parts(fit: Fit) -> list[Part]:
    """Return the parts of the page with recommended measurements."""
    sentences = next_sentences(fit)
    if not sentences:
        return []
    how = "Each by itself, with lines and relative noise of this test, as the models and the joint found predict it."
    return [Words(sentences), Words([how], "notes")]
