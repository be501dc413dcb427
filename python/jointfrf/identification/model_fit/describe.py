"""What a reader must know of a fit of a model, in words: notes on how the numbers came about, and warnings."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointfrf.errors import ConvergenceWarning, IdentificationWarning
from jointfrf.identification.model.fit import FoundModel, OpenDirection
from jointfrf.identification.model.prepare import Channels
from jointfrf.identification.model_fit.model_fit import ModelFit
from jointfrf.identification.parameter_table import correlation_notes, parameter_warnings
from jointfrf.identification.profile import Intervals

__all__ = ["DescribedModel", "describe_model"]

#: A prior that the FRFs narrow by less than this is told.
_UNCHANGED = 0.9
#: Another minimum whose squares are higher by less than this is told.
_OTHER = 10.0
#: Names shown of bands, channels, pairs.
_SHOWN = 4


class DescribedModel(NamedTuple):
    """A fit with its notes and warnings, and the warnings to be issued."""

    fit: ModelFit
    warnings: tuple[Warning, ...]


def describe_model(found: FoundModel, channels: Channels) -> DescribedModel:
    """Make the result, with its notes and warnings."""
    problem, vector = found.problem, found.problem.vector
    whole = problem.prediction.whole
    shown = np.isfinite(problem.variance)
    size = abs(np.where(shown, found.predicted, 1))
    level = float(np.median((np.sqrt(np.where(shown, problem.variance, 0)) / np.maximum(size, 1e-300))[shown]))
    fit = ModelFit(
        assembly=whole,
        joint=whole.joint.with_values(found.values[vector.places_of("joint")]),
        parameters={one.name: float(found.values[i]) for one, i in zip(vector.fitted, vector.free, strict=True)},
        covariance=found.covariance,
        fitted=vector.fitted,
        noise_level=level,
        residual_level=level * found.test.ratio,
        freq_hz=problem.freq_hz,
        responses=channels.responses,
        forces=channels.forces,
        predicted=found.predicted,
        residual=found.residual,
        test=found.test,
        open_directions=found.directions,
        is_converged=found.minimum.converged,
        intervals=found.intervals,
    )
    doubts = [
        *_residual_warnings(fit),
        *_parameter_warnings(fit, found.intervals),
        *_direction_warnings(fit),
        *_other_warnings(found),
    ]
    notes = [*_noise_notes(found), *_prior_notes(fit), *correlation_notes(list(fit.parameters), fit.correlation)]
    told: list[Warning] = [IdentificationWarning(text) for text in doubts]
    if not found.minimum.converged:
        told.append(ConvergenceWarning("the fit did not converge"))
    texts = tuple(str(one) for one in told)
    return DescribedModel(replace(fit, notes=tuple(notes), warnings=texts), tuple(told))


def _residual_warnings(fit: ModelFit) -> list[str]:
    """Say that the model does not fit, and where."""
    test, told = fit.test, []
    if test.is_noise:
        return []
    found = [f"residual {test.ratio:.3g} times the noise"]
    if test.bands:
        found.append(
            "most at " + ", ".join(f"{low:g}-{high:g} Hz ({ratio:.3g})" for low, high, ratio in test.bands[:_SHOWN])
        )
    for names, channels, what in ((fit.responses, test.responses, "responses"), (fit.forces, test.forces, "forces")):
        if channels:
            found.append(f"in the {what} " + ", ".join(f"{names[i]} ({ratio:.3g})" for i, ratio in channels[:_SHOWN]))
    if np.isfinite(test.neighbours) and test.neighbours > 5:
        found.append("smooth over frequency, as no noise is")
    if test.is_large or test.bands or test.responses or test.forces or test.neighbours > 4:
        told.append(
            f"the models and the joint do not fit the FRFs: {'; '.join(found)}; the parameters carry that error, which "
            "the intervals do not allow for"
        )
    if test.pulls:
        pulled = ", ".join(f"{fit.fitted[i].name} by {pull:+.1f}" for i, pull in test.pulls[:_SHOWN])
        told.append(f"the FRFs deny what was believed, in standard deviations of the prior: {pulled}")
    return told


def _parameter_warnings(fit: ModelFit, intervals: Intervals) -> list[str]:
    """Name parameters of the joint that the data determine poorly or not at all."""
    errors = fit.std_error
    shown = [(one, fit.parameters[one.name], errors[one.name]) for one in fit.fitted if one.origin == "joint"]
    return parameter_warnings(shown, lambda name: intervals.of(name, 0.95))


def _direction_warnings(fit: ModelFit) -> list[str]:
    """Say what the FRFs do not hold, by its direction, unless a prior holds it."""
    return [
        f"the FRFs do not hold {_direction(one)}: moved along it, they stay within their noise"
        for one in fit.open_directions
        if not one.is_held_by_prior
    ]


def _direction(one: OpenDirection) -> str:
    parts = ", ".join(f"{name} {100 * change:+.2g} %" for name, change in one.parts[:_SHOWN])
    if len(one.parts) == 1:
        return one.parts[0][0]
    return f"the direction {parts}"


def _other_warnings(found: FoundModel) -> list[str]:
    if found.other < _OTHER:
        return [
            f"another joint fits nearly as well (-2 log likelihood higher by {found.other:.1f}): give values of the "
            "joint that are nearer, or more FRFs"
        ]
    return []


def _noise_notes(found: FoundModel) -> list[str]:
    problem, told = found.problem, []
    if problem.noise.is_assumed:
        told.append("the noise level is taken from the residual: the FRFs do not show it otherwise")
    if problem.noise.inflation > 1.2:
        told.append(
            f"the noise of neighbouring lines is correlated: {problem.freq_hz.size} lines say as much as "
            f"{problem.freq_hz.size / problem.noise.inflation:.0f} independent ones"
        )
    return told


def _prior_notes(fit: ModelFit) -> list[str]:
    """Name unknowns of which the FRFs say no more than the prior, and directions that priors hold."""
    errors = fit.std_error
    same = [one.name for one in fit.fitted if one.std is not None and errors[one.name] > _UNCHANGED * one.std]
    told = [f"{', '.join(same)}: known from the prior, hardly from the FRFs"] if same else []
    held = [one for one in fit.open_directions if one.is_held_by_prior and len(one.parts) > 1]
    return told + [f"priors hold what the FRFs do not: {_direction(one)}" for one in held[:_SHOWN]]
