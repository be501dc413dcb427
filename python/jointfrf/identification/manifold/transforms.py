"""From channels to joint DOFs, and non-rigid motion of the channels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.channels.point_lines import Interface
from jointfrf.frf.smoothing import near_squares
from jointfrf.identification.prepare import as_transform
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "ChannelModes",
    "Transform",
    "Transforms",
    "as_transforms",
    "deformation_variance",
    "modes_of",
]

#: Types that the argument `transform` accepts.
Transform = ArrayLike | Interface


class Transforms(NamedTuple):
    """From channels to joint DOFs j, then k.

    Attributes
    ----------
    responses, forces : ndarray, shapes (2 n, m_r), (2 n, m_f)
        Matrices from channels to joint DOFs j, then k.
    response_modes, force_modes : ndarray, shapes (m_r, 2 n), (m_f, 2 n), or None
        Rigid motion of the channels, if known.
    geometry, force_geometry : Interface or None
        Geometry of the responses and of the forces, if known.
    compliance : ndarray, shape (n,), or None
        Stated compliance that the sides add to the joint DOFs, m/N or rad/(N m).
    """

    responses: FloatArray
    forces: FloatArray
    response_modes: FloatArray | None = None
    force_modes: FloatArray | None = None
    geometry: Interface | None = None
    compliance: FloatArray | None = None
    force_geometry: Interface | None = None

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
        """Return the variance of these FRFs for independent noise of the channels, (m/N)^2."""
        return variance if self.are_units else self.responses**2 @ variance @ (self.forces**2).T

    def with_modes(self, smooth: ComplexArray) -> Transforms:
        """Return the same with the rigid modes of plain matrices, if smooth FRFs confirm them."""
        if self.are_units:
            return self
        responses, forces = self.response_modes, self.force_modes
        if responses is None:
            responses = modes_of(self.responses, smooth)
        if forces is None:
            forces = modes_of(self.forces, smooth.swapaxes(1, 2))
        return self._replace(response_modes=responses, force_modes=forces)

    def position_errors(self, size: float) -> tuple[FloatArray, FloatArray] | None:
        """Return the joint DOFs that errors of positions mix, of responses and of forces, shapes (n_errors, 2 n, 2 n).

        Each channel is displaced from its stated position by `size`, m, along one axis. Channels that are both
        responses and forces are points of the structure: one error moves the sensor and the impact. None if the
        positions are not known, or if no joint DOF depends on them.
        """
        if self.geometry is None or self.force_geometry is None:
            return None
        mixed = [
            np.einsum("dm,ame->amde", transform, size * own.mode_slopes).reshape(-1, *[len(transform)] * 2)
            for transform, own in ((self.responses, self.geometry), (self.forces, self.force_geometry))
        ]
        if self.geometry is not self.force_geometry:
            mixed = [np.concatenate(own) for own in ((mixed[0], 0 * mixed[1]), (0 * mixed[0], mixed[1]))]
        moved = [one.any(axis=(1, 2)) for one in mixed]
        either = moved[0] | moved[1]
        return (mixed[0][either], mixed[1][either]) if either.any() else None

    @property
    def channels(self) -> tuple[ChannelModes, ChannelModes] | None:
        """Rigid motion of responses and of forces, if both are known."""
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
        force_geometry=known[1],
        compliance=np.max(compliances, axis=0) if compliances else None,
    )


#: Least share of an error that stays in the residual of a channel which the other channels check.
_CHECKED = 0.02
#: Least share of rigid motion in the motion of the channels for modes that follow from a matrix alone.
_RIGID = 0.9


class ChannelModes(NamedTuple):
    """Rigid motion of channels.

    Attributes
    ----------
    transform : ndarray, shape (2 n, m)
        Matrix from channels to joint DOFs j, then k.
    modes : ndarray, shape (m, 2 n)
        Motion of each channel for a unit of each joint DOF; transform times modes is the unit matrix.
    """

    transform: FloatArray
    modes: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Matrix from the channels to their non-rigid motion, shape (m, m)."""
        left: FloatArray = np.eye(len(self.modes)) - self.modes @ self.transform
        return left

    @property
    def redundancy(self) -> FloatArray:
        """Share of an error in each channel that stays in its residual, shape (m,); 0 below the usable value."""
        own = np.diagonal(self.residual)
        share: FloatArray = np.where(own > _CHECKED, own, 0.0)
        return share

    def of_side(self, side: int) -> NDArray[np.intp]:
        """Return the channels of the DOFs of side 0 (j) or 1 (k)."""
        n = len(self.transform) // 2
        return np.flatnonzero(self.transform[side * n : (side + 1) * n].any(axis=0))


def deformation_variance(smooth: ComplexArray, responses: ChannelModes, forces: ChannelModes) -> FloatArray:
    """Return squares of the non-rigid motion in smooth FRFs of the channels, shape (n_freq, m_r, m_f), (m/N)^2.

    Squares of responses and of forces are divided by the redundancy of their channel, so that the mean equals the mean
    of the errors themselves. They are averaged over a line and its neighbours. A channel that no other channel checks
    has none.
    """
    total = np.zeros(smooth.shape)
    for residual, share in (
        (responses.residual @ smooth, responses.redundancy[:, None]),
        (smooth @ forces.residual.T, forces.redundancy[None, :]),
    ):
        total += np.where(share > 0, near_squares(residual) / np.where(share > 0, share, 1), 0)
    return total


def modes_of(transform: FloatArray, smooth: ComplexArray) -> FloatArray | None:
    """Return the rigid modes whose pseudo-inverse a matrix is, if the channels move accordingly; else None.

    Parameters
    ----------
    transform : ndarray, shape (2 n, m)
        Matrix from channels to joint DOFs.
    smooth : ndarray, shape (n_freq, m, k)
        FRFs of its channels, m/N.
    """
    if np.linalg.matrix_rank(transform) < len(transform):
        return None
    modes: FloatArray = np.asarray(np.linalg.pinv(transform), np.float64)
    rigid = np.linalg.norm(modes @ (transform @ smooth), axis=(1, 2))
    whole = np.linalg.norm(smooth, axis=(1, 2))
    share = np.median(rigid / np.maximum(whole, np.finfo(float).tiny))
    return modes if abs(share - 1) < 1 - _RIGID else None
