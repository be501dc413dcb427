"""The kind of case `bolted-lap`."""

from __future__ import annotations

from jointfrf.cases.bolted_lap.compute import BoltedLapResult, compute_bolted_lap
from jointfrf.cases.bolted_lap.figures import bolted_lap_figures
from jointfrf.cases.bolted_lap.keys import BOLTED_LAP_KEYS, EXPECTED_BOLTED_KEYS
from jointfrf.cases.bolted_lap.read import BoltedLapCase, read_bolted_lap
from jointfrf.cases.bolted_lap.studied import bolted_lap_studied
from jointfrf.cases.bolted_lap.summary import bolted_lap_summary
from jointfrf.cases.bolted_lap.tables import bolted_lap_numbers, bolted_lap_tables
from jointfrf.cases.kind import CaseKind

__all__ = ["BOLTED_LAP"]

BOLTED_LAP: CaseKind[BoltedLapCase, BoltedLapResult] = CaseKind(
    name="bolted-lap",
    read=read_bolted_lap,
    compute=compute_bolted_lap,
    tables=bolted_lap_tables,
    figures=bolted_lap_figures,
    summary=bolted_lap_summary,
    numbers=bolted_lap_numbers,
    studied=bolted_lap_studied,
    keys=BOLTED_LAP_KEYS,
    expected_keys=EXPECTED_BOLTED_KEYS,
)
