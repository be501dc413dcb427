"""A spring with viscous damping, hysteretic damping, both, or none."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cache
from typing import Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_number, check_choice
from jointfrf.laws.law import JointLaw, LawField, checked_values

__all__ = ["SpringDamping", "SpringLaw"]

SpringDamping = Literal["none", "viscous", "hysteretic", "both"]


@cache
def _fields(damping: SpringDamping, is_cross: bool) -> tuple[LawField, ...]:
    found = [LawField("k", "stiffness", -np.inf if is_cross else 0.0)]
    if damping in ("hysteretic", "both"):
        found.append(LawField("h", "stiffness"))
    if damping in ("viscous", "both"):
        found.append(LawField("c", "damping"))
    return tuple(found)


@dataclass(frozen=True)
class SpringLaw(JointLaw):
    """Spring with dampers, K*(w) = k + i h + i w c (2.11).

    Parameters
    ----------
    k : float
        Stiffness, N/m (between a displacement and a rotation N, between rotations N m/rad).
    c : float
        Viscous damping, N s/m.
    h : float
        Hysteretic damping, loss factor times stiffness, N/m.
    damping : {"none", "viscous", "hysteretic", "both"}, optional
        Which dampings are parameters; by default those that are not zero, and viscous where both are.
    is_cross : bool
        Whether it couples two DOFs: k may then be negative.

    Raises
    ------
    ValueError
        A negative stiffness of one DOF, damping that `damping` leaves out, NaN or Inf.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> law = jf.SpringLaw(6e5, c=20.0)
    >>> [field.name for field in law.fields], law.stiffness(np.array([100.0])).tolist()
    (['k', 'c'], [(600000+2000j)])
    """

    k: float
    c: float = 0.0
    h: float = 0.0
    damping: SpringDamping | None = None
    is_cross: bool = False

    def __post_init__(self) -> None:
        for name in ("k", "c", "h"):
            object.__setattr__(self, name, as_number(name, getattr(self, name)))
        if self.damping is None:
            found: SpringDamping = ("hysteretic" if self.c == 0 else "both") if self.h != 0 else "viscous"
            object.__setattr__(self, "damping", found)
        check_choice("damping", self.damping, get_args(SpringDamping))
        shown = {field.name for field in self.fields}
        for name in ("c", "h"):
            if name not in shown and getattr(self, name) != 0:
                raise ValueError(f"{name} is {getattr(self, name):g}, but damping is {self.damping!r}")
        checked_values("a spring", self.fields, self.values)

    @property
    def fields(self) -> tuple[LawField, ...]:
        """k, then h, then c, as far as they are parameters."""
        assert self.damping is not None
        return _fields(self.damping, self.is_cross)

    @property
    def values(self) -> FloatArray:
        """Values of the parameters, shape (p,)."""
        return np.array([getattr(self, field.name) for field in self.fields])

    def with_values(self, values: ArrayLike) -> Self:
        """Return the same law with other values."""
        found = checked_values("a spring", self.fields, values)
        other = copy(self)
        for field, value in zip(self.fields, found.tolist(), strict=True):
            object.__setattr__(other, field.name, value)
        return other

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return k + i h + i w c, shape (n_freq,)."""
        return np.asarray(self.k + 1j * self.h + 1j * omega * self.c, np.complex128)

    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return 1, i, i w, shape (p, n_freq)."""
        by_name = {"k": np.ones_like(omega) + 0j, "h": 1j * np.ones_like(omega), "c": 1j * omega}
        return np.array([by_name[field.name] for field in self.fields])

    @property
    def constant_terms(self) -> tuple[float, float, float] | None:
        """(k, c, h)."""
        return self.k, self.c, self.h
