"""The cases of a known joint in a short form, each computed once a run for all tests that look at it."""

from __future__ import annotations

import dataclasses

from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.known_joint import KIND
from jointfrf.workbench.cases.known_joint.compute import KnownJointResult
from jointfrf.workbench.cases.known_joint.exact import Exact
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.cases.known_joint.realisations import Identified, estimate_groups, identified_joints
from jointfrf.workbench.cases.run import begin_estimates, compute_case
from jointfrf.workbench.cases.workers import Workers
from jointfrf.workbench.report.draw import Drawing, draw
from jointfrf.workbench.report.figure import Figure

#: Every so many lines are left and so many realisations drawn. Tails are looked at where there are 120.
_SHORT = {
    "3.1-discrete": (1, 60),
    "3.2-fe-beams": (1, 120),
    "3.3-beams-1mm": (3, 60),
    "3.3.1-decoupling": (3, 60),
    "3.3.1a-two-translations": (3, 60),
    "4.3.1-six-dof": (4, 8),
    "4.3.2-six-dof-decoupling": (4, 4),
}
PLANE = list(_SHORT)[:5]
SOLID = list(_SHORT)[5:]


def compute_thinned(name: str) -> KnownJointResult:
    step, count = _SHORT[name]
    case = read_case(find_case(name))
    return compute_case(KIND, dataclasses.replace(case, freq_hz=case.freq_hz[::step]), count)


def estimate_realisations(case: KnownJointCase, exact: Exact, count: int) -> list[Identified]:
    """The joints that a run of the case identifies, without the rest of its results."""
    return identified_joints(case, begin_estimates(estimate_groups(case, exact, None), count, Workers())())


@dataclasses.dataclass(frozen=True)
class DrawSome:
    """Stands for `draw` in a case, in its processes too: draw the figures of these keys and leave the others empty."""

    keys: frozenset[str] = frozenset()

    def __call__(self, figure: Figure, png: bool = True) -> Drawing:
        return draw(figure, png) if figure.key in self.keys else Drawing(b"", b"<svg/>")
