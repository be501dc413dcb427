"""Exponential windows: their effect on a joint, and signs of a window that was not stated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import parameter_name
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.manifold.fit import MARGIN
from jointfrf.identification.profile import Intervals
from jointfrf.identification.result import Fit, SeenStiffness
from jointfrf.kernel.arguments import FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["unstated_window", "without_window"]

#: Number of lines from which on the two terms and their scatter are compared.
_LEAST_LINES = 10


def without_window(fit: Fit, decay: float) -> Fit:
    """Return the fit of springs and dampers to FRFs of responses and forces that were weighted by exp(-decay t).

    Parameters
    ----------
    fit : Fit
        Fit of springs and dampers, with its likelihood.
    decay : float
        Decay rate of the window, 1/s.

    Notes
    -----
    The window shifts the frequency of a linear structure: the FRFs are taken at s = i w + decay. The fit of
    K* = k + s c then gives a stiffness k + decay c, and c. For a stiffness between virtual points, c is multiplied by
    the square of its share in the stiffness of the joint alone.
    """
    place = {(one.kind, one.row, one.column): i for i, one in enumerate(fit.parameters)}
    back = np.eye(len(fit.parameters))
    for (kind, row, column), i in place.items():
        damper = place.get(("c", row, column))
        if kind == "k" and damper is not None:
            back[i, damper] = -decay
    estimate = back @ fit.estimate
    covariance = back @ fit.covariance @ back.T
    moved = fit.estimate - estimate
    own = fit.intervals
    assert isinstance(own, Intervals)
    k_lines = fit.k_lines
    if k_lines is not None:
        damping: FloatArray = fit.damping_matrix
        k_lines = k_lines - decay * damping
    shown = tuple(
        f"{one.name} by {value:.3g} {one.unit}" for one, value in zip(fit.parameters, moved, strict=True) if value
    )
    removed = Finding("window-removed", {"decay": decay, "shown": shown or "no stiffness"})
    return replace(
        fit, estimate=estimate, covariance=covariance, k_lines=k_lines,
        intervals=_intervals(own, fit.covariance, covariance, back, moved),
        seen={name: _moved(one, _shift_between_points(fit, name, one, moved)) for name, one in fit.seen.items()},
        findings=(*fit.findings, removed),
    )  # fmt: skip


def _intervals(own: Intervals, before: FloatArray, after: FloatArray, back: FloatArray, moved: FloatArray) -> Intervals:
    """Return the intervals of parameters that are `back` times others; from their variances without a profile."""

    def limits(i: int, probability: float) -> tuple[float, float]:
        used = np.flatnonzero(back[i])
        low, high = own.of(own.names[i], probability)
        if used.size > 1 and np.isfinite([low, high]).all():
            both = own.of_function(lambda values: float(back[i] @ values), used, probability)
            if both is not None and np.isfinite(both).all():
                return both
            middle, wider = (low + high) / 2, float(np.sqrt(after[i, i] / before[i, i]))
            low, high = middle + (low - middle) * wider, middle + (high - middle) * wider
        return low - float(moved[i]), high - float(moved[i])

    def of_function(
        function: Callable[[FloatArray], float], used: NDArray[np.intp], probability: float
    ) -> tuple[float, float] | None:
        on = np.flatnonzero(back[used].any(axis=0))
        return own.of_function(lambda values: function(back @ values), on, probability)

    return Intervals(own.names, limits, of_function)


def _shift_between_points(fit: Fit, name: str, one: SeenStiffness, moved: FloatArray) -> float:
    """Return the shift by the window of a stiffness between virtual points."""
    place = [each.name for each in fit.parameters].index(name)
    share = one.value / float(fit.estimate[place])
    return float(moved[place]) * share**2 if np.isfinite(share) else 0.0


def _moved(one: SeenStiffness, shift: float) -> SeenStiffness:
    return replace(one, value=one.value - shift, low=one.low - shift, high=one.high - shift)


def unstated_window(fit: Fit) -> list[Finding]:
    """Return a finding if an exponential window would explain hysteretic damping that falls like 1/w.

    Notes
    -----
    Under a window exp(-sigma t) an accelerance is s^2 times the receptance at s = i w + sigma. Divided by (i w)^2
    instead of s^2 it gives K* (i w / s)^2, about k (1 + 2 i sigma / w); a mobility gives half of this. Im K* of the
    lines, weighted by their information on h, is fitted as h + w c and as b / w + w c. Both have two terms: n lines
    prefer the second by a Bayesian information criterion that is lower by n ln(squares / squares).
    """
    names, omega, found = [one.name for one in fit.parameters], 2 * np.pi * fit.freq_hz, []
    dampers = [(d, dof) for d, dof in enumerate(fit.dofs) if parameter_name("h", dof, dof) in names]
    if not dampers or not isinstance(fit.data, FitData):
        return []
    compliance, information = fit.data.line_compliance(), fit.data.information()
    if information.shape[1] != len(names):  # points that share their parameters
        return []
    for d, dof in dampers:
        share = information[:, names.index(parameter_name("h", dof, dof))]
        k = fit.value.get(parameter_name("k", dof, dof), 0.0)
        used = fit.data.fitted[:, d] & np.isfinite(compliance[:, d]) & (compliance[:, d] != 0) & (share > 0)
        if not 0 < k < np.inf or np.count_nonzero(used) < _LEAST_LINES:
            continue
        y, weight = (1 / compliance[used, d]).imag, np.sqrt(share[used])
        constant, falling = (_squares(y, weight, omega[used], power) for power in (0, -1))
        gain = y.size * np.log(constant[0] / max(falling[0], np.finfo(float).tiny))
        if gain > MARGIN and falling[1] > 0:
            found.append((dof, falling[1] / k))
    if not found:
        return []
    sigma = float(np.median([ratio for _, ratio in found]))
    dofs = tuple(dof for dof, _ in found)
    numbers = {"dofs": dofs, "of_accelerances": sigma / 2, "of_mobilities": sigma}
    return [Finding("window-not-stated", numbers, tuple(parameter_name("h", dof, dof) for dof in dofs))]


def _squares(y: FloatArray, weight: FloatArray, omega: FloatArray, power: int) -> tuple[float, float]:
    """Return the least squares of y = a w^power + w c, and a."""
    terms = np.column_stack([omega**power, omega]) * weight[:, None]
    size = np.maximum(np.linalg.norm(terms, axis=0), np.finfo(float).tiny)
    at = np.linalg.lstsq(terms / size, y * weight, rcond=None)[0]
    return float(((y * weight - terms / size @ at) ** 2).sum()), float(at[0] / size[0])
