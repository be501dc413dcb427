"""The printed values of a source that noise was added to, each with what is needed to compute it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.substructuring.methods import STIFFNESS_METHODS
from jointfrf.workbench.cases.keys import BandSet
from jointfrf.workbench.cases.known_joint.keys import ExpectedErrors, ExpectedParameters, KnownJointCase

#: Rounding of a printed parameter, as a share of its size, and of an error, percent.
_PARAMETER_DIGITS, _ERROR_DIGITS = 1e-3, 0.005
_ERRORS = ("amplitude", "frequency")


@dataclass(frozen=True)
class ParameterQuantity:
    """An identified parameter: mean over bands; `index` counts stiffness of all DOFs, then damping."""

    method: str
    bands: BandSet
    index: int


@dataclass(frozen=True)
class ErrorQuantity:
    """An error of an FRF regenerated from all identified parameters; `index` 0 is (4.11), amplitude, 1 is (4.12)."""

    method: str
    bands: BandSet
    known: ExpectedErrors
    index: int


@dataclass(frozen=True)
class PrintedValue:
    """A printed value.

    Attributes
    ----------
    name : str
    value : float
    quantity : ParameterQuantity or ErrorQuantity
    unit : float
        As in `score`.
    """

    name: str
    value: float
    quantity: ParameterQuantity | ErrorQuantity
    unit: float

    def resolution(self, step: float) -> float:
        """Return the standard deviation of what the value is rounded to, with lines `step` Hz apart; in its unit."""
        if isinstance(self.quantity, ParameterQuantity):
            return _PARAMETER_DIGITS * self.unit
        line = 0.0 if self.quantity.index == 0 else 100 * step / float(np.mean(self.quantity.known.band))
        return float(np.hypot(_ERROR_DIGITS, line / np.sqrt(12)))


@dataclass(frozen=True)
class PrintedTable:
    """Values that a source prints together, and one way to compute them.

    Attributes
    ----------
    source : str
    way : str
        Method and bands.
    level : float
        Printed level of the noise: that of the first noise of the case that the table stands beside.
    values : tuple of PrintedValue
    """

    source: str
    way: str
    level: float
    values: tuple[PrintedValue, ...]

    @property
    def content(self) -> tuple[tuple[str, float], ...]:
        """What is printed: tables of the same content are the same one, computed in different ways."""
        return tuple((one.name, one.value) for one in self.values)


def printed_tables(cases: Iterable[KnownJointCase]) -> list[PrintedTable]:
    """Collect what the sources of cases of one structure and joint print, each content and way once.

    Parameters
    ----------
    cases : iterable of KnownJointCase

    Returns
    -------
    list of PrintedTable
    """
    found: dict[tuple[tuple[tuple[str, float], ...], str], PrintedTable] = {}
    for case in cases:
        tables = [_parameters(case, known) for known in case.expected.identified if _is_band_mean(known)]
        for source in dict.fromkeys(known.source for known in case.expected.regenerated):
            tables.append(_errors(case, [known for known in case.expected.regenerated if known.source == source]))
        for table in tables:
            if table.values:
                found.setdefault((table.content, table.way), table)
    return list(found.values())


def _is_band_mean(known: ExpectedParameters) -> bool:
    return bool(known.values) and known.method in STIFFNESS_METHODS


def _level(case: KnownJointCase, name: str) -> float:
    return next(noise.level for noise in case.noises if noise.name == name)


def _parameters(case: KnownJointCase, known: ExpectedParameters) -> PrintedTable:
    bands = next(band_set for band_set in case.band_sets if band_set.name == known.bands)

    def value(index: int, parameter: Parameter) -> PrintedValue:
        actual = float(case.actual[index])
        quantity = ParameterQuantity(known.method, bands, index)
        return PrintedValue(parameter.name, known.values[parameter.name], quantity, abs(actual) or 1.0)

    values = [value(index, one) for index, one in enumerate(case.parameters) if one.name in known.values]
    return PrintedTable(known.source, f"{known.method}, {bands.name}", _level(case, known.noise), tuple(values))


def _errors(case: KnownJointCase, entries: list[ExpectedErrors]) -> PrintedTable:
    bands = case.band_sets[0]
    values = []
    for known in entries:
        low, high = known.band
        for index, printed in enumerate((known.amplitude, known.frequency)):
            if printed is not None and known.method in STIFFNESS_METHODS:
                name = f"{_ERRORS[index]} {known.observed} {low:g}-{high:g} Hz, {known.method}"
                values.append(PrintedValue(name, printed, ErrorQuantity(known.method, bands, known, index), 1.0))
    methods = " and ".join(dict.fromkeys(known.method for known in entries))
    return PrintedTable(entries[0].source, f"{methods}, {bands.name}", _level(case, entries[0].noise), tuple(values))
