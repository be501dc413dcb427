"""Whether reference points and channels of a joint are where they can be: in one unit, and near one another."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from jointfrf.channels.check.finding import FindingLevel, FrfFinding
from jointfrf.channels.joint_channels import JointChannels
from jointfrf.kernel.arguments import FloatArray

__all__ = ["reference_findings"]

#: Root mean square distance of channels from their middle, m, from which they lie about no joint: coordinates in
#: another unit. From the first such a unit is tried, where it brings the reference point nearer.
_LARGE, _WIDEST = 0.5, 5.0
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


def reference_findings(joint: JointChannels) -> Iterator[FrfFinding]:
    """Find coordinates and reference points in different units, and points far from all channels."""
    places = []
    for side in ("j", "k"):
        every = np.vstack([joint.positions[kind, side] for kind in ("response", "excitation")])
        middle = every.mean(axis=0)
        reach = float(np.sqrt(((every - middle) ** 2).sum(axis=1).mean()))
        if reach > 0:
            places.append(_Place(side, middle, reach, joint.points["response", side].point))
    wide = [one for one in places if one.reach >= _LARGE and _unit(one, 1) is not None]
    unit = _unit(wide[0], 1) if wide else None
    if wide or any(one.reach >= _WIDEST for one in places):
        one = max(places, key=lambda each: each.reach)
        told = f"and the reference point {_in_metres(one.point)} is in metres: " if unit else ""
        yield _found(
            "error" if unit else "warning", one.reach, _WIDEST,
            f"the coordinates of the channels look like {unit or 'millimetres'}, {told}they lie {one.reach:.3g} m "
            f"(root mean square) about their middle on side {one.side}",
            "give coordinates of channels, and the reference point, in metres",
        )  # fmt: skip
        return
    far = [one for one in places if one.distance() > _FAR * one.reach]
    if not far:
        return
    one, unit = far[0], _unit(far[0], -1)
    both = "the reference point" if len(far) == len(places) else f"the reference point of side {one.side}"
    where = (
        f"{both}, {_in_metres(one.point)}, lies {one.distance():.3g} m from the middle of its channels, "
        f"{one.distance() / one.reach:.3g} times their reach of {1e3 * one.reach:.3g} mm"
    )
    if unit is not None:
        yield _found(
            "error", one.distance() / one.reach, _FAR, f"{where}: its coordinates look like {unit}",
            "give the reference point in metres",
        )  # fmt: skip
    else:
        yield _found(
            "warning", one.distance() / one.reach, _FAR,
            f"{where}: errors of rotations enter its displacements that many times larger",
            "put it at the joint, or name the channels next to it",
        )  # fmt: skip


def _found(level: FindingLevel, value: float, threshold: float, message: str, remedy: str) -> FrfFinding:
    return FrfFinding("reference", level, (), value, threshold, message, remedy)


def _unit(one: _Place, way: int) -> str | None:
    """Return the unit that brings the reference point to the channels: theirs (way 1), or its own (way -1)."""
    for metres, name in _UNITS:
        distance = one.distance(metres**-way)
        if distance < _NEAR * one.reach and distance * _NEARER < one.distance():
            return name
    return None


def _in_metres(point: FloatArray) -> str:
    return ", ".join(f"{value:.5g}" for value in point + 0.0)
