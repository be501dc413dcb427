"""Resonances of the tip, and how far regenerated ones are from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.cases.bolted_lap.frfs import TIP_DIRECTIONS
from jointfrf.frf.bands import Band, has_peak, peak
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Resonance", "ResonanceErrors", "resonance_errors", "resonances"]

#: A regenerated resonance is sought within this share of the actual one.
_REACH = 0.15
#: Peaks count when they stand out from their surroundings by this factor.
_PROMINENCE = 1.5


@dataclass(frozen=True)
class Resonance:
    """A resonance of the actual FRF: direction, Hz, m/N, and the band in which it is sought again."""

    direction: str
    freq_hz: float
    amplitude: float
    band: Band


class ResonanceErrors(NamedTuple):
    """Errors of a regenerated FRF at every resonance.

    Attributes
    ----------
    amplitude, frequency : ndarray, shape (n_peaks,)
        (4.11) and (4.12), percent.
    found : ndarray of bool, shape (n_peaks,)
        Whether the regenerated FRF has a peak in the band. Where it has none, its largest value lies at an end of the
        band: the frequency error is the limit of the search, not a result, and the amplitude error is NaN.
    """

    amplitude: FloatArray
    frequency: FloatArray
    found: NDArray[np.bool_]


def resonances(freq_hz: FloatArray, tip: ComplexArray) -> list[Resonance]:
    """Resonances of the FRFs of the tip, shape (n_freq, 2); each band ends at the valleys on either side."""
    from scipy.signal import find_peaks  # takes as long to import as all else together

    found = []
    for d, direction in enumerate(TIP_DIRECTIONS):
        size = np.log(abs(tip[:, d]))
        tops = find_peaks(size, prominence=np.log(_PROMINENCE))[0]
        parts = np.split(np.arange(freq_hz.size), tops)
        valleys = [part[np.argmin(size[part])] for part in parts]
        for at, left, right in zip(tops, valleys, valleys[1:], strict=False):
            low = max(freq_hz[left], freq_hz[at] * (1 - _REACH))
            high = min(freq_hz[right], freq_hz[at] * (1 + _REACH))
            band = (float(low), float(high))
            amplitude, freq = peak(tip[:, d], freq_hz, band, refine=True)
            found.append(Resonance(direction, freq, amplitude, band))
    return found


def resonance_errors(freq_hz: FloatArray, peaks: list[Resonance], h: ComplexArray) -> ResonanceErrors:
    """Errors of the regenerated FRFs of the tip, shape (n_freq, 2), at every resonance; peaks between the lines."""
    errors = []
    for one in peaks:
        own = h[:, TIP_DIRECTIONS.index(one.direction)]
        amplitude, freq = peak(own, freq_hz, one.band, refine=True)
        found = has_peak(own, freq_hz, one.band)
        in_amplitude = abs(amplitude / one.amplitude - 1) * 100 if found else np.nan  # (4.11)
        errors.append((in_amplitude, abs(freq / one.freq_hz - 1) * 100, found))  # (4.12)
    amplitudes, frequencies, which = np.array(errors, np.float64).reshape(-1, 3).T
    return ResonanceErrors(amplitudes, frequencies, which.astype(bool))
