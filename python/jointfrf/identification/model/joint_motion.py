"""Motion of the joint of a fitted assembly on each line, and the contribution of each line to the fit."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from jointfrf.identification.minimise import minimise
from jointfrf.identification.model.fit import FoundModel, ModelProblem, fit_assembly
from jointfrf.identification.model.next_channels import without_start
from jointfrf.identification.model.uncertainty import ModelLinearised
from jointfrf.identification.parameters import ParameterVector, joint_vector
from jointfrf.kernel.arguments import ComplexArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["FoundMotion", "JointMotion"]


class JointMotion(NamedTuple):
    """Motion across the joint, and derivatives of the FRFs by its dynamic stiffness.

    Attributes
    ----------
    per_force : ndarray, shape (n_freq, n, n_i)
        Motion of each joint DOF, j minus k, per measured force, m/N or rad/N.
    slopes : ndarray, shape (n, n_freq, n_o, n_i)
        Derivatives of the weighted FRFs by K*_dd.
    gradient : ModelLinearised
        Derivatives by the coordinates, residual, information.
    predicted : ndarray, shape (n_freq, n_o, n_i)
        Fitted FRFs, m/N.
    """

    per_force: ComplexArray
    slopes: ComplexArray
    gradient: ModelLinearised
    predicted: ComplexArray


class FoundMotion:
    """Motion of the joint of a fit on demand; can be pickled, without the start of the fit.

    Parameters
    ----------
    found : FoundModel
        Result of the fit.
    describe : callable
        Function that makes a `Fit` of a result.
    """

    def __init__(self, found: FoundModel, describe: Callable[[FoundModel], Any]) -> None:
        self._found, self._describe = without_start(found), describe

    @staticmethod
    def _as_found(problem: ModelProblem) -> ModelProblem:
        """Return a problem with the correlation of lines that was estimated without models, which stays fixed.

        The misfit of a law of the amplitude is as large as the misfit of rational functions.
        """
        model = problem.noise.model
        if model is None:
            return problem
        model = replace(model, inflation_source="none")
        return replace(problem, noise=replace(problem.noise, inflation=model.inflation, model=model))

    def refitted(self, joint: LawJoint) -> Any:
        """Return the fit with another joint, from the present values; fixed parameters stay fixed."""
        found = self._found
        problem, vector = self._as_found(found.problem), found.problem.vector
        fixed = [one.name for one in vector.all if one.origin == "joint" and not one.is_free]
        prediction = copy(problem.prediction)
        prediction.whole = prediction.whole.with_joint(joint)
        own = joint_vector(joint, fixed, prediction.joint_stiffness()).all
        rest = [one for one in vector.all if one.origin != "joint"]
        return self._describe(
            # the joint follows its amplitude now
            fit_assembly(replace(problem, prediction=prediction, vector=ParameterVector((*own, *rest)), motion=None))
        )

    def __call__(self) -> JointMotion:
        """Return the motion at the estimate, without model errors, which could look like a joint that changes."""
        found, problem = self._found, self._as_found(self._found.problem)
        likelihood, minimum = problem.likelihood, found.minimum
        vector, prediction = likelihood.vector, likelihood.prediction
        if found.error is not None:
            minimum = minimise(likelihood, minimum.x[: vector.free.size])
        values = vector.to_values(minimum.x)
        rows, columns = prediction.channel_gains(vector, values)
        out, into = prediction.joint_motion(vector, values)
        weight = likelihood.weight * np.outer(rows, columns)
        slopes = -(out.transpose(2, 0, 1)[..., None] * into.transpose(1, 0, 2)[:, :, None, :]) * weight
        gradient = ModelLinearised.of(likelihood, minimum, problem.noise.inflation)
        return JointMotion(into * columns, slopes, gradient, prediction.frfs(vector, values))
