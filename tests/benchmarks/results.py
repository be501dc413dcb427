"""What was measured: one record a candidate and case, as JSON, and compared with an older run."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from .machine import Limits
from .measure import Timing

OURS, OUT, REFERENCE, NUMPY, LOOP = "jointfrf", "jointfrf, out=", "engine lapack", "numpy", "LAPACK loop"
_FORMAT = 1
#: A time may grow by this share, and by what repetitions differ, before it counts as slower.
_TOLERANCE = 0.10


@dataclass(frozen=True)
class Record:
    """One candidate in one case; times in ns a line; least operations, bytes and random numbers of a line."""

    operation: str
    data: str
    streaming: bool
    n: int
    lines: int
    candidate: str
    threads: int
    median: float
    least: float
    spread: float
    flops: float
    moved: float
    limit: float
    samples: tuple[float, ...]
    normals: float = 0.0

    @property
    def case(self) -> tuple[str, str, bool, int]:
        """What was computed, whoever did it."""
        return self.operation, self.data, self.streaming, self.n

    @property
    def percent(self) -> float:
        """Share of the limit that is reached, percent."""
        return 100 * self.limit / self.median


def record(
    case: tuple[str, str, bool, int],
    lines: int,
    candidate: str,
    limits: Limits,
    timing: Timing,
    flops: float,
    moved: float,
    normals: float,
) -> Record:
    """Return times of a call that does so many lines as ns a line, and the limit."""
    ns = tuple(round(1e9 * seconds / lines, 3) for seconds in timing.samples)
    median, limit = timing.median * 1e9 / lines, _limit(limits, flops, moved, normals, lines)
    times = (median, min(ns), timing.spread)
    return Record(*case, lines, candidate, limits.threads, *times, flops, moved, limit, ns, normals)


def with_limits(one: Record, limits: dict[int, Limits]) -> Record:
    """Return a record with the limit computed again."""
    return replace(one, limit=_limit(limits[one.threads], one.flops, one.moved, one.normals, one.lines))


def _limit(limits: Limits, flops: float, moved: float, normals: float, lines: int) -> float:
    return 1e9 * limits.seconds(flops, moved, moved * lines, normals)


@dataclass(frozen=True)
class Run:
    """All of one run: when, on what, the limits for each number of threads, the records."""

    date: str
    machine: dict[str, Any]
    limits: list[dict[str, Any]]
    records: list[Record]

    def find(self, case: tuple[str, str, bool, int], candidate: str, threads: int = 1) -> Record | None:
        """Return the record of a candidate, if there is one."""
        for one in self.records:
            if one.case == case and one.candidate == candidate and one.threads == threads:
                return one
        return None

    def ratio(self, ours: Record, candidate: str) -> float | None:
        """Return how many times longer another candidate takes, on the same number of threads if it can, else on one.

        It is the ratio of medians: the samples were taken in turn.
        """
        other = self.find(ours.case, candidate, ours.threads) or self.find(ours.case, candidate)
        return other.median / ours.median if other else None

    def least_ratio(self, ours: Record, candidate: str) -> float | None:
        """Return the ratio of the least times on one thread, which other programs disturb less than medians."""
        other = self.find(ours.case, candidate)
        return other.least / ours.least if other else None


def save(run: Run, path: Path) -> None:
    """Write a run as JSON."""
    path.write_text(json.dumps({"format": _FORMAT, **asdict(run)}, indent=1) + "\n")


def load(path: Path) -> Run:
    """Read a run."""
    content = json.loads(path.read_text())
    if content.pop("format", None) != _FORMAT:
        raise ValueError(f"{path} is not a result of this command")
    content["records"] = [Record(**{**one, "samples": tuple(one["samples"])}) for one in content["records"]]
    return Run(**content)


def slower(old: Run, new: Run) -> list[tuple[Record, Record]]:
    """Return the pairs, old and new, in which jointfrf became slower."""
    return [(a, b) for a, b in _pairs(old, new) if b.median > a.median * (1 + _allowed(a, b))]


def faster(old: Run, new: Run) -> list[tuple[Record, Record]]:
    """Return the pairs, old and new, in which jointfrf became faster."""
    return [(a, b) for a, b in _pairs(old, new) if a.median > b.median * (1 + _allowed(a, b))]


def _allowed(old: Record, new: Record) -> float:
    return max(_TOLERANCE, old.spread, new.spread)


def _pairs(old: Run, new: Run) -> Iterator[tuple[Record, Record]]:
    def ours(records: Iterable[Record]) -> dict[tuple[Any, ...], Record]:
        mine = (OURS, OUT)
        return {(*one.case, one.candidate, one.threads, one.lines): one for one in records if one.candidate in mine}

    before = ours(old.records)
    for key, one in ours(new.records).items():
        if key in before:
            yield before[key], one
