"""Fits of realisations of the measurement of a modelled joint."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import NamedTuple

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
from jointfrf.workbench.cases.kind import (
    Computed,
    EstimateColumn,
    EstimateGroup,
    Estimates,
    GroupEstimates,
    StudyChoice,
)
from jointfrf.workbench.cases.modelled_joint.keys import ModelledJointCase

__all__ = [
    "ESTIMATOR",
    "Draw",
    "ModelledJointResult",
    "estimate_groups",
    "exact_frfs",
    "modelled_joint_result",
    "moving_stiffness",
]


class Draw(NamedTuple):
    """Further results of one realisation.

    Attributes
    ----------
    is_noise : bool
        Whether the residual is noise.
    stiffness : ndarray, shape (n_freq, n)
        Dynamic stiffness K*(w) of the DOFs with a law, N/m.
    """

    is_noise: bool
    stiffness: ComplexArray


@dataclass(frozen=True)
class ModelledJointResult:
    """Result of a case of a modelled joint.

    Attributes
    ----------
    case : ModelledJointCase
        Case with its keys.
    found : GroupEstimates
        Parameters of the joint and of the models with their bounds, and `Draw` objects.
    first : Fit
        Fit of the first realisation.
    measured : ndarray
        FRFs of the first realisation, m/N.
    constant : Fit
        Fit of the first realisation by springs and dashpots in place of frequency-dependent laws.
    """

    case: ModelledJointCase
    found: GroupEstimates
    first: Fit
    measured: ComplexArray
    constant: Fit


def moving_stiffness(joint: Joint | LawJoint, freq_hz: FloatArray) -> ComplexArray:
    """Return K*(w) of the DOFs with a law, shape (n_freq, n), N/m."""
    assert isinstance(joint, LawJoint)
    laws = {pair: law for pair, law in joint.laws.items() if pair[0] == pair[1]}
    return np.array([law.stiffness(2 * np.pi * freq_hz) for law in laws.values()]).T


def exact_frfs(case: ModelledJointCase) -> ComplexArray:
    """Return the FRFs of the assembly between the measured DOFs without noise."""
    return case.truth.receptance(case.freq_hz, case.responses, case.forces)


def modelled_joint_result(computed: Computed[ModelledJointCase, ComplexArray]) -> ModelledJointResult:
    """Return the result of a case from its realisations."""
    case, workers = computed.case, computed.workers
    measured = pollute(computed.frfs, case.noise, seed=case.seed)
    first = workers.begin(_fit, case, case.believed, measured)
    constant = workers.begin(_fit, case, case.believed.with_joint(_constant(case.believed.joint)), measured)
    (found,) = computed.estimates()
    return ModelledJointResult(case, found, first(), measured, constant())


def _fit_of_exact(case: ModelledJointCase, exact: ComplexArray) -> Fit:
    """Return the fit of exact FRFs at the actual joint; its standard errors are the Cramer-Rao bound."""
    at_truth = case.believed.with_joint(case.truth.joint)
    return _fit(case, at_truth, exact, np.asarray((case.noise * abs(exact)) ** 2, float))


def _fit(case: ModelledJointCase, whole: Assembly, h: ComplexArray, noise: FloatArray | None = None) -> Fit:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return identify_model(case.freq_hz, h, whole, case.responses, case.forces, noise=noise)


def _constant(joint: LawJoint) -> LawJoint:
    """Return a joint with springs and dashpots in place of frequency-dependent laws."""
    laws: dict[tuple[str, str], JointLaw] = {
        pair: law if law.constant_terms is not None else SpringLaw(float(abs(law.values[0])), c=1.0)
        for pair, law in joint.laws.items()
    }
    return LawJoint(laws, joint.rigid, joint.mass, joint.dofs)


#: The only estimator.
ESTIMATOR = "model-fit"


@dataclass(frozen=True)
class ModelFitSource:
    """Estimates from realisations of the measurement by fits with the models."""

    case: ModelledJointCase
    exact: ComplexArray
    names: tuple[str, ...]

    def __call__(self, first: int, count: int) -> Estimates:
        """Return the fit of each realisation; NaN in the row of a realisation that cannot be fitted."""
        return self._fits(first, count, (ValueError, ArithmeticError))[0]

    def details(self, first: int, count: int) -> tuple[Estimates, list[Draw]]:
        """Return the fit of each realisation; raise ValueError if one cannot be fitted."""
        return self._fits(first, count, ())

    def _fits(self, first: int, count: int, failures: tuple[type[Exception], ...]) -> tuple[Estimates, list[Draw]]:
        case, draws = self.case, []
        found = np.full((3, count, len(self.names)), np.nan)
        for i in range(count):
            try:
                fit = _fit(case, case.believed, pollute(self.exact, case.noise, seed=case.seed + first + i))
                intervals = fit.confidence_interval(0.95)
            except failures:
                continue
            found[:, i] = np.array([(fit.value[name], *intervals[name]) for name in self.names]).T
            draws.append(Draw(bool(fit.residual_is_noise), moving_stiffness(fit.joint, case.freq_hz)))
        return Estimates(*found), draws


def estimate_groups(case: ModelledJointCase, exact: ComplexArray, choice: StudyChoice | None) -> list[EstimateGroup]:
    """Return the group of the fit with models."""
    if choice is not None and choice.noises:
        raise ValueError(f"unknown noise {choice.noises[0]!r} in a case of kind modelled-joint; set [measured] noise")
    fit = _fit_of_exact(case, exact)
    source = ModelFitSource(case, exact, tuple(fit.std_error))
    columns = tuple(
        EstimateColumn(ESTIMATOR, name, fit.unit(name), float(case.actual[name]), fit.std_error[name])
        for name in source.names
    )
    details = source.details if choice is None else None
    return [EstimateGroup(f"{100 * case.noise:g} %", ESTIMATOR, columns, source, details=details)]
