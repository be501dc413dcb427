"""A law of a joint DOF: K*(w) from a few parameters, its derivatives, initial values for a fit, its form in files."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Mapping
from copy import copy
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.dofs import UNITS
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray, as_number, as_real, one_line

__all__ = ["JointLaw", "LawField"]

#: Kind of a number of a law; it sets the unit.
FieldKind = Literal["stiffness", "damping", "time", "number", "frequency"]

#: Least distance of an initial value of a fit from its bounds, as a share of the bound.
_INSIDE = 1e-6


class LawField(NamedTuple):
    """A parameter of a law, or another of its numbers.

    Attributes
    ----------
    name : str
        Name, such as ``"k"`` or ``"tau"``.
    kind : {"stiffness", "damping", "time", "number"}
        Kind: stiffnesses and dampings are factors in K*(w), times and numbers are not. Also "frequency" for a number
        that is no parameter of a fit.
    lower, upper : float
        Smallest and largest value.
    meaning : str
        Description for the reference of files.
    """

    name: str
    kind: FieldKind
    lower: float = -np.inf
    upper: float = np.inf
    meaning: str = ""

    def unit(self, rotations: int) -> str:
        """Return the unit between two DOFs of which 0, 1 or 2 are rotations."""
        if rotations not in (0, 1, 2):
            raise ValueError(f"rotations must be 0, 1 or 2, not {one_line(rotations)}")
        return UNITS[self.kind][rotations]

    @property
    def is_factor(self) -> bool:
        """Whether K*(w) is proportional to it if all other factors are zero."""
        return self.kind in ("stiffness", "damping")


class JointLaw(ABC):
    """K*(w) between one DOF of A and one of B, from a few parameters.

    A law computes K*(w) and its derivatives by its parameters. Laws do not change, `with_values` makes another one. A
    frozen dataclass declares the rest in class attributes; a law of another form defines `fields`, `values` and
    `with_values` itself.

    Attributes
    ----------
    word : str
        Name in files; empty if a file cannot contain the law.
    parameters : tuple of LawField
        Fields of the dataclass that are parameters of a fit.
    settings : tuple of LawField
        Further numbers of the law.
    optional : tuple of str
        Names of fields that a file may omit.
    """

    word: ClassVar[str] = ""
    parameters: ClassVar[tuple[LawField, ...]] = ()
    settings: ClassVar[tuple[LawField, ...]] = ()
    optional: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        self._convert()
        self.checked(self.values)

    def _convert(self) -> None:
        """Convert all numbers of a dataclass to floats."""
        for field in (*self.parameters, *self.settings):
            object.__setattr__(self, field.name, as_number(field.name, getattr(self, field.name)))

    @property
    def fields(self) -> tuple[LawField, ...]:
        """Parameters: names, kinds and bounds."""
        return self.parameters

    @property
    def values(self) -> FloatArray:
        """Values of the parameters, shape (p,)."""
        return np.array([getattr(self, field.name) for field in self.fields])

    def with_values(self, values: ArrayLike) -> Self:
        """Return the same law with other values of its parameters, shape (p,)."""
        found = self.checked(values)
        other = copy(self)
        for field, value in zip(self.fields, found.tolist(), strict=True):
            object.__setattr__(other, field.name, value)
        return other

    def checked(self, values: ArrayLike) -> FloatArray:
        """Return values of the parameters.

        Raises
        ------
        ValueError
            A wrong number of them, NaN or Inf, or a value outside its bounds.
        """
        found = as_real("values", values, (len(self.fields),))
        for field, value in zip(self.fields, found, strict=True):
            if not field.lower <= value <= field.upper:
                bounds = f"{field.lower:g} to {field.upper:g}"
                raise ValueError(f"{field.name} of {type(self).__name__} must lie in {bounds}, not {value:g}")
        return found

    @classmethod
    def from_numbers(cls, numbers: Mapping[str, Any], *, is_cross: bool) -> Self:
        """Return the law that a file describes; `is_cross`: it couples two DOFs."""
        return cls(**numbers)

    def numbers(self) -> dict[str, float]:
        """Return the numbers for `from_numbers`."""
        return {field.name: float(getattr(self, field.name)) for field in (*self.fields, *self.settings)}

    @abstractmethod
    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return K*(w) at angular frequencies in rad/s, shape (n_freq,), N/m."""

    @abstractmethod
    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return the derivatives of K*(w) by each parameter, shape (p, n_freq)."""

    @property
    def constant_terms(self) -> tuple[float, float, float] | None:
        """Return (k, c, h) if the law is K* = k + i h + i w c, else None."""
        return None

    def trial_numbers(self, omega: FloatArray) -> list[list[float]]:
        """Return initial values of a fit, a list for each field that is no factor, in their order."""
        low, high = float(omega.min()), float(omega.max())
        choices = []
        for field, value in zip(self.fields, self.values, strict=True):
            if field.kind == "time":
                choices.append(np.geomspace(0.1 / high, 10 / max(low, 1e-3 * high), 17).tolist())
            elif field.kind == "number":
                bounded = np.isfinite(field.lower) and np.isfinite(field.upper)
                share = np.array([0.2, 0.35, 0.5, 0.65, 0.8]) if bounded else np.zeros(0)
                choices.append([value, *(field.lower + share * (field.upper - field.lower)).tolist()])
        return choices

    def started(self, omega: FloatArray, k_lines: ComplexArray, weight: FloatArray | None = None) -> Self:
        """Return the law with initial values from K*(w) of single lines.

        Parameters
        ----------
        omega : ndarray, shape (n_freq,)
            Angular frequencies, rad/s.
        k_lines : ndarray, shape (n_freq,)
            Dynamic stiffness K*(w) of each line by itself, N/m; NaN does not count.
        weight : ndarray, shape (n_freq,), optional
            Inverse variance of each line; 1 by default.

        Notes
        -----
        Times and numbers are tried on a grid; factors follow by linear least squares, inside their bounds.
        """
        known = np.isfinite(k_lines)
        if not known.any():
            return self
        own_omega, target = omega[known], k_lines[known]
        root = np.ones(target.size) if weight is None else np.sqrt(weight[known])
        fields, best, least = self.fields, self, np.inf
        factors = [i for i, field in enumerate(fields) if field.is_factor]
        others = [i for i, field in enumerate(fields) if not field.is_factor]
        for numbers in itertools.product(*self.trial_numbers(own_omega)):
            values = np.zeros(len(fields))
            values[others] = numbers
            basis = np.array([self._unit_factor(values, i).stiffness(own_omega) for i in factors]).T * root[:, None]
            solved = _least_squares(basis, target * root)
            values[factors] = [
                _within(value, fields[i], float(np.median(abs(target))))
                for i, value in zip(factors, solved, strict=True)
            ]
            trial = self.with_values(values)
            misfit = float((abs((trial.stiffness(own_omega) - target) * root) ** 2).sum())
            if misfit < least:
                best, least = trial, misfit
        return best

    def _unit_factor(self, values: FloatArray, i: int) -> Self:
        """Return the law with one factor of 1, and all further factors as small as possible."""
        own = values.copy()
        for place, field in enumerate(self.fields):
            if field.is_factor:
                own[place] = 1.0 if place == i else max(field.lower, 0.0)
        return self.with_values(own)


def _least_squares(basis: ComplexArray, target: ComplexArray) -> FloatArray:
    """Return real factors of complex columns."""
    both = np.concatenate([basis.real, basis.imag]), np.concatenate([target.real, target.imag])
    size = np.maximum(np.linalg.norm(both[0], axis=0), TINY)
    return np.asarray(np.linalg.lstsq(both[0] / size, both[1], rcond=None)[0] / size)


def _within(value: float, field: LawField, size: float) -> float:
    """Return a value inside the bounds of its field, above zero by a share of a size if zero is a bound."""
    low = field.lower
    if np.isfinite(low):
        low += 1e-3 * size if field.kind == "stiffness" else _INSIDE * abs(low)
    return float(np.clip(value, low, field.upper - _INSIDE * abs(field.upper) if np.isfinite(field.upper) else np.inf))
