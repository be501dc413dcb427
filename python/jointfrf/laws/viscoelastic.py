"""Laws of rubber and polymers: standard linear solid, fractional Zener, power law."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_number
from jointfrf.laws.law import JointLaw, LawField, checked_values

__all__ = ["FractionalZener", "PowerLaw", "StandardLinearSolid"]

#: Smallest exponent and time: K*(w) would not depend on the others below.
_LEAST_ALPHA, _LEAST_TIME = 1e-3, 1e-12


class _Viscoelastic(JointLaw):
    """A law whose parameters are the first fields of its dataclass."""

    FIELDS: ClassVar[tuple[LawField, ...]]

    def __post_init__(self) -> None:
        for field in self.FIELDS:
            object.__setattr__(self, field.name, as_number(field.name, getattr(self, field.name)))
        checked_values(type(self).__name__, self.FIELDS, self.values)

    @property
    def fields(self) -> tuple[LawField, ...]:
        """The parameters: names, kinds and bounds."""
        return self.FIELDS

    @property
    def values(self) -> FloatArray:
        """Values of the parameters, shape (p,)."""
        return np.array(astuple(self)[: len(self.FIELDS)])  # type: ignore[call-overload]

    def with_values(self, values: ArrayLike) -> Self:
        """Return the same law with other values."""
        found = checked_values(type(self).__name__, self.FIELDS, values).tolist()
        return type(self)(*found, *astuple(self)[len(self.FIELDS) :])  # type: ignore[call-overload]


@dataclass(frozen=True)
class StandardLinearSolid(_Viscoelastic):
    """Spring beside a spring and a dashpot in series, K*(w) = k + k_m i w tau / (1 + i w tau).

    Parameters
    ----------
    k : float
        Stiffness at rest, N/m, N m/rad.
    k_m : float
        What is added at high frequencies, N/m, N m/rad.
    tau : float
        Relaxation time, s: losses are largest near w = 1/tau.

    Raises
    ------
    ValueError
        A value that is negative, NaN or Inf.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.StandardLinearSolid(1e5, 2e5, tau=1e-3).stiffness(np.array([1000.0])).tolist()
    [(200000+100000j)]
    """

    k: float
    k_m: float
    tau: float

    FIELDS: ClassVar[tuple[LawField, ...]] = (
        LawField("k", "stiffness", 0.0),
        LawField("k_m", "stiffness", 0.0),
        LawField("tau", "time", _LEAST_TIME),
    )

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return K*(w), shape (n_freq,)."""
        turn = 1j * omega * self.tau
        return np.asarray(self.k + self.k_m * turn / (1 + turn), np.complex128)

    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return the derivatives by k, k_m, tau, shape (3, n_freq)."""
        turn = 1j * omega * self.tau
        return np.array([np.ones_like(turn), turn / (1 + turn), self.k_m * 1j * omega / (1 + turn) ** 2])


@dataclass(frozen=True)
class FractionalZener(_Viscoelastic):
    """Standard linear solid with a fractional derivative, K*(w) = k + k_m (i w tau)^alpha / (1 + (i w tau)^alpha).

    Parameters
    ----------
    k : float
        Stiffness at rest, N/m, N m/rad.
    k_m : float
        What is added at high frequencies, N/m, N m/rad.
    tau : float
        Relaxation time, s.
    alpha : float
        Order of the derivative, above 0, at most 1 (the standard linear solid): the smaller, the wider the band of
        losses.

    Raises
    ------
    ValueError
        A value outside its bounds, NaN or Inf.

    References
    ----------
    .. [1] R. L. Bagley, P. J. Torvik, On the fractional calculus model of viscoelastic behavior, J. Rheology 30 (1986)
       133-155.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.FractionalZener(1e5, 2e5, tau=1e-3, alpha=1.0).stiffness(np.array([1000.0])).round(6).tolist()
    [(200000+100000j)]
    """

    k: float
    k_m: float
    tau: float
    alpha: float

    FIELDS: ClassVar[tuple[LawField, ...]] = (
        *StandardLinearSolid.FIELDS,
        LawField("alpha", "number", _LEAST_ALPHA, 1.0),
    )

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return K*(w), shape (n_freq,)."""
        turn = (1j * omega * self.tau) ** self.alpha
        return np.asarray(self.k + self.k_m * turn / (1 + turn), np.complex128)

    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return the derivatives by k, k_m, tau, alpha, shape (4, n_freq)."""
        base = 1j * omega * self.tau
        turn = base**self.alpha
        by_turn = self.k_m / (1 + turn) ** 2
        # turn log(base) -> 0 at rest
        log = np.log(np.where(base == 0, 1, base))
        return np.array(
            [np.ones_like(turn), turn / (1 + turn), by_turn * self.alpha * turn / self.tau, by_turn * turn * log]
        )


@dataclass(frozen=True)
class PowerLaw(_Viscoelastic):
    """Spring beside a spring-pot, K*(w) = k + k_a (i w / w_0)^alpha, w_0 = 2 pi reference_hz.

    Parameters
    ----------
    k : float
        Stiffness at rest, N/m, N m/rad; 0 for a spring-pot alone, whose loss factor is tan(pi alpha / 2) at all
        frequencies.
    k_a : float
        Modulus of the spring-pot at the reference frequency, N/m, N m/rad.
    alpha : float
        0 to 1: from a spring to a dashpot.
    reference_hz : float
        Reference frequency, Hz; no parameter of a fit.

    Raises
    ------
    ValueError
        A value outside its bounds, NaN or Inf; a reference frequency that is not positive.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> law = jf.PowerLaw(0.0, 1e5, alpha=0.5, reference_hz=100.0)
    >>> law.stiffness(2 * np.pi * np.array([400.0])).round(3).tolist()
    [(141421.356+141421.356j)]
    """

    k: float
    k_a: float
    alpha: float
    reference_hz: float = 100.0

    FIELDS: ClassVar[tuple[LawField, ...]] = (
        LawField("k", "stiffness", 0.0),
        LawField("k_a", "stiffness", 0.0),
        LawField("alpha", "number", _LEAST_ALPHA, 1.0),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "reference_hz", as_number("reference_hz", self.reference_hz))
        if self.reference_hz <= 0:
            raise ValueError(f"reference_hz must be positive, not {self.reference_hz:g}")

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return K*(w), shape (n_freq,)."""
        return np.asarray(
            self.k + self.k_a * (1j * omega / (2 * np.pi * self.reference_hz)) ** self.alpha, np.complex128
        )

    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return the derivatives by k, k_a, alpha, shape (3, n_freq)."""
        base = 1j * omega / (2 * np.pi * self.reference_hz)
        power = base**self.alpha
        log = np.log(np.where(base == 0, 1, base))
        return np.array([np.ones_like(power), power, self.k_a * power * log])
