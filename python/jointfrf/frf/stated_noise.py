"""Noise stated by a user: a part relative to the FRFs, and floors that do not depend on them."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.kernel.arguments import FloatArray, as_frequency, as_lines, as_not_negative

__all__ = ["StatedNoise"]


@dataclass(frozen=True)
class StatedNoise:
    """Noise of measured FRFs, of known size.

    E|e|^2 of a receptance h is relative^2 |h|^2 + receptance^2 + (mobility/w)^2 + (accelerance/w^2)^2. The noise of
    accelerometers is a floor of the accelerance.

    Attributes
    ----------
    relative : float
        Standard deviation relative to the FRF, 0.01 for 1 %, default 0.
    receptance, mobility, accelerance : float
        Floors: standard deviations that do not depend on the FRF, in m/N, m/(s N) and m/(s^2 N), default 0. For an FRF
        of a rotation or a moment the numbers are the same in its units.

    Raises
    ------
    ValueError
        A number is negative, or all are 0.

    Examples
    --------
    2 % of the FRF, and an accelerometer with a floor of 0.01 m/(s^2 N):

    >>> import numpy as np, jointfrf as jf
    >>> noise = jf.StatedNoise(0.02, accelerance=0.01)
    >>> variance = noise.variance([100.0], np.full((1, 1, 1), 1e-6))
    >>> bool(np.isclose(variance[0, 0, 0], (0.02 * 1e-6) ** 2 + (0.01 / (2 * np.pi * 100) ** 2) ** 2))
    True
    """

    relative: float = 0.0
    receptance: float = 0.0
    mobility: float = 0.0
    accelerance: float = 0.0

    def __post_init__(self) -> None:
        for one in fields(self):
            object.__setattr__(self, one.name, as_not_negative(one.name, getattr(self, one.name)))
        if not self.relative and not self.has_floor:
            raise ValueError("relative part and floors of the noise are all zero; give one of them")

    @property
    def has_floor(self) -> bool:
        """Whether a part does not depend on the FRF."""
        return bool(self.receptance or self.mobility or self.accelerance)

    def variance(self, freq_hz: ArrayLike, h: ArrayLike) -> FloatArray:
        """Return E|e|^2 of receptances, (m/N)^2.

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Frequencies, Hz; above 0 if the noise has a floor of mobility or accelerance.
        h : array_like, shape (n_freq, n_out, n_in)
            Receptances, m/N.

        Returns
        -------
        ndarray, shape of h
            Variance, (m/N)^2.
        """
        lines = as_lines("h", h)
        of_floors = self.floor_variance(as_frequency(freq_hz, len(lines)))
        found: FloatArray = (self.relative * abs(lines)) ** 2 + of_floors[:, None, None]
        return found

    def floor_variance(self, freq_hz: FloatArray) -> FloatArray:
        """Return the variance by the floors, (m/N)^2, shape (n_freq,)."""
        if (self.mobility or self.accelerance) and freq_hz.size and freq_hz.min() <= 0:
            raise ValueError(
                f"a floor of mobility or accelerance has no size at {freq_hz.min():g} Hz; leave out lines at 0 Hz"
            )
        found = np.zeros(freq_hz.shape)
        for quantity, power in POWER_OF_I_OMEGA.items():
            floor = getattr(self, quantity)
            if floor:
                found += (floor / (2 * np.pi * freq_hz) ** power) ** 2
        return found

    def of_mean(self, averages: float) -> StatedNoise:
        """Return the noise of the mean of this number of measurements."""
        return StatedNoise(**{one.name: getattr(self, one.name) / averages**0.5 for one in fields(self)})
