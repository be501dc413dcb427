"""What a kind of case consists of: reading, computing, tables, figures, summary, numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from jointfrf.cases.studied import StudiedGroup, StudyChoice
from jointfrf.cases.workers import Workers
from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.figure import Figure
from jointfrf.report.table import Table
from jointfrf.toml.keys import KeyTable
from jointfrf.toml.table import TomlTable

__all__ = ["Case", "CaseKind"]


@dataclass(frozen=True, kw_only=True)
class Case:
    """What every case says, of whatever kind.

    Attributes
    ----------
    folder : Path
        Where the case stands.
    title, section : str
        What it is, and where the source treats it.
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    realisations, seed : int
        Realisations of the noise, and the seed they come from.
    figure_numbers : mapping of str to str
        Figure to its number in the source.
    """

    folder: Path
    title: str
    section: str
    freq_hz: FloatArray
    realisations: int
    seed: int
    figure_numbers: Mapping[str, str]

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name


CaseT = TypeVar("CaseT", bound=Case)
ResultT = TypeVar("ResultT")


@dataclass(frozen=True)
class CaseKind(Generic[CaseT, ResultT]):
    """A kind of case: all that is needed to read one, run it and show what it yields.

    Attributes
    ----------
    name : str
        The value of `kind` in `case.toml`.
    read : callable
        ``read(common, table, expected)`` returns the case: `common` is what every case says, already read; `table` is
        `case.toml` and `expected` is `expected.toml` (without keys where there is none), from which it takes the keys
        of its kind. A key that nobody asks for is an error afterwards. It raises FileContentError.
    compute : callable
        ``compute(case, n_realisations, workers)`` returns the result, a class of the kind.
    tables : callable
        ``tables(result)``, in the order in which they are shown.
    figures : callable
        ``figures(result)``; their numbers in the source are added afterwards.
    summary : callable
        ``summary(result, tables)`` returns short tables that say what came out.
    numbers : callable
        ``numbers(result)`` returns what `results.json` holds beside the common part and the tables.
    studied : callable, optional
        ``studied(case, choice)`` returns what a study of the case computes, see `jointfrf.cases.studied.StudiedGroup`.
        It raises ValueError.
    not_printed : tuple of str
        Keys of tables that stand in the report but are not printed.
    keys, expected_keys : KeyTable, optional
        What `case.toml` and `expected.toml` may hold; then a misspelt key is found before anything else is wrong, and
        the reference of all keys has a part about the kind.

    Examples
    --------
    >>> from jointfrf.cases.kinds import KINDS
    >>> list(KINDS)
    ['known-joint', 'bolted-lap', 'modelled-joint']
    """

    name: str
    read: Callable[[Case, TomlTable, TomlTable], CaseT]
    compute: Callable[[CaseT, int, Workers], ResultT]
    tables: Callable[[ResultT], list[Table]]
    figures: Callable[[ResultT], list[Figure]]
    summary: Callable[[ResultT, list[Table]], list[Table]]
    numbers: Callable[[ResultT], dict[str, Any]]
    studied: Callable[[CaseT, StudyChoice], list[StudiedGroup]] | None = None
    not_printed: tuple[str, ...] = ()
    keys: KeyTable | None = None
    expected_keys: KeyTable | None = None
