"""Folder of a study: a file for each finished chunk, written whole or not at all."""

from __future__ import annotations

import io
import json
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError, first_line
from jointfrf.files import OwnFolder, ReadLimit
from jointfrf.frf.noise import MOST_REALISATIONS
from jointfrf.io.npz_file import npz_fields
from jointfrf.kernel.arguments import one_line
from jointfrf.spelling import some_of
from jointfrf.workbench.cases.kind import EstimateColumn, Estimates
from jointfrf.workbench.studies.design import Arrangement, FactorValue, StudyPoint, as_text_of

__all__ = ["GroupRecord", "Span", "StudyRecord", "StudyStore", "check_estimates"]

#: Version of `study.json`.
_FORMAT = 1
#: Name of a chunk: group, first realisation, number of realisations.
_NAME = re.compile(r"(\d{1,20})-(\d{1,20})-(\d{1,20})\.npz", re.ASCII)
#: Largest number of bytes of memory for a byte of JSON: an empty table, `{},`, becomes a dict of 64 bytes.
_JSON_TIMES = 25
_RECORD = "study.json"


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
    """Point of the design, noise and columns of a group of estimates.

    Attributes
    ----------
    point : mapping
        Value by factor.
    noise : str
        Name of the noise.
    columns : tuple of EstimateColumn
        Estimator and parameter of each column.
    """

    point: StudyPoint
    noise: str
    columns: tuple[EstimateColumn, ...]


@dataclass(frozen=True)
class StudyRecord:
    """Description of a study.

    Attributes
    ----------
    name, title : str
        Name and title of the case.
    seed, realisations : int
        Seed, and number of realisations of each group.
    identity : mapping
        Fields that identify the study, see `StudyDesign.identity`.
    groups : tuple of GroupRecord
        Groups of estimates.
    """

    name: str
    title: str
    seed: int
    realisations: int
    identity: Mapping[str, Any]
    groups: tuple[GroupRecord, ...]

    @property
    def layout(self) -> list[tuple[str, list[tuple[str, str, str]]]]:
        """Return noise and columns of each group, which do not depend on the machine."""
        return [(one.noise, [(each.estimator, each.parameter, each.unit) for each in one.columns])
                for one in self.groups]  # fmt: skip


class _HeldColumn(msgspec.Struct):
    estimator: str
    parameter: str
    unit: str
    actual: float | None
    bound: float | None


class _HeldGroup(msgspec.Struct):
    point: dict[str, FactorValue]
    noise: str
    columns: Annotated[list[_HeldColumn], msgspec.Meta(min_length=1)]


class _HeldDesign(msgspec.Struct):
    factors: dict[str, list[FactorValue]]
    arrangement: Arrangement


class _HeldStudy(msgspec.Struct):
    """Types of `study.json`."""

    name: str
    title: str
    seed: int
    realisations: Annotated[int, msgspec.Meta(ge=1, le=MOST_REALISATIONS)]
    identity: _HeldDesign
    groups: Annotated[list[_HeldGroup], msgspec.Meta(min_length=1)]


@dataclass(frozen=True)
class StudyStore:
    """A folder with `study.json` and chunks.

    Attributes
    ----------
    folder : Path
        Folder of the study.
    """

    folder: Path

    @property
    def own(self) -> OwnFolder:
        """Folder, for reading and writing its files."""
        return OwnFolder(self.folder)

    @property
    def _chunks(self) -> OwnFolder:
        return self.own / "chunks"

    @property
    def exists(self) -> bool:
        """Whether the folder contains a study."""
        return os.path.lexists(self.folder / _RECORD)

    def read(self) -> StudyRecord:
        """Return the record of the study.

        Raises
        ------
        FileContentError
            The folder contains no study, or its file is damaged.
        """
        path = self.folder / _RECORD
        try:
            with self.own.opened(_RECORD) as file:
                ReadLimit(path).take(_JSON_TIMES * os.fstat(file.fileno()).st_size)
                content = file.read()
        except (FileNotFoundError, NotADirectoryError) as error:
            raise FileContentError(f"{self.folder} contains no study.json; name the folder of a study") from error
        try:
            held = json.loads(content)
            if isinstance(held, dict) and held.get("format", _FORMAT) != _FORMAT:
                version = one_line(held["format"])
                raise FileContentError(
                    f"{path}: format {version} was written by another version of jointfrf: name another folder"
                )
            checked = msgspec.convert(held, _HeldStudy)
            groups = tuple(
                GroupRecord(one.point, one.noise, tuple(map(_column, one.columns))) for one in checked.groups
            )
        except (ValueError, RecursionError) as error:
            if isinstance(error, FileContentError):
                raise
            raise FileContentError(
                f"{path} is not the file of a study ({first_line(error)}): name another folder"
            ) from error
        return StudyRecord(checked.name, checked.title, checked.seed, checked.realisations, held["identity"], groups)

    def begin(self, record: StudyRecord) -> None:
        """Write the record of the study.

        Raises
        ------
        FileContentError
            The folder contains chunks without a `study.json`, so that their study is unknown.
        """
        # In this order: another process that begins the same study writes study.json before its first chunk.
        if self.spans(record) and not self.exists:
            raise FileContentError(
                f"{self._chunks.path} contains chunks of an unknown study, without study.json: name another folder"
            )
        self._chunks.make()
        groups = [
            {"point": dict(one.point), "noise": one.noise, "columns": [_plain(column) for column in one.columns]}
            for one in record.groups
        ]
        content = {"format": _FORMAT, **asdict(replace(record, groups=())), "groups": groups}
        self.own.write(_RECORD, json.dumps(content, indent=1, default=str) + "\n")

    def check(self, identity: Mapping[str, Any]) -> StudyRecord:
        """Return the record of the study in the folder, after a check of its identity.

        Raises
        ------
        FileContentError
            The folder contains another study, or a damaged file.
        """
        record = self.read()
        ours = json.loads(as_text_of(identity))
        for key in ours:
            if as_text_of({key: record.identity.get(key)}) != as_text_of({key: ours[key]}):
                raise FileContentError(
                    f"{self.folder} contains another study, of {record.name}, whose {key} differ; name another folder"
                )
        return record

    def write(self, group: int, first: int, estimates: Estimates) -> None:
        """Write the estimates of a chunk."""
        content = io.BytesIO()
        has_intervals = not (np.isnan(estimates.low).all() and np.isnan(estimates.high).all())
        if has_intervals:
            np.savez(content, values=estimates.values, low=estimates.low, high=estimates.high)
        else:
            np.savez(content, values=estimates.values)
        name = f"{group:05d}-{first:010d}-{len(estimates.values):07d}.npz"
        self._chunks.write(name, content.getvalue())

    def spans(self, record: StudyRecord) -> dict[int, list[tuple[Span, str]]]:
        """Return the chunks of each group and their names, in the order of their realisations.

        Raises
        ------
        FileContentError
            A name contains a group or realisations outside the study.
        """
        found: dict[int, list[tuple[Span, str]]] = {}
        for name, status in self._chunks.entries().items():
            match = _NAME.fullmatch(name)
            if not match or (stat.S_ISREG(status.st_mode) and not status.st_size):
                continue
            group, first, count = map(int, match.groups())
            if group >= len(record.groups) or first + count > MOST_REALISATIONS:
                raise FileContentError(f"{self._chunks.path / name} belongs to no group of this study: delete it")
            found.setdefault(group, []).append((Span(first, count), name))
        return {group: sorted(own) for group, own in found.items()}

    def missing(self, record: StudyRecord, wanted: Span) -> list[list[Span]]:
        """Return the wanted realisations of each group that are missing.

        Raises
        ------
        FileContentError
            A chunk with wanted realisations is damaged.
        """
        there = self.spans(record)
        for group, own in there.items():
            for span, name in own:
                if span.first < wanted.end and wanted.first < span.end:
                    self._read_chunk(record, group, span, name)
        return [_gaps([span for span, _ in there.get(group, [])], wanted) for group in range(len(record.groups))]

    def chunks(self, record: StudyRecord, group: int) -> Iterator[tuple[int, Estimates]]:
        """Yield first number and estimates of the chunks of a group in order, each realisation once."""
        at = 0
        for span, name in self.spans(record).get(group, []):
            first, end = max(at, span.first), min(span.end, record.realisations)
            if first < end:
                found = self._read_chunk(record, group, span, name)
                yield first, Estimates(*(part[first - span.first : end - span.first] for part in found))
                at = end

    def take(self, record: StudyRecord, parts: Sequence[StudyStore]) -> None:
        """Copy the chunks of other folders of the same study into this one."""
        for part in parts:
            if part.folder.samefile(self.folder):
                continue
            for group, own in part.spans(record).items():
                for span, name in own:
                    self.write(group, span.first, part._read_chunk(record, group, span, name))

    def _read_chunk(self, record: StudyRecord, group: int, span: Span, name: str) -> Estimates:
        path = self._chunks.path / name
        with self._chunks.opened(name) as file:
            try:
                estimates = _estimates_of(npz_fields(path, ReadLimit(path), file))
                check_estimates(estimates, span.count, len(record.groups[group].columns))
            except (OSError, ValueError) as error:
                why = first_line(error).removeprefix(f"{path} ")
                raise FileContentError(
                    f"{path} is damaged ({why}): delete it, and the same study computes its realisations again"
                ) from error
        return estimates


def _estimates_of(held: Mapping[str, NDArray[Any]]) -> Estimates:
    """Return the arrays of a chunk, numbers of 8 bytes in the order of this machine."""
    if set(held) not in ({"values"}, set(Estimates._fields)):
        raise ValueError(f"arrays must be values, low and high, not {some_of(sorted(held), 3) or 'none'}")
    parts = {name: part.astype(np.float64, copy=False) if part.dtype.kind == "f" else part
             for name, part in held.items()}  # fmt: skip
    return Estimates(**parts) if len(parts) > 1 else Estimates.without_intervals(parts["values"])


def check_estimates(estimates: Estimates, count: int, columns: int) -> None:
    """Raise ValueError if the estimates do not fit the numbers of realisations and columns.

    Parameters
    ----------
    estimates : Estimates
        Values that are finite or NaN, and intervals whose `low` is at most `high`, infinite if they are unbounded.
    count, columns : int
        Number of realisations and number of columns.
    """
    for name, part in zip(Estimates._fields, estimates, strict=True):
        if not isinstance(part, np.ndarray) or part.dtype != np.float64:
            kind = part.dtype if isinstance(part, np.ndarray) else type(part).__name__
            raise ValueError(f"{name} must be float64, not {kind}")
        if part.shape != (count, columns):
            shape = " x ".join(map(str, part.shape)) or "one number"
            raise ValueError(f"{name} must be {count} realisations x {columns} columns, not {shape}")
    if np.isinf(estimates.values).any():
        raise ValueError("values must be finite, or NaN if a realisation failed, not infinite")
    if (estimates.low > estimates.high).any() or (estimates.low == np.inf).any() or (estimates.high == -np.inf).any():
        raise ValueError("low must be at most high in every interval")


def _gaps(there: Sequence[Span], wanted: Span) -> list[Span]:
    """Return the parts of a span that a sorted sequence of spans does not cover."""
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


def _column(held: _HeldColumn) -> EstimateColumn:
    if not all(value is None or np.isfinite(value) for value in (held.actual, held.bound)):
        raise ValueError("actual and bound must be finite")
    actual, bound = (np.nan if value is None else value for value in (held.actual, held.bound))
    return EstimateColumn(held.estimator, held.parameter, held.unit, actual, bound)
