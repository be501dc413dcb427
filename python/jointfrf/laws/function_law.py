"""A user-defined law: a function with its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_limits, check_choice, check_type
from jointfrf.laws.law import JointLaw, LawField

__all__ = ["FunctionLaw"]

#: Kinds of its parameters.
_KINDS = ("stiffness", "damping", "time", "number")
#: Relative step of the differences that check derivatives, and their tolerance.
_STEP, _APART = 1e-5, 1e-4
#: Angular frequencies of this check, rad/s.
_PLACES = 2 * np.pi * np.array([3.0, 30.0, 300.0])


@dataclass(frozen=True, init=False)
class FunctionLaw(JointLaw):
    """K*(w) as a user-defined function.

    Parameters
    ----------
    function : callable
        Function ``function(omega, values)`` that returns K*(w), shape (n_freq,), N/m (N, N m/rad); omega in rad/s.
    derivatives : callable
        Function ``derivatives(omega, values)`` that returns the derivatives by each value, shape (p, n_freq).
    fields : sequence of (name, kind) or (name, kind, lower, upper), or of LawField
        Parameters; kind is "stiffness", "damping", "time" or "number". Stiffnesses and dampings must be factors: K*(w)
        is proportional to each if all further ones are zero.
    values : array_like, shape (p,)
        Values of the parameters; times and numbers are initial values of a fit.

    Raises
    ------
    ValueError
        Values outside the bounds; a wrong shape; derivatives that differ from differences of the function at 3, 30 and
        300 Hz.

    See Also
    --------
    LawJoint : joint of laws.
    SpringLaw : springs and dampers.

    Examples
    --------
    A spring with a cubic rise:

    >>> import numpy as np, jointfrf as jf
    >>> law = jf.FunctionLaw(
    ...     lambda w, v: v[0] * (1 + (w * v[1]) ** 3) + 0j,
    ...     lambda w, v: np.array([1 + (w * v[1]) ** 3, 3 * v[0] * w**3 * v[1] ** 2]) + 0j,
    ...     [("k", "stiffness", 0, np.inf), ("tau", "time", 0, 1)], [1e5, 1e-4])
    >>> law.stiffness(np.array([1e4])).tolist()
    [(200000+0j)]
    """

    function: Callable[[FloatArray, FloatArray], ComplexArray]
    derivatives: Callable[[FloatArray, FloatArray], ComplexArray]
    _fields: tuple[LawField, ...]
    _values: tuple[float, ...]

    def __init__(
        self,
        function: Callable[[FloatArray, FloatArray], ComplexArray],
        derivatives: Callable[[FloatArray, FloatArray], ComplexArray],
        fields: object,
        values: ArrayLike,
    ) -> None:
        if not isinstance(fields, Iterable):
            raise TypeError(f"fields must be a sequence of LawField, not {type(fields).__name__}")
        for name, each in (("function", function), ("derivatives", derivatives)):
            if not callable(each):
                raise TypeError(f"{name} must be a function of omega and values, not {type(each).__name__}")
        try:
            named = tuple(LawField(*field) for field in fields)
        except TypeError as error:
            raise TypeError(
                "fields must contain name, kind and bounds of each parameter, as LawField has them"
            ) from error
        for field in named:
            check_type("name of a parameter", field.name, str)
            check_choice("kind of a parameter", field.kind, _KINDS)
            as_limits(field.name, field.lower, field.upper)
        object.__setattr__(self, "function", function)
        object.__setattr__(self, "derivatives", derivatives)
        object.__setattr__(self, "_fields", named)
        found = self.checked(values)
        object.__setattr__(self, "_values", tuple(found.tolist()))
        self._check_derivatives(found)

    def _check_derivatives(self, values: FloatArray) -> None:
        k, slopes = self.stiffness(_PLACES), self.slopes(_PLACES)
        size = abs(k).max()
        for i, field in enumerate(self._fields):
            step = _STEP * max(abs(values[i]), _STEP)
            moved = values.copy()
            moved[i] += step
            ahead = np.asarray(self.function(_PLACES, moved))
            moved[i] -= 2 * step
            slope = (ahead - np.asarray(self.function(_PLACES, moved))) / (2 * step)
            scale = np.maximum(abs(slope).max(), abs(slopes[i]).max()) + 1e-6 * size / max(abs(values[i]), _STEP)
            if not abs(slope - slopes[i]).max() <= _APART * scale:
                raise ValueError(f"derivatives: that by {field.name} is not the derivative of the function")

    @property
    def fields(self) -> tuple[LawField, ...]:
        """Parameters: names, kinds and bounds."""
        return self._fields

    @property
    def values(self) -> FloatArray:
        """Values of the parameters, shape (p,)."""
        return np.array(self._values)

    def with_values(self, values: ArrayLike) -> Self:
        """Return the same law with other values."""
        found = self.checked(values)
        other = copy(self)
        object.__setattr__(other, "_values", tuple(found.tolist()))
        return other

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return K*(w), shape (n_freq,)."""
        found = np.asarray(self.function(omega, self.values), np.complex128)
        if found.shape != omega.shape:
            raise ValueError(f"function must return shape {omega.shape}, not {found.shape}")
        return found

    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return the derivatives by each value, shape (p, n_freq)."""
        found = np.asarray(self.derivatives(omega, self.values), np.complex128)
        wanted = (len(self._fields), *omega.shape)
        if found.shape != wanted:
            raise ValueError(f"derivatives must return shape {wanted}, not {found.shape}")
        return found
