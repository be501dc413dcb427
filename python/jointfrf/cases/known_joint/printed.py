"""FRFs regenerated from published parameters as they are printed: without noise, only the model is compared."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointfrf.cases.known_joint.exact import Exact, exact_frfs
from jointfrf.cases.known_joint.expected import ExpectedErrors, ExpectedParameters
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.dofs import rigid_offset
from jointfrf.frf.metrics import amplitude_error, frequency_error, has_peak
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.coupling import couple

__all__ = ["PrintedErrors", "printed_errors"]


@dataclass(frozen=True)
class PrintedErrors:
    """Errors of an FRF regenerated from printed parameters.

    Attributes
    ----------
    known : ExpectedErrors
        Which FRF, band and method, and the published errors.
    amplitude, frequency : float or None
        Errors (4.11) and (4.12), percent; None where the exact or the regenerated FRF has no peak in the band.
    """

    known: ExpectedErrors
    amplitude: float | None
    frequency: float | None


def printed_errors(case: KnownJointCase) -> list[PrintedErrors]:
    """Regenerate the FRFs of published errors from the parameters that the same source prints.

    Parameters
    ----------
    case : KnownJointCase

    Returns
    -------
    list of PrintedErrors
        One for each published pair of errors for which all parameters are published; none where `expected.toml` names
        no spacing of lines (`printed_step`).
    """
    step = case.expected.printed_step
    wanted = [(known, table) for known in case.expected.errors if (table := _printed_table(case, known)) is not None]
    if step is None or not wanted:
        return []
    first = float(case.freq_hz[0])
    numbers = np.unique(np.concatenate([_lines(known, first, step) for known, _ in wanted]))
    exact = exact_frfs(replace(case, freq_hz=np.round(first + numbers * step, 9)))
    return [_errors(case, exact, known, table) for known, table in wanted]


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


def _errors(case: KnownJointCase, exact: Exact, known: ExpectedErrors, table: ExpectedParameters) -> PrintedErrors:
    observed = next(one for one in case.observed if one.key == known.observed)
    weights = rigid_offset(exact.dofs, known.offset)[observed.dof] if known.offset else np.eye(exact.n)[observed.dof]
    at = exact.where(observed.point)
    theta = np.array([table.values[parameter] for parameter in case.parameters])
    actual, h = (lines[:, at, at] @ weights @ weights for lines in (exact.h_c, _assembly(exact, theta)))
    if not (has_peak(actual, exact.freq_hz, known.band) and has_peak(h, exact.freq_hz, known.band)):
        return PrintedErrors(known, None, None)
    amplitude, frequency = (error(actual, h, exact.freq_hz, known.band) for error in (amplitude_error, frequency_error))
    return PrintedErrors(known, amplitude, frequency)


def _assembly(exact: Exact, theta: FloatArray) -> ComplexArray:
    """Receptance of the assembly (2.26) with stiffness of all DOFs, then damping."""
    n = exact.n
    k_joint = (theta[:n] + 2j * np.pi * exact.freq_hz[:, None] * theta[n:])[:, None] * np.eye(n)
    joint = list(range(n))
    return couple(exact.h_a, exact.h_b, k_joint, joint, joint, freq_hz=exact.freq_hz)
