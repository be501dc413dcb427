"""Pooled fits of the same joint in several assemblies, at several torques, on several days."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.result import Fit, columns_of
from jointfrf.kernel.arguments import FloatArray, as_names, as_number, as_probability, check_type, one_line
from jointfrf.messages.finding import Finding, WithFindings, worst_first
from jointfrf.messages.of_data import DATA_MESSAGES
from jointfrf.spelling import did_you_mean, some_of
from jointfrf.workbench.pooling.parameter import (
    ASSEMBLY,
    Estimate,
    PooledParameter,
    TestPlan,
    pooled_parameter,
    shown_chance,
)

__all__ = ["PooledFits", "pool"]

#: Labels, or numbers, of the group of each fit.
Factors = Mapping[str, Sequence[str | float]]


@dataclass(frozen=True)
class PooledFits(WithFindings):
    """Pooled fits of one joint; `print` shows them.

    Attributes
    ----------
    labels : tuple of str
        Names of the fits.
    parameters : dict of str to PooledParameter
        Pooled parameters by name.
    probability : float
        Coverage probability of the intervals of means, spreads, trends and the next assembly.
    findings : tuple of Finding
        Warnings about fits and parameters.
    """

    labels: tuple[str, ...]
    parameters: dict[str, PooledParameter]
    probability: float
    findings: tuple[Finding, ...]

    def __str__(self) -> str:
        """Return tables of means and the next assembly, of spreads and trends, and the findings."""
        percent = f"{100 * self.probability:g} %"
        means = [("parameter", "mean", f"{percent} interval", f"next assembly, {percent}", "fits", "unit")]
        spreads = [("parameter", "factor", "levels", "spread", f"{percent} interval", "p", "unit")]
        trends = [("parameter", "factor", "change", f"{percent} interval", "p", "unit")]
        for one in self.parameters.values():
            factor, unit, by = (
                (100.0, "%", "exponent") if one.scale == "log" else (1.0, one.unit, f"{one.unit} by unit")
            )
            means.append((one.name, f"{one.mean.value:.5g}", _limits(one.mean), _limits(one.next_one),
                          str(len(one.labels)), one.unit))  # fmt: skip
            for own in one.spreads:
                scaled = Estimate(factor * own.value, factor * own.low, factor * own.high)
                spreads.append((one.name, own.factor, str(own.levels), f"{scaled.value:.3g}", _limits(scaled),
                                shown_chance(own.p_value), unit))  # fmt: skip
            for slope in one.trends:
                limits = f"{slope.low:.3g} .. {slope.high:.3g}"
                trends.append((one.name, slope.factor, f"{slope.value:.3g}", limits, shown_chance(slope.p_value), by))
        first, *others = [columns_of(table) for table in (means, spreads, trends) if table[1:]] or [[]]
        places = [f"{', '.join(names)}: mean and next assembly at {where}" for where, names in self.places.items()]
        said = [str(one) for one in self.findings]
        parts = ([f"{len(self.labels)} fits"], first, places, *others, said)
        return "\n\n".join("\n".join(lines) for lines in parts if lines)

    @property
    def places(self) -> dict[str, list[str]]:
        """Return names of parameters by the numbers of the trends to which mean and next assembly belong."""
        found = dict[str, list[str]]()
        for one in self.parameters.values():
            if one.at:
                found.setdefault(place_of(one), []).append(one.name)
        return found


def place_of(one: PooledParameter) -> str:
    """Return the numbers of the trends to which mean and next assembly of a parameter belong."""
    kind = " (geometric mean)" if one.scale == "log" else " (mean)"
    return ", ".join(f"{name} {number:.4g}{kind}" for name, number in one.at.items())


def _limits(one: Estimate) -> str:
    return f"{one.low:.4g} .. {one.high:.4g}"


def pool(
    fits: Sequence[Fit],
    *,
    labels: Sequence[str] | None = None,
    factors: Factors | None = None,
    trends: Iterable[str] = (),
    common: Mapping[str, float] | float = 0.0,
    parameters: Sequence[str] | None = None,
    probability: float = 0.95,
) -> PooledFits:
    """Pool fits of the same joint, and return mean, spread between assemblies and prediction interval.

    Parameters
    ----------
    fits : sequence of Fit, at least 2
        Fits of several assemblies, torques, days or specimens; `load` reads them from files.
    labels : sequence of str, optional
        Names of the fits, default "1", "2", ...
    factors : mapping of str to sequence, optional
        Group of each fit, by factor ("assembly", "torque", "day", "operator"). Fits of one "assembly" are repeats,
        whose spread is "repeat". Without the factor "assembly" each fit is a separate assembly.
    trends : iterable of str
        Names of factors whose numbers act as a trend (on a logarithmic scale a power law), such as the torque; default
        none.
    common : float or mapping of str to float
        Relative standard error that all fits share, such as the error of one calibration, default 0. It is not averaged
        away. By name of a factor: an error that fits of the same group share.
    parameters : sequence of str, optional
        Names of parameters, loss factors ``"eta_y"`` included, default all parameters of the joint.
    probability : float
        Coverage probability of the intervals, default 0.95.

    Returns
    -------
    PooledFits
        Mean, spreads, trends and prediction interval of each parameter.

    Raises
    ------
    ValueError
        Fewer than two fits, or too few for the trends; a factor with a wrong number of groups, with one group only, or
        equal to another factor. A name that no fit has, or a common error below zero.
    TypeError
        An element of `fits` is no fit.

    See Also
    --------
    transfer : test of one joint in different structures.
    assemblies_needed : number of assemblies for a wanted interval.
    write_pool : page of pooled fits.

    Notes
    -----
    The model is y = mean + trends + random effects of the factors + error, with the error variance of each fit. It is a
    model of logarithms if all fits are more than two standard errors above zero. Spreads are estimated by REML.
    Intervals come from the confidence distribution of the variances [1]_. They are valid for three assemblies as for
    thirty. If the spread is small compared with the errors of the fits, they are too wide rather than too narrow.
    Parameters are pooled one by one.

    References
    ----------
    .. [1] H. Iyer, C. Wang, T. Mathew, JASA 99 (2004) 1060.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    >>> fits = []
    >>> for seed, k in enumerate([2000.0, 2250.0, 1850.0, 2100.0]):  # four assemblies of one joint
    ...     joint = jf.Joint([k], [3.0], ["x"])
    ...     h = jf.couple(a, b, joint.dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]
    ...     fits.append(jf.identify(freq, jf.pollute(h, 0.02, seed=seed), ["x"], damping="viscous"))
    >>> k = jf.pool(fits).parameters["k_x"]
    >>> print(f"{k.mean.value:.0f} N/m, spread {100 * k.spreads[0].value:.0f} %")
    2045 N/m, spread 8 %
    >>> print(f"the next assembly: {k.next_one.low:.0f} to {k.next_one.high:.0f} N/m")
    the next assembly: 1521 to 2750 N/m
    """
    probability = as_probability("probability", probability)
    chosen = None if parameters is None else as_names("parameters", parameters)
    listed = as_fits("a pool", fits)
    plan = _plan(as_labels(labels, len(listed)), factors, as_names("trends", trends), common, probability)
    each = [_estimates(fit) for fit in listed]
    units = {name: own[0] for found in each for name, own in found.items()}
    for name in chosen or ():
        if name not in units:
            raise ValueError(
                f"unknown parameter {one_line(name)}; use one of {some_of(list(units), 12)}{did_you_mean(name, units)}"
            )
    pooled = dict[str, PooledParameter]()
    findings = [one for label, fit in zip(plan.labels, listed, strict=True) for one in _of_data(label, fit)]
    for name in units if chosen is None else dict.fromkeys(chosen):
        found = [own[name][1] if name in own else None for own in each]
        parameter, own_findings = pooled_parameter(name, units[name], found, plan)
        findings += own_findings
        if parameter is not None:
            pooled[name] = parameter
    return PooledFits(plan.labels, pooled, probability, worst_first(findings))


def _of_data(label: str, fit: Fit) -> list[Finding]:
    """Return errors and warnings about the FRFs of a fit, with its name."""
    return [replace(one, test=label) for one in fit.findings if one.code in DATA_MESSAGES and one.severity != "note"]


def _estimates(fit: Fit) -> dict[str, tuple[str, Estimate]]:
    """Return unit and estimate of each parameter of the joint, and of its loss factors."""
    limits = fit.confidence_interval(0.95)
    own = [one for one in fit.parameters if one.origin == "joint"]
    found = {one.name: (one.unit, Estimate(fit.value[one.name], *limits[one.name])) for one in own}
    return found | {name: ("1", Estimate(eta.value, eta.low, eta.high)) for name, eta in fit.loss_factors.items()}


def as_fits(what: str, fits: object) -> list[Fit]:
    """Return at least two fits as a list, or raise an error."""
    if not isinstance(fits, Iterable) or isinstance(fits, str):
        raise TypeError(f"fits is {one_line(fits)}; give a sequence of Fit")
    listed = list(fits)
    for fit in listed:
        check_type("fits", fit, Fit)
    if len(listed) < 2:
        raise ValueError(f"{len(listed)} fits are too few for {what}; give at least two")
    return listed


def as_labels(labels: object, count: int) -> tuple[str, ...]:
    """Return different names of the fits, default "1", "2", ..."""
    names = tuple(map(str, range(1, count + 1))) if labels is None else as_names("labels", labels)
    if len(set(names)) != count or len(names) != count:
        raise ValueError(f"wrong labels; give {count} different names, one for each fit")
    return names


def _plan(
    labels: tuple[str, ...],
    factors: Factors | None,
    trends: tuple[str, ...],
    common: Mapping[str, float] | float,
    probability: float,
) -> TestPlan:
    """Check labels, factors and common errors of the fits."""
    count = len(labels)
    factors = {} if factors is None else factors
    check_type("factors", factors, Mapping)
    by_factor = common if isinstance(common, Mapping) else {}
    for name in (*trends, *by_factor):
        if name not in factors:
            raise ValueError(f"unknown factor {one_line(name)}; add it to the factors{did_you_mean(name, factors)}")
    codes = {name: _codes(name, own, count) for name, own in factors.items()}
    shared = [(codes[name], as_number("common", own)) for name, own in by_factor.items()]
    if not isinstance(common, Mapping):
        shared.append((np.zeros(count, dtype=np.intp), as_number("common", common)))
    if any(not 0 <= own < math.inf for _, own in shared):
        raise ValueError("common is negative or not finite; give a relative standard error of zero or more")
    numbers = {name: _numbers(name, factors[name]) for name in trends}
    groups = _random_factors({name: own for name, own in codes.items() if name not in trends}, count)
    return TestPlan(labels, groups, numbers, shared, probability)


def _codes(name: str, own: Sequence[str | float], count: int) -> NDArray[np.intp]:
    """Return the number of the group of each fit."""
    if not isinstance(own, Sequence | np.ndarray) or isinstance(own, str):
        raise TypeError(f"factor {one_line(name)} is {one_line(own)}; give a sequence of groups")
    if len(own) != count:
        raise ValueError(f"factor {one_line(name)} has {len(own)} groups; give {count}, one for each fit")
    found: NDArray[np.intp] = np.unique([str(one) for one in own], return_inverse=True)[1]
    if found.max() == 0:
        raise ValueError(f"factor {one_line(name)} is the same for all fits; leave it out")
    return found


def _numbers(name: str, own: Sequence[str | float]) -> FloatArray:
    try:
        found = np.array([float(one) for one in own])
    except (TypeError, ValueError):
        raise ValueError(
            f"the trend over {one_line(name)} has groups that are no numbers; give numbers such as 12.5"
        ) from None
    if not np.isfinite(found).all():
        raise ValueError(f"the trend over {one_line(name)} has infinite numbers or NaN; give finite numbers")
    return found


def _random_factors(codes: Mapping[str, NDArray[np.intp]], count: int) -> dict[str, NDArray[np.intp]]:
    """Return random factors, finest first, or raise ValueError if two of them are equal."""
    seen: dict[tuple[int, ...], str] = {}
    for name, own in codes.items():
        if own.max() + 1 == count and name != ASSEMBLY:
            raise ValueError(
                f"factor {one_line(name)} has a different group for each fit, as the assemblies do; leave it out, or "
                "make it a trend"
            )
        first: dict[int, int] = {}
        pattern = tuple(first.setdefault(code, len(first)) for code in own.tolist())
        if pattern in seen:
            raise ValueError(
                f"factors {one_line(seen[pattern])} and {one_line(name)} have the same groups; leave out one"
            )
        seen[pattern] = name
    kept = {name: own for name, own in codes.items() if own.max() + 1 < count}
    return dict(sorted(kept.items(), key=lambda item: -int(item[1].max())))
