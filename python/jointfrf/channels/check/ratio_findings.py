"""Gain, units and delay of channels in words, and how to correct them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.channel_ratios import ChannelRatios, Offsets
from jointfrf.channels.check.correction import Correction
from jointfrf.channels.check.finding import FindingLevel, FrfFinding
from jointfrf.channels.check.measurement import Measurement
from jointfrf.channels.check.units import unit_of_factor
from jointfrf.kernel.arguments import FloatArray

__all__ = [
    "LEAST_GAIN",
    "LEAST_PHASE",
    "Side",
    "delay_findings",
    "gain_findings",
    "unexplained_gains",
]

#: Differences that every set of sensors has are not reported: of gain, and of phase at the highest frequency (rad).
LEAST_GAIN, LEAST_PHASE = 0.01, 0.01
#: Standard errors that a difference must exceed.
_SIGNIFICANT = 5.0
#: A factor within this share of that of a unit is taken for it.
_UNIT_TOLERANCE = 0.03
#: Factors below this are gains, not units, unless a unit brings them.
_GAIN_LIMIT = 2.0

#: 1: responses are to blame for a ratio, 2: forces; the number of the axis of h.
Side = int


def _is_significant(offsets: Offsets, least: float) -> NDArray[np.bool_]:
    """Channels that differ from the others by more than noise and more than a least value."""
    with np.errstate(invalid="ignore"):
        found: NDArray[np.bool_] = abs(offsets.value) > np.maximum(least, _SIGNIFICANT * offsets.error)
    return found


def unexplained_gains(measurement: Measurement, ratios: ChannelRatios) -> FloatArray:
    """Return the logarithms of the gains that are significant and that no unit explains; 0 for others, shape (n,)."""
    offsets = ratios.gain
    gain = np.where(_is_significant(offsets, LEAST_GAIN), offsets.value, 0.0)
    for i in np.flatnonzero(gain):
        tolerance = max(_UNIT_TOLERANCE, 4 * float(offsets.error[i]))
        if unit_of_factor(math.exp(gain[i]), bool(measurement.rotations[i]), tolerance) is not None:
            gain[i] = 0
    return gain


def gain_findings(
    measurement: Measurement, ratios: ChannelRatios, side: Side
) -> tuple[list[FrfFinding], list[Correction]]:
    """Say which channels have another gain than the others, or other units."""
    findings, corrections = [], []
    offsets = ratios.gain
    left = _is_significant(offsets, LEAST_GAIN)
    while left.any():
        first = int(np.flatnonzero(left)[np.nanargmax(abs(offsets.value[left]))])
        with np.errstate(invalid="ignore"):
            near = abs(offsets.value - offsets.value[first]) < np.maximum(
                _UNIT_TOLERANCE, 4 * np.hypot(offsets.error, offsets.error[first])
            )
        kind_of = measurement.rotations == measurement.rotations[first]
        alike = left & near & kind_of & (ratios.group == ratios.group[first])
        left &= ~alike
        finding, places, factor = _gain_finding(measurement, ratios, alike)
        findings.append(finding)
        dofs = measurement.rows if side == 1 else measurement.columns
        text = f"{_of(measurement, places, side)} divided by {factor if side == 1 else 1 / factor:.5g}"
        own = tuple(int(dofs[i]) for i in places)
        corrections.append(Correction(finding.kind, text, side, own, factor if side == 1 else 1 / factor))
    return findings, corrections


def _gain_finding(
    measurement: Measurement, ratios: ChannelRatios, alike: NDArray[np.bool_]
) -> tuple[FrfFinding, list[int], float]:
    """Return the finding for channels of one factor, the channels to correct, and the factor."""
    places = np.flatnonzero(alike).tolist()
    offsets = ratios.gain
    factor = math.exp(float(np.median(offsets.value[places])))
    error = float(offsets.error[places].max())
    rotation = bool(measurement.rotations[places[0]])
    unit = unit_of_factor(factor, rotation, max(_UNIT_TOLERANCE, 4 * error))
    others = np.flatnonzero((ratios.group == ratios.group[places[0]]) & ~alike)
    if unit is None and others.size and (measurement.rotations[others] != rotation).all():
        # It may be the others that are in other units.
        turned = unit_of_factor(1 / factor, not rotation, max(_UNIT_TOLERANCE, 4 * error))
        if turned is not None:
            places, factor, unit, rotation = others.tolist(), 1 / factor, turned, not rotation
    names = tuple(measurement.dofs[i] for i in places)
    shown = f"h_pq / h_qp is {_times(factor, error)} for p = {', '.join(names)} and every other q"
    if len(names) > 1:
        shown = f"h_pq / h_qp is {_times(factor, error)} for p = {', '.join(names)} and every q but these"
    doubt = _doubt(measurement, ratios, offsets, places)
    if unit is not None:
        remedy = f"convert {_plural('this channel', names)} to SI units"
        return FrfFinding(
            "units", "error", names, factor, 1 + _UNIT_TOLERANCE, f"{shown}: {unit}{doubt}", remedy
        ), places, factor  # fmt: skip
    size, opposite = ("large", "small") if factor > 1 else ("small", "large")
    which = f"the response of {', '.join(names)} is too {size}, or the force there too {opposite}"
    level: FindingLevel = "warning" if 1 / _GAIN_LIMIT < factor < _GAIN_LIMIT else "error"
    remedy = (
        "calibrate sensor and hammer of this DOF; reciprocity cannot tell which of the two it is, and the driving point"
        " carries the error either way"
    )
    threshold = math.exp(max(LEAST_GAIN, _SIGNIFICANT * error))
    return FrfFinding("gain", level, names, factor, threshold, f"{shown}: {which}{doubt}", remedy), places, factor


def delay_findings(
    measurement: Measurement, ratios: ChannelRatios, side: Side
) -> tuple[list[FrfFinding], list[Correction]]:
    """Say which channels lag behind the others."""
    findings, corrections = [], []
    offsets = ratios.delay
    least = LEAST_PHASE / measurement.omega[-1]
    for i in np.flatnonzero(_is_significant(offsets, least)).tolist():
        delay, error = float(offsets.value[i]), float(offsets.error[i])
        name = measurement.dofs[i]
        degrees = math.degrees(delay * measurement.omega[-1])
        word, opposite, way = ("late", "early", "falls") if delay > 0 else ("early", "late", "rises")
        shown = (
            f"the phase of h_pq / h_qp {way} with frequency for p = {name}: a delay of {1e6 * delay:.3g} +- "
            f"{1e6 * error:.2g} us, {degrees:.3g} degrees at {measurement.freq_hz[-1]:g} Hz: the response of {name} is "
            f"{word}, or the force there {opposite}{_doubt(measurement, ratios, offsets, [i])}"
        )
        findings.append(
            FrfFinding(
                "delay", "warning", (name,), delay, max(least, _SIGNIFICANT * error), shown,
                "look at the channel's filter, cable and trigger; reciprocity cannot tell sensor from hammer",
            )
        )  # fmt: skip
        place = int((measurement.rows if side == 1 else measurement.columns)[i])
        own = delay if side == 1 else -delay
        text = f"{_of(measurement, [i], side)} advanced by {1e6 * own:.4g} us"
        corrections.append(Correction("delay", text, side, (place,), delay=own))
    return findings, corrections


def _times(factor: float, error: float) -> str:
    return f"{factor:.4g} +- {factor * error:.1g}"


def _doubt(measurement: Measurement, ratios: ChannelRatios, offsets: Offsets, places: list[int]) -> str:
    """Say which channels may be wrong instead: where as many agree among each other."""
    if not offsets.undecided[places].any():
        return ""
    group = ratios.group == ratios.group[places[0]]
    others = [measurement.dofs[i] for i in np.flatnonzero(group) if i not in places]
    return f" (or {', '.join(others)} the other way: as many channels agree with each side)"


def _plural(words: str, names: tuple[str, ...]) -> str:
    return words if len(names) == 1 else words.replace("this channel", "these channels")


def _of(measurement: Measurement, places: list[int], side: Side) -> str:
    labels = measurement.responses if side == 1 else measurement.forces
    at = (measurement.rows if side == 1 else measurement.columns)[places]
    return ("response " if side == 1 else "force ") + ", ".join(labels[i] for i in at)
