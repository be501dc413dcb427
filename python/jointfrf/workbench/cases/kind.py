"""What a kind of case consists of: keys, computing, tables, figures, what a study computes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cases.keys import Case, CaseKeys, ExpectedKeys, Noise
from jointfrf.workbench.cases.workers import Workers
from jointfrf.workbench.report.figure import Figure
from jointfrf.workbench.report.table import Table

__all__ = [
    "CaseKind",
    "EstimateColumn",
    "EstimateGroup",
    "Estimates",
    "Estimator",
    "Pollution",
    "RealisationSource",
    "StudyChoice",
    "chosen_noises",
]


class Estimates(NamedTuple):
    """What realisations gave, a row each; NaN where one gave nothing.

    Attributes
    ----------
    values : ndarray, shape (count, n_columns)
        In the units of the columns.
    low, high : ndarray, shape (count, n_columns)
        Limits of the intervals of 95 %; NaN where there are none.
    """

    values: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def without_intervals(cls, values: FloatArray) -> Estimates:
        """Return values of an estimator that gives no intervals."""
        missing = np.full(values.shape, np.nan)
        return cls(values, missing, missing)


#: Called with the number of the first realisation and how many. Realisation k does not depend on the others of a
#: call; the object can be sent to another process.
RealisationSource = Callable[[int, int], Estimates]

#: An estimator of the user: lines, Hz, FRFs at the joint DOFs j, then k, and names of the joint DOFs to stiffness of
#: all DOFs, then damping.
Estimator = Callable[[FloatArray, ComplexArray, tuple[str, ...]], FloatArray]


@dataclass(frozen=True)
class EstimateColumn:
    """One parameter by one estimator.

    Attributes
    ----------
    estimator, parameter, unit : str
    actual : float
        NaN where it is not known.
    bound : float
        Least standard deviation of an unbiased estimate (Cramer-Rao), NaN where it is not known.
    """

    estimator: str
    parameter: str
    unit: str
    actual: float
    bound: float


@dataclass(frozen=True)
class EstimateGroup:
    """Estimates that come from the same FRFs by one method.

    Attributes
    ----------
    noise : str
        Name of the noise.
    columns : tuple of EstimateColumn
    source : callable
        Gives the estimates of realisations, see `RealisationSource`.
    side_by_side : int
        Realisations that are best computed in one call.
    """

    noise: str
    columns: tuple[EstimateColumn, ...]
    source: RealisationSource
    side_by_side: int = 1


#: Noise of the user: exact FRFs, seed and number of the realisation to FRFs with noise.
Pollution = Callable[[ComplexArray, int, int], ComplexArray]


@dataclass(frozen=True)
class StudyChoice:
    """What of a case is studied.

    Attributes
    ----------
    noises : tuple of str
        Names; all noises of the case if empty.
    estimators : tuple of str
        Methods of the kind; those that the case names for each noise if empty.
    own_estimators : mapping of str to callable
        See `Estimator`.
    own_noises : mapping of str to callable
        See `Pollution`; in the place of the noises of the case.
    """

    noises: tuple[str, ...] = ()
    estimators: tuple[str, ...] = ()
    own_estimators: Mapping[str, Estimator] = field(default_factory=dict)
    own_noises: Mapping[str, Pollution] = field(default_factory=dict)


def chosen_noises(noises: Sequence[Noise], choice: StudyChoice) -> list[Noise]:
    """Return the noises of a case that a study takes.

    Raises
    ------
    ValueError
        The case has no noise of such a name.
    """
    names = [noise.name for noise in noises]
    for name in choice.noises:
        if name not in names:
            raise ValueError(f"unknown noise {name!r}{did_you_mean(name, names) or '; use one of ' + ', '.join(names)}")
    return [noise for noise in noises if noise.name in choice.noises or not choice.noises]


CaseT = TypeVar("CaseT", bound=Case)
ResultT = TypeVar("ResultT")


@dataclass(frozen=True, kw_only=True)
class CaseKind(Generic[CaseT, ResultT]):
    """A kind of case: all that is needed to read one, run it and show what it yields.

    Attributes
    ----------
    keys : type
        What `case.toml` may hold; its ``tag`` is the value of the key `kind`.
    expected_keys : type
        What `expected.toml` may hold.
    read : callable
        ``read(common, keys, expected)`` returns the case: `common` is what every case says, `keys` and `expected` are
        what the files say, of the classes above. It raises FileContentError.
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
    groups : callable, optional
        ``groups(case, choice)`` returns what a study of the case computes, see `EstimateGroup`. It raises ValueError.
    not_printed : tuple of str
        Keys of tables that the report has but that are not printed.
    headline : tuple of str
        Keys of figures: the first of them that there is stands before the tables of the report.

    Examples
    --------
    >>> from jointfrf.workbench.cases.catalogue import KINDS
    >>> KINDS["bolted-lap"].name
    'bolted-lap'
    """

    keys: type[CaseKeys]
    expected_keys: type[ExpectedKeys] = ExpectedKeys
    read: Callable[[Case, Any, Any], CaseT]
    compute: Callable[[CaseT, int, Workers], ResultT]
    tables: Callable[[ResultT], list[Table]]
    figures: Callable[[ResultT], list[Figure]]
    summary: Callable[[ResultT, list[Table]], list[Table]]
    numbers: Callable[[ResultT], dict[str, Any]]
    groups: Callable[[CaseT, StudyChoice], list[EstimateGroup]] | None = None
    not_printed: tuple[str, ...] = ()
    headline: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The value of `kind` in `case.toml`."""
        return str(self.keys.__struct_config__.tag)
