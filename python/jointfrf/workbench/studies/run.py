"""Run or continue a study, and merge parts of a study."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

from jointfrf.errors import FileContentError
from jointfrf.frf.noise import MOST_REALISATIONS
from jointfrf.kernel.arguments import as_integer, check_type, one_line
from jointfrf.parallel.pool import AnyExecutor, Pool, check_progress, one_thread, opened_pool
from jointfrf.workbench.cases.catalogue import find_case
from jointfrf.workbench.cases.kind import EstimateGroup, Estimates, RealisationSource
from jointfrf.workbench.cases.workers import silent
from jointfrf.workbench.studies.design import StudyDesign, in_words
from jointfrf.workbench.studies.result import StudyResult
from jointfrf.workbench.studies.store import GroupRecord, Span, StudyRecord, StudyStore, check_estimates

__all__ = ["Chunk", "ChunkResult", "Schedule", "compute_chunk", "merge_studies", "study"]

#: Seconds that a chunk is to take: short enough to lose with a killed worker, long compared with its transfer.
_CHUNK_SECONDS = 2.0
#: Least number of chunks for each worker, so that all workers end together.
_SHARES = 4


@dataclass(frozen=True)
class Chunk:
    """Consecutive realisations of one group."""

    group: int
    first: int
    count: int
    source: RealisationSource


class ChunkResult(NamedTuple):
    """Estimates of a chunk, and the seconds that it took."""

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
    """Missing realisations of a group, and the seconds that a realisation takes (None before the first one)."""

    group: EstimateGroup
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
    groups : sequence of EstimateGroup
        Groups of estimates.
    missing : sequence of list of Span
        Missing realisations of each group.
    workers : int
        Number of workers.
    """

    groups: Sequence[EstimateGroup]
    missing: Sequence[list[Span]]
    workers: int
    _queues: list[_Queue] = field(init=False)
    _spent: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        """Make the queue of each group."""
        self._queues = [_Queue(group, list(spans)) for group, spans in zip(self.groups, self.missing, strict=True)]

    def __iter__(self) -> Iterator[Chunk]:
        """Yield chunks one by one."""
        for number, queue in enumerate(self._queues):
            if queue.spans:
                yield self._take(number, queue.group.side_by_side)
        for number, queue in enumerate(self._queues):
            while queue.spans:
                yield self._take(number, self._size(queue))

    def learn(self, chunk: Chunk, seconds: float) -> None:
        """Store the time that a chunk took."""
        queue = self._queues[chunk.group]
        queue.at_work -= chunk.count
        queue.seconds = seconds / chunk.count
        self._spent += seconds

    @property
    def done(self) -> tuple[int, int]:
        """Return finished and total work, in estimated milliseconds of one worker."""
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
        """Return the next realisations of a group, ending at a multiple of those that are computed together."""
        queue = self._queues[number]
        span, together = queue.spans[0], queue.group.side_by_side
        first_end = (span.first // together + 1) * together
        end = min(span.end, max(first_end, (span.first + size) // together * together))
        count = end - span.first
        queue.spans[:1] = [Span(end, span.end - end)] if end < span.end else []
        queue.at_work += count
        return Chunk(number, span.first, count, queue.group.source)


def study(
    case: str | Path,
    out: str | Path,
    realisations: int | None = None,
    *,
    design: StudyDesign | None = None,
    part: range | None = None,
    executor: AnyExecutor | None = None,
    jobs: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> StudyResult:
    """Return estimates of the joint of a case from many realisations of the noise, over a design of factors.

    Parameters
    ----------
    case : str or Path
        Name or number of a case that comes with jointfrf, or a folder with a `case.toml`, of any kind.
    out : str or Path
        Folder of the results, made if it does not exist. Realisations that it contains are not computed again.
    realisations : int, optional
        Number of realisations of each noise at each point of the design, default the number in the case.
    design : StudyDesign, optional
        Factors, noises and estimators, default the table ``[study]`` of the case, or the case without factors.
    part : range, optional
        Numbers of the realisations to compute, such as ``range(200, 300)`` for one job of many; default all. See
        `merge_studies`.
    executor : Executor or callable, optional
        Executor of `concurrent.futures`, of which only `submit` is used: threads, loky (``client.get_executor()``) or
        MPI (``mpi4py.futures.MPIPoolExecutor()``). A function that makes an executor, such as
        ``loky.get_reusable_executor``, is called again if the executor breaks. The default is processes of this
        machine; if a process dies, only its chunk is lost.
    jobs : int, optional
        Number of workers, default all cores, or the number that `executor` states. With 1 everything is computed in
        this thread.
    progress : callable, optional
        Function that is called after each chunk with finished and total work, in milliseconds of one worker.

    Returns
    -------
    StudyResult
        Results in the folder.

    Raises
    ------
    FileContentError
        The case or a point of the design is wrong; the folder contains another study, or a damaged file.
    UnknownCaseError
        The case does not exist.
    BrokenPoolError
        The executor has lost its workers, and no function makes another one. Finished chunks are kept.
    ValueError
        The case has no such noise or estimator, or `part` does not fit.
    TypeError
        The case is no name or folder, `design` is no `StudyDesign`, or another argument has the wrong type.

    See Also
    --------
    merge_studies : merge parts of a study.
    read_study : read results from a folder.
    StudyDesign : factors, noises and estimators.

    Notes
    -----
    Realisation k has the same numbers, bit for bit, for any number of workers, chunks and parts, on machines with the
    same processor and engine (`set_engine`). Other machines differ by rounding. All points of the design have the same
    noise numbers. Each task computes on one thread. Memory does not depend on `realisations`.

    If the process ends early, finished chunks are kept, and the same call continues. A chunk takes about 2 s.

    Scripts that start processes need ``if __name__ == "__main__":`` around their main part.

    Examples
    --------
    >>> import jointfrf as jf, tempfile
    >>> design = jf.StudyDesign({"noise": [0.02, 0.05]}, estimators=["inverse-substructuring"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     found = jf.study("3.1", folder, 50, design=design, jobs=1)
    ...     rows = found.summary
    >>> [(row.point["noise"], row.parameter, abs(row.bias / row.actual) < 0.05) for row in rows][::2]
    [(0.02, 'k_x', True), (0.05, 'k_x', True)]
    """
    if design is not None:
        check_type("design", design, StudyDesign)
    check_progress(progress)
    if not isinstance(case, str | Path):
        raise TypeError(f"case must be the name or the folder of a case, not {one_line(case)}")
    folder = find_case(str(case)).resolve()
    plan = StudyDesign.of_case(folder) if design is None else design
    store, identity = StudyStore(Path(out)), plan.identity(folder)
    held = store.check(identity) if store.exists else None
    groups: list[EstimateGroup] = []
    if held is None:
        groups, record = _prepared(folder, plan, realisations)
    else:
        record = held if realisations is None else replace(held, realisations=_count(realisations))
    wanted = _wanted(part, record.realisations)
    missing = store.missing(record, wanted)
    if held is not None and any(missing):
        groups, ours = _prepared(folder, plan, realisations)
        _check_layout(store, record, ours)
    if record != held:
        store.begin(record)
    if any(missing):
        with opened_pool(executor, jobs) as pool:
            _compute(store, Schedule(groups, missing, pool.workers), pool, progress or silent)
    return StudyResult(store.folder)


def _compute(store: StudyStore, schedule: Schedule, pool: Pool, progress: Callable[[int, int], None]) -> None:
    """Compute missing realisations, and store each finished chunk."""
    for chunk, result in pool.completed(compute_chunk, iter(schedule)):
        _check_result(chunk, result, schedule.groups[chunk.group])
        store.write(chunk.group, chunk.first, result.estimates)
        schedule.learn(chunk, result.seconds)
        progress(*schedule.done)


def _check_result(chunk: Chunk, result: object, group: EstimateGroup) -> None:
    """Check the result of a worker, which may have another version of jointfrf, or run an estimator of the user."""
    numbers = f"realisations {chunk.first} to {chunk.first + chunk.count - 1} of noise {group.noise!r}"
    if (
        not isinstance(result, ChunkResult)
        or not isinstance(result.estimates, Estimates)
        or not isinstance(result.seconds, float)
    ):
        raise TypeError(
            f"a worker returned {one_line(result)} for {numbers}: start workers with this version of jointfrf"
        )
    try:
        check_estimates(result.estimates, chunk.count, len(group.columns))
    except ValueError as error:
        raise ValueError(f"{numbers}, {group.columns[0].estimator}: {error}") from error


def _check_layout(store: StudyStore, held: StudyRecord, ours: StudyRecord) -> None:
    if held.layout != ours.layout:
        raise FileContentError(
            f"{store.folder} was written by another version of jointfrf, with other estimates: name another folder"
        )


def _prepared(folder: Path, design: StudyDesign, realisations: int | None) -> tuple[list[EstimateGroup], StudyRecord]:
    """Return the groups of estimates of all points, and the record of the study."""
    groups: list[EstimateGroup] = []
    records: list[GroupRecord] = []
    seen = None
    for point, case, kind in design.cases(folder):
        try:
            own = kind.study_groups(case, design.choice)
        except ValueError as error:
            raise ValueError(f"{in_words(point)}: {error}" if point else str(error)) from error
        groups += own
        records += [GroupRecord(point, group.noise, group.columns) for group in own]
        seen = case
    assert seen is not None
    count = seen.realisations if realisations is None else _count(realisations)
    return groups, StudyRecord(folder.name, seen.title, seen.seed, count, design.identity(folder), tuple(records))


def _count(realisations: int) -> int:
    count = as_integer("realisations", realisations)
    if not 1 <= count <= MOST_REALISATIONS:
        raise ValueError(f"realisations must be from 1 to {MOST_REALISATIONS}, not {realisations}")
    return count


def _wanted(part: range | None, realisations: int) -> Span:
    if part is None:
        return Span(0, realisations)
    check_type("part", part, range)
    if part.step != 1 or not len(part) or part.start < 0 or part.stop > realisations:
        raise ValueError(
            f"part is {one_line(part)}; give at least one realisation, in steps of 1, within range({realisations})"
        )
    return Span(part.start, len(part))


def merge_studies(parts: Sequence[str | Path], out: str | Path) -> StudyResult:
    """Merge parts of one study from several folders, and return the results.

    Parameters
    ----------
    parts : sequence of str or Path
        Folders of the parts; they stay as they are.
    out : str or Path
        Folder of the merged study, which may contain a part.

    Returns
    -------
    StudyResult
        Results of all parts. `missing` is the number of realisations that are in no part; `study` into the same folder
        computes them.

    Raises
    ------
    FileContentError
        A folder does not contain a study, or the parts belong to different studies.
    ValueError
        `parts` is empty.

    See Also
    --------
    study : compute realisations, all or a part.
    read_study : read results from a folder.

    Examples
    --------
    >>> import jointfrf as jf, tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as at:
    ...     parts = [Path(at) / "a", Path(at) / "b"]
    ...     for folder, part in zip(parts, (range(0, 4), range(4, 8))):
    ...         found = jf.study("3.1", folder, 8, part=part, jobs=1)
    ...     jf.merge_studies(parts, Path(at) / "whole").missing
    0
    """
    if isinstance(parts, str | Path) or not isinstance(parts, Iterable):
        raise TypeError(f"parts is {one_line(parts)}; give a list of folders")
    stores, target = [StudyStore(Path(part)) for part in parts], StudyStore(Path(out))
    if not stores:
        raise ValueError("parts is empty; name at least one folder")
    first = stores[0].read()
    known = [target] if target.exists else []
    records = [one.check(first.identity) for one in (*stores, *known)]
    for store, one in zip((*stores, *known), records, strict=True):
        _check_layout(store, one, first)
    whole = replace(first, realisations=max(one.realisations for one in records))
    target.begin(whole)
    target.take(whole, stores)
    return StudyResult(target.folder)
