"""Realisations of the measurement of a modelled joint, each fitted."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial

import numpy as np

from jointfrf.frf.noise import pollute
from jointfrf.identification.identify_model import identify_model
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.result import Fit
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law import JointLaw
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.workbench.cases.kind import EstimateColumn, EstimateGroup, Estimates, StudyChoice
from jointfrf.workbench.cases.modelled_joint.keys import ModelledJointCase
from jointfrf.workbench.cases.workers import Workers

__all__ = [
    "FittedDraw",
    "ModelledJointResult",
    "compute_modelled",
    "estimate_groups",
    "fit_of_exact",
    "fitted_draw",
]


@dataclass(frozen=True)
class FittedDraw:
    """What one realisation gave.

    Attributes
    ----------
    values : dict of str to float
    intervals : dict of str to (low, high)
        Of 95 %.
    is_noise : bool
        Whether the residual is noise.
    stiffness : ndarray, shape (n_freq, n)
        K*(w) of the DOFs that have a law, N/m.
    """

    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    is_noise: bool
    stiffness: ComplexArray


@dataclass(frozen=True)
class ModelledJointResult:
    """Result of a case of a modelled joint.

    Attributes
    ----------
    case : ModelledJointCase
    draws : tuple of FittedDraw
    bound : dict of str to float
        Standard deviations at the Cramer-Rao bound.
    first : Fit
        The first realisation.
    measured : ndarray
        Its FRFs.
    constant : Fit
        The same fitted by springs and dashpots in place of laws that depend on frequency.
    """

    case: ModelledJointCase
    draws: tuple[FittedDraw, ...]
    bound: dict[str, float]
    first: Fit
    measured: ComplexArray
    constant: Fit


def moving_stiffness(joint: Joint | LawJoint, freq_hz: FloatArray) -> ComplexArray:
    """Return K*(w) of the DOFs that have a law, shape (n_freq, n), N/m."""
    assert isinstance(joint, LawJoint)
    laws = {pair: law for pair, law in joint.laws.items() if pair[0] == pair[1]}
    return np.array([law.stiffness(2 * np.pi * freq_hz) for law in laws.values()]).T


def compute_modelled(case: ModelledJointCase, n_realisations: int, workers: Workers) -> ModelledJointResult:
    """Simulate measurements and fit each."""
    exact = case.truth.receptance(case.freq_hz, case.responses, case.forces)
    measured = pollute(exact, case.noise, seed=case.seed)
    bound = workers.begin(fit_of_exact, case, exact)
    first = workers.begin(_fit, case, case.believed, measured)
    constant = workers.begin(_fit, case, case.believed.with_joint(_constant(case.believed.joint)), measured)
    draws = tuple(
        workers.counted(workers.map(partial(fitted_draw, case, exact), range(n_realisations)), n_realisations)
    )
    return ModelledJointResult(case, draws, bound().std_error, first(), measured, constant())


def fit_of_exact(case: ModelledJointCase, exact: ComplexArray) -> Fit:
    """Fit exact FRFs from the actual joint, with the noise known: standard errors are at the Cramer-Rao bound."""
    at_truth = case.believed.with_joint(case.truth.joint)
    return _fit(case, at_truth, exact, np.asarray((case.noise * abs(exact)) ** 2, float))


def _fit(case: ModelledJointCase, whole: Assembly, h: ComplexArray, noise: FloatArray | None = None) -> Fit:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return identify_model(case.freq_hz, h, whole, case.responses, case.forces, noise=noise)


def fitted_draw(case: ModelledJointCase, exact: ComplexArray, number: int) -> FittedDraw:
    """Fit one realisation: that of seed + number."""
    fit = _fit(case, case.believed, pollute(exact, case.noise, seed=case.seed + number))
    stiffness = moving_stiffness(fit.joint, case.freq_hz)
    return FittedDraw(fit.value, fit.confidence_interval(0.95), bool(fit.residual_is_noise), stiffness)


def _constant(joint: LawJoint) -> LawJoint:
    """Return springs and dashpots in place of laws that depend on frequency."""
    laws: dict[tuple[str, str], JointLaw] = {
        pair: law if law.constant_terms is not None else SpringLaw(float(abs(law.values[0])), c=1.0)
        for pair, law in joint.laws.items()
    }
    return LawJoint(laws, joint.rigid, joint.mass, joint.dofs)


#: The name of its only estimator in studies.
_ESTIMATOR = "model-fit"


@dataclass(frozen=True)
class ModelFitSource:
    """Realisations of the measurement, each fitted with the models."""

    case: ModelledJointCase
    exact: ComplexArray
    names: tuple[str, ...]

    def __call__(self, first: int, count: int) -> Estimates:
        """Fit each realisation."""
        found = np.full((3, count, len(self.names)), np.nan)
        for i in range(count):
            try:
                fit = fitted_draw(self.case, self.exact, first + i)
            except (ValueError, ArithmeticError):
                continue  # it counts as failed
            found[0, i] = [fit.values[name] for name in self.names]
            found[1:, i] = np.array([fit.intervals[name] for name in self.names]).T
        return Estimates(*found)


def estimate_groups(case: ModelledJointCase, choice: StudyChoice) -> list[EstimateGroup]:
    """Return what a study computes: the fit with models."""
    if choice.own_estimators or choice.own_noises or choice.noises:
        raise ValueError("own estimator or noise in a case of kind modelled-joint; use the noise of [measured]")
    if any(word != _ESTIMATOR for word in choice.estimators):
        raise ValueError(f"unknown estimator {choice.estimators[0]!r} in a case of kind modelled-joint; use model-fit")
    exact = case.truth.receptance(case.freq_hz, case.responses, case.forces)
    fit = fit_of_exact(case, exact)
    names = tuple(fit.std_error)
    columns = [
        EstimateColumn(_ESTIMATOR, name, fit.unit(name), float(case.actual[name]), fit.std_error[name])
        for name in names
    ]
    return [EstimateGroup(f"{100 * case.noise:g} %", tuple(columns), ModelFitSource(case, exact, names))]
