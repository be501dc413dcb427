"""DOFs left out of an interface whose motion the channels attribute to a DOF that is kept."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.channels.point_lines import Interface
from jointfrf.dofs import DIRECTIONS, direction_places, is_rotation
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["LeftOutDof", "OffsetCoupling", "left_out_dofs", "offset_couplings"]

#: Geometry below this share of the reach of the channels is rounding.
_NOTHING = 1e-6
#: The channels show a DOF when it is known to this part of a unit.
_SHOWN = 1e-6
#: Share of the motion of a DOF from which on another one that enters it is named.
_ENTERS = 0.05
#: Arms below this are rounding, m.
_NO_ARM = 1e-6


class LeftOutDof(NamedTuple):
    """A DOF left out that enters one that is kept.

    Attributes
    ----------
    side : {"j", "k"}
    dof, into : str
        The DOF left out, and the one that its motion is attributed to.
    weight : float
        Of its motion there: 1, m, 1/m.
    share : float
        Its part in the motion found of that DOF, root mean square over lines and forces; NaN where the channels do not
        show the DOF.
    """

    side: str
    dof: str
    into: str
    weight: float
    share: float

    @property
    def matters(self) -> bool:
        """Whether it is a noticeable part of the motion found, or may be."""
        return not self.share < _ENTERS

    def __str__(self) -> str:
        unit = " m" if is_rotation(self.dof) > is_rotation(self.into) else ""
        size = (
            f"{100 * self.share:.0f} % of its motion"
            if np.isfinite(self.share)
            else "how much cannot be seen from these channels"
        )
        return (
            f"{self.weight:.3g}{unit} of {self.dof}, which is left out, enters {self.into} of side {self.side} "
            f"({size}): fit {self.dof}, too, or move the reference point or the channels"
        )


class OffsetCoupling(NamedTuple):
    """A rotation that an offset between the reference points of the two sides turns into relative displacement.

    Attributes
    ----------
    translation, rotation : str
        The DOF kept, and the rotation of both sides together.
    arm : float
        Relative displacement for a unit of the rotation, m.
    is_left_out : bool
        Whether the rotation is no DOF of the joint.
    """

    translation: str
    rotation: str
    arm: float
    is_left_out: bool

    def __str__(self) -> str:
        left = ", which is left out" if self.is_left_out else ""
        return (
            f"the offset between the reference points couples {self.translation} with {self.rotation}{left}: "
            f"{1e3 * self.arm:.3g} mm"
        )


def offset_couplings(interface: Interface) -> tuple[OffsetCoupling, ...]:
    """Find the rotations that an offset of the reference points turns into displacements of the joint.

    Parameters
    ----------
    interface : Interface

    Returns
    -------
    tuple of OffsetCoupling
        Empty where both sides have one reference point.

    Notes
    -----
    Where both sides turn by theta as one body, points that are d apart move theta x d against each other: a joint
    between them resists that, and its stiffness is not diagonal.

    Examples
    --------
    >>> import jointfrf as jf
    >>> from jointfrf.channels.left_out_dofs import offset_couplings
    >>> sides = jf.interface([1], [2], ["x"], {1: (0, 0, 0), 2: (0, 0.006, 0)})
    >>> print(*offset_couplings(sides))
    the offset between the reference points couples x with theta_z, which is left out: -6 mm
    """
    apart = interface.references[1] - interface.references[0]
    kept = direction_places(interface.dofs)
    found = []
    for axis in range(3):
        moved = np.cross(np.eye(3)[axis], apart)
        rotation = DIRECTIONS[3 + axis]
        found += [
            OffsetCoupling(DIRECTIONS[place], rotation, float(moved[place]), 3 + axis not in kept)
            for place in kept
            if place < 3 and abs(moved[place]) > _NO_ARM
        ]
    return tuple(found)


def left_out_dofs(h: ComplexArray, interface: Interface) -> tuple[LeftOutDof, ...]:
    """Find the DOFs left out whose motion enters DOFs that are kept.

    Parameters
    ----------
    h : ndarray, shape (n_freq, m, m_in)
        FRFs of the channels of the interface.
    interface : Interface

    Returns
    -------
    tuple of LeftOutDof
        Of each DOF left out, the one kept that it disturbs most on each side.

    Notes
    -----
    A channel 6 mm from the reference point along y shows x - 0.006 theta_z where the side turns: with theta_z left out,
    T M holds -0.006 for its rigid motion M. How much theta_z there is comes from all DOFs that the channels show.
    """
    n, found = len(interface.dofs), []
    for side in range(2):
        own = interface.transform[side * n : (side + 1) * n]
        at = np.flatnonzero(own.any(axis=0))
        motion = interface.motion[at][:, side * 6 : side * 6 + 6]
        inverse = np.linalg.pinv(motion)
        size = _rms(inverse @ h[:, at])
        shown = abs(np.diagonal(inverse @ motion) - 1) < _SHOWN
        of_kept = _rms(own @ h)
        weights = own[:, at] @ motion
        reach = np.sqrt((motion[:, 3:] ** 2).sum(axis=1).max())
        unit = np.array([1.0] * 3 + [1 / (reach or 1.0)] * 3)
        unit_kept = unit[[DIRECTIONS.index(dof) for dof in interface.dofs]]
        for d, dof in enumerate(DIRECTIONS):
            if dof in interface.dofs:
                continue
            relative = abs(weights[:, d]) * unit[d] / unit_kept
            if relative.max() < _NOTHING:
                continue
            weight = np.where(relative < _NOTHING, 0, weights[:, d])
            shares = abs(weight) * size[d] / np.maximum(of_kept, np.finfo(float).tiny)
            most = int((shares if shown[d] else relative).argmax())
            share = float(shares[most]) if shown[d] else np.nan
            found.append(LeftOutDof("jk"[side], dof, interface.dofs[most], float(weight[most]), share))
    return tuple(found)


def _rms(q: ComplexArray) -> FloatArray:
    """Return the root mean square of each row over its columns, and its median over lines."""
    size: FloatArray = np.median(np.sqrt((abs(q) ** 2).mean(axis=2)), axis=0)
    return size
