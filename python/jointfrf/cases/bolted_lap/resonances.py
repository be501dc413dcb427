"""Resonances of the tip, and how far regenerated ones are from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from jointfrf.cases.bolted_lap.frfs import TIP_DIRECTIONS
from jointfrf.frf.bands import Band
from jointfrf.frf.metrics import amplitude_error, frequency_error
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Resonance", "resonance_errors", "resonances"]

#: A regenerated resonance is sought within this share of the actual one.
_REACH = 0.15
#: Peaks count when they stand out from their surroundings by this factor.
_PROMINENCE = 1.5


@dataclass(frozen=True)
class Resonance:
    """A resonance of the actual FRF: direction, frequency in Hz, and the band in which it is sought again."""

    direction: str
    freq_hz: float
    band: Band


def resonances(freq_hz: FloatArray, tip: ComplexArray) -> list[Resonance]:
    """Resonances of the FRFs of the tip, shape (n_freq, 2); each band ends at the valleys on either side."""
    found = []
    for d, direction in enumerate(TIP_DIRECTIONS):
        size = np.log(abs(tip[:, d]))
        tops = find_peaks(size, prominence=np.log(_PROMINENCE))[0]
        parts = np.split(np.arange(freq_hz.size), tops)
        valleys = [part[np.argmin(size[part])] for part in parts]
        for at, left, right in zip(tops, valleys, valleys[1:], strict=False):
            low = max(freq_hz[left], freq_hz[at] * (1 - _REACH))
            high = min(freq_hz[right], freq_hz[at] * (1 + _REACH))
            found.append(Resonance(direction, float(freq_hz[at]), (float(low), float(high))))
    return found


def resonance_errors(
    freq_hz: FloatArray, peaks: list[Resonance], actual: ComplexArray, h: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Errors (4.11) and (4.12) at every resonance, percent, shape (n_peaks,) each."""
    pairs = [(actual[:, d], h[:, d]) for p in peaks for d in [TIP_DIRECTIONS.index(p.direction)]]
    amplitude, frequency = (
        np.array([error(*pair, freq_hz, p.band, refine=True) for p, pair in zip(peaks, pairs, strict=True)])
        for error in (amplitude_error, frequency_error)
    )
    return amplitude, frequency
