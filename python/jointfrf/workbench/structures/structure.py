"""One of the two structures that a joint connects: a model or FRFs, and the keys of a file that declare it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.models.model import Model
from jointfrf.models.points import PointModel, PointPatch
from jointfrf.toml.declared import Keys

__all__ = ["MeasuredStructure", "ModelStructure", "Structure", "SubstructureKeys"]

#: Relative difference of frequencies below which they are the same line: Universal Files have six digits.
_SAME_LINE = 1e-5


class Structure(ABC):
    """One of the two structures that the joint connects."""

    @abstractmethod
    def check_points(self, joint: Sequence[str], internal: Sequence[str]) -> None:
        """Raise a ValueError if a joint DOF or an internal one is missing, or a joint DOF is named twice."""

    @property
    @abstractmethod
    def places(self) -> dict[str, FloatArray]:
        """Places of its nodes, m, as far as they are known."""

    @abstractmethod
    def receptance(self, freq_hz: FloatArray, points: Sequence[str]) -> ComplexArray:
        """Return the receptance between DOFs, shape (n_freq, m, m), m/N."""


def _check_once(names: Sequence[str]) -> None:
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise ValueError(f"the joint DOF {twice[0]!r} is named twice; name each DOF once")


@dataclass(frozen=True)
class ModelStructure(Structure):
    """A substructure known by its model.

    Attributes
    ----------
    model : Model
    x : ndarray, shape (n_nodes,), or None
        Positions of the nodes along a beam, m.
    about : str
        Which files it is of; empty for models that are built.
    patches : tuple of PointPatch
        Nodes of its reference points.
    """

    model: Model
    x: FloatArray | None = None
    about: str = ""
    patches: tuple[PointPatch, ...] = ()

    @property
    def places(self) -> dict[str, FloatArray]:
        """Places of nodes and reference points, m; a beam lies along x."""
        if isinstance(self.model, PointModel):
            return dict(self.model.places)
        return {} if self.x is None else {str(i): np.array([x, 0.0, 0.0]) for i, x in enumerate(self.x, 1)}

    def check_points(self, joint: Sequence[str], internal: Sequence[str]) -> None:
        """Raise an error if a DOF is missing; a joint cannot act on a mean motion."""
        self.dofs(joint)
        _check_once(joint)
        self.model.ports(*joint, *internal)

    def dofs(self, names: Sequence[str]) -> list[int]:
        """Return DOFs, counted from 0."""
        found = self.model.index(*names)
        return [found] if isinstance(found, int) else found

    def receptance(self, freq_hz: FloatArray, points: Sequence[str]) -> ComplexArray:
        """Return the receptance of the model."""
        return self.model.receptance(freq_hz, self.model.ports(*points))


@dataclass(frozen=True)
class MeasuredStructure(Structure):
    """A substructure known by its FRFs.

    Attributes
    ----------
    frfs : FrfSet
        Receptances.
    """

    frfs: FrfSet

    @property
    def places(self) -> dict[str, FloatArray]:
        """Places of nodes, m, if the file contains them."""
        return {str(node): np.asarray(at) for node, at in (self.frfs.coordinates or {}).items()}

    def check_points(self, joint: Sequence[str], internal: Sequence[str]) -> None:
        """Raise an error if an FRF is missing, or a driving point does not move."""
        channels = [Channel.parse(name) for name in (*joint, *internal)]
        _check_once([f"{channel.node}:{channel.axis}" for channel in channels[: len(joint)]])
        h = self.frfs.matrix(channels, channels)
        for i, channel in enumerate(channels):
            if not h[:, i, i].any():
                raise ValueError(f"{self.frfs.source}: the FRF {channel} / {channel} is zero on all lines; check it")

    def receptance(self, freq_hz: FloatArray, points: Sequence[str]) -> ComplexArray:
        """Return the receptances on lines that the set contains."""
        h: ComplexArray = self.frfs.matrix(points, points)[self.lines_at(freq_hz)]
        return h

    def lines_at(self, freq_hz: FloatArray) -> list[int]:
        """Return the lines of the set at given frequencies, or raise ValueError if one is missing."""
        held = self.frfs.freq_hz
        above = np.clip(np.searchsorted(held, freq_hz), 1, max(held.size - 1, 1))
        below = above - 1
        above = np.minimum(above, held.size - 1)
        nearest = np.where(abs(held[above] - freq_hz) < abs(held[below] - freq_hz), above, below)
        missing = abs(held[nearest] - freq_hz) > _SAME_LINE * freq_hz
        if missing.any():
            first = int(np.argmax(missing))
            raise ValueError(
                f"{self.frfs.source} has no line at {freq_hz[first]:g} Hz, the nearest is {held[nearest[first]]:g} Hz "
                f"({int(missing.sum())} of {freq_hz.size} lines are missing); set from_file in [frequency]"
            )
        return [int(line) for line in nearest]


class SubstructureKeys(Keys, tag_field="model"):
    """One of the two structures that the joint connects."""

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure; FRFs must be available on all lines, Hz. Raises FileContentError."""
        raise NotImplementedError
