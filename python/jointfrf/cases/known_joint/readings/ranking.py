"""Which reading explains most: of one printed table, and of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from jointfrf.cases.known_joint.readings.reading import Reading
from jointfrf.cases.known_joint.readings.study import Explained

__all__ = ["Total", "best_by_choice", "by_table", "totals"]


@dataclass(frozen=True)
class Total:
    """What one reading explains of all printed tables, with one spacing of the lines.

    Attributes
    ----------
    reading : Reading
    spacing : float
        Hz; of all structures but those with a spacing of their own.
    share : float
        Level as a share of the printed one.
    parts : tuple of Explained
        One for each printed table: where it can be computed in several ways, the one of the largest density.
    """

    reading: Reading
    spacing: float
    share: float
    parts: tuple[Explained, ...]

    @property
    def inside(self) -> int:
        """Printed values inside the central 95 %."""
        return sum(part.inside for part in self.parts)

    @property
    def count(self) -> int:
        """Printed values."""
        return sum(len(part.scores) for part in self.parts)

    @property
    def log_density(self) -> float:
        """Sum over the printed values."""
        return sum(part.log_density for part in self.parts)


def totals(explained: Sequence[Explained], spacings: Sequence[float]) -> list[Total]:
    """Add up over all printed tables, the largest log density first.

    Parameters
    ----------
    explained : sequence of Explained
        Of all structures.
    spacings : sequence of float
        Hz.

    Returns
    -------
    list of Total
    """
    found: dict[tuple[Reading, float, float], dict[object, Explained]] = {}
    for one in explained:
        for spacing in spacings if one.own_spacing else (one.spacing,):
            parts = found.setdefault((one.reading, spacing, one.share), {})
            before = parts.get(one.table.content)
            if before is None or one.log_density > before.log_density:
                parts[one.table.content] = one
    every = [Total(reading, spacing, share, tuple(own.values())) for (reading, spacing, share), own in found.items()]
    return sorted(every, key=lambda total: -total.log_density)


def by_table(explained: Sequence[Explained]) -> dict[str, list[Explained]]:
    """Sort by printed table, the largest log density first; readings that are the same one there stand once.

    Parameters
    ----------
    explained : sequence of Explained

    Returns
    -------
    dict of str to list of Explained
        Source, with the level of the noise and the number of values.
    """
    found: dict[str, dict[tuple[object, ...], Explained]] = {}
    for one in explained:
        same = (one.table.way, one.spacing, one.share, one.scores)
        name = f"{one.table.source}, {100 * one.table.level:g} %, {len(one.scores)} values"
        found.setdefault(name, {}).setdefault(same, one)
    return {name: sorted(own.values(), key=lambda one: -one.log_density) for name, own in found.items()}


def best_by_choice(every: Sequence[Total]) -> list[tuple[str, str, Total]]:
    """Find the best reading with each single choice held: question, choice, best.

    Parameters
    ----------
    every : sequence of Total
        Sorted, as `totals` returns them.

    Returns
    -------
    list of (str, str, Total)
    """
    found: dict[tuple[str, str], Total] = {}
    for total in every:
        reading = total.reading
        for question, choice in (
            ("number", f"{reading.parts} {reading.law}, {reading.level_means}"),
            ("common to", reading.sharing),
            ("reciprocal", "yes" if reading.reciprocal else "no"),
            ("relative to", reading.reference),
            ("lines, Hz", f"{total.spacing:g}"),
            ("level, share of the printed one", f"{total.share:g}"),
        ):
            found.setdefault((question, choice), total)
    order = list(dict.fromkeys(question for question, _ in found))
    return [(*key, total) for key, total in sorted(found.items(), key=lambda item: order.index(item[0][0]))]
