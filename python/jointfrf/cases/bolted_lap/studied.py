"""A bolted lap joint in a study: estimates of single realisations by every route."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointfrf.cases.bolted_lap.compute import NoisyLap, identify_noisy
from jointfrf.cases.bolted_lap.frfs import solid_frfs
from jointfrf.cases.bolted_lap.read import BoltedLapCase
from jointfrf.cases.bolted_lap.routes import Found
from jointfrf.cases.studied import Estimates, StudiedColumn, StudiedGroup, StudyChoice, chosen_noises
from jointfrf.spelling import did_you_mean

__all__ = ["bolted_lap_studied"]

_ESTIMATORS = ("ismm", "compliance")
#: Half of the central 95 % of a normal distribution, in standard deviations.
_REACH = 1.959963984540054


@dataclass(frozen=True)
class LapSource:
    """Realisations of the measurement at five points a side."""

    measured: NoisyLap

    def __call__(self, first: int, count: int) -> Estimates:
        """Identify the joint from each realisation."""
        numbers = range(first, first + count)
        return Estimates(
            *np.array([_row(identify_noisy(self.measured._replace(number=i))) for i in numbers]).swapaxes(0, 1)
        )


def _row(found: list[Found]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    theta = np.concatenate([one.theta for one in found])
    missing = np.full(len(found[0].theta), np.nan)
    errors = np.concatenate([missing if one.std_error is None else one.std_error for one in found])
    return theta, theta - _REACH * errors, theta + _REACH * errors


def bolted_lap_studied(case: BoltedLapCase, choice: StudyChoice) -> list[StudiedGroup]:
    """Return what a study computes: every noise with every estimator, each by all of its routes.

    The joint that the solid model has is not known: there are no actual values.
    """
    if choice.own_estimators or choice.own_noises:
        raise ValueError("estimators and noises of one's own need a case of kind known-joint")
    for word in choice.estimators:
        if word not in _ESTIMATORS:
            hint = did_you_mean(word, _ESTIMATORS) or f": {', '.join(_ESTIMATORS)}"
            raise ValueError(f"a bolted lap joint has no estimator {word!r}{hint}")
    solid = solid_frfs(case, case.beams.lengths[1], True)
    groups = []
    for noise in chosen_noises(case.noises, choice):
        for method in choice.estimators or noise.methods:
            own = NoisyLap(case, replace(noise, methods=(method,)), solid.points, solid.channels, 0)
            columns = [
                StudiedColumn(f"{one.estimator}, {one.route}", parameter.name, parameter.unit, np.nan, np.nan)
                for one in identify_noisy(own)
                for parameter in case.parameters
            ]
            groups.append(StudiedGroup(noise.name, tuple(columns), LapSource(own)))
    return groups
