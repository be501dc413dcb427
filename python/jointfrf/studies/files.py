"""Files of a study: a page with its table and figures, and single realisations as Parquet or NPZ."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.format import write_array_header_1_0
from numpy.typing import NDArray

from jointfrf.cases.studied import Estimates
from jointfrf.extras import check_extras, import_extra
from jointfrf.files import below, write_file, written_whole
from jointfrf.report.document import Document, Listing, Picture, Section, make_document
from jointfrf.report.draw import draw
from jointfrf.report.figure import Figure, figure_csv
from jointfrf.report.table import Table, table_csv
from jointfrf.studies.design import in_words
from jointfrf.studies.store import GroupRecord, StudyRecord, StudyStore

__all__ = ["write_npz_of", "write_parquet_of", "write_report_of"]


def write_report_of(
    folder: Path, record: StudyRecord, table: Table, figures: Sequence[Figure], content: Mapping[str, Any]
) -> Path:
    """Write the page of a study and, beside it, its numbers, table and figures."""
    check_extras("matplotlib", "jinja2")
    drawn = [(figure, draw(figure)) for figure in figures]
    for inner in ("tables", "figures"):
        below(folder, inner).mkdir(exist_ok=True)
    for figure, drawing in drawn:
        write_file(below(folder / "figures", figure.key, ".png"), drawing.png)
        write_file(below(folder / "figures", figure.key, ".svg"), drawing.svg)
        write_file(below(folder / "figures", figure.key, ".csv"), figure_csv(figure))
    write_file(below(folder / "tables", "study.csv"), table_csv(table))
    write_file(below(folder, "results.json"), json.dumps(content, indent=1) + "\n")
    sections = [
        Section("estimates", "Estimates", [table]),
        Section("figures", "Figures", [Picture(figure, drawing) for figure, drawing in drawn]),
        Section("subject", "The study", [Listing("case and design", json.dumps(record.identity, indent=1))]),
    ]
    page = make_document(Document(f"Study: {record.title}", _about(record), sections))
    write_file(below(folder, "report.html"), page)
    return folder / "report.html"


def _about(record: StudyRecord) -> str:
    factors = record.identity["factors"]
    varied = "; ".join(f"{name}: {', '.join(map(str, values))}" for name, values in factors.items())
    how = "every combination" if record.identity["arrangement"] == "full" else "one at a time"
    design = f" Varied, {how}: {varied}."
    return (
        f"Case {record.name}, {record.realisations} realisations of the noise at each point, seed {record.seed}."
        f"{design if varied else ''}"
    )


def write_parquet_of(store: StudyStore, record: StudyRecord, path: Path) -> Path:
    """Write a row for each realisation and column, a chunk at a time."""
    pa, parquet = import_extra("pyarrow"), import_extra("pyarrow.parquet")
    factors = list(dict.fromkeys(name for group in record.groups for name in group.point))
    kinds = {name: _kind_of([group.point.get(name) for group in record.groups], pa) for name in factors}
    words = {name: pa.dictionary(pa.int32(), pa.string()) for name in ("noise", "estimator", "parameter", "unit")}
    numbers = dict.fromkeys(("actual", "value", "low", "high"), pa.float64())
    schema = pa.schema({**kinds, **words, "realisation": pa.int64(), **numbers})
    with written_whole(path) as temporary, parquet.ParquetWriter(temporary, schema) as writer:
        for number, group in enumerate(record.groups):
            for first, estimates in store.chunks(number):
                columns = _tidy(group, first, estimates)
                content = {name: [_as_kind(group.point.get(name), kinds[name], pa)] * len(columns["value"])
                           for name in factors} | columns  # fmt: skip
                arrays = [pa.array(content[one.name], type=one.type) for one in schema]
                writer.write_table(pa.Table.from_arrays(arrays, schema=schema))
    return path


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
    told = {
        name: [getattr(column, name) for column in group.columns] * count for name in ("estimator", "parameter", "unit")
    }
    return {
        "noise": [group.noise] * (count * len(group.columns)),
        **told,
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


def write_npz_of(store: StudyStore, record: StudyRecord, path: Path) -> Path:
    """Write the realisations of each group as arrays, a chunk at a time."""
    told = [
        {"point": dict(group.point), "noise": group.noise, "in_words": in_words(group.point),
         "columns": [[column.estimator, column.parameter, column.unit] for column in group.columns]}
        for group in record.groups
    ]  # fmt: skip
    with written_whole(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        with archive.open("groups.npy", "w") as file:
            np.lib.format.write_array(file, np.array(json.dumps(told)))
        for number, group in enumerate(record.groups):
            rows = sum(len(estimates.values) for _, estimates in store.chunks(number))
            for member in _members(number, rows, len(group.columns)):
                with archive.open(member.name, "w", force_zip64=True) as file:
                    header = {"descr": member.dtype.str, "fortran_order": False, "shape": member.shape}
                    write_array_header_1_0(file, header)
                    for part in _parts(member, store.chunks(number)):
                        file.write(part.tobytes())
    return path


def _members(number: int, rows: int, columns: int) -> Iterator[_Member]:
    yield _Member(f"realisations_{number}.npy", (rows,), np.dtype(np.int64),
                  lambda first, own: np.arange(first, first + len(own.values)))  # fmt: skip
    for at, name in enumerate(Estimates._fields):
        yield _Member(f"{name}_{number}.npy", (rows, columns), np.dtype(np.float64), lambda _, own, at=at: own[at])  # type: ignore[misc]


def _parts(member: _Member, chunks: Iterator[tuple[int, Estimates]]) -> Iterator[NDArray[Any]]:
    for first, estimates in chunks:
        yield np.ascontiguousarray(member.part(first, estimates), member.dtype)
