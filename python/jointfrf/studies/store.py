"""What a study has found so far, in a folder: a file for each chunk, written whole: nothing finished is lost."""

from __future__ import annotations

import io
import json
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.cases.kind import EstimateColumn, Estimates
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, check_file, write_file, written_whole
from jointfrf.io.npz_file import npz_fields
from jointfrf.studies.design import StudyPoint, as_text_of

__all__ = ["GroupRecord", "Span", "StudyRecord", "StudyStore"]

#: Version of `study.json`.
_FORMAT = 1
#: Name of a chunk: group, first realisation, how many.
_NAME = re.compile(r"(\d+)-(\d+)-(\d+)\.npz")


@dataclass(frozen=True, order=True)
class Span:
    """Realisations first to first + count - 1."""

    first: int
    count: int

    @property
    def end(self) -> int:
        """The realisation after the last."""
        return self.first + self.count


@dataclass(frozen=True)
class GroupRecord:
    """What the columns of a group are: at which point of the design, with which noise.

    Attributes
    ----------
    point : mapping
        Factor to value.
    noise : str
    columns : tuple of EstimateColumn
    """

    point: StudyPoint
    noise: str
    columns: tuple[EstimateColumn, ...]


@dataclass(frozen=True)
class StudyRecord:
    """What a study is.

    Attributes
    ----------
    name, title : str
        Of the case.
    seed, realisations : int
        Realisations of each group.
    identity : mapping
        Fields that identify it, see `StudyDesign.identity`.
    groups : tuple of GroupRecord
    """

    name: str
    title: str
    seed: int
    realisations: int
    identity: Mapping[str, Any]
    groups: tuple[GroupRecord, ...]


@dataclass(frozen=True)
class StudyStore:
    """A folder with `study.json` and chunks.

    Attributes
    ----------
    folder : Path
    """

    folder: Path

    @property
    def _chunks(self) -> Path:
        return self.folder / "chunks"

    @property
    def exists(self) -> bool:
        """Whether a study was begun here."""
        return (self.folder / "study.json").is_file()

    def read(self) -> StudyRecord:
        """Read what the study is.

        Raises
        ------
        FileContentError
            There is no study, or its file is damaged.
        """
        path = self.folder / "study.json"
        try:
            check_file(path)
            held = json.loads(path.read_text(encoding="utf-8"))
            if held["format"] != _FORMAT:
                raise FileContentError(f"{path}: format {held['format']} was written by another version of jointfrf")
            groups = tuple(
                GroupRecord(one["point"], one["noise"], tuple(_column(column) for column in one["columns"]))
                for one in held["groups"]
            )
            return StudyRecord(
                held["name"], held["title"], held["seed"], held["realisations"], held["identity"], groups
            )
        except FileNotFoundError as error:
            raise FileContentError(f"{self.folder} holds no study: there is no study.json in it") from error
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            if isinstance(error, FileContentError):
                raise
            raise FileContentError(f"{path} is not the file of a study: {error}") from error

    def begin(self, record: StudyRecord) -> None:
        """Write what the study is."""
        self._chunks.mkdir(parents=True, exist_ok=True)
        groups = [
            {"point": dict(one.point), "noise": one.noise, "columns": [_plain(column) for column in one.columns]}
            for one in record.groups
        ]
        content = {"format": _FORMAT, **asdict(replace(record, groups=())), "groups": groups}
        write_file(self.folder / "study.json", json.dumps(content, indent=1, default=str) + "\n")

    def check(self, identity: Mapping[str, Any]) -> StudyRecord:
        """Return the study that was begun here; it must be this one.

        Raises
        ------
        FileContentError
            It is another one, or damaged.
        """
        record = self.read()
        ours = json.loads(as_text_of(identity))
        for key in ours:
            if as_text_of({key: record.identity.get(key)}) != as_text_of({key: ours[key]}):
                raise FileContentError(
                    f"{self.folder} holds another study, of {record.name}, whose {key} differ: name another folder"
                )
        return record

    def write(self, group: int, first: int, estimates: Estimates) -> None:
        """Keep what a chunk gave."""
        content = io.BytesIO()
        has_intervals = not (np.isnan(estimates.low).all() and np.isnan(estimates.high).all())
        if has_intervals:
            np.savez(content, values=estimates.values, low=estimates.low, high=estimates.high)
        else:
            np.savez(content, values=estimates.values)
        name = f"{group:05d}-{first:010d}-{len(estimates.values):07d}.npz"
        write_file(self._chunks / name, content.getvalue())

    def spans(self) -> dict[int, list[tuple[Span, Path]]]:
        """Return what is there: group to its chunks in the order of their realisations."""
        found: dict[int, list[tuple[Span, Path]]] = {}
        for path in self._chunks.iterdir() if self._chunks.is_dir() else ():
            match = _NAME.fullmatch(path.name)
            if match and path.stat().st_size:
                group, first, count = map(int, match.groups())
                found.setdefault(group, []).append((Span(first, count), path))
        return {group: sorted(own) for group, own in found.items()}

    def missing(self, groups: int, wanted: Span) -> list[list[Span]]:
        """Return for each group which of the realisations wanted are not there."""
        there = self.spans()
        return [_gaps([span for span, _ in there.get(group, [])], wanted) for group in range(groups)]

    def chunks(self, group: int) -> Iterator[tuple[int, Estimates]]:
        """Read the chunks of a group in order, each realisation once: number of the first, and estimates."""
        at = 0
        for span, path in self.spans().get(group, []):
            skip = max(0, at - span.first)
            if skip < span.count:
                yield span.first + skip, _read_chunk(path, skip)
                at = span.end

    def take(self, parts: Sequence[StudyStore]) -> None:
        """Copy the chunks of other folders into this one."""
        self._chunks.mkdir(parents=True, exist_ok=True)
        for part in parts:
            for own in part.spans().values():
                for _, path in own:
                    with written_whole(self._chunks / path.name) as temporary:
                        shutil.copyfile(path, temporary)


def _read_chunk(path: Path, skip: int) -> Estimates:
    try:
        check_file(path)
        held = npz_fields(path, ReadLimit(path))
        values = held["values"][skip:]
        if "low" not in held:
            return Estimates.without_intervals(values)
        return Estimates(values, held["low"][skip:], held["high"][skip:])
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise FileContentError(
            f"{path} is damaged ({error}): delete it, and the same study computes its realisations again"
        ) from error


def _gaps(there: Sequence[Span], wanted: Span) -> list[Span]:
    """Return what of a span is not covered by others, which are sorted."""
    found, at = [], wanted.first
    for span in there:
        if span.end <= at or span.first >= wanted.end:
            continue
        if span.first > at:
            found.append(Span(at, span.first - at))
        at = span.end
    if at < wanted.end:
        found.append(Span(at, wanted.end - at))
    return found


def _plain(column: EstimateColumn) -> dict[str, Any]:
    return {key: None if value != value else value for key, value in asdict(column).items()}


def _column(held: Mapping[str, Any]) -> EstimateColumn:
    actual, bound = (np.nan if held[key] is None else float(held[key]) for key in ("actual", "bound"))
    return EstimateColumn(held["estimator"], held["parameter"], held["unit"], actual, bound)
