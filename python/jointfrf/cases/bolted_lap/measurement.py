"""Where a bolted lap joint is measured, and how the six DOFs of both sides follow: Measurements 1-4, virtual points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.point_lines import difference_weights
from jointfrf.channels.virtual_point import VirtualPoint, virtual_point, virtual_points
from jointfrf.kernel.arguments import FloatArray

__all__ = ["DOFS", "FivePoints", "both_sides", "measured_entries"]

#: Order of the joint DOFs in (4.5) and (4.8).
DOFS = ("x", "theta_y", "y", "theta_x", "z", "theta_z")
_AXES = np.eye(3)


@dataclass(frozen=True)
class FivePoints:
    """Five triaxial points on one side of the joint: rp in the middle, 1 and 3 along z, 2 and 4 along x (figure 4-40).

    Attributes
    ----------
    centre : ndarray, shape (3,)
        Reference point rp, m.
    spacing : tuple of float
        s_x and s_z: from rp to its neighbours, m.
    """

    centre: FloatArray
    spacing: tuple[float, float]

    @cached_property
    def points(self) -> FloatArray:
        """Positions of rp, 1, 2, 3, 4, shape (5, 3), m."""
        s_x, s_z = self.spacing
        offsets = np.array([[0, 0, 0], [0, 0, -s_z], [-s_x, 0, 0], [0, 0, s_z], [s_x, 0, 0]])
        placed: FloatArray = self.centre + offsets
        return placed

    @property
    def channels(self) -> tuple[FloatArray, FloatArray]:
        """Positions and directions of the 15 channels, x, y, z of each point; both of shape (15, 3)."""
        return np.repeat(self.points, 3, axis=0), np.tile(_AXES, (5, 1))

    @cached_property
    def differences(self) -> FloatArray:
        """Transformation (6, 15) to the joint DOFs by second-order central differences (4.14), (4.18).

        Rotations in a right-handed system: theta_y = +du_x/dz, theta_z = +du_y/dx, but theta_x = -du_y/dz, where the
        source has the sign of (4.14) for all of them.
        """
        s_x, s_z = self.spacing
        along_x, along_z = difference_weights(s_x)[1], difference_weights(s_z)[1]
        t = np.zeros((6, 5, 3))
        for row, axis in ((0, 0), (2, 1), (4, 2)):
            t[row, 0, axis] = 1
        t[1, [1, 0, 3], 0] = along_z  # Measurement 1
        t[3, [1, 0, 3], 1] = -along_z  # Measurement 4
        t[5, [2, 0, 4], 1] = along_x  # Measurement 3
        return t.reshape(6, 15)

    @cached_property
    def virtual_point(self) -> VirtualPoint:
        """Rigid motion of all five points about rp, by least squares."""
        return virtual_point(*self.channels, self.centre, DOFS)


def measured_entries() -> NDArray[np.bool_]:
    """Entries of the receptance between six DOFs that Measurements 1-4 give (4.28), shape (6, 6).

    x with theta_y, y with theta_x and with theta_z, z alone. All others stay zero.
    """
    known = np.eye(6, dtype=bool)
    for a, b in (("x", "theta_y"), ("y", "theta_x"), ("y", "theta_z")):
        i, j = DOFS.index(a), DOFS.index(b)
        known[i, j] = known[j, i] = True
    return known


def both_sides(j: FivePoints, k: FivePoints) -> tuple[FloatArray, FloatArray]:
    """Return the transformations (12, 30) of both sides: by central differences, and by virtual points."""
    by_differences = np.zeros((12, 30))
    by_differences[:6, :15], by_differences[6:, 15:] = j.differences, k.differences
    return by_differences, virtual_points(j.virtual_point, k.virtual_point)
