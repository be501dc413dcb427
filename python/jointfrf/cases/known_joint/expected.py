"""What the source says about a case of a known joint: its `expected.toml`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from jointfrf.cases.comparison import ExpectedFrequencies, read_expected_frequencies
from jointfrf.cases.definitions import check_bands
from jointfrf.cases.fitting import FITTED, METHODS
from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band
from jointfrf.kernel.arguments import FloatArray
from jointfrf.toml.table import TomlTable

__all__ = [
    "Expected",
    "ExpectedErrors",
    "ExpectedParameters",
    "ExpectedRegions",
    "Known",
    "PrintedLines",
    "read_expected",
]


@dataclass(frozen=True)
class Known:
    """Names that an `expected.toml` may use: those of its case.

    Attributes
    ----------
    parameters : tuple of Parameter
    band_sets : tuple of str
    methods : mapping of str to tuple of str
        Noise to the methods that are applied to it.
    observed : mapping of str to tuple of (low, high)
        FRF to the bands where errors of regenerated ones are counted, Hz.
    freq_hz : ndarray, shape (n_freq,)
        Lines, Hz.
    """

    parameters: tuple[Parameter, ...]
    band_sets: tuple[str, ...]
    methods: Mapping[str, tuple[str, ...]]
    observed: Mapping[str, tuple[Band, ...]]
    freq_hz: FloatArray


@dataclass(frozen=True)
class ExpectedParameters:
    """Published parameters of one identification, and the largest errors allowed, percent."""

    source: str
    noise: str
    method: str
    bands: str
    values: dict[Parameter, float]
    rmse_below: dict[Parameter, float]


@dataclass(frozen=True)
class ExpectedErrors:
    """Published errors (4.11), (4.12) of a regenerated FRF in a band, percent; None where the source has none.

    `offset` says how far from its reference point the FRF is seen, x, y, z in m; empty for the point itself.
    """

    source: str
    noise: str
    method: str
    observed: str
    band: Band
    amplitude: float | None
    frequency: float | None
    offset: tuple[float, ...] = ()


@dataclass(frozen=True)
class ExpectedRegions:
    """Where a source finds an FRF sensitive to a parameter, (low, high) in Hz."""

    source: str
    parameter: Parameter
    observed: str
    bands: tuple[Band, ...]


@dataclass(frozen=True)
class PrintedLines:
    """How FRFs regenerated from printed parameters are compared with the errors that the same source prints.

    Attributes
    ----------
    step : float
        Spacing of the lines, Hz.
    amplitude_within : float
        How far the error (4.11) may lie from the printed one, percent of it.
    lines_within : float
        How many lines the error (4.12) may lie from the printed one.
    """

    step: float
    amplitude_within: float
    lines_within: float


@dataclass(frozen=True)
class Expected:
    """What is known about a case.

    Attributes
    ----------
    frequencies : dict of str to ExpectedFrequencies
        Natural frequencies of the assembly with the ``"actual"`` or the ``"initial"`` joint.
    tables : tuple of ExpectedParameters
    errors : tuple of ExpectedErrors
    regions : tuple of ExpectedRegions
    printed : PrintedLines or None
        None: nothing is regenerated from printed parameters.
    """

    frequencies: dict[str, ExpectedFrequencies]
    tables: tuple[ExpectedParameters, ...]
    errors: tuple[ExpectedErrors, ...]
    regions: tuple[ExpectedRegions, ...] = ()
    printed: PrintedLines | None = None


def read_expected(table: TomlTable, known: Known) -> Expected:
    """Read the keys of this kind from `expected.toml`.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """

    def entries(key: str) -> list[TomlTable]:
        return table.tables(key) if key in table else []

    joints = [(entry.text("joint", ("actual", "initial")), entry) for entry in entries("frequencies")]
    table.check_different("frequencies", [joint for joint, _ in joints], "name the same joint")
    return Expected(
        {joint: read_expected_frequencies(entry) for joint, entry in joints},
        tuple(_expected_parameters(entry, known) for entry in entries("identified")),
        tuple(_expected_errors(entry, known) for entry in entries("regenerated")),
        tuple(_expected_regions(entry, known) for entry in entries("regions")),
        _printed_lines(table.table("printed")) if "printed" in table else None,
    )


def _applied(entry: TomlTable, known: Known) -> tuple[str, str, str]:
    """Return source, noise and method of an expected table."""
    source, noise = entry.text("source"), entry.text("noise", tuple(known.methods))
    method = entry.text("method", METHODS)
    if method not in known.methods[noise]:
        raise entry.error("method", f"one of the methods that case.toml applies to {noise!r}")
    return source, noise, method


def _expected_parameters(entry: TomlTable, known: Known) -> ExpectedParameters:
    source, noise, method = _applied(entry, known)
    bands = "" if method in FITTED else entry.text("bands", known.band_sets)
    values, rmse_below = (_by_parameter(entry, key, known) for key in ("values", "rmse_below"))
    entry.close()
    return ExpectedParameters(source, noise, method, bands, values, rmse_below)


def _by_parameter(entry: TomlTable, key: str, known: Known) -> dict[Parameter, float]:
    if key not in entry:
        return {}
    inner = entry.table(key)
    found = {parameter: inner.number(parameter.name) for parameter in known.parameters if parameter.name in inner}
    inner.close()
    return found


def _expected_errors(entry: TomlTable, known: Known) -> ExpectedErrors:
    source, noise, method = _applied(entry, known)
    key = entry.text("observed", tuple(known.observed))
    bands = entry.bands("band")
    if len(bands) != 1 or bands[0] not in known.observed[key]:
        raise entry.error("band", f"one of the bands that case.toml names for {key}")
    amplitude, frequency = (entry.number(what) if what in entry else None for what in ("amplitude", "frequency"))
    offset = tuple(entry.numbers("offset")) if "offset" in entry else ()
    if offset and len(offset) != 3:
        raise entry.error("offset", "x, y, z in m")
    entry.close()
    return ExpectedErrors(source, noise, method, key, bands[0], amplitude, frequency, offset)


def _expected_regions(entry: TomlTable, known: Known) -> ExpectedRegions:
    names = tuple(parameter.name for parameter in known.parameters)
    source, parameter = entry.text("source"), known.parameters[names.index(entry.text("parameter", names))]
    key, bands = entry.text("observed", tuple(known.observed)), tuple(entry.bands("bands"))
    entry.close()
    check_bands(entry, "bands", bands, known.freq_hz)
    return ExpectedRegions(source, parameter, key, bands)


def _printed_lines(table: TomlTable) -> PrintedLines:
    found = PrintedLines(*(table.number(key, 0) for key in ("step", "amplitude_within_percent", "lines_within")))
    table.close()
    if found.step == 0:
        raise table.error("step", "positive, in Hz")
    return found
