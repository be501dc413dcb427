"""From a prepared problem to numbers: initial values, minimum, update of the noise, covariance, tests."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.sparse import csgraph

from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.noise_model import NoiseModel
from jointfrf.frf.noise_parts import acceleration_floor, describes_better, line_correlation
from jointfrf.frf.smoothing import pieces
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.line_starts import LineCompliance, from_lines, interface_compliance
from jointfrf.identification.minimise import Minimum, inverse_information, minimise
from jointfrf.identification.mixed import Added, added_by, mass_effects, parameter_ratio, smooth_effects, student_factor
from jointfrf.identification.model.evidence import (
    GAIN,
    Errors,
    spread_factors,
    with_discrepancy,
    with_errors,
    with_spreads,
)
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.model.starts import ranked_trials, refined
from jointfrf.identification.model.uncertainty import BandHomogeneity, ModelLinearised, band_homogeneity
from jointfrf.identification.noise import KnownNoise, noise_about
from jointfrf.identification.parameters import ParameterVector
from jointfrf.identification.profile import Intervals, ProfileIntervals
from jointfrf.identification.residual_test import ResidualTest, check_residual
from jointfrf.identification.scatter import Spread, spread_of
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.parallel.pool import one_thread

__all__ = [
    "FoundModel",
    "GainError",
    "ModelProblem",
    "OpenDirection",
    "Unseparated",
    "common_gain",
    "fit_assembly",
    "lowest_minimum",
    "open_directions",
    "unseparated",
]

#: Ratio of residual to noise at a minimum below which its initial value is good.
_GOOD = 1.1
#: Model errors that engineers would call small: the error of the joint is then small, too.
_SMALL_ERROR = 0.02
#: Maximum number of initial values that are followed to their minimum.
_FOLLOWED = 4
#: Number of updates of the noise of FRFs of substructures near the minimum: its effect depends on the joint.
_TURNS = 2
#: Variance factor above which uncertain spreads cause most of a variance.
_OF_SPREAD = 2.0
#: Maximum number of extensions of the reductions of the models.
_REFINED = 3
#: Ratio of the standard deviation to the initial value, and in units, above which FRFs do not determine a value: the
#: rest is rounding.
_BLIND = 1e9
#: Largest share of the noise that the parameters of a fit absorb.
_MOST_TAKEN = 0.9
#: Deviation of a gain from 1, in standard deviations, above which it is named: by chance one of 400 is.
_NAMED_GAIN = 3.0
#: Errors that are gains.
_GAIN_ERRORS = ("response-error", "force-error", "common-error")
#: Share of a standard error that is noticeable.
_TENTH = 0.1
#: Difference of -2 log likelihood below which two points are equal.
_SAME = 1e-3


@dataclass(frozen=True)
class ModelProblem:
    """A fit, ready to be computed.

    Attributes
    ----------
    prediction : Prediction
        FRFs of the assembly.
    vector : ParameterVector
        Parameters.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    measured : ndarray, shape (n_freq, n_o, n_i)
        Measured receptances, m/N; NaN if not measured.
    variance : ndarray, shape (n_freq, n_o, n_i)
        Noise variance E|e|^2, (m/N)^2, inf if not measured.
    smooth : ndarray, shape (n_freq, n_o, n_i)
        Smooth FRFs, m/N.
    noise : KnownNoise
        Noise of the FRFs.
    joint_channels : pair of list of int, or None
        Responses and forces at the joint DOFs j, then k, if all are measured.
    compliance_start : callable or None
        Function that returns values of the joint from the compliance fit, or None.
    tested : ndarray, shape (n_freq, n_o, n_i), optional
        Noise variance estimated without the models, for the test of the residual; `variance` by default.
    shared : ndarray, shape (n_freq, n_o, n_i, n_sources), optional
        Effect of noise of FRFs of the substructures on FRFs of the assembly near the minimum, m/N, multiplied by the
        factor for correlated lines.
    motion : ndarray, shape (n_freq,), optional
        Size of the motion on each line, if the FRFs depend on amplitude.
    """

    prediction: Prediction
    vector: ParameterVector
    freq_hz: FloatArray
    measured: ComplexArray
    variance: FloatArray
    smooth: ComplexArray
    noise: KnownNoise
    joint_channels: tuple[list[int], list[int]] | None
    compliance_start: Callable[[], FloatArray | None]
    tested: FloatArray | None = None
    shared: ComplexArray | None = None
    motion: FloatArray | None = None

    @property
    def likelihood(self) -> Likelihood:
        """The likelihood for this variance."""
        return Likelihood.of_variance(
            self.prediction, self.vector, self.measured, self.variance, self.noise.inflation, self.shared
        )

    def near(self, minimum: Minimum) -> ModelProblem:
        """Return the same with the noise of substructures near a minimum."""
        if not self.prediction.has_noisy_parts:
            return self
        return replace(self, shared=self.prediction.part_noise(self.vector, self.vector.to_values(minimum.x)))


class GainError(NamedTuple):
    """Gain of a channel, or of all FRFs, that the FRFs contradict.

    Attributes
    ----------
    origin : str
        Kind: "response-error", "force-error" or "common-error".
    channel : int
        Number of the response or force.
    value, std : float
        Measured over true value, and its standard deviation.
    """

    origin: str
    channel: int
    value: float
    std: float


class FoundModel(NamedTuple):
    """Result of `fit_assembly`.

    Attributes
    ----------
    problem : ModelProblem
        Problem with the final noise.
    minimum : Minimum
        Minimum of -2 log likelihood.
    values : ndarray
        Values of all parameters.
    covariance : ndarray, shape (p, p)
        Covariance of the free parameters.
    intervals : Intervals
        Intervals of the free parameters.
    predicted : ndarray, shape (n_freq, n_o, n_i)
        Fitted FRFs, m/N.
    residual : ndarray, shape (n_freq, n_o, n_i)
        Residual over the standard deviation of the noise; NaN if not measured.
    test : ResidualTest
        Test of the residual without errors of models and gains.
    directions : tuple of OpenDirection
        Combinations of parameters that the FRFs do not determine.
    other : float
        Squares at the next lowest minimum minus squares at the lowest; inf if there is no second one.
    error : Errors or None
        Errors of models and gains in addition to the unknowns, if FRFs show any or priors include them.
    gains : tuple of GainError
        Gains among these errors that differ from 1.
    test_with_error : ResidualTest
        Test of the residual with these errors.
    spread : Spread
        Variance factors by errors that FRFs share.
    added : Added
        Contribution of smooth errors of channels to the uncertainty of the coordinates.
    unseparated : tuple of Unseparated
        Parameters of several joints that the FRFs do not separate.
    parts : BandHomogeneity
        Coordinates by part of the band.
    error_matters : bool
        Whether these errors change the joint or its intervals noticeably.
    """

    problem: ModelProblem
    minimum: Minimum
    values: FloatArray
    covariance: FloatArray
    intervals: Intervals
    predicted: ComplexArray
    residual: ComplexArray
    test: ResidualTest
    directions: tuple[OpenDirection, ...]
    other: float
    error: Errors | None
    gains: tuple[GainError, ...]
    test_with_error: ResidualTest
    spread: Spread
    added: Added
    unseparated: tuple[Unseparated, ...]
    parts: BandHomogeneity
    error_matters: bool = False

    @property
    def has_failed(self) -> bool:
        """Whether the fit has no minimum because the models do not fit the FRFs: it has no intervals."""
        return not self.minimum.converged and self.test_with_error.is_large


def fit_assembly(problem: ModelProblem) -> FoundModel:
    """Fit all free parameters by maximum likelihood."""
    # For matrices as small as reduced models, threads of a BLAS wait for each other most of the time.
    with (
        one_thread(of_blas_only=True),
        warnings.catch_warnings(),
        np.errstate(over="ignore", divide="ignore", invalid="ignore"),
    ):
        warnings.simplefilter("ignore", IllConditionedWarning)
        minimum, other = lowest_minimum(problem)
        if problem.prediction.has_noisy_parts:
            for _ in range(_TURNS):
                problem = problem.near(minimum)
                minimum = minimise(problem.likelihood, minimum.x)
        for _ in range(_REFINED):
            if not problem.prediction.refine(problem.vector, problem.vector.to_values(minimum.x)):
                break
            minimum = minimise(problem.likelihood, minimum.x)
        for _ in range(2 if problem.noise.is_assumed else 1):
            changed = _with_noise_of_model(problem, minimum)
            if changed is None:
                break
            problem = changed
            minimum = minimise(problem.likelihood, minimum.x)
        likelihood, minimum = with_spreads(problem.likelihood, minimum)
        return _result_at(replace(problem, vector=likelihood.vector), minimum, other)


def _explained(problem: ModelProblem, minimum: Minimum) -> float:
    """Return the residual over the noise, including noise of the substructures."""
    likelihood = problem.near(minimum).likelihood
    return _ratio(likelihood, minimum._replace(cost=likelihood.cost(minimum.x)), problem.noise.inflation)


def _ratio(likelihood: Likelihood, minimum: Minimum, inflation: float) -> float:
    """Return the residual over the noise."""
    squares = minimum.cost - float((likelihood.vector.pulls(minimum.x) ** 2).sum())
    count = float(likelihood.used.sum())
    return float(np.sqrt(squares * inflation / max(2 * count - minimum.x.size, 1.0)))


def lowest_minimum(problem: ModelProblem, known: Minimum | None = None) -> tuple[Minimum, float]:
    """Return the lowest minimum, and the height of the next one above it: of a known one, if it fits."""
    likelihood, vector = problem.likelihood, problem.vector
    given: list[FloatArray] = []
    found: list[Minimum] = []
    if known is not None and _explained(problem, known) < _GOOD:
        return known, np.inf
    for values in itertools.chain(_values_of_lines(problem), [vector.values], _values_of_equal(problem)):
        given.append(values)
        found.append(minimise(likelihood, vector.to_coordinates(values)))
        if _explained(problem, found[-1]) < _GOOD:
            return found[-1], np.inf
    nearest = min(found, key=lambda one: one.cost)
    if not problem.noise.is_assumed and _is_explained(problem, nearest):
        return nearest, np.inf
    trials = ranked_trials(likelihood, given)
    for x in itertools.islice(refined(likelihood, trials), _FOLLOWED):
        found.append(minimise(likelihood, x))
        if _explained(problem, found[-1]) < _GOOD and not problem.noise.is_assumed:
            break
    best = min(found, key=lambda one: one.cost)
    apart = [one.cost - best.cost for one in found if abs(one.x - best.x).max(initial=0) > 0.1 and one.cost > best.cost]
    return best, min(apart, default=np.inf)


def _values_of_equal(problem: ModelProblem) -> Iterator[FloatArray]:
    """Yield values with equal parameters for joints of the same laws, because few unknowns converge from anywhere."""
    equal = problem.vector.of_equal_joints()
    if equal is not None:
        likelihood = replace(problem, vector=equal).likelihood
        best: Minimum | None = None
        for x in itertools.islice(refined(likelihood, ranked_trials(likelihood, [equal.values])), _FOLLOWED):
            found = minimise(likelihood, x)
            best = found if best is None or found.cost < best.cost else best
        if best is not None:
            yield problem.vector.with_means(equal.to_values(best.x))


def _is_explained(problem: ModelProblem, minimum: Minimum) -> bool:
    """Return whether small model errors explain the residual above the noise: no other initial value is needed."""
    found = with_errors(problem.likelihood, minimum, common_gain(problem), at_most=_SMALL_ERROR)
    if found is None or found[2].largest_level >= _SMALL_ERROR:
        return False
    return _ratio(*found[:2], problem.noise.inflation) < _GOOD


def _values_of_lines(problem: ModelProblem) -> Iterator[FloatArray]:
    """Yield values of all parameters: from single lines without models, with models, and from the compliance fit.

    The first and the last need FRFs between all joint DOFs.
    """
    vector, prediction = problem.vector, problem.prediction
    joint, omega = prediction.whole.joint, prediction.omega
    own, at = vector.places_of("joint"), problem.joint_channels
    lines: list[Callable[[], LineCompliance | None]] = []
    if at is not None:
        lines.append(lambda: interface_compliance(problem.smooth, problem.variance, at))
    if np.isfinite(problem.measured).all():
        lines.append(lambda: prediction.joint_compliance(vector, problem.smooth, problem.variance))

    def of_lines(found: LineCompliance | None) -> FloatArray | None:
        return None if found is None else from_lines(joint, omega, found)

    for values_of in (*(lambda one=one: of_lines(one()) for one in lines), problem.compliance_start):
        values = values_of()
        if values is not None:
            free = np.array([vector.all[i].is_free for i in own])
            whole = vector.values.copy()
            whole[own] = np.where(free, values, whole[own])
            yield vector.with_means(whole)


def _with_noise_of_model(problem: ModelProblem, minimum: Minimum) -> ModelProblem | None:
    """Return the problem with noise about fitted FRFs if these fit, or with noise at the level of the residual."""
    likelihood = problem.likelihood
    ratio = _ratio(likelihood, minimum, problem.noise.inflation)
    if problem.noise.is_assumed:
        return None if abs(ratio - 1) < 1e-3 else replace(problem, variance=problem.variance * ratio**2)
    if problem.noise.stated is not None:
        return _with_stated_noise(problem, problem.noise.stated, minimum) if ratio <= _GOOD else None
    noise = problem.noise.model
    # The residual of fitted FRFs includes the noise of the substructures.
    is_apart = problem.shared is None and noise is not None and noise.source == "residual" and ratio <= _GOOD
    if noise is None or not is_apart or noise.coherence_factor.any():
        return None
    predicted = problem.prediction.frfs(problem.vector, problem.vector.to_values(minimum.x))
    shape = noise.floor_shape(problem.freq_hz)[:, None, None]
    parts = [noise.relative**2 * abs(h) ** 2 + noise.floor**2 * shape for h in (predicted, problem.smooth)]
    usable = np.isfinite(problem.variance) & (parts[0] > 0) & (parts[1] > 0)
    share = np.where(usable, parts[0] / np.where(usable, parts[1], 1), 1)
    tested = problem.variance * share
    in_pieces = len(pieces(np.argsort(problem.freq_hz))) > 1
    variance = tested if in_pieces else _about(problem, noise, predicted)
    found = replace(problem, variance=variance, tested=tested, smooth=predicted)
    if in_pieces or noise.inflation_source != "residual":
        return found
    # Errors of a rational function at peaks are equal on neighbouring lines, and no noise.
    rest = ((problem.measured - predicted) / np.sqrt(variance))[:, np.isfinite(variance).all(axis=0)].T
    used = np.where(noise.line_factor > 1, np.nan, rest)
    taken = min(minimum.x.size / max(2 * used.size, 1), _MOST_TAKEN)
    inflation = min(problem.noise.inflation, line_correlation(used, taken))
    return replace(found, noise=replace(problem.noise, inflation=inflation))


def _with_stated_noise(problem: ModelProblem, stated: StatedNoise, minimum: Minimum) -> ModelProblem:
    """Return the problem with noise relative to the fitted FRFs: measured ones give small values too much weight."""
    predicted = problem.prediction.frfs(problem.vector, problem.vector.to_values(minimum.x))
    variance = stated.variance(problem.freq_hz, predicted)
    usable = np.isfinite(problem.variance) & (variance > 0)
    return replace(problem, variance=np.where(usable, variance, problem.variance), smooth=predicted)


def _about(problem: ModelProblem, noise: NoiseModel, predicted: ComplexArray) -> FloatArray:
    """Return E|e|^2 from the difference of measured and fitted FRFs, relative part and floor by entry.

    Smooth FRFs have errors at antiresonances, which look like a floor and hide the information of small FRFs.
    """
    used = np.isfinite(problem.variance).all(axis=0)
    outlying = noise.line_factor
    squares = np.asarray(abs((problem.measured - predicted)[:, used].T) ** 2, float)
    size, good = np.asarray(abs(predicted[:, used].T) ** 2, float), outlying == 1
    # A floor of acceleration may describe the slow variation that was estimated without models.
    choices: list[tuple[FloatArray, FloatArray]] = [(noise.line_level, noise.floor_shape(problem.freq_hz))]
    if noise.inflation_source != "none":  # noise that is to stay unchanged
        choices.append((np.ones(good.size), acceleration_floor(problem.freq_hz)))
    least, variance = np.inf, np.full(predicted.shape, np.inf)
    for usual, shape in choices:
        relative, floor, loss = noise_about((squares / usual)[:, good], size[:, good], shape[good])
        loss += 2 * len(squares) * float(np.log(usual[good]).sum())
        if least == np.inf or describes_better(loss, least):
            least = loss
            variance[:, used] = ((relative[:, None] * size + floor[:, None] * shape) * usual * outlying).T
    return variance


def _result_at(problem: ModelProblem, minimum: Minimum, other: float) -> FoundModel:
    """Return covariance, intervals and tests at a minimum, with nominal values for undetermined parameters."""
    likelihood = problem.likelihood
    residual, predicted = _residual(problem, likelihood, minimum)
    test = with_error = _test(problem, likelihood, minimum, residual, predicted)
    # If errors of channels explain a residual, it contains none of the models.
    explained = problem.noise.calibration is not None and test.is_noise
    without, found = minimum, with_errors(likelihood, minimum, common_gain(problem), is_sought=not explained)
    is_rejected = found is None or not found[1].converged  # errors of these kinds do not describe the misfit
    if is_rejected and without.converged:
        found = None
    if is_rejected and test.is_large and not explained:
        found = with_discrepancy(likelihood, without, problem.noise.inflation, test.ratio)
        minimum = without._replace(converged=False)  # without errors the models do not fit
    if found is not None:
        likelihood, minimum = found[:2]
        residual, predicted = _residual(problem, likelihood, minimum)
        with_error = _test(problem, likelihood, minimum, residual / found[2].noise, predicted)
    vector, n = likelihood.vector, likelihood.vector.n_shown
    # Not for logarithms of the joint: FRFs may well determine distant values.
    least = (_BLIND * np.maximum(1.0, 1 / vector.scale)) ** -2
    of_joint = np.array([one.origin in ("joint", "mean") for one in vector.fitted], bool)
    blind = ~(vector.is_log & of_joint) & (np.diagonal(minimum.information) <= least)
    if blind.any():
        # The nominal value is as good as the one to which rounding has led.
        believed = np.where(blind, vector.to_coordinates(vector.values), minimum.x)
        blind &= bool(likelihood.cost(believed) < minimum.cost + _SAME)
        minimum = minimum._replace(x=np.where(blind, believed, minimum.x))
    values = vector.to_values(minimum.x)
    matters = found is not None and _changes_joint(vector, without, minimum)
    at = ModelLinearised.of(likelihood, minimum, problem.noise.inflation)
    every_line = np.ones((1, problem.freq_hz.size))
    shape = problem.measured.shape[1], problem.measured.shape[2]
    effects = smooth_effects(at, problem.noise.calibration, problem.freq_hz, shape, every_line)
    effects += mass_effects(at, problem.noise.mass, problem.freq_hz, problem.measured, every_line)
    added = added_by(effects, at)
    beside = parameter_ratio(added.covariance, at)
    by_noise = max(1.0, with_error.ratio**2) if with_error.is_large else 1.0
    spread = spread_of(at, by_noise, problem.noise.inflation, beside, problem.motion)
    parts = band_homogeneity(at, problem.freq_hz, spread.factor + beside)
    spread = spread._replace(factor=spread.factor * parts.factor)
    root, slope = np.sqrt(spread.factor), np.diagonal(at.slope)
    covariance = at.covariance * np.outer(root, root) + added.covariance
    factor, estimated = spread.factor + beside, beside * added.estimated
    factor = factor * student_factor(factor - estimated, estimated, added.degrees)
    if vector.means:
        wider = spread_factors(vector, minimum)[:n]
        covariance, factor = covariance * np.sqrt(np.outer(wider, wider)), factor * wider
    covariance *= np.outer(slope, slope)
    whole = inverse_information(minimum.information, open_ends=True)
    unknown = np.flatnonzero(blind)
    whole[unknown, unknown] = covariance[unknown, unknown] = np.inf
    of_spread = spread_factors(vector, minimum)[:n] > _OF_SPREAD if vector.means else np.zeros(n, bool)
    has_failed = not minimum.converged and with_error.is_large
    profiles = _Profiles(likelihood, vector, minimum, whole, factor, of_spread, has_failed)
    intervals = Intervals([one.name for one in vector.fitted[:n]], profiles.of, profiles.of_function)
    of_shown = problem.vector, minimum.x[:n], minimum.information[:n, :n]
    directions = open_directions(*of_shown)
    return FoundModel(
        problem, minimum, values, covariance, intervals, predicted, residual, test,
        directions, other, None if found is None else found[2], _gains(vector, minimum), with_error, spread, added,
        unseparated(*of_shown, directions), parts, matters,
    )  # fmt: skip


def common_gain(problem: ModelProblem) -> float:
    """Return the standard deviation of the prior of a gain that all FRFs share."""
    calibration = problem.noise.calibration
    said = None if calibration is None or calibration.setups is None else calibration.setups.setups
    if said is not None and (said.gain is not None or said.common_gain > 0):
        return 0.0  # stated errors are in the intervals separately from the fit
    return GAIN if any(side.part.is_uncertain for side in problem.prediction.sides) else 0.0


def _gains(vector: ParameterVector, minimum: Minimum) -> tuple[GainError, ...]:
    """Return the gains among the errors that differ from 1 by more than their standard deviation explains."""
    std = np.sqrt(np.maximum(np.diagonal(inverse_information(minimum.information)), 0)) * vector.slope(minimum.x)
    value = vector.to_values(minimum.x)[vector.free]
    return tuple(
        GainError(one.origin, int(one.place[0]), 1 + float(value[i]), float(std[i]))
        for i, one in enumerate(vector.fitted)
        if one.origin in _GAIN_ERRORS and abs(value[i]) > _NAMED_GAIN * std[i]
    )


def _changes_joint(vector: ParameterVector, without: Minimum, minimum: Minimum) -> bool:
    """Return whether model errors change the joint, or widen its intervals, by a tenth of a standard error."""
    n = vector.n_shown
    joint = np.array([one.origin in ("joint", "mean") for one in vector.fitted[:n]], bool)
    before, after = (np.diagonal(inverse_information(one.information))[:n][joint] for one in (without, minimum))
    moved = (minimum.x[:n] - without.x[:n])[joint] ** 2
    return bool(((after - before > _TENTH**2 * after) | (moved > _TENTH**2 * after)).any())


@dataclass(frozen=True)
class _Profiles:
    """Profiles of the parameters at a minimum, with a variance factor for each.

    The likelihood has one spread for similar joints. If most of a variance is due to other spreads, `of_spread`, the
    interval follows from it. There is none if the fit has failed.
    """

    likelihood: Likelihood
    vector: ParameterVector
    minimum: Minimum
    covariance: FloatArray
    factor: FloatArray
    of_spread: NDArray[np.bool_]
    has_failed: bool

    def _profile(self, factor: float) -> ProfileIntervals:
        least = self.minimum
        return ProfileIntervals(self.likelihood, self.vector, least.x, least.cost, self.covariance, factor)

    def of(self, i: int, probability: float) -> tuple[float, float]:
        """Return the interval of one parameter."""
        if self.has_failed:
            return self.vector.end(i, -1), self.vector.end(i, 1)
        if self.of_spread[i]:
            reach = np.sqrt(self.covariance[i, i] * self.factor[i]) * float(special.ndtri((1 + probability) / 2))
            step = np.eye(1, self.minimum.x.size, i)[0] * reach
            low, high = (self.vector.value(i, self.minimum.x + sign * step) for sign in (-1, 1))
            return low, high
        with one_thread(of_blas_only=True), warnings.catch_warnings():
            warnings.simplefilter("ignore", IllConditionedWarning)  # during the search for distant limits
            return self._profile(float(self.factor[i])).of(i, probability)

    def of_function(
        self, function: Callable[[FloatArray], float], used: NDArray[np.intp], probability: float
    ) -> tuple[float, float] | None:
        """Return the interval of a function of the parameters that depends on those with these numbers."""
        shown = self.vector.free[: self.factor.size]
        if self.has_failed:
            return -np.inf, np.inf
        if self.of_spread[used].any():
            return None
        with one_thread(of_blas_only=True):
            return self._profile(float(self.factor[used].max())).of_function(
                lambda x: function(self.vector.to_values(x)[shown]), probability
            )


def _residual(problem: ModelProblem, likelihood: Likelihood, minimum: Minimum) -> tuple[ComplexArray, ComplexArray]:
    """Return the residual over the noise, and the fitted FRFs."""
    vector = likelihood.vector
    predicted = problem.prediction.frfs(vector, vector.to_values(minimum.x))
    if likelihood.whitening is not None:
        # FRFs of a line share noise of substructures: their combinations are independent.
        size = np.where(likelihood.used, np.sqrt(problem.noise.inflation / 2), np.nan)
        return likelihood.weighted(likelihood.difference(predicted)) * size, predicted
    return (likelihood.measured - predicted) / _tested(problem, likelihood), predicted


def _tested(problem: ModelProblem, likelihood: Likelihood) -> FloatArray:
    """Return the standard deviation of the noise for the test of the residual; NaN if nothing was measured."""
    tested = problem.variance if problem.tested is None else problem.tested
    if problem.shared is not None:
        # Its lines have the correlation of the FRFs of the assembly.
        tested = tested + (abs(problem.shared) ** 2).sum(axis=-1) / problem.noise.inflation
    return np.sqrt(np.where(likelihood.used, tested, np.nan))


def _test(
    problem: ModelProblem, likelihood: Likelihood, minimum: Minimum, residual: ComplexArray, predicted: ComplexArray
) -> ResidualTest:
    """Compare a residual with noise and calibration; parameters with priors use fewer degrees of freedom."""
    n, errors = likelihood.vector.n_shown, problem.noise.calibration
    of_priors = np.diagonal(likelihood.vector.prior_information(minimum.x))[n:]
    held = float(of_priors @ np.diagonal(inverse_information(minimum.information))[n:])
    smooth = None
    if errors is not None:
        added = (abs(predicted) / _tested(problem, likelihood)) ** 2 * errors.variance(problem.freq_hz)[:, None, None]
        residual, smooth = residual / np.sqrt(1 + added), added / (1 + added)
    return check_residual(
        residual, problem.freq_hz, likelihood.vector.pulls(minimum.x)[:n], parameters=minimum.x.size - held,
        inflation=problem.noise.inflation, is_given=problem.noise.is_given, smooth=smooth,
    )  # fmt: skip


#: The FRFs do not determine a direction if -2 log likelihood changes by less than 1 when its parameters change by this
#: share, or by a standard deviation of their prior.
_SHARE = 0.3
#: Relative size of components below which they are not named.
_NAMED = 0.2
#: Cosine between parts of a space of directions above which parameters belong together.
_LINKED = 0.05


class OpenDirection(NamedTuple):
    """A combination of parameters with hardly any effect on the FRFs.

    Attributes
    ----------
    parts : tuple of (str, float)
        Name of each parameter, and its relative change, the largest first.
    std : float
        Standard deviation of the combination from the FRFs alone, in units of `parts`; inf if they do not determine it.
    is_held_by_prior : bool
        Whether priors determine it.
    """

    parts: tuple[tuple[str, float], ...]
    std: float
    is_held_by_prior: bool


def open_directions(vector: ParameterVector, x: FloatArray, information: FloatArray) -> tuple[OpenDirection, ...]:
    """Return the directions that the FRFs do not determine.

    Parameters
    ----------
    vector : ParameterVector
        Parameters.
    x : ndarray, shape (p,)
        Coordinates of the minimum.
    information : ndarray, shape (p, p)
        Half of the second derivatives of -2 log likelihood with priors, in coordinates.

    Notes
    -----
    Eigenvectors of the information of the FRFs alone, in units of a share of each value, or of its prior.
    """
    values, slope = vector.to_values(x)[vector.free], vector.slope(x)
    # FRFs determine a mean only through its members.
    seen = [i for i, one in enumerate(vector.fitted) if one.origin != "mean"]
    of_priors = vector.pull_slopes(x)[:, seen]
    of_frfs = information[np.ix_(seen, seen)] - of_priors.T @ of_priors
    fitted, values, slope = [vector.fitted[i] for i in seen], values[seen], slope[seen]
    std = np.array([one.std or np.inf for one in fitted])
    unit = np.minimum(np.where(values == 0, np.inf, _SHARE * abs(values)), std)
    unit = np.where(np.isfinite(unit), unit, 1.0) / np.maximum(slope, np.finfo(float).tiny)
    scaled = of_frfs * np.outer(unit, unit)
    value, turned = np.linalg.eigh(scaled)
    found = []
    for direction in _disjoint(turned[:, value < 1]).T:
        size, largest = float(direction @ scaled @ direction), abs(direction).max()
        change = direction * unit * slope / np.where(values == 0, 1, abs(values))
        change = change * np.sign(direction[abs(direction).argmax()])
        named = [i for i in np.argsort(-abs(direction)) if abs(direction[i]) > _NAMED * largest]
        by_prior = float(((of_priors @ (direction * unit)) ** 2).sum())
        found.append(
            OpenDirection(
                tuple((fitted[i].name, float(change[i])) for i in named),
                float(1 / np.sqrt(size)) if size > 0 else float("inf"),
                by_prior + max(size, 0) > 1 / 9,
            )
        )
    return tuple(found)


def _disjoint(directions: FloatArray) -> FloatArray:
    """Return directions of the same space that share no parameters, as far as possible; in columns."""
    if directions.shape[1] < 2:
        return directions
    within = directions @ directions.T  # does not depend on which directions span the space
    size = np.sqrt(np.maximum(np.diagonal(within), 0))
    moved = np.flatnonzero(size > _NAMED * size.max())
    linked = abs(within[np.ix_(moved, moved)]) > _LINKED * np.outer(size[moved], size[moved])
    count, group = csgraph.connected_components(linked, directed=False)
    found = []
    for number in range(count):
        own = moved[group == number]
        left, length, _ = np.linalg.svd(directions[own], full_matrices=False)
        for vector in left[:, length > 0.5].T:  # sqrt(1/2): half of it is in these parameters
            whole = np.zeros(len(directions))
            whole[own] = vector
            found.append(whole)
    return np.array(found).T if len(found) == directions.shape[1] else directions


class Unseparated(NamedTuple):
    """Parameters of several joints that the FRFs do not separate.

    Attributes
    ----------
    names : tuple of str
        Names of the parameters.
    known : tuple of (tuple of float, float)
        Determined sums of the parameters: their coefficients, of which the largest is 1, and the standard deviation.
    is_held_by_prior : bool
        Whether priors determine them.
    """

    names: tuple[str, ...]
    known: tuple[tuple[tuple[float, ...], float], ...]
    is_held_by_prior: bool


def unseparated(
    vector: ParameterVector, x: FloatArray, information: FloatArray, directions: Sequence[OpenDirection]
) -> tuple[Unseparated, ...]:
    """Return the parameters of several joints in undetermined directions, and their determined combinations.

    Notes
    -----
    Determined combinations are the eigenvectors of the information of the FRFs on relative changes, with all further
    parameters unknown, without the undetermined directions.
    """
    place = {one.name: i for i, one in enumerate(vector.fitted)}
    slope, of_frfs = vector.slope(x), information - vector.prior_information(x)
    groups: list[tuple[list[str], list[OpenDirection]]] = []
    for one in directions:
        names = [name for name, _ in one.parts]
        joints = {name.rpartition(".")[0] for name in names}
        if len(joints) < 2 or not all(vector.fitted[place[name]].origin == "joint" for name in names):
            continue
        touched = [group for group in groups if set(group[0]) & set(names)]
        groups = [group for group in groups if group not in touched]
        groups.append(([*names, *(name for group in touched for name in group[0])],
                       [one, *(each for group in touched for each in group[1])]))  # fmt: skip
    found = []
    for names, own in groups:
        at = sorted({place[name] for name in names})
        rest = [i for i in place.values() if i not in at]
        cross = of_frfs[np.ix_(at, rest)]
        known = of_frfs[np.ix_(at, at)] - cross @ inverse_information(information[np.ix_(rest, rest)]) @ cross.T
        values = vector.to_values(x)[vector.free][at]
        size = np.where(values == 0, 1, abs(values))
        unit = size / np.maximum(slope[at], np.finfo(float).tiny)
        value, turned = np.linalg.eigh(known * np.outer(unit, unit))
        sums = []
        for level, share in list(zip(value, turned.T, strict=True))[: len(own) - 1 : -1]:
            largest = share[abs(share).argmax()] / size[abs(share).argmax()]
            weights = share / size / largest
            sums.append((tuple(weights.tolist()), float(1 / np.sqrt(max(level, np.finfo(float).tiny)) / abs(largest))))
        held = all(one.is_held_by_prior for one in own)
        found.append(Unseparated(tuple(vector.fitted[i].name for i in at), tuple(sums), held))
    return tuple(found)
