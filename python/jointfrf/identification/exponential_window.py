"""Springs and dampers seen through an exponential window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.findings import note
from jointfrf.identification.profile import Intervals
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import FloatArray

__all__ = ["without_window"]


def without_window(fit: Fit, decay: float) -> Fit:
    """Return the fit of springs and dampers to FRFs of responses and forces that were weighted by exp(-decay t).

    Parameters
    ----------
    fit : Fit
        Of springs and dampers, with its likelihood.
    decay : float
        1/s.

    Notes
    -----
    Of a linear structure the window shifts the frequency: FRFs are those at i w + decay. K* = k + (i w + decay) c is
    then fitted as a stiffness k + decay c, and as c.
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
    seen = fit.intervals
    assert isinstance(seen, Intervals)

    def limits(i: int, probability: float) -> tuple[float, float]:
        used = np.flatnonzero(back[i])
        own = seen.of(seen.names[i], probability)
        if used.size > 1 and np.isfinite(own).all():
            both = seen.of_function(lambda values: float(back[i] @ values), used, probability)
            if both is not None and np.isfinite(both).all():
                return both
        return own[0] - float(moved[i]), own[1] - float(moved[i])

    def of_function(
        function: Callable[[FloatArray], float], used: NDArray[np.intp], probability: float
    ) -> tuple[float, float] | None:
        on = np.flatnonzero(back[used].any(axis=0))
        return seen.of_function(lambda values: function(back @ values), on, probability)

    k_lines = fit.k_lines
    if k_lines is not None:
        damping: FloatArray = fit.damping_matrix
        k_lines = k_lines - decay * damping
    shown = ", ".join(
        f"{one.name} by {value:.3g} {one.unit}" for one, value in zip(fit.parameters, moved, strict=True) if value
    )
    text = (
        f"an exponential window, exp(-{decay:g} t), adds {decay:g} /s times c to k: taken off {shown or 'no stiffness'}"
    )
    return replace(
        fit, estimate=estimate, covariance=covariance, k_lines=k_lines,
        intervals=Intervals(seen.names, limits, of_function), findings=(*fit.findings, note("window", text)),
    )  # fmt: skip
