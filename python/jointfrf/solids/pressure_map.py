"""Contact pressure in plan view: what a drawing of figures 4-13 to 4-15 needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import FloatArray
from jointfrf.solids.bolted_lap import INTERFACES, BoltedLap
from jointfrf.solids.contact import InterfaceState

__all__ = ["PressureMap", "pressure_maps"]

#: Nodes within this share of the height of the mesh lie in a face.
_NEAR: Final = 1e-6


@dataclass(frozen=True)
class PressureMap:
    """Pressure on the two faces of an interface, which is the same on both.

    Attributes
    ----------
    points : ndarray, shape (n, 2)
        z and x before loading, m.
    quads : ndarray of int, shape (n_quads, 4)
        Corners, counted in `points`.
    pressure : ndarray, shape (n,)
        Pa; 0 where nothing touches.
    closed, slipping : ndarray of bool, shape (n,)
    nodes : ndarray of int, shape (n,)
        Of the mesh, on the upper body, counted from 0.
    """

    points: FloatArray
    quads: NDArray[np.int32]
    pressure: FloatArray
    closed: NDArray[np.bool_]
    slipping: NDArray[np.bool_]
    nodes: NDArray[np.int32]


def pressure_maps(lap: BoltedLap, states: Mapping[str, InterfaceState]) -> dict[str, PressureMap]:
    """Return the contact pressure on all interfaces.

    Parameters
    ----------
    lap : BoltedLap
    states : mapping of str to InterfaceState

    Returns
    -------
    dict of str to PressureMap
        "head": upper face of A and the head; "lap": lower face of A and upper face of B; "nut": lower face of B and the
        nut.
    """
    return {name: _map(lap, name, states[name]) for name in INTERFACES}


def _map(lap: BoltedLap, name: str, state: InterfaceState) -> PressureMap:
    nodes = lap.interfaces[name].upper
    height = lap.mesh.nodes[:, 1]
    number = np.full(len(height), -1)
    number[nodes] = np.arange(len(nodes))
    faces, _ = lap.mesh.faces()
    flat = np.ptp(height[faces], axis=1) < _NEAR * np.ptp(height)
    quads = number[faces[flat]]
    return PressureMap(
        points=lap.mesh.nodes[nodes][:, [2, 0]],
        quads=quads[(quads >= 0).all(axis=1)].astype(np.int32),
        pressure=state.pressure,
        closed=state.closed,
        slipping=state.slipping,
        nodes=nodes,
    )
