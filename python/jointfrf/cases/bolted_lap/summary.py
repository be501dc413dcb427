"""What came out of a case of a bolted lap joint, in a few sentences."""

from __future__ import annotations

import numpy as np

from jointfrf.cases.bolted_lap.compute import BoltedLapResult
from jointfrf.cases.bolted_lap.tables import above_limit
from jointfrf.cases.comparison import agreement
from jointfrf.report.table import Table, number

__all__ = ["bolted_lap_summary"]


def bolted_lap_summary(result: BoltedLapResult, tables: list[Table]) -> list[str]:
    """Say in a few sentences what came out."""
    by_key = {table.key: table for table in tables}
    sentences = [_preload(result), *agreement(by_key["natural-frequencies"])]
    routes = dict.fromkeys(one.found[:2] for one in result.regenerated)
    for transferred, what in ((False, "Regenerated"), (True, "Transferred to the other beam B")):
        each = "; ".join(
            f"{route} ({estimator}) " + " / ".join(_worst(result, (route, estimator), d, transferred) for d in "yx")
            for route, estimator in routes
        )
        sentences.append(f"{what}: largest error of a resonance in y / x, percent: {each}.")
    return sentences


def _preload(result: BoltedLapResult) -> str:
    state = result.state
    slipping = sum(int(np.count_nonzero(one.slipping)) for one in state.interfaces.values())
    return (
        f"A preload of {number(state.force)} N stretches the bolt by {1e6 * state.elongation:.1f} um; the contact "
        f"converged in {len(state.history)} iterations, {slipping} pairs slip, the lap is closed up to "
        f"{1e3 * state.contact_radius:.1f} mm from the axis."
    )


def _worst(result: BoltedLapResult, named: tuple[str, str], direction: str, transferred: bool) -> str:
    """Write the largest error (4.12) of a resonance in a direction, percent."""
    peaks = result.transferred_peaks if transferred else result.peaks
    one = next(r for r in result.regenerated if r.found[:2] == named)
    errors = one.transferred_errors if transferred else one.errors
    own = [i for i, peak in enumerate(peaks) if peak.direction == direction]
    worst = max((float(errors.frequency[i]) for i in own), default=0.0)
    return number(worst, 2) if errors.found[own].all() else above_limit(worst)
