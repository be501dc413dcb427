"""Errors of channels around a virtual point: sign, factor, quantity, delay, direction, place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from jointfrf.channels.check.channel_ratios import unit_of_factor
from jointfrf.channels.check.pair_ratios import exponents
from jointfrf.channels.check.rigid_motion import ChannelGroup, Suspects, column_size, expected_motion, find_suspects
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.messages.finding import Finding
from jointfrf.messages.message import Severity

__all__ = ["rigid_faults"]

#: Mean square that a suspect causes over that of the others, from which it is one: of bodies without a fault, whose
#: deformation is no rigid motion either, 8 is exceeded in a third of the groups, 25 in one of 300 with four residuals
#: or more. What is seen must thus be large, too:
_LEAST_RATIO, _CLEAR_RATIO = 6.0, 20.0
#: error of a channel relative to its motion that the deformation of sides does not reach (0.8 without a fault);
_LARGE = 0.9
#: or a factor or direction that explains the error: what is left of it, at most this share (without a fault 0.43).
_EXPLAINED, _NOTICED = 0.3, 0.1
#: A sensor, or an exchange, is one where it is as large relative to its motion.
_SENSOR_ERROR = 0.25
#: A factor and direction leave less than half of the power of what they are to explain.
_HALF = math.sqrt(0.5)
#: Factors and directions are known to this share: a sensor is not read off where its direction is not.
_ALONG = 0.35
#: A factor within this share of that of a unit is taken for it, or within what is left of the motion, to this share.
_UNIT, _UNIT_WIDEST = 0.05, 0.25
#: Exponent of w in the ratio of measured to expected motion, and how far it may be off for a quantity.
_EXPONENT = 0.3
#: Parts of the band, their coherence with the expected motion, and the span in frequency that show an exponent.
_PARTS, _COHERENT, _SPAN = 12, 0.8, 2.0
#: Delays that are tried: up to this number of turns of the phase over the band, either way.
_TURNS, _STEPS = 2.0, 81
#: Faults of a group: with more nothing can be said of any.
_MOST_FAULTS = 3


@dataclass(frozen=True, eq=False)
class _Seen:
    """What a channel shows beside what the others expect at its place.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
    shown : ndarray, shape (n_freq, n)
    place : ndarray, shape (n_freq, 3, n)
        Expected displacement of its place.
    direction : ndarray, shape (3,)
        Along which it is to measure.
    """

    freq_hz: FloatArray
    shown: ComplexArray
    place: ComplexArray
    direction: FloatArray

    @property
    def expected(self) -> ComplexArray:
        """Expected motion of the channel, shape (n_freq, n)."""
        return np.asarray(np.einsum("a,fan->fn", self.direction, self.place))

    def on(self, lines: np.ndarray) -> _Seen:
        """Return the motions on some lines."""
        return replace(self, freq_hz=self.freq_hz[lines], shown=self.shown[lines], place=self.place[lines])

    def error(self) -> float:
        """Root mean square of the difference, relative to the expected motion."""
        expected = self.expected
        return _size(self.shown - expected) / max(_size(expected), TINY)

    def fitted(self) -> tuple[FloatArray, float]:
        """Return the direction times factor that explains most of the shown motion, and the share of the residual."""
        across = self.place.swapaxes(0, 1).reshape(3, -1)
        both = np.hstack([across.real, across.imag]).T
        shown = np.concatenate([self.shown.real.ravel(), self.shown.imag.ravel()])
        direction = np.linalg.lstsq(both, shown, rcond=None)[0]
        left = float(np.linalg.norm(shown - both @ direction))
        return direction, left / max(float(np.linalg.norm(shown)), TINY)

    def share_left(self, expected: ComplexArray) -> float:
        """Return the residual of another expected motion as a share of the shown motion."""
        return _size(self.shown - expected) / max(_size(self.shown), TINY)


def _size(values: ComplexArray) -> float:
    return float(np.linalg.norm(values))


def rigid_faults(group: ChannelGroup, freq_hz: FloatArray, names: Sequence[str]) -> Iterator[tuple[Finding, list[int]]]:
    """Find the channels that do not share the rigid motion of their neighbours, one cause at a time.

    Parameters
    ----------
    group : ChannelGroup
        Responses or forces of one side.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    names : sequence of str
        Names of its channels.

    Yields
    ------
    tuple
        Finding, and the rows or columns of its channels.
    """
    left = np.arange(group.size)
    for _ in range(_MOST_FAULTS):
        own = group.only(left)
        suspects = find_suspects(own)
        if suspects is None or suspects.ratio < _LEAST_RATIO:
            return
        finding = _finding(own, suspects, freq_hz, [names[i] for i in left.tolist()])
        if finding is None:
            return
        bad = left[list(suspects.channels)]
        yield finding, group.places[bad].tolist()
        left = np.setdiff1d(left, bad)


def _finding(group: ChannelGroup, suspects: Suspects, freq_hz: FloatArray, names: Sequence[str]) -> Finding | None:
    others = np.setdiff1d(np.arange(group.size), suspects.channels)
    motion = expected_motion(group, others)
    size = column_size(group.h)
    # The motion of the others at the place of each suspect; every column has the same weight on every line.
    seen = [
        _Seen(freq_hz, group.h[:, i] / size, group.at(group.positions[i]) @ motion / size[:, None], group.directions[i])
        for i in suspects.channels
    ]
    some = [one.on(suspects.lines) for one in seen]
    if suspects.kind == "channel":
        return _channel_finding(group, suspects, seen[0], some[0], names, motion)
    error = math.sqrt(sum(one.error() ** 2 for one in some) / len(some))
    if suspects.ratio < _CLEAR_RATIO or error < _SENSOR_ERROR:
        return None
    numbers, about = _beside(group, suspects, error), tuple(f"{group.word} {names[i]}" for i in suspects.channels)
    if suspects.kind == "exchanged":
        return Finding("exchanged-channels", numbers, about, variant="neighbours")
    turned = _turned(some)
    if turned is not None:
        return Finding("channel-direction", numbers | {"shown": turned}, about, variant="sensor")
    return Finding("channel-place", numbers, about, variant="sensor")


def _beside(group: ChannelGroup, suspects: Suspects, error: float) -> dict[str, Any]:
    """Return how far suspects are from the rigid motion of their neighbours, and these among each other."""
    return {"error": error, "neighbours": group.size - len(suspects.channels), "rest": suspects.rest}


class _Cause(NamedTuple):
    """Error of a channel: code and variant of the finding, and its numbers."""

    code: str
    numbers: Mapping[str, Any]
    variant: str = "neighbours"
    severity: Severity = "error"


def _channel_finding(
    group: ChannelGroup, suspects: Suspects, seen: _Seen, some: _Seen, names: Sequence[str], motion: ComplexArray
) -> Finding | None:
    """Report the error of one channel; None if the deformation of the side may be the reason."""
    place = suspects.channels[0]
    error = some.error()
    direction, left = some.fitted()
    other, after = _like_another(group, place, some, motion, suspects.lines)
    # Shares of the shown motion become shares of the expected one, as the error is.
    scale = _size(some.shown) / max(_size(some.expected), TINY)
    copied = after * scale <= _EXPLAINED * error and after < left
    is_explained = copied or left * scale <= _EXPLAINED * error
    if error < _NOTICED or not (is_explained or error >= _LARGE):
        return None
    causes = [_quantity(group.word, seen)]
    if not copied:
        causes += [_of_direction(some.direction, direction, left) if left < _HALF else None, _late(seen)]
    if copied or after < 0.5:
        causes.append(_Cause("channel-place", {"other": f"{group.word} {names[other]}"}, "copy"))
    if error >= _LARGE and suspects.ratio >= _CLEAR_RATIO:
        causes.append(_Cause("channel-place", {}, ""))
    for cause in causes:
        if cause is not None:
            numbers = _beside(group, suspects, error) | dict(cause.numbers)
            return Finding(cause.code, numbers, (f"{group.word} {names[place]}",), (), cause.severity, cause.variant)
    return None


def _quantity(word: str, seen: _Seen) -> _Cause | None:
    """Return the power of i w by which a channel differs from its expected motion."""
    n, expected, shown = seen.freq_hz.size, seen.expected, seen.shown
    first = np.linspace(0, n, min(_PARTS, n), endpoint=False).astype(int)
    lines = (expected.conj() * shown, abs(expected) ** 2, abs(shown) ** 2)
    product, power_of_expected, power_of_shown = (np.add.reduceat(one.sum(axis=1), first) for one in lines)
    coherent = abs(product) > _COHERENT * np.maximum(np.sqrt(power_of_expected * power_of_shown), TINY)
    ratio = product[coherent] / power_of_expected[coherent]
    middle = (np.add.reduceat(seen.freq_hz, first) / np.diff(first, append=n))[coherent]
    if middle.size < 3 or middle[-1] < _SPAN * middle[0]:
        return None
    slope = float(exponents(middle, np.log(abs(ratio))))
    power = round(slope)
    if not 1 <= abs(power) <= 2 or abs(slope - power) > _EXPONENT:
        return None
    if (ratio / abs(ratio) * (-1j) ** power).mean().real <= _COHERENT:
        return None
    what = {2: "an acceleration", 1: "a velocity", -1: "divided by i w once", -2: "divided by i w twice"}[power]
    if word == "force":
        what = f"(i w)^{power} times a force"
    action = "Convert it like the other channels"
    return _Cause("quantity", {"quantity": f"{what} among other quantities", "action": action})


def _late(seen: _Seen) -> _Cause | None:
    """Return the delay of a channel, if the delay explains more than the deformation of sides turns phases."""
    omega = 2 * np.pi * seen.freq_hz
    product = (seen.expected.conj() * seen.shown).sum(axis=1)
    tried = np.linspace(-1, 1, _STEPS) * _TURNS * 2 * np.pi / omega[-1]
    delay = float(tried[np.argmax((np.exp(1j * np.outer(tried, omega)) @ product).real)])
    if seen.share_left(np.exp(-1j * omega * delay)[:, None] * seen.expected) >= _EXPLAINED:
        return None
    return _Cause("channel-delay", {"way": "late" if delay > 0 else "early", "delay": 1e6 * abs(delay)})


def _of_direction(own: FloatArray, direction: FloatArray, left: float) -> _Cause | None:
    """Read sign, factor or another direction off the vector that explains a channel."""
    along = float(direction @ own)
    across = float(np.linalg.norm(direction - along * own))
    if across <= _ALONG * abs(along):
        if 1 / 1.25 < -along < 1.25:
            return _Cause("channel-sign", {"factor": along})
        unit = unit_of_factor(abs(along), is_rotation=False, tolerance=min(max(_UNIT, left), _UNIT_WIDEST))
        if unit is not None and along > 0:
            return _Cause("channel-unit", {"factor": along, "unit": unit})
        return _Cause("channel-gain", {"factor": along}, severity="warning" if 0.5 < along < 2 else "error")
    name, axis = _axis_of(direction)
    size = float(np.linalg.norm(direction))
    if np.linalg.norm(direction / size - axis) <= _ALONG and 0.5 < size < 2:
        given = " ".join(f"{value:.3g}" for value in own + 0.0)
        return _Cause("channel-direction", {"shown": name, "stated": given}, "")
    return None


def _axis_of(direction: FloatArray) -> tuple[str, FloatArray]:
    """Return the axis that is nearest to a vector, with its name."""
    place = int(np.argmax(abs(direction)))
    sign = -1.0 if direction[place] < 0 else 1.0
    return f"{'-' if sign < 0 else '+'}{'xyz'[place]}", sign * np.eye(3)[place]


def _like_another(
    group: ChannelGroup, place: int, some: _Seen, motion: ComplexArray, lines: np.ndarray
) -> tuple[int, float]:
    """Return the channel whose expected motion this one shows, and the share that is left."""
    size = np.sqrt(np.median(abs(group.h[lines]) ** 2, axis=1))
    size = np.where(size > 0, size, 1.0)
    left = np.full(group.size, np.inf)
    for other in range(group.size):
        if other != place:
            expected = np.einsum("a,fan->fn", group.motion[other], motion[lines]) / size
            left[other] = some.share_left(expected)
    best = int(np.argmin(left))
    return best, float(left[best])


def _turned(some: Sequence[_Seen]) -> str | None:
    """Return the axes that the channels of a sensor show, where these are axes, and others than theirs."""
    words = []
    for one in some:
        direction, left = one.fitted()
        name, axis = _axis_of(direction)
        if left > 0.5 or np.linalg.norm(direction - axis) > 2 * _ALONG:
            return None
        words.append((name, float(axis @ one.direction)))
    if all(own > 1 - _ALONG for _, own in words):
        return None
    return ", ".join(name for name, _ in words)
