"""A lap joint with a preloaded bolt of solid elements: measured, identified, and used again with another beam.

lap          the mesh of two beams and the bolt; the force of the preload
contact      unilateral contact with friction between pairs of nodes
preload      the tightened state, its contact pressure, the linear model about it
keys         the keys of its files, and the case as data
frfs         FRFs: of the preloaded solid model, of the beams by themselves; resonances of the tip
routes       from measured FRFs to K*(w) by several routes, and to constants by two estimators
compute      all of these, without noise and with it, for cases and for studies
results      tables, numbers and figures
"""

from jointfrf.workbench.cases.bolted_lap.compute import (
    BoltedLapResult,
    bolted_lap_result,
    estimate_groups,
    preloaded_frfs,
)
from jointfrf.workbench.cases.bolted_lap.frfs import SolidFrfs
from jointfrf.workbench.cases.bolted_lap.keys import BoltedLapCase, BoltedLapExpected, BoltedLapKeys, read_bolted_lap
from jointfrf.workbench.cases.bolted_lap.results import (
    build_figures,
    build_numbers,
    build_summary,
    build_tables,
)
from jointfrf.workbench.cases.bolted_lap.routes import ESTIMATORS
from jointfrf.workbench.cases.kind import CaseKind

__all__ = ["KIND"]

KIND: CaseKind[BoltedLapCase, SolidFrfs, BoltedLapResult] = CaseKind(
    keys=BoltedLapKeys,
    expected_keys=BoltedLapExpected,
    read=read_bolted_lap,
    frfs=preloaded_frfs,
    methods=tuple(ESTIMATORS),
    groups=estimate_groups,
    result=bolted_lap_result,
    tables=build_tables,
    figures=build_figures,
    summary=build_summary,
    numbers=build_numbers,
    headline=("lines-k",),
)
