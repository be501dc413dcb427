"""All parameters of a fit in one vector, and the coordinates of the search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import parameter_name
from jointfrf.kernel.arguments import TINY, FloatArray
from jointfrf.laws.law_joint import JointQuantity, LawJoint
from jointfrf.laws.springs import SpringLaw

__all__ = [
    "CommonMean",
    "ErrorOrigin",
    "FitParameter",
    "ParameterOrigin",
    "ParameterVector",
    "joint_vector",
    "with_dampers",
]

#: Unnamed errors of models and gains: modal matrices and mode shapes of a part; gain of a response, of a force, of all
#: FRFs.
ErrorOrigin = Literal["error", "shape-error", "response-error", "force-error", "common-error"]
#: Owner of a parameter; "mean" is the mean of several joints.
ParameterOrigin = Literal["joint", "mean", "part", "attachment", "response", "force"] | ErrorOrigin


#: Ratio to the stiffness of the substructures at the joint within which its stiffnesses are sought; also the ratio to
#: the nominal value for other logarithms without a bound.
_WIDEST = 1e6
#: Longest step of a logarithm, or of a parameter in standard deviations of its prior; also of the first step of a
#: profile.
_LONGEST, _LONGEST_REACH = 1.0, 1.5


#: Standard deviation of the prior of a loss factor: joints hardly reach 1.
_LARGEST_LOSS = 1.0
#: Loss factor of the first change of damping that starts at zero; for a damper at this angular frequency, rad/s.
_FIRST_LOSS, _FIRST_OMEGA = 0.01, 1000.0


class FitParameter(NamedTuple):
    """One parameter of a fit.

    Attributes
    ----------
    name, unit : str
        Name and unit.
    origin : str
        Owner: joint, part, attachment, response or force.
    place : tuple
        Place in its owner:

        - number in the joint
        - number of the attachment and of the quantity
        - names of the part and of the unknown
        - number of a channel
    value : float
        Initial value, and mean of the prior.
    std : float or None
        Standard deviation of the prior.
    lower, upper : float
        Bounds.
    is_log : bool
        Whether the coordinate is the logarithm.
    is_free : bool
        Whether it is fitted.
    like : int or None
        Place of the equal parameter in the vector of all.
    damps : int or None
        Place of the stiffness that the prior of a hysteretic damping is relative to, in the vector of all.
    size : float
        Unit of the coordinate of a parameter that starts at zero without a prior.
    """

    name: str
    unit: str
    origin: ParameterOrigin
    place: tuple[int | str, ...]
    value: float
    std: float | None
    lower: float
    upper: float
    is_log: bool
    is_free: bool
    like: int | None = None
    damps: int | None = None
    size: float = 1.0

    @property
    def is_error(self) -> bool:
        """Whether it is an error of a model or of a gain, without a name for the user."""
        return self.origin in get_args(ErrorOrigin)


class CommonMean(NamedTuple):
    """A parameter of several joints whose values scatter about a common mean.

    Attributes
    ----------
    mean : int
        Place of the mean among all parameters.
    members : tuple of int
        Places of the parameters.
    std : float
        Standard deviation of the members, or of their logarithms if these are the coordinates.
    relative : float or None
        Given spread: `std`, or its ratio to the mean; None if no spread was given.
    """

    mean: int
    members: tuple[int, ...]
    std: float
    relative: float | None


@dataclass(frozen=True)
class ParameterVector:
    """Parameters of a fit; vectors contain the values of all, coordinates only the free ones.

    Attributes
    ----------
    all : tuple of FitParameter
        All parameters.
    means : tuple of CommonMean
        Priors that several parameters share.
    """

    all: tuple[FitParameter, ...]
    means: tuple[CommonMean, ...] = ()

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Places of the free parameters among all."""
        return np.array([i for i, one in enumerate(self.all) if one.is_free], np.intp)

    @property
    def fitted(self) -> tuple[FitParameter, ...]:
        """The free parameters."""
        return tuple(self.all[i] for i in self.free)

    @cached_property
    def n_shown(self) -> int:
        """Number of free parameters without errors of the models, which come last."""
        return sum(not one.is_error for one in self.fitted)

    @cached_property
    def values(self) -> FloatArray:
        """Initial values of all parameters."""
        return np.array([one.value for one in self.all])

    @cached_property
    def is_log(self) -> NDArray[np.bool_]:
        """Which free parameters have a logarithm as coordinate."""
        return np.array([one.is_log for one in self.fitted], bool)

    @cached_property
    def scale(self) -> FloatArray:
        """Unit of the coordinate of each free parameter without a logarithm."""
        return np.array([one.std or abs(one.value) or one.size for one in self.fitted])

    def to_coordinates(self, values: FloatArray) -> FloatArray:
        """Return the coordinates of values of all."""
        own = values[self.free]
        with np.errstate(divide="ignore", invalid="ignore"):
            logs = np.log(np.where(self.is_log, own, 1))
        return np.asarray(np.clip(np.where(self.is_log, logs, own / self.scale), *self.bounds))

    def to_values(self, x: FloatArray) -> FloatArray:
        """Return the values of all from coordinates."""
        values = self.values.copy()
        values[self.free] = self._own(x)
        values[self._alike[0]] = values[self._alike[1]]
        return values

    @cached_property
    def _alike(self) -> tuple[list[int], list[int]]:
        """Places of the parameters that equal another one, and the places of these."""
        own = [(i, one.like) for i, one in enumerate(self.all) if one.like is not None]
        return [i for i, _ in own], [like for _, like in own]

    def with_means(self, values: FloatArray, *, at_mean: bool = False) -> FloatArray:
        """Return values of all with the means of their members; with `at_mean`, also the members at their mean."""
        found = values.copy()
        for one in self.means:
            own, members = self.all[one.mean], values[list(one.members)]
            found[one.mean] = np.exp(np.log(members).mean()) if own.is_log else members.mean()
            if at_mean:
                found[list(one.members)] = found[one.mean] = members[0]
        return found

    def _own(self, x: FloatArray) -> FloatArray:
        logs = np.where(self.is_log, np.minimum(np.maximum(x, self.bounds[0]), self.bounds[1]), 0)
        found: FloatArray = np.where(self.is_log, np.exp(logs), x * self.scale)
        return np.asarray(np.minimum(np.maximum(found, self.limits[0]), self.limits[1]))

    def slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the free values by their coordinates."""
        found: FloatArray = np.where(self.is_log, self._own(x), self.scale)
        return found

    @cached_property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest values of the free parameters."""
        return np.array([one.lower for one in self.fitted]), np.array([one.upper for one in self.fitted])

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest coordinates; finite for logarithms."""
        value = np.where(self.is_log, self.values[self.free], 1)
        lower, upper = (np.where(self.is_log, limit, 1) for limit in self.limits)
        lower, upper = np.where(lower > 0, lower, value / _WIDEST), np.where(upper < np.inf, upper, value * _WIDEST)
        logs, linear = (np.log(lower), np.log(upper)), [limit / self.scale for limit in self.limits]
        return np.where(self.is_log, logs[0], linear[0]), np.where(self.is_log, logs[1], linear[1])

    def longest(self, x: FloatArray) -> FloatArray:
        """Return the largest steps of a minimiser: damping is unbounded, but not a step of it."""
        of_prior = np.minimum(self.scale / np.where(self.is_log, self.values[self.free], self.scale), 1)
        return _LONGEST * np.where(self.has_prior, of_prior, np.where(self.is_log, 1, np.maximum(abs(x), 1)))

    def value(self, i: int, x: FloatArray) -> float:
        """Return the value of one of the free parameters."""
        return float(self._own(x)[i])

    def end(self, i: int, sign: int) -> float:
        """Return the limit of a free parameter without a bound below (-1) or above (1)."""
        if self.is_log[i] and self.fitted[i].origin in ("joint", "mean"):  # their bounds are the limits of the search
            return np.inf if sign > 0 else 0.0
        return float(self.limits[sign > 0][i])

    def longest_reach(self, i: int) -> float:
        """Return the largest distance from a minimum for the first search of a limit."""
        return _LONGEST_REACH if self.is_log[i] else np.inf

    @cached_property
    def has_prior(self) -> NDArray[np.bool_]:
        """Which free parameters have a prior."""
        return np.array([one.std is not None for one in self.fitted], bool)

    @cached_property
    def _std(self) -> FloatArray:
        """Standard deviations of the priors of the free parameters, inf without a prior."""
        return np.array([one.std or np.inf for one in self.fitted])

    @cached_property
    def _shared(self) -> FloatArray:
        """Coordinates of members minus the coordinate of their mean, over their standard deviation, as a matrix."""
        rows, place = [], {int(i): at for at, i in enumerate(self.free)}
        for one in self.means:
            for member in one.members:
                row = np.zeros(self.free.size)
                for i, sign in ((member, 1), (one.mean, -1)):
                    row[place[i]] = sign * (1.0 if self.all[i].is_log else self.scale[place[i]]) / one.std
                rows.append(row)
        return np.array(rows).reshape(-1, self.free.size)

    @cached_property
    def _dampers(self) -> tuple[NDArray[np.intp], NDArray[np.intp], list[int]]:
        """Places of dampings h and of their stiffnesses (-1 if fixed) among the free, and of these among all."""
        place = {int(i): at for at, i in enumerate(self.free)}
        own = [(at, one.damps) for at, one in enumerate(self.fitted) if one.damps is not None]
        of = [place.get(damps, -1) for _, damps in own if damps is not None]
        return np.array([at for at, _ in own], np.intp), np.array(of, np.intp), [k for _, k in own if k is not None]

    def pulls(self, x: FloatArray) -> FloatArray:
        """Return the distance of each free value from its prior in standard deviations, 0 without one; then members."""
        own = self._own(x)
        found = (own - self.values[self.free]) / self._std
        at, _, places = self._dampers
        if at.size:
            found[at] = own[at] / np.maximum(self.to_values(x)[places], TINY) / _LARGEST_LOSS
        return np.concatenate([found, self._shared @ x])

    def pull_slopes(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the pulls by the coordinates, one row each."""
        slope = self.slope(x)
        found = np.diag(slope / self._std)
        at, of, places = self._dampers
        stiffness = np.maximum(self.to_values(x)[places], TINY)
        found[at, at] = slope[at] / stiffness / _LARGEST_LOSS
        free = of >= 0
        found[at[free], of[free]] = -(self._own(x)[at] / stiffness**2 / _LARGEST_LOSS)[free] * slope[of[free]]
        return np.concatenate([found, self._shared])

    def prior_information(self, x: FloatArray) -> FloatArray:
        """Return the information of all priors on the coordinates, shape (p, p)."""
        slopes = self.pull_slopes(x)
        return np.asarray(slopes.T @ slopes)

    def places_of(self, origin: ParameterOrigin) -> list[int]:
        """Return the places, among all, of the parameters of an origin."""
        return self._places.get(origin, [])

    @cached_property
    def _places(self) -> dict[ParameterOrigin, list[int]]:
        found: dict[ParameterOrigin, list[int]] = {}
        for i, one in enumerate(self.all):
            found.setdefault(one.origin, []).append(i)
        return found

    def of_joint(self) -> ParameterVector:
        """Return the vector in which only the parameters of the joint are free."""
        return ParameterVector(tuple(one._replace(is_free=one.is_free and one.origin == "joint") for one in self.all))

    def of_equal_joints(self) -> ParameterVector | None:
        """Return the vector with equal parameters for all joints of the same laws; None if there are no such joints."""
        first: dict[str, int] = {}
        found, is_new = list(self.all), False
        for i, one in enumerate(self.all):
            if one.origin == "joint" and one.is_free:
                like = first.setdefault(one.name.rpartition(".")[2], i)
                if like != i:
                    found[i], is_new = one._replace(is_free=False, like=like), True
            elif one.like is not None and found[one.like].like is not None:
                found[i] = one._replace(like=found[one.like].like)
            elif one.origin == "mean":
                found[i] = one._replace(is_free=False)
        return ParameterVector(tuple(found)) if is_new else None

    def places_of_part(self, name: str, origin: ParameterOrigin = "part") -> list[int]:
        """Return the places, among all, of the unknowns or the errors of a part."""
        return [i for i in self.places_of(origin) if self.all[i].place[0] == name]


def with_dampers(parameters: Sequence[FitParameter], joint: LawJoint) -> list[FitParameter]:
    """Return parameters of a joint whose springs supply no energy: damping of one DOF is at least 0.

    Hysteretic damping has a prior relative to the stiffness, because FRFs far from a joint hardly restrict a loss
    factor above 1.
    """
    found, at = list(parameters), {one.name: i for i, one in enumerate(parameters)}
    for i, one in enumerate(joint.quantities):
        name, own = one.field.name, found[i]
        if one.field not in SpringLaw.parameters[1:] or "," in one.name or one.value < 0:
            continue
        point, _, own_name = one.name.rpartition(f"{name}_")
        stiffness = at[f"{point}k_{own_name}"]
        size = _FIRST_LOSS * (parameters[stiffness].value or 1.0) / (1.0 if name == "h" else _FIRST_OMEGA)
        found[i] = own._replace(lower=0.0, size=size, damps=stiffness if name == "h" else None)
    return found


def joint_vector(joint: LawJoint, fixed: Sequence[str], joint_stiffness: FloatArray) -> ParameterVector:
    """Return the parameters of a joint as a vector.

    Parameters
    ----------
    joint : LawJoint
        Joint to fit.
    fixed : sequence of str
        Names of parameters that keep their value.
    joint_stiffness : ndarray
        Stiffness of the substructures at the joint, N/m or N m/rad; see `parameter_vector`.
    """
    names = joint.names
    for name in fixed:
        if name not in names:
            raise ValueError(f"unknown parameter {name!r} in fixed; use one of {', '.join(names)}")
    size = dict(zip(joint.dofs, joint_stiffness.tolist(), strict=True))
    return ParameterVector(
        tuple(_of_joint(one, i, one.name not in fixed, size) for i, one in enumerate(joint.quantities))
    )


def _of_joint(one: JointQuantity, place: int, is_free: bool, size: Mapping[str, float]) -> FitParameter:
    """Return a parameter of the joint; the coordinate of a positive stiffness or time is its logarithm."""
    kind, lower, upper = one.field.kind, one.field.lower, one.field.upper
    is_log = kind in ("stiffness", "time") and lower >= 0
    if is_log and kind == "stiffness":
        own = (value for dof, value in size.items() if one.name == parameter_name(one.field.name, dof, dof))
        known = next(own, one.value)
        lower, upper = max(lower, min(known, one.value or known) / _WIDEST), min(upper, max(known, one.value) * _WIDEST)
    if is_log and kind == "time":
        upper = min(upper, max(1e3, 10 * one.value))
    value = float(np.clip(one.value, lower, upper))
    return FitParameter(one.name, one.unit, "joint", (place,), value, None, lower, upper, is_log, is_free)
