"""Initial values of a fit of a model: the best of many trials."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from jointfrf.identification.minimise import minimise
from jointfrf.identification.model.likelihood import Likelihood, LogLikelihood
from jointfrf.identification.parameters import ParameterVector
from jointfrf.kernel.arguments import FloatArray

__all__ = ["ranked_trials", "refined"]

#: Number of trials, number of lines at which they are compared, and number of the best that are refined.
_TRIALS, _LINES, _BEST = 200, 60, 5
#: Seed of the trials: the same data give the same fit.
_SEED = 1
#: Largest ratio of stiffnesses of trials to the stiffness of the substructures.
_SPREAD = 3e3
#: Standard deviation of a logarithm of an FRF that is not yet fitted, and the misfit at which it is clipped.
_BROAD, _CUT = 0.3, 3.0


def ranked_trials(likelihood: Likelihood, given: Sequence[FloatArray]) -> list[FloatArray]:
    """Return initial values of all parameters, best first.

    Parameters
    ----------
    likelihood : Likelihood
        Objective.
    given : sequence of ndarray
        Further values of all parameters to try.

    Notes
    -----
    Parameters of the joint are drawn over decades around the stiffness of the substructures at the joint; all further
    parameters keep their nominal values. The trials are ranked by |ln(measured / predicted)|, limited so that distant
    resonances do not hide resonances that agree.
    """
    vector, prediction = likelihood.vector, likelihood.prediction
    n_freq = len(prediction.freq_hz)
    lines = np.unique(np.linspace(0, n_freq - 1, min(_LINES, n_freq)).astype(np.intp))
    frfs = prediction.of_joint(vector, vector.values, lines)
    measured, used = likelihood.measured[lines], likelihood.used[lines] & (likelihood.measured[lines] != 0)
    trials = [*given, *_drawn(vector, prediction.joint_stiffness())]
    misfits = []
    for values in trials:
        try:
            y = frfs(values)
        except np.linalg.LinAlgError:
            misfits.append(np.inf)
            continue
        good = used & (y != 0) & np.isfinite(y)
        ratio = abs(np.log(np.where(good, measured, 1) / np.where(good, y, 1)))
        misfits.append(float(np.minimum(ratio, _CUT)[used].mean()) if good.any() else np.inf)
    return [trials[i] for i in np.argsort(misfits, kind="stable")]


def _drawn(vector: ParameterVector, stiffness: FloatArray) -> list[FloatArray]:
    """Return trials: stiffnesses over decades, damping in proportion, times and numbers over their range."""
    generator = np.random.default_rng(_SEED)
    own = [i for i in vector.places_of("joint") if vector.all[i].is_free]
    trials = []
    for _ in range(_TRIALS):
        values = vector.values.copy()
        for i in own:
            one = vector.all[i]
            u = generator.random()
            if one.is_log and one.unit != "s":
                middle = np.sqrt(one.lower * one.upper)
                value = float(np.clip(middle, stiffness.min(), stiffness.max()) * _SPREAD ** (2 * u - 1))
            elif one.is_log:
                value = float(np.exp(np.log(1e-6) + u * np.log(1e6)))
            elif np.isfinite(one.lower) and np.isfinite(one.upper):
                value = one.lower + u * (one.upper - one.lower)
            else:
                value = one.value
            values[i] = np.clip(value, one.lower, one.upper)
        trials.append(vector.with_means(values, at_mean=True))
    return trials


def refined(likelihood: Likelihood, trials: Sequence[FloatArray]) -> Iterator[FloatArray]:
    """Yield coordinates refined by the squares of logarithms, from the best trials: first the joint alone, then all."""
    vector, own = likelihood.vector, likelihood.vector.of_joint()
    weight = np.where(likelihood.used, 1 / _BROAD, 0.0)
    broad = LogLikelihood(likelihood.prediction, vector, likelihood.measured, weight)
    of_joint = LogLikelihood(likelihood.prediction, own, likelihood.measured, weight)
    found = list(trials[:1])
    if own.free.size:
        apart = _distinct(vector, trials)
        minima = [minimise(of_joint, own.to_coordinates(values), steps=15, least=1e-2) for values in apart]
        found = [own.to_values(one.x) for one in sorted(minima, key=lambda one: one.cost)]
    for values in found:
        x = vector.to_coordinates(values)
        yield x if own.free.size == vector.free.size else minimise(broad, x, steps=15, least=1e-2).x


def _distinct(vector: ParameterVector, trials: Sequence[FloatArray]) -> list[FloatArray]:
    """Return the best trials that are not near to a better one."""
    kept: list[FloatArray] = []
    logs: list[FloatArray] = []
    for values in trials:
        x = vector.to_coordinates(values)[vector.is_log]
        if all(abs(x - other).max(initial=0) > 0.7 for other in logs) or not kept:
            kept.append(values)
            logs.append(x)
        if len(kept) == _BEST:
            break
    return kept
