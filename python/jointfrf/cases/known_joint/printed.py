"""FRFs regenerated from published parameters as they are printed: without noise, only the model is compared."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointfrf.cases.known_joint.exact import Exact, exact_frfs
from jointfrf.cases.known_joint.expected import ExpectedErrors, ExpectedParameters, PrintedLines
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.cases.known_joint.regenerate import regenerate
from jointfrf.frf.bands import amplitude_error, frequency_error, has_peak, peak
from jointfrf.kernel.arguments import FloatArray

__all__ = ["PrintedErrors", "printed_errors"]

#: Half of the last digit of the errors that are printed, percent.
_LAST_DIGIT = 0.005


@dataclass(frozen=True)
class PrintedErrors:
    """Errors of an FRF regenerated from printed parameters.

    Attributes
    ----------
    known : ExpectedErrors
        Which FRF, band and method, and the published errors.
    amplitude, frequency : float or None
        Errors (4.11) and (4.12), percent; None where the exact or the regenerated FRF has no peak in the band.
    one_line : float
        What an error (4.12) of one line is, percent.
    amplitude_fits, frequency_fits : bool
        Whether they lie as near the published ones as the case asks for; where the source has none, whether there is no
        peak.
    """

    known: ExpectedErrors
    amplitude: float | None
    frequency: float | None
    one_line: float
    amplitude_fits: bool
    frequency_fits: bool


def printed_errors(case: KnownJointCase) -> list[PrintedErrors]:
    """Regenerate the FRFs of published errors from the parameters that the same source prints.

    Parameters
    ----------
    case : KnownJointCase

    Returns
    -------
    list of PrintedErrors
        One for each published pair of errors for which all parameters are published; none where `expected.toml` names
        lines for it (`printed`).
    """
    printed = case.expected.printed
    wanted = [(known, table) for known in case.expected.errors if (table := _printed_table(case, known)) is not None]
    if printed is None or not wanted:
        return []
    step, first = printed.step, float(case.freq_hz[0])
    numbers = np.unique(np.concatenate([_lines(known, first, step) for known, _ in wanted]))
    exact = exact_frfs(replace(case, freq_hz=np.round(first + numbers * step, 9)))
    return [_errors(case, exact, known, table, printed) for known, table in wanted]


def _printed_table(case: KnownJointCase, known: ExpectedErrors) -> ExpectedParameters | None:
    """Return the published parameters that belong to published errors, if all of the joint are there."""
    for table in case.expected.tables:
        same = (table.noise, table.method) == (known.noise, known.method)
        if same and all(parameter in table.values for parameter in case.parameters):
            return table
    return None


def _lines(known: ExpectedErrors, first: float, step: float) -> FloatArray:
    """Return the numbers of the lines inside a band, counted from the first line of the case."""
    low, high = ((limit - first) / step for limit in known.band)
    return np.arange(np.ceil(low - 1e-9), np.floor(high + 1e-9) + 1)


def _errors(
    case: KnownJointCase, exact: Exact, known: ExpectedErrors, table: ExpectedParameters, printed: PrintedLines
) -> PrintedErrors:
    observed = next(one for one in case.observed if one.key == known.observed)
    theta = np.stack([case.actual, np.array([table.values[parameter] for parameter in case.parameters])])
    actual, h = regenerate(exact, theta, observed.point, observed.dof, known.offset)
    one_line = printed.step / peak(actual, exact.freq_hz, known.band)[1] * 100
    amplitude = frequency = None
    if has_peak(actual, exact.freq_hz, known.band) and has_peak(h, exact.freq_hz, known.band):
        amplitude, frequency = (
            error(actual, h, exact.freq_hz, known.band) for error in (amplitude_error, frequency_error)
        )
    return PrintedErrors(
        known, amplitude, frequency, one_line,
        _near(amplitude, known.amplitude, printed.amplitude_within / 100 * (known.amplitude or 0)),
        _near(frequency, known.frequency, printed.lines_within * one_line),
    )  # fmt: skip


def _near(found: float | None, published: float | None, within: float) -> bool:
    """Whether an error is near the published one, up to its two printed digits; or both are missing."""
    if found is None or published is None:
        return found is published
    return abs(found - published) <= within + _LAST_DIGIT
