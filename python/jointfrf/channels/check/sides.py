"""Whether the sides of a joint are measured alike, in one quantity, sign and unit, and where their points say."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from jointfrf.channels.check.channel_ratios import unit_of_factor
from jointfrf.channels.check.driving_points import (
    Sectors,
    quantities,
    quantity_findings,
    sectors,
    sign_findings,
)
from jointfrf.channels.check.pair_ratios import Polar, are_signals, exponents
from jointfrf.channels.check.signals import as_measurement, modulus, smoothness
from jointfrf.channels.extent import extent_of, longest_extent
from jointfrf.channels.joint_channels import JointChannels
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["reference_findings", "side_findings"]

#: Share of the lines that is looked at: those on which both sides move most like one body.
_BEST = 0.3
#: A factor between the sides is one from this: virtual points of sides that bend differ by less (at most 1.4 in 1000
#: data sets without a fault), and the pairs of DOFs agree on it to this deviation of its logarithm.
_FACTOR, _AGREED = 1.8, 0.5
#: A factor within this share of that of a unit is taken for it: units differ by more than twice that.
_UNIT = 0.25
#: Exponents of w in a ratio may be off by this.
_EXPONENT = 0.35
_SIDES = ("side j", "side k")


def side_findings(
    freq_hz: FloatArray, h: ComplexArray, share: FloatArray, hidden: np.ndarray, read_as: str | None
) -> Iterator[Finding]:
    """Compare the sides by FRFs between joint DOFs j, then k.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
    h : ndarray, shape (n_freq, 2 n, 2 n)
    share : ndarray, shape (n_freq,)
        Share of the motion of the channels that is not rigid.
    hidden : ndarray of bool, shape (2 n, 2 n)
        FRFs that the noise of the channels hides.
    """
    best = np.sort(np.argsort(share, kind="stable")[: max(round(_BEST * share.size), 1)])
    n = h.shape[1] // 2
    power, log_factor, agreed = _ratio(2 * np.pi * freq_hz[best], h[best], hidden, n)
    driving = np.einsum("faa->fa", h)
    decided = sectors(driving[best])
    quarter = np.array([_most(own) for own in decided.quarter.reshape(2, n)])
    mixed = decided.mixed.reshape(2, n).mean(axis=1) > 0.5
    both = Sectors(quarter, np.median(decided.negative.reshape(2, n), axis=1), mixed)
    omega = 2 * np.pi * freq_hz
    powers = np.array([0, -power]) - min(0, -power)
    signs = np.array([1, -1 if log_factor.imag != 0 else 1])
    named = as_measurement(freq_hz, h[:, :2, :2], _SIDES, _SIDES, np.zeros((2, 2), bool))
    group, own = np.zeros(2, np.intp), driving.reshape(omega.size, 2, n)
    found = quantities(omega, own, group, powers.astype(np.intp), signs.astype(np.intp), both)
    for one in (
        *quantity_findings(named, found, both, read_as),
        *sign_findings(named, found, both, 1, may_rotate=False),
    ):
        if isinstance(one, Finding) and one.code in ("quantity", "driving-point-sign"):
            yield one
    factor = math.exp(-log_factor.real)
    if power == 0 and agreed < _AGREED and not 1 / _FACTOR < factor < _FACTOR:
        unit, other = (unit_of_factor(one, is_rotation=False, tolerance=_UNIT) for one in (factor, 1 / factor))
        what = f"{unit} on side k" if unit else f"{other} on side j" if other else ""
        numbers = {"factor": factor} | ({"unit": what} if what else {})
        yield Finding("channel-unit" if what else "channel-gain", numbers, _SIDES, severity="error", variant="side")


def _most(quarter: np.ndarray) -> int:
    """Return the half plane in which most driving points lie; -1 where none holds half of those that are decided."""
    known = quarter[quarter >= 0]
    if not known.size:
        return -1
    count = np.bincount(known, minlength=4)
    best = int(np.argmax(count))
    return best if 2 * count[best] > known.size else -1


def _ratio(omega: FloatArray, h: ComplexArray, hidden: np.ndarray, n: int) -> tuple[int, complex, float]:
    """Return the power of i w, the logarithm and the scatter over pairs of h_jk / h_kj: side j over side k."""
    size = np.median(modulus(h), axis=0)
    seen = (are_signals(size, smoothness(h), len(h)) & ~hidden & ~hidden.T)[:n, n:]
    if not seen.any():
        return 0, 0j, math.inf
    below = Polar.of(h[:, n:, :n].swapaxes(1, 2)[:, seen])
    amplitude, phasor = Polar.of(h[:, :n, n:][:, seen]).over(below)
    slope = float(exponents(omega, np.median(amplitude, axis=1)))
    power = round(slope) if abs(slope - round(slope)) < _EXPONENT and abs(round(slope)) <= 2 else 0
    sign = 0.0 if (phasor * (-1j) ** power).sum().real >= 0 else math.pi
    own = np.median(amplitude - power * np.log(omega)[:, None], axis=0)
    return power, complex(np.median(own), sign), float(1.4826 * np.median(abs(own - np.median(own))))


#: Root mean square distance of channels from their middle, m, from which another unit is tried, where it brings the
#: reference point nearer.
_LARGE = 0.5
#: Distance of the reference point from the middle of the channels, in their reach, at which an error of a rotation
#: enters translations of the point that many times larger.
_FAR = 10.0
#: Another unit is named where it brings the reference point this near, and nearer by this factor.
_NEAR, _NEARER = 4.0, 2.0
#: Metres in units that coordinates are written in.
_UNITS = ((1e-3, "millimetres"), (1e-2, "centimetres"), (0.0254, "inches"), (0.3048, "feet"))


class _Place(NamedTuple):
    """The channels of a side beside its reference point, m."""

    side: str
    middle: FloatArray
    reach: float
    point: FloatArray

    def distance(self, point_times: float = 1.0) -> float:
        """How far the point, in another unit, is from the middle."""
        return float(np.linalg.norm(point_times * self.point - self.middle))


def reference_findings(joint: JointChannels, highest_hz: float) -> Iterator[Finding]:
    """Find coordinates and reference points in different units, and points far from all channels."""
    places, too_wide = [], False
    for side in ("j", "k"):
        every = np.vstack([joint.positions[kind, side] for kind in ("response", "excitation")])
        middle = every.mean(axis=0)
        reach = float(np.sqrt(((every - middle) ** 2).sum(axis=1).mean()))
        too_wide |= extent_of(every) > longest_extent(highest_hz)
        if reach > 0:
            places.append(_Place(side, middle, reach, joint.points["response", side].point))
    wide = [one for one in places if one.reach >= _LARGE and _unit(one, 1) is not None]
    unit = _unit(wide[0], 1) if wide else None
    if wide or too_wide:
        one = max(places, key=lambda each: each.reach)
        numbers = {"unit": unit or "millimetres", "side": one.side, "reach": one.reach}
        yield Finding("coordinates-unit", numbers, severity="error" if unit else "warning")
        return
    far = [one for one in places if one.distance() > _FAR * one.reach]
    if not far:
        return
    one, unit = far[0], _unit(far[0], -1)
    numbers = {
        "which": "the reference point" if len(far) == len(places) else f"the reference point of side {one.side}",
        "point": _in_metres(one.point), "distance": one.distance(), "times": one.distance() / one.reach,
        "reach": 1e3 * one.reach,
    }  # fmt: skip
    if unit is not None:
        yield Finding("coordinates-unit", numbers | {"unit": unit}, variant="reference")
    else:
        yield Finding("reference-point-far", numbers)


def _unit(one: _Place, way: int) -> str | None:
    """Return the unit that brings the reference point to the channels: theirs (way 1), or its own (way -1)."""
    for metres, name in _UNITS:
        distance = one.distance(metres**-way)
        if distance < _NEAR * one.reach and distance * _NEARER < one.distance():
            return name
    return None


def _in_metres(point: FloatArray) -> str:
    return ", ".join(f"{value:.5g}" for value in point + 0.0)
