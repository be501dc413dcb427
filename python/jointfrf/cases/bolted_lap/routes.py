"""From measured FRFs to the joint: several routes to K*(w), and two estimators of constants."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from jointfrf.cases.bolted_lap.measurement import FivePoints, both_sides, measured_entries
from jointfrf.cases.bolted_lap.read import BoltedLapCase
from jointfrf.cases.fitting import fit_measured
from jointfrf.errors import IdentificationWarning, IllConditionedWarning
from jointfrf.frf.bands import band_mean
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.substructuring.compliance import multi_point_compliance
from jointfrf.substructuring.modification import inverse_substructuring

__all__ = [
    "Found",
    "band_means",
    "by_band_means",
    "by_compliance_fit",
    "joint_stiffness_lines",
    "route_lines",
]


class Found(NamedTuple):
    """A joint as one route and one estimator see it.

    Attributes
    ----------
    route : str
        How the FRFs of the joint DOFs were obtained.
    estimator : {"band mean", "compliance fit"}
    theta : ndarray, shape (12,)
        Stiffness of the six DOFs, then damping.
    std_error : ndarray, shape (12,), or None
    """

    route: str
    estimator: str
    theta: FloatArray
    std_error: FloatArray | None = None


def route_lines(
    points: tuple[FivePoints, FivePoints], h: ComplexArray, reference: ComplexArray | None = None
) -> dict[str, ComplexArray]:
    """K* line by line by every route, shape (n_freq, 6, 6).

    Parameters
    ----------
    points : tuple of FivePoints
        Sides j and k.
    h : ndarray, shape (n_freq, 30, 30)
        FRFs between their channels, m/N.
    reference : ndarray, shape (n_freq, 12, 12), optional
        FRFs of six-DOF reference points, which cannot be measured.
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
    """K* = -(gamma^-1)_jk, which ISMM reduces to whatever the first estimate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        return inverse_substructuring(gamma, on_singular="nan")


def _multi_point(points: tuple[FivePoints, FivePoints], h: ComplexArray) -> ComplexArray:
    """K* of the equivalent multi-point connection: six forces pass the joint."""
    j, k = (side.virtual_point for side in points)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)
        return invert(multi_point_compliance(h, j, k, rank=6).equivalent)


def band_means(case: BoltedLapCase, k_lines: ComplexArray) -> FloatArray:
    """Means of Re K* and Im K*/w over the bands of each DOF, shape (12,)."""
    dofs = case.joint.dofs
    mean = band_mean(case.freq_hz, k_lines, {dof: case.bands_of(dof) for dof in dofs}, dofs)
    return np.concatenate([mean.stiffness, mean.damping])


def by_band_means(case: BoltedLapCase, k_lines: Mapping[str, ComplexArray]) -> list[Found]:
    """Constants of every route as means over bands."""
    return [Found(route, "band mean", band_means(case, k)) for route, k in k_lines.items()]


def by_compliance_fit(case: BoltedLapCase, points: tuple[FivePoints, FivePoints], h: ComplexArray) -> list[Found]:
    """Constants by fits in the compliance domain over all lines, by differences and by virtual points."""
    found = []
    for route, transform in zip(("central differences", "virtual points"), both_sides(*points), strict=True):
        fit = fit_measured(case.freq_hz, case.joint.dofs, h, transform)
        errors = np.array([fit.std_error[parameter.name] for parameter in case.parameters])
        found.append(Found(route, "compliance fit", np.concatenate([fit.stiffness, fit.damping]), errors))
    return found
