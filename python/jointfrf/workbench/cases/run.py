"""Computation and report of a case: FRFs without noise, realisations, methods, tables and figures."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from jointfrf.files import OwnFolder, check_stated, clean_name
from jointfrf.workbench.cases.catalogue import read_case_and_kind
from jointfrf.workbench.cases.comparison import verdict_sentence
from jointfrf.workbench.cases.keys import Case
from jointfrf.workbench.cases.kind import CaseKind, Computed, EstimateGroup, Estimates, GroupEstimates
from jointfrf.workbench.cases.workers import Workers
from jointfrf.workbench.report.document import Document, Listing, Picture, Section, Words, make_document
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Figure, figure_csv
from jointfrf.workbench.report.table import Table, plain_rows, shown, table_csv

__all__ = ["CaseOutput", "begin_estimates", "compute_case", "numbered", "run_case", "write_results"]

#: Memory of a realisation of the noise, including chunks and estimates, bytes.
_REALISATION = 1_000
#: Least number of tasks of a group with as many realisations, so that all processes end at about the same time.
_TASKS = 32

CaseT = TypeVar("CaseT", bound=Case)
FrfsT = TypeVar("FrfsT")
ResultT = TypeVar("ResultT")


def compute_case(
    kind: CaseKind[CaseT, FrfsT, ResultT], case: CaseT, n_realisations: int, workers: Workers | None = None
) -> ResultT:
    """Return the result of a case.

    Parameters
    ----------
    kind : CaseKind
        Kind of the case.
    case : Case
        Case of this kind.
    n_realisations : int
        Number of realisations of each noise. A realisation depends only on the seed and its own number, not on the
        number of processes.
    workers : Workers, optional
        Worker processes; this process by default.

    Returns
    -------
    object
        Result of the class that the kind defines.

    See Also
    --------
    run_case : Computation and report of a case.
    """
    at_work = workers or Workers()
    frfs = at_work.begin(kind.frfs, case)()
    estimates = begin_estimates(kind.groups(case, frfs, None), n_realisations, at_work)
    return kind.result(Computed(case, frfs, n_realisations, estimates, at_work))


def begin_estimates(
    groups: Sequence[EstimateGroup], count: int, workers: Workers
) -> Callable[[], list[GroupEstimates]]:
    """Start the estimates of groups from realisations, and return a function that waits for them."""
    parts = []
    for number, group in enumerate(groups):
        size = group.side_by_side * max(1, count // (_TASKS * group.side_by_side))
        parts += [(number, first, min(size, count - first)) for first in range(0, count, size)]
    own, firsts, counts = ([part[i] for part in parts] for i in range(3))
    results = workers.map(_estimated, [groups[number] for number in own], firsts, counts)

    def collected() -> list[GroupEstimates]:
        found: list[list[tuple[Estimates, list[Any]]]] = [[] for _ in groups]
        for number, part in zip(own, workers.counted(results, len(parts)), strict=True):
            found[number].append(part)
        return [
            GroupEstimates(
                group,
                Estimates(*(np.concatenate(arrays) for arrays in zip(*(part for part, _ in done), strict=True))),
                [one for _, details in done for one in details],
            )
            for group, done in zip(groups, found, strict=True)
        ]

    return collected


def _estimated(group: EstimateGroup, first: int, count: int) -> tuple[Estimates, list[Any]]:
    return (group.source(first, count), []) if group.details is None else group.details(first, count)


@dataclass(frozen=True)
class CaseOutput:
    """Results of a case that was run.

    Attributes
    ----------
    case : Case
        Case with its keys.
    result : object
        Result of `compute_case`.
    tables : list of Table
        All tables of the report.
    figures : list of Figure
        All figures of the report.
    summary : list of Table
        Short tables of the outcome.
    report : Path
        Path of the HTML report; CSV, SVG and JSON files are in the same folder.
    printed : list of Table
        Tables for the terminal.
    """

    case: Case
    result: Any
    tables: list[Table]
    figures: list[Figure]
    summary: list[Table]
    report: Path
    printed: list[Table]


def numbered(case: Case, figures: Sequence[Figure]) -> list[Figure]:
    """Return figures with their numbers in the source, in the order of the source, then figures without a number."""
    named = [replace(figure, number=case.figure_numbers.get(figure.key, "")) for figure in figures]
    return sorted(named, key=lambda figure: (not figure.number, _number_key(figure.number)))


def _number_key(number: str) -> list[tuple[int, str]]:
    """Return the key that sorts "3-9a", "3-9b", "3-10", "4-32 and 4-33" in the order of the source."""
    return [(int(digits), letter) for digits, letter in re.findall(r"(\d+)([a-z]?)", number)]


def run_case(
    folder: Path | str,
    out: Path | str = "results",
    *,
    realisations: int | None = None,
    at_most: int | None = None,
    png: bool = False,
    workers: Workers | None = None,
    show: Callable[[Case, list[Table]], None] = lambda case, tables: None,
) -> CaseOutput:
    """Compute a case, write its report, tables and figures, and return them.

    Parameters
    ----------
    folder : Path or str
        Folder with `case.toml`.
    out : Path or str
        Folder for the results, default "results". A subfolder with the name of the case gets `report.html`,
        `results.json`, `tables/*.csv`, `figures/*.svg` and `figures/*.csv`.
    realisations : int, optional
        Number of realisations, default the number in `case.toml`.
    at_most : int, optional
        Largest number of realisations, no limit by default.
    png : bool
        Whether to write `figures/*.png`, too, default False.
    workers : Workers, optional
        Worker processes, see `jointfrf.workbench.cases.workers.started_workers`; this process by default.
    show : callable, optional
        Function called before figures are drawn, with the case and its tables for the terminal, the summary first.

    Returns
    -------
    CaseOutput

    Raises
    ------
    FileContentError
        Missing or invalid content of the case.
    OSError
        The results cannot be written.

    See Also
    --------
    compute_case : Computation without a report.
    jointfrf.workbench.cases.catalogue.find_case : Folder of a case.
    """
    for name, number in (("realisations", realisations), ("at_most", at_most)):
        if number is not None and number < 1:
            raise ValueError(f"{name} must be at least 1, not {number}")
    at_work = workers or Workers()
    case, kind = read_case_and_kind(Path(folder))
    count = case.realisations if realisations is None else realisations
    count = min(count, at_most or count)
    if realisations is None:
        stated = f"{case.folder / 'case.toml'}: realisations = {case.realisations}"
        check_stated(stated, _REALISATION * count)
    target = OwnFolder(Path(out)) / case.name
    for inner in ("tables", "figures"):
        (target / inner).make()
    result = compute_case(kind, case, count, at_work)
    tables = kind.tables(result)
    summary = kind.summary(result, tables)
    printed = [table for table in tables if table.key not in kind.not_printed]
    show(case, [*summary, *printed])
    figures = numbered(case, kind.figures(result))
    drawings = at_work.map(partial(draw, png=png), figures)
    pictures = [Picture(figure, drawing) for figure, drawing in zip(figures, drawings, strict=True)]
    sections = _sections(case, kind.headline, pictures, summary, tables)
    content = _common_numbers(case, count, tables) | kind.numbers(result)
    report = write_results(target, Document(case.title, _about(case, count), sections), tables, content)
    return CaseOutput(case, result, tables, figures, summary, report, printed)


def _sections(
    case: Case, headlines: Sequence[str], pictures: Sequence[Picture], summary: list[Table], tables: list[Table]
) -> list[Section]:
    """Return the sections of the page of a case; the summary contains the first existing figure of `headlines`."""
    keys = [one.figure.key for one in pictures]
    first = [pictures[keys.index(key)] for key in headlines if key in keys][:1]
    verdict = verdict_sentence(summary)
    texts = [Listing(name, _text(case.folder, file)) for name, file in (("", "README.md"), ("case.toml",) * 2)]
    return [
        Section("summary", "Summary", [Words([verdict] if verdict else [], "findings"), *first, *summary]),
        Section("tables", "Tables", tables),
        Section("figures", "Figures", [one for one in pictures if one not in first]),
        Section("subject", "The case", texts),
    ]


def write_results(folder: OwnFolder, document: Document, tables: Sequence[Table], content: Mapping[str, Any]) -> Path:
    """Write a page, its figures, tables and numbers to one folder, and return the path of the page."""
    drawings, numbers = (folder / "figures").make(), (folder / "tables").make()
    for figure, (png, svg) in (part for part in document.parts if isinstance(part, Picture)):
        for suffix, text in ((".png", png), (".svg", svg), (".csv", figure_csv(figure))):
            if text:
                drawings.write(clean_name(figure.key, suffix), text)
    for table in tables:
        numbers.write(clean_name(table.key, ".csv"), table_csv(table))
    folder.write("results.json", json.dumps(content, indent=1) + "\n")
    return folder.write("report.html", make_document(document))


def _about(case: Case, count: int) -> str:
    freq = case.freq_hz
    # A case of the user has no section of a source.
    where = f"Section {case.section}. " if case.section[:1].isdigit() else ""
    return (
        f"{where}{count} realisations of each noise level, seed {case.seed}; "
        f"{freq.size} frequency lines from {freq[0]:g} to {freq[-1]:g} Hz."
    )


def _text(folder: Path, name: str) -> str:
    """Return a text of the folder of a case for its page; links to other folders are ignored."""
    if not (folder / name).is_file() or (folder / name).is_symlink():
        return ""
    with OwnFolder(folder).opened(name) as file:
        return file.read().decode("utf-8", errors="replace")


def _common_numbers(case: Case, count: int, tables: list[Table]) -> dict[str, Any]:
    """Return the numbers of every kind of case for JSON, with the tables."""
    return {
        "case": case.name,
        "title": case.title,
        "section": case.section,
        "realisations": count,
        "seed": case.seed,
        "frequency_hz": {"first": case.freq_hz[0], "last": case.freq_hz[-1], "lines": case.freq_hz.size},
        "tables": {
            table.key: {"title": table.title, "columns": table.columns, "rows": plain_rows(table)}
            for table in map(shown, tables)
        },
    }
