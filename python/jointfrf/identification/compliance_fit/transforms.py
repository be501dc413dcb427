"""From channels to joint DOFs: the transforms that `identify` is given, checked."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.channels.point_lines import Interface
from jointfrf.identification.compliance_fit.rigidity import ChannelModes, modes_of
from jointfrf.identification.prepare import as_transform
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Transform", "Transforms", "as_transforms"]

#: What a transform may be given as.
Transform = ArrayLike | Interface


class Transforms(NamedTuple):
    """From channels to joint DOFs j, then k.

    Attributes
    ----------
    responses, forces : ndarray, shapes (2 n, m_r), (2 n, m_f)
    response_modes, force_modes : ndarray, shapes (m_r, 2 n), (m_f, 2 n), or None
        Rigid motion of the channels, where it is known.
    geometry : Interface or None
        Of the responses, where it is known.
    compliance : ndarray, shape (n,), or None
        What the sides add to the compliance of the joint DOFs, where that was said.
    """

    responses: FloatArray
    forces: FloatArray
    response_modes: FloatArray | None = None
    force_modes: FloatArray | None = None
    geometry: Interface | None = None
    compliance: FloatArray | None = None

    @property
    def are_units(self) -> bool:
        """Whether the channels are the joint DOFs."""
        return all(
            t.shape[0] == t.shape[1] == np.count_nonzero(t) and (t.diagonal() == 1).all()
            for t in (self.responses, self.forces)
        )

    def gamma(self, h: ComplexArray) -> ComplexArray:
        """Return FRFs between the joint DOFs, m/N."""
        return h if self.are_units else self.responses @ h @ self.forces.T

    def variance(self, variance: FloatArray) -> FloatArray:
        """Return their variance where that of the channels is independent, (m/N)^2."""
        return variance if self.are_units else self.responses**2 @ variance @ (self.forces**2).T

    def with_modes(self, smooth: ComplexArray) -> Transforms:
        """Return the same with the rigid modes of plain matrices, as far as smooth FRFs bear them out."""
        if self.are_units:
            return self
        responses, forces = self.response_modes, self.force_modes
        if responses is None:
            responses = modes_of(self.responses, smooth)
        if forces is None:
            forces = modes_of(self.forces, smooth.swapaxes(1, 2))
        return self._replace(response_modes=responses, force_modes=forces)

    @property
    def channels(self) -> tuple[ChannelModes, ChannelModes] | None:
        """Rigid motion of responses and of forces, where both are known."""
        if self.response_modes is None or self.force_modes is None:
            return None
        return ChannelModes(self.responses, self.response_modes), ChannelModes(self.forces, self.force_modes)


def as_transforms(transform: Transform | tuple[Transform, Transform] | None, h: ComplexArray) -> Transforms:
    """Check the transforms of responses and of forces; one for both, or a pair."""
    m_r, m_f = h.shape[1:]
    if transform is None or isinstance(transform, Interface) or not isinstance(transform, tuple):
        if m_r != m_f:
            raise ValueError(
                f"gamma has {m_r} responses and {m_f} forces: transform must be a pair, for responses and for forces"
            )
        pair = (transform, transform)
    elif len(transform) != 2:
        raise ValueError(f"transform must be one matrix or a pair for responses and forces, not {len(transform)}")
    else:
        pair = transform
    one = pair[0] is pair[1]
    names = ("transform", "transform") if one else ("transform[0]", "transform[1]")
    matrices = [
        as_transform(given.transform if isinstance(given, Interface) else given, m, name)
        for given, m, name in zip(pair, (m_r, m_f), names, strict=True)
    ]
    if one:
        matrices[1] = matrices[0]
    if matrices[0].shape[0] != matrices[1].shape[0]:
        raise ValueError(
            f"transform must lead to the same DOFs from responses and forces, not to {matrices[0].shape[0]} and "
            f"{matrices[1].shape[0]}"
        )
    known = [given if isinstance(given, Interface) else None for given in pair]
    compliances = [given.compliance for given in known if given is not None and given.compliance is not None]
    return Transforms(
        responses=matrices[0],
        forces=matrices[1],
        response_modes=None if known[0] is None else known[0].modes,
        force_modes=None if known[1] is None else known[1].modes,
        geometry=known[0],
        compliance=np.max(compliances, axis=0) if compliances else None,
    )
