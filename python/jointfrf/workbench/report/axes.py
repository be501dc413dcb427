"""Labels with units, limits of axes and the numbers along them, and percentiles of figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from jointfrf.dofs import Parameter, compliance_unit
from jointfrf.frf.bands import Band
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "FREQUENCY",
    "bands_in_words",
    "bulk_limits",
    "format_axis",
    "modulus_label",
    "numbered_axis",
    "parameter_label",
    "parameter_lines",
    "percentile_lines",
    "percentiles",
    "prefixed_unit",
    "symbol",
]

#: SI prefixes by powers of ten.
_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
#: First letters of units that take a prefix; hertz, percent, decibel and lengths are shown without one.
_TAKE_PREFIX = ("N", "m/N", "rad/")
#: Range of values without a prefix.
_SHORT = (0.1, 1e4)
#: Decades of a logarithmic axis: below the first, numbers at equal distances; below the second at 1, 2, 5; else at 1.
_NARROW, _WIDE = 0.7, 2.0
#: Digits of exponents.
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Number of values along a short axis.
_MOST_BESIDE = 5


def prefixed_unit(unit: str, largest: float) -> tuple[str, float]:
    """Return a unit with the SI prefix that makes its values short.

    Parameters
    ----------
    unit : str
        Unit without a prefix.
    largest : float
        Largest absolute value.

    Returns
    -------
    unit : str
        Unit with its prefix, or without one if none is needed or usual.
    size : float
        Size of the unit, by which values are divided.

    Examples
    --------
    >>> from jointfrf.workbench.report.axes import prefixed_unit
    >>> prefixed_unit("N/m", 6.2e6), prefixed_unit("rad/(N m)", 2e-4), prefixed_unit("%", 1e6)
    (('MN/m', 1000000.0), ('µrad/(N m)', 1e-06), ('%', 1.0))
    """
    usual = unit.startswith(_TAKE_PREFIX)
    if not usual or not np.isfinite(largest) or largest == 0 or _SHORT[0] <= largest < _SHORT[1]:
        return unit, 1.0
    power = int(np.clip(3 * np.floor(np.log10(largest) / 3), min(_PREFIXES), max(_PREFIXES)))
    return _PREFIXES[power] + unit, 10.0**power


def tick_texts(values: Sequence[float]) -> list[str]:
    """Return the numbers along an axis as texts with equal decimals.

    Examples
    --------
    >>> from jointfrf.workbench.report.axes import tick_texts
    >>> tick_texts([-0.5, 0.0, 0.5, 1.0])
    ['−0.5', '0.0', '0.5', '1.0']
    >>> tick_texts([0.0, 1e-7])
    ['0', '1e−07']
    """
    for decimals in range(5):
        if all(abs(value - round(value, decimals)) <= 1e-6 * max(map(abs, values)) for value in values):
            texts = [f"{value:.{decimals}f}" for value in values]
            break
    else:
        texts = [f"{value:g}" for value in values]
    # A zero has no sign, and a minus is as long as a plus.
    return [(text[1:] if text.startswith("-") and float(text) == 0 else text).replace("-", "−") for text in texts]


def axis_values(low: float, high: float, most: int, *, log: bool = False) -> list[float]:
    """Return the values of the numbers along an axis; the script of a page that zooms chooses the same values.

    Parameters
    ----------
    low, high : float
        Limits, logarithms to base ten with `log`.
    most : int
        Approximate largest number of values.
    log : bool
        Whether the axis is logarithmic: values are logarithms, too.

    Examples
    --------
    >>> from jointfrf.workbench.report.axes import axis_values
    >>> axis_values(0.0, 9.9, 6), axis_values(-9.2, -3.1, 5, log=True)
    ([0.0, 2.0, 4.0, 6.0, 8.0], [-8.0, -6.0, -4.0])
    """
    if log and high - low < _WIDE:
        inside = [np.log10(v) + n for n in range(int(np.floor(low)), int(np.ceil(high)) + 1) for v in (1, 2, 5)]
        inside = [float(value) for value in inside if low <= value <= high]
        if high - low >= _NARROW and len(inside) > 1:
            return inside
        values = axis_values(10.0**low, 10.0**high, most)
        return [float(np.log10(value)) for value in values if value > 0]
    rough = (high - low) / most
    if log:
        step = float(max(1, np.ceil(rough)))
    else:
        size = 10.0 ** np.floor(np.log10(rough))
        step = float(size * next(nice for nice in (1, 2, 2.5, 5, 10) if nice * size >= rough * (1 - 1e-9)))
    first = np.ceil(low / step - 1e-9)
    return [float(step * number) + 0.0 for number in np.arange(first, np.floor(high / step + 1e-9) + 1)]


def value_text(value: float) -> str:
    """Return a power of ten as such, and other values with four digits.

    Examples
    --------
    >>> from jointfrf.workbench.report.axes import value_text
    >>> value_text(1e-7), value_text(1.0), value_text(0.05)
    ('10⁻⁷', '1', '0.05')
    """
    power = round(np.log10(value)) if value > 0 else 0
    if power in (0, 1) or not np.isclose(value, 10.0**power, rtol=1e-9, atol=0):
        return f"{value:.4g}"
    return "10" + str(power).translate(_RAISED)


class NumberedAxis(NamedTuple):
    """Numbers along an axis: its label with their unit, the size of this unit, the values and their texts."""

    label: str
    size: float
    values: list[float]
    texts: list[str]


def numbered_axis(
    label: str, low: float, high: float, most: int, *, log: bool = False, step: float | None = None
) -> NumberedAxis:
    """Return the numbers along an axis, in a unit that makes them short.

    Parameters
    ----------
    label : str
        Label, "quantity, unit".
    low, high : float
        Limits of the axis.
    most : int
        Approximate largest number of values.
    log : bool
        Whether the axis is logarithmic.
    step : float, optional
        Distance of the values; default 1, 2, 2.5 or 5 times a power of ten.

    Examples
    --------
    >>> from jointfrf.workbench.report.axes import numbered_axis
    >>> numbered_axis("k, N/m", 0.0, 2.5e6, 3)
    NumberedAxis(label='k, MN/m', size=1000000.0, values=[0.0, 1000000.0, 2000000.0], texts=['0', '1', '2'])
    """
    quantity, comma, unit = label.rpartition(", ")
    if log:
        ends = float(np.log10(low)), float(np.log10(high))
        values = [10.0**value for value in axis_values(*ends, most, log=True)]
        if ends[1] - ends[0] >= _WIDE:
            return NumberedAxis(label, 1.0, values, [value_text(value) for value in values])
    elif step is not None:
        values = (step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)).tolist()
    else:
        values = axis_values(low, high, most)
    unit, size = prefixed_unit(unit, max(abs(low), abs(high)))
    return NumberedAxis(f"{quantity}{comma}{unit}", size, values, tick_texts([value / size for value in values]))


def format_axis(
    axis: Any, label: str, *, most: int = _MOST_BESIDE, log: bool = False, step: float | None = None
) -> None:
    """Set label and numbers of an axis of matplotlib as `numbered_axis` does, again when its limits change."""
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullFormatter

    def renumber(_: Any = None) -> None:
        low, high = sorted(axis.get_view_interval())
        found = numbered_axis(label, low, high, most, log=log, step=step)
        axis.set_major_locator(FixedLocator(found.values))
        axis.set_major_formatter(FixedFormatter(found.texts))
        axis.set_minor_formatter(NullFormatter())
        axis.set_label_text(found.label)

    renumber()
    axis.axes.callbacks.connect(f"{axis.axis_name}lim_changed", renumber)


#: Label of the axis of all FRFs.
FREQUENCY = "frequency, Hz"
#: Names of the median and the limits of a distribution.
_SPREAD = (2.5, 50, 97.5)
#: Percentiles between which most values lie.
_BULK = (5, 95)
#: Margin around the values, as a share of their extent, and at least as a share of the largest value.
_ROOM, _LEAST_ROOM = 0.15, 0.05
#: Least margin for exact values: numbers along the axis then have six digits.
_ROUNDING = 1e-5
#: Distance of the limits of an axis from the value `around`, as a multiple of it.
_FURTHEST = 3.0


def symbol(parameter: Parameter) -> str:
    """Return a parameter as a formula: k_Mtheta as k with index M theta."""
    index = ",".join(dict.fromkeys((parameter.row, parameter.column))).replace("theta", "\\theta ").strip()
    return f"${parameter.kind}_{{{index}}}$"


def parameter_label(parameter: Parameter) -> str:
    """Return the label of an axis: a parameter and its unit."""
    return f"{symbol(parameter)}, {parameter.unit}"


def modulus_label(points: str, dof: str) -> str:
    """Return the label of an axis: the modulus of a receptance with response and force at the same DOF, and its unit.

    Examples
    --------
    >>> from jointfrf.workbench.report.axes import modulus_label
    >>> modulus_label("ss", "theta")
    '$|H_{ss}|$, rad/(N m)'
    """
    return f"$|H_{{{points}}}|$, {compliance_unit(dof, dof)}"


def bands_in_words(bands: Iterable[Band]) -> str:
    """Return bands as text, "200-400, 650-800"."""
    return ", ".join(f"{low:g}-{high:g}" for low, high in bands)


def parameter_lines(k_lines: ComplexArray, freq_hz: FloatArray, parameter: Parameter) -> FloatArray:
    """Return values of one parameter line by line: Re K* of a stiffness, Im K*, or Im K*/w of a viscous damping.

    Parameters
    ----------
    k_lines : ndarray, shape (..., n_freq)
        Entry of K* to which the parameter belongs, N/m.
    freq_hz : ndarray, shape (n_freq,)
        Lines, Hz.
    parameter : Parameter
        Stiffness or damping.

    Returns
    -------
    ndarray, shape (..., n_freq)
        Values in the unit of the parameter.
    """
    if parameter.kind == "k":
        return k_lines.real
    return k_lines.imag / (2 * np.pi * freq_hz) if parameter.kind == "c" else k_lines.imag


def percentiles(values: FloatArray) -> tuple[float, float, float]:
    """Return the 2.5, 50 and 97.5 percentile of values."""
    low, median, high = (float(x) for x in np.percentile(values, _SPREAD))
    return low, median, high


def percentile_lines(lines: FloatArray) -> FloatArray:
    """Return the 2.5, 50 and 97.5 percentile at each frequency, shape (3, n_freq), of lines of shape (r, n_freq)."""
    return np.asarray(np.percentile(lines, _SPREAD, axis=0), np.float64)


def bulk_limits(
    values: Sequence[FloatArray],
    shown: Sequence[float] = (),
    around: float | None = None,
    least_room: float = _LEAST_ROOM,
) -> tuple[float, float]:
    """Return limits of an axis for nine tenths of the values: a few lines near a singular matrix would hide them.

    Parameters
    ----------
    values : sequence of ndarray
        Values, without regard to NaN and Inf.
    shown : sequence of float
        Values that are always within the limits.
    around : float, optional
        Further value within the limits, from which they are at most three times its size away.
    least_room : float
        Least margin, as a share of the largest value: 0 if intervals show the accuracy of the values.

    Returns
    -------
    low, high : float
        Limits of the axis.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.workbench.report.axes import bulk_limits
    >>> low, high = bulk_limits([np.array([1.0, 2.0, 90.0, np.nan])], around=1.0)
    >>> round(low, 2), round(high, 2)
    (0.55, 4.45)
    """
    every = np.concatenate([np.empty(0), *(np.ravel(own) for own in values)])
    every = every[np.isfinite(every)]
    bulk = [float(end) for end in np.percentile(every, _BULK)] if every.size else []
    low, high = min([*bulk, *shown], default=0.0), max([*bulk, *shown], default=0.0)
    if around is not None:
        reach = _FURTHEST * abs(around) or np.inf
        low, high = max(min(low, around), around - reach), min(max(high, around), around + reach)
    # Rounding must not fill a panel.
    room = max(_ROOM * (high - low), max(least_room, _ROUNDING) * max(abs(low), abs(high))) or 1.0
    return float(low - room), float(high + room)
