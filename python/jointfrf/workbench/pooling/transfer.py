"""Test whether one joint explains fits of two or more structures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from jointfrf.identification.result import Fit, columns_of
from jointfrf.kernel.arguments import FloatArray, as_names, as_number, one_line
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.pooling.pool import as_fits, as_labels

__all__ = ["Difference", "Transfer", "transfer"]


@dataclass(frozen=True)
class Difference:
    """Difference of one parameter of one structure from the common joint.

    Attributes
    ----------
    label, name : str
        Names of the fit and of the parameter.
    value : float
        Logarithm of the value over the common value.
    std_error : float
        Standard error of `value`.
    p_value : float
        Two-sided p-value of the difference.
    """

    label: str
    name: str
    value: float
    std_error: float
    p_value: float


@dataclass(frozen=True)
class Transfer:
    """Result of the test of one joint in several structures; `print` shows it.

    Attributes
    ----------
    statistic : float
        Weighted sum of squared differences from the common joint.
    degrees_of_freedom : int
        Degrees of freedom of the statistic.
    p_value : float
        p-value under the hypothesis that the joint is the same.
    common : dict of str to float
        Parameters of the common joint.
    differences : tuple of Difference
        Differences from the common joint, the largest in standard errors first.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float
    common: dict[str, float]
    differences: tuple[Difference, ...]

    def __str__(self) -> str:
        """Return the test and the differences."""
        verdict = "one joint explains all" if self.p_value >= 0.05 else "no one joint explains all"
        head = f"{verdict}: chi-squared {self.statistic:.3g} with {self.degrees_of_freedom} degrees of freedom"
        rows = [("fit", "parameter", "common", "difference", "std error", "p")]
        for one in self.differences:
            rows.append((one.label, one.name, f"{self.common[one.name]:.5g}", f"{100 * np.expm1(one.value):+.2g} %",
                         f"{100 * one.std_error:.2g} %", f"{one.p_value:.2g}"))  # fmt: skip
        return "\n".join([f"{head}, p = {self.p_value:.2g}", "", *columns_of(rows)])


def transfer(
    fits: Sequence[Fit],
    *,
    labels: Sequence[str] | None = None,
    parameters: Sequence[str] | None = None,
    spread: Mapping[str, float] | float = 0.0,
) -> Transfer:
    """Test whether one joint explains fits of different structures, and return the differences.

    Parameters
    ----------
    fits : sequence of Fit, at least 2
        Fits of the structures, one for each.
    labels : sequence of str, optional
        Names of the fits, default "1", "2", ...
    parameters : sequence of str, optional
        Names of parameters, default all parameters of the joint with a bounded interval above zero in every fit.
    spread : float or mapping of str to float
        Relative standard deviation of the joint between assemblies from `pool`, default 0. With a spread the test asks
        whether structures differ by more than assemblies.

    Returns
    -------
    Transfer
        Statistic, p-value and differences.

    Raises
    ------
    ValueError
        Fewer than two fits, or no common parameter; a name that some fit does not have, or has only as a bound; a
        spread below zero.
    TypeError
        An element of `fits` is no fit.

    See Also
    --------
    pool : mean and spread of one joint in several assemblies.

    Notes
    -----
    Let x_i be the logarithms of fit i and V_i their covariance. The common joint is
    x = (sum V_i^-1)^-1 sum V_i^-1 x_i. The statistic sum (x_i - x)^T V_i^-1 (x_i - x) is chi-squared with (n - 1) p
    degrees of freedom. Errors that the fits share are not differences: two fits of one calibration agree better than
    the p-value states.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq, joint = np.linspace(0.5, 10, 400), jf.Joint([2000.0], [3.0], ["x"])
    >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    >>> fits = []
    >>> for seed, mass in enumerate([3.0, 6.0]):  # the same joint on two masses
    ...     a = jf.chain([5, mass], [2500, 3500], [3, 4], ground="start").receptance(freq)
    ...     h = jf.couple(a, b, joint.dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]
    ...     fits.append(jf.identify(freq, jf.pollute(h, 0.02, seed=seed), ["x"], damping="viscous"))
    >>> jf.transfer(fits).p_value > 0.05
    True
    """
    listed = as_fits("a transfer", fits)
    shown = as_labels(labels, len(listed))
    names = _names(listed, None if parameters is None else as_names("parameters", parameters))
    given = spread if isinstance(spread, Mapping) else dict.fromkeys(names, spread)
    own = {name: as_number("spread", one) for name, one in given.items()}
    if any(not 0 <= one < np.inf for one in own.values()):
        raise ValueError("spread is negative or not finite; give a relative standard deviation of zero or more")
    more = np.diag([own.get(name, 0.0) ** 2 for name in names])
    values, covariances = zip(*(_logarithms(fit, names) for fit in listed), strict=True)
    return _compared(shown, names, np.array(values), np.array(covariances) + more)


def _names(fits: Sequence[Fit], parameters: Sequence[str] | None) -> tuple[str, ...]:
    """Return the parameters to be compared."""
    usable = []
    for fit in fits:
        limits = fit.confidence_interval(0.95)
        usable.append([one.name for one in fit.parameters if one.origin == "joint" and _is_usable(limits[one.name])])
    shared = [name for name in usable[0] if all(name in own for own in usable[1:])]
    for name in parameters or ():
        if name not in shared:
            raise ValueError(
                f"some fit has no {one_line(name)} with an interval above zero; use another{did_you_mean(name, shared)}"
            )
    chosen = tuple(shared if parameters is None else dict.fromkeys(parameters))
    if not chosen:
        raise ValueError("the fits share no joint parameter with an interval above zero; use other fits")
    return chosen


def _is_usable(limits: tuple[float, float]) -> bool:
    return 0 < limits[0] < limits[1] < np.inf


def _logarithms(fit: Fit, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Return logarithms of parameters, shape (p,), and their covariance."""
    at = [[one.name for one in fit.parameters].index(name) for name in names]
    value = fit.estimate[at]
    return np.log(value), fit.covariance[np.ix_(at, at)] / np.outer(value, value)


def _compared(labels: Sequence[str], names: Sequence[str], values: FloatArray, covariances: FloatArray) -> Transfer:
    weights = np.linalg.inv(covariances)
    of_common = np.linalg.inv(weights.sum(axis=0))
    common = of_common @ np.einsum("fpq,fq->p", weights, values)
    away = values - common
    statistic = float(np.einsum("fp,fpq,fq->", away, weights, away))
    dof = (len(labels) - 1) * len(names)
    errors = np.sqrt(np.diagonal(covariances - of_common, axis1=1, axis2=2))
    chances = 2 * norm.sf(np.abs(away) / errors)
    found = [
        Difference(label, name, float(away[i, j]), float(errors[i, j]), float(chances[i, j]))
        for i, label in enumerate(labels)
        for j, name in enumerate(names)
    ]
    ordered = tuple(sorted(found, key=lambda one: one.p_value))
    shared = dict(zip(names, np.exp(common).tolist(), strict=True))
    return Transfer(statistic, dof, float(chi2.sf(statistic, dof)), shared, ordered)
