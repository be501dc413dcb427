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
        Estimates in the units of the columns.
    low, high : ndarray, shape (count, n_columns)
        Limits of the 95 % intervals; NaN without intervals.
    """

    values: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def without_intervals(cls, values: FloatArray) -> Estimates:
        """Return estimates of an estimator without intervals."""
        missing = np.full(values.shape, np.nan)
        return cls(values, missing, missing)


#: Function of the number of the first realisation and the count. Realisation k does not depend on other realisations
#: of a call; the object can be sent to another process.
RealisationSource = Callable[[int, int], Estimates]

#: Estimator of the user: a function of the frequency lines, Hz, FRFs at the joint DOFs j, then k, and names of the
#: joint DOFs that returns stiffness of all DOFs, then damping.
Estimator = Callable[[FloatArray, ComplexArray, tuple[str, ...]], FloatArray]


@dataclass(frozen=True)
class EstimateColumn:
    """Column of estimates: one parameter by one estimator.

    Attributes
    ----------
    estimator, parameter, unit : str
        Names of the estimator and of the parameter, and unit of the parameter.
    actual : float
        Actual value; NaN if unknown.
    bound : float
        Least standard deviation of an unbiased estimate (Cramer-Rao); NaN if unknown.
    """

    estimator: str
    parameter: str
    unit: str
    actual: float
    bound: float


@dataclass(frozen=True)
class EstimateGroup:
    """Group of estimates from the same FRFs by one method.

    Attributes
    ----------
    noise, method : str
        Names of the noise and of the method.
    columns : tuple of EstimateColumn
        Columns of the estimates.
    source : callable
        Function that returns the estimates of realisations, see `RealisationSource`.
    side_by_side : int
        Best number of realisations in one call, default 1.
    details : callable, optional
        Function with the arguments of `source`, used for the report of a case. In addition to estimates, it returns a
        list with further results of some realisations, such as K* line by line for figures.
    """

    noise: str
    method: str
    columns: tuple[EstimateColumn, ...]
    source: RealisationSource
    side_by_side: int = 1
    details: Callable[[int, int], tuple[Estimates, list[Any]]] | None = None


class GroupEstimates(NamedTuple):
    """Estimates of all realisations of a group, and further results of some realisations; see `EstimateGroup`."""

    group: EstimateGroup
    estimates: Estimates
    details: list[Any]


@dataclass(frozen=True)
class StudyChoice:
    """Selection of noises and estimators of a case for a study.

    Attributes
    ----------
    noises : tuple of str
        Names of noises; all noises of the case if empty.
    estimators : tuple of str
        Methods of the kind; if empty, the methods of each noise of the case.
    own_estimators : mapping of str to callable
        Estimators of the user, see `Estimator`.
    own_noises : mapping of str to callable
        Noises of the user, see `Pollution`; they replace the noises of the case.
    """

    noises: tuple[str, ...] = ()
    estimators: tuple[str, ...] = ()
    own_estimators: Mapping[str, Estimator] = field(default_factory=dict)
    own_noises: Mapping[str, Pollution] = field(default_factory=dict)


#: Noise of the user: a function of exact FRFs, seed and number of the realisation that returns FRFs with noise.
Pollution = Callable[[ComplexArray, int, int], ComplexArray]


def chosen_noises(noises: Sequence[Noise], choice: StudyChoice) -> list[Noise]:
    """Return the noises of a case in a study.

    Raises
    ------
    ValueError
        The case has no noise of this name.
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
    """Case whose estimates are being computed.

    Attributes
    ----------
    case : Case
        Case with its keys.
    frfs : object
        FRFs without noise, the result of `CaseKind.frfs`.
    n_realisations : int
        Number of realisations of each noise.
    estimates : callable
        Function that waits for the estimates of all groups and returns them.
    workers : Workers
        Processes for further work.
    """

    case: CaseT
    frfs: FrfsT
    n_realisations: int
    estimates: Callable[[], list[GroupEstimates]]
    workers: Workers


@dataclass(frozen=True, kw_only=True)
class CaseKind(Generic[CaseT, FrfsT, ResultT]):
    """Kind of case: reading, and the steps from structure to tables (`jointfrf.workbench.cases.run`).

    Attributes
    ----------
    keys : type
        Keys of `case.toml`; the ``tag`` is the value of the key `kind`.
    expected_keys : type
        Keys of `expected.toml`.
    read : callable
        Function ``read(common, keys, expected)`` that returns the case, or raises FileContentError. `common` is the
        part that all kinds share; `keys` and `expected` are the contents of the files, of the classes above.
    frfs : callable
        Function ``frfs(case)`` that returns the FRFs of the structure without noise.
    methods : tuple of str
        Names of the estimators of studies.
    takes_functions : bool
        Whether studies accept estimators and noises of the user, default False.
    groups : callable
        Function ``groups(case, frfs, choice)`` that returns a list of `EstimateGroup`: the methods of a study, or the
        methods of the report of the case if `choice` is None.
    result : callable
        Function ``result(computed)`` that returns the result, a class of the kind, from a `Computed`.
    tables : callable
        Function ``tables(result)`` that returns the tables in the order of the report.
    figures : callable
        Function ``figures(result)`` that returns the figures without their numbers in the source.
    summary : callable
        Function ``summary(result, tables)`` that returns short tables.
    numbers : callable
        Function ``numbers(result)`` that returns the part of `results.json` from this kind.
    not_printed : tuple of str
        Keys of tables that appear only in the report.
    headline : tuple of str
        Keys of figures; the first existing figure appears before the tables of the report.

    See Also
    --------
    jointfrf.workbench.cases.run.run_case : Computation and report of a case.

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
        """Value of `kind` in `case.toml`."""
        return str(self.keys.__struct_config__.tag)

    def study_groups(self, case: CaseT, choice: StudyChoice) -> list[EstimateGroup]:
        """Return the groups of estimates of a study of a case.

        Raises
        ------
        ValueError
            The case has no such noise or estimator, or accepts no functions of the user.
        """
        if not self.takes_functions and (choice.own_estimators or choice.own_noises):
            raise ValueError(f"own estimator or noise in a case of kind {self.name}; use a case of kind known-joint")
        for word in choice.estimators:
            if word not in self.methods:
                several = "one of " if len(self.methods) > 1 else ""
                hint = did_you_mean(word, self.methods) or f"; use {several}{', '.join(self.methods)}"
                raise ValueError(f"unknown estimator {word!r} in a case of kind {self.name}{hint}")
        return self.groups(case, self.frfs(case), choice)
