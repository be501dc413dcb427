"""From ratios of pairs of FRFs to channels: which one differs in gain, units or delay, and how to correct it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.pair_ratios import PairRatios
from jointfrf.channels.check.result import Correction, FrfFix
from jointfrf.channels.check.signals import Measurement
from jointfrf.kernel.arguments import FloatArray
from jointfrf.messages.finding import Finding
from jointfrf.messages.message import Severity

__all__ = [
    "LEAST_GAIN",
    "LEAST_PHASE",
    "channel_ratios",
    "delay_findings",
    "gain_findings",
    "unit_of_factor",
]

#: Standard gravity, m/s^2; inch, m; pound-force, N.
_GRAVITY, _INCH, _POUND = 9.80665, 0.0254, 4.4482216
#: Factor of h, response over force, and the unit that causes it; of displacements and forces, of rotations and moments.
_KNOWN: Final[tuple[tuple[tuple[float, str], ...], ...]] = (
    (
        (1e3, "millimetres instead of metres"),
        (1e6, "micrometres instead of metres"),
        (1 / _INCH, "inches instead of metres"),
        (1 / _GRAVITY, "g instead of m/s^2"),
        (_GRAVITY, "m/s^2 where g is stated"),
        (1 / _POUND, "forces in lbf instead of N"),
        (1e-3, "forces in kN instead of N"),
    ),
    (
        (180 / math.pi, "degrees instead of radians"),
        (1e3, "mrad instead of rad, or moments in N mm instead of N m"),
        (1e6, "microradians instead of radians"),
    ),
)
#: Differences that every set of sensors has are not reported: of gain, and of phase at the highest frequency (rad).
LEAST_GAIN, LEAST_PHASE = 0.01, 0.01
#: Standard errors that a difference must exceed.
_SIGNIFICANT = 5.0
#: A factor within this share of that of a unit is taken for it.
_UNIT_TOLERANCE = 0.03
#: A gain within this factor is a warning, beyond it an error.
_GAIN_LIMIT = 2.0


@dataclass(frozen=True, eq=False)
class Offsets:
    """A property of channels, relative to most of those that they are connected to.

    Attributes
    ----------
    value, error : ndarray, shape (n,)
        NaN for a channel that is compared to no other.
    undecided : ndarray of bool, shape (n,)
        Equally many channels differ the other way: which of them are wrong is not decided.
    """

    value: FloatArray
    error: FloatArray
    undecided: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ChannelRatios:
    """Response over force of each DOF that they share: r_p of h_pq / h_qp = r_p / r_q.

    Attributes
    ----------
    group : ndarray of int, shape (n,)
        Channels of one number are compared to each other.
    power : ndarray of int, shape (n,)
        Exponent of i w, relative to the lowest of the group.
    sign : ndarray of int, shape (n,)
        1 or -1, relative to the first of the group.
    gain, delay : Offsets
        Natural logarithm; s.
    """

    group: NDArray[np.intp]
    power: NDArray[np.intp]
    sign: NDArray[np.intp]
    gain: Offsets
    delay: Offsets


def channel_ratios(pairs: PairRatios, n: int, *, least_gain: float, least_delay: float) -> ChannelRatios:
    """Assign the ratios of pairs to channels; differences below `least_gain`, `least_delay` count as none."""
    use = pairs.usable
    p, q = pairs.p[use], pairs.q[use]
    linked, phase = np.eye(n, dtype=bool), np.zeros((n, n))
    linked[p, q] = linked[q, p] = True
    phase[p, q], phase[q, p] = pairs.phase[use], -pairs.phase[use]
    reached = linked
    for _ in range(n.bit_length()):
        reached = reached @ reached
    group = np.argmax(reached, axis=1)
    gain = _solved(group, p, q, pairs.log_gain[use], pairs.gain_error[use] ** -2)
    delay = _solved(group, p, q, pairs.delay[use], pairs.delay_error[use] ** -2)
    power = _solved(group, p, q, pairs.power[use].astype(float), np.ones(p.size))[0]
    sign = np.ones(n, np.intp)
    for number in np.unique(group):
        some = np.flatnonzero(group == number)
        power[some] = np.rint(power[some] - power[some].min())
        turn = phase[np.ix_(some, some)] - np.pi / 2 * (power[some, None] - power[some])
        leading = np.linalg.eigh(linked[np.ix_(some, some)] * np.sign(np.cos(turn)))[1][:, -1]
        sign[some] = np.where(leading * leading[0] < 0, -1, 1)
    gains, delays = _offsets(group, *gain, least_gain), _offsets(group, *delay, least_delay)
    return ChannelRatios(group, power.astype(np.intp), sign, gains, delays)


def _solved(
    group: NDArray[np.intp], p: NDArray[np.intp], q: NDArray[np.intp], difference: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Values of channels by least squares from differences of pairs, mean zero in each group, and their covariance."""
    n = group.size
    laplacian = np.zeros((n, n))
    np.add.at(laplacian, (p, p), weight)
    np.add.at(laplacian, (q, q), weight)
    np.add.at(laplacian, (p, q), -weight)
    np.add.at(laplacian, (q, p), -weight)
    right = np.zeros(n)
    np.add.at(right, p, weight * difference)
    np.add.at(right, q, -weight * difference)
    scale = weight.max(initial=0.0) or 1.0
    # The constant of each group is not determined: projected out.
    same = group[:, None] == group
    constants = same / same.sum(axis=1)
    covariance = (np.linalg.inv(laplacian / scale + constants) - constants) / scale
    return covariance @ right, covariance


def _offsets(group: NDArray[np.intp], value: FloatArray, covariance: FloatArray, least: float) -> Offsets:
    """Refer the values of each group to the largest set of channels that agree."""
    result, error = np.full(value.size, np.nan), np.full(value.size, np.nan)
    undecided = np.zeros(value.size, bool)
    for number in np.unique(group):
        some = np.flatnonzero(group == number)
        if some.size < 2:
            continue
        own = covariance[np.ix_(some, some)]
        variance = own.diagonal()[:, None] + own.diagonal() - 2 * own
        agree = abs(value[some, None] - value[some]) < np.maximum(least, 4 * np.sqrt(np.maximum(variance, 0)))
        count = agree.sum(axis=1)
        best = int(np.argmax(count))
        reference = agree[best]
        contrast = np.eye(some.size) - reference / reference.sum()
        result[some] = contrast @ value[some]
        error[some] = np.sqrt(np.maximum(np.einsum("ab,bc,ac->a", contrast, own, contrast), 0))
        others = ~reference
        undecided[some] = others.any() and count[others].max(initial=0) >= count[best]
    return Offsets(result, error, undecided)


def unit_of_factor(factor: float, is_rotation: bool, tolerance: float) -> str | None:
    """Return the units that explain a ratio of response to force; None if none does within a relative tolerance."""
    for known, what in _KNOWN[is_rotation]:
        if abs(math.log(factor / known)) < tolerance:
            return what
    return None


def _is_significant(offsets: Offsets, least: float) -> NDArray[np.bool_]:
    """Channels that differ from the others by more than noise and more than a least value."""
    with np.errstate(invalid="ignore"):
        found: NDArray[np.bool_] = abs(offsets.value) > np.maximum(least, _SIGNIFICANT * offsets.error)
    return found


def gain_findings(measurement: Measurement, ratios: ChannelRatios, side: int) -> Iterator[Finding | Correction]:
    """Report the channels whose gain or unit differs from most channels."""
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
        yield finding
        name, own = measurement.of_side(side, places)
        divisor = factor if side == 1 else 1 / factor
        fix: FrfFix = "units" if finding.code == "channel-unit" else "gain"
        yield Correction(fix, f"{name} divided by {divisor:.5g}", side, own, divisor)


def _gain_finding(
    measurement: Measurement, ratios: ChannelRatios, alike: NDArray[np.bool_]
) -> tuple[Finding, list[int], float]:
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
    doubtful = _doubtful(measurement, ratios, offsets, places)
    numbers = {"factor": factor, "error": factor * error, "others": doubtful}
    variant = "undecided" if doubtful else ""
    if unit is not None:
        return Finding("channel-unit", numbers | {"unit": unit}, names, variant=variant), places, factor
    severity: Severity = "warning" if 1 / _GAIN_LIMIT < factor < _GAIN_LIMIT else "error"
    return Finding("channel-gain", numbers, names, severity=severity, variant=variant), places, factor


def delay_findings(measurement: Measurement, ratios: ChannelRatios, side: int) -> Iterator[Finding | Correction]:
    """Report the channels that are late or early compared with most channels."""
    offsets = ratios.delay
    least = LEAST_PHASE / measurement.omega[-1]
    for i in np.flatnonzero(_is_significant(offsets, least)).tolist():
        delay, error = float(offsets.value[i]), float(offsets.error[i])
        name = measurement.dofs[i]
        way, opposite = ("late", "early") if delay > 0 else ("early", "late")
        doubtful = _doubtful(measurement, ratios, offsets, [i])
        numbers = {
            "way": way, "opposite": opposite, "delay": 1e6 * abs(delay), "error": 1e6 * error,
            "degrees": math.degrees(abs(delay) * measurement.omega[-1]), "freq": float(measurement.freq_hz[-1]),
            "others": doubtful,
        }  # fmt: skip
        yield Finding("channel-delay", numbers, (name,), variant="undecided" if doubtful else "")
        label, places = measurement.of_side(side, [i])
        own = delay if side == 1 else -delay
        yield Correction("delay", f"{label} advanced by {1e6 * own:.4g} us", side, places, delay=own)


def _doubtful(measurement: Measurement, ratios: ChannelRatios, offsets: Offsets, places: list[int]) -> tuple[str, ...]:
    """Return the channels that may be wrong instead: as many agree among each other; none where it is decided."""
    if not offsets.undecided[places].any():
        return ()
    group = ratios.group == ratios.group[places[0]]
    return tuple(measurement.dofs[i] for i in np.flatnonzero(group) if i not in places)
