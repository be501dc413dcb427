"""What a reader must know of a fit of laws, in words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.errors import ConvergenceWarning, IdentificationWarning
from jointfrf.identification.compliance_fit.describe import (
    left_out_warnings,
    noise_notes,
    places_of_excess,
    untrusted_warnings,
)
from jointfrf.identification.law_fit.law_fit import LawFit
from jointfrf.identification.manifold.fit import ManifoldFit
from jointfrf.identification.parameter_table import correlation_notes, parameter_warnings
from jointfrf.identification.parameters import joint_vector
from jointfrf.laws.law_joint import LawJoint

__all__ = ["DescribedLaws", "describe_laws"]


class DescribedLaws(NamedTuple):
    """A fit with its notes and warnings, and the warnings to be issued."""

    fit: LawFit
    warnings: tuple[Warning, ...]


def describe_laws(found: ManifoldFit, joint: LawJoint) -> DescribedLaws:
    """Make the result, with its notes and warnings."""
    problem, result = found.problem, found.estimate
    names = [one.name for one in result.parameters]
    size = np.sqrt(np.maximum(np.diagonal(found.covariance), np.finfo(float).tiny))
    doubts = [
        *untrusted_warnings(result, problem.dofs),
        *left_out_warnings(problem),
        *_parameter_warnings(found, joint),
        *_misfit_warnings(found),
    ]
    notes = [*noise_notes(problem), *correlation_notes(names, found.covariance / np.outer(size, size))]
    if problem.added_compliance is not None:
        notes.append("the intervals do not allow for what is not rigid between the channels of a side")
    told: list[Warning] = [IdentificationWarning(text) for text in doubts]
    if not result.converged:
        told.append(ConvergenceWarning("the fit did not converge"))
    scale = float(np.sqrt(result.excess))
    fit = LawFit(
        joint=joint.with_values(result.theta),
        parameters=dict(zip(names, result.theta.tolist(), strict=True)),
        covariance=found.covariance,
        noise_level=problem.noise.level * (scale if problem.noise.is_assumed else 1.0),
        residual_level=scale * problem.noise.level,
        freq_hz=problem.freq_hz,
        k_lines=problem.frfs.line_stiffness(),
        is_converged=result.converged,
        intervals=found.intervals,
        warnings=tuple(str(one) for one in told),
        notes=tuple(notes),
    )
    return DescribedLaws(fit, tuple(told))


def _parameter_warnings(found: ManifoldFit, joint: LawJoint) -> list[str]:
    """Name parameters that the data determine poorly or not at all."""
    errors = np.sqrt(np.maximum(np.diagonal(found.covariance), 0))
    parameters = joint_vector(joint, (), np.ones(len(joint.dofs))).all
    shown = list(zip(parameters, found.estimate.theta.tolist(), errors.tolist(), strict=True))
    return parameter_warnings(shown, lambda name: found.intervals.of(name, 0.95))


def _misfit_warnings(found: ManifoldFit) -> list[str]:
    """Say whether the residual differs from the noise, and how."""
    misfit, told = found.test, []
    if not found.problem.noise.is_assumed and misfit.is_large:
        apart = f"{abs(misfit.ratio - 1) / misfit.sigma:.0f} sigma"
        told.append(
            f"the residual is {misfit.ratio:.2f} times the noise, {apart} above it: these laws do not fit the data"
            f"{places_of_excess(misfit)}"
        )
    for trend in misfit.trends:
        low, high = trend.values.min(), trend.values.max()
        told.append(
            f"{trend.name} is not one constant over frequency: parts of the band give {low:.3g} .. {high:.3g}: another "
            "law may fit"
        )
    return told
