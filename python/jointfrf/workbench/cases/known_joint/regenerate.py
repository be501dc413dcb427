"""FRFs of the assembly, regenerated from identified and from published parameters, and their errors."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from jointfrf.dofs import rigid_offset
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import Band, amplitude_error, frequency_error, has_peak, peak
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.coupling import couple
from jointfrf.workbench.cases.keys import Observed, constant_joint
from jointfrf.workbench.cases.known_joint.exact import Exact, exact_frfs
from jointfrf.workbench.cases.known_joint.keys import ExpectedErrors, KnownJointCase
from jointfrf.workbench.cases.known_joint.realisations import Identified, chunk_size
from jointfrf.workbench.cases.workers import Workers
from jointfrf.workbench.report.axes import percentile_lines

__all__ = ["PrintedErrors", "RegeneratedFrf", "peak_errors", "printed_errors", "regenerate", "regenerate_all"]

#: Realisations whose FRFs are regenerated.
_REGENERATED = 200


@dataclass(frozen=True)
class RegeneratedFrf:
    """An FRF of the assembly with identified parameters.

    Attributes
    ----------
    identified : Identified
        Identified parameters, without K* line by line.
    observed : Observed
        Point, DOF and bands of the FRF.
    percentiles : ndarray, shape (3, n_freq)
        Percentiles 2.5, 50 and 97.5 of the modulus, m/N.
    first : ndarray, shape (n_freq,)
        FRF of the first realisation, m/N.
    bands : tuple of (low, high) or None
        Bands in which errors are counted, Hz; None for all lines.
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
    """Return the receptance of the assembly (2.26) at a point, regenerated from parameters of the joint.

    Parameters
    ----------
    exact : Exact
        Receptances of the substructures.
    theta : ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping, one row for each set of parameters.
    point : {"r", "s"}
        Internal point of A or of B.
    dof : int
        DOF of the point for response and force, default 0.
    offset : tuple of float, optional
        Offset x, y, z of response and force from the point, m; none by default.

    Returns
    -------
    ndarray, shape (r, n_freq)
        Receptance of each set of parameters, m/N.

    See Also
    --------
    peak_errors : Errors of a peak.
    """
    h_a, h_b = _at_joint_and_point(exact, point, _weights(exact, dof, offset))
    n, n_freq = exact.n, exact.freq_hz.size
    size, at = chunk_size(n_freq, (2 * n + 1) ** 2), n if point == "r" else 2 * n
    found = np.empty((len(theta), n_freq), np.complex128)
    for first in range(0, len(theta), size):
        some = theta[first : first + size]
        # A copy releases the memory of the coupled FRFs.
        found[first : first + size] = _coupled(h_a, h_b, constant_joint(some, exact.freq_hz), at)
    return found


def _weights(exact: Exact, dof: int, offset: tuple[float, ...]) -> FloatArray:
    """Return the weights of the DOFs of a point for the motion in the direction of one DOF, at an offset."""
    motion = rigid_offset(exact.dofs, offset) if offset else np.eye(exact.n)
    weights: FloatArray = motion[dof]
    return weights


def _at_joint_and_point(exact: Exact, point: str, weights: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return receptances of A and B at the joint DOFs; the observed point is the last DOF of its substructure."""
    n = exact.n
    at_joint = np.eye(n, 2 * n)
    at_both = np.vstack([at_joint, np.concatenate([np.zeros(n), weights])])
    of_a, of_b = (at_both, at_joint) if point == "r" else (at_joint, at_both)
    return of_a @ exact.h_a @ of_a.T, of_b @ exact.h_b @ of_b.T


def _coupled(h_a: ComplexArray, h_b: ComplexArray, k_joint: ComplexArray, at: int) -> ComplexArray:
    """Return the coupled FRFs at one DOF for each set of parameters, as a view."""
    count, n_freq, n, _ = k_joint.shape
    joint = list(range(n))
    many_a, many_b = (np.tile(h, (count, 1, 1)) for h in (h_a, h_b))
    with warnings.catch_warnings():
        # Identified parameters may be far from physical values.
        warnings.simplefilter("ignore", IllConditionedWarning)
        h_c = couple(many_a, many_b, k_joint.reshape(-1, n, n), joint, joint)
    return h_c[:, at, at].reshape(count, n_freq)


def _with_errors(exact: Exact, h_exact: ComplexArray, identified: Identified, observed: Observed) -> RegeneratedFrf:
    h = regenerate(exact, identified.theta[:_REGENERATED], observed.point, observed.dof)
    bands = observed.bands or (None,)
    errors = np.array([[peak_errors(h_exact, one, exact.freq_hz, band) for one in h] for band in bands])
    return RegeneratedFrf(
        identified, observed, percentile_lines(np.abs(h)), h[0].copy(), bands, *np.moveaxis(errors, 2, 0)
    )


def peak_errors(h_exact: ComplexArray, h: ComplexArray, freq_hz: FloatArray, band: Band | None) -> tuple[float, float]:
    """Return the errors (4.11) and (4.12) of a peak, percent; NaN if either FRF has no peak in the band.

    If the largest value is at the edge of the band, the band has no peak.
    """
    if band is not None and not (has_peak(h_exact, freq_hz, band) and has_peak(h, freq_hz, band)):
        return np.nan, np.nan
    return amplitude_error(h_exact, h, freq_hz, band), frequency_error(h_exact, h, freq_hz, band)


def regenerate_all(
    exact: Exact, identified: list[Identified], observed: tuple[Observed, ...], workers: Workers
) -> list[RegeneratedFrf]:
    """Return each observed FRF, regenerated from all identified joints."""
    # The lines are large and not needed in the processes.
    without_lines = [replace(found, k_lines=np.empty((0, *found.k_lines.shape[1:]), complex)) for found in identified]
    pairs = [(found, one) for found in without_lines for one in observed]
    h_exact = [exact.h_c[:, at, at] for at in (exact.at(one) for _, one in pairs)]
    # FRFs of the assembly between all points are not needed either.
    uncoupled = replace(exact, h_c=exact.h_c[:0], h_initial=exact.h_initial[:0])
    return list(workers.map(_with_errors, [uncoupled] * len(pairs), h_exact, *zip(*pairs, strict=True)))


class PrintedErrors(NamedTuple):
    """Errors of an FRF that is regenerated from published parameters.

    Attributes
    ----------
    known : ExpectedErrors
        FRF, band, method and published errors.
    amplitude, frequency : float or None
        Errors (4.11) and (4.12), percent; None if the exact or the regenerated FRF has no peak in the band.
    one_line : float
        Error (4.12) of one line, percent.
    """

    known: ExpectedErrors
    amplitude: float | None
    frequency: float | None
    one_line: float


def printed_errors(case: KnownJointCase) -> list[PrintedErrors]:
    """Return errors of FRFs that are regenerated from published parameters.

    Parameters
    ----------
    case : KnownJointCase
        Case with published parameters and errors.

    Returns
    -------
    list of PrintedErrors
        One object for each published pair of errors with a complete set of published parameters; empty without
        `printed` in `expected.toml`.
    """
    printed, names = case.expected.printed, [parameter.name for parameter in case.parameters]
    parameters = {
        (table.noise, table.method): [table.values[name] for name in names]
        for table in reversed(case.expected.identified) if not set(names) - set(table.values)
    }  # fmt: skip
    wanted = [known for known in case.expected.regenerated if (known.noise, known.method) in parameters]
    if printed is None or not wanted:
        return []
    step, first = printed.step, float(case.freq_hz[0])
    # Lines inside the bands, counted from the first line of the case.
    ends = ((np.array(known.band) - first) / step for known in wanted)
    numbers = np.unique(
        np.concatenate([np.arange(np.ceil(low - 1e-9), np.floor(high + 1e-9) + 1) for low, high in ends])
    )
    exact = exact_frfs(replace(case, freq_hz=np.round(first + numbers * step, 9)))
    found = []
    for known in wanted:
        observed = next(one for one in case.observed if one.key == known.observed)
        theta = np.array([case.actual, parameters[known.noise, known.method]])
        actual, h = regenerate(exact, theta, observed.point, observed.dof, known.offset or ())
        errors = peak_errors(actual, h, exact.freq_hz, known.band)
        amplitude, frequency = (None if np.isnan(error) else error for error in errors)
        one_line = step / peak(actual, exact.freq_hz, known.band)[1] * 100
        found.append(PrintedErrors(known, amplitude, frequency, one_line))
    return found
