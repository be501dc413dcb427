"""Values from which a fit starts: K* of the lines where all FRFs of the joint are measured, many trials elsewhere."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence

import numpy as np

from jointfrf.errors import IllConditionedWarning
from jointfrf.identification.model_fit.likelihood import Likelihood, LogLikelihood
from jointfrf.identification.model_fit.minimum import minimise
from jointfrf.identification.model_fit.prediction import LineCompliance
from jointfrf.identification.model_fit.unknowns import ParameterVector
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law import JointLaw
from jointfrf.laws.law_joint import LawJoint
from jointfrf.substructuring.compliance import joint_compliance

__all__ = ["from_lines", "interface_compliance", "ranked_trials", "refined"]

#: Trials, lines at which they are compared, and how many of the best are refined.
_TRIALS, _LINES, _BEST = 200, 60, 5
#: Trials are drawn from this seed: the same data give the same fit.
_SEED = 1
#: Stiffnesses of trials lie within this factor of that of the substructures.
_SPREAD = 3e3
#: Linearisations of a stiffness in its compliance, and its largest ratio to that found before.
_COMPLIANCE_STEPS, _LARGEST_RATIO = 4, 1.5
#: Standard deviation of a logarithm of an FRF that is not yet fitted, and where a misfit counts no further.
_BROAD, _CUT = 0.3, 3.0


def interface_compliance(smooth: ComplexArray, variance: FloatArray, at: tuple[list[int], list[int]]) -> LineCompliance:
    """Return the compliance of the joint from FRFs between all joint DOFs, which needs no model.

    Parameters
    ----------
    smooth, variance : ndarray, shape (n_freq, n_o, n_i)
        Smooth FRFs, and E|e|^2 of the measured ones.
    at : pair of list of int
        Channels of the joint DOFs j, then k: responses and forces.
    """
    rows, columns = at
    n = len(rows) // 2
    gamma = smooth[:, rows][:, :, columns]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        c = joint_compliance(gamma, on_singular="nan")
    # Noise of C is that of gamma_kk + gamma_jj and what transmits it, roughly.
    level = np.median(variance[:, rows][:, :, columns] / np.maximum(abs(gamma) ** 2, 1e-300))
    size = abs(np.einsum("lpp->lp", gamma))
    return LineCompliance(c, level * (size[:, :n] + size[:, n:]) ** 2)


def from_lines(joint: LawJoint, omega: FloatArray, lines: LineCompliance) -> FloatArray | None:
    """Return values of the joint from its compliance on each line.

    Parameters
    ----------
    joint : LawJoint
    omega : ndarray, shape (n_freq,)
        rad/s.
    lines : LineCompliance

    Returns
    -------
    ndarray, shape (p,), or None
        Of the joint, None where lines do not give it.
    """
    values, laws = [], dict(joint.laws)
    coupled = {dof for pair in joint.laws if pair[0] != pair[1] for dof in pair}
    known = np.asarray(np.isfinite(lines.c).all(axis=(1, 2)))
    moving = [i for i, dof in enumerate(joint.dofs) if dof not in joint.rigid]
    c = np.where(known[:, None, None], lines.c, np.eye(len(joint.dofs)))[:, moving][:, :, moving]
    with np.errstate(all="ignore"):
        k = invert(c, on_singular="nan")
    for pair, law in joint.laws.items():
        a, b = (moving.index(joint.dofs.index(dof)) for dof in pair)
        of_a, of_b = (np.where(known, lines.variance[:, moving[i]], np.nan) for i in (a, b))
        with np.errstate(all="ignore"):
            if a == b and pair[0] not in coupled:
                found = _of_compliance(law, omega, c[:, a, a], of_a)
            else:
                found = _started(law, omega, k[:, a, b], abs(k[:, a, a] * k[:, b, b]) ** 2 * np.sqrt(of_a * of_b))
        if found is None:
            return None
        laws[pair] = found
    for law in laws.values():
        values += law.values.tolist()
    return np.array([*values, *joint.mass.values()])


def _started(law: JointLaw, omega: FloatArray, k: ComplexArray, variance: FloatArray) -> JointLaw | None:
    """Return a law near to K* of the lines; None where these say nothing."""
    usable = np.isfinite(variance) & (variance > 0) & np.isfinite(k)
    if not usable.any():
        return None
    weight = np.where(usable, 1 / np.where(usable, variance, 1), 0)
    # A line where noise hides the joint shows a stiffness that means nothing.
    weight = np.minimum(weight, 20 * np.median(weight[usable]))
    return law.started(omega, np.where(usable, k, np.nan), np.maximum(weight, 1e-300))


def _of_compliance(law: JointLaw, omega: FloatArray, c: ComplexArray, variance: FloatArray) -> JointLaw | None:
    """Return a law whose compliance is near to that of the lines, in which noise is additive: K* of it is biased."""
    found = _started(law, omega, 1 / c, variance / abs(c) ** 4)
    for _ in range(_COMPLIANCE_STEPS):
        if found is None:
            return None
        # K* of c linearised at K* found, no farther than half and twice of it.
        k = found.stiffness(omega)
        ratio = c * k
        ratio = ratio * np.minimum(1, _LARGEST_RATIO / np.maximum(abs(ratio), 1e-300))
        found = _started(found, omega, k * (2 - ratio), variance * abs(k) ** 4)
    return found


def ranked_trials(likelihood: Likelihood, given: Sequence[FloatArray]) -> list[FloatArray]:
    """Return values of all parameters from which to start, best first.

    Parameters
    ----------
    likelihood : Likelihood
    given : sequence of ndarray
        Values of all parameters that are tried, too.

    Notes
    -----
    Parameters of the joint are drawn over decades around the stiffness that the substructures have at the joint; the
    rest keeps its believed values. They are ranked by |ln(measured / predicted)|, cut so that resonances that lie apart
    do not hide those that agree.
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
    """Return trials: stiffnesses over decades, damping that goes with them, times and numbers over their range."""
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
        trials.append(values)
    return trials


def refined(likelihood: Likelihood, trials: Sequence[FloatArray]) -> Iterator[FloatArray]:
    """Yield coordinates refined by the squares of logarithms, from the best trials: first the joint alone, then all."""
    vector, own = likelihood.vector, likelihood.vector.of_joint()
    weight = np.where(likelihood.used, 1 / _BROAD, 0.0)
    broad = LogLikelihood(likelihood.prediction, vector, likelihood.measured, weight)
    of_joint = LogLikelihood(likelihood.prediction, own, likelihood.measured, weight)
    found = list(trials[:1])
    if own.free.size:
        apart = _apart(vector, trials)
        minima = [minimise(of_joint, own.to_coordinates(values), steps=15, least=1e-2) for values in apart]
        found = [own.to_values(one.x) for one in sorted(minima, key=lambda one: one.cost)]
    for values in found:
        x = vector.to_coordinates(values)
        yield x if own.free.size == vector.free.size else minimise(broad, x, steps=15, least=1e-2).x


def _apart(vector: ParameterVector, trials: Sequence[FloatArray]) -> list[FloatArray]:
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
