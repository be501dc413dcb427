"""Quantity and sign of each channel, from driving points and reciprocity together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.driving_points import Sectors

__all__ = ["Quantities", "quantities"]

#: Mean exponents of w in |h| of driving points: below the first it is a receptance, above the second an accelerance.
_RECEPTANCE, _ACCELERANCE = -0.2, 0.6
#: A band that spans less than this factor in frequency does not show the exponent.
_LEAST_SPAN = 3.0


@dataclass(frozen=True, eq=False)
class Quantities:
    """What each DOF shows.

    Attributes
    ----------
    power : ndarray of int, shape (n,)
        0 receptance, 1 mobility, 2 accelerance.
    sign : ndarray of int, shape (n,)
        -1 where the response points against the force.
    contradiction : ndarray of bool, shape (n,)
        The driving point has another sign or quantity than the reciprocity of its channel.
    exponent : float
        Mean exponent of w in |h|.
    certain : bool
        Whether accelerances can be told from receptances of the other sign by it.
    """

    power: NDArray[np.intp]
    sign: NDArray[np.intp]
    contradiction: NDArray[np.bool_]
    exponent: float
    certain: bool


def quantities(
    group: NDArray[np.intp],
    power: NDArray[np.intp],
    sign: NDArray[np.intp],
    driving: Sectors,
    exponent: float,
    span: float,
) -> Quantities:
    """Combine powers and signs relative within each group with the half planes of the driving points.

    Parameters
    ----------
    group, power, sign : ndarray of int, shape (n,)
        As in `ChannelRatios`.
    driving : Sectors
    exponent : float
        Mean exponent of w in the driving-point FRFs, less `power`.
    span : float
        Highest over lowest frequency.

    Notes
    -----
    A response that is (i w)^q times a displacement, with sign s, turns its driving point by i^q s. Im < 0 is thus a
    receptance or an accelerance of the wrong sign: |h| falls with frequency in one and rises in the other.
    """
    certain = span >= _LEAST_SPAN and not _RECEPTANCE < exponent < _ACCELERANCE
    expected = (2 if exponent > _ACCELERANCE else 0) if certain else None
    found_power, found_sign = power.copy(), sign.copy()
    contradiction = np.zeros(group.size, bool)
    for number in np.unique(group):
        some = group == number
        quarter = driving.quarter[some]
        if (quarter < 0).all():
            continue
        choices = []
        for shift in range(3 - int(power[some].max())):
            for turn in (1, -1):
                own = power[some] + shift
                signs = turn * sign[some]
                wrong = (quarter >= 0) & ((own + 2 * (signs < 0)) % 4 != quarter)
                unlikely = expected is not None and shift != 1 and shift != expected
                choices.append((int(wrong.sum()), unlikely, int((signs < 0).sum()), shift, turn, wrong))
        best = min(choices, key=lambda choice: choice[:5])
        found_power[some] = power[some] + best[3]
        found_sign[some] = best[4] * sign[some]
        contradiction[some] = best[5]
    return Quantities(found_power, found_sign, contradiction, exponent, certain)
