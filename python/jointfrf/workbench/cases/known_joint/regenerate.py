"""FRFs of the assembly regenerated from identified and from printed parameters, and their errors."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from jointfrf.dofs import rigid_offset
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import Band, amplitude_error, frequency_error, has_peak, peak
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.coupling import couple
from jointfrf.workbench.cases.keys import Observed, constant_joint
from jointfrf.workbench.cases.known_joint.exact import Exact, exact_frfs
from jointfrf.workbench.cases.known_joint.keys import ExpectedErrors, ExpectedParameters, KnownJointCase, PrintedLines
from jointfrf.workbench.cases.known_joint.realisations import Identified, chunk_size
from jointfrf.workbench.cases.workers import Workers
from jointfrf.workbench.report.axes import percentile_lines

__all__ = ["PrintedErrors", "RegeneratedFrf", "printed_errors", "regenerate", "regenerate_all"]

#: Realisations whose FRFs are regenerated.
_REGENERATED = 200


@dataclass(frozen=True)
class RegeneratedFrf:
    """An FRF of the assembly with identified parameters.

    Attributes
    ----------
    identified : Identified
        Without its lines.
    observed : Observed
        Which FRF.
    percentiles : ndarray, shape (3, n_freq)
        2.5, 50 and 97.5 percentile of the modulus, m/N.
    first : ndarray, shape (n_freq,)
        That of the first realisation.
    bands : tuple of (low, high) or None
        Where errors are counted, Hz; None for all lines.
    amplitude, frequency : ndarray, shape (n_bands, n_realisations)
        Errors (4.11) and (4.12), percent; NaN where the exact or the regenerated FRF has no peak in the band.
    """

    identified: Identified
    observed: Observed
    percentiles: FloatArray
    first: ComplexArray
    bands: tuple[Band | None, ...]
    amplitude: FloatArray
    frequency: FloatArray


def regenerate(
    exact: Exact, theta: FloatArray, point: str, dof: int = 0, offset: tuple[float, ...] = ()
) -> ComplexArray:
    """Receptance of the assembly (2.26) at a point, regenerated from parameters of the joint.

    Parameters
    ----------
    exact : Exact
    theta : ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.
    point : {"r", "s"}
    dof : int
        Response and force at this DOF of the point.
    offset : tuple of float, optional
        Where response and force are, from the point, x, y, z in m; at the point itself by default.

    Returns
    -------
    ndarray, shape (r, n_freq)
        m/N.
    """
    h_a, h_b = _at_joint_and_point(exact, point, _weights(exact, dof, offset))
    n, n_freq = exact.n, exact.freq_hz.size
    size, at = chunk_size(n_freq, (2 * n + 1) ** 2), n if point == "r" else 2 * n
    found = np.empty((len(theta), n_freq), np.complex128)
    for first in range(0, len(theta), size):
        some = theta[first : first + size]
        # Copied out of the coupled FRFs, which are large.
        found[first : first + size] = _coupled(h_a, h_b, constant_joint(some, exact.freq_hz), at)
    return found


def _weights(exact: Exact, dof: int, offset: tuple[float, ...]) -> FloatArray:
    """Weights of the DOFs of a point for the motion in the direction of one of them, there or beside it."""
    motion = rigid_offset(exact.dofs, offset) if offset else np.eye(exact.n)
    weights: FloatArray = motion[dof]
    return weights


def _at_joint_and_point(exact: Exact, point: str, weights: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Receptances of A and B at the joint DOFs; that of the substructure with the point also there, as the last DOF."""
    n = exact.n
    at_joint = np.eye(n, 2 * n)
    at_both = np.vstack([at_joint, np.concatenate([np.zeros(n), weights])])
    of_a, of_b = (at_both, at_joint) if point == "r" else (at_joint, at_both)
    return of_a @ exact.h_a @ of_a.T, of_b @ exact.h_b @ of_b.T


def _coupled(h_a: ComplexArray, h_b: ComplexArray, k_joint: ComplexArray, at: int) -> ComplexArray:
    """Couple once for each set of parameters, all at once, and take one DOF: a view of the coupled FRFs."""
    count, n_freq, n, _ = k_joint.shape
    joint = list(range(n))
    many_a, many_b = (np.tile(h, (count, 1, 1)) for h in (h_a, h_b))
    with warnings.catch_warnings():
        # Identified parameters may be absurd.
        warnings.simplefilter("ignore", IllConditionedWarning)
        h_c = couple(many_a, many_b, k_joint.reshape(-1, n, n), joint, joint)
    return h_c[:, at, at].reshape(count, n_freq)


def _with_errors(exact: Exact, h_exact: ComplexArray, identified: Identified, observed: Observed) -> RegeneratedFrf:
    h = regenerate(exact, identified.theta[:_REGENERATED], observed.point, observed.dof)
    bands = observed.bands or (None,)
    amplitude, frequency = (
        np.array([[_error(error, h_exact, one, exact.freq_hz, band) for one in h] for band in bands], np.float64)
        for error in (amplitude_error, frequency_error)
    )
    return RegeneratedFrf(identified, observed, percentile_lines(np.abs(h)), h[0].copy(), bands, amplitude, frequency)


def _error(
    error: Callable[..., float], h_exact: ComplexArray, h: ComplexArray, freq_hz: FloatArray, band: Band | None
) -> float:
    """Error of a peak; NaN where there is none: what is largest at the edge of a band belongs to a peak elsewhere."""
    if band is not None and not (has_peak(h_exact, freq_hz, band) and has_peak(h, freq_hz, band)):
        return float("nan")
    return error(h_exact, h, freq_hz, band)


def regenerate_all(
    exact: Exact, identified: list[Identified], observed: tuple[Observed, ...], workers: Workers
) -> list[RegeneratedFrf]:
    """Regenerate each observed FRF from everything that was identified."""
    # Without the lines, which are large and not needed there.
    without_lines = [replace(found, k_lines=np.empty((0, *found.k_lines.shape[1:]), complex)) for found in identified]
    pairs = [(found, one) for found in without_lines for one in observed]
    h_exact = [exact.h_c[:, at, at] for at in (exact.at(one) for _, one in pairs)]
    # Nor FRFs of the assembly between all points.
    uncoupled = replace(exact, h_c=exact.h_c[:0], h_initial=exact.h_initial[:0])
    return list(workers.map(_with_errors, [uncoupled] * len(pairs), h_exact, *zip(*pairs, strict=True)))


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
    wanted = [
        (known, table) for known in case.expected.regenerated if (table := _printed_table(case, known)) is not None
    ]
    if printed is None or not wanted:
        return []
    step, first = printed.step, float(case.freq_hz[0])
    numbers = np.unique(np.concatenate([_lines(known, first, step) for known, _ in wanted]))
    exact = exact_frfs(replace(case, freq_hz=np.round(first + numbers * step, 9)))
    return [_errors(case, exact, known, table, printed) for known, table in wanted]


def _printed_table(case: KnownJointCase, known: ExpectedErrors) -> ExpectedParameters | None:
    """Return the published parameters that belong to published errors, if all of the joint are there."""
    for table in case.expected.identified:
        same = (table.noise, table.method) == (known.noise, known.method)
        if same and all(parameter.name in table.values for parameter in case.parameters):
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
    theta = np.stack([case.actual, np.array([table.values[parameter.name] for parameter in case.parameters])])
    actual, h = regenerate(exact, theta, observed.point, observed.dof, known.offset or ())
    one_line = printed.step / peak(actual, exact.freq_hz, known.band)[1] * 100
    amplitude = frequency = None
    if has_peak(actual, exact.freq_hz, known.band) and has_peak(h, exact.freq_hz, known.band):
        amplitude, frequency = (
            error(actual, h, exact.freq_hz, known.band) for error in (amplitude_error, frequency_error)
        )
    return PrintedErrors(
        known, amplitude, frequency, one_line,
        _near(amplitude, known.amplitude, printed.amplitude_within_percent / 100 * (known.amplitude or 0)),
        _near(frequency, known.frequency, printed.lines_within * one_line),
    )  # fmt: skip


def _near(found: float | None, published: float | None, within: float) -> bool:
    """Whether an error is near the published one, up to its two printed digits; or both are missing."""
    if found is None or published is None:
        return found is published
    return abs(found - published) <= within + _LAST_DIGIT
