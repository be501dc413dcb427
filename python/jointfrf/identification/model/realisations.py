"""Joints from many sets of FRFs of one assembly: realisations of noise, repeated measurements."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

import numpy as np

from jointfrf.errors import IllConditionedWarning
from jointfrf.identification.minimise import full_step
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.fit import FoundModel, ModelProblem, fit_assembly
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prepare import Channels, prepare_model_fit
from jointfrf.identification.noise import NoiseOptions, noise_about
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["RealisationFits"]

#: Predicted decrease of the squares by the last step: the next step would predict far less.
_LEAST = 1e-2
#: Usual number of steps for a set that is similar to the first: two or three.
_STEPS = 6
#: Ratio of the noise of a set to the noise of the first above which it needs separate initial values.
_LIKE = 1.1


class RealisationFits:
    """Fits of many sets of FRFs of one assembly, each from the same minimum: a result depends on no other set.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    whole : Assembly
        Assembly with its unknowns.
    channels : Channels
        Channels of the FRFs.
    first : iterable of ndarray, shape (n_freq, n_o, n_i)
        Sets of FRFs for `identify_model`, all measured, m/N: all start from the first whose residual is noise.

    Notes
    -----
    The first set is fitted by `identify_model`. Noise of all further sets, relative part and floor by entry, is
    estimated from measured minus fitted FRFs instead of smooth ones. Each has its own minimum. A set with different
    noise, or without convergence, is fitted like the first.
    """

    def __init__(self, freq_hz: FloatArray, whole: Assembly, channels: Channels, first: Iterable[ComplexArray]) -> None:
        self._freq, self._whole, self._channels = freq_hz, whole, channels
        self._start: _Start | None = None
        for h in first:
            found = self._alone(h)
            is_right = found.test.is_noise and found.error is None
            if found.minimum.converged and is_right and not found.problem.noise.is_assumed:
                self._start = _Start(found.problem, found.minimum.x)
                break

    def joint(self, h: ComplexArray) -> LawJoint:
        """Return the joint of a set of FRFs, shape (n_freq, n_o, n_i), m/N."""
        near = None if self._start is None else self._start.joint(h)
        if near is not None:
            return near
        found = self._alone(h)
        return _joint_of(found.problem, found.values)

    def _alone(self, h: ComplexArray) -> FoundModel:
        return fit_assembly(prepare_model_fit(self._freq, h, self._whole, self._channels, NoiseOptions(), ()))


def _joint_of(problem: ModelProblem, values: FloatArray) -> LawJoint:
    return problem.prediction.whole.joint.with_values(values[problem.vector.places_of("joint")])


class _Start:
    """A minimum from which further sets are fitted."""

    def __init__(self, problem: ModelProblem, x: FloatArray) -> None:
        self._problem, self._x = problem, x
        self._y, self._slopes = self._linearised(x)
        self._scratch = np.empty_like(self._slopes)
        self._level = self._noise(problem.measured, self._y)[1]

    def joint(self, h: ComplexArray) -> LawJoint | None:
        """Return the joint of the nearest minimum for other FRFs, None if their noise differs."""
        problem, vector, x = self._problem, self._problem.vector, self._x
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            for turn in range(_STEPS):
                if turn:
                    y, slopes = self._linearised(x)
                else:
                    y, slopes = self._y, self._scratch
                    np.copyto(slopes, self._slopes)
                variance, level = self._noise(h, y)
                squares = Likelihood.of_variance(problem.prediction, vector, h, variance, problem.noise.inflation)
                at = squares.about(x, y, slopes)
                if (turn and not level < _LIKE * self._level) or not np.isfinite(at.information).all():
                    return None
                x, promised = full_step(at, x, vector.bounds)
                if turn and promised < _LEAST:
                    return _joint_of(problem, vector.to_values(x))
        return None

    def _linearised(self, x: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IllConditionedWarning)
            return self._problem.prediction.linearised(self._problem.vector, self._problem.vector.to_values(x))

    def _noise(self, h: ComplexArray, y: ComplexArray) -> tuple[FloatArray, float]:
        """Return E|e|^2 of FRFs about fitted ones, inf if nothing was measured, and its median level."""
        used = np.isfinite(self._problem.variance).all(axis=0)
        squares, size = (np.asarray((abs(part[:, used]) ** 2).T, float, "C") for part in (h - y, y))
        freq, model = self._problem.freq_hz, self._problem.noise.model
        shape = np.ones(freq.size) if model is None else model.floor_shape(freq)
        relative, floor, _ = noise_about(squares, size, shape)
        own = np.maximum(relative[:, None] * size + floor[:, None] * shape, np.finfo(float).tiny)
        variance = np.full(h.shape, np.inf)
        variance[:, used] = own.T
        return variance, float(np.median(np.sqrt(own / np.maximum(size, np.finfo(float).tiny))))
