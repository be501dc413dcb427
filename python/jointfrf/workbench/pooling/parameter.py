"""One parameter of a joint over several fits: mean, spreads, trends, prediction interval, and outliers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from jointfrf.kernel.arguments import FloatArray, one_line
from jointfrf.messages.finding import Finding
from jointfrf.workbench.pooling.random_effects import RandomEffects

__all__ = ["Estimate", "FactorSpread", "FactorTrend", "PooledParameter", "TestPlan", "pooled_parameter", "shown_chance"]

#: Distance from zero in standard errors, in any fit, below which a parameter is not pooled on a logarithmic scale.
_FROM_ZERO = 2.0
#: Half of a 95 % interval, in standard errors.
_HALF = float(norm.ppf(0.975))
#: Least number of fits for an outlier: with three, any fit could be the outlier.
_LEAST_TO_JUDGE = 4
#: Significance level of outliers over a set of fits, and of factors.
_SIGNIFICANT = 0.05
#: p-value of the agreement of the fits below which a share of their errors is taken as common to all.
_AGREE = 0.01
#: Share of the upper limit below which a spread is zero up to the tolerance of the minimiser.
_NOTHING = 1e-3
#: Names of the factor whose groups are assemblies, and of the spread between repeats.
ASSEMBLY, _REPEAT = "assembly", "repeat"


@dataclass(frozen=True)
class Estimate:
    """A value with its interval, in its unit; the interval of a fit is the 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class FactorSpread:
    """Scatter of a parameter over one factor, beyond the errors of the fits.

    Attributes
    ----------
    factor : str
        Name of the factor: "assembly", "day", ...; "repeat" for the scatter between fits of one assembly.
    levels : int
        Number of groups in the fits.
    value, low, high : float
        Standard deviation by restricted maximum likelihood (REML), with its interval: relative to the parameter on a
        logarithmic scale, else in its unit.
    p_value : float
        p-value under the hypothesis that this factor has no spread, for any spreads of other factors.
    """

    factor: str
    levels: int
    value: float
    low: float
    high: float
    p_value: float


@dataclass(frozen=True)
class FactorTrend:
    """Change of a parameter with a number such as the torque.

    Attributes
    ----------
    factor : str
        Name of the factor.
    value, low, high : float
        Exponent b of (number)^b on a logarithmic scale, else change of the parameter by unit of the number.
    p_value : float
        Two-sided p-value under the hypothesis of no trend.
    """

    factor: str
    value: float
    low: float
    high: float
    p_value: float


@dataclass(frozen=True)
class PooledParameter:
    """A parameter over all fits.

    Attributes
    ----------
    name, unit : str
        Name and unit of the parameter.
    scale : {"log", "linear"}
        Scale on which the parameter scatters normally. On "log" the mean is geometric, and spreads are relative.
    mean : Estimate
        Mean of all such assemblies, with its confidence interval.
    next_one : Estimate
        Prediction for another assembly of the same kind, with its interval, at the mean of each trend.
    spreads : tuple of FactorSpread
        Spread over each factor; the spread that no factor explains is last.
    trends : tuple of FactorTrend
        Trend over each number.
    labels : tuple of str
        Labels of the fits that have this parameter.
    estimates : tuple of Estimate
        Estimates of these fits.
    outlying : tuple of str
        Labels of outlying fits.
    at : dict of str to float
        Number of each trend to which `mean` and `next_one` belong: the mean over the fits, on "log" the geometric mean.
    """

    name: str
    unit: str
    scale: Literal["log", "linear"]
    mean: Estimate
    next_one: Estimate
    spreads: tuple[FactorSpread, ...]
    trends: tuple[FactorTrend, ...]
    labels: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    outlying: tuple[str, ...]
    at: dict[str, float]


@dataclass(frozen=True)
class TestPlan:
    """Labels, factors and common errors of the fits.

    Attributes
    ----------
    labels : tuple of str
        Names of the fits.
    groups : dict of str to ndarray of int
        Number of each fit's group, by random factor, finest first.
    trends : dict of str to ndarray
        Number of each fit, by trend.
    common : list of (ndarray of int, float)
        Groups of the fits and relative standard error that fits of the same group share.
    probability : float
        Coverage probability of the intervals.
    """

    labels: tuple[str, ...]
    groups: Mapping[str, NDArray[np.intp]]
    trends: Mapping[str, FloatArray]
    common: Sequence[tuple[NDArray[np.intp], float]]
    probability: float


def pooled_parameter(
    name: str, unit: str, estimates: Sequence[Estimate | None], plan: TestPlan
) -> tuple[PooledParameter | None, list[Finding]]:
    """Return the pooled parameter, or None if fewer than two fits have it.

    Raises
    ------
    ValueError
        Too few fits for the trends; a trend in logarithms over a number that is not above zero.
    """
    findings = list[Finding]()
    found = [(i, one) for i, one in enumerate(estimates) if one is not None]
    unusable = [plan.labels[i] for i, one in found if not _is_closed(one)]
    if unusable:
        findings.append(Finding("fit-not-pooled", {"fits": tuple(unusable)}, (name,)))
    at = np.array([i for i, one in found if _is_closed(one)], dtype=np.intp)
    used = tuple(one for _, one in found if _is_closed(one))
    if len(used) < 2:
        findings.append(Finding("parameter-not-pooled", {"count": len(used)}, (name,)))
        return None, findings
    is_log = all(_is_positive(one) for one in used)
    if not is_log:
        findings.append(Finding("pooled-linearly", about=(name,)))
    names, effects = _random_effects(used, at, is_log, plan)
    chance, share = effects.excess_of_errors
    if chance < _AGREE:
        findings.append(Finding("errors-shared", {"chance": chance, "share": share}, (name,)))
        effects = effects.with_shared_errors(share)
    outlying = _outlying(effects, names, tuple(plan.labels[i] for i in at))
    mean, ahead = _mean_and_next(effects, names, is_log, plan.probability)
    pooled = PooledParameter(
        name, unit, "log" if is_log else "linear", mean, ahead, _spreads(effects, names, plan.probability),
        _trends(effects, tuple(plan.trends), plan.probability), tuple(plan.labels[i] for i in at), used, outlying,
        {own: _centre(numbers[at], is_log) for own, numbers in plan.trends.items()},
    )  # fmt: skip
    return pooled, findings + list(_findings(pooled))


def _is_closed(one: Estimate) -> bool:
    return all(map(math.isfinite, (one.value, one.low, one.high))) and one.low < one.high


def _is_positive(one: Estimate) -> bool:
    return one.low > 0 and one.value > _FROM_ZERO * (one.high - one.low) / (2 * _HALF)


def _random_effects(
    used: Sequence[Estimate], at: NDArray[np.intp], is_log: bool, plan: TestPlan
) -> tuple[list[str], RandomEffects]:
    """Return the names of the random factors that can be estimated, and the model, whose first column is the mean."""
    limits = np.array([(one.value, one.low, one.high) for one in used])
    limits = np.log(limits) if is_log else limits
    values, error = limits[:, 0], (limits[:, 2] - limits[:, 1]) / (2 * _HALF)
    size = 1.0 if is_log else np.abs(values).mean()
    covariance = np.diag(error**2)
    for codes, own in plan.common:
        covariance = covariance + (own * size) ** 2 * (codes[at][:, None] == codes[at])
    columns = [np.ones(at.size)]
    for name, numbers in plan.trends.items():
        if is_log and (numbers[at] <= 0).any():
            raise ValueError(f"the trend over {one_line(name)} is a power law; give numbers above zero")
        centre = _centre(numbers[at], is_log)
        columns.append(np.log(numbers[at] / centre) if is_log else numbers[at] - centre)
    design = np.column_stack(columns)
    if np.linalg.matrix_rank(design) < len(columns) or len(columns) >= at.size:
        raise ValueError(
            f"{at.size} fits cannot determine a mean and {len(columns) - 1} trends; give more fits or fewer trends"
        )
    names, factors = list[str](), list[NDArray[np.intp]]()
    for name, codes in plan.groups.items():
        group = np.unique(codes[at], return_inverse=True)[1].astype(np.intp)
        trial = RandomEffects(values, covariance, design, [*factors, group])
        if min(trial.degrees_of_freedom) > 0:  # the fits used are more than one group, and fewer groups than fits
            names.append(name)
            factors.append(group)
    return names, RandomEffects(values, covariance, design, factors)


def _centre(numbers: FloatArray, is_log: bool) -> float:
    """Return the mean of the numbers of a trend, on a logarithmic scale the geometric mean."""
    return float(np.exp(np.log(numbers).mean()) if is_log else numbers.mean())


def _mean_and_next(
    effects: RandomEffects, names: Sequence[str], is_log: bool, probability: float
) -> tuple[Estimate, Estimate]:
    back = math.exp if is_log else float
    of_mean = np.eye(effects.design.shape[1])[0]
    mean = effects.combination(of_mean)
    # The next assembly has the spreads between assemblies, not the spread between repeats.
    between = np.array([float(ASSEMBLY not in names), *(1.0 for _ in names)])
    ahead = effects.combination(of_mean, effects.variances @ between)
    middle = back(mean.quantile(0.5))
    return tuple(Estimate(middle, *map(back, one.interval(probability))) for one in (mean, ahead))  # type: ignore[return-value]


def _spreads(effects: RandomEffects, names: Sequence[str], probability: float) -> tuple[FactorSpread, ...]:
    tails = (1 - probability) / 2
    found = []
    for component, name in enumerate((_REPEAT if ASSEMBLY in names else ASSEMBLY, *names)):
        levels = int(effects.factors[component - 1].max()) + 1 if component else effects.values.size
        low = math.sqrt(np.quantile(effects.variances[:, component], tails))
        value, high = math.sqrt(effects.reml[component]), math.sqrt(effects.upper_limit(component, tails))
        value = value if value > _NOTHING * high else 0.0
        chance = effects.chance_of_no_spread(component)
        found.append(FactorSpread(name, levels, value, low, high, chance))
    return (*found[1:], found[0])


def _trends(effects: RandomEffects, names: Sequence[str], probability: float) -> tuple[FactorTrend, ...]:
    found = []
    for column, name in enumerate(names, 1):
        slope = effects.combination(np.eye(effects.design.shape[1])[column])
        below = slope.below(0.0)
        found.append(FactorTrend(name, slope.quantile(0.5), *slope.interval(probability), 2 * min(below, 1 - below)))
    return tuple(found)


def _outlying(effects: RandomEffects, names: Sequence[str], labels: Sequence[str]) -> tuple[str, ...]:
    """Return the outlying assemblies, each tested against the distribution of the remaining ones."""
    own = effects.factors[list(names).index(ASSEMBLY)] if ASSEMBLY in names else np.arange(len(labels))
    units = np.unique(own)
    if units.size < _LEAST_TO_JUDGE:
        return ()
    found = list[str]()
    for unit in units:
        members = np.flatnonzero(own == unit)
        if effects.chance_of(members) * units.size < _SIGNIFICANT:  # Bonferroni
            found += [labels[i] for i in members.tolist()]
    return tuple(found)


def shown_chance(p_value: float) -> str:
    """Return a probability as text."""
    return f"{p_value:.2g}" if p_value >= 1e-4 else "< 1e-4"


def _findings(pooled: PooledParameter) -> list[Finding]:
    found = []
    if pooled.outlying:
        numbers = {"parameter": pooled.name, "chance": _SIGNIFICANT, "fits": len(pooled.labels)}
        found.append(Finding("outlying-assembly", numbers, pooled.outlying))
    for one in pooled.spreads:
        if one.p_value < _SIGNIFICANT and one.factor not in (ASSEMBLY, _REPEAT):
            found.append(_effect(pooled.name, one.factor, one.p_value, ""))
    found += [
        _effect(pooled.name, one.factor, one.p_value, "trend") for one in pooled.trends if one.p_value < _SIGNIFICANT
    ]
    return found


def _effect(name: str, factor: str, p_value: float, variant: str) -> Finding:
    numbers = {"parameter": name, "factor": factor, "chance": shown_chance(p_value)}
    return Finding("factor-effect", numbers, (name,), variant=variant)
