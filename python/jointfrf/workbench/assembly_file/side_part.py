"""Parts as models of the sides of a joint that bend: which DOF of a part each channel of a test is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointfrf.dofs import DIRECTIONS, direction_names
from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import Channel
from jointfrf.identification.side_models import ModelChannel, SideModel
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.assembly_file.read import AssemblyPart, read_part

__all__ = ["PlacedChannel", "SidePart", "read_side"]

#: A channel is taken to the nearest node of a part up to this distance, m; it is said from the second one on.
_FARTHEST, _AT_IT = 0.01, 1e-4


@dataclass(frozen=True)
class PlacedChannel:
    """A channel of a test.

    Attributes
    ----------
    channel : Channel
    direction : ndarray, shape (3,)
        Unit vector of its motion or force.
    position : ndarray, shape (3,), or None
        From the reference point of the joint, m; None where it is not known.
    """

    channel: Channel
    direction: FloatArray
    position: FloatArray | None = None


@dataclass(frozen=True)
class SidePart:
    """A part as the model of a side.

    Attributes
    ----------
    model : SideModel
    text : tuple of str
        What shows that the file holds the right thing, and which channel is at which node.
    """

    model: SideModel
    text: tuple[str, ...]


def read_side(
    path: Path, freq_hz: FloatArray, responses: Sequence[PlacedChannel], forces: Sequence[PlacedChannel], n: int
) -> SidePart:
    """Read `part.toml` and find the channels of a side in it.

    Parameters
    ----------
    path : Path
        The table of one part, as in `assembly.toml`; its `joint` is at the reference point.
    freq_hz : ndarray, shape (n_freq,)
        Lines of the test, Hz.
    responses, forces : sequence of PlacedChannel
    n : int
        Joint DOFs.

    Raises
    ------
    FileContentError
        Something in the file is missing or wrong; a channel is no DOF of the part, by its name or by its place.

    Notes
    -----
    Where the nodes of a part have places, its joint is taken to the reference point of the test: channels are found by
    the place relative to it, at the nearest node; else by their names, node and direction.
    """
    part = read_part(path)
    if len(part.keys.joint) != n:
        raise part.keys.wrong("joint", f"{len(part.keys.joint)} DOFs; name the {n} DOFs of the joint")
    origin = part.places.get(part.keys.joint[0].rpartition(":")[0])
    found, moved = [], {}
    for own in (responses, forces):
        named = []
        for one in own:
            node, distance = _node(part, one, origin, path)
            if distance > _AT_IT:
                moved[str(one.channel)] = f"{one.channel} at node {node}, {1e3 * distance:.2g} mm off"
            named.append(_dof(part, node, one, path))
        found.append(named)
    names = [dof for own in found for channel in own for dof in channel]
    substructure = part.substructure(freq_hz, names)
    # The eigenvalue of a mode holds both errors, of its stiffness and of its mass.
    modes = {} if substructure.model_error is None else {"modes": np.sqrt(2) * substructure.model_error}
    model = part.keys.build(lambda: SideModel(substructure, tuple(found[0]), tuple(found[1]), **modes))
    text = [f"side by {path}: {len(responses)} responses, {len(forces)} excitations", *part.describe()]
    text += [f"  nearest nodes: {'; '.join(moved.values())}"] if moved else []
    return SidePart(model, tuple(text))


def _node(part: AssemblyPart, channel: PlacedChannel, origin: FloatArray | None, path: Path) -> tuple[str, float]:
    """Return the node of a channel, and how far it is away."""
    by_name = str(channel.channel.node)
    if origin is None or channel.position is None or channel.channel.is_rotation:
        return by_name, 0.0
    names = [name for name in part.places if any(part.has(f"{name}:{d}") for d in DIRECTIONS[:3])]
    apart = np.linalg.norm([part.places[name] - origin - channel.position for name in names], axis=1)
    nearest = int(apart.argmin())
    if apart[nearest] > _FARTHEST:
        where = ", ".join(f"{1e3 * x:.4g}" for x in channel.position)
        raise FileContentError(
            f"{path}: no node is at channel {channel.channel}, ({where}) mm from the joint; the nearest, "
            f"{names[nearest]}, is {1e3 * apart[nearest]:.3g} mm away; correct the position"
        )
    return names[nearest], float(apart[nearest])


def _dof(part: AssemblyPart, node: str, channel: PlacedChannel, path: Path) -> ModelChannel:
    """Return a channel as a sum of DOFs of its node."""
    if channel.channel.is_rotation:
        axis = direction_names([channel.channel.axis])[0]
        weights = {axis if part.has(f"{node}:{axis}") else "theta": float(channel.channel.sign)}
    else:
        weights = {d: float(w) for d, w in zip(DIRECTIONS[:3], channel.direction, strict=True) if abs(w) > 1e-9}
    for direction in weights:
        if not part.has(f"{node}:{direction}"):
            raise FileContentError(
                f"{path}: DOF {node}:{direction} of channel {channel.channel} is missing; add it to the model"
            )
    return {f"{node}:{direction}": weight for direction, weight in weights.items()}
