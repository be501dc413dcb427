"""Where a channel of a measurement is, which way it points, and on which side of a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.kernel.arguments import as_nodes, check_type

__all__ = ["ChannelPlace", "ChannelRole", "JointSide", "places_of_nodes"]

ChannelRole = Literal["response", "excitation", "both"]
JointSide = Literal["j", "k"]


@dataclass(frozen=True, eq=False)
class ChannelPlace:
    """What is known of one translational channel beside its FRFs.

    Attributes
    ----------
    channel : Channel
        Its name in the file of FRFs.
    side : {"j", "k"} or None
        Side of the joint; None where it is not said.
    role : {"response", "excitation", "both"}
        As what it counts; "both": as what the file has.
    position : ndarray, shape (3,), or None
        m; None: as the file says.
    direction : ndarray, shape (3,), or None
        Unit vector of the motion or force that the channel of this name stands for; None: as its name says.
    weight : float
        In the virtual point, 0 to leave the channel out.
    optional : bool
        Whether the file need not have it: one of three directions of a sensor.
    where : str
        Where this is said, for messages.
    """

    channel: Channel
    side: JointSide | None = None
    role: ChannelRole = "both"
    position: NDArray[np.float64] | None = None
    direction: NDArray[np.float64] | None = None
    weight: float = 1.0
    optional: bool = False
    where: str = ""

    def __post_init__(self) -> None:
        check_type("channel", self.channel, Channel)

    @property
    def unit(self) -> NDArray[np.float64]:
        """Direction of the channel, shape (3,)."""
        if self.direction is not None:
            return self.direction
        own: NDArray[np.float64] = self.channel.sign * np.eye(3)["xyz".index(self.channel.axis)] + 0.0
        return own


def places_of_nodes(frfs: FrfSet, nodes_j: Sequence[int], nodes_k: Sequence[int]) -> tuple[ChannelPlace, ...]:
    """List the translational channels of a set at nodes on both sides of a joint.

    Parameters
    ----------
    frfs : FrfSet
        With coordinates of the nodes.
    nodes_j, nodes_k : sequence of int
        Nodes on side j (on A) and on side k (on B).

    Returns
    -------
    tuple of ChannelPlace
        In the order of the nodes; position and direction as the set says.

    Raises
    ------
    ValueError
        A node is on both sides, or the set has no translational channel there.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.frf.channel_place import places_of_nodes
    >>> from jointfrf.io import Channel, FrfSet
    >>> ends = (Channel(1, "+y"), Channel(2, "-z"))
    >>> frfs = FrfSet(np.array([10.0]), ends, ends, np.ones((1, 2, 2)))
    >>> [(str(place.channel), place.side) for place in places_of_nodes(frfs, [1], [2])]
    [('1:+y', 'j'), ('2:-z', 'k')]
    """
    check_type("frfs", frfs, FrfSet)
    nodes_j, nodes_k = as_nodes("nodes_j", nodes_j), as_nodes("nodes_k", nodes_k)
    shared = set(nodes_j) & set(nodes_k)
    if shared:
        raise ValueError(f"node {min(shared)} is named on both sides of the joint")
    # A sensor along +y and a hammer along -y are the same channel: FRFs are found with their signs.
    known = {(c.node, c.axis): c for c in (*frfs.excitations, *frfs.responses) if not c.is_rotation}
    found = []
    for side, nodes in (("j", nodes_j), ("k", nodes_k)):
        for node in dict.fromkeys(nodes):
            own = [channel for (at, _), channel in sorted(known.items()) if at == node]
            if not own:
                raise ValueError(f"node {node} has no channel of a translation")
            found += [ChannelPlace(channel, side) for channel in own]  # type: ignore[arg-type]
    return tuple(found)
