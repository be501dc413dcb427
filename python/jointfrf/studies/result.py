"""What a study has found: summary, single realisations, tables, figures, files."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import FloatArray, as_integer
from jointfrf.report.figure import Figure
from jointfrf.report.table import Table, as_text
from jointfrf.studies.figures import study_figures
from jointfrf.studies.files import write_npz_of, write_parquet_of, write_report_of
from jointfrf.studies.store import GroupRecord, Span, StudyRecord, StudyStore
from jointfrf.studies.summary import ParameterSummary, summarise
from jointfrf.studies.tables import study_table

__all__ = ["StudyResult", "read_study"]


@dataclass(frozen=True)
class StudyResult:
    """Results of a study, read from its folder as they are asked for.

    Attributes
    ----------
    folder : Path
    """

    folder: Path

    @property
    def _store(self) -> StudyStore:
        return StudyStore(self.folder)

    @cached_property
    def record(self) -> StudyRecord:
        """What the study is: case, seed, realisations, groups."""
        return self._store.read()

    @property
    def groups(self) -> tuple[GroupRecord, ...]:
        """Point of the design, noise and columns of each group of estimates."""
        return self.record.groups

    @property
    def missing(self) -> int:
        """How many realisations of groups have not been computed."""
        wanted = Span(0, self.record.realisations)
        return sum(span.count for own in self._store.missing(len(self.groups), wanted) for span in own)

    @cached_property
    def summary(self) -> list[ParameterSummary]:
        """Each parameter by each estimator at each point of the design."""
        return summarise(self._store)

    def estimates(self, group: int) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
        """Return the single realisations of a group.

        Parameters
        ----------
        group : int
            Number in `groups`.

        Returns
        -------
        numbers : ndarray of int, shape (r,)
            Of the realisations.
        values, low, high : ndarray, shape (r, n_columns)
            Estimates and the limits of their 95 % intervals in the units of the columns; NaN where there are none.

        Raises
        ------
        ValueError
            There is no such group.
        """
        if not 0 <= as_integer("group", group) < len(self.groups):
            raise ValueError(f"group must be from 0 to {len(self.groups) - 1}, not {group}")
        columns = len(self.groups[group].columns)
        numbers, parts = [np.empty(0, np.int64)], [np.empty((3, 0, columns))]
        for first, estimates in self._store.chunks(group):
            numbers.append(np.arange(first, first + len(estimates.values)))
            parts.append(np.array(estimates))
        values, low, high = np.concatenate(parts, axis=1)
        return np.concatenate(numbers), values, low, high

    @property
    def table(self) -> Table:
        """The summary as a table."""
        return study_table(self.record, self.summary, self.missing)

    @property
    def figures(self) -> list[Figure]:
        """Distributions; over each factor: errors beside the bound, and coverage."""
        return study_figures(self.record, self.summary)

    def to_dict(self) -> dict[str, Any]:
        """Return case, design and summary as JSON holds them; what is not a number is None."""
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
            The page.

        Raises
        ------
        MissingPackageError
            matplotlib or jinja2 is not installed.
        """
        return write_report_of(self.folder, self.record, self.table, self.figures, self.to_dict())

    def save_parquet(self, path: str | Path) -> Path:
        """Write single realisations as a Parquet file, a row for each estimate; memory does not depend on their number.

        Parameters
        ----------
        path : str or Path

        Returns
        -------
        Path

        Raises
        ------
        MissingPackageError
            pyarrow is not installed.
        """
        return write_parquet_of(self._store, self.record, Path(path))

    def save_npz(self, path: str | Path) -> Path:
        """Write single realisations as an NPZ file; memory does not depend on their number.

        Parameters
        ----------
        path : str or Path
            For group g of `groups` it holds ``realisations_g``, shape (r,), and ``values_g``, ``low_g``, ``high_g``,
            shape (r, n_columns); ``groups`` says in JSON what they are.

        Returns
        -------
        Path
        """
        return write_npz_of(self._store, self.record, Path(path))

    def __str__(self) -> str:
        """Return the summary as text."""
        return as_text(self.table)


def read_study(folder: str | Path) -> StudyResult:
    """Read what a study has found, finished or not.

    Parameters
    ----------
    folder : str or Path

    Returns
    -------
    StudyResult

    Raises
    ------
    FileContentError
        The folder holds no study.
    """
    StudyStore(Path(folder)).read()
    return StudyResult(Path(folder))
