"""A modelled joint in a study: fits with models to single realisations, and their Cramer-Rao bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.cases.modelled_joint.compute import fit_of_exact, fitted_draw
from jointfrf.cases.modelled_joint.read import ModelledJointCase
from jointfrf.cases.studied import Estimates, StudiedColumn, StudiedGroup, StudyChoice
from jointfrf.kernel.arguments import ComplexArray

__all__ = ["modelled_joint_studied"]

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


def modelled_joint_studied(case: ModelledJointCase, choice: StudyChoice) -> list[StudiedGroup]:
    """Return what a study computes: the fit with models."""
    if choice.own_estimators or choice.own_noises or choice.noises:
        raise ValueError("a modelled joint has one noise, [measured] noise, and one estimator, model-fit")
    if any(word != _ESTIMATOR for word in choice.estimators):
        raise ValueError(f"a modelled joint has the estimator model-fit only, not {choice.estimators[0]!r}")
    exact = case.truth.receptance(case.freq_hz, case.responses, case.forces)
    fit = fit_of_exact(case, exact)
    names = tuple(fit.std_error)
    columns = [
        StudiedColumn(_ESTIMATOR, name, fit.unit(name), float(case.actual[name]), fit.std_error[name]) for name in names
    ]
    return [StudiedGroup(f"{100 * case.noise:g} %", tuple(columns), ModelFitSource(case, exact, names))]
