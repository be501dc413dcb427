"""A hammer test of two rigid bodies with a six-DOF joint: 24 responses, 24 impacts, sensors and impacts apart."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet
from rigid_bodies import AROUND, BODY_A, BODY_B, DOFS, POINT, along, six

JOINT = jf.Joint([2e6, 3e6, 5e6, 2e3, 3e3, 1e3], [40, 60, 90, 0.06, 0.08, 0.03], DOFS)
FREQ_HZ = np.arange(20.0, 1000.0, 8.0)
#: Nodes of sensors and of impacts on both sides.
SENSORS, IMPACTS = ((101, 104), (201, 204)), ((111, 122), (211, 222))
_AXES = "xyz"


def _impacts(seed):
    """Twelve impacts around the point, four along each axis, to and fro."""
    places = POINT + 0.03 * np.random.default_rng(seed).uniform(-1, 1, (12, 3))
    return places, [f"{'-+'[i % 2]}{_AXES[i % 3]}" for i in range(12)]


@lru_cache(maxsize=1)
def hammer_test():
    """FRFs as accelerances without noise, with the coordinates of all nodes."""
    parts, responses, excitations, places = [], [], [], {}
    for side, body in enumerate((BODY_A, BODY_B)):
        sensors = POINT + AROUND
        at, directions = _impacts(side)
        first, hit = SENSORS[side][0], IMPACTS[side][0]
        responses += [Channel(first + i, f"+{axis}") for i in range(4) for axis in _AXES]
        excitations += [Channel(hit + i, direction) for i, direction in enumerate(directions)]
        places |= {first + i: place for i, place in enumerate(sensors)}
        places |= {hit + i: place for i, place in enumerate(at)}
        seen = along(np.repeat(sensors, 3, axis=0), np.tile(np.eye(3), (4, 1)))
        driven = along(at, [float(f"{d[0]}1") * np.eye(3)[_AXES.index(d[1])] for d in directions])
        parts.append(body.receptance(FREQ_HZ, [*six(POINT), *seen, *driven], [*six(POINT), *seen, *driven]))
    h = jf.couple(*parts, JOINT.dynamic_stiffness(FREQ_HZ), range(6), range(6))
    n = 6 + 12 + 12
    rows = [*range(6, 18), *range(n + 6, n + 18)]
    columns = [*range(18, 30), *range(n + 18, n + 30)]
    power = (2j * np.pi * FREQ_HZ)[:, None, None] ** 2
    return FrfSet(
        FREQ_HZ, tuple(responses), tuple(excitations), power * h[:, rows][:, :, columns], "accelerance", places
    )


def noisy(frfs, level=0.01, seed=3):
    """The same with relative noise of its own in each FRF."""
    random = np.random.default_rng(seed)
    noise = (random.standard_normal(frfs.h.shape) + 1j * random.standard_normal(frfs.h.shape)) / np.sqrt(2)
    return FrfSet(
        frfs.freq_hz, frfs.responses, frfs.excitations, frfs.h * (1 + level * noise), frfs.quantity, frfs.coordinates
    )
