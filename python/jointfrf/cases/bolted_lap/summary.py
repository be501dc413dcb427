"""What came out of a case of a bolted lap joint, in short tables."""

from __future__ import annotations

import numpy as np

from jointfrf.cases.bolted_lap.compute import BoltedLapResult
from jointfrf.cases.bolted_lap.tables import above_limit
from jointfrf.cases.comparison import agreement
from jointfrf.report.table import Cell, Table, number

__all__ = ["bolted_lap_summary"]


def bolted_lap_summary(result: BoltedLapResult, tables: list[Table]) -> list[Table]:
    """Return short tables: how much fits, the preload, and the largest errors of the resonances."""
    fits = agreement(tables)
    return [*([fits] if fits.rows else []), _preload(result), _worst_errors(result)]


def _preload(result: BoltedLapResult) -> Table:
    state = result.state
    slipping = sum(int(np.count_nonzero(one.slipping)) for one in state.interfaces.values())
    cells: tuple[tuple[Cell, ...], ...] = (
        ("preload", number(state.force), "N"),
        ("elongation of the bolt", f"{1e6 * state.elongation:.1f}", "µm"),
        ("iterations of the contact", str(len(state.history)), ""),
        ("slipping pairs", str(slipping), ""),
        ("lap closed up to this distance from the axis", f"{1e3 * state.contact_radius:.1f}", "mm"),
    )
    return Table("preload", "Preload", ("quantity", "value", "unit"), cells)


def _worst_errors(result: BoltedLapResult) -> Table:
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (*named, *(_worst(result, named, d, transferred) for transferred in (False, True) for d in "yx"))
        for named in dict.fromkeys(one.found[:2] for one in result.regenerated)
    )
    beams = (f"{beams}: {direction}, %" for beams in ("same beams", "other beam B") for direction in "yx")
    columns = ("joint DOFs by", "estimator", *beams)
    title = "Largest error (4.12) of a resonance of the tip"
    return Table("worst", title, columns, cells, percentages=columns)


def _worst(result: BoltedLapResult, named: tuple[str, str], direction: str, transferred: bool) -> str:
    """Write the largest error (4.12) of a resonance in a direction, percent."""
    peaks = result.transferred_peaks if transferred else result.peaks
    one = next(r for r in result.regenerated if r.found[:2] == named)
    errors = one.transferred_errors if transferred else one.errors
    own = [i for i, peak in enumerate(peaks) if peak.direction == direction]
    worst = max((float(errors.frequency[i]) for i in own), default=0.0)
    return number(worst, 2) if errors.found[own].all() else above_limit(worst)
