"""Laws of rubber and polymers: standard linear solid, fractional Zener, power law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray, as_positive
from jointfrf.laws.law import JointLaw, LawField

__all__ = ["FractionalZener", "PowerLaw", "StandardLinearSolid"]

#: Smallest exponent and time: below, K*(w) would not depend on all further parameters; frequencies are only positive.
_LEAST_ALPHA, _LEAST_TIME, _LEAST_HZ = 1e-3, 1e-12, TINY
#: Numbers of several laws.
_K = LawField("k", "stiffness", 0.0, meaning="Stiffness, at rest.")
#: The exponent of both fractional laws.
_ALPHA = LawField("alpha", "number", _LEAST_ALPHA, 1.0, meaning="Order of the derivative.")


@dataclass(frozen=True)
class StandardLinearSolid(JointLaw):
    """Spring parallel to a spring and a dashpot in series, K*(w) = k + k_m i w tau / (1 + i w tau).

    Parameters
    ----------
    k : float
        Stiffness at rest, N/m, N m/rad.
    k_m : float
        Additional stiffness at high frequencies, N/m, N m/rad.
    tau : float
        Relaxation time, s: losses are largest near w = 1/tau.

    Raises
    ------
    ValueError
        A value that is negative, NaN or Inf.

    See Also
    --------
    FractionalZener : the same with a fractional derivative.
    LawJoint : joint of laws.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.StandardLinearSolid(1e5, 2e5, tau=1e-3).stiffness(np.array([1000.0])).tolist()
    [(200000+100000j)]
    """

    k: float
    k_m: float
    tau: float

    word = "standard-linear-solid"
    parameters = (
        _K,
        LawField("k_m", "stiffness", 0.0, meaning="Additional stiffness at high frequencies."),
        LawField("tau", "time", _LEAST_TIME, meaning="Relaxation time."),
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
class FractionalZener(JointLaw):
    """Standard linear solid with a fractional derivative, K*(w) = k + k_m (i w tau)^alpha / (1 + (i w tau)^alpha).

    Parameters
    ----------
    k : float
        Stiffness at rest, N/m, N m/rad.
    k_m : float
        Additional stiffness at high frequencies, N/m, N m/rad.
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

    word = "fractional-zener"
    parameters = (*StandardLinearSolid.parameters, _ALPHA)

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
class PowerLaw(JointLaw):
    """Spring parallel to a spring-pot, K*(w) = k + k_a (i w / w_0)^alpha, w_0 = 2 pi reference_hz.

    Parameters
    ----------
    k : float
        Stiffness at rest, N/m, N m/rad; 0 for a spring-pot alone, whose loss factor is tan(pi alpha / 2) at all
        frequencies.
    k_a : float
        Modulus of the spring-pot at the reference frequency, N/m, N m/rad.
    alpha : float
        Exponent, 0 to 1: from a spring to a dashpot.
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

    word = "power"
    parameters = (
        _K,
        LawField("k_a", "stiffness", 0.0, meaning="Modulus of the spring-pot at the reference frequency."),
        _ALPHA,
    )
    settings = (LawField("reference_hz", "frequency", _LEAST_HZ, meaning="Reference frequency of the power law."),)

    def __post_init__(self) -> None:
        super().__post_init__()
        as_positive("reference_hz", self.reference_hz)

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
