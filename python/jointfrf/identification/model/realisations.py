"""Joints from many sets of FRFs of one assembly: realisations of noise, repeated measurements."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointfrf.errors import IllConditionedWarning
from jointfrf.identification.minimise import minimise
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.fit import FoundModel, fit_assembly
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.model.prepare import Channels, prepare_model_fit
from jointfrf.identification.noise import NoiseOptions, noise_about
from jointfrf.identification.parameters import ParameterVector
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["joints_of_realisations"]

#: Noise is found from measured minus fitted FRFs twice, first from those fitted to the first set; steps end when they
#: promise to lower the squares by less than this.
_LEAST = (1e-2, 1e-4)
#: A set whose noise exceeds that of the first by this factor gets starts of its own.
_LIKE = 1.1


class _Noise(NamedTuple):
    """E|e|^2 of FRFs, inf where nothing is measured, and its median level relative to them."""

    variance: FloatArray
    level: float


class _Remembering(Prediction):
    """A prediction that keeps what it found at the first values, where each set begins, and at the last ones."""

    def __init__(self, of: Prediction) -> None:
        vars(self).update(vars(of))
        self._known: list[tuple[FloatArray, ComplexArray, ComplexArray]] = []
        self._lent: ComplexArray | None = None

    def linearised(self, vector: ParameterVector, values: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return what a prediction does; the derivatives are the caller's until the next call."""
        found = next((known for known in self._known if np.array_equal(known[0], values)), None)
        if found is None:
            found = (values.copy(), *super().linearised(vector, values))
            self._known[1:] = [found]
        _, y, slopes = found
        if self._lent is None:
            self._lent = np.empty_like(slopes)
        np.copyto(self._lent, slopes)
        return y, self._lent


def joints_of_realisations(
    freq_hz: FloatArray,
    measured: Iterable[ComplexArray],
    whole: Assembly,
    channels: Channels,
) -> Iterator[LawJoint]:
    """Yield the joint of each of several sets of FRFs of the same assembly.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    measured : iterable of ndarray, shape (n_freq, n_o, n_i)
        Each as `identify_model` takes it, all FRFs measured, m/N.
    whole : Assembly
    channels : Channels

    Notes
    -----
    The first set is fitted as by `identify_model`. The others start there, and their noise, relative part and floor by
    entry, is found from measured minus fitted FRFs in place of smooth ones. Each minimum is its own; a set that comes
    to another noise, or does not converge, is fitted as the first.
    """
    first: FoundModel | None = None
    level = np.inf
    for h in measured:
        if first is not None:
            near = _near(first, h, level)
            if near is not None:
                yield near
                continue
        found = fit_assembly(prepare_model_fit(freq_hz, h, whole, channels, NoiseOptions(), ()))
        yield _joint_of(found, found.values)
        is_right = found.test.is_noise and found.error is None
        if first is None and found.minimum.converged and is_right and not found.problem.noise.is_assumed:
            prediction = _Remembering(found.problem.prediction)
            first = found._replace(problem=replace(found.problem, prediction=prediction))
            level = _noise(first, h, first.predicted).level


def _joint_of(found: FoundModel, values: FloatArray) -> LawJoint:
    return found.problem.prediction.whole.joint.with_values(values[found.problem.vector.places_of("joint")])


def _near(first: FoundModel, h: ComplexArray, level: float) -> LawJoint | None:
    """Return the joint of the minimum near to that of other FRFs, None where the noise is not like theirs."""
    problem, x, predicted = first.problem, first.minimum.x, first.predicted
    vector, prediction = problem.vector, problem.prediction
    with warnings.catch_warnings(), np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        warnings.simplefilter("ignore", IllConditionedWarning)
        for turn in range(len(_LEAST)):
            if turn:
                predicted = prediction.frfs(vector, vector.to_values(x))
            noise = _noise(first, h, predicted)
            if turn and not noise.level < _LIKE * level:
                return None
            squares = Likelihood.of_variance(prediction, vector, h, noise.variance, problem.noise.inflation)
            minimum = minimise(squares, x, least=_LEAST[turn])
            x = minimum.x
    return _joint_of(first, vector.to_values(x)) if minimum.converged else None


def _noise(first: FoundModel, h: ComplexArray, predicted: ComplexArray) -> _Noise:
    """Return the noise of FRFs about fitted ones."""
    used = np.isfinite(first.problem.variance).all(axis=0)
    squares, size = (np.asarray((abs(part[:, used]) ** 2).T, float, "C") for part in (h - predicted, predicted))
    relative, floor = noise_about(squares, size)
    own = np.maximum(relative[:, None] * size + floor[:, None], np.finfo(float).tiny)
    variance = np.full(h.shape, np.inf)
    variance[:, used] = own.T
    return _Noise(variance, float(np.median(np.sqrt(own / np.maximum(size, np.finfo(float).tiny)))))
