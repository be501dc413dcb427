"""What is known about a case: reading and checking its `expected.toml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from jointfrf.cases.toml_table import Table, read_toml
from jointfrf.frf.bands import Band
from jointfrf.identification.identify import IdentificationMethod

__all__ = ["METHODS", "Expected", "ExpectedErrors", "ExpectedTable", "Known", "read_expected"]

METHODS: tuple[str, ...] = get_args(IdentificationMethod)


@dataclass(frozen=True)
class Known:
    """Names that an `expected.toml` may use: those of its case.

    Attributes
    ----------
    parameters, band_sets : tuple of str
    methods : mapping of str to tuple of str
        Noise to the methods that are applied to it.
    observed : mapping of str to tuple of (low, high)
        FRF to the bands where errors of regenerated ones are counted, Hz.
    """

    parameters: tuple[str, ...]
    band_sets: tuple[str, ...]
    methods: Mapping[str, tuple[str, ...]]
    observed: Mapping[str, tuple[Band, ...]]


@dataclass(frozen=True)
class ExpectedTable:
    """Published numbers of one identification: parameter to value, and the largest errors allowed, percent.

    A value fits inside the `central` percent of the realisations.
    """

    source: str
    noise: str
    method: str
    bands: str
    values: dict[str, float]
    rmse_below: dict[str, float]
    central: float = 98.0


@dataclass(frozen=True)
class ExpectedErrors:
    """Published errors (4.11), (4.12) of a regenerated FRF in a band, percent; None where the source has none."""

    source: str
    noise: str
    method: str
    observed: str
    band: Band
    amplitude: float | None
    frequency: float | None


@dataclass(frozen=True)
class Expected:
    """What is known about a case: natural frequencies in Hz, tables, and the numbers of the source's figures."""

    frequencies: tuple[tuple[str, str, tuple[float, ...], float], ...] = ()
    tables: tuple[ExpectedTable, ...] = ()
    errors: tuple[ExpectedErrors, ...] = ()
    figures: tuple[tuple[str, str], ...] = ()

    def figure(self, key: str) -> str:
        """Return the number of a figure in the source, or an empty text."""
        return dict(self.figures).get(key, "")


def read_expected(path: Path, known: Known) -> Expected:
    """Read an `expected.toml`.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    table = read_toml(path)
    frequencies = []
    for entry in table.tables("frequencies") if "frequencies" in table else []:
        joint = entry.text("joint", ("actual", "initial"))
        frequencies.append(
            (joint, entry.text("source"), tuple(entry.numbers("values")), entry.number("within_percent", 0))
        )
        entry.close()
    tables = []
    for entry in table.tables("identified") if "identified" in table else []:
        source, noise, method = _applied(entry, known)
        bands = "" if method == "compliance" else entry.text("bands", known.band_sets)
        columns: list[dict[str, float]] = []
        for key in ("values", "rmse_below"):
            column = {}
            if key in entry:
                inner = entry.table(key)
                column = {parameter: inner.number(parameter) for parameter in known.parameters if parameter in inner}
                inner.close()
            columns.append(column)
        central = entry.number("central_percent", 0) if "central_percent" in entry else 98.0
        tables.append(ExpectedTable(source, noise, method, bands, columns[0], columns[1], central))
        entry.close()
    regenerated = table.tables("regenerated") if "regenerated" in table else []
    errors = [_expected_errors(entry, known) for entry in regenerated]
    figures: tuple[tuple[str, str], ...] = ()
    if "figures" in table:
        inner = table.table("figures")
        figures = tuple((key, inner.text(key)) for key in inner.keys())  # noqa: SIM118
    table.close()
    return Expected(tuple(frequencies), tuple(tables), tuple(errors), figures)


def _applied(entry: Table, known: Known) -> tuple[str, str, str]:
    """Return source, noise and method of an expected table."""
    source, noise = entry.text("source"), entry.text("noise", tuple(known.methods))
    method = entry.text("method", METHODS)
    if method not in known.methods[noise]:
        raise entry.error("method", f"one of the methods that case.toml applies to {noise!r}")
    return source, noise, method


def _expected_errors(entry: Table, known: Known) -> ExpectedErrors:
    source, noise, method = _applied(entry, known)
    key = entry.text("observed", tuple(known.observed))
    bands = entry.bands("band")
    if len(bands) != 1 or bands[0] not in known.observed[key]:
        raise entry.error("band", f"one of the bands that case.toml names for {key}")
    amplitude, frequency = (entry.number(what) if what in entry else None for what in ("amplitude", "frequency"))
    entry.close()
    return ExpectedErrors(source, noise, method, key, bands[0], amplitude, frequency)
