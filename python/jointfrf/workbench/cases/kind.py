"""Parts of a kind of case: keys, FRFs, methods, tables and figures; the same parts serve studies."""

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
    "Computed",
    "EstimateColumn",
    "EstimateGroup",
    "Estimates",
    "Estimator",
    "GroupEstimates",
    "Pollution",
    "RealisationSource",
    "StudyChoice",
    "chosen_noises",
]


class Estimates(NamedTuple):
    """Estimates of realisations, one row each; NaN in the row of a realisation that failed.

    Attributes
    ----------
    values : ndarray, shape (count, n_columns)
        In the units of the columns.
    low, high : ndarray, shape (count, n_columns)
        Limits of the intervals of 95 %; NaN without intervals.
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
        NaN if it is unknown.
    bound : float
        Least standard deviation of an unbiased estimate (Cramer-Rao), NaN if it is unknown.
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
    noise, method : str
        Names.
    columns : tuple of EstimateColumn
    source : callable
        Gives the estimates of realisations, see `RealisationSource`.
    side_by_side : int
        Realisations that are best computed in one call.
    details : callable, optional
        Called like `source`, in its place for the report of a case: it also returns a list, with one object for each
        realisation that has further results (K* line by line, for figures).
    """

    noise: str
    method: str
    columns: tuple[EstimateColumn, ...]
    source: RealisationSource
    side_by_side: int = 1
    details: Callable[[int, int], tuple[Estimates, list[Any]]] | None = None


class GroupEstimates(NamedTuple):
    """Estimates of all realisations of a group, and the further results of some; see `EstimateGroup`."""

    group: EstimateGroup
    estimates: Estimates
    details: list[Any]


@dataclass(frozen=True)
class StudyChoice:
    """Selection of noises and estimators of a case for a study.

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


#: Noise of the user: exact FRFs, seed and number of the realisation to FRFs with noise.
Pollution = Callable[[ComplexArray, int, int], ComplexArray]


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
FrfsT = TypeVar("FrfsT")
ResultT = TypeVar("ResultT")


@dataclass(frozen=True)
class Computed(Generic[CaseT, FrfsT]):
    """A case whose realisations are under way.

    Attributes
    ----------
    case : Case
    frfs : object
        FRFs without noise, as `CaseKind.frfs` returned them.
    n_realisations : int
    estimates : callable
        Waits for the estimates of all groups.
    workers : Workers
        Processes that share further work.
    """

    case: CaseT
    frfs: FrfsT
    n_realisations: int
    estimates: Callable[[], list[GroupEstimates]]
    workers: Workers


@dataclass(frozen=True, kw_only=True)
class CaseKind(Generic[CaseT, FrfsT, ResultT]):
    """A kind of case: how to read one, and the steps from its structure to tables (`jointfrf.workbench.cases.run`).

    Attributes
    ----------
    keys : type
        Keys of `case.toml`; the ``tag`` is the value of the key `kind`.
    expected_keys : type
        Keys of `expected.toml`.
    read : callable
        ``read(common, keys, expected)`` returns the case: `common` is the part that all kinds share, `keys` and
        `expected` are the files, of the classes above. It raises FileContentError.
    frfs : callable
        ``frfs(case)`` returns the FRFs of the structure without noise.
    methods : tuple of str
        Names of the estimators that a study may take.
    takes_functions : bool
        Whether a study may take estimators and noises of the user.
    groups : callable
        ``groups(case, frfs, choice)`` returns the methods that are applied to realisations of noise, see
        `EstimateGroup`: the methods of a study, or without a choice (None) the methods of the report of the case.
    result : callable
        ``result(computed)`` returns the result, a class of the kind, from a `Computed`.
    tables : callable
        ``tables(result)``, in the order in which they are shown.
    figures : callable
        ``figures(result)``; their numbers in the source are added afterwards.
    summary : callable
        ``summary(result, tables)`` returns short tables.
    numbers : callable
        ``numbers(result)`` returns the part of `results.json` that this kind adds.
    not_printed : tuple of str
        Keys of tables that the report has but that are not printed.
    headline : tuple of str
        Keys of figures: the first of them that exists is shown before the tables of the report.

    Examples
    --------
    >>> from jointfrf.workbench.cases.catalogue import kind_named
    >>> kind_named("bolted-lap").methods
    ('ismm', 'compliance')
    """

    keys: type[CaseKeys]
    expected_keys: type[ExpectedKeys] = ExpectedKeys
    read: Callable[[Case, Any, Any], CaseT]
    frfs: Callable[[CaseT], FrfsT]
    methods: tuple[str, ...] = ()
    takes_functions: bool = False
    groups: Callable[[CaseT, FrfsT, StudyChoice | None], list[EstimateGroup]]
    result: Callable[[Computed[CaseT, FrfsT]], ResultT]
    tables: Callable[[ResultT], list[Table]]
    figures: Callable[[ResultT], list[Figure]]
    summary: Callable[[ResultT, list[Table]], list[Table]]
    numbers: Callable[[ResultT], dict[str, Any]]
    not_printed: tuple[str, ...] = ()
    headline: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The value of `kind` in `case.toml`."""
        return str(self.keys.__struct_config__.tag)

    def study_groups(self, case: CaseT, choice: StudyChoice) -> list[EstimateGroup]:
        """Return the estimates of a study of a case.

        Raises
        ------
        ValueError
            The case has no such noise or estimator, or takes no functions.
        """
        if not self.takes_functions and (choice.own_estimators or choice.own_noises):
            raise ValueError(f"own estimator or noise in a case of kind {self.name}; use a case of kind known-joint")
        for word in choice.estimators:
            if word not in self.methods:
                several = "one of " if len(self.methods) > 1 else ""
                hint = did_you_mean(word, self.methods) or f"; use {several}{', '.join(self.methods)}"
                raise ValueError(f"unknown estimator {word!r} in a case of kind {self.name}{hint}")
        return self.groups(case, self.frfs(case), choice)
