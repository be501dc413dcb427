"""A spring with viscous damping, hysteretic damping, both, or none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, Self, get_args

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray, check_choice
from jointfrf.laws.law import JointLaw, LawField

__all__ = ["SpringLaw"]

SpringDamping = Literal["none", "viscous", "hysteretic", "both"]


@dataclass(frozen=True)
class SpringLaw(JointLaw):
    """Spring with dampers, K*(w) = k + i h + i w c (2.11).

    Parameters
    ----------
    k : float
        Stiffness, N/m (between a displacement and a rotation N, between rotations N m/rad).
    c : float
        Viscous damping, N s/m, default 0.
    h : float
        Hysteretic damping, loss factor times stiffness, N/m, default 0.
    damping : {"none", "viscous", "hysteretic", "both"}, optional
        Damping terms that are parameters; by default those that are not zero, and viscous damping if both are zero.
    is_cross : bool
        Whether it couples two DOFs, so that k may be negative; default False.

    Raises
    ------
    ValueError
        A negative stiffness of one DOF, damping that `damping` omits, NaN or Inf.

    See Also
    --------
    LawJoint : joint of laws.
    StandardLinearSolid, FractionalZener, PowerLaw : laws that depend on frequency.

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

    word = "spring"
    parameters = (
        LawField("k", "stiffness", 0.0, meaning="Stiffness, at rest; of a cross term of any sign."),
        LawField("h", "stiffness", meaning="Hysteretic damping."),
        LawField("c", "damping", meaning="Viscous damping."),
    )
    optional = ("h", "c")

    def __post_init__(self) -> None:
        self._convert()
        if self.damping is None:
            found: SpringDamping = ("hysteretic" if self.c == 0 else "both") if self.h != 0 else "viscous"
            object.__setattr__(self, "damping", found)
        check_choice("damping", self.damping, get_args(SpringDamping))
        super().__post_init__()
        for name in {"c", "h"}.difference(field.name for field in self.fields):
            if getattr(self, name) != 0:
                raise ValueError(f"{name} is {getattr(self, name):g}, but damping is {self.damping!r}")

    @property
    def fields(self) -> tuple[LawField, ...]:
        """Parameters among k, h and c, in this order."""
        assert self.damping is not None
        return _fields(self.damping, self.is_cross)

    @classmethod
    def from_numbers(cls, numbers: Mapping[str, Any], *, is_cross: bool) -> Self:
        """Return the spring of a file, with the damping that it names; `is_cross`: it couples two DOFs."""
        named: dict[tuple[bool, bool], SpringDamping] = {(True, True): "both", (True, False): "hysteretic"}
        damping = named.get(("h" in numbers, "c" in numbers), "viscous")
        return cls(**numbers, damping=damping, is_cross=is_cross)

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return k + i h + i w c, shape (n_freq,)."""
        return np.asarray(self.k + 1j * self.h + 1j * omega * self.c, np.complex128)

    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return 1, i, i w, shape (p, n_freq)."""
        by_name = {"k": np.ones_like(omega) + 0j, "h": 1j * np.ones_like(omega), "c": 1j * omega}
        return np.array([by_name[field.name] for field in self.fields])

    @property
    def constant_terms(self) -> tuple[float, float, float] | None:
        """Return (k, c, h)."""
        return self.k, self.c, self.h


@cache
def _fields(damping: SpringDamping, is_cross: bool) -> tuple[LawField, ...]:
    k, h, c = SpringLaw.parameters
    found = [k._replace(lower=-np.inf) if is_cross else k]
    found += [h] if damping in ("hysteretic", "both") else []
    return (*found, c) if damping in ("viscous", "both") else tuple(found)
