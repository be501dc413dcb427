"""Errors of models and gains, and the spread of similar joints: by priors, or by the evidence of the FRFs."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.identification.minimise import Minimum, NormalEquations, inverse_information, minimise
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.parameters import (
    CommonMean,
    ErrorOrigin,
    FitParameter,
    ParameterOrigin,
    ParameterVector,
)
from jointfrf.kernel.arguments import FloatArray

__all__ = [
    "GAIN",
    "ErrorGroup",
    "ErrorLevel",
    "Errors",
    "error_terms",
    "expected_covariance",
    "spread_factors",
    "with_discrepancy",
    "with_errors",
    "with_spreads",
]

#: Standard deviation of the prior of a gain that all FRFs share: accelerometers and hammers are calibrated to 1 to 2 %
#: (ISO 16063-21).
GAIN = 0.01
#: Maximum number of terms of a part, and of entries of their derivatives: 400 MB.
_TERMS, _NUMBERS = 90, 25_000_000
#: Initial value of the search: typical for models of one material and simple shape.
_FIRST = 3e-3
#: Largest relative error of an entry of a modal matrix: beyond it the matrix would not be positive definite.
_LARGEST = 0.3
#: Levels that are compared, in steps of a factor of 1.12. At the last one, where errors beyond the band are ninefold,
#: the models do not describe the parts, or another assumption is wrong.
_LEVELS = np.geomspace(1e-6, _LARGEST / 9, 93)
#: Levels of gains that are compared.
_GAINS = np.geomspace(1e-6, _LARGEST, 112)
#: Maximum number of cycles over the kinds of errors, and tolerance of the logarithm of a level.
_CYCLES, _SAME = 10, 0.05
#: Tolerance of the level as a factor, and maximum number of fits.
_SETTLED, _FITS = 1.15, 5
#: Maximum number of updates of the noise for wrong models, and tolerance of an update as a factor.
_DISCREPANCY_TURNS, _DISCREPANCY_SETTLED = 15, 1.02
#: Least decrease of -2 log evidence by errors; a smaller one is chance.
_LEAST_GAIN = 1.0
#: Least decrease by gains: by chance one of 400 fits exceeds it, as half of chi-squared of one degree does.
_LEAST_OF_GAINS = 7.9
#: Increase of -2 log evidence that excludes a level: with 95 %, as by chi-squared of one degree.
_EXCLUDED = 3.84
#: Prior of a spread relative to its mean: parts of one kind differ by some tens of percent at most.
_USUAL_SPREAD = 0.3
#: Spreads over which variances are averaged, relative to the mean: the whole range of prior and likelihood.
_SPREADS = np.geomspace(1e-3, 3.0, 40)
#: Maximum number of steps to the spreads of a minimum, and their tolerance.
_SPREAD_STEPS, _SPREAD_SETTLED = 500, 1e-3


class ErrorLevel(NamedTuple):
    """Standard deviation of errors of one kind that the intervals cover.

    Attributes
    ----------
    level : float
        Standard deviation of the relative errors that the FRFs show; 0 if they show none.
    gain : float
        -2 log evidence without errors minus that with this level.
    largest : float
        Largest level that the FRFs do not exclude: intervals cover errors with a prior up to this level.
    """

    level: float
    gain: float
    largest: float

    def of(self, believed: ArrayLike) -> FloatArray:
        """Return the level of errors by the standard deviation of their prior."""
        return np.maximum(self.level, np.minimum(self.largest, believed))


class Errors(NamedTuple):
    """Errors in addition to the unknowns of a fit.

    Attributes
    ----------
    model : ErrorLevel
        Errors of modal stiffnesses and masses of the parts (`Substructure.model_error`).
    gains : dict of ErrorOrigin to ErrorLevel
        Errors of the gains of responses, of forces, and of a gain that all FRFs share.
    shapes : ErrorLevel
        Errors of mode shapes of the parts at channels that no joint touches.
    noise : float
        Factor of the noise that covers the residual beyond these errors (`with_discrepancy`).
    """

    model: ErrorLevel
    gains: dict[ErrorOrigin, ErrorLevel]
    shapes: ErrorLevel = ErrorLevel(0.0, 0.0, 0.0)
    noise: float = 1.0

    @property
    def largest_level(self) -> float:
        """Largest level that the FRFs show, of models or gains."""
        return max([self.model.level, *(one.level for one in self.gains.values())])


_NONE = ErrorLevel(0.0, 0.0, 0.0)


class ErrorGroup(NamedTuple):
    """Errors of one variance.

    Attributes
    ----------
    origin : str
        Kind of the errors, as in `FitParameter`.
    names : tuple of str
        Name of each error.
    places : tuple of tuple
        Place of each error, as in `FitParameter`.
    weight, believed : ndarray, shape (n,)
        Standard deviation of each error for a level of 1, and its prior level.
    levels : ndarray
        Levels that are compared; the last one is rejected as no small error.
    least : float
        Least decrease of -2 log evidence.
    """

    origin: ErrorOrigin
    names: tuple[str, ...]
    places: tuple[tuple[str | int, ...], ...]
    weight: FloatArray
    believed: FloatArray
    levels: FloatArray
    least: float

    def parameters(self, deviation: FloatArray) -> Iterator[FitParameter]:
        """Yield the errors as parameters with these standard deviations."""
        limit = min(9 * float(self.levels[-1]), 0.9)
        for name, place, std in zip(self.names, self.places, deviation.tolist(), strict=True):
            yield FitParameter(name, "1", self.origin, place, 0.0, std, -limit, limit, False, True)


@dataclass(frozen=True)
class _Levels:
    """Levels of all groups by the evidence, from squares about a point whose errors have priors.

    Attributes
    ----------
    at : NormalEquations
        Squares about x, with the priors of `deviation`.
    x : ndarray, shape (p,)
        Coordinates.
    groups : sequence of ErrorGroup
        Groups of errors, which are the last coordinates.
    deviation : ndarray, shape (n_errors,)
        Standard deviations of the priors, which are the units of the coordinates.
    """

    at: NormalEquations
    x: FloatArray
    groups: Sequence[ErrorGroup]
    deviation: FloatArray

    def found(self, begin: Sequence[float]) -> list[ErrorLevel]:
        """Return the level of each group that maximises the evidence, one after the other until convergence."""
        n, count = self.x.size - self.deviation.size, [one.weight.size for one in self.groups]
        ends = n + np.cumsum([0, *count])
        weight = np.concatenate([one.weight for one in self.groups])
        # Without the priors of the errors, in units of the deviation for a level of 1, about zero errors.
        unit = np.concatenate([np.ones(n), weight / self.deviation])
        of_errors = np.zeros(self.x.size)
        of_errors[n:] = 1.0
        information = self.at.information - np.diag(of_errors)
        gradient = self.at.gradient + of_errors * self.x
        gradient = (gradient + information[:, n:] @ self.x[n:]) * unit
        information = information * np.outer(unit, unit)
        levels, best = list(begin), [_NONE] * len(self.groups)
        for _ in range(_CYCLES):
            before = list(levels)
            for i, group in enumerate(self.groups):
                own = slice(ends[i], ends[i + 1])
                prior = np.concatenate([np.zeros(n), np.repeat([max(one, _LEVELS[0]) ** -2 for one in levels], count)])
                best[i] = _level_of(information, gradient, prior, own, group)
                levels[i] = best[i].level
            if abs(np.log(np.maximum(levels, _LEVELS[0]) / np.maximum(before, _LEVELS[0]))).max() < _SAME:
                break
        return best


def _level_of(
    information: FloatArray, gradient: FloatArray, prior: FloatArray, own: slice, group: ErrorGroup
) -> ErrorLevel:
    """Return the level of a group, whose coordinates are `own`, by the information of all priors, shape (p,)."""
    rest = np.r_[0 : own.start, own.stop : len(gradient)]
    inner = information[np.ix_(rest, rest)] + np.diag(prior[rest])
    cross = information[own, rest]
    back = cross @ inverse_information(inner)
    apart = information[own, own] - back @ cross.T
    value, vector = np.linalg.eigh((apart + apart.T) / 2)
    along = (vector.T @ (gradient[own] - back @ gradient[rest])) ** 2
    levels = group.levels
    squared = levels[:, None] ** 2
    scaled = 1 + squared * np.maximum(value, 0)
    costs = (np.log(scaled) - squared * along / scaled).sum(axis=1)
    best = int(np.argmin(costs))
    gain = float(costs[0] - costs[best])
    largest = float(levels[np.flatnonzero(costs <= costs[best] + _EXCLUDED)[-1]])
    return ErrorLevel(float(levels[best]) if gain > group.least else 0.0, gain, largest)


def with_errors(
    likelihood: Likelihood,
    minimum: Minimum,
    common_gain: float,
    *,
    is_sought: bool = True,
    at_most: float = np.inf,
) -> tuple[Likelihood, Minimum, Errors] | None:
    """Fit with errors of models and gains from FRFs and priors; None if there are none.

    Parameters
    ----------
    likelihood : Likelihood
        Objective without these errors.
    minimum : Minimum
        Its minimum.
    common_gain : float
        Standard deviation of the prior of a gain that all FRFs share.
    is_sought : bool
        Whether errors of models without a prior are included if the FRFs show them.
    at_most : float
        Level above which no fit is made: None if the squares about the minimum show a larger one.

    Notes
    -----
    Errors of one kind have one variance. It maximises the evidence, the likelihood integrated over all parameters and
    errors, by Laplace's method at the minimum, which moves with it [1]_. Joint and unknowns can mimic some errors,
    which the evidence therefore does not show. A part thus has at least its prior level unless the evidence excludes
    it; the common gain of all FRFs, too. The largest level that is compared is rejected as no small error.

    References
    ----------
    .. [1] D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415-447.
    """
    n = minimum.x.size
    shape = likelihood.measured.shape[1], likelihood.measured.shape[2]
    groups = [
        *_gain_groups(likelihood.vector, shape, common_gain),
        *_model_groups(likelihood.prediction, likelihood.measured.size, is_sought=is_sought),
    ]
    if not groups:
        return None
    deviation = np.concatenate([_FIRST * one.weight for one in groups])
    x = np.concatenate([minimum.x, np.zeros(deviation.size)])
    levels = [_NONE] * len(groups)
    for turn in range(_FITS):
        own = replace(likelihood, vector=_with_parameters(likelihood.vector, groups, deviation))
        if turn:
            at = minimise(own, x, least=1e-2, small=1e-1)
            x, about = at.x, NormalEquations(at.cost, at.information, at.gradient)
        else:
            about = own.linearised(x)
        levels = _Levels(about, x, groups, deviation).found([one.level for one in levels])
        levels = _as_allowed(groups, levels, is_sought=is_sought, is_first=not turn)
        found = [level.of(one.believed) * one.weight for one, level in zip(groups, levels, strict=True)]
        if not any(one.any() for one in found) or (turn == 0 and max(one.level for one in levels) > at_most):
            return None
        least = [_LEVELS[0] * one.weight for one in groups]
        ratio = np.maximum(np.concatenate(found), np.concatenate(least)) / deviation
        x[n:] /= ratio
        deviation = deviation * ratio
        if turn == 0 and not all(one.any() for one in found):
            kept = np.concatenate([np.full(one.size, one.any()) for one in found])
            x, deviation = np.concatenate([x[:n], x[n:][kept]]), deviation[kept]
            groups = list(itertools.compress(groups, [one.any() for one in found]))
            levels = list(itertools.compress(levels, [one.any() for one in found]))
        elif turn and max(ratio.max(), 1 / ratio.min()) < _SETTLED:
            break
    own = replace(likelihood, vector=_with_parameters(likelihood.vector, groups, deviation))
    by_origin = {one.origin: level for one, level in zip(groups, levels, strict=True)}
    return own, minimise(own, x), Errors(by_origin.pop("error", _NONE), by_origin)


def with_discrepancy(
    likelihood: Likelihood, minimum: Minimum, inflation: float, ratio: float
) -> tuple[Likelihood, Minimum, Errors] | None:
    """Fit wrong models: with errors of modal matrices and mode shapes, and noise that covers the rest.

    None if no part has a model, or if such a fit does not converge.

    Parameters
    ----------
    likelihood : Likelihood
        Objective without these errors.
    minimum : Minimum
        Its minimum.
    inflation : float
        Number of lines that carry the noise of one independent line.
    ratio : float
        Residual over noise at this minimum, which is the initial value of the noise.

    Notes
    -----
    The mixed model y = f(x) + B u + e with a separate variance for each kind of errors u, and one factor of the
    variance of e. In each update the factor decreases to the mean square of the residual that the errors leave: FRFs
    with much noise have one broad minimum, and the updates follow it to lower noise.
    """
    vector, n = likelihood.vector, minimum.x.size
    groups = _model_groups(likelihood.prediction, likelihood.measured.size, is_sought=True, of_shapes=True)
    if not groups:
        return None
    levels = [np.maximum(one.believed, _FIRST) for one in groups]
    starts = minimum.x, vector.to_coordinates(vector.values)
    x = np.concatenate([starts[0], np.zeros(sum(one.weight.size for one in groups))])
    scale, count = ratio, 2.0 * float(likelihood.used.sum())
    found, before = [_NONE] * len(groups), np.inf
    for turn in range(_DISCREPANCY_TURNS):
        deviation = np.concatenate([level * one.weight for one, level in zip(groups, levels, strict=True)])
        own = replace(likelihood.with_noise(scale), vector=_with_parameters(vector, groups, deviation))
        if turn == 0:
            x[:n] = min(starts, key=likelihood.with_noise(scale).cost)
        at = minimise(own, x)
        if not at.converged:
            return None
        of_priors = np.diagonal(own.vector.prior_information(at.x))[n:]
        held = float(of_priors @ np.diagonal(inverse_information(at.information))[n:])
        squares = at.cost - float((own.vector.pulls(at.x) ** 2).sum())
        left = float(np.sqrt(squares * inflation / max(count - (at.x.size - held), 1.0)))
        about = NormalEquations(at.cost, at.information, at.gradient)
        found = _Levels(about, at.x, groups, deviation).found([float(np.mean(one)) for one in levels])
        x, before, scale = at.x, scale, max(scale * left, 1.0)
        if before / scale < _DISCREPANCY_SETTLED:
            break
        others = [np.clip(one.level, np.maximum(group.believed, _FIRST), group.levels[-1])
                  for one, group in zip(found, groups, strict=True)]  # fmt: skip
        x[n:] *= np.concatenate([one / other for one, other in zip(levels, others, strict=True)])
        levels = others
    by_origin = {one.origin: own._replace(level=float(level.max()))
                 for one, own, level in zip(groups, found, levels, strict=True)}  # fmt: skip
    return own, at, Errors(by_origin.get("error", _NONE), {}, by_origin.get("shape-error", _NONE), before)


def _as_allowed(
    groups: Sequence[ErrorGroup], levels: Sequence[ErrorLevel], *, is_sought: bool, is_first: bool
) -> list[ErrorLevel]:
    """Return levels without those that are not sought, or so large that the models do not describe the parts."""
    is_absurd = [one.level == group.levels[-1] for one, group in zip(levels, groups, strict=True)]
    if not is_first and any(at and one.origin == "error" for at, one in zip(is_absurd, groups, strict=True)):
        return [one._replace(level=0.0) for one in levels]  # gains cannot be recognised with such models, either
    dropped = [
        not is_sought if one.origin == "error" else absurd for absurd, one in zip(is_absurd, groups, strict=True)
    ]
    return [one._replace(level=0.0) if drop else one for drop, one in zip(dropped, levels, strict=True)]


def _model_groups(prediction: Prediction, size: int, *, is_sought: bool, of_shapes: bool = False) -> list[ErrorGroup]:
    """Return the errors of the models of all parts, if any is sought or has a prior; mode shapes last."""
    sides = prediction.sides
    if not (is_sought or any(side.part.error_level > 0 for side in sides)):
        return []
    most = min(_TERMS, int(_NUMBERS / max(size, 1)) // len(sides))
    for side in sides:
        side.allow_errors(most, prediction.away_from_joints(side.name) if of_shapes else ())
    known = [(side, side.errors) for side in sides if side.errors is not None]
    of_matrices = [(side, i, one) for side, errors in known for i, one in enumerate(errors.terms)]
    at_points = [(side, i, one) for side, errors in known for i, one in enumerate(errors.shape_terms)]
    kinds: tuple[tuple[ErrorOrigin, list[Any], float, FloatArray, float], ...] = (
        ("error", of_matrices, 1.0, _LEVELS, _LEAST_GAIN),
        ("shape-error", at_points, 0.0, _GAINS, _LEAST_OF_GAINS),  # their priors are not stated
    )
    return [
        ErrorGroup(
            origin,
            tuple(f"{side.name}/{one.matrix} {one.row + 1} {one.column + 1}" for side, _, one in terms),
            tuple((side.name, i) for side, i, _ in terms),
            np.array([one.weight for *_, one in terms]),
            np.array([stated * side.part.error_level for side, *_ in terms]),
            levels,
            least,
        )
        for origin, terms, stated, levels, least in kinds
        if terms
    ]


def _gain_groups(vector: ParameterVector, shape: tuple[int, int], common_gain: float) -> list[ErrorGroup]:
    """Return the gains of responses, of forces, and of all FRFs, as far as the fit does not have them as unknowns."""
    origins: tuple[tuple[ErrorOrigin, ParameterOrigin], ...] = (
        ("response-error", "response"), ("force-error", "force")
    )  # fmt: skip
    found, is_unknown = [], False
    for (origin, unknown), number in zip(origins, shape, strict=True):
        known = {int(vector.all[i].place[0]) for i in vector.places_of(unknown)}
        left = tuple((i,) for i in range(number) if i not in known)
        is_unknown |= not left
        if number > 1 and left:
            one, names = np.ones(len(left)), tuple(f"gain of {unknown} {i + 1}" for (i,) in left)
            found.append(ErrorGroup(origin, names, left, one, 0 * one, _GAINS, _LEAST_OF_GAINS))
    if not is_unknown:
        own = np.ones(1), np.full(1, common_gain)
        found.insert(0, ErrorGroup("common-error", ("gain of all FRFs",), ((0,),), *own, _GAINS, _LEAST_OF_GAINS))
    return found


def error_terms(
    prediction: Prediction, vector: ParameterVector, shape: tuple[int, int], common_gain: float
) -> tuple[ParameterVector, list[ErrorGroup]]:
    """Return a vector to which all errors with a prior are added, at a level of 1, and these errors.

    Parameters
    ----------
    prediction : Prediction
        FRFs of the assembly.
    vector : ParameterVector
        Parameters without the errors.
    shape : (int, int)
        Numbers of responses and forces.
    common_gain : float
        Standard deviation of the prior of a gain that all FRFs share.
    """
    size = prediction.omega.size * shape[0] * shape[1]
    gains = [one for one in _gain_groups(vector, shape, common_gain) if one.believed.any()]
    groups = [*gains, *_model_groups(prediction, size, is_sought=False)]
    return _with_parameters(vector, groups, np.concatenate([np.zeros(0), *(one.weight for one in groups)])), groups


def expected_covariance(of_frfs: FloatArray, prior: FloatArray, groups: Sequence[ErrorGroup]) -> FloatArray:
    """Return the covariance of the parameters that a fit of FRFs of perfect models will state.

    Parameters
    ----------
    of_frfs : ndarray, shape (p + e, p + e)
        Information of the FRFs on parameters and errors, these in units of their deviations at a level of 1.
    prior : ndarray, shape (p, p)
        Information of the priors of the parameters.
    groups : sequence of ErrorGroup
        All errors in their order.

    Returns
    -------
    ndarray, shape (p, p)
        Covariance of the parameters.

    Notes
    -----
    A fit includes errors up to their prior level unless the evidence excludes it (`with_errors`). The expectation of
    -2 log evidence over the noise is log det I - tr(I^-1 J) + 2 e log(level), with the information J of the FRFs and
    I = J + P of FRFs and priors.
    """
    p = len(prior)
    ends = p + np.cumsum([0, *(one.weight.size for one in groups)])
    whole = of_frfs.copy()
    whole[:p, :p] += prior
    levels = [np.clip(one.believed, one.levels[0], one.levels[-1]) for one in groups]
    for i, one in enumerate(groups):
        others = np.concatenate([np.zeros(0), *(level**-2.0 for j, level in enumerate(levels) if j != i)])
        own = np.arange(ends[i], ends[i + 1])
        rest = np.delete(np.arange(len(whole)), own)
        priors = np.zeros((rest.size, rest.size))
        priors[:p, :p] = prior
        priors[range(p, rest.size), range(p, rest.size)] = others
        largest = _expected_level(of_frfs, priors, rest, own, one.levels)
        levels[i] = np.clip(one.believed, one.levels[0], max(largest, float(one.levels[0])))
    errors = np.arange(p, len(whole))
    whole[errors, errors] += np.concatenate([np.zeros(0), *(level**-2.0 for level in levels)])
    return np.asarray(np.linalg.inv(whole)[:p, :p], np.float64)


def _expected_level(
    of_frfs: FloatArray, prior: FloatArray, rest: NDArray[np.intp], own: NDArray[np.intp], levels: FloatArray
) -> float:
    """Return the largest level of the errors `own` that the mean evidence does not exclude; `prior` is of the rest."""
    a = np.linalg.inv(of_frfs[np.ix_(rest, rest)] + prior)
    onto = a @ of_frfs[np.ix_(rest, own)]
    value, turned = np.linalg.eigh(of_frfs[np.ix_(own, own)] - of_frfs[np.ix_(own, rest)] @ onto)
    value = np.maximum(value, 0.0)
    through = onto @ turned
    held = np.einsum("ik,ij,jk->k", through, prior, through)
    squared = levels[:, None] ** 2
    ratio = value * squared
    costs = (np.log1p(ratio) + 1 / (1 + ratio) * (1 + held * squared)).sum(axis=1)
    return float(levels[np.flatnonzero(costs <= costs.min() + _EXCLUDED)[-1]])


def with_spreads(likelihood: Likelihood, minimum: Minimum) -> tuple[Likelihood, Minimum]:
    """Fit with spreads of similar joints, estimated from the FRFs or given relative to the means.

    Notes
    -----
    A spread s maximises the evidence, the means integrated, times s exp(-s / 30 %). This prior excludes zero if a few
    joints differ by no more than their errors [1]_, and infinity if the FRFs hardly determine it. The method is
    expectation-maximisation on the squares about the minimum, which moves with the spreads.

    References
    ----------
    .. [1] Y. Chung, S. Rabe-Hesketh, V. Dorie, A. Gelman, J. Liu, A nondegenerate penalized likelihood estimator for
       variance parameters in multilevel models, Psychometrika 78 (2013) 685-709.
    """
    for _ in range(_FITS if likelihood.vector.means else 0):
        vector = likelihood.vector
        means = _spreads(vector, minimum)
        likelihood = replace(likelihood, vector=replace(vector, means=means))
        minimum = minimise(likelihood, minimum.x)
        moved = [max(a.std / b.std, b.std / a.std) for a, b in zip(means, vector.means, strict=True)]
        if max(moved) < _SETTLED:
            break
    return likelihood, minimum


@dataclass(frozen=True)
class _SharedPriors:
    """Squares about a minimum without the priors that members share with their means, and these priors.

    Attributes
    ----------
    information, gradient : ndarray, shapes (p, p), (p,)
        Derivatives of the squares about the minimum: about zero, rounding would hide differences of the evidence.
    apart : ndarray, shape (r,)
        Members minus their mean at the minimum, in units of their values or logarithms.
    rows : ndarray, shape (r, p)
        Derivatives of members minus their mean, in units of their values or logarithms.
    of_row : ndarray, shape (r,)
        Number of the mean of each row.
    sizes : ndarray
        Values that spreads are relative to.
    """

    information: FloatArray
    gradient: FloatArray
    apart: FloatArray
    rows: FloatArray
    of_row: NDArray[np.intp]
    sizes: FloatArray

    @classmethod
    def of(cls, vector: ParameterVector, minimum: Minimum) -> _SharedPriors:
        own = vector.pull_slopes(minimum.x)[vector.free.size :]
        information = minimum.information - own.T @ own
        gradient = minimum.gradient + own.T @ (own @ minimum.x)
        of_row = np.repeat(np.arange(len(vector.means)), [len(one.members) for one in vector.means])
        std, values = np.array([one.std for one in vector.means]), vector.to_values(minimum.x)
        sizes = [1.0 if vector.all[one.mean].is_log else abs(values[one.mean]) for one in vector.means]
        floor = np.finfo(float).tiny
        rows = own * std[of_row, None]
        return cls(information, gradient, rows @ minimum.x, rows, of_row, np.maximum(sizes, floor))

    def with_spreads(self, std: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Return information and gradient with the priors, and the squares of these at the minimum."""
        shared, apart = self.rows / std[self.of_row, None], self.apart / std[self.of_row]
        return self.information + shared.T @ shared, self.gradient - shared.T @ apart, float(apart @ apart)


def _spreads(vector: ParameterVector, minimum: Minimum) -> tuple[CommonMean, ...]:
    """Return the means with the standard deviations at a minimum that was found with other ones."""
    shared, means = _SharedPriors.of(vector, minimum), vector.means
    std, count = np.array([one.std for one in means]), np.array([len(one.members) for one in means])
    given = np.array([np.nan if one.relative is None else one.relative for one in means]) * shared.sizes
    is_given = np.isfinite(given)
    std = np.where(is_given, given, std)
    for _ in range(0 if is_given.all() else _SPREAD_STEPS):
        information, gradient, _ = shared.with_spreads(std)
        covariance = inverse_information(information)
        apart = shared.apart + shared.rows @ (covariance @ gradient)
        own = np.einsum("ri,ij,rj->r", shared.rows, covariance, shared.rows)
        squares = np.bincount(shared.of_row, apart**2 + own)
        likely = [_most_likely(*one) for one in zip(squares, count, shared.sizes, strict=True)]
        other = np.where(is_given, given, likely)
        is_settled = abs(np.log(other / std)).max() < _SPREAD_SETTLED
        std = other
        if is_settled:
            break
    return tuple(one._replace(std=float(value)) for one, value in zip(means, std, strict=True))


def spread_factors(vector: ParameterVector, minimum: Minimum) -> FloatArray:
    """Return the factors by which uncertain spreads increase variances of the coordinates, shape (p,).

    Notes
    -----
    The law of total variance over the posterior of each spread: it is wide for few joints, or for joints that the FRFs
    do not separate.
    """
    shared = _SharedPriors.of(vector, minimum)
    std = np.array([one.std for one in vector.means])
    variance = np.diagonal(inverse_information(shared.with_spreads(std)[0]))
    factor = np.ones(minimum.x.size)
    for q, one in enumerate(vector.means):
        if one.relative is not None:
            continue
        levels = _SPREADS * shared.sizes[q]
        logs, x, own = [], [], []
        for level in levels:
            information, gradient, at = shared.with_spreads(np.where(np.arange(std.size) == q, level, std))
            covariance = inverse_information(information)
            size = np.sqrt(np.maximum(np.diagonal(information), np.finfo(float).tiny))
            volume = np.linalg.slogdet(information / np.outer(size, size))[1] + 2 * np.log(size).sum()
            x.append(covariance @ gradient)
            own.append(np.diagonal(covariance))
            squares = at - gradient @ x[-1] + volume + 2 * len(one.members) * np.log(level)
            # The prior, and one power of the level for levels that rise by a factor.
            logs.append(2 * np.log(level) - level / (_USUAL_SPREAD * shared.sizes[q]) - squares / 2)
        weight = np.exp(np.array(logs) - max(logs))
        weight /= weight.sum()
        mean = weight @ np.array(x)
        total = weight @ (np.array(own) + (np.array(x) - mean) ** 2)
        factor += np.maximum(total / np.maximum(variance, np.finfo(float).tiny) - 1, 0)
    return factor


def _most_likely(squares: float, count: int, size: float) -> float:
    """Return the spread at the maximum of likelihood and prior: (m - 1) s^2 + s^3 / u = squares."""
    from scipy.optimize import brentq  # takes long to import, and is seldom needed

    usual, largest = _USUAL_SPREAD * size, float(np.sqrt(squares / (count - 1)))
    return float(brentq(lambda s: (count - 1) * s**2 + s**3 / usual - squares, 0.0, largest, rtol=1e-9))


def _with_parameters(vector: ParameterVector, groups: Sequence[ErrorGroup], deviation: FloatArray) -> ParameterVector:
    """Return a vector to which the errors of all groups are added."""
    ends = np.cumsum([one.weight.size for one in groups])[:-1]
    added = [one.parameters(own) for one, own in zip(groups, np.split(deviation, ends), strict=True)]
    return ParameterVector((*vector.all, *itertools.chain(*added)), vector.means)
