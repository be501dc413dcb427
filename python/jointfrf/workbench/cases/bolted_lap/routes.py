"""Joint from measured points: DOFs of both sides, several routes to K*(w), and two estimators of constants."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.point_lines import difference_weights
from jointfrf.channels.virtual_point import VirtualPoint, virtual_point, virtual_points
from jointfrf.errors import ConvergenceWarning, FrfCheckWarning, IdentificationWarning, IllConditionedWarning
from jointfrf.identification.identify import identify
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.substructuring.compliance import multi_point_compliance
from jointfrf.substructuring.modification import inverse_substructuring
from jointfrf.workbench.cases.bolted_lap.keys import DOFS, BoltedLapCase

__all__ = [
    "ESTIMATORS",
    "FivePoints",
    "Found",
    "both_sides",
    "by_band_means",
    "by_compliance_fit",
    "fit_measured",
    "joint_stiffness_lines",
    "measured_entries",
    "route_lines",
]

#: Directions x, y, z.
_AXES = np.eye(3)
#: Names of the methods in tables, and their routes to the FRFs of the joint DOFs.
ESTIMATORS = {
    "ismm": ("band mean", ("Measurements 1-4", "central differences", "virtual points", "multi-point")),
    "compliance": ("compliance fit", ("central differences", "virtual points")),
}


@dataclass(frozen=True)
class FivePoints:
    """Five triaxial points on one side of the joint: rp at the centre, 1 and 3 along z, 2 and 4 along x (figure 4-40).

    Attributes
    ----------
    centre : ndarray, shape (3,)
        Coordinates of the reference point rp, m.
    spacing : tuple of float
        Distances s_x and s_z from rp to the neighbouring points, m.
    """

    centre: FloatArray
    spacing: tuple[float, float]

    @cached_property
    def points(self) -> FloatArray:
        """Return the positions of rp, 1, 2, 3, 4, shape (5, 3), m."""
        s_x, s_z = self.spacing
        offsets = np.array([[0, 0, 0], [0, 0, -s_z], [-s_x, 0, 0], [0, 0, s_z], [s_x, 0, 0]])
        placed: FloatArray = self.centre + offsets
        return placed

    @property
    def channels(self) -> tuple[FloatArray, FloatArray]:
        """Return positions, m, and directions of the 15 channels, x, y, z of each point; both of shape (15, 3)."""
        return np.repeat(self.points, 3, axis=0), np.tile(_AXES, (5, 1))

    @cached_property
    def differences(self) -> FloatArray:
        """Return the transformation (6, 15) to the joint DOFs by second-order central differences (4.14), (4.18).

        Rotations are right-handed: theta_y = +du_x/dz, theta_z = +du_y/dx, but theta_x = -du_y/dz. The source uses the
        sign of (4.14) for all rotations.
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
        """Return the virtual point of the rigid motion of all five points about rp, by least squares."""
        return virtual_point(*self.channels, self.centre, DOFS)


def measured_entries() -> NDArray[np.bool_]:
    """Return the mask of entries of the receptance of six DOFs that Measurements 1-4 give (4.28), shape (6, 6).

    The entries connect x with theta_y, y with theta_x and with theta_z, and z with itself. All other entries are zero.
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


class Found(NamedTuple):
    """Joint identified by one route and one estimator.

    Attributes
    ----------
    route : str
        Route from measured FRFs to FRFs of the joint DOFs.
    estimator : {"band mean", "compliance fit"}
        Estimator of the constants.
    theta : ndarray, shape (12,)
        Stiffness of the six DOFs, then damping.
    std_error : ndarray, shape (12,), or None
        Standard errors of `theta`; None for band means.
    """

    route: str
    estimator: str
    theta: FloatArray
    std_error: FloatArray | None = None


def route_lines(
    points: tuple[FivePoints, FivePoints], h: ComplexArray, reference: ComplexArray | None = None
) -> dict[str, ComplexArray]:
    """Return K* line by line by every route.

    Parameters
    ----------
    points : tuple of FivePoints
        Measured points on sides j and k.
    h : ndarray, shape (n_freq, 30, 30)
        Receptances between the channels of the points, m/N.
    reference : ndarray, shape (n_freq, 12, 12), optional
        Receptances of six-DOF reference points, which cannot be measured, m/N.

    Returns
    -------
    dict of str to ndarray, shape (n_freq, 6, 6)
        K*(w) by the name of the route, N/m.

    See Also
    --------
    by_band_means, by_compliance_fit : Constants of the joint.
    """
    by_differences, by_virtual_points = both_sides(*points)
    differences = by_differences @ h @ by_differences.T
    gammas = {
        "Measurements 1-4": differences * np.tile(measured_entries(), (2, 2)),
        "central differences": differences,
        "virtual points": by_virtual_points @ h @ by_virtual_points.T,
    }
    if reference is not None:
        gammas["reference points"] = reference
    lines = {route: joint_stiffness_lines(gamma) for route, gamma in gammas.items()}
    return lines | {"multi-point": _multi_point(points, h)}


def joint_stiffness_lines(gamma: ComplexArray) -> ComplexArray:
    """Return K* = -(gamma^-1)_jk, the result of ISMM for any first estimate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        return inverse_substructuring(gamma, on_singular="nan")


def _multi_point(points: tuple[FivePoints, FivePoints], h: ComplexArray) -> ComplexArray:
    """Return K* of the equivalent multi-point connection with six forces in the joint."""
    j, k = (side.virtual_point for side in points)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)
        return invert(multi_point_compliance(h, j, k, rank=6).equivalent)


def by_band_means(case: BoltedLapCase, k_lines: Mapping[str, ComplexArray]) -> list[Found]:
    """Return the constants of every route as means over bands."""
    return [Found(route, "band mean", case.bands.means(case.freq_hz, k)) for route, k in k_lines.items()]


def by_compliance_fit(case: BoltedLapCase, points: tuple[FivePoints, FivePoints], h: ComplexArray) -> list[Found]:
    """Return constants by fits of the compliance over all lines, for central differences and for virtual points."""
    found = []
    for route, transform in zip(("central differences", "virtual points"), both_sides(*points), strict=True):
        fit = fit_measured(case.freq_hz, case.joint.dofs, h, transform)
        errors = np.array([fit.std_error[parameter.name] for parameter in case.parameters])
        found.append(Found(route, "compliance fit", np.concatenate([fit.stiffness, fit.damping]), errors))
    return found


#: Relative noise that sets the weights of a fit; its level does not affect the parameters.
_ASSUMED = 0.01
#: Least variance of an FRF as a fraction of the variance of its driving points, because zero entries have no noise.
_ROUNDING = 1e-20


def fit_measured(freq_hz: FloatArray, dofs: tuple[str, ...], h: ComplexArray, transform: FloatArray) -> Fit:
    """Return the fit of a joint to FRFs between measured channels; warnings are suppressed.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines, Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    h : ndarray, shape (n_freq, m, m)
        Receptances between the channels, m/N.
    transform : ndarray, shape (2 n, m)
        Transformation from the channels to the joint DOFs j, then k.

    Returns
    -------
    Fit

    See Also
    --------
    route_lines : K* line by line.
    """
    gamma = transform @ h @ transform.T
    # Variance of each FRF between joint DOFs; the covariance matrix of many channels takes ten times as long.
    variance = transform**2 @ (_ASSUMED * abs(h)) ** 2 @ (transform**2).T
    largest = np.sqrt(np.diagonal(variance.max(axis=0)))
    variance = np.maximum(variance, _ROUNDING * np.outer(largest, largest))
    with warnings.catch_warnings():
        for category in (IdentificationWarning, IllConditionedWarning, ConvergenceWarning, FrfCheckWarning):
            warnings.simplefilter("ignore", category)
        return identify(freq_hz, gamma, dofs, damping="viscous", cross="ignore", noise=variance)
