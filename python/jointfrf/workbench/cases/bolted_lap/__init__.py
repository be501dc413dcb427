"""A lap joint with a preloaded bolt of solid elements: measurement, identification, and transfer to another beam.

lap          mesh of two beams and the bolt, and the preload force
contact      unilateral contact with friction between pairs of nodes
preload      static state under preload, its contact pressure, and the linear model about it
keys         keys of the files, and the case as data
frfs         FRFs of the preloaded solid model and of the single beams, and resonances of the tip
routes       K*(w) from measured FRFs by several routes, and constants by two estimators
compute      results with and without noise, for cases and for studies
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
