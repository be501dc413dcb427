"""Parts as models of flexible sides of a joint: DOFs of the part for the channels of a test."""

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

#: Largest distance of a channel from the nearest node of a part, m, and distance above which it is reported.
_FARTHEST, _AT_IT = 0.01, 1e-4


@dataclass(frozen=True)
class PlacedChannel:
    """A channel of a test.

    Attributes
    ----------
    channel : Channel
        Name of the channel.
    direction : ndarray, shape (3,)
        Unit vector of the motion or force.
    position : ndarray, shape (3,), or None
        Position from the reference point of the joint, m; None if it is unknown.
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
        Model of the side, with the DOFs of the channels.
    text : tuple of str
        Properties that help to check the file, and channels at a distance from their nodes.
    """

    model: SideModel
    text: tuple[str, ...]


def read_side(
    path: Path, freq_hz: FloatArray, responses: Sequence[PlacedChannel], forces: Sequence[PlacedChannel], n: int
) -> SidePart:
    """Return the part of `part.toml` as the model of a side, with the DOFs of its channels.

    Parameters
    ----------
    path : Path
        Path of a file with the table of one part, as in `assembly.toml`; its `joint` is at the reference point.
    freq_hz : ndarray, shape (n_freq,)
        Lines of the test, Hz.
    responses, forces : sequence of PlacedChannel
        Channels of the side.
    n : int
        Number of joint DOFs.

    Raises
    ------
    FileContentError
        A key is missing or wrong, or a channel is no DOF of the part by its name or place.

    Notes
    -----
    If the nodes of a part have places, its joint is at the reference point of the test, and a channel belongs to the
    nearest node by its relative position. Otherwise node and direction in its name determine the DOF.
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
    # The eigenvalue of a mode contains the errors of its stiffness and of its mass.
    modes = {} if substructure.model_error is None else {"modes": np.sqrt(2) * substructure.model_error}
    model = part.keys.build(lambda: SideModel(substructure, tuple(found[0]), tuple(found[1]), **modes))
    text = [f"side by {path}: {len(responses)} responses, {len(forces)} excitations", *part.describe()]
    text += [f"  nearest nodes: {'; '.join(moved.values())}"] if moved else []
    return SidePart(model, tuple(text))


def _node(part: AssemblyPart, channel: PlacedChannel, origin: FloatArray | None, path: Path) -> tuple[str, float]:
    """Return the node of a channel, and its distance."""
    by_name = str(channel.channel.node)
    if origin is None or channel.position is None or channel.channel.is_rotation:
        return by_name, 0.0
    names = [name for name in part.places if any(part.has(f"{name}:{d}") for d in DIRECTIONS[:3])]
    apart = np.linalg.norm([part.places[name] - origin - channel.position for name in names], axis=1)
    nearest = int(apart.argmin())
    if apart[nearest] > _FARTHEST:
        where = ", ".join(f"{1e3 * x:.4g}" for x in channel.position)
        raise FileContentError(
            f"{path}: channel {channel.channel} at ({where}) mm from the joint is {1e3 * apart[nearest]:.3g} mm away "
            f"from the nearest node, {names[nearest]}; correct the position"
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
                f"{path} has no DOF {node}:{direction} for channel {channel.channel}; add it to the model"
            )
    return {f"{node}:{direction}": weight for direction, weight in weights.items()}
