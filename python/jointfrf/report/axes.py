"""What figures share: labels with units, limits of axes, percentiles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from jointfrf.dofs import Parameter, compliance_unit
from jointfrf.frf.bands import Band
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "FREQUENCY",
    "bands_in_words",
    "bulk_limits",
    "modulus_label",
    "parameter_label",
    "parameter_lines",
    "percentile_lines",
    "percentiles",
    "symbol",
]

#: Label of the axis of all FRFs.
FREQUENCY = "frequency, Hz"
#: What is shown of a distribution.
_SPREAD = (2.5, 50, 97.5)
#: Percentiles between which most values lie.
_BULK = (5, 95)
#: Margin around what is shown, as a share of its extent, and at least as a share of the largest value.
_ROOM, _LEAST_ROOM = 0.15, 0.05
#: How far an axis reaches from a value that is shown in any case, in such values.
_FURTHEST = 3.0


def symbol(parameter: Parameter) -> str:
    """Write a parameter as a formula: k_Mtheta as k with index M theta."""
    index = parameter.name.partition("_")[2].replace("theta", "\\theta ").strip()
    return f"${parameter.kind}_{{{index}}}$"


def parameter_label(parameter: Parameter) -> str:
    """Label of an axis: a parameter and its unit."""
    return f"{symbol(parameter)}, {parameter.unit}"


def modulus_label(points: str, dof: str) -> str:
    """Label of an axis: the modulus of a receptance with response and force at the same DOF, and its unit.

    Examples
    --------
    >>> from jointfrf.report.axes import modulus_label
    >>> modulus_label("ss", "theta")
    '$|H_{ss}|$, rad/(N m)'
    """
    return f"$|H_{{{points}}}|$, {compliance_unit(dof, dof)}"


def bands_in_words(bands: Iterable[Band]) -> str:
    """Write bands for a reader, "200-400, 650-800"."""
    return ", ".join(f"{low:g}-{high:g}" for low, high in bands)


def parameter_lines(k_lines: ComplexArray, freq_hz: FloatArray, parameter: Parameter) -> FloatArray:
    """Values of one parameter line by line: Re K* of a stiffness, Im K*, or Im K*/w of a viscous damping.

    Parameters
    ----------
    k_lines : ndarray, shape (..., n_freq)
        The entry of K* that the parameter belongs to, N/m.
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    parameter : Parameter

    Returns
    -------
    ndarray, shape (..., n_freq)
    """
    if parameter.kind == "k":
        return k_lines.real
    return k_lines.imag / (2 * np.pi * freq_hz) if parameter.kind == "c" else k_lines.imag


def percentiles(values: FloatArray) -> tuple[float, float, float]:
    """2.5, 50 and 97.5 percentile of values."""
    low, median, high = (float(x) for x in np.percentile(values, _SPREAD))
    return low, median, high


def percentile_lines(lines: FloatArray) -> FloatArray:
    """2.5, 50 and 97.5 percentile at each frequency, shape (3, n_freq), of lines of shape (r, n_freq)."""
    return np.asarray(np.percentile(lines, _SPREAD, axis=0), np.float64)


def bulk_limits(
    values: Sequence[FloatArray], shown: Sequence[float] = (), around: float | None = None
) -> tuple[float, float]:
    """Limits of an axis that show nine tenths of the values: a few lines near a singular matrix would hide them.

    Parameters
    ----------
    values : sequence of ndarray
        NaN and Inf do not count.
    shown : sequence of float
        Values that lie within the limits in any case.
    around : float, optional
        One more such value; the limits do not go further from it than three times its size.

    Returns
    -------
    low, high : float

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.report.axes import bulk_limits
    >>> low, high = bulk_limits([np.array([1.0, 2.0, 90.0, np.nan])], around=1.0)
    >>> round(low, 2), round(high, 2)
    (0.55, 4.45)
    """
    every = np.concatenate([np.ravel(own) for own in values])
    every = every[np.isfinite(every)]
    low, high = np.percentile(every, _BULK) if every.size else (0.0, 0.0)
    low, high = min([low, *shown]), max([high, *shown])
    if around is not None:
        reach = _FURTHEST * abs(around) or np.inf
        low, high = max(min(low, around), around - reach), min(max(high, around), around + reach)
    # Round-off is not to fill a panel.
    room = max(_ROOM * (high - low), _LEAST_ROOM * max(abs(low), abs(high))) or 1.0
    return float(low - room), float(high + room)
