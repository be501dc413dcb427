"""Cases: finding them, running one, and writing what it yields."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jointfrf.cases.bolted_lap.compute import BoltedResult, compute_bolted
from jointfrf.cases.bolted_lap.figures import bolted_figures
from jointfrf.cases.bolted_lap.read import KIND, BoltedCase, read_bolted_case
from jointfrf.cases.bolted_lap.tables import bolted_json, bolted_summary, bolted_tables
from jointfrf.cases.known_joint.compute import CaseResult, compute
from jointfrf.cases.known_joint.figures import make_figures
from jointfrf.cases.known_joint.read import Case, read_case
from jointfrf.cases.known_joint.tables import Table, as_csv, make_tables, to_json
from jointfrf.cases.toml_table import read_toml
from jointfrf.files import write_file
from jointfrf.report.page import make_report, summary
from jointfrf.report.plots import Figure, draw
from jointfrf.report.plots import as_csv as figure_as_csv

__all__ = [
    "CaseOutput",
    "UnknownCaseError",
    "cases_folder",
    "find_case",
    "list_cases",
    "read_any_case",
    "run_case",
]


class UnknownCaseError(ValueError):
    """There is no such case."""


@dataclass(frozen=True)
class CaseOutput:
    """What running a case gave.

    Attributes
    ----------
    result : CaseResult or BoltedResult
    tables : list of Table
    summary : list of str
        A few sentences.
    report : Path
        The HTML report; CSV, PNG and JSON files stand beside it.
    """

    result: CaseResult | BoltedResult
    tables: list[Table]
    summary: list[str]
    report: Path


def cases_folder() -> Path | None:
    """Return the folder of the cases that come with the package: installed, or in the source tree; None if absent."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "data" / "cases", package.parents[1] / "cases"):
        if folder.is_dir() and any(folder.glob("*/case.toml")):
            return folder
    return None


def list_cases() -> list[Path]:
    """Return the folders of the cases that come with the package, in the order of their numbers."""
    folder = cases_folder()
    found = [] if folder is None else [path.parent for path in folder.glob("*/case.toml")]
    return sorted(found, key=lambda path: [int(x) for x in path.name.split("-")[0].split(".") if x.isdigit()])


def find_case(word: str) -> Path:
    """Return the folder of a case.

    Parameters
    ----------
    word : str
        A folder that holds a `case.toml`, or the name or the number of a case that comes with the package.

    Returns
    -------
    Path

    Raises
    ------
    UnknownCaseError
        There is none.
    """
    if (Path(word) / "case.toml").is_file():
        return Path(word)
    known = list_cases()
    for folder in known:
        if word in (folder.name, folder.name.split("-")[0]):
            return folder
    names = ", ".join(folder.name for folder in known) or "none"
    if Path(word).is_dir():
        raise UnknownCaseError(f"the folder {word} holds no case.toml; known cases: {names}")
    raise UnknownCaseError(f"there is no case {word!r}; known cases: {names}; or name a folder with a case.toml")


def run_case(
    folder: Path | str,
    out: Path | str = "results",
    *,
    realisations: int | None = None,
    pool: Executor | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> CaseOutput:
    """Run a case and write its report, tables and figures.

    Parameters
    ----------
    folder : Path or str
        Folder with `case.toml`.
    out : Path or str
        Results go to a folder with the case's name in there: `report.html`, `results.json`, `tables/*.csv`,
        `figures/*.png` and `figures/*.csv`.
    realisations : int, optional
        Instead of the number that the case names.
    pool : Executor, optional
        Processes that share the work, see `jointfrf.cases.known_joint.study.workers`.
    progress : callable
        Called with the numbers of chunks done and in all.

    Returns
    -------
    CaseOutput

    Raises
    ------
    FileContentError
        Something in the case is missing or wrong.
    OSError
        The results cannot be written.
    """
    if realisations is not None and realisations < 1:
        raise ValueError(f"realisations must be at least 1, not {realisations}")
    case = read_any_case(Path(folder))
    target = Path(out) / case.name
    for inner in ("tables", "figures"):
        (target / inner).mkdir(parents=True, exist_ok=True)
    result, tables, figures, sentences, content = _computed(case, realisations, pool, progress)
    drawn = list((map if pool is None else pool.map)(draw, figures))
    for figure, png in zip(figures, drawn, strict=True):
        write_file(target / "figures" / f"{figure.key}.png", png)
        write_file(target / "figures" / f"{figure.key}.csv", figure_as_csv(figure))
    for table in tables:
        write_file(target / "tables" / f"{table.key}.csv", as_csv(table))
    write_file(target / "results.json", json.dumps(content, indent=1) + "\n")
    report = target / "report.html"
    drawings = list(zip(figures, drawn, strict=True))
    write_file(report, make_report(case, result.n_realisations, sentences, tables, drawings))
    return CaseOutput(result, tables, sentences, report)


def read_any_case(folder: Path) -> Case | BoltedCase:
    """Read a case of whatever kind its `case.toml` names: a joint of known parameters by default.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    table = read_toml(folder / "case.toml")
    if "kind" in table and table.text("kind", (KIND,)) == KIND:
        return read_bolted_case(folder)
    return read_case(folder)


def _computed(
    case: Case | BoltedCase,
    realisations: int | None,
    pool: Executor | None,
    progress: Callable[[int, int], None],
) -> tuple[CaseResult | BoltedResult, list[Table], list[Figure], list[str], dict[str, Any]]:
    """Return the result of a case, its tables, figures, summary, and numbers for JSON."""
    if isinstance(case, BoltedCase):
        bolted = compute_bolted(case, realisations, pool, progress)
        tables = bolted_tables(bolted)
        return bolted, tables, bolted_figures(bolted), bolted_summary(bolted), bolted_json(bolted, tables)
    result = compute(case, realisations, pool, progress)
    tables = make_tables(result)
    return result, tables, make_figures(result), summary(result, tables), to_json(result, tables)
