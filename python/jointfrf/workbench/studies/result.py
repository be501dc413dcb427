"""Results of a study: summary, single realisations, tables, figures, files."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO, Literal, NamedTuple

import numpy as np
from numpy.lib.format import write_array_header_1_0
from numpy.typing import NDArray

from jointfrf.extras import check_extras, import_extra
from jointfrf.files import OwnFolder, written_whole
from jointfrf.kernel.arguments import FloatArray, as_integer, check_choice
from jointfrf.workbench.cases.kind import Estimates
from jointfrf.workbench.cases.run import write_results
from jointfrf.workbench.report.document import Document, Listing, Picture, Section
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Figure
from jointfrf.workbench.report.table import Table, as_text
from jointfrf.workbench.studies.design import in_words
from jointfrf.workbench.studies.store import GroupRecord, Span, StudyRecord, StudyStore
from jointfrf.workbench.studies.summary import ParameterSummary, study_figures, study_table, summarise

__all__ = ["StudyResult", "read_study"]


@dataclass(frozen=True)
class StudyResult:
    """Results of a study, read from its folder when they are needed.

    Attributes
    ----------
    folder : Path
        Folder of the study.
    """

    folder: Path

    @property
    def _store(self) -> StudyStore:
        return StudyStore(self.folder)

    @cached_property
    def record(self) -> StudyRecord:
        """Case, seed, realisations and groups of the study."""
        return self._store.read()

    @property
    def groups(self) -> tuple[GroupRecord, ...]:
        """Point of the design, noise and columns of each group of estimates."""
        return self.record.groups

    @cached_property
    def missing(self) -> int:
        """Number of realisations of groups that have not been computed."""
        wanted = Span(0, self.record.realisations)
        return sum(span.count for own in self._store.missing(self.record, wanted) for span in own)

    @cached_property
    def summary(self) -> list[ParameterSummary]:
        """Summary of each parameter by each estimator at each point of the design."""
        return summarise(self._store, self.record)

    def estimates(self, group: int) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
        """Return the single realisations of a group.

        Parameters
        ----------
        group : int
            Number in `groups`.

        Returns
        -------
        numbers : ndarray of int, shape (r,)
            Numbers of the realisations.
        values, low, high : ndarray, shape (r, n_columns)
            Estimates and the limits of their 95 % intervals in the units of the columns; NaN if there are none.

        Raises
        ------
        ValueError
            The group does not exist.
        """
        if not 0 <= as_integer("group", group) < len(self.groups):
            raise ValueError(f"group must be from 0 to {len(self.groups) - 1}, not {group}")
        columns = len(self.groups[group].columns)
        numbers, parts = [np.empty(0, np.int64)], [np.empty((3, 0, columns))]
        for first, estimates in self._store.chunks(self.record, group):
            numbers.append(np.arange(first, first + len(estimates.values)))
            parts.append(np.array(estimates))
        values, low, high = np.concatenate(parts, axis=1)
        return np.concatenate(numbers), values, low, high

    @property
    def table(self) -> Table:
        """Return the summary as a table."""
        return study_table(self.record, self.summary, self.missing)

    @property
    def figures(self) -> list[Figure]:
        """Return figures of the distributions, and of errors, bound and coverage over each factor."""
        return study_figures(self.record, self.summary)

    def to_dict(self) -> dict[str, Any]:
        """Return case, design and summary as values for JSON, with None for NaN."""
        record = self.record
        rows = [asdict(row) for row in self.summary]
        return {
            "case": record.name,
            "title": record.title,
            "seed": record.seed,
            "realisations": record.realisations,
            "missing": self.missing,
            "design": {key: value for key, value in record.identity.items() if key != "case"},
            "summary": [{key: None if value != value else value for key, value in row.items()} for row in rows],
        }

    def report(self) -> Path:
        """Write `report.html`, `results.json`, the table as CSV and the figures as PNG, SVG and CSV into the folder.

        Returns
        -------
        Path
            File of the page.

        Raises
        ------
        MissingPackageError
            matplotlib or jinja2 is not installed.
        """
        return _write_report(self._store.own, self.record, self.table, self.figures, self.to_dict())

    def save_parquet(self, path: str | Path) -> Path:
        """Write single realisations as a Parquet file, a row for each estimate; memory does not depend on their number.

        Parameters
        ----------
        path : str or Path
            Path of the file.

        Returns
        -------
        Path
            Path of the written file.

        Raises
        ------
        MissingPackageError
            pyarrow is not installed.
        """
        _write_parquet(self._store, self.record, written_whole(Path(path)))
        return Path(path)

    def save_npz(self, path: str | Path) -> Path:
        """Write single realisations as an NPZ file; memory does not depend on their number.

        Parameters
        ----------
        path : str or Path
            Path of the file. For group g of `groups` it contains ``realisations_g``, shape (r,), and ``values_g``,
            ``low_g``, ``high_g``, shape (r, n_columns). ``groups`` describes the groups in JSON.

        Returns
        -------
        Path
            Path of the written file.
        """
        _write_npz(self._store, self.record, written_whole(Path(path)))
        return Path(path)

    def save_values(self, form: Literal["parquet", "npz"]) -> Path:
        """Write single realisations into the folder of the study, and return the path of the file.

        Parameters
        ----------
        form : {"parquet", "npz"}
            Format of the file, see `save_parquet` and `save_npz`.

        Returns
        -------
        Path
            `realisations.parquet` or `realisations.npz`.

        Raises
        ------
        FileContentError
            The path of the file is a link, a pipe or a device.
        MissingPackageError
            pyarrow is not installed.
        """
        check_choice("form", form, ("parquet", "npz"))
        name = f"realisations.{form}"
        write = _write_parquet if form == "parquet" else _write_npz
        write(self._store, self.record, self._store.own.written(name))
        return self.folder / name

    def __str__(self) -> str:
        """Return the summary as text."""
        return as_text(self.table)


def read_study(folder: str | Path) -> StudyResult:
    """Return the results of a study, finished or not.

    Parameters
    ----------
    folder : str or Path
        Folder of the study.

    Returns
    -------
    StudyResult
        Results so far.

    Raises
    ------
    FileContentError
        The folder does not contain a study.

    See Also
    --------
    study : compute realisations.
    merge_studies : merge parts of a study.
    """
    StudyStore(Path(folder)).read()
    return StudyResult(Path(folder))


def _write_report(
    folder: OwnFolder, record: StudyRecord, table: Table, figures: Sequence[Figure], content: Mapping[str, Any]
) -> Path:
    """Write the page of a study, and its numbers, table and figures into the same folder."""
    check_extras("matplotlib", "jinja2")
    pictures = [Picture(figure, draw(figure)) for figure in figures]
    sections = [
        Section("summary", "Estimates", [*pictures[:1], table]),
        Section("figures", "Figures", pictures[1:]),
        Section("subject", "The study", [Listing("case and design", json.dumps(record.identity, indent=1))]),
    ]
    document = Document(f"Study: {record.title}", _about(record), sections)
    return write_results(folder, document, [table], content)


def _about(record: StudyRecord) -> str:
    factors = record.identity["factors"]
    varied = "; ".join(f"{name}: {', '.join(map(str, values))}" for name, values in factors.items())
    how = "every combination" if record.identity["arrangement"] == "full" else "one at a time"
    design = f" Varied, {how}: {varied}."
    return (
        f"Case {record.name}, {record.realisations} realisations of the noise at each point, seed {record.seed}."
        f"{design if varied else ''}"
    )


def _write_parquet(store: StudyStore, record: StudyRecord, target: AbstractContextManager[Path | BinaryIO]) -> None:
    """Write a row for each realisation and column, a chunk at a time."""
    pa, parquet = import_extra("pyarrow"), import_extra("pyarrow.parquet")
    factors = list(dict.fromkeys(name for group in record.groups for name in group.point))
    kinds = {name: _kind_of([group.point.get(name) for group in record.groups], pa) for name in factors}
    words = {name: pa.dictionary(pa.int32(), pa.string()) for name in ("noise", "estimator", "parameter", "unit")}
    numbers = dict.fromkeys(("actual", "value", "low", "high"), pa.float64())
    schema = pa.schema({**kinds, **words, "realisation": pa.int64(), **numbers})
    with target as place, parquet.ParquetWriter(place, schema) as writer:
        for number, group in enumerate(record.groups):
            for first, estimates in store.chunks(record, number):
                columns = _tidy(group, first, estimates)
                content = {name: [_as_kind(group.point.get(name), kinds[name], pa)] * len(columns["value"])
                           for name in factors} | columns  # fmt: skip
                arrays = [pa.array(content[one.name], type=one.type) for one in schema]
                writer.write_table(pa.Table.from_arrays(arrays, schema=schema))


def _kind_of(values: Sequence[Any], pa: Any) -> Any:
    """Return the type of a factor: numbers, or texts."""
    held = [value for value in values if value is not None]
    is_number = all(isinstance(value, int | float) and not isinstance(value, bool) for value in held)
    return pa.float64() if is_number else pa.string()


def _as_kind(value: Any, kind: Any, pa: Any) -> Any:
    return None if value is None else float(value) if kind == pa.float64() else str(value)


def _tidy(group: GroupRecord, first: int, estimates: Estimates) -> dict[str, Any]:
    """Return a chunk as columns of the same length: realisation after realisation."""
    count = len(estimates.values)
    texts = {
        name: [getattr(column, name) for column in group.columns] * count for name in ("estimator", "parameter", "unit")
    }
    return {
        "noise": [group.noise] * (count * len(group.columns)),
        **texts,
        "realisation": np.repeat(np.arange(first, first + count), len(group.columns)),
        "actual": np.tile([column.actual for column in group.columns], count),
        "value": estimates.values.ravel(),
        "low": estimates.low.ravel(),
        "high": estimates.high.ravel(),
    }


class _Member(NamedTuple):
    """An array of an NPZ file that is written chunk by chunk."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    part: Callable[[int, Estimates], NDArray[Any]]


def _write_npz(store: StudyStore, record: StudyRecord, target: AbstractContextManager[Path | BinaryIO]) -> None:
    """Write the realisations of each group as arrays, a chunk at a time."""
    groups = [
        {"point": dict(group.point), "noise": group.noise, "in_words": in_words(group.point),
         "columns": [[column.estimator, column.parameter, column.unit] for column in group.columns]}
        for group in record.groups
    ]  # fmt: skip
    with target as place, zipfile.ZipFile(place, "w") as archive:
        with archive.open("groups.npy", "w") as file:
            np.lib.format.write_array(file, np.array(json.dumps(groups)))
        for number, group in enumerate(record.groups):
            rows = sum(len(estimates.values) for _, estimates in store.chunks(record, number))
            for member in _members(number, rows, len(group.columns)):
                with archive.open(member.name, "w", force_zip64=True) as file:
                    header = {"descr": member.dtype.str, "fortran_order": False, "shape": member.shape}
                    write_array_header_1_0(file, header)
                    for part in _parts(member, store.chunks(record, number)):
                        file.write(part.tobytes())


def _members(number: int, rows: int, columns: int) -> Iterator[_Member]:
    yield _Member(f"realisations_{number}.npy", (rows,), np.dtype(np.int64),
                  lambda first, own: np.arange(first, first + len(own.values)))  # fmt: skip
    for at, name in enumerate(Estimates._fields):
        yield _Member(f"{name}_{number}.npy", (rows, columns), np.dtype(np.float64), lambda _, own, at=at: own[at])  # type: ignore[misc]


def _parts(member: _Member, chunks: Iterator[tuple[int, Estimates]]) -> Iterator[NDArray[Any]]:
    for first, estimates in chunks:
        yield np.ascontiguousarray(member.part(first, estimates), member.dtype)
