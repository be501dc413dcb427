"""Coordinates of a joint of laws: its compliance on every line, and derivatives of it."""

from __future__ import annotations

import numpy as np

from jointfrf.identification.model_fit.unknowns import ParameterVector, joint_vector
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["LawCoordinates"]


class LawCoordinates:
    """The compliance of a joint of laws as a function of the coordinates of its parameters.

    Parameters
    ----------
    joint : LawJoint
        Without masses; rigid DOFs have no compliance. Its values are where a fit may start.
    omega : ndarray, shape (n_freq,)
        rad/s.
    size : ndarray, shape (n,)
        Dynamic stiffness of the structure at the joint DOFs: stiffnesses are sought around it.

    Notes
    -----
    Entries are the upper triangle of C. Stiffnesses and times that cannot be negative are sought as logarithms.
    """

    def __init__(self, joint: LawJoint, omega: FloatArray, size: FloatArray) -> None:
        self.joint, self.omega, self.size = joint, omega, size
        self.vector: ParameterVector = joint_vector(joint, (), size)
        self.lower, self.upper = self.vector.bounds
        self.rows, self.columns = np.triu_indices(len(joint.dofs))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.joint.names

    def _at(self, x: FloatArray) -> LawJoint:
        return self.joint.with_values(self.vector.to_values(x))

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the upper triangle of C, shape (n_freq, n (n + 1)/2); NaN where K* is singular."""
        c = self._at(x).compliance(self.omega / (2 * np.pi), on_singular="nan")
        return np.ascontiguousarray(c[:, self.rows, self.columns])

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return its derivatives by the coordinates, -C dK C, shape (n_freq, n (n + 1)/2, p)."""
        n = len(self.joint.dofs)
        c = np.empty((len(entries), n, n), np.complex128)
        c[:, self.rows, self.columns] = c[:, self.columns, self.rows] = entries
        slope = np.zeros((*entries.shape, x.size), np.complex128)
        for i, (places, by_value) in enumerate(self._at(x).connection_slopes(self.omega)):
            for a, b in places:
                slope[:, :, i] -= c[:, self.rows, a] * c[:, b, self.columns] * by_value[:, None]
        slope *= self.vector.slope(x)
        return slope

    def on_lines(self, lines: slice) -> LawCoordinates:
        """Return the same on some of the lines."""
        return LawCoordinates(self.joint, self.omega[lines], self.size)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters."""
        return self.vector.to_values(x)

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the coordinates of parameters."""
        return self.vector.to_coordinates(theta)

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the parameters by the coordinates, shape (p, p)."""
        return np.diag(self.vector.slope(x))
