"""Finding cases, reading one, running one and writing what it yields."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from jointfrf.choices import CASE_KINDS
from jointfrf.files import OwnFolder, check_stated, clean_name
from jointfrf.toml.declared import read_keys
from jointfrf.toml.documents import key_reference
from jointfrf.toml.table import TomlTable, read_toml
from jointfrf.workbench.cases.comparison import verdict_sentence
from jointfrf.workbench.cases.keys import Case, CaseKeys, ExpectedKeys
from jointfrf.workbench.cases.kind import CaseKind
from jointfrf.workbench.cases.workers import Workers
from jointfrf.workbench.report.document import Document, Listing, Picture, Section, Words, make_document
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Figure, figure_csv
from jointfrf.workbench.report.table import Table, plain_rows, shown, table_csv

__all__ = [
    "KINDS",
    "CaseOutput",
    "UnknownCaseError",
    "case_title",
    "cases_folder",
    "find_case",
    "key_page",
    "list_cases",
    "numbered",
    "read_case",
    "read_case_and_kind",
    "read_case_of",
    "run_case",
    "write_results",
]


class _Kinds(Mapping[str, CaseKind[Any, Any]]):
    """Kinds of cases by name, each the `KIND` of the package of this name, imported when it is needed."""

    def __init__(self, *names: str) -> None:
        self._names = names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __getitem__(self, name: str) -> CaseKind[Any, Any]:
        if name not in self._names:
            raise KeyError(name)
        kind: CaseKind[Any, Any] = import_module(f"jointfrf.workbench.cases.{name.replace('-', '_')}").KIND
        return kind


#: Bytes of memory of a realisation of the noise, chunks and estimates included.
_REALISATION = 1_000
#: The kinds of cases, by the value of `kind` in `case.toml`.
KINDS: Mapping[str, CaseKind[Any, Any]] = _Kinds(*CASE_KINDS)


class UnknownCaseError(ValueError):
    """There is no such case; one line, whatever word was given."""

    def __init__(self, message: str) -> None:
        super().__init__("\\n".join(message.splitlines()))


@dataclass(frozen=True)
class CaseOutput:
    """What running a case gave.

    Attributes
    ----------
    case : Case
    result : object
        What the `compute` of its kind returned.
    tables : list of Table
    figures : list of Figure
    summary : list of Table
        What came out, in short.
    report : Path
        The HTML report; CSV, SVG and JSON files are beside it.
    printed : list of Table
        The tables that are worth printing.
    """

    case: Case
    result: Any
    tables: list[Table]
    figures: list[Figure]
    summary: list[Table]
    report: Path
    printed: list[Table]


def cases_folder() -> Path | None:
    """Return the folder of the cases that come with the package: installed, or in the source tree; None if absent."""
    package = Path(__file__).resolve().parents[2]
    for folder in (package / "data" / "cases", package.parents[1] / "cases"):
        if folder.is_dir() and any(folder.glob("*/case.toml")):
            return folder
    return None


def list_cases() -> list[Path]:
    """Return the folders of the cases that come with the package, in the order of their numbers; others last."""
    folder = cases_folder()
    found = [] if folder is None else [path.parent for path in folder.glob("*/case.toml")]

    def place(path: Path) -> tuple[bool, list[int], str]:
        numbers = [int(x) for x in re.findall(r"\d+", path.name.split("-")[0])]
        return not numbers, numbers, path.name

    return sorted(found, key=place)


def case_title(folder: Path) -> str:
    """Return the title of a case without reading the rest of it."""
    return str(read_toml(folder / "case.toml").content.get("title", ""))


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
        raise UnknownCaseError(f"the folder {word} has no case.toml; name another folder, or one of the cases {names}")
    raise UnknownCaseError(f"unknown case {word!r}; name a folder with a case.toml, or one of the cases {names}")


def read_case(folder: Path, kinds: Mapping[str, CaseKind[Any, Any]] = KINDS) -> Case:
    """Read a case of whatever kind its `case.toml` names.

    Parameters
    ----------
    folder : Path
        Folder with `case.toml` and, where something is known about the case, `expected.toml`.
    kinds : mapping of str to CaseKind
        Kinds that may be named; the first is that of a file that names none.

    Returns
    -------
    Case
        What the `read` of its kind returned.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    return read_case_and_kind(folder, kinds)[0]


def read_case_and_kind(
    folder: Path, kinds: Mapping[str, CaseKind[Any, Any]] = KINDS
) -> tuple[Case, CaseKind[Any, Any]]:
    """Read a case as `read_case` does, and return its kind, too."""
    path = folder / "expected.toml"
    expected = read_toml(path) if path.is_file() else TomlTable({}, str(path))
    return read_case_of(folder, read_toml(folder / "case.toml"), expected, kinds)


def read_case_of(
    folder: Path, table: TomlTable, expected: TomlTable, kinds: Mapping[str, CaseKind[Any, Any]] = KINDS
) -> tuple[Case, CaseKind[Any, Any]]:
    """Read a case from tables: of its `case.toml`, and of what is known about it."""
    name = table.content.get("kind", next(iter(kinds)))
    if not isinstance(name, str) or name not in kinds:
        raise table.error("kind", f"one of {', '.join(kinds)}")
    kind = kinds[name]
    keys, known = read_keys(table, kind.keys), read_keys(expected, kind.expected_keys)
    case: Case = kind.read(_common(folder, keys, known), keys, known)
    return case, kind


def _common(folder: Path, keys: CaseKeys, expected: ExpectedKeys) -> Case:
    """Return what every case says."""
    return Case(
        folder=folder.resolve(),
        title=keys.title,
        section=keys.section,
        freq_hz=keys.frequency.lines(),
        realisations=keys.study.realisations,
        seed=keys.study.seed,
        figure_numbers=expected.figures,
    )


#: What the reference of keys begins with.
_KEYS_HEAD = """# Keys of case files

<!-- jointfrf cases --keys > docs/case-keys.md -->

A case is a folder with a `case.toml` and, where something is known about it beforehand, an `expected.toml`;
[cases](cases.md) says how one is run, `jointfrf new KIND FOLDER` writes one to begin with. SI units. Files that a key
names are relative to the folder. A key that is not in this list is an error that lists those that are. `DOF` in a key
stands for the name of a joint DOF (`k_theta_z`).

"""


def key_page(kinds: Mapping[str, CaseKind[Any, Any]] = KINDS) -> str:
    """Return the reference of all keys of kinds of cases, as Markdown."""
    tops = {f"case.toml of kind {name}": kind.keys for name, kind in kinds.items()}
    known = {f"expected.toml of kind {name}": kind.expected_keys for name, kind in kinds.items()}
    return _KEYS_HEAD + key_reference({name: top for each in zip(tops.items(), known.items(), strict=True)
                                       for name, top in each})  # fmt: skip


def numbered(case: Case, figures: Sequence[Figure]) -> list[Figure]:
    """Give figures their numbers in the source and its order; those that have none follow as they are."""
    named = [replace(figure, number=case.figure_numbers.get(figure.key, "")) for figure in figures]
    return sorted(named, key=lambda figure: (not figure.number, _number_key(figure.number)))


def _number_key(number: str) -> list[tuple[int, str]]:
    """Order "3-9a", "3-9b", "3-10", "4-32 and 4-33" in the order of the source."""
    return [(int(digits), letter) for digits, letter in re.findall(r"(\d+)([a-z]?)", number)]


def run_case(
    folder: Path | str,
    out: Path | str = "results",
    *,
    realisations: int | None = None,
    at_most: int | None = None,
    png: bool = False,
    workers: Workers | None = None,
    kinds: Mapping[str, CaseKind[Any, Any]] = KINDS,
    show: Callable[[Case, list[Table]], None] = lambda case, tables: None,
) -> CaseOutput:
    """Run a case and write its report, tables and figures.

    Parameters
    ----------
    folder : Path or str
        Folder with `case.toml`.
    out : Path or str
        Results go to a folder with the case's name in there: `report.html`, `results.json`, `tables/*.csv`,
        `figures/*.svg` and `figures/*.csv`.
    realisations : int, optional
        Number of realisations, default the number that the case names.
    at_most : int, optional
        Largest number of realisations.
    png : bool
        Whether to write `figures/*.png`, too.
    workers : Workers, optional
        Processes that share the work, see `jointfrf.workbench.cases.workers.started_workers`; this process by default.
    kinds : mapping of str to CaseKind
        As in `read_case`.
    show : callable, optional
        Called with the case and its tables that are worth printing, the summary first, before figures are drawn.

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
    for name, number in (("realisations", realisations), ("at_most", at_most)):
        if number is not None and number < 1:
            raise ValueError(f"{name} must be at least 1, not {number}")
    at_work = workers or Workers()
    case, kind = read_case_and_kind(Path(folder), kinds)
    count = case.realisations if realisations is None else realisations
    count = min(count, at_most or count)
    if realisations is None:
        stated = f"{case.folder / 'case.toml'}: realisations = {case.realisations}"
        check_stated(stated, _REALISATION * count)
    target = OwnFolder(Path(out)) / case.name
    for inner in ("tables", "figures"):
        (target / inner).make()
    result = kind.compute(case, count, at_work)
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
    """Return the sections of the page of a case; the first figure there is of `headlines` stands in the summary."""
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
    """Write a page and, beside it, its figures, tables and numbers; return the path of the page."""
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
    # A case of the user's own has no section of a source.
    where = f"Section {case.section}. " if case.section[:1].isdigit() else ""
    return (
        f"{where}{count} realisations of each noise level, seed {case.seed}; "
        f"{freq.size} frequency lines from {freq[0]:g} to {freq[-1]:g} Hz."
    )


def _text(folder: Path, name: str) -> str:
    """Return a text of the folder of a case, for its page; not that of another folder, by a link."""
    if not (folder / name).is_file() or (folder / name).is_symlink():
        return ""
    with OwnFolder(folder).opened(name) as file:
        return file.read().decode("utf-8", errors="replace")


def _common_numbers(case: Case, count: int, tables: list[Table]) -> dict[str, Any]:
    """Return what the JSON of every kind of case begins with, and its tables."""
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
