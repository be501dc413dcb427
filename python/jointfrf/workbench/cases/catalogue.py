"""List of cases, reading of a case, and the kinds of cases with their keys."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from jointfrf.choices import CASE_KINDS
from jointfrf.toml.declared import Keys, read_keys
from jointfrf.toml.documents import key_reference
from jointfrf.toml.table import TomlTable, read_toml
from jointfrf.workbench.cases.keys import Case
from jointfrf.workbench.cases.kind import CaseKind

__all__ = [
    "UnknownCaseError",
    "case_title",
    "cases_folder",
    "find_case",
    "key_page",
    "kind_named",
    "list_cases",
    "read_case",
    "read_case_and_kind",
    "read_case_of",
]


class UnknownCaseError(ValueError):
    """Error for an unknown case, with a message of one line."""

    def __init__(self, message: str) -> None:
        super().__init__("\\n".join(message.splitlines()))


def cases_folder() -> Path | None:
    """Return the folder of the cases of the package, installed or in the source tree; None if it does not exist."""
    package = Path(__file__).resolve().parents[2]
    for folder in (package / "data" / "cases", package.parents[1] / "cases"):
        if folder.is_dir() and any(folder.glob("*/case.toml")):
            return folder
    return None


def list_cases() -> list[Path]:
    """Return the folders of the cases of the package in the order of their numbers, then folders without a number."""
    folder = cases_folder()
    found = [] if folder is None else [path.parent for path in folder.glob("*/case.toml")]

    def place(path: Path) -> tuple[bool, list[int], str]:
        numbers = [int(x) for x in re.findall(r"\d+", path.name.split("-")[0])]
        return not numbers, numbers, path.name

    return sorted(found, key=place)


def case_title(folder: Path) -> str:
    """Return the title of a case without its other keys."""
    return str(read_toml(folder / "case.toml").content.get("title", ""))


def find_case(word: str) -> Path:
    """Return the folder of a case.

    Parameters
    ----------
    word : str
        Folder with a `case.toml`, or the name or the number of a case of the package.

    Returns
    -------
    Path

    Raises
    ------
    UnknownCaseError
        No case has this folder, name or number.

    See Also
    --------
    list_cases : Folders of all cases of the package.
    read_case : Case in a folder.
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


def kind_named(name: str) -> CaseKind[Any, Any, Any]:
    """Return a kind of case by the value of `kind` in `case.toml`."""
    kind: CaseKind[Any, Any, Any] = import_module(f"jointfrf.workbench.cases.{name.replace('-', '_')}").KIND
    return kind


def read_case(folder: Path) -> Case:
    """Return the case in a folder, of the kind in its `case.toml`.

    Parameters
    ----------
    folder : Path
        Folder with `case.toml` and, if there are expected results, `expected.toml`.

    Returns
    -------
    Case
        Case of the class of its kind.

    Raises
    ------
    FileContentError
        Invalid content; the message is one sentence with the file and the key.

    See Also
    --------
    find_case : Folder of a case.
    jointfrf.workbench.cases.run.run_case : Computation and report of a case.
    """
    return read_case_and_kind(folder)[0]


def read_case_and_kind(folder: Path) -> tuple[Case, CaseKind[Any, Any, Any]]:
    """Return the case in a folder and its kind."""
    path = folder / "expected.toml"
    expected = read_toml(path) if path.is_file() else TomlTable({}, str(path))
    return read_case_of(folder, read_toml(folder / "case.toml"), expected)


def read_case_of(folder: Path, table: TomlTable, expected: TomlTable) -> tuple[Case, CaseKind[Any, Any, Any]]:
    """Return a case and its kind from the tables of its `case.toml` and its `expected.toml`."""
    name = table.content.get("kind", CASE_KINDS[0])
    if name not in CASE_KINDS:
        raise table.error("kind", f"one of {', '.join(CASE_KINDS)}")
    kind = kind_named(name)
    keys, known = read_keys(table, kind.keys), read_keys(expected, kind.expected_keys)
    common = Case(
        folder=folder.resolve(),
        title=keys.title,
        section=keys.section,
        freq_hz=keys.frequency.lines(),
        realisations=keys.study.realisations,
        seed=keys.study.seed,
        figure_numbers=known.figures,
    )
    case: Case = kind.read(common, keys, known)
    return case, kind


#: First paragraph of the reference of keys.
_KEYS_HEAD = """# Keys of case files

<!-- jointfrf cases --keys > docs/case-keys.md -->

A case is a folder with a `case.toml` and, for a comparison with expected results, an `expected.toml`. To run a case,
see [cases](cases.md). To write a first case, run `jointfrf new KIND FOLDER`. All values are in SI units. Paths of files
are relative to the folder. A key that is not on this page is an error, and the message lists the valid keys. `DOF` in a
key stands for the name of a joint DOF (`k_theta_z`).

"""


def key_page() -> str:
    """Return the reference of all keys of all kinds of cases, as Markdown."""
    tops: dict[str, type[Keys]] = {}
    for name in CASE_KINDS:
        kind = kind_named(name)
        tops |= {f"case.toml of kind {name}": kind.keys, f"expected.toml of kind {name}": kind.expected_keys}
    return _KEYS_HEAD + key_reference(tops)
