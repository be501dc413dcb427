"""Joint DOFs that are channels themselves: one node on each side, with its translations and rotations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.channels.point_lines import Interface
from jointfrf.dofs import direction_names, direction_places
from jointfrf.frf.frf_set import Channel

__all__ = ["node_dofs"]

_CHANNELS = ("x", "y", "z", "rx", "ry", "rz")


def node_dofs(node_j: int, node_k: int, dofs: Sequence[str], coordinates: Mapping[int, ArrayLike]) -> Interface:
    """Take translations and rotations of two nodes as the DOFs of a joint, as a model or a coupled assembly gives them.

    Parameters
    ----------
    node_j, node_k : int
        Nodes on side j (on A) and on side k (on B).
    dofs : sequence of str
        Joint DOFs.
    coordinates : mapping of int to array_like, shape (3,)
        Positions of the nodes, m; a node that is missing is taken to lie where the other one is.

    Returns
    -------
    Interface
        Channels ``node:x`` ... ``node:rz`` of j, then of k; the transform is a unit matrix.

    Raises
    ------
    ValueError
        An unknown DOF, or both nodes are the same.

    Examples
    --------
    >>> from jointfrf.channels.node_dofs import node_dofs
    >>> [str(channel) for channel in node_dofs(3, 4, ["y", "theta_z"], {}).channels]
    ['3:+y', '3:+rz', '4:+y', '4:+rz']
    """
    if node_j == node_k:
        raise ValueError(f"node {node_j} is named on both sides of the joint")
    places = direction_places(dofs)
    n = places.size
    channels = tuple(Channel(node, _CHANNELS[place]) for node in (node_j, node_k) for place in places)
    given = [np.asarray(coordinates[node], float) for node in (node_j, node_k) if node in coordinates]
    ends = given if len(given) == 2 else [np.zeros(3)] * 2
    motion = np.zeros((2 * n, 12))
    motion[np.arange(n), places] = 1
    motion[n + np.arange(n), 6 + places] = 1
    return Interface(channels, np.eye(2 * n), (ends[0], ends[1]), direction_names(dofs), motion)
