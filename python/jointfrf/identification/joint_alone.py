"""Correction of a fit between virtual points of flexible sides to the joint alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from jointfrf.dofs import parameter_name
from jointfrf.identification.manifold.flexible_sides import JointAlone
from jointfrf.identification.profile import Intervals
from jointfrf.identification.result import Fit, SeenStiffness
from jointfrf.kernel.arguments import FloatArray

__all__ = ["with_joint_alone"]

#: Standard deviations of the 95 % intervals in `JointAlone`.
_REACH = 1.96


def with_joint_alone(fit: Fit, alone: JointAlone) -> Fit:
    """Return a fit of the stiffnesses of the joint alone, with the stiffnesses between virtual points in `seen`.

    Parameters
    ----------
    fit : Fit
        Fit of springs and dampers between the virtual points.
    alone : JointAlone
        Stiffnesses of the joint without the sides.

    Notes
    -----
    Flexible sides add a real compliance D0. K* keeps its imaginary compliance, so that damping is proportional to the
    square of the stiffness. Cross terms are proportional to the roots of both stiffnesses, which keeps K positive.
    """
    of_dof = {dof: d for d, dof in enumerate(fit.dofs)}
    places = [(of_dof[one.row], of_dof[one.column]) for one in fit.parameters]
    seen = _diagonal_of_inverse(fit)
    root = np.sqrt(np.where((seen > 0) & (alone.best > 0), seen / np.maximum(alone.best, 1e-300), 1.0))
    powers = np.array([1.0 if one.kind == "k" else 2.0 for one in fit.parameters])
    factor = np.array([root[a] * root[b] for a, b in places]) ** powers
    estimate = fit.estimate * factor
    names, own = [one.name for one in fit.parameters], _Intervals(fit, alone, estimate, factor, powers, places)
    intervals = Intervals(names, lambda i, probability: own(probability)[names[i]], own.of_function)
    limits = intervals(0.95)
    errors = np.array([
        _error(one.kind == "k" and not one.is_cross, value, *limits[one.name], error * own)
        for one, value, error, own in zip(fit.parameters, estimate, fit.std_error.values(), factor, strict=True)
    ])  # fmt: skip
    return replace(
        fit,
        estimate=estimate,
        covariance=fit.correlation * np.outer(errors, errors),
        intervals=intervals,
        seen=_between_points(fit, alone),
    )


def _diagonal_of_inverse(fit: Fit) -> FloatArray:
    """Return C_dd of the fitted joint."""
    try:
        found = np.diagonal(np.linalg.inv(fit.stiffness_matrix))
    except np.linalg.LinAlgError:
        found = np.full(len(fit.dofs), np.nan)
    return np.asarray(np.where(found > 0, found, 1 / fit.stiffness))


def _error(is_stiffness: bool, value: float, low: float, high: float, otherwise: float) -> float:
    """Return the standard error equivalent to a 95 % interval; for a stiffness by the interval of its compliance."""
    if is_stiffness and low > 0:
        return value**2 * (1 / low - 1 / high) / (2 * _REACH)
    return (high - low) / (2 * _REACH) if np.isfinite(low) and np.isfinite(high) else otherwise


def _between_points(fit: Fit, alone: JointAlone) -> dict[str, SeenStiffness]:
    """Return the stiffness of each DOF between virtual points, and the causes of a wide interval of the joint alone."""
    parts = np.array([np.hypot(alone.softer, alone.stiffer), alone.inertia, alone.noise]) ** 2
    shares = parts / np.maximum(parts.sum(axis=0), np.finfo(float).tiny)
    low, high = alone.seen - alone.reach, alone.seen + alone.reach
    found = {}
    for d, dof in enumerate(fit.dofs):
        name = parameter_name("k", dof, dof)
        if name not in fit.value:
            continue
        c, softest, stiffest = float(alone.seen[d]), float(high[d]), float(low[d])
        found[name] = SeenStiffness(
            1 / c if c > 0 else np.inf,
            1 / softest if softest > 0 else np.inf,
            1 / stiffest if stiffest > 0 else np.inf,
            *(float(share) for share in shares[:, d]),
        )
    return found


class _Intervals:
    """Intervals of the joint alone."""

    def __init__(
        self,
        fit: Fit,
        alone: JointAlone,
        estimate: FloatArray,
        factor: FloatArray,
        powers: FloatArray,
        places: list[tuple[int, int]],
    ) -> None:
        self.fit, self.alone, self.estimate, self.factor = fit, alone, estimate, factor
        self.powers, self.places = powers, places
        #: K_dd C_dd, 1 without cross terms.
        self.coupling = fit.stiffness * _diagonal_of_inverse(fit)

    def of_function(
        self, function: Callable[[FloatArray], float], used: NDArray[np.intp], probability: float
    ) -> tuple[float, float] | None:
        """Return the interval of a function: unbounded if a parameter is, else from the covariance."""
        limits = list(self(probability).values())
        return None if np.isfinite([limits[i] for i in used]).all() else (-np.inf, np.inf)

    def __call__(self, probability: float) -> dict[str, tuple[float, float]]:
        """Return the interval of every parameter."""
        wide = float(ndtri((1 + probability) / 2)) / _REACH
        alone = self.alone
        softest = alone.seen + wide * np.hypot(alone.softer, alone.reach)
        stiffest = np.maximum(alone.seen - wide * np.hypot(alone.stiffer, alone.reach), 0.0)
        with np.errstate(divide="ignore"):
            low = np.where(softest > 0, self.coupling / np.maximum(softest, 1e-300), 0.0)
            high = np.where(stiffest > 0, self.coupling / np.maximum(stiffest, 1e-300), np.inf)
        stiffness = self.coupling / alone.best
        as_seen = self.fit.confidence_interval(probability)
        found = {}
        for i, (one, (a, b)) in enumerate(zip(self.fit.parameters, self.places, strict=True)):
            if one.kind == "k" and a == b:
                found[one.name] = float(low[a]), float(high[a])
                continue
            ends = [np.sqrt(end[a] * end[b] / (stiffness[a] * stiffness[b])) ** self.powers[i] for end in (low, high)]
            own = [limit * self.factor[i] for limit in as_seen[one.name]]
            found[one.name] = _product(own, ends)
        return found


def _product(limits: list[float], factors: list[float]) -> tuple[float, float]:
    """Return the interval of a product of two numbers with intervals; unbounded if one of these is."""
    if not np.isfinite([*limits, *factors]).all():
        return -np.inf, np.inf
    ends = [limit * factor for limit in limits for factor in factors]
    return min(ends), max(ends)
