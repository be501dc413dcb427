"""Which realisations are computed together: chunks of about the same time, as measured while the study runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import NamedTuple

from jointfrf.cases.kind import Estimates, RealisationSource, StudiedGroup
from jointfrf.parallel.processes import one_thread
from jointfrf.studies.store import Span

__all__ = ["Chunk", "ChunkResult", "Schedule", "compute_chunk"]

#: Seconds that a chunk is to take: what a killed worker costs, and long against sending it.
_CHUNK_SECONDS = 2.0
#: Chunks for each worker at least, so that all end together.
_SHARES = 4


@dataclass(frozen=True)
class Chunk:
    """Some realisations of one group."""

    group: int
    first: int
    count: int
    source: RealisationSource


class ChunkResult(NamedTuple):
    """What a chunk gave, and the seconds that it took."""

    estimates: Estimates
    seconds: float


def compute_chunk(chunk: Chunk) -> ChunkResult:
    """Compute a chunk on one thread."""
    with one_thread():
        start = perf_counter()
        estimates = chunk.source(chunk.first, chunk.count)
        return ChunkResult(estimates, perf_counter() - start)


@dataclass
class _Queue:
    """What is left to do of a group, and the seconds that a realisation takes, None before the first is done."""

    group: StudiedGroup
    spans: list[Span]
    seconds: float | None = None
    at_work: int = 0

    @property
    def left(self) -> int:
        return sum(span.count for span in self.spans)


@dataclass
class Schedule:
    """Chunks of groups, the first of each group small.

    Attributes
    ----------
    groups : sequence of StudiedGroup
    missing : sequence of list of Span
        For each group.
    workers : int
    """

    groups: Sequence[StudiedGroup]
    missing: Sequence[list[Span]]
    workers: int
    _queues: list[_Queue] = field(init=False)
    _spent: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        """Begin with all that is missing."""
        self._queues = [_Queue(group, list(spans)) for group, spans in zip(self.groups, self.missing, strict=True)]

    def __iter__(self) -> Iterator[Chunk]:
        """Give chunks, each when it is asked for."""
        for number, queue in enumerate(self._queues):
            if queue.spans:
                yield self._take(number, queue.group.side_by_side)
        for number, queue in enumerate(self._queues):
            while queue.spans:
                yield self._take(number, self._size(queue))

    def learn(self, chunk: Chunk, seconds: float) -> None:
        """Take note of the time that a chunk took."""
        queue = self._queues[chunk.group]
        queue.at_work -= chunk.count
        queue.seconds = seconds / chunk.count
        self._spent += seconds

    @property
    def done(self) -> tuple[int, int]:
        """Work done and in all, in milliseconds of one worker as far as is known."""
        known = [queue.seconds for queue in self._queues if queue.seconds is not None]
        usual = sum(known) / len(known) if known else 1.0
        ahead = sum((queue.left + queue.at_work) * (usual if queue.seconds is None else queue.seconds)
                    for queue in self._queues)  # fmt: skip
        spent = round(1000 * self._spent)
        return spent, spent + (round(1000 * ahead) or (1 if ahead else 0))

    def _size(self, queue: _Queue) -> int:
        if queue.seconds is None:
            return queue.group.side_by_side
        by_time = int(_CHUNK_SECONDS / max(queue.seconds, 1e-9))
        return max(1, min(by_time, -(-queue.left // (_SHARES * self.workers))))

    def _take(self, number: int, size: int) -> Chunk:
        """Take the next realisations of a group, up to the end of those that are computed side by side."""
        queue = self._queues[number]
        span, together = queue.spans[0], queue.group.side_by_side
        first_end = (span.first // together + 1) * together
        end = min(span.end, max(first_end, (span.first + size) // together * together))
        count = end - span.first
        queue.spans[:1] = [Span(end, span.end - end)] if end < span.end else []
        queue.at_work += count
        return Chunk(number, span.first, count, queue.group.source)
