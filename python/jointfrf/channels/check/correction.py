"""Corrections of FRFs that a check proposes, carried out where they are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.channels.check.finding import FindingKind
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Correction", "corrected"]


@dataclass(frozen=True)
class Correction:
    """One correction: rows or columns divided by factor (i w)^power exp(-i w delay), exchanged, or all conjugated.

    Attributes
    ----------
    kind : str
        Of the finding that it belongs to.
    text : str
        What it does.
    axis : {1, 2}
        Responses or forces.
    places : tuple of int
        Which of them.
    factor, power, delay : float
    exchange, conjugate : bool
        Whether the two places are exchanged, or all FRFs conjugated, instead.
    """

    kind: FindingKind
    text: str
    axis: int = 1
    places: tuple[int, ...] = ()
    factor: float = 1.0
    power: int = 0
    delay: float = 0.0
    exchange: bool = False
    conjugate: bool = False

    def apply(self, omega: FloatArray, h: ComplexArray) -> ComplexArray:
        """Return corrected FRFs, shape (n_freq, n_responses, n_forces); a copy."""
        if self.conjugate:
            return np.ascontiguousarray(h.conj())
        result: ComplexArray = h.copy()
        across = result if self.axis == 1 else result.swapaxes(1, 2)
        places = list(self.places)
        if self.exchange:
            across[:, places] = across[:, places[::-1]]
            return result
        with np.errstate(divide="ignore", invalid="ignore"):
            divisor = self.factor * (1j * omega) ** self.power * np.exp(-1j * omega * self.delay)
            across[:, places] /= divisor[:, None, None]
        return result


def corrected(omega: FloatArray, h: ComplexArray, corrections: list[Correction]) -> ComplexArray:
    """Return the FRFs with all corrections, one after the other."""
    for correction in corrections:
        h = correction.apply(omega, h)
    return h
