"""What an identification found, in sentences that can be quoted."""

from __future__ import annotations

from typing import cast, get_args

import numpy as np

from jointfrf.dofs import Parameter, ParameterKind, is_rotation
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.result import Fit, FittedParameter
from jointfrf.report.table import Cell, Table
from jointfrf.report.ticks import prefixed_unit

__all__ = ["finding_sentences", "parameter_table", "quality_sentences", "shown_name", "with_unit"]

#: A residual up to this many times the noise is called that of the noise.
_NOISE = 1.1
#: Significant digits of an uncertainty.
_DIGITS = 2
_PROBABILITY = 0.95


def with_unit(value: float, unit: str, uncertainty: float | None = None) -> str:
    """Write a value with its unit and prefix, to two digits of its uncertainty, four digits without one.

    Examples
    --------
    >>> from jointfrf.report.fit_words import with_unit
    >>> with_unit(9.9955e6, "N/m", 6.5e3), with_unit(4999.93, "N m/rad", 103.0), with_unit(0.9756, "N m s/rad", 0.04)
    ('9.9955 MN/m', '5000 N m/rad', '0.976 N m s/rad')
    """
    shown, size = prefixed_unit(unit, abs(value))
    return f"{_rounded(value / size, None if uncertainty is None else uncertainty / size)} {shown}"


def _rounded(value: float, uncertainty: float | None) -> str:
    if uncertainty is None or not np.isfinite(uncertainty) or uncertainty <= 0:
        return f"{value:.4g}"
    places = _DIGITS - 1 - int(np.floor(np.log10(uncertainty)))
    return f"{round(value, places):.{max(places, 0)}f}"


def shown_name(one: FittedParameter) -> Cell:
    """Return a parameter as a cell of a table."""
    is_spring = one.origin == "joint" and one.kind in get_args(ParameterKind)
    return Parameter(cast(ParameterKind, one.kind), one.row, one.column) if is_spring else one.name


def _named(term: FittedParameter) -> str:
    """Name a parameter of one DOF in words."""
    kind = {"k": "stiffness", "h": "hysteretic stiffness", "c": "viscous damping"}.get(term.kind)
    if kind is None:
        return f"parameter {term.kind} of {term.row}"
    axis = term.row.rpartition("_")[2].lstrip("r")
    if is_rotation(term.row) and axis in ("x", "y", "z"):
        return f"{'rotational ' if term.kind != 'c' else ''}{kind} about {axis}"
    return f"{kind} of {term.row}" if is_rotation(term.row) else f"{kind} along {term.row}"


def finding_sentences(fit: Fit) -> list[str]:
    """Return one sentence a parameter, its value and where it lies with 95 % probability; one for all cross terms."""
    intervals = fit.confidence_interval(_PROBABILITY)
    told = [] if fit.laws is None or not fit.laws.rigid else [f"Rigid: {', '.join(fit.laws.rigid)}."]
    for term, value in zip(fit.parameters, fit.value.values(), strict=True):
        if term.origin != "joint":
            continue
        low, high = intervals[term.name]
        name = _named(term)
        if not term.is_cross:
            told.append(f"{name[0].upper()}{name[1:]} ({term.name}): {_value_sentence(term, value, low, high)}")
    for name, eta in fit.loss_factors.items():
        of = FittedParameter(name, "", "eta", name.removeprefix("eta_"), name.removeprefix("eta_"))
        told.append(f"Loss factor of {of.row} ({name}): {_value_sentence(of, eta.value, eta.low, eta.high)}")
    rest = [term.name for term in fit.parameters if term.origin != "joint"]
    if rest:
        told.append(f"Fitted with it, values in the table: {', '.join(rest)}.")
    cross = [term.name for term in fit.parameters if term.is_cross and term.origin == "joint"]
    if cross:
        clear = [name for name in cross if not intervals[name][0] <= 0 <= intervals[name][1]]
        which = f"{len(clear)} of {len(cross)}: {', '.join(clear)}" if clear else f"none of {len(cross)}"
        told.append(f"Cross terms significantly different from zero (values in the table): {which}.")
    return told


def _value_sentence(term: FittedParameter, value: float, low: float, high: float) -> str:
    if term.kind == "k":
        if not np.isfinite(high):
            bound = f"at least {with_unit(low, term.unit)} (95 %)" if low > 0 else "the data give no bound"
            return f"cannot be distinguished from rigid; {bound}."
        if not low > 0:
            return f"cannot be distinguished from no joint; at most {with_unit(high, term.unit)} (95 %)."
    if not (np.isfinite(low) and np.isfinite(high)):
        return "not determined by the data."
    reach = (high - low) / 2
    shown, size = prefixed_unit(term.unit, abs(value))
    ends = " and ".join(_rounded(limit / size, reach / size) for limit in (low, high))
    share = f" (±{100 * reach / abs(value):.2g} %)" if abs(value) > reach else ""
    zero = "; not significantly different from zero" if low < 0 < high else ""
    return f"{_rounded(value / size, reach / size)} {shown}, with 95 % probability between {ends} {shown}{share}{zero}."


def quality_sentences(fit: Fit) -> list[str]:
    """Return sentences on noise and residual, and on lines that were left out."""
    told = []
    if np.isfinite(fit.noise_level) and fit.noise_level > 0:
        ratio = fit.residual_level / fit.noise_level
        explains, explain = ("joint explains", "joint as described does")
        if isinstance(fit.data, ModelData):
            explains, explain = ("models and the joint explain", "models and the joint as described do")
        verdict = (
            f"the {explains} the FRFs of the lines used to within their noise."
            if ratio < _NOISE
            else f"the {explain} not explain all that the FRFs show."
        )
        told.append(
            f"The noise of the FRFs is {100 * fit.noise_level:.2g} % (median); what the fit leaves unexplained is "
            f"{100 * fit.residual_level:.2g} %, {ratio:.2f} times the noise: {verdict}"
        )
    if isinstance(fit.data, FitData):
        out = np.count_nonzero(~fit.data.fitted, axis=0)
        total = len(fit.data.fitted)
        names = [f"{n} of {total} for {dof}" for dof, n in zip(fit.dofs, out, strict=True) if n]
        if names:
            told.append(
                f"Lines left out, outside the bands or because they do not fit the joint found: {', '.join(names)}."
            )
    if fit.warnings:
        told.append("Read the warnings below before quoting these numbers.")
    return told


def parameter_table(fit: Fit) -> Table:
    """Return the parameters with standard errors and intervals."""
    intervals, errors = fit.confidence_interval(_PROBABILITY), fit.std_error
    has_prior = any(one.prior for one in fit.parameters)
    rows: list[tuple[Cell, ...]] = []
    for term, value in zip(fit.parameters, fit.value.values(), strict=True):
        low, high = intervals[term.name]
        is_open = term.kind == "k" and not term.is_cross and not np.isfinite(high)
        ends: tuple[Cell, ...] = (low, "open") if is_open else (low, high)
        prior = "" if term.prior is None else f"{term.prior[0]:.4g} ± {term.prior[1]:.2g}"
        believed = (prior,) if has_prior else ()
        rows.append((shown_name(term), "open" if is_open else value, errors[term.name], *ends, *believed, term.unit))
    for name, eta in fit.loss_factors.items():
        rows.append((name, eta.value, eta.std_error, eta.low, eta.high, *([""] if has_prior else []), "1"))
    note = "K*(ω) = k + i h + i ω c, time convention exp(+iωt)"
    note += "; η = h/k" if fit.loss_factors else ""
    if any(term.origin == "joint" and term.kind not in get_args(ParameterKind) for term in fit.parameters):
        note = "Laws: docs/model-fit.md; time convention exp(+iωt)"
    prior_column = ("prior",) if has_prior else ()
    columns = ("parameter", "value", "standard error", "95 % from", "95 % to", *prior_column, "unit")
    return Table("parameters", "Parameters of the joint", columns, tuple(rows), note=note + ".")
