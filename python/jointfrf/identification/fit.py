"""From a prepared problem to numbers: the compliance fit with its choice of damping, and means over bands."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np

from jointfrf.dofs import joint_parameters
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import band_mean, in_bands
from jointfrf.identification.compliance_fit.estimator import ComplianceEstimate, estimate
from jointfrf.identification.compliance_fit.intervals import parameter_covariance
from jointfrf.identification.compliance_fit.joint_terms import DampingTerms, joint_basis
from jointfrf.identification.joint_fit import JointFit
from jointfrf.identification.prepare import BandMeanProblem, ComplianceProblem
from jointfrf.kernel.arguments import FloatArray
from jointfrf.substructuring.ismm import inverse_substructuring

__all__ = ["ComplianceFit", "DampingChoice", "fit_band_mean", "fit_compliance"]


class DampingChoice(NamedTuple):
    """How the damping terms were chosen by the Bayesian information criterion (BIC).

    Attributes
    ----------
    best, second : str
    margin : float
        Difference of their BIC.
    indistinguishable : bool
        Whether both terms together would have had the lowest BIC, but are not significant.
    """

    best: DampingTerms
    second: DampingTerms
    margin: float
    indistinguishable: bool


class ComplianceFit(NamedTuple):
    """Result of `fit_compliance`.

    Attributes
    ----------
    joint : JointFit
        Parameters, covariance and levels, without notes and warnings.
    estimate : ComplianceEstimate
        What they come from, for the parameters that are identifiable.
    level_from_residual : bool
        Whether the noise level is that of the residual.
    choice : DampingChoice or None
        None where the damping terms were given.
    """

    joint: JointFit
    estimate: ComplianceEstimate
    level_from_residual: bool
    choice: DampingChoice | None


def fit_compliance(problem: ComplianceProblem) -> ComplianceFit:
    """Fit the joint by maximum likelihood in the compliance domain."""
    options, choice = problem.options, None
    if options.damping == "auto":
        choice, result = _choose_damping(problem)
    else:
        result = _estimate(problem, options.damping)
    result = result.of_identifiable()
    residual = float(result.residual_level[0])
    level = problem.noise.level or residual
    t, h = problem.transform, problem.measured
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        k_lines = inverse_substructuring(t @ h @ t.T, on_singular="nan")
    joint = JointFit(
        method="compliance",
        dofs=problem.dofs,
        parameters=dict(zip([one.name for one in result.parameters], result.theta[0].tolist(), strict=True)),
        covariance=parameter_covariance(result, level, residual),
        noise_level=level,
        residual_level=residual,
        freq_hz=problem.freq_hz,
        k_lines=k_lines,
        bands=problem.bands,
    )
    return ComplianceFit(joint, result, not problem.noise.level, choice)


def _estimate(problem: ComplianceProblem, damping: DampingTerms) -> ComplianceEstimate:
    noise, options = problem.noise, problem.options
    basis = joint_basis(2 * np.pi * problem.freq_hz, problem.dofs, damping, options.cross)
    with warnings.catch_warnings():
        # Lines on which noise hides the joint are ill-conditioned; they are left out, and a note says so.
        warnings.simplefilter("ignore", IllConditionedWarning)
        return estimate(
            problem.measured[None], problem.transform, basis, variance=noise.variance, reciprocal=options.reciprocal,
            cross=options.cross, used=problem.used, initial=problem.initial[None],
            level=np.array([noise.level]) if noise.level else None,
        )  # fmt: skip


def _choose_damping(problem: ComplianceProblem) -> tuple[DampingChoice, ComplianceEstimate]:
    """Take the damping terms with the lowest Bayesian information criterion."""
    kinds: tuple[DampingTerms, ...] = ("viscous", "hysteretic", "both")
    results = {kind: _estimate(problem, kind) for kind in kinds}
    # All are judged at the noise that the richest model leaves.
    power = float(results["both"].residual_level[0]) ** 2
    scores = {}
    for kind, result in results.items():
        equations, p = 2 * float(result.equations[0]), int(np.count_nonzero(result.identifiable))
        misfit = float(result.residual_level[0]) ** 2 * (equations - p) / max(power, np.finfo(float).tiny)
        scores[kind] = misfit + p * np.log(equations)
    ranked = sorted(scores, key=lambda kind: scores[kind])
    indistinguishable = ranked[0] == "both" and not _both_significant(results["both"], problem.noise.level)
    if indistinguishable:
        ranked.remove("both")
    best, second = ranked[:2]
    return DampingChoice(best, second, scores[second] - scores[best], indistinguishable), results[best]


def _both_significant(result: ComplianceEstimate, level: float) -> bool:
    """Whether, for some DOF, the hysteretic and the viscous term both exceed zero by two standard errors.

    A joint supplies no energy: two terms of opposite sign that nearly cancel are noise.
    """
    residual = float(result.residual_level[0])
    result = result.of_identifiable()
    error = np.sqrt(np.diagonal(parameter_covariance(result, level or residual, residual)))
    significant = (result.theta[0] > 2 * error).reshape(3, -1)  # k, h, c by DOF
    return bool((significant[1] & significant[2]).any())


def fit_band_mean(problem: BandMeanProblem) -> JointFit:
    """Average K*(w) over the bands of each DOF, as the thesis does; standard errors from the scatter of the lines."""
    freq, names = problem.freq_hz, problem.dofs
    mean = band_mean(freq, problem.k_lines, dict(zip(names, problem.bands, strict=True)), names)
    values = np.concatenate([mean.stiffness, mean.damping]).tolist()
    kept = np.any([in_bands(freq, bands) for bands in problem.bands], axis=0)
    return JointFit(
        method=problem.method,
        dofs=names,
        parameters=dict(zip([one.name for one in joint_parameters(names)], values, strict=True)),
        covariance=np.diag(np.square(_scatter(problem))),
        noise_level=np.nan,
        residual_level=np.nan,
        freq_hz=freq[kept],
        k_lines=problem.k_lines[kept],
        bands=problem.bands,
    )


def _scatter(problem: BandMeanProblem) -> FloatArray:
    """Return standard errors of the means: the scatter of the lines over the root of their number."""
    freq, k = problem.freq_hz, problem.k_lines
    omega = np.where(freq > 0, 2 * np.pi * freq, np.nan)[:, None, None]
    errors = []
    for part in (k.real, k.imag / omega):
        for d, bands in enumerate(problem.bands):
            values = part[in_bands(freq, bands), d, d]
            errors.append(values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else np.nan)
    return np.array(errors)
